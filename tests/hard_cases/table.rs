//! The table of hard cases, `tests/hard_cases.md`: what is asked, what the reference does, what was measured here.

use super::support::repository;
use lucerna::core::stats::figures;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Set to 1, this variable makes the test write the table instead of looking at it.
const UPDATE: &str = "LUCERNA_UPDATE_EXPECTED";

const TABLE: &str = "tests/hard_cases.md";

/// A hard case: its number, what is asked of a renderer, and what the reference does. A dash where nobody looked.
type Case = (&'static str, &'static str, &'static str);

const CASES: &[Case] = &[
    ("g01", "closed sphere of triangles, at the origin and 270 000 away: at most 2e-5 of the rays escape", "-"),
    ("g02", "rays aimed at vertices and middles of edges of a closed mesh: none escapes", "-"),
    (
        "g03",
        "rays leaving a hit on a convex shape, sizes and coordinates 1e-8 to 1e8, 1e6 rays: none returns",
        "starts 8.9e-5 (1 + largest coordinate) off the surface, whatever its size",
    ),
    (
        "g04",
        "gaps of 1e-4 at scene sizes 1e-3, 1, 1e6: not blocked by their own ends",
        "its offset closes or skips such gaps",
    ),
    ("g05", "a room 1 wide at 1e5: as at the origin, no black specks", "-"),
    ("g06", "triangles without area: never hit, counted, the tree builds", "-"),
    (
        "g07",
        "shading normal zero, NaN or opposite: the geometric one, no black pixels",
        "a zero one is an error; an opposite one is black in 144 of 256 pixels",
    ),
    ("g08", "no, collapsed or huge texture coordinates: finite tangents", "-"),
    ("g09", "100 000 coincident triangles: at most 4 times the build of others, traversal ends", "-"),
    ("g10", "empty, flat, infinite and huge boxes: valid tree; infinite ones refused", "-"),
    ("g11", "0 to 3 primitives, or lights alone: renders", "-"),
    ("g12", "garbage meshes: no panic; what is not finite is refused", "-"),
    ("g13", "rays with NaN, infinity, no direction or no length: miss", "-"),
    ("g14", "rays in the planes of boxes and triangles: as rays beside", "-"),
    ("g15", "a sphere seen from 1e4 and 1e6 radii: solid angle within 1 %", "-"),
    (
        "g16",
        "radius 0 or negative, scale 0, sheared spheres: errors; mirrored: normals as the reference's",
        "loads scale 0 and stretched spheres without a word",
    ),
    ("g17", "a million instances: at most 300 bytes each; nested and shining ones: errors", "loads them slowly"),
    ("g18", "all tree builders, 20 seeds: hits of brute force, bit for bit", "-"),
    ("g19", "lamp seen from its surface, from inside and from 1e-6 away: finite, densities true", "-"),
    ("s01", "densities of all BSDFs against samples: chi-squared at 0.01", "has such tests"),
    ("s02", "weight times density is the value: relative 1e-4", "-"),
    ("s03", "reciprocity of all that claim it: relative 1e-3", "-"),
    ("s04", "albedos of the reference: within 0.005", "rough models lose energy, `principled` gains up to 59 %"),
    ("s05", "lossless materials in a white furnace, whole integrators, depth 64: 1 within 0.01", "the same"),
    ("s06", "roughness 0 to 1e-3: finite; negative: error", "loads -1"),
    ("s07", "equal, nearly equal and extreme indices: finite; 1: light unchanged; not positive: error", "loads 0"),
    ("s08", "grazing and opposite directions, random numbers at their ends: none or finite", "-"),
    (
        "s09",
        "shading normals tilted by 89 degrees: no light through the surface, no NaN",
        "lets through 5 % (`diffuse`) to 100 % (mirrors) of a lamp behind",
    ),
    (
        "s10",
        "reflectance above 1 or negative: error, clamped with a warning in pictures; NaN texel: error with pixel",
        "error for colours",
    ),
    ("s11", "blends of two different, of smooth and delta, of nested materials: chi-squared", "-"),
    (
        "s12",
        "`twosided` of glass: error; of `twosided`: as one; `mask` of 0 and 1: `null`, and the plain material",
        "error for glass",
    ),
    ("s13", "flat normal and bump maps: as none", "-"),
    ("s14", "anisotropy 0.001 to 1: chi-squared on fine cells", "-"),
    ("e01", "skies of one pixel, black, bright in one pixel, NaN: true densities, never picked, errors", "-"),
    ("e02", "a million lights, one a million times brighter: exact picks, at most 64 bytes each", "-"),
    ("e03", "lights without area or power: never picked, nothing divided by zero", "picks them as the others"),
    ("e04", "spots whose beam is the cutoff, 90 and 180 degrees: finite; 0: error", "loads 0"),
    ("e05", "point light in a surface, in the eye: finite, no brighter than theory", "-"),
    ("e06", "surrounding lights in a scene without extent: finite", "-"),
    ("e07", "textures of 1 x 1 and 65536 x 1, coordinates 1e7 and NaN: finite", "-"),
    (
        "e08",
        "fields of view from 0.001 to 179.9 degrees; 0, 180, near beyond far, degenerate lookat: errors",
        "errors, too",
    ),
    ("e09", "films of one pixel, crops of one pixel, filters wider than the film: right; crops outside: error", "-"),
    ("e10", "films of two million or -5 pixels: error before anything is allocated", "loads, and dies later"),
    ("i", "input files that are damaged or hostile: word for word the expected message, exit code 2", "see below"),
    ("i01", "files that are missing, folders, or not readable: all told in one run", "located error"),
    ("i02", "malformed XML, encodings: located, true messages", "an empty file is \"not there\""),
    ("i03", "document types and entities: refused", "ignored"),
    ("i04", "200 000 nested elements: error at depth 256", "segmentation fault"),
    ("i05", "includes of themselves: error with the chain", "the same"),
    ("i06", "paths out of the folder: nothing of their content is printed, `--root` refuses them", "reads them"),
    ("i07", "numbers that are none: errors", "`nan`, `inf`, `1e400` and nothing load"),
    ("i08", "duplicates, dangling and circular references: errors", "errors, but for attributes"),
    ("i09", "unknown plugins and parameters: error with a suggestion", "error without"),
    ("i10", "parameters that are unused, undefined or recursive: errors", "the same"),
    ("i11", "PLY with false counts: error before anything is allocated", "exhausts memory"),
    ("i12", "PLY with indices out of range: error with the face", "segmentation fault"),
    ("i13", "PLY with negative indices: error", "loads garbage"),
    ("i14", "PLY in all encodings, with polygons and unknown elements: loads", "partly"),
    ("i15", "OBJ with relative and wrong indices, endless lines, large polygons", "partly"),
    ("i16", "`serialized` files damaged or as bombs: error, nothing inflated beyond what is declared", "error"),
    ("i17", "`.vol` files damaged: error", "error"),
    ("i18", "pictures damaged or of impossible size: error before decoding", "error for EXR"),
    ("i19", "meshes without faces, with NaN: errors", "the same"),
    ("i20", "old scenes upgraded, versions missing or unknown: error or warning", "many are rejected"),
    ("i21", "outputs that cannot be written: told before the render", "told after it"),
    ("i22", "files of what was learnt and of where a run stands: damaged, of another scene or run: errors", "has none"),
    ("p01", "what a guide has learnt, in 100 cells, and its mixture with BSDFs: samples as dense as told", "-"),
    ("p02", "records of nothing, of one, of zeros, of 1e30, of one direction: a sound field", "-"),
    (
        "p03",
        "light of lobes from even to 1e8 times as narrow, of 64 lobes, of none: densities that integrate to one",
        "-",
    ),
    ("p04", "positions at 1e18, all in one point: splits end, every point has a leaf", "-"),
    ("p05", "a path of 1000 vertices: all are noted, with the light behind them", "-"),
    ("p06", "guided against not, trained and corrupted, probability 0 and 1: equal means", "-"),
    ("p07", "delta lobes: never guided; the selection probability keeps off both ends", "-"),
    ("p08", "learning with any number of threads: equal bits", "-"),
    ("p09", "iterations that are black or without variance: finite weights, no black picture", "-"),
    ("p11", "the limit of memory: refinement ends, and says so", "-"),
    ("p12", "light from an open sky on diffuse things: variance times rays at most 1.25 times that of unguided", "-"),
    (
        "p14",
        "roulette told of throughputs and light from 0 to 1e30, or of wrong light: answers in [0.05, 20], equal means",
        "-",
    ),
    (
        "p18",
        "a budget below one pass, or a stop while learning: a picture, with its samples told; a time limit is kept",
        "-",
    ),
    ("x01", "any number of threads, any run: equal bits", "-"),
    ("x02", "a run that is interrupted anywhere and goes on: equal bits", "cannot"),
    ("x03", "100 000 samples, 16k x 16k pixels: no limit but memory, which is told before the start", "-"),
    ("x04", "sample counts that do not fit a sampler: rounded with a note; not positive: error", "loads 0"),
    ("x05", "the last of 2^32 samples, dimension 1000: no overflow, no repetition", "-"),
    ("x06", "a million samples: sums drift by less than 1e-5", "-"),
    ("x07", "progress: often and true to 10 %", "-"),
    ("x08", "one sample again: equal bits", "cannot"),
];

/// Names of all tests of hard cases in the sources.
fn tests() -> Vec<String> {
    fn collect(folder: &Path, names: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                collect(&path, names);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).expect("a source file");
                let functions = text.lines().filter_map(|line| line.trim_start().strip_prefix("fn hc_"));
                names
                    .extend(functions.filter_map(|rest| rest.split_once("() {")).map(|(name, _)| format!("hc_{name}")));
            }
        }
    }
    let mut names = Vec::new();
    for folder in ["src", "plugins", "tests"] {
        collect(&repository(folder), &mut names);
    }
    names.sort();
    names
}

/// Whether a name bears a number: `hc_s06_s07_extreme` bears s06 and s07.
fn bears(name: &str, number: &str) -> bool {
    let is_number = |word: &&str| word.chars().skip(1).all(|c| c.is_ascii_digit()) && word.len() != 2;
    name.split('_').skip(1).take_while(is_number).any(|word| word == number)
}

/// How many cases of `scenes/bad` each number has.
fn bad_scenes() -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for entry in std::fs::read_dir(repository("scenes/bad")).expect("a folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        if let Some((number, _)) = name.split_once('_') {
            *counts.entry(number.to_owned()).or_default() += 1;
        }
    }
    counts
}

fn generate() -> String {
    let folder = std::env::var_os(figures::FOLDER).expect("figures to write: see the head of the table");
    let mut text = HEAD.to_owned();
    let (tests, bad) = (tests(), bad_scenes());
    for (number, asked, reference) in CASES {
        let mut cell = Vec::new();
        for test in tests.iter().filter(|test| bears(test, number)) {
            let figure = std::fs::read_to_string(Path::new(&folder).join(test)).unwrap_or_else(|_| "passes".to_owned());
            cell.push(format!("`{test}`: {figure}"));
        }
        if let Some(count) = bad.get(*number) {
            cell.push(format!("`scenes/bad`: {count}"));
        }
        let _ = writeln!(text, "| {} | {asked} | {reference} | {} |", number.to_uppercase(), cell.join("<br>"));
    }
    text
}

const HEAD: &str = "# Hard cases

What is known to break renderers, what is asked, what the reference (Mitsuba 3.9.1) does, and what the tests of this
repository measured. A dash says that nobody looked. A test is found by its name; a number after `scenes/bad` counts the cases in that folder.
`tests/hard_cases/table.rs` holds the first columns and checks that every test is named here. This file is written by

    LUCERNA_FIGURES=$PWD/target/figures cargo test --workspace hc_
    LUCERNA_FIGURES=$PWD/target/figures LUCERNA_UPDATE_EXPECTED=1 cargo test --test hard_cases table

| case | asked | the reference | Lucerna |
|---|---|---|---|
";

#[test]
fn every_test_of_a_hard_case_is_in_the_table_and_no_other() {
    if std::env::var_os(UPDATE).is_some_and(|value| value == "1") {
        std::fs::write(repository(TABLE), generate()).expect("the table");
    }
    let table = std::fs::read_to_string(repository(TABLE)).expect("the table");
    let mut named: Vec<String> = table.split('`').filter(|word| word.starts_with("hc_")).map(str::to_owned).collect();
    named.sort();
    named.dedup();
    assert_eq!(named, tests(), "write the table again: its head tells how");
    let bad = bad_scenes();
    for (number, asked, reference) in CASES {
        let row = format!("| {} | {asked} | {reference} | ", number.to_uppercase());
        let cell = table.lines().find_map(|line| line.strip_prefix(&row));
        let cell = cell.unwrap_or_else(|| panic!("{number} is not in the table as it is here"));
        assert!(cell.starts_with('`'), "{number} has no test");
        let count = bad.get(*number).map_or_else(String::new, |count| format!("`scenes/bad`: {count} |"));
        assert!(cell.ends_with(&count), "{number}: {cell}");
    }
    for name in tests() {
        assert!(CASES.iter().any(|(number, ..)| bears(&name, number)), "{name} bears no number of a case");
    }
}
