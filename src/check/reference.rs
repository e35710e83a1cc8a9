//! The reference renderer's side of a comparison: the `mitsuba` package, run by Python.

use super::key::{digest, scene_hash};
use super::ours::Ours;
use super::{Options, PASSES, Refusal, cache, compared, stored};
use lucerna_core::image::Image;
use lucerna_core::scene::write::{WriteOptions, to_xml};
use lucerna_core::stats::Measured;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

/// What Python runs; `reference/render.py` uses it, too.
const SCRIPT: &str = include_str!("../../reference/passes.py");

/// Names the Python that has the package.
const VARIABLE: &str = "LUCERNA_REFERENCE_PYTHON";

/// Where a reference comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Stored in the repository.
    Stored,
    /// From the cache.
    Cached,
    /// Rendered now.
    Rendered,
}

/// A measured reference.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Mean and variance.
    pub measured: Measured,
    /// Samples per pixel of one pass.
    pub spp: u32,
    /// Seconds of rendering, 0 if not known.
    pub seconds: f64,
    /// Version of the package.
    pub mitsuba: String,
    /// Its variant.
    pub variant: String,
    /// It looked its filter up in a table, as scalar variants do.
    pub tabulated: bool,
    /// Where it comes from.
    pub source: Source,
    /// What is to be said about it.
    pub notes: Vec<String>,
}

/// A Python that has the package.
struct Python {
    program: PathBuf,
    version: String,
}

/// Finds Python once: what the environment variable names, that of the repository, that of the system.
fn python(scene: &Path) -> Result<&'static Python, Refusal> {
    static FOUND: OnceLock<Result<Python, String>> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        if let Some(program) = std::env::var_os(VARIABLE) {
            let program = PathBuf::from(program);
            return ask_version(&program)
                .map(|version| Python { version, program: program.clone() })
                .map_err(|e| format!("{VARIABLE}={}: {e}", program.display()));
        }
        let own = [scene, Path::new(".")].into_iter().filter_map(stored::repository);
        let own = own.map(|root| root.join("reference/.venv/bin/python")).filter(|program| program.exists());
        for program in own.chain(["python3".into(), "python".into()]) {
            if let Ok(version) = ask_version(&program) {
                return Ok(Python { program, version });
            }
        }
        Err(format!(
            "the package mitsuba is needed, and no Python that has it was found (pip install mitsuba; {VARIABLE} names the interpreter)"
        ))
    });
    found.as_ref().map_err(|e| Refusal::Failed(e.clone()))
}

fn ask_version(program: &Path) -> Result<String, String> {
    let mut child = start(program)?;
    send(&mut child, "\n")?;
    let output = child.wait_with_output().map_err(|e| e.to_string())?;
    let answer: Value = serde_json::from_slice(&output.stdout).map_err(|_| "gives no answer".to_owned())?;
    match (answer["mitsuba"].as_str(), answer["error"].as_str()) {
        (Some(version), _) => Ok(version.to_owned()),
        (None, error) => Err(error.unwrap_or("gives no version").to_owned()),
    }
}

fn start(program: &Path) -> Result<Child, String> {
    let mut command = Command::new(program);
    command.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    command.spawn().map_err(|e| e.to_string())
}

fn send(child: &mut Child, text: &str) -> Result<(), String> {
    let mut input = child.stdin.take().ok_or("takes no input")?;
    input.write_all(text.as_bytes()).map_err(|e| e.to_string())
}

/// Ends the interpreter if an answer is given up.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What the interpreter answered.
struct Answer {
    images: Vec<Image>,
    /// Seconds of each.
    times: Vec<f64>,
    variant: String,
    notes: Vec<String>,
    /// What it told at the end of a job that is timed.
    end: Value,
}

/// Pictures that were timed.
pub(crate) struct Timed {
    /// In the order they were asked for.
    pub pictures: Vec<TimedPicture>,
    /// The most memory the process had, in MiB, if the system tells.
    pub peak_mib: Option<f64>,
}

/// A picture that was timed.
pub(crate) struct TimedPicture {
    /// The picture.
    pub image: Image,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Seconds of processor time, of all threads.
    pub cpu: Option<f64>,
}

/// Renders one picture per seed.
fn render(python: &Python, job: &Value, seeds: usize, size: [u32; 2]) -> Result<Answer, String> {
    let mut child = start(&python.program)?;
    send(&mut child, &format!("{job}\n"))?;
    let output = child.stdout.take().ok_or("gives no output")?;
    let _running = Running(child);
    let mut output = BufReader::new(output);
    let mut line = String::new();
    output.by_ref().take(1 << 20).read_line(&mut line).map_err(|e| e.to_string())?;
    let head: Value = serde_json::from_str(&line).map_err(|_| "the reference renderer ended without an answer")?;
    if let Some(error) = head["error"].as_str() {
        return Err(error.to_owned());
    }
    let number = |key: &str| head[key].as_u64().and_then(|v| u32::try_from(v).ok()).unwrap_or(0);
    let [width, height] = ["width", "height"].map(number);
    if [width, height] != size {
        return Err(format!("it renders {width} x {height} pixels, we {} x {}", size[0], size[1]));
    }
    let strings = |key: &str| -> Vec<String> {
        head[key].as_array().into_iter().flatten().filter_map(|v| v.as_str().map(str::to_owned)).collect()
    };
    let channels = strings("channels");
    let values = width as usize * height as usize * channels.len();
    let (mut images, mut times) = (Vec::new(), Vec::new());
    for _ in 0..seeds {
        let mut bytes = vec![0; 8 + 4 * values];
        output.read_exact(&mut bytes).map_err(|_| "the reference renderer ended early".to_owned())?;
        let (time, data) = bytes.split_at(8);
        times.push(time.try_into().map_or(0.0, f64::from_le_bytes));
        let data = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        images.push(Image { width, height, channels: channels.clone(), data });
    }
    let variant = head["variant"].as_str().unwrap_or_default().to_owned();
    let mut line = String::new();
    if job["spp"].is_array() {
        let _ = output.take(1 << 20).read_line(&mut line);
    }
    let end = serde_json::from_str(&line).unwrap_or_default();
    Ok(Answer { images, times, variant, notes: strings("notes"), end })
}

/// The version of the package.
///
/// # Errors
/// If there is none.
pub(crate) fn version(scene: &Path) -> Result<String, String> {
    python(scene).map(|python| python.version.clone()).map_err(|refusal| refusal.text())
}

/// Renders a scene that is given as text for the reference: one picture for each number of samples per pixel, all with one
/// seed, and the time of each.
///
/// # Errors
/// If there is no package, or it cannot render the scene.
pub(crate) fn render_text(
    scene: &Path,
    text: &str,
    variant: &str,
    counts: &[u32],
    seed: u32,
    size: [u32; 2],
) -> Result<Timed, String> {
    let python = python(scene).map_err(|refusal| refusal.text())?;
    let file = TemporaryFile::new(text).map_err(|refusal| refusal.text())?;
    let job = json!({
        "scene": file.1,
        "variant": variant,
        "defines": {},
        "size": null,
        "spp": counts,
        "seeds": vec![seed; counts.len()],
        "threads": rayon::current_num_threads(),
    });
    let answer = render(python, &job, counts.len(), size)?;
    let cpu = |i: usize| answer.end["cpu"][i].as_f64();
    let pictures = answer.images.into_iter().zip(&answer.times).enumerate();
    let pictures = pictures.map(|(i, (image, seconds))| TimedPicture { image, seconds: *seconds, cpu: cpu(i) });
    Ok(Timed { pictures: pictures.collect(), peak_mib: answer.end["peak_mib"].as_f64() })
}

/// A way to hand the scene to the reference.
struct Way {
    /// The text of the converted scene; without it the scene's own file is used.
    converted: Option<String>,
    note: Option<String>,
}

/// The scene's own file, or what `lucerna convert` writes: for scenes older than 2.0, and if the first fails.
fn ways(ours: &Ours, options: &Options) -> Vec<Way> {
    let convert = |note: &str| Way {
        converted: Some(to_xml(&ours.description, &WriteOptions::default())),
        note: Some(format!("the reference rendered what `lucerna convert` writes: {note}")),
    };
    if ours.description.version < [2, 0, 0] {
        vec![convert("it does not read scenes of this version")]
    } else if !options.reading.search_path.is_empty() {
        vec![convert("it knows no other folders to look in")]
    } else {
        vec![Way { converted: None, note: None }, convert("it does not load the scene itself")]
    }
}

/// Renders with the ways in turn until one works; gives its number, too.
fn render_scene(
    ours: &Ours,
    options: &Options,
    variant: &str,
    spp: u32,
    seeds: &[u32],
) -> Result<(usize, Answer), Refusal> {
    let python = python(&ours.path)?;
    let mut failed: Option<String> = None;
    for (number, way) in ways(ours, options).iter().enumerate() {
        let file = match &way.converted {
            Some(text) => TemporaryFile::new(text)?,
            None => TemporaryFile(None, ours.path.clone()),
        };
        let real = file.1.canonicalize().map_err(Refusal::failed)?;
        let own = way.converted.is_none();
        let defines = options.reading.defines.iter().filter(|_| own);
        let job = json!({
            "scene": real,
            "variant": variant,
            "defines": defines.map(|(k, v)| (k.clone(), Value::from(v.clone()))).collect::<serde_json::Map<_, _>>(),
            "size": options.size.filter(|_| own).map(|_| ours.size()),
            "spp": spp,
            "seeds": seeds,
        });
        match render(python, &job, seeds.len(), ours.size()) {
            Ok(answer) => return Ok((number, answer)),
            // The first reason is that of the user's own file.
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    Err(Refusal::Failed(format!("the reference renderer failed: {}", failed.unwrap_or_default())))
}

/// Measures the reference in [`PASSES`] passes, or takes it from the cache.
///
/// # Errors
/// If there is no package, or it cannot render the scene.
pub fn measure(ours: &Ours, options: &Options, spp: u32, seed: u32) -> Result<Reference, Refusal> {
    let python = python(&ours.path)?;
    let ways = ways(ours, options);
    let keys = ways.iter().map(|way| key(ours, options, way, python, spp, seed)).collect::<Result<Vec<_>, _>>()?;
    let told = |mut reference: Reference, number: usize| {
        reference.notes.extend(ways[number].note.clone());
        reference
    };
    for (number, key) in keys.iter().enumerate() {
        if let Some(reference) = cache::load(&options.cache, key) {
            return Ok(told(reference, number));
        }
    }
    let seeds: Vec<u32> = (0..PASSES).map(|pass| seed.wrapping_add(pass)).collect();
    let (number, answer) = render_scene(ours, options, &options.variant, spp, &seeds)?;
    let channels = compared(&answer.images[0].channels);
    let measured = Measured::of(&answer.images, &channels).map_err(Refusal::Failed)?;
    let mut reference = Reference {
        measured,
        spp,
        seconds: answer.times.iter().sum(),
        mitsuba: python.version.clone(),
        tabulated: answer.variant.starts_with("scalar"),
        variant: answer.variant,
        source: Source::Rendered,
        notes: answer.notes,
    };
    if let Err(error) = cache::store(&options.cache, &keys[number], &reference) {
        reference.notes.push(format!("the reference could not be kept in {}: {error}", options.cache.display()));
    }
    Ok(told(reference, number))
}

/// One picture of `scalar_rgb`, and the seconds it took.
///
/// # Errors
/// As [`measure`].
pub fn exact(ours: &Ours, options: &Options, spp: u32, seed: u32) -> Result<(Image, f64), Refusal> {
    let (_, mut answer) = render_scene(ours, options, "scalar_rgb", spp, &[seed])?;
    let image = answer.images.pop().ok_or_else(|| Refusal::failed("the reference gave no picture"))?;
    Ok((image, answer.times.iter().sum()))
}

/// Everything a reference depends on.
fn key(ours: &Ours, options: &Options, way: &Way, python: &Python, spp: u32, seed: u32) -> Result<String, Refusal> {
    let content = scene_hash(&ours.path, &ours.files).map_err(Refusal::Failed)?;
    let what = json!({
        "content": content,
        "converted": way.converted.as_ref().map(|text| digest(text.as_bytes())),
        "defines": options.reading.defines,
        "size": ours.size(),
        "mitsuba": python.version,
        "script": digest(SCRIPT.as_bytes()),
        "variant": options.variant,
        "spp": spp,
        "passes": PASSES,
        "seed": seed,
    });
    Ok(digest(what.to_string().as_bytes()))
}

/// A file that is gone when it is dropped, or one that stays.
struct TemporaryFile(Option<PathBuf>, PathBuf);

impl TemporaryFile {
    fn new(text: &str) -> Result<Self, Refusal> {
        let name = format!("lucerna-check-{}-{}.xml", std::process::id(), &digest(text.as_bytes())[..16]);
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).map_err(|e| Refusal::Failed(format!("{}: {e}", path.display())))?;
        Ok(TemporaryFile(Some(path.clone()), path))
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            let _ = std::fs::remove_file(path);
        }
    }
}
