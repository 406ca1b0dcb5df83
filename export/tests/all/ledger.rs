//! Nothing is dropped in silence, and no figure is given that is not known.

use gapscope_diagnosis::{Corrected, EncoderSide, MODEL_SCHEMA};
use gapscope_dynamics::robots;
use gapscope_effects::{Effect, Kind};
use gapscope_export::{How, Robot, Target, export};

/// One effect of each kind.
const ALL: &str = r#"[
    {"kind": "viscous_friction", "viscous": {"joint1": 1.5}},
    {"kind": "coulomb_friction", "coulomb": {"joint1": 0.75}},
    {"kind": "stribeck_friction", "coulomb": {"joint1": 1.0}, "static": {"joint1": 2.0}, "stribeck_velocity": {"joint1": 0.125}},
    {"kind": "load_dependent_friction", "load_coefficient": {"joint1": 0.1}},
    {"kind": "presliding_friction", "coulomb": {"joint2": 2.0}, "bristle_stiffness": {"joint2": 300.0}},
    {"kind": "thermal_drift", "coulomb": {"joint1": 2.0}, "ratio": {"joint1": 0.5}, "time_constant": {"joint1": 5.0}},
    {"kind": "payload", "joint": "joint6", "mass": 1.5, "com": [0.02, -0.01, 0.08], "inertia": [0.004, 0, 0.004, 0, 0, 0.003]},
    {"kind": "link_inertia_error", "joint": "joint1", "mass_delta": 0.3, "first_moment_delta": [0.01, -0.02, 0.015],
     "inertia_delta": [0.02, 0.001, 0.02, 0.002, -0.001, 0.02]},
    {"kind": "armature", "armature": {"joint3": 0.9}},
    {"kind": "gravity_misalignment", "roll": 0.05, "pitch": -0.08},
    {"kind": "torque_gain_error", "gain": {"joint1": 1.25}},
    {"kind": "torque_bias", "bias": {"joint1": -0.5}},
    {"kind": "actuation_delay", "delay": 0.0125},
    {"kind": "actuator_lag", "time_constant": 0.02},
    {"kind": "torque_saturation", "limit": {"joint6": 3.5}},
    {"kind": "torque_ripple", "amplitude": {"joint1": 0.75}, "cycles": {"joint1": 17.0}, "phase": {"joint1": 9.0}},
    {"kind": "joint_elasticity", "stiffness": {"joint3": 900.0, "joint5": 800.0}, "damping": {"joint3": 1.5}},
    {"kind": "backlash", "gap": {"joint4": 0.01}},
    {"kind": "parallel_spring", "stiffness": {"joint1": 12.0}, "rest_position": {"joint1": -0.25}},
    {"kind": "joint_zero_offset", "offset": {"joint1": 0.5}},
    {"kind": "external_contact", "link": "joint2", "intervals": [], "force": [1, 0, 0]},
    {"kind": "joint_coupling", "joints": ["joint5", "joint6"], "coulomb": 0.5, "viscous": 0.25, "armature": 0.125, "ratio": -2.0}
]"#;

#[test]
fn every_kind_has_its_line_and_no_figure_without_logs() {
    let loaded = robots::model("arm6").unwrap().unwrap();
    let effects: Vec<Effect> = serde_json::from_str(ALL).unwrap();
    let kinds: Vec<Kind> = effects.iter().map(Effect::kind).collect();
    assert_eq!(kinds.len(), Kind::ALL.len());
    let all = |x: f64| loaded.model.joints().iter().map(|joint| (joint.name.clone(), x)).collect();
    let corrected = Corrected {
        made_from: None,
        schema: MODEL_SCHEMA.to_owned(),
        robot: "arm6".to_owned(),
        weights: all(1.0),
        standstill: all(0.01),
        band: 10.0,
        encoder_side: EncoderSide::Link,
        alignment: 1e-4,
        effects,
    };
    let robot = Robot { text: robots::arm6(), loaded: &loaded, is_mjcf: false, dt: gapscope_export::DT };
    let how = |target: Target| {
        let ledger = export(target, &robot, &corrected, &[]).unwrap().ledger;
        assert!(ledger.notes.iter().any(|note| note.contains("1.00e-4 s")), "{:?}", ledger.notes);
        assert_eq!((ledger.shrink, ledger.shrink_here), (None, None));
        let drake = ledger.notes.iter().any(|note| note.starts_with("Drake reads no `friction`"));
        assert_eq!(drake, target == Target::Urdf, "{:?}", ledger.notes);
        for kind in &kinds {
            assert!(ledger.effects.iter().any(|entry| entry.kind == kind.name()), "{target:?} {kind}");
        }
        for entry in &ledger.effects {
            assert!(entry.loss.is_none() && !entry.r#as.is_empty(), "{entry:?}");
        }
        let count = |how: How| ledger.effects.iter().filter(|entry| entry.how == how).count();
        ([count(How::Written), count(How::Approximated), count(How::LeftOut)], ledger)
    };
    assert_eq!(how(Target::Urdf).0, [7, 3, 12]);
    assert_eq!(how(Target::IsaacLab).0, [8, 4, 10]);
    assert_eq!(how(Target::C).0, [21, 0, 1]);
    let (counts, mjcf) = how(Target::Mjcf);
    // The spring of joint 5 and the play have no rotor behind them; friction by load needs logs; contact belongs to its log.
    assert_eq!(counts, [18, 1, 4]);
    let springs: Vec<_> = mjcf.effects.iter().filter(|entry| entry.kind == "joint_elasticity").collect();
    assert_eq!((springs[0].how, springs[0].joints.as_slice()), (How::Written, &["joint3".to_owned()][..]));
    assert_eq!((springs[1].how, springs[1].joints.as_slice()), (How::LeftOut, &["joint5".to_owned()][..]));
}

/// A body of two equal links, from which more is taken than either has: one takes the rest, and the ledger says so.
#[test]
fn links_that_lose_their_mass_are_named() {
    let tool = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0 0 .2"/><mass value=".2"/>
            <inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        )
    };
    let text = format!(
        r#"<robot name="pair"><link name="base"/>{}{}<joint name="swing" type="continuous"><parent link="base"/><child link="left"/>
        <axis xyz="0 1 0"/></joint><joint name="glue" type="fixed"><parent link="left"/><child link="right"/></joint></robot>"#,
        tool("left"),
        tool("right")
    );
    let loaded = gapscope_dynamics::Model::from_urdf(&text).unwrap();
    // Three quarters of both together.
    let effects = r#"[{"kind": "link_inertia_error", "joint": "swing", "mass_delta": -0.3, "first_moment_delta": [0, 0, -0.06],
        "inertia_delta": [-0.042, 0, -0.057, 0, 0, -0.06]}]"#;
    let all = |x: f64| [("swing".to_owned(), x)].into();
    let corrected = Corrected {
        made_from: None,
        schema: MODEL_SCHEMA.to_owned(),
        robot: "pair".to_owned(),
        weights: all(1.0),
        standstill: all(0.01),
        band: 10.0,
        encoder_side: EncoderSide::Link,
        alignment: 0.0,
        effects: serde_json::from_str(effects).unwrap(),
    };
    let robot = Robot { text: &text, loaded: &loaded, is_mjcf: false, dt: gapscope_export::DT };
    let exported = export(Target::Urdf, &robot, &corrected, &[]).unwrap();
    let notes = &exported.ledger.notes;
    assert!(notes.iter().any(|note| note.contains("`right` has no mass of its own")), "{notes:?}");
    let again = gapscope_dynamics::Model::from_urdf(&exported.text).unwrap();
    assert!((again.model.joints()[0].inertia.mass - 0.1).abs() < 1e-12, "{}", exported.text);
}
