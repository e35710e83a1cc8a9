//! Indices of refraction by material name.

use crate::scene::did_you_mean;

/// Name and index of refraction (dimensionless, visible light).
pub const MATERIALS: &[(&str, f32)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.3330),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.470),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.5750),
    ("diamond", 2.419),
];

/// The index of a material, letter case ignored, or a message that says what was perhaps meant.
pub fn by_name(name: &str) -> Result<f32, String> {
    MATERIALS.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, ior)| *ior).ok_or_else(|| match did_you_mean(
        name,
        MATERIALS.iter().map(|(n, _)| *n),
    ) {
        Some(meant) => format!("unknown material \"{name}\" (did you mean \"{meant}\"?)"),
        None => format!("unknown material \"{name}\""),
    })
}
