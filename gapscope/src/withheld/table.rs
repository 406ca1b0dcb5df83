//! A score as text.

use crate::report::score::figures::{Table, arms, faults, servos, table};
use crate::report::terminal::{column, fill, pad};
use gapscope_withheld::Score;
use std::fmt::Write;

/// Width of the names at the left of the matrix.
const NAMES: usize = 24;
/// Most columns of the name of a bank.
const BANK: usize = 16;

/// Most columns of a figure of used arms.
const ARM: usize = 24;

/// A table's head and rows, its cells cut to a width.
fn rows(table: &Table, most: usize) -> String {
    let names = column(table.rows.iter().map(|row| row.0), 60) + 2;
    let width = column(table.rows.iter().flat_map(|row| &row.1).chain(&table.columns).map(String::as_str), most) + 3;
    let line = |name: &str, cells: &[String]| -> String {
        let cells: String = cells.iter().map(|cell| fill(pad(cell, most).trim_end(), width)).collect();
        format!("{}{cells}\n", pad(name, names))
    };
    let mut text = line("", &table.columns);
    for (name, cells) in &table.rows {
        text.push_str(&line(name, cells));
    }
    text
}

/// The figures of a score and its confusion matrix.
pub fn score(score: &Score) -> String {
    let mut text = rows(&table(score), BANK);
    if let Some(arms) = arms(score) {
        text.push_str(&format!("\nUsed arms (95 % intervals in brackets)\n{}", rows(&arms, ARM)));
    }
    if let Some(servos) = servos(score) {
        text.push_str(&format!("\nServo arms (95 % intervals in brackets)\n{}", rows(&servos, ARM)));
    }
    if let Some(faults) = faults(score) {
        text.push_str(&format!("\nWrong data\n{}", rows(&faults, BANK)));
    }
    // Writing to a string cannot fail.
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
    let failed: Vec<_> = score.cases.iter().filter_map(|c| Some((c, c.error.as_ref()?))).collect();
    for (case, error) in &failed {
        let _ = writeln!(text, "{}/{}: no diagnosis: {}", case.bank, case.case, error.replace('\n', " "));
    }
    text.replace(['\u{a0}', '\u{202f}'], " ")
}
