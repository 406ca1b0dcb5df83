//! Forward kinematics and Jacobians.

use crate::data::Data;
use crate::model::{JointKind, Model};
use glam::DVec3;
use nalgebra::DMatrix;

impl Model {
    /// Places every link at position `q` (n): read the results with [`Data::world_from_link`]. Does not allocate.
    ///
    /// world_from_link(i) = world_from_link(parent) · placement(i) · motion(q_i) (Featherstone 2008, eq. 4.2).
    ///
    /// # Panics
    /// If `q` is not of length n.
    pub fn forward_kinematics(&self, data: &mut Data, q: &[f64]) {
        assert_eq!(q.len(), self.dof(), "one position a joint");
        for (i, joint) in self.joints().iter().enumerate() {
            let parent_from_link = joint.parent_from_link(q[i]);
            data.placement[i] = parent_from_link;
            data.world_from_link[i] = match joint.parent {
                Some(parent) => data.world_from_link[parent].compose(&parent_from_link),
                None => parent_from_link,
            };
        }
    }

    /// Jacobian (6×n) of a point fixed to the link of joint `link`, given in that link's frame, m: rows linear then
    /// angular velocity, in world axes, for unit joint speeds. Calls [`Model::forward_kinematics`]. Does not allocate.
    ///
    /// # Panics
    /// If `q` is not of length n, `link` not less than n, or `jacobian` not 6×n.
    pub fn jacobian(&self, data: &mut Data, q: &[f64], link: usize, point_in_link: DVec3, jacobian: &mut DMatrix<f64>) {
        assert_eq!(jacobian.shape(), (6, self.dof()), "the Jacobian is 6×n");
        self.forward_kinematics(data, q);
        let point = data.world_from_link[link].transform_point(point_in_link);
        jacobian.fill(0.0);
        let mut next = Some(link);
        while let Some(i) = next {
            let joint = &self.joints()[i];
            let frame = &data.world_from_link[i];
            let axis = frame.rotation * joint.axis;
            let (linear, angular) = match joint.kind {
                JointKind::Revolute | JointKind::Continuous => (axis.cross(point - frame.translation), axis),
                JointKind::Prismatic => (axis, DVec3::ZERO),
            };
            let column = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
            jacobian.column_mut(i).copy_from_slice(&column);
            next = joint.parent;
        }
    }

    /// Fills local placements and the link velocities in link axes.
    pub(crate) fn local_velocities(&self, data: &mut Data, q: &[f64], v: &[f64]) {
        assert_eq!(q.len(), self.dof(), "one position a joint");
        assert_eq!(v.len(), self.dof(), "one velocity a joint");
        for (i, joint) in self.joints().iter().enumerate() {
            let placement = joint.parent_from_link(q[i]);
            data.placement[i] = placement;
            let own = joint.subspace() * v[i];
            data.velocity[i] = match joint.parent {
                Some(parent) => placement.motion_to_child(data.velocity[parent]) + own,
                None => own,
            };
        }
    }
}
