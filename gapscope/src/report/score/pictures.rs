//! The pictures of a score: confusion matrix, calibration curve, accuracy against size of effect.

use super::super::axis::Axis;
use super::super::format::figure;
use super::super::words;
use crate::picture::{Cell, Matrix, Panel, Series, panels};
use gapscope_withheld::{DETECTABLE, Score};

/// Sealed effect by row, the one named first by column.
pub fn confusion(score: &Score) -> String {
    let (labels, counts) = score.confusion_matrix();
    let cells: Vec<Vec<Option<Cell>>> = counts
        .iter()
        .enumerate()
        .map(|(i, row)| {
            let total = row.iter().sum::<usize>();
            let cell = |(j, &n): (usize, &usize)| {
                (n > 0 || i == j && total > 0).then(|| Cell {
                    shade: n as f64 / total as f64,
                    text: n.to_string(),
                    framed: i == j,
                    tip: format!("{} named {}: {n} of {total}", labels[i], labels[j]),
                })
            };
            row.iter().enumerate().map(cell).collect()
        })
        .collect();
    let names: Vec<String> = labels.iter().map(|label| words::effect(label)).collect();
    Matrix {
        title: "Which effect is taken for which",
        sides: ["sealed", "named first"],
        rows: &names,
        columns: &names,
        cells: &cells,
        note: "Cases of one effect, of none and of unknown ones. Shaded by share of the row; framed where the name is right.",
    }
    .svg()
}

/// Share of the effects named that are there, by the confidence they are named with.
pub fn calibration(score: &Score) -> String {
    let line = Series {
        name: "were it as it says".into(),
        points: vec![[0.0, 0.0], [1.0, 1.0]],
        dashed: true,
        ..Series::default()
    };
    let bins = &score.calibration;
    let shares = Series {
        name: "share that is there, 95 % interval; n effects".into(),
        points: bins.iter().map(|bin| [bin.confidence, bin.right]).collect(),
        intervals: bins.iter().map(|bin| bin.ci95).collect(),
        labels: bins.iter().map(|bin| bin.n.to_string()).collect(),
        dots: true,
        ..Series::default()
    };
    let title = match score.totals.calibration_error {
        Some(error) => format!("Confidence against truth: expected calibration error {}", figure(error)),
        None => "Confidence against truth: no effect was named".into(),
    };
    let (x, y) = (Axis::tight([0.0, 1.0], "confidence", 5), Axis::tight([0.0, 1.0], "share that is there", 5));
    panels(&title, &[Panel { title: String::new(), x, y, series: vec![shares, line], rules: vec![] }])
}

/// Share of the sealed effects named, by their signature over noise.
pub fn size(score: &Score) -> String {
    let bins = &score.visibility;
    let shares = Series {
        name: "share named, 95 % interval; n effects".into(),
        points: bins.iter().map(|bin| [(bin.from * bin.to).sqrt(), bin.found]).collect(),
        intervals: bins.iter().map(|bin| bin.ci95).collect(),
        labels: bins.iter().map(|bin| bin.n.to_string()).collect(),
        dots: true,
        ..Series::default()
    };
    let ends = bins.iter().flat_map(|bin| [bin.from, bin.to]).chain([DETECTABLE]);
    let (x, y) = (Axis::powers(ends, "size: signature over noise"), Axis::tight([0.0, 1.0], "share named", 5));
    let rules = vec![(DETECTABLE, "limit of sight".into())];
    panels("Effects found by their size", &[Panel { title: String::new(), x, y, series: vec![shares], rules }])
}
