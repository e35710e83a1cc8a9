//! The table: configurations of every BSDF.

use super::GRID;
use lucerna::core::math::Vec3;
use lucerna::core::stats::chi2::SphereGrid;
use std::f64::consts::PI;

/// One configuration.
pub struct Material {
    pub xml: String,
    /// The cells its samples are counted in.
    pub grid: SphereGrid,
    /// Roughness in both directions, if normals are sampled by the visible ones of a Beckmann distribution.
    fitted: Option<[f64; 2]>,
    /// Below this cosine the lobe is too narrow for the quadrature over the cells: that of finer cells still approaches
    /// the share of samples that have a direction.
    resolved: f32,
}

impl Material {
    fn new(xml: impl Into<String>) -> Self {
        Material { xml: xml.into(), grid: GRID, fitted: None, resolved: 0.0 }
    }

    /// Whether χ² can be made for a direction.
    ///
    /// Smith's shadowing of a Beckmann distribution is a rational fit (Walter et al. 2007, section 5.2), off by up to
    /// 0.35 %; it is part of the density, and of the pictures of the reference. A million samples see that, so the
    /// density is corrected to the exact shadowing, which is a factor for metal and glass. Under a plastic it is a
    /// factor of one of two lobes: left out where the fit is not exactly 1.
    pub fn is_exact(&self, wi: Vec3) -> bool {
        let mixed = super::plugin_of(&self.xml) == "roughplastic";
        let fits = !mixed || self.fitted.is_none_or(|alpha| inverse_slope(wi, alpha) >= 3.0);
        fits && wi.z.abs() >= self.resolved
    }

    /// Ground glass of which all normals are sampled: the weight is that of the reference, which leaves out that they
    /// come from a wider distribution, as the manual tells.
    pub fn is_weighed_as_the_reference(&self) -> bool {
        super::plugin_of(&self.xml) == "roughdielectric" && self.xml.contains("name='sample_visible' value='false'")
    }

    /// Exact over claimed density.
    pub fn density_factor(&self, wi: Vec3) -> f32 {
        let Some(alpha) = self.fitted else { return 1.0 };
        let a = inverse_slope(wi, alpha);
        if a.is_nan() || a > 10.0 {
            return 1.0;
        }
        let exact = 2.0 / (1.0 + erf(a) + (-a * a).exp() / (a * PI.sqrt()));
        let fit = if a >= 1.6 { 1.0 } else { (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) };
        (exact / fit) as f32
    }
}

/// 1 / (α tan θ), where α is the roughness along the direction.
fn inverse_slope(wi: Vec3, [alpha_u, alpha_v]: [f64; 2]) -> f64 {
    let [x, y, z] = wi.to_array().map(f64::from);
    z.abs() / ((alpha_u * x).powi(2) + (alpha_v * y).powi(2)).sqrt()
}

/// The error function by its Taylor series, good to 10⁻⁹ up to 4.
fn erf(x: f64) -> f64 {
    if x > 4.0 {
        return 1.0;
    }
    let (mut term, mut sum) = (x, x);
    for n in 1..100 {
        term *= -x * x / f64::from(n);
        sum += term / f64::from(2 * n + 1);
    }
    sum * 2.0 / PI.sqrt()
}

/// Different from each other, and rough enough to overlap: for combinators.
const GLOSSY: &str = "<bsdf type='roughconductor'><string name='distribution' value='ggx'/>\
    <float name='alpha' value='0.3'/></bsdf>";
const GLASS: &str = "<bsdf type='roughdielectric'><string name='distribution' value='ggx'/>\
    <float name='alpha' value='0.3'/></bsdf>";
const PAINT: &str = "<bsdf type='roughplastic'><string name='distribution' value='ggx'/>\
    <float name='alpha' value='0.2'/><rgb name='diffuse_reflectance' value='0.9 0.5 0.1'/></bsdf>";
const MATT: &str = "<bsdf type='diffuse'><rgb name='reflectance' value='0.2 0.5 0.8'/></bsdf>";
const COATED: &str = "<bsdf type='plastic'/>";
const RELIEF: &str = "<texture type='bitmap'><string name='filename' value='textures/height.png'/>\
    <boolean name='raw' value='true'/></texture><float name='scale' value='0.1'/>";
const NORMALS: &str = "<texture type='bitmap' name='normalmap'><string name='filename' value='textures/normals.png'/>\
    <boolean name='raw' value='true'/></texture>";
const RAMP: &str = "<string name='filename' value='textures/ramp.png'/><boolean name='raw' value='true'/>";

/// All configurations.
pub fn materials() -> Vec<Material> {
    let nested = |plugin: &str, inner: &str| format!("<bsdf type='{plugin}'>{inner}</bsdf>");
    let floats = |values: &[(&str, &str)]| -> String {
        values.iter().map(|(name, value)| format!("<float name='{name}' value='{value}'/>")).collect()
    };
    let blend = |weight: &str, children: &str| {
        nested("blendbsdf", &format!("<float name='weight' value='{weight}'/>{children}"))
    };
    let mask =
        |opacity: &str, child: &str| nested("mask", &format!("<float name='opacity' value='{opacity}'/>{child}"));
    let tilted = "<rgb name='normalmap' value='0.9 0.3 0.6'/>";
    let nonlinear = "<boolean name='nonlinear' value='true'/>\
        <rgb name='diffuse_reflectance' value='0.9 0.5 0.1'/>";
    let strong = "<rgb name='base_color' value='0.9 0.5 0.1'/>".to_owned()
        + &floats(&[("metallic", "0.2"), ("spec_trans", "0.3"), ("anisotropic", "0.5"), ("spec_tint", "0.6")])
        + &floats(&[("sheen", "0.7"), ("sheen_tint", "0.4"), ("flatness", "0.5"), ("clearcoat", "0.8")])
        + &floats(&[("clearcoat_gloss", "0.1")]);
    let principled = |values: &[(&str, &str)]| nested("principled", &floats(values));
    let mut all: Vec<Material> = [
        MATT.to_owned(),
        nested("diffuse", &format!("<texture type='bitmap' name='reflectance'>{RAMP}</texture>")),
        nested("dielectric", ""),
        nested("thindielectric", ""),
        nested("conductor", "<string name='material' value='Au'/>"),
        nested("null", ""),
        COATED.to_owned(),
        nested("plastic", nonlinear),
        nested(
            "roughconductor",
            &format!(
                "<texture type='bitmap' name='alpha'>{RAMP}</texture>\
            <string name='material' value='Cu'/><string name='distribution' value='ggx'/>"
            ),
        ),
        PAINT.to_owned(),
        nested("principled", ""),
        nested("principled", &strong),
        principled(&[("roughness", "0.3"), ("metallic", "1")]),
        principled(&[("roughness", "1"), ("metallic", "1")]),
        principled(&[("roughness", "0.3"), ("spec_trans", "0.8")]),
        principled(&[("roughness", "1"), ("spec_trans", "0.8")]),
        principled(&[("roughness", "0.5"), ("clearcoat", "1"), ("sheen", "1")]),
        nested("twosided", &format!("{MATT}{GLOSSY}")),
        nested("twosided", PAINT),
        mask("0.4", PAINT),
        mask("0.7", GLASS),
        blend("0.3", &format!("{MATT}{GLOSSY}")),
        blend("0.6", &format!("<bsdf type='null'/>{GLASS}")),
        blend("0.3", &format!("{}{}", mask("0.5", MATT), blend("0.5", &format!("{COATED}<bsdf type='null'/>")))),
        nested("blendbsdf", &format!("<texture type='bitmap' name='weight'>{RAMP}</texture>{GLASS}{MATT}")),
        nested("normalmap", &format!("{tilted}{PAINT}")),
        nested("normalmap", &format!("{tilted}{GLASS}")),
        nested("normalmap", &format!("{NORMALS}{}", blend("0.5", &format!("{MATT}{GLOSSY}")))),
        nested("bumpmap", &format!("{RELIEF}{GLOSSY}")),
        nested("bumpmap", &format!("{RELIEF}{GLASS}")),
        nested("bumpmap", &format!("{RELIEF}{}", nested("twosided", &format!("{MATT}{PAINT}")))),
    ]
    .into_iter()
    .map(Material::new)
    .collect();
    for plugin in ["roughconductor", "roughplastic", "roughdielectric"] {
        for distribution in ["beckmann", "ggx"] {
            for (visible, alpha) in [(true, 0.05), (true, 0.3), (true, 1.0), (false, 0.05), (false, 0.3), (false, 1.0)]
            {
                let options = format!(
                    "<string name='distribution' value='{distribution}'/><boolean name='sample_visible' \
                     value='{visible}'/><float name='alpha' value='{alpha}'/>"
                );
                let fitted = (visible && distribution == "beckmann").then_some([alpha; 2]);
                all.push(Material { fitted, ..Material::new(nested(plugin, &options)) });
            }
        }
    }
    // Extreme anisotropy, on cells four times as fine (S14).
    for distribution in ["beckmann", "ggx"] {
        let options = format!("<string name='distribution' value='{distribution}'/>")
            + &floats(&[("alpha_u", "0.001"), ("alpha_v", "1")]);
        let grid = SphereGrid { rings: 4 * GRID.rings, spokes: 4 * GRID.spokes };
        let fitted = (distribution == "beckmann").then_some([0.001, 1.0]);
        all.push(Material { grid, fitted, resolved: 0.5, ..Material::new(nested("roughconductor", &options)) });
    }
    all
}

/// More for the tests of extreme input: roughness and indices of refraction at their ends.
pub fn extreme() -> impl Iterator<Item = String> {
    let rough = ["roughconductor", "roughdielectric", "roughplastic"].into_iter().flat_map(|plugin| {
        ["beckmann", "ggx"].into_iter().flat_map(move |distribution| {
            ["0", "1e-7", "1e-4", "1e-3"].map(|alpha| {
                format!(
                    "<bsdf type='{plugin}'><string name='distribution' value='{distribution}'/>\
                     <float name='alpha' value='{alpha}'/></bsdf>"
                )
            })
        })
    });
    let glass = [("1", "1"), ("1.000001", "1"), ("1", "1.000001"), ("10", "1"), ("1", "1.8")];
    let indices = glass.into_iter().flat_map(|(inside, outside)| {
        let plugins = ["dielectric", "thindielectric", "plastic", "roughdielectric", "roughplastic"];
        plugins.into_iter().filter(move |plugin| inside != outside || !plugin.starts_with("rough")).map(move |plugin| {
            format!(
                "<bsdf type='{plugin}'><float name='int_ior' value='{inside}'/>\
                 <float name='ext_ior' value='{outside}'/></bsdf>"
            )
        })
    });
    let sharp = "<bsdf type='principled'><float name='roughness' value='0'/><float name='clearcoat' value='1'/>\
        <float name='clearcoat_gloss' value='1'/></bsdf>";
    rough.chain(indices).chain([sharp.to_owned()])
}
