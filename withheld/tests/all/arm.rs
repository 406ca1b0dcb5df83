//! Figures of used arms, on judgements made by hand.

use gapscope_dynamics::{Model, robots};
use gapscope_withheld::{Answer, CaseScore, Score, Truth, Used, impossible_bodies, judge, judge_arm};
use serde_json::{Value, json};

/// An arm with Coulomb friction, link errors and, perhaps, something further.
fn truth(further: Option<Value>) -> Truth {
    let mut effects = vec![
        json!({"kind": "coulomb_friction", "joints": [0, 1], "joint_names": ["a", "b"], "power": [50.0, 60.0], "fc": [1.0, 2.0], "part": "calibration"}),
        json!({"kind": "link_inertia_error", "joints": [0, 1], "joint_names": ["a", "b"], "power": [20.0, 20.0], "part": "calibration",
               "mass_delta": [0.1, -0.2], "first_moment_delta": [[0.0, 0.0, 0.01], [0.0, 0.02, 0.0]],
               "inertia_delta": [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]}),
    ];
    effects.extend(further);
    let kinds: Vec<Value> = effects.iter().map(|effect| effect["kind"].clone()).collect();
    let known = kinds.iter().all(|kind| !kind.as_str().unwrap().starts_with("unknown"));
    serde_json::from_value(json!({
        "robot": "arm", "seed": 1, "noise": [0.0, 0.0, 0.0], "kinds": kinds, "effects": effects, "known": known, "used": 1, "rate": 500, "motion": "moves",
    }))
    .unwrap()
}

fn ripple() -> Value {
    json!({"kind": "torque_ripple", "joints": [0, 1], "joint_names": ["a", "b"], "power": [9.0, 30.0], "amp": [0.1, 0.4], "part": "further"})
}

/// What is calibration, rightly named; the second link's mass is outside its interval, the first link's first moment inside all three.
fn calibration() -> Vec<Value> {
    let number = |value: f64| json!({"value": value, "ci95": [value - 0.05, value + 0.05], "unit": ""});
    let link = |joint: &str, mass: f64, from: [f64; 3], to: [f64; 3]| {
        json!({"kind": "link_inertia_error", "joints": [joint], "confidence": 0.9, "part": "calibration", "parameters": {
            "mass_delta": number(mass), "first_moment_delta": {"value": from, "ci95": [from, to], "unit": "kg m"}}})
    };
    vec![
        json!({"kind": "coulomb_friction", "joints": ["a", "b"], "confidence": 1.0, "part": "calibration",
               "parameters": {"coulomb": {"a": number(1.04), "b": number(2.2)}}}),
        link("a", 0.12, [-0.1, -0.1, 0.0], [0.1, 0.1, 0.02]),
        link("b", 0.1, [-0.1, 0.0, 0.01], [0.1, 0.01, 0.02]),
    ]
}

fn score(
    truth: &Truth,
    effects: Option<Vec<Value>>,
    verdict: &str,
    seconds: f64,
    impossible: Option<usize>,
) -> CaseScore {
    let answer: Option<Answer> =
        effects.map(|effects| serde_json::from_value(json!({"verdict": verdict, "effects": effects})).unwrap());
    let judgement = judge(truth, answer.as_ref(), None);
    let arm = judge_arm(truth, answer.as_ref(), &judgement, impossible);
    CaseScore::new(["bank", "case_000"], truth, judgement, seconds, None).on_arm(arm)
}

fn with(more: Value) -> Option<Vec<Value>> {
    Some([calibration(), vec![more]].concat())
}

#[test]
fn intervals_of_each_link_count_and_so_do_those_of_what_is_not_there() {
    let arm = score(&truth(None), Some(calibration()), "explained", 1.0, None).arm.unwrap();
    // Friction: one of two. Masses: one of two. First moments: three, and of the other link's, x alone.
    assert_eq!(arm.intervals, [6, 10]);
    let bias = |from: f64| {
        with(
            json!({"kind": "torque_bias", "joints": ["b"], "confidence": 0.6, "parameters": {"bias": {"b": {"value": 0.1, "ci95": [from, 0.2]}}}}),
        )
    };
    for (from, held) in [(-0.1, 7), (0.05, 6)] {
        let arm = score(&truth(None), bias(from), "explained", 1.0, None).arm.unwrap();
        assert_eq!(arm.intervals, [held, 11]);
    }
}

#[test]
fn the_further_effect_counts_on_the_joint_that_shows_it_best() {
    let sealed = ripple();
    let named = |joints: &[&str]| {
        let ripple = json!({"kind": "torque_ripple", "joints": joints, "confidence": 0.9, "part": "further"});
        score(&truth(Some(sealed.clone())), with(ripple), "explained", 1.0, None).arm.unwrap().further_named
    };
    assert_eq!((named(&["b"]), named(&["a", "b"]), named(&["a"])), (Some(true), Some(true), Some(false)));
    let missed = score(&truth(Some(ripple())), Some(calibration()), "explained", 1.0, None).arm.unwrap();
    assert_eq!((missed.further_named, missed.invented), (Some(false), 0));
    assert_eq!(score(&truth(None), None, "", 1.0, None).arm.unwrap().further_named, None);
}

#[test]
fn figures_of_a_bank_are_counted_with_what_they_are_of() {
    let lag = json!({"kind": "actuator_lag", "joints": [], "confidence": 0.7, "part": "further"});
    let tie = json!({"kind": "actuator_lag", "joints": [], "confidence": 0.7, "part": "further", "indistinguishable_from": ["torque_ripple"]});
    let right = json!({"kind": "torque_ripple", "joints": ["b"], "confidence": 0.9, "part": "further",
                       "parameters": {"amplitude": {"b": {"value": 0.5, "ci95": [0.3, 0.7]}}}});
    let hum =
        json!({"kind": "unknown_hum", "joints": [0], "joint_names": ["a"], "power": [40.0, 0.0], "part": "further"});
    let cases = vec![
        score(&truth(Some(ripple())), with(right), "explained", 1.0, Some(0)),
        score(&truth(Some(ripple())), with(tie), "explained", 2.0, Some(2)),
        score(&truth(Some(ripple())), None, "", 9.0, None),
        score(&truth(None), Some(calibration()), "explained", 3.0, Some(0)),
        score(&truth(None), with(lag), "partly_explained", 4.0, Some(0)),
        score(&truth(Some(hum)), Some(calibration()), "partly_explained", 5.0, Some(0)),
    ];
    let score = Score::new(cases);
    let [arms] = score.arms.as_slice() else { panic!("{:?}", score.arms) };
    let of = |rate: Option<gapscope_withheld::Rate>| rate.map(|rate| (rate.count, rate.of));
    assert_eq!((arms.used, arms.n), (Used::Little, 6));
    assert_eq!((of(arms.exact), of(arms.exact_or_tie)), (Some((2, 5)), Some((3, 5))));
    assert_eq!(of(arms.further_named), Some((1, 3)));
    assert_eq!(arms.invented.map(|m| (m.value, m.of)), Some((2.0 / 6.0, 6)));
    assert_eq!(of(arms.nothing_further), Some((1, 2)));
    assert_eq!((of(arms.unknown_flagged), of(arms.unknown_claimed)), (Some((1, 1)), Some((1, 5))));
    assert_eq!(of(arms.impossible), Some((1, 5)));
    assert_eq!((arms.seconds_median, arms.seconds_slowest), (Some(3.5), Some(9.0)));
    // 0.04 of 1 and 0.2 of 2, five times; a quarter of 0.4.
    assert!(arms.friction_error.is_some_and(|m| (m.value - 0.07).abs() < 1e-9 && m.of == 10));
    assert!(arms.further_error.is_some_and(|m| (m.value - 0.25).abs() < 1e-9 && m.of == 1));
    assert_eq!(arms.rotor_error, None);
    let [low, high] = arms.exact.unwrap().ci95;
    assert!(low > 0.1 && low < 0.4 && high > 0.4 && high < 0.8);
}

#[test]
fn a_bank_without_used_arms_says_nothing_of_them() {
    let mut old = truth(None);
    old.used = None;
    let json =
        serde_json::to_value(Score::new(vec![score(&old, Some(calibration()), "explained", 1.0, None)])).unwrap();
    assert!(json.get("arms").is_none() && json["cases"][0].get("arm").is_none());
}

#[test]
fn a_body_that_cannot_be_is_found_in_the_corrected_model() {
    let model = Model::from_urdf(robots::urdf("arm6").unwrap()).unwrap().model;
    let joint = &model.joints()[2];
    let error = |mass: f64, inertia: f64| {
        json!({"kind": "link_inertia_error", "joint": joint.name, "mass_delta": mass, "first_moment_delta": [0.0, 0.0, 0.0],
               "inertia_delta": [inertia, 0.0, 0.0, 0.0, 0.0, 0.0]})
    };
    let impossible = |effects: Vec<Value>| impossible_bodies(&model, &json!({"effects": effects}));
    assert_eq!(impossible(vec![]), Some(0));
    assert_eq!(impossible(vec![error(0.0, 0.0)]), Some(0));
    // An inertia about one axis that is more than those about the others together.
    let heavy = 10.0 * joint.inertia.rotational.x_axis.x.max(joint.inertia.rotational.y_axis.y);
    assert_eq!(impossible(vec![error(0.0, heavy)]), Some(1));
    assert_eq!(impossible_bodies(&model, &json!({})), None);
}
