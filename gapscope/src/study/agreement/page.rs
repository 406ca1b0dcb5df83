//! The page: how far the answers agree, what was wanted, and what is missed in plain words.

use super::figures::{Agreement, Count, Given, JOINT_ERRORS, KINDS, Kind, REACH, Reach, WITHIN};
use crate::report::{NONE, capital, effect, figure, parameter, percent, probability_figure, significant, with_unit};
use std::fmt::Write;

/// Differences listed of those that lie too far apart.
const LISTED: usize = 5;

/// The page.
pub fn markdown(all: &[Agreement]) -> String {
    let mut text = format!(
        "# Several logs of one machine\n\n\
         Each log is diagnosed alone, with nothing known of the others. Do the answers agree?\n\n\
         - **Kinds.** Of the kinds of effect that any log gives, all logs should give two thirds.\n\
         - **Parameters.** Nine in ten differences should lie within {JOINT_ERRORS} joint standard errors. A standard error is half of a 95\u{a0}% interval over 1.96. \
           The error of a difference is the root of both squares.\n\
         - **Corrections.** The correction from one log is tried on another (`gapscope evaluate`). It should reach {} of the shrink that this log’s own diagnosis reaches held out.\n\n",
        percent(REACH)
    );
    text.push_str(&short(all));
    text.push_str(&missed(all));
    for one in all {
        text.push_str(&machine(one));
    }
    text.push_str("This page is made by `gapscope study agreement --data DIR --force`.\n");
    text.replace('\u{202f}', "\u{a0}")
}

/// The figures of all machines in a few lines, for the terminal.
pub fn summary(all: &[Agreement]) -> String {
    let line = |one: &Agreement| {
        let [kinds, within, reach] = [
            counted(one.kinds_in_all(false)),
            counted(one.within(true)),
            one.least_reach().and_then(|reach| reach.share).map_or(NONE.to_owned(), percent),
        ];
        let note = if one.judged { "" } else { " (not judged)" };
        format!(
            "{}{note}: {kinds} kinds in all logs, {within} differences within {JOINT_ERRORS} joint standard errors, least reach {reach}\n",
            one.machine
        )
    };
    all.iter().map(line).collect::<String>().replace(['\u{202f}', '\u{a0}'], " ")
}

fn counted(count: Count) -> String {
    if count.of == 0 { NONE.to_owned() } else { format!("{} of {}", count.right, count.of) }
}

/// The table of all machines beside the targets.
fn short(all: &[Agreement]) -> String {
    let mut text = String::from(
        "| machine | logs | kinds in all logs, of those in any | the same with declared ties | differences within two joint standard errors | the same, of parameters found in one log alone | least reach of a correction |\n|---|--:|--:|--:|--:|--:|--:|\n",
    );
    let _ = writeln!(text, "| *wanted* | | *2 of 3* | | *{}* | | *{}* |", percent(WITHIN), percent(REACH));
    for one in all {
        let mark = if one.judged { "" } else { " (not judged)" };
        let reach = one.least_reach().and_then(|reach| reach.share).map_or(NONE.to_owned(), percent);
        let cells = [
            format!("{}{mark}", one.machine),
            one.logs.len().to_string(),
            counted(one.kinds_in_all(false)),
            counted(one.kinds_in_all(true)),
            counted(one.within(true)),
            alone(one),
            reach,
        ];
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    let judged: Count = all.iter().filter(|one| one.judged).map(|one| one.within(true)).sum();
    let _ = writeln!(
        text,
        "\nOf all that is judged, {} differences ({}) lie within {JOINT_ERRORS} joint standard errors. \
         Where a log lacks an effect, its value counts as none, to within the least size that the log would have shown. \
         A tie counts where it is one of the first two that the answer declares.\n",
        counted(judged),
        judged.part().map_or(NONE.to_owned(), percent)
    );
    text
}

fn alone(one: &Agreement) -> String {
    match one.open() {
        0 => counted(one.within(false)),
        open => format!("{}, {open} open", counted(one.within(false))),
    }
}

/// What falls short of the targets, machine by machine.
fn missed(all: &[Agreement]) -> String {
    let mut lines = Vec::new();
    for one in all.iter().filter(|one| one.judged) {
        if one.kinds_in_all(false).part().is_some_and(|part| part < KINDS) {
            lines.push(kinds_missed(one));
        }
        if one.within(true).part().is_some_and(|part| part < WITHIN) {
            lines.push(differences_missed(one));
        }
        for log in one.without_shrink() {
            lines.push(format!(
                "- **{}: on {log} its own diagnosis shrinks nothing that was held out.** No part of it can be told.\n",
                one.machine
            ));
        }
        let short = |reach: &&Reach| reach.share.is_some_and(|share| share < REACH);
        lines.extend(one.reaches.iter().filter(short).map(|reach| reach_missed(one, reach)));
    }
    if lines.is_empty() {
        return "Every machine that is judged reaches all three.\n\n".to_owned();
    }
    format!("## What is missed\n\n{}\n", lines.concat())
}

fn kinds_missed(one: &Agreement) -> String {
    let which = |kind: &Kind| {
        let by = one.logs.iter().zip(&kind.given).filter_map(|(log, given)| match given {
            Given::Named { confidence, .. } => Some(format!("{log} at {}\u{a0}%", probability_figure(*confidence))),
            Given::Tie => Some(format!("{log} as a tie")),
            Given::Not => None,
        });
        format!("{} ({})", effect(&kind.name), by.collect::<Vec<_>>().join("; "))
    };
    let not: Vec<String> = one.kinds.iter().filter(|kind| !kind.in_all()).map(which).collect();
    let count = one.kinds_in_all(false);
    format!(
        "- **{}: {} of {} kinds are in all logs.** Not in all: {}.\n",
        one.machine,
        count.right,
        count.of,
        not.join(", ")
    )
}

fn differences_missed(one: &Agreement) -> String {
    let mut far: Vec<_> = one.differences.iter().filter(|d| d.in_both() && d.within() == Some(false)).collect();
    far.sort_by(|a, b| b.apart.unwrap_or(0.0).total_cmp(&a.apart.unwrap_or(0.0)));
    let which = |difference: &&super::figures::Difference| {
        let values = difference.pair.iter().zip(&difference.told).filter_map(|(log, told)| {
            let told = told.as_ref()?;
            let half = told.half.map_or(String::new(), |half| format!(" ± {}", significant(half, 2)));
            Some(format!("{} in {}", with_unit(&(figure(told.value) + &half), &difference.unit), one.logs[*log]))
        });
        let apart = significant(difference.apart.unwrap_or(f64::NAN), 2);
        format!(
            "`{}` is {}, {apart} joint standard errors apart",
            difference.name,
            values.collect::<Vec<_>>().join(" and ")
        )
    };
    let listed: Vec<String> = far.iter().take(LISTED).map(which).collect();
    let count = one.within(true);
    format!(
        "- **{}: {} of {} differences lie within {JOINT_ERRORS} joint standard errors.** The farthest: {}.\n",
        one.machine,
        count.right,
        count.of,
        listed.join("; ")
    )
}

fn reach_missed(one: &Agreement, reach: &Reach) -> String {
    let [from, on] = [&one.logs[reach.from], &one.logs[reach.on]];
    let lost = reach.lost.as_ref().map_or(String::new(), |lost| {
        let [left, own] = [lost.left, lost.own].map(|rms| with_unit(&figure(rms), lost.unit));
        format!(" Most is lost at {}: it leaves {left} rms there, the own one {own}.", lost.joint)
    });
    let of = |part: Option<f64>| part.map_or(NONE.to_owned(), percent);
    format!(
        "- **{}: on {on} the correction from {from} reaches {} of the own shrink.** It shrinks the gap by {}, the own one by {}.{lost}\n",
        one.machine,
        of(reach.share),
        of(reach.shrink),
        of(reach.own)
    )
}

/// One machine in full.
fn machine(one: &Agreement) -> String {
    let mut text = format!("## {}\n\n", capital(&one.machine));
    if !one.judged {
        text.push_str("These logs are too short to be judged.\n\n");
    }
    let rule: String = one.logs.iter().map(|_| "---|").collect();
    let _ = writeln!(text, "| kind | {} |\n|---|{rule}", one.logs.join(" | "));
    let _ = writeln!(text, "| *verdict* | {} |", one.verdicts.join(" | "));
    for kind in &one.kinds {
        let cells: Vec<String> = kind.given.iter().map(cell).collect();
        let _ = writeln!(text, "| {} | {} |", effect(&kind.name), cells.join(" | "));
    }
    text.push('\n');
    let parameters = one.parameters();
    if !parameters.is_empty() {
        text.push_str("| effect | parameter | within two joint standard errors | median difference, joint standard errors | median size | median half of the 95\u{a0}% interval |\n|---|---|--:|--:|--:|--:|\n");
        for row in &parameters {
            let (size, half) =
                (with_unit(&figure(row.size), &row.unit), with_unit(&significant(row.half, 2), &row.unit));
            let cells = [
                effect(&row.kind),
                parameter(&row.parameter),
                counted(row.within),
                significant(row.apart, 2),
                size,
                half,
            ];
            let _ = writeln!(text, "| {} |", cells.join(" | "));
        }
        text.push('\n');
    }
    text.push_str("| correction from | on | shrinks the torque gap by | its own diagnosis, held out | share |\n|---|---|--:|--:|--:|\n");
    let of = |part: Option<f64>| part.map_or(NONE.to_owned(), percent);
    for reach in &one.reaches {
        let [from, on] = [&one.logs[reach.from], &one.logs[reach.on]];
        let _ = writeln!(text, "| {from} | {on} | {} | {} | {} |", of(reach.shrink), of(reach.own), of(reach.share));
    }
    text.push('\n');
    text
}

fn cell(given: &Given) -> String {
    match given {
        Given::Named { confidence, joints } => {
            let places = match joints {
                0 => String::new(),
                1 => ", 1 joint".to_owned(),
                n => format!(", {n} joints"),
            };
            format!("{}\u{a0}%{places}", probability_figure(*confidence))
        }
        Given::Tie => "a tie".to_owned(),
        Given::Not => NONE.to_owned(),
    }
}
