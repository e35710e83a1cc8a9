//! `lucerna compare`: which method gives less error in the same time?

use super::Failure;
use super::scene_args::ReadingArguments;
use crate::check::cache;
use crate::compare::facts::Facts;
use crate::compare::method::Methods;
use crate::compare::results::SceneResult;
use crate::compare::turn::{self, Place};
use crate::compare::{Budgets, Options, compare, page};
use clap::Args;
use lucerna_core::scene::Registry;
use lucerna_core::stats::metrics::Interval;
use std::path::PathBuf;
use std::process::ExitCode;

/// Told at the end of the help.
const EXAMPLES: &str = "\
Methods: `path`, `direct`, `path:max_depth=4`, `path:sampler=sobol`, `path+guide=sd_tree`, `path+light_sampler=power`,
`path+roulette=adjoint`, `scene` (as the scene has it), `mitsuba:llvm_ad_rgb:path` (with the reference renderer), or a file such as

    baseline = \"two bounces\"
    [[method]]
    name = \"two bounces\"
    integrator = \"path\"
    parameters = { max_depth = 3 }
    sampler = \"multijitter\"
    light_sampler = \"light_tree\"
    # guide = \"sd_tree\"
    # roulette = \"adjoint\"
    define = { power = \"2\" }            # the scene's $power
    # renderer = \"mitsuba:scalar_rgb\"

What a method does not name stays as the scene has it, but an integrator that is named comes without the scene's guide,
roulette, light sampler and cache. A sampler of the scene that the reference renderer does not have is
replaced by `independent` for it. The first method is the baseline, unless a file or --baseline says
otherwise. Runs are kept in the report's folder: the same command again continues where it was.

Exit codes: 0 done; 2 a method or a scene failed (the report tells of the others), or nothing could be compared";

/// Options of `compare`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Scene files
    #[arg(required = true)]
    scenes: Vec<PathBuf>,

    /// What to compare: short forms, and .toml files
    #[arg(short, long, required = true, num_args = 1.., value_name = "METHOD")]
    methods: Vec<String>,

    /// The method that others are measured by
    #[arg(long, value_name = "NAME")]
    baseline: Option<String>,

    /// Seconds that a picture may take, several separated by commas; without this and --spp: 5
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = seconds, conflicts_with = "spp")]
    seconds: Vec<f64>,

    /// Samples per pixel instead, several separated by commas
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Vec<u32>,

    /// Runs of each method with other random numbers; intervals need at least 2
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: u32,

    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Compare with this picture (.exr; its variance may stand next to it in .var.exr) instead of rendering one
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,

    /// The method that renders the reference
    #[arg(long, value_name = "METHOD", default_value = "path:sampler=sobol", conflicts_with = "reference")]
    reference_method: String,

    /// Seconds that the reference may take, if its noise does not fall below a tenth of the best method's error before
    #[arg(long, value_name = "S", default_value = "600", value_parser = seconds, conflicts_with = "reference")]
    reference_seconds: f64,

    /// Render only what the budgets name, not the points of the curves before them
    #[arg(long)]
    no_curves: bool,

    /// The relMSE to tell the time to; by default that of the baseline's longest run
    #[arg(long, value_name = "RELMSE", value_parser = error)]
    target: Option<f64>,

    /// Another picture size, as WIDTHxHEIGHT
    #[arg(long, value_name = "WxH", value_parser = super::render::size)]
    size: Option<[u32; 2]>,

    #[command(flatten)]
    reading: ReadingArguments,

    /// Where rendered references are kept; lucerna/references in the user's cache by default
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,

    /// The folder of the report
    #[arg(short, long, value_name = "FOLDER", default_value = "lucerna-compare")]
    output: PathBuf,

    /// Number of threads, of Lucerna and of the reference renderer; all cores by default
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Do not tell of every run
    #[arg(short, long)]
    quiet: bool,

    /// Take one turn and answer on standard output: how a comparison starts its processes
    #[arg(long, hide = true)]
    turn: Option<String>,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e6 => Ok(seconds),
        _ => Err("expected a number of seconds above 0".to_owned()),
    }
}

fn error(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(error) if error > 0.0 && error.is_finite() => Ok(error),
        _ => Err("expected an error above 0".to_owned()),
    }
}

impl Arguments {
    fn options(&self, place: Place) -> Options {
        let (mut seconds, mut spp) = (self.seconds.clone(), self.spp.clone());
        if seconds.is_empty() && spp.is_empty() {
            seconds.push(5.0);
        }
        seconds.sort_by(f64::total_cmp);
        seconds.dedup();
        spp.sort_unstable();
        spp.dedup();
        Options {
            reading: self.reading.options(),
            size: self.size,
            budgets: if spp.is_empty() { Budgets::Seconds(seconds) } else { Budgets::Samples(spp) },
            seeds: self.seeds,
            seed: self.seed,
            no_curves: self.no_curves,
            target: self.target,
            place,
            reference: self.reference.clone(),
            reference_method: self.reference_method.clone(),
            reference_seconds: self.reference_seconds,
            cache: self.cache.clone().unwrap_or_else(cache::default_folder),
            output: self.output.clone(),
        }
    }
}

/// Compares.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    super::set_threads(arguments.threads)?;
    let mut methods = Methods::parse(&arguments.methods).map_err(Failure::new)?;
    if let Some(turn) = &arguments.turn {
        turn::serve(registry, &methods, &arguments.options(Place::Here), turn);
        return Ok(ExitCode::SUCCESS);
    }
    let program =
        std::env::current_exe().map_err(|e| Failure::new(format!("this program cannot be started again: {e}")))?;
    let options = arguments.options(Place::Process { program, arguments: std::env::args_os().skip(1).collect() });
    if let Some(name) = &arguments.baseline {
        if !methods.list.iter().any(|m| m.name == *name) {
            return Err(Failure::new(format!("--baseline {name}: no method is called so")));
        }
        methods.baseline = Some(name.clone());
    }
    if arguments.reference.is_some() && arguments.scenes.len() > 1 {
        return Err(Failure::new("--reference is the picture of one scene"));
    }
    if let Some(missing) = arguments.scenes.iter().find(|scene| !scene.is_file()) {
        return Err(Failure::new(format!("{}: no such file", missing.display())));
    }
    let facts = Facts::gather(command(), &methods, &arguments.scenes[0]);
    let (mut done, mut failed) = (Vec::new(), Vec::new());
    for scene in &arguments.scenes {
        let mut tell = |line: String| {
            if !arguments.quiet {
                eprintln!("{}: {line}", scene.display());
            }
        };
        match compare(registry, scene, &methods, &options, &mut tell) {
            Ok(result) => {
                print(&result, &options);
                page::write_pictures(&result, done.len(), &options).map_err(Failure::new)?;
                done.push(result);
            }
            Err(why) => {
                eprintln!("error: {}: {why}", scene.display());
                failed.push((scene.clone(), why));
            }
        }
        if !done.is_empty() {
            page::write(&done, &failed, &options, &facts).map_err(Failure::new)?;
        }
    }
    if !done.is_empty() {
        println!("see {}", options.output.join("index.html").display());
    }
    let any_failed = !failed.is_empty() || done.iter().flat_map(|s| &s.methods).any(|m| m.failed.is_some());
    Ok(if any_failed { ExitCode::from(super::FAILURE) } else { ExitCode::SUCCESS })
}

/// What was typed, for a shell to repeat.
fn command() -> String {
    let plain = |text: &str| text.chars().all(|c| c.is_alphanumeric() || "_-./:=,+@%".contains(c)) && !text.is_empty();
    let quoted = |text: String| if plain(&text) { text } else { format!("'{}'", text.replace('\'', "'\\''")) };
    let rest = std::env::args_os().skip(1).map(|text| quoted(text.to_string_lossy().into_owned()));
    std::iter::once("lucerna".to_owned()).chain(rest).collect::<Vec<_>>().join(" ")
}

/// One line a method and budget.
fn print(result: &SceneResult, options: &Options) {
    let width = result.methods.iter().map(|m| m.method.name.chars().count()).max().unwrap_or(0);
    println!("{}: against {}", result.scene.display(), result.truth.source);
    if result.truth.reached == Some(false) {
        println!("  note: the reference is still too noisy for the best method; --reference-seconds gives it longer");
    }
    for (budget, name) in options.budgets.names().iter().enumerate() {
        println!("  {name}");
        for (i, method) in result.methods.iter().enumerate() {
            let label = format!("{:<width$}", method.method.name);
            match (&method.failed, method.stops.get(budget).and_then(|at| method.points.get(*at))) {
                (Some(why), _) => println!("    {label}  failed: {why}"),
                (None, Some(point)) => println!(
                    "    {label}  {:>6} spp  {:>8.3} s  relMSE {:.3e}  efficiency {}{}  mean {}{}",
                    point.spp,
                    point.time().value,
                    point.mean(|e| e.rel_mse).value,
                    match result.gain(i, budget, |e| e.rel_mse) {
                        _ if i == result.baseline => "1 × (baseline)".to_owned(),
                        gain => gain.map_or_else(|| "-".to_owned(), |g| page::times(&g)),
                    },
                    match result.gain_without_noise(i, budget) {
                        Some(gain) if i != result.baseline && result.truth.reached == Some(false) => {
                            format!(" ({} without the reference's noise)", page::times(&gain))
                        }
                        _ => String::new(),
                    },
                    percent(&point.mean_difference(&result.truth)),
                    if result.is_biased(point) == Some(true) { " (biased)" } else { "" },
                ),
                _ => {}
            }
        }
    }
}

fn percent(found: &Interval) -> String {
    let half = found.bounds.map(|[low, high]| format!(" ± {:.2}", 50.0 * (high - low)));
    format!("{:+.2}{} %", 100.0 * found.value, half.unwrap_or_default())
}
