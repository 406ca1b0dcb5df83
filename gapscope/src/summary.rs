//! The diagnosis and the evaluation as a few lines for the terminal, within its width: faults of the data, the answer in three
//! sentences, what it cannot be told from, then the figures.

mod change;
pub mod which;

use crate::input::fault_line;
use crate::report::effort::Effort;
use crate::report::plain;
use crate::report::terminal::{INDENT, Paint, block, blocks, clean, column, fill, name as padded, pad, wrap};
use crate::report::{
    account, beside_the_answer, capital, changed, count, effect, effects, figure, headline, implied_unit, in_words,
    interval, is_above_floor, joint_list, largest, list, motion_unit, outstanding, percent, percent_figure,
    plain as rounded, power_line, regime, rolled_out, sentences, significant, verdict, with_unit, words_of_the_rest,
};
use change::Cells;
use gapscope_datasets::{Doubt, Fault};
use gapscope_diagnosis::schema::{Diagnosis, Evaluation, FoundEffect, Regime, Shrink, Verdict, Why};
use gapscope_export::TargetLedger;
use std::path::Path;

/// Effects, regimes, rollouts and findings shown; the rest is counted.
const EFFECTS: usize = 5;
const REGIMES: usize = 3;
const SUMS: usize = 4;
const FINDINGS: usize = 3;
const CHANGES: usize = 7;
const LOGS: usize = 12;

/// The three sentences of the answer, and nothing else.
pub fn answer(diagnosis: &Diagnosis, paint: &Paint) -> String {
    ordinary_spaces(&told(&plain::answer(diagnosis), diagnosis.verdict, paint))
}

/// Sentences within the width, the first in the colour of the verdict.
pub fn told(sentences: &[String], verdict: Verdict, paint: &Paint) -> Vec<String> {
    let mut lines = vec![];
    for (i, line) in sentences.iter().enumerate() {
        let wrapped = wrap(&clean(line), paint.width);
        lines.extend(wrapped.into_iter().map(|l| if i == 0 { paint.verdict(&l, verdict) } else { l }));
    }
    lines
}

/// What is wrong with the data, and what may be.
pub fn faults(faults: &[Fault], doubts: &[Doubt], paint: &Paint) -> Vec<String> {
    let mut lines = Vec::new();
    for fault in faults {
        block(&mut lines, paint, "Fault", &[clean(&fault_line(fault))]);
    }
    for doubt in doubts {
        block(&mut lines, paint, "In doubt", &[clean(&capital(&doubt.question))]);
    }
    if !lines.is_empty() {
        lines.push(String::new());
    }
    lines
}

/// The diagnosis in some 25 lines: faults, the answer, ties, which, where, how far, notes, what to change in the robot's own
/// description where its `ledger` is there, and where the report is.
pub fn summary(diagnosis: &Diagnosis, ledger: Option<&TargetLedger>, out: Option<&Path>, paint: &Paint) -> String {
    let data = &diagnosis.data;
    // An answer of wrong logs is none: what is wrong with them comes before it.
    let mut lines = faults(&data.faults, &data.doubts, paint);
    lines.extend(told(&plain::answer(diagnosis), diagnosis.verdict, paint));
    lines.push(String::new());
    let of = format!(
        "{} · {}, {}, {} at {}",
        diagnosis.robot,
        count(diagnosis.joints.len(), "joint"),
        count(data.episodes, "episode"),
        with_unit(&rounded(data.duration), "s"),
        with_unit(&rounded(data.rate), "Hz")
    );
    lines.extend(wrap(&clean(&of), paint.width));
    let effort = Effort::of(&diagnosis.gap.regimes);
    block(&mut lines, paint, "Ties", &said(effort, &ties(&diagnosis.effects)));
    let label = verdict(diagnosis.verdict).to_uppercase();
    let mended = data.faults.iter().any(|fault| fault.mended);
    let of = if mended { "Of the mended logs: " } else { "" };
    let head = format!("{}  {of}{}", paint.verdict(&label, diagnosis.verdict), headline(diagnosis));
    lines.extend(wrap(&head, paint.width));
    lines.push(String::new());
    if diagnosis.verdict != Verdict::NotExcited {
        block(&mut lines, paint, "Which", &which::of(diagnosis, paint));
        block(&mut lines, paint, "Where", &said(effort, &places(diagnosis)));
        block(
            &mut lines,
            paint,
            "How far",
            &how_far(&diagnosis.shrink, &diagnosis.gap.regimes, !diagnosis.effects.is_empty()),
        );
    }
    block(&mut lines, paint, "Notes", &said(effort, &notes(diagnosis, paint.terminal)));
    if let (Verdict::NoGap, Some(line)) = (diagnosis.verdict, power_line(&diagnosis.power)) {
        block(&mut lines, paint, "Power", &[effort.say(&line)]);
    }
    if let Some(next) = &diagnosis.next_experiment {
        block(&mut lines, paint, "Next", &[effort.say(&clean(&sentences(&in_words(&next.motion))))]);
    }
    block(&mut lines, paint, "Change", &ledger.and_then(changes).into_iter().collect::<Vec<_>>());
    let mut text = ordinary_spaces(&lines);
    if let Some(out) = out {
        text += &format!("{} {}\n", paint.head(&pad("Report", INDENT - 1)), out.display());
    }
    text
}

/// What to change at the joints of the robot's own description; `None` where nothing is a number of one joint.
fn changes(ledger: &TargetLedger) -> Option<String> {
    let format = if ledger.target == "mjcf" { "in the MJCF" } else { "in the URDF" };
    let attributes = |text: &str| text.trim_start_matches("<dynamics ").trim_end_matches("/>").to_owned();
    let lines = ledger.paste.iter().filter_map(|line| line.split_once(": "));
    to_paste(format, lines.map(|(joint, text)| (joint.to_owned(), attributes(text))).collect())
}

/// Joints with the attributes that change at each, as XML has them, in a sentence that begins with where; `None` without any.
pub fn to_paste(place: &str, lines: Vec<(String, String)>) -> Option<String> {
    // Where a number changes, those that are nothing beside it say nothing.
    let bare = |attributes: &str| {
        let all: Vec<String> = attributes.split("\" ").map(|one| one.replace("=\"", " ").replace('"', "")).collect();
        let some: Vec<String> = all.iter().filter(|one| !one.ends_with(" 0")).cloned().collect();
        if some.is_empty() { all.join(", ") } else { some.join(", ") }
    };
    let more = lines.len().saturating_sub(CHANGES);
    let told = lines.iter().take(CHANGES).map(|(joint, text)| format!("{joint} {}", bare(text)).replace(' ', "\u{a0}"));
    let told: Vec<String> = told.chain((more > 0).then(|| format!("and {more} more in the report"))).collect();
    (!told.is_empty()).then(|| clean(&format!("{place}: {}", told.join("; "))))
}

/// What the logs cannot tell apart, a line each.
pub fn ties(found: &[FoundEffect]) -> Vec<String> {
    let tied = found.iter().filter(|found| !found.indistinguishable_from.is_empty());
    let tie = |found: &FoundEffect| {
        let kinds = effects(&found.indistinguishable_from);
        clean(&format!("{} could also be {}", effect(&found.kind), list(&kinds, "or")))
    };
    let mut lines: Vec<String> = tied.map(tie).collect();
    lines.sort();
    lines.dedup();
    lines
}

/// What was proposed, against what, and by how much the logs spoke for it or against it: one entry a comparison.
pub fn why(list: &[Why], joints: &[String], paint: &Paint) -> String {
    let mut lines = vec![String::new()];
    let head = "what was proposed, against what, and by how many nats it won (+) or lost (−); 3 nats are odds of twenty to one";
    let rows: Vec<String> = wrap(head, paint.width - INDENT);
    block(&mut lines, paint, "Why", &rows);
    let mut all: Vec<&Why> = list.iter().collect();
    all.sort_by(|a, b| b.taken.cmp(&a.taken).then(b.odds.total_cmp(&a.odds)));
    for Why { proposed, joints: at, against, odds, taken } in all {
        let odds = format!("{odds:+.1}").replace('-', "−");
        let place = if at.is_empty() { String::new() } else { format!(" at {}", joint_list(at, joints)) };
        let text = clean(&format!("{}{place}, against {}", effect(proposed), account(against)));
        // The kind in words; its public name stands in diagnosis.json.
        let before = format!("  {:5}  {}  ", if *taken { "taken" } else { "no" }, fill(&odds, 9));
        let columns = before.chars().count();
        for (i, line) in wrap(&text, paint.width.saturating_sub(columns)).into_iter().enumerate() {
            lines.push(if i == 0 { before.clone() + &line } else { " ".repeat(columns) + &line });
        }
    }
    ordinary_spaces(&lines)
}

/// The evaluation in a few lines: the gap over all logs, before and after, then log by log.
pub fn evaluation_summary(evaluation: &Evaluation) -> String {
    let paint = &Paint::plain();
    let mut lines = vec![];
    if let Some(shrink) = &evaluation.shrink {
        block(&mut lines, paint, "How far", &how_far(shrink, &evaluation.gap.regimes, true));
    }
    let torque = &evaluation.gap.torque;
    let mut joints: Vec<(&String, f64)> = torque.rms.iter().map(|(joint, &rms)| (joint, rms)).collect();
    joints.sort_by(|a, b| b.1.total_cmp(&a.1));
    let width = column(joints.iter().map(|(joint, _)| joint.as_str()), 28);
    let top = joints.first().map_or(0.0, |j| j.1);
    let rows: Vec<String> = joints
        .iter()
        .take(LOGS)
        .map(|(joint, rms)| {
            let unit = implied_unit(joint, &evaluation.gap.regimes);
            let floor =
                torque.floor.get(*joint).map_or(String::new(), |f| format!("; noise floor {}", significant(*f, 2)));
            let rms_text = with_unit(&figure(*rms), unit);
            let word = Effort::of(&evaluation.gap.regimes).word();
            format!("{}  {}  {word} gap {} rms{floor}", padded(joint, width), blocks(rms / top, 10), fill(&rms_text, 9))
        })
        .collect();
    block(&mut lines, paint, "Where", &rest(rows, joints.len(), LOGS, "joint"));
    let width = column(evaluation.logs.iter().map(|log| log.log.as_str()), 44);
    let rows: Vec<String> = evaluation
        .logs
        .iter()
        .take(LOGS)
        .map(|log| {
            let text = match &log.shrink {
                Some(change) => Cells::of(change, percent).line(6, 6),
                None => {
                    let worst = log.torque.rms.iter().max_by(|a, b| a.1.total_cmp(b.1));
                    worst.map_or("–".into(), |(joint, rms)| format!("largest at {joint}: {} rms", figure(*rms)))
                }
            };
            format!("{}  {text}", padded(&log.log, width))
        })
        .collect();
    block(&mut lines, paint, "Logs", &rest(rows, evaluation.logs.len(), LOGS, "log"));
    ordinary_spaces(&lines)
}

/// Lines joined; no-break spaces become plain ones, so that the text can be searched and copied.
pub fn ordinary_spaces(lines: &[String]) -> String {
    let text: String = lines.iter().flat_map(|line| [line.trim_end(), "\n"]).collect();
    text.replace(['\u{a0}', '\u{202f}'], " ")
}

/// Lines in the robot's own word for what its drives push with.
pub fn said(effort: Effort, lines: &[String]) -> Vec<String> {
    lines.iter().map(|line| effort.say(line)).collect()
}

fn places(diagnosis: &Diagnosis) -> Vec<String> {
    let mut rows = vec![];
    if let Some((joint, rms)) = largest(diagnosis) {
        let unit = implied_unit(joint, &diagnosis.gap.regimes);
        let floor = diagnosis.gap.torque.floor.get(joint);
        let floor =
            floor.map_or(String::new(), |f| format!("; noise alone gives {}", with_unit(&significant(*f, 2), unit)));
        let rms = with_unit(&figure(rms), unit);
        rows.push(clean(&format!("largest at {joint}: torque gap {rms} rms{floor}")));
    }
    if diagnosis.verdict == Verdict::NoGap {
        return rows;
    }
    let outstanding = regime_rows(&diagnosis.gap.regimes, &|joint| is_above_floor(diagnosis, joint));
    if outstanding.is_empty() && !diagnosis.gap.regimes.is_empty() {
        rows.push("spread over all regimes of the motion".into());
    }
    rows.extend(outstanding);
    rows
}

/// The regimes that stand out, one a joint; of joints at the noise none.
pub fn regime_rows(regimes: &[Regime], above: &dyn Fn(&str) -> bool) -> Vec<String> {
    let mut shown: Vec<&Regime> = vec![];
    for found in outstanding(regimes) {
        let new = !shown.iter().any(|r| r.joint == found.joint);
        if shown.len() < REGIMES && new && above(&found.joint) {
            shown.push(found);
        }
    }
    let width = column(shown.iter().map(|r| r.joint.as_str()), 22);
    // A band of frequencies says nothing without its bounds.
    let name = |r: &&Regime| if r.regime == "frequency_band" { interval(&r.bounds) } else { regime(&r.regime) };
    let names: Vec<String> = shown.iter().map(name).collect();
    let name_width = column(names.iter().map(String::as_str), 17);
    let row = |(found, name): (&&Regime, &String)| {
        format!(
            "{}  {}  {} {:>4} % of squared gap, {} of {}",
            padded(&found.joint, width),
            padded(name, name_width),
            blocks(found.share, 8),
            percent_figure(found.share),
            percent(found.samples),
            if found.regime == "frequency_band" { "effort" } else { "samples" }
        )
    };
    shown.iter().zip(&names).map(row).collect()
}

fn how_far(shrink: &Shrink, regimes: &[Regime], corrected: bool) -> Vec<String> {
    let mut cells = vec![];
    if changed(&shrink.torque) {
        let floor = percent(shrink.reference.noise_floor);
        let note = format!("   of effort std, floor {floor}");
        cells.push((Effort::of(regimes).word().to_string(), Cells::of(&shrink.torque, percent), note));
    }
    if changed(&shrink.one_step) {
        cells.push((
            "one step".into(),
            Cells::of(&shrink.one_step, figure),
            format!("   {} rms", motion_unit(regimes, true)),
        ));
    }
    let n = shrink.rollout.len();
    let shown: Vec<usize> = if n <= 3 { (0..n).collect() } else { vec![0, n / 2, n - 1] };
    for h in shown.into_iter().filter_map(|i| shrink.rollout.get(i)).filter(|h| changed(&h.change)) {
        cells.push((
            format!("rollout {} s", rounded(h.horizon)),
            Cells::of(&h.change, rolled_out),
            format!("   {} rms", motion_unit(regimes, false)),
        ));
    }
    let name = column(cells.iter().map(|c| c.0.as_str()), 16);
    let before = column(cells.iter().map(|c| c.1.before.as_str()), 14);
    let after = column(cells.iter().map(|c| c.1.after.as_str()), 14);
    let row = |(head, c, note): &(String, Cells, String)| {
        let text = if corrected { c.line(before, after) } else { fill(&c.before, before) };
        format!("{}  {text}{note}", pad(head, name))
    };
    cells.iter().map(row).collect()
}

/// On a terminal the gravest findings, wrapped; elsewhere all of them.
fn notes(diagnosis: &Diagnosis, terminal: bool) -> Vec<String> {
    let findings = &diagnosis.data.findings;
    let mut rows = vec![];
    let best = diagnosis.alternatives.iter().max_by(|a, b| a.probability.total_cmp(&b.probability));
    if let Some(other) = best.filter(|a| a.probability >= 0.05) {
        let kinds: Vec<String> = other.effects.iter().map(|kind| effect(kind)).collect();
        let kinds = if kinds.is_empty() { "no effect at all".into() } else { kinds.join(" + ") };
        rows.push(clean(&format!("instead of all these, {kinds} fits {}", beside_the_answer(other.probability))));
    }
    if matches!(diagnosis.verdict, Verdict::PartlyExplained | Verdict::UnknownEffect) {
        rows.push(clean(&words_of_the_rest(&diagnosis.unexplained, &diagnosis.joints)));
    }
    let shown = if terminal { FINDINGS } else { findings.len() };
    rows.extend(findings.iter().take(shown).map(|text| clean(text)));
    rest(rows, findings.len(), shown, "finding")
}

/// Appends a count of what is not shown.
pub fn rest(mut rows: Vec<String>, all: usize, shown: usize, thing: &str) -> Vec<String> {
    if all > shown {
        rows.push(format!("and {}", count(all - shown, &format!("more {thing}"))));
    }
    rows
}

#[cfg(test)]
mod tests;
