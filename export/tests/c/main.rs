//! The C file compiled by the C compiler of this machine, held to our own plant; said to be skipped where there is none.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod covers;

use gapscope_diagnosis::{Corrected, EncoderSide, MODEL_SCHEMA};
use gapscope_dynamics::{Loaded, Model, StepModel, robots};
use gapscope_effects::{Effect, Kind};
use gapscope_export::{How, Robot, Target, export, weights};
use gapscope_network::{Activation, Init, Mlp, Net};
use gapscope_residual::{Hybrid, On};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Stdio};

const DRIVER: &str = include_str!("driver.c");
/// Of C against Rust, relative to the largest number of a vector (at least 1): sums in another order, no more.
const TOLERANCE: f64 = 1e-9;
const STANDSTILL: f64 = 1e-3;

/// One of every kind on the joints FIRST and LAST, which may be one.
const CASES: [&str; 21] = [
    r#"{"kind": "viscous_friction", "viscous": {"FIRST": 1.5, "LAST": 0.25}}"#,
    r#"{"kind": "coulomb_friction", "coulomb": {"FIRST": 2.5, "LAST": 0.75}}"#,
    r#"{"kind": "stribeck_friction", "coulomb": {"FIRST": 1}, "static": {"FIRST": 2}, "stribeck_velocity": {"FIRST": 0.15}}"#,
    r#"{"kind": "load_dependent_friction", "load_coefficient": {"FIRST": 0.12, "LAST": 0.08}}"#,
    r#"{"kind": "presliding_friction", "coulomb": {"FIRST": 3, "LAST": 0.4}, "bristle_stiffness": {"FIRST": 600, "LAST": 90}}"#,
    r#"{"kind": "thermal_drift", "coulomb": {"FIRST": 3, "LAST": 0.4}, "ratio": {"FIRST": 0.5, "LAST": 0.3}, "time_constant": {"FIRST": 0.01, "LAST": 6}}"#,
    r#"{"kind": "payload", "joint": "LAST", "mass": 1.5, "com": [0.02, -0.01, 0.08], "inertia": [0.004, 0.0002, 0.004, 0, 0, 0.003]}"#,
    r#"{"kind": "link_inertia_error", "joint": "FIRST", "mass_delta": 0.3, "first_moment_delta": [0.01, -0.02, 0.015], "inertia_delta": [0.02, 0.001, 0.02, 0.002, -0.001, 0.02]}"#,
    r#"{"kind": "armature", "armature": {"FIRST": 0.9, "LAST": 0.02}}"#,
    r#"{"kind": "gravity_misalignment", "roll": 0.05, "pitch": -0.08}"#,
    r#"{"kind": "torque_gain_error", "gain": {"FIRST": 1.1, "LAST": 0.9}}"#,
    r#"{"kind": "torque_bias", "bias": {"FIRST": 3, "LAST": -0.2}}"#,
    r#"{"kind": "actuation_delay", "delay": 0.0034}"#,
    r#"{"kind": "actuator_lag", "time_constant": 0.005}"#,
    r#"{"kind": "torque_saturation", "limit": {"FIRST": 2, "LAST": 1}}"#,
    r#"{"kind": "torque_ripple", "amplitude": {"FIRST": 3, "LAST": 0.2}, "cycles": {"FIRST": 17, "LAST": 5}, "phase": {"FIRST": 0.4, "LAST": 0}}"#,
    r#"{"kind": "joint_elasticity", "stiffness": {"FIRST": 4000, "LAST": 300}, "damping": {"FIRST": 8, "LAST": 0.3}}"#,
    r#"{"kind": "backlash", "gap": {"FIRST": 0.006}}"#,
    r#"{"kind": "parallel_spring", "stiffness": {"FIRST": 25, "LAST": 2}, "rest_position": {"FIRST": -0.6, "LAST": 0.4}}"#,
    r#"{"kind": "joint_zero_offset", "offset": {"FIRST": 0.05, "LAST": -0.07}}"#,
    r#"{"kind": "joint_coupling", "joints": ["FIRST", "LAST"], "coulomb": 0.6, "viscous": 0.5, "armature": 0.03, "ratio": 0.7}"#,
];

fn effects(json: &str, model: &Model) -> Vec<Effect> {
    let (first, last) = (&model.joints()[0].name, &model.joints()[model.dof() - 1].name);
    serde_json::from_str(&format!("[{json}]").replace("FIRST", first).replace("LAST", last)).unwrap()
}

fn corrected(model: &Model, effects: Vec<Effect>, encoder_side: EncoderSide) -> Corrected {
    let all = |x: f64| model.joints().iter().map(|joint| (joint.name.clone(), x)).collect();
    Corrected {
        made_from: None,
        schema: MODEL_SCHEMA.to_owned(),
        robot: model.name().to_owned(),
        weights: all(1.0),
        standstill: all(STANDSTILL),
        band: 10.0,
        encoder_side,
        alignment: 0.0,
        effects,
    }
}

fn has(compiler: &str) -> bool {
    let there = Command::new(compiler).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    if !there {
        // The harness shows this with --nocapture; a machine without a compiler proves nothing of these files.
        eprintln!("skipped: no `{compiler}` on this machine");
    }
    there
}

fn has_compiler() -> bool {
    has("cc")
}

/// Runs a compiler on files of a folder, every warning an error.
fn compile(folder: &Path, compiler: &str, arguments: &[&str]) {
    let strict = ["-O0", "-Wall", "-Wextra", "-Werror", "-pedantic"];
    let built = Command::new(compiler).args(strict).args(arguments).current_dir(folder).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

/// What the compiled file says of commands, a line of numbers each.
fn run(folder: &Path, code: &str, commands: &str) -> Vec<Vec<f64>> {
    for (name, text) in [("robot.c", code), ("driver.c", DRIVER)] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    compile(folder, "cc", &["-std=c99", "robot.c", "driver.c", "-lm", "-o", "robot"]);
    answers(folder, commands)
}

/// What the program `robot` of a folder says of commands.
fn answers(folder: &Path, commands: &str) -> Vec<Vec<f64>> {
    std::fs::write(folder.join("commands"), commands).unwrap();
    let commands = std::fs::File::open(folder.join("commands")).unwrap();
    let told = Command::new(folder.join("robot")).current_dir(folder).stdin(commands).output().unwrap();
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let told = String::from_utf8(told.stdout).unwrap();
    told.lines().map(|line| line.split(' ').map(|x| x.parse().unwrap()).collect()).collect()
}

fn command(out: &mut String, name: char, numbers: &[&[f64]]) {
    let _ = write!(out, "{name}");
    numbers.iter().copied().flatten().for_each(|x| {
        let _ = write!(out, " {x:?}");
    });
    out.push('\n');
}

fn same(rust: &[f64], c: &[f64], what: &str) {
    assert_eq!(rust.len(), c.len(), "{what}");
    let scale = rust.iter().fold(1.0f64, |scale, x| scale.max(x.abs()));
    for (rust, c) in rust.iter().zip(c) {
        assert!((rust - c).abs() <= TOLERANCE * scale, "{what}: {rust} in Rust, {c} in C");
    }
}

/// Robots: six joints, two, and a branched tree with a slide and a joint that is not about an axis of its frame.
fn robots() -> Vec<(String, Loaded)> {
    let branched = include_str!("../../../dynamics/golden/branched.urdf");
    [robots::arm6(), robots::double_pendulum(), branched]
        .map(|xml| (xml.to_owned(), Model::from_urdf(xml).unwrap()))
        .to_vec()
}

fn code(xml: &str, loaded: &Loaded, corrected: &Corrected, dt: f64) -> String {
    let robot = Robot { text: xml, loaded, is_mjcf: false, dt };
    export(Target::C, &robot, corrected, &[]).unwrap().text
}

struct Draw(Pcg64);

impl Draw {
    fn some(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.0.random_range(-size..size)).collect()
    }
}

/// Random states stepped by both, and samples of which both tell torque and acceleration.
fn agree(name: &str, xml: &str, loaded: &Loaded, json: &str, side: EncoderSide, dt: f64) {
    let model = &loaded.model;
    let n = model.dof();
    let corrected = corrected(model, effects(json, model), side);
    let mut plant = corrected.plant(model, dt).unwrap();
    let mut draw = Draw(Pcg64::seed_from_u64(11));
    let (mut commands, mut wanted) = (String::new(), Vec::new());
    for trial in 0..8 {
        let (q, mut v) = (draw.some(n, 1.0), draw.some(n, 1.0));
        // Some begin at rest, where friction holds.
        if trial % 2 == 1 {
            v.fill(0.0);
        }
        command(&mut commands, 's', &[&q, &v]);
        let mut x = vec![0.0; plant.state_len()];
        plant.start(&q, &v, &mut x);
        for _ in 0..12 {
            let tau = draw.some(n, 4.0);
            command(&mut commands, 't', &[&tau]);
            plant.step(&mut x, &tau);
            wanted.push(x[..2 * n].to_vec());
        }
        let (a, tau, mut rest) = (draw.some(n, 2.0), draw.some(n, 4.0), vec![0.0; n]);
        plant.residual(&q, &v, &a, &tau, &vec![STANDSTILL; n], &mut rest);
        command(&mut commands, 'r', &[&q, &v, &a, &tau]);
        wanted.push(rest.clone());
        plant.residual(&q, &v, &a, &vec![0.0; n], &vec![STANDSTILL; n], &mut rest);
        command(&mut commands, 'i', &[&q, &v, &a]);
        wanted.push(rest.iter().map(|rest| -rest).collect());
    }
    let folder = tempfile::tempdir().unwrap();
    let told = run(folder.path(), &code(xml, loaded, &corrected, dt), &commands);
    assert_eq!(told.len(), wanted.len());
    for (i, (wanted, told)) in wanted.iter().zip(&told).enumerate() {
        same(wanted, told, &format!("{name}, {json}, answer {i}"));
    }
}

#[test]
fn every_kind_steps_as_in_rust() {
    if !has_compiler() {
        return;
    }
    let rotors = r#"{"kind": "armature", "armature": {"FIRST": 0.9, "LAST": 0.02}}"#;
    for (i, (xml, loaded)) in robots().into_iter().enumerate() {
        let name = loaded.model.name().to_owned();
        // A compilation each: one robot shows every kind by itself, the others all together.
        for json in CASES.iter().take(if i == 0 { CASES.len() } else { 0 }) {
            agree(&name, &xml, &loaded, json, EncoderSide::Link, 2e-3);
            if json.contains("elasticity") || json.contains("backlash") {
                let json = format!("{json}, {rotors}");
                agree(&name, &xml, &loaded, &json, EncoderSide::Link, 2e-3);
                agree(&name, &xml, &loaded, &json, EncoderSide::Motor, 1e-3);
            }
        }
        agree(&name, &xml, &loaded, "", EncoderSide::Link, 2e-3);
        agree(&name, &xml, &loaded, &CASES.join(","), EncoderSide::Motor, 2e-3);
    }
}

#[test]
fn every_kind_is_written_but_the_contact_of_one_log() {
    let arm = Model::from_urdf(robots::arm6()).unwrap();
    let contact = r#"{"kind": "external_contact", "link": "LAST", "force": [1, 0, 0], "intervals": [[0, 1]]}"#;
    let all = effects(&format!("{},{contact}", CASES.join(",")), &arm.model);
    let corrected = corrected(&arm.model, all, EncoderSide::Link);
    let robot = Robot { text: robots::arm6(), loaded: &arm, is_mjcf: false, dt: 1e-3 };
    let ledger = export(Target::C, &robot, &corrected, &[]).unwrap().ledger;
    let how = |how: How| ledger.effects.iter().filter(move |e| e.how == how).map(|e| e.kind.as_str());
    let written: std::collections::BTreeSet<&str> = how(How::Written).collect();
    let named = Kind::ALL.iter().map(|kind| kind.name()).filter(|name| *name != "external_contact");
    assert_eq!(written, named.collect());
    assert_eq!(how(How::LeftOut).collect::<Vec<_>>(), ["external_contact"]);
}

/// Accelerations under the efforts of a motion are those of the motion; where a joint stands, none.
#[test]
fn forward_dynamics_undo_inverse_dynamics() {
    if !has_compiler() {
        return;
    }
    for (xml, loaded) in robots() {
        let n = loaded.model.dof();
        let all: Vec<&str> = CASES.iter().copied().filter(|json| !json.contains("saturation")).collect();
        let corrected = corrected(&loaded.model, effects(&all.join(","), &loaded.model), EncoderSide::Link);
        let mut plant = corrected.plant(&loaded.model, 1e-3).unwrap();
        let mut draw = Draw(Pcg64::seed_from_u64(3));
        let (mut commands, mut wanted) = (String::new(), Vec::new());
        for trial in 0..10 {
            let (q, mut v, a, mut tau) = (draw.some(n, 1.0), draw.some(n, 1.0), draw.some(n, 2.0), vec![0.0; n]);
            if trial < 5 {
                plant.residual(&q, &v, &a, &vec![0.0; n], &vec![STANDSTILL; n], &mut tau);
                tau.iter_mut().for_each(|tau| *tau = -*tau);
                wanted.push(a);
            } else {
                // At rest under what holds the arm against gravity, or nearly so.
                v.fill(0.0);
                plant.residual(&q, &v, &v, &vec![0.0; n], &vec![0.0; n], &mut tau);
                tau.iter_mut().for_each(|tau| *tau = -*tau);
                wanted.push(vec![0.0; n]);
            }
            command(&mut commands, 'f', &[&q, &v, &tau]);
        }
        let folder = tempfile::tempdir().unwrap();
        let told = run(folder.path(), &code(&xml, &loaded, &corrected, 1e-3), &commands);
        for (wanted, told) in wanted.iter().zip(&told) {
            same(wanted, told, loaded.model.name());
        }
    }
}

#[test]
fn a_residual_network_is_read_from_disk_and_added() {
    if !has_compiler() {
        return;
    }
    let arm = Model::from_urdf(robots::double_pendulum()).unwrap();
    let (n, dt) = (2, 5e-3);
    let corrected = corrected(&arm.model, effects(CASES[1], &arm.model), EncoderSide::Link);
    let code = code(robots::double_pendulum(), &arm, &corrected, dt);
    for (on, activation) in [
        (On::NextState, Activation::Tanh),
        (On::Acceleration, Activation::Relu),
        (On::Torque, Activation::Sigmoid),
        (On::Torque, Activation::Identity),
    ] {
        let network = Mlp::<f32>::new(&[3 * n, 16, 9, on.outputs(n)], activation, Init::Xavier, 5).unwrap();
        let physics = corrected.plant(&arm.model, dt).unwrap();
        let mut hybrid = Hybrid::new(physics, Net::new(network.cast::<f64>()), on).unwrap();
        let mut draw = Draw(Pcg64::seed_from_u64(2));
        let (q, v) = (draw.some(n, 1.0), draw.some(n, 1.0));
        let (mut commands, mut wanted) = (String::from("w residual.bin\n"), vec![vec![0.0]]);
        command(&mut commands, 's', &[&q, &v]);
        let mut x = vec![0.0; hybrid.state_len()];
        hybrid.start(&q, &v, &mut x);
        for _ in 0..20 {
            let tau = draw.some(n, 1.0);
            command(&mut commands, 'h', &[&tau]);
            hybrid.step(&mut x, &tau);
            wanted.push(x[..2 * n].to_vec());
        }
        // Files that are none, or cut off, or for another robot, are refused.
        let folder = tempfile::tempdir().unwrap();
        let bytes = weights(&network, on, n, dt);
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
        write("residual.bin", &bytes);
        write("cut.bin", &bytes[..bytes.len() - 1]);
        write("long.bin", &[&bytes[..], &[0]].concat());
        write("other.bin", &weights(&network, on, n, 2.0 * dt));
        write("text.bin", b"time,position");
        commands += "w none.bin\nw cut.bin\nw long.bin\nw other.bin\nw text.bin\n";
        wanted.extend([1.0, 2.0, 2.0, 2.0, 2.0].map(|code| vec![code]));
        let told = run(folder.path(), &code, &commands);
        assert_eq!(told.len(), wanted.len());
        for (wanted, told) in wanted.iter().zip(&told) {
            same(wanted, told, &format!("{on:?} {activation}"));
        }
    }
}
