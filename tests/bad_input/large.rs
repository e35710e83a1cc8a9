//! Bad scenes that are too large to be kept as files.

use crate::REFUSED;
use crate::run::{Folder, Run, report_slowest, scene};
use flate2::{Compression, write::ZlibEncoder};
use std::fs;
use std::io::Write;
use std::path::Path;

/// Runs the scene in a folder of its own, beside a file with a name and a content.
fn render(name: &'static str, xml: &str, beside: Option<(&str, &[u8])>) -> Run {
    let folder = Folder::new(name);
    fs::write(folder.0.join("scene.xml"), xml).unwrap();
    if let Some((file, content)) = beside {
        fs::write(folder.0.join(file), content).unwrap();
    }
    let arguments = ["--spp", "1", "-q"].map(str::to_owned);
    let run = Run::render(&folder.0, Path::new("scene.xml"), Path::new("out.exr"), arguments);
    assert_eq!(run.broken(), None, "{name}");
    assert_eq!(folder.0.join("out.exr").exists(), run.code == Some(0), "{name}");
    let runs = [(name, run)];
    report_slowest(&runs);
    let [(_, run)] = runs;
    run
}

#[track_caller]
fn refused(run: &Run, message: &str) {
    assert_eq!((run.errors.trim_end(), run.code), (message, Some(REFUSED)));
}

fn mesh(kind: &str) -> String {
    let file = format!("mesh.{kind}");
    scene(&format!("<shape type=\"{kind}\">\n<string name=\"filename\" value=\"{file}\"/>\n</shape>\n"))
}

#[test]
fn hc_i04_two_hundred_thousand_nested_elements() {
    let depth = 200_000;
    let (open, close) = ("<shape type=\"shapegroup\">".repeat(depth), "</shape>".repeat(depth));
    // The root is level 1, so the 256th group is level 257; each tag has 25 letters, the root's 23.
    let message = "error: scene.xml:1:6399: elements are nested deeper than 256";
    let run = render("nested", &format!("<scene version=\"3.0.0\">{open}{close}</scene>"), None);
    refused(&run, message);
    let run = render("nested-unclosed", &format!("<scene version=\"3.0.0\">{open}"), None);
    refused(&run, message);
}

#[test]
fn hc_i04_a_wide_scene_is_told_its_last_line() {
    let count = 100_000;
    let xml = scene(&("<shape type=\"sphere\"/>\n".repeat(count) + "<wrong/>\n"));
    let run = render("wide", &xml, None);
    refused(&run, "error: scene.xml:100005:1: encountered an unsupported XML element: <wrong>");
}

#[test]
fn hc_i02_a_value_of_ten_megabytes_is_not_repeated() {
    let value = "1".repeat(10_000_000) + "x";
    let xml = scene(&format!("<shape type=\"sphere\">\n<float name=\"radius\" value=\"{value}\"/>\n</shape>\n"));
    let run = render("attribute", &xml, None);
    let start = "error: scene.xml:6:1: could not parse floating point value \"1111111";
    assert!(run.errors.starts_with(start) && run.errors.len() < 400, "{:.500}", run.errors);
    assert_eq!(run.code, Some(REFUSED));
}

/// Each default is ten times the one before it: replaced without end, this would be 10¹¹ letters.
#[test]
fn hc_i10_parameters_do_not_grow() {
    let default = |i: usize| match i {
        0 => "<default name=\"p0\" value=\"1\"/>\n".to_owned(),
        _ => format!("<default name=\"p{i}\" value=\"{}\"/>\n", format!("$p{}", i - 1).repeat(10)),
    };
    let defaults: String = (0..12).map(default).collect();
    let sphere = "<shape type=\"sphere\">\n<float name=\"radius\" value=\"$p11\"/>\n</shape>\n";
    let run = render("growth", &scene(&(defaults + sphere)), None);
    assert!(run.errors.len() < 2000, "{:.500}", run.errors);
    assert_eq!(run.code, Some(REFUSED), "{}", run.errors);
}

#[test]
fn hc_i15_lines_of_a_million_letters() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let text = format!("{triangle}# {}\nf 1 2 {}\n", "x".repeat(1_000_000), "9".repeat(1_000_000));
    let run = render("long-line", &mesh("obj"), Some(("mesh.obj", text.as_bytes())));
    refused(
        &run,
        "error: scene.xml:6:1: \"mesh.obj\": line 5: vertex 1099511627776 does not exist (3 so far), in shape of type \
         \"obj\"",
    );
}

#[test]
fn hc_i15_a_polygon_of_two_hundred_corners_loads() {
    let vertices: String = (0..200).map(|i| format!("v {i} {} 0\n", i * i)).collect();
    let corners: String = (1..=200).map(|i| format!(" {i}")).collect();
    let run = render("polygon", &mesh("obj"), Some(("mesh.obj", format!("{vertices}f{corners}\n").as_bytes())));
    assert_eq!((run.errors.as_str(), run.code), ("", Some(0)));
}

/// A mesh of one triangle, followed by a gigabyte of zeros in a megabyte: only what is declared is inflated.
#[test]
fn hc_i16_a_bomb_is_not_inflated() {
    let mut packer = ZlibEncoder::new(vec![0x1C, 0x04, 4, 0], Compression::fast());
    packer.write_all(&0x1000u32.to_le_bytes()).unwrap();
    packer.write_all(b"m\0").unwrap();
    packer.write_all(&[3u64, 1].map(u64::to_le_bytes).concat()).unwrap();
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32];
    packer.write_all(&corners.map(f32::to_le_bytes).concat()).unwrap();
    packer.write_all(&[0u32, 1, 2].map(u32::to_le_bytes).concat()).unwrap();
    let zeros = vec![0; 1 << 20];
    (0..1 << 10).for_each(|_| packer.write_all(&zeros).unwrap());
    let mut file = packer.finish().unwrap();
    file.extend(0u64.to_le_bytes());
    file.extend(1u32.to_le_bytes());
    let run = render("bomb", &mesh("serialized"), Some(("mesh.serialized", &file)));
    assert_eq!((run.errors.as_str(), run.code), ("", Some(0)));
}
