//! Top-down splits by the surface area heuristic over binned centroids (Wald 2007, *On fast construction of SAH-based
//! bounding volume hierarchies*), all three axes, in parallel.
//!
//! | Parameter | Wald 2007 | here |
//! |---|---|---|
//! | bins | 16 | 32; 16 below 256 primitives, 8 below 16 |
//! | axes | the longest | all three |
//! | end of recursion | when a leaf is cheaper | one primitive; the collapse to the wide tree decides about leaves |
//! | no separating plane | leaf | halves by position |
//!
//! Where the levels that remain would just do for halving, it halves: so the depth has a limit for any input, and
//! coincident primitives cost no more than others.

use super::{BinaryNode, BinaryTree, Builder, MAX_DEPTH, block_len, filled};
use crate::math::Aabb;
use glam::{Vec3, Vec3A};
use rayon::prelude::*;

/// Binned surface area heuristic; the default builder.
#[derive(Clone, Copy, Debug, Default)]
pub struct BinnedSah;

/// Subtrees smaller than this are built by the thread that found them.
const FORK: usize = 4096;
/// Nodes larger than this are binned in pieces of this size by several threads.
const PIECE: usize = 65_536;

#[derive(Clone, Copy)]
struct Reference {
    min: Vec3A,
    max: Vec3A,
    prim: u32,
}

impl Reference {
    /// The middle of the box, finite for every finite box.
    fn centroid(&self) -> Vec3A {
        self.min * 0.5 + self.max * 0.5
    }
}

/// A box in registers.
#[derive(Clone, Copy)]
struct Extent {
    min: Vec3A,
    max: Vec3A,
}

impl Extent {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    fn grow(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    fn half_area(&self) -> f32 {
        let d = (self.max - self.min).max(Vec3A::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

impl Builder for BinnedSah {
    fn build(&self, bounds: &[Aabb]) -> BinaryTree {
        let mut references: Vec<_> = bounds
            .par_iter()
            .enumerate()
            .map(|(i, b)| Reference { min: b.min.into(), max: b.max.into(), prim: i as u32 })
            .collect();
        let mut nodes = filled(BinaryNode::UNSET, (2 * bounds.len()).saturating_sub(1));
        if let Some((root, block)) = nodes.split_first_mut() {
            build_subtree(&mut references, root, block, 1, 0);
        }
        BinaryTree { nodes }
    }
}

/// Builds the tree over `references` into `node` and the `block` below it, which begins at slot `base` of the node array.
fn build_subtree(
    references: &mut [Reference],
    node: &mut BinaryNode,
    block: &mut [BinaryNode],
    base: usize,
    depth: usize,
) {
    let count = references.len();
    let (bounds, centroids) = extents(references);
    node.bounds = Aabb { min: Vec3::from(bounds.min), max: Vec3::from(bounds.max) };
    node.count = count as u32;
    if count == 1 {
        node.index = references[0].prim;
        return;
    }
    node.index = base as u32;

    let must_halve = count.next_power_of_two().ilog2() as usize >= MAX_DEPTH - depth;
    let split = match count {
        _ if must_halve => None,
        0..=2 => None,
        3..16 => best_split::<8>(references, &centroids),
        16..256 => best_split::<16>(references, &centroids),
        _ => best_split::<32>(references, &centroids),
    };
    let middle = match split {
        Some(split) => partition(references, |r| split.is_left(r)),
        None => halve(references, &centroids),
    };

    let (left_refs, right_refs) = references.split_at_mut(middle);
    let (children, rest) = block.split_at_mut(2);
    let (left, right) = children.split_at_mut(1);
    let left_len = block_len(middle);
    let (left_block, right_block) = rest.split_at_mut(left_len);
    let left_base = base + 2;
    let mut build_left = || build_subtree(left_refs, &mut left[0], left_block, left_base, depth + 1);
    let mut build_right = || build_subtree(right_refs, &mut right[0], right_block, left_base + left_len, depth + 1);
    if count < FORK {
        build_left();
        build_right();
    } else {
        rayon::join(build_left, build_right);
    }
}

/// The box of all primitives and the box of their centroids.
fn extents(references: &[Reference]) -> (Extent, Extent) {
    let of = |piece: &[Reference]| {
        piece.iter().fold((Extent::EMPTY, Extent::EMPTY), |(mut bounds, mut centroids), r| {
            let c = r.centroid();
            bounds.grow(&Extent { min: r.min, max: r.max });
            centroids.grow(&Extent { min: c, max: c });
            (bounds, centroids)
        })
    };
    if references.len() <= PIECE {
        return of(references);
    }
    let pieces: Vec<_> = references.par_chunks(PIECE).map(of).collect();
    pieces.into_iter().fold((Extent::EMPTY, Extent::EMPTY), |(mut bounds, mut centroids), (b, c)| {
        bounds.grow(&b);
        centroids.grow(&c);
        (bounds, centroids)
    })
}

/// Maps centroids to bins.
#[derive(Clone, Copy)]
struct Binning {
    min: Vec3A,
    scale: Vec3A,
    last: f32,
}

impl Binning {
    fn new(centroids: &Extent, bins: usize) -> Self {
        // An axis without extent (or one whose extent overflows) gets scale 0: everything falls into bin 0.
        let extent = centroids.max - centroids.min;
        let scale = Vec3A::splat(bins as f32) / extent;
        let usable = scale.is_finite_mask() & extent.is_finite_mask();
        Self { min: centroids.min, scale: Vec3A::select(usable, scale, Vec3A::ZERO), last: (bins - 1) as f32 }
    }

    fn bins(&self, r: &Reference) -> [usize; 3] {
        let b = ((r.centroid() - self.min) * self.scale).min(Vec3A::splat(self.last)).to_array();
        b.map(|x| x as usize)
    }
}

/// Everything left of a bin border on one axis.
struct Split {
    binning: Binning,
    axis: usize,
    border: usize,
}

impl Split {
    fn is_left(&self, r: &Reference) -> bool {
        self.binning.bins(r)[self.axis] < self.border
    }
}

#[derive(Clone)]
struct Bins<const N: usize>([[(Extent, u32); N]; 3]);

impl<const N: usize> Bins<N> {
    const EMPTY: Self = Self([[(Extent::EMPTY, 0); N]; 3]);

    fn fill(mut self, binning: &Binning, references: &[Reference]) -> Self {
        for r in references {
            let bounds = Extent { min: r.min, max: r.max };
            for (axis, bin) in binning.bins(r).into_iter().enumerate() {
                let (extent, count) = &mut self.0[axis][bin];
                extent.grow(&bounds);
                *count += 1;
            }
        }
        self
    }

    fn merge(&mut self, other: &Self) {
        for (bins, more) in self.0.iter_mut().zip(&other.0) {
            for ((extent, count), (other_extent, other_count)) in bins.iter_mut().zip(more) {
                extent.grow(other_extent);
                *count += other_count;
            }
        }
    }
}

/// The border with the least Σ area · primitives; `None` when no border has primitives on both sides and a finite cost.
fn best_split<const N: usize>(references: &[Reference], centroids: &Extent) -> Option<Split> {
    let binning = Binning::new(centroids, N);
    let table = if references.len() <= PIECE {
        Bins::<N>::EMPTY.fill(&binning, references)
    } else {
        let pieces: Vec<_> = references.par_chunks(PIECE).map(|piece| Bins::<N>::EMPTY.fill(&binning, piece)).collect();
        let mut total = Bins::EMPTY;
        pieces.iter().for_each(|piece| total.merge(piece));
        total
    };

    let mut best = None;
    let mut best_cost = f32::INFINITY;
    for (axis, row) in table.0.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        let mut right_cost = [0.0; N];
        let (mut extent, mut count) = (Extent::EMPTY, 0);
        for border in (1..N).rev() {
            extent.grow(&row[border].0);
            count += row[border].1;
            right_cost[border] = if count == 0 { f32::INFINITY } else { extent.half_area() * count as f32 };
        }
        (extent, count) = (Extent::EMPTY, 0);
        for border in 1..N {
            extent.grow(&row[border - 1].0);
            count += row[border - 1].1;
            let cost = extent.half_area() * count as f32 + right_cost[border];
            if count > 0 && cost < best_cost {
                best_cost = cost;
                best = Some(Split { binning, axis, border });
            }
        }
    }
    best
}

/// Moves what is `left` to the front and returns how many those are.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let (mut i, mut j) = (0, references.len());
    loop {
        while i < j && left(&references[i]) {
            i += 1;
        }
        while i < j && !left(&references[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        references.swap(i, j - 1);
    }
}

/// Halves by number along the longest axis of the centroids; equal centroids are ordered by primitive.
fn halve(references: &mut [Reference], centroids: &Extent) -> usize {
    let middle = references.len() / 2;
    let extent = centroids.max * 0.5 - centroids.min * 0.5;
    if extent != Vec3A::ZERO {
        let axis = extent.max_position();
        references.select_nth_unstable_by(middle, |a, b| {
            a.centroid()[axis].total_cmp(&b.centroid()[axis]).then(a.prim.cmp(&b.prim))
        });
    }
    middle
}
