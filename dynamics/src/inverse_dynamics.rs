//! Inverse dynamics by the recursive Newton-Euler algorithm.

use crate::data::{Data, LaneData};
use crate::kernel::{Kernel, Scratch, lane_by_lane, run_kernel};
use crate::matrix::{Matrix, Symmetric, spin};
use crate::model::Model;
use crate::plane::Turn;
use crate::real::{LANES, One, Real};
use crate::segments::Segments;
use crate::vector::Vector;

/// A body in motion, in its kernel frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moving<R> {
    pub turn: Turn<R>,
    pub origin: Vector<R>,
    pub omega: Vector<R>,
    pub alpha: Vector<R>,
    /// Acceleration of the origin, less gravity.
    pub linear: Vector<R>,
    spin: Matrix<R>,
    force: Vector<R>,
    moment: Vector<R>,
}

impl<R: Real> Moving<R> {
    pub const ZERO: Self = Self {
        turn: Turn::ZERO,
        origin: Vector::ZERO,
        omega: Vector::ZERO,
        alpha: Vector::ZERO,
        linear: Vector::ZERO,
        spin: Matrix::ZERO,
        force: Vector::ZERO,
        moment: Vector::ZERO,
    };
}

impl Model {
    /// Torques (n; N m or N) that give accelerations `a` (n) at state `q`, `v` (n each):
    /// τ = (M(q) + diag(armature)) a + C(q, v) v + g(q). Does not allocate.
    ///
    /// The recursive Newton-Euler algorithm in body coordinates, gravity as an acceleration of the base (Luh, Walker and
    /// Paul 1980; Featherstone 2008, table 5.1), on the true accelerations of the links' origins. Frames have their
    /// joint's axis on z; the forces come from the matrix α̂ + ω̂ω̂ as in Khalil and Kleinfinger 1987.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn inverse_dynamics(&self, data: &mut Data, q: &[f64], v: &[f64], a: &[f64], tau: &mut [f64]) {
        run_kernel!(&mut data.kernel, self.segments(), q, v, a, tau);
    }

    /// [`Model::inverse_dynamics`] of [`LANES`] states at once: entry `[i][k]` belongs to joint i of state k. Does not
    /// allocate.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn inverse_dynamics_lanes(
        &self,
        data: &mut LaneData,
        q: &[[f64; LANES]],
        v: &[[f64; LANES]],
        a: &[[f64; LANES]],
        tau: &mut [[f64; LANES]],
    ) {
        let n = self.dof();
        assert!([q.len(), v.len(), a.len(), tau.len()] == [n; 4], "one row a joint");
        match &mut data.kernel {
            Kernel::Portable(scratch) => {
                lane_by_lane!(portable, self.segments(), scratch, &mut data.single, q, v, a, tau);
            }
            // SAFETY: these variants exist only where `Kernel::new` found the instructions.
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2(scratch) => unsafe { avx2(self.segments(), scratch, q, v, a, tau) },
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512(scratch) => unsafe { avx512(self.segments(), scratch, q, v, a, tau) },
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2(scratch) | Kernel::Avx512(scratch) => {
                lane_by_lane!(body, self.segments(), scratch, &mut data.single, q, v, a, tau);
            }
        }
    }

    /// Torques (n) that hold the arm still at `q`: g(q) = inverse dynamics at zero velocity and acceleration. Does not
    /// allocate.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn gravity_torque(&self, data: &mut Data, q: &[f64], tau: &mut [f64]) {
        let zero = std::mem::take(&mut data.zero);
        self.inverse_dynamics(data, q, &zero, &zero, tau);
        data.zero = zero;
    }

    /// Torques (n) at zero acceleration: C(q, v) v + g(q). Does not allocate.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn bias(&self, data: &mut Data, q: &[f64], v: &[f64], tau: &mut [f64]) {
        let zero = std::mem::take(&mut data.zero);
        self.inverse_dynamics(data, q, v, &zero, tau);
        data.zero = zero;
    }
}

fn portable(segments: &Segments, scratch: &mut Scratch<One<false>>, q: &[f64], v: &[f64], a: &[f64], tau: &mut [f64]) {
    body(segments, scratch, q, v, a, tau);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")]
unsafe fn avx512<R: Real>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[R::Outside],
    v: &[R::Outside],
    a: &[R::Outside],
    tau: &mut [R::Outside],
) {
    body(segments, scratch, q, v, a, tau);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn avx2<R: Real>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[R::Outside],
    v: &[R::Outside],
    a: &[R::Outside],
    tau: &mut [R::Outside],
) {
    body(segments, scratch, q, v, a, tau);
}

#[inline(always)]
fn body<R: Real>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[R::Outside],
    v: &[R::Outside],
    a: &[R::Outside],
    tau: &mut [R::Outside],
) {
    assert_eq!(tau.len(), segments.list.len(), "one torque a joint");
    for part in 0..R::PARTS {
        accelerate(segments, scratch, q, v, a, part);

        // Inwards: each joint carries its body and what hangs from it.
        for (i, segment) in segments.list.iter().enumerate().rev() {
            let Moving { turn, origin, force, moment, .. } = scratch.moving[i + 1];
            let along = if segment.revolute { moment.z } else { force.z };
            R::splat(segment.armature).times_plus(R::load(&a[i], part), along).store(&mut tau[i], part);
            if segment.parent > 0 {
                let parent = &mut scratch.moving[segment.parent];
                let (force, mut moment) = segment.pair_to_parent(turn, force, moment);
                if segment.offset {
                    moment = origin.cross_plus(force, moment);
                }
                parent.force = parent.force.plus(force);
                parent.moment = parent.moment.plus(moment);
            }
        }
    }
}

/// Outwards: accelerations, and the force that each body's motion takes.
#[inline(always)]
pub(crate) fn accelerate<R: Real>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[R::Outside],
    v: &[R::Outside],
    a: &[R::Outside],
    part: usize,
) {
    let n = segments.list.len();
    assert_eq!(q.len(), n, "one position a joint");
    assert_eq!(v.len(), n, "one velocity a joint");
    assert_eq!(a.len(), n, "one acceleration a joint");
    assert_eq!(scratch.moving.len(), n + 1, "scratch of this model");
    scratch.turn_joints(segments, q, part);
    scratch.moving[0].linear = Vector::constant(-segments.gravity);

    for (i, segment) in segments.list.iter().enumerate() {
        let turn = scratch.turn(i);
        let (q, v, a) = (R::load(&q[i], part), R::load(&v[i], part), R::load(&a[i], part));
        let parent = &scratch.moving[segment.parent];
        let origin = segment.origin_at(q);
        let linear = if segment.offset { parent.spin.times_plus(origin, parent.linear) } else { parent.linear };
        let mut linear = segment.vector_into_child(turn, linear);
        let (mut omega, mut alpha) = segment.pair_into_child(turn, parent.omega, parent.alpha);
        if segment.revolute {
            alpha.x = omega.y.times_plus(v, alpha.x);
            alpha.y = (-omega.x).times_plus(v, alpha.y);
            alpha.z = alpha.z + a;
            omega.z = omega.z + v;
        } else {
            let twice = v + v;
            linear.x = omega.y.times_plus(twice, linear.x);
            linear.y = (-omega.x).times_plus(twice, linear.y);
            linear.z = linear.z + a;
        }
        let spin = spin(omega, alpha);
        let h = Vector::constant(segment.first_moment);
        let force = spin.times_plus(h, linear.scaled(R::splat(segment.mass)));
        // ∫ x × (linear + spin x) dm.
        let moment = h.cross_plus(linear, spin.moment_of(Symmetric::constant(&segment.second_moment)));
        scratch.moving[i + 1] = Moving { turn, origin, omega, alpha, linear, spin, force, moment };
    }
}
