//! `corrected.json`: what is written comes back to the bit, and what is damaged gives an error that helps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gapscope_diagnosis::{Corrected, CorrectedError, EncoderSide, MODEL_SCHEMA};
use gapscope_dynamics::{Model, robots};
use gapscope_effects::{
    ActuationDelay, ActuatorLag, Armature, Backlash, CoulombFriction, Effect, ExternalContact, GravityMisalignment,
    JointCoupling, JointElasticity, JointZeroOffset, Kind, LinkInertiaError, LoadDependentFriction, ParallelSpring,
    Payload, Plant, PreslidingFriction, StribeckFriction, ThermalDrift, TorqueBias, TorqueGainError, TorqueRipple,
    TorqueSaturation, ViscousFriction,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use std::collections::BTreeMap;

fn arm6() -> Model {
    robots::model("arm6").unwrap().unwrap().model
}

/// A model with every effect of the catalogue, all numbers with full mantissas.
fn sample(model: &Model, seed: u64) -> Corrected {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut number = move || random.random_range(0.1..2.0_f64) / 3.0;
    let mut map = || -> BTreeMap<String, f64> { model.joints().iter().map(|j| (j.name.clone(), number())).collect() };
    let (weights, standstill) = (map(), map());
    let body = Payload { joint: "joint6".into(), mass: 1.0 / 3.0, com: [0.1 / 3.0; 3], inertia: [1e-3 / 7.0; 6] };
    let coupling = JointCoupling {
        joints: ["joint5".into(), "joint6".into()],
        ratio: -1.0,
        coulomb: 0.1 + 0.2,
        viscous: 5e-324,
        armature: 0.0,
    };
    let link = LinkInertiaError {
        joint: "joint3".into(),
        mass_delta: 0.2 / 3.0,
        first_moment_delta: [1e-2 / 3.0, -1e-2 / 7.0, 0.0],
        inertia_delta: [1e-3 / 7.0; 6],
    };
    let effects = vec![
        Effect::ViscousFriction(ViscousFriction { viscous: map() }),
        Effect::CoulombFriction(CoulombFriction { coulomb: map() }),
        Effect::Armature(Armature { armature: map() }),
        Effect::TorqueBias(TorqueBias { bias: map().into_iter().map(|(j, b)| (j, -b)).collect() }),
        Effect::TorqueGainError(TorqueGainError { gain: map() }),
        Effect::ParallelSpring(ParallelSpring { stiffness: map(), rest_position: map() }),
        Effect::Payload(body),
        Effect::GravityMisalignment(GravityMisalignment { roll: 0.1 / 3.0, pitch: -0.0 }),
        Effect::JointCoupling(coupling),
        Effect::LinkInertiaError(link),
        Effect::StribeckFriction(StribeckFriction {
            coulomb: map(),
            r#static: map().into_iter().map(|(j, s)| (j, s + 1.0)).collect(),
            stribeck_velocity: map(),
        }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: map() }),
        Effect::PreslidingFriction(PreslidingFriction { coulomb: map(), bristle_stiffness: map() }),
        Effect::ThermalDrift(ThermalDrift { coulomb: map(), ratio: map(), time_constant: map() }),
        Effect::ActuationDelay(ActuationDelay { delay: 1e-2 / 3.0 }),
        Effect::ActuatorLag(ActuatorLag { time_constant: 1e-2 / 7.0 }),
        Effect::TorqueSaturation(TorqueSaturation { limit: map() }),
        Effect::TorqueRipple(TorqueRipple { amplitude: map(), cycles: map(), phase: map() }),
        Effect::JointElasticity(JointElasticity { stiffness: map(), damping: map() }),
        Effect::Backlash(Backlash { gap: map() }),
        Effect::JointZeroOffset(JointZeroOffset { offset: map() }),
        Effect::ExternalContact(ExternalContact {
            link: "joint6".into(),
            intervals: vec![[0.1, 0.7 / 3.0], [1.0, 2.0]],
            force: [20.0 / 3.0, -0.0, 1.0],
            offset: [0.01, 0.0, -0.02],
        }),
    ];
    Corrected {
        schema: MODEL_SCHEMA.into(),
        robot: "a robot \"with\" quotes, ünïcode\nand lines".into(),
        weights,
        standstill,
        band: 10.0 / 3.0,
        encoder_side: EncoderSide::Link,
        alignment: -1e-3 / 7.0,
        effects,
        made_from: None,
    }
}

/// The sample as a JSON tree to damage.
fn tree() -> Value {
    serde_json::from_str(&sample(&arm6(), 1).to_json().unwrap()).unwrap()
}

fn read(value: &Value) -> Result<Corrected, CorrectedError> {
    Corrected::from_json(&value.to_string(), &arm6())
}

#[track_caller]
fn assert_error_names(value: &Value, words: &[&str]) {
    let text = read(value).expect_err("a damaged file").to_string();
    for word in words {
        assert!(text.contains(word), "the error does not say `{word}`: {text}");
    }
}

#[test]
fn what_was_written_comes_back_to_the_bit() {
    let model = arm6();
    for seed in 0..20 {
        let corrected = sample(&model, seed);
        let text = corrected.to_json().unwrap();
        let back = Corrected::from_json(&text, &model).unwrap();
        assert_eq!(back, corrected);
        assert_eq!(back.to_json().unwrap(), text, "bytes, so signs of zero and last bits too");
        for (a, b) in back.weights.values().zip(corrected.weights.values()) {
            assert_eq!(a.to_bits(), b.to_bits());
        }
    }
}

#[test]
fn the_sample_has_every_kind_of_effect() {
    let mut kinds: Vec<Kind> = sample(&arm6(), 1).effects.iter().map(Effect::kind).collect();
    kinds.sort();
    let mut all = Kind::ALL.to_vec();
    all.sort();
    assert_eq!(kinds, all);
}

#[test]
fn the_file_has_the_fields_of_its_schema() {
    let tree = tree();
    let fields: Vec<&str> = tree.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = ["alignment", "band", "effects", "encoder_side", "robot", "schema", "standstill", "weights"];
    assert_eq!(
        {
            let mut f = fields;
            f.sort_unstable();
            f
        },
        expected
    );
    assert_eq!(tree["schema"], "gapscope.model/1");
    assert_eq!(tree["encoder_side"], "link");
}

#[test]
fn the_encoder_may_sit_on_the_motors_side() {
    let mut tree = tree();
    tree["encoder_side"] = json!("motor");
    assert_eq!(read(&tree).unwrap().encoder_side, EncoderSide::Motor);
}

#[test]
fn another_schema_is_named_with_the_one_expected() {
    for schema in ["gapscope.model/2", "gapscope.diagnosis/1", ""] {
        let mut tree = tree();
        tree["schema"] = json!(schema);
        assert_error_names(&tree, &[schema, "gapscope.model/1", "diagnose"]);
    }
}

#[test]
fn a_missing_field_is_named() {
    for field in tree().as_object().unwrap().keys() {
        let mut tree = tree();
        tree.as_object_mut().unwrap().remove(field);
        assert_error_names(&tree, &[field, "corrected.json"]);
    }
}

#[test]
fn an_unknown_field_is_named() {
    let mut tree = tree();
    tree["wieghts"] = json!({});
    assert_error_names(&tree, &["wieghts"]);
}

/// A misspelt parameter of an effect must not be passed over: the model would silently be another one.
#[test]
fn an_unknown_field_of_an_effect_is_named() {
    let count = tree()["effects"].as_array().unwrap().len();
    for i in 0..count {
        let mut tree = tree();
        tree["effects"][i]["surplus"] = json!(1.0);
        assert_error_names(&tree, &["surplus"]);
    }
}

#[test]
fn joints_that_the_robot_does_not_have_are_named_with_those_it_has() {
    for field in ["weights", "standstill"] {
        let mut renamed = tree();
        let map = renamed[field].as_object_mut().unwrap();
        let value = map.remove("joint3").unwrap();
        map.insert("elbow".into(), value);
        assert_error_names(&renamed, &["elbow", "joint3"]);
        let mut less = tree();
        less[field].as_object_mut().unwrap().remove("joint3");
        assert_error_names(&less, &["joint3"]);
        let mut more = tree();
        more[field]["joint7"] = json!(1.0);
        assert_error_names(&more, &["joint7"]);
    }
}

#[test]
fn an_effect_on_an_unknown_joint_is_named() {
    for (i, field) in [(0, "viscous"), (1, "coulomb"), (2, "armature"), (3, "bias"), (4, "gain"), (5, "stiffness")] {
        let mut tree = tree();
        tree["effects"][i][field]["elbow"] = json!(0.5);
        let kind = tree["effects"][i]["kind"].as_str().unwrap().to_owned();
        assert_error_names(&tree, &["elbow", "joint1", &kind]);
    }
    let mut payload = tree();
    payload["effects"][6]["joint"] = json!("flange");
    assert_error_names(&payload, &["flange", "payload"]);
    let mut link = tree();
    link["effects"][9]["joint"] = json!("forearm");
    assert_error_names(&link, &["forearm", "link_inertia_error"]);
    let mut coupling = tree();
    coupling["effects"][8]["joints"] = json!(["joint5", "joint9"]);
    assert_error_names(&coupling, &["joint9", "joint_coupling"]);
}

#[test]
fn numbers_that_cannot_be_are_named_with_their_field() {
    for field in ["weights", "standstill"] {
        let mut tree = tree();
        tree[field]["joint2"] = json!(-0.5);
        assert_error_names(&tree, &[field, "joint2", "-0.5"]);
    }
    for (field, value) in [("band", -1.0), ("band", 0.0), ("alignment", 3.0), ("alignment", -1.0)] {
        let mut tree = tree();
        tree[field] = json!(value);
        assert_error_names(&tree, &[field, &value.to_string()]);
    }
    for (i, field, value) in [(2, "armature", -0.1), (4, "gain", 0.0), (4, "gain", -1.0), (5, "stiffness", -2.0)] {
        let mut tree = tree();
        tree["effects"][i][field]["joint2"] = json!(value);
        assert_error_names(&tree, &[field, &value.to_string()]);
    }
    for (i, field, value) in [
        (7, "roll", 4.0),
        (7, "pitch", -4.0),
        (8, "ratio", 0.0),
        (8, "coulomb", -0.1),
        (8, "viscous", -0.1),
        (8, "armature", -0.1),
    ] {
        let mut tree = tree();
        tree["effects"][i][field] = json!(value);
        assert_error_names(&tree, &[field, &value.to_string()]);
    }
}

/// JSON has no NaN: serde writes null for it, other tools write the bare word, and some write 1e999.
#[test]
fn what_is_not_a_number_is_an_error() {
    let model = arm6();
    let text = sample(&model, 1).to_json().unwrap();
    let number = sample(&model, 1).band.to_string();
    assert_eq!(text.matches(&number).count(), 1);
    for word in ["NaN", "nan", "null", "Infinity", "-Infinity", "1e999", "-1e999", "\"10\"", "true", "[]", "{}", ""] {
        Corrected::from_json(&text.replace(&number, word), &model).expect_err(word);
    }
    let nan = Corrected { band: f64::NAN, ..sample(&model, 1) };
    if let Ok(text) = nan.to_json() {
        Corrected::from_json(&text, &model).unwrap_err();
    }
}

/// Every place in the file that holds a number or a text, as a JSON pointer.
fn leaves(value: &Value, at: String, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            map.iter().for_each(|(key, value)| {
                leaves(value, format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")), out)
            });
        }
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| leaves(value, format!("{at}/{i}"), out)),
        _ => out.push(at),
    }
}

/// A value of another type, anywhere, is an error that says where: the field's name, or its line.
#[test]
fn a_value_of_another_type_is_an_error_that_says_where() {
    let mut all = Vec::new();
    leaves(&tree(), String::new(), &mut all);
    assert!(all.len() > 60);
    for at in &all {
        for wrong in [json!(null), json!(true), json!([[]]), json!({"a": "b"})] {
            let mut tree = tree();
            *tree.pointer_mut(at).unwrap() = wrong.clone();
            let pretty = serde_json::to_string_pretty(&tree).unwrap();
            let error = Corrected::from_json(&pretty, &arm6()).expect_err(&format!("{at} = {wrong}"));
            let text = error.to_string();
            let named = at.split('/').any(|part| part.len() > 2 && part != "effects" && text.contains(part));
            assert!(named || text.contains("line "), "{at} = {wrong}: {text}");
        }
    }
}

/// Whatever is read can be used and written again.
fn use_it(corrected: &Corrected, model: &Model) {
    let text = corrected.to_json().unwrap();
    assert_eq!(Corrected::from_json(&text, model).unwrap().to_json().unwrap(), text);
    let mut plant = Plant::new(model, &corrected.effects, 1e-3).unwrap();
    let n = model.dof();
    let mut rest = vec![0.0; n];
    plant.residual(&vec![0.1; n], &vec![0.2; n], &vec![0.3; n], &vec![1.0; n], &vec![0.1; n], &mut rest);
}

#[test]
fn no_damage_to_the_bytes_panics() {
    let model = arm6();
    let text = sample(&model, 3).to_json().unwrap().into_bytes();
    let mut random = Pcg64::seed_from_u64(99);
    let mut accepted = 0;
    let pool = b"0123456789eE+-.,:[]{}\"\\ntrufals \xff\x00";
    for _ in 0..4000 {
        let mut bytes = text.clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes[at] = pool[random.random_range(0..pool.len())],
                2 => drop(bytes.remove(at)),
                _ => bytes.insert(at, pool[random.random_range(0..pool.len())]),
            }
        }
        if let Ok(corrected) = Corrected::from_json(&String::from_utf8_lossy(&bytes), &model) {
            use_it(&corrected, &model);
            accepted += 1;
        }
    }
    assert!((1..3900).contains(&accepted), "{accepted} of 4000 damaged files are still files");
}

#[test]
fn a_truncated_file_is_an_error() {
    let model = arm6();
    let text = sample(&model, 3).to_json().unwrap();
    let end = text.trim_end().len();
    for cut in (0..end).filter(|&cut| text.is_char_boundary(cut)).step_by(7).chain([end - 1]) {
        let error = Corrected::from_json(&text[..cut], &model).expect_err("a truncated file").to_string();
        assert!(error.contains("corrected.json"), "{error}");
    }
}

/// Numbers swapped for wild ones: read and usable, or refused; nothing in between.
#[test]
fn wild_numbers_are_refused_or_usable() {
    let model = arm6();
    let mut all = Vec::new();
    leaves(&tree(), String::new(), &mut all);
    let mut random = Pcg64::seed_from_u64(7);
    let wild = [0.0, -0.0, 1e-320, -1e-9, 1e300, -1e300, f64::MAX, f64::MIN, 1e18, 0.5];
    for _ in 0..1500 {
        let mut tree = tree();
        for _ in 0..random.random_range(1..4) {
            let at = &all[random.random_range(0..all.len())];
            let leaf = tree.pointer_mut(at).unwrap();
            if leaf.is_number() {
                *leaf = json!(wild[random.random_range(0..wild.len())]);
            }
        }
        if let Ok(corrected) = read(&tree) {
            use_it(&corrected, &model);
        }
    }
}

#[test]
fn a_file_of_another_robot_is_refused() {
    let text = sample(&arm6(), 1).to_json().unwrap();
    let other = robots::model("arm7").unwrap().unwrap().model;
    let error = Corrected::from_json(&text, &other).unwrap_err().to_string();
    assert!(error.contains("joint7") && error.contains("URDF"), "{error}");
}

#[test]
fn deep_nesting_is_an_error_and_no_overflow() {
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    Corrected::from_json(&deep, &arm6()).unwrap_err();
    let deep = format!("{{\"effects\": {deep}}}");
    Corrected::from_json(&deep, &arm6()).unwrap_err();
}
