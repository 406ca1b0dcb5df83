//! 3×3 matrices of any [`Real`], symmetric and not: what the kernels' inertias are made of.

use crate::plane::{Plane, Turn};
use crate::real::Real;
use crate::vector::Vector;

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric<R> {
    pub xx: R,
    pub xy: R,
    pub xz: R,
    pub yy: R,
    pub yz: R,
    pub zz: R,
}

/// A 3×3 matrix, entries by row and column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Matrix<R> {
    pub xx: R,
    pub xy: R,
    pub xz: R,
    pub yx: R,
    pub yy: R,
    pub yz: R,
    pub zx: R,
    pub zy: R,
    pub zz: R,
}

impl<R: Real> Symmetric<R> {
    pub const ZERO: Self = Self { xx: R::ZERO, xy: R::ZERO, xz: R::ZERO, yy: R::ZERO, yz: R::ZERO, zz: R::ZERO };

    #[inline(always)]
    pub fn constant(m: &Symmetric<f64>) -> Self {
        Self {
            xx: R::splat(m.xx),
            xy: R::splat(m.xy),
            xz: R::splat(m.xz),
            yy: R::splat(m.yy),
            yz: R::splat(m.yz),
            zz: R::splat(m.zz),
        }
    }

    #[inline(always)]
    pub fn plus(self, b: Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yy: self.yy + b.yy,
            yz: self.yz + b.yz,
            zz: self.zz + b.zz,
        }
    }

    /// self · v.
    #[inline(always)]
    pub fn times(self, v: Vector<R>) -> Vector<R> {
        Vector {
            x: self.xz.times_plus(v.z, self.xy.times_plus(v.y, self.xx * v.x)),
            y: self.yz.times_plus(v.z, self.yy.times_plus(v.y, self.xy * v.x)),
            z: self.zz.times_plus(v.z, self.yz.times_plus(v.y, self.xz * v.x)),
        }
    }

    /// self · v + c.
    #[inline(always)]
    pub fn times_plus(self, v: Vector<R>, c: Vector<R>) -> Vector<R> {
        Vector {
            x: self.xz.times_plus(v.z, self.xy.times_plus(v.y, self.xx.times_plus(v.x, c.x))),
            y: self.yz.times_plus(v.z, self.yy.times_plus(v.y, self.xy.times_plus(v.x, c.y))),
            z: self.zz.times_plus(v.z, self.yz.times_plus(v.y, self.xz.times_plus(v.x, c.z))),
        }
    }

    /// self − h r̂ + r̂ gᵀ, r̂ being the matrix of x ↦ r × x: symmetric for g = h + r̂ m.
    #[inline(always)]
    pub fn shifted(self, r: Vector<R>, h: Matrix<R>, g: Matrix<R>) -> Self {
        // Row i of −h r̂ is r × (row i of h); column j of r̂ gᵀ is r × (row j of g).
        Self {
            xx: r.y.times_plus(g.xz, (-r.z).times_plus(g.xy, r.y.times_plus(h.xz, (-r.z).times_plus(h.xy, self.xx)))),
            xy: r.y.times_plus(g.yz, (-r.z).times_plus(g.yy, r.z.times_plus(h.xx, (-r.x).times_plus(h.xz, self.xy)))),
            xz: r.y.times_plus(g.zz, (-r.z).times_plus(g.zy, r.x.times_plus(h.xy, (-r.y).times_plus(h.xx, self.xz)))),
            yy: r.z.times_plus(g.yx, (-r.x).times_plus(g.yz, r.z.times_plus(h.yx, (-r.x).times_plus(h.yz, self.yy)))),
            yz: r.z.times_plus(g.zx, (-r.x).times_plus(g.zz, r.x.times_plus(h.yy, (-r.y).times_plus(h.yx, self.yz)))),
            zz: r.x.times_plus(g.zy, (-r.y).times_plus(g.zx, r.x.times_plus(h.zy, (-r.y).times_plus(h.zx, self.zz)))),
        }
    }

    /// self − u vᵀ, where that is symmetric.
    #[inline(always)]
    pub fn less_outer(self, u: Vector<R>, v: Vector<R>) -> Self {
        Self {
            xx: (-u.x).times_plus(v.x, self.xx),
            xy: (-u.x).times_plus(v.y, self.xy),
            xz: (-u.x).times_plus(v.z, self.xz),
            yy: (-u.y).times_plus(v.y, self.yy),
            yz: (-u.y).times_plus(v.z, self.yz),
            zz: (-u.z).times_plus(v.z, self.zz),
        }
    }

    /// self − u vᵀ − v uᵀ.
    #[inline(always)]
    pub fn less_outer_twice(self, u: Vector<R>, v: Vector<R>) -> Self {
        let twice = v.plus(v);
        Self {
            xx: (-u.x).times_plus(twice.x, self.xx),
            xy: (-u.x).times_plus(v.y, (-u.y).times_plus(v.x, self.xy)),
            xz: (-u.x).times_plus(v.z, (-u.z).times_plus(v.x, self.xz)),
            yy: (-u.y).times_plus(twice.y, self.yy),
            yz: (-u.y).times_plus(v.z, (-u.z).times_plus(v.y, self.yz)),
            zz: (-u.z).times_plus(twice.z, self.zz),
        }
    }

    /// From axes turned about z to the unturned.
    #[inline(always)]
    pub fn out_of_z(self, turn: Turn<R>) -> Self {
        let (xx, xy, _, yy) = turn.leave_block(self.xx, self.xy, self.xy, self.yy);
        let (xz, yz) = turn.leave(self.xz, self.yz);
        Self { xx, xy, xz, yy, yz, zz: self.zz }
    }

    /// From axes turned about x to the unturned.
    #[inline(always)]
    pub fn out_of_x(self, turn: impl Plane<R>) -> Self {
        let (yy, yz, _, zz) = turn.leave_block(self.yy, self.yz, self.yz, self.zz);
        let (xy, xz) = turn.leave(self.xy, self.xz);
        Self { xx: self.xx, xy, xz, yy, yz, zz }
    }
}

impl<R: Real> Matrix<R> {
    pub const ZERO: Self = Self {
        xx: R::ZERO,
        xy: R::ZERO,
        xz: R::ZERO,
        yx: R::ZERO,
        yy: R::ZERO,
        yz: R::ZERO,
        zx: R::ZERO,
        zy: R::ZERO,
        zz: R::ZERO,
    };

    #[inline(always)]
    pub fn plus(self, b: Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yx: self.yx + b.yx,
            yy: self.yy + b.yy,
            yz: self.yz + b.yz,
            zx: self.zx + b.zx,
            zy: self.zy + b.zy,
            zz: self.zz + b.zz,
        }
    }

    /// selfᵀ · v + c.
    #[inline(always)]
    pub fn transposed_times_plus(self, v: Vector<R>, c: Vector<R>) -> Vector<R> {
        Vector {
            x: self.zx.times_plus(v.z, self.yx.times_plus(v.y, self.xx.times_plus(v.x, c.x))),
            y: self.zy.times_plus(v.z, self.yy.times_plus(v.y, self.xy.times_plus(v.x, c.y))),
            z: self.zz.times_plus(v.z, self.yz.times_plus(v.y, self.xz.times_plus(v.x, c.z))),
        }
    }

    /// self + the matrix of x ↦ h × x.
    #[inline(always)]
    pub fn plus_hat(self, h: Vector<R>) -> Self {
        Self {
            xy: self.xy - h.z,
            xz: self.xz + h.y,
            yx: self.yx + h.z,
            yz: self.yz - h.x,
            zx: self.zx - h.y,
            zy: self.zy + h.x,
            ..self
        }
    }

    /// self · v + c.
    #[inline(always)]
    pub fn times_plus(self, v: Vector<R>, c: Vector<R>) -> Vector<R> {
        Vector {
            x: self.xz.times_plus(v.z, self.xy.times_plus(v.y, self.xx.times_plus(v.x, c.x))),
            y: self.yz.times_plus(v.z, self.yy.times_plus(v.y, self.yx.times_plus(v.x, c.y))),
            z: self.zz.times_plus(v.z, self.zy.times_plus(v.y, self.zx.times_plus(v.x, c.z))),
        }
    }

    /// self + r̂ m, r̂ being the matrix of x ↦ r × x.
    #[inline(always)]
    pub fn plus_hat_times(self, r: Vector<R>, m: Symmetric<R>) -> Self {
        let x = r.cross_plus(Vector { x: m.xx, y: m.xy, z: m.xz }, Vector { x: self.xx, y: self.yx, z: self.zx });
        let y = r.cross_plus(Vector { x: m.xy, y: m.yy, z: m.yz }, Vector { x: self.xy, y: self.yy, z: self.zy });
        let z = r.cross_plus(Vector { x: m.xz, y: m.yz, z: m.zz }, Vector { x: self.xz, y: self.yz, z: self.zz });
        Self { xx: x.x, yx: x.y, zx: x.z, xy: y.x, yy: y.y, zy: y.z, xz: z.x, yz: z.y, zz: z.z }
    }

    /// ∫ x × self x dm for a body of second moment ∫ x xᵀ dm.
    #[inline(always)]
    pub fn moment_of(self, s: Symmetric<R>) -> Vector<R> {
        let x = self.zz.times_plus(s.yz, self.zy.times_plus(s.yy, self.zx * s.xy));
        let y = self.xz.times_plus(s.zz, self.xy.times_plus(s.yz, self.xx * s.xz));
        let z = self.yz.times_plus(s.xz, self.yy.times_plus(s.xy, self.yx * s.xx));
        Vector {
            x: (-self.yx).times_plus(s.xz, (-self.yy).times_plus(s.yz, (-self.yz).times_plus(s.zz, x))),
            y: (-self.zx).times_plus(s.xx, (-self.zy).times_plus(s.xy, (-self.zz).times_plus(s.xz, y))),
            z: (-self.xx).times_plus(s.xy, (-self.xy).times_plus(s.yy, (-self.xz).times_plus(s.yz, z))),
        }
    }

    /// self − u vᵀ.
    #[inline(always)]
    pub fn less_outer(self, u: Vector<R>, v: Vector<R>) -> Self {
        Self {
            xx: (-u.x).times_plus(v.x, self.xx),
            xy: (-u.x).times_plus(v.y, self.xy),
            xz: (-u.x).times_plus(v.z, self.xz),
            yx: (-u.y).times_plus(v.x, self.yx),
            yy: (-u.y).times_plus(v.y, self.yy),
            yz: (-u.y).times_plus(v.z, self.yz),
            zx: (-u.z).times_plus(v.x, self.zx),
            zy: (-u.z).times_plus(v.y, self.zy),
            zz: (-u.z).times_plus(v.z, self.zz),
        }
    }

    /// From axes turned about z to the unturned.
    #[inline(always)]
    pub fn out_of_z(self, turn: Turn<R>) -> Self {
        let (xx, xy, yx, yy) = turn.leave_block(self.xx, self.xy, self.yx, self.yy);
        let (xz, yz) = turn.leave(self.xz, self.yz);
        let (zx, zy) = turn.leave(self.zx, self.zy);
        Self { xx, xy, xz, yx, yy, yz, zx, zy, zz: self.zz }
    }

    /// From axes turned about x to the unturned.
    #[inline(always)]
    pub fn out_of_x(self, turn: impl Plane<R>) -> Self {
        let (yy, yz, zy, zz) = turn.leave_block(self.yy, self.yz, self.zy, self.zz);
        let (xy, xz) = turn.leave(self.xy, self.xz);
        let (yx, zx) = turn.leave(self.yx, self.zx);
        Self { xx: self.xx, xy, xz, yx, yy, yz, zx, zy, zz }
    }
}

/// Spin of an angular velocity ω and acceleration α: the matrix α̂ + ω̂ ω̂, which takes a point of the body to its
/// acceleration less that of the origin.
#[inline(always)]
pub(crate) fn spin<R: Real>(omega: Vector<R>, alpha: Vector<R>) -> Matrix<R> {
    let (xx, yy, zz) = (omega.x * omega.x, omega.y * omega.y, omega.z * omega.z);
    Matrix {
        xx: -(yy + zz),
        xy: omega.x.times_plus(omega.y, -alpha.z),
        xz: omega.x.times_plus(omega.z, alpha.y),
        yx: omega.x.times_plus(omega.y, alpha.z),
        yy: -(xx + zz),
        yz: omega.y.times_plus(omega.z, -alpha.x),
        zx: omega.x.times_plus(omega.z, -alpha.y),
        zy: omega.y.times_plus(omega.z, alpha.x),
        zz: -(xx + yy),
    }
}
