//! Clocks and encoders as servo buses have them: they neither invent an effect nor hide one.

use gapscope_datasets::{Episode, Fault, FaultKind, find_faults, mend};
use gapscope_dynamics::Model;
use gapscope_servo::schema::Diagnosis;
use gapscope_servo::{Given, Law, Param, diagnose, joints, simulate_arm};

const PENDULUM: &str = r#"<robot name="one"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 0.06"/><mass value="0.2"/><inertia ixx="3e-4" iyy="3e-4" izz="3e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="5" velocity="9"/></joint>
</robot>"#;

/// Hz.
const RATE: f64 = 50.0;
/// A step of a 12-bit encoder, rad.
const TICK: f64 = std::f64::consts::TAU / 4096.0;
/// N m/rad.
const STIFFNESS: f64 = 6.0;

fn model() -> Model {
    Model::from_urdf(PENDULUM).unwrap().model
}

/// A clock: its jitter and when a row's set point arrives, both as parts of an interval, and every how many samples one repeats
/// the one before.
struct Clock {
    jitter: f64,
    arrives: f64,
    repeats: usize,
}

/// Logs of 16 s of a servo with dry friction, taken by a clock and stamped with its nominal rate.
fn logs(model: &Model, clock: &Clock, effects: impl Fn(&mut Law)) -> Vec<Episode> {
    let mut law = Law::default();
    law[Param::Scale] = 1.0 / STIFFNESS;
    law[Param::Damping] = 0.06;
    law[Param::Latency] = clock.arrives / RATE;
    effects(&mut law);
    let log = |run: i32| {
        let nominal: Vec<f64> = (0..800).map(|k| f64::from(k) / RATE).collect();
        let stray = |k: usize| clock.jitter * (12.9898 * k as f64 + f64::from(run)).sin();
        let time: Vec<f64> = nominal.iter().enumerate().map(|(k, t)| t + stray(k) / RATE).collect();
        let told = |t: f64| {
            let step = if t > 1.0 && (t * 0.4).fract() > 0.5 { 0.25 } else { -0.15 };
            0.5 * ((1.1 + 0.3 * f64::from(run)) * t).sin() + 0.15 * (2.9 * t).sin() + step
        };
        let command: Vec<f64> = time.iter().map(|&t| told(t)).collect();
        let start = Episode {
            name: format!("run_{run}.csv"),
            joints: vec!["a".into()],
            position: vec![vec![command[0]; time.len()]],
            command: Some(vec![command]),
            time,
            ..Episode::default()
        };
        let mut plain = joints(model, std::slice::from_ref(&start), &Given::default());
        plain.iter_mut().flat_map(|joint| &mut joint.runs).for_each(|run| run.step = 1e-3);
        let mut position = simulate_arm(model, &[Some(law)], &plain, 0);
        position[0].iter_mut().for_each(|q| *q = (*q / TICK).round() * TICK);
        for k in (1..nominal.len()).filter(|k| clock.repeats > 0 && k % clock.repeats == 0) {
            position[0][k] = position[0][k - 1];
        }
        Episode { position, time: nominal, ..start }
    };
    (0..2).map(log).collect()
}

fn found(model: &Model, logs: &[Episode]) -> Diagnosis {
    diagnose(model, logs, &Given::default(), Vec::new(), &|_, _| {}).unwrap().diagnosis
}

fn kinds(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.effects.iter().map(|effect| effect.kind.as_str()).collect()
}

#[test]
fn jitter_repeats_and_set_points_between_samples_invent_nothing_and_hide_no_friction() {
    let model = model();
    for (jitter, arrives, repeats) in [(0.1, 0.0, 0), (0.0, 0.6, 0), (0.0, -0.4, 0), (0.0, 0.0, 40), (0.1, 0.3, 50)] {
        let clock = Clock { jitter, arrives, repeats };
        let diagnosis = found(&model, &logs(&model, &clock, |law| law[Param::Coulomb] = 0.03));
        assert_eq!(kinds(&diagnosis), ["coulomb_friction"], "{jitter} {arrives} {repeats}");
        let coulomb = diagnosis.effects[0].parameters["coulomb"].at("a").unwrap().value;
        assert!((coulomb / (0.03 * STIFFNESS) - 1.0).abs() < 0.1, "{jitter} {arrives} {repeats}: {coulomb}");
        let stiffness = diagnosis.drive["a"].constants["stiffness"].value;
        assert!((stiffness / STIFFNESS - 1.0).abs() < 0.1, "{jitter} {arrives} {repeats}: {stiffness}");
        // Readings that were lost are no error of a model.
        let left = diagnosis.shrink.position.after.unwrap();
        assert!(jitter > 0.0 || left < 1.3 * TICK / 12f64.sqrt(), "{arrives} {repeats}: {left}");
        // Stamps that were counted are said to be so.
        assert!(diagnosis.data.findings.iter().any(|finding| finding.contains("nominal rate")));
    }
}

#[test]
fn degrees_about_a_calibration_middle_are_mended_and_the_middle_is_a_zero_offset() {
    let model = model();
    let clock = Clock { jitter: 0.0, arrives: 0.0, repeats: 0 };
    let middle = 0.12;
    let mut logs = logs(&model, &clock, |law| law[Param::Coulomb] = 0.03);
    for log in &mut logs {
        let command = log.command.iter_mut().flatten();
        log.position.iter_mut().chain(command).flatten().for_each(|x| *x = (*x + middle).to_degrees());
    }
    let faults = find_faults(&model, &logs);
    let said: Vec<FaultKind> = faults.faults.iter().map(|fault: &Fault| fault.kind).collect();
    assert_eq!(said, [FaultKind::PositionScale]);
    let (_, mended) = mend(&model, &logs, &faults.faults);
    let diagnosis = found(&model, &mended);
    let offset = diagnosis.effects.iter().find(|effect| effect.kind == "joint_zero_offset");
    let offset = offset.unwrap_or_else(|| panic!("no offset among {:?}", diagnosis.effects));
    let value = offset.parameters["offset"].at("a").unwrap().value;
    assert!((value - middle).abs() < 0.03, "{value}");
    assert_eq!(kinds(&diagnosis).len(), 2, "{:?}", diagnosis.effects);
}
