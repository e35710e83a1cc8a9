//! What all files of a scene share, and the way from file to file.

use super::LoadOptions;
use super::definitions::Definitions;
use super::parser::FileParser;
use super::source;
use crate::scene::error::{Location, SceneError, SceneErrors, did_you_mean};
use crate::scene::notes::Notes;
use crate::scene::{Description, Node, NodeId, ObjectKind, Value, resolve};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How deep includes may nest.
const DEEPEST_INCLUDE: usize = 15;
/// Reading ends after so many errors.
const MOST_ERRORS: usize = 100;

/// Where the main file comes from.
pub(super) enum Main<'a> {
    File(&'a Path),
    Text { text: &'a str, name: &'a str },
}

/// A file that is being read.
struct OpenFile {
    name: Arc<str>,
    /// Where it really is, to notice cycles.
    real: PathBuf,
}

/// The state shared by all files of a scene.
pub(super) struct Loader<'o> {
    pub options: &'o LoadOptions,
    pub definitions: Definitions,
    pub description: Description,
    /// Every id, with the object it names (aliases name the object of their source) and where it was declared.
    pub ids: HashMap<String, (NodeId, Location)>,
    pub aliases: HashMap<String, String>,
    pub errors: Vec<SceneError>,
    pub notes: Notes,
    /// Set when reading ended early, so that what was not seen is not complained about.
    pub gave_up: bool,
    open_files: Vec<OpenFile>,
    /// The place of each `<include>` that led here, outermost first.
    pub include_sites: Vec<Location>,
}

pub(super) fn load(main: Main, options: &LoadOptions) -> Result<Description, SceneErrors> {
    let definitions = Definitions::from_outside(&options.defines)
        .map_err(|wrong| SceneErrors(wrong.into_iter().map(SceneError::anywhere).collect()))?;
    let folder = match main {
        Main::File(path) => path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")),
        Main::Text { .. } => Path::new("."),
    };
    let mut search_path = vec![folder.to_owned()];
    if folder != Path::new(".") {
        search_path.push(PathBuf::from("."));
    }
    search_path.extend(options.search_path.iter().cloned());
    let mut loader = Loader {
        options,
        definitions,
        description: Description {
            nodes: Vec::new(),
            root: NodeId(0),
            version: [0; 3],
            search_path,
            notes: Vec::new(),
            warnings: Vec::new(),
            confined_to: options.root.clone(),
            file_versions: Vec::new(),
            sources: Vec::new(),
        },
        ids: HashMap::new(),
        aliases: HashMap::new(),
        errors: Vec::new(),
        notes: Notes::default(),
        gave_up: false,
        open_files: Vec::new(),
        include_sites: Vec::new(),
    };
    let root = match main {
        Main::File(path) => loader.read_file(path),
        Main::Text { text, name } => loader.read_text(text, name.into(), Path::new(".")),
    };
    loader.finish(root)
}

impl Loader<'_> {
    /// Records an error together with the includes that led to it.
    pub fn error(&mut self, mut error: SceneError) {
        error.chain.extend(self.included_from());
        self.errors.push(error);
        self.gave_up |= self.is_full();
    }

    /// True when so much is wrong that going on helps nobody.
    pub fn is_full(&self) -> bool {
        self.errors.len() >= MOST_ERRORS
    }

    /// The includes that led to the current file, innermost first.
    pub fn included_from(&self) -> Vec<String> {
        self.include_sites.iter().rev().map(|site| format!("included from {site}")).collect()
    }

    /// Reads an included file; gives its root.
    pub fn include(&mut self, filename: &str, folder: &Path, at: &Location) -> Option<NodeId> {
        let beside = folder.join(filename);
        let path = if beside.exists() { Ok(beside) } else { self.description.locate(filename) };
        let path = match path {
            Ok(path) => path,
            Err(reason) => {
                self.error(SceneError::at(at, format!("could not include \"{filename}\"")).hint(reason));
                return None;
            }
        };
        let real = path.canonicalize().unwrap_or_else(|_| path.clone());
        if let Some(first) = self.open_files.iter().position(|file| file.real == real) {
            let mut chain: Vec<&str> = self.open_files[first..].iter().map(|file| &*file.name).collect();
            chain.push(chain[0]);
            let message = format!("circular include detected: {}", chain.join(" -> "));
            self.error(SceneError::at(at, message));
            return None;
        }
        if self.open_files.len() > DEEPEST_INCLUDE {
            self.error(SceneError::at(at, format!("includes are nested deeper than {DEEPEST_INCLUDE}")));
            return None;
        }
        self.include_sites.push(at.clone());
        let root = self.read_file(&path);
        self.include_sites.pop();
        root
    }

    fn read_file(&mut self, path: &Path) -> Option<NodeId> {
        let plain = path.strip_prefix(".").ok().filter(|rest| !rest.as_os_str().is_empty()).unwrap_or(path);
        let name: Arc<str> = plain.display().to_string().into();
        let whole_file = Location::file(Arc::clone(&name));
        let text = self
            .description
            .check_confinement(path)
            .and_then(|()| crate::io::read_bytes(path).map_err(|error| error.message))
            .map_err(|reason| SceneError::at(&whole_file, "could not read the file").hint(reason))
            .and_then(|bytes| source::decode(&bytes, &name));
        match text {
            Ok(text) => {
                self.description.sources.push(path.to_owned());
                let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
                self.open_files.push(OpenFile { name: Arc::clone(&name), real });
                let root = self.read_text(&text, name, path.parent().unwrap_or(Path::new("")));
                self.open_files.pop();
                root
            }
            Err(error) => {
                self.gave_up = true;
                self.error(error);
                None
            }
        }
    }

    fn read_text(&mut self, text: &str, name: Arc<str>, folder: &Path) -> Option<NodeId> {
        // The XML reader would skip byte order marks without counting them.
        let text = text.trim_start_matches('\u{feff}');
        let mut parser = FileParser::new(self, name, folder);
        match parser.run(text) {
            Ok(root) => Some(root),
            Err(fatal) => {
                self.gave_up = true;
                if let Some(error) = fatal {
                    self.error(*error);
                }
                None
            }
        }
    }

    /// Notes that the scene depends on a file that an element names.
    pub fn add_source(&mut self, filename: &str) {
        self.description.sources.extend(self.description.find_file(filename));
    }

    /// Checks that need the whole scene, and the result.
    fn finish(mut self, root: Option<NodeId>) -> Result<Description, SceneErrors> {
        if let Some(root) = root {
            self.description.root = root;
        }
        for node in &mut self.description.nodes {
            for parameter in &mut node.parameters {
                if let Value::Reference(id) = &mut parameter.value
                    && let Some(source) = self.aliases.get(id)
                {
                    id.clone_from(source);
                }
            }
        }
        if !self.gave_up {
            self.check_definitions();
            self.errors.extend(resolve::check(&self.description));
        }
        if self.errors.is_empty() {
            let Description { root, .. } = self.description;
            self.description.file_versions.retain(|(_, version)| *version != self.description.version);
            self.description.notes.extend(self.notes.into_lines());
            debug_assert!((root.0 as usize) < self.description.nodes.len());
            Ok(self.description)
        } else {
            Err(SceneErrors(self.errors))
        }
    }

    fn check_definitions(&mut self) {
        for (name, value, meant) in self.definitions.unused() {
            let mut error = SceneError::anywhere(format!("unused parameter: ${name}={value}"));
            error.hint = Some(match meant {
                Some(meant) => format!("did you mean \"{meant}\"?"),
                None => format!("nothing in the scene refers to ${name}"),
            });
            match self.options.lenient {
                true => self.description.warnings.push(error.to_string()),
                false => self.errors.push(error),
            }
        }
    }

    /// Declares an id.
    pub fn declare(&mut self, id: &str, node: NodeId, at: &Location) {
        match self.ids.get(id) {
            Some((_, first)) => {
                let message = format!("duplicate ID: \"{id}\" (previous was at {first})");
                self.error(SceneError::at(at, message));
            }
            None => {
                self.ids.insert(id.to_owned(), (node, at.clone()));
            }
        }
    }

    /// Declares that `new` means what `id` means.
    pub fn alias(&mut self, id: &str, new: &str, at: &Location) {
        if let Some((_, first)) = self.ids.get(new) {
            let message = format!("alias destination ID \"{new}\" already exists");
            return self.error(SceneError::at(at, message).hint(format!("declared at {first}")));
        }
        match self.ids.get(id) {
            Some(&(node, _)) => {
                let source = self.aliases.get(id).map_or(id, String::as_str).to_owned();
                self.ids.insert(new.to_owned(), (node, at.clone()));
                self.aliases.insert(new.to_owned(), source);
            }
            None => {
                let mut error = SceneError::at(at, format!("alias source ID \"{id}\" not found"));
                let meant = did_you_mean(id, self.ids.keys().map(String::as_str));
                error.hint = meant.map(|meant| format!("did you mean \"{meant}\"?"));
                error.hint.get_or_insert_with(|| "it must be declared before the alias".to_owned());
                self.error(error);
            }
        }
    }

    /// Adds an object to the scene.
    pub fn add(&mut self, kind: ObjectKind, plugin: &str, id: Option<&str>, at: &Location) -> NodeId {
        let node = self.description.add(Node {
            kind,
            plugin: plugin.to_owned(),
            id: id.map(str::to_owned),
            parameters: Vec::new(),
            at: at.clone(),
            included_from: self.included_from(),
        });
        if let Some(id) = id {
            self.declare(id, node, at);
        }
        node
    }
}
