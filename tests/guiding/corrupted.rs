//! A guide that is wrong on purpose: it learns as `sd_tree` does, and spoils what is asked of it.

use super::cone;
use lucerna::core::interfaces::{
    Arena, Guide, GuideField, GuideLearner, GuideRecord, GuideSets, GuidedDirections, GuidedVertex, Outlook,
    SurfaceHit, Training, VertexRecord, mix,
};
use lucerna::core::math::{Aabb, Vec2, Vec3};
use lucerna::core::sampling::warp::square_to_sphere;
use lucerna::core::scene::{
    Built, Constructor, Description, Location, Node, Object, ObjectKind, Param, Plugin, Properties, build_one,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// Ways to be wrong.
pub const WAYS: &[&str] = &["none", "random", "inverted", "one_direction", "one_cell", "empty"];

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "corrupted",
    aliases: &[],
    summary: "a guide that is wrong on purpose",
    params: &[&[
        Param::string("way", "none", "in which way; \"wrong\" has a density that is not that of its samples"),
        Param::float_opt("p_guide", "probability of the guide; as learnt if unset"),
        Param::string("outlook", "learnt", "what is told to roulette: learnt, zero, huge, nan, or random"),
        Param::int("candidates", 1, "directions tried at a vertex"),
        Param::string("sets", "one", "sets of directions"),
        Param::choice("nee", &["never", "kickstart", "always"], "always", "when lights are sampled"),
    ]],
    build: Constructor::Guide(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Guide> {
    let at = Location::file("corrupted".to_owned());
    let value = |name: &str, value: lucerna::core::scene::Value| lucerna::core::scene::Parameter {
        name: name.to_owned(),
        value,
        at: at.clone(),
    };
    let node = Node {
        kind: ObjectKind::Guide,
        plugin: "sd_tree".to_owned(),
        id: None,
        parameters: vec![
            value("product", lucerna::core::scene::Value::String("resampling".to_owned())),
            value("candidates", lucerna::core::scene::Value::Integer(p.int("candidates"))),
            value("sets", lucerna::core::scene::Value::String(p.string("sets").to_owned())),
            value("nee", lucerna::core::scene::Value::String(p.choice("nee").to_owned())),
            // All vertices are spoilt, and iterations are several.
            value("least_gain", lucerna::core::scene::Value::Float(0.0)),
            value("learning", lucerna::core::scene::Value::Float(0.4)),
            // Small, so that a few samples make many cells.
            value("spatial_threshold", lucerna::core::scene::Value::Float(200.0)),
        ],
        at: at.clone(),
        included_from: Vec::new(),
    };
    match build_one(&lucerna::builtin(), &Description::of(node)) {
        Ok(Object::Guide(inner)) => {
            let (way, outlook) = (p.string("way").to_owned(), p.string("outlook").to_owned());
            Ok(Arc::new(Corrupted { inner, spoils: Spoils { way, outlook, p_guide: p.float_opt("p_guide") } }))
        }
        _ => Err(p.error("", "sd_tree cannot be built")),
    }
}

struct Corrupted {
    inner: Arc<dyn Guide>,
    spoils: Spoils,
}

/// What is spoilt.
#[derive(Clone)]
struct Spoils {
    way: String,
    outlook: String,
    p_guide: Option<f32>,
}

impl Guide for Corrupted {
    fn start(&self, bounds: Aabb) -> Box<dyn GuideLearner> {
        Box::new(Learner { inner: self.inner.start(bounds), spoils: self.spoils.clone() })
    }

    fn training(&self) -> Training {
        self.inner.training()
    }
}

struct Learner {
    inner: Box<dyn GuideLearner>,
    spoils: Spoils,
}

impl GuideLearner for Learner {
    fn learn(&mut self, tiles: &[Vec<GuideRecord>]) {
        self.inner.learn(tiles);
    }

    fn learn_outlook(&mut self, tiles: &[Vec<VertexRecord>]) {
        self.inner.learn_outlook(tiles);
    }

    fn refine(&mut self, spp: u32) {
        self.inner.refine(spp);
        self.inner.field().validate().expect("the field is sound");
    }

    fn field(&self) -> Arc<dyn GuideField> {
        Arc::new(Field { inner: self.inner.field(), spoils: self.spoils.clone() })
    }

    fn summary(&self) -> Vec<String> {
        self.inner.summary()
    }
}

struct Field {
    inner: Arc<dyn GuideField>,
    spoils: Spoils,
}

/// A number that differs from place to place.
fn key(p: Vec3) -> u64 {
    let place = (p * 4.0).floor();
    [place.x, place.y, place.z].iter().fold(0, |key, x| mix(key ^ u64::from(x.to_bits())))
}

impl GuideField for Field {
    fn cell(&self, p: Vec3) -> usize {
        self.inner.cell(p)
    }

    fn at<'g>(
        &'g self,
        cell: usize,
        hit: &SurfaceHit,
        vertex: GuidedVertex,
        arena: &'g Arena,
    ) -> Option<&'g dyn GuidedDirections> {
        if self.spoils.way == "empty" {
            return None;
        }
        let inner = self.inner.at(cell, hit, vertex, arena)?;
        let p_guide = self.spoils.p_guide.unwrap_or_else(|| inner.p_guide());
        Some(arena.alloc(Spoilt { inner, way: &self.spoils.way, p_guide, key: key(hit.p) }))
    }

    fn sets(&self) -> GuideSets {
        self.inner.sets()
    }

    fn incident(&self, p: Vec3, d: Vec3) -> Option<f32> {
        self.inner.incident(p, d)
    }

    fn outlook(&self, cell: usize, n: Vec3) -> Option<Outlook> {
        let all = |x| Some(Outlook { light: x, square: x, spread: x, cost: x });
        match &*self.spoils.outlook {
            "zero" => all(0.0),
            "huge" => all(1e30),
            "nan" => all(f32::NAN),
            "random" => {
                let part = |i: u64| ((mix(mix(cell as u64) ^ i) % 8) as f32 - 4.0).exp2();
                Some(Outlook { light: part(1), square: part(2), spread: part(3), cost: part(4) })
            }
            _ => self.inner.outlook(cell, n),
        }
    }

    fn validate(&self) -> Result<(), String> {
        self.inner.validate()
    }
}

struct Spoilt<'g> {
    inner: &'g dyn GuidedDirections,
    way: &'g str,
    p_guide: f32,
    key: u64,
}

/// The octant of a direction.
fn octant(d: Vec3) -> usize {
    usize::from(d.x < 0.0) + 2 * usize::from(d.y < 0.0) + 4 * usize::from(d.z < 0.0)
}

/// Cosine of the cone that holds all of the one direction.
const NARROW: f32 = 0.9999;

impl Spoilt<'_> {
    /// Random weights of the octants; some are zero.
    fn weights(&self) -> [f32; 8] {
        let weights = std::array::from_fn(|i| ((mix(self.key ^ i as u64) & 0xff) as f32 - 80.0).max(0.0));
        if weights.iter().sum::<f32>() > 0.0 { weights } else { [1.0; 8] }
    }

    /// A direction in an octant.
    fn in_octant(octant: usize, u2: Vec2) -> Vec3 {
        let d = square_to_sphere(u2).abs();
        let sign = |bit: usize| if octant & bit == 0 { 1.0 } else { -1.0 };
        Vec3::new(sign(1) * d.x, sign(2) * d.y, sign(4) * d.z)
    }
}

impl GuidedDirections for Spoilt<'_> {
    fn p_guide(&self) -> f32 {
        self.p_guide
    }

    fn sample(&self, u2: Vec2) -> (Vec3, f32) {
        let d = match self.way {
            "random" => {
                let weights = self.weights();
                let mut rest = u2.x * weights.iter().sum::<f32>();
                let mut chosen = weights.iter().rposition(|w| *w > 0.0).unwrap_or(0);
                for (i, weight) in weights.iter().enumerate() {
                    if rest < *weight {
                        chosen = i;
                        break;
                    }
                    rest -= weight;
                }
                let x = (rest / weights[chosen]).clamp(0.0, 0.999_999);
                Self::in_octant(chosen, Vec2::new(x, u2.y))
            }
            "inverted" => -self.inner.sample(u2).0,
            "one_direction" => cone::sample(u2, NARROW),
            "one_cell" => Self::in_octant(5, u2),
            _ => self.inner.sample(u2).0,
        };
        (d, self.pdf(d))
    }

    fn pdf(&self, d: Vec3) -> f32 {
        match self.way {
            "random" => {
                let weights = self.weights();
                weights[octant(d)] / weights.iter().sum::<f32>() * 8.0 / (4.0 * PI)
            }
            "inverted" => self.inner.pdf(-d),
            "one_direction" => {
                if d.z >= NARROW {
                    cone::pdf(NARROW)
                } else {
                    0.0
                }
            }
            "one_cell" => {
                if octant(d) == 5 {
                    8.0 / (4.0 * PI)
                } else {
                    0.0
                }
            }
            "wrong" => 0.9 * self.inner.pdf(d),
            _ => self.inner.pdf(d),
        }
    }
}
