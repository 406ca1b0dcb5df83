//! What friction held at rest: no fit of motion tells it where a joint leaves rest too fast to be seen, but rests do.

use crate::numbers::quantile::quantile;
use gapscope_effects::Rests;

/// What friction held at rest in the rows of a fold, N m or N.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Break-away torque.
    pub torque: f64,
    /// What it may be off by.
    pub doubt: f64,
}

impl Held {
    /// From the torques in the rows at rest, the noise on them, and what rests tell.
    pub fn at_rest(rows: &[Option<f64>], noise: f64, rests: &Rests) -> Option<Held> {
        let mut held: Vec<f64> = rows.iter().filter_map(|x| x.map(f64::abs)).collect();
        held.sort_by(f64::total_cmp);
        // One row alone may be a glitch.
        let &[.., second, greatest] = held.as_slice() else { return None };
        let spread = greatest - quantile(&held, rests.well_below);
        (held.len() as f64 >= rests.least * rows.len() as f64 && second > noise)
            .then_some(Held { torque: second - noise, doubt: rests.spreads * spread + 2.0 * noise })
    }
}
