//! A method: a name and what it changes in a scene. Whatever it does not name stays as the scene has it, but an integrator
//! that is named comes without the guide and other decisions of the scene's own.

use crate::short_form::{decide, parse, plain_value};
use lucerna_core::scene::{Description, Location, Node, ObjectKind, Parameter, Registry, Value};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// Its name, unique in a comparison.
    pub name: String,
    /// The variant of the reference renderer that renders it; Lucerna if none.
    pub variant: Option<String>,
    /// Another integrator.
    pub integrator: Option<Node>,
    /// Decisions nested in the integrator.
    pub decisions: Vec<Node>,
    /// Another sampler.
    pub sampler: Option<Node>,
    /// Values for the scene's `$name`.
    pub defines: Vec<(String, String)>,
}

/// The methods of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Methods {
    /// In the order they take turns.
    pub list: Vec<Method>,
    /// The one that others are measured by.
    pub baseline: Option<String>,
}

/// A file of methods.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(skip_serializing_if = "Option::is_none")]
    baseline: Option<String>,
    method: Vec<Entry>,
}

/// One `[[method]]` of a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    renderer: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    integrator: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sampler: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    guide: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    light_sampler: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    roulette: Option<String>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, toml::Value>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    define: BTreeMap<String, String>,
}

impl Methods {
    /// Of short forms, and of files whose name ends in `.toml`.
    ///
    /// # Errors
    /// If one cannot be read, or two have the same name; one line.
    pub fn parse(texts: &[String]) -> Result<Self, String> {
        let (mut list, mut baseline) = (Vec::new(), None);
        for text in texts {
            if Path::new(text).extension().is_some_and(|e| e == "toml") {
                let failed = |e: &dyn std::fmt::Display| format!("{text}: {}", e.to_string().replace('\n', " "));
                let content = std::fs::read_to_string(text).map_err(|e| failed(&e))?;
                let file: File = toml::from_str(&content).map_err(|e| failed(&located(&content, &e)))?;
                baseline = file.baseline.or(baseline);
                for entry in file.method {
                    list.push(Method::of_entry(entry).map_err(|e| failed(&e))?);
                }
            } else {
                list.push(Method::of_text(text)?);
            }
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = list.iter().find(|m| !names.insert(m.name.clone())) {
            return Err(format!("two methods are called \"{}\"", twice.name));
        }
        match baseline.as_ref().filter(|name| !names.contains(*name)) {
            Some(name) => Err(format!("no method is called \"{name}\", the baseline")),
            None if list.is_empty() => Err("there is no method to compare".to_owned()),
            None => Ok(Methods { list, baseline }),
        }
    }
}

impl Methods {
    /// As a file that [`Methods::parse`] reads.
    pub fn to_toml(&self) -> String {
        let file = File { baseline: self.baseline.clone(), method: self.list.iter().map(Entry::of).collect() };
        // All of it can be written as TOML: there are tables, texts and numbers only.
        toml::to_string(&file).unwrap_or_default()
    }
}

impl Entry {
    fn of(method: &Method) -> Self {
        let value = |value: &Value| match value {
            Value::Integer(v) => toml::Value::Integer(*v),
            Value::Float(v) => toml::Value::Float(*v),
            Value::Boolean(v) => toml::Value::Boolean(*v),
            other => toml::Value::String(plain_text(other)),
        };
        let decision = |kind| method.decisions.iter().find(|node| node.kind == kind).map(short);
        let parameters = method.integrator.iter().flat_map(|node| &node.parameters);
        Entry {
            name: method.name.clone(),
            renderer: method.variant.as_ref().map(|variant| format!("mitsuba:{variant}")),
            integrator: method.integrator.as_ref().map(|node| node.plugin.clone()),
            sampler: method.sampler.as_ref().map(short),
            guide: decision(ObjectKind::Guide),
            light_sampler: decision(ObjectKind::LightSampler),
            roulette: decision(ObjectKind::Roulette),
            parameters: parameters.map(|p| (p.name.clone(), value(&p.value))).collect(),
            define: method.defines.iter().cloned().collect(),
        }
    }
}

/// A plugin in short form.
fn short(node: &Node) -> String {
    let values = node.parameters.iter().map(|p| format!("{}={}", p.name, plain_text(&p.value)));
    let values = values.collect::<Vec<_>>().join(",");
    if values.is_empty() { node.plugin.clone() } else { format!("{}:{values}", node.plugin) }
}

/// Line and message of a mistake in a file.
fn located(content: &str, error: &toml::de::Error) -> String {
    let line = error.span().map(|span| 1 + content[..span.start.min(content.len())].matches('\n').count());
    line.map_or_else(|| error.message().to_owned(), |line| format!("line {line}: {}", error.message()))
}

impl Method {
    /// Of a short form: `path`, `path:max_depth=4,sampler=sobol`, `path+guide=sd_tree:startup=4+light_sampler=power`,
    /// `scene`, `mitsuba:llvm_ad_rgb:path`. A light sampler may also stand among the parameters.
    ///
    /// # Errors
    /// If it is none.
    pub fn of_text(text: &str) -> Result<Self, String> {
        let (variant, rest) = match text.strip_prefix("mitsuba:") {
            Some(rest) => {
                let (variant, rest) = rest.split_once(':').unwrap_or((rest, "scene"));
                (Some(variant.to_owned()), rest)
            }
            None => (None, text),
        };
        let mut parts = rest.split('+');
        let mut node = parse(ObjectKind::Integrator, parts.next().unwrap_or(""), "--methods")?;
        let mut plugin_of = |kind: ObjectKind| match node.take(kind.tag()).map(|p| p.value) {
            Some(Value::String(name)) => Ok(Some(parse(kind, &name, "--methods")?)),
            Some(_) => Err(format!("--methods {text}: {} must be the name of one", kind.tag())),
            None => Ok(None),
        };
        let (sampler, light_sampler) = (plugin_of(ObjectKind::Sampler)?, plugin_of(ObjectKind::LightSampler)?);
        let mut decisions = parts.map(|part| decision(text, part)).collect::<Result<Vec<_>, _>>()?;
        decisions.extend(light_sampler);
        if variant.is_some() && !decisions.is_empty() {
            return Err(format!("--methods {text}: the reference has no such decisions"));
        }
        let names = variant.iter().chain([&node.plugin]).chain(sampler.iter().chain(&decisions).map(|s| &s.plugin));
        if !names.into_iter().all(|name| is_name(name)) {
            return Err(format!(
                "--methods {text}: expected scene, INTEGRATOR, INTEGRATOR:parameter=value,sampler=NAME, INTEGRATOR+guide=NAME, mitsuba:VARIANT:INTEGRATOR, or a .toml file"
            ));
        }
        if node.plugin == "scene" && !node.parameters.is_empty() {
            return Err(format!("--methods {text}: \"scene\" takes no parameters but sampler and light_sampler"));
        }
        let integrator = (node.plugin != "scene").then_some(node);
        Ok(Method { name: text.to_owned(), variant, integrator, decisions, sampler, defines: Vec::new() })
    }

    fn of_entry(entry: Entry) -> Result<Self, String> {
        let mut text = entry.integrator.unwrap_or_else(|| "scene".to_owned());
        if let Some(renderer) = &entry.renderer {
            text = format!("{renderer}:{text}");
        }
        let mut method = Method::of_text(&text)?;
        if let Some(sampler) = entry.sampler {
            method.sampler = Some(parse(ObjectKind::Sampler, &sampler, "sampler")?);
        }
        let guide = entry.guide.map(|text| parse(ObjectKind::Guide, &text, "guide")).transpose()?;
        let light_sampler = entry.light_sampler.map(|text| parse(ObjectKind::LightSampler, &text, "light_sampler"));
        method.decisions.extend(guide);
        method.decisions.extend(light_sampler.transpose()?);
        let roulette = entry.roulette.map(|text| parse(ObjectKind::Roulette, &text, "roulette"));
        method.decisions.extend(roulette.transpose()?);
        if !entry.parameters.is_empty() {
            let node = method.integrator.as_mut().ok_or("parameters need an integrator")?;
            for (name, value) in entry.parameters {
                let value = match value {
                    toml::Value::String(text) => Value::String(text),
                    other => plain_value(&other.to_string()),
                };
                let _ = node.take(&name);
                node.parameters.push(Parameter { name, value, at: node.at.clone() });
            }
        }
        method.name = entry.name;
        method.defines = entry.define.into_iter().collect();
        Ok(method)
    }

    /// What it is, in one line.
    pub fn describe(&self) -> String {
        let mut parts = vec![self.variant.as_ref().map_or("Lucerna".to_owned(), |v| format!("mitsuba {v}"))];
        parts.push(self.integrator.as_ref().map_or("the scene's integrator".to_owned(), short));
        parts.extend(self.decisions.iter().map(|d| format!("{} {}", d.kind.tag(), short(d))));
        parts.extend(self.sampler.as_ref().map(|s| format!("sampler {}", short(s))));
        parts.extend(self.defines.iter().map(|(name, value)| format!("${name} = {value}")));
        parts.join(", ")
    }

    /// Changes a scene. The integrator's parameters that the scene gives stay, if the method does not give them and they
    /// have a meaning for its integrator, but not its guide or other decisions: `path` is not guided, whatever the scene says.
    /// The number of samples per pixel belongs to the comparison.
    ///
    /// # Errors
    /// If the scene has no integrator that makes a decision of the method; one line.
    pub fn apply(&self, description: &mut Description, registry: &Registry) -> Result<(), String> {
        let root = description.root;
        if let Some(wanted) = &self.integrator {
            replace(description, root, wanted, registry);
        }
        if let Some(wanted) = &self.sampler {
            let is_sensor = |node: &Node| node.kind == ObjectKind::Sensor;
            let sensors: Vec<_> =
                (description.children(root).map(|(_, id)| id)).filter(|id| is_sensor(description.node(*id))).collect();
            for sensor in sensors {
                replace(description, sensor, wanted, registry);
            }
        }
        self.decisions.iter().try_for_each(|wanted| decide(description, registry, wanted))
    }
}

/// Puts an object in the place of the parent's own of that kind, whose parameters it takes over.
fn replace(description: &mut Description, parent: lucerna_core::scene::NodeId, wanted: &Node, registry: &Registry) {
    let mut node = wanted.clone();
    let old: Vec<_> = (description.children(parent))
        .filter(|(_, child)| description.node(*child).kind == wanted.kind)
        .map(|(parameter, child)| (parameter.name.clone(), child))
        .collect();
    let known = registry.find(wanted.kind, &wanted.plugin);
    for (_, child) in &old {
        let before = description.node(*child);
        let same = before.plugin == wanted.plugin;
        let stays = |p: &&Parameter| {
            let has_meaning = same || known.is_some_and(|plugin| plugin.param(&p.name).is_some());
            let fits = match p.value {
                Value::Object(id) => same && !DECISIONS.contains(&description.node(id).kind),
                _ => true,
            };
            has_meaning && node.parameter(&p.name).is_none() && fits
        };
        let kept: Vec<Parameter> = before.parameters.iter().filter(stays).cloned().collect();
        node.parameters.extend(kept);
    }
    let at = Location::file("--methods".to_owned());
    let name = format!("_{}", wanted.kind.tag());
    let id = description.add(node);
    let parameters = &mut description.node_mut(parent).parameters;
    parameters.retain(|p| !old.iter().any(|(name, _)| *name == p.name));
    parameters.push(Parameter { name, value: Value::Object(id), at });
}

/// What an integrator may leave to other plugins.
const DECISIONS: [ObjectKind; 4] =
    [ObjectKind::Guide, ObjectKind::LightSampler, ObjectKind::Roulette, ObjectKind::Cache];

/// A decision in short form: `guide=sd_tree:startup=4`.
fn decision(text: &str, part: &str) -> Result<Node, String> {
    let (tag, plugin) = part.split_once('=').unwrap_or((part, ""));
    let kind = DECISIONS.into_iter().find(|kind| kind.tag() == tag);
    let kind = kind.ok_or_else(|| format!("--methods {text}: \"{tag}\" is no decision, such as guide"))?;
    parse(kind, plugin, "--methods")
}

fn plain_text(value: &Value) -> String {
    match value {
        Value::Integer(v) => v.to_string(),
        Value::Float(v) => v.to_string(),
        Value::Boolean(v) => v.to_string(),
        Value::String(v) => v.clone(),
        other => other.type_name().to_owned(),
    }
}

fn is_name(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_forms() {
        let method = Method::of_text("path:max_depth=4,sampler=sobol").unwrap();
        assert_eq!(method.describe(), "Lucerna, path:max_depth=4, sampler sobol");
        let peer = Method::of_text("mitsuba:llvm_ad_rgb:path").unwrap();
        assert_eq!(peer.describe(), "mitsuba llvm_ad_rgb, path");
        let guided = Method::of_text("path:max_depth=4+guide=sd_tree:startup=2").unwrap();
        assert_eq!(guided.describe(), "Lucerna, path:max_depth=4, guide sd_tree:startup=2");
        assert_eq!(Method::of_text("scene").unwrap().integrator, None);
        for wrong in [
            "",
            "path:max_depth",
            "a b",
            "mitsuba:",
            "scene:max_depth=3",
            "path:sampler=3",
            "path+guide",
            "path+bsdf=glass",
        ] {
            let message = Method::of_text(wrong).unwrap_err();
            assert!(message.starts_with("--methods") && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let texts =
            ["scene", "path:max_depth=4,hide_emitters=true,sampler=sobol", "mitsuba:llvm_ad_rgb:path:rr_depth=3"];
        let mut methods = Methods::parse(&texts.map(str::to_owned)).unwrap();
        methods.list[0].defines.push(("power".to_owned(), "1.5".to_owned()));
        methods.list[1].sampler = Some(parse(ObjectKind::Sampler, "sobol:sample_count=16", "").unwrap());
        methods.baseline = Some(texts[1].to_owned());
        let file = std::env::temp_dir().join(format!("lucerna-methods-{}.toml", std::process::id()));
        std::fs::write(&file, methods.to_toml()).unwrap();
        let again = Methods::parse(&[file.display().to_string()]).unwrap();
        std::fs::remove_file(file).unwrap();
        let told = |methods: &Methods| methods.list.iter().map(|m| (m.name.clone(), m.describe())).collect::<Vec<_>>();
        let sorted = |text: &str| {
            let mut parts: Vec<String> = text.split([',', ':']).map(|part| part.trim().to_owned()).collect();
            parts.sort();
            parts
        };
        for ((a, b), (c, d)) in told(&methods).iter().zip(&told(&again)) {
            assert_eq!((a, sorted(b)), (c, sorted(d)));
        }
        assert_eq!(again.baseline, methods.baseline);
    }

    #[test]
    fn names_are_unique() {
        let texts = ["path".to_owned(), "path".to_owned()];
        assert_eq!(Methods::parse(&texts).unwrap_err(), "two methods are called \"path\"");
        assert!(Methods::parse(&[]).is_err());
    }

    /// A scene for `guided_path` compared with `path` would be compared with itself.
    #[test]
    fn an_integrator_that_is_named_comes_without_the_decisions_of_the_scene() {
        let xml = r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/>
            <guide type="sd_tree"/><roulette type="albedo"/></integrator></scene>"#;
        for (text, expected) in [
            ("path", vec![]),
            ("path+roulette=adjoint", vec!["adjoint"]),
            ("path+guide=sd_tree", vec!["sd_tree"]),
            ("scene", vec!["sd_tree", "albedo"]),
        ] {
            let mut scene = lucerna_core::scene::xml::load_str(xml, "t.xml", &Default::default()).unwrap();
            Method::of_text(text).unwrap().apply(&mut scene, &crate::builtin()).unwrap();
            let (_, integrator) = scene.children(scene.root).next().unwrap();
            let found: Vec<&str> = scene.children(integrator).map(|(_, id)| scene.node(id).plugin.as_str()).collect();
            assert_eq!(found, expected, "{text}");
            assert!(scene.node(integrator).parameter("max_depth").is_some(), "{text}");
        }
    }

    #[test]
    fn a_method_keeps_what_it_does_not_name() {
        let xml = r#"<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator></scene>"#;
        for (text, depth) in [("path", Some(6)), ("path:max_depth=3", Some(3)), ("volpath", Some(6)), ("direct", None)]
        {
            let mut scene = lucerna_core::scene::xml::load_str(xml, "t.xml", &Default::default()).unwrap();
            Method::of_text(text).unwrap().apply(&mut scene, &crate::builtin()).unwrap();
            let integrators = scene.children(scene.root).map(|(_, id)| scene.node(id));
            let all: Vec<&Node> = integrators.filter(|node| node.kind == ObjectKind::Integrator).collect();
            assert_eq!(all.len(), 1);
            let found = all[0].parameter("max_depth").map(|p| p.value.clone());
            assert_eq!(found, depth.map(Value::Integer), "{text}");
        }
    }
}
