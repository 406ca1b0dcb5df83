//! Faults of the data: each found on a simulated, used robot, with its joints and its size, and none on a healthy one.

use crate::common::{built_in, drives};
use gapscope_datasets::{
    Channel, Doubt, Episode, Fault, FaultKind, Faults, Perturbation, Recipe, Sensors, find_faults, generate, mend,
};
use gapscope_dynamics::Model;
use std::f64::consts::PI;

/// Logs of a used robot: bodies a little off, friction and rotors that the model lacks, sensors as they are.
fn logs(model: &Model, seed: u64, count: u64) -> Vec<Episode> {
    let mut effects = drives(model);
    effects.extend(Perturbation { coulomb: 0.0, viscous: 0.0, ..Perturbation::default() }.draw(model, seed));
    let sensors =
        Sensors { encoder_step: 1e-5, effort_noise: 0.005, velocity_cutoff: Some(40.0), ..Sensors::default() };
    let log = |e| {
        let recipe = Recipe { seconds: 10.0, rate: 250.0, sensors, ..Recipe::default() };
        generate(model, &effects, 100 * seed + e, &recipe, &format!("run_{e}.csv")).unwrap()
    };
    (0..count).map(log).collect()
}

fn found(model: &Model, seed: u64, spoil: impl Fn(&mut Episode)) -> Faults {
    let mut logs = logs(model, seed, 2);
    logs.iter_mut().for_each(spoil);
    find_faults(model, &logs)
}

fn times(samples: &mut [f64], factor: f64) {
    samples.iter_mut().for_each(|x| *x *= factor);
}

fn names(model: &Model, joints: &[usize]) -> Vec<String> {
    joints.iter().map(|&j| model.joints()[j].name.clone()).collect()
}

/// Exactly one fault, of this kind, joints and factor, in all logs.
#[track_caller]
fn only(faults: &Faults, kind: FaultKind, joints: Vec<String>, factor: Option<f64>) -> Fault {
    let [fault] = faults.faults.as_slice() else { panic!("{faults:#?}") };
    assert!(
        (fault.kind, &fault.joints) == (kind, &joints) && fault.files.is_empty(),
        "{kind:?} {joints:?}: {fault:#?}"
    );
    if let (Some(found), Some(true_one)) = (fault.factor, factor) {
        assert!((found / true_one - 1.0).abs() < 0.02, "{found} is not {true_one}: {fault:#?}");
    }
    fault.clone()
}

const ROBOTS: [&str; 3] = ["double_pendulum", "arm6", "arm7"];

#[test]
fn a_healthy_used_robot_has_no_fault() {
    for name in ROBOTS {
        for seed in 0..3 {
            let model = built_in(name);
            let faults = found(&model, seed, |_| {});
            assert_eq!(faults, Faults::default(), "{name} {seed}");
        }
    }
}

#[test]
fn effort_in_another_unit_or_of_the_other_sign() {
    for name in ROBOTS {
        let model = built_in(name);
        let n = model.dof();
        let all = names(&model, &(0..n).collect::<Vec<_>>());
        for (factor, sign) in [(1e3, 1.0), (141.612, 1.0), (0.25, 1.0), (1.0 / 35.0, 1.0), (1.0, -1.0), (3.0, 1.0)] {
            let faults = found(&model, 1, |log| log.effort.iter_mut().for_each(|x| times(x, sign * factor)));
            let kind = if sign < 0.0 { FaultKind::EffortSign } else { FaultKind::EffortScale };
            let named = [1e3, 141.612].contains(&factor) || sign < 0.0;
            let fault = only(&faults, kind, all.clone(), named.then_some(sign * factor));
            let ratio = fault.factor.unwrap() / (sign * factor);
            assert!((ratio - 1.0).abs() < 0.08, "{name} {factor}: {fault:#?}");
        }
        let faults = found(&model, 2, |log| times(&mut log.effort[1], 1e3));
        only(&faults, FaultKind::EffortScale, names(&model, &[1]), Some(1e3));
        let faults = found(&model, 2, |log| times(&mut log.effort[1], -1.0));
        only(&faults, FaultKind::EffortSign, names(&model, &[1]), Some(-1.0));
    }
}

#[test]
fn positions_in_another_unit_of_the_other_sign_or_from_another_zero() {
    let degrees = 180.0 / PI;
    for (name, factor) in ROBOTS.into_iter().zip([100.0, degrees, 65536.0 / (2.0 * PI)]) {
        let model = built_in(name);
        let n = model.dof();
        let all: Vec<usize> = (0..n).collect();
        let without_velocity = |log: &mut Episode| log.velocity = None;
        let faults = found(&model, 1, |log| {
            without_velocity(log);
            log.position.iter_mut().for_each(|x| times(x, degrees));
        });
        only(&faults, FaultKind::PositionScale, names(&model, &all), Some(degrees));
        let faults = found(&model, 2, |log| {
            without_velocity(log);
            times(&mut log.position[1], factor);
        });
        only(&faults, FaultKind::PositionScale, names(&model, &[1]), Some(factor));
        let faults = found(&model, 3, |log| {
            without_velocity(log);
            times(&mut log.position[1], -1.0);
        });
        only(&faults, FaultKind::PositionSign, names(&model, &[1]), None);
        // Of a planar pendulum the mirror image is another pendulum.
        if name != "double_pendulum" {
            let faults = found(&model, 3, |log| {
                without_velocity(log);
                times(&mut log.position[1], -1.0);
                times(&mut log.effort[1], -1.0);
            });
            // Half a turn of the next joint is nearly the same robot in a mirror: then it is asked, and nothing is mended.
            let asked = faults.doubts.iter().any(|doubt| doubt.question.contains("the other way round"));
            if !(asked && faults.faults.is_empty()) {
                only(&faults, FaultKind::AxisSign, names(&model, &[1]), None);
            }
        }
        for zero in [PI / 2.0, -0.7] {
            let faults = found(&model, 4, |log| log.position[1].iter_mut().for_each(|q| *q += zero));
            // Known: a link that is described badly looks the same where little hangs on the joint; then nothing is said, and
            // nothing else either.
            let may_hide = name == "double_pendulum" || zero == -0.7;
            if !(may_hide && faults.faults.is_empty()) {
                only(&faults, FaultKind::PositionZero, names(&model, &[1]), Some(zero));
            }
        }
    }
}

#[test]
fn another_clock() {
    for name in ROBOTS {
        let model = built_in(name);
        for (factor, velocity) in [(1e3, true), (1e3, false), (1e6, true), (0.5, false), (2.0, false), (2.0, true)] {
            let faults = found(&model, 1, |log| {
                times(&mut log.time, factor);
                if !velocity {
                    log.velocity = None;
                }
            });
            // A unit with a name and a measured velocity tell a clock; without them bodies that are off by 7 % move it by half.
            let told = velocity || factor >= 1e3;
            // On a slow robot it is then no more than rotors that the description lacks: it is asked, or nothing is said, and
            // nothing else either.
            let of_clock = |doubt: &Doubt| doubt.question.contains("clock");
            if !told && faults.faults.is_empty() && faults.doubts.iter().all(of_clock) {
                continue;
            }
            let fault = only(&faults, FaultKind::TimeScale, vec![], told.then_some(factor));
            let ratio = fault.factor.unwrap() / factor;
            assert!((ratio - 1.0).abs() < 0.05, "{name} {factor}: {fault:#?}");
        }
    }
}

#[test]
fn joints_under_each_others_names() {
    for name in ["arm6", "arm7"] {
        let model = built_in(name);
        let faults = found(&model, 1, |log| log.effort.swap(1, 2));
        only(&faults, FaultKind::JointOrder, names(&model, &[1, 2]), None);
        let faults = found(&model, 1, |log| {
            for channel in [Channel::Position, Channel::Velocity, Channel::Effort] {
                let part = |log: &mut Episode| match channel {
                    Channel::Position => log.position.swap(1, 3),
                    Channel::Effort => log.effort.swap(1, 3),
                    _ => log.velocity.as_mut().unwrap().swap(1, 3),
                };
                part(log);
            }
        });
        only(&faults, FaultKind::JointOrder, names(&model, &[1, 3]), None);
    }
}

#[test]
fn effort_that_says_nothing_leaves_its_joint_out() {
    for name in ROBOTS {
        let model = built_in(name);
        let one = names(&model, &[1]);
        let fault = only(&found(&model, 1, |log| log.effort[1].fill(0.0)), FaultKind::EffortMissing, one.clone(), None);
        assert!(!fault.mended);
        only(&found(&model, 1, |log| log.effort[1].fill(5.0)), FaultKind::EffortMissing, one.clone(), None);
        let faults = found(&model, 1, |log| {
            let noise = |k: usize| {
                let x = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                ((x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            log.effort[1].iter_mut().enumerate().for_each(|(k, x)| *x = 100.0 * noise(k));
        });
        only(&faults, FaultKind::EffortNoise, one, None);
    }
}

#[test]
fn angles_that_wrap_readings_that_repeat_and_channels_of_other_instants() {
    for name in ROBOTS {
        let model = built_in(name);
        // About a vertical axis any zero does.
        if name != "double_pendulum" {
            let faults = found(&model, 1, |log| {
                log.velocity = None;
                let (low, high) = log.position[0].iter().fold((9.0_f64, -9.0_f64), |(l, h), q| (l.min(*q), h.max(*q)));
                let middle = 0.5 * (low + high);
                log.position[0].iter_mut().for_each(|q| *q = (*q - middle).rem_euclid(2.0 * PI) - PI);
            });
            only(&faults, FaultKind::PositionWrapped, names(&model, &[0]), None);
        }
        let faults = found(&model, 1, |log| {
            for x in log.position.iter_mut().chain(log.velocity.iter_mut().flatten()) {
                (0..x.len()).for_each(|k| x[k] = x[k - k % 5]);
            }
        });
        only(&faults, FaultKind::RepeatedSamples, vec![], Some(5.0));
        let faults = found(&model, 1, |log| log.effort.iter_mut().for_each(|x| x.rotate_left(20)));
        let all = names(&model, &(0..model.dof()).collect::<Vec<_>>());
        let fault = only(&faults, FaultKind::TimeShift, all, None);
        // Known: it is told some 6 ms too long, on all robots alike, where friction lacks in the model.
        let most = 0.010;
        assert!((fault.factor.unwrap() + 0.08).abs() < most, "{fault:#?}");
    }
}

#[test]
fn gravity_of_another_direction() {
    for name in ["arm6", "arm7"] {
        let model = built_in(name);
        let hanging = model.clone().with_gravity(-model.gravity());
        let logs = logs(&hanging, 3, 2);
        only(&find_faults(&model, &logs), FaultKind::Gravity, vec![], None);
    }
}

/// A carriage on a rail, as heavy as the first real one that was diagnosed.
fn slider() -> Model {
    let urdf = r#"<robot name="slider"><link name="base"/>
        <link name="carriage"><inertial><mass value="95"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <joint name="rail" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 0 0"/>
        <limit lower="-0.3" upper="0.3" effort="400" velocity="1"/></joint></robot>"#;
    Model::from_urdf(urdf).unwrap().model
}

#[test]
fn limits_tell_a_position_in_another_unit_and_masses_ask_for_one() {
    let model = slider();
    let without_velocity = |factor: f64, effort: f64| {
        found(&model, 1, |log| {
            log.velocity = None;
            times(&mut log.position[0], factor);
            times(&mut log.effort[0], effort);
        })
    };
    assert_eq!(without_velocity(1.0, 1.0), Faults::default());
    only(&without_velocity(1e3, 1.0), FaultKind::PositionScale, names(&model, &[0]), Some(1e3));
    // Counts have no name, and a carriage is known by some per cent: the size is near.
    let counts = 65536.0;
    let fault = only(&without_velocity(counts, 1.0), FaultKind::PositionScale, names(&model, &[0]), None);
    assert!((fault.factor.unwrap() / counts - 1.0).abs() < 0.15, "{fault:#?}");
    // A part of the effort, or a multiple, may be another carriage, or a rotor: it is asked, or beyond doubt, and never silent.
    for effort in [0.25, 1.0 / 35.0, 0.5, 2.0, 3.0] {
        let faults = without_velocity(1.0, effort);
        assert!(!faults.faults.is_empty() || !faults.doubts.is_empty(), "{effort}: nothing is said");
    }
}

#[test]
fn what_one_log_has_by_itself_is_no_fault_where_it_does_not_make_it_one_of_the_others() {
    let model = built_in("arm7");
    let mut logs = logs(&model, 6, 3);
    // Somebody pushes in one log: it is not like the others, and no fault of the data.
    for (k, x) in logs[1].effort[1].iter_mut().enumerate() {
        *x += if (800..1500).contains(&k) { 25.0 } else { 0.0 };
    }
    assert_eq!(find_faults(&model, &logs).faults, []);
}

#[test]
fn one_log_of_several_is_named() {
    let model = built_in("arm6");
    let mut logs = logs(&model, 5, 3);
    logs[1].position.iter_mut().for_each(|x| times(x, 180.0 / PI));
    let faults = find_faults(&model, &logs);
    let [fault] = faults.faults.as_slice() else { panic!("{faults:#?}") };
    assert_eq!((fault.kind, fault.files.as_slice()), (FaultKind::PositionScale, &["run_1.csv".to_owned()][..]));
    let (_, mended) = mend(&model, &logs, &faults.faults);
    assert_eq!(find_faults(&model, &mended).faults, []);
}

#[test]
fn efforts_that_one_log_cuts_off_are_told_and_left_out() {
    let model = built_in("arm7");
    let mut logs = logs(&model, 3, 3);
    let most = logs[1].effort[1].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    logs[1].effort[1].iter_mut().for_each(|x| *x = x.clamp(-0.5 * most, 0.5 * most));
    let faults = find_faults(&model, &logs);
    let [fault] = faults.faults.as_slice() else { panic!("{faults:#?}") };
    assert_eq!((fault.kind, &fault.joints), (FaultKind::EffortClipped, &names(&model, &[1])));
    assert!(fault.files == ["run_1.csv"] && !fault.mended, "{fault:#?}");
}

/// The description with masses and inertias in grams.
fn in_grams(urdf: &str) -> String {
    let mut text = String::new();
    let mut rest = urdf;
    let names = ["mass value=\"", "ixx=\"", "ixy=\"", "ixz=\"", "iyy=\"", "iyz=\"", "izz=\""];
    while let Some(from) = names.iter().filter_map(|name| rest.find(name).map(|at| at + name.len())).min() {
        let end = from + rest[from..].find('"').unwrap();
        let number: f64 = rest[from..end].parse().unwrap();
        text += &format!("{}{}", &rest[..from], 1e3 * number);
        rest = &rest[end..];
    }
    text + rest
}

#[test]
fn a_description_in_grams_is_said_though_its_limits_are_not() {
    for name in ["arm6", "arm7"] {
        let model = built_in(name);
        let logs = logs(&model, 2, 2);
        let heavy = Model::from_urdf(&in_grams(gapscope_dynamics::robots::urdf(name).unwrap())).unwrap().model;
        let all = names(&model, &(0..model.dof()).collect::<Vec<_>>());
        let fault = only(&find_faults(&heavy, &logs), FaultKind::EffortScale, all, Some(1e-3));
        assert!(fault.evidence.contains("grams"), "{fault:#?}");
    }
}

#[test]
fn one_log_whose_effort_is_late_is_named() {
    let model = built_in("arm6");
    let mut logs = logs(&model, 5, 3);
    logs[1].effort.iter_mut().for_each(|x| x.rotate_right(25));
    let faults = find_faults(&model, &logs);
    let [fault] = faults.faults.as_slice() else { panic!("{faults:#?}") };
    assert_eq!((fault.kind, fault.files.as_slice()), (FaultKind::TimeShift, &["run_1.csv".to_owned()][..]));
    assert!((fault.factor.unwrap() - 0.1).abs() < 0.01, "{fault:#?}");
}

#[test]
fn stamps_of_one_log_in_another_unit_are_named() {
    let model = built_in("double_pendulum");
    let mut logs = logs(&model, 5, 3);
    times(&mut logs[2].time, 1e9);
    let faults = find_faults(&model, &logs);
    let [fault] = faults.faults.as_slice() else { panic!("{faults:#?}") };
    assert_eq!((fault.kind, fault.factor), (FaultKind::TimeScale, Some(1e9)));
    assert_eq!(fault.files, ["run_2.csv"]);
}
