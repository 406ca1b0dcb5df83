//! The least sizes that a diagnosis says its logs would have revealed: what is well above is found, what is well below is not.

use gapscope_datasets::Episode;
use gapscope_diagnosis::schema::{Diagnosis, Power, Verdict};
use gapscope_dynamics::Model;
use gapscope_effects::{
    Armature, Backlash, CoulombFriction, Effect, JointElasticity, Payload, TorqueBias, TorqueGainError, ViscousFriction,
};
use gapscope_tests::{diagnose, inertia_about, robot, rotors, simulate};
use std::collections::BTreeMap;

fn logs(model: &Model, effects: &[Effect]) -> Vec<Episode> {
    (1..4).map(|seed| simulate(model, effects, seed, 8.0, 250.0, 2e-6)).collect()
}

/// An effect of a kind at a joint, of a size.
fn effect(model: &Model, power: &Power, size: f64) -> Effect {
    let joint = power.joints[0].clone();
    let one: BTreeMap<String, f64> = [(joint.clone(), size)].into();
    match power.kind.as_str() {
        "viscous_friction" => Effect::ViscousFriction(ViscousFriction { viscous: one }),
        "coulomb_friction" => Effect::CoulombFriction(CoulombFriction { coulomb: one }),
        "armature" => Effect::Armature(Armature { armature: one }),
        "torque_bias" => Effect::TorqueBias(TorqueBias { bias: one }),
        "torque_gain_error" => Effect::TorqueGainError(TorqueGainError { gain: [(joint, 1.0 - size)].into() }),
        "payload" => {
            let body = &model.joints()[model.joint_index(&joint).unwrap()].inertia;
            let com = body.center_of_mass().unwrap().to_array();
            Effect::Payload(Payload { joint, mass: size, com, inertia: [0.0; 6] })
        }
        "joint_elasticity" => {
            let damping = [(joint.clone(), 0.1 * (size * inertia_about(model, &joint)).sqrt())].into();
            Effect::JointElasticity(JointElasticity { stiffness: one, damping })
        }
        "backlash" => Effect::Backlash(Backlash { gap: one }),
        other => panic!("{other}"),
    }
}

#[test]
#[ignore = "sizes leave out what is immaterial to the competition on one score: issue 23"]
fn sizes_are_those_that_are_found() {
    let model = robot("arm6");
    let nothing = diagnose(&model, &logs(&model, &[])).diagnosis;
    assert_eq!(nothing.verdict, Verdict::NoGap);
    let cases = [
        ("viscous_friction", "joint2"),
        ("coulomb_friction", "joint5"),
        ("armature", "joint4"),
        ("torque_bias", "joint1"),
        ("torque_gain_error", "joint2"),
        ("payload", "joint6"),
    ];
    let mut wrong = Vec::new();
    for (kind, joint) in cases {
        let of = |p: &&Power| p.kind == kind && p.joints == [joint];
        let power = nothing.power.iter().find(of).unwrap_or_else(|| panic!("{kind} at {joint}"));
        let size = power.size.unwrap();
        for (part, seen) in [(0.4, false), (2.5, true)] {
            let found = diagnose(&model, &logs(&model, &[effect(&model, power, part * size)])).diagnosis;
            let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
            if kinds.contains(&kind) != seen {
                wrong.push(format!("{kind} at {joint}, {part} × {size} {}: {kinds:?}", power.unit));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");

    // Gravity lies along the first axis: no offset of its encoder moves any torque.
    assert!(nothing.power.iter().all(|p| p.size.is_none_or(|size| size > 0.0)), "{:#?}", nothing.power);
    let first = |kind: &str| nothing.power.iter().find(|p| p.kind == kind && p.joints == ["joint1"]).unwrap().size;
    assert_eq!(first("joint_zero_offset"), None);
    assert!(first("coulomb_friction").is_some());
}

/// Springs and play act by what the rotor behind them does: here each joint has one.
#[test]
#[ignore = "play is named below its size since the competition on one score: issue 23"]
fn so_are_those_of_springs_and_play() {
    let model = robot("arm6");
    let rotors = rotors(&model);
    // Encoders of 17 bits or so: the least play is then one that gears have.
    let logs = |effects: &[Effect]| -> Vec<Episode> {
        (1..4).map(|seed| simulate(&model, effects, seed, 8.0, 250.0, 2e-5)).collect()
    };
    let nothing = diagnose(&model, &logs(std::slice::from_ref(&rotors))).diagnosis;
    let kinds = |d: &Diagnosis| d.effects.iter().map(|e| e.kind.clone()).collect::<Vec<_>>();
    assert_eq!(kinds(&nothing), ["armature"]);
    let mut wrong = Vec::new();
    for (kind, joint) in [
        ("joint_elasticity", "joint2"),
        ("joint_elasticity", "joint5"),
        ("backlash", "joint3"),
        ("backlash", "joint4"),
        ("backlash", "joint5"),
        ("backlash", "joint6"),
    ] {
        let power = nothing.power.iter().find(|p| p.kind == kind && p.joints == [joint]).unwrap();
        let Some(size) = power.size else {
            wrong.push(format!("{kind} at {joint} has no size"));
            continue;
        };
        for (part, seen) in [(0.4, false), (5.0, true)] {
            // The softer a spring is, the more it shows.
            let size = if kind == "backlash" { part * size } else { size / part };
            let found = diagnose(&model, &logs(&[rotors.clone(), effect(&model, power, size)])).diagnosis;
            if kinds(&found).iter().any(|found| found == kind) != seen {
                wrong.push(format!("{kind} at {joint}, {size} {}: {:?}", power.unit, kinds(&found)));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
