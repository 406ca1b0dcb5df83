//! Each rule of `check_logs` fires on the fault that it is for, on a simulated arm, and on nothing else.

use gapscope_datasets::{Episode, check_logs};
use gapscope_dynamics::{Data, Model};

const URDF: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="turret"><inertial><origin xyz="0 0 0.1"/><mass value="4"/><inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.02"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="3"/><inertia ixx="0.005" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.04"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1.5"/><inertia ixx="0.002" ixy="0" ixz="0" iyy="0.015" iyz="0" izz="0.015"/></inertial></link>
  <joint name="yaw" type="revolute"><parent link="base"/><child link="turret"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9" effort="80" velocity="6"/></joint>
  <joint name="shoulder" type="revolute"><parent link="turret"/><child link="upper"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="30" velocity="6"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="30" velocity="6"/></joint>
</robot>"#;

const DT: f64 = 0.002;

fn model() -> Model {
    Model::from_urdf(URDF).unwrap().model
}

/// Evenly spread in [-1, 1], the same at every call.
fn noise(seed: usize) -> f64 {
    let mut x = (seed as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
}

/// A run of ten seconds with friction and a little noise.
fn run(model: &Model, seed: usize) -> Episode {
    let mut data = Data::new(model);
    let mut episode = Episode {
        name: format!("run_{seed}.csv"),
        joints: model.joints().iter().map(|joint| joint.name.clone()).collect(),
        position: vec![vec![]; 3],
        velocity: Some(vec![vec![]; 3]),
        effort: vec![vec![]; 3],
        command: Some(vec![vec![]; 3]),
        ..Episode::default()
    };
    for k in 0..5000 {
        let t = k as f64 * DT;
        let (mut q, mut v, mut a, mut tau) = ([0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]);
        for j in 0..3 {
            for h in 1..4 {
                let w = 0.9 * h as f64 * (1.0 + 0.13 * j as f64);
                let (size, phase) = (0.5 / h as f64, 3.0 * noise(100 * seed + 10 * j + h));
                q[j] += size * (w * t + phase).sin();
                v[j] += size * w * (w * t + phase).cos();
                a[j] -= size * w * w * (w * t + phase).sin();
            }
        }
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        episode.time.push(t);
        for j in 0..3 {
            let n = |channel: usize| noise(k + 5000 * (j + 3 * (channel + 4 * seed)));
            episode.position[j].push(q[j] + 2e-6 * n(0));
            episode.velocity.as_mut().unwrap()[j].push(v[j] + 5e-4 * n(1));
            episode.effort[j].push(tau[j] + 0.8 * v[j] + 0.5 * (v[j] / 0.02).tanh() + 0.02 * n(2));
            episode.command.as_mut().unwrap()[j].push(q[j]);
        }
    }
    episode
}

/// The findings for two runs that went through `spoil`.
fn findings(spoil: impl Fn(&mut Episode)) -> Vec<String> {
    let model = model();
    let mut runs = [run(&model, 1), run(&model, 2)];
    runs.iter_mut().for_each(&spoil);
    check_logs(&model, &runs).iter().map(ToString::to_string).collect()
}

/// Exactly one finding, about these joints, that holds this word.
#[track_caller]
fn only(about: &str, word: &str, spoil: impl Fn(&mut Episode)) -> String {
    let findings = findings(spoil);
    assert!(findings.len() == 1 && findings[0].starts_with(&format!("{about}:")), "{about}: {word}: {findings:#?}");
    assert!(findings[0].contains(word), "{word}: {findings:#?}");
    findings[0].clone()
}

fn scale(samples: &mut [Vec<f64>], factor: f64) {
    samples.iter_mut().flatten().for_each(|x| *x *= factor);
}

fn velocity(episode: &mut Episode) -> &mut [Vec<f64>] {
    episode.velocity.as_mut().unwrap()
}

#[test]
fn a_healthy_log_gives_no_finding() {
    assert_eq!(findings(|_| {}), [""; 0]);
    assert_eq!(findings(|run| run.velocity = None), [""; 0]);
}

#[test]
fn positions_in_degrees() {
    let all = "yaw, shoulder, elbow";
    let degrees = 180.0 / std::f64::consts::PI;
    only(all, "position is in degrees", |run| scale(&mut run.position, degrees));
    only(all, "position is in degrees", |run| {
        scale(&mut run.position, degrees);
        scale(velocity(run), degrees);
    });
    let line = only(all, "position is in degrees", |run| {
        scale(&mut run.position, degrees);
        run.velocity = None;
    });
    assert!(line.contains("torque fits the model only") && line.contains("scale = 0.01745329251994329"), "{line}");
}

#[test]
fn velocity_that_is_not_the_derivative_of_position() {
    only("all joints", "degrees per second", |run| scale(velocity(run), 57.29578));
    only("all joints", "opposite sign to the derivative", |run| scale(velocity(run), -1.0));
    only("elbow", "1.2 times the derivative", |run| scale(&mut velocity(run)[2..], 1.2));
    only("all joints", "10 ms later", |run| velocity(run).iter_mut().for_each(|v| v.rotate_right(5)));
    only("shoulder", "is 0 throughout", |run| velocity(run)[1].fill(0.0));
    only("shoulder", "does not follow", |run| velocity(run)[1].iter_mut().enumerate().for_each(|(k, v)| *v = noise(k)));
    let swapped = findings(|run| velocity(run).swap(0, 2));
    assert!(swapped.len() == 2 && swapped[0].contains("derivative of the position of elbow"), "{swapped:#?}");
}

#[test]
fn velocity_that_is_coarse_or_noisy() {
    only("yaw", "velocity has steps of 0.3", |run| {
        velocity(run)[0].iter_mut().for_each(|v| *v = (*v / 0.3).round() * 0.3);
    });
    only("yaw", "times as noisy", |run| {
        velocity(run)[0].iter_mut().enumerate().for_each(|(k, v)| *v += 0.3 * noise(k));
    });
}

#[test]
fn effort_against_the_model() {
    only("yaw, shoulder, elbow", "effort has the opposite sign", |run| scale(&mut run.effort, -1.0));
    only("shoulder", "counted the other way round", |run| scale(&mut run.effort[1..2], -1.0));
    only("elbow", "effort is 0.00998 times the torque", |run| scale(&mut run.effort[2..], 0.01));
    only("yaw", "effort is 0 throughout", |run| run.effort[0].fill(0.0));
    only("shoulder", "above the URDF's limit", |run| scale(&mut run.effort[1..2], 4.0));
}

#[test]
fn a_robot_that_hangs_upside_down() {
    let model = model();
    let hanging = model.clone().with_gravity(-model.gravity());
    let runs = [run(&hanging, 1), run(&hanging, 2)];
    let findings: Vec<String> = check_logs(&model, &runs).iter().map(ToString::to_string).collect();
    assert!(findings.len() == 1 && findings[0].contains("upside down"), "{findings:#?}");
}

#[test]
fn a_known_disturbance_is_part_of_the_torque() {
    assert_eq!(
        findings(|run| {
            let effort = run.effort.clone();
            scale(&mut run.effort, 3.0);
            let rest = |(e, f): (&Vec<f64>, &Vec<f64>)| e.iter().zip(f).map(|(e, f)| e - f).collect();
            run.disturbance = Some(effort.iter().zip(&run.effort).map(rest).collect());
        })
        .iter()
        .filter(|line| !line.contains("limit"))
        .count(),
        0
    );
}

#[test]
fn joints_in_another_order() {
    let line = only("shoulder, elbow", "joints seem to be in another order", |run| {
        run.position.swap(1, 2);
        run.effort.swap(1, 2);
        run.velocity = None;
    });
    assert!(line.contains("shoulder is logged as elbow"), "{line}");
    only("shoulder, elbow", "efforts seem to be in another order", |run| run.effort.swap(1, 2));
    only("yaw, elbow", "another order", |run| run.effort.swap(0, 2));
}

#[test]
fn single_samples_that_jump() {
    let line = only("shoulder", "single samples that jump (3 in a log)", |run| {
        run.position[1][1000] += 0.02;
        run.position[1][2000] -= 0.5;
        run.position[1][3000] = 0.0;
    });
    assert!(line.contains("the course of their neighbours"), "{line}");
}

#[test]
fn an_angle_that_wraps() {
    only("yaw", "wrapped", |run| {
        run.velocity = None;
        run.position[0].iter_mut().skip(2000).for_each(|q| *q += std::f64::consts::TAU);
        run.position[0].iter_mut().skip(2500).for_each(|q| *q -= std::f64::consts::TAU);
    });
}

#[test]
fn a_coarse_encoder() {
    only("elbow", "encoder's step is 0.002 rad", |run| {
        run.velocity = None;
        run.position[2].iter_mut().for_each(|q| *q = (*q / 0.002).round() * 0.002);
    });
}

#[test]
fn samples_that_repeat() {
    let repeat = |samples: &mut [Vec<f64>], every: usize| {
        for row in samples {
            for k in 1..row.len() {
                if k % every != 0 {
                    row[k] = row[k - 1];
                }
            }
        }
    };
    let stale = findings(|run| {
        repeat(&mut run.position, 2);
        repeat(&mut run.effort, 2);
        run.velocity = None;
    });
    assert!(stale.iter().all(|line| line.contains("repeat the one before in every channel")), "{stale:#?}");
    assert!(stale.len() == 2 && stale[0].starts_with("run_1.csv: 50"), "{stale:#?}");
    only("all joints", "comes at about 125 Hz", |run| {
        repeat(&mut run.position, 4);
        run.velocity = None;
    });
    only("shoulder", "repeat the position before", |run| {
        (20..5000).step_by(40).for_each(|k| run.position[1][k] = run.position[1][k - 1]);
        run.velocity = None;
    });
}

#[test]
fn a_joint_that_does_not_move() {
    let model = model();
    let mut still = run(&model, 1);
    still.position[0].iter_mut().enumerate().for_each(|(k, q)| *q = 0.3 + 1e-6 * noise(k));
    still.velocity = None;
    let findings: Vec<String> = check_logs(&model, &[still.clone()]).iter().map(ToString::to_string).collect();
    assert!(findings.iter().any(|line| line.starts_with("yaw: does not move")), "{findings:#?}");
    // In one log of two it may rest.
    let findings = check_logs(&model, &[still, run(&model, 2)]);
    assert!(findings.iter().all(|finding| !finding.message.contains("does not move")), "{findings:#?}");
}

#[test]
fn limits_that_are_passed() {
    let model = model();
    let mut runs = [run(&model, 1)];
    runs[0].position[0].iter_mut().for_each(|q| *q += 2.5);
    let findings: Vec<String> = check_logs(&model, &runs).iter().map(ToString::to_string).collect();
    assert!(findings.len() == 1 && findings[0].contains("yaw in run_1.csv: the position passes"), "{findings:#?}");
    let mut runs = [run(&model, 1)];
    runs[0].time.iter_mut().for_each(|t| *t *= 0.2);
    runs[0].velocity = None;
    let findings: Vec<String> = check_logs(&model, &runs).iter().map(ToString::to_string).collect();
    assert!(findings.iter().any(|line| line.contains("velocity limit")), "{findings:#?}");
}

#[test]
fn a_command_from_unset_memory() {
    only("elbow", "cannot be", |run| run.command.as_mut().unwrap()[2][4000] = -5e235);
}

#[test]
fn episodes_of_another_robot_or_without_samples_are_passed_over() {
    let model = model();
    let mut other = run(&model, 1);
    other.position.pop();
    assert!(check_logs(&model, &[other, Episode::default(), run(&model, 1).part(0, 10, "short")]).is_empty());
    assert!(check_logs(&model, &[]).is_empty());
}

#[test]
fn wild_numbers_do_not_panic() {
    for wild in [1e300, -1e300, 1e-300] {
        for count in [20, 25, 61, 400] {
            let model = model();
            let mut episode = run(&model, 3).part(0, count, "wild");
            episode.position[1][count / 2] = wild;
            episode.effort[0][count / 3] = wild;
            episode.velocity.as_mut().unwrap()[2].iter_mut().for_each(|v| *v *= wild);
            let _ = check_logs(&model, &[episode]);
        }
    }
}
