//! Textures at random places; pictures larger than the caches next to a core.

use crate::support::objects::build;
use crate::{INPUTS, group, uniform_pairs};
use criterion::{Criterion, Throughput};
use lucerna::core::image::{self, Image};
use lucerna::core::interfaces::SurfaceHit;
use lucerna::core::sampling::Pcg32;
use lucerna::core::scene::Object;
use std::hint::black_box;
use std::path::Path;

/// Edge of the pictures.
const SIZE: u32 = 1024;

pub fn all(criterion: &mut Criterion) {
    let mut group = group(criterion, "textures");
    group.throughput(Throughput::Elements(INPUTS as u64));
    let hits: Vec<SurfaceHit> =
        uniform_pairs().into_iter().map(|uv| SurfaceHit { uv, ..SurfaceHit::default() }).collect();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let bitmap = |name: &str| {
        let path = folder.join(name);
        image::write(&path, &noise()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        format!("<texture type='bitmap'><string name='filename' value='{}'/></texture>", path.display())
    };
    for (name, xml) in [
        ("bitmap/8 bit", bitmap("noise.png")),
        ("bitmap/float", bitmap("noise.pfm")),
        ("checkerboard", "<texture type='checkerboard'/>".to_owned()),
    ] {
        let Object::Texture(texture) = build(&xml) else { unreachable!("a texture") };
        group.bench_function(name, |b| {
            b.iter(|| {
                for hit in &hits {
                    black_box(texture.color(hit));
                }
            });
        });
    }
}

fn noise() -> Image {
    let mut pcg = Pcg32::new(1, 1);
    let mut image = Image::new(SIZE, SIZE, &["R", "G", "B"]);
    image.data.fill_with(|| pcg.next_f32());
    image
}
