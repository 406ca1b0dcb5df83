//! Rotations in a plane: joints about z, and the fixed turns about x and z between them.

use crate::real::Real;

/// Cosine and sine of an angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn<R> {
    pub c: R,
    pub s: R,
}

/// A rotation in a plane with coordinates (a, b): of any angle, or of an angle that needs no arithmetic.
pub(crate) trait Plane<R>: Copy {
    /// From the turned axes to the unturned.
    fn leave(self, a: R, b: R) -> (R, R);
    /// From the unturned axes to the turned.
    fn enter(self, a: R, b: R) -> (R, R);
    /// The 2×2 block ((aa, ab), (ba, bb)) from the turned axes to the unturned.
    fn leave_block(self, aa: R, ab: R, ba: R, bb: R) -> (R, R, R, R);
}

/// No turn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Straight;

/// A turn of +90°.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quarter;

/// A turn of −90°.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Back;

impl<R: Real> Turn<R> {
    pub const ZERO: Self = Self { c: R::ZERO, s: R::ZERO };

    #[inline(always)]
    pub fn constant(turn: Turn<f64>) -> Self {
        Self { c: R::splat(turn.c), s: R::splat(turn.s) }
    }
}

impl<R: Real> Plane<R> for Turn<R> {
    #[inline(always)]
    fn leave(self, a: R, b: R) -> (R, R) {
        ((-self.s).times_plus(b, self.c * a), self.s.times_plus(a, self.c * b))
    }

    #[inline(always)]
    fn enter(self, a: R, b: R) -> (R, R) {
        (self.s.times_plus(b, self.c * a), (-self.s).times_plus(a, self.c * b))
    }

    #[inline(always)]
    fn leave_block(self, aa: R, ab: R, ba: R, bb: R) -> (R, R, R, R) {
        let (ss, cs) = (self.s * self.s, self.c * self.s);
        let difference = aa - bb;
        let sum = ab + ba;
        let even = cs.times_plus(sum, ss * difference);
        let odd = (-ss).times_plus(sum, cs * difference);
        (aa - even, ab + odd, ba + odd, bb + even)
    }
}

impl<R: Real> Plane<R> for Straight {
    #[inline(always)]
    fn leave(self, a: R, b: R) -> (R, R) {
        (a, b)
    }

    #[inline(always)]
    fn enter(self, a: R, b: R) -> (R, R) {
        (a, b)
    }

    #[inline(always)]
    fn leave_block(self, aa: R, ab: R, ba: R, bb: R) -> (R, R, R, R) {
        (aa, ab, ba, bb)
    }
}

impl<R: Real> Plane<R> for Quarter {
    #[inline(always)]
    fn leave(self, a: R, b: R) -> (R, R) {
        (-b, a)
    }

    #[inline(always)]
    fn enter(self, a: R, b: R) -> (R, R) {
        (b, -a)
    }

    #[inline(always)]
    fn leave_block(self, aa: R, ab: R, ba: R, bb: R) -> (R, R, R, R) {
        (bb, -ba, -ab, aa)
    }
}

impl<R: Real> Plane<R> for Back {
    #[inline(always)]
    fn leave(self, a: R, b: R) -> (R, R) {
        (b, -a)
    }

    #[inline(always)]
    fn enter(self, a: R, b: R) -> (R, R) {
        (-b, a)
    }

    #[inline(always)]
    fn leave_block(self, aa: R, ab: R, ba: R, bb: R) -> (R, R, R, R) {
        (bb, -ba, -ab, aa)
    }
}
