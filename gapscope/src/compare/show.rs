//! A comparison as a table of the terminal, and as a picture.

use super::{Answer, Comparison, Row};
use crate::picture::{Panel, Series, panels};
use crate::report::axis::Axis;
use crate::report::terminal::{cut_to, fill, pad};
use crate::report::{figure, significant};
use std::fmt::Write;
use std::path::Path;

/// Panels of a picture: those that differ, then the farthest apart of the others.
const PANELS: usize = 12;

/// The table, and what it comes to.
pub fn table(found: &Comparison, picture: Option<&Path>) -> String {
    let count = |answer: Answer| found.parameters.iter().filter(|row| row.answer == answer).count();
    let (differ, open) = (count(Answer::Differs), count(Answer::Open));
    let mut text = String::new();
    for (result, robot) in found.results.iter().zip(&found.robots) {
        let _ = writeln!(text, "{}  {}", pad(result, 24), cut_to(robot, 60));
    }
    let _ = writeln!(
        text,
        "\n{differ} of {} parameters differ: more than {} standard errors apart, so that chance makes one in twenty comparisons differ.",
        found.parameters.len(),
        significant(found.threshold, 2)
    );
    if open > 0 {
        let _ = writeln!(
            text,
            "{open} have no interval in one of the results, which is needed to say whether they differ."
        );
    }
    if found.robots.windows(2).any(|pair| pair[0] != pair[1]) {
        text += "The robots have different names; joints were matched by theirs.\n";
    }
    text.push('\n');
    let names: Vec<String> = found.parameters.iter().map(Row::name).collect();
    let wide = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let _ = write!(text, "{}", pad("", wide));
    for result in &found.results {
        let _ = write!(text, "  {}", fill(&cut_to(result, 22), 22));
    }
    text += "  last − first            answer\n";
    for (row, name) in found.parameters.iter().zip(&names) {
        let _ = write!(text, "{}", pad(name, wide));
        for told in &row.told {
            let cell = match told {
                Some(told) => {
                    let value = if told.found { figure(told.value) } else { "none".to_owned() };
                    value + &told.half.map_or(String::new(), |half| format!(" ± {}", significant(half, 2)))
                }
                None => "–".to_owned(),
            };
            let _ = write!(text, "  {}", fill(&cell, 22));
        }
        let change = row.change.map_or("–".to_owned(), |[change, half]| {
            let sign = if change < 0.0 { "−" } else { "+" };
            format!("{sign}{} ± {} {}", figure(change.abs()), significant(half, 2), row.unit)
        });
        let mut answer = match row.answer {
            Answer::Differs => format!("differs, {} errors", significant(row.apart.unwrap_or(f64::NAN), 2)),
            Answer::Common => "common".to_owned(),
            Answer::Open => "no interval".to_owned(),
        };
        for (told, result) in row.told.iter().zip(&found.results) {
            if let Some(under) = told.as_ref().and_then(|told| told.under.as_ref()) {
                let _ = write!(answer, "; as {under} in {result}");
            }
        }
        let _ = writeln!(text, "  {}{answer}", pad(&change, 24));
    }
    if let Some(picture) = picture {
        let _ = writeln!(text, "\nPicture  {}", picture.display());
    }
    text
}

/// A panel for each parameter that differs, then for others, with the 95 % intervals.
pub fn picture(found: &Comparison) -> String {
    let drawn: Vec<Panel> = found
        .parameters
        .iter()
        .filter(|row| row.told.iter().flatten().count() > 1)
        .take(PANELS)
        .map(|row| {
            let points = row.told.iter().enumerate().filter_map(|(i, told)| Some((i, told.as_ref()?)));
            let series: Vec<Series> = points
                .map(|(i, told)| {
                    let half = told.half.filter(|half| half.is_finite()).unwrap_or(0.0);
                    Series {
                        name: found.results[i].clone(),
                        points: vec![[i as f64 + 1.0, told.value]],
                        intervals: vec![[told.value - half, told.value + half]],
                        dots: true,
                        ..Series::default()
                    }
                })
                .collect();
            let mut x = Axis::tight([0.5, found.results.len() as f64 + 0.5], "", 2);
            x.ticks = (0..found.results.len()).map(|i| (i as f64 + 1.0, (i + 1).to_string())).collect();
            let ends = series.iter().flat_map(|one| one.intervals.iter().flatten().copied()).collect::<Vec<_>>();
            let answer = if row.answer == Answer::Differs { " (differs)" } else { "" };
            let y = Axis::padded(ends, &row.unit, 4);
            Panel { title: cut_to(&(row.name() + answer), 60), x, y, series, rules: Vec::new() }
        })
        .collect();
    panels("Parameters of the results, with 95 % intervals", &drawn)
}
