//! What is exported, read again by our own readers: the same torque for the same motion, unit by unit and sign by sign.

use gapscope_diagnosis::{Corrected, EncoderSide, MODEL_SCHEMA};
use gapscope_dynamics::{Data, Loaded, Model, robots};
use gapscope_effects::{Effect, Plant};
use gapscope_export::{Robot, Target, export};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use roxmltree::Document;

/// Robots: built-in ones, one with branches and fixed links, one with what a URDF may leave out, and a prismatic joint.
fn robots() -> Vec<(String, Loaded)> {
    let branched = include_str!("../../../dynamics/golden/branched.urdf");
    [robots::arm7(), robots::arm6(), robots::double_pendulum(), branched, BARE]
        .map(|xml| (xml.to_owned(), Model::from_urdf(xml).unwrap()))
        .to_vec()
}

/// A slide and a hinge; no origin, no inertial of the last moved link, all of whose mass is fixed to it.
const BARE: &str = r#"<robot name="bare"><!-- kept -->
  <link name="world"/>
  <link name="cart">
    <inertial><mass value="3"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://cart.stl"/></geometry></visual>
  </link>
  <link name="arm"/>
  <link name="tool"><inertial><origin xyz="0 0 .2" rpy=".3 -.2 .5"/><mass value="1"/>
    <inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz=".001" iyz="0"/></inertial></link>
  <joint name="rail" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="100" velocity="1"/><dynamics damping='2' friction="1"/></joint>
  <joint name="swing" type="continuous">
    <parent link="cart"/>
    <child link="arm"/>
    <axis xyz="0 1 0"/>
  </joint>
  <joint name="mount" type="fixed"><origin xyz=".1 0 0" rpy="0 .4 0"/><parent link="arm"/><child link="tool"/></joint>
</robot>
"#;

fn effects(json: &str, model: &Model) -> Vec<Effect> {
    let (first, last) = (&model.joints()[0].name, &model.joints()[model.dof() - 1].name);
    serde_json::from_str(&json.replace("FIRST", first).replace("LAST", last)).unwrap()
}

fn corrected(model: &Model, effects: Vec<Effect>) -> Corrected {
    let all = |x: f64| model.joints().iter().map(|joint| (joint.name.clone(), x)).collect();
    Corrected {
        made_from: None,
        schema: MODEL_SCHEMA.to_owned(),
        robot: model.name().to_owned(),
        weights: all(1.0),
        standstill: all(1e-9),
        band: 10.0,
        encoder_side: EncoderSide::Link,
        alignment: 0.0,
        effects,
    }
}

fn exported(target: Target, xml: &str, loaded: &Loaded, effects: Vec<Effect>) -> String {
    let robot = Robot { text: xml, loaded, is_mjcf: false, dt: gapscope_export::DT };
    export(target, &robot, &corrected(&loaded.model, effects), &[]).unwrap().text
}

/// Torque that random motions take of a plant, N m (N).
fn taken(mut plant: Plant, joints: usize) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(7);
    let mut draw = || -> Vec<f64> { (0..joints).map(|_| random.random_range(-1.5..1.5)).collect() };
    let (mut out, mut rest) = (Vec::new(), vec![0.0; joints]);
    for _ in 0..20 {
        let (q, v, a) = (draw(), draw(), draw());
        plant.residual(&q, &v, &a, &vec![0.0; joints], &vec![1e-9; joints], &mut rest);
        out.extend(rest.iter().map(|rest| -rest));
    }
    out
}

fn same(a: &[f64], b: &[f64], what: &str) {
    let scale = a.iter().fold(1.0f64, |scale, x| scale.max(x.abs()));
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 1e-9 * scale, "{what}: {a} {b}");
    }
}

/// Effects that our readers read back from both targets.
const BOTH: [&str; 6] = [
    r#"[{"kind": "viscous_friction", "viscous": {"FIRST": 1.5, "LAST": 0.25}}]"#,
    r#"[{"kind": "coulomb_friction", "coulomb": {"LAST": 0.75}}]"#,
    r#"[{"kind": "payload", "joint": "LAST", "mass": 1.5, "com": [0.02, -0.01, 0.08], "inertia": [0.004, 0.0002, 0.004, 0, 0, 0.003]}]"#,
    r#"[{"kind": "link_inertia_error", "joint": "FIRST", "mass_delta": 0.3, "first_moment_delta": [0.01, -0.02, 0.015], "inertia_delta": [0.02, 0.001, 0.02, 0.002, -0.001, 0.02]}]"#,
    r#"[{"kind": "gravity_misalignment", "roll": 0.05, "pitch": -0.08}]"#,
    r#"[{"kind": "joint_zero_offset", "offset": {"FIRST": 0.05, "LAST": -0.07}}]"#,
];

#[test]
fn a_urdf_takes_the_torque_of_the_corrected_robot() {
    let all = format!("[{}]", BOTH.map(|json| json.trim_matches(['[', ']']).to_owned()).join(","));
    for (xml, loaded) in robots() {
        let model = &loaded.model;
        for json in BOTH.iter().copied().chain([all.as_str()]) {
            let effects = effects(json, model);
            let text = exported(Target::Urdf, &xml, &loaded, effects.clone());
            let again = Model::from_urdf(&text).unwrap_or_else(|error| panic!("{error}\n{text}")).model;
            let wanted = taken(Plant::new(model, &effects, 1e-3).unwrap(), model.dof());
            same(&wanted, &taken(Plant::nominal(&again, 1e-3), model.dof()), &format!("{} {json}", model.name()));
        }
    }
}

#[test]
fn an_mjcf_takes_the_torque_of_the_corrected_robot() {
    let rotor = r#"[{"kind": "armature", "armature": {"FIRST": 0.9, "LAST": 0.02}}]"#;
    for (xml, loaded) in robots() {
        let model = &loaded.model;
        for json in BOTH.iter().copied().chain(["[]", rotor]) {
            let effects = effects(json, model);
            let text = exported(Target::Mjcf, &xml, &loaded, effects.clone());
            let again = Model::from_mjcf(&text, &|_| Err(String::new()), &[]).unwrap_or_else(|e| panic!("{e}\n{text}"));
            let names = |model: &Model| model.joints().iter().map(|j| j.name.clone()).collect::<Vec<_>>();
            assert_eq!(names(&again.model), names(model));
            let wanted = taken(Plant::new(model, &effects, 1e-3).unwrap(), model.dof());
            let found = taken(Plant::nominal(&again.model, 1e-3), model.dof());
            let scale = wanted.iter().fold(1.0f64, |scale, x| scale.max(x.abs()));
            for (a, b) in wanted.iter().zip(&found) {
                // A body without mass is given next to none, which MuJoCo asks for.
                assert!((a - b).abs() < 1e-5 * scale, "{} {json}: {a} {b}", model.name());
            }
        }
    }
}

#[test]
fn the_way_back_from_an_mjcf_is_the_same_as_from_the_urdf() {
    let (xml, loaded) = robots().swap_remove(1);
    let first = exported(Target::Mjcf, &xml, &loaded, vec![]);
    let again = Model::from_mjcf(&first, &|_| Err(String::new()), &[]).unwrap();
    let robot = Robot { text: &first, loaded: &again, is_mjcf: true, dt: gapscope_export::DT };
    let effects = effects(BOTH[1], &again.model);
    let corrected = corrected(&again.model, effects.clone());
    let second = export(Target::Mjcf, &robot, &corrected, &[]).unwrap().text;
    let third = Model::from_mjcf(&second, &|_| Err(String::new()), &[]).unwrap().model;
    let wanted = taken(Plant::new(&loaded.model, &effects, 1e-3).unwrap(), 6);
    same(&wanted, &taken(Plant::nominal(&third, 1e-3), 6), "again");
    let error = export(Target::Urdf, &robot, &corrected, &[]).unwrap_err().to_string();
    assert!(error.contains("--to mjcf"), "{error}");
}

#[test]
fn isaac_lab_gets_efforts_of_joints_and_steps_of_delay() {
    let (xml, loaded) = robots().swap_remove(1);
    let json = r#"[{"kind": "viscous_friction", "viscous": {"joint2": 1.5}}, {"kind": "armature", "armature": {"joint3": 0.25}},
        {"kind": "stribeck_friction", "coulomb": {"joint1": 1.0}, "static": {"joint1": 2.5}, "stribeck_velocity": {"joint1": 0.1}},
        {"kind": "torque_saturation", "limit": {"joint6": 3.5}}, {"kind": "actuation_delay", "delay": 0.0126}]"#;
    let text = exported(Target::IsaacLab, &xml, &loaded, effects(json, &loaded.model));
    for line in [
        r#"viscous_friction={r"joint1": 0.0, r"joint2": 1.5, "#,
        r#"armature={r"joint1": 0.0, r"joint2": 0.0, r"joint3": 0.25, "#,
        r#" friction={r"joint1": 2.5, "#,
        r#"dynamic_friction={r"joint1": 1.0, "#,
        r#"r"joint5": 28.0, r"joint6": 3.5}"#,
        "min_delay=3,",
        "max_delay=3,",
        "stiffness=0.0,",
        "NOT RUN",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

#[test]
fn every_other_byte_of_a_urdf_is_kept() {
    for (xml, loaded) in robots() {
        assert_eq!(exported(Target::Urdf, &xml, &loaded, vec![]), xml);
    }
    let loaded = Model::from_urdf(BARE).unwrap();
    let friction = effects(BOTH[0], &loaded.model);
    let text = exported(Target::Urdf, BARE, &loaded, friction);
    let expected = BARE
        .replace("damping='2'", "damping='3.5'")
        .replace("\"0 1 0\"/>\n  </joint>", "\"0 1 0\"/>\n    <dynamics damping=\"0.25\" friction=\"0\"/>\n  </joint>");
    assert_eq!(text, expected);
}

#[test]
fn links_stay_bodies_where_the_whole_body_is_one() {
    let loaded = Model::from_urdf(BARE).unwrap();
    let less = r#"[{"kind": "payload", "joint": "swing", "mass": -0.4, "com": [0.1, 0, 0.2], "inertia": [-0.001, 0, -0.001, 0, 0, -0.001]}]"#;
    let text = exported(Target::Urdf, BARE, &loaded, effects(less, &loaded.model));
    // The moved link has nothing to take the mass from: what is fixed to it gives it.
    assert!(text.contains("<link name=\"arm\"/>") && text.contains("<mass value=\"0.6\"/>"), "{text}");
    assert!(Model::from_urdf(&text).unwrap().model.joints()[1].inertia.is_physical());
}

/// The effects that MJCF has elements of its own for.
const DRIVES: &str = r#"[
    {"kind": "torque_gain_error", "gain": {"FIRST": 1.25}},
    {"kind": "torque_bias", "bias": {"FIRST": -0.5}},
    {"kind": "torque_saturation", "limit": {"LAST": 3.5}},
    {"kind": "actuation_delay", "delay": 0.0125},
    {"kind": "actuator_lag", "time_constant": 0.02},
    {"kind": "parallel_spring", "stiffness": {"FIRST": 12.0}, "rest_position": {"FIRST": -0.25}},
    {"kind": "joint_zero_offset", "offset": {"FIRST": 0.5}},
    {"kind": "torque_ripple", "amplitude": {"FIRST": 0.75}, "cycles": {"FIRST": 17.0}, "phase": {"FIRST": 9.0}},
    {"kind": "presliding_friction", "coulomb": {"LAST": 2.0}, "bristle_stiffness": {"LAST": 300.0}},
    {"kind": "stribeck_friction", "coulomb": {"FIRST": 1.0}, "static": {"FIRST": 2.0}, "stribeck_velocity": {"FIRST": 0.125}},
    {"kind": "joint_elasticity", "stiffness": {"LAST": 900.0}, "damping": {"LAST": 1.5}},
    {"kind": "armature", "armature": {"LAST": 0.25}},
    {"kind": "joint_coupling", "joints": ["FIRST", "LAST"], "coulomb": 0.5, "viscous": 0.25, "armature": 0.125, "ratio": -2.0}
]"#;

#[test]
fn play_is_a_tendon_between_limits_that_press_as_hard_as_our_contact() {
    let (xml, loaded) = robots().swap_remove(1);
    let play = r#"[
        {"kind": "backlash", "gap": {"LAST": 0.02}},
        {"kind": "joint_elasticity", "stiffness": {"LAST": 900.0}, "damping": {"LAST": 1.5}},
        {"kind": "armature", "armature": {"LAST": 0.25}}
    ]"#;
    let text = exported(Target::Mjcf, &xml, &loaded, effects(play, &loaded.model));
    let document = Document::parse(&text).unwrap();
    let tendon = document.descendants().find(|n| n.attribute("name") == Some("joint6_wind_up")).unwrap();
    let numbers = |name: &str| -> Vec<f64> {
        tendon.attribute(name).unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
    };
    assert_eq!(numbers("range"), [-0.01, 0.01]);
    assert_eq!(tendon.attribute("stiffness"), None, "nothing acts between the limits");
    // MuJoCo's constraint of impedance d passes on d/(1 − d) of the acceleration asked for, d² of it divided out, over how
    // easily the tendon gives way: the rotor and the last link, all other joints free.
    let model = &loaded.model;
    let mut mass = DMatrix::zeros(model.dof(), model.dof());
    model.mass_matrix(&mut Data::new(model), &vec![0.0; model.dof()], &mut mass);
    let last = model.dof() - 1;
    let gives_way = 1.0 / 0.25 + mass.try_inverse().unwrap()[(last, last)];
    let impedance = numbers("solimplimit")[0];
    for (of_constraint, of_force) in numbers("solreflimit").iter().zip([900.0, 1.5]) {
        let force = -of_constraint / (gives_way * (1.0 - impedance));
        assert!((force - of_force).abs() < 1e-6 * of_force, "{force} for {of_force}");
    }
}

#[test]
fn an_mjcf_has_every_number_in_the_unit_and_sign_of_mujoco() {
    let (xml, loaded) = robots().swap_remove(1);
    let text = exported(Target::Mjcf, &xml, &loaded, effects(DRIVES, &loaded.model));
    let document = Document::parse(&text).unwrap();
    let of = |element: &str, name: &str, attribute: &str| -> String {
        let node = document.descendants().find(|n| n.has_tag_name(element) && n.attribute("name") == Some(name));
        let node = node.unwrap_or_else(|| panic!("{element} {name}\n{text}"));
        node.attribute(attribute).unwrap_or_else(|| panic!("{element} {name} {attribute}\n{text}")).to_owned()
    };
    let step: f64 = document
        .descendants()
        .find(|n| n.has_tag_name("option"))
        .unwrap()
        .attribute("timestep")
        .unwrap()
        .parse()
        .unwrap();
    for (element, name, attribute, value) in [
        ("general", "joint1", "gainprm", "1.25"),
        ("general", "joint1", "biasprm", "-0.5 0 0"),
        ("general", "joint6", "forcerange", "-3.5 3.5"),
        ("general", "joint2", "delay", "0.0125"),
        ("general", "joint2", "dyntype", "filterexact"),
        ("general", "joint2", "dynprm", "0.02"),
        ("general", "joint6", "joint", "joint6_motor"),
        ("joint", "joint1", "stiffness", "12"),
        ("joint", "joint1", "ref", "0.5"),
        // What the encoder shows where the spring is relaxed at −0.25 in truth.
        ("joint", "joint1", "springref", "0.25"),
        // 17 cycles of the true position: 9 − 17 · 0.5 on the measured one.
        ("dcmotor", "joint1_ripple", "cogging", "0.75 17 0.5"),
        ("dcmotor", "joint6_presliding", "lugre", "300 0 2 2 1"),
        ("joint", "joint6_motor", "armature", "0.25"),
        ("fixed", "joint6_wind_up", "stiffness", "900"),
        ("fixed", "joint6_wind_up", "damping", "1.5"),
        ("fixed", "joint6_wind_up", "springlength", "0 0"),
        ("fixed", "joint1_joint6_coupling", "frictionloss", "0.5"),
        ("fixed", "joint1_joint6_coupling", "damping", "0.25"),
        ("fixed", "joint1_joint6_coupling", "armature", "0.125"),
    ] {
        assert_eq!(of(element, name, attribute), value, "{element} {name} {attribute}");
    }
    let samples: f64 = of("general", "joint2", "nsample").parse().unwrap();
    assert!(samples * step >= 0.0125, "the buffer spans the delay");
    let lugre = of("dcmotor", "joint1_stribeck", "lugre");
    assert!(lugre.starts_with("20000 ") && lugre.ends_with(" 1 2 0.125"), "{lugre}");
    let elastic = document.descendants().find(|n| n.attribute("name") == Some("joint6")).unwrap();
    assert_eq!(elastic.attribute("armature"), None, "the rotor turns with the motor");
}
