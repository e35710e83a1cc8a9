//! What large scenes take, counted byte by byte.

mod support;

use lucerna::core::interfaces::{Emitter, EmitterFlags, LightPoint, LightSample};
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::sampling::Discrete;
use lucerna::core::scene::{EmitterId, EmitterSource, Scene};
use lucerna::core::stats::figures::measured;
use peak_alloc::PeakAlloc;
use std::path::Path;
use std::sync::{Arc, Mutex};
use support::load_text;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Held while bytes are counted: what another test allocates would be counted, too.
static COUNTING: Mutex<()> = Mutex::new(());

/// What is made, and the bytes that it keeps.
fn bytes_of<T>(make: impl FnOnce() -> T) -> (T, usize) {
    let before = MEMORY.current_usage();
    let made = make();
    (made, MEMORY.current_usage().saturating_sub(before))
}

/// Instances, loaded from a file. A quarter of a million, to save time: what each takes does not depend on it.
#[test]
fn hc_g17_many_instances() {
    const COUNT: usize = 250_000;
    let _alone = COUNTING.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut text = "<scene version='3.0.0'><shape type='shapegroup' id='g'><shape type='cube'/></shape>".to_owned();
    for i in 0..COUNT {
        let (x, y, z) = (i % 100, i / 100 % 100, i / 10_000);
        text += &format!(
            "<shape type='instance'><ref id='g'/><transform name='to_world'><translate x='{x}' y='{y}' z='{z}'/></transform></shape>"
        );
    }
    text += "</scene>";
    // What is read meanwhile is gone when the scene is there.
    let (scene, bytes) = bytes_of(|| load_text(&text, Path::new(".")));
    let each = bytes / COUNT;
    measured("hc_g17_many_instances", format!("{each} bytes each"));
    assert_eq!(scene.shapes().len(), COUNT);
    assert!(each <= 300, "{each} bytes each");
}

/// A light of so many watts.
struct Lamp(f32);

impl Emitter for Lamp {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::DELTA
    }

    fn sampling_weight(&self) -> f32 {
        self.0
    }

    fn sample_direct(&self, _from: Vec3, _u2: Vec2) -> Option<LightSample> {
        None
    }

    fn pdf_direct(&self, _from: Vec3, _point: &LightPoint) -> f32 {
        0.0
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        self.0
    }
}

/// A million lights, one of them a million times brighter than the others: half of all picks are that one.
#[test]
fn hc_e02_a_million_lights() {
    const COUNT: usize = 1_000_000;
    const BRIGHT: usize = 123_456;
    let _alone = COUNTING.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let weight = |i: usize| if i == BRIGHT { 1e6 } else { 1.0 };
    let (table, table_bytes) = bytes_of(|| Discrete::new((0..COUNT).map(weight)));
    drop(table);
    let sources = || (0..COUNT).map(|i| EmitterSource::Free(Arc::new(Lamp(weight(i) as f32)))).collect::<Vec<_>>();
    let (scene, bytes) = bytes_of(|| Scene::new(Vec::new(), &sources(), Vec::new(), None).expect("a scene"));
    let each = bytes / COUNT;
    measured(
        "hc_e02_a_million_lights",
        format!("{each} bytes each in the scene, {} of them for the selection; exact", table_bytes / COUNT),
    );
    assert!(each <= 64, "{each} bytes each");

    let sum = 1e6 + (COUNT - 1) as f64;
    assert_eq!(scene.emitter_pmf(EmitterId(BRIGHT as u32)), (1e6 / sum) as f32);
    assert_eq!(scene.emitter_pmf(EmitterId(0)), (1.0 / sum) as f32);
    // Each number picks the light that a search over all weights in double precision would find.
    for step in 0..100_000 {
        let u = step as f32 / 100_000.0;
        let target = f64::from(u) * sum;
        let expected = match target {
            t if t < BRIGHT as f64 => t as usize,
            t if t < BRIGHT as f64 + 1e6 => BRIGHT,
            t => (t - 1e6) as usize + 1,
        };
        let (id, pmf, rest) = scene.choose_emitter(u).expect("a light");
        assert_eq!(id.0 as usize, expected, "{u}");
        assert!(pmf > 0.0 && (0.0..1.0).contains(&rest));
    }
}
