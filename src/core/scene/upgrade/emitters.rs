//! Lights.

use super::super::description::{NodeId, ObjectKind, Value};
use super::sun::PlaceAndTime;
use super::{Editor, number, scaled};
use glam::{DMat4, DVec3};

/// The full angle of the sun in degrees, which `sun_radius_scale` multiplied.
const SUN_APERTURE: f64 = 0.5358;

/// A `scale` on a light goes into its colour.
pub(super) fn fold_scale(editor: &mut Editor, node: NodeId) -> Option<String> {
    let light = editor.scene.node(node);
    let factor = number(&light.parameter("scale")?.value)?;
    let colour = ["radiance", "intensity", "irradiance"].into_iter().find(|name| light.parameter(name).is_some());
    let colour = colour.unwrap_or(match light.plugin.as_str() {
        "point" | "spot" => "intensity",
        "directional" => "irradiance",
        _ => "radiance",
    });
    let value = light.parameter(colour).map_or(Some(Value::Float(factor)), |p| scaled(&p.value, factor))?;
    let note = format!("\"scale\" of emitter \"{}\" is multiplied into \"{colour}\"", light.plugin);
    editor.take(node, "scale");
    editor.set(node, colour, value);
    Some(note)
}

/// A `sun` beside a `sky` goes into it: today a scene has one environment. What only the sun says about itself (its
/// scale and size) is kept, and the rest is taken from the sky.
pub(super) fn join_sun_to_sky(editor: &mut Editor, scene: NodeId) -> Option<String> {
    let find = |plugin| {
        let mut lights = editor.children(scene, ObjectKind::Emitter).into_iter();
        lights.find(|(_, light)| editor.plugin(*light) == plugin && editor.is_old(*light))
    };
    let ((_, sky), (name, sun)) = (find("sky")?, find("sun")?);
    let sky_scale = editor.take_number(sky, "scale").unwrap_or(1.0);
    let sun_scale = editor.take_number(sun, "scale").unwrap_or(1.0);
    editor.set(sky, "sky_scale", Value::Float(sky_scale));
    editor.set(sky, "sun_scale", Value::Float(sun_scale));
    if let Some(size) = editor.take(sun, "sun_radius_scale") {
        editor.set(sky, "sun_radius_scale", size);
    }
    editor.scene.node_mut(sky).plugin = "sunsky".to_owned();
    editor.take(scene, &name);
    Some("emitters \"sun\" and \"sky\" are read as one \"sunsky\"".to_owned())
}

/// `sky` is `sunsky` without the sun.
pub(super) fn only_the_sky(editor: &mut Editor, node: NodeId) -> Option<String> {
    become_sunsky(editor, node, "sky_scale", "sun_scale")
}

/// `sun` is `sunsky` without the sky.
pub(super) fn only_the_sun(editor: &mut Editor, node: NodeId) -> Option<String> {
    become_sunsky(editor, node, "sun_scale", "sky_scale")
}

fn become_sunsky(editor: &mut Editor, node: NodeId, on: &str, off: &str) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    editor.scene.node_mut(node).plugin = "sunsky".to_owned();
    if let Some(scale) = editor.take_number(node, "scale") {
        editor.set(node, on, Value::Float(scale));
    }
    editor.set(node, off, Value::Float(0.0));
    Some(format!("emitter \"{old}\" is read as \"sunsky\" with {off} 0"))
}

/// `scale` on `sunsky` goes into the scales of both parts.
pub(super) fn scale_both(editor: &mut Editor, node: NodeId) -> Option<String> {
    let factor = editor.take_number(node, "scale")?;
    for part in ["sun_scale", "sky_scale"] {
        let own = editor.take_number(node, part).unwrap_or(1.0);
        editor.set(node, part, Value::Float(own * factor));
    }
    Some("\"scale\" of emitter \"sunsky\" is multiplied into \"sun_scale\" and \"sky_scale\"".to_owned())
}

/// The size of the sun is an angle today.
pub(super) fn sun_aperture(editor: &mut Editor, node: NodeId) -> Option<String> {
    let factor = editor.take_number(node, "sun_radius_scale")?;
    editor.set(node, "sun_aperture", Value::Float(SUN_APERTURE * factor));
    Some("\"sun_radius_scale\" is read as \"sun_aperture\", in degrees".to_owned())
}

/// The sky model knows turbidities from 1 to 10.
pub(super) fn turbidity(editor: &mut Editor, node: NodeId) -> Option<String> {
    let given = number(&editor.scene.node(node).parameter("turbidity")?.value)?;
    let possible = given.clamp(1.0, 10.0);
    (given != possible).then(|| {
        editor.set(node, "turbidity", Value::Float(possible));
        format!("turbidity {given} is read as {possible}")
    })
}

/// The sky of 0.x had +Y at the zenith, today's has +Z: a quarter turn about x is put before `to_world`.
///
/// Today's sun goes through the sky the other way round, so a place and time are replaced by the direction of the sun,
/// which was and is given in the world.
pub(super) fn upright(editor: &mut Editor, node: NodeId) -> Option<String> {
    if !editor.is_ancient(node) {
        return None;
    }
    let to_world = match editor.take(node, "to_world") {
        Some(Value::Transform(matrix)) => matrix,
        _ => DMat4::IDENTITY,
    };
    let mut given = |name, default| editor.take_number(node, name).unwrap_or(default);
    let when = PlaceAndTime {
        latitude: given("latitude", 35.6894),
        longitude: given("longitude", 139.6917),
        timezone: given("timezone", 9.0),
        year: given("year", 2010.0),
        month: given("month", 7.0),
        day: given("day", 10.0),
        hour: given("hour", 15.0) + given("minute", 0.0) / 60.0 + given("second", 0.0) / 3600.0,
    };
    if editor.scene.node(node).parameter("sun_direction").is_none() {
        let direction = to_world.transform_vector3(when.sun()).normalize_or(DVec3::Y);
        editor.set(node, "sun_direction", Value::Vector(direction.to_array()));
    }
    editor.set(node, "to_world", Value::Transform(to_world * y_up_to_z_up()));
    Some("emitter \"sunsky\" is turned from +Y up to +Z up, and a place and time read as \"sun_direction\"".to_owned())
}

/// The exact quarter turn `(x, y, z) → (x, z, −y)`.
fn y_up_to_z_up() -> DMat4 {
    DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0., 0., 0., 0., 0., 1.])
}
