//! Writes the seeds, `seeds/<target>/*`: small valid files, each of another shape, that fuzzing starts from. All are
//! made here from nothing; the output is committed, so that tests need no generator.
//!
//!     cargo run --manifest-path fuzz/Cargo.toml --example seeds

use exr::prelude::*;
use flate2::write::ZlibEncoder;
use half::f16;
use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};
use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Write as _};
use std::path::Path;

fn save(target: &str, name: &str, bytes: impl AsRef<[u8]>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target);
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join(name), bytes).expect("a file");
}

fn main() {
    pictures();
    exr_files();
    for (name, head) in [("grey.pfm", "Pf\n3 2\n-1.0\n"), ("color.pfm", "PF\n2 1\n1\n")] {
        save(
            "pfm",
            name,
            [head.as_bytes(), &[1.5f32, 0.0, -2.0, 3e38, 1e-45, 7.0].map(f32::to_le_bytes).concat()].concat(),
        );
    }
    ply();
    obj();
    serialized();
    guides();
    for (name, size) in [("one.vol", [1i32, 1, 1, 1]), ("grid.vol", [2, 3, 1, 3])] {
        let head = [b"VOL\x03".to_vec(), 1i32.to_le_bytes().to_vec(), size.map(i32::to_le_bytes).concat()].concat();
        let count = size.iter().product::<i32>() as usize;
        save(
            "vol",
            name,
            [
                head,
                [0.0f32, 0.0, 0.0, 1.0, 2.0, 3.0].map(f32::to_le_bytes).concat(),
                0.5f32.to_le_bytes().repeat(count),
            ]
            .concat(),
        );
    }
    dictionary();
}

fn pictures() {
    let rgb: DynamicImage = ImageBuffer::from_fn(5, 3, |x, y| Rgb([x as u8 * 50, y as u8 * 80, 128])).into();
    let encoded = |picture: &DynamicImage, format| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("an encoder");
        bytes.into_inner()
    };
    let grey: DynamicImage = GrayImage::from_fn(4, 4, |x, y| Luma([(x * y) as u8 * 20])).into();
    let grey_alpha: DynamicImage = ImageBuffer::from_pixel(2, 2, LumaA([300u16, 400])).into();
    let rgba: DynamicImage =
        ImageBuffer::from_fn(3, 3, |x, y| Rgba([x as u16 * 9000, y as u16 * 9000, 7, 65535])).into();
    let rgba8: DynamicImage = rgba.to_rgba8().into();
    for (name, picture) in [("grey", &grey), ("grey_alpha", &grey_alpha), ("rgb", &rgb), ("rgba", &rgba)] {
        save("picture", &format!("{name}.png"), encoded(picture, ImageFormat::Png));
    }
    for (name, picture) in [("grey", &grey), ("rgb", &rgb)] {
        save("picture", &format!("{name}.jpg"), encoded(picture, ImageFormat::Jpeg));
        save("picture", &format!("{name}.bmp"), encoded(picture, ImageFormat::Bmp));
        save("picture", &format!("{name}.pnm"), encoded(picture, ImageFormat::Pnm));
        save("tga", &format!("{name}.tga"), encoded(picture, ImageFormat::Tga));
    }
    save("tga", "rgba.tga", encoded(&rgba8, ImageFormat::Tga));
    save("picture", "rgba.bmp", encoded(&rgba8, ImageFormat::Bmp));
    save("picture", "float.hdr", encoded(&rgb.to_rgb32f().into(), ImageFormat::Hdr));
    save("picture", "bits.pbm", "P1\n3 2\n0 1 0 1 1 0\n");
    save("picture", "text.ppm", "P3\n# two pixels\n2 1 255\n1 2 3 4 5 6\n");
    save("picture", "packed.pbm", b"P4\n9 1\n\xAA\x80");
    save("picture", "deep.pgm", b"P5\n2 1\n65535\n\x01\x02\x03\x04");
    save("picture", "any.pam", b"P7\nWIDTH 1\nHEIGHT 2\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n12345678");
}

fn exr_files() {
    let write = |name: &str, compression, blocks, half: bool, names: &[&str]| {
        let (width, height) = (6, 5);
        let values = |c: usize| (0..width * height).map(move |i| (i * (c + 1)) as f32 * 0.125);
        let channel = |(c, name): (usize, &&str)| {
            let samples = match half {
                true => FlatSamples::F16(values(c).map(f16::from_f32).collect()),
                false => FlatSamples::F32(values(c).collect()),
            };
            AnyChannel::new(*name, samples)
        };
        let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let layer = Layer::new((width, height), LayerAttributes::default(), encoding, channels);
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).expect("an encoder");
        save("exr", name, bytes.into_inner());
    };
    let tiles = Blocks::Tiles(Vec2(4, 4));
    let rgb: &[&str] = &["R", "G", "B"];
    write("plain.exr", Compression::Uncompressed, Blocks::ScanLines, false, &["Y"]);
    write("rle.exr", Compression::RLE, Blocks::ScanLines, true, rgb);
    write("zip1.exr", Compression::ZIP1, Blocks::ScanLines, false, rgb);
    write("zip16.exr", Compression::ZIP16, tiles, true, &["R", "G", "B", "A"]);
    write("piz.exr", Compression::PIZ, Blocks::ScanLines, true, rgb);
    write("pxr24.exr", Compression::PXR24, tiles, false, &["X", "Y", "Z"]);
    write("b44.exr", Compression::B44, Blocks::ScanLines, true, rgb);
    write("b44a.exr", Compression::B44A, Blocks::ScanLines, true, &["left.R", "left.G", "left.B"]);
}

fn ply() {
    let rows = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    save(
        "ply",
        "text.ply",
        format!(
            "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n4 0 1 2 3\n"
        ),
    );
    for big in [false, true] {
        let name = if big { "big" } else { "little" };
        let float = |v: f32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let mut bytes = format!("ply\r\nformat binary_{name}_endian 1.0\r\nelement vertex 3\n");
        for property in ["x", "y", "z", "nx", "ny", "nz", "u", "v", "r", "g", "b"] {
            let _ = writeln!(bytes, "property float {property}");
        }
        bytes += "property double weight\nelement extra 1\nproperty list ushort short data\nelement face 1\n\
                  property list uint8 uint32 vertex_index\nproperty uchar flag\nend_header\n";
        let mut bytes = bytes.into_bytes();
        for corner in [[0.0, 0.0, 0.0f32], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
            corner.iter().chain(&[0.0, 0.0, 1.0, 0.5, 0.5, 0.1, 0.2, 0.3]).for_each(|v| bytes.extend(float(*v)));
            bytes.extend([0; 8]);
        }
        bytes.extend(if big { [0, 2, 0, 7, 0, 8] } else { [2, 0, 7, 0, 8, 0] });
        bytes.push(3);
        for index in [0u32, 1, 2] {
            bytes.extend(if big { index.to_be_bytes() } else { index.to_le_bytes() });
        }
        bytes.push(1);
        save("ply", &format!("{name}.ply"), bytes);
    }
}

fn obj() {
    save(
        "obj",
        "full.obj",
        "# by hand\nmtllib x.mtl\no thing\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 -1.5e0\n\
        vt 0.25 0.5\nvt 0 1 0\nvn 0 0 2\nvn 0 1 0\ng a\nusemtl m\ns off\nf 1/1/1 2/2/1 3/2/1\nf 1/1/1 3/2/1 4/1/2\n",
    );
    save("obj", "plain.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nl 1 2\n");
    save("obj", "relative.obj", "v 0 0 0\r\nv 1 0 0\r\nv \\\n1 1 0\r\nvn 0 0 1\r\nf -3//-1 -2//-1 -1//-1\r\n");
}

fn serialized() {
    for (name, version, flags) in [("four.serialized", 4u16, 0x1001 | 2 | 8), ("three.serialized", 3, 0x2000 | 0x10)] {
        let double = flags & 0x2000 != 0;
        let floats = 9
            + if flags & 1 != 0 { 9 } else { 0 }
            + if flags & 2 != 0 { 6 } else { 0 }
            + if flags & 8 != 0 { 9 } else { 0 };
        let mut content = (flags as u32).to_le_bytes().to_vec();
        if version == 4 {
            content.extend(b"shape\0");
        }
        content.extend([3u64, 1].map(u64::to_le_bytes).concat());
        for i in 0..floats {
            let value = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0][i % 9];
            match double {
                true => content.extend(f64::to_le_bytes(value)),
                false => content.extend(f32::to_le_bytes(value as f32)),
            }
        }
        content.extend([0u32, 1, 2].map(u32::to_le_bytes).concat());
        let mut file = Vec::new();
        let mut starts = Vec::new();
        for _ in 0..2 {
            starts.push(file.len() as u64);
            file.extend(0x041Cu16.to_le_bytes());
            file.extend(version.to_le_bytes());
            // Stored, not compressed, so that the fuzzer sees through it.
            let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::none());
            encoder.write_all(&content).expect("memory");
            file.extend(encoder.finish().expect("memory"));
        }
        for start in starts {
            let bytes = start.to_le_bytes();
            file.extend(if version == 4 { &bytes[..] } else { &bytes[..4] });
        }
        file.extend(2u32.to_le_bytes());
        save("serialized", name, file);
    }
}

/// The words of the scene language, in the format of libFuzzer.
fn dictionary() {
    let registry = lucerna::builtin();
    let mut words: Vec<&str> = registry.all().flat_map(|p| p.all_params().map(|q| q.name).chain([p.name])).collect();
    words.extend([
        "<scene version=\\\"3.0.0\\\">",
        "</scene>",
        "<integrator ",
        "<sensor ",
        "<film ",
        "<sampler ",
        "<rfilter ",
        "<shape ",
        "<bsdf ",
        "<emitter ",
        "<texture ",
        "<spectrum ",
        "<rgb ",
        "<float ",
        "<integer ",
        "<boolean ",
        "<string ",
        "<point ",
        "<vector ",
        "<transform ",
        "<translate ",
        "<rotate ",
        "<scale ",
        "<lookat ",
        "<matrix ",
        "<ref id=\\\"",
        "<default ",
        "<include ",
        "<alias ",
        "name=\\\"",
        "value=\\\"",
        "type=\\\"",
        "id=\\\"",
        "to_world",
        "0.6.0",
        "2.0.0",
        "1e38",
        "nan",
        "/>",
        "<!--",
        "-->",
        "<medium ",
        "<phase ",
        "<volume ",
        "<path ",
    ]);
    words.sort_unstable();
    words.dedup();
    let lines: String = words.iter().map(|word| format!("\"{word}\"\n")).collect();
    fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("xml.dict"), lines).expect("a file");
}

/// What a guide has learnt: the content of files, without head and checksum. Of nothing, of one cell, of several, of cells with
/// two sets.
fn guides() {
    use lucerna::core::interfaces::{GuideRecord, RecordKind};
    use lucerna::core::math::{Aabb, Vec3};
    use lucerna::core::render::Learnt;
    use lucerna::core::scene::xml::{LoadOptions, load_str};
    use lucerna::core::scene::{Object, build_one};
    let settings = "<float name='spatial_threshold' value='40'/><integer name='directional_depth' value='4'/>";
    let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    for (name, records, sets) in [
        ("nothing.guide", 0, "one"),
        ("one.guide", 30, "one"),
        ("cells.guide", 200, "one"),
        ("direct.guide", 90, "direct_indirect"),
        ("product.guide", 90, "primary_product"),
    ] {
        let more = format!("<string name='sets' value='{sets}'/>");
        let text = format!("<guide version='3.0.0' type='sd_tree'>{settings}{more}</guide>");
        let description = load_str(&text, "guide.xml", &LoadOptions::default()).expect("a guide");
        let Ok(Object::Guide(guide)) = build_one(&lucerna::builtin(), &description) else { panic!("a guide") };
        let mut learner = guide.start(bounds);
        let record = |i: u32| {
            let u = |k: u32| (i.wrapping_mul(k) % 1009) as f32 / 1009.0;
            let d = Vec3::new(u(7) - 0.5, u(11) - 0.5, 0.6).normalize();
            let (radiance, kind) = (1.0 + u(5), RecordKind::Mixed);
            let p = Vec3::new(u(601), u(353), u(197));
            GuideRecord {
                p,
                d,
                radiance,
                direct: 0.5 * radiance,
                scattered: radiance,
                pdf: 0.5,
                pdf_bsdf: 0.3,
                pdf_guide: 0.7,
                pdf_sets: [0.9, 0.5],
                kind,
                primary: i % 2 == 0,
            }
        };
        for _ in 0..2 {
            learner.learn(&[(0..records).map(record).collect()]);
            learner.refine(1);
        }
        // Some of the next iteration, so that there are sums.
        learner.learn(&[(0..records / 20).map(record).collect()]);
        let learnt = Learnt { guide: "sd_tree".to_owned(), bounds, spp: 1, state: learner.save() };
        save("guide", name, &learnt.to_bytes()[12..learnt.to_bytes().len() - 4]);
    }
}
