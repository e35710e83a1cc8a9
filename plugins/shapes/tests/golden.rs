//! Against tables of the reference renderer; see `reference/golden_shapes.py` for their making and format.

use super::{Traced, draft, shape};
use crate::testing::Draft;
use lucerna_core::math::{DMat4, Vec2, Vec3};
use lucerna_core::scene::Value;

const TABLE: &str = include_str!("../golden/shapes.txt");

/// The numbers of a line, taken off the front.
struct Numbers<'a>(std::str::SplitWhitespace<'a>);

impl Numbers<'_> {
    fn next(&mut self) -> f32 {
        self.0.next().expect("a number").parse().expect("a number")
    }

    fn pair(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

fn parse_shape(line: &str) -> Draft {
    let mut words = line.split_whitespace();
    let mut draft = draft(words.next().expect("a plugin"));
    for (name, text) in words.filter_map(|word| word.split_once('=')) {
        let numbers: Vec<f64> = text.split(',').filter_map(|t| t.parse().ok()).collect();
        draft = match (name, numbers.as_slice()) {
            ("to_world", m) => {
                let rows: [f64; 16] = std::array::from_fn(|i| if i < 12 { m[i] } else { f64::from(i == 15) });
                draft.to_world(DMat4::from_cols_array(&rows).transpose())
            }
            (_, [x, y, z]) => draft.set(name, Value::Vector([*x, *y, *z])),
            (_, [number]) => draft.float(name, *number),
            _ if matches!(text, "true" | "false") => draft.bool(name, text == "true"),
            _ => draft.string(name, text),
        };
    }
    draft
}

/// Fails if two values differ by more than `tolerance`, and says the largest difference of all.
struct Check {
    line: String,
    worst: f32,
}

impl Check {
    fn same(&mut self, what: &str, found: &[f32], expected: &[f32], tolerance: f32) {
        for (f, e) in found.iter().zip(expected) {
            let difference = (f - e).abs() / e.abs().max(1.0);
            assert!(difference <= tolerance, "{what}: {found:?}, not {expected:?} in {}", self.line);
            self.worst = self.worst.max(difference);
        }
    }

    fn vectors(&mut self, what: &str, found: Vec3, expected: Vec3) {
        self.same(what, &found.to_array(), &expected.to_array(), 1e-5);
    }
}

#[test]
fn hits_and_samples_as_the_reference() {
    let mut check = Check { line: String::new(), worst: 0.0 };
    let mut traced: Option<Traced> = None;
    let (mut is_mesh, mut is_curved) = (false, false);
    for line in TABLE.lines() {
        check.line = line.to_owned();
        let (word, rest) = line.split_once(' ').expect("words");
        if word == "shape" {
            is_mesh = ["cube", "obj", "ply"].contains(&rest.split(' ').next().expect("a plugin"));
            is_curved = rest.contains("bumpy") && !rest.contains("face_normals");
            traced = Some(Traced::new(shape(&parse_shape(rest))));
            continue;
        }
        let traced = traced.as_ref().expect("a shape first");
        let mut n = Numbers(rest.split_whitespace());
        match word {
            "hit" => {
                let (o, d) = (n.vector(), n.vector());
                let hit = traced.hit(o, d).expect("a hit");
                let t = n.next();
                check.same("t", &[hit.t], &[t], 1e-5);
                check.vectors("p", hit.p, n.vector());
                // Of mirrored shapes other than meshes, the reference's geometric normal is not its shading normal.
                let geometric = n.vector();
                check.vectors("shading normal", hit.frame.n, n.vector());
                check.vectors("normal", hit.n, if is_mesh { geometric } else { hit.frame.n });
                check.vectors("tangent", hit.frame.s, n.vector());
                check.same("uv", &hit.uv.to_array(), &n.pair().to_array(), 1e-5);
                check.vectors("dp_du", hit.dp_du, n.vector());
                check.vectors("dp_dv", hit.dp_dv, n.vector());
            }
            "area" => {
                let sample = traced.shape.sample_area(n.pair()).expect("a sample");
                check.vectors("p", sample.p, n.vector());
                check.same("uv", &sample.uv.to_array(), &n.pair().to_array(), 1e-5);
                check.same("pdf", &[sample.pdf], &[n.next()], 1e-5);
            }
            _ => {
                let from = n.vector();
                let (point, _, pdf) = traced.shape.sample_direct(from, n.pair()).expect("a sample");
                // At the rim of a sphere single precision costs the reference half of its digits: the tilt there is a
                // root of a difference that cancels. Lucerna computes it in double precision.
                check.same("p", &point.p.to_array(), &n.vector().to_array(), 5e-5);
                check.same("d", &point.d.to_array(), &n.vector().to_array(), 1e-5);
                // The reference takes the interpolated normal for the density, which is then not one per solid angle.
                if !is_curved {
                    check.same("pdf", &[pdf], &[n.next()], 1e-4);
                }
            }
        }
    }
    println!("largest difference: {}", check.worst);
}
