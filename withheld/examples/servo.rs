//! How servo arms are diagnosed, in one process: no command line, no files of results.
//!
//! `cargo run --release -p gapscope-withheld --example servo -- SEED CASES` makes a bank and scores it;
//! `… --example servo -- BANK` scores one that `withheld make --servo` or `tests/withheld/servo.py` made, by the same rules
//! as `gapscope withheld score`. Each line has what was hidden, what was named and by how many nats.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use gapscope_datasets::{Episode, ReadOptions, read_logs};
use gapscope_dynamics::Model;
use gapscope_servo::{Given, diagnose, evaluate};
use gapscope_withheld::{Case, CaseScore, Difficulty, Plan, Robot, Score, Truth, judge, judge_servo, make_case};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut scores = Vec::new();
    if let (Ok(seed), Some(count)) = (args[0].parse::<u64>(), args.get(1)) {
        let count: usize = count.parse().unwrap();
        let only: Option<Vec<usize>> = args.get(2).map(|list| list.split(',').map(|i| i.parse().unwrap()).collect());
        for (i, case) in made(seed, count, only.as_deref()) {
            scores.push(scored(&format!("{i:03}"), case));
        }
    } else {
        let bank = PathBuf::from(&args[0]);
        let only: Option<Vec<String>> = args.get(1).map(|list| list.split(',').map(str::to_owned).collect());
        let mut names: Vec<String> =
            std::fs::read_dir(&bank).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        for name in
            names.iter().filter(|name| only.as_ref().is_none_or(|only| only.iter().any(|end| name.ends_with(end))))
        {
            scores.push(scored(name, read(&bank, name)));
        }
    }
    let score = Score::new(scores);
    for totals in &score.servos {
        println!("{}", serde_json::to_string_pretty(totals).unwrap());
    }
}

/// The cases of a bank by their numbers.
fn made(seed: u64, count: usize, only: Option<&[usize]>) -> impl Iterator<Item = (usize, Case)> {
    let mut plan: Plan = serde_json::from_value(serde_json::json!({
        "cases": 0, "multi": 0, "mixed": 0, "none": 0, "unknown": 0, "robots": ["arm7"], "seed": seed,
        "difficulty": Difficulty::Mixed, "seconds": 10.0, "episodes": 4, "tests": 2, "servo": true
    }))
    .unwrap();
    plan.share_out_servos(count);
    let urdf = gapscope_dynamics::robots::arm7();
    let robot = Robot::new("arm7".into(), urdf.into(), Model::from_urdf(urdf).unwrap().model).unwrap();
    let specs = plan.specs().into_iter().enumerate();
    specs.filter(move |(i, _)| only.is_none_or(|only| only.contains(i))).filter_map(move |(i, spec)| {
        match make_case(&robot, &spec) {
            Ok(case) => Some((i, case)),
            Err(error) => {
                println!("{i:03} {error}");
                None
            }
        }
    })
}

fn read(bank: &Path, name: &str) -> Case {
    let sealed = bank.with_file_name(format!("{}.sealed", bank.file_name().unwrap().to_str().unwrap())).join(name);
    let urdf = std::fs::read_to_string(bank.join(name).join("robot.urdf")).unwrap();
    let model = Model::from_urdf(&urdf).unwrap().model;
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let logs = |folder: &Path, prefix: &str| -> Vec<Episode> {
        let files = (0..).map(|i| folder.join(format!("{prefix}_{i}.csv"))).take_while(|file| file.is_file());
        let options = ReadOptions { without_effort: true, ..ReadOptions::default() };
        read_logs(&files.collect::<Vec<_>>(), &joints, &options).unwrap().0
    };
    let truth: Truth = serde_json::from_str(&std::fs::read_to_string(sealed.join("truth.json")).unwrap()).unwrap();
    let servo = std::fs::read_to_string(bank.join(name).join("servo.toml")).ok();
    Case { urdf, episodes: logs(&bank.join(name), "episode"), tests: logs(&sealed, "test"), truth, servo }
}

fn scored(name: &str, case: Case) -> CaseScore {
    let Case { urdf, episodes, tests, truth, servo } = case;
    let model = Model::from_urdf(&urdf).unwrap().model;
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let given = servo.map_or_else(Given::default, |text| Given::from_toml(&text, &joints).unwrap());
    let began = Instant::now();
    let outcome = diagnose(&model, &episodes, &given, vec![], &|_, _| {}).unwrap();
    let seconds = began.elapsed().as_secs_f64();
    let (evaluation, _) = evaluate(&model, &tests, &given, Some(&outcome.corrected)).unwrap();
    let answer = serde_json::from_value(serde_json::to_value(&outcome.diagnosis).unwrap()).unwrap();
    let evaluation = serde_json::to_value(&evaluation).unwrap();
    let judgement = judge(&truth, Some(&answer), Some(&evaluation));
    let servo = judge_servo(&truth, Some(&answer));
    let sealed: Vec<String> = truth
        .effects
        .iter()
        .map(|effect| {
            format!("{}@{}({:.0})", effect.kind, effect.joint_names.len(), effect.visibility().unwrap_or(0.0))
        })
        .collect();
    let named: Vec<String> = outcome
        .diagnosis
        .effects
        .iter()
        .map(|effect| {
            let ties = if effect.indistinguishable_from.is_empty() {
                String::new()
            } else {
                format!("|{}", effect.indistinguishable_from.join("|"))
            };
            format!("{}{ties}@{}({:.0})", effect.kind, effect.joints.len(), answer_odds(&answer, &effect.kind))
        })
        .collect();
    let right = servo.as_ref().and_then(|servo| servo.kinds);
    let figure = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.3}"));
    println!(
        "{name} {} {}dof {:3.0} Hz {} | {} | {} | {} left {:.3} after {} mrad | shrink {} {} | {seconds:.1} s",
        if servo.as_ref().is_some_and(|servo| servo.given) { "given" } else { "free " },
        joints.len(),
        truth.rate.unwrap_or(0.0),
        match right {
            Some(true) => "ok  ",
            Some(false) => "MISS",
            None if servo.as_ref().is_some_and(|servo| servo.invented > 0) => "FALSE",
            None => "    ",
        },
        sealed.join(" "),
        named.join(" "),
        outcome.diagnosis.verdict,
        outcome.diagnosis.unexplained.fraction,
        figure(outcome.diagnosis.shrink.position.after.map(|after| 1e3 * after)),
        figure(judgement.predicted_shrink),
        figure(judgement.shrink),
    );
    CaseScore::new(["servo", name], &truth, judgement, seconds, None).on_servos(servo)
}

fn answer_odds(answer: &gapscope_withheld::Answer, kind: &str) -> f64 {
    let named = answer.effects.iter().find(|named| named.kind == kind);
    named.and_then(|named| answer.odds(named)).unwrap_or(f64::NAN)
}
