//! `gapscope withheld`: cases whose hidden effect is sealed, and how well a binary names it.

mod bank;
mod calibrate;
mod make;
mod score;
mod table;
mod trial;

pub use score::scored;
pub use trial::gathered;

use crate::cli::Withheld;
use anyhow::Result;

/// Makes or scores a bank, or holds confidence against it; returns what to print.
///
/// # Errors
/// A bank that is not one, or results that exist or cannot be written.
pub fn run(args: &Withheld) -> Result<String> {
    match args {
        Withheld::Make(args) => make::run(args),
        Withheld::Score(args) => score::run(args),
        Withheld::Calibrate(args) => calibrate::run(args),
    }
}

/// A bar over the cases on standard error where that is a terminal, nothing elsewhere.
fn progress(cases: usize) -> indicatif::ProgressBar {
    let bar = indicatif::ProgressBar::new(cases as u64);
    if let Ok(style) = indicatif::ProgressStyle::with_template("{bar:30} {pos}/{len} cases  {elapsed}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
