//! Mass matrix by the composite rigid body algorithm.

use crate::data::Data;
use crate::kernel::{Scratch, run_kernel};
use crate::matrix::Symmetric;
use crate::model::Model;
use crate::plane::Turn;
use crate::real::{One, Real};
use crate::segments::Segments;
use crate::vector::Vector;
use nalgebra::DMatrix;

/// A body with all that hangs from it, rigid, in its kernel frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Composite<R> {
    turn: Turn<R>,
    origin: Vector<R>,
    mass: R,
    first_moment: Vector<R>,
    rotational: Symmetric<R>,
}

impl<R: Real> Composite<R> {
    pub const ZERO: Self = Self {
        turn: Turn::ZERO,
        origin: Vector::ZERO,
        mass: R::ZERO,
        first_moment: Vector::ZERO,
        rotational: Symmetric::ZERO,
    };
}

impl Model {
    /// Mass matrix M(q) + diag(armature) (n×n, both halves), kg m² between revolute joints. Does not allocate.
    ///
    /// The composite rigid body algorithm in body coordinates (Featherstone 2008, table 6.2). Frames have their joint's
    /// axis on z.
    ///
    /// # Panics
    /// If `q` is not of length n or `mass` not n×n.
    pub fn mass_matrix(&self, data: &mut Data, q: &[f64], mass: &mut DMatrix<f64>) {
        let n = self.dof();
        assert_eq!(mass.shape(), (n, n), "the mass matrix is n×n");
        run_kernel!(&mut data.kernel, self.segments(), q, mass.as_mut_slice());
    }
}

fn portable(segments: &Segments, scratch: &mut Scratch<One<false>>, q: &[f64], out: &mut [f64]) {
    body(segments, scratch, q, out);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")]
unsafe fn avx512<R: Real<Outside = f64>>(segments: &Segments, scratch: &mut Scratch<R>, q: &[f64], out: &mut [f64]) {
    body(segments, scratch, q, out);
}

/// # Safety
/// The processor must have the features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn avx2<R: Real<Outside = f64>>(segments: &Segments, scratch: &mut Scratch<R>, q: &[f64], out: &mut [f64]) {
    body(segments, scratch, q, out);
}

#[inline(always)]
fn body<R: Real<Outside = f64>>(segments: &Segments, scratch: &mut Scratch<R>, q: &[f64], out: &mut [f64]) {
    let n = segments.list.len();
    assert_eq!(q.len(), n, "one position a joint");
    assert_eq!(scratch.composite.len(), n + 1, "scratch of this model");
    scratch.turn_joints(segments, q, 0);
    for (i, segment) in segments.list.iter().enumerate() {
        scratch.composite[i + 1] = Composite {
            turn: scratch.turn(i),
            origin: segment.origin_at(R::load(&q[i], 0)),
            mass: R::splat(segment.mass),
            first_moment: Vector::constant(segment.first_moment),
            rotational: Symmetric::constant(&segment.rotational),
        };
    }
    out.fill(0.0);
    for (i, segment) in segments.list.iter().enumerate().rev() {
        let Composite { turn, origin, mass, first_moment: h, rotational } = scratch.composite[i + 1];
        // The force that moves the composite at unit acceleration of the joint.
        let (mut moment, mut force, along) = if segment.revolute {
            let moment = Vector { x: rotational.xz, y: rotational.yz, z: rotational.zz };
            (moment, Vector { x: -h.y, y: h.x, z: R::ZERO }, rotational.zz)
        } else {
            (Vector { x: h.y, y: -h.x, z: R::ZERO }, Vector { x: R::ZERO, y: R::ZERO, z: mass }, mass)
        };
        (along + R::splat(segment.armature)).store(&mut out[i * n + i], 0);

        if segment.parent > 0 {
            let (mut h, mut rotational) = segment.rigid_to_parent(turn, h, rotational);
            if segment.offset {
                // I + 2 (r·g) 1 − r gᵀ − g rᵀ with g = h + ½ m r.
                let g = origin.scaled_plus(mass * R::splat(0.5), h);
                let dot = origin.dot(g);
                let all = Symmetric { xx: dot + dot, yy: dot + dot, zz: dot + dot, ..Symmetric::ZERO };
                rotational = rotational.plus(all).less_outer_twice(origin, g);
                h = origin.scaled_plus(mass, h);
            }
            let parent = &mut scratch.composite[segment.parent];
            parent.mass = parent.mass + mass;
            parent.first_moment = parent.first_moment.plus(h);
            parent.rotational = parent.rotational.plus(rotational);
        }

        // Down to the base: what each joint on the way takes of the force.
        let mut at = i;
        while segments.list[at].parent > 0 {
            let below = &segments.list[at];
            let composite = &scratch.composite[at + 1];
            (force, moment) = below.pair_to_parent(composite.turn, force, moment);
            if below.offset {
                moment = composite.origin.cross_plus(force, moment);
            }
            at = below.parent - 1;
            let entry = if segments.list[at].revolute { moment.z } else { force.z };
            entry.store(&mut out[i * n + at], 0);
            entry.store(&mut out[at * n + i], 0);
        }
    }
}
