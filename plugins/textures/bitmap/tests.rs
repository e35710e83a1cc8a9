use super::*;
use crate::emitters::testing::{self, assert_close, golden, matrix, text};
use half::f16;
use lucerna_core::image::{PixelData, Samples};
use lucerna_core::math::DMat4;
use lucerna_core::scene::ObjectKind;

fn floats(width: u32, height: u32, channels: u32, values: Vec<f32>) -> PixelData {
    PixelData { width, height, channels, samples: Samples::F32(values), alpha: None, srgb: false }
}

fn example(width: u32, height: u32, channels: u32) -> PixelData {
    floats(width, height, channels, testing::pattern(width, height, channels))
}

fn bytes() -> PixelData {
    let samples = Samples::U8(testing::pattern(4, 3, 3).iter().map(|v| (v * 100.0) as u8).collect());
    PixelData { width: 4, height: 3, channels: 3, samples, alpha: None, srgb: true }
}

fn texture(picture: PixelData, raw: bool, filter: Filter, wrap: Wrap, to_uv: DMat4) -> Bitmap {
    Bitmap::new(Texels::new(picture, raw, Format::Auto).unwrap(), filter, wrap, UvTransform::new(to_uv))
}

fn plain(picture: PixelData) -> Bitmap {
    texture(picture, true, Filter::Bilinear, Wrap::Repeat, DMat4::IDENTITY)
}

fn at(uv: Vec2) -> SurfaceHit {
    SurfaceHit { uv, ..SurfaceHit::default() }
}

/// The picture of the textured lights of reference/golden_lights.py.
pub(crate) fn slide(nearest: bool) -> Arc<dyn Texture> {
    let filter = if nearest { Filter::Nearest } else { Filter::Bilinear };
    Arc::new(texture(example(4, 3, 3), true, filter, Wrap::Repeat, DMat4::IDENTITY))
}

/// The pictures of reference/golden_lights.py.
fn cases() -> Vec<(&'static str, Bitmap)> {
    use Filter::{Bilinear, Nearest};
    use Wrap::{Clamp, Mirror, Repeat};
    let mut cases: Vec<_> = [
        ("repeat_bilinear", Bilinear, Repeat),
        ("repeat_nearest", Nearest, Repeat),
        ("mirror_bilinear", Bilinear, Mirror),
        ("mirror_nearest", Nearest, Mirror),
        ("clamp_bilinear", Bilinear, Clamp),
        ("clamp_nearest", Nearest, Clamp),
    ]
    .into_iter()
    .map(|(case, filter, wrap)| (case, texture(example(4, 3, 3), true, filter, wrap, DMat4::IDENTITY)))
    .collect();
    cases.extend([
        ("grey", plain(example(4, 3, 1))),
        ("bytes", texture(bytes(), false, Bilinear, Repeat, DMat4::IDENTITY)),
        ("bytes_raw", plain(bytes())),
    ]);
    cases
}

#[test]
fn looks_as_the_reference() {
    let to_uv = DMat4::from_cols_array_2d(&[
        [2.0, 0.3, 0.0, 0.0],
        [0.5, -1.5, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.1, 0.2, 0.0, 1.0],
    ]);
    let mut cases = cases();
    cases.push(("transformed", texture(example(4, 4, 3), true, Filter::Bilinear, Wrap::Repeat, to_uv)));
    cases.push(("large", plain(example(3001, 3, 3))));
    for (case, texture) in cases {
        for line in golden(include_str!("../golden.txt"), case) {
            let hit = at(Vec2::from_slice(&line));
            let (color, gradient) = (texture.color(&hit), texture.gradient(&hit));
            let [r, g, b] = color.to_array();
            assert_close(&[r, g, b, texture.scalar(&hit), gradient.x, gradient.y], &line[2..], case);
        }
    }
}

#[test]
fn positions_are_sampled_as_the_reference() {
    for (case, texture) in cases() {
        for line in golden(include_str!("../golden_positions.txt"), case) {
            let (uv, pdf) = texture.sample_position(Vec2::from_slice(&line)).unwrap();
            assert_close(&[uv.x, uv.y, pdf], &line[2..], case);
            assert_eq!(texture.pdf_position(uv), pdf);
        }
    }
}

#[test]
fn hc_e07_any_texture_coordinate_gives_a_finite_value() {
    let odd = [0.0, 1.0, -0.5, 1e7, -1e7, 8.4e6, f32::MAX, f32::INFINITY, f32::NAN];
    for (width, height) in [(1, 1), (65536, 1), (3, 5)] {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [Filter::Bilinear, Filter::Nearest] {
                let texture = texture(example(width, height, 1), true, filter, wrap, DMat4::IDENTITY);
                for hit in odd.iter().flat_map(|u| odd.map(|v| at(Vec2::new(*u, v)))) {
                    assert!((0.0..=2.5).contains(&texture.scalar(&hit)), "{wrap:?} {filter:?} {}", hit.uv);
                    assert!(texture.gradient(&hit).is_finite() && texture.pdf_position(hit.uv).is_finite());
                }
            }
        }
    }
}

#[test]
fn precision_follows_the_file() {
    let third = |samples| PixelData { width: 1, height: 1, channels: 1, samples, alpha: None, srgb: true };
    let value = |samples, raw, format| Texels::new(third(samples), raw, format).unwrap().scalar(0, 0);
    assert_eq!(value(Samples::U8(vec![128]), true, Format::Auto), 128.0 / 255.0);
    assert_close(&[value(Samples::U8(vec![128]), false, Format::Auto)], &[0.215_860_5], "byte");
    assert_eq!(value(Samples::U8(vec![128]), false, Format::Half), f16::from_f32(0.215_860_5).to_f32());
    assert_eq!(value(Samples::U16(vec![32768]), true, Format::Auto), 0.5);
    assert_eq!(value(Samples::U16(vec![32768]), true, Format::Single), 32768.0 / 65535.0);
    assert_eq!(value(Samples::F32(vec![1.0 / 3.0]), true, Format::Auto), 1.0 / 3.0);
}

#[test]
fn hc_s10_what_is_not_finite_is_told_with_its_pixel() {
    let mut values = testing::pattern(4, 3, 3);
    values[(4 + 2) * 3 + 1] = f32::NAN;
    let message = Texels::new(floats(4, 3, 3, values), false, Format::Auto).err().unwrap();
    assert!(message.contains("pixel (2, 1) is NaN"), "{message}");
}

#[test]
fn black_pictures_are_never_sampled() {
    let texture = plain(floats(2, 2, 1, vec![0.0; 4]));
    assert!(texture.sample_position(Vec2::splat(0.5)).is_none());
    assert_eq!((texture.pdf_position(Vec2::splat(0.5)), texture.mean()), (0.0, 0.0));
}

#[test]
fn is_read_from_a_file() {
    let folder = std::env::temp_dir().join(format!("lucerna-bitmap-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.pfm");
    let mut picture = image::Image::new(4, 3, &["R", "G", "B"]);
    picture.data = testing::pattern(4, 3, 3);
    image::write(&path, &picture).unwrap();
    let name = text("filename", path.to_str().unwrap());
    let shift = matrix("to_uv", DMat4::from_translation([1.0, 0.0, 0.0].into()));
    let built = testing::build(ObjectKind::Texture, "bitmap", vec![name, shift]);
    std::fs::write(&path, "no picture").unwrap();
    let broken = testing::build(ObjectKind::Texture, "bitmap", vec![text("filename", path.to_str().unwrap())]);
    std::fs::remove_dir_all(&folder).unwrap();
    let Ok(lucerna_core::scene::Object::Texture(texture)) = built else { panic!("the picture is fine") };
    let expected = plain(example(4, 3, 3)).color(&at(Vec2::new(0.3, 0.6)));
    assert_close(&texture.color(&at(Vec2::new(0.3, 0.6))).to_array(), &expected.to_array(), "file");
    assert_eq!(texture.maximum(), Some(2.5));
    assert!(broken.err().unwrap().to_string().contains("a.pfm"));
}
