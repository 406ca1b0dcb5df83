//! The diagnosis and the evaluation of a servo arm as a few lines for the terminal, in the order of those of torque.

use crate::report::effort::Effort;
use crate::report::servo::{Changes, Line, answer as three, follows, known, nominal, offset, schema, unit};
use crate::report::terminal::{INDENT, Paint, block, clean, column, name, pad, wrap};
use crate::report::{
    Beside, count, in_words, joint_list, parameter, percent, percent_interval, percent_within, plain as rounded,
    sentences as sentences_of, verdict, with_unit,
};
use crate::summary::{faults, ordinary_spaces, regime_rows, rest, said, ties, to_paste, told, which};
use gapscope_diagnosis::schema::Verdict;
use gapscope_servo::Outcome;
use gapscope_servo::schema::{Change, Diagnosis, Estimate, Evaluation, FoundDrive};
use std::path::Path;

/// Logs and findings that a summary shows at most.
const SHOWN: usize = 12;
const FINDINGS: usize = 4;

/// The answer alone, in three sentences.
pub fn answer(diagnosis: &Diagnosis, paint: &Paint) -> String {
    ordinary_spaces(&told(&three(diagnosis), schema::verdict(&diagnosis.verdict), paint))
}

/// Which, where and how far, a sentence each.
pub fn sentences(diagnosis: &Diagnosis) -> [String; 3] {
    let rows = effects(diagnosis, &Paint::plain());
    let words = |row: &String| row.split_whitespace().collect::<Vec<_>>().join(" ");
    let which = rows.iter().map(words).collect::<Vec<_>>().join("; ");
    let worst = place(diagnosis).unwrap_or_else(|| "no joint moves".to_owned());
    [format!("{} Effects: {which}", headline(diagnosis)), worst, reach(diagnosis)]
}

/// The diagnosis in some lines: faults, the answer, ties, which, the drives, where, how far, notes, what to change in a robot
/// description, and where the report is.
pub fn summary(outcome: &Outcome, beside: &Beside, out: Option<&Path>, paint: &Paint) -> String {
    let diagnosis = &outcome.diagnosis;
    let (data, word) = (&diagnosis.data, schema::verdict(&diagnosis.verdict));
    let mut lines = faults(beside.faults(), beside.doubts(), paint);
    lines.extend(told(&three(diagnosis), word, paint));
    lines.push(String::new());
    let of = format!(
        "{} · {}, {}, {} at {}, no torque in the logs",
        diagnosis.robot,
        count(diagnosis.joints.len(), "joint"),
        count(data.episodes, "episode"),
        with_unit(&rounded(data.duration), "s"),
        with_unit(&rounded(data.rate), "Hz")
    );
    let effort = effort(diagnosis);
    lines.extend(wrap(&effort.say(&clean(&of)), paint.width));
    block(&mut lines, paint, "Ties", &said(effort, &ties(&schema::effects(&diagnosis.effects))));
    let head = format!("{}  {}", paint.verdict(&verdict(word).to_uppercase(), word), headline(diagnosis));
    lines.extend(wrap(&head, paint.width));
    lines.push(String::new());
    block(&mut lines, paint, "Which", &effects(diagnosis, paint));
    block(&mut lines, paint, "Drives", &said(effort, &drives(diagnosis)));
    let mut places: Vec<String> = place(diagnosis).into_iter().collect();
    places.extend(regime_rows(&schema::regimes(&diagnosis.gap.regimes), &|_| true));
    block(&mut lines, paint, "Where", &places);
    block(&mut lines, paint, "How far", &[reach(diagnosis)]);
    // What is wrong with the logs stands first already.
    let notes: Vec<&String> = data.findings.iter().filter(|line| !beside.warnings().contains(line)).collect();
    let shown = if paint.terminal { FINDINGS } else { notes.len() };
    let first = notes.iter().take(shown).map(|line| clean(line)).collect();
    block(&mut lines, paint, "Notes", &said(effort, &rest(first, notes.len(), shown, "finding")));
    if let Some(next) = &diagnosis.next_experiment {
        block(&mut lines, paint, "Next", &[effort.say(&clean(&sentences_of(&in_words(&next.motion))))]);
    }
    let own = Changes::new(diagnosis, &outcome.corrected);
    let of = |lines: Vec<Line>| lines.into_iter().map(|line| (line.joint, line.attributes)).collect();
    let changes = [("in the URDF", own.urdf), ("actuators of an MJCF", own.actuators)];
    block(
        &mut lines,
        paint,
        "Change",
        &changes.into_iter().filter_map(|(place, own)| to_paste(place, of(own))).collect::<Vec<_>>(),
    );
    if let Some(out) = out {
        lines.push(format!("{} {}", paint.head(&pad("Report", INDENT - 1)), out.join("report.html").display()));
    }
    ordinary_spaces(&lines)
}

/// What was proposed, and by how much the logs spoke for or against it.
pub fn why(diagnosis: &Diagnosis, paint: &Paint) -> String {
    crate::summary::why(&schema::why(&diagnosis.why), &diagnosis.joints, paint)
}

/// The evaluation in a few lines: the gap over all logs, by joint and by log.
pub fn evaluation_summary(evaluation: &Evaluation) -> String {
    let paint = &Paint::plain();
    let regimes = &evaluation.gap.regimes;
    let all = unit(regimes, None);
    let mut lines = Vec::new();
    let mut far = vec![];
    if let Some(shrink) = &evaluation.shrink {
        far.push(format!("free run under the set points: {}", change(&shrink.position, all)));
    }
    if let Some(mean) = evaluation.mean_absolute {
        far.push(format!("mean absolute error {}", offset(mean, mean, all)));
    }
    block(&mut lines, paint, "How far", &far);
    let joint = |(joint, rms): (&String, &f64)| {
        let own = unit(regimes, Some(joint));
        let after =
            evaluation.after.get(joint).map_or(String::new(), |after| format!(" → {}", offset(*after, *rms, own)));
        clean(&format!("{joint}  {} rms{after}", offset(*rms, *rms, own)))
    };
    block(&mut lines, paint, "Where", &evaluation.gap.position.rms.iter().map(joint).collect::<Vec<_>>());
    let width = column(evaluation.logs.iter().map(|log| log.log.as_str()), 44);
    let shown = evaluation.logs.iter().take(SHOWN);
    let logs = shown.map(|log| format!("{}  {}", name(&log.log, width), change(&log.position, all))).collect();
    block(&mut lines, paint, "Logs", &rest(logs, evaluation.logs.len(), SHOWN, "log"));
    ordinary_spaces(&lines)
}

fn effort(diagnosis: &Diagnosis) -> Effort {
    Effort::of(&schema::regimes(&diagnosis.gap.regimes))
}

fn effects(diagnosis: &Diagnosis, paint: &Paint) -> Vec<String> {
    if diagnosis.effects.is_empty() {
        return vec!["no effect is claimed".into()];
    }
    let with = ["with it the gap shrinks by", "with it the gap grows by"];
    which::rows(&schema::effects(&diagnosis.effects), (&diagnosis.joints, effort(diagnosis)), with, &|_| None, paint)
}

/// Each joint with what it follows, its constants, and what the logs leave open.
fn drives(diagnosis: &Diagnosis) -> Vec<String> {
    let mut rows = vec![];
    for (joint, drive) in diagnosis.joints.iter().filter_map(|joint| Some((joint, diagnosis.drive.get(joint)?))) {
        rows.push(clean(&format!("{joint} follows its {}{}", follows(drive), constants(diagnosis, joint, drive))));
    }
    // What several joints leave open is said once.
    let mut open: Vec<(&String, Vec<String>)> = vec![];
    for joint in &diagnosis.joints {
        for text in diagnosis.drive.get(joint).into_iter().flat_map(|drive| &drive.open) {
            match open.iter_mut().find(|(other, _)| *other == text) {
                Some((_, joints)) => joints.push(joint.clone()),
                None => open.push((text, vec![joint.clone()])),
            }
        }
    }
    let place = |joints: &[String]| joint_list(joints, &diagnosis.joints);
    rows.extend(open.iter().map(|(text, joints)| clean(&format!("open at {}: {text}", place(joints)))));
    rows
}

fn constants(diagnosis: &Diagnosis, joint: &str, drive: &FoundDrive) -> String {
    let cell = |(name, found): (&String, &Estimate)| {
        let value = which::one(&schema::estimate(found))?;
        let known = known(diagnosis, joint, name).map_or(String::new(), |known| format!(", {known}"));
        Some(format!("{} {value}{known}", parameter(name)))
    };
    let cells: Vec<String> = drive.constants.iter().filter_map(cell).collect();
    if cells.is_empty() { String::new() } else { format!(": {}", cells.join("; ")) }
}

fn place(diagnosis: &Diagnosis) -> Option<String> {
    let gaps = diagnosis.gap.position.rms.iter().filter(|(_, rms)| rms.is_finite());
    let (joint, rms) = gaps.max_by(|a, b| a.1.total_cmp(b.1))?;
    let rms = offset(*rms, *rms, unit(&diagnosis.gap.regimes, Some(joint)));
    Some(clean(&format!("largest at {joint}: {rms} rms from {}", nominal(diagnosis))))
}

fn reach(diagnosis: &Diagnosis) -> String {
    format!(
        "free run under the set points, held out: {}",
        change(&diagnosis.shrink.position, unit(&diagnosis.gap.regimes, None))
    )
}

fn headline(diagnosis: &Diagnosis) -> String {
    let left = format!("{} of the squared gap is left", percent(diagnosis.unexplained.fraction.max(0.0)));
    match schema::verdict(&diagnosis.verdict) {
        Verdict::NotExcited => "No joint moves or is told to.".to_owned(),
        Verdict::NoGap => format!("The drives alone explain the logs; {left}."),
        Verdict::UnknownEffect => format!("Something is there that no effect of the catalogue explains; {left}."),
        Verdict::PartlyExplained => format!("The drives and these effects explain a part of the logs; {left}."),
        Verdict::Explained => format!("Effects on top of the drives explain the logs; {left}."),
    }
}

fn change(change: &Change, unit: &str) -> String {
    match (change.before, change.after) {
        (Some(before), Some(after)) => {
            let sign = |shrink: f64| if shrink < 0.0 { "+" } else { "−" };
            let shrink = change
                .shrink
                .map_or("at the floor".to_owned(), |s| format!("{}{}", sign(s), percent_within(s.abs(), change.ci95)));
            // Ends of one sign share it.
            let ends = change.ci95.filter(|[low, high]| low * high > 0.0).map(|ends| {
                let [a, b] = ends.map(f64::abs);
                format!(" ({})", percent_interval([a.min(b), a.max(b)]))
            });
            let [from, to] = [offset(before, after, unit), offset(after, before, unit)];
            format!("{from} → {to}  {shrink}{}", ends.unwrap_or_default())
        }
        (Some(before), None) => {
            format!("{} → the arm found here cannot be simulated there", offset(before, before, unit))
        }
        _ => "cannot be simulated".to_owned(),
    }
}
