//! Scenes that must be refused, with the words they are refused with: see `scenes/bad/README.md`.
//!
//! Every case runs the built program, as a user would, with a limit on its address space, so that a declared size that
//! is believed shows as an abort instead of a slow machine. Cases named `hc_` are those that do not fit into a folder.

mod large;
mod output;
mod run;

use run::{Run, report_slowest};
use std::fs;
use std::path::{Path, PathBuf};

/// Set to 1, this variable makes the test write down what the program says instead of comparing it.
const UPDATE: &str = "LUCERNA_UPDATE_EXPECTED";

/// Exit code of a refusal.
const REFUSED: i32 = 2;

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// One folder of `scenes/bad`.
struct Case {
    name: String,
}

impl Case {
    fn all() -> Vec<Case> {
        let entries = fs::read_dir(repository().join("scenes/bad")).unwrap().map(Result::unwrap);
        let folders = entries.filter(|entry| entry.path().is_dir());
        let mut names: Vec<_> = folders.map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.sort();
        names.into_iter().map(|name| Case { name }).collect()
    }

    /// `scenes/bad/NAME/NAME.EXTENSION`, relative to the repository, as messages show it.
    fn file(&self, extension: &str) -> PathBuf {
        Path::new("scenes/bad").join(&self.name).join(format!("{}.{extension}", self.name))
    }

    fn content(&self, extension: &str) -> Option<String> {
        fs::read_to_string(repository().join(self.file(extension))).ok()
    }

    fn run(&self, output: &Path) -> Run {
        let extra = self.content("args").unwrap_or_default();
        let scene = self.file("xml");
        let arguments = ["--spp", "1", "-q"].into_iter().map(str::to_owned).chain(extra.lines().map(str::to_owned));
        Run::render(repository(), &scene, output, arguments)
    }

    /// What is wrong with how the program answered, if anything.
    fn judge(&self, run: &Run, left_output: bool) -> Option<String> {
        let (refusal, acceptance) = (self.content("expected"), self.content("accepted"));
        let (expected, code) = match (&refusal, &acceptance) {
            (Some(text), None) => (text, REFUSED),
            (None, Some(text)) => (text, 0),
            _ => return Some("needs a file .expected or .accepted, and not both".to_owned()),
        };
        if run.errors != *expected {
            return Some(format!("says\n{}instead of\n{expected}", run.errors));
        }
        if run.code != Some(code) {
            return Some(format!("ends with {:?}, not {code}", run.code));
        }
        (left_output != (code == 0)).then(|| format!("left {} picture", if left_output { "a" } else { "no" }))
    }

    fn update(&self, run: &Run) {
        let (right, wrong) = if run.code == Some(0) { ("accepted", "expected") } else { ("expected", "accepted") };
        fs::write(repository().join(self.file(right)), &run.errors).unwrap();
        let _ = fs::remove_file(repository().join(self.file(wrong)));
    }
}

#[test]
fn hc_i_bad_scenes_are_refused_word_for_word() {
    let folder = run::Folder::new("bad");
    let update = std::env::var_os(UPDATE).is_some_and(|value| value == "1");
    let mut wrong = Vec::new();
    let mut runs = Vec::new();
    for case in Case::all() {
        let output = folder.0.join(format!("{}.exr", case.name));
        let run = case.run(&output);
        if update {
            case.update(&run);
        }
        wrong.extend(run.broken().map(|problem| format!("{}: {problem}", case.name)));
        wrong.extend(case.judge(&run, output.exists()).map(|problem| format!("{}: {problem}", case.name)));
        runs.push((case.name, run));
    }
    assert!(runs.len() > 200, "only {} cases: is scenes/bad complete?", runs.len());
    report_slowest(&runs);
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), runs.len(), wrong.join("\n"));
}

/// Form of a message: every line of a refusal begins with `error: ` and is one line for one mistake.
#[test]
fn expected_messages_have_the_form_of_messages() {
    for case in Case::all() {
        for line in case.content("expected").unwrap_or_default().lines() {
            assert!(line.starts_with("error: ") || line.starts_with("  "), "{}: {line}", case.name);
            assert!(!line.ends_with('.') && !line.contains("(os error"), "{}: {line}", case.name);
        }
        for line in case.content("accepted").unwrap_or_default().lines() {
            assert!(line.starts_with("warning: ") || line.starts_with("note: "), "{}: {line}", case.name);
        }
    }
}

#[test]
fn hc_i01_scenes_that_are_not_there() {
    let folder = run::Folder::new("missing");
    let refuse = |scene: &str, message: &str| {
        let run = Run::render(&folder.0, Path::new(scene), Path::new("out.exr"), []);
        assert_eq!((run.code, run.errors.trim_end()), (Some(REFUSED), message));
    };
    refuse("none.xml", "error: none.xml: could not read the file (no such file or directory)");
    refuse("no/scene.xml", "error: no/scene.xml: could not read the file (no such file or directory)");
    refuse(".", "error: .: could not read the file (is a folder, not a file)");
    if cfg!(unix) {
        refuse("/dev/zero", "error: /dev/zero: could not read the file (is not a regular file)");
    }
}

#[test]
fn hc_x04_no_samples_is_a_wrong_argument() {
    let folder = run::Folder::new("arguments");
    for arguments in [["--spp", "0"], ["--spp", "-1"], ["--crop", "0,0,8"], ["--integrator", "pth"]] {
        let run = Run::render(&folder.0, Path::new("none.xml"), Path::new("out.exr"), arguments.map(str::to_owned));
        assert_eq!(run.broken(), None);
        assert!(run.code == Some(REFUSED) && run.errors.starts_with("error: "), "{arguments:?}: {}", run.errors);
    }
}

/// Without a scene, the built-in one is taken.
#[test]
fn hc_i09_a_wrong_integrator_of_the_command_line_is_named() {
    let folder = run::Folder::new("option");
    let arguments = ["render", "-o", "out.exr", "--integrator", "pth"].map(Into::into);
    let run = Run::program(&folder.0, &arguments);
    let message = "error: --integrator: unknown integrator plugin \"pth\" (did you mean \"path\"?)";
    assert_eq!((run.errors.trim_end(), run.code), (message, Some(REFUSED)));
}

#[test]
#[cfg(unix)]
fn hc_i01_files_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = run::Folder::new("permission");
    let scene = run::scene("<shape type=\"ply\">\n<string name=\"filename\" value=\"locked.ply\"/>\n</shape>\n");
    fs::write(folder.0.join("scene.xml"), scene).unwrap();
    let locked = folder.0.join("locked.ply");
    fs::write(&locked, "ply\n").unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&locked).is_ok() {
        eprintln!("skipped: this user may read everything");
        return;
    }
    let run = Run::render(&folder.0, Path::new("scene.xml"), Path::new("out.exr"), []);
    assert_eq!(run.code, Some(REFUSED));
    assert!(run.errors.contains("\"locked.ply\": permission denied"), "{}", run.errors);
}

/// A link inside the folder of `--root` that leads out of it.
#[test]
#[cfg(unix)]
fn hc_i06_links_do_not_lead_out_of_the_root() {
    let folder = run::Folder::new("link");
    let inside = folder.0.join("inside");
    fs::create_dir(&inside).unwrap();
    fs::write(folder.0.join("mesh.ply"), "ply\n").unwrap();
    std::os::unix::fs::symlink("../mesh.ply", inside.join("link.ply")).unwrap();
    let scene = run::scene("<shape type=\"ply\">\n<string name=\"filename\" value=\"link.ply\"/>\n</shape>\n");
    fs::write(inside.join("scene.xml"), scene).unwrap();
    let arguments = ["--root", "inside"].map(str::to_owned);
    let run = Run::render(&folder.0, Path::new("inside/scene.xml"), Path::new("out.exr"), arguments);
    assert_eq!(run.code, Some(REFUSED));
    assert!(run.errors.contains("files outside of \"inside\" are refused"), "{}", run.errors);
}
