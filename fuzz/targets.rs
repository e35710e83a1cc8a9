//! What is fuzzed: one function for each kind of file, which takes the bytes of a file the way the renderer does.
//!
//! A function returns whether the file was accepted. It may not panic, take more than a second, or more than 256 MiB
//! beyond the size of the file. The fuzzer's targets (`fuzz_targets`) and the tests (`tests/fuzz_corpus.rs`) share this
//! file.
#![allow(dead_code)] // Each fuzz target uses one.

use lucerna::core::image::{self, ReadLimits, exr as exr_files};
use lucerna::core::interfaces::{Arena, Guide, GuidedVertex, SurfaceHit};
use lucerna::core::io;
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::render::Learnt;
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{Object, Registry, build_one, instantiate, resolve, upgrade};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A reader of one kind of file: whether it accepts these bytes.
pub type Target = fn(&[u8]) -> bool;

/// All targets by name.
pub const ALL: &[(&str, Target)] = &[
    ("exr", exr),
    ("guide", guide),
    ("obj", obj),
    ("pfm", pfm),
    ("picture", picture),
    ("ply", ply),
    ("serialized", serialized),
    ("tga", tga),
    ("vol", vol),
    ("xml", xml),
];

/// Lets panics unwind, which a fuzzer's own hook turns into aborts: readers shield themselves from the panics of
/// libraries. One that leaves a target still ends the process.
pub fn let_readers_catch_panics() {
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
}

/// A scene, all the way to objects that could be rendered. Files that it names are out of reach.
pub fn xml(bytes: &[u8]) -> bool {
    static REGISTRY: OnceLock<Registry> = OnceLock::new();
    static NOWHERE: OnceLock<PathBuf> = OnceLock::new();
    let registry = REGISTRY.get_or_init(lucerna::builtin);
    let nowhere = NOWHERE.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("lucerna-nowhere-{}", std::process::id()));
        let _ = std::fs::create_dir_all(&folder);
        folder
    });
    // A byte decides, so that both are reached from the same corpus.
    let lenient = bytes.len() % 2 == 1;
    let options = LoadOptions { lenient, root: Some(nowhere.clone()), ..LoadOptions::default() };
    let Ok(mut description) = load_str(&String::from_utf8_lossy(bytes), "scene.xml", &options) else { return false };
    if resolve::resolve(&mut description).is_err() {
        return false;
    }
    upgrade::upgrade(&mut description);
    instantiate(registry, description, lenient).is_ok()
}

/// What a guide has learnt. The checksum is made right, or nothing would come past it.
pub fn guide(bytes: &[u8]) -> bool {
    static GUIDE: OnceLock<Option<Arc<dyn Guide>>> = OnceLock::new();
    let guide = GUIDE.get_or_init(|| {
        let text = "<guide version='3.0.0' type='sd_tree'/>";
        let description = load_str(text, "guide.xml", &LoadOptions::default()).ok()?;
        match build_one(&lucerna::builtin(), &description) {
            Ok(Object::Guide(guide)) => Some(guide),
            _ => None,
        }
    });
    let (Some(guide), Ok(learnt)) = (guide, Learnt::of_content(bytes)) else { return false };
    let Ok(learner) = learnt.recall(&**guide, learnt.bounds) else { return false };
    let (arena, hit) = (Arena::new(), SurfaceHit { wi: Vec3::Z, ..SurfaceHit::default() });
    let field = learner.field();
    if let Some(directions) = field.at(field.cell(hit.p), &hit, GuidedVertex::default(), &arena) {
        let (d, pdf) = directions.sample(Vec2::splat(0.5));
        assert!(d.is_finite() && pdf >= 0.0);
    }
    !learner.facts().is_empty()
}

/// A mesh in the PLY format.
pub fn ply(bytes: &[u8]) -> bool {
    io::ply::read(bytes).is_ok()
}

/// A mesh in the Wavefront format.
pub fn obj(bytes: &[u8]) -> bool {
    io::obj::read(bytes).is_ok()
}

/// Meshes in the format of Mitsuba 0.x.
pub fn serialized(bytes: &[u8]) -> bool {
    io::serialized::read(bytes, 0).is_ok() | io::serialized::read(bytes, 1).is_ok()
}

/// A voxel grid.
pub fn vol(bytes: &[u8]) -> bool {
    io::vol::read(bytes).is_ok()
}

/// A picture of any format that is recognised by its first bytes.
pub fn picture(bytes: &[u8]) -> bool {
    decoded(image::read_from_bytes(bytes, None, &ReadLimits::default()))
}

/// A TGA picture, which only its name tells.
pub fn tga(bytes: &[u8]) -> bool {
    decoded(image::read_from_bytes(bytes, Some("tga"), &ReadLimits::default()))
}

/// A portable float map; the start of the file is given, so that no other format is tried.
pub fn pfm(bytes: &[u8]) -> bool {
    bytes.starts_with(b"P") && picture(bytes)
}

/// An EXR file: its colour, as a texture, and all of its channels.
pub fn exr(bytes: &[u8]) -> bool {
    let all = exr_files::read_from_bytes(bytes, &ReadLimits::default());
    if let Ok(file) = &all {
        let image = &file.image;
        assert_eq!(image.data.len(), image.width as usize * image.height as usize * image.channels.len());
    }
    let signed = bytes.starts_with(&[0x76, 0x2F, 0x31, 0x01]);
    (signed && picture(bytes)) | all.is_ok()
}

/// What was decoded is as large as it says.
fn decoded(picture: io::Result<image::PixelData>) -> bool {
    let Ok(picture) = picture else { return false };
    let pixels = picture.width as usize * picture.height as usize;
    assert_eq!(picture.samples.len(), pixels * picture.channels as usize);
    assert!(picture.alpha.is_none_or(|alpha| alpha.len() == pixels));
    true
}
