//! A score as a page of documentation, its pictures in files beside it.

use super::figures::{Table, arms, faults, misses, servos, table};
use gapscope_withheld::{DETECTABLE, Score};
use std::fmt::Write;

/// The page; `call` is the command that makes it, `pictures` the files of confusion, calibration and size.
pub fn page(score: &Score, call: &str, pictures: [&str; 3]) -> String {
    let [confusion, calibration, size] = pictures;
    let table = table(score);
    let mut text = format!(
        "# Withheld cases\n\n`{call}` diagnosed {} cases whose effects are sealed, and opened the truth once every answer was given. *Exact*: \
         the set of effects is the sealed one and the verdict is right. A *declared tie* is an effect named as one that the logs cannot \
         tell from the sealed one.\n\n{}",
        score.cases.len(),
        rows(&table),
    );
    if let Some(arms) = arms(score) {
        text.push_str(
            "\n## Used arms\n\nFriction, links, rotors and biases are off on most of them, and one further effect may be beside that. Shares say \
             of how many, with their 95 % score interval (Wilson); means and medians say of how many values.\n\n",
        );
        text.push_str(&rows(&arms));
    }
    if let Some(servos) = servos(score) {
        text.push_str(
            "\n## Servo arms\n\n1 to 7 joints, set points and no torque, 12-bit encoders at 20 to 200 Hz. The simulator’s servo is given in some. \
             Shares say of how many they are, with their 95 % interval; kinds hold of arms with effects of the catalogue.\n\n",
        );
        text.push_str(&rows(&servos));
    }
    if let Some(faults) = faults(score) {
        text.push_str("\n## Wrong data\n\nTwo cases in three have one thing wrong with their logs.\n\n");
        text.push_str(&rows(&faults));
    }
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n## Which effect is taken for which\n\n![Sealed effect against the one named first]({confusion})\n\n\
         ## Confidence\n\nOf the effects named with some confidence, so many are there. The expected calibration error is the mean \
         distance from the line, weighted by the number of effects in each bin of 0.1; intervals are score intervals of a binomial \
         share (Wilson).\n\n![Confidence against truth]({calibration})\n\n| confidence | effects | mean confidence | share that is \
         there | 95 % interval |\n|---|--:|--:|--:|---|\n"
    );
    for bin in &score.calibration {
        let (from, to, [low, high]) = (bin.from, bin.from + 0.1, bin.ci95);
        let _ = writeln!(
            text,
            "| {from:.1}–{to:.1} | {} | {:.3} | {:.3} | {low:.2}–{high:.2} |",
            bin.n, bin.confidence, bin.right
        );
    }
    let _ = write!(
        text,
        "\n## Size of effect\n\nThe size of an effect is its torque signature over the noise of the log, at the joint that shows it best: \
         √800 · rms(with − without)/rms(noise) below 10 Hz. Below {DETECTABLE} nobody can tell it; such cases are counted apart. A dot is the \
         share of the sealed effects of the catalogue that the answer names, alone or beside others.\n\n![Effects found by their size]({size})\n\n\
         ## Misses\n\n"
    );
    let misses = misses(score);
    if misses.is_empty() {
        text.push_str("None.\n");
    } else {
        text.push_str("Sizes are in brackets behind what was sealed, confidences behind what was named.\n\n| case | robot | sealed | named | verdict | counts as |\n|---|---|---|---|---|---|\n");
    }
    for miss in &misses {
        let cells = [&miss.case, &miss.robot, &miss.sealed, &miss.named, &miss.verdict];
        let cells = cells.map(|cell| cell.replace('|', "\\|")).join(" | ");
        let _ = writeln!(text, "| {cells} | {} |", miss.counts);
    }
    text.replace('\u{202f}', "\u{a0}")
}

/// A table's head and rows.
fn rows(table: &Table) -> String {
    let mut text = format!("| | {} |\n|---|{}\n", table.columns.join(" | "), "---|".repeat(table.columns.len()));
    for (name, cells) in &table.rows {
        let name = name.strip_prefix("  ").map_or_else(|| (*name).to_owned(), |name| format!("… {name}"));
        text.push_str(&format!("| {name} | {} |\n", cells.join(" | ")));
    }
    text
}
