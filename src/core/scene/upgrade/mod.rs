//! Scenes written for the 0.x and 2.x versions of the language, brought to today's names.
//!
//! [`upgrade`] walks over a resolved [`Description`] and applies the rows of one table (`table.rs`): each names a kind of
//! object, the plugins it concerns, and the rewrite. It is more forgiving than the reference, which changes the letter
//! case of parameters and leaves the rest to the author. Whatever is rewritten is told in [`Description::notes`], once
//! per row with a count. Objects from files of version 3.0 and later are left as they are, but for a few private
//! plugins that are found in published scenes.
//!
//! What a plugin meant decides what it becomes: radiance on `<spectrum>` with one number was white, a conductor without
//! parameters was copper, a boundary of a medium without a material was invisible, the sky was Y-up. Where today has
//! nothing like it, the nearest plugin is taken and the note says so.

mod emitters;
mod materials;
mod media;
mod others;
mod sun;
mod table;
mod textures;

#[cfg(test)]
mod tests;

use super::description::{Description, NodeId, ObjectKind, Parameter, SpectrumValue, Value};
use super::notes::Notes;
use super::resolve;
use table::{LEFTOVERS, Rewrite, Row, TABLE};

/// An object may become another plugin so often at most.
const MOST_ROUNDS: usize = 8;

/// Rewrites everything that comes from a file older than version 3.0 into today's names.
///
/// References must have been [resolved](super::resolve::resolve) before, because what a texture or material becomes
/// depends on the objects around it.
pub fn upgrade(description: &mut Description) {
    let mut editor = Editor { scene: description, notes: Notes::default() };
    editor.run();
    let notes = editor.notes;
    description.notes.extend(notes.into_lines());
    resolve::prune(description);
}

/// The scene being rewritten, with the small changes that rewrites are made of.
struct Editor<'d> {
    scene: &'d mut Description,
    notes: Notes,
}

impl Editor<'_> {
    fn run(&mut self) {
        let all = |editor: &Self| (0..editor.scene.nodes.len() as u32).map(NodeId);
        for node in all(self).filter(|node| self.is_old(*node)).collect::<Vec<_>>() {
            self.snake_case(node);
        }
        // Materials come before textures: a bump map takes over the factor of a texture around its texture.
        let mut kinds = ObjectKind::ALL;
        kinds.sort_by_key(|kind| *kind == ObjectKind::Texture);
        for kind in kinds {
            for node in all(self).filter(|node| self.scene.node(*node).kind == kind).collect::<Vec<_>>() {
                self.apply(if self.is_old(node) { TABLE } else { LEFTOVERS }, node);
            }
        }
    }

    /// Applies the rows in order; one that changes the plugin starts them again for what it has become.
    fn apply(&mut self, rows: &[Row], node: NodeId) {
        for _ in 0..MOST_ROUNDS {
            let plugin = self.plugin(node).to_owned();
            for row in rows {
                if row.concerns(self.scene.node(node)) {
                    self.rewrite(row, node);
                }
                if self.plugin(node) != plugin {
                    break;
                }
            }
            if self.plugin(node) == plugin {
                break;
            }
        }
    }

    fn rewrite(&mut self, row: &Row, node: NodeId) {
        let (tag, plugin) = (row.kind.tag(), self.plugin(node).to_owned());
        let at = self.scene.node(node).at.clone();
        let why = if row.why.is_empty() { String::new() } else { format!(": {}", row.why) };
        match row.rewrite {
            Rewrite::Plugin(new) => {
                self.scene.node_mut(node).plugin = new.to_owned();
                self.notes.add(format!("{tag} \"{plugin}\" is read as \"{new}\"{why}"), &at);
            }
            Rewrite::Rename(old, new) => {
                let given = self.scene.node(node).parameter(new).is_some();
                if let Some(parameter) = self.scene.node_mut(node).take(old) {
                    self.notes.add(format!("\"{old}\" of {tag} \"{plugin}\" is read as \"{new}\"{why}"), &parameter.at);
                    if !given {
                        self.scene.node_mut(node).parameters.push(Parameter { name: new.to_owned(), ..parameter });
                    }
                }
            }
            Rewrite::Drop(names) => {
                self.drop_if(node, |p| names.contains(&p.name.as_str()), &why);
            }
            Rewrite::Keep(names) => {
                let goes = |p: &Parameter| !matches!(p.value, Value::Object(_)) && !names.contains(&p.name.as_str());
                self.drop_if(node, goes, &why);
            }
            Rewrite::Words(name, words) => {
                let parameter = self.scene.node_mut(node).parameters.iter_mut().find(|p| p.name == name);
                if let Some(Parameter { value: Value::String(text), at, .. }) = parameter
                    && let Some((_, new)) = words.iter().find(|(old, _)| text.eq_ignore_ascii_case(old))
                {
                    self.notes.add(format!("{name} \"{text}\" of {tag} \"{plugin}\" is read as \"{new}\"{why}"), at);
                    *text = (*new).to_owned();
                }
            }
            Rewrite::Whole(names) => self.change_numbers(node, names, |value| match value {
                Value::Float(number) if number.fract() == 0.0 && number.abs() < 1e15 => {
                    Some(Value::Integer(*number as i64))
                }
                _ => None,
            }),
            Rewrite::Real(names) => self.change_numbers(node, names, |value| match value {
                Value::Integer(number) => Some(Value::Float(*number as f64)),
                _ => None,
            }),
            Rewrite::With(change) => {
                if let Some(note) = change(self, node) {
                    self.notes.add(note + &why, &at);
                }
            }
        }
    }

    /// True for what stands in a file of 0.x or 2.x.
    fn is_old(&self, node: NodeId) -> bool {
        self.scene.version_at(&self.scene.node(node).at) < [3, 0, 0]
    }

    /// True for what stands in a file of 0.x.
    fn is_ancient(&self, node: NodeId) -> bool {
        self.scene.version_at(&self.scene.node(node).at) < [2, 0, 0]
    }

    fn plugin(&self, node: NodeId) -> &str {
        &self.scene.node(node).plugin
    }

    fn snake_case(&mut self, node: NodeId) {
        let names: Vec<_> = self.scene.node(node).parameters.iter().map(|p| p.name.clone()).collect();
        for (index, old) in names.iter().enumerate() {
            let new = snake_case(old);
            if new != *old && !names.contains(&new) {
                let parameter = &mut self.scene.node_mut(node).parameters[index];
                parameter.name = new;
                let at = parameter.at.clone();
                self.notes.add("names such as \"toWorld\" are read as \"to_world\"", &at);
            }
        }
    }

    fn drop_if(&mut self, node: NodeId, goes: impl Fn(&Parameter) -> bool, why: &str) {
        let target = self.scene.node_mut(node);
        let (tag, plugin) = (target.kind.tag(), target.plugin.clone());
        let (gone, stays) = std::mem::take(&mut target.parameters).into_iter().partition(goes);
        target.parameters = stays;
        let gone: Vec<Parameter> = gone;
        for p in gone {
            self.notes.add(format!("\"{}\" of {tag} \"{plugin}\" is left out{why}", p.name), &p.at);
        }
    }

    fn change_numbers(&mut self, node: NodeId, names: &[&str], change: impl Fn(&Value) -> Option<Value>) {
        for parameter in &mut self.scene.node_mut(node).parameters {
            if names.contains(&parameter.name.as_str())
                && let Some(new) = change(&parameter.value)
            {
                parameter.value = new;
            }
        }
    }

    fn take(&mut self, node: NodeId, name: &str) -> Option<Value> {
        self.scene.node_mut(node).take(name).map(|parameter| parameter.value)
    }

    /// Takes a parameter out if it is a plain number.
    fn take_number(&mut self, node: NodeId, name: &str) -> Option<f64> {
        let number = number(&self.scene.node(node).parameter(name)?.value)?;
        self.scene.node_mut(node).take(name);
        Some(number)
    }

    /// Sets a parameter, at the place of the object itself if it is new.
    fn set(&mut self, node: NodeId, name: &str, value: Value) {
        let target = self.scene.node_mut(node);
        match target.parameters.iter_mut().find(|p| p.name == name) {
            Some(parameter) => parameter.value = value,
            None => {
                let at = target.at.clone();
                target.parameters.push(Parameter { name: name.to_owned(), value, at });
            }
        }
    }

    /// The nested objects of a kind, with the names of the parameters they fill.
    fn children(&self, node: NodeId, kind: ObjectKind) -> Vec<(String, NodeId)> {
        let all = self.scene.children(node);
        all.filter(|(_, child)| self.scene.node(*child).kind == kind)
            .map(|(p, child)| (p.name.clone(), child))
            .collect()
    }

    /// Makes an object a copy of another one; it keeps its id and place.
    fn become_copy_of(&mut self, node: NodeId, other: NodeId) {
        let copy = self.scene.node(other).clone();
        let target = self.scene.node_mut(node);
        target.plugin = copy.plugin;
        target.parameters = copy.parameters;
    }

    /// Adds an object of today next to an old one.
    fn add_beside(&mut self, node: NodeId, kind: ObjectKind, plugin: &str) -> NodeId {
        let mut new = self.scene.node(node).clone();
        (new.kind, new.plugin, new.id, new.parameters) = (kind, plugin.to_owned(), None, Vec::new());
        self.scene.add(new)
    }

    /// Replaces an object that wraps another one by the one inside.
    fn unwrap_child(&mut self, node: NodeId) -> Option<String> {
        let (kind, plugin) = (self.scene.node(node).kind, self.plugin(node).to_owned());
        let (_, child) = self.children(node, kind).into_iter().next()?;
        self.become_copy_of(node, child);
        Some(format!("{} \"{plugin}\" gives way to the \"{}\" inside it", kind.tag(), self.plugin(node)))
    }
}

/// A parameter's value as a number, if it is one.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

/// A parameter's value as a colour, if it is one without a texture or a spectrum.
fn colour(value: &Value) -> Option<[f64; 3]> {
    match value {
        Value::Rgb(colour) => Some(*colour),
        _ => number(value).map(|grey| [grey; 3]),
    }
}

/// A colour as the simplest value: a number if it is grey.
fn colour_value(colour: [f64; 3]) -> Value {
    let [red, green, blue] = colour;
    if red == green && green == blue { Value::Float(red) } else { Value::Rgb(colour) }
}

/// A colour or spectrum times a number.
fn scaled(value: &Value, factor: f64) -> Option<Value> {
    Some(match value {
        Value::Spectrum(SpectrumValue::Uniform(level)) => Value::Spectrum(SpectrumValue::Uniform(level * factor)),
        Value::Spectrum(SpectrumValue::Table(table)) => {
            Value::Spectrum(SpectrumValue::Table(table.iter().map(|(nm, level)| (*nm, level * factor)).collect()))
        }
        Value::Spectrum(SpectrumValue::Blackbody { temperature, scale }) => {
            Value::Spectrum(SpectrumValue::Blackbody { temperature: *temperature, scale: scale * factor })
        }
        Value::Rgb(colour) => Value::Rgb(colour.map(|c| c * factor)),
        _ => Value::Float(number(value)? * factor),
    })
}

/// `toWorld` as `to_world`; names that begin with a capital letter (`B`, `S`) are left alone.
fn snake_case(name: &str) -> String {
    if name.starts_with(|c: char| c.is_ascii_uppercase()) {
        return name.to_owned();
    }
    let mut result = String::with_capacity(name.len() + 4);
    let mut previous = '_';
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && previous.is_ascii_lowercase() {
            result.push('_');
        }
        result.push(letter.to_ascii_lowercase());
        previous = letter;
    }
    result
}
