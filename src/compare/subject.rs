//! A scene as one method renders it.

use super::method::Method;
use super::{Options, Shot};
use crate::check::key::{digest, scene_hash};
use crate::check::reference;
use crate::pictures::{Source, one_line, read};
use crate::process::processor_seconds;
#[cfg(doc)]
use lucerna_core::interfaces::Sampler;
use lucerna_core::render::{Budget, Control, FilmStore, PassEnd, RenderContext};
use lucerna_core::scene::write::{WriteOptions, to_xml};
use lucerna_core::scene::{ObjectKind, Parameter, Registry, Scene, Value, instantiate};
use serde_json::json;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

/// Memory of the largest picture in MiB, as of `render`.
const MOST_MIB: u64 = 16_384;

/// A scene, changed by a method and ready to be rendered.
pub struct Subject {
    path: PathBuf,
    /// Our scene. For a peer it tells the size and how its sampler rounds; its integrator need not be one of ours.
    scene: Scene,
    peer: Option<Peer>,
    /// Hash of all that the pictures depend on, the seed and the number of samples aside.
    pub key: String,
}

struct Peer {
    variant: String,
    text: String,
}

impl Subject {
    /// Reads the scene and changes it.
    ///
    /// # Errors
    /// If that cannot be done; one line.
    pub fn load(registry: &Registry, path: &Path, method: &Method, options: &Options) -> Result<Self, String> {
        let mut reading = options.reading.clone();
        for (name, value) in &method.defines {
            reading.defines.retain(|(known, _)| known != name);
            reading.defines.push((name.clone(), value.clone()));
        }
        let Source { mut description, files } = read(path, &reading).map_err(|e| one_line(&e))?;
        let content = scene_hash(path, &files)?;
        method.apply(&mut description, registry)?;
        if let Some(size) = options.size {
            description.resize_films(size, "--size");
        }
        let for_reference = method.variant.is_some();
        let text = to_xml(&description, &WriteOptions { for_reference, folder: None });
        let peer = match &method.variant {
            Some(variant) => {
                for node in method.integrator.iter().chain(&method.sampler).chain(&method.decisions) {
                    if !text.contains(&format!("type=\"{}\"", node.plugin)) {
                        return Err(format!("the reference has no {} \"{}\"", node.kind.tag(), node.plugin));
                    }
                }
                // Its integrators may be others than ours.
                let root = description.root;
                let known = |p: &Parameter| match p.value {
                    Value::Object(id) => {
                        let node = &description.nodes[id.0 as usize];
                        node.kind != ObjectKind::Integrator || registry.find(node.kind, &node.plugin).is_some()
                    }
                    _ => true,
                };
                let kept = description.node(root).parameters.iter().filter(|p| known(p)).cloned().collect();
                description.node_mut(root).parameters = kept;
                Some(Peer { variant: variant.clone(), text: text.clone() })
            }
            None => None,
        };
        let scene = instantiate(registry, description, reading.lenient).map_err(|e| one_line(&e))?.scene;
        if scene.sensors().is_empty() {
            return Err("the scene has no sensor".to_owned());
        }
        if scene.integrator().is_none() && peer.is_none() {
            return Err("the scene has no integrator".to_owned());
        }
        let film = scene.sensors()[0].film.settings().crop_size;
        let needed =
            scene.integrator().map_or_else(|| FilmStore::bytes(film, 0), |integrator| integrator.bytes(film)) >> 20;
        if needed > MOST_MIB {
            return Err(format!(
                "the picture needs {needed} MiB, the limit is {MOST_MIB} MiB (--size makes it smaller)"
            ));
        }
        let renderer = match &peer {
            Some(peer) => format!("{} {}", peer.variant, reference::version(path)?),
            None => program().to_owned(),
        };
        let key = json!({ "content": content, "text": text, "renderer": renderer });
        Ok(Subject { path: path.to_owned(), scene, peer, key: digest(key.to_string().as_bytes()) })
    }

    /// Width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.scene.sensors()[0].film.settings().crop_size.to_array()
    }

    /// The largest number of samples per pixel that the sampler can take and is not above `most`, or the least it can.
    pub fn counts_up_to(&self, most: u32) -> u32 {
        let sampler = &self.scene.sensors()[0].sampler;
        let (mut low, mut high) = (0, most);
        while low < high {
            let middle = high - (high - low) / 2;
            if sampler.round_spp(middle) <= most {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        sampler.round_spp(low.max(1))
    }

    /// Whether another renderer renders it.
    pub fn is_peer(&self) -> bool {
        self.peer.is_some()
    }

    /// Whether the picture of fewer samples can be taken from a run on its way: see [`Sampler::is_sequence`]. What learns
    /// plans for the samples it will have.
    pub fn is_sequence(&self) -> bool {
        self.peer.is_none() && !self.learns() && self.scene.sensors()[0].sampler.is_sequence()
    }

    /// Whether samples depend on those before, and so does their speed.
    pub fn learns(&self) -> bool {
        self.peer.is_none() && self.scene.integrator().is_some_and(|integrator| integrator.estimator().is_none())
    }

    /// Samples per pixel of a run that the clock ends.
    ///
    /// # Errors
    /// If the renderer gives up; one line.
    pub fn samples_in(&self, seconds: f64, seed: u32) -> Result<u32, String> {
        let integrator = self.scene.integrator().ok_or("the scene has no integrator")?;
        let (camera, channels) = (&self.scene.sensors()[0], integrator.aov_names());
        let control = Control::new().with_deadline(seconds);
        let mut cx = RenderContext::new(&self.scene, camera, Budget::Seconds(seconds), seed, &control, channels);
        Ok(integrator.render(&mut cx).map_err(|e| joined(&e.0))?.spp)
    }

    /// Renders pictures with one seed and these numbers of samples per pixel.
    ///
    /// # Errors
    /// If the renderer gives up; one line.
    pub fn render(&self, counts: &[u32], seed: u32) -> Result<Vec<Shot>, String> {
        let mut shots = Vec::new();
        self.render_each(counts, seed, false, &mut |shot| {
            shots.push(shot);
            Ok(())
        })?;
        shots.sort_by_key(|shot| shot.spp);
        Ok(shots)
    }

    /// As [`render`](Self::render), handing each picture over as soon as it is there, in no order. `alone`: no other work is
    /// done in this process, whose processor time is the run's.
    ///
    /// # Errors
    /// As [`render`](Self::render), or what `take` gives.
    pub fn render_each(&self, counts: &[u32], seed: u32, alone: bool, take: Take<'_>) -> Result<(), String> {
        let Some(peer) = &self.peer else {
            let mut left = counts.to_vec();
            while let Some(most) = left.iter().copied().max() {
                let seen = self.render_here(&left, most, seed, alone, take)?;
                left.retain(|spp| !seen.contains(spp));
            }
            return Ok(());
        };
        let answer = reference::render_text(&self.path, &peer.text, &peer.variant, counts, seed, self.size());
        let answer = answer.map_err(|e| joined(&e))?;
        for (timed, spp) in answer.pictures.into_iter().zip(counts) {
            let (image, seconds, cpu) = (timed.image, timed.seconds, timed.cpu);
            take(Shot { spp: *spp, of: *spp, seconds, cpu, memory: answer.peak_mib, image })?;
        }
        Ok(())
    }

    /// One run of `most` samples per pixel; the pictures of fewer are taken on the way where the sampler and the passes
    /// allow it. Gives what was taken.
    fn render_here(
        &self,
        counts: &[u32],
        most: u32,
        seed: u32,
        alone: bool,
        take: Take<'_>,
    ) -> Result<Vec<u32>, String> {
        let integrator = self.scene.integrator().ok_or("the scene has no integrator")?;
        let camera = &self.scene.sensors()[0];
        let channels = integrator.aov_names();
        let early = |spp: u32| self.is_sequence() && spp < most && counts.contains(&spp);
        let clock = alone.then(ProcessorClock::start);
        let state = Mutex::new((Vec::new(), Ok(()), take, clock));
        let look = |pass: PassEnd<'_>| {
            if !early(pass.spp) {
                return ControlFlow::Continue(());
            }
            let Ok(mut state) = state.lock() else { return ControlFlow::Break(()) };
            let (seen, result, take, clock) = &mut *state;
            let cpu = clock.as_ref().and_then(ProcessorClock::seconds);
            let image = pass.picture();
            *result = take(Shot { spp: pass.spp, of: most, seconds: pass.seconds, cpu, memory: None, image });
            seen.push(pass.spp);
            if let Some(clock) = clock {
                clock.leave_out_since(cpu);
            }
            if result.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        // Not looked at where that gives nothing.
        let control = if self.is_sequence() { Control::new().with_pass_end(&look) } else { Control::new() };
        let budget = Budget::Samples(most);
        let mut cx = RenderContext::new(&self.scene, camera, budget, seed, &control, channels);
        integrator.render(&mut cx).map_err(|e| joined(&e.0))?;
        let (seconds, image) = (control.seconds(), cx.picture());
        drop(cx);
        let (mut seen, result, take, clock) = state.into_inner().map_err(|_| "a run was lost")?;
        result?;
        let cpu = clock.and_then(|clock| clock.seconds());
        take(Shot { spp: most, of: most, seconds, cpu, memory: None, image })?;
        seen.push(most);
        Ok(seen)
    }
}

/// Takes a picture.
pub type Take<'a> = &'a mut (dyn FnMut(Shot) -> Result<(), String> + Send);

/// Processor time since the start, less what is left out.
struct ProcessorClock(Option<f64>);

impl ProcessorClock {
    fn start() -> Self {
        ProcessorClock(processor_seconds())
    }

    fn seconds(&self) -> Option<f64> {
        Some(processor_seconds()? - self.0?)
    }

    /// What was spent since the clock showed `then` does not count.
    fn leave_out_since(&mut self, then: Option<f64>) {
        if let (Some(now), Some(then), Some(start)) = (self.seconds(), then, &mut self.0) {
            *start += now - then;
        }
    }
}

/// A hash of the running program: what another build rendered is not taken for what this one would.
pub fn program() -> &'static str {
    static HASH: OnceLock<String> = OnceLock::new();
    HASH.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(std::fs::read);
        bytes.map_or_else(|_| env!("CARGO_PKG_VERSION").to_owned(), |bytes| digest(&bytes))
    })
}

/// A text of several lines as one.
pub fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
