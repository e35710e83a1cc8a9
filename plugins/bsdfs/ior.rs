//! Indices of refraction as parameters.

use lucerna_core::scene::{Failed, Param, Properties};

/// Index of the side without the normal.
pub const fn interior(material: &'static str) -> Param {
    Param::ior("int_ior", material, "index of refraction inside: a number or a material name")
}

/// Index of the side with the normal.
pub const EXTERIOR: Param = Param::ior("ext_ior", "air", "index of refraction outside: a number or a material name");

/// Interior over exterior index, both of which must be positive.
pub fn relative(p: &Properties<'_>) -> Result<f32, Failed> {
    let (inside, outside) = (p.ior("int_ior")?, p.ior("ext_ior")?);
    for (name, value) in [("int_ior", inside), ("ext_ior", outside)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(p.error(name, format!("the index of refraction must be positive, not {value}")));
        }
    }
    Ok(inside / outside)
}

/// As [`relative`], for rough interfaces, which have no meaning between equal indices.
pub fn relative_differing(p: &Properties<'_>) -> Result<f32, Failed> {
    let eta = relative(p)?;
    if eta == 1.0 {
        let name = if p.has("int_ior") { "int_ior" } else { "ext_ior" };
        return Err(p.error(name, "the interior and exterior indices of refraction must differ (use \"null\"?)"));
    }
    Ok(eta)
}
