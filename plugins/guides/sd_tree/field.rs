//! What has been learnt, to be sampled.

use super::cylinder;
use super::near::Near;
use super::outlook::{SIDES, side};
use super::quadtree::{CELLS, EDGE, Quads, Quadtree, UNIFORM, long};
use super::sets::{ApartLeaf, is_lit};
use super::spatial::SpatialTree;
use lucerna_core::interfaces::{Arena, GuideField, GuideSets, GuidedDirections, GuidedVertex, Outlook, SurfaceHit};
use lucerna_core::math::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::{Arc, LazyLock};

/// A field.
pub struct Field {
    pub tree: SpatialTree,
    pub leaves: Vec<Leaf>,
    /// Whether paths are guided: [more is gained](super::gain) than it costs, or it is not known yet.
    pub guides: bool,
    /// Whether directions are weighted by the cosine at the vertex.
    pub cosine: bool,
    /// Whether something is kept apart,
    pub sets: GuideSets,
    /// and that, as many as there are leaves; empty if not.
    pub apart: Vec<ApartLeaf>,
    /// What vertices need of the leaves, if nothing is kept apart.
    near: Near,
}

/// What is known in a cell of space.
#[derive(Clone, Default)]
pub struct Leaf {
    /// Nothing where no light has arrived yet. Cells that were one share it.
    pub directions: Option<Arc<Quadtree>>,
    /// Probability of the guide.
    pub p_guide: f32,
    /// Mean radiance times 4π that arrived.
    pub fluence: f32,
    /// What scattering has brought, for each side that surfaces may face.
    pub outlooks: [Option<Outlook>; SIDES],
}

impl GuideField for Field {
    fn cell(&self, p: Vec3) -> usize {
        self.tree.at(p)
    }

    fn at<'g>(
        &'g self,
        cell: usize,
        hit: &SurfaceHit,
        vertex: GuidedVertex,
        arena: &'g Arena,
    ) -> Option<&'g dyn GuidedDirections> {
        if let Some(apart) = self.apart.get(cell) {
            return self.at_apart((&self.leaves[cell], apart), hit, vertex, arena);
        }
        let (tree, p_guide) = self.near.get(cell)?;
        Some(arena.alloc(self.here(tree, p_guide, hit, vertex.one_sided)?))
    }

    fn guides(&self) -> bool {
        self.guides
    }

    fn sets(&self) -> GuideSets {
        self.sets
    }

    fn incident(&self, p: Vec3, d: Vec3) -> Option<f32> {
        let index = self.tree.at(p);
        let leaf = &self.leaves[index];
        // What is kept apart may be a part of the light; what first hits scatter is none.
        let apart = self.apart.get(index).filter(|_| self.sets == GuideSets::DirectIndirect);
        if !is_lit(leaf, apart) {
            return None;
        }
        let radiance = |tree: &Quadtree, fluence: f32| {
            let (cell, density) = tree.view().pdf_in_cell(cylinder::of_direction(d));
            fluence * UNIFORM * tree.view().part(cell) * CELLS as f32 * density
        };
        let of_leaf = leaf.directions.as_deref().map_or(0.0, |tree| radiance(tree, leaf.fluence));
        let of_apart = apart.and_then(|apart| Some(radiance(apart.directions.as_deref()?, apart.fluence)));
        Some(of_leaf + of_apart.unwrap_or(0.0))
    }

    fn outlook(&self, cell: usize, n: Vec3) -> Option<Outlook> {
        self.leaves[cell].outlooks[side(n)]
    }

    fn validate(&self) -> Result<(), String> {
        self.tree.validate()?;
        if self.leaves.len() != self.tree.leaves() {
            return Err("the field does not have as many leaves as its tree".to_owned());
        }
        for leaf in &self.leaves {
            if !(0.0..=1.0).contains(&leaf.p_guide) || !(0.0..f32::INFINITY).contains(&leaf.fluence) {
                return Err("a leaf has no usable probability or fluence".to_owned());
            }
            leaf.directions.iter().try_for_each(|tree| tree.validate())?;
        }
        let expected = if self.sets == GuideSets::One { 0 } else { self.leaves.len() };
        if self.apart.len() != expected {
            return Err("the field does not keep something apart in every leaf".to_owned());
        }
        for ApartLeaf { directions, p, fluence } in &self.apart {
            if !(0.0..=1.0).contains(p) || !(0.0..f32::INFINITY).contains(fluence) {
                return Err("a leaf has no usable probability or fluence apart".to_owned());
            }
            directions.iter().try_for_each(|tree| tree.validate())?;
        }
        Ok(())
    }
}

impl Field {
    /// What is known in the leaves of a tree over space.
    pub fn new(tree: SpatialTree, leaves: Vec<Leaf>, cosine: bool, sets: GuideSets, apart: Vec<ApartLeaf>) -> Self {
        let near = if apart.is_empty() { Near::new(&leaves) } else { Near::default() };
        Field { tree, leaves, guides: true, cosine, sets, apart, near }
    }

    /// A tree of a leaf at a vertex.
    #[inline]
    pub(super) fn here<'g>(
        &self,
        tree: Quads<'g>,
        p_guide: f32,
        hit: &SurfaceHit,
        one_sided: bool,
    ) -> Option<Here<'g>> {
        let normal = hit.frame.n * 1f32.copysign(hit.wi.z);
        // The integral of the factor over all directions.
        let (cosines, reach) =
            if self.cosine && one_sided { (cosines(normal), PI * f32::from(UPRIGHT)) } else { (&[1; CELLS], 4.0 * PI) };
        Here::new(tree, p_guide, cosines, reach)
    }
}

/// A leaf's directions at a vertex. Weights of cells are products that are made when they are needed: most vertices need
/// few of them, but all need their sums.
pub(super) struct Here<'g> {
    tree: Quads<'g>,
    /// Factors of the grid's cells.
    cosines: &'g [u8; CELLS],
    p_guide: f32,
    /// Sums of the weights in the columns of the grid.
    columns: [f32; EDGE],
    /// The sum of all.
    pub(super) total: f32,
    /// What makes a density relative to a uniform one, per solid angle, of a weight.
    scale: f32,
    /// What makes a density before it is weighted a multiple of the mean.
    reach: f32,
}

impl<'g> Here<'g> {
    /// A tree that has the cosine in it.
    pub(super) fn of_product(tree: Quads<'g>, p_guide: f32) -> Option<Self> {
        Here::new(tree, p_guide, &[1; CELLS], 4.0 * PI)
    }

    /// `None` if no light comes from where it would be scattered.
    #[inline]
    fn new(tree: Quads<'g>, p_guide: f32, cosines: &'g [u8; CELLS], reach: f32) -> Option<Self> {
        let mut columns = [0.0; EDGE];
        let rows = tree.grid().as_chunks::<EDGE>().0.iter().zip(cosines.as_chunks::<EDGE>().0);
        rows.for_each(|(grid, cosines)| {
            for i in 0..EDGE {
                columns[i] += long(grid[i]) * f32::from(cosines[i]);
            }
        });
        let total = sum(&columns);
        let scale = UNIFORM * CELLS as f32 / total;
        (total > 0.0 && scale.is_finite()).then_some(Here { tree, cosines, p_guide, columns, total, scale, reach })
    }
}

/// The weights of a column of the grid.
#[inline]
fn product(tree: Quads<'_>, cosines: &[u8; CELLS], column: usize) -> [f32; EDGE] {
    std::array::from_fn(|j| tree.part(EDGE * j + column) * f32::from(cosines[EDGE * j + column]))
}

/// The sum of eight numbers, always in the same order.
#[inline]
fn sum([a, b, c, d, e, f, g, h]: &[f32; EDGE]) -> f32 {
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

impl GuidedDirections for Here<'_> {
    fn p_guide(&self) -> f32 {
        self.p_guide
    }

    fn sample(&self, u2: Vec2) -> (Vec3, f32) {
        let (column, x) = pick(&self.columns, self.total, f64::from(u2.x));
        let weights = product(self.tree, self.cosines, column);
        let (row, y) = pick(&weights, self.columns[column], f64::from(u2.y));
        let (p, density) = self.tree.sample_in_cell(EDGE * row + column, [x, y]);
        (cylinder::to_direction(p), weights[row] * self.scale * density)
    }

    fn pdf(&self, d: Vec3) -> f32 {
        let (cell, density) = self.tree.pdf_in_cell(cylinder::of_direction(d));
        self.tree.part(cell) * f32::from(self.cosines[cell]) * self.scale * density
    }

    fn light(&self, d: Vec3) -> f32 {
        let (cell, density) = self.tree.pdf_in_cell(cylinder::of_direction(d));
        self.tree.part(cell) * self.scale * density * self.reach
    }
}

/// An index by weight, and what is left of the number. Never one without weight, if there is any.
#[inline]
fn pick(weights: &[f32; EDGE], total: f32, u: f64) -> (usize, f64) {
    let mut rest = u * f64::from(total);
    let mut last = 0;
    for (i, weight) in weights.iter().enumerate() {
        let weight = f64::from(*weight);
        if weight > 0.0 {
            if rest < weight {
                return (i, rest / weight);
            }
            last = i;
        }
        rest -= weight;
    }
    (last, 1.0 - f64::EPSILON)
}

/// Normals are taken together in so many groups along each edge of the octahedron's square. An odd number: all axes but the
/// lower one, along which most floors and walls face, are in the middle of theirs.
const GROUPS: usize = 17;

/// What [`cosines`] calls 1.
const UPRIGHT: u8 = u8::MAX;

/// Mean cosine of each cell of the grid with a normal, for directions above the surface. It is averaged over the group of
/// the normal too, so that no cell that could be seen has none.
fn cosines(n: Vec3) -> &'static [u8; CELLS] {
    static TABLE: LazyLock<Vec<[u8; CELLS]>> = LazyLock::new(|| {
        /// Points along an edge of a cell.
        const POINTS: usize = 4;
        let points = |cells: usize, direction: fn(Vec2) -> Vec3| {
            let step = 1.0 / (cells * POINTS) as f32;
            move |cell: usize| {
                let (i, j) = (cell % cells, cell / cells);
                (0..POINTS * POINTS).map(move |k| {
                    let (x, y) = (i * POINTS + k % POINTS, j * POINTS + k / POINTS);
                    direction(Vec2::new((x as f32 + 0.5) * step, (y as f32 + 0.5) * step))
                })
            }
        };
        let (normals, directions) = (points(GROUPS, of_octahedron), points(EDGE, cylinder::to_direction));
        let cells: Vec<Vec<Vec3>> = (0..CELLS).map(|cell| directions(cell).collect()).collect();
        let group = |group: usize| {
            let normals: Vec<Vec3> = normals(group).collect();
            let mut row = [0; CELLS];
            for (mean, directions) in row.iter_mut().zip(&cells) {
                let pairs = normals.iter().flat_map(|n| directions.iter().map(move |d| n.dot(*d).max(0.0)));
                let cosine = pairs.sum::<f32>() / (normals.len() * directions.len()) as f32;
                *mean = (cosine * f32::from(UPRIGHT)).ceil() as u8;
            }
            row
        };
        (0..GROUPS * GROUPS).map(group).collect()
    });
    let p = to_octahedron(n) * GROUPS as f32;
    &TABLE[(p.y as usize).min(GROUPS - 1) * GROUPS + (p.x as usize).min(GROUPS - 1)]
}

/// A unit vector's place in a square: the faces of an octahedron, with the lower four unfolded around the upper ones
/// (Meyer, Süßmuth, Sußner, Stamminger, Greiner 2010, "On floating-point normal vectors").
#[inline]
fn to_octahedron(n: Vec3) -> Vec2 {
    let a = n.abs();
    let p = n.truncate() / (a.x + a.y + a.z);
    let p = if n.z < 0.0 { folded(p) } else { p };
    0.5 * p + 0.5
}

/// A place of the lower faces, if it is one of the upper ones; and back.
#[inline]
fn folded(p: Vec2) -> Vec2 {
    (Vec2::ONE - Vec2::new(p.y, p.x).abs()).copysign(p)
}

/// The unit vector of a place.
fn of_octahedron(p: Vec2) -> Vec3 {
    let p = 2.0 * p - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { folded(p) } else { p };
    p.extend(z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octahedron_is_gone_round_and_back() {
        for i in 0..32 {
            for j in 0..32 {
                let p = (Vec2::new(i as f32, j as f32) + 0.5) / 32.0;
                let n = of_octahedron(p);
                assert!((n.length() - 1.0).abs() < 1e-6 && (to_octahedron(n) - p).abs().max_element() < 1e-5, "{p}");
            }
        }
        assert_eq!(to_octahedron(Vec3::Z), Vec2::splat(0.5));
    }

    /// A cell around a normal counts nearly fully, and one below the surface nothing.
    #[test]
    fn cosines_are_those_with_the_normal() {
        for d in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.36, 0.48, -0.8)] {
            let cell_of = |d: Vec3| super::super::quadtree::cell(&mut cylinder::of_direction(d));
            let row = cosines(d);
            let cosine = f32::from(row[cell_of(d)]) / f32::from(UPRIGHT);
            assert!(cosine > 0.8 && row[cell_of(-d)] == 0, "{d}: {cosine}");
        }
        // Nothing distinguishes azimuths around an axis; downwards, where four groups meet, one is a little tilted.
        for (column, n, most) in [(7, Vec3::Z, 1), (0, Vec3::NEG_Z, UPRIGHT / 10)] {
            let cells: Vec<u8> = (0..EDGE).map(|row| cosines(n)[EDGE * row + column]).collect();
            assert!(cells.iter().all(|cosine| cosine.abs_diff(cells[0]) <= most), "{n}: {cells:?}");
        }
    }
}
