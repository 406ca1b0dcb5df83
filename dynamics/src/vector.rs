//! Vectors of any [`Real`]: what the kernels are made of.

use crate::plane::{Plane, Turn};
use crate::real::Real;
use glam::{DMat3, DVec3};

/// Three coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vector<R> {
    pub x: R,
    pub y: R,
    pub z: R,
}

impl<R: Real> Vector<R> {
    pub const ZERO: Self = Self { x: R::ZERO, y: R::ZERO, z: R::ZERO };

    #[inline(always)]
    pub fn constant(v: DVec3) -> Self {
        Self { x: R::splat(v.x), y: R::splat(v.y), z: R::splat(v.z) }
    }

    #[inline(always)]
    pub fn plus(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }

    #[inline(always)]
    pub fn scaled(self, k: R) -> Self {
        Self { x: self.x * k, y: self.y * k, z: self.z * k }
    }

    /// self · k + b.
    #[inline(always)]
    pub fn scaled_plus(self, k: R, b: Self) -> Self {
        Self { x: self.x.times_plus(k, b.x), y: self.y.times_plus(k, b.y), z: self.z.times_plus(k, b.z) }
    }

    #[inline(always)]
    pub fn dot(self, b: Self) -> R {
        self.z.times_plus(b.z, self.y.times_plus(b.y, self.x * b.x))
    }

    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        Self {
            x: self.y.times_plus(b.z, -(self.z * b.y)),
            y: self.z.times_plus(b.x, -(self.x * b.z)),
            z: self.x.times_plus(b.y, -(self.y * b.x)),
        }
    }

    /// self × b + c.
    #[inline(always)]
    pub fn cross_plus(self, b: Self, c: Self) -> Self {
        Self {
            x: self.y.times_plus(b.z, (-self.z).times_plus(b.y, c.x)),
            y: self.z.times_plus(b.x, (-self.x).times_plus(b.z, c.y)),
            z: self.x.times_plus(b.y, (-self.y).times_plus(b.x, c.z)),
        }
    }

    /// matrix · self.
    #[inline(always)]
    pub fn turned(self, m: &DMat3) -> Self {
        let [x, y, z] = [Self::constant(m.x_axis), Self::constant(m.y_axis), Self::constant(m.z_axis)];
        z.scaled_plus(self.z, y.scaled_plus(self.y, x.scaled(self.x)))
    }

    /// From axes turned about z to the unturned.
    #[inline(always)]
    pub fn out_of_z(self, turn: Turn<R>) -> Self {
        let (x, y) = turn.leave(self.x, self.y);
        Self { x, y, z: self.z }
    }

    /// To axes turned about z.
    #[inline(always)]
    pub fn into_z(self, turn: Turn<R>) -> Self {
        let (x, y) = turn.enter(self.x, self.y);
        Self { x, y, z: self.z }
    }

    /// From axes turned about x to the unturned.
    #[inline(always)]
    pub fn out_of_x(self, turn: impl Plane<R>) -> Self {
        let (y, z) = turn.leave(self.y, self.z);
        Self { x: self.x, y, z }
    }

    /// To axes turned about x.
    #[inline(always)]
    pub fn into_x(self, turn: impl Plane<R>) -> Self {
        let (y, z) = turn.enter(self.y, self.z);
        Self { x: self.x, y, z }
    }
}
