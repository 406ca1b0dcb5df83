//! Effects as JSON: the public names of the catalogue, every bit kept, and errors where something is unknown.

use gapscope_effects::{
    Armature, CoulombFriction, Effect, GravityMisalignment, JointCoupling, Kind, LinkInertiaError, ParallelSpring,
    Payload, TorqueBias, TorqueGainError, ViscousFriction,
};
use proptest::collection::btree_map;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Every number that JSON can hold, subnormal and negative zero too.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        1 => -10.0..10.0f64,
    ]
}

/// Joint names of any sort: URDFs have blanks, dots and letters of all scripts.
fn joint() -> impl Strategy<Value = String> {
    prop_oneof!["joint[1-9]", "[a-z_./ -]{1,12}", any::<String>()]
}

fn by_joint() -> impl Strategy<Value = BTreeMap<String, f64>> {
    btree_map(joint(), number(), 0..5)
}

fn effect() -> impl Strategy<Value = Effect> {
    prop_oneof![
        by_joint().prop_map(|viscous| Effect::ViscousFriction(ViscousFriction { viscous })),
        by_joint().prop_map(|coulomb| Effect::CoulombFriction(CoulombFriction { coulomb })),
        by_joint().prop_map(|armature| Effect::Armature(Armature { armature })),
        by_joint().prop_map(|gain| Effect::TorqueGainError(TorqueGainError { gain })),
        by_joint().prop_map(|bias| Effect::TorqueBias(TorqueBias { bias })),
        (by_joint(), by_joint()).prop_map(|(stiffness, rest_position)| {
            Effect::ParallelSpring(ParallelSpring { stiffness, rest_position })
        }),
        (joint(), number(), prop::array::uniform3(number()), prop::array::uniform6(number()))
            .prop_map(|(joint, mass, com, inertia)| Effect::Payload(Payload { joint, mass, com, inertia })),
        (joint(), number(), prop::array::uniform3(number()), prop::array::uniform6(number())).prop_map(
            |(joint, mass_delta, first_moment_delta, inertia_delta)| {
                Effect::LinkInertiaError(LinkInertiaError { joint, mass_delta, first_moment_delta, inertia_delta })
            }
        ),
        (number(), number()).prop_map(|(roll, pitch)| Effect::GravityMisalignment(GravityMisalignment { roll, pitch })),
        (prop::array::uniform2(joint()), number(), number(), number(), number()).prop_map(
            |(joints, ratio, coulomb, viscous, armature)| {
                Effect::JointCoupling(JointCoupling { joints, ratio, coulomb, viscous, armature })
            }
        ),
    ]
}

/// All numbers of an effect as bits, by public name.
fn bits(effect: &Effect) -> Vec<(&'static str, Option<String>, Vec<u64>)> {
    let parameters = effect.law().parameters();
    parameters.into_iter().map(|p| (p.name, p.joint, p.value.iter().map(|x| x.to_bits()).collect())).collect()
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20_261_121),
        ..ProptestConfig::default()
    })]

    #[test]
    fn an_effect_comes_back_to_the_bit(effect in effect()) {
        for text in [serde_json::to_string(&effect).unwrap(), serde_json::to_string_pretty(&effect).unwrap()] {
            let back: Effect = serde_json::from_str(&text).unwrap();
            prop_assert_eq!(&back, &effect);
            prop_assert_eq!(bits(&back), bits(&effect), "{}", text);
        }
        let back: Effect = serde_json::from_value(serde_json::to_value(&effect).unwrap()).unwrap();
        prop_assert_eq!(bits(&back), bits(&effect));
    }

    /// No text makes the reader panic; what it accepts it also writes.
    #[test]
    fn a_damaged_effect_gives_an_error_or_an_effect(effect in effect(), cut in any::<prop::sample::Index>(), at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut text = serde_json::to_string(&effect).unwrap().into_bytes();
        let _ = serde_json::from_slice::<Effect>(&text[..cut.index(text.len())]).unwrap_err();
        let at = at.index(text.len());
        text[at] = byte;
        if let Ok(read) = serde_json::from_slice::<Effect>(&text) {
            let again: Effect = serde_json::from_str(&serde_json::to_string(&read).unwrap()).unwrap();
            prop_assert_eq!(bits(&again), bits(&read));
        }
    }
}

/// One effect of each kind on joints `a` and `b`, as the catalogue writes it.
fn written() -> Vec<(Kind, Effect, Value)> {
    let map = |a: f64, b: f64| -> BTreeMap<String, f64> { [("a".to_owned(), a), ("b".to_owned(), b)].into() };
    let body =
        Payload { joint: "b".into(), mass: 1.5, com: [0.01, 0.02, 0.03], inertia: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6] };
    let link = LinkInertiaError {
        joint: "a".into(),
        mass_delta: 0.25,
        first_moment_delta: [0.01, 0.02, 0.03],
        inertia_delta: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
    };
    let coupling =
        JointCoupling { joints: ["a".into(), "b".into()], ratio: -1.0, coulomb: 0.5, viscous: 0.25, armature: 0.125 };
    vec![
        (
            Kind::ViscousFriction,
            Effect::ViscousFriction(ViscousFriction { viscous: map(1.0, 2.0) }),
            json!({"kind": "viscous_friction", "viscous": {"a": 1.0, "b": 2.0}}),
        ),
        (
            Kind::CoulombFriction,
            Effect::CoulombFriction(CoulombFriction { coulomb: map(1.0, 2.0) }),
            json!({"kind": "coulomb_friction", "coulomb": {"a": 1.0, "b": 2.0}}),
        ),
        (
            Kind::Payload,
            Effect::Payload(body),
            json!({
                "kind": "payload", "joint": "b", "mass": 1.5,
                "com": [0.01, 0.02, 0.03], "inertia": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
            }),
        ),
        (
            Kind::LinkInertiaError,
            Effect::LinkInertiaError(link),
            json!({
                "kind": "link_inertia_error", "joint": "a", "mass_delta": 0.25,
                "first_moment_delta": [0.01, 0.02, 0.03], "inertia_delta": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
            }),
        ),
        (
            Kind::Armature,
            Effect::Armature(Armature { armature: map(1.0, 2.0) }),
            json!({"kind": "armature", "armature": {"a": 1.0, "b": 2.0}}),
        ),
        (
            Kind::GravityMisalignment,
            Effect::GravityMisalignment(GravityMisalignment { roll: 0.1, pitch: -0.2 }),
            json!({"kind": "gravity_misalignment", "roll": 0.1, "pitch": -0.2}),
        ),
        (
            Kind::TorqueGainError,
            Effect::TorqueGainError(TorqueGainError { gain: map(0.9, 1.1) }),
            json!({"kind": "torque_gain_error", "gain": {"a": 0.9, "b": 1.1}}),
        ),
        (
            Kind::TorqueBias,
            Effect::TorqueBias(TorqueBias { bias: map(1.0, -2.0) }),
            json!({"kind": "torque_bias", "bias": {"a": 1.0, "b": -2.0}}),
        ),
        (
            Kind::ParallelSpring,
            Effect::ParallelSpring(ParallelSpring { stiffness: map(3.0, 4.0), rest_position: map(0.5, 0.0) }),
            json!({
                "kind": "parallel_spring",
                "stiffness": {"a": 3.0, "b": 4.0}, "rest_position": {"a": 0.5, "b": 0.0}
            }),
        ),
        (
            Kind::JointCoupling,
            Effect::JointCoupling(coupling),
            json!({
                "kind": "joint_coupling", "joints": ["a", "b"],
                "ratio": -1.0, "coulomb": 0.5, "viscous": 0.25, "armature": 0.125
            }),
        ),
    ]
}

#[test]
fn every_kind_is_written_under_its_public_names() {
    let written = written();
    for (kind, effect, expected) in written {
        assert_eq!(effect.kind(), kind);
        assert_eq!(serde_json::to_value(&effect).unwrap(), expected);
        assert_eq!(serde_json::from_value::<Effect>(expected).unwrap(), effect);
    }
}

/// Names, units on rotating and sliding joints, and whether there is a value for each joint: the table of the catalogue.
#[test]
fn parameters_carry_the_names_and_units_of_the_catalogue() {
    let table: BTreeMap<&str, Vec<(&str, &str, &str, bool)>> = [
        ("viscous_friction", vec![("viscous", "N m s/rad", "N s/m", true)]),
        ("coulomb_friction", vec![("coulomb", "N m", "N", true)]),
        ("payload", vec![("mass", "kg", "kg", false), ("com", "m", "m", false), ("inertia", "kg m²", "kg m²", false)]),
        (
            "link_inertia_error",
            vec![
                ("mass_delta", "kg", "kg", false),
                ("first_moment_delta", "kg m", "kg m", false),
                ("inertia_delta", "kg m²", "kg m²", false),
            ],
        ),
        ("armature", vec![("armature", "kg m²", "kg", true)]),
        ("gravity_misalignment", vec![("roll", "rad", "rad", false), ("pitch", "rad", "rad", false)]),
        ("torque_gain_error", vec![("gain", "-", "-", true)]),
        ("torque_bias", vec![("bias", "N m", "N", true)]),
        ("parallel_spring", vec![("stiffness", "N m/rad", "N/m", true), ("rest_position", "rad", "m", true)]),
        (
            "joint_coupling",
            vec![
                ("coulomb", "N m", "N", false),
                ("viscous", "N m s/rad", "N s/m", false),
                ("armature", "kg m²", "kg", false),
                ("ratio", "-", "-", false),
            ],
        ),
    ]
    .into();
    for (kind, effect, _) in written() {
        let found: BTreeSet<(&str, &str, &str, bool)> =
            effect.law().parameters().iter().map(|p| (p.name, p.unit, p.unit_prismatic, p.joint.is_some())).collect();
        assert_eq!(found, table[kind.name()].iter().copied().collect(), "{kind}");
        let joints: &[&str] = match kind {
            Kind::GravityMisalignment => &[],
            Kind::Payload => &["b"],
            Kind::LinkInertiaError => &["a"],
            _ => &["a", "b"],
        };
        assert_eq!(effect.law().joints(), joints, "{kind}");
    }
}

#[test]
fn an_unknown_kind_is_an_error_that_names_the_known_ones() {
    for kind in ["magic", "", "Viscous_Friction", "ViscousFriction"] {
        let error = serde_json::from_value::<Effect>(json!({"kind": kind, "viscous": {"a": 1.0}})).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(kind) && text.contains("viscous_friction"), "{text}");
    }
    for text in ["{}", "null", "[]", "3", r#"{"viscous": {}}"#, r#"{"kind": 4}"#, r#"{"kind": null}"#, ""] {
        serde_json::from_str::<Effect>(text).unwrap_err();
    }
}

/// A misspelt parameter must not pass as the default.
#[test]
fn an_unknown_field_is_an_error() {
    for (kind, _, mut value) in written() {
        value["surplus"] = json!(1.0);
        let read = serde_json::from_value::<Effect>(value);
        let error = read.expect_err(&format!("{kind} with a field `surplus`")).to_string();
        assert!(error.contains("surplus"), "{kind}: {error}");
    }
}

#[test]
fn a_missing_field_is_an_error_that_names_it() {
    for (kind, _, value) in written() {
        for field in value.as_object().unwrap().keys().filter(|key| *key != "kind") {
            let mut less = value.clone();
            less.as_object_mut().unwrap().remove(field);
            let error = serde_json::from_value::<Effect>(less).expect_err(&format!("{kind} without {field}"));
            assert!(error.to_string().contains(field.as_str()), "{kind} without {field}: {error}");
        }
    }
}

#[test]
fn a_field_of_another_type_is_an_error() {
    for (kind, _, value) in written() {
        for field in value.as_object().unwrap().keys() {
            for wrong in [json!(null), json!("1.0"), json!([]), json!(true), json!({"a": null}), json!({"a": "1"})] {
                let mut other = value.clone();
                other[field] = wrong.clone();
                if other == value || (field == "joint" && wrong.is_string()) {
                    continue;
                }
                assert!(serde_json::from_value::<Effect>(other).is_err(), "{kind}: {field} = {wrong}");
            }
        }
    }
}
