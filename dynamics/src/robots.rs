//! Robots that come with the crate, from published figures: the sources are named in each URDF.
//!
//! All have joints `joint1`, `joint2`, … with limits, no friction, no rotors and no meshes.

use crate::model::Model;
use crate::urdf::{Loaded, UrdfError};

/// The names that [`model`] knows.
pub const NAMES: [&str; 3] = ["arm7", "arm6", "double_pendulum"];

/// URDF of a seven-joint arm: the Franka Emika Panda without hand, with the dynamic parameters of Gaz et al. 2019.
pub fn arm7() -> &'static str {
    include_str!("../robots/arm7.urdf")
}

/// URDF of a six-joint arm: the Universal Robots UR5e.
pub fn arm6() -> &'static str {
    include_str!("../robots/arm6.urdf")
}

/// URDF of a double pendulum: DFKI's design C.1, both joints about y, hanging down at position zero.
pub fn double_pendulum() -> &'static str {
    include_str!("../robots/double_pendulum.urdf")
}

/// URDF of the robot of this name; `None` where there is none, [`NAMES`] has those there are.
pub fn urdf(name: &str) -> Option<&'static str> {
    match name {
        "arm7" => Some(arm7()),
        "arm6" => Some(arm6()),
        "double_pendulum" => Some(double_pendulum()),
        _ => None,
    }
}

/// The robot of this name, loaded; `None` where there is none, [`NAMES`] has those there are.
///
/// # Errors
/// None: every robot of [`NAMES`] loads, without findings. The type is that of [`Model::from_urdf`].
pub fn model(name: &str) -> Option<Result<Loaded, UrdfError>> {
    urdf(name).map(Model::from_urdf)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn every_robot_loads_without_findings_and_is_physical() {
        for (name, dof) in NAMES.into_iter().zip([7, 6, 2]) {
            let loaded = model(name).unwrap().unwrap();
            assert_eq!(loaded.model.name(), name);
            assert_eq!(loaded.model.dof(), dof);
            assert!(loaded.findings.is_empty(), "{name}: {:?}", loaded.findings);
            for (number, joint) in loaded.model.joints().iter().enumerate() {
                assert_eq!(joint.name, format!("joint{}", number + 1));
                assert!(joint.inertia.is_physical(), "{name} {}", joint.name);
                assert!(joint.limits.lower.unwrap() < joint.limits.upper.unwrap());
                assert!(joint.limits.velocity.unwrap() > 0.0 && joint.limits.effort.unwrap() > 0.0);
            }
        }
        assert!(model("arm8").is_none());
    }

    /// Centre of a moved link's frame in the base at position zero.
    fn origin(name: &str, joint: usize) -> DVec3 {
        let loaded = model(name).unwrap().unwrap();
        let joints = loaded.model.joints();
        let (mut at, mut next) = (DVec3::ZERO, Some(joint));
        while let Some(index) = next {
            at = joints[index].placement.transform_point(at);
            next = joints[index].parent;
        }
        at
    }

    #[test]
    fn arm7_stands_upright_at_zero() {
        // Franka's figures: 0.333 + 0.316 + 0.384 to the wrist, 0.088 out to the last axis, flange 0.107 below.
        let last = origin("arm7", 6);
        assert!((last - DVec3::new(0.088, 0.0, 1.033)).length() < 1e-12, "{last}");
        let flange = model("arm7").unwrap().unwrap().link("flange").unwrap().clone();
        assert_eq!((flange.joint, flange.placement.translation), (Some(6), DVec3::new(0.0, 0.0, 0.107)));
    }

    #[test]
    fn arm6_lies_along_minus_x_at_zero() {
        // Product of the Denavit-Hartenberg transforms at zero: x = a2 + a3, y = -(d4 + d6), z = d1 - d5.
        let last = origin("arm6", 5);
        assert!((last - DVec3::new(-0.8172, -0.2329, 0.0628)).length() < 1e-12, "{last}");
    }
}
