//! Every plugin is in a table, builds from its own manual, says what its table says, and reads what its table offers.

use lucerna::core::math::DMat4;
use lucerna::core::scene::param::{Default as ParamDefault, ParamType};
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{
    Description, NodeId, ObjectKind, Param, Parameter, Plugin, Registry, Value, instantiate, resolve, trace_reads,
    upgrade,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One plugin's source: the file, or the `mod.rs` of a folder.
struct Source {
    /// Name of the kind's folder, such as `bsdfs`.
    folder: String,
    /// Name of the file without its ending, or of the folder.
    name: String,
    /// The lines of the head comment without `//!`.
    manual: Vec<String>,
}

/// All files and folders below `plugins/` that hold a plugin.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("plugins");
    let mut found = Vec::new();
    for kind in entries(&root).into_iter().filter(|path| path.is_dir()) {
        for path in entries(&kind) {
            let file = if path.is_dir() { path.join("mod.rs") } else { path.clone() };
            let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
            if file.extension().is_none_or(|e| e != "rs") || !file.exists() || ["mod", "tests"].contains(&&*stem) {
                continue;
            }
            let text = std::fs::read_to_string(&file).expect("source can be read");
            if text.contains("const PLUGIN: Plugin") {
                let manual = text.lines().map_while(|line| line.strip_prefix("//!"));
                let manual = manual.map(|line| line.strip_prefix(' ').unwrap_or(line).to_owned()).collect();
                let folder = kind.file_name().expect("a name").to_string_lossy().into_owned();
                found.push(Source { folder, name: stem, manual });
            }
        }
    }
    assert!(!found.is_empty());
    found
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths
}

/// The kind whose plugins live in a folder: its tag in the plural.
fn kind_of(folder: &str) -> ObjectKind {
    ObjectKind::from_tag(folder.trim_end_matches('s')).unwrap_or_else(|| panic!("plugins/{folder} is of no kind"))
}

impl Source {
    fn title(&self) -> String {
        format!("plugins/{}/{}", self.folder, self.name)
    }

    fn kind(&self) -> ObjectKind {
        kind_of(&self.folder)
    }

    fn plugin<'r>(&self, registry: &'r Registry) -> &'r Plugin {
        registry.find(self.kind(), &self.name).unwrap_or_else(|| panic!("{} is in no table", self.title()))
    }

    /// The text of the one XML example.
    fn example(&self) -> String {
        let blocks: Vec<String> = self
            .manual
            .split(|line| line.starts_with("```xml"))
            .skip(1)
            .map(|rest| rest.iter().take_while(|line| *line != "```").map(|line| format!("{line}\n")).collect())
            .collect();
        assert_eq!(blocks.len(), 1, "{}: the manual must hold one example", self.title());
        blocks[0].clone()
    }

    /// Rows of the parameter table, as (parameter, default). Nested objects have no names and are left out.
    fn rows(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        let lines = self.manual.iter().filter(|line| line.starts_with('|')).skip(2);
        for line in lines {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let [name, _, default, meaning] = cells[..] else { panic!("{}: {line}: not four cells", self.title()) };
            if name.starts_with("nested") || name.starts_with("(nested)") {
                continue;
            }
            assert!(!meaning.is_empty(), "{}: {line}: no meaning", self.title());
            let names: Vec<&str> = name.split(", ").map(|n| n.trim_matches('`')).collect();
            let default = default.replace('`', "");
            let shared: Vec<&str> = default.split(", ").collect();
            for (i, name) in names.iter().enumerate() {
                let own = if shared.len() == names.len() { shared[i] } else { &default };
                rows.push(((*name).to_owned(), own.to_owned()));
            }
        }
        rows
    }
}

/// A scene around the example, upgraded and with its references joined, and the node the manual is about.
fn described(source: &Source) -> (Description, NodeId) {
    let example = source.example();
    let around = match source.kind() {
        ObjectKind::Film | ObjectKind::Sampler => ["<sensor type='perspective'>", "</sensor>"],
        ObjectKind::Guide => ["<integrator type='path'>", "</integrator>"],
        ObjectKind::Rfilter => ["<sensor type='perspective'><film type='hdrfilm'>", "</film></sensor>"],
        _ => ["", ""],
    };
    let group = match source.name.as_str() {
        "instance" => "<shape type='shapegroup' id='tree'><shape type='sphere'/></shape>",
        _ => "",
    };
    let [open, close] = around;
    let text = format!("<scene version='3.9.1'>{group}{open}{example}{close}</scene>");
    let options = LoadOptions { search_path: vec![assets()], ..LoadOptions::default() };
    let described = || {
        let mut description = load_str(&text, &source.title(), &options)?;
        resolve::resolve(&mut description)?;
        upgrade::upgrade(&mut description);
        Ok::<_, lucerna::core::scene::SceneErrors>(description)
    };
    let description = described().unwrap_or_else(|e| panic!("{}: {e}", source.title()));
    let node = (0..description.nodes.len() as u32)
        .map(NodeId)
        .find(|id| description.node(*id).kind == source.kind() && description.node(*id).plugin == source.name)
        .unwrap_or_else(|| panic!("{}: the example does not show the plugin", source.title()));
    (description, node)
}

/// Our small files, and the names they have in the examples.
const ASSETS: [(&str, &str); 6] = [
    ("textures/sky.exr", "museum.exr"),
    ("textures/picture.jpg", "wood.jpg"),
    ("meshes/vase.obj", "meshes/teapot.obj"),
    ("meshes/vase_little.ply", "meshes/bunny.ply"),
    ("meshes/vase_ascii.ply", "tree.ply"),
    ("meshes/two.serialized", "room.serialized"),
];

/// A folder with small files under the names that the examples use, made once.
fn assets() -> PathBuf {
    static FOLDER: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    FOLDER.get_or_init(make_assets).clone()
}

fn make_assets() -> PathBuf {
    let ours = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/assets");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugin-examples");
    std::fs::create_dir_all(folder.join("meshes")).expect("a folder for temporary files");
    for (ours_name, name) in ASSETS {
        std::fs::copy(ours.join(ours_name), folder.join(name)).unwrap_or_else(|e| panic!("{ours_name}: {e}"));
    }
    folder
}

#[test]
fn every_plugin_file_is_in_the_table_of_its_kind() {
    let registry = lucerna::builtin();
    let sources = sources();
    for source in &sources {
        assert_eq!(source.plugin(&registry).name, source.name, "{}: named after its XML type", source.title());
    }
    assert_eq!(sources.len(), registry.all().count(), "a table names a plugin that has no file of its own");
}

#[test]
fn every_plugin_builds_from_its_manual() {
    let registry = lucerna::builtin();
    for source in sources() {
        let (description, _) = described(&source);
        if let Err(errors) = instantiate(&registry, description, false) {
            panic!("{}: {errors}", source.title());
        }
    }
}

/// How many plugins of a kind have a group of parameters: what more than half of them share is explained once, in the
/// kind's `mod.rs`.
fn is_common(registry: &Registry, kind: ObjectKind, group: &[Param]) -> bool {
    let sharing = registry.of_kind(kind).filter(|p| p.params.contains(&group)).count();
    sharing > 1 && 2 * sharing > registry.of_kind(kind).count()
}

/// Whether a manual's word for a default means that of the table.
fn means(word: &str, param: &Param) -> bool {
    let number = |text: &str| match text.split_once('/') {
        Some((a, b)) => Some(a.parse::<f64>().ok()? / b.parse::<f64>().ok()?),
        None => text.parse::<f64>().ok(),
    };
    match param.default {
        // What happens then is told in words.
        ParamDefault::Unset if param.ty == ParamType::Any => true,
        ParamDefault::Unset => !word.is_empty() && word != "required" && number(word).is_none(),
        ParamDefault::Number(v) => number(word) == Some(v),
        _ => word == param.default_text(),
    }
}

#[test]
fn manuals_agree_with_tables() {
    let registry = lucerna::builtin();
    let mut wrong = Vec::new();
    for source in sources() {
        let (plugin, title) = (source.plugin(&registry), source.title());
        let rows = source.rows();
        for (name, default) in &rows {
            match plugin.param(name) {
                None => wrong.push(format!("{title}: \"{name}\" is in the manual but not in the table")),
                Some(param) if !means(default, param) => {
                    let table = param.default_text();
                    wrong.push(format!("{title}: \"{name}\": the manual says \"{default}\", the table \"{table}\""));
                }
                Some(_) => {}
            }
        }
        let own = plugin.params.iter().filter(|group| !is_common(&registry, source.kind(), group));
        for param in own.flat_map(|group| group.iter()) {
            let silent = matches!(param.ty, ParamType::Child(..) | ParamType::Any);
            if !silent && !rows.iter().any(|(name, _)| name == param.name) {
                wrong.push(format!("{title}: \"{}\" is in the table but not in the manual", param.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A value that the table allows and that is not the default, where there is a choice.
fn some_value(param: &Param) -> Value {
    let (low, high) = match (param.min.is_finite(), param.max.is_finite()) {
        (true, true) => (param.min, param.max),
        (true, false) => (param.min, param.min + 2.0),
        (false, true) => (param.max - 2.0, param.max),
        (false, false) => (0.0, 1.0),
    };
    let middle = 0.5 * (low + high);
    match param.ty {
        ParamType::Float => Value::Float(middle),
        ParamType::Integer => Value::Integer((low + 1.0).min(high) as i64),
        ParamType::Boolean => Value::Boolean(param.default != ParamDefault::Boolean(true)),
        ParamType::Choice(words) => Value::String(words[words.len() - 1].to_owned()),
        ParamType::String | ParamType::File => Value::String("1".to_owned()),
        ParamType::Vector => Value::Vector([0.0, 0.0, 1.0]),
        ParamType::Transform => Value::Transform(DMat4::IDENTITY),
        ParamType::Rgb(_) | ParamType::Color(_) | ParamType::Scalar(_) => Value::Float(0.5),
        ParamType::Ior => Value::Float(1.25),
        ParamType::Any | ParamType::Child(..) => unreachable!("these are not read by name"),
    }
}

/// Whether a constructor gets a parameter by its name, and not as one of its children or never.
fn read_by_name(param: &Param) -> bool {
    !matches!(param.ty, ParamType::Any | ParamType::Child(..))
}

/// The description with a parameter of the node set, if it is not already.
fn with(description: &Description, node: NodeId, param: &Param) -> Description {
    let mut description = description.clone();
    if description.node(node).parameter(param.name).is_none() {
        let at = description.node(node).at.clone();
        let parameter = Parameter { name: param.name.to_owned(), value: some_value(param), at };
        description.node_mut(node).parameters.push(parameter);
    }
    description
}

#[test]
fn constructors_read_what_tables_offer() {
    let registry = lucerna::builtin();
    let mut unread: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for source in sources() {
        let (plugin, kind) = (source.plugin(&registry), source.kind());
        let (example, node) = described(&source);
        for param in plugin.all_params().filter(|param| read_by_name(param)) {
            let description = with(&example, node, param);
            let is_read = |description: &Description| {
                let reads = trace_reads(&registry, description);
                let reads = reads.unwrap_or_else(|e| panic!("{}: \"{}\": {e}", source.title(), param.name));
                reads.contains(&(kind, plugin.name, param.name))
            };
            // Some count only where another is set, too.
            let beside_another = || {
                plugin
                    .all_params()
                    .filter(|other| read_by_name(other))
                    .any(|other| is_read(&with(&description, node, other)))
            };
            if !is_read(&description) && !beside_another() {
                unread.entry(source.title()).or_default().push(param.name);
            }
        }
    }
    assert!(unread.is_empty(), "parameters that nobody reads: {unread:#?}");
}
