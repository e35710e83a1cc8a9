//! Runs of the program, as a user starts it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// How a run of the program ended.
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// Runs the program in the repository; `change` sets what else it gets.
    pub fn of(arguments: &[&str], change: impl FnOnce(&mut Command)) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lucerna"));
        command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
        change(&mut command);
        let output = command.output().expect("the program starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("messages are UTF-8");
        Run { code: output.status.code().expect("no signal"), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// The folder for temporary files of one test, which may not be there yet.
pub fn folder_of(file: &str, test: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(file).join(test)
}

/// The program of a browser of the family of chromium, if there is one.
pub fn chromium() -> Option<&'static str> {
    ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"]
        .into_iter()
        .find(|program| Path::new(program).exists())
}

/// A temporary path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("temporary names are UTF-8")
}
