//! What has been learnt, to be sampled.

use super::cylinder;
use super::outlook::{SIDES, side};
use super::quadtree::{CELLS, EDGE, Quadtree, UNIFORM};
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
    /// Whether directions are weighted by the cosine at the vertex.
    pub cosine: bool,
    /// Whether something is kept apart,
    pub sets: GuideSets,
    /// and that, as many as there are leaves; empty if not.
    pub apart: Vec<ApartLeaf>,
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
    fn at<'g>(&'g self, hit: &SurfaceHit, vertex: GuidedVertex, arena: &'g Arena) -> Option<&'g dyn GuidedDirections> {
        let index = self.tree.leaf(self.tree.cell(hit.p)).0 as usize;
        let leaf = &self.leaves[index];
        if let Some(apart) = self.apart.get(index) {
            return self.at_apart((leaf, apart), hit, vertex, arena);
        }
        let tree = leaf.directions.as_deref()?;
        Some(arena.alloc(self.here(tree, leaf, hit, vertex.one_sided)?))
    }

    fn sets(&self) -> GuideSets {
        self.sets
    }

    fn incident(&self, p: Vec3, d: Vec3) -> Option<f32> {
        let index = self.tree.leaf(self.tree.cell(p)).0 as usize;
        let leaf = &self.leaves[index];
        // What is kept apart may be a part of the light; what first hits scatter is none.
        let apart = self.apart.get(index).filter(|_| self.sets == GuideSets::DirectIndirect);
        if !is_lit(leaf, apart) {
            return None;
        }
        let radiance = |tree: &Quadtree, fluence: f32| {
            let (cell, density) = tree.pdf_in_cell(cylinder::of_direction(d));
            fluence * UNIFORM * tree.grid[cell] * CELLS as f32 * density
        };
        let of_leaf = leaf.directions.as_deref().map_or(0.0, |tree| radiance(tree, leaf.fluence));
        let of_apart = apart.and_then(|apart| Some(radiance(apart.directions.as_deref()?, apart.fluence)));
        Some(of_leaf + of_apart.unwrap_or(0.0))
    }

    fn outlook(&self, p: Vec3, n: Vec3) -> Option<Outlook> {
        self.leaves[self.tree.leaf(self.tree.cell(p)).0 as usize].outlooks[side(n)]
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
    /// A tree of a leaf at a vertex.
    #[inline]
    pub(super) fn here<'g>(
        &self,
        tree: &'g Quadtree,
        leaf: &Leaf,
        hit: &SurfaceHit,
        one_sided: bool,
    ) -> Option<Here<'g>> {
        let normal = hit.frame.n * 1f32.copysign(hit.wi.z);
        // The integral of the factor over all directions.
        let (cosines, reach) = if self.cosine && one_sided { (cosines(normal), PI) } else { (&[1.0; CELLS], 4.0 * PI) };
        Some(Here { reach, ..Here::new(tree, leaf.p_guide, cosines)? })
    }
}

/// A leaf's directions at a vertex. Weights of cells are products that are made when they are needed: most vertices need
/// few of them, but all need their sums.
pub(super) struct Here<'g> {
    tree: &'g Quadtree,
    /// Factors of the grid's cells.
    cosines: &'g [f32; CELLS],
    p_guide: f32,
    /// Sums of the weights in the rows of the grid.
    rows: [f32; EDGE],
    /// The sum of all.
    pub(super) total: f32,
    /// What makes a density relative to a uniform one, per solid angle, of a weight.
    scale: f32,
    /// What makes a density before it is weighted a multiple of the mean.
    reach: f32,
}

impl<'g> Here<'g> {
    /// A tree that has the cosine in it.
    pub(super) fn of_product(tree: &'g Quadtree, p_guide: f32) -> Option<Self> {
        Here::new(tree, p_guide, &[1.0; CELLS])
    }

    /// `None` if no light comes from where it would be scattered.
    #[inline]
    fn new(tree: &'g Quadtree, p_guide: f32, cosines: &'g [f32; CELLS]) -> Option<Self> {
        let mut rows = [0.0; EDGE];
        for (j, row) in rows.iter_mut().enumerate() {
            *row = sum(&product(tree, cosines, j));
        }
        let total = sum(&rows);
        let scale = UNIFORM * CELLS as f32 / total;
        (total > 0.0 && scale.is_finite()).then_some(Here {
            tree,
            cosines,
            p_guide,
            rows,
            total,
            scale,
            reach: 4.0 * PI,
        })
    }
}

/// The weights of a row of the grid.
#[inline]
fn product(tree: &Quadtree, cosines: &[f32; CELLS], row: usize) -> [f32; EDGE] {
    let (grid, cosines) = (&tree.grid.as_chunks::<EDGE>().0[row], &cosines.as_chunks::<EDGE>().0[row]);
    std::array::from_fn(|i| grid[i] * cosines[i])
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
        let (row, y) = pick(&self.rows, self.total, f64::from(u2.y));
        let weights = product(self.tree, self.cosines, row);
        let (column, x) = pick(&weights, self.rows[row], f64::from(u2.x));
        let (p, density) = self.tree.sample_in_cell(EDGE * row + column, [x, y]);
        (cylinder::to_direction(p), weights[column] * self.scale * density)
    }

    fn pdf(&self, d: Vec3) -> f32 {
        let (cell, density) = self.tree.pdf_in_cell(cylinder::of_direction(d));
        self.tree.grid[cell] * self.cosines[cell] * self.scale * density
    }

    fn light(&self, d: Vec3) -> f32 {
        let (cell, density) = self.tree.pdf_in_cell(cylinder::of_direction(d));
        self.tree.grid[cell] * self.scale * density * self.reach
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

/// Normals are taken together in so many groups along each edge of the cylinder's square.
const GROUPS: usize = 16;

/// Mean cosine of each cell of the grid with a normal, for directions above the surface. It is averaged over the group of
/// the normal too, so that no cell that could be seen has none.
fn cosines(n: Vec3) -> &'static [f32; CELLS] {
    static TABLE: LazyLock<Vec<[f32; CELLS]>> = LazyLock::new(|| {
        /// Points along an edge of a cell.
        const POINTS: usize = 4;
        let points = |cells: usize| {
            let step = 1.0 / (cells * POINTS) as f32;
            move |cell: usize| {
                let (i, j) = (cell % cells, cell / cells);
                (0..POINTS * POINTS).map(move |k| {
                    let (x, y) = (i * POINTS + k % POINTS, j * POINTS + k / POINTS);
                    cylinder::to_direction(Vec2::new((x as f32 + 0.5) * step, (y as f32 + 0.5) * step))
                })
            }
        };
        let (normals, directions) = (points(GROUPS), points(EDGE));
        let cells: Vec<Vec<Vec3>> = (0..CELLS).map(|cell| directions(cell).collect()).collect();
        let group = |group: usize| {
            let normals: Vec<Vec3> = normals(group).collect();
            let mut row = [0.0; CELLS];
            for (mean, directions) in row.iter_mut().zip(&cells) {
                let pairs = normals.iter().flat_map(|n| directions.iter().map(move |d| n.dot(*d).max(0.0)));
                *mean = pairs.sum::<f32>() / (normals.len() * directions.len()) as f32;
            }
            row
        };
        (0..GROUPS * GROUPS).map(group).collect()
    });
    let p = cylinder::of_direction(n) * GROUPS as f32;
    &TABLE[(p.y as usize).min(GROUPS - 1) * GROUPS + (p.x as usize).min(GROUPS - 1)]
}
