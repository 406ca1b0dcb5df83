//! How often faults of logs are named, and how often healthy logs are said to have one.
//!
//! `cargo run --release -p gapscope-withheld --example faults -- SEED ROUNDS FOLDER…`: each folder holds `robot.urdf` and
//! healthy logs. Each is tried as it is, then with as many faults as there are rounds, drawn at random. `KIND=JointOrder` before
//! the command tries one kind alone.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use gapscope_datasets::{Episode, FaultKind, Faults, ReadOptions, find_faults, read_logs};
use gapscope_dynamics::Model;
use gapscope_withheld::{FAULTS, draw_fault, spoil};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn main() {
    let mut args = std::env::args().skip(1);
    let seed: u64 = args.next().unwrap().parse().unwrap();
    let rounds: usize = args.next().unwrap().parse().unwrap();
    let mut totals: BTreeMap<FaultKind, [usize; 5]> = BTreeMap::new();
    let (mut healthy, mut alarms, mut questions, mut slowest) = (0, 0, 0, 0.0_f64);
    for (at, folder) in args.map(PathBuf::from).enumerate() {
        let Some((model, logs)) = read(&folder) else { continue };
        let start = std::time::Instant::now();
        let found = find_faults(&model, &logs);
        slowest = slowest.max(start.elapsed().as_secs_f64());
        healthy += 1;
        alarms += usize::from(!found.faults.is_empty());
        questions += usize::from(!found.doubts.is_empty());
        say("healthy", &folder, &found);
        let mut random = Pcg64::seed_from_u64(seed.wrapping_add(1000 * at as u64));
        for round in 0..rounds {
            let wanted = std::env::var("KIND").unwrap_or_default();
            let kind = FAULTS
                .into_iter()
                .find(|kind| format!("{kind:?}") == wanted)
                .unwrap_or(FAULTS[(at * rounds + round + seed as usize) % FAULTS.len()]);
            let Some(mut fault) = draw_fault(kind, &model, logs.len(), &mut random) else { continue };
            let mut spoilt = logs.clone();
            if !spoil(&mut fault, &model, &mut spoilt, &mut random) {
                continue;
            }
            let stands = fault.gravity.map_or_else(|| model.clone(), |g| model.clone().with_gravity(g.into()));
            let start = std::time::Instant::now();
            let found = find_faults(&stands, &spoilt);
            slowest = slowest.max(start.elapsed().as_secs_f64());
            let named = fault.is_named(&found.faults, |log| logs[log].name.clone());
            let sized = fault.is_sized(&found.faults);
            let total = totals.entry(kind).or_default();
            total[0] += 1;
            total[1] += usize::from(named);
            total[2] += usize::from(named && sized);
            total[3] += usize::from(!named && !found.faults.is_empty());
            total[4] += usize::from(found.faults.is_empty() && !found.doubts.is_empty());
            if !(named && sized) {
                println!("  wanted {:?} {:?} {:?} {:?}", fault.kind, fault.joints, fault.factor, fault.log);
                say(if named { "size" } else { "MISSED" }, &folder, &found);
            }
        }
    }
    println!("healthy {healthy}: a fault in {alarms}, a question in {questions}; slowest {slowest:.2} s");
    let mut all = [0; 5];
    for (kind, total) in &totals {
        println!(
            "{kind:?}: of {} named {}, size right {}, other fault said {}, asked {}",
            total[0], total[1], total[2], total[3], total[4]
        );
        (0..5).for_each(|i| all[i] += total[i]);
    }
    println!(
        "all: of {} named {}, size right {}, other fault said {}, asked {}",
        all[0], all[1], all[2], all[3], all[4]
    );
}

fn read(folder: &Path) -> Option<(Model, Vec<Episode>)> {
    let urdf = std::fs::read_to_string(folder.join("robot.urdf")).ok()?;
    let model = Model::from_urdf(&urdf).ok()?.model;
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).ok()?.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().contains(".csv"));
    paths.sort();
    match read_logs(&paths, &joints, &ReadOptions { drop_bad_channels: true, ..ReadOptions::default() }) {
        Ok((logs, _)) => Some((model, logs)),
        Err(error) => {
            println!("{}: {error}", folder.display());
            None
        }
    }
}

fn say(what: &str, folder: &Path, found: &Faults) {
    for fault in &found.faults {
        println!(
            "{what} {}: {:?} {:?} {:?} {:?} {}",
            folder.display(),
            fault.kind,
            fault.joints,
            fault.factor,
            fault.files,
            fault.evidence
        );
    }
    for doubt in &found.doubts {
        println!("{what} {}: asks {}", folder.display(), doubt.question);
    }
    if what == "MISSED" && found.faults.is_empty() && found.doubts.is_empty() {
        println!("{what} {}: nothing", folder.display());
    }
}
