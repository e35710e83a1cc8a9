//! The way of one ray through the tree. The only `unsafe` code of the renderer: vector instructions chosen at run time,
//! and a stack that is not cleared for every ray.
//!
//! Two kernels answer two questions, which boxes of a node a ray enters and which triangles of a pack it may hit. Both
//! err on the side of yes by different amounts, so they may visit different nodes; which triangle is hit, and where, is
//! decided in [`Shear::intersect`] for both. So their hits are the same, bit for bit.
//!
//! # Why no box is missed
//!
//! With u = 2⁻²⁴, planes p and origin o relative to the middle of the scene, and S = max |p| + |o|: moving o there is
//! wrong by u S; the plane's distance (p − o) / d, computed as p · (1/d) − o · (1/d), is off by what moving p by 4 u S
//! would do; and the triangle test accepts points up to 6 u S beside a triangle, since it rounds the sheared vertices.
//! The rounding of t adds u S. Each plane is therefore moved outwards by 12 u S, in the constant o · (1/d), at no cost.
//! A direction component below 10⁻¹⁸ of the largest counts as that; over the length of the scene this shifts the ray by
//! much less than u S.

//!
//! # Why no triangle is missed
//!
//! Heights count along the axis of the shear. With R the largest sheared coordinate of a triangle and M the largest of
//! its heights plus R, which bounds its coordinates relative to the ray's origin as the slopes are at most 1, sheared
//! coordinates are within 6 u M of exact, edge functions within 36 u M R, their sum (`area`) within 150 u M R, and
//! their sum times heights (`moment`) within 170 u M² R; moment over area is the height of the hit. [`ROUNDING`] allows
//! for 256 u: what is left over is more than the rounding of the limits and of `t`, as area ≤ 6 R² and R ≤ 2 M.
//! [`TINY`] covers numbers so small that they are not rounded relatively. Lanes that may still be hit go to
//! [`Shear::intersect`]; only whether there is *any* hit can be told without it, from the same bounds.

use super::Primitive;
use super::ray::Ray;
use super::triangle::{Shear, TriangleHit};
use super::wide::{Frame, Node, Pack, WIDTH, Word};
use crate::math::Aabb;
use glam::Vec3A;
use std::hint::black_box;
use std::mem::MaybeUninit;
use std::sync::Arc;

/// Everything a ray needs.
pub struct Tree {
    /// Inner nodes; parents come before their children.
    pub nodes: Vec<Node>,
    /// Leaves of triangles.
    pub packs: Vec<Pack>,
    /// All other leaves, each with its number in the order of (shape, prim).
    pub primitives: Vec<(u32, Arc<dyn Primitive>)>,
    /// Where to begin; `None` when there is nothing.
    pub root: Option<Word>,
    /// The frame of the nodes' boxes.
    pub frame: Frame,
    /// All geometry, in world units.
    pub bounds: Aabb,
}

/// What the closest hit was found on, by number.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub id: u32,
    /// For analytic primitives: shape within an instance, and part.
    pub part: Option<(Option<u32>, u32)>,
}

/// Which vector instructions to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Path(Instructions);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Instructions {
    /// Only ever made by [`Path::fastest`], after it has asked the processor.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    Portable,
}

impl Path {
    /// Runs on every processor.
    pub const PORTABLE: Self = Self(Instructions::Portable);

    /// The best this processor offers.
    #[must_use]
    pub fn fastest() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx2::is_available() {
            return Self(Instructions::Avx2);
        }
        Self::PORTABLE
    }
}

/// The closest hit of a ray that [`Ray::is_traceable`], with a direction neither tiny nor huge.
pub fn closest(tree: &Tree, path: Path, ray: &Ray) -> Option<Found> {
    match path.0 {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `Path::fastest` is the only place that makes `Avx2`, after it has found the instructions.
        Instructions::Avx2 => unsafe { avx2::closest(tree, ray) },
        Instructions::Portable => walk::<Portable, false>(tree, ray),
    }
}

/// Whether such a ray hits anything.
pub fn any(tree: &Tree, path: Path, ray: &Ray) -> bool {
    match path.0 {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as in `closest`.
        Instructions::Avx2 => unsafe { avx2::any(tree, ray) }.is_some(),
        Instructions::Portable => walk::<Portable, true>(tree, ray).is_some(),
    }
}

/// The constants of one ray.
struct Beam {
    shear: Shear,
    inv_d: [f32; 3],
    /// Subtracted from the near planes' p · (1/d).
    near_offset: [f32; 3],
    /// Subtracted from the far planes' p · (1/d).
    far_offset: [f32; 3],
    /// Rows of [`Node::rows`] with the near planes.
    near_rows: [usize; 3],
    /// Rows of [`Node::rows`] with the far planes.
    far_rows: [usize; 3],
    t_min: f32,
    /// Length of the direction along its longest axis: turns distances into heights.
    height: f32,
    /// Sign of the direction along that axis: turns coordinates along it into heights.
    ahead: f32,
    /// Height of the origin.
    origin_height: f32,
    /// Shear constants for heights.
    slope: [f32; 2],
    /// [`Ray::ends`].
    ends: [u32; 2],
}

impl Beam {
    #[inline(always)]
    fn new(frame: &Frame, ray: &Ray) -> Self {
        let [o, d] = [ray.o - frame.center, ray.d].map(Vec3A::from);
        let longest = d.abs().max_element();
        let margin = 12.0 * 0.5 * f32::EPSILON * (frame.reach + o.abs().max_element());
        let tiny = Vec3A::splat(longest * 1e-18);
        let inv = Vec3A::select(d.abs().cmplt(tiny), tiny.copysign(d), d).recip();
        // Kept finite, also in scenes of 10³⁸, since ∞ − ∞ would let rays into slots that are empty. In this order, the
        // limits win over NaN.
        let finite = |v: Vec3A| v.min(Vec3A::MAX).max(Vec3A::MIN);
        let shear = Shear::new(ray.o, ray.d);
        let ahead = 1_f32.copysign(shear.d[2]);
        let sides = [inv.x < 0.0, inv.y < 0.0, inv.z < 0.0].map(|negative| 3 * usize::from(negative));
        Self {
            inv_d: inv.to_array(),
            near_offset: finite(o * inv + margin * inv.abs()).to_array(),
            far_offset: finite(o * inv - margin * inv.abs()).to_array(),
            near_rows: [sides[0], 1 + sides[1], 2 + sides[2]],
            far_rows: [3 - sides[0], 4 - sides[1], 5 - sides[2]],
            t_min: ray.t_min.max(0.0),
            height: longest,
            ahead,
            origin_height: shear.o[2] * ahead,
            slope: shear.s.map(|s| s * ahead),
            shear,
            ends: ray.ends,
        }
    }
}

/// Bound on the error of `area`, over the largest coordinate and the largest sheared one.
const ROUNDING: f32 = 128.0 * f32::EPSILON;
/// See the module's description.
const TINY: f32 = 1e-30;

/// Lanes of a pack, one bit each.
#[derive(Clone, Copy)]
struct Candidates {
    /// All that may be hit within the limits.
    maybe: u32,
    /// Those of them that are hit within the limits for certain.
    sure: u32,
}

/// The two questions that take vector instructions.
trait Kernel {
    /// One bit for each box that holds points of the ray between `t_min` and `t_max`; `near` gets the entry distances.
    ///
    /// # Safety
    /// The processor has the instructions of the kernel.
    unsafe fn boxes<const ANY: bool>(beam: &Beam, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32;

    /// One bit for each triangle that the ray may hit nearer than `t_max`; `near` gets lower bounds of their heights.
    ///
    /// # Safety
    /// The processor has the instructions of the kernel.
    unsafe fn candidates<const ANY: bool>(beam: &Beam, pack: &Pack, t_max: f32, near: &mut [f32; WIDTH]) -> Candidates;

    /// Asks for the cache lines of an item, which need not exist.
    #[inline(always)]
    fn prefetch<T>(_: &[T], _index: usize) {}
}

struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    unsafe fn boxes<const ANY: bool>(beam: &Beam, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
        let mut far = [t_max; WIDTH];
        *near = [beam.t_min; WIDTH];
        for axis in 0..3 {
            let [near_row, far_row] = [&node.rows[beam.near_rows[axis]], &node.rows[beam.far_rows[axis]]];
            let [inv, near_offset, far_offset] = [beam.inv_d[axis], beam.near_offset[axis], beam.far_offset[axis]];
            for i in 0..WIDTH {
                let [enter, leave] = [near_row[i] * inv - near_offset, far_row[i] * inv - far_offset];
                near[i] = if enter > near[i] { enter } else { near[i] };
                far[i] = if leave < far[i] { leave } else { far[i] };
            }
        }
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(near[i] <= far[i]) << i)
    }

    #[inline(always)]
    unsafe fn candidates<const ANY: bool>(beam: &Beam, pack: &Pack, t_max: f32, near: &mut [f32; WIDTH]) -> Candidates {
        let Shear { o, axes, .. } = beam.shear;
        let [low, high] = [beam.t_min, t_max].map(|t| t * beam.height);
        let mut found = Candidates { maybe: 0, sure: 0 };
        for i in 0..WIDTH {
            let (mut reach, mut extent, mut top) = (0.0_f32, 0.0_f32, 0.0_f32);
            let [a, b, c] = pack.vertices.each_ref().map(|rows| {
                let [x, y] = [0, 1].map(|k| rows[axes[k]][i] - o[k]);
                let z = rows[axes[2]][i] * beam.ahead - beam.origin_height;
                let p = [x - beam.slope[0] * z, y - beam.slope[1] * z, z];
                reach = reach.max(z.abs());
                extent = extent.max(p[0].abs()).max(p[1].abs());
                top = top.max(z);
                p
            });
            reach += extent;
            let edges = [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]];
            let negative = (edges[0] < 0.0) | (edges[1] < 0.0) | (edges[2] < 0.0);
            let positive = (edges[0] > 0.0) | (edges[1] > 0.0) | (edges[2] > 0.0);
            let side = if negative { -1.0 } else { 1.0 };
            let area = (edges[0] + edges[1] + edges[2]) * side;
            let moment = (edges[0] * a[2] + edges[1] * b[2] + edges[2] * c[2]) * side;
            let area_error = reach * extent * ROUNDING + TINY;
            let moment_error = area_error * reach + TINY;
            near[i] = (moment - moment_error) / (area + area_error);
            let beside = (negative & positive) | beam.ends.contains(&pack.ids[i]);
            let outside = (top <= 0.0) | (moment < -moment_error) | (near[i] > high);
            let certain =
                !edges.contains(&0.0) & (near[i] > low) & (moment + moment_error < high * (area - area_error));
            found.maybe |= u32::from(!beside & !outside) << i;
            found.sure |= u32::from(!beside & !outside & certain) << i;
        }
        found
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Beam, Candidates, Found, Kernel, Node, Pack, ROUNDING, Ray, Shear, TINY, Tree, WIDTH, walk};
    use std::arch::x86_64::*;

    pub fn is_available() -> bool {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt")
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    pub fn closest(tree: &Tree, ray: &Ray) -> Option<Found> {
        walk::<Avx2, false>(tree, ray)
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    pub fn any(tree: &Tree, ray: &Ray) -> Option<Found> {
        walk::<Avx2, true>(tree, ray)
    }

    /// Only used in the two functions above.
    struct Avx2;

    impl Kernel for Avx2 {
        #[inline(always)]
        unsafe fn boxes<const ANY: bool>(beam: &Beam, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
            // SAFETY: the caller vouches for the instructions.
            unsafe { boxes::<ANY>(beam, node, t_max, near) }
        }

        #[inline(always)]
        unsafe fn candidates<const ANY: bool>(
            beam: &Beam,
            pack: &Pack,
            t_max: f32,
            near: &mut [f32; WIDTH],
        ) -> Candidates {
            // SAFETY: the caller vouches for the instructions.
            unsafe { candidates::<ANY>(beam, pack, t_max, near) }
        }

        #[inline(always)]
        fn prefetch<T>(items: &[T], index: usize) {
            let item = items.as_ptr().wrapping_add(index).cast::<i8>();
            for line in (0..size_of::<T>()).step_by(64) {
                // SAFETY: prefetching reads nothing and cannot fault, whatever the address.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(item.wrapping_add(line)) };
            }
        }
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn load(row: &[f32; WIDTH]) -> __m256 {
        // SAFETY: a row is eight floats; no alignment is asked for.
        unsafe { _mm256_loadu_ps(row.as_ptr()) }
    }

    /// `row * inv - offset`.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn distances(row: &[f32; WIDTH], inv: f32, offset: f32) -> __m256 {
        _mm256_fmsub_ps(load(row), _mm256_set1_ps(inv), _mm256_set1_ps(offset))
    }

    /// One for each query, although they are the same: each then has a single caller, into which it is inlined.
    #[inline]
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn boxes<const ANY: bool>(beam: &Beam, node: &Node, t_max: f32, near: &mut [f32; WIDTH]) -> u32 {
        // SAFETY: rows are numbered 0 to 5 in `Beam::new`, the only place that makes beams.
        let row = |index: usize| unsafe { node.rows.get_unchecked(index) };
        let enter = |axis: usize| distances(row(beam.near_rows[axis]), beam.inv_d[axis], beam.near_offset[axis]);
        let leave = |axis: usize| distances(row(beam.far_rows[axis]), beam.inv_d[axis], beam.far_offset[axis]);
        // A NaN in the first operand yields the second: the box counts as entered.
        let entry = _mm256_max_ps(enter(1), _mm256_max_ps(enter(0), _mm256_set1_ps(beam.t_min)));
        let exit = _mm256_min_ps(leave(1), _mm256_min_ps(leave(0), _mm256_set1_ps(t_max)));
        let [entry, exit] = [_mm256_max_ps(enter(2), entry), _mm256_min_ps(leave(2), exit)];
        // SAFETY: `near` is eight floats; no alignment is asked for.
        unsafe { _mm256_storeu_ps(near.as_mut_ptr(), entry) };
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32
    }

    /// A vertex of each triangle, relative to the ray's origin and sheared, with its height.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn sheared(rows: &[[f32; WIDTH]; 3], beam: &Beam) -> [__m256; 3] {
        let Shear { axes, o, .. } = &beam.shear;
        // SAFETY: axes are numbered 0 to 2 in `Shear::new`, the only place that makes them.
        let row = |i: usize| load(unsafe { rows.get_unchecked(axes[i]) });
        // Fused or not is all the same here, as the sign changes nothing.
        let z = _mm256_fmsub_ps(row(2), _mm256_set1_ps(beam.ahead), _mm256_set1_ps(beam.origin_height));
        let moved = |i: usize| {
            let slope = _mm256_mul_ps(_mm256_set1_ps(beam.slope[i]), z);
            _mm256_sub_ps(_mm256_sub_ps(row(i), _mm256_set1_ps(o[i])), slope)
        };
        [moved(0), moved(1), z]
    }

    /// Lanes of a pack that hold one of two triangles.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn listed(ids: &[u32; WIDTH], [one, other]: [u32; 2]) -> __m256 {
        // SAFETY: eight integers; no alignment is asked for.
        let ids = unsafe { _mm256_loadu_si256(ids.as_ptr().cast()) };
        let equal = |id: u32| _mm256_cmpeq_epi32(ids, _mm256_set1_epi32(id as i32));
        _mm256_castsi256_ps(_mm256_or_si256(equal(one), equal(other)))
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn abs(a: __m256) -> __m256 {
        _mm256_andnot_ps(_mm256_set1_ps(-0.0), a)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
    fn candidates<const ANY: bool>(beam: &Beam, pack: &Pack, t_max: f32, near: &mut [f32; WIDTH]) -> Candidates {
        let [a, b, c] = [0, 1, 2].map(|vertex| sheared(&pack.vertices[vertex], beam));
        let cross =
            |p: [__m256; 3], q: [__m256; 3]| _mm256_sub_ps(_mm256_mul_ps(p[0], q[1]), _mm256_mul_ps(p[1], q[0]));
        let [u, v, w] = [cross(c, b), cross(a, c), cross(b, a)];
        let zero = _mm256_setzero_ps();
        let max = |a: __m256, b: __m256, c: __m256| _mm256_max_ps(_mm256_max_ps(a, b), c);
        let min = |a: __m256, b: __m256, c: __m256| _mm256_min_ps(_mm256_min_ps(a, b), c);
        let any_negative = _mm256_cmp_ps::<_CMP_LT_OQ>(min(u, v, w), zero);
        let any_positive = _mm256_cmp_ps::<_CMP_GT_OQ>(max(u, v, w), zero);
        let beside = _mm256_and_ps(any_negative, any_positive);
        let inside = _mm256_andnot_ps(beside, _mm256_cmp_ps::<_CMP_GT_OQ>(max(a[2], b[2], c[2]), zero));
        let inside = _mm256_andnot_ps(listed(&pack.ids, beam.ends), inside);
        if _mm256_testz_ps(inside, inside) != 0 {
            return Candidates { maybe: 0, sure: 0 };
        }

        let sign = _mm256_and_ps(any_negative, _mm256_set1_ps(-0.0));
        let area = _mm256_xor_ps(_mm256_add_ps(_mm256_add_ps(u, v), w), sign);
        let moment = _mm256_fmadd_ps(u, a[2], _mm256_fmadd_ps(v, b[2], _mm256_mul_ps(w, c[2])));
        let moment = _mm256_xor_ps(moment, sign);
        let extent = |i: usize| max(abs(a[i]), abs(b[i]), abs(c[i]));
        let heights = extent(2);
        let extent = _mm256_max_ps(extent(0), extent(1));
        let reach = _mm256_add_ps(heights, extent);
        let tiny = _mm256_set1_ps(TINY);
        let area_error = _mm256_fmadd_ps(_mm256_mul_ps(reach, _mm256_set1_ps(ROUNDING)), extent, tiny);
        let moment_error = _mm256_fmadd_ps(area_error, reach, tiny);

        let [low, high] = [beam.t_min, t_max].map(|t| _mm256_set1_ps(t * beam.height));
        let least = _mm256_sub_ps(moment, moment_error);
        let most = _mm256_add_ps(moment, moment_error);
        let nearest = _mm256_div_ps(least, _mm256_add_ps(area, area_error));
        // SAFETY: `near` is eight floats; no alignment is asked for.
        unsafe { _mm256_storeu_ps(near.as_mut_ptr(), nearest) };
        let behind = _mm256_cmp_ps::<_CMP_LT_OQ>(most, zero);
        let beyond = _mm256_cmp_ps::<_CMP_GT_OQ>(nearest, high);
        let maybe = _mm256_andnot_ps(_mm256_or_ps(behind, beyond), inside);
        if !ANY {
            return Candidates { maybe: _mm256_movemask_ps(maybe) as u32, sure: 0 };
        }
        let ends = _mm256_cmp_ps::<_CMP_LT_OQ>(most, _mm256_mul_ps(high, _mm256_sub_ps(area, area_error)));
        let begins = _mm256_cmp_ps::<_CMP_GT_OQ>(nearest, low);
        let smallest = min(abs(u), abs(v), abs(w));
        let off_edges = _mm256_cmp_ps::<_CMP_GT_OQ>(smallest, zero);
        let sure = _mm256_and_ps(_mm256_and_ps(maybe, ends), _mm256_and_ps(begins, off_edges));
        Candidates { maybe: _mm256_movemask_ps(maybe) as u32, sure: _mm256_movemask_ps(sure) as u32 }
    }
}

/// Nodes that wait: entry distance in the upper half, word in the lower, so that comparing integers compares distances.
///
/// Each of at most [`MAX_DEPTH`](super::builders::MAX_DEPTH) levels leaves at most seven behind; the deepest adds
/// eight.
struct Stack {
    entries: [MaybeUninit<u64>; Self::SIZE],
    len: usize,
}

impl Stack {
    const SIZE: usize = (WIDTH - 1) * super::builders::MAX_DEPTH + WIDTH;

    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; Self::SIZE], len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: u64) {
        self.entries[self.len].write(entry);
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.len = self.len.checked_sub(1)?;
        Some(self.get(self.len))
    }

    /// Puts an entry among those from `base` on, of which the last is the nearest.
    #[inline(always)]
    fn insert(&mut self, base: usize, entry: u64) {
        let mut at = self.len;
        self.push(entry);
        while at > base && self.get(at - 1) < entry {
            let farther = self.get(at - 1);
            self.entries[at].write(farther);
            at -= 1;
        }
        self.entries[at].write(entry);
    }

    #[inline(always)]
    fn get(&self, at: usize) -> u64 {
        // SAFETY: `push` has written every entry below the largest `len` so far, and no entry is read beyond that.
        unsafe { self.entries[at].assume_init() }
    }
}

/// The closest hit, or any hit. Inlined into one function for each kernel, since its instructions must match.
#[inline(always)]
fn walk<K: Kernel, const ANY: bool>(tree: &Tree, ray: &Ray) -> Option<Found> {
    let beam = Beam::new(&tree.frame, ray);
    let mut best = Best { t: ray.t_max, found: None };
    let mut stack = Stack::new();
    let mut near = [0.0; WIDTH];
    let mut word = tree.root?;
    loop {
        if word.is_node() {
            let node = &tree.nodes[word.index()];
            // SAFETY: `walk` runs with a kernel only inside of a function compiled for its instructions.
            let mut mask = unsafe { K::boxes::<ANY>(&beam, node, best.t, &mut near) };
            if mask.is_power_of_two() {
                word = node.children[mask.trailing_zeros() as usize];
                continue;
            }
            if mask != 0 {
                let mut nearest = take::<K>(tree, node, &near, &mut mask);
                let base = stack.len;
                while mask != 0 {
                    let other = take::<K>(tree, node, &near, &mut mask);
                    if ANY {
                        stack.push(nearest);
                        nearest = other;
                    } else {
                        stack.insert(base, nearest.max(other));
                        nearest = nearest.min(other);
                    }
                }
                word = Word(nearest as u32);
                continue;
            }
        } else if word.is_primitive() {
            let (id, primitive) = &tree.primitives[word.index()];
            if ANY {
                let ray = Ray { t_min: beam.t_min, ..*ray };
                if primitive.occluded(&ray) {
                    return Some(Found { t: 0.0, u: 0.0, v: 0.0, id: *id, part: None });
                }
            } else {
                // The next number lets an equal distance through, so that its shape index can decide.
                let ray = Ray { t_min: beam.t_min, t_max: best.t.next_up(), ..*ray };
                if let Some(hit) = primitive.intersect(&ray) {
                    let part = Some((hit.shape, hit.prim));
                    best.offer(beam.t_min, Found { t: hit.t, u: hit.u, v: hit.v, id: *id, part });
                }
            }
        } else {
            let pack = &tree.packs[word.index()];
            // SAFETY: as above.
            let Candidates { maybe: mut mask, sure } = unsafe { K::candidates::<ANY>(&beam, pack, best.t, &mut near) };
            if ANY && sure != 0 {
                let id = pack.ids[sure.trailing_zeros() as usize & (WIDTH - 1)];
                return Some(Found { t: 0.0, u: 0.0, v: 0.0, id, part: None });
            }
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
                mask &= mask - 1;
                if near[lane] > best.t * beam.height {
                    continue;
                }
                // Hidden from the compiler, which else prepares this test for each ray before the first node.
                let shear = black_box(&beam.shear);
                let points = pack.vertices.each_ref().map(|rows| shear.axes.map(|axis| rows[axis][lane]));
                if let Some(TriangleHit { t, u, v }) = shear.intersect(points) {
                    best.offer(beam.t_min, Found { t, u, v, id: pack.ids[lane], part: None });
                    if ANY && best.found.is_some() {
                        return best.found;
                    }
                }
            }
        }
        loop {
            let Some(entry) = stack.pop() else { return best.found };
            if ANY || f32::from_bits((entry >> 32) as u32) <= best.t {
                word = Word(entry as u32);
                break;
            }
        }
    }
}

/// The next child of a node in `mask`, which must not be 0, as an entry of the stack. Asks for its memory.
#[inline(always)]
fn take<K: Kernel>(tree: &Tree, node: &Node, near: &[f32; WIDTH], mask: &mut u32) -> u64 {
    let slot = mask.trailing_zeros() as usize & (WIDTH - 1);
    *mask &= *mask - 1;
    let child = node.children[slot];
    if child.is_node() {
        K::prefetch(&tree.nodes, child.index());
    } else {
        K::prefetch(&tree.packs, child.index());
    }
    u64::from(near[slot].to_bits()) << 32 | u64::from(child.0)
}

struct Best {
    t: f32,
    found: Option<Found>,
}

impl Best {
    /// Takes what is nearer, or as near with a smaller number.
    #[inline(always)]
    fn offer(&mut self, t_min: f32, hit: Found) {
        let first = hit.t == self.t && self.found.is_some_and(|best| hit.id < best.id);
        if hit.t > t_min && (hit.t < self.t || first) {
            self.t = hit.t;
            self.found = Some(hit);
        }
    }
}
