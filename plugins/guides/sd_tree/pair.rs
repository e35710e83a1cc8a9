//! Directions where something is kept [apart](super::sets).

use super::field::{Field, Here, Leaf};
use super::quadtree::Quadtree;
use super::sets::ApartLeaf;
use lucerna_core::interfaces::{Arena, GuideSets, GuidedDirections, GuidedVertex, SurfaceHit};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};

impl Field {
    /// As [`at`](lucerna_core::interfaces::GuideField::at), in a cell that keeps something apart.
    pub(super) fn at_apart<'g>(
        &'g self,
        (leaf, apart): (&'g Leaf, &'g ApartLeaf),
        hit: &SurfaceHit,
        vertex: GuidedVertex,
        arena: &'g Arena,
    ) -> Option<&'g dyn GuidedDirections> {
        if self.sets == GuideSets::PrimaryProduct {
            return match apart.directions.as_deref().filter(|_| vertex.primary) {
                // The cosine is in it.
                Some(tree) => Some(arena.alloc(Here::of_product(tree.view(), apart.p)?)),
                None => Some(arena.alloc(self.here(
                    leaf.directions.as_deref()?.view(),
                    leaf.p_guide,
                    hit,
                    vertex.one_sided,
                )?)),
            };
        }
        let here = |tree: &'g Quadtree| self.here(tree.view(), leaf.p_guide, hit, vertex.one_sided);
        let direct = apart.directions.as_deref().and_then(here);
        let rest = leaf.directions.as_deref().and_then(here);
        match (direct, rest) {
            (Some(direct), Some(rest)) => {
                let [bright, dim] = [apart.fluence * direct.total, leaf.fluence * rest.total];
                let part = bright / (bright + dim);
                let lit = if part.is_finite() { part } else { apart.p };
                Some(arena.alloc(Pair { direct, rest, c: apart.p, lit }))
            }
            (Some(alone), None) | (None, Some(alone)) => Some(arena.alloc(alone)),
            (None, None) => None,
        }
    }
}

/// The mixture of light met directly and the rest.
struct Pair<'g> {
    direct: Here<'g>,
    rest: Here<'g>,
    /// Probability of the first.
    c: f32,
    /// Its part in what a diffuse surface would scatter.
    lit: f32,
}

impl GuidedDirections for Pair<'_> {
    fn p_guide(&self) -> f32 {
        self.rest.p_guide()
    }

    fn sample(&self, u2: Vec2) -> (Vec3, f32) {
        let Pair { direct, rest, c, .. } = self;
        let within = |x: f32| Vec2::new(x.min(ONE_MINUS_EPSILON), u2.y);
        if u2.x < *c {
            let (d, pdf) = direct.sample(within(u2.x / c));
            return (d, c * pdf + (1.0 - c) * rest.pdf(d));
        }
        let (d, pdf) = rest.sample(within((u2.x - c) / (1.0 - c)));
        (d, c * direct.pdf(d) + (1.0 - c) * pdf)
    }

    fn pdf(&self, d: Vec3) -> f32 {
        self.c * self.direct.pdf(d) + (1.0 - self.c) * self.rest.pdf(d)
    }

    fn pdf_sets(&self, d: Vec3) -> [f32; 2] {
        [self.direct.pdf(d), self.rest.pdf(d)]
    }

    fn light(&self, d: Vec3) -> f32 {
        self.lit * self.direct.light(d) + (1.0 - self.lit) * self.rest.light(d)
    }
}
