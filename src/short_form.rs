//! Plugins in short form, as the command line takes them: `name` or `name:parameter=value,parameter=value`; and where
//! they go.

use lucerna_core::scene::param::ParamType;
use lucerna_core::scene::{Description, Location, Node, ObjectKind, Parameter, Registry, Value};

/// A plugin of this kind; `option` is where it was written, for messages.
///
/// # Errors
/// If a parameter has no value.
pub fn parse(kind: ObjectKind, text: &str, option: &str) -> Result<Node, String> {
    let (plugin, rest) = text.split_once(':').unwrap_or((text, ""));
    let at = Location::file(option.to_owned());
    let mut parameters = Vec::new();
    for item in rest.split(',').filter(|item| !item.is_empty()) {
        let (name, value) = key_value(item).map_err(|e| format!("{option} {text}: \"{item}\": {e}"))?;
        parameters.push(Parameter { name, value: plain_value(&value), at: at.clone() });
    }
    Ok(Node { kind, plugin: plugin.to_owned(), id: None, parameters, at, included_from: Vec::new() })
}

/// Gives every integrator that makes this decision another answer, in the place of its own.
///
/// # Errors
/// If the scene has no such integrator; one line.
pub fn decide(description: &mut Description, registry: &Registry, answer: &Node) -> Result<(), String> {
    let makes_it = |node: &Node| {
        let plugin = registry.find(node.kind, &node.plugin);
        let slot = |ty: ParamType| matches!(ty, ParamType::Child(kind, ..) if kind == answer.kind);
        node.kind == ObjectKind::Integrator && plugin.is_some_and(|plugin| plugin.all_params().any(|p| slot(p.ty)))
    };
    // What hangs on the scene: an integrator that was replaced is still among the nodes.
    let (mut integrators, mut ahead) = (Vec::new(), vec![description.root]);
    while let Some(id) = ahead.pop() {
        if makes_it(description.node(id)) && !integrators.contains(&id) {
            integrators.push(id);
        }
        let inner = description.children(id).map(|(_, child)| child);
        ahead.extend(inner.filter(|child| description.node(*child).kind == ObjectKind::Integrator));
    }
    if integrators.is_empty() {
        let option = &answer.at.file;
        return Err(format!(
            "{option} {}: the scene has no integrator that takes a {}",
            answer.plugin,
            answer.kind.tag()
        ));
    }
    let id = description.add(answer.clone());
    for integrator in integrators {
        let own = |p: &&Parameter| matches!(p.value, Value::Object(c) if description.node(c).kind == answer.kind);
        let own: Vec<String> =
            description.node(integrator).parameters.iter().filter(own).map(|p| p.name.clone()).collect();
        let parameters = &mut description.node_mut(integrator).parameters;
        parameters.retain(|p| !own.contains(&p.name));
        let name = format!("_{}", answer.kind.tag());
        parameters.push(Parameter { name, value: Value::Object(id), at: answer.at.clone() });
    }
    Ok(())
}

/// `key=value`.
///
/// # Errors
/// If it is not of that form.
pub fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err("expected name=value".to_owned()),
    }
}

/// A value: the narrowest type it can be.
pub fn plain_value(text: &str) -> Value {
    if let Ok(v) = text.parse::<i64>() {
        Value::Integer(v)
    } else if let Ok(v) = text.parse::<f64>() {
        Value::Float(v)
    } else if let Ok(v) = text.parse::<bool>() {
        Value::Boolean(v)
    } else {
        Value::String(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decisions_go_to_integrators_that_make_them() {
        let registry = crate::builtin();
        let power = parse(ObjectKind::LightSampler, "power", "--light-sampler").unwrap();
        for (integrators, made) in [
            ("<integrator type='path'/>", 1),
            ("<integrator type='path'><light_sampler type='uniform'/></integrator>", 1),
            ("<integrator type='moment'><integrator type='path'/><integrator type='direct'/></integrator>", 2),
            ("<integrator type='depth'/>", 0),
            ("", 0),
        ] {
            let text = format!("<scene version='3.0.0'>{integrators}</scene>");
            let mut scene = lucerna_core::scene::xml::load_str(&text, "t.xml", &Default::default()).unwrap();
            let outcome = decide(&mut scene, &registry, &power);
            assert_eq!(outcome.is_ok(), made > 0, "{integrators}: {outcome:?}");
            let answers = |node: &Node| {
                let objects = node.parameters.iter().filter_map(|p| match p.value {
                    Value::Object(id) => Some(scene.node(id)),
                    _ => None,
                });
                objects.filter(|n| n.kind == ObjectKind::LightSampler).map(|n| n.plugin.clone()).collect::<Vec<_>>()
            };
            let all: Vec<String> = scene.nodes.iter().flat_map(answers).collect();
            assert_eq!(all, vec!["power"; made], "{integrators}");
        }
    }

    #[test]
    fn an_integrator_that_was_replaced_does_not_count() {
        let text = "<scene version='3.0.0'><integrator type='path'/></scene>";
        let mut scene = lucerna_core::scene::xml::load_str(text, "t.xml", &Default::default()).unwrap();
        let root = scene.root;
        scene.node_mut(root).parameters.clear();
        let power = parse(ObjectKind::LightSampler, "power", "--light-sampler").unwrap();
        let message = decide(&mut scene, &crate::builtin(), &power).unwrap_err();
        assert_eq!(message, "--light-sampler power: the scene has no integrator that takes a light_sampler");
    }
}
