//! Forward dynamics by the articulated body algorithm.

use crate::data::{Data, LaneData};
use crate::kernel::{Kernel, Scratch, lane_by_lane, run_kernel};
use crate::matrix::{Matrix, Symmetric};
use crate::model::Model;
use crate::plane::Turn;
use crate::real::{LANES, One, Real};
use crate::segments::{Segment, Segments};
use crate::vector::Vector;

/// A body with what hangs from it, in its kernel frame: moment = inertia α + coupling a + ..., force = couplingᵀ α +
/// mass a + ..., with a the acceleration of the origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Articulated<R> {
    turn: Turn<R>,
    origin: Vector<R>,
    omega: Vector<R>,
    /// ω × (ω × origin), ω of the parent, in its frame.
    centripetal: Vector<R>,
    /// What the joint's speed adds to the acceleration across x and y: of the angular kind for a revolute joint, of
    /// the linear kind for a prismatic one.
    drift: (R, R),
    /// Articulated inertia of the children alone, until the body's turn comes.
    inertia: Symmetric<R>,
    coupling: Matrix<R>,
    mass: Symmetric<R>,
    moment: Vector<R>,
    force: Vector<R>,
    /// Columns of the articulated inertia at the joint's axis, over D.
    angular_gain: Vector<R>,
    linear_gain: Vector<R>,
    /// u / D.
    push: R,
    alpha: Vector<R>,
    linear: Vector<R>,
}

impl<R: Real> Articulated<R> {
    pub const ZERO: Self = Self {
        turn: Turn::ZERO,
        origin: Vector::ZERO,
        omega: Vector::ZERO,
        centripetal: Vector::ZERO,
        drift: (R::ZERO, R::ZERO),
        inertia: Symmetric::ZERO,
        coupling: Matrix::ZERO,
        mass: Symmetric::ZERO,
        moment: Vector::ZERO,
        force: Vector::ZERO,
        angular_gain: Vector::ZERO,
        linear_gain: Vector::ZERO,
        push: R::ZERO,
        alpha: Vector::ZERO,
        linear: Vector::ZERO,
    };
}

impl Model {
    /// Accelerations (n) under torques `tau` (n; N m or N) at state `q`, `v` (n each):
    /// a = (M(q) + diag(armature))⁻¹ (τ − C(q, v) v − g(q)). Does not allocate.
    ///
    /// The articulated body algorithm in body coordinates (Featherstone 2008, table 7.1), on the true accelerations of
    /// the links' origins, so that no linear velocity is needed. Frames have their joint's axis on z; an articulated
    /// inertia is 21 numbers.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn forward_dynamics(&self, data: &mut Data, q: &[f64], v: &[f64], tau: &[f64], a: &mut [f64]) {
        run_kernel!(&mut data.kernel, self.segments(), q, v, tau, a);
    }

    /// [`Model::forward_dynamics`] of [`LANES`] states at once: entry `[i][k]` belongs to joint i of state k. Does not
    /// allocate.
    ///
    /// # Panics
    /// If a slice is not of length n.
    pub fn forward_dynamics_lanes(
        &self,
        data: &mut LaneData,
        q: &[[f64; LANES]],
        v: &[[f64; LANES]],
        tau: &[[f64; LANES]],
        a: &mut [[f64; LANES]],
    ) {
        let n = self.dof();
        assert!([q.len(), v.len(), tau.len(), a.len()] == [n; 4], "one row a joint");
        match &mut data.kernel {
            Kernel::Portable(scratch) => {
                lane_by_lane!(portable, self.segments(), scratch, &mut data.single, q, v, tau, a);
            }
            // SAFETY: these variants exist only where `Kernel::new` found the instructions.
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2(scratch) => unsafe { avx2(self.segments(), scratch, q, v, tau, a) },
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512(scratch) => unsafe { avx512(self.segments(), scratch, q, v, tau, a) },
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2(scratch) | Kernel::Avx512(scratch) => {
                lane_by_lane!(body, self.segments(), scratch, &mut data.single, q, v, tau, a);
            }
        }
    }
}

fn portable(segments: &Segments, scratch: &mut Scratch<One<false>>, q: &[f64], v: &[f64], tau: &[f64], a: &mut [f64]) {
    body(segments, scratch, q, v, tau, a);
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
    tau: &[R::Outside],
    a: &mut [R::Outside],
) {
    body(segments, scratch, q, v, tau, a);
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
    tau: &[R::Outside],
    a: &mut [R::Outside],
) {
    body(segments, scratch, q, v, tau, a);
}

#[inline(always)]
fn body<R: Real>(
    segments: &Segments,
    scratch: &mut Scratch<R>,
    q: &[R::Outside],
    v: &[R::Outside],
    tau: &[R::Outside],
    a: &mut [R::Outside],
) {
    let n = segments.list.len();
    assert_eq!(q.len(), n, "one position a joint");
    assert_eq!(v.len(), n, "one velocity a joint");
    assert_eq!(tau.len(), n, "one torque a joint");
    assert_eq!(a.len(), n, "one acceleration a joint");
    assert_eq!(scratch.articulated.len(), n + 1, "scratch of this model");
    scratch.articulated[0].linear = Vector::constant(-segments.gravity);
    for part in 0..R::PARTS {
        scratch.turn_joints(segments, q, part);
        for (i, segment) in segments.list.iter().enumerate() {
            move_outwards(scratch, i, segment, R::load(&q[i], part), R::load(&v[i], part));
        }
        for (i, segment) in segments.list.iter().enumerate().rev() {
            gather_inwards(scratch, i, segment, R::load(&tau[i], part));
        }
        for (i, segment) in segments.list.iter().enumerate() {
            accelerate_outwards(scratch, i, segment).store(&mut a[i], part);
        }
    }
}

/// Velocities, and what follows from them alone.
#[inline(always)]
fn move_outwards<R: Real>(scratch: &mut Scratch<R>, i: usize, segment: &Segment, q: R, v: R) {
    let turn = scratch.turn(i);
    let parent = scratch.articulated[segment.parent].omega;
    let origin = segment.origin_at(q);
    let mut omega = segment.vector_into_child(turn, parent);
    let rate = if segment.revolute { v } else { v + v };
    let drift = (omega.y * rate, -(omega.x * rate));
    if segment.revolute {
        omega.z = omega.z + v;
    }
    let out = &mut scratch.articulated[i + 1];
    out.turn = turn;
    out.origin = origin;
    out.omega = omega;
    out.drift = drift;
    if segment.offset {
        out.centripetal = parent.cross(parent.cross(origin));
    }
}

/// Articulated inertia and force of a body, its joint's answer, and what the parent feels of it.
#[inline(always)]
fn gather_inwards<R: Real>(scratch: &mut Scratch<R>, i: usize, segment: &Segment, tau: R) {
    let body = &mut scratch.articulated[i + 1];
    let (turn, origin, omega) = (body.turn, body.origin, body.omega);
    let h = Vector::constant(segment.first_moment);
    let own_inertia = Symmetric::constant(&segment.rotational);
    let m = R::splat(segment.mass);

    // The body, and its children's sum.
    let mut force = omega.cross(omega.cross(h));
    let mut moment = omega.cross(own_inertia.times(omega));
    let (mut inertia, mut coupling, mut mass);
    if segment.leaf {
        inertia = own_inertia;
        coupling = Matrix::ZERO.plus_hat(h);
        mass = Symmetric { xx: m, yy: m, zz: m, ..Symmetric::ZERO };
    } else {
        inertia = body.inertia.plus(own_inertia);
        coupling = body.coupling.plus_hat(h);
        mass = Symmetric { xx: body.mass.xx + m, yy: body.mass.yy + m, zz: body.mass.zz + m, ..body.mass };
        force = force.plus(body.force);
        moment = moment.plus(body.moment);
    }

    // The joint gives way along its axis: column of the axis, D, u.
    let armature = R::splat(segment.armature);
    let (angular, linear, along, rest) = if segment.revolute {
        let row = Vector { x: coupling.zx, y: coupling.zy, z: coupling.zz };
        (Vector { x: inertia.xz, y: inertia.yz, z: inertia.zz }, row, inertia.zz, tau - moment.z)
    } else {
        let column = Vector { x: coupling.xz, y: coupling.yz, z: coupling.zz };
        (column, Vector { x: mass.xz, y: mass.yz, z: mass.zz }, mass.zz, tau - force.z)
    };
    let inverse = (along + armature).reciprocal();
    let angular_gain = angular.scaled(inverse);
    let linear_gain = linear.scaled(inverse);
    let push = rest * inverse;
    body.angular_gain = angular_gain;
    body.linear_gain = linear_gain;
    body.push = push;
    if segment.parent == 0 {
        return;
    }
    inertia = inertia.less_outer(angular, angular_gain);
    coupling = coupling.less_outer(angular, linear_gain);
    mass = mass.less_outer(linear, linear_gain);

    // What the parent feels at this origin: the joint's push, the drift, all in the parent's axes.
    let zero = R::ZERO;
    let drift = Vector { x: body.drift.0, y: body.drift.1, z: zero };
    moment = angular.scaled_plus(push, moment);
    force = linear.scaled_plus(push, force);
    if segment.revolute {
        moment = inertia.times_plus(drift, moment);
        force = coupling.transposed_times_plus(drift, force);
    } else {
        moment = coupling.times_plus(drift, moment);
        force = mass.times_plus(drift, force);
    }
    (inertia, coupling, mass) = segment.articulated_to_parent(turn, (inertia, coupling, mass));
    (moment, force) = segment.pair_to_parent(turn, moment, force);

    // And at the parent's origin.
    if segment.offset {
        let centripetal = body.centripetal;
        moment = coupling.times_plus(centripetal, moment);
        force = mass.times_plus(centripetal, force);
        moment = origin.cross_plus(force, moment);
        let before = coupling;
        coupling = coupling.plus_hat_times(origin, mass);
        inertia = inertia.shifted(origin, before, coupling);
    }
    let parent = &mut scratch.articulated[segment.parent];
    if segment.first_to_report {
        parent.inertia = inertia;
        parent.coupling = coupling;
        parent.mass = mass;
        parent.moment = moment;
        parent.force = force;
    } else {
        parent.inertia = parent.inertia.plus(inertia);
        parent.coupling = parent.coupling.plus(coupling);
        parent.mass = parent.mass.plus(mass);
        parent.moment = parent.moment.plus(moment);
        parent.force = parent.force.plus(force);
    }
}

/// The joint's acceleration from its parent's, and the body's.
#[inline(always)]
fn accelerate_outwards<R: Real>(scratch: &mut Scratch<R>, i: usize, segment: &Segment) -> R {
    let parent = &scratch.articulated[segment.parent];
    let (parent_alpha, mut linear) = (parent.alpha, parent.linear);
    let body = &mut scratch.articulated[i + 1];
    if segment.offset {
        linear = parent_alpha.cross_plus(body.origin, linear.plus(body.centripetal));
    }
    let (mut linear, mut alpha) = segment.pair_into_child(body.turn, linear, parent_alpha);
    let moved = if segment.revolute { &mut alpha } else { &mut linear };
    moved.x = moved.x + body.drift.0;
    moved.y = moved.y + body.drift.1;
    let a = body.push - (body.angular_gain.dot(alpha) + body.linear_gain.dot(linear));
    if segment.revolute {
        alpha.z = alpha.z + a;
    } else {
        linear.z = linear.z + a;
    }
    body.alpha = alpha;
    body.linear = linear;
    a
}
