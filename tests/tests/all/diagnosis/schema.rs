//! The diagnosis as the specification has it.

use super::*;

/// Every key of `expected` is there; `more` names those that the schema adds to the specification.
#[track_caller]
fn assert_keys(value: &Value, expected: &[&str], more: &[&str]) {
    let mut all: Vec<&str> = expected.iter().chain(more).copied().collect();
    all.sort_unstable();
    assert_eq!(keys(value), all);
}

fn assert_change(value: &Value, more: &[&str]) {
    assert_keys(value, &["before", "after", "shrink", "ci95"], more);
    assert!(value["before"].is_f64() && value["after"].is_f64());
    assert!(value["shrink"].is_null() || value["shrink"].is_f64());
    assert!(value["ci95"].is_null() || value["ci95"].as_array().unwrap().len() == 2);
}

#[test]
fn the_diagnosis_has_the_fields_of_its_specification() {
    let model = robot("arm6");
    let outcome = found(&model, &with_payload());
    let text = serde_json::to_string_pretty(&outcome.diagnosis).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_keys(
        &json,
        &[
            "schema",
            "robot",
            "joints",
            "data",
            "verdict",
            "gap",
            "effects",
            "combinations",
            "alternatives",
            "unexplained",
            "shrink",
            "next_experiment",
        ],
        &["power", "why", "covariance"],
    );
    assert_eq!((&json["schema"], &json["robot"]), (&"gapscope.diagnosis/1".into(), &"arm6".into()));
    assert_eq!(json["verdict"], "explained");
    let joints: Vec<&str> = json["joints"].as_array().unwrap().iter().map(|j| j.as_str().unwrap()).collect();
    assert_eq!(joints, ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6"]);

    assert_keys(&json["data"], &["episodes", "samples", "duration", "rate", "findings"], &["band"]);
    assert_eq!((&json["data"]["episodes"], &json["data"]["samples"]), (&3.into(), &6000.into()));

    let gap = &json["gap"];
    assert_keys(gap, &["torque", "one_step", "rollout", "regimes"], &[]);
    assert_keys(&gap["torque"], &["rms", "floor"], &["ci95"]);
    assert_keys(&gap["one_step"], &["position", "velocity"], &[]);
    for of_joints in
        [&gap["torque"]["rms"], &gap["torque"]["floor"], &gap["one_step"]["position"], &gap["one_step"]["velocity"]]
    {
        assert_eq!(keys(of_joints), joints);
    }
    for entry in gap["rollout"].as_array().unwrap() {
        assert_keys(entry, &["horizon", "position"], &[]);
        assert_eq!(keys(&entry["position"]), joints);
    }
    assert!(!gap["rollout"].as_array().unwrap().is_empty());
    let known = [
        "standstill",
        "reversal",
        "low_speed",
        "high_speed",
        "high_load",
        "high_acceleration",
        "pose",
        "frequency_band",
        "time",
    ];
    let regimes = [gap["regimes"].as_array().unwrap(), json["unexplained"]["regimes"].as_array().unwrap()];
    assert!(!regimes[0].is_empty());
    for regime in regimes.into_iter().flatten() {
        assert_keys(regime, &["joint", "regime", "bounds", "share", "ci95"], &["samples"]);
        assert!(known.contains(&regime["regime"].as_str().unwrap()), "{regime}");
        assert!(joints.contains(&regime["joint"].as_str().unwrap()));
        assert_keys(&regime["bounds"], &["quantity", "unit", "interval"], &[]);
        assert!((0.0..=1.0).contains(&regime["share"].as_f64().unwrap()), "{regime}");
    }

    let effects = json["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 3);
    for effect in effects {
        assert_keys(
            effect,
            &["kind", "joints", "part", "confidence", "parameters", "indistinguishable_from", "shrink"],
            &[],
        );
        assert_keys(&effect["shrink"], &["torque"], &["ci95"]);
        let calibration = ["viscous_friction", "coulomb_friction", "link_inertia_error", "armature", "torque_bias"];
        let part = if calibration.contains(&effect["kind"].as_str().unwrap()) { "calibration" } else { "further" };
        assert_eq!(effect["part"], part);
        assert!((0.0..=1.0).contains(&effect["confidence"].as_f64().unwrap()));
    }
    let of = |kind: &str| effects.iter().find(|e| e["kind"] == kind).unwrap();
    assert_keys(&of("viscous_friction")["parameters"], &["viscous"], &[]);
    assert_keys(&of("viscous_friction")["parameters"]["viscous"], &["joint2"], &[]);
    assert_keys(&of("viscous_friction")["parameters"]["viscous"]["joint2"], &["value", "ci95", "unit"], &[]);
    assert_keys(&of("coulomb_friction")["parameters"]["coulomb"]["joint3"], &["value", "ci95", "unit"], &[]);
    let body = &of("payload")["parameters"];
    assert_keys(body, &["mass", "com", "inertia"], &[]);
    assert_keys(&body["mass"], &["value", "ci95", "unit"], &[]);
    assert!(body["mass"]["value"].is_f64() && body["mass"]["ci95"][0].is_f64());
    for (name, length) in [("com", 3), ("inertia", 6)] {
        assert_eq!(body[name]["value"].as_array().unwrap().len(), length);
        assert_eq!(body[name]["ci95"][1].as_array().unwrap().len(), length);
    }

    for alternative in json["alternatives"].as_array().unwrap() {
        assert_keys(alternative, &["effects", "probability"], &[]);
    }
    assert_keys(&json["unexplained"], &["fraction", "regimes"], &["learnable", "resembles"]);
    assert!((0.0..=1.0).contains(&json["unexplained"]["learnable"].as_f64().unwrap()));
    assert_keys(&json["shrink"], &["torque", "one_step", "rollout", "reference"], &[]);
    assert_change(&json["shrink"]["torque"], &[]);
    assert_change(&json["shrink"]["one_step"], &[]);
    json["shrink"]["rollout"].as_array().unwrap().iter().for_each(|change| assert_change(change, &["horizon"]));
    assert_keys(&json["shrink"]["reference"], &["noise_floor", "residual_network", "pure_network"], &[]);
    assert!(
        json["next_experiment"].is_null()
            || keys(&json["next_experiment"]) == ["motion", "separates", "separation", "trajectory", "why"]
    );

    for power in json["power"].as_array().unwrap() {
        assert_keys(power, &["kind", "joints", "parameter", "size", "unit"], &[]);
    }
    assert!(["residual_network", "pure_network"].iter().all(|name| json["shrink"]["reference"][name].is_f64()));

    let back: Diagnosis = serde_json::from_str(&text).unwrap();
    assert_eq!(back, outcome.diagnosis, "read back to the bit");
}

/// The share of each joint's gap over a partition of its samples is the whole gap.
#[test]
fn shares_of_speed_regimes_do_not_exceed_the_gap() {
    let outcome = found(&robot("arm6"), &mixed());
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    for regime in outcome.diagnosis.gap.regimes.iter().filter(|r| r.regime == "time") {
        *sums.entry(&regime.joint).or_default() += regime.share;
    }
    assert!(!sums.is_empty());
    assert!(sums.values().all(|sum| *sum < 1.0 + 1e-9), "{sums:?}");
}
