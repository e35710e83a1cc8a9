//! `lucerna guide`: what a guide has learnt, in numbers and as a picture.

use super::Failure;
use super::render::numbers;
use super::scene_args::SceneArguments;
use crate::short_form;
use crate::view::directions::{Learned, Place};
use clap::{Args, Subcommand};
use lucerna_core::image;
use lucerna_core::interfaces::{FactValue, Guide, GuideFact};
use lucerna_core::math::UVec2;
use lucerna_core::render::Learnt;
use lucerna_core::scene::{Description, Object, ObjectKind, Registry, build_one};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Options of `guide`.
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Tell what a file of learnt state holds
    Info(InfoArguments),
    /// Draw the directions that were learnt where pixels see the scene
    View(Box<ViewArguments>),
}

#[derive(Args)]
struct InfoArguments {
    /// A file that `render --guide-file` has written
    file: PathBuf,

    /// In JSON
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ViewArguments {
    #[command(flatten)]
    scene: SceneArguments,

    /// A file that `render --guide-file` has written in this scene
    #[arg(long, value_name = "FILE")]
    guide_file: PathBuf,

    /// The pixel through whose centre the scene is looked at (repeatable)
    #[arg(long, value_name = "X,Y", required = true, value_parser = numbers::<2>)]
    pixel: Vec<[u32; 2]>,

    /// Where to write the picture: .png, .exr, .pfm or .hdr
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Another picture size, as WIDTHxHEIGHT, which pixels then belong to
    #[arg(long, value_name = "WxH", value_parser = super::render::size)]
    size: Option<[u32; 2]>,

    /// Which sensor of the scene, counted from 0
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    sensor: usize,
}

/// Most pixels of a picture: it gets wide.
const MOST_PIXELS: usize = 16;

/// Does what the arguments say.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        Command::Info(arguments) => info(registry, arguments),
        Command::View(arguments) => view(registry, arguments),
    }
}

/// What a file holds, and the guide it is of with that one's usual settings.
fn read(registry: &Registry, path: &Path) -> Result<(Learnt, Arc<dyn Guide>), Failure> {
    let learnt = Learnt::read(path).map_err(Failure::new)?;
    let plugin = registry.find(ObjectKind::Guide, &learnt.guide);
    let plugin = plugin.ok_or_else(|| at(path, "is of a guide that this program does not have"))?;
    let node = short_form::parse(ObjectKind::Guide, plugin.name, "guide").map_err(Failure::new)?;
    match build_one(registry, &Description::of(node))? {
        Object::Guide(guide) => Ok((learnt, guide)),
        _ => Err(at(path, "is of no guide")),
    }
}

/// A message about a file.
fn at(path: &Path, message: impl std::fmt::Display) -> Failure {
    Failure::new(format!("{}: {message}", path.display()))
}

fn info(registry: &Registry, arguments: &InfoArguments) -> Result<ExitCode, Failure> {
    let (learnt, guide) = read(registry, &arguments.file)?;
    let learner = learnt.recall(&*guide, learnt.bounds).map_err(|e| at(&arguments.file, e))?;
    let facts = learner.facts();
    let (min, max) = (learnt.bounds.min.to_array(), learnt.bounds.max.to_array());
    if arguments.json {
        let facts: Map<String, Value> = facts.iter().map(|fact| (fact.name.replace(' ', "_"), in_json(fact))).collect();
        let all =
            json!({ "guide": learnt.guide, "bounds": [min, max], "samples_per_pixel": learnt.spp, "learnt": facts });
        println!("{all:#}");
        return Ok(ExitCode::SUCCESS);
    }
    println!("{}: what {} has learnt", arguments.file.display(), learnt.guide);
    println!("  scene inside {min:?} to {max:?}");
    println!("  longest iteration learnt from: {} samples per pixel", learnt.spp);
    facts.iter().for_each(tell);
    Ok(ExitCode::SUCCESS)
}

fn in_json(fact: &GuideFact) -> Value {
    match &fact.value {
        FactValue::Count(count) => json!(count),
        FactValue::Number(number) => json!(number),
        FactValue::Range(range) => json!(range),
        FactValue::PerDepth(counts) => json!(counts),
    }
}

fn tell(fact: &GuideFact) {
    match &fact.value {
        FactValue::Count(count) => println!("  {}: {count}", fact.name),
        FactValue::Number(number) => println!("  {}: {number:.3}", fact.name),
        FactValue::Range([low, high]) => println!("  {}: {low:.3e} to {high:.3e}", fact.name),
        FactValue::PerDepth(counts) => {
            println!("  {}:", fact.name);
            for (depth, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                println!("    {depth:>3}  {count}");
            }
        }
    }
}

fn view(registry: &Registry, arguments: &ViewArguments) -> Result<ExitCode, Failure> {
    let output = &arguments.output;
    image::check_writable(output).map_err(|e| at(output, e))?;
    if arguments.pixel.len() > MOST_PIXELS {
        return Err(Failure::new(format!("--pixel: at most {MOST_PIXELS} at a time")));
    }
    let mut description = arguments.scene.describe()?;
    if let Some(size) = arguments.size {
        description.resize_films(size, "--size");
    }
    let scene = arguments.scene.build(registry, description)?.scene;
    let camera = super::render::sensor(&scene, arguments.sensor)?;
    let size = camera.film.settings().size;
    let pixels: Vec<UVec2> = arguments.pixel.iter().map(|[x, y]| UVec2::new(*x, *y)).collect();
    if pixels.iter().any(|pixel| pixel.cmpge(size).any()) {
        return Err(Failure::new(format!("--pixel must lie inside the film of {} x {} pixels", size.x, size.y)));
    }
    let (learnt, guide) = read(registry, &arguments.guide_file)?;
    let learner = learnt.recall(&*guide, scene.accel().bounds()).map_err(|e| at(&arguments.guide_file, e))?;
    let field = learner.field();
    if !field.guides() {
        println!("paths are left to the BSDF, since the guide gains little; what it has learnt is shown");
    }
    let least_roughness = guide.training().least_roughness;
    let learned = Learned { scene: &scene, sensor: &*camera.sensor, size, field: &*field, least_roughness };
    let places: Vec<Place> = pixels.into_iter().map(|pixel| learned.look(pixel)).collect();
    places.iter().for_each(tell_place);
    let picture = learned.picture(&places);
    image::write(output, &picture).map_err(|e| at(output, e))?;
    Ok(ExitCode::SUCCESS)
}

fn tell_place(place: &Place) {
    let pixel = format!("pixel {},{}", place.pixel.x, place.pixel.y);
    let Some(p) = place.hit else { return println!("{pixel}: nothing is seen") };
    let guided = place.p_guide.map_or("not guided".to_owned(), |p| format!("probability of the guide {p:.3}"));
    let peak = place.peak.map_or("no light was found".to_owned(), |(d, density)| {
        format!("most towards {:?}, {density:.3e} times uniform", d.to_array())
    });
    println!("{pixel}: at {:?}, {guided}, {peak}", p.to_array());
}
