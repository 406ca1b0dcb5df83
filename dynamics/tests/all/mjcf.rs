//! MJCF against the figures of MuJoCo in `golden/mjcf`, made by `make.py` there; and what is refused.

use gapscope_dynamics::{Data, Loaded, MjcfError, Model};
use nalgebra::DMatrix;
use proptest::prelude::*;
use serde_json::Value;

const ARM: &str = include_str!("../../golden/mjcf/arm.xml");
const GEOMS: &str = include_str!("../../golden/mjcf/geoms.xml");
const LOWER: &str = include_str!("../../golden/mjcf/lower.xml");

fn read(xml: &str, locked: &[&str]) -> Result<Loaded, MjcfError> {
    let include = |file: &str| if file == "lower.xml" { Ok(LOWER.to_owned()) } else { Err("no such file".to_owned()) };
    Model::from_mjcf(xml, &include, locked)
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

#[track_caller]
fn near(what: &str, got: &[f64], golden: &Value) {
    let golden = numbers(golden);
    let scale = golden.iter().fold(1e-3, |s: f64, x| s.max(x.abs()));
    assert_eq!(got.len(), golden.len(), "{what}");
    for (x, y) in got.iter().zip(&golden) {
        assert!((x - y).abs() <= 1e-9 * scale, "{what}: {got:?}, MuJoCo has {golden:?}");
    }
}

fn check(xml: &str, golden: &str) {
    let model = read(xml, &[]).unwrap().model;
    let golden: Value = serde_json::from_str(golden).unwrap();
    let names: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(serde_json::json!(names), golden["joints"]);
    let mut data = Data::new(&model);
    let (mut bias, mut mass) = (vec![0.0; names.len()], DMatrix::zeros(names.len(), names.len()));
    for state in golden["states"].as_array().unwrap() {
        let [q, v] = ["q", "v"].map(|key| numbers(&state[key]));
        model.bias(&mut data, &q, &v, &mut bias);
        near("bias", &bias, &state["bias"]);
        model.mass_matrix(&mut data, &q, &mut mass);
        near("mass matrix", mass.as_slice(), &state["mass_matrix"]);
    }
    let of = |field: fn(&gapscope_dynamics::Joint) -> f64| model.joints().iter().map(field).collect::<Vec<f64>>();
    near("damping", &of(|joint| joint.damping), &golden["damping"]);
    near("friction", &of(|joint| joint.friction), &golden["friction"]);
    near("armature", model.armature(), &golden["armature"]);
    let limits: Vec<f64> =
        model.joints().iter().flat_map(|j| [j.limits.lower.unwrap_or(0.0), j.limits.upper.unwrap_or(0.0)]).collect();
    near("range", &limits, &golden["range"]);
}

#[test]
fn an_arm_moves_as_in_mujoco() {
    check(ARM, include_str!("../../golden/mjcf/arm.json"));
    let loaded = read(ARM, &[]).unwrap();
    let limits: Vec<Option<f64>> = loaded.model.joints().iter().map(|joint| joint.limits.effort).collect();
    assert_eq!(limits, [Some(100.0), Some(80.0), None, None]);
}

#[test]
fn bodies_of_geoms_weigh_as_in_mujoco() {
    check(GEOMS, include_str!("../../golden/mjcf/geoms.json"));
    let findings: Vec<String> = read(GEOMS, &[]).unwrap().findings.iter().map(ToString::to_string).collect();
    assert!(findings[0].contains("cube") && findings[0].contains("left out"), "{findings:?}");
}

#[test]
fn joints_and_inertials_in_frames_stand_as_in_mujoco() {
    check(include_str!("../../golden/mjcf/frames.xml"), include_str!("../../golden/mjcf/frames.json"));
}

#[test]
fn a_held_joint_stands_at_zero() {
    let (whole, held) = (read(ARM, &[]).unwrap().model, read(ARM, &["lift"]).unwrap().model);
    assert_eq!(held.dof(), 3);
    let (mut all, mut fewer) = (vec![0.0; 4], vec![0.0; 3]);
    whole.gravity_torque(&mut Data::new(&whole), &[0.3, 0.0, 0.1, -0.5], &mut all);
    held.gravity_torque(&mut Data::new(&held), &[0.3, 0.1, -0.5], &mut fewer);
    all.remove(1);
    for (a, b) in all.iter().zip(&fewer) {
        assert!((a - b).abs() < 1e-9, "{all:?} {fewer:?}");
    }
}

#[test]
fn what_the_model_cannot_hold_is_refused_by_name_with_the_mend() {
    let body = |inside: &str| format!("<mujoco><worldbody><body name=\"b\">{inside}</body></worldbody></mujoco>");
    let hinge = "<joint name=\"j\"/><geom size=\"1\"/>";
    let with = |more: &str| body(hinge).replace("</mujoco>", &format!("{more}</mujoco>"));
    let cases = [
        (with("<tendon><fixed name=\"t\"><joint joint=\"j\"/></fixed></tendon>"), "<fixed> `t`"),
        (with("<equality><weld name=\"w\" body1=\"b\"/></equality>"), "<weld> `w`"),
        (with("<equality><joint joint1=\"j\" joint2=\"k\"/></equality>"), "--lock j --lock k"),
        (body("<joint type=\"ball\"/><geom size=\"1\"/>"), "ball"),
        (body(&format!("<freejoint/><geom size=\"1\"/><body>{hinge}</body>")), "floats"),
        (body("<joint/><geom type=\"mesh\" mesh=\"m\"/>"), "mj_saveLastXML"),
        (body("<joint axis=\"0 0 0\"/><geom size=\"1\"/>"), "axis"),
        (body("<joint/><geom size=\"-1\"/>"), "size"),
        (body("<joint class=\"none\"/><geom size=\"1\"/>"), "`none`"),
        (body("<joint/><inertial mass=\"1\" diaginertia=\"1 1 5\"/>"), "no body"),
        (body("<joint damping=\"x\"/><geom size=\"1\"/>"), "damping"),
        (body("<geom size=\"1\"/>"), "no hinge"),
        (body("<replicate count=\"3\"/>"), "<replicate>"),
        ("<mujoco><worldbody><frame><joint/></frame></worldbody></mujoco>".into(), "in no body"),
        (with("<include file=\"none.xml\"/>"), "none.xml"),
        ("<robot/>".into(), "<mujoco>"),
        ("<mujoco>".into(), "well-formed"),
        ("<mujoco><compiler coordinate=\"global\"/></mujoco>".into(), "global"),
    ];
    for (xml, what) in cases {
        let error = read(&xml, &[]).unwrap_err().to_string();
        assert!(error.contains(what), "{what:?} is not in {error:?}");
    }
    assert!(read(&with("<equality><joint joint1=\"j\" joint2=\"j\" active=\"false\"/></equality>"), &[]).is_ok());
    assert!(read(ARM, &["grip"]).unwrap_err().to_string().contains("pan, lift"));
    let looped = |_: &str| Ok("<mujocoinclude><include file=\"x\"/></mujocoinclude>".to_owned());
    assert!(Model::from_mjcf("<mujoco><include file=\"x\"/></mujoco>", &looped, &[]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_changed_in_a_file_never_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(b"0123456789.-e <>/\"=xn".as_slice())), 1..8),
        of_arm in any::<bool>(),
    ) {
        let mut bytes = if of_arm { ARM } else { GEOMS }.as_bytes().to_vec();
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(loaded) = read(&String::from_utf8_lossy(&bytes), &[]) {
            prop_assert!(loaded.model.joints().iter().all(|joint| joint.inertia.parameters().iter().all(|x| x.is_finite())));
        }
    }
}
