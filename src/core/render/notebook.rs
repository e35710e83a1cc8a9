//! What a path notes on its way, and what it knows about its vertices in the end.

use crate::color::Rgb;
use crate::interfaces::{GuideRecord, RecordKind};
use crate::math::Vec3;

/// A vertex at which a path was scattered.
#[derive(Clone, Copy, Debug)]
pub struct Scattering {
    /// The vertex.
    pub p: Vec3,
    /// World direction in which the path goes on.
    pub d: Vec3,
    /// Value over density of that direction, in the mixture it was drawn from.
    pub weight: Rgb,
    /// As in [`GuideRecord`].
    pub pdf: f32,
    /// As in [`GuideRecord`].
    pub pdf_bsdf: f32,
    /// As in [`GuideRecord`].
    pub pdf_guide: f32,
    /// How the direction was found; `None` where nothing can be learnt.
    pub kind: Option<RecordKind>,
}

/// One link of the chain: a vertex and what the path found behind it.
struct Link {
    at: Scattering,
    /// Light of sampled emitters that this vertex scattered.
    direct: Rgb,
    /// Light the ray that leaves it has run into, weighted against emitter sampling.
    met: Rgb,
    /// The part of `met` that emitter sampling could not have found.
    met_alone: Rgb,
    /// One over the probability with which roulette let the path go on.
    boost: f32,
}

/// The notes of paths: a chain of vertices for the one under way, and the records of those that have ended.
///
/// What a vertex receives is put together from the far end: it is what the ray met, and what the next vertex scattered.
/// So nothing is divided by a throughput, which may be tiny.
#[derive(Default)]
pub struct Notebook {
    links: Vec<Link>,
    /// Light of sampled emitters at the vertex whose direction is not known yet.
    direct: Rgb,
    records: Vec<GuideRecord>,
    learn_direct: bool,
}

impl Notebook {
    /// An empty one. `learn_direct` says whether light counts that emitter sampling finds too.
    pub fn new(learn_direct: bool) -> Self {
        Notebook { learn_direct, ..Notebook::default() }
    }

    /// The records of all paths, in their order.
    pub fn into_records(self) -> Vec<GuideRecord> {
        self.records
    }

    /// Light of a sampled emitter that the vertex being visited scatters towards the one before.
    #[inline]
    pub fn direct(&mut self, light: Rgb) {
        self.direct = light;
    }

    /// The path is scattered.
    #[inline]
    pub fn scattered(&mut self, at: Scattering) {
        let direct = std::mem::replace(&mut self.direct, Rgb::BLACK);
        self.links.push(Link { at, direct, met: Rgb::BLACK, met_alone: Rgb::BLACK, boost: 1.0 });
    }

    /// Roulette has let the path go on with probability `q`.
    #[inline]
    pub fn survived(&mut self, q: f32) {
        if let Some(last) = self.links.last_mut() {
            last.boost = 1.0 / q;
        }
    }

    /// The ray that left the last vertex has met this light; `alone` if emitter sampling could not find it.
    #[inline]
    pub fn met(&mut self, light: Rgb, alone: bool) {
        if let Some(last) = self.links.last_mut() {
            last.met = light;
            last.met_alone = if alone { light } else { Rgb::BLACK };
        }
    }

    /// The path has ended.
    pub fn end(&mut self) {
        // Scattered by a vertex whose further direction is unknown: the path ended there.
        let mut scattered = std::mem::replace(&mut self.direct, Rgb::BLACK);
        while let Some(Link { at, direct, met, met_alone, boost }) = self.links.pop() {
            let arriving = (met + scattered) * boost;
            if let Some(kind) = at.kind {
                let learnt = if self.learn_direct { arriving } else { (met_alone + scattered) * boost };
                let product = (at.weight * learnt).mean();
                let radiance = learnt.mean();
                if radiance.is_finite() && product.is_finite() && at.pdf > 0.0 && at.pdf.is_finite() {
                    let Scattering { p, d, pdf, pdf_bsdf, pdf_guide, .. } = at;
                    self.records.push(GuideRecord {
                        p,
                        d,
                        radiance,
                        scattered: product,
                        pdf,
                        pdf_bsdf,
                        pdf_guide,
                        kind,
                    });
                }
            }
            scattered = direct + at.weight * arriving;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::figures::measured;

    fn vertex(weight: f32) -> Scattering {
        let kind = Some(RecordKind::Unguided);
        Scattering {
            p: Vec3::ZERO,
            d: Vec3::Z,
            weight: Rgb::splat(weight),
            pdf: 0.5,
            pdf_bsdf: 0.5,
            pdf_guide: 0.0,
            kind,
        }
    }

    /// Three vertices with light on the way: what arrives at each, counted by hand.
    #[test]
    fn a_vertex_receives_what_lies_behind_it() {
        for (learn_direct, expected) in
            [(true, [5.0, 9.0, 1.0 + 0.5 * 9.0 + 2.0]), (false, [0.0, 8.0, 1.0 + 0.5 * 9.0])]
        {
            let mut book = Notebook::new(learn_direct);
            book.direct(Rgb::splat(7.0));
            book.scattered(vertex(3.0));
            book.met(Rgb::splat(2.0), false);
            book.direct(Rgb::splat(1.0));
            book.scattered(vertex(0.5));
            book.survived(0.25);
            book.met(Rgb::splat(0.25), false);
            book.scattered(vertex(0.4));
            book.met(Rgb::splat(5.0), false);
            book.end();
            let found: Vec<f32> = book.into_records().iter().map(|r| r.radiance).collect();
            assert_eq!(found, expected, "{learn_direct}");
        }
    }

    /// A path of a thousand vertices: every one is noted, with all the light behind it, and nothing stays for the next.
    #[test]
    fn hc_p05_a_path_of_a_thousand_vertices_is_noted_to_its_end() {
        const VERTICES: usize = 1000;
        let mut book = Notebook::new(true);
        for round in 1..=2 {
            for _ in 0..VERTICES {
                book.direct(Rgb::splat(1.0));
                book.scattered(vertex(0.5));
                book.survived(0.5);
            }
            book.met(Rgb::splat(3.0), true);
            book.end();
            assert_eq!((book.records.len(), book.links.len()), (round * VERTICES, 0));
        }
        // What is scattered is halved and doubled by roulette: from the last vertex 6 arrive, from each one before 2 more.
        let records = book.into_records();
        for path in records.chunks(VERTICES) {
            for (behind, record) in path.iter().enumerate() {
                let expected = 6.0 + 2.0 * behind as f32;
                assert!((record.radiance / expected - 1.0).abs() < 1e-4, "{behind}: {}", record.radiance);
            }
        }
        measured(
            "hc_p05_a_path_of_a_thousand_vertices_is_noted_to_its_end",
            format!("{VERTICES} records, the first of radiance {}", records[VERTICES - 1].radiance),
        );
    }

    #[test]
    fn light_that_only_scattering_finds_is_always_learnt() {
        let mut book = Notebook::new(false);
        book.scattered(vertex(1.0));
        book.met(Rgb::splat(2.0), true);
        book.end();
        assert_eq!(book.into_records()[0].radiance, 2.0);
    }

    /// One path does not leave anything to the next.
    #[test]
    fn paths_are_apart() {
        let mut book = Notebook::new(true);
        book.scattered(vertex(1.0));
        book.direct(Rgb::splat(3.0));
        book.end();
        book.scattered(vertex(1.0));
        book.end();
        let found: Vec<f32> = book.into_records().iter().map(|r| r.radiance).collect();
        assert_eq!(found, [3.0, 0.0]);
    }
}
