//! Coriolis matrix.

use crate::data::Data;
use crate::model::{Inertia, Model};
use crate::spatial::{Force, Motion};
use glam::DVec3;
use nalgebra::{DMatrix, Matrix6, Vector6};

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
            data.coriolis[i] = body_coriolis(&inertia, velocity);
        }
        coriolis.fill(0.0);
        for (i, joint) in self.joints().iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                data.composite[parent] = data.composite[parent].add(&data.composite[i]);
                let lump = data.coriolis[i];
                data.coriolis[parent] += lump;
            }
            let s = data.subspace[i];
            let lump = &data.coriolis[i];
            // Column i, all rows from i down to the base; and row i, those columns.
            let column = data.composite[i].apply(data.subspace_rate[i]) + force(lump * vector(s));
            let momentum = data.composite[i].apply(s);
            let row = motion(lump.tr_mul(&vector(s)));
            coriolis[(i, i)] = s.dot(column);
            let mut next = joint.parent;
            while let Some(j) = next {
                let other = data.subspace[j];
                coriolis[(j, i)] = other.dot(column);
                coriolis[(i, j)] =
                    data.subspace_rate[j].dot(momentum) + row.angular.dot(other.angular) + row.linear.dot(other.linear);
                next = self.joints()[j].parent;
            }
        }
    }
}

/// B = ½[(v×*) I − I (v×) + (I v) ×̄*], angular rows first.
fn body_coriolis(inertia: &Inertia, velocity: Motion) -> Matrix6<f64> {
    let momentum = inertia.apply(velocity);
    let mut out = Matrix6::zeros();
    for k in 0..6 {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        let e =
            Motion { angular: DVec3::new(unit[0], unit[1], unit[2]), linear: DVec3::new(unit[3], unit[4], unit[5]) };
        let a = velocity.cross_force(inertia.apply(e));
        let b = inertia.apply(velocity.cross(e));
        let c = e.cross_force(momentum);
        let column =
            Force { moment: 0.5 * (a.moment - b.moment + c.moment), force: 0.5 * (a.force - b.force + c.force) };
        out.set_column(k, &vector_of(column.moment, column.force));
    }
    out
}

fn vector_of(top: DVec3, bottom: DVec3) -> Vector6<f64> {
    Vector6::new(top.x, top.y, top.z, bottom.x, bottom.y, bottom.z)
}

fn vector(m: Motion) -> Vector6<f64> {
    vector_of(m.angular, m.linear)
}

fn force(v: Vector6<f64>) -> Force {
    Force { moment: DVec3::new(v[0], v[1], v[2]), force: DVec3::new(v[3], v[4], v[5]) }
}

fn motion(v: Vector6<f64>) -> Motion {
    Motion { angular: DVec3::new(v[0], v[1], v[2]), linear: DVec3::new(v[3], v[4], v[5]) }
}
