//! Albedos are those of the reference.

use super::*;

/// Largest channel of the mean weight over `n` well-spread points (additive recurrence, Roberts 2018), without the
/// change of radiance by 1/η².
fn albedo(bsdf: &dyn Bsdf, cos_theta: f32, n: u32) -> f64 {
    let wi = direction(cos_theta);
    let mut sum = Rgb::BLACK.to_array().map(f64::from);
    with(bsdf, wi, |bxdf| {
        for i in 0..n {
            let u = |step: f64| (((0.5 + step * f64::from(i)) % 1.0) as f32).min(ONE_MINUS_EPSILON);
            let u2 = Vec2::new(u(0.671_043_606_703_789_2), u(0.549_700_477_901_970_3));
            let Some(s) = bxdf.sample(wi, u(0.819_172_513_396_164_4), u2, Transport::Importance) else { continue };
            sum.iter_mut().zip(s.weight.to_array()).for_each(|(sum, weight)| *sum += f64::from(weight));
        }
    });
    sum.into_iter().fold(0.0, f64::max) / f64::from(n)
}

/// But for `principled`, which gains energy as the reference does. A hundredth is granted to the fits in the plastics.
#[test]
fn nothing_gives_more_than_it_gets() {
    let failures: Vec<String> = materials()
        .par_iter()
        .filter(|material| plugin_of(&material.xml) != "principled" && !material.is_weighed_as_the_reference())
        .flat_map_iter(|material| {
            let bsdf = bsdf(&material.xml);
            INCIDENCES.into_iter().filter_map(move |cos_theta| {
                let albedo = albedo(&*bsdf, cos_theta, 1 << 15);
                (albedo > 1.01).then(|| format!("{} at {cos_theta}: {albedo}", material.xml))
            })
        })
        .collect();
    assert_none(&failures);
}

/// Albedos of the reference renderer at cos θ = 1, 0.5, 0.1 and 0.01.
#[test]
fn hc_s04_albedos_of_the_reference() {
    const ALPHAS: [f32; 6] = [0.01, 0.05, 0.1, 0.3, 0.6, 1.0];
    type Table = [[f64; 4]; 6];
    let tables: [(&str, &str, Table); 6] = [
        (
            "<bsdf type='roughconductor'><string name='distribution' value='ggx'/>",
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
            "<bsdf type='roughconductor'><string name='distribution' value='beckmann'/>",
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
            "<bsdf type='roughdielectric'><string name='distribution' value='ggx'/>\
             <float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>",
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
            "<bsdf type='roughplastic'><string name='distribution' value='ggx'/>\
             <float name='diffuse_reflectance' value='1'/>",
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
            "<bsdf type='principled'><float name='base_color' value='1'/>",
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
            "<bsdf type='principled'><float name='base_color' value='1'/><float name='metallic' value='1'/>",
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
    let mut cases = Vec::new();
    for (open, parameter, table) in tables {
        for (alpha, row) in ALPHAS.into_iter().zip(table) {
            cases.push((format!("{open}<float name='{parameter}' value='{alpha}'/></bsdf>"), row));
        }
    }
    for lossless in [
        "<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>",
        "<bsdf type='dielectric'/>",
        "<bsdf type='thindielectric'/>",
        "<bsdf type='conductor'/>",
        "<bsdf type='null'/>",
        "<bsdf type='plastic'><float name='diffuse_reflectance' value='1'/></bsdf>",
    ] {
        cases.push((lossless.to_owned(), [1.0; 4]));
    }
    let failures: Vec<String> = cases
        .par_iter()
        .flat_map_iter(|(xml, row)| {
            let bsdf = bsdf(xml);
            [1.0, 0.5, 0.1, 0.01].into_iter().zip(row).filter_map(move |(cos_theta, expected)| {
                let ours = albedo(&*bsdf, cos_theta, 1 << 18);
                ((ours - expected).abs() > 0.005).then(|| format!("{xml} at {cos_theta}: {ours:.4} against {expected}"))
            })
        })
        .collect();
    assert_none(&failures);
}
