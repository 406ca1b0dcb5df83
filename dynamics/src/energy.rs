//! Kinetic and potential energy.

use crate::data::Data;
use crate::model::Model;

impl Model {
    /// Kinetic energy ½ vᵀ (M(q) + diag(armature)) v, J, summed body by body: Σ ½ v_iᵀ I_i v_i. Does not allocate.
    ///
    /// # Panics
    /// If `q` or `v` is not of length n.
    pub fn kinetic_energy(&self, data: &mut Data, q: &[f64], v: &[f64]) -> f64 {
        self.local_velocities(data, q, v);
        let mut twice = 0.0;
        for (i, joint) in self.joints().iter().enumerate() {
            let velocity = data.velocity[i];
            twice += velocity.dot(joint.inertia.apply(velocity)) + self.armature()[i] * v[i] * v[i];
        }
        0.5 * twice
    }

    /// Potential energy −Σ m_i g · c_i of the moved links, J, zero at the height of the base's origin. Calls
    /// [`Model::forward_kinematics`]. Does not allocate.
    ///
    /// # Panics
    /// If `q` is not of length n.
    pub fn potential_energy(&self, data: &mut Data, q: &[f64]) -> f64 {
        self.forward_kinematics(data, q);
        let mut energy = 0.0;
        for (joint, frame) in self.joints().iter().zip(&data.world_from_link) {
            let inertia = &joint.inertia;
            let moment = frame.rotation * inertia.first_moment + inertia.mass * frame.translation;
            energy -= self.gravity().dot(moment);
        }
        energy
    }
}
