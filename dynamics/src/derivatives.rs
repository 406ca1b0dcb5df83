//! Derivatives of inverse and forward dynamics.

use crate::coriolis::VelocityProduct;
use crate::data::Data;
use crate::inverse::invert;
use crate::model::Model;
use crate::spatial::{Force, Motion};
use nalgebra::DMatrix;

impl Model {
    /// Derivatives of [`Model::inverse_dynamics`] at `q`, `v`, `a` (n each): ∂τ/∂q and ∂τ/∂v (n×n, row: torque, column:
    /// joint). ∂τ/∂a is [`Model::mass_matrix`]. Calls [`Model::forward_kinematics`]. Does not allocate.
    ///
    /// Analytic, one sweep outwards and one inwards (Carpentier and Mansard 2018, "Analytical derivatives of rigid body
    /// dynamics algorithms"), in the form in which the velocity products of composite bodies are summed (Singh, Russell
    /// and Wensing 2022, "Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra"), in
    /// world coordinates. With ψ̇ = v_p × S, ψ̈ = a_p × S + v_p × ψ̇ of a joint on parent p and j a joint on the way from i
    /// to the base:
    ///
    /// ∂τ_i/∂q_j = S_iᵀ(2B_i ψ̇_j + I_i ψ̈_j), ∂τ_j/∂q_i = S_jᵀ(2B_i ψ̇_i + I_i ψ̈_i + S_i ×* f_i),
    /// ∂τ_i/∂v_j = S_iᵀ(2B_i S_j + I_i(ψ̇_j + Ṡ_j)), ∂τ_j/∂v_i = S_jᵀ(2B_i S_i + I_i(ψ̇_i + Ṡ_i)).
    ///
    /// # Panics
    /// If a slice is not of length n or a matrix not n×n.
    pub fn inverse_dynamics_derivatives(
        &self,
        data: &mut Data,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        by_position: &mut DMatrix<f64>,
        by_velocity: &mut DMatrix<f64>,
    ) {
        let n = self.dof();
        assert!([v.len(), a.len()] == [n; 2], "one velocity and one acceleration a joint");
        assert!([by_position.shape(), by_velocity.shape()] == [(n, n); 2], "the derivatives are n×n");
        self.forward_kinematics(data, q);
        let base = Motion { linear: -self.gravity(), ..Motion::default() };
        for (i, joint) in self.joints().iter().enumerate() {
            let frame = data.world_from_link[i];
            let s = frame.motion_to_parent(joint.subspace());
            let parent = joint.parent.map(|p| (data.velocity[p], data.acceleration[p]));
            let (parent_velocity, parent_acceleration) = parent.unwrap_or((Motion::default(), base));
            let velocity = parent_velocity + s * v[i];
            let rate = velocity.cross(s);
            let acceleration = parent_acceleration + s * a[i] + rate * v[i];
            let inertia = joint.inertia.transform(&frame);
            data.subspace[i] = s;
            data.subspace_rate[i] = rate;
            data.velocity[i] = velocity;
            data.acceleration[i] = acceleration;
            data.drift[i] = parent_velocity.cross(s);
            data.drift_rate[i] = parent_acceleration.cross(s) + parent_velocity.cross(data.drift[i]);
            data.composite[i] = inertia;
            data.coriolis[i] = VelocityProduct::new(&inertia, velocity);
            data.force[i] = inertia.apply(acceleration) + velocity.cross_force(inertia.apply(velocity));
        }
        by_position.fill(0.0);
        by_velocity.fill(0.0);
        for (i, joint) in self.joints().iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                data.composite[parent] = data.composite[parent].add(&data.composite[i]);
                data.coriolis[parent] = data.coriolis[parent].add(&data.coriolis[i]);
                let force = data.force[i];
                data.force[parent] += force;
            }
            let (s, inertia, product) = (data.subspace[i], data.composite[i], data.coriolis[i]);
            let twice = |f: Force| Force { moment: 2.0 * f.moment, force: 2.0 * f.force };
            let momentum = inertia.apply(s);
            let row = 2.0 * product.transpose_apply(s);
            let position_column =
                twice(product.apply(data.drift[i])) + inertia.apply(data.drift_rate[i]) + s.cross_force(data.force[i]);
            let velocity_column = twice(product.apply(s)) + inertia.apply(data.drift[i] + data.subspace_rate[i]);
            by_position[(i, i)] = row.dot(data.drift[i].angular) + data.drift_rate[i].dot(momentum);
            by_velocity[(i, i)] = s.dot(velocity_column);
            let mut next = joint.parent;
            while let Some(j) = next {
                let (other, drift) = (data.subspace[j], data.drift[j]);
                by_position[(i, j)] = row.dot(drift.angular) + data.drift_rate[j].dot(momentum);
                by_velocity[(i, j)] = row.dot(other.angular) + (drift + data.subspace_rate[j]).dot(momentum);
                by_position[(j, i)] = other.dot(position_column);
                by_velocity[(j, i)] = other.dot(velocity_column);
                next = self.joints()[j].parent;
            }
        }
    }

    /// [`Model::forward_dynamics`] with its derivatives ∂a/∂q, ∂a/∂v and ∂a/∂τ = M⁻¹ (n×n each). Does not allocate.
    ///
    /// ∂a/∂x = −M⁻¹ ∂τ/∂x at that acceleration (Carpentier and Mansard 2018, section III): the implicit function theorem
    /// on inverse dynamics.
    ///
    /// # Panics
    /// If a slice is not of length n or a matrix not n×n.
    #[expect(clippy::too_many_arguments, reason = "a point, and a buffer for each of the four results")]
    pub fn forward_dynamics_derivatives(
        &self,
        data: &mut Data,
        q: &[f64],
        v: &[f64],
        tau: &[f64],
        a: &mut [f64],
        by_position: &mut DMatrix<f64>,
        by_velocity: &mut DMatrix<f64>,
        by_torque: &mut DMatrix<f64>,
    ) {
        self.forward_dynamics(data, q, v, tau, a);
        let [mut mass, mut torque_by_position, mut torque_by_velocity] = std::mem::take(&mut data.square);
        self.inverse_dynamics_derivatives(data, q, v, a, &mut torque_by_position, &mut torque_by_velocity);
        self.mass_matrix(data, q, &mut mass);
        invert(&mut mass, by_torque);
        // Not nalgebra's product, which allocates buffers.
        for (out, factor) in [(by_position, &torque_by_position), (by_velocity, &torque_by_velocity)] {
            for c in 0..self.dof() {
                for r in 0..self.dof() {
                    out[(r, c)] = -by_torque.column(r).dot(&factor.column(c));
                }
            }
        }
        data.square = [mass, torque_by_position, torque_by_velocity];
    }
}
