//! The elements of one file, turned into nodes. An explicit stack stands for the open elements, so that the depth of a
//! file costs no stack of ours.

use super::attributes::Attributes;
use super::loader::Loader;
use super::numbers::Wrong;
use super::property::{self, OLD_PROPERTIES, PROPERTIES};
use super::source::Cursor;
use super::transform;
use crate::scene::error::{Location, SceneError, did_you_mean};
use crate::scene::{NodeId, ObjectKind, Value};
use glam::DMat4;
use quick_xml::Reader;
use quick_xml::errors::{Error, IllFormedError};
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How deep elements may nest.
const DEEPEST_ELEMENT: usize = 256;
/// Elements that are neither objects nor properties.
const DIRECTIVES: [&str; 5] = ["transform", "default", "include", "path", "alias"];

/// Why reading a file ended early: an error, unless it has been recorded already.
type Fatal = Option<Box<SceneError>>;

/// An element that is open.
enum Frame {
    /// An object, how many of its children have no name, and where each given name was first given.
    Object { node: NodeId, unnamed: u32, names: HashMap<String, Location> },
    /// `<transform>`, composed so far.
    Transform { name: String, matrix: DMat4, at: Location },
    /// `<animation>` of old files: the first of its transforms counts.
    Animation { name: String, first: Option<DMat4>, at: Location },
    /// An element that has no children.
    Leaf(String),
    /// An element that is passed over with all it holds.
    Skipped,
}

/// Reads one file.
pub(super) struct FileParser<'l, 'o> {
    loader: &'l mut Loader<'o>,
    file: Arc<str>,
    folder: PathBuf,
    version: [u32; 3],
    stack: Vec<Frame>,
    /// The place of each open element, for the message that it is never closed.
    opened: Vec<(String, Location)>,
    root: Option<NodeId>,
}

impl<'l, 'o> FileParser<'l, 'o> {
    /// A parser for the file called `file` in messages, whose includes are relative to `folder`.
    pub fn new(loader: &'l mut Loader<'o>, file: Arc<str>, folder: &Path) -> Self {
        let folder = folder.to_owned();
        FileParser { loader, file, folder, version: [3, 0, 0], stack: Vec::new(), opened: Vec::new(), root: None }
    }

    /// Reads the file; gives its root.
    pub fn run(&mut self, text: &str) -> Result<NodeId, Fatal> {
        let mut reader = Reader::from_str(text);
        let mut cursor = Cursor::new(text, Arc::clone(&self.file));
        let fatal = |at: &Location, message: String| Some(Box::new(SceneError::at(at, message)));
        loop {
            let start = reader.buffer_position() as usize;
            match reader.read_event() {
                Ok(Event::Start(element)) => self.open(&element, cursor.locate(start))?,
                Ok(Event::Empty(element)) => {
                    self.open(&element, cursor.locate(start))?;
                    self.close();
                }
                Ok(Event::End(_)) => self.close(),
                Ok(Event::Eof) => break,
                Ok(Event::DocType(_)) => return Err(fatal(&cursor.locate(start), "DTD is not allowed".to_owned())),
                Ok(Event::GeneralRef(entity)) if !entity.is_char_ref() => {
                    let name = entity.into_inner();
                    if !matches!(&*name, "lt" | "gt" | "amp" | "apos" | "quot") {
                        return Err(fatal(&cursor.locate(start), format!("unknown entity &{name};")));
                    }
                }
                Ok(Event::Text(text)) if !text.trim().is_empty() => {
                    self.loader.notes.add("text between elements is ignored", &cursor.locate(start));
                }
                Ok(_) => {}
                Err(error) => {
                    let at = cursor.locate(reader.error_position() as usize);
                    return Err(fatal(&at, self.malformed(&error)));
                }
            }
            if self.loader.is_full() {
                return Err(None);
            }
        }
        if let Some((tag, at)) = self.opened.pop() {
            return Err(fatal(&at, format!("the file is malformed: <{tag}> is never closed")));
        }
        self.root.ok_or_else(|| {
            fatal(&Location::file(Arc::clone(&self.file)), "the file has no elements: it is no scene".to_owned())
        })
    }

    fn malformed(&self, error: &Error) -> String {
        let reason = match (error, self.opened.last()) {
            (Error::IllFormed(IllFormedError::MismatchedEndTag { found, .. }), Some((tag, at))) => {
                format!("</{found}> closes <{tag}> of line {}", at.line)
            }
            (Error::IllFormed(error), _) => error.to_string().replace('`', ""),
            (Error::Syntax(error), _) => error.to_string().replace('`', ""),
            _ => error.to_string(),
        };
        format!("the file is malformed: {reason}")
    }

    /// True in files of 0.x and 2.x.
    fn is_old(&self) -> bool {
        self.version < [3, 0, 0]
    }

    /// Records what is wrong at `at`, and in which object.
    fn wrong(&mut self, at: &Location, (message, hint): (String, Option<String>)) {
        let mut error = SceneError::at(at, message);
        error.hint = hint;
        let object = self.stack.iter().rev().find_map(|frame| match frame {
            Frame::Object { node, .. } => Some(self.loader.description.node(*node)),
            _ => None,
        });
        if let Some(object) = object.filter(|object| object.kind != ObjectKind::Scene) {
            error = error.within(format!("in {} ({})", object.title(), object.at));
        }
        self.loader.error(error);
    }

    fn wrong_value(&mut self, at: &Location, (message, hint): Wrong) {
        self.wrong(at, (message, hint.map(str::to_owned)));
    }

    fn open(&mut self, element: &BytesStart, at: Location) -> Result<(), Fatal> {
        if self.stack.len() >= DEEPEST_ELEMENT {
            let message = format!("elements are nested deeper than {DEEPEST_ELEMENT}");
            return Err(Some(Box::new(SceneError::at(&at, message))));
        }
        let (mut attributes, wrong) = Attributes::read(element, &mut self.loader.definitions);
        let tag = element.name().into_inner();
        self.opened.push((tag.to_owned(), at.clone()));
        let skipped = matches!(self.stack.last(), Some(Frame::Skipped));
        if !skipped {
            for error in wrong {
                self.wrong(&at, error);
            }
        }
        let frame = match (skipped, self.todays_name(tag, &attributes, &at)) {
            (true, _) | (false, None) => Frame::Skipped,
            (false, Some(tag)) => {
                attributes.tag = tag;
                self.element(&attributes, at)?
            }
        };
        self.stack.push(frame);
        Ok(())
    }

    /// The tag as it is called today; `None` for elements of old files that are passed over.
    fn todays_name(&mut self, tag: &str, attributes: &Attributes, at: &Location) -> Option<String> {
        let today = match tag {
            "lookAt" => "lookat",
            "camera" => "sensor",
            "luminaire" => "emitter",
            _ => tag,
        };
        if !self.is_old() || matches!(self.stack.last(), Some(Frame::Skipped)) {
            return Some(tag.to_owned());
        }
        if today != tag {
            self.loader.notes.add(format!("<{tag}> is read as <{today}>"), at);
        } else if !self.is_known(tag) {
            let kind = attributes.get("type").map(|kind| format!(" type=\"{kind}\"")).unwrap_or_default();
            self.loader.notes.add(format!("<{tag}{kind}> is left out: there is no such element today"), at);
            return None;
        }
        Some(today.to_owned())
    }

    fn is_known(&self, tag: &str) -> bool {
        ObjectKind::from_tag(tag).is_some()
            || [&PROPERTIES[..], &OLD_PROPERTIES, &DIRECTIVES, &transform::OPERATIONS].iter().any(|l| l.contains(&tag))
    }

    /// Reads an element that is not passed over.
    fn element(&mut self, attributes: &Attributes, at: Location) -> Result<Frame, Fatal> {
        let tag = attributes.tag.as_str();
        let is_object = match tag {
            "spectrum" => attributes.get("type").is_some(),
            _ => ObjectKind::from_tag(tag).is_some(),
        };
        match self.stack.last() {
            None if !is_object => {
                let message = format!("the root must be an object such as <scene>, not <{tag}>");
                return Err(Some(Box::new(SceneError::at(&at, message))));
            }
            None if self.root.is_some() => {
                let message = format!("<{tag}> is a second root; a file has one");
                return Err(Some(Box::new(SceneError::at(&at, message))));
            }
            Some(Frame::Transform { .. }) => return Ok(self.operation(attributes, &at)),
            Some(Frame::Animation { .. }) if tag == "transform" => {
                let name = attributes.get("name").unwrap_or_default().to_owned();
                return Ok(Frame::Transform { name, matrix: DMat4::IDENTITY, at });
            }
            Some(Frame::Leaf(parent)) => {
                let message = format!("<{tag}> cannot stand inside <{parent}>");
                self.wrong(&at, (message, None));
                return Ok(Frame::Skipped);
            }
            _ => {}
        }
        if is_object {
            return Ok(self.object(attributes, at));
        }
        match tag {
            "transform" | "animation" => return Ok(self.transform(attributes, at)),
            "default" => self.default_value(attributes, &at),
            "include" => self.include(attributes, &at),
            "path" => self.path(attributes, &at),
            "alias" => self.alias(attributes, &at),
            _ if PROPERTIES.contains(&tag) || (self.is_old() && OLD_PROPERTIES.contains(&tag)) => {
                self.property(attributes, &at);
            }
            _ => return Ok(self.unknown(tag, &at)),
        }
        Ok(Frame::Leaf(tag.to_owned()))
    }

    fn unknown(&mut self, tag: &str, at: &Location) -> Frame {
        let (message, hint) = if transform::OPERATIONS.contains(&tag) {
            (format!("transform operation <{tag}> can only appear inside a <transform> tag"), None)
        } else {
            let today = match tag {
                "camera" => Some("sensor"),
                "luminaire" => Some("emitter"),
                _ => None,
            };
            let known = ObjectKind::ALL.iter().map(|kind| kind.tag()).chain(PROPERTIES).chain(DIRECTIVES);
            let meant = today.or_else(|| did_you_mean(tag, known)).map(|meant| format!("did you mean <{meant}>?"));
            (format!("encountered an unsupported XML element: <{tag}>"), meant)
        };
        if self.loader.options.lenient {
            self.loader.description.warnings.push(format!("{at}: {message}; it is left out"));
        } else {
            self.wrong(at, (message, hint));
        }
        Frame::Skipped
    }

    /// Complains about attributes that are not in the list.
    fn expect(&mut self, attributes: &Attributes, allowed: &[&str], at: &Location) {
        let strangers: Vec<_> = attributes.names().filter(|name| !allowed.contains(name)).collect();
        for name in strangers {
            let message = format!("unexpected attribute \"{name}\" in element <{}>", attributes.tag);
            if self.is_old() {
                let note = format!("attribute \"{name}\" of <{}> is left out", attributes.tag);
                self.loader.notes.add(note, at);
            } else if self.loader.options.lenient {
                self.loader.description.warnings.push(format!("{at}: {message}; it is left out"));
            } else {
                let meant = did_you_mean(name, allowed.iter().copied());
                self.wrong(at, (message, meant.map(|meant| format!("did you mean \"{meant}\"?"))));
            }
        }
    }

    /// The value of an attribute that must be there; records an error if it is not.
    fn required<'a>(&mut self, attributes: &'a Attributes, name: &str, at: &Location) -> Option<&'a str> {
        attributes.required(name).map_err(|wrong| self.wrong_value(at, wrong)).ok()
    }

    fn read_version(&mut self, attributes: &Attributes, at: &Location) {
        let tag = &attributes.tag;
        let Some(text) = attributes.get("version") else {
            let message = format!("missing version attribute in root element <{tag}>");
            return self.wrong(at, (message, Some("such as version=\"3.0.0\"".to_owned())));
        };
        let numbers: Option<Vec<u32>> = text.trim().split('.').map(|part| part.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[major, ref rest @ ..]) if rest.len() < 3 => {
                self.version = [major, rest.first().map_or(0, |n| *n), rest.get(1).map_or(0, |n| *n)];
            }
            _ => {
                let message = format!("invalid version number \"{text}\"");
                return self.wrong(at, (message, Some("three numbers such as \"3.0.0\"".to_owned())));
            }
        }
        if self.version >= [4, 0, 0] {
            let warning = format!("{at}: version {text} is newer than 3.x; the file is read as one of 3.x");
            self.loader.description.warnings.push(warning);
        }
        if self.loader.include_sites.is_empty() {
            self.loader.description.version = self.version;
        } else {
            self.loader.description.file_versions.push((Arc::clone(&self.file), self.version));
        }
    }

    fn object(&mut self, attributes: &Attributes, at: Location) -> Frame {
        let kind = ObjectKind::from_tag(&attributes.tag).unwrap_or(ObjectKind::Texture);
        let is_root = self.stack.is_empty();
        if is_root {
            self.read_version(attributes, &at);
        }
        self.expect(
            attributes,
            if is_root { &["type", "id", "name", "version"] } else { &["type", "id", "name"] },
            &at,
        );
        let plugin = match kind {
            ObjectKind::Scene => "",
            _ => self.required(attributes, "type", &at).unwrap_or_default(),
        };
        let id = attributes.get("id").filter(|id| !id.is_empty());
        let node = self.loader.add(kind, plugin, id, &at);
        if is_root {
            self.root = Some(node);
        } else {
            self.attach(attributes.get("name"), Value::Object(node), &at);
        }
        Frame::Object { node, unnamed: 0, names: HashMap::new() }
    }

    /// Gives the innermost object a parameter; one without a name gets an automatic one.
    fn attach(&mut self, name: Option<&str>, value: Value, at: &Location) {
        let Some(Frame::Object { node, unnamed, names }) = self.stack.last_mut() else { return };
        let node = *node;
        let name = match name.filter(|name| !name.is_empty()) {
            Some(name) => name.to_owned(),
            None => {
                *unnamed += 1;
                format!("_arg_{}", *unnamed - 1)
            }
        };
        if let Some(first) = names.get(&name) {
            let hint = format!("first at {first}");
            let message = format!("property \"{name}\" was specified multiple times");
            return self.wrong(at, (message, Some(hint)));
        }
        names.insert(name.clone(), at.clone());
        let parameter = crate::scene::Parameter { name, value, at: at.clone() };
        self.loader.description.node_mut(node).parameters.push(parameter);
    }

    fn property(&mut self, attributes: &Attributes, at: &Location) {
        self.expect(attributes, property::allowed(&attributes.tag), at);
        let name = match attributes.tag.as_str() {
            "ref" => attributes.get("name"),
            _ => match self.required(attributes, "name", at) {
                Some(name) => Some(name),
                None => return,
            },
        };
        if attributes.broken {
            return self.reserve(name, at);
        }
        match property::value(attributes, self.version, &self.loader.description) {
            Ok((value, note)) => {
                if let Some(note) = note {
                    self.loader.notes.add(note, at);
                }
                if let (Value::Spectrum(_), Some(file)) = (&value, attributes.get("filename")) {
                    self.loader.add_source(file);
                }
                self.attach(name, value, at);
            }
            Err(wrong) => {
                self.wrong(at, wrong);
                self.reserve(name, at);
            }
        }
    }

    /// Remembers that a property was given although its value is broken.
    fn reserve(&mut self, name: Option<&str>, at: &Location) {
        if let (Some(Frame::Object { names, .. }), Some(name)) = (self.stack.last_mut(), name) {
            names.entry(name.to_owned()).or_insert_with(|| at.clone());
        }
    }

    fn transform(&mut self, attributes: &Attributes, at: Location) -> Frame {
        if attributes.tag == "animation" && !self.is_old() {
            return self.unknown("animation", &at);
        }
        self.expect(attributes, &["name"], &at);
        let Some(name) = self.required(attributes, "name", &at).map(str::to_owned) else { return Frame::Skipped };
        match attributes.tag.as_str() {
            "animation" => {
                self.loader.notes.add("of an <animation> only the first transform is used", &at);
                Frame::Animation { name, first: None, at }
            }
            _ => Frame::Transform { name, matrix: DMat4::IDENTITY, at },
        }
    }

    fn operation(&mut self, attributes: &Attributes, at: &Location) -> Frame {
        let tag = attributes.tag.as_str();
        if !transform::OPERATIONS.contains(&tag) {
            let meant = did_you_mean(tag, transform::OPERATIONS).map(|meant| format!("did you mean <{meant}>?"));
            self.wrong(at, (format!("unexpected <{tag}> element inside <transform>"), meant));
            return Frame::Skipped;
        }
        self.expect(attributes, transform::allowed(tag), at);
        if attributes.broken {
            return Frame::Leaf(tag.to_owned());
        }
        match transform::operation(tag, attributes) {
            Ok(step) => {
                if let Some(Frame::Transform { matrix, .. }) = self.stack.last_mut() {
                    *matrix = step * *matrix;
                }
            }
            Err(wrong) => self.wrong_value(at, wrong),
        }
        Frame::Leaf(tag.to_owned())
    }

    fn default_value(&mut self, attributes: &Attributes, at: &Location) {
        self.expect(attributes, &["name", "value"], at);
        let name = self.required(attributes, "name", at);
        let value = self.required(attributes, "value", at);
        if let (Some(name), Some(value)) = (name, value) {
            if name.is_empty() {
                return self.wrong(at, ("a parameter needs a name".to_owned(), None));
            }
            let value = Some(value.to_owned()).filter(|_| !attributes.broken);
            self.loader.definitions.default_value(name.to_owned(), value);
        }
    }

    fn include(&mut self, attributes: &Attributes, at: &Location) {
        self.expect(attributes, &["filename", "name"], at);
        if attributes.broken {
            self.loader.gave_up = true;
            return;
        }
        let Some(filename) = self.required(attributes, "filename", at) else { return };
        let folder = self.folder.clone();
        let Some(root) = self.loader.include(filename, &folder, at) else { return };
        let name = attributes.get("name");
        if self.loader.description.node(root).kind != ObjectKind::Scene {
            return self.attach(name, Value::Object(root), at);
        }
        for parameter in std::mem::take(&mut self.loader.description.node_mut(root).parameters) {
            match parameter.value {
                Value::Object(_) | Value::Reference(_) => {
                    let name = Some(parameter.name.as_str()).filter(|name| !name.starts_with("_arg_"));
                    self.attach(name, parameter.value, &parameter.at);
                }
                _ => self.loader.notes.add("properties of an included <scene> are left out", &parameter.at),
            }
        }
    }

    fn path(&mut self, attributes: &Attributes, at: &Location) {
        self.expect(attributes, &["value"], at);
        if attributes.broken {
            return;
        }
        if self.stack.len() != 1 {
            return self.wrong(at, ("<path> can only stand directly under the root".to_owned(), None));
        }
        let Some(value) = self.required(attributes, "value", at) else { return };
        let beside = self.folder.join(value);
        let found = if beside.is_dir() { Ok(beside) } else { self.loader.description.locate(value) };
        match found {
            Ok(folder) if folder.is_dir() => self.loader.description.search_path.insert(0, folder),
            Ok(_) => self.wrong(at, (format!("<path>: \"{value}\" is not a folder"), None)),
            Err(reason) => self.wrong(at, (format!("<path>: could not find the folder \"{value}\""), Some(reason))),
        }
    }

    fn alias(&mut self, attributes: &Attributes, at: &Location) {
        self.expect(attributes, &["id", "as"], at);
        let id = self.required(attributes, "id", at);
        if let (Some(id), Some(new)) = (id, self.required(attributes, "as", at)) {
            self.loader.alias(id, new, at);
        }
    }

    fn close(&mut self) {
        self.opened.pop();
        match self.stack.pop() {
            Some(Frame::Transform { name, matrix, at }) => match self.stack.last_mut() {
                Some(Frame::Animation { first, .. }) => {
                    first.get_or_insert(matrix);
                }
                _ if !matrix.as_mat4().is_finite() => {
                    let message = format!("the numbers in the transform \"{name}\" are too large");
                    self.wrong(&at, (message, None));
                }
                _ => self.attach(Some(&name), Value::Transform(matrix), &at),
            },
            Some(Frame::Animation { name, first, at }) => {
                self.attach(Some(&name), Value::Transform(first.unwrap_or_default()), &at);
            }
            _ => {}
        }
    }
}
