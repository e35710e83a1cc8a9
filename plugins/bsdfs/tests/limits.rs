//! Value, density and weight belong together; extreme inputs stay finite; albedos are the reference's; bad parameters
//! are errors.

use super::{build, direction, hit, try_build};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bxdf, Lobes, Transport};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;
use lucerna_core::stats::figures::measured;

const MODES: [Transport; 2] = [Transport::Radiance, Transport::Importance];

/// One of each, in the notation of [`build`].
const ALL: &[&str] = &[
    "bsdf|diffuse",
    "bsdf|conductor;string|material|Au",
    "bsdf|dielectric",
    "bsdf|thindielectric",
    "bsdf|plastic",
    "bsdf|null",
    "bsdf|roughconductor;float|alpha|0.05",
    "bsdf|roughconductor;string|distribution|ggx;float|alpha|0.3;boolean|sample_visible|false",
    "bsdf|roughdielectric;float|alpha|0.1",
    "bsdf|roughdielectric;string|distribution|ggx;float|alpha|1",
    "bsdf|roughplastic;float|alpha|0.1",
    "bsdf|roughplastic;string|distribution|ggx;float|alpha|1",
    "bsdf|principled;float|clearcoat|1;float|sheen|1",
    "bsdf|principled;float|spec_trans|0.8;float|metallic|0.3;float|anisotropic|0.6",
    "bsdf|twosided;bsdf|diffuse;end;bsdf|plastic",
    "bsdf|mask;float|opacity|0.4;bsdf|roughplastic",
    "bsdf|blendbsdf;float|weight|0.3;bsdf|diffuse;end;bsdf|roughconductor",
    "bsdf|blendbsdf;float|weight|0.3;bsdf|mask;bsdf|diffuse;end;end;bsdf|blendbsdf;float|weight|0.5;bsdf|plastic;end;bsdf|null",
    "bsdf|normalmap;rgb|normalmap|0.9 0.3 0.6;bsdf|roughplastic",
    "bsdf|bumpmap;texture|fixed;rgb|gradient|2 -1 0;end;bsdf|roughdielectric",
];

fn with(lines: &str, wi: Vec3, check: impl FnOnce(&dyn Bxdf)) {
    let arena = Arena::new();
    check(build(lines).resolve(&hit(wi), &arena));
}

fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-9
}

#[test]
fn hc_s02_weight_times_density_is_the_value() {
    let mut pcg = Pcg32::new(3, 1);
    // Largest relative deviation at a cosine of 0.1 and above, and at 0.01.
    let mut worst = [0f32; 2];
    for lines in ALL {
        for cos_theta in [1.0, 0.5, 0.1, 0.01, -0.6] {
            let wi = direction(cos_theta);
            with(lines, wi, |bxdf| {
                for i in 0..500 {
                    let mode = MODES[i % 2];
                    let (u1, u2) = (pcg.next_f32(), Vec2::new(pcg.next_f32(), pcg.next_f32()));
                    let Some(s) = bxdf.sample(wi, u1, u2, mode) else { continue };
                    assert!(s.pdf > 0.0 && (s.wo.length() - 1.0).abs() < 1e-4, "{lines}: {s:?}");
                    if !s.lobe.is_smooth() {
                        continue;
                    }
                    let (value, pdf) = bxdf.eval_pdf(wi, s.wo, mode);
                    // At grazing incidence the half vector magnifies the rounding of `wo`.
                    let tolerance = 1e-4 + 4e-6 / cos_theta.abs();
                    assert!(close(s.pdf, pdf, tolerance), "{lines} at {cos_theta}: {s:?}, density {pdf}");
                    let grazing = usize::from(cos_theta == 0.01);
                    for c in 0..3 {
                        let off = (s.weight[c] * s.pdf - value[c]).abs() / value[c].max(1e-5);
                        worst[grazing] = worst[grazing].max(off);
                        assert!(
                            close(s.weight[c] * s.pdf, value[c], tolerance),
                            "{lines} at {cos_theta}: {s:?}, {value:?}"
                        );
                    }
                }
            });
        }
    }
    let [usual, grazing] = worst;
    let figure =
        format!("off by {usual:.0e}, at a cosine of 0.01 by {grazing:.0e}, where the half vector magnifies rounding");
    measured("hc_s02_weight_times_density_is_the_value", figure);
}

#[test]
fn hc_s06_s07_s08_extreme_inputs_stay_finite() {
    let edge = [0.0, f32::MIN_POSITIVE, 1e-7, 0.25, 0.5, 0.75, ONE_MINUS_EPSILON];
    let mut subjects: Vec<String> = ALL.iter().map(|s| (*s).to_owned()).collect();
    for alpha in ["0", "1e-7", "1e-4", "1e-3"] {
        for plugin in ["roughconductor", "roughdielectric", "roughplastic"] {
            for distribution in ["beckmann", "ggx"] {
                subjects.push(format!("bsdf|{plugin};string|distribution|{distribution};float|alpha|{alpha}"));
            }
        }
    }
    subjects.push("bsdf|principled;float|roughness|0;float|clearcoat|1;float|clearcoat_gloss|1".to_owned());
    for (inside, outside) in [("1", "1"), ("1.000001", "1"), ("1", "1.000001"), ("10", "1"), ("1", "1.8")] {
        for plugin in ["dielectric", "thindielectric", "plastic", "roughdielectric", "roughplastic"] {
            if inside != outside || !plugin.starts_with("rough") {
                subjects.push(format!("bsdf|{plugin};float|int_ior|{inside};float|ext_ior|{outside}"));
            }
        }
    }
    let fine = |c: Rgb| c.is_finite() && c.r >= 0.0 && c.g >= 0.0 && c.b >= 0.0;
    for lines in &subjects {
        for cos_theta in [1.0, 0.5, 1e-3, 1e-8, f32::MIN_POSITIVE, 0.0, -0.0, -1e-8, -0.5, -1.0] {
            let wi = direction(cos_theta);
            with(lines, wi, |bxdf| {
                let place = format!("{lines} at {cos_theta}");
                assert!(fine(bxdf.albedo(wi)) && (0.0..=1.0).contains(&bxdf.roughness()), "{place}");
                for u1 in edge {
                    for u2 in edge.iter().flat_map(|x| edge.map(|y| Vec2::new(*x, y))) {
                        let Some(s) = bxdf.sample(wi, u1, u2, Transport::Radiance) else { continue };
                        assert!(
                            fine(s.weight) && s.wo.is_finite() && s.pdf > 0.0 && s.pdf.is_finite(),
                            "{place}: {s:?}"
                        );
                        assert!(s.eta > 0.0 && s.eta.is_finite(), "{place}: {s:?}");
                    }
                }
                for cos_o in [1.0, 1e-8, 0.0, -1e-8, -1.0, cos_theta, -cos_theta] {
                    for wo in [direction(cos_o), -direction(-cos_o), Vec3::new(-wi.x, -wi.y, wi.z), -wi] {
                        let (value, pdf) = bxdf.eval_pdf(wi, wo, Transport::Importance);
                        assert!(fine(value) && pdf >= 0.0 && pdf.is_finite(), "{place} to {wo}: {value:?} {pdf}");
                    }
                }
            });
        }
    }
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

/// Green channel of the mean weight over 2¹⁸ well-spread points (additive recurrence, Roberts 2018).
fn albedo(lines: &str, cos_theta: f32) -> f64 {
    let wi = direction(cos_theta);
    let mut sum = 0.0;
    let n = 1 << 18;
    with(lines, wi, |bxdf| {
        for i in 0..n {
            let u = |step: f64| ((0.5 + step * f64::from(i)) % 1.0) as f32;
            let u2 =
                Vec2::new(u(0.671_043_606_703_789_2), u(0.549_700_477_901_970_3)).min(Vec2::splat(ONE_MINUS_EPSILON));
            let u1 = u(0.819_172_513_396_164_4).min(ONE_MINUS_EPSILON);
            sum += bxdf.sample(wi, u1, u2, Transport::Importance).map_or(0.0, |s| f64::from(s.weight.g));
        }
    });
    sum / f64::from(n)
}

/// Albedos of the reference renderer at cos θ = 1, 0.5, 0.1 and 0.01, without the change of radiance by 1/η².
#[test]
fn hc_s04_albedos_of_the_reference() {
    const ALPHAS: [f32; 6] = [0.01, 0.05, 0.1, 0.3, 0.6, 1.0];
    type Table = [[f64; 4]; 6];
    let tables: [(&str, &str, Table); 6] = [
        (
            "bsdf|roughconductor;string|distribution|ggx",
            "alpha",
            [
                [1.000, 1.000, 0.994, 0.882],
                [0.997, 0.993, 0.909, 0.916],
                [0.988, 0.969, 0.873, 0.920],
                [0.878, 0.818, 0.842, 0.880],
                [0.592, 0.625, 0.730, 0.770],
                [0.307, 0.409, 0.558, 0.608],
            ],
        ),
        (
            "bsdf|roughconductor;string|distribution|beckmann",
            "alpha",
            [
                [1.000, 1.000, 1.000, 0.914],
                [1.000, 1.000, 0.952, 0.949],
                [1.000, 1.000, 0.913, 0.957],
                [1.000, 0.924, 0.932, 0.961],
                [0.856, 0.852, 0.934, 0.954],
                [0.461, 0.756, 0.902, 0.926],
            ],
        ),
        (
            "bsdf|roughdielectric;string|distribution|ggx;float|int_ior|1.5;float|ext_ior|1",
            "alpha",
            [
                [1.000, 1.000, 0.996, 0.887],
                [1.000, 0.998, 0.938, 0.926],
                [0.999, 0.992, 0.916, 0.926],
                [0.988, 0.947, 0.850, 0.802],
                [0.955, 0.843, 0.629, 0.547],
                [0.893, 0.672, 0.400, 0.323],
            ],
        ),
        (
            "bsdf|roughplastic;string|distribution|ggx;float|diffuse_reflectance|1",
            "alpha",
            [
                [0.978, 0.979, 0.986, 0.900],
                [0.957, 0.958, 0.915, 0.909],
                [0.910, 0.908, 0.859, 0.873],
                [0.695, 0.673, 0.628, 0.601],
                [0.489, 0.439, 0.347, 0.311],
                [0.340, 0.263, 0.172, 0.148],
            ],
        ),
        (
            "bsdf|principled;float|base_color|1",
            "roughness",
            [
                [1.016, 1.051, 1.266, 1.458],
                [1.019, 1.054, 1.291, 1.460],
                [1.021, 1.059, 1.314, 1.357],
                [1.033, 1.076, 1.212, 1.185],
                [1.046, 1.073, 1.208, 1.244],
                [1.048, 1.078, 1.420, 1.586],
            ],
        ),
        (
            "bsdf|principled;float|base_color|1;float|metallic|1",
            "roughness",
            [
                [1.000, 1.000, 1.000, 0.994],
                [1.000, 1.000, 1.000, 0.964],
                [1.000, 1.000, 0.994, 0.882],
                [0.991, 0.975, 0.875, 0.920],
                [0.825, 0.777, 0.824, 0.861],
                [0.307, 0.409, 0.558, 0.608],
            ],
        ),
    ];
    let mut failures = String::new();
    let mut worst = 0f64;
    for (lines, parameter, table) in tables {
        for (alpha, row) in ALPHAS.into_iter().zip(table) {
            for (cos_theta, expected) in [1.0, 0.5, 0.1, 0.01].into_iter().zip(row) {
                let ours = albedo(&format!("{lines};float|{parameter}|{alpha}"), cos_theta);
                worst = worst.max((ours - expected).abs());
                if (ours - expected).abs() > 0.005 {
                    failures += &format!("{lines} {alpha} at {cos_theta}: {ours:.4} against {expected}\n");
                }
            }
        }
    }
    for lossless in [
        "bsdf|diffuse;float|reflectance|1",
        "bsdf|dielectric",
        "bsdf|thindielectric",
        "bsdf|conductor",
        "bsdf|null",
        "bsdf|plastic;float|diffuse_reflectance|1",
    ] {
        for cos_theta in [1.0, 0.5, 0.1, 0.01] {
            let ours = albedo(lossless, cos_theta);
            worst = worst.max((ours - 1.0).abs());
            if (ours - 1.0).abs() > 0.005 {
                failures += &format!("{lossless} at {cos_theta}: {ours:.4} against 1\n");
            }
        }
    }
    measured("hc_s04_albedos_of_the_reference", format!("off by at most {worst:.4}"));
    assert!(failures.is_empty(), "{failures}");
}

/// f(wi, wo) = f*(wo, wi): radiance one way is importance the other. `bumpmap` and `normalmap` do not claim it (the
/// shadowing function knows `wo` only).
#[test]
fn hc_s03_reciprocity() {
    let mut pcg = Pcg32::new(11, 1);
    let mut worst = 0f32;
    let mut sphere = || {
        let z = 2.0 * pcg.next_f32() - 1.0;
        let (s, c) = (std::f32::consts::TAU * pcg.next_f32()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * c, r * s, z)
    };
    for lines in ALL.iter().filter(|l| !l.contains("normalmap") && !l.contains("bumpmap")) {
        let (mut compared, arena) = (0, Arena::new());
        let bsdf = build(lines);
        let bxdf = bsdf.resolve(&hit(Vec3::Z), &arena);
        for _ in 0..10_000 {
            let (wi, wo) = (sphere(), sphere());
            if wi.z.abs() < 0.01 || wo.z.abs() < 0.01 {
                continue;
            }
            let there = bxdf.eval_pdf(wi, wo, Transport::Radiance).0 / wo.z.abs();
            let back = bxdf.eval_pdf(wo, wi, Transport::Importance).0 / wi.z.abs();
            for c in 0..3 {
                worst = worst.max((there[c] - back[c]).abs() / there[c].max(1e-3));
                assert!(
                    (there[c] - back[c]).abs() <= 1e-3 * there[c].max(back[c]) + 1e-6,
                    "{lines}: {wi} {wo} {there:?} {back:?}"
                );
            }
            compared += usize::from(!there.is_black());
        }
        assert!(compared > 100 || !bxdf.lobes().is_smooth(), "{lines}: {compared}");
    }
    measured("hc_s03_reciprocity", format!("off by {worst:.0e}; not claimed by `bumpmap` and `normalmap`"));
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
