//! The regressor: inverse dynamics as a linear map of the inertial parameters.

use crate::data::Data;
use crate::inverse_dynamics::accelerate;
use crate::kernel::{Scratch, run_kernel};
use crate::matrix::spin;
use crate::model::Model;
use crate::real::{One, Real};
use crate::segments::Segments;
use crate::vector::Vector;
use nalgebra::DMatrix;

impl Model {
    /// The regressor Y(q, v, a) (n×10n): τ = Y π for the inertial parameters π of all links one after the other, each
    /// `[m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz]` in the link's frame about its origin, in the order of
    /// [`crate::Inertia::parameters`]. Armature is no part of it: Y π + diag(armature) a is the inverse dynamics. Does
    /// not allocate.
    ///
    /// A body's force is linear in its parameters (Atkeson, An and Hollerbach 1986); each joint below it takes its
    /// component S_j · f, with S_j brought to the body's frame.
    ///
    /// # Panics
    /// If `q`, `v` or `a` is not of length n or `regressor` not n×10n.
    pub fn regressor(&self, data: &mut Data, q: &[f64], v: &[f64], a: &[f64], regressor: &mut DMatrix<f64>) {
        let n = self.dof();
        assert_eq!(regressor.shape(), (n, 10 * n), "the regressor is n×10n");
        run_kernel!(&mut data.kernel, self.segments(), q, v, a, regressor.as_mut_slice());
    }
}

fn portable(segments: &Segments, scratch: &mut Scratch<One<false>>, q: &[f64], v: &[f64], a: &[f64], out: &mut [f64]) {
    body(segments, scratch, q, v, a, out);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")]
unsafe fn avx512<R: Real<Outside = f64>>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[f64],
    v: &[f64],
    a: &[f64],
    out: &mut [f64],
) {
    body(segments, scratch, q, v, a, out);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn avx2<R: Real<Outside = f64>>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[f64],
    v: &[f64],
    a: &[f64],
    out: &mut [f64],
) {
    body(segments, scratch, q, v, a, out);
}

#[inline(always)]
fn body<R: Real<Outside = f64>>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[f64],
    v: &[f64],
    a: &[f64],
    out: &mut [f64],
) {
    let n = segments.list.len();
    accelerate(segments, scratch, q, v, a, 0);
    out.fill(0.0);
    if n == 0 {
        return;
    }
    for (k, (columns, segment)) in out.chunks_exact_mut(10 * n).zip(&segments.list).enumerate() {
        let body = &scratch.moving[k + 1];
        let (turn, origin) = (body.turn, body.origin);
        let omega = segment.to_link(body.omega);
        let alpha = segment.to_link(body.alpha);
        let linear = segment.to_link(body.linear);
        let spin = spin(omega, alpha);
        let mut at = k;
        loop {
            // The motion of this body at unit speed of joint `at`, its parent's motion being known already.
            let (angular, slide) = if at == k {
                let z = Vector { z: R::splat(1.0), ..Vector::ZERO };
                if segment.revolute { (z, Vector::ZERO) } else { (Vector::ZERO, z) }
            } else {
                let (angular, slide) = scratch.axes[(segment.parent - 1) * n + at];
                let slide = if segment.offset { angular.cross_plus(origin, slide) } else { slide };
                segment.pair_into_child(turn, angular, slide)
            };
            scratch.axes[k * n + at] = (angular, slide);
            let (angular, slide) = (segment.to_link(angular), segment.to_link(slide));
            let first_moment = spin.transposed_times_plus(slide, linear.cross(angular));
            let [xx, xy, yy, xz, yz, zz] = rotational_row(angular, alpha, omega);
            let h = first_moment;
            let row = [slide.dot(linear), h.x, h.y, h.z, xx, xy, yy, xz, yz, zz];
            for (column, entry) in columns.chunks_exact_mut(n).zip(row) {
                entry.store(&mut column[at], 0);
            }
            match segments.list[at].parent {
                0 => break,
                parent => at = parent - 1,
            }
        }
    }
}

/// Coefficients of `[Ixx, Ixy, Iyy, Ixz, Iyz, Izz]` in s · (I α + ω × I ω) = sᵀ I α + (s × ω)ᵀ I ω.
#[inline(always)]
fn rotational_row<R: Real>(s: Vector<R>, alpha: Vector<R>, omega: Vector<R>) -> [R; 6] {
    let w = s.cross(omega);
    [
        s.x.times_plus(alpha.x, w.x * omega.x),
        s.x.times_plus(alpha.y, s.y.times_plus(alpha.x, w.x.times_plus(omega.y, w.y * omega.x))),
        s.y.times_plus(alpha.y, w.y * omega.y),
        s.x.times_plus(alpha.z, s.z.times_plus(alpha.x, w.x.times_plus(omega.z, w.z * omega.x))),
        s.y.times_plus(alpha.z, s.z.times_plus(alpha.y, w.y.times_plus(omega.z, w.z * omega.y))),
        s.z.times_plus(alpha.z, w.z * omega.z),
    ]
}
