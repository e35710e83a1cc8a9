//! A [`Description`] as an XML file of version 3.0.
//!
//! Includes and parameters are gone, shared objects are written once and referred to, transforms are one matrix each.
//! By default the file is meant for the reference renderer, too: what it does not have is replaced or left out, with a
//! comment in its place.

use super::description::{Description, NodeId, ObjectKind, Parameter, SpectrumValue, Value};
use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

/// How a scene is written.
#[derive(Clone, Debug)]
pub struct WriteOptions {
    /// Leave out or replace what the reference renderer does not know: guides and the other decisions, our samplers
    /// and integrators.
    pub for_reference: bool,
    /// The folder the text will be saved in: file names become relative to it. Without it they become absolute.
    pub folder: Option<PathBuf>,
}

impl Default for WriteOptions {
    fn default() -> Self {
        WriteOptions { for_reference: true, folder: None }
    }
}

/// The integrators of the reference.
const REFERENCE_INTEGRATORS: [&str; 10] =
    ["path", "direct", "volpath", "volpathmis", "ptracer", "depth", "aov", "moment", "stokes", "prb"];
/// The samplers of the reference.
const REFERENCE_SAMPLERS: [&str; 5] = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler"];
/// Vectors that are places.
const POINTS: [&str; 6] = ["center", "position", "origin", "target", "p0", "p1"];

/// Writes a resolved, upgraded scene. The result loads to the same objects and parameters, but for what
/// [`for_reference`](WriteOptions::for_reference) replaces.
pub fn to_xml(description: &Description, options: &WriteOptions) -> String {
    let top_level = description.children(description.root).map(|(_, child)| child).collect();
    let mut writer = Writer { scene: description, options, ids: names(description), top_level, text: String::new() };
    writer.text.push_str("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
    writer.object(description.root, None, 0);
    writer.text
}

struct Writer<'d> {
    scene: &'d Description,
    options: &'d WriteOptions,
    /// The id of each object that has or needs one, and whether it has been written.
    ids: HashMap<NodeId, (String, bool)>,
    /// Objects directly under the root are written there, and referred to from everywhere else.
    top_level: HashSet<NodeId>,
    text: String,
}

/// The ids of all objects that have one, and new ones for objects used more than once.
fn names(description: &Description) -> HashMap<NodeId, (String, bool)> {
    let all = || (0..description.nodes.len() as u32).map(NodeId);
    let taken: HashSet<&str> = description.nodes.iter().filter_map(|node| node.id.as_deref()).collect();
    let mut uses: HashMap<NodeId, u32> = HashMap::new();
    for (_, child) in all().flat_map(|node| description.children(node)) {
        *uses.entry(child).or_default() += 1;
    }
    let mut number = 0;
    let mut named = HashMap::new();
    for node in all() {
        let id = match &description.node(node).id {
            Some(id) => id.clone(),
            None if uses.get(&node).is_some_and(|uses| *uses > 1) => loop {
                number += 1;
                let id = format!("{}_{number}", description.node(node).kind.tag());
                if !taken.contains(id.as_str()) {
                    break id;
                }
            },
            None => continue,
        };
        named.insert(node, (id, false));
    }
    named
}

impl Writer<'_> {
    fn line(&mut self, depth: usize, text: &str) {
        let _ = writeln!(self.text, "{:1$}{text}", "", 4 * depth);
    }

    fn comment(&mut self, depth: usize, text: &str) {
        self.line(depth, &format!("<!-- {} -->", text.replace("--", "- -")));
    }

    /// Writes an object, or a reference if it has its place elsewhere. The depth of objects is bounded by
    /// [`resolve`](super::resolve::DEEPEST_OBJECT).
    fn child(&mut self, parent: NodeId, parameter: &Parameter, child: NodeId, depth: usize) {
        let name = (!parameter.name.starts_with("_arg_")).then_some(parameter.name.as_str());
        let elsewhere = parent != self.scene.root && self.top_level.contains(&child);
        match self.ids.get_mut(&child) {
            Some((id, written)) if *written || elsewhere => {
                let reference = format!("<ref{}{}/>", attribute("name", name), attribute("id", Some(id)));
                self.line(depth, &reference);
            }
            id => {
                if let Some((_, written)) = id {
                    *written = true;
                }
                self.object(child, name, depth);
            }
        }
    }

    fn object(&mut self, id: NodeId, name: Option<&str>, depth: usize) {
        let node = self.scene.node(id);
        let tag = node.kind.tag();
        if self.options.for_reference && is_decision(node.kind) {
            return self.comment(depth, &format!("{tag} \"{}\" is left out: the reference has none", node.plugin));
        }
        let plugin = self.replacement(id).map_or(node.plugin.as_str(), |new| {
            self.comment(depth, &format!("{tag} \"{}\" in the original: the reference has none", node.plugin));
            new
        });
        let mut head = format!("<{tag}");
        if id == self.scene.root {
            head.push_str(" version=\"3.0.0\"");
        }
        head.push_str(&attribute("type", (!plugin.is_empty()).then_some(plugin)));
        head.push_str(&attribute("name", name));
        head.push_str(&attribute("id", self.ids.get(&id).map(|(id, _)| id.as_str())));
        let replaced_integrator = node.kind == ObjectKind::Integrator && plugin != node.plugin;
        let keeps = |p: &&Parameter| {
            !replaced_integrator || ["max_depth", "rr_depth", "hide_emitters"].contains(&p.name.as_str())
        };
        let parameters: Vec<&Parameter> = node.parameters.iter().filter(keeps).collect();
        if parameters.is_empty() {
            return self.line(depth, &(head + "/>"));
        }
        self.line(depth, &(head + ">"));
        for parameter in parameters {
            match &parameter.value {
                Value::Object(child) => self.child(id, parameter, *child, depth + 1),
                value => self.property(&parameter.name, value, depth + 1),
            }
        }
        self.line(depth, &format!("</{tag}>"));
    }

    /// What stands for a plugin that the reference does not have.
    fn replacement(&self, id: NodeId) -> Option<&'static str> {
        let node = self.scene.node(id);
        let known: &[&str] = match node.kind {
            ObjectKind::Sampler => &REFERENCE_SAMPLERS,
            ObjectKind::Integrator => &REFERENCE_INTEGRATORS,
            _ => return None,
        };
        if !self.options.for_reference || known.contains(&node.plugin.as_str()) {
            return None;
        }
        let has_medium = || self.scene.nodes.iter().any(|node| node.kind == ObjectKind::Medium);
        Some(match node.kind {
            ObjectKind::Sampler => "independent",
            _ if has_medium() => "volpath",
            _ => "path",
        })
    }

    fn property(&mut self, name: &str, value: &Value, depth: usize) {
        let line = |tag: &str, value: &str| {
            format!("<{tag}{}{}/>", attribute("name", Some(name)), attribute("value", Some(value)))
        };
        let text = match value {
            Value::Float(number) => line("float", &decimal(*number)),
            Value::Integer(number) => line("integer", &number.to_string()),
            Value::Boolean(truth) => line("boolean", &truth.to_string()),
            Value::String(file) if name == "filename" || name == "file" => line("string", &self.file_name(file)),
            Value::String(text) => line("string", text),
            Value::Vector(vector) => {
                let tag = if POINTS.contains(&name) { "point" } else { "vector" };
                line(tag, &list(vector))
            }
            Value::Rgb(colour) => line("rgb", &list(colour)),
            Value::Spectrum(SpectrumValue::Uniform(level)) => line("spectrum", &decimal(*level)),
            Value::Spectrum(SpectrumValue::Table(table)) => line("spectrum", &pairs(table)),
            Value::Spectrum(SpectrumValue::Blackbody { temperature, scale }) => {
                self.comment(depth, &format!("black body of {temperature} K times {scale}"));
                line("spectrum", &pairs(&planck(*temperature, *scale)))
            }
            Value::Transform(matrix) => {
                self.line(depth, &format!("<transform{}>", attribute("name", Some(name))));
                let rows = matrix.transpose().to_cols_array();
                self.line(depth + 1, &format!("<matrix{}/>", attribute("value", Some(&list(&rows)))));
                "</transform>".to_owned()
            }
            Value::Reference(id) => {
                let name = (!name.starts_with("_arg_")).then_some(name);
                format!("<ref{}{}/>", attribute("name", name), attribute("id", Some(id)))
            }
            Value::Object(_) => return,
        };
        self.line(depth, &text);
    }

    /// A file name that is right from the folder of the output. A file that does not exist keeps its name.
    fn file_name(&self, name: &str) -> String {
        let Some(found) = self.scene.find_file(name) else { return name.to_owned() };
        let absolute = |path: &Path| path.canonicalize().ok().or_else(|| std::path::absolute(path).ok());
        let Some(file) = absolute(&found) else { return name.to_owned() };
        let relative = self.options.folder.as_deref().and_then(absolute).map(|folder| relative(&file, &folder));
        relative.unwrap_or(file).display().to_string()
    }
}

fn is_decision(kind: ObjectKind) -> bool {
    matches!(kind, ObjectKind::Guide | ObjectKind::LightSampler | ObjectKind::Roulette | ObjectKind::Cache)
}

/// The way from an absolute folder to an absolute file.
fn relative(file: &Path, folder: &Path) -> PathBuf {
    let common = file.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

/// ` name="value"` with everything escaped that means something in XML or in the scene language.
fn attribute(name: &str, value: Option<&str>) -> String {
    let Some(value) = value else { return String::new() };
    let mut escaped = String::with_capacity(value.len());
    for letter in value.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '$' => escaped.push_str("\\$"),
            '\n' | '\r' | '\t' => {
                let _ = write!(escaped, "&#{};", u32::from(letter));
            }
            _ => escaped.push(letter),
        }
    }
    format!(" {name}=\"{escaped}\"")
}

/// The shortest decimal that reads back as the same number.
fn decimal(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        size if (1e-5..1e15).contains(&size) => number.to_string(),
        _ => format!("{number:e}"),
    }
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|number| decimal(*number)).collect::<Vec<_>>().join(" ")
}

fn pairs(table: &[(f64, f64)]) -> String {
    table.iter().map(|(nm, value)| format!("{}:{}", decimal(*nm), decimal(*value))).collect::<Vec<_>>().join(", ")
}

/// The radiance of a black body in W·m⁻²·sr⁻¹·nm⁻¹ (Planck's law, CODATA 2018 constants) times `scale`, every 10 nm
/// over the range that the reference integrates.
fn planck(temperature: f64, scale: f64) -> Vec<(f64, f64)> {
    const PLANCK: f64 = 6.626_070_15e-34;
    const LIGHT: f64 = 299_792_458.0;
    const BOLTZMANN: f64 = 1.380_649e-23;
    let radiance = |nm: f64| {
        let lambda = nm * 1e-9;
        let per_metre = 2.0 * PLANCK * LIGHT * LIGHT
            / (lambda.powi(5) * (PLANCK * LIGHT / (lambda * BOLTZMANN * temperature)).exp_m1());
        per_metre * 1e-9
    };
    (36..=83).map(|ten| f64::from(ten) * 10.0).map(|nm| (nm, scale * radiance(nm))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{resolve, upgrade, xml};
    use super::*;

    fn load(text: &str) -> Description {
        let mut description = xml::load_str(text, "a.xml", &xml::LoadOptions::default()).unwrap();
        resolve::resolve(&mut description).unwrap();
        upgrade::upgrade(&mut description);
        description
    }

    #[test]
    fn writes_what_it_read() {
        let text = r#"<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
    <bsdf type="diffuse" id="a&amp;&quot;b">
        <rgb name="reflectance" value="0.1 1e-7 0.3"/>
        <string name="price" value="5\$"/>
    </bsdf>
    <shape type="sphere">
        <float name="radius" value="2"/>
        <point name="center" value="1 2 3"/>
        <transform name="to_world">
            <matrix value="1 2 3 4 5 6 7 8 9 10 11 12 0 0 0 1"/>
        </transform>
        <ref id="a&amp;&quot;b"/>
        <texture type="checkerboard" name="x" id="texture_1"/>
        <ref name="y" id="texture_1"/>
        <spectrum name="s" value="400:1, 500:2"/>
    </shape>
</scene>
"#;
        assert_eq!(to_xml(&load(text), &WriteOptions::default()), text);
    }

    #[test]
    fn replaces_what_the_reference_lacks() {
        let text = "<scene version='3.0.0'><integrator type='path_graph'><integer name='max_depth' value='5'/>\
                    <integer name='k' value='5'/><guide type='sd_tree'/></integrator>\
                    <sampler type='sobol'/></scene>";
        let description = load(text);
        let written = to_xml(&description, &WriteOptions::default());
        let expected = "    <!-- integrator \"path_graph\" in the original: the reference has none -->\n    \
                        <integrator type=\"path\">\n        <integer name=\"max_depth\" value=\"5\"/>\n    \
                        </integrator>\n    <!-- sampler \"sobol\" in the original: the reference has none -->\n    \
                        <sampler type=\"independent\"/>\n";
        assert!(written.contains(expected), "{written}");
        let ours = to_xml(&description, &WriteOptions { for_reference: false, folder: None });
        assert!(ours.contains("<guide type=\"sd_tree\"/>") && ours.contains("type=\"sobol\""), "{ours}");
    }

    #[test]
    fn relative_names_lead_back() {
        let way = |file, folder| relative(Path::new(file), Path::new(folder)).display().to_string();
        assert_eq!(way("/a/b/c.obj", "/a/b"), "c.obj");
        assert_eq!(way("/a/b/c.obj", "/a/x/y"), "../../b/c.obj");
    }

    /// Wien's law: a body of 5000 K is brightest at 579.6 nm, with 4.095e-6 · T⁵ W·m⁻²·sr⁻¹·m⁻¹.
    #[test]
    fn black_bodies_follow_planck() {
        let table = planck(5000.0, 2.0);
        let (nm, peak) = table.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert_eq!(nm, 580.0);
        assert!((peak / (2.0 * 4.095_7e-6 * 5000f64.powi(5) * 1e-9) - 1.0).abs() < 1e-3, "{peak}");
    }
}
