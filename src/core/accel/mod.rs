//! What does a ray hit first, and does it hit anything?
//!
//! [`Accel::build`] arranges meshes, analytic shapes and instances in a tree with eight children a node;
//! [`Accel::intersect`] and [`Accel::occluded`] walk it. A binary tree comes from one of the [`builders`], `collapse`
//! turns it into the `wide` one, `traverse` is the walk, and `triangle` decides what is hit.
//!
//! # What is promised
//!
//! * A closed mesh has no holes, at any place and at sizes from 10⁻⁸ to 10⁸ (coordinates up to 10¹⁸ are exact enough for
//!   the tests; beyond, hits may be lost, but nothing panics).
//! * The hit is the one with the least `t`, and among those of equal `t` the least (shape, prim). It does not depend on
//!   the builder, the number of threads or the processor.
//! * Triangles without area or with non-finite vertices are left out and counted in [`Stats::degenerate`].

pub mod builders;
mod collapse;
mod instance;
mod numbering;
mod primitive;
mod ray;
#[allow(unsafe_code)]
mod traverse;
mod triangle;
mod validate;
mod wide;

pub use instance::Instance;
pub use primitive::{PrimHit, Primitive};
pub use ray::{Hit, NO_INSTANCE, NO_TRIANGLE, Ray};

use crate::math::Aabb;
use builders::Builder;
use glam::Vec3;
use numbering::Numbering;
use rayon::prelude::*;
use std::sync::Arc;
use traverse::{Found, Path, Tree};
use wide::{Frame, Pack, Word};

/// The surface of one shape.
#[derive(Clone)]
pub enum Geometry<'a> {
    /// Triangles by index into positions; copied into the tree.
    Mesh {
        /// Vertices, in world units.
        positions: &'a [Vec3],
        /// Corners of each triangle.
        triangles: &'a [[u32; 3]],
    },
    /// A shape that finds its own hits, or an instance.
    Analytic(Arc<dyn Primitive>),
}

/// Which binary tree to start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuilderKind {
    /// [`builders::BinnedSah`].
    #[default]
    BinnedSah,
    /// [`builders::Ploc`].
    Ploc,
}

/// How to build.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuildOptions {
    /// The builder of the binary tree.
    pub builder: BuilderKind,
    /// Do without vector instructions beyond the processor family's baseline. Hits are the same.
    pub portable: bool,
}

/// What was built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Triangles and analytic shapes in the tree.
    pub primitives: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves of up to eight triangles.
    pub packs: usize,
    /// Memory of the tree, without what analytic shapes own.
    pub bytes: usize,
    /// Primitives left out: no area, not finite, or empty bounds.
    pub degenerate: usize,
}

/// A scene or a group of shapes, ready for rays.
pub struct Accel {
    tree: Tree,
    path: Path,
    numbering: Numbering,
    degenerate: usize,
    has_instances: bool,
}

impl Accel {
    /// Builds the tree over `items`, pairs of a shape index and its geometry.
    ///
    /// # Errors
    /// If a triangle refers to a vertex that is not there, if an analytic shape has bounds that are not finite, or if
    /// there are more than 2³⁰ primitives.
    pub fn build(items: &[(u32, Geometry)], options: &BuildOptions) -> Result<Self, String> {
        // On a thread of the pool: each parallel step costs another thread a switch there, and a scene may have a million
        // shapes.
        rayon::scope(|_| Self::build_here(items, options))
    }

    fn build_here(items: &[(u32, Geometry)], options: &BuildOptions) -> Result<Self, String> {
        let mut sorted: Vec<_> = items.iter().collect();
        sorted.sort_by_key(|(shape, _)| *shape);

        let mut found = Vec::with_capacity(items.len());
        let mut first = 0_usize;
        let (mut triangles, mut analytic) = (Vec::new(), Vec::new());
        for (shape, geometry) in &sorted {
            let number = u32::try_from(first).map_err(|_| TOO_MANY)?;
            found.push((*shape, number));
            match geometry {
                Geometry::Mesh { positions, triangles: corners } => {
                    first += corners.len();
                    if first > Word::LIMIT {
                        return Err(TOO_MANY.into());
                    }
                    collect_triangles(*shape, positions, corners, number, &mut triangles)?;
                }
                Geometry::Analytic(primitive) => {
                    first += 1;
                    let bounds = primitive.bounds();
                    if bounds.is_empty() && !bounds.min.is_nan() && !bounds.max.is_nan() {
                        continue;
                    }
                    if !bounds.is_finite() {
                        return Err(format!("shape {shape}: its bounds are not finite"));
                    }
                    analytic.push((number, bounds, Arc::clone(primitive)));
                }
            }
        }
        if first > Word::LIMIT {
            return Err(TOO_MANY.into());
        }

        let degenerate = first - triangles.len() - analytic.len();
        let has_instances = analytic.iter().any(|(_, _, p)| p.is_instance());
        let (mut bounds, numbers): (Vec<_>, Vec<_>) = triangles.into_par_iter().unzip();
        let triangle_count = numbers.len() as u32;
        bounds.extend(analytic.iter().map(|(_, bounds, _)| *bounds));
        let binary = match options.builder {
            BuilderKind::BinnedSah => builders::BinnedSah.build(&bounds),
            BuilderKind::Ploc => builders::Ploc.build(&bounds),
        };
        drop(bounds);

        let total = binary.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds);
        let frame = Frame::new(&total);
        let mut tree = Tree {
            nodes: Vec::new(),
            packs: Vec::new(),
            primitives: analytic.into_iter().map(|(number, _, p)| (number, p)).collect(),
            root: None,
            frame,
            bounds: total,
        };
        // Collected in place of larger entries.
        tree.primitives.shrink_to_fit();
        if !binary.nodes.is_empty() {
            let wide = collapse::collapse(&binary, &frame, &|prim| prim.checked_sub(triangle_count));
            drop(binary);
            tree.nodes = wide.nodes;
            tree.nodes.shrink_to_fit();
            tree.root = Some(wide.root);
            let fill = |members: &[u32; wide::WIDTH]| {
                let mut pack = Pack::EMPTY;
                for (lane, &prim) in members.iter().enumerate().filter(|(_, prim)| **prim != u32::MAX) {
                    let number = numbers[prim as usize];
                    let item = found.partition_point(|(_, first)| *first <= number) - 1;
                    if let Geometry::Mesh { positions, triangles } = &sorted[item].1 {
                        let corners = triangles[(number - found[item].1) as usize];
                        pack.set(lane, corners.map(|i| positions[i as usize]), number);
                    }
                }
                pack
            };
            tree.packs = wide.packs.par_iter().map(fill).collect();
        }
        let path = if options.portable { Path::PORTABLE } else { Path::fastest() };
        Ok(Self { tree, path, numbering: Numbering::new(found, first as u32), degenerate, has_instances })
    }

    /// The nearest hit with `t_min < t < t_max`.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        if is_ordinary(ray) {
            return traverse::closest(&self.tree, self.path, ray).map(|found| self.hit(found));
        }
        let (scaled, scale) = rescaled(ray)?;
        let mut hit = traverse::closest(&self.tree, self.path, &scaled).map(|found| self.hit(found))?;
        hit.t = (f64::from(hit.t) / scale) as f32;
        (ray.t_min.max(0.0) < hit.t && hit.t < ray.t_max).then_some(hit)
    }

    /// Whether anything is hit with `t_min < t < t_max`. Quicker than [`Accel::intersect`].
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        if is_ordinary(ray) {
            return traverse::any(&self.tree, self.path, ray);
        }
        rescaled(ray).is_some_and(|(scaled, _)| traverse::any(&self.tree, self.path, &scaled))
    }

    /// A box around everything, empty when there is nothing.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds
    }

    /// Whether any item is an instance.
    #[must_use]
    pub fn has_instances(&self) -> bool {
        self.has_instances
    }

    /// Sizes.
    #[must_use]
    pub fn stats(&self) -> Stats {
        let tree = &self.tree;
        let triangles = tree.packs.iter().flat_map(|pack| pack.ids).filter(|id| *id != u32::MAX).count();
        Stats {
            primitives: triangles + tree.primitives.len(),
            nodes: tree.nodes.len(),
            packs: tree.packs.len(),
            bytes: size_of_val(tree.nodes.as_slice())
                + size_of_val(tree.packs.as_slice())
                + size_of_val(tree.primitives.as_slice())
                + self.numbering.bytes(),
            degenerate: self.degenerate,
        }
    }

    /// Checks that boxes hold what is below them, that every primitive is in one leaf, and that the tree is not too deep.
    ///
    /// # Errors
    /// Says which node or primitive is wrong.
    pub fn validate(&self) -> Result<(), String> {
        validate::validate(&self.tree)
    }

    fn hit(&self, found: Found) -> Hit {
        let Found { t, u, v, id, part } = found;
        let (shape, prim) = self.numbering.find(id);
        match part {
            None => Hit { t, u, v, shape, prim, instance: NO_INSTANCE, triangle: id },
            Some((None, prim)) => Hit { t, u, v, shape, prim, instance: NO_INSTANCE, triangle: NO_TRIANGLE },
            Some((Some(inner), prim)) => Hit { t, u, v, shape: inner, prim, instance: shape, triangle: NO_TRIANGLE },
        }
    }

    /// The number of a shape's first primitive, to which a triangle's index is added for [`Ray::ends`].
    #[must_use]
    pub fn first_triangle(&self, shape: u32) -> Option<u32> {
        self.numbering.first(shape)
    }
}

/// The exponent of an `f64`; alone, it is the power of two below the number.
const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
/// Smaller meshes are not worth a second thread.
const SERIAL: usize = 4096;
const TOO_MANY: &str = "more than 2^30 primitives in one scene or group";

/// Appends the bounds and numbers of all triangles that can be hit.
fn collect_triangles(
    shape: u32,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    first: u32,
    into: &mut Vec<(Aabb, u32)>,
) -> Result<(), String> {
    if let Some(bad) =
        triangles.par_iter().with_min_len(SERIAL).position_first(|t| t.iter().any(|&i| i as usize >= positions.len()))
    {
        let count = positions.len();
        return Err(format!("shape {shape}: triangle {bad} refers to vertices {:?} of {count}", triangles[bad]));
    }
    let hittable = |(i, corners): (usize, &[u32; 3])| {
        let points = corners.map(|i| positions[i as usize]);
        triangle::is_hittable(points).then(|| (Aabb::of_points(points), first + i as u32))
    };
    if triangles.len() < SERIAL {
        into.extend(triangles.iter().enumerate().filter_map(hittable));
    } else {
        into.par_extend(triangles.par_iter().enumerate().filter_map(hittable));
    }
    Ok(())
}

/// Whether a ray can be traced as it is: it can hit something, and its direction is neither tiny nor huge.
#[inline]
fn is_ordinary(ray: &Ray) -> bool {
    let longest = ray.d.abs().max_element();
    (1e-3..=1e3).contains(&longest) && ray.o.is_finite() && ray.t_min < ray.t_max && ray.t_max > 0.0 && !ray.d.is_nan()
}

/// Of a ray that is not: the same with a direction of about 1, and the power of two that distances were multiplied with.
/// So reciprocals of the direction stay far from the limits of `f32`. `None` if it cannot hit anything.
#[cold]
fn rescaled(ray: &Ray) -> Option<(Ray, f64)> {
    if !ray.is_traceable() {
        return None;
    }
    let longest = ray.d.abs().max_element();
    let scale = f64::from_bits(f64::from(longest).to_bits() & EXPONENT);
    let d = (ray.d.as_dvec3() / scale).as_vec3();
    let [t_min, t_max] = [ray.t_min, ray.t_max].map(|t| (f64::from(t) * scale) as f32);
    Some((Ray { d, t_min, t_max, ..*ray }, scale))
}

#[cfg(test)]
mod tests;
