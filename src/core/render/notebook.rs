//! What a path notes on its way, and what it knows about its vertices in the end.

use crate::color::Rgb;
use crate::interfaces::{GuideRecord, RecordKind, Subjects, VertexRecord};
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
    /// As in [`GuideRecord`].
    pub pdf_sets: [f32; 2],
    /// As in [`GuideRecord`].
    pub primary: bool,
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

/// A vertex from which branches go on, one after the other.
struct Fork {
    /// Links behind it.
    behind: usize,
    /// Branches that have not ended.
    left: u32,
    /// What each counts for.
    share: f32,
    /// What those that have ended scattered, times the share.
    sum: Rgb,
    /// Number of those that have ended, sum and sum of squares of what they scattered as it is recorded.
    ended: [f32; 3],
    /// Rays traced before the branch under way.
    rays: u32,
    /// Where it is.
    place: Place,
}

/// A vertex as far as what it scatters depends on it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The vertex.
    pub p: Vec3,
    /// Unit normal on the side that light is scattered from.
    pub n: Vec3,
    /// Its albedo.
    pub albedo: Rgb,
}

/// The notes of a tile's paths: for the sample under way a chain of vertices with its forks, and the records of those that
/// have ended.
///
/// What a vertex receives is put together from the far end: it is what the ray met, and what the next vertex scattered.
/// So nothing is divided by a throughput, which may be tiny.
#[derive(Default)]
pub struct Notebook {
    links: Vec<Link>,
    forks: Vec<Fork>,
    /// Light of sampled emitters at the vertex whose direction is not known yet.
    direct: Rgb,
    records: Vec<GuideRecord>,
    vertices: Vec<VertexRecord>,
    learn_direct: bool,
    subjects: Subjects,
    /// Records of either kind that are kept; what comes after is not learnt.
    most: usize,
}

impl Notebook {
    /// An empty one. `learn_direct` says whether light counts that emitter sampling finds too, `most` how many records of
    /// either kind it holds.
    pub fn new(learn_direct: bool, subjects: Subjects, most: usize) -> Self {
        Notebook { learn_direct, subjects, most, ..Notebook::default() }
    }

    /// The records of all paths, in their order.
    pub fn into_records(self) -> (Vec<GuideRecord>, Vec<VertexRecord>) {
        (self.records, self.vertices)
    }

    /// The vertex being visited scatters light along `count` branches, each of which counts `share`; `rays` have been
    /// traced so far.
    #[inline]
    pub fn forked(&mut self, place: Place, count: u32, share: f32, rays: u32) {
        let behind = self.links.len();
        self.forks.push(Fork { behind, left: count, share, sum: Rgb::BLACK, ended: [0.0; 3], rays, place });
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

    /// The path, or the branch under way, has ended; `rays` have been traced so far.
    pub fn end(&mut self, rays: u32) {
        // Scattered by a vertex whose further direction is unknown: the path ended there.
        let mut scattered = std::mem::replace(&mut self.direct, Rgb::BLACK);
        loop {
            let behind = self.forks.last().map_or(0, |fork| fork.behind);
            while self.links.len() > behind
                && let Some(link) = self.links.pop()
            {
                scattered = self.read(&link, scattered);
            }
            let Some(fork) = self.forks.last_mut() else { return };
            let Place { p, n, albedo } = fork.place;
            let light = scattered.luminance() / albedo.luminance();
            fork.sum += scattered * fork.share;
            fork.left = fork.left.saturating_sub(1);
            if light.is_finite() && light >= 0.0 && self.vertices.len() < self.most {
                let [count, sum, squares] = &mut fork.ended;
                (*count, *sum, *squares) = (*count + 1.0, *sum + light, *squares + light * light);
                let variance = (*squares - *sum * *sum / *count).max(0.0) / (*count - 1.0);
                let spread = (fork.left == 0 && *count > 1.0 && variance.is_finite()).then_some(variance);
                self.vertices.push(VertexRecord { p, n, light, cost: (rays - fork.rays) as f32, spread });
            }
            fork.rays = rays;
            if fork.left > 0 {
                return;
            }
            scattered = fork.sum;
            self.forks.pop();
        }
    }

    /// Records what a vertex received, if the next one scattered that much, and gives what it scattered itself.
    fn read(&mut self, link: &Link, beyond: Rgb) -> Rgb {
        let Link { at, direct, met, met_alone, boost } = *link;
        let arriving = (met + beyond) * boost;
        if let Some(kind) = at.kind
            && self.subjects.directions
            && self.records.len() < self.most
        {
            let learnt = if self.learn_direct { arriving } else { (met_alone + beyond) * boost };
            let direct = (if self.learn_direct { met } else { met_alone } * boost).mean();
            let scattered = (at.weight * learnt).mean();
            let radiance = learnt.mean();
            if radiance.is_finite() && scattered.is_finite() && at.pdf > 0.0 && at.pdf.is_finite() {
                let Scattering { p, d, pdf, pdf_bsdf, pdf_guide, pdf_sets, primary, .. } = at;
                self.records.push(GuideRecord {
                    p,
                    d,
                    radiance,
                    direct,
                    scattered,
                    pdf,
                    pdf_bsdf,
                    pdf_guide,
                    pdf_sets,
                    kind,
                    primary,
                });
            }
        }
        direct + at.weight * arriving
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::figures::measured;

    const DIRECTIONS: Subjects = Subjects { directions: true, outlook: false };

    fn vertex(weight: f32) -> Scattering {
        let kind = Some(RecordKind::Unguided);
        Scattering {
            p: Vec3::ZERO,
            d: Vec3::Z,
            weight: Rgb::splat(weight),
            pdf: 0.5,
            pdf_bsdf: 0.5,
            pdf_guide: 0.0,
            pdf_sets: [0.0; 2],
            primary: false,
            kind,
        }
    }

    /// Three vertices with light on the way: what arrives at each, counted by hand.
    #[test]
    fn a_vertex_receives_what_lies_behind_it() {
        for (learn_direct, expected) in
            [(true, [5.0, 9.0, 1.0 + 0.5 * 9.0 + 2.0]), (false, [0.0, 8.0, 1.0 + 0.5 * 9.0])]
        {
            let mut book = Notebook::new(learn_direct, DIRECTIONS, usize::MAX);
            book.direct(Rgb::splat(7.0));
            book.scattered(vertex(3.0));
            book.met(Rgb::splat(2.0), false);
            book.direct(Rgb::splat(1.0));
            book.scattered(vertex(0.5));
            book.survived(0.25);
            book.met(Rgb::splat(0.25), false);
            book.scattered(vertex(0.4));
            book.met(Rgb::splat(5.0), false);
            book.end(0);
            let found: Vec<f32> = book.into_records().0.iter().map(|r| r.radiance).collect();
            assert_eq!(found, expected, "{learn_direct}");
        }
    }

    /// A path of a thousand vertices: every one is noted, with all the light behind it, and nothing stays for the next.
    #[test]
    fn hc_p05_a_path_of_a_thousand_vertices_is_noted_to_its_end() {
        const VERTICES: usize = 1000;
        let mut book = Notebook::new(true, DIRECTIONS, usize::MAX);
        for round in 1..=2 {
            for _ in 0..VERTICES {
                book.direct(Rgb::splat(1.0));
                book.scattered(vertex(0.5));
                book.survived(0.5);
            }
            book.met(Rgb::splat(3.0), true);
            book.end(0);
            assert_eq!((book.records.len(), book.links.len()), (round * VERTICES, 0));
        }
        // What is scattered is halved and doubled by roulette: from the last vertex 6 arrive, from each one before 2 more.
        let (records, _) = book.into_records();
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
        let mut book = Notebook::new(false, DIRECTIONS, usize::MAX);
        book.scattered(vertex(1.0));
        book.met(Rgb::splat(2.0), true);
        book.end(0);
        assert_eq!(book.into_records().0[0].radiance, 2.0);
    }

    /// One path does not leave anything to the next.
    #[test]
    fn paths_are_apart() {
        let mut book = Notebook::new(true, DIRECTIONS, usize::MAX);
        book.scattered(vertex(1.0));
        book.direct(Rgb::splat(3.0));
        book.end(0);
        book.scattered(vertex(1.0));
        book.end(0);
        let found: Vec<f32> = book.into_records().0.iter().map(|r| r.radiance).collect();
        assert_eq!(found, [3.0, 0.0]);
    }

    /// A path that splits in two, one branch of which splits again: what each vertex scattered, counted by hand.
    #[test]
    fn branches_count_their_share() {
        const OUTLOOK: Subjects = Subjects { directions: true, outlook: true };
        let place = Place { p: Vec3::ZERO, n: Vec3::Z, albedo: Rgb::splat(0.5) };
        let mut book = Notebook::new(true, OUTLOOK, usize::MAX);
        book.forked(place, 1, 1.0, 1);
        book.direct(Rgb::splat(1.0));
        book.scattered(vertex(0.5));
        book.forked(place, 2, 0.25, 3);
        book.direct(Rgb::splat(2.0));
        book.scattered(vertex(1.0));
        book.met(Rgb::splat(6.0), false);
        book.forked(place, 3, 0.5, 5);
        for i in 0..3 {
            book.direct(Rgb::splat(4.0));
            book.end(6 + i);
        }
        // The other branch is lost.
        book.end(10);
        let (records, vertices) = book.into_records();
        // The third vertex scattered 4 thrice, half of it counts; the second 2 + 6 + 6, and nothing.
        let light: Vec<f32> = vertices.iter().map(|v| 0.5 * v.light).collect();
        for (found, expected) in light.iter().zip([4.0, 4.0, 4.0, 14.0, 0.0, 1.0 + 0.5 * 0.25 * 14.0]) {
            assert!((found / expected - 1.0).abs() < 1e-6 || *found == expected, "{light:?}");
        }
        let cost: Vec<f32> = vertices.iter().map(|v| v.cost).collect();
        assert_eq!(cost, [1.0, 1.0, 1.0, 5.0, 2.0, 9.0]);
        let radiance: Vec<f32> = records.iter().map(|r| r.radiance).collect();
        assert_eq!(radiance, [12.0, 3.5]);
    }
}
