//! References joined to what they name.
//!
//! After [`resolve`] no [`Value::Reference`] is left, the objects form a graph without cycles, and every node can be
//! reached from the root: an object that nothing uses is gone, as is a nested `<scene>`, which the language allows and
//! ignores.

use super::description::{Description, NodeId, ObjectKind, Value};
use super::error::{SceneError, SceneErrors, did_you_mean};
use std::collections::HashMap;

/// How deep objects may nest, references followed. What walks the tree may recurse.
pub const DEEPEST_OBJECT: u32 = 256;

/// Joins all references and drops what the root does not reach.
///
/// # Errors
/// References to ids that do not exist, circular references, and objects nested deeper than [`DEEPEST_OBJECT`].
pub fn resolve(description: &mut Description) -> Result<(), SceneErrors> {
    let errors = check(description);
    if !errors.is_empty() {
        return Err(SceneErrors(errors));
    }
    let ids = ids(description);
    for node in &mut description.nodes {
        for parameter in &mut node.parameters {
            if let Value::Reference(id) = &parameter.value
                && let Some(target) = ids.get(id)
            {
                parameter.value = Value::Object(*target);
            }
        }
    }
    for index in 0..description.nodes.len() {
        let mut parameters = std::mem::take(&mut description.nodes[index].parameters);
        parameters.retain(|p| !matches!(p.value, Value::Object(o) if description.node(o).kind == ObjectKind::Scene));
        description.nodes[index].parameters = parameters;
    }
    prune(description);
    Ok(())
}

/// Drops the nodes that the root does not reach and numbers the rest anew, parents before children where the order of
/// the file allows.
pub(super) fn prune(description: &mut Description) {
    let mut reached = vec![false; description.nodes.len()];
    let mut open = vec![description.root];
    while let Some(id) = open.pop() {
        if !std::mem::replace(&mut reached[id.0 as usize], true) {
            open.extend(description.children(id).map(|(_, child)| child));
        }
    }
    let mut next = 0;
    let numbers: Vec<NodeId> = reached
        .iter()
        .map(|reached| {
            let number = NodeId(next);
            next += u32::from(*reached);
            number
        })
        .collect();
    let mut keep = reached.iter();
    description.nodes.retain(|_| keep.next().copied().unwrap_or(false));
    description.root = numbers[description.root.0 as usize];
    for parameter in description.nodes.iter_mut().flat_map(|node| &mut node.parameters) {
        if let Value::Object(child) = &mut parameter.value {
            *child = numbers[child.0 as usize];
        }
    }
}

fn ids(description: &Description) -> HashMap<String, NodeId> {
    let nodes = (0..).map(NodeId).zip(&description.nodes);
    nodes.filter_map(|(number, node)| Some((node.id.clone()?, number))).collect()
}

/// What is wrong with the references of a scene; see [`resolve`].
pub(super) fn check(description: &Description) -> Vec<SceneError> {
    let ids = ids(description);
    let mut errors = Vec::new();
    for node in &description.nodes {
        for parameter in &node.parameters {
            if let Value::Reference(id) = &parameter.value
                && !ids.contains_key(id)
            {
                let message = format!("unresolved reference to \"{id}\"");
                let mut error = SceneError::at(&parameter.at, message);
                error.hint = Some(match did_you_mean(id, ids.keys().map(String::as_str)) {
                    Some(meant) => format!("did you mean \"{meant}\"?"),
                    None => format!("make sure an object with id=\"{id}\" exists"),
                });
                if node.kind != ObjectKind::Scene {
                    error = error.within(format!("in {} ({})", node.title(), node.at));
                }
                error.chain.extend(node.included_from.iter().cloned());
                errors.push(error);
            }
        }
    }
    errors.extend(check_shape(description, &ids));
    errors
}

/// Where the walk of [`check_shape`] is.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    New,
    /// On the current chain.
    Open,
    /// Done; so many levels of objects are below.
    Done(u32),
}

/// Finds the first cycle, and objects nested too deep, by a depth-first walk without recursion.
fn check_shape(description: &Description, ids: &HashMap<String, NodeId>) -> Option<SceneError> {
    let child = |node: NodeId, index: usize| match &description.node(node).parameters[index].value {
        Value::Object(child) => Some(*child),
        Value::Reference(id) => ids.get(id).copied(),
        _ => None,
    };
    let mut marks = vec![Mark::New; description.nodes.len()];
    for start in (0..description.nodes.len() as u32).map(NodeId) {
        if marks[start.0 as usize] != Mark::New {
            continue;
        }
        // Each entry: a node, the next parameter to look at, and the levels found below it so far.
        let mut chain = vec![(start, 0, 0)];
        marks[start.0 as usize] = Mark::Open;
        while let Some(&mut (node, ref mut next, ref mut below)) = chain.last_mut() {
            if *next == description.node(node).parameters.len() {
                let levels = *below + 1;
                if levels > DEEPEST_OBJECT {
                    let message = format!("objects are nested deeper than {DEEPEST_OBJECT}");
                    return Some(SceneError::at(&description.node(node).at, message));
                }
                marks[node.0 as usize] = Mark::Done(levels);
                chain.pop();
                if let Some((_, _, parent)) = chain.last_mut() {
                    *parent = levels.max(*parent);
                }
                continue;
            }
            let index = *next;
            *next += 1;
            let Some(child) = child(node, index) else { continue };
            match marks[child.0 as usize] {
                Mark::Done(levels) => *below = levels.max(*below),
                Mark::New => {
                    marks[child.0 as usize] = Mark::Open;
                    chain.push((child, 0, 0));
                }
                Mark::Open => {
                    let cycle = chain.iter().map(|entry| entry.0).skip_while(|n| *n != child).chain([child]);
                    let names: Vec<_> = cycle.map(|node| name(description, node)).collect();
                    let message = format!("circular reference detected: {}", names.join(" -> "));
                    return Some(SceneError::at(&description.node(node).parameters[index].at, message));
                }
            }
        }
    }
    None
}

fn name(description: &Description, node: NodeId) -> String {
    let node = description.node(node);
    node.id.clone().unwrap_or_else(|| node.title())
}
