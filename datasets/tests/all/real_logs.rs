//! Logs of real and simulated robots read as they stand, and give the findings that are known of them.

use gapscope_datasets::{
    ColumnMap, Episode, Faults, LogErrorKind, ReadOptions, check_logs, find_faults, read_logs, resample,
};
use gapscope_dynamics::{Finding, Model};
use std::path::{Path, PathBuf};

/// A folder beside the repository, or where the variable says; `None`, said plainly, where it is missing.
fn folder(variable: &str, default: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = std::env::var_os(variable).map_or_else(|| root.join(default), PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: there is no folder {} ({variable} names another)", folder.display());
        return None;
    }
    Some(folder)
}

struct Robot {
    model: Model,
    episodes: Vec<Episode>,
    /// What reading and checking found.
    read: Vec<String>,
    checked: Vec<String>,
}

fn lines(findings: &[Finding]) -> Vec<String> {
    findings.iter().map(ToString::to_string).collect()
}

fn robot(folder: &Path, options: &ReadOptions) -> Robot {
    let xml = std::fs::read_to_string(folder.join("robot.urdf")).unwrap();
    let model = Model::from_urdf(&xml).unwrap().model;
    let (episodes, read) = read_logs(&logs(folder), &joints(&model), options).unwrap();
    let checked = check_logs(&model, &episodes);
    println!("{}: {:#?} {:#?}", folder.display(), lines(&read), lines(&checked));
    Robot { model, episodes, read: lines(&read), checked: lines(&checked) }
}

fn logs(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "gz"));
    paths.sort();
    paths
}

fn joints(model: &Model) -> Vec<String> {
    model.joints().iter().map(|joint| joint.name.clone()).collect()
}

/// Each line holds the words of the same place.
#[track_caller]
fn hold(lines: &[String], words: &[&str]) {
    assert!(
        lines.len() == words.len() && lines.iter().zip(words).all(|(line, word)| line.contains(word)),
        "{lines:#?} do not hold {words:#?}"
    );
}

#[test]
fn emps_and_tx40_are_healthy() {
    let Some(data) = folder("GAPSCOPE_DATA", "../shared/data") else { return };
    for (name, samples) in [("emps", vec![24841, 24841]), ("tx40", vec![45000])] {
        let robot = robot(&data.join(name), &ReadOptions::default());
        assert_eq!(robot.episodes.iter().map(Episode::len).collect::<Vec<_>>(), samples);
        hold(&robot.read, &[]);
        hold(&robot.checked, &[]);
        for episode in &robot.episodes {
            let uniform = resample(episode, episode.dt());
            assert_eq!((&uniform.position, &uniform.effort), (&episode.position, &episode.effort));
        }
    }
}

#[test]
fn the_double_pendulum_jitters_and_has_a_coarse_encoder() {
    let Some(data) = folder("GAPSCOPE_DATA", "../shared/data") else { return };
    let robot = robot(&data.join("double_pendulum"), &ReadOptions::default());
    assert_eq!(robot.episodes.iter().map(Episode::len).collect::<Vec<_>>(), [4997, 1998, 1998, 21969]);
    hold(&robot.read, &["run_055640.csv.gz: 1 step of time is longer", "slow_74s.csv.gz: time jitters"]);
    hold(
        &robot.checked,
        &["encoder's step is 0.000381 rad", "Joint1 in run_060245.csv.gz: the velocity is 3.49 times as noisy"],
    );
}

#[test]
fn a_kinova_log_has_empty_cells_in_its_command_and_late_readings() {
    let Some(data) = folder("GAPSCOPE_DATA", "../shared/data") else { return };
    let folder = data.join("kinova_gen3");
    let model = Model::from_urdf(&std::fs::read_to_string(folder.join("robot.urdf")).unwrap()).unwrap().model;
    let error = read_logs(&logs(&folder), &joints(&model), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        (error.kind, error.row, error.column.as_deref()),
        (LogErrorKind::EmptyCell, Some(4723), Some("command.joint_2"))
    );
    assert!(error.hint.contains("ignore=command.*"), "{error}");

    let robot = robot(&folder, &ReadOptions { drop_bad_channels: true, ..ReadOptions::default() });
    assert_eq!(robot.episodes.iter().map(Episode::len).collect::<Vec<_>>(), [1942, 4741]);
    hold(&robot.read, &["opti_traj_testing1.csv.gz: row 4723, column `command.joint_2`: the cell is empty"]);
    hold(&robot.checked, &["RunTrajectory1.csv.gz: 1.06 to 1.31 % of the samples in motion repeat the position"]);
    let map = ColumnMap::from_pairs(&["ignore=command.*"]).unwrap();
    assert_eq!(
        read_logs(&logs(&folder), &joints(&model), &ReadOptions { map, ..ReadOptions::default() }).unwrap().0.len(),
        2
    );
}

#[test]
fn logs_of_the_bank_are_healthy_but_for_limits() {
    for case in bank_cases() {
        let robot = robot(&case, &ReadOptions::default());
        hold(&robot.read, &[]);
        assert_eq!(robot.episodes.len(), 3);
        let limits =
            |line: &&String| line.contains("velocity limit") || line.contains("the effort is above the URDF's limit");
        assert_eq!(robot.checked.iter().filter(|line| !limits(line)).count(), 0, "{:#?}", robot.checked);
    }
}

#[test]
fn no_healthy_log_has_a_fault() {
    let sets = ["emps", "tx40", "double_pendulum", "kinova_gen3", "kuka_lwr4"];
    let data = folder("GAPSCOPE_DATA", "../shared/data").into_iter();
    let folders = data.flat_map(|data| sets.map(|set| data.join(set))).chain(bank_cases());
    for folder in folders {
        let robot = robot(&folder, &ReadOptions { drop_bad_channels: true, ..ReadOptions::default() });
        let faults = find_faults(&robot.model, &robot.episodes);
        assert_eq!(faults, Faults::default(), "{}", folder.display());
    }
}

fn bank_cases() -> Vec<PathBuf> {
    let Some(bank) = folder("GAPSCOPE_BANK", "../shared/bank/sample") else { return Vec::new() };
    let mut cases: Vec<PathBuf> = std::fs::read_dir(bank).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.sort();
    cases
}

/// A fault put into healthy logs, and a word that its finding must hold.
struct Fault {
    name: &'static str,
    word: &'static str,
    inject: fn(&mut Episode),
}

fn each(samples: &mut [Vec<f64>], f: impl Fn(f64) -> f64) {
    samples.iter_mut().flatten().for_each(|x| *x = f(*x));
}

fn swap(episode: &mut Episode, i: usize, j: usize, effort_only: bool) {
    episode.effort.swap(i, j);
    if !effort_only {
        episode.position.swap(i, j);
        episode.velocity.iter_mut().for_each(|velocity| velocity.swap(i, j));
    }
}

const FAULTS: [Fault; 14] = [
    Fault { name: "degrees", word: "position is in degrees", inject: |e| each(&mut e.position, f64::to_degrees) },
    Fault {
        name: "degrees, velocity too",
        word: "position is in degrees",
        inject: |e| {
            each(&mut e.position, f64::to_degrees);
            each(e.velocity.as_mut().unwrap(), f64::to_degrees);
        },
    },
    Fault {
        name: "degrees, no velocity",
        word: "position is in degrees",
        inject: |e| {
            each(&mut e.position, f64::to_degrees);
            e.velocity = None;
        },
    },
    Fault {
        name: "velocity in degrees",
        word: "degrees per second",
        inject: |e| each(e.velocity.as_mut().unwrap(), f64::to_degrees),
    },
    Fault {
        name: "velocity turned",
        word: "velocity has the opposite sign",
        inject: |e| each(e.velocity.as_mut().unwrap(), |x| -x),
    },
    Fault {
        name: "velocity 20 % high",
        word: "times the derivative",
        inject: |e| each(e.velocity.as_mut().unwrap(), |x| 1.2 * x),
    },
    Fault {
        name: "velocity late",
        word: "later than the derivative",
        inject: |e| e.velocity.as_mut().unwrap().iter_mut().for_each(|v| v.rotate_right(5)),
    },
    Fault { name: "effort turned", word: "effort has the opposite sign", inject: |e| each(&mut e.effort, |x| -x) },
    Fault {
        name: "effort of joint 2 turned",
        word: "effort has the opposite sign",
        inject: |e| each(&mut e.effort[1..2], |x| -x),
    },
    Fault { name: "joints 1 and 3 swapped", word: "another order", inject: |e| swap(e, 0, 2, false) },
    Fault { name: "joints 2 and 3 swapped", word: "another order", inject: |e| swap(e, 1, 2, false) },
    Fault { name: "efforts 2 and 3 swapped", word: "another order", inject: |e| swap(e, 1, 2, true) },
    Fault { name: "a glitch", word: "single samples", inject: |e| e.position[1][777] += 0.02 },
    Fault {
        name: "joints backwards",
        word: "another order",
        inject: |e| {
            e.position.reverse();
            e.effort.reverse();
            e.velocity.iter_mut().for_each(|v| v.reverse());
        },
    },
];

#[test]
fn faults_put_into_logs_of_the_bank_are_found() {
    // Some of both arms; `joints 1 and 3 swapped` and the like are found in 25 to 30 of the 30 cases.
    for case in bank_cases().iter().skip(3).step_by(7).take(4) {
        let robot = robot(case, &ReadOptions::default());
        for fault in FAULTS {
            let mut episodes = robot.episodes.clone();
            episodes.iter_mut().for_each(fault.inject);
            let findings = lines(&check_logs(&robot.model, &episodes));
            let found = findings.iter().any(|line| line.contains(fault.word));
            assert!(found, "{} in {}: {findings:#?}", fault.name, case.display());
        }
    }
}
