//! Runs of the program, bounded in time and memory.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer hangs. Runs take milliseconds; this is no measure of speed.
const HANGS: Duration = Duration::from_secs(30);

/// Address space in KiB: far above what a small scene needs, far below what the lies of a header ask for.
const MOST_MEMORY: u32 = 3 << 20;

/// What a run of the program came to.
pub struct Run {
    /// Exit code; none if a signal ended it.
    pub code: Option<i32>,
    /// Standard error.
    pub errors: String,
    /// How long it took.
    pub time: Duration,
}

impl Run {
    /// Runs `lucerna render SCENE -o OUTPUT …` in `folder`.
    pub fn render(folder: &Path, scene: &Path, output: &Path, arguments: impl IntoIterator<Item = String>) -> Run {
        let mut all: Vec<OsString> = vec!["render".into(), scene.into(), "-o".into(), output.into()];
        all.extend(arguments.into_iter().map(OsString::from));
        Self::program(folder, &all)
    }

    /// Runs the program in `folder`.
    pub fn program(folder: &Path, arguments: &[OsString]) -> Run {
        let program = env!("CARGO_BIN_EXE_lucerna");
        let mut command = if cfg!(target_os = "linux") {
            let mut shell = Command::new("sh");
            shell.arg("-c").arg(format!("ulimit -v {MOST_MEMORY} && exec \"$0\" \"$@\"")).arg(program);
            shell
        } else {
            Command::new(program)
        };
        // Two threads, so that their stacks do not count against the limit on machines with many cores.
        command
            .args(arguments)
            .current_dir(folder)
            .env("RAYON_NUM_THREADS", "2")
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null());
        // Into a file: a pipe that nobody empties would block the program, and so hide what it says.
        let messages = std::env::temp_dir().join(format!("lucerna-messages-{}-{}", std::process::id(), unique()));
        let start = Instant::now();
        let mut child =
            command.stdout(Stdio::null()).stderr(File::create(&messages).unwrap()).spawn().expect("the program starts");
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if start.elapsed() > HANGS {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        let time = start.elapsed();
        let errors = String::from_utf8_lossy(&fs::read(&messages).unwrap()).into_owned();
        fs::remove_file(&messages).unwrap();
        Run { code: status.and_then(|status| status.code()), errors, time }
    }

    /// What no run may do.
    pub fn broken(&self) -> Option<String> {
        if self.time > HANGS {
            Some("hangs".to_owned())
        } else if self.errors.contains("panicked") {
            Some(format!("panics:\n{}", self.errors))
        } else if self.code.is_none() {
            Some(format!("is ended by a signal:\n{}", self.errors))
        } else {
            None
        }
    }
}

fn unique() -> usize {
    static NEXT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
    NEXT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)
}

/// Tells which cases took longest (shown with `--nocapture`): all should end within a second.
pub fn report_slowest<N: AsRef<str>>(runs: &[(N, Run)]) {
    let mut by_time: Vec<_> = runs.iter().map(|(name, run)| (run.time, name.as_ref())).collect();
    by_time.sort();
    for (time, name) in by_time.iter().rev().take(3) {
        eprintln!("{:6} ms  {name}", time.as_millis());
    }
}

/// A small scene with a sensor, a light, and `body`, which starts in line 5.
pub fn scene(body: &str) -> String {
    let film =
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/></film>";
    format!(
        "<scene version=\"3.0.0\">\n<integrator type=\"path\"/>\n<sensor type=\"perspective\">{film}</sensor>\n\
         <emitter type=\"constant\"/>\n{body}</scene>\n"
    )
}

/// A folder for one test, removed at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    /// Creates the folder; `name` must be unique among the tests.
    pub fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("lucerna-input-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Folder(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
