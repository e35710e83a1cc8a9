//! A turn: one run of one method, in a process of its own, so that its memory and its processor time are its own and
//! a method that ends the process ends no other. The process is this program again, with the same arguments and a hidden
//! one, `--turn`, that says which run; it answers on standard output, in lines of JSON, each picture followed by its values.

use super::method::Methods;
use super::subject::{Subject, joined};
use super::{Options, Shot};
use crate::process::peak_memory;
use lucerna_core::image::Image;
use lucerna_core::scene::Registry;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Where turns are taken.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// In this process, which others' work goes on in, too: memory and processor time are not known.
    Here,
    /// In one that is started for each.
    Process {
        /// The program.
        program: PathBuf,
        /// Its arguments, `--turn` aside.
        arguments: Vec<OsString>,
    },
}

/// What is to be done in a turn.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Pictures of so many samples per pixel, with one seed.
    Render {
        /// The numbers, rising.
        counts: Vec<u32>,
        /// The seed.
        seed: u32,
    },
    /// Samples per pixel a second, from a trial of about so many seconds.
    Rate(f64),
    /// Samples per pixel that fit into each of these seconds, from a run of each: what learns has no rate that lasts.
    Fit(Vec<f64>),
}

/// A turn.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Turn {
    /// The scene's file.
    pub scene: PathBuf,
    /// Name of the method.
    pub method: String,
    /// Hash of what is rendered: see [`Subject::key`].
    pub key: String,
    /// What is to be done.
    pub work: Work,
}

/// What came of it.
pub enum Answer {
    /// Pictures, rising in samples.
    Shots(Vec<Shot>),
    /// Samples per pixel a second.
    Rate(f64),
    /// Samples per pixel that fit into each time.
    Fit(Vec<u32>),
}

/// Lines that are longer are no answer.
const LONGEST_LINE: u64 = 1 << 20;

/// Takes a turn in the place the options name.
///
/// # Errors
/// If the method fails, or its process does; one line.
pub fn take(subject: &Subject, turn: &Turn, options: &Options) -> Result<Answer, String> {
    match (&options.place, &turn.work) {
        // A peer has a process of its own anyway.
        (Place::Process { program, arguments }, _) if !subject.is_peer() => ask(program, arguments, turn),
        (_, Work::Rate(seconds)) => super::rate(subject, *seconds).map(Answer::Rate),
        (_, Work::Fit(seconds)) => super::fit(subject, seconds).map(Answer::Fit),
        (_, Work::Render { counts, seed }) => subject.render(counts, *seed).map(Answer::Shots),
    }
}

/// Has a process take the turn.
fn ask(program: &Path, arguments: &[OsString], turn: &Turn) -> Result<Answer, String> {
    let text = serde_json::to_string(turn).map_err(|e| e.to_string())?;
    let child = Command::new(program)
        .args(arguments)
        .arg(format!("--turn={text}"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.map_err(|e| format!("{}: {e}", program.display()))?;
    // Closed with this process, however that ends, which ends the other.
    let _alive = child.stdin.take();
    let (output, errors) = (child.stdout.take().ok_or("no output")?, child.stderr.take().ok_or("no errors")?);
    // What it complains about is read at the same time, so that neither side waits for the other.
    let complaint = std::thread::spawn(move || {
        let mut text = Vec::new();
        let _ = errors.take(LONGEST_LINE).read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    });
    let answer = read(BufReader::new(output));
    let ended = end(&mut child);
    let complaint = joined(&complaint.join().unwrap_or_default());
    match (answer, ended) {
        (Ok(answer), _) => Ok(answer),
        (Err(Some(why)), _) => Err(why),
        (Err(None), why) if complaint.is_empty() => Err(format!("the process of the method {why}")),
        (Err(None), why) => Err(format!("the process of the method {why}: {}", shortened(&complaint, 400))),
    }
}

/// Waits for the end, and says how it came.
fn end(child: &mut Child) -> String {
    match child.wait() {
        Ok(status) if status.success() => "gave no whole answer".to_owned(),
        Ok(status) => format!("ended early ({status})"),
        Err(error) => format!("is lost ({error})"),
    }
}

fn shortened(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}

/// Reads an answer. `Err(None)` if it ends early.
fn read(mut output: impl BufRead) -> Result<Answer, Option<String>> {
    let mut shots: Vec<Shot> = Vec::new();
    loop {
        let mut line = String::new();
        (&mut output).take(LONGEST_LINE).read_line(&mut line).map_err(|_| None)?;
        let head: Value = serde_json::from_str(&line).map_err(|_| None)?;
        if let Some(why) = head["error"].as_str() {
            return Err(Some(why.to_owned()));
        }
        if let Some(rate) = head["rate"].as_f64() {
            return Ok(Answer::Rate(rate));
        }
        if head["fit"].is_array() {
            return serde_json::from_value(head["fit"].clone()).map(Answer::Fit).map_err(|_| None);
        }
        if head["end"] == true {
            let memory = head["peak_mib"].as_f64();
            shots.iter_mut().for_each(|shot| shot.memory = memory);
            shots.sort_by_key(|shot| shot.spp);
            return Ok(Answer::Shots(shots));
        }
        let number = |name: &str| head[name].as_u64().and_then(|v| u32::try_from(v).ok()).ok_or(None);
        let channels: Vec<String> = serde_json::from_value(head["channels"].clone()).map_err(|_| None)?;
        let [width, height] = [number("width")?, number("height")?];
        let mut bytes = vec![0; 4 * width as usize * height as usize * channels.len()];
        output.read_exact(&mut bytes).map_err(|_| None)?;
        let data = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        shots.push(Shot {
            spp: number("spp")?,
            of: number("of")?,
            seconds: head["seconds"].as_f64().ok_or(None)?,
            cpu: head["cpu"].as_f64(),
            memory: None,
            image: Image { width, height, channels, data },
        });
    }
}

/// The other side: takes the turn that `text` says and answers on standard output. Whether that worked is in the answer.
pub fn serve(registry: &Registry, methods: &Methods, options: &Options, text: &str) {
    // Nobody waits for the answer when the input ends. (Nothing is ever sent.)
    std::thread::spawn(|| {
        let _ = std::io::stdin().read(&mut [0]);
        std::process::exit(1);
    });
    let mut output = BufWriter::new(std::io::stdout());
    if let Err(why) = answer(registry, methods, options, text, &mut output) {
        let _ = writeln!(output, "{}", json!({ "error": why }));
    }
    let _ = output.flush();
}

fn answer(
    registry: &Registry,
    methods: &Methods,
    options: &Options,
    text: &str,
    output: &mut (impl Write + Send),
) -> Result<(), String> {
    let turn: Turn = serde_json::from_str(text).map_err(|e| format!("--turn: {e}"))?;
    let method = methods.list.iter().find(|m| m.name == turn.method).ok_or("--turn: no such method")?;
    let subject = Subject::load(registry, &turn.scene, method, options)?;
    if subject.key != turn.key {
        return Err("the scene, its files or the program changed while it was compared".to_owned());
    }
    let failed = |e: std::io::Error| e.to_string();
    match turn.work {
        Work::Rate(seconds) => {
            let rate = super::rate(&subject, seconds)?;
            writeln!(output, "{}", json!({ "rate": rate })).map_err(failed)
        }
        Work::Fit(seconds) => {
            let counts = super::fit(&subject, &seconds)?;
            writeln!(output, "{}", json!({ "fit": counts })).map_err(failed)
        }
        Work::Render { counts, seed } => {
            subject.render_each(&counts, seed, true, &mut |shot| send(output, &shot).map_err(failed))?;
            writeln!(output, "{}", json!({ "end": true, "peak_mib": peak_memory() })).map_err(failed)
        }
    }
}

fn send(output: &mut impl Write, shot: &Shot) -> std::io::Result<()> {
    let Image { width, height, channels, data } = &shot.image;
    let head = json!({
        "spp": shot.spp, "of": shot.of, "seconds": shot.seconds, "cpu": shot.cpu,
        "width": width, "height": height, "channels": channels,
    });
    writeln!(output, "{head}")?;
    let bytes: Vec<u8> = data.iter().flat_map(|v| v.to_le_bytes()).collect();
    output.write_all(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shot(spp: u32) -> Shot {
        let image = Image { width: 2, height: 1, channels: vec!["Y".to_owned()], data: vec![0.5, f32::NAN] };
        Shot { spp, of: 8, seconds: 0.1 * f64::from(spp), cpu: Some(0.3), memory: None, image }
    }

    #[test]
    fn answers_are_read_as_they_were_sent() {
        let mut bytes = Vec::new();
        for spp in [8, 2] {
            send(&mut bytes, &shot(spp)).unwrap();
        }
        assert!(matches!(read(&bytes[..]), Err(None)), "an answer that is cut short is none");
        writeln!(bytes, "{}", json!({ "end": true, "peak_mib": 12.5 })).unwrap();
        let Ok(Answer::Shots(shots)) = read(&bytes[..]) else { panic!("pictures") };
        assert_eq!(
            shots.iter().map(|s| (s.spp, s.of, s.memory)).collect::<Vec<_>>(),
            [(2, 8, Some(12.5)), (8, 8, Some(12.5))]
        );
        assert!(shots[0].image.data[0] == 0.5 && shots[0].image.data[1].is_nan());
        assert!(matches!(read(&b"{\"error\": \"why\"}\n"[..]), Err(Some(why)) if why == "why"));
        assert!(matches!(read(&b"{\"fit\": [3, 9]}\n"[..]), Ok(Answer::Fit(counts)) if counts == [3, 9]));
        assert!(matches!(read(&b"nonsense"[..]), Err(None)));
    }
}
