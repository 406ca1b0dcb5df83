//! Units of a joint that slides. Laws are worked out in one set of numbers whatever the joint does; the public JSON says metres
//! and newtons where it slides.

use crate::schema::{Diagnosis, Estimate, Parameter, Regime};
use gapscope_dynamics::{JointKind, Model};

/// What a unit of a joint that turns is called of one that slides: an angle becomes a length, a torque a force.
pub fn sliding(unit: &str) -> String {
    unit.replace("kg m²", "kg").replace("N m", "N").replace("rad", "m")
}

/// Whether the robot has a joint of this name that slides.
fn slides(model: &Model, joint: &str) -> bool {
    model.joints().iter().any(|j| j.name == joint && j.kind == JointKind::Prismatic)
}

/// Puts the units of joints that slide into regimes.
pub fn of_regimes(model: &Model, regimes: &mut [Regime]) {
    for regime in regimes.iter_mut().filter(|regime| slides(model, &regime.joint)) {
        regime.bounds.unit = sliding(&regime.bounds.unit);
    }
}

/// The same in a whole diagnosis.
pub fn of_diagnosis(model: &Model, diagnosis: &mut Diagnosis) {
    of_regimes(model, &mut diagnosis.gap.regimes);
    let rename = |joint: &str, found: &mut Estimate| {
        if slides(model, joint) {
            found.unit = sliding(&found.unit);
        }
    };
    for parameter in diagnosis.effects.iter_mut().flat_map(|effect| effect.parameters.values_mut()) {
        if let Parameter::PerJoint(joints) = parameter {
            joints.iter_mut().for_each(|(joint, found)| rename(joint, found));
        }
    }
    for (joint, drive) in &mut diagnosis.drive {
        drive.constants.values_mut().for_each(|found| rename(joint, found));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slide_has_lengths_and_forces() {
        for (turns, slides) in [
            ("N m s/rad", "N s/m"),
            ("N m/(N m/rad)", "N/(N/m)"),
            ("kg m²/(N m/V)", "kg/(N/V)"),
            ("rad/s", "m/s"),
            ("-", "-"),
            ("s", "s"),
        ] {
            assert_eq!(sliding(turns), slides);
        }
    }
}
