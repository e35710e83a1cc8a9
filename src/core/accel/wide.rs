//! The memory that a ray walks through: nodes with eight children, and packs of eight triangles.

use crate::math::Aabb;
use glam::Vec3;

/// Children of a node, and triangles in a pack.
pub const WIDTH: usize = 8;

/// Where a child is: an inner node, a pack of triangles, or a [`Primitive`](super::Primitive).
///
/// The two upper bits say which; the others are the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Word(pub u32);

impl Word {
    const PACK: u32 = 1 << 31;
    const PRIMITIVE: u32 = 3 << 30;
    const KIND: u32 = 3 << 30;
    /// One more than the largest index a word can hold.
    pub const LIMIT: usize = 1 << 30;

    /// The node with this index.
    #[must_use]
    pub const fn node(index: u32) -> Self {
        Self(index)
    }

    /// The pack with this index.
    #[must_use]
    pub const fn pack(index: u32) -> Self {
        Self(Self::PACK | index)
    }

    /// The analytic primitive with this index.
    #[must_use]
    pub const fn primitive(index: u32) -> Self {
        Self(Self::PRIMITIVE | index)
    }

    /// Whether this is an inner node.
    #[must_use]
    pub const fn is_node(self) -> bool {
        self.0 & Self::PACK == 0
    }

    /// Whether this is an analytic primitive.
    #[must_use]
    pub const fn is_primitive(self) -> bool {
        self.0 & Self::KIND == Self::PRIMITIVE
    }

    /// Index into the nodes, packs or primitives.
    #[must_use]
    pub const fn index(self) -> usize {
        (self.0 & !Self::KIND) as usize
    }
}

/// Boxes of up to eight children, as six rows: smallest x, y, z, then largest x, y, z.
///
/// Coordinates are relative to the middle of the scene, see [`Frame`]. An empty slot has min = +∞ and max = −∞.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Rows of planes.
    pub rows: [[f32; WIDTH]; 6],
    /// What each box holds.
    pub children: [Word; WIDTH],
}

impl Node {
    /// A node without children.
    pub const EMPTY: Self = Self {
        rows: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [Word::node(0); WIDTH],
    };

    /// Puts `bounds`, given in the frame, and what it holds into a slot.
    pub fn set(&mut self, slot: usize, bounds: &Aabb, child: Word) {
        for axis in 0..3 {
            self.rows[axis][slot] = bounds.min[axis];
            self.rows[axis + 3][slot] = bounds.max[axis];
        }
        self.children[slot] = child;
    }

    /// The box in a slot.
    #[must_use]
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |row: usize| Vec3::new(self.rows[row][slot], self.rows[row + 1][slot], self.rows[row + 2][slot]);
        Aabb { min: corner(0), max: corner(3) }
    }
}

/// Up to eight triangles. The coordinates of an empty lane are NaN, which fails every test.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Pack {
    /// Coordinates by vertex, axis and lane, in world units.
    pub vertices: [[[f32; WIDTH]; 3]; 3],
    /// The triangles' numbers in the order of (shape, prim), over all items of the scene.
    pub ids: [u32; WIDTH],
}

impl Pack {
    /// A pack without triangles.
    pub const EMPTY: Self = Self { vertices: [[[f32::NAN; WIDTH]; 3]; 3], ids: [u32::MAX; WIDTH] };

    /// Puts a triangle into a lane.
    pub fn set(&mut self, lane: usize, triangle: [Vec3; 3], id: u32) {
        for (rows, p) in self.vertices.iter_mut().zip(triangle) {
            for (row, x) in rows.iter_mut().zip(p.to_array()) {
                row[lane] = x;
            }
        }
        self.ids[lane] = id;
    }

    /// The triangle in a lane.
    #[must_use]
    pub fn triangle(&self, lane: usize) -> [Vec3; 3] {
        std::array::from_fn(|vertex| Vec3::from_array(std::array::from_fn(|axis| self.vertices[vertex][axis][lane])))
    }
}

const _: () = assert!(size_of::<Node>() == 256 && size_of::<Pack>() == 320);

/// Boxes are stored relative to the middle of the scene, so their rounding is relative to the size of the scene and not
/// to its distance from the world's origin.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The middle, in world units.
    pub center: Vec3,
    /// Largest distance of a plane from the middle.
    pub reach: f32,
}

impl Frame {
    /// The frame for a scene with these bounds.
    #[must_use]
    pub fn new(bounds: &Aabb) -> Self {
        if bounds.is_empty() {
            return Self { center: Vec3::ZERO, reach: 0.0 };
        }
        let center = bounds.center();
        let frame = Self { center, reach: 0.0 };
        let inside = frame.enclose(bounds);
        Self { center, reach: inside.min.abs().max(inside.max.abs()).max_element() }
    }

    /// The box in this frame, rounded outwards.
    #[must_use]
    pub fn enclose(&self, bounds: &Aabb) -> Aabb {
        Aabb { min: (bounds.min - self.center).map(f32::next_down), max: (bounds.max - self.center).map(f32::next_up) }
    }
}
