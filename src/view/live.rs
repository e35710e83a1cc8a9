//! `--serve`: a page that shows the picture as it forms.
//!
//! | path | what |
//! |---|---|
//! | `/`, `/style.css`, `/live.js` | the page |
//! | `/state` | JSON: what is rendered, how far it is, all points of the curve, number of the picture |
//! | `/picture` | four `u32` (number of the picture, samples per pixel, width, height), then red, green and blue of each pixel as `f32`, row by row; all little-endian |
//!
//! The page asks for the state twice a second, and for the picture when there is a new one. Pictures are made after passes,
//! and not more often than somebody takes them.

use super::Point;
use super::http::{self, Answer};
use lucerna_core::render::Progress;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Shortest time between two pictures while somebody looks.
const PAUSE: Duration = Duration::from_millis(300);

/// The same while nobody does: one is there for whoever opens the page in the middle of a long pass.
const UNSEEN_PAUSE: Duration = Duration::from_secs(3);

/// Part of the time that may go into making pictures.
const SHARE: u32 = 20;

/// Whoever has asked within this time is looking.
const LOOKING: Duration = Duration::from_secs(3);

/// How long the end waits for those who look.
const FAREWELL: Duration = Duration::from_secs(5);

/// What does not change in the course of a run.
pub struct Facts {
    /// Name of the scene.
    pub scene: String,
    /// Name of the integrator.
    pub integrator: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The relMSE that ends the run.
    pub target: Option<f64>,
    /// Name of the reference.
    pub reference: Option<String>,
    /// Where the picture will be written.
    pub output: String,
}

/// A page and the server that has it.
pub struct Page {
    shared: Arc<Shared>,
    url: String,
}

struct Shared {
    facts: Facts,
    state: Mutex<State>,
    /// Number of the picture that was sent last.
    taken: AtomicU32,
    /// Whether the end was told.
    told: AtomicBool,
}

#[derive(Default)]
struct State {
    fraction: f64,
    samples: u64,
    seconds: f64,
    /// Whether `fraction` says how much is left.
    is_known: bool,
    spp: u32,
    estimate: Option<f64>,
    points: Vec<Point>,
    /// Number of the picture, from 1.
    number: u32,
    picture: Option<Arc<[u8]>>,
    made: Option<Instant>,
    cost: Duration,
    asked: Option<Instant>,
    /// How it ended.
    message: Option<String>,
}

impl State {
    fn is_watched(&self) -> bool {
        self.asked.is_some_and(|asked| asked.elapsed() < LOOKING)
    }
}

impl Page {
    /// Starts to serve.
    ///
    /// # Errors
    /// If the port cannot be had.
    pub fn serve(port: u16, facts: Facts) -> Result<Self, String> {
        let shared =
            Arc::new(Shared { facts, state: Mutex::default(), taken: AtomicU32::new(0), told: AtomicBool::new(false) });
        let answering = shared.clone();
        let address = http::serve(port, Arc::new(move |path: &str| answering.answer(path)))
            .map_err(|e| format!("port {port} of 127.0.0.1: {e}"))?;
        Ok(Page { shared, url: format!("http://{address}/") })
    }

    /// Where it is.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Takes up how far the run is, after so many seconds; `is_known`: whether the fraction tells how much is left.
    pub fn progress(&self, progress: Progress, seconds: f64, is_known: bool) {
        let mut state = self.shared.state();
        // Calls of several threads come in any order.
        if progress.samples >= state.samples {
            (state.fraction, state.samples, state.seconds) = (progress.fraction, progress.samples, seconds);
            state.is_known = is_known;
        }
    }

    /// Takes up the end of a pass.
    pub fn pass(&self, spp: u32, seconds: f64, estimate: Option<f64>) {
        let mut state = self.shared.state();
        (state.spp, state.estimate) = (spp, estimate);
        state.seconds = seconds;
    }

    /// Takes up a point of the curve.
    pub fn point(&self, point: Point) {
        self.shared.state().points.push(point);
    }

    /// Whether it is time for another picture.
    pub fn wants_picture(&self) -> bool {
        let state = self.shared.state();
        let is_taken = self.shared.taken.load(Ordering::Acquire) == state.number;
        let pause = if state.is_watched() && is_taken { PAUSE } else { UNSEEN_PAUSE };
        state.made.is_none_or(|made| made.elapsed() >= pause.max(state.cost * SHARE))
    }

    /// Shows a picture: red, green and blue of each pixel.
    pub fn show(&self, spp: u32, [width, height]: [u32; 2], rgb: &[f32]) {
        let started = Instant::now();
        let number = self.shared.state().number + 1;
        let head = [number, spp, width, height].into_iter().flat_map(u32::to_le_bytes);
        let bytes: Arc<[u8]> = head.chain(rgb.iter().flat_map(|v| v.to_le_bytes())).collect::<Vec<u8>>().into();
        let mut state = self.shared.state();
        (state.number, state.picture) = (number, Some(bytes));
        (state.made, state.cost) = (Some(Instant::now()), started.elapsed());
    }

    /// Tells that the run is over. Whoever looks gets the time to take the last picture; with `keep` the page stays until
    /// `is_over`.
    pub fn close(&self, message: &str, keep: bool, is_over: &dyn Fn() -> bool) {
        let last = {
            let mut state = self.shared.state();
            state.message = Some(message.to_owned());
            (state.fraction, state.is_known) = (1.0, true);
            state.number
        };
        // Whoever ended the run by Ctrl-C does not wait for a second one.
        let keep = keep && !is_over();
        if keep {
            eprintln!("the page stays at {} until Ctrl-C", self.url);
        }
        let started = Instant::now();
        loop {
            let is_watched = self.shared.state().is_watched();
            let is_taken = self.shared.taken.load(Ordering::Acquire) == last;
            // The last picture may be taken before the end is known.
            let is_told = self.shared.told.load(Ordering::Acquire);
            let may_go = !is_watched || (is_taken && is_told) || started.elapsed() > FAREWELL;
            if if keep { is_over() } else { may_go } {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn answer(self: &Arc<Self>, path: &str) -> Option<Answer> {
        let (kind, body): (_, Arc<[u8]>) = match path {
            "/" => ("text/html; charset=utf-8", include_bytes!("page/index.html").as_slice().into()),
            "/style.css" => ("text/css; charset=utf-8", include_bytes!("page/style.css").as_slice().into()),
            "/live.js" => ("text/javascript; charset=utf-8", include_bytes!("page/live.js").as_slice().into()),
            "/state" => {
                let state = self.tell();
                let (shared, is_over) = (self.clone(), !state["ended"].is_null());
                let on_sent = move || {
                    shared.told.fetch_or(is_over, Ordering::AcqRel);
                };
                let body = state.to_string().into_bytes().into();
                return Some(Answer { kind: "application/json", body, on_sent: Some(Box::new(on_sent)) });
            }
            "/picture" => {
                let (number, bytes) = {
                    let state = self.state();
                    (state.number, state.picture.clone()?)
                };
                let shared = self.clone();
                let on_sent = move || {
                    shared.taken.fetch_max(number, Ordering::AcqRel);
                };
                return Some(Answer {
                    kind: "application/octet-stream",
                    body: bytes,
                    on_sent: Some(Box::new(on_sent)),
                });
            }
            _ => return None,
        };
        Some(Answer { kind, body, on_sent: None })
    }

    fn tell(&self) -> Value {
        let (facts, mut state) = (&self.facts, self.state());
        state.asked = Some(Instant::now());
        let point = |p: &Point| {
            json!({
                "spp": p.spp,
                "seconds": p.seconds,
                "estimate": p.estimate,
                "rel_mse": p.errors.map(|e| e.rel_mse),
                "mse": p.errors.map(|e| e.mse),
            })
        };
        // Nothing can be told from the first moments.
        let is_told = state.is_known && state.fraction > 1e-6 && state.message.is_none();
        let left = is_told.then(|| state.seconds * (1.0 - state.fraction) / state.fraction);
        json!({
            "scene": facts.scene,
            "integrator": facts.integrator,
            "size": facts.size,
            "target": facts.target,
            "reference": facts.reference,
            "output": facts.output,
            "spp": state.spp,
            "samples": state.samples,
            "seconds": state.seconds,
            "rate": state.samples as f64 / state.seconds.max(1e-9),
            "fraction": state.is_known.then_some(state.fraction),
            "left": left,
            "estimate": state.estimate,
            "points": state.points.iter().map(point).collect::<Vec<_>>(),
            "picture": state.number,
            "ended": state.message,
        })
    }
}
