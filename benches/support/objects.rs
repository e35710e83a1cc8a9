//! Scenes and single objects from XML.

use lucerna::core::scene::{NodeId, Object, Scene, SceneErrors, Value};
use lucerna::core::scene::{build_one, instantiate, xml};
use std::path::Path;

/// A scene file, ready to render.
pub fn scene(path: &Path) -> Result<Scene, SceneErrors> {
    let description = xml::load_upgraded(path, &xml::LoadOptions::default())?;
    Ok(instantiate(&lucerna::builtin(), description, false)?.scene)
}

/// A scene from text.
pub fn scene_of(text: &str) -> Scene {
    let options = xml::LoadOptions::default();
    let built = xml::load_str(text, "bench", &options).and_then(xml::upgraded);
    built.and_then(|d| instantiate(&lucerna::builtin(), d, false)).unwrap_or_else(|e| panic!("{text}: {e}")).scene
}

/// The last object of a piece of XML.
pub fn build(text: &str) -> Object {
    let scene = format!("<scene version='3.9.1'>{text}</scene>");
    let build = || {
        let mut description = xml::upgraded(xml::load_str(&scene, "bench", &xml::LoadOptions::default())?)?;
        let mut objects = description.node(description.root).parameters.iter().filter_map(|p| match p.value {
            Value::Object(id) => Some(id),
            _ => None,
        });
        description.root = objects.next_back().unwrap_or(NodeId(0));
        build_one(&lucerna::builtin(), &description)
    };
    build().unwrap_or_else(|e| panic!("{text}: {e}"))
}
