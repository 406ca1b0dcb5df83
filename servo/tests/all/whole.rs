//! Effects of the whole arm: a body at its flange, and the zero of an encoder.

use crate::diagnosis::{ARM, against_given, logs, model, of, of_each, one, told};
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, Payload, Plant};
use gapscope_servo::schema::{Diagnosis, Estimate, Parameter};
use gapscope_servo::{Given, Param, diagnose, evaluate};

/// The mass of the body that is the first effect, kg.
fn mass(diagnosis: &Diagnosis) -> &Estimate {
    let Some(Parameter::Single(mass)) = diagnosis.effects[0].parameters.get("mass") else { panic!("a mass") };
    mass
}

#[test]
fn a_body_at_the_flange_is_found_against_a_given_servo() {
    let model = model();
    let body = Effect::Payload(Payload { joint: "b".into(), mass: 0.12, com: [0.01, 0.0, 0.1], inertia: [0.0; 6] });
    let loaded = Plant::new(&model, std::slice::from_ref(&body), 1e-3).unwrap().model().clone();
    let logs = logs(&loaded, [6.0, 3.0], |_| {});
    let text = "[joint.a]\nstiffness = 6\ndamping = 0.36\n[joint.b]\nstiffness = 3\ndamping = 0.18\n";
    let given = Given::from_toml(text, &["a".to_owned(), "b".to_owned()]).unwrap();
    let outcome = diagnose(&model, &logs, &given, Vec::new(), &|_, _| {}).unwrap();
    let kinds: Vec<&str> = outcome.diagnosis.effects.iter().map(|effect| effect.kind.as_str()).collect();
    assert_eq!(kinds, ["payload"]);
    let mass = mass(&outcome.diagnosis);
    assert!((mass.value / 0.12 - 1.0).abs() < 0.1, "{mass:?}");
    // The corrected arm carries it to other logs.
    let (evaluation, _) = evaluate(&model, &logs, &given, Some(&outcome.corrected)).unwrap();
    assert!(evaluation.shrink.unwrap().position.shrink.unwrap() > 0.9);
}

/// What is found of a joint alone that carries a body of 80 g, has a bias, and pushes no harder than at this error, rad.
fn of_one_with_a_body(stiffness: f64, limit: f64) -> Diagnosis {
    let model = one();
    let body = Effect::Payload(Payload { joint: "a".into(), mass: 0.08, com: [-0.05, 0.05, 0.11], inertia: [0.0; 6] });
    let loaded = Plant::new(&model, std::slice::from_ref(&body), 1e-3).unwrap().model().clone();
    let logs = of_each(&loaded, &[stiffness], |_, law| (law[Param::Bias], law[Param::Limit]) = (0.03, limit));
    let text = format!("[joint.a]\nstiffness = 3\ndamping = {}\n", 0.06 * stiffness);
    let given = Given::from_toml(&text, &["a".to_owned()]).unwrap();
    diagnose(&model, &logs, &given, Vec::new(), &|_, _| {}).unwrap().diagnosis
}

/// A joint alone tells a body's moment and what it turns by, its mass by little.
#[test]
fn a_body_on_a_single_joint_is_found_beside_another_gain_a_bias_and_a_limit() {
    let diagnosis = of_one_with_a_body(2.2, 0.4);
    let mut kinds: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["payload", "servo_gain_error", "torque_bias", "torque_saturation"]);
    let mass = mass(&diagnosis);
    assert!((mass.value / 0.08 - 1.0).abs() < 0.1, "{mass:?}");
}

/// Held against what lasts before anybody looks for a body, no kind of the joint stands, and without them no body shows.
#[test]
fn a_body_on_a_single_joint_is_looked_for_before_its_kinds_are_held_against_what_lasts() {
    let diagnosis = of_one_with_a_body(2.5, 10.0);
    assert!(diagnosis.effects.iter().any(|effect| effect.kind == "payload"), "{:?}", diagnosis.effects);
    assert_eq!(diagnosis.verdict, "explained");
}

/// What is found of an arm that carries 50 g under drives that brake a third as much as given, and answer so late, s, as is given to
/// be none.
fn of_an_arm_that_swings(latency: f64) -> Diagnosis {
    let model = model();
    let body = Effect::Payload(Payload { joint: "b".into(), mass: 0.05, com: [-0.03, 0.015, 0.1], inertia: [0.0; 6] });
    let loaded = Plant::new(&model, std::slice::from_ref(&body), 1e-3).unwrap().model().clone();
    let logs = logs(&loaded, [6.0, 3.0], |law| (law[Param::Damping], law[Param::Latency]) = (0.02, latency));
    let text = "latency = 0\n[joint.a]\nstiffness = 6\ndamping = 0.36\n[joint.b]\nstiffness = 3\ndamping = 0.18\n";
    let given = Given::from_toml(text, &["a".to_owned(), "b".to_owned()]).unwrap();
    diagnose(&model, &logs, &given, Vec::new(), &|_, _| {}).unwrap().diagnosis
}

/// Joints that swing jolt each other: beside what was measured of these jolts, an offset or a play took the place of the body.
#[test]
fn a_body_is_found_where_joints_jolt_each_other() {
    let both = ["a".to_owned(), "b".to_owned()];
    let diagnosis = of_an_arm_that_swings(0.0);
    assert_eq!(told(&diagnosis), [("payload", &both[1..]), ("servo_damping_error", &both[..])]);
    let mass = mass(&diagnosis);
    assert!((mass.value / 0.05 - 1.0).abs() < 0.02, "{mass:?}");
}

/// What joints have was found beside a body: chosen anew from nothing on they had a play again.
#[test]
fn what_joints_have_beside_a_body_is_where_a_choice_begins() {
    let both = ["a".to_owned(), "b".to_owned()];
    let told = of_an_arm_that_swings(0.034);
    let kinds: Vec<&str> = told.effects.iter().map(|effect| effect.kind.as_str()).collect();
    assert_eq!(kinds, ["payload", "servo_damping_error", "actuation_delay"]);
    assert!(told.effects[1..].iter().all(|effect| effect.joints == both));
}

#[test]
fn what_a_body_turns_about_itself_is_no_rotor() {
    let model = model();
    // A ball of 6 cm.
    let own = 0.4 * 0.1 * 0.06 * 0.06;
    let inertia = [own, 0.0, own, 0.0, 0.0, own];
    let body = Effect::Payload(Payload { joint: "b".into(), mass: 0.1, com: [0.01, 0.0, 0.05], inertia });
    let loaded = Plant::new(&model, std::slice::from_ref(&body), 1e-3).unwrap().model().clone();
    let diagnosis = against_given(&model, &loaded, |_, _| {}).diagnosis;
    let kinds: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.kind.as_str()).collect();
    assert_eq!(kinds, ["payload"]);
    let mass = mass(&diagnosis);
    assert!((mass.value / 0.1 - 1.0).abs() < 0.1, "{mass:?}");
}

#[test]
fn an_encoder_zero_that_is_off_is_told_of_its_joint_alone() {
    // All links behind the joint hang elsewhere, so that the joint behind it feels an offset too.
    let hand = r#"<link name="hand"><inertial><origin xyz="0 0 0.04"/><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="c" type="revolute"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5" velocity="9"/></joint>
</robot>"#;
    let model = Model::from_urdf(&ARM.replace("</robot>", hand)).unwrap().model;
    let logs = of_each(&model, &[9.0, 5.0, 3.0], |j, law| {
        if j == 1 {
            law[Param::Offset] = -0.08;
        }
    });
    let diagnosis = diagnose(&model, &logs, &Given::default(), Vec::new(), &|_, _| {}).unwrap().diagnosis;
    assert_eq!(told(&diagnosis), [("joint_zero_offset", &["b".to_owned()][..])]);
    let found = of(&diagnosis, "joint_zero_offset", "offset", "b");
    assert!((found + 0.08).abs() < 0.004, "{found}");
}

/// An arm whose axes stand across, and its last along the link, with a hand behind it or none; every centre of mass lies beside
/// its axis.
fn with_a_wrist(hand: bool) -> Model {
    let link = |name: &str, parent: &str, at: f64, axis: &str, [x, y, z]: [f64; 3], mass: f64| {
        format!(
            r#"<link name="{name}l"><inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/><inertia ixx="1e-4" iyy="1e-4" izz="2e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{name}l"/><origin xyz="0 0 {at}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="5" velocity="9"/></joint>"#
        )
    };
    let (across, along) = ("0 1 0", "0 0 1");
    let links = [
        link("a", "base", 0.0, along, [0.01, -0.003, 0.06], 0.14),
        link("b", "al", 0.11, across, [0.01, 0.006, 0.04], 0.14),
        link("c", "bl", 0.09, across, [0.004, 0.001, 0.04], 0.13),
        link("d", "cl", 0.08, along, [-0.006, -0.012, 0.045], 0.08),
        link("e", "dl", 0.09, across, [-0.004, -0.014, 0.041], 0.09),
    ];
    let links = if hand { &links[..] } else { &links[..4] };
    let text = format!(r#"<robot name="wrist"><link name="base"/>{}</robot>"#, links.join("\n"));
    Model::from_urdf(&text).unwrap().model
}

/// Each joint alone is turned as far as the zero before it is off, and a tilted base or a body would turn all of them a little.
#[test]
fn one_zero_stands_for_what_all_joints_behind_it_have() {
    let model = with_a_wrist(true);
    let stiffness = [7.6, 14.6, 4.6, 0.44, 0.64];
    let names: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let servo = |(name, k): (&String, f64)| format!("[joint.{name}]\nstiffness = {k}\ndamping = {}\n", 0.06 * k);
    let text: String = names.iter().zip(stiffness).map(servo).collect();
    for (given, offset) in [(Given::from_toml(&text, &names).unwrap(), -0.2), (Given::default(), 0.15)] {
        let logs = of_each(&model, &stiffness, |j, law| {
            law[Param::Latency] = -0.002;
            if j == 1 {
                law[Param::Offset] = offset;
            }
        });
        // One log is enough, and half of the time.
        let diagnosis = diagnose(&model, &logs[..1], &given, Vec::new(), &|_, _| {}).unwrap().diagnosis;
        assert_eq!(told(&diagnosis), [("joint_zero_offset", &["b".to_owned()][..])]);
        let found = of(&diagnosis, "joint_zero_offset", "offset", "b");
        assert!((found - offset).abs() < 0.004, "{found}");
    }
}

/// Before anybody looks for a body, all that joints have of their own is held against an error that the body makes.
#[test]
fn a_body_at_a_wrist_is_found_without_a_given_servo() {
    let model = with_a_wrist(false);
    let body =
        Effect::Payload(Payload { joint: "d".into(), mass: 0.06, com: [-0.044, -0.041, 0.12], inertia: [0.0; 6] });
    let loaded = Plant::new(&model, std::slice::from_ref(&body), 1e-3).unwrap().model().clone();
    let logs = of_each(&loaded, &[0.7, 3.6, 3.2, 0.1], |_, _| {});
    let diagnosis = diagnose(&model, &logs, &Given::default(), Vec::new(), &|_, _| {}).unwrap().diagnosis;
    assert_eq!(told(&diagnosis), [("payload", &["d".to_owned()][..])]);
    assert_eq!(diagnosis.verdict, "explained");
    // A drive of twice the stiffness would carry twice the body nearly as well: the two are found together.
    let mass = mass(&diagnosis);
    let [Some(low), Some(high)] = mass.ci95 else { panic!("an interval") };
    assert!((mass.value / 0.06 - 1.0).abs() < 0.05 && low < 0.06 && high > 0.06, "{mass:?}");
}
