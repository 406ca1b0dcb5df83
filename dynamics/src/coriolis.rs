//! Coriolis matrix.

use crate::data::Data;
use crate::model::{Inertia, Model};
use crate::spatial::{Force, Motion};
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

impl Model {
    /// Coriolis matrix C(q, v) (n×n) with C v the Coriolis and centrifugal torques and Ṁ − 2C skew-symmetric: the
    /// choice of the Christoffel symbols. Calls [`Model::forward_kinematics`]. Does not allocate.
    ///
    /// C = Σ J_kᵀ (I_k J̇_k + B_k J_k) with B_k = ½[(v×*) I − I (v×) + (I v) ×̄*] (Echeandia and Wensing 2021,
    /// "Numerical methods to compute the Coriolis matrix and Christoffel symbols for rigid-body systems", algorithm 1),
    /// here in world coordinates.
    ///
    /// # Panics
    /// If `q` or `v` is not of length n or `coriolis` not n×n.
    pub fn coriolis_matrix(&self, data: &mut Data, q: &[f64], v: &[f64], coriolis: &mut DMatrix<f64>) {
        let n = self.dof();
        assert_eq!(v.len(), n, "one velocity a joint");
        assert_eq!(coriolis.shape(), (n, n), "the Coriolis matrix is n×n");
        self.forward_kinematics(data, q);
        for (i, joint) in self.joints().iter().enumerate() {
            let frame = data.world_from_link[i];
            let s = frame.motion_to_parent(joint.subspace());
            let velocity = joint.parent.map_or(Motion::default(), |p| data.velocity[p]) + s * v[i];
            let inertia = joint.inertia.transform(&frame);
            data.velocity[i] = velocity;
            data.subspace[i] = s;
            data.subspace_rate[i] = velocity.cross(s);
            data.composite[i] = inertia;
            data.coriolis[i] = VelocityProduct::new(&inertia, velocity);
        }
        coriolis.fill(0.0);
        for (i, joint) in self.joints().iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                data.composite[parent] = data.composite[parent].add(&data.composite[i]);
                data.coriolis[parent] = data.coriolis[parent].add(&data.coriolis[i]);
            }
            let s = data.subspace[i];
            let product = data.coriolis[i];
            // Column i, all rows from i down to the base; and row i, those columns.
            let column = data.composite[i].apply(data.subspace_rate[i]) + product.apply(s);
            let momentum = data.composite[i].apply(s);
            let row = product.transpose_apply(s);
            coriolis[(i, i)] = s.dot(column);
            let mut next = joint.parent;
            while let Some(j) = next {
                let other = data.subspace[j];
                coriolis[(j, i)] = other.dot(column);
                coriolis[(i, j)] = data.subspace_rate[j].dot(momentum) + row.dot(other.angular);
                next = self.joints()[j].parent;
            }
        }
    }
}

/// What a body's motion makes of other motions, B = ½[(v×*) I − I (v×) + (I v) ×̄*]: a moment and a force that are
/// linear in the angular part e of a motion, `moment` e and e × `momentum`; the linear part drops out by Jacobi's
/// identity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VelocityProduct {
    moment: DMat3,
    momentum: DVec3,
}

impl VelocityProduct {
    pub const ZERO: Self = Self { moment: DMat3::ZERO, momentum: DVec3::ZERO };

    /// Of one body: moment e = −ω × (Σ e) − h × (v × e) with Σ = ½ tr(I) 1 − I, h its first moment and v the velocity
    /// of its point at the origin.
    pub fn new(inertia: &Inertia, velocity: Motion) -> Self {
        let (omega, h, v) = (velocity.angular, inertia.first_moment, velocity.linear);
        let i = inertia.rotational;
        let second = DMat3::from_diagonal(DVec3::splat(0.5 * (i.x_axis.x + i.y_axis.y + i.z_axis.z))) - i;
        let column = |e: DVec3| -omega.cross(second * e) - h.cross(v.cross(e));
        Self {
            moment: DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z)),
            momentum: inertia.mass * v + omega.cross(h),
        }
    }

    /// Of both bodies joined.
    pub fn add(&self, other: &Self) -> Self {
        Self { moment: self.moment + other.moment, momentum: self.momentum + other.momentum }
    }

    /// B m.
    pub fn apply(&self, m: Motion) -> Force {
        Force { moment: self.moment * m.angular, force: m.angular.cross(self.momentum) }
    }

    /// Bᵀ m: its linear part is zero.
    pub fn transpose_apply(&self, m: Motion) -> DVec3 {
        self.moment.transpose() * m.angular + self.momentum.cross(m.linear)
    }
}
