//! `lucerna check`: do scenes look as with the reference renderer?

use super::Failure;
use super::scene_args::ReadingArguments;
use crate::check::{self, Options, Outcome, Verdict, cache, page, scenes};
use clap::Args;
use lucerna_core::scene::Registry;
use lucerna_core::stats::images::Scale;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// Told at the end of the help.
const EXIT_CODES: &str = "\
Verdicts: \"agrees\"; \"ray offset\": differs only because the reference starts rays farther off surfaces (and leaks
light through thin gaps); \"known\": differs as reference/apart.toml explains; \"DIFFERS\"; \"skipped\": a scene of a folder
that needs what is not built; \"not run\".

Exit codes: 0 no scene differs but for ray offsets or known reasons; 1 a scene differs; 2 none differs, but one could not
be compared, or none was";

/// Exit code if a scene differs.
const DIFFERS: u8 = 1;

/// Options of `check`.
#[derive(Args)]
#[command(after_help = EXIT_CODES)]
pub struct Arguments {
    /// Scene files, and folders to search for them
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    scenes: Vec<PathBuf>,

    /// All scenes of this repository that have a stored reference
    #[arg(long)]
    all: bool,

    #[command(flatten)]
    reading: ReadingArguments,

    /// Compare sample for sample with the variant scalar_rgb, with its random numbers and ray offsets
    #[arg(long, conflicts_with_all = ["variant", "reference_offsets"])]
    exact: bool,

    /// Another picture size, as WIDTH (the height follows) or WIDTHxHEIGHT
    #[arg(long, value_name = "W[xH]", value_parser = size)]
    size: Option<(u32, Option<u32>)>,

    /// Samples per pixel of the reference (where that is stored, of Lucerna), instead of as many as find 0.3 % in the
    /// mean. With --exact, of both: stored images of as many, and of --seed, or one rendered now
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Option<u32>,

    /// Chooses the random numbers; 0 by default
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    /// Variant of the reference; llvm_ad_rgb where that works, else scalar_rgb
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,

    /// Start rays as far off surfaces as the reference does
    #[arg(long)]
    reference_offsets: bool,

    /// Render references that are stored, too
    #[arg(long)]
    fresh: bool,

    /// Where rendered references are kept; lucerna/references in the user's cache by default
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,

    /// Where pictures and the report of scenes that differ are written
    #[arg(short, long, value_name = "FOLDER", default_value = "lucerna-check")]
    output: PathBuf,

    /// Write pictures and report of all scenes
    #[arg(long)]
    keep: bool,

    /// Tell the results as JSON
    #[arg(long)]
    json: bool,

    /// Number of threads of Lucerna; all cores by default
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

fn size(text: &str) -> Result<(u32, Option<u32>), String> {
    let number = |text: &str| text.trim().parse::<u32>().ok().filter(|v| (1..=1 << 16).contains(v));
    let wrong = || "expected a width, or WIDTHxHEIGHT, of 1 to 65536 pixels".to_owned();
    match text.split_once('x') {
        Some((width, height)) => Ok((number(width).ok_or_else(wrong)?, Some(number(height).ok_or_else(wrong)?))),
        None => Ok((number(text).ok_or_else(wrong)?, None)),
    }
}

/// Checks.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    super::set_threads(arguments.threads)?;
    let found = if arguments.all { scenes::all() } else { scenes::find(&arguments.scenes) };
    let found = found.map_err(Failure::new)?;
    let options = Options {
        reading: arguments.reading.options(),
        size: arguments.size,
        spp: arguments.spp,
        seed: arguments.seed,
        variant: arguments.variant.clone().unwrap_or_default(),
        exact: arguments.exact,
        reference_offsets: arguments.reference_offsets,
        fresh: arguments.fresh,
        cache: arguments.cache.clone().unwrap_or_else(cache::default_folder),
    };
    let width = found.iter().map(|(path, _)| path.display().to_string().chars().count()).max().unwrap_or(0);
    let count = found.len();
    let (mut verdicts, mut sections, mut told) = (Vec::new(), Vec::new(), Vec::new());
    for (scene, named) in found {
        let mut outcome = check::check(registry, scene, &options, count);
        // Whoever names a scene wants it compared.
        if named && outcome.verdict == Verdict::Skipped {
            outcome.verdict = Verdict::Failed;
        }
        if arguments.json {
            told.push(to_json(&outcome));
        } else {
            tell(&outcome, width, arguments.reading.verbose > 0);
        }
        verdicts.push(outcome.verdict);
        if arguments.keep || !matches!(outcome.verdict, Verdict::Agrees | Verdict::Skipped | Verdict::Failed) {
            let section = page::write_section(&arguments.output, &outcome, sections.len()).map_err(Failure::new)?;
            sections.extend(section);
        }
    }
    let report = match sections.is_empty() {
        true => None,
        false => Some(page::write(&arguments.output, &sections, &summary(&verdicts)).map_err(Failure::new)?),
    };
    if arguments.json {
        let document = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "level": check::SIGNIFICANCE,
            "report": report,
            "scenes": told,
        });
        println!("{document:#}");
    } else {
        println!("{}", summary(&verdicts));
        if let Some(report) = report {
            println!("see {}", report.display());
        }
    }
    Ok(exit_code(&verdicts))
}

fn exit_code(verdicts: &[Verdict]) -> ExitCode {
    let any = |verdict| verdicts.contains(&verdict);
    if any(Verdict::Differs) {
        ExitCode::from(DIFFERS)
    } else if any(Verdict::Failed) || verdicts.iter().all(|v| *v == Verdict::Skipped) {
        ExitCode::from(super::FAILURE)
    } else {
        ExitCode::SUCCESS
    }
}

/// How many scenes fared how.
fn summary(verdicts: &[Verdict]) -> String {
    use Verdict::{Agrees, Differs, Failed, Known, Offset, Skipped};
    let of = |verdict| verdicts.iter().filter(|v| **v == verdict).count();
    let mut parts = vec![format!("{} agree", of(Agrees)), format!("{} differ", of(Differs))];
    let words = [
        (Offset, "only by the reference's ray offsets"),
        (Known, "as known"),
        (Skipped, "skipped"),
        (Failed, "not run"),
    ];
    parts.extend(words.into_iter().filter(|(v, _)| of(*v) > 0).map(|(v, text)| format!("{} {text}", of(v))));
    let scenes = if verdicts.len() == 1 { "scene" } else { "scenes" };
    format!("{} {scenes}: {}", verdicts.len(), parts.join(", "))
}

/// One line a scene, and its notes.
fn tell(outcome: &Outcome, width: usize, verbose: bool) {
    let name = format!("{:<width$}", outcome.scene.display().to_string());
    let verdict = outcome.verdict.text();
    let [ours, theirs] = outcome.seconds;
    let Some(findings) = &outcome.findings else {
        println!("{name}  {verdict:<10}  {}", outcome.notes.join("; "));
        return;
    };
    let times = format!("{ours:.1} s, reference {theirs:.1} s");
    if let Some(comparison) = &findings.comparison {
        let mean = comparison.mean_difference().0;
        let ([worst_mean, mean_limit], [worst_tile, tile_limit]) =
            (page::worst(comparison, Scale::Mean), page::worst(comparison, Scale::Tile));
        println!(
            "{name}  {verdict:<10}  mean {:+.3} % ({worst_mean:.1} of {mean_limit:.1} σ), worst tile {worst_tile:.1} of \
             {tile_limit:.1} σ, pixels {:.3} %, finds {:.2} %, {times}",
            100.0 * mean,
            100.0 * comparison.test(Scale::Pixel).share(),
            100.0 * comparison.detectable(),
        );
    } else if let Some(found) = &findings.agreement {
        let [x, y] = found.worst_pixel;
        println!(
            "{name}  {verdict:<10}  {:.3} % of pixels follow the reference's samples, worst at {x},{y}, {times}",
            100.0 * found.share
        );
    }
    if verbose {
        println!("    {}, ours {} spp", outcome.reference, outcome.spp[0]);
    }
    for note in outcome.notes.iter().filter(|_| verbose || outcome.verdict != Verdict::Agrees) {
        println!("    {note}");
    }
}

fn to_json(outcome: &Outcome) -> Value {
    let mut value = json!({
        "scene": outcome.scene,
        "verdict": outcome.verdict.text().to_lowercase(),
        "notes": outcome.notes,
    });
    let Some(findings) = &outcome.findings else { return value };
    value["reference"] = json!(outcome.reference);
    value["spp"] = json!({"ours": outcome.spp[0], "reference": outcome.spp[1]});
    value["seconds"] = json!({"ours": outcome.seconds[0], "reference": outcome.seconds[1]});
    value["size"] = json!([findings.theirs.width, findings.theirs.height]);
    if let Some(comparison) = &findings.comparison {
        let (mean, error) = comparison.mean_difference();
        value["mean_difference"] = json!({"relative": mean, "standard_error": error});
        value["detectable"] = json!(comparison.detectable());
        value["left_out"] = json!(comparison.left_out);
        for test in &comparison.tests {
            let [worst, limit] = page::worst(comparison, test.scale);
            let (at, channel) = comparison.place(test.scale, test.worst);
            value[test.scale.to_string()] = json!({
                "worst_sigma": worst,
                "limit_sigma": limit,
                "at": at,
                "channel": channel,
                "failed": test.failed.len(),
                "share": test.share(),
            });
        }
    }
    if let Some(found) = &findings.agreement {
        value["exact"] = json!({"share": found.share, "worst": found.worst, "at": found.worst_pixel});
    }
    value
}
