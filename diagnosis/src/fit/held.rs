//! What friction held at rest: no fit of motion tells it where a joint leaves rest too fast to be seen, but rests do.

use crate::numbers::decide::RESTS;
use crate::numbers::quantile::quantile;

/// Part of the rests of a fold that end well below the break-away torque: by so many times what the others differ, it may
/// lie higher, as a rest that ends in a moment is averaged with what comes before.
const WELL_BELOW: f64 = 0.98;
const SPREADS: f64 = 3.0;

/// What friction held at rest in the rows of a fold, N m or N.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Break-away torque.
    pub torque: f64,
    /// What it may be off by.
    pub doubt: f64,
}

impl Held {
    /// From the torques in the rows at rest, and the noise on them.
    pub fn at_rest(rows: &[Option<f64>], noise: f64) -> Option<Held> {
        let mut held: Vec<f64> = rows.iter().filter_map(|x| x.map(f64::abs)).collect();
        held.sort_by(f64::total_cmp);
        // One row alone may be a glitch.
        let &[.., second, greatest] = held.as_slice() else { return None };
        let spread = greatest - quantile(&held, WELL_BELOW);
        (held.len() as f64 >= RESTS * rows.len() as f64 && second > noise)
            .then_some(Held { torque: second - noise, doubt: SPREADS * spread + 2.0 * noise })
    }
}
