//! Combinators at their ends, textured parameters, equal indices of refraction, and parameters that are errors. What
//! holds for every BSDF is in `tests/properties`.

use super::{build, direction, hit, try_build};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bxdf, Lobes, Transport};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;

fn with(lines: &str, wi: Vec3, check: impl FnOnce(&dyn Bxdf)) {
    let arena = Arena::new();
    check(build(lines).resolve(&hit(wi), &arena));
}

fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-9
}

#[test]
fn hc_s07_equal_indices_pass_light_unchanged() {
    let wi = direction(0.3);
    with("bsdf|dielectric;float|int_ior|1.4;float|ext_ior|1.4", wi, |bxdf| {
        for u1 in [0.0, 0.5, ONE_MINUS_EPSILON] {
            let s = bxdf.sample(wi, u1, Vec2::ZERO, Transport::Radiance).unwrap();
            assert!((s.wo + wi).length() < 1e-6 && s.weight == Rgb::WHITE && s.pdf == 1.0 && s.eta == 1.0);
        }
    });
}

#[test]
fn hc_s11_s12_s13_combinators_at_their_ends() {
    let mut pcg = Pcg32::new(5, 1);
    let same = |a: &str, b: &str, pcg: &mut Pcg32| {
        for cos_theta in [0.8, 0.05, -0.7] {
            let wi = direction(cos_theta);
            let arena = Arena::new();
            let (a, b) = (build(a), build(b));
            let (a, b) = (a.resolve(&hit(wi), &arena), b.resolve(&hit(wi), &arena));
            for _ in 0..100 {
                let (u1, u2) = (pcg.next_f32(), Vec2::new(pcg.next_f32(), pcg.next_f32()));
                let [x, y] = [a, b].map(|f| f.sample(wi, u1, u2, Transport::Radiance));
                assert_eq!(x.is_some(), y.is_some());
                if let (Some(x), Some(y)) = (x, y) {
                    assert!((x.wo - y.wo).length() < 1e-6 && close(x.pdf, y.pdf, 1e-5) && x.lobe == y.lobe);
                    assert!(close(x.weight.g, y.weight.g, 1e-5));
                }
            }
        }
    };
    let rough = "bsdf|roughplastic;float|alpha|0.2";
    same(&format!("bsdf|mask;float|opacity|1;{rough}"), rough, &mut pcg);
    same(&format!("bsdf|mask;float|opacity|0;{rough}"), "bsdf|null", &mut pcg);
    same(&format!("bsdf|normalmap;rgb|normalmap|0.5 0.5 1;{rough}"), rough, &mut pcg);
    same(&format!("bsdf|bumpmap;texture|fixed;end;{rough}"), rough, &mut pcg);
    same(&format!("bsdf|blendbsdf;float|weight|0;{rough};end;bsdf|diffuse"), rough, &mut pcg);
    same(&format!("bsdf|blendbsdf;float|weight|1;bsdf|diffuse;end;{rough}"), rough, &mut pcg);
    same(&format!("bsdf|twosided;bsdf|twosided;{rough}"), &format!("bsdf|twosided;{rough}"), &mut pcg);
}

/// Textures give what constants give, from the arena.
#[test]
fn textured_parameters() {
    let wi = direction(0.6);
    let arena = Arena::new();
    for (constant, textured) in [
        ("bsdf|diffuse;float|reflectance|0.3", "bsdf|diffuse;texture:reflectance|fixed;rgb|color|0.3 0.3 0.3"),
        ("bsdf|roughconductor;float|alpha|0.3", "bsdf|roughconductor;texture:alpha|fixed;rgb|color|0.3 0.3 0.3"),
        ("bsdf|principled;float|metallic|0.3", "bsdf|principled;texture:metallic|fixed;rgb|color|0.3 0.3 0.3"),
        (
            "bsdf|mask;float|opacity|1;bsdf|diffuse",
            "bsdf|mask;texture:opacity|fixed;rgb|color|1.5 1.5 1.5;end;bsdf|diffuse",
        ),
    ] {
        let value =
            |lines: &str| build(lines).resolve(&hit(wi), &arena).eval_pdf(wi, direction(0.7), Transport::Radiance);
        let ((a, pdf_a), (b, pdf_b)) = (value(constant), value(textured));
        assert!(close(a.g, b.g, 1e-5) && close(pdf_a, pdf_b, 1e-5), "{textured}: {a:?} {b:?}");
    }
    assert_eq!(build("bsdf|diffuse").lobes(), Lobes::DIFFUSE_REFLECTION);
}

#[test]
fn hc_s06_s07_s12_bad_parameters_are_errors() {
    for (lines, part) in [
        ("bsdf|twosided;bsdf|dielectric", "without a transmission component"),
        ("bsdf|twosided;bsdf|mask;bsdf|diffuse", "allow_transmission"),
        ("bsdf|roughconductor;float|alpha|-1", "at least 0"),
        ("bsdf|roughconductor;float|alpha|0.1;float|alpha_u|0.2", "exclude each other"),
        ("bsdf|roughconductor;float|alpha_u|0.2", "alpha_v"),
        ("bsdf|conductor;string|material|au", "did you mean \"Au\""),
        ("bsdf|conductor;string|material|Au;float|eta|2", "exclude each other"),
        ("bsdf|dielectric;float|int_ior|0", "positive"),
        ("bsdf|thindielectric;float|ext_ior|-1.5", "positive"),
        ("bsdf|roughdielectric;float|int_ior|1.5;float|ext_ior|1.5", "must differ"),
        ("bsdf|roughplastic;string|int_ior|air", "must differ"),
        ("bsdf|roughplastic;string|distribution|phong", "beckmann"),
        ("bsdf|principled;float|eta|1.5;float|specular|0.5", "exclude each other"),
        ("bsdf|principled;float|eta|0", "greater than 0"),
        ("bsdf|blendbsdf;bsdf|diffuse;end;bsdf|diffuse", "weight"),
        ("bsdf|blendbsdf;float|weight|0.5;bsdf|diffuse", "bsdf"),
        ("bsdf|mask;float|opacity|0.5", "bsdf"),
        ("bsdf|bumpmap;bsdf|diffuse", "texture"),
    ] {
        match try_build(lines) {
            Err(errors) => assert!(errors.to_string().contains(part), "{lines}: {errors}"),
            Ok(_) => panic!("{lines} was accepted"),
        }
    }
    assert!(try_build("bsdf|twosided;boolean|allow_transmission|true;bsdf|dielectric").is_ok());
}
