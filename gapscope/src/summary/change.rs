//! A gap before and after, as columns of text.

use crate::report::terminal::{fill, pad};
use crate::report::{percent_interval, percent_within};
use gapscope_diagnosis::schema::Change;

/// What a gap loses as a signed percentage: `−93 %`, to the digits of its interval.
fn change_sign(shrink: f64, interval: Option<[f64; 2]>) -> String {
    let text = percent_within(shrink.abs(), interval);
    match text.trim_start_matches(['<', '>']) {
        _ if text.starts_with('<') || shrink == 0.0 => "±0 %".into(),
        text if shrink < 0.0 => format!("+{text}"),
        text => format!("−{text}"),
    }
}

/// The interval of a change with the signs of [`change_sign`], which are left out where both ends share them.
fn change_interval([low, high]: [f64; 2]) -> String {
    let text = if low < 0.0 && high > 0.0 {
        format!("{} to {}", change_sign(high, None), change_sign(low, None))
    } else if high <= 0.0 {
        percent_interval([-high, -low])
    } else {
        percent_interval([low, high])
    };
    // Beyond 99.9 % both ends print alike and say nothing.
    if text.starts_with('>') { String::new() } else { format!(" ({text})") }
}

/// A change, printed: `21 % → 1.5 %  −93 % (92–94 %)`.
pub struct Cells {
    /// Nominal model.
    pub before: String,
    /// Corrected model.
    pub after: String,
    /// The change with its interval.
    pub shrink: String,
}

impl Cells {
    /// A change, its figures printed by `print`.
    pub fn of(change: &Change, print: impl Fn(f64) -> String) -> Self {
        let shrink = match (change.shrink, change.ci95) {
            // Of a rollout that goes nowhere no part can be told.
            (Some(part), _) if part < -1e3 => "worse".into(),
            (Some(part), ends) => {
                let ends = ends.map_or(String::new(), change_interval);
                format!("{}{ends}", change_sign(part, change.ci95))
            }
            (None, _) => "at the noise floor".into(),
        };
        Cells { before: print(change.gaps()[0]), after: print(change.gaps()[1]), shrink }
    }

    /// The change in columns of the given widths.
    pub fn line(&self, before: usize, after: usize) -> String {
        format!("{} → {}  {}", fill(&self.before, before), pad(&self.after, after), self.shrink)
    }
}
