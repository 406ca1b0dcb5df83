//! The next experiment of a servo arm, logged on the arm that was found: whether it tells what it promises.

use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use gapscope_servo::schema::Diagnosis;
use gapscope_servo::{Given, Law, Outcome, Param, diagnose, follow, joints, simulate_arm};

const ARM: &str = r#"<robot name="one"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 -0.1"/><mass value="0.4"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5" velocity="9"/></joint>
</robot>"#;

/// A step of a 12-bit encoder, rad.
const TICK: f64 = std::f64::consts::TAU / 4096.0;

fn rounded(mut log: Episode) -> Episode {
    log.position.iter_mut().flatten().for_each(|q| *q = (*q / TICK).round() * TICK);
    log
}

/// A slow and small motion of an arm with dry friction, at 100 Hz.
fn poor(model: &Model, amplitude: f64, seconds: f64) -> Episode {
    let time: Vec<f64> = (0..).map(|k| 0.01 * f64::from(k)).take_while(|t| *t < seconds).collect();
    let command: Vec<f64> = time.iter().map(|t| amplitude * (1.3 * t).sin()).collect();
    let log = Episode {
        name: "poor.csv".into(),
        joints: vec!["a".into()],
        position: vec![vec![0.0; time.len()]],
        command: Some(vec![command]),
        time,
        ..Episode::default()
    };
    let mut law = Law::default();
    law[Param::Scale] = 1.0 / 4.0;
    law[Param::Damping] = 0.05;
    law[Param::Coulomb] = 0.03;
    let all = joints(model, std::slice::from_ref(&log), &Given::default());
    rounded(Episode { position: simulate_arm(model, &[Some(law)], &all, 0), ..log })
}

fn found(model: &Model, logs: &[Episode]) -> Outcome {
    diagnose(model, logs, &Given::default(), Vec::new(), &|_, _| {}).unwrap()
}

/// Half the interval of the drive's constant over its size.
fn part(diagnosis: &Diagnosis, constant: &str) -> f64 {
    let found = &diagnosis.drive["a"].constants[constant];
    match found.ci95 {
        [Some(low), Some(high)] => 0.5 * (high - low) / found.value.abs(),
        _ => f64::INFINITY,
    }
}

#[test]
fn what_it_promises_comes_true_on_the_arm_that_was_found() {
    let model = Model::from_urdf(ARM).unwrap().model;
    let log = poor(&model, 0.05, 3.0);
    let first = found(&model, std::slice::from_ref(&log));
    let next = first.diagnosis.next_experiment.clone().expect("something is told badly");
    let known = format!("stiffness at a is known to {:.0} %", 100.0 * part(&first.diagnosis, "stiffness"));
    assert!(next.why.contains(&known) && next.motion.contains("to about 1 %"), "{known}: {next:?}");
    let motion = first.trajectory.as_ref().expect("set points");
    let more = follow(&model, &first.corrected, "next.csv", motion.time.clone(), motion.position.clone()).unwrap();
    let second = found(&model, &[log, rounded(more)]);
    let [before, after] = [&first, &second].map(|outcome| part(&outcome.diagnosis, "stiffness"));
    assert!(before > 0.1 && after < 0.015, "{before} -> {after}");
    assert!(second.diagnosis.next_experiment.is_none_or(|next| !next.why.contains("stiffness")));
}

#[test]
fn an_arm_that_stands_is_told_to_move_within_its_limits() {
    let model = Model::from_urdf(ARM).unwrap().model;
    let outcome = found(&model, &[poor(&model, 0.0, 3.0)]);
    assert_eq!(outcome.diagnosis.verdict, "not_excited");
    let next = outcome.diagnosis.next_experiment.expect("a motion");
    assert!(next.why.contains("hardly move"), "{next:?}");
    let path = &outcome.trajectory.expect("set points").position[0];
    let (low, high) = path.iter().fold((0.0_f64, 0.0_f64), |(a, b), q| (a.min(*q), b.max(*q)));
    assert!(low < -0.5 && high > 0.5 && low > -3.0 && high < 3.0, "{low} to {high}");
}
