//! A score as text.

use crate::report::terminal::{fill, pad};
use crate::report::{figure, percent};
use gapscope_withheld::{Group, Score};
use std::fmt::Write;

/// Width of the names at the left.
const NAMES: usize = 24;

/// The figures of a score and its confusion matrix.
pub fn score(score: &Score) -> String {
    let t = &score.totals;
    let part = |p: Option<f64>| p.map_or("–".into(), percent);
    let number = |x: Option<f64>| x.map_or("–".into(), figure);
    let mut text = format!("{}{:>6}{:>8}{:>11}{:>13}\n", pad("cases", NAMES), "n", "exact", "with ties", "first named");
    for (group, shares) in Group::ALL.iter().filter_map(|g| Some((g, t.groups.get(g.name())?))) {
        let cells = [(shares.exact, 8), (shares.class_exact, 11), (shares.top1, 13)];
        let cells: String = cells.into_iter().map(|(share, width)| fill(&part(share), width)).collect();
        let _ = writeln!(text, "{}{:>6}{cells}", pad(group.name(), NAMES), shares.n);
    }
    let conf = format!("expected error {} over {} effects named", number(t.calibration_error), t.reported_effects);
    for (name, value) in [
        ("set of effects (multi)", format!("F1 {}", number(t.set_f1_multi))),
        ("joints", format!("F1 {}", number(t.joint_f1))),
        (
            "parameters",
            format!(
                "median error {}, gains {}; {} reported; {} of 95 % intervals hold the truth",
                part(t.param_rel_err_median),
                number(t.gain_abs_err_median),
                part(t.param_reported),
                part(t.interval_coverage)
            ),
        ),
        ("confidence", conf),
        ("no gap", format!("{} false alarms", part(t.no_gap_false_alarms))),
        ("unknown effects", format!("{} flagged", part(t.unknown_flagged))),
        ("shrink", format!("predicted {} off the sealed episodes’, mean", number(t.shrink_abs_err_mean))),
        ("diagnosis", format!("{} s, median", number(t.seconds_median))),
    ] {
        let _ = writeln!(text, "{}{value}", pad(name, NAMES + 2));
    }
    let (labels, counts) = score.confusion_matrix();
    if !labels.is_empty() {
        let _ = writeln!(text, "\nSealed effect (rows) against the one named first (columns)");
        let heads: String = (1..=labels.len()).map(|i| format!("{i:>3}")).collect();
        let _ = writeln!(text, "{}{heads}", pad("", NAMES + 3));
        for (i, (label, row)) in labels.iter().zip(&counts).enumerate() {
            let cell = |n: &usize| if *n == 0 { "  ·".to_owned() } else { format!("{n:>3}") };
            let row: String = row.iter().map(cell).collect();
            let _ = writeln!(text, "{:>2} {}{row}", i + 1, pad(label, NAMES));
        }
    }
    let failed: Vec<_> = score.cases.iter().filter_map(|c| Some((&c.case, c.error.as_ref()?))).collect();
    for (case, error) in &failed {
        let _ = writeln!(text, "{case}: no diagnosis: {}", error.replace('\n', " "));
    }
    text.replace(['\u{a0}', '\u{202f}'], " ")
}
