//! Finds the further quantities among the properties of an element, by name.

use super::header::Element;
use crate::io::MeshAttribute;

/// What the properties of one element mean.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Attributes {
    /// Names and channels; no data yet.
    pub attributes: Vec<MeshAttribute>,
    /// Property, attribute and channel within it.
    pub channels: Vec<(usize, usize, usize)>,
}

impl Attributes {
    /// Groups the properties of `element`; `prefix` is `vertex` or `face`.
    pub fn find(element: &Element, prefix: &str) -> Self {
        let mut found = Attributes::default();
        let scalar = |name: &str| element.properties.iter().position(|p| p.name == name && p.length.is_none());
        for names in [["red", "green", "blue", "alpha"], ["r", "g", "b", "a"]] {
            let color: Vec<usize> = names.iter().map_while(|name| scalar(name)).collect();
            if color.len() >= 3 {
                found.add(format!("{prefix}_color"), &color);
                break;
            }
        }
        for property in &element.properties {
            let Some((stem, suffix)) = property.name.rsplit_once('_') else { continue };
            // A group is recognised by its first member; texture coordinates and the like have other suffixes.
            let (suffixes, name) = match suffix {
                "r" => (["r", "g", "b", "a"], format!("{prefix}_{stem}_color")),
                "x" => (["x", "y", "z", "w"], format!("{prefix}_{stem}")),
                "0" => (["0", "1", "2", "3"], format!("{prefix}_{stem}")),
                _ if property.name.starts_with(prefix) && stem.starts_with(prefix) => {
                    let is_member = matches!(suffix, "g" | "b" | "a" | "y" | "z" | "w" | "1" | "2" | "3");
                    if let (false, Some(at)) = (is_member, scalar(&property.name)) {
                        found.add(property.name.clone(), &[at]);
                    }
                    continue;
                }
                _ => continue,
            };
            let members: Vec<usize> = suffixes.iter().map_while(|s| scalar(&format!("{stem}_{s}"))).collect();
            if !members.is_empty() {
                found.add(name, &members);
            }
        }
        found
    }

    fn add(&mut self, name: String, properties: &[usize]) {
        if self.attributes.iter().any(|other| other.name == name) {
            return;
        }
        let slot = self.attributes.len();
        self.channels.extend(properties.iter().enumerate().map(|(channel, &property)| (property, slot, channel)));
        self.attributes.push(MeshAttribute { name, channels: properties.len() as u32, data: Vec::new() });
    }
}
