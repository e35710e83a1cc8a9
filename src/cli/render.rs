//! `lucerna render`: a scene to a picture.

use super::Failure;
use super::keeping::{self, Chosen, KeepingArguments};
use super::scene_args::{SceneArguments, default_output};
use super::views::{MOST_SPP, Rendered, ViewArguments};
use crate::short_form;
use crate::view::{self, Summary, Views};
use clap::Args;
use lucerna_core::image::{self, exr, png};
use lucerna_core::interfaces::{ComponentFormat, FileFormat, Integrator};
use lucerna_core::math::UVec2;
use lucerna_core::render::{Budget, Control, OnPass, PassEnd, RenderContext, Report, SampleOrder, replay};
use lucerna_core::scene::{
    BuiltSensor, Description, NodeId, Object, ObjectKind, Parameter, Registry, Scene, Value, build_one,
};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exit code of a run that met bad samples under `--strict-nan`.
const BAD_SAMPLES: u8 = 3;

/// Options of `render`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,

    /// Where to write: .exr, .png, .pfm or .hdr; next to the scene by default
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Samples per pixel, instead of what the scene says
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,

    /// Render for so many seconds instead
    #[arg(long, value_name = "S", conflicts_with = "spp", value_parser = positive)]
    seconds: Option<f64>,

    /// Chooses the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Which sensor of the scene, counted from 0
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    sensor: usize,

    /// Number of threads; all cores by default
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Another integrator, as NAME or NAME:parameter=value,…
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,

    /// A guide for the integrator, as NAME or NAME:parameter=value,…
    #[arg(long, value_name = "NAME")]
    guide: Option<String>,

    /// What decides whether paths go on, stop or split, as NAME or NAME:parameter=value,…
    #[arg(long, value_name = "NAME")]
    roulette: Option<String>,

    /// Another sampler, as NAME or NAME:parameter=value,…
    #[arg(long, value_name = "NAME")]
    sampler: Option<String>,

    /// Another way for its integrators to choose lights, as NAME or NAME:parameter=value,…
    #[arg(long, value_name = "NAME")]
    light_sampler: Option<String>,

    /// Render a part only: x,y,width,height in pixels
    #[arg(long, value_name = "X,Y,W,H", value_parser = numbers::<4>)]
    crop: Option<[u32; 4]>,

    /// Another picture size, as WIDTHxHEIGHT; a crop window in the scene is dropped
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,

    /// Replay one sample of this pixel and print its value
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>)]
    pixel: Option<[u32; 2]>,

    /// Which sample to replay
    #[arg(long, value_name = "K", default_value_t = 0, requires = "pixel")]
    sample: u32,

    /// Exit with code 3 if any sample was NaN, infinite or negative
    #[arg(long)]
    strict_nan: bool,

    /// Refuse to start if the picture needs more memory than so many MiB
    #[arg(long, value_name = "MIB", default_value_t = 16384)]
    max_memory: u64,

    #[command(flatten)]
    keeping: KeepingArguments,

    #[command(flatten)]
    views: ViewArguments,

    /// Write a summary in JSON
    #[arg(long, value_name = "FILE")]
    stats_json: Option<PathBuf>,

    /// No progress bar and no summary
    #[arg(short, long)]
    quiet: bool,

    /// Spend random numbers in the order of the reference's scalar_rgb, as if it ran with so many threads
    #[arg(long, value_name = "THREADS", hide = true, num_args = 0..=1, default_missing_value = "3")]
    reference_order: Option<u32>,
}

pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds >= 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("expected a number of seconds".to_owned()),
    }
}

pub fn numbers<const N: usize>(text: &str) -> Result<[u32; N], String> {
    let list: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse::<u32>()).collect();
    list.ok().and_then(|list| list.try_into().ok()).ok_or_else(|| format!("expected {N} whole numbers"))
}

pub fn size(text: &str) -> Result<[u32; 2], String> {
    numbers(&text.replace('x', ","))
}

/// Ctrl-C asks the running render to stop; the second one ends the program.
fn stop_on_interrupt(control: &'static Control<'static>) {
    let mut pressed = false;
    // A program that embeds this one may have a handler of its own; then Ctrl-C is its business.
    let _ = ctrlc::set_handler(move || {
        if std::mem::replace(&mut pressed, true) {
            std::process::exit(130);
        }
        control.stop();
    });
}

/// Renders.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    let output = arguments.output.clone().unwrap_or_else(|| default_output(arguments.scene.scene.as_deref()));
    if arguments.pixel.is_none() {
        image::check_writable(&output).map_err(|e| Failure::new(format!("{}: {e}", output.display())))?;
    }
    arguments.keeping.check()?;
    super::set_threads(arguments.threads)?;
    let mut description = arguments.scene.describe()?;
    if let Some(text) = &arguments.integrator {
        let root = description.root;
        replace_child(&mut description, root, ObjectKind::Integrator, text)?;
    }
    if let Some(text) = &arguments.guide {
        let of_kind = |id| description.node(id).kind == ObjectKind::Integrator;
        let integrator = description.children(description.root).map(|(_, child)| child).find(|child| of_kind(*child));
        let integrator =
            integrator.ok_or_else(|| Failure::new("--guide needs an integrator, and the scene has none"))?;
        replace_child(&mut description, integrator, ObjectKind::Guide, text)?;
    }
    if let Some(text) = &arguments.light_sampler {
        let node = short_form::parse(ObjectKind::LightSampler, text, "--light-sampler").map_err(Failure::new)?;
        short_form::decide(&mut description, registry, &node).map_err(Failure::new)?;
    }
    if let Some(text) = &arguments.roulette {
        let node = short_form::parse(ObjectKind::Roulette, text, "--roulette").map_err(Failure::new)?;
        short_form::decide(&mut description, registry, &node).map_err(Failure::new)?;
    }
    arguments.keeping.override_scene(&mut description);
    if let Some(size) = arguments.size {
        description.resize_films(size, "--size");
    }
    let is_integrator = |id| description.node(id).kind == ObjectKind::Integrator;
    let chosen = description.children(description.root).map(|(_, child)| child).find(|child| is_integrator(*child));
    let name = chosen.map_or_else(String::new, |child| description.node(child).plugin.clone());
    let hash = if arguments.keeping.keeps_state() { keeping::hash(&description)? } else { String::new() };
    let mut scene = arguments.scene.build(registry, description)?.scene;
    if arguments.reference_order.is_some() {
        scene.use_reference_offsets();
    }
    check_complete(&scene, arguments)?;
    let camera = camera(registry, &scene, arguments)?;
    let integrator = scene.integrator().ok_or_else(|| Failure::new("the scene has no integrator"))?.clone();
    let budget = match (arguments.seconds, arguments.spp) {
        (Some(seconds), _) => Budget::Seconds(seconds),
        (None, None) if arguments.views.target_relmse.is_some() => Budget::Samples(camera.sampler.round_spp(MOST_SPP)),
        (None, spp) => Budget::Samples(camera.sampler.round_spp(spp.unwrap_or(camera.sampler.sample_count()))),
    };
    tell_rounding(arguments, budget);
    render(arguments, (&scene, &hash), &camera, (&name, &*integrator), budget, &output)
}

fn tell_rounding(arguments: &Arguments, budget: Budget) {
    if let (Some(asked), Budget::Samples(spp)) = (arguments.spp, budget)
        && asked != spp
    {
        eprintln!("note: {asked} samples per pixel become {spp}: the sampler needs such a number");
    }
}

/// What the run takes, before it starts.
fn tell_size(size: UVec2, budget: Budget, target: Option<f64>, bytes: u64) {
    let work = match budget {
        Budget::Samples(spp) => format!("{spp} samples each"),
        Budget::Seconds(seconds) => format!("{seconds} s"),
    };
    let work = target.map_or(work.clone(), |target| format!("at most {work}, until the relMSE is about {target:e}"));
    let mib = bytes as f64 / f64::from(1 << 20);
    eprintln!("{} x {} pixels, {work}; the picture takes {mib:.1} MiB", size.x, size.y);
}

/// A scene may be read without a sensor or an integrator, but not rendered.
fn check_complete(scene: &Scene, arguments: &Arguments) -> Result<(), Failure> {
    let name = arguments.scene.name();
    let mut missing = Vec::new();
    if scene.sensors().is_empty() {
        missing.push(format!("error: {name}: the scene has no sensor (add a <sensor type=\"perspective\">)"));
    }
    if scene.integrator().is_none() {
        missing.push(format!("error: {name}: the scene has no integrator (add one, or use --integrator path)"));
    }
    if missing.is_empty() { Ok(()) } else { Err(Failure(missing.join("\n"))) }
}

/// A sensor by its number.
pub fn sensor(scene: &Scene, number: usize) -> Result<&BuiltSensor, Failure> {
    let count = scene.sensors().len();
    scene.sensors().get(number).ok_or_else(|| match count {
        1 => Failure::new(format!("there is no sensor {number}: the scene has one, number 0")),
        _ => Failure::new(format!("there is no sensor {number}: the scene has {count}, counted from 0")),
    })
}

/// The chosen sensor, with another sampler if one is asked for.
fn camera(registry: &Registry, scene: &Scene, arguments: &Arguments) -> Result<BuiltSensor, Failure> {
    let mut camera = sensor(scene, arguments.sensor)?.clone();
    if let Some(text) = &arguments.sampler {
        let node = short_form::parse(ObjectKind::Sampler, text, "--sampler").map_err(Failure::new)?;
        if let Object::Sampler(sampler) = build_one(registry, &Description::of(node))? {
            camera.sampler = sampler;
        }
    }
    Ok(camera)
}

fn render(
    arguments: &Arguments,
    (scene, hash): (&Scene, &str),
    camera: &BuiltSensor,
    (name, integrator): (&str, &dyn Integrator),
    budget: Budget,
    output: &Path,
) -> Result<ExitCode, Failure> {
    let window = window(arguments, camera)?;
    let bytes = integrator.bytes(window.1);
    let needed = bytes >> 20;
    if needed > arguments.max_memory {
        let name = arguments.scene.name();
        let message = format!("{name}: the picture needs {needed} MiB, the limit is {} MiB", arguments.max_memory);
        return Err(Failure::new(format!("{message} (raise it with --max-memory, or render a part with --crop)")));
    }
    if !arguments.quiet && arguments.pixel.is_none() {
        tell_size(window.1, budget, arguments.views.target_relmse, bytes);
        let flat = scene.accel().stats().degenerate;
        if flat > 0 {
            eprintln!("note: {flat} primitives have no area and are left out");
        }
    }
    let views: &'static Views = Box::leak(Box::new(arguments.views.open(&Rendered {
        scene: arguments.scene.name(),
        integrator: name,
        sampler: &*camera.sampler,
        film: camera.film.settings().size,
        window,
        output,
        quiet: arguments.quiet,
    })?));
    let control = control(views, integrator, budget);
    let mut cx =
        RenderContext::of_window(scene, camera, window, budget, arguments.seed, control, integrator.aov_names());
    if let Some(threads) = arguments.reference_order {
        cx.order = SampleOrder::Reference { threads };
    }
    let chosen = Chosen { sensor: arguments.sensor, sampler: arguments.sampler.as_deref(), seed: arguments.seed };
    arguments.keeping.apply(&mut cx, hash, &chosen);
    if let Some([x, y]) = arguments.pixel {
        return replay_pixel(&cx, integrator, UVec2::new(x, y), arguments.sample);
    }
    let report = integrator.render(&mut cx).map_err(Failure::new)?;
    let seen = views.finish(&report, &cx.store, &cx.film);
    write(arguments, name, &cx, &report, output)?;
    let line = summary(arguments, &cx, &report, &seen, output)?;
    views.close(&line, arguments.views.serve_keep, &|| control.is_stopped());
    let bad = report.bad.count > 0 && arguments.strict_nan;
    Ok(if bad { ExitCode::from(BAD_SAMPLES) } else { ExitCode::SUCCESS })
}

/// Stop button, deadline, and who is told. As Ctrl-C can come at any time, it lives as long as the program.
fn control(views: &'static Views, integrator: &dyn Integrator, budget: Budget) -> &'static Control<'static> {
    let show: &'static (dyn Fn(_) + Sync) = Box::leak(Box::new(|progress| views.progress(progress)));
    let look: OnPass<'static> = Box::leak(Box::new(|end: PassEnd<'_>| views.pass_end(end)));
    let mut control = Control::new().with_progress(show);
    if views.watches_passes() {
        control = control.with_pass_end(look);
    }
    let seconds = match budget {
        Budget::Seconds(seconds) => Some(seconds),
        Budget::Samples(_) => integrator.timeout(),
    };
    if let Some(seconds) = seconds {
        control = control.with_deadline(seconds);
    }
    let control: &'static Control<'static> = Box::leak(Box::new(control));
    stop_on_interrupt(control);
    control
}

/// Offset and size of the part to render: that of `--crop`, or of the film.
fn window(arguments: &Arguments, camera: &BuiltSensor) -> Result<(UVec2, UVec2), Failure> {
    let settings = camera.film.settings();
    let Some([x, y, width, height]) = arguments.crop else {
        return Ok((settings.crop_offset, settings.crop_size));
    };
    let (film, offset, size) = (settings.size, UVec2::new(x, y), UVec2::new(width, height));
    let inside = offset.checked_add(size).is_some_and(|end| end.cmple(film).all());
    if !inside || size.min_element() == 0 {
        return Err(Failure::new(format!("--crop must lie inside the film of {} x {} pixels", film.x, film.y)));
    }
    Ok((offset, size))
}

fn replay_pixel(
    cx: &RenderContext<'_>,
    integrator: &dyn Integrator,
    pixel: UVec2,
    sample: u32,
) -> Result<ExitCode, Failure> {
    let estimator =
        integrator.estimator().ok_or_else(|| Failure::new("this integrator has no samples that can be replayed"))?;
    if pixel.cmpge(cx.film.size).any() {
        let film = cx.film.size;
        return Err(Failure::new(format!("--pixel must lie inside the film of {} x {} pixels", film.x, film.y)));
    }
    let value = replay(cx, estimator, pixel, sample);
    let [r, g, b] = value.rgb.to_array();
    println!(
        "pixel {},{} sample {sample}: {r:?} {g:?} {b:?} alpha {:?} ({} rays)",
        pixel.x, pixel.y, value.alpha, value.rays
    );
    Ok(ExitCode::SUCCESS)
}

fn write(
    arguments: &Arguments,
    integrator: &str,
    cx: &RenderContext<'_>,
    report: &Report,
    output: &Path,
) -> Result<(), Failure> {
    let picture = cx.picture();
    let extension = output.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let written = match extension.as_deref() {
        Some("exr") => exr::write(output, &picture, &exr_options(arguments, integrator, cx, report)),
        Some("png") => png::write_srgb(output, &picture),
        _ => image::write(output, &picture),
    };
    written.map_err(|e| Failure::new(format!("{}: {e}", output.display())))
}

fn exr_options(arguments: &Arguments, integrator: &str, cx: &RenderContext<'_>, report: &Report) -> exr::ExrOptions {
    use exr::{Attribute, HalfChannels};
    let half = match (cx.film.component_format, cx.film.file_format) {
        (ComponentFormat::Float16, FileFormat::OpenExr) => HalfChannels::All,
        _ => HalfChannels::None,
    };
    let text = |s: &str| Attribute::Text(s.to_owned());
    exr::ExrOptions {
        half,
        attributes: vec![
            ("lucerna:version".to_owned(), text(env!("CARGO_PKG_VERSION"))),
            ("lucerna:scene".to_owned(), text(&arguments.scene.name())),
            ("lucerna:integrator".to_owned(), text(integrator)),
            ("lucerna:seed".to_owned(), Attribute::Number(f64::from(arguments.seed))),
            ("lucerna:spp".to_owned(), Attribute::Number(f64::from(report.spp))),
            ("lucerna:samples".to_owned(), Attribute::Number(report.samples as f64)),
            ("lucerna:seconds".to_owned(), Attribute::Number(report.seconds)),
        ],
        ..exr::ExrOptions::default()
    }
}

/// Tells how it ended, in the line that it gives and in the JSON file.
fn summary(
    arguments: &Arguments,
    cx: &RenderContext<'_>,
    report: &Report,
    seen: &Summary,
    output: &Path,
) -> Result<String, Failure> {
    view::tell_bad_samples(report, arguments.seed);
    if let Some(warning) = seen.warning() {
        eprintln!("{warning}");
    }
    let line = format!("{}: {}", output.display(), seen.tell(report, cx.store.size()));
    if !arguments.quiet {
        report.notes.iter().for_each(|note| eprintln!("{note}"));
        eprintln!("{line}");
    }
    if let Some(path) = &arguments.stats_json {
        let stats = seen.document(report);
        std::fs::write(path, format!("{stats:#}\n")).map_err(|e| Failure::new(format!("{}: {e}", path.display())))?;
    }
    Ok(line)
}

/// Puts an object from the command line in the place of the parent's own.
fn replace_child(description: &mut Description, parent: NodeId, kind: ObjectKind, text: &str) -> Result<(), Failure> {
    let node = short_form::parse(kind, text, &format!("--{}", kind.tag())).map_err(Failure::new)?;
    let at = node.at.clone();
    let id = description.add(node);
    let old: Vec<String> = description
        .children(parent)
        .filter(|(_, child)| description.node(*child).kind == kind)
        .map(|(parameter, _)| parameter.name.clone())
        .collect();
    let parameters = &mut description.node_mut(parent).parameters;
    parameters.retain(|p| !old.contains(&p.name));
    parameters.push(Parameter { name: format!("_{}", kind.tag()), value: Value::Object(id), at });
    Ok(())
}
