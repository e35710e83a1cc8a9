//! The language, and what is said about files that do not follow it.

use super::{LoadOptions, load, load_str};
use crate::scene::{Description, Node, NodeId, SpectrumValue, Value, resolve};
use glam::{DMat4, DVec3};
use std::fs;
use std::path::PathBuf;

/// Text in a 3.0.0 scene, starting in line 1 after `<scene version="3.0.0">`.
fn scene(body: &str) -> String {
    format!("<scene version=\"3.0.0\">{body}</scene>")
}

fn defines(list: &[(&str, &str)]) -> LoadOptions {
    let defines = list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
    LoadOptions { defines, ..LoadOptions::default() }
}

#[track_caller]
fn good(body: &str) -> Description {
    load_str(&scene(body), "a.xml", &LoadOptions::default()).unwrap()
}

/// The messages for a whole file.
fn messages_of(text: &str) -> Vec<String> {
    match load_str(text, "a.xml", &LoadOptions::default()) {
        Ok(_) => Vec::new(),
        Err(errors) => errors.0.iter().map(ToString::to_string).collect(),
    }
}

fn messages(body: &str) -> Vec<String> {
    messages_of(&scene(body))
}

fn first_child(description: &Description) -> &Node {
    description.node(description.children(description.root).next().unwrap().1)
}

fn value(body: &str) -> Value {
    let description = good(&format!("<bsdf type=\"x\">{body}</bsdf>"));
    first_child(&description).parameters[0].value.clone()
}

/// A folder for one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let folder = std::env::temp_dir().join(format!("lucerna-xml-{name}-{}", std::process::id()));
        for (file, text) in files {
            let path = folder.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        Folder(folder)
    }

    fn load(&self, file: &str, options: &LoadOptions) -> Result<Description, Vec<String>> {
        let prefix = format!("{}/", self.0.display());
        load(&self.0.join(file), options)
            .map_err(|errors| errors.0.iter().map(|e| e.to_string().replace(&prefix, "")).collect())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn properties() {
    assert_eq!(value("<float name='a' value=' .5 '/>"), Value::Float(0.5));
    assert_eq!(value("<integer name='a' value='+2'/>"), Value::Integer(2));
    assert_eq!(value("<boolean name='a' value='TRUE'/>"), Value::Boolean(true));
    assert_eq!(value("<string name='a' value='x &amp; \\$y'/>"), Value::String("x & $y".into()));
    assert_eq!(value("<point name='a' x='1' y='2' z='3'/>"), Value::Vector([1.0, 2.0, 3.0]));
    assert_eq!(value("<vector name='a' value='4'/>"), Value::Vector([4.0; 3]));
    assert_eq!(value("<rgb name='a' value='0.1,0.2\n 0.3'/>"), Value::Rgb([0.1, 0.2, 0.3]));
    assert_eq!(value("<spectrum name='a' value='2'/>"), Value::Spectrum(SpectrumValue::Uniform(2.0)));
    let table = SpectrumValue::Table(vec![(400.0, 1.0), (500.0, 2.0)]);
    assert_eq!(value("<spectrum name='a' value='400:1, 500:2'/>"), Value::Spectrum(table));
    assert!(matches!(value("<spectrum type='d65'/>"), Value::Object(_)));
}

#[test]
fn objects_get_automatic_names() {
    let d = good("<bsdf type='a' id='m'/><shape type='b'><ref id='m'/><ref id='m' name='x'/><bsdf type='c'/></shape>");
    let shape = d.node(d.children(d.root).nth(1).unwrap().1);
    let names: Vec<_> = shape.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["_arg_0", "x", "_arg_1"]);
    assert_eq!(shape.parameters[0].value, Value::Reference("m".into()));
    assert_eq!(shape.at.to_string(), "a.xml:1:47");
}

#[test]
fn transforms_apply_in_order() {
    let transform = "<transform name='t'><translate x='1'/><scale value='2'/><rotate z='1' angle='90'/></transform>";
    let Value::Transform(m) = value(transform) else { panic!("not a transform") };
    assert!((m.transform_point3(DVec3::ZERO) - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-12);
    assert_eq!(value("<transform name='t'/>"), Value::Transform(DMat4::IDENTITY));
    let huge = messages("<transform name='t'><scale value='1e30'/><scale value='1e30'/></transform>");
    assert_eq!(huge, ["a.xml:1:24: the numbers in the transform \"t\" are too large"]);
}

#[test]
fn parameters_alias_and_forward_references() {
    let body = "<default name='p' value='plastic'/><shape type='s'><ref id='n'/></shape>\
                <bsdf type='rough$p' id='m'/><alias id='m' as='n'/>";
    let mut d = load_str(&scene(body), "a.xml", &LoadOptions::default()).unwrap();
    resolve::resolve(&mut d).unwrap();
    let material = d.children(NodeId(1)).next().unwrap().1;
    assert_eq!(d.node(material).plugin, "roughplastic");
    let mut d = load_str(&scene(body), "a.xml", &defines(&[("p", "conductor")])).unwrap();
    resolve::resolve(&mut d).unwrap();
    assert!(d.nodes.iter().any(|node| node.plugin == "roughconductor"));
}

#[test]
fn includes_and_search_path() {
    let folder = Folder::new(
        "include",
        &[
            ("top.xml", &scene("<path value='lib'/>\n<include filename='sub/a.xml'/><include filename='m.xml'/>")),
            ("sub/a.xml", &scene("<include filename='b.xml'/><float name='lost' value='1'/>")),
            ("sub/b.xml", "<scene version='0.6.0'><bsdf type='diffuse' id='b'/></scene>"),
            ("lib/m.xml", "<bsdf version='3.0.0' type='plastic' id='m'/>"),
            ("lib/s.spd", "# x\n400 1\n700 2\n"),
            ("spd.xml", &scene("<path value='lib'/><bsdf type='x'><spectrum name='r' filename='s.spd'/></bsdf>")),
        ],
    );
    let d = folder.load("top.xml", &LoadOptions::default()).unwrap();
    let plugins: Vec<_> = d.children(d.root).map(|(p, id)| (p.name.as_str(), &*d.node(id).plugin)).collect();
    assert_eq!(plugins, [("_arg_0", "diffuse"), ("_arg_1", "plastic")]);
    let b = d.nodes.iter().find(|node| node.id.as_deref() == Some("b")).unwrap();
    assert_eq!(b.included_from.len(), 2);
    assert!(b.included_from[0].ends_with("sub/a.xml:1:24"), "{:?}", b.included_from);
    assert_eq!(d.version_at(&b.at), [0, 6, 0]);
    assert_eq!(d.search_path[0], folder.0.join("lib"));
    assert_eq!(d.notes.len(), 1, "{:?}", d.notes);
    let d = folder.load("spd.xml", &LoadOptions::default()).unwrap();
    let table = SpectrumValue::Table(vec![(400.0, 1.0), (700.0, 2.0)]);
    assert_eq!(first_child(&d).parameters[0].value, Value::Spectrum(table));
}

#[test]
fn hc_i01_missing_files() {
    let folder = Folder::new("missing", &[("top.xml", &scene("<include filename='x.xml'/><path value='y'/>"))]);
    let errors = folder.load("top.xml", &LoadOptions::default()).unwrap_err();
    assert!(errors[0].starts_with("top.xml:1:24: could not include \"x.xml\" (no such file in "), "{errors:?}");
    assert!(errors[1].starts_with("top.xml:1:51: <path>: could not find the folder \"y\" ("), "{errors:?}");
    let errors = folder.load("nowhere.xml", &LoadOptions::default()).unwrap_err();
    assert_eq!(errors, ["nowhere.xml: could not read the file (no such file or directory)"]);
    let errors = folder.load("", &LoadOptions::default()).unwrap_err();
    assert!(errors[0].ends_with("could not read the file (is a folder, not a file)"), "{errors:?}");
}

#[test]
fn hc_i02_malformed() {
    let cases = [
        ("", "a.xml: the file has no elements: it is no scene"),
        ("<!-- x -->", "a.xml: the file has no elements: it is no scene"),
        (
            "<scene version='3.0.0'>\n <bsdf type='a'>\n</scene>",
            "a.xml:3:1: the file is malformed: </scene> closes <bsdf> of line 2",
        ),
        ("<scene version='3.0.0'>\n <bsdf type='a'>", "a.xml:2:2: the file is malformed: <bsdf> is never closed"),
        (
            "<scene version='3.0.0'>\n</scene></scene>",
            "a.xml:2:9: the file is malformed: close tag </scene> does not match any open tag",
        ),
        (
            "<scene version='3.0.0'><bsdf type='a/></scene>",
            "a.xml:1:24: the file is malformed: attribute value not closed: ' not found before end of input",
        ),
        ("<scene version='3.0.0'/><scene version='3.0.0'/>", "a.xml:1:25: <scene> is a second root; a file has one"),
        ("<float name='a' value='1'/>", "a.xml:1:1: the root must be an object such as <scene>, not <float>"),
        ("<scene version='3.0.0'>&evil;</scene>", "a.xml:1:24: unknown entity &evil;"),
        (
            "<scene version='3.0.0'><bsdf type=a/></scene>",
            "a.xml:1:24: the attributes of element <bsdf> are malformed: a value is not in quotes",
        ),
    ];
    for (text, message) in cases {
        assert_eq!(messages_of(text)[0], message, "{text}");
    }
}

#[test]
fn hc_i03_dtd() {
    let bomb =
        "<?xml version='1.0'?>\n<!DOCTYPE x [<!ENTITY a \"aaa\"><!ENTITY b \"&a;&a;\">]>\n<scene version='3.0.0'/>";
    assert_eq!(messages_of(bomb), ["a.xml:2:1: DTD is not allowed"]);
}

#[test]
fn hc_i04_depth() {
    let deep = format!("<scene version='3.0.0'>{}", "<bsdf type='twosided'>".repeat(200_000));
    assert_eq!(messages_of(&deep), ["a.xml:1:5634: elements are nested deeper than 256"]);
    let chain: String = (0..300).map(|i| format!("<bsdf type='t' id='m{i}'><ref id='m{}'/></bsdf>", i + 1)).collect();
    let errors = messages(&format!("{chain}<bsdf type='d' id='m300'/>"));
    assert!(errors[0].ends_with("objects are nested deeper than 256"), "{errors:?}");
}

#[test]
fn hc_i05_include_cycles_and_depth() {
    let include = |name: &str| scene(&format!("\n<include filename='{name}'/>"));
    let folder = Folder::new(
        "cycle",
        &[("self.xml", &include("self.xml")), ("a.xml", &include("b.xml")), ("b.xml", &include("a.xml"))],
    );
    let errors = |file: &str| {
        folder
            .load(file, &LoadOptions::default())
            .unwrap_err()
            .join("\n")
            .replace(&format!("{}/", folder.0.display()), "")
    };
    assert_eq!(errors("self.xml"), "self.xml:2:1: circular include detected: self.xml -> self.xml");
    assert_eq!(
        errors("a.xml"),
        "b.xml:2:1: circular include detected: a.xml -> b.xml -> a.xml, included from a.xml:2:1"
    );
    let files: Vec<_> = (0..=16).map(|i| (format!("{i}.xml"), include(&format!("{}.xml", i + 1)))).collect();
    let mut files: Vec<(&str, &str)> = files.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let end = scene("");
    files.push(("16.xml", &end));
    let folder = Folder::new("deep", &files);
    let errors = folder.load("0.xml", &LoadOptions::default()).unwrap_err();
    assert!(
        errors[0].starts_with("15.xml:2:1: includes are nested deeper than 15, included from 14.xml:2:1, included"),
        "{errors:?}"
    );
    assert!(folder.load("1.xml", &LoadOptions::default()).is_ok());
}

#[test]
fn hc_i06_confined() {
    let folder =
        Folder::new("root", &[("in/top.xml", &scene("<include filename='../out.xml'/>")), ("out.xml", &scene(""))]);
    let options = LoadOptions { root: Some(folder.0.join("in")), ..LoadOptions::default() };
    let errors = folder.load("in/top.xml", &options).unwrap_err();
    assert!(errors[0].contains("out.xml: could not read the file (files outside of "), "{errors:?}");
    assert!(folder.load("in/top.xml", &LoadOptions::default()).is_ok());
    let d = load_str(&scene(""), "a.xml", &options).unwrap();
    assert!(d.locate("/etc/passwd").unwrap_err().starts_with("files outside of "));
}

#[test]
fn hc_i07_numbers() {
    let errors = messages(
        "\n<shape type='sphere' id='s'>\n<float name='radius' value='nan'/>\n<integer name='n' value='5.0'/>\n\
         <boolean name='b' value='1'/>\n<rgb name='c' value='0.3 0.4'/>\n<point name='p' x='1' y='2'/>\n\
         <rgb name='d' value='#ff0000'/></shape>",
    );
    let inside = ", in shape \"s\" (a.xml:2:1)";
    let expected = [
        "a.xml:3:1: could not parse floating point value \"nan\" (only finite numbers are allowed)",
        "a.xml:4:1: could not parse integer value \"5.0\" (a whole number is needed)",
        "a.xml:5:1: could not parse boolean value \"1\" (must be \"true\" or \"false\")",
        "a.xml:6:1: could not parse RGB value \"0.3 0.4\" (one or three numbers are needed)",
        "a.xml:7:1: missing required attribute \"z\" in <point>",
        "a.xml:8:1: could not parse RGB value \"#ff0000\" (hexadecimal colours are not allowed; give three numbers \
         from 0 to 1)",
    ];
    let expected: Vec<_> = expected.iter().map(|e| format!("{e}{inside}")).collect();
    assert_eq!(errors, expected);
}

#[test]
fn hc_i08_duplicates_and_references() {
    let cases = [
        (
            "<bsdf type='a' id='m'/>\n<bsdf type='a' id='m'/>",
            "a.xml:2:1: duplicate ID: \"m\" (previous was at a.xml:1:24)",
        ),
        (
            "<bsdf type='a'>\n<float name='x' value='1'/><float name='x' value='1'/></bsdf>",
            "a.xml:2:28: property \"x\" was specified multiple times (first at a.xml:2:1), in bsdf of type \"a\" (a.xml:1:24)",
        ),
        ("<bsdf type='a' type='b'/>", "a.xml:1:24: duplicate attribute \"type\" in element <bsdf>"),
        (
            "<bsdf type='a' id='wood'/>\n<shape type='s' id='t'><ref id='wod'/></shape>",
            "a.xml:2:24: unresolved reference to \"wod\" (did you mean \"wood\"?), in shape \"t\" (a.xml:2:1)",
        ),
        (
            "<shape type='s'><ref id='zebra'/></shape>",
            "a.xml:1:40: unresolved reference to \"zebra\" (make sure an object with id=\"zebra\" exists), \
             in shape of type \"s\" (a.xml:1:24)",
        ),
        (
            "<bsdf type='t' id='a'><ref id='b'/></bsdf>\n<bsdf type='t' id='b'><ref id='a'/></bsdf>",
            "a.xml:2:23: circular reference detected: a -> b -> a",
        ),
        ("<bsdf type='t' id='a'><ref id='a'/></bsdf>", "a.xml:1:46: circular reference detected: a -> a"),
        (
            "<alias id='m' as='n'/>",
            "a.xml:1:24: alias source ID \"m\" not found (it must be declared before the alias)",
        ),
        (
            "<bsdf type='t' id='m'/><bsdf type='t' id='n'/><alias id='m' as='n'/>",
            "a.xml:1:70: alias destination ID \"n\" already exists (declared at a.xml:1:47)",
        ),
    ];
    for (body, message) in cases {
        assert_eq!(messages(body), [message], "{body}");
    }
}

#[test]
fn hc_i09_elements_and_attributes() {
    let cases = [
        ("<mode type='x'/>", "a.xml:1:24: encountered an unsupported XML element: <mode>"),
        ("<bdsf type='x'/>", "a.xml:1:24: encountered an unsupported XML element: <bdsf> (did you mean <bsdf>?)"),
        ("<scale x='1'/>", "a.xml:1:24: transform operation <scale> can only appear inside a <transform> tag"),
        (
            "<transform name='t'><lookAt origin='0 0 0' target='0 0 1'/></transform>",
            "a.xml:1:44: unexpected <lookAt> element inside <transform> (did you mean <lookat>?)",
        ),
        ("<float name='a' value='1' unit='m'/>", "a.xml:1:24: unexpected attribute \"unit\" in element <float>"),
        ("<float value='1'/>", "a.xml:1:24: missing required attribute \"name\" in <float>"),
        ("<bsdf/>", "a.xml:1:24: missing required attribute \"type\" in <bsdf>"),
        ("<bsdf typ='x'/>", "a.xml:1:24: unexpected attribute \"typ\" in element <bsdf> (did you mean \"type\"?)"),
        ("<float name='a' value='1'><ref id='a'/></float>", "a.xml:1:50: <ref> cannot stand inside <float>"),
        (
            "<bsdf type='x'><path value='a'/></bsdf>",
            "a.xml:1:39: <path> can only stand directly under the root, in bsdf of type \"x\" (a.xml:1:24)",
        ),
        (
            "<spectrum name='s' value='1 2 3'/>",
            "a.xml:1:24: could not parse spectrum value \"1 2 3\" (give one number, or pairs such as \"400:0.1, 700:0.5\"; a colour is an <rgb>)",
        ),
    ];
    for (body, message) in cases {
        assert_eq!(messages(body)[0], message, "{body}");
    }
}

#[test]
fn hc_i10_parameters() {
    let text = scene("<default name='spp' value='4'/><sampler type='$spq'/>");
    assert_eq!(messages_of(&text), ["a.xml:1:55: undefined parameter: $spq (did you mean \"$spp\"?)"]);
    let text = scene("<default name='a' value='$a'/>");
    assert_eq!(
        messages_of(&text),
        ["a.xml:1:24: undefined parameter: $a (give it a value with -D a=… or with a <default> above)"]
    );
    let text = scene("<default name='spp' value='4'/>");
    let errors = |list: &[_]| load_str(&text, "a.xml", &defines(list)).unwrap_err().to_string();
    assert_eq!(errors(&[("spb", "16")]), "error: unused parameter: $spb=16 (did you mean \"spp\"?)");
    assert_eq!(errors(&[("x", "$x")]), "error: the value of parameter $x refers to another parameter: \"$x\"");
    let lenient = LoadOptions { lenient: true, ..defines(&[("spb", "16")]) };
    let warnings = load_str(&text, "a.xml", &lenient).unwrap().warnings;
    assert_eq!(warnings, ["unused parameter: $spb=16 (did you mean \"spp\"?)"]);
}

#[test]
fn hc_i20_versions() {
    assert_eq!(
        messages_of("<scene/>"),
        ["a.xml:1:1: missing version attribute in root element <scene> (such as version=\"3.0.0\")"]
    );
    assert_eq!(
        messages_of("<scene version='abc'/>"),
        ["a.xml:1:1: invalid version number \"abc\" (three numbers such as \"3.0.0\")"]
    );
    let d = load_str("<scene version='99.0.0'/>", "a.xml", &LoadOptions::default()).unwrap();
    assert_eq!(d.warnings, ["a.xml:1:1: version 99.0.0 is newer than 3.x; the file is read as one of 3.x"]);
    let d = load_str("<scene version='0.5'/>", "a.xml", &LoadOptions::default()).unwrap();
    assert_eq!(d.version, [0, 5, 0]);
}

#[test]
fn hc_i20_old_elements() {
    let text = "<scene version='0.6.0'><mode type='final'/><camera type='perspective'>\
                <transform name='t'><lookAt origin='0 0 0' target='0 0 1' up='0 1 0'/></transform></camera>\
                <bsdf type='x'><srgb name='a' value='#ff8000'/><rgb name='b' value='#ff8000'/>\
                <spectrum name='c' value='1 2 3' intent='illuminant'/><spectrum name='d' value='2'/>\
                <blackbody name='e' temperature='5000K' scale='2'/><animation name='f'>\
                <transform time='0'><translate x='1'/></transform><transform time='1'/></animation></bsdf></scene>";
    let d = load_str(text, "a.xml", &LoadOptions::default()).unwrap();
    let values: Vec<_> = d.nodes[2].parameters.iter().map(|p| p.value.clone()).collect();
    let Value::Rgb([red, green, blue]) = values[0] else { panic!("not a colour") };
    assert!(red == 1.0 && (green - 0.215_861).abs() < 1e-6 && blue == 0.0);
    assert_eq!(values[1], Value::Rgb([1.0, 128.0 / 255.0, 0.0]));
    assert_eq!(values[2], Value::Rgb([1.0, 2.0, 3.0]));
    assert_eq!(values[3], Value::Float(2.0));
    assert_eq!(values[4], Value::Spectrum(SpectrumValue::Blackbody { temperature: 5000.0, scale: 2.0 }));
    assert_eq!(values[5], Value::Transform(DMat4::from_translation(DVec3::X)));
    assert_eq!(d.notes[0], "<mode type=\"final\"> is left out: there is no such element today (a.xml:1:24)");
    assert_eq!(d.notes[1], "<camera> is read as <sensor> (a.xml:1:44)");
    assert_eq!(d.notes.len(), 9, "{:#?}", d.notes);
}

#[test]
fn many_errors_in_one_run() {
    let body = "<float name='a' value='x'/>".repeat(1000);
    assert_eq!(messages(&body).len(), 100);
    let lenient = LoadOptions { lenient: true, ..LoadOptions::default() };
    let d = load_str(&scene("<what><ever/></what><bsdf type='x' y='z'/>"), "a.xml", &lenient).unwrap();
    assert_eq!(
        d.warnings,
        [
            "a.xml:1:24: encountered an unsupported XML element: <what>; it is left out",
            "a.xml:1:44: unexpected attribute \"y\" in element <bsdf>; it is left out"
        ]
    );
}
