//! A colour in linear sRGB primaries.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Neg, Sub};

/// Linear sRGB: radiance, reflectance or throughput per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Rgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

impl Rgb {
    /// No light.
    pub const BLACK: Rgb = Rgb::splat(0.0);
    /// One in all channels.
    pub const WHITE: Rgb = Rgb::splat(1.0);

    /// From channels.
    #[inline]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Rgb { r, g, b }
    }

    /// The same value in all channels.
    #[inline]
    pub const fn splat(v: f32) -> Self {
        Rgb { r: v, g: v, b: v }
    }

    /// From double precision, as written in a scene.
    pub fn from_f64([r, g, b]: [f64; 3]) -> Self {
        Rgb::new(r as f32, g as f32, b as f32)
    }

    /// As an array.
    #[inline]
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// Luminance with the weights of the reference renderer (CIE Y of linear sRGB).
    #[inline]
    pub fn luminance(self) -> f32 {
        0.212671 * self.r + 0.715160 * self.g + 0.072169 * self.b
    }

    /// CIE 1931 XYZ of linear sRGB.
    pub fn to_xyz(self) -> [f32; 3] {
        let Rgb { r, g, b } = self;
        [0.412453 * r + 0.357580 * g + 0.180423 * b, self.luminance(), 0.019334 * r + 0.119193 * g + 0.950227 * b]
    }

    /// Largest channel.
    #[inline]
    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// Smallest of the three.
    #[inline]
    pub fn min_component(self) -> f32 {
        self.r.min(self.g).min(self.b)
    }

    /// Mean of the channels.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) * (1.0 / 3.0)
    }

    /// Exactly zero in all channels.
    #[inline]
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }

    /// No channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// A function of each channel.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Rgb::new(f(self.r), f(self.g), f(self.b))
    }
}

macro_rules! componentwise {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl $trait for Rgb {
            type Output = Rgb;
            #[inline]
            fn $method(self, o: Rgb) -> Rgb {
                Rgb::new(self.r $op o.r, self.g $op o.g, self.b $op o.b)
            }
        }
    )*};
}
componentwise!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Mul<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn mul(self, s: f32) -> Rgb {
        Rgb::new(self.r * s, self.g * s, self.b * s)
    }
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    #[inline]
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn div(self, s: f32) -> Rgb {
        Rgb::new(self.r / s, self.g / s, self.b / s)
    }
}

impl Neg for Rgb {
    type Output = Rgb;
    #[inline]
    fn neg(self) -> Rgb {
        self.map(|v| -v)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl MulAssign for Rgb {
    #[inline]
    fn mul_assign(&mut self, o: Rgb) {
        *self = *self * o;
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        *self = *self * s;
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Rgb>>(iter: I) -> Rgb {
        iter.fold(Rgb::BLACK, Add::add)
    }
}

impl Index<usize> for Rgb {
    type Output = f32;
    #[inline]
    fn index(&self, channel: usize) -> &f32 {
        match channel {
            0 => &self.r,
            1 => &self.g,
            _ => &self.b,
        }
    }
}
