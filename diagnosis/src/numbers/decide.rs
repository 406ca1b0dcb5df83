//! The numbers that decide an answer, 25 of them. Budgets of searches, tolerances and limits of loops stand where they are
//! used; what is true of one kind of effect stands on its card.
//!
//! A study turns each to a half and to double and shows what that does to the answers: `gapscope study numbers`.

use std::sync::atomic::{AtomicU64, Ordering};

/// A number that decides.
#[derive(Debug)]
pub struct Number {
    /// Its name, as it stands here.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    value: f64,
    /// Bits of the factor that a study has turned it by.
    turned: AtomicU64,
}

impl Number {
    const fn new(name: &'static str, unit: &'static str, value: f64) -> Number {
        Number { name, unit, value, turned: AtomicU64::new(1f64.to_bits()) }
    }

    /// Its value.
    pub fn get(&self) -> f64 {
        self.value * f64::from_bits(self.turned.load(Ordering::Relaxed))
    }

    /// Multiplies it by a factor, for all diagnoses of this process, until it is turned again. For studies alone.
    pub fn turn(&self, factor: f64) {
        self.turned.store(factor.to_bits(), Ordering::Relaxed);
    }
}

macro_rules! numbers {
    ($($(#[$doc:meta])* $name:ident = $value:expr, $unit:literal;)*) => {
        $($(#[$doc])* pub static $name: Number = Number::new(stringify!($name), $unit, $value);)*

        /// All of them.
        pub static ALL: &[&Number] = &[$(&$name),*];
    };
}

numbers! {
    // What an account must bring.

    /// Twenty to one. A kind beyond calibration must bring as much, as about one arm in twenty has it; a rival that is less
    /// likely by no more is a tie, and is named; an effect that is likelier than none by as much is called seen.
    TWENTY_TO_ONE = 3.0, "nats";

    /// What a law outside the catalogue must bring: it is to be rarer than any effect.
    PRICE_OF_OUTSIDE = 5.0, "nats";

    /// What an odd account must bring: some links off while others are right, where one may have been wrong in the URDF or
    /// all are a little; what hardly moves a joint, or comes where nothing is missed.
    PRICE_OF_ODD = 20.0, "nats";

    // How well things are known.

    /// No law is exact to better than this part of the torque that it explains, and no drive's torque is known to better.
    EXACT_TO = 0.003, "part of the effort";

    /// What sampling and integration leave.
    UNNOTICED = 1e-3, "part of the effort";

    /// A gap that is nobody's concern.
    IMMATERIAL = 0.01, "part of the effort";

    /// What a law makes of noise, and how much of a delay and how much of a lag a drive is, is known to this part: it is
    /// neither white, nor one of the two exactly.
    KNOWN_TO = 0.15, "part";

    /// The noise floor is known to this factor: it is an estimate itself. A gap above it is more than noise, and its joint worth
    /// a look; a gap below it by as much was not there to begin with.
    FLOOR_KNOWN_TO = 1.3, "factor";

    // What noise does.

    /// Up to here what is left is noise (Huber 1964): rows beyond count less, and so does what is borne at rest; a joint that
    /// leaves more of its floor than this is no chance of one among many.
    OUTLIER = 3.0, "standard deviations";

    /// Beyond this multiple of that, the weight of a row falls with the square.
    FAR_OUT = 2.0, "factor";

    /// Beyond any doubt, also as the best of a hundred tries: a row that stands out, a drive that is not rigid, an experiment
    /// that parts two accounts.
    CLEAR = 5.0, "standard deviations";

    /// Of the distribution of what is left: its tails are so heavy that neither a glitch nor a blow decides.
    FREEDOM = 4.0, "degrees of freedom";

    /// An account that does not feel this part of a touch of the effort does not predict the effort there.
    FELT = 0.05, "part";

    // Motors that turn on their own.

    /// A drive is not rigid where an account of it leaves this part of the mean square, or less: in all, or of the blocks of
    /// time in the mean of logarithms, as a burst of chatter is one block.
    NOT_RIGID_LEAVES = 0.85, "part of the square";

    /// Part of the noise below which what is left of a block of time is as good as nothing: play may show in few of them.
    BLOCK_OF_NOISE = 0.25, "part of the square";

    /// A rotor lighter than this would not show.
    LIGHTEST_ROTOR = 0.05, "part of the inertia that it turns";

    // What to say.

    /// A gap over this matters, however much larger it was before.
    MATERIAL_GAP = 0.1, "part of the effort";

    /// Effects explain the gap if they leave less than this above the floor: about a twentieth of the gap.
    EXPLAINED = 0.003, "part of the square";

    /// A network predicts less than this of noise, held out: what it predicts by chance, several times.
    PREDICTED = 0.05, "part of the square";

    /// Spread of the mean squares of seconds over what noise of the same correlation has. Of a minute it is 1 ± 0.2; a spot
    /// that rubs, chatter and the edges of friction have 4 to 10.
    UNEVEN = 2.0, "factor";

    /// Rows that noise is correlated over, at most, as squares: 0.4 s at the usual cut-off. Drift is remembered longer.
    REMEMBERED = 10.0, "rows";

    /// Power of the explained part of the gap by which confidence falls: what leaves much of the gap may be the nearest thing
    /// that the catalogue has to a cause that it has not.
    MISFIT = 4.0, "exponent";

    /// Effects that are there of those named beside a rest so large that nothing speaks for them, measured on withheld cases:
    /// laws that nobody has thought of look like those in the catalogue at times. Such an effect could be.
    LEAST_THERE = 0.45, "part";

    /// Effects that are there of those named beyond doubt, measured on withheld cases.
    MOST_THERE = 0.98, "part";

    /// Logs determine a sum of bodies whose interval is narrower than this part of the one that it had before them.
    DETERMINED = 0.5, "part";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_turned_and_turned_back() {
        let number = Number::new("X", "m", 3.0);
        number.turn(0.5);
        assert_eq!(number.get(), 1.5);
        number.turn(1.0);
        assert_eq!(number.get(), 3.0);
    }

    #[test]
    fn there_are_25_and_each_has_a_name_and_a_unit_of_its_own() {
        assert_eq!(ALL.len(), 25);
        assert!(ALL.iter().all(|n| !n.unit.is_empty() && n.get() > 0.0));
        let mut names: Vec<&str> = ALL.iter().map(|n| n.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 25);
    }
}
