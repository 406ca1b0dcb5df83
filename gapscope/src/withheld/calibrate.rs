//! `gapscope withheld calibrate`: the confidence of answers against the sealed truth.

use super::bank::Case;
use super::trial::{gathered, kept, trials};
use crate::cli::CalibrateBank;
use crate::report::terminal::{fill, pad};
use crate::report::{figure, percent, percent_interval, plain, significant};
use anyhow::{Context, Result, bail};
use gapscope_withheld::{Answer, Calibration, OddsBin, Reliability, Slope, Top, stated};
use std::fmt::Write;
use std::io::ErrorKind;
use std::path::Path;

/// Columns of a table.
const COLUMN: usize = 16;

/// Holds the confidence of answers against the truth; returns what to print.
///
/// # Errors
/// A bank that is not one, a diagnosis that cannot be read, or no diagnosis at all.
pub fn run(args: &CalibrateBank) -> Result<String> {
    let cases = gathered(&args.banks)?;
    let answers = match &args.answers {
        Some(folder) => cases.iter().map(|case| read(folder, case)).collect::<Result<Vec<_>>>()?,
        None => trials(&cases, &args.how, None)?.into_iter().map(|trial| trial.answer).collect(),
    };
    let answered = answers.iter().flatten().count();
    if answered == 0 {
        let place = args.answers.as_ref().map_or(String::new(), |folder| {
            format!(
                "; expected {} and so on, as `withheld score --keep` leaves them",
                kept(folder, &cases[0]).display()
            )
        });
        bail!("none of the {} cases has a diagnosis{place}", cases.len());
    }
    let mut all = Vec::new();
    for (case, answer) in cases.iter().zip(&answers) {
        if let Some(answer) = answer {
            all.extend(stated(&case.truth()?, answer));
        }
    }
    let calibration = Calibration::new(&all, answered, cases.len() - answered);
    Ok(if args.json { serde_json::to_string(&calibration)? } else { text(&calibration) })
}

/// The diagnosis of a case that was kept; `None` where there is none.
fn read(folder: &Path, case: &Case) -> Result<Option<Answer>> {
    let file = kept(folder, case);
    let text = match std::fs::read_to_string(&file) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        text => text.with_context(|| format!("cannot read {}", file.display()))?,
    };
    let wrong = || format!("{} is not a diagnosis; remove it, or diagnose the case again", file.display());
    serde_json::from_str(&text).map(Some).with_context(wrong)
}

/// The calibration for the terminal.
fn text(calibration: &Calibration) -> String {
    let mut text = format!(
        "{} cases with an answer, {} without. 95 % intervals in brackets; effects count as if each were a case of its own.\n",
        calibration.cases, calibration.unanswered
    );
    let parts = [
        ("All effects", &calibration.overall),
        ("Calibration: bodies, friction, rotors, bias", &calibration.calibration),
        ("Further effects", &calibration.further),
    ];
    for (name, of) in parts {
        let _ = write!(text, "\n{name}\n{}", part(of));
    }
    text.replace(['\u{a0}', '\u{202f}'], " ")
}

fn part(of: &Reliability) -> String {
    let Some(error) = of.error else { return "  none is named\n".to_owned() };
    let mut text = row(["confidence", "effects", "mean stated", "are there", "95 %"].map(str::to_owned));
    for bin in &of.bins {
        let range = percent_interval([bin.from, bin.from + 0.1]);
        text += &row([range, bin.n.to_string(), percent(bin.confidence), percent(bin.right), interval(bin.ci95)]);
    }
    let _ = writeln!(text, "  {} of {} are there; expected calibration error {}", of.right, of.n, figure(error));
    if let Some(top) = &of.top {
        text += &at_the_top(top);
    }
    if !of.odds.is_empty() {
        text += &row(["odds, nats", "effects", "", "are there", "95 %"].map(str::to_owned));
        for bin in &of.odds {
            text += &row([between(bin), bin.n.to_string(), String::new(), percent(bin.right), interval(bin.ci95)]);
        }
    }
    for (what, slope) in [("log odds of confidence", &of.of_confidence), ("odds of `why`", &of.of_odds)] {
        if let Some(slope) = slope {
            text += &map(what, slope);
        }
    }
    text
}

fn row(cells: [String; 5]) -> String {
    let [first, rest @ ..] = cells;
    let rest: String = rest.iter().map(|cell| fill(cell, COLUMN)).collect();
    format!("  {}{}\n", pad(&first, COLUMN), rest.trim_end())
}

fn interval(ends: [f64; 2]) -> String {
    format!("[{}]", percent_interval(ends))
}

fn between(bin: &OddsBin) -> String {
    match (bin.from, bin.to) {
        (Some(from), Some(to)) => format!("{}–{}", plain(from), plain(to)),
        (Some(from), None) => format!("{} or more", plain(from)),
        (None, Some(to)) => format!("below {}", plain(to)),
        (None, None) => "any".to_owned(),
    }
}

/// What the greatest confidence hides.
fn at_the_top(top: &Top) -> String {
    let [low, high] = top.ci95;
    let held = if low > top.confidence {
        "it hides that they are surer"
    } else if high < top.confidence {
        "it says too much"
    } else {
        "these cases do not tell it from that"
    };
    let odds = top.odds.map_or(String::new(), |odds| {
        let [least, middle, most] = odds.map(|odds| significant(odds, 2));
        format!("  Their odds run from {least} to {most} nats, median {middle}; one confidence is said of all.\n")
    });
    format!(
        "  No confidence is above {}. {} effects state it, {} of them are there {}: {held}.\n{odds}",
        percent(top.confidence),
        top.n,
        percent(top.right),
        interval(top.ci95)
    )
}

/// The map from odds to probability that the cases support.
fn map(what: &str, slope: &Slope) -> String {
    let end = |end: Option<f64>, open: &str| end.map_or(open.to_owned(), |end| significant(end, 2));
    let ends = format!("[{}, {}]", end(slope.ci95[0], "−∞"), end(slope.ci95[1], "∞"));
    let Some(best) = slope.slope else {
        return format!(
            "  {what}: none speaks against them, or none for them, so that no slope is the likeliest; those in {ends} fit, {} effects.\n",
            slope.n
        );
    };
    let told = match slope.ci95 {
        [Some(low), _] if low > 1.0 => "they say too little",
        [_, Some(high)] if high < 1.0 => "they say too much",
        _ => "a slope of 1, as stated, fits",
    };
    let temperature = if best > 0.0 { format!(", temperature {}", significant(1.0 / best, 2)) } else { String::new() };
    format!(
        "  {what}: p = 1/(1 + exp(−{} x)) {ends}{temperature}, {} effects: {told}. Loss {} as stated, {} so, nats each.\n",
        significant(best, 2),
        slope.n,
        figure(slope.loss_as_stated),
        figure(slope.loss)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Trials;
    use serde_json::{Value, json};
    use std::fs;
    use std::path::PathBuf;

    /// Ten cases with Coulomb friction of one joint. Each answer names it with 0.98; the first two also name play with 0.6.
    /// The last case has no answer.
    fn bank(folder: &Path) -> (PathBuf, PathBuf) {
        let (bank, answers) = (folder.join("bank"), folder.join("answers"));
        for i in 0..11 {
            let name = format!("case_{i:03}");
            let [open, sealed, answer] =
                [bank.join(&name), folder.join("bank.sealed").join(&name), answers.join("bank").join(&name)];
            for folder in [&open, &sealed, &answer] {
                fs::create_dir_all(folder).unwrap();
            }
            fs::write(open.join("robot.urdf"), "").unwrap();
            fs::write(open.join("episode_0.csv"), "").unwrap();
            let effect = json!({"kind": "coulomb_friction", "joints": [0], "joint_names": ["a"], "power": [50.0]});
            let truth = json!({"robot": "arm", "seed": 1, "noise": [0.0, 0.0, 0.0], "kinds": ["coulomb_friction"], "effects": [effect], "known": true});
            fs::write(sealed.join("truth.json"), truth.to_string()).unwrap();
            let mut effects = vec![json!({"kind": "coulomb_friction", "joints": ["a"], "confidence": 0.98})];
            if i < 2 {
                effects.push(json!({"kind": "backlash", "joints": ["a"], "confidence": 0.6}));
            }
            let why = json!([{"proposed": "coulomb_friction", "against": "nothing", "odds": 40.0, "taken": true},
                {"proposed": "backlash", "against": "a rigid drive", "odds": 0.5, "taken": true}]);
            let answered = json!({"verdict": "explained", "effects": effects, "why": why});
            if i < 10 {
                fs::write(answer.join("diagnosis.json"), answered.to_string()).unwrap();
            }
        }
        (bank, answers)
    }

    fn calibrated(bank: &Path, answers: PathBuf, json: bool) -> Result<String> {
        let how = Trials { exe: None, jobs: None, timeout: 1.0, turn: None };
        run(&CalibrateBank { banks: vec![bank.to_owned()], answers: Some(answers), how, json })
    }

    #[test]
    fn kept_answers_are_held_against_the_truth() {
        let dir = tempfile::tempdir().unwrap();
        let (bank, answers) = bank(dir.path());
        let made: Value = serde_json::from_str(&calibrated(&bank, answers.clone(), true).unwrap()).unwrap();
        assert_eq!(made["schema"], "gapscope.calibration/1");
        assert_eq!((&made["cases"], &made["unanswered"]), (&json!(10), &json!(1)));
        assert_eq!((&made["overall"]["n"], &made["overall"]["right"]), (&json!(12), &json!(10)));
        assert_eq!((&made["calibration"]["n"], &made["further"]["right"]), (&json!(10), &json!(0)));
        // (10 × 0.02 + 2 × 0.6) / 12
        assert!((made["overall"]["error"].as_f64().unwrap() - 0.1167).abs() < 1e-4, "{made}");
        assert_eq!(made["calibration"]["of_odds"]["slope"], Value::Null);
        let text = calibrated(&bank, answers, false).unwrap();
        for said in [
            "10 cases with an answer, 1 without",
            "10 of 12 are there; expected calibration error 0.117",
            "No confidence is above 98 %. 10 effects state it, 100 % of them are there",
            "these cases do not tell it from that.",
            "Their odds run from 40 to 40 nats, median 40",
            "no slope is the likeliest",
        ] {
            assert!(text.contains(said), "{said}\n{text}");
        }
    }

    #[test]
    fn answers_that_are_none_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let (bank, answers) = bank(dir.path());
        let said = calibrated(&bank, dir.path().join("other"), false).unwrap_err().to_string();
        assert!(said.contains("none of the 11 cases") && said.contains("--keep"), "{said}");
        fs::write(answers.join("bank/case_003/diagnosis.json"), "[1").unwrap();
        let said = format!("{:#}", calibrated(&bank, answers, false).unwrap_err());
        assert!(said.contains("case_003") && said.contains("is not a diagnosis"), "{said}");
    }
}
