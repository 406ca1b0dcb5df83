//! What is there is named, and nothing else.

use super::*;

#[test]
fn no_effect_is_no_gap() {
    for name in ["arm6", "arm7"] {
        let outcome = found(&robot(name), &[]);
        assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
        assert!(outcome.diagnosis.effects.is_empty() && outcome.corrected.effects.is_empty());
        assert!(outcome.diagnosis.next_experiment.is_none());
        assert_eq!(outcome.diagnosis.joints.len(), robot(name).dof());
    }
}

/// What a perfect model leaves is what the noise of the log gives: the floor says so within a factor of two.
#[test]
fn the_floor_is_what_a_perfect_model_leaves() {
    for name in ["arm6", "arm7"] {
        let torque = found(&robot(name), &[]).diagnosis.gap.torque;
        for (joint, rms) in &torque.rms {
            let ratio = torque.floor[joint] / rms;
            assert!((0.5..2.0).contains(&ratio), "{name} {joint}: floor {}, rms {rms}", torque.floor[joint]);
        }
    }
}

/// One test for each effect and robot, so that each can fail by itself.
macro_rules! alone {
    ($($test:ident: $robot:literal $effect:expr;)*) => {$(
        #[test]
        fn $test() {
            let truth = [$effect];
            assert_finds(&found(&robot($robot), &truth), &truth);
        }
    )*};
}

alone! {
    viscous_friction_on_one_joint: "arm6" viscous([("joint3", 6.0)]);
    viscous_friction_on_three_joints_of_seven: "arm7" viscous([("joint2", 6.0), ("joint4", 4.0), ("joint6", 1.5)]);
    coulomb_friction_on_one_joint: "arm6" coulomb([("joint2", 8.0)]);
    coulomb_friction_on_all_joints: "arm6" coulomb([("joint1", 6.0), ("joint2", 8.0), ("joint3", 5.0), ("joint4", 0.5), ("joint5", 0.3), ("joint6", 0.01)]);
    armature_on_two_joints: "arm6" armature([("joint3", 0.8), ("joint5", 0.3)]);
    armature_on_two_joints_of_seven: "arm7" armature([("joint4", 0.6), ("joint6", 0.2)]);
    gain_of_one_joint: "arm6" gain([("joint2", 0.85)]);
    bias_on_two_joints: "arm6" bias([("joint2", 5.0), ("joint4", -2.0)]);
    bias_on_one_joint_of_seven: "arm7" bias([("joint4", 4.0)]);
    spring_on_one_joint: "arm6" spring("joint3", 15.0, 0.4);
    payload_at_the_flange: "arm6" payload(1.5);
    tilted_base: "arm6" tilt();
    tilted_base_of_seven_joints: "arm7" tilt();
    coupling_on_the_sum_of_two_joints: "arm6" coupling(1.0);
    coupling_on_the_difference_of_two_joints: "arm6" coupling(-1.0);
    a_heavier_link: "arm6" Effect::LinkInertiaError(LinkInertiaError { joint: "joint3".into(), mass_delta: 2.0, first_moment_delta: [-0.5, 0.05, 0.1], inertia_delta: [0.05, 0.0, 0.2, 0.0, 0.0, 0.2] });
}

/// A load that is missing and a last link that is lighter are the same ten numbers.
#[test]
fn missing_mass_at_the_flange() {
    let inertia = [-1.2e-4, 0.0, -1.2e-4, 0.0, 0.0, -1.6e-4];
    let load = Payload { joint: "joint6".into(), mass: -0.25, com: [0.0, 0.0, -0.001], inertia };
    let diagnosis = found(&robot("arm6"), &[Effect::Payload(load)]).diagnosis;
    let [found] = diagnosis.effects.as_slice() else { panic!("{}", summary(&diagnosis)) };
    assert!(["payload", "link_inertia_error"].contains(&found.kind.as_str()), "{}", summary(&diagnosis));
    assert_eq!((diagnosis.verdict, found.joints.as_slice()), (Verdict::Explained, &["joint6".to_owned()][..]));
}

macro_rules! together {
    ($($test:ident: $robot:literal $($effect:expr),+;)*) => {$(
        #[test]
        fn $test() {
            let truth = [$($effect),+];
            assert_finds(&found(&robot($robot), &truth), &truth);
        }
    )*};
}

together! {
    viscous_and_coulomb_friction: "arm6" viscous([("joint2", 8.0), ("joint5", 1.5)]), coulomb([("joint3", 6.0)]);
    viscous_friction_and_payload: "arm6" viscous([("joint2", 8.0), ("joint4", 3.0)]), payload(2.0);
    coulomb_friction_and_spring: "arm6" coulomb([("joint2", 7.0)]), spring("joint4", 6.0, -0.5);
    armature_and_bias: "arm6" armature([("joint3", 1.0)]), bias([("joint2", 6.0)]);
    gain_and_viscous_friction_of_one_joint: "arm6" gain([("joint3", 0.8)]), viscous([("joint3", 8.0)]);
    gain_and_viscous_friction: "arm6" gain([("joint3", 1.15)]), viscous([("joint5", 2.0)]);
    tilt_and_coulomb_friction: "arm6" tilt(), coulomb([("joint3", 5.0), ("joint5", 2.0)]);
    coupling_and_viscous_friction: "arm6" coupling(1.0), viscous([("joint5", 1.0)]);
}

/// The strongest effect comes first.
#[test]
fn effects_are_in_the_order_of_what_they_explain() {
    let truth = [coulomb([("joint5", 0.8)]), viscous([("joint1", 20.0), ("joint2", 25.0), ("joint3", 15.0)])];
    let outcome = found(&robot("arm6"), &truth);
    let kinds: Vec<&str> = outcome.diagnosis.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["viscous_friction", "coulomb_friction"], "{}", summary(&outcome.diagnosis));
}

#[test]
fn a_standing_robot_is_not_excited() {
    let model = robot("arm6");
    let mut random = Pcg64::seed_from_u64(1);
    let samples = 2000;
    let mut normal = |size: f64| size * random.sample::<f64, _>(StandardNormal);
    let row =
        |at: f64, noise: f64, normal: &mut dyn FnMut(f64) -> f64| (0..samples).map(|_| at + normal(noise)).collect();
    let episode = Episode {
        name: "standing.csv".into(),
        joints: model.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..samples).map(|k| f64::from(k) / RATE).collect(),
        position: (0..6).map(|j| row(0.2 * f64::from(j), 1e-6, &mut normal)).collect(),
        effort: (0..6).map(|j| row(f64::from(j), 0.01, &mut normal)).collect(),
        ..Episode::default()
    };
    for episodes in
        [vec![episode.clone()], vec![episode.part(0, 30, "short")], vec![episode.part(0, 0, "empty")], vec![]]
    {
        let outcome = diagnose(&model, &episodes);
        assert_eq!(outcome.diagnosis.verdict, Verdict::NotExcited, "{}", summary(&outcome.diagnosis));
        assert!(outcome.diagnosis.effects.is_empty());
        assert!(outcome.diagnosis.next_experiment.is_some(), "it says what to log");
        // The files that go with it can be written and read.
        Corrected::from_json(&outcome.corrected.to_json().unwrap(), &model).unwrap();
        serde_json::to_string(&outcome.diagnosis).unwrap();
    }
}

/// A joint that stands is not blamed, and the others are told apart all the same.
#[test]
fn a_joint_that_stands_is_not_blamed() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0)])];
    let mut episodes = logs(&model, &truth);
    for episode in &mut episodes {
        let samples = episode.len();
        episode.position[5] = vec![0.3; samples];
    }
    let outcome = diagnose(&model, &episodes);
    assert!(outcome.diagnosis.effects.iter().all(|e| !e.joints.contains(&"joint6".to_owned())));
    assert!(
        outcome.diagnosis.data.findings.iter().any(|f| f.contains("joint6")),
        "{:?}",
        outcome.diagnosis.data.findings
    );
}

// An effect that the URDF has is no gap.

#[test]
fn friction_that_the_urdf_declares_is_no_gap() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0), ("joint5", 1.0)]), coulomb([("joint2", 5.0), ("joint4", 2.0)])];
    let mut joints = model.joints().to_vec();
    (joints[1].damping, joints[4].damping) = (8.0, 1.0);
    (joints[1].friction, joints[3].friction) = (5.0, 2.0);
    let declared = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let outcome = diagnose(&declared, &logs(&model, &truth));
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
    // Half of it declared: the other half is found, as what comes on top.
    let mut joints = model.joints().to_vec();
    joints[1].damping = 3.0;
    let half = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let outcome = diagnose(&half, &logs(&model, &[viscous([("joint2", 8.0)])]));
    assert_finds(&outcome, &[viscous([("joint2", 5.0)])]);
}

#[test]
fn a_payload_that_the_urdf_has_is_no_gap() {
    let model = robot("arm6");
    let Effect::Payload(body) = payload(1.5) else { panic!() };
    let loaded = model.clone().with_inertia(5, model.joints()[5].inertia.add(&body.link_inertia()));
    let outcome = diagnose(&loaded, &logs(&model, &[payload(1.5)]));
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
}

/// A known external effort is added to the logged one: the log of a biased robot that knows its bias has no gap.
#[test]
fn a_known_disturbance_is_no_gap() {
    let model = robot("arm6");
    let mut episodes = logs(&model, &[bias([("joint2", 6.0)])]);
    for episode in &mut episodes {
        let samples = episode.len();
        episode.disturbance = Some((0..6).map(|j| vec![if j == 1 { 6.0 } else { 0.0 }; samples]).collect());
    }
    let outcome = diagnose(&model, &episodes);
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
}

// Relations between diagnoses.
