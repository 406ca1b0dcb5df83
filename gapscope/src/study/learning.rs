//! What residual and pure learning need and where they fail, measured on a simulated 7-joint arm.

mod arm;
mod policy;
mod region;
mod samples;
mod structure;

use crate::cli::Learning;
use crate::output;
use crate::picture::{Series, svg};
use crate::report::axis::Axis;
use anyhow::{Result, bail};
use arm::Budget;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write;

/// Which study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    Samples,
    Region,
    Structure,
    Policy,
}

/// What a study found.
struct Findings {
    /// File name without ending.
    name: &'static str,
    title: &'static str,
    /// What was done, in a paragraph or two of Markdown.
    method: String,
    head: Vec<String>,
    /// Figures under the head; text as it is.
    rows: Vec<Vec<Cell>>,
    /// Sentences below the table, made of the figures.
    findings: Vec<String>,
    picture: Picture,
}

enum Cell {
    Text(String),
    Figure(f64),
}

struct Picture {
    x: Axis,
    y: Axis,
    series: Vec<Series>,
}

/// Runs a study and writes NAME.md, NAME.csv and NAME.svg; returns the table.
///
/// # Errors
/// Results that exist or cannot be written, or a setting of zero.
pub fn run(topic: Topic, args: &Learning) -> Result<String> {
    if args.steps == 0 || args.repeats == 0 {
        bail!("--steps and --repeats must be at least 1");
    }
    let name = match topic {
        Topic::Samples => samples::NAME,
        Topic::Region => region::NAME,
        Topic::Structure => structure::NAME,
        Topic::Policy => policy::NAME,
    };
    for ending in ["md", "csv", "svg"] {
        let path = args.out.join(format!("{name}.{ending}"));
        if path.exists() && !args.force {
            bail!(
                "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
                path.display()
            );
        }
    }
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos} of {len} networks, {eta} left") {
        bar.set_style(style);
    }
    let budget = Budget { steps: args.steps, repeats: args.repeats, bar: bar.clone() };
    let found = match topic {
        Topic::Samples => samples::run(&budget),
        Topic::Region => region::run(&budget),
        Topic::Structure => structure::run(&budget),
        Topic::Policy => policy::run(&budget),
    }?;
    bar.finish_and_clear();
    let path = |ending: &str| args.out.join(format!("{}.{ending}", found.name));
    let page = markdown(&found, args);
    output::write(&path("csv"), &csv(&found))?;
    output::write(&path("svg"), &svg(found.title, &found.picture.x, &found.picture.y, &found.picture.series))?;
    output::write(&path("md"), &page)?;
    Ok(page)
}

fn csv(found: &Findings) -> String {
    let mut text = format!("{}\n", found.head.join(","));
    for row in &found.rows {
        let cells: Vec<String> = row
            .iter()
            .map(|cell| match cell {
                Cell::Text(text) if text.contains(',') => format!("\"{text}\""),
                Cell::Text(text) => text.clone(),
                Cell::Figure(value) => value.to_string(),
            })
            .collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

fn markdown(found: &Findings, args: &Learning) -> String {
    let mut text = format!("# {}\n\n{}\n\n![{}]({}.svg)\n\n", found.title, found.method, found.title, found.name);
    let _ = writeln!(text, "| {} |\n|{}", found.head.join(" | "), "---|".repeat(found.head.len()));
    for row in &found.rows {
        let cells: Vec<String> = row
            .iter()
            .map(|cell| match cell {
                Cell::Text(text) => text.clone(),
                Cell::Figure(value) => format!("{value:.3e}"),
            })
            .collect();
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text.push('\n');
    for finding in &found.findings {
        let _ = writeln!(text, "- {finding}");
    }
    let _ = write!(
        text,
        "\nMade by `gapscope study {}{}{} --force`.\n",
        found.name,
        if args.steps == 8000 { String::new() } else { format!(" --steps {}", args.steps) },
        if args.repeats == 3 { String::new() } else { format!(" --repeats {}", args.repeats) },
    );
    text
}

/// Slope of log y over log x by least squares.
fn exponent(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::ln)).collect();
    let count = logs.len() as f64;
    let mean = |k: usize| logs.iter().map(|p| p[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let (cross, square) =
        logs.iter().fold((0.0, 0.0), |(c, s), p| (c + (p[0] - x) * (p[1] - y), s + (p[0] - x) * (p[0] - x)));
    cross / square
}

/// A series of measured points.
fn measured(name: impl Into<String>, points: Vec<[f64; 2]>) -> Series {
    Series { name: name.into(), points, dots: true, ..Series::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_law_is_its_power() {
        let points: Vec<[f64; 2]> = (1..9).map(|i| [f64::from(i), 3.0 * f64::from(i).powf(-0.5)]).collect();
        assert!((exponent(&points) + 0.5).abs() < 1e-12);
    }
}
