//! Errors.

use super::*;

/// Each kind of effect on a joint of this name.
fn on_joint(joint: &str) -> Vec<Effect> {
    let one = |x: f64| -> BTreeMap<String, f64> { [(joint.to_owned(), x)].into() };
    let coupling = |joints: [&str; 2]| {
        let joints = joints.map(str::to_owned);
        Effect::JointCoupling(JointCoupling { joints, ratio: 1.0, coulomb: 1.0, viscous: 1.0, armature: 0.1 })
    };
    vec![
        Effect::ViscousFriction(ViscousFriction { viscous: one(1.0) }),
        coulomb(one(1.0)),
        Effect::Armature(Armature { armature: one(0.1) }),
        Effect::TorqueGainError(TorqueGainError { gain: one(1.1) }),
        Effect::TorqueBias(TorqueBias { bias: one(1.0) }),
        Effect::ParallelSpring(ParallelSpring { stiffness: one(1.0), rest_position: one(0.0) }),
        Effect::Payload(Payload { joint: joint.into(), mass: 1.0, com: [0.0; 3], inertia: [0.0; 6] }),
        Effect::LinkInertiaError(LinkInertiaError {
            joint: joint.into(),
            mass_delta: 1.0,
            first_moment_delta: [0.0; 3],
            inertia_delta: [0.0; 6],
        }),
        coupling([joint, "joint1"]),
        coupling(["joint1", joint]),
    ]
}

#[test]
fn an_unknown_joint_is_named_with_those_there_are() {
    let model = robot("arm6");
    for effect in on_joint("joint2") {
        Plant::new(&model, &[effect], 1e-3).unwrap();
    }
    for effect in on_joint("elbow") {
        let error = Plant::new(&model, std::slice::from_ref(&effect), 1e-3).unwrap_err();
        match &error {
            EffectError::UnknownJoint { kind, joint, known } => {
                assert_eq!((*kind, joint.as_str()), (effect.kind(), "elbow"));
                assert_eq!(known, "joint1, joint2, joint3, joint4, joint5, joint6");
            }
            other => panic!("{effect:?}: {other}"),
        }
        let text = error.to_string();
        assert!(text.contains(effect.kind().name()) && text.contains("elbow") && text.contains("joint6"), "{text}");
    }
}

#[track_caller]
fn assert_out_of_bounds(effect: Effect, name: &str) {
    let error = Plant::new(&robot("arm6"), std::slice::from_ref(&effect), 1e-3);
    match &error {
        Err(e @ EffectError::OutOfBounds { kind, parameter, .. }) => {
            assert_eq!((*kind, *parameter), (effect.kind(), name), "{effect:?}");
            let text = e.to_string();
            assert!(text.contains(effect.kind().name()) && text.contains(name) && text.contains("must be"), "{text}");
        }
        other => panic!("{effect:?} with a bad {name} gives {:?}", other.as_ref().err()),
    }
}

#[test]
fn parameters_outside_their_bounds_are_named() {
    let one = |x: f64| -> BTreeMap<String, f64> { [("joint2".to_owned(), x)].into() };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_out_of_bounds(Effect::ViscousFriction(ViscousFriction { viscous: one(bad) }), "viscous");
        assert_out_of_bounds(coulomb(one(bad)), "coulomb");
        assert_out_of_bounds(Effect::TorqueBias(TorqueBias { bias: one(bad) }), "bias");
        let spring = ParallelSpring { stiffness: one(1.0), rest_position: one(bad) };
        assert_out_of_bounds(Effect::ParallelSpring(spring), "rest_position");
        let body = Payload { joint: "joint6".into(), mass: 1.0, com: [0.0; 3], inertia: [0.0; 6] };
        assert_out_of_bounds(Effect::Payload(Payload { mass: bad, ..body.clone() }), "mass");
        assert_out_of_bounds(Effect::Payload(Payload { com: [0.0, bad, 0.0], ..body.clone() }), "com");
        let inertia = [0.0, 0.0, 0.0, 0.0, 0.0, bad];
        assert_out_of_bounds(Effect::Payload(Payload { inertia, ..body }), "inertia");
        let error = LinkInertiaError {
            joint: "joint3".into(),
            mass_delta: 0.1,
            first_moment_delta: [0.0; 3],
            inertia_delta: [0.0; 6],
        };
        assert_out_of_bounds(
            Effect::LinkInertiaError(LinkInertiaError { mass_delta: bad, ..error.clone() }),
            "mass_delta",
        );
        let moved = LinkInertiaError { first_moment_delta: [bad, 0.0, 0.0], ..error.clone() };
        assert_out_of_bounds(Effect::LinkInertiaError(moved), "first_moment_delta");
        let turned = LinkInertiaError { inertia_delta: [0.0, 0.0, bad, 0.0, 0.0, 0.0], ..error };
        assert_out_of_bounds(Effect::LinkInertiaError(turned), "inertia_delta");
    }
    for bad in [f64::NAN, f64::INFINITY, -1e-9] {
        assert_out_of_bounds(Effect::Armature(Armature { armature: one(bad) }), "armature");
        let spring = ParallelSpring { stiffness: one(bad), rest_position: one(0.0) };
        assert_out_of_bounds(Effect::ParallelSpring(spring), "stiffness");
        let coupling = JointCoupling {
            joints: ["joint1".into(), "joint2".into()],
            ratio: 1.0,
            coulomb: 1.0,
            viscous: 1.0,
            armature: 1.0,
        };
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { coulomb: bad, ..coupling.clone() }), "coulomb");
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { viscous: bad, ..coupling.clone() }), "viscous");
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { armature: bad, ..coupling.clone() }), "armature");
    }
    for bad in [f64::NAN, f64::INFINITY, 0.0, -0.5] {
        assert_out_of_bounds(Effect::TorqueGainError(TorqueGainError { gain: one(bad) }), "gain");
    }
    for bad in [f64::NAN, f64::INFINITY, 3.2, -3.2] {
        assert_out_of_bounds(Effect::GravityMisalignment(GravityMisalignment { roll: bad, pitch: 0.0 }), "roll");
        assert_out_of_bounds(Effect::GravityMisalignment(GravityMisalignment { roll: 0.0, pitch: bad }), "pitch");
    }
    for bad in [f64::NAN, f64::INFINITY, 0.0] {
        let joints = ["joint1".into(), "joint2".into()];
        let coupling = JointCoupling { joints, ratio: bad, coulomb: 1.0, viscous: 1.0, armature: 1.0 };
        assert_out_of_bounds(Effect::JointCoupling(coupling), "ratio");
    }
}

/// Friction below what the URDF declares is an effect; friction below zero drives the joint.
#[test]
fn friction_that_would_drive_a_joint_is_out_of_bounds() {
    let declared = {
        let mut joints = slider().joints().to_vec();
        (joints[0].damping, joints[0].friction) = (2.0, 3.0);
        Model::new("slider".into(), "base".into(), joints).unwrap()
    };
    let one = |x: f64| -> BTreeMap<String, f64> { [("rail".to_owned(), x)].into() };
    let viscous = |x| Effect::ViscousFriction(ViscousFriction { viscous: one(x) });
    for allowed in [coulomb(one(-3.0)), viscous(-2.0)] {
        Plant::new(&declared, &[allowed], 1e-3).unwrap();
    }
    for (effect, name) in [(coulomb(one(-3.1)), "coulomb"), (viscous(-2.1), "viscous")] {
        match Plant::new(&declared, std::slice::from_ref(&effect), 1e-3) {
            Err(EffectError::OutOfBounds { parameter, .. }) => assert_eq!(parameter, name),
            other => panic!("{effect:?}: {:?}", other.err()),
        }
    }
}

/// A body may be missing from the link, but not more than the link has.
#[test]
fn a_payload_that_leaves_less_than_nothing_is_out_of_bounds() {
    let model = robot("arm6");
    let mass = model.joints()[5].inertia.mass;
    let missing = Payload { joint: "joint6".into(), mass: -1.5 * mass, com: [0.0; 3], inertia: [0.0; 6] };
    assert_out_of_bounds(Effect::Payload(missing), "mass");
    let error = LinkInertiaError {
        joint: "joint3".into(),
        mass_delta: -1.5 * model.joints()[2].inertia.mass,
        first_moment_delta: [0.0; 3],
        inertia_delta: [0.0; 6],
    };
    assert_out_of_bounds(Effect::LinkInertiaError(error), "mass_delta");
}

#[test]
fn a_rest_position_of_an_unknown_joint_is_an_error() {
    let spring = ParallelSpring {
        stiffness: [("joint1".into(), 1.0)].into(),
        rest_position: [("joint1".into(), 0.1), ("elbow".into(), 0.2)].into(),
    };
    let error = Plant::new(&robot("arm6"), &[Effect::ParallelSpring(spring)], 1e-3).err();
    assert!(matches!(&error, Some(EffectError::UnknownJoint { joint, .. }) if joint == "elbow"), "{error:?}");
}

#[test]
fn a_coupling_needs_two_joints() {
    let joints = ["joint3".into(), "joint3".into()];
    let coupling = JointCoupling { joints, ratio: -1.0, coulomb: 1.0, viscous: 1.0, armature: 0.1 };
    assert!(Plant::new(&robot("arm6"), &[Effect::JointCoupling(coupling)], 1e-3).is_err());
}
