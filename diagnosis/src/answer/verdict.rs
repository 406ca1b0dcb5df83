//! The answer in a word.

use crate::numbers::decide::{EXPLAINED, FLOOR_KNOWN_TO, IMMATERIAL, MATERIAL_GAP, OUTLIER};
use crate::record::rows;
use crate::schema::Verdict;

/// Weighted held-out gap before and after, and the noise floor in the same measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Of the nominal model.
    pub before: f64,
    /// With the effects.
    pub after: f64,
    /// Of a perfect model.
    pub floor: f64,
}

impl Level {
    /// Squared gap left above the floor over the squared gap before.
    pub fn unexplained_fraction(&self) -> f64 {
        if self.before <= 0.0 {
            return 0.0;
        }
        ((self.after.powi(2) - self.floor.powi(2)) / self.before.powi(2)).clamp(0.0, 1.0)
    }

    /// Whether what is left is more than noise.
    pub fn leaves_any(&self) -> bool {
        self.after > FLOOR_KNOWN_TO.get() * self.floor
    }

    /// Whether what is left is material, and more than explained gaps leave.
    fn matters(&self) -> bool {
        self.after > IMMATERIAL.get()
            && (self.unexplained_fraction() > EXPLAINED.get() || self.after > MATERIAL_GAP.get())
    }
}

/// The gap of the whole robot and of each joint: what is large in one joint can be lost in the sum.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// All joints together.
    pub all: Level,
    /// Each joint alone.
    pub joints: Vec<Level>,
    /// Whether the noise floor of each joint holds: with a drive that turns on its own a joint swings with noise in the band,
    /// which the floor is not read from.
    pub floored: Vec<bool>,
}

impl Judged {
    /// From sums of squares a joint, the count last, of the nominal model and with the effects, the noise floor of each joint
    /// in its own unit, the weights of the joints, and which of them have drives that turn on their own.
    pub fn new(before: &[f64], after: &[f64], floor: &[f64], weights: &[f64], turning: &[bool]) -> Judged {
        let level = |weights: &[f64]| Level {
            before: rows::weighted_rms(before, weights),
            after: rows::weighted_rms(after, weights),
            floor: rows::weighted_floor(floor, weights),
        };
        let joints = (0..weights.len()).map(|j| level(&rows::of_joint(weights, j))).collect();
        Judged { all: level(weights), joints, floored: turning.iter().map(|turns| !turns).collect() }
    }

    /// Squared gap left above the floor over the squared gap before, all joints together.
    pub fn unexplained_fraction(&self) -> f64 {
        self.all.unexplained_fraction()
    }

    /// The same of some joints, or of all where there are none.
    pub fn unexplained_of(&self, joints: &[usize]) -> f64 {
        if joints.is_empty() {
            return self.unexplained_fraction();
        }
        let size = |of: fn(&Level) -> f64| joints.iter().map(|&j| of(&self.joints[j]).powi(2)).sum::<f64>().sqrt();
        Level { before: size(|l| l.before), after: size(|l| l.after), floor: size(|l| l.floor) }.unexplained_fraction()
    }

    /// Whether what is left is more than noise and more than explained gaps leave.
    pub fn leaves_much(&self) -> bool {
        (self.all.leaves_any() && self.all.matters()) || self.any_alone()
    }

    /// Whether a joint leaves more than noise and more than explained gaps leave, whatever the others do.
    fn alone(&self, j: usize) -> bool {
        let level = &self.joints[j];
        self.floored[j] && level.after > (OUTLIER.get() * level.floor).max(IMMATERIAL.get()) && level.matters()
    }

    fn any_alone(&self) -> bool {
        (0..self.joints.len()).any(|j| self.alone(j))
    }

    /// Whether what laws outside the catalogue account for concerns anyone: a part of some joint's effort, `beside` with them taken
    /// for known.
    pub fn concerned_by_laws(&self, beside: &Judged) -> bool {
        let takes = |(left, beside): (&Level, &Level)| left.after.powi(2) - beside.after.powi(2);
        self.joints.iter().zip(&beside.joints).map(takes).any(|square| square > IMMATERIAL.get().powi(2))
    }

    /// The answer in a word, by whether any effect was found, and whether a law outside the catalogue concerns anyone beside them.
    pub fn verdict(&self, no_effects: bool, outside: bool) -> Verdict {
        match (no_effects, self.leaves_much()) {
            (true, false) => Verdict::NoGap,
            (true, true) => Verdict::UnknownEffect,
            (false, false) if !outside => Verdict::Explained,
            (false, _) => Verdict::PartlyExplained,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seven joints of equal effort, each with its gap before and after, under a floor of a thousandth.
    fn judged(before: [f64; 7], after: [f64; 7]) -> Judged {
        let sums = |gap: [f64; 7]| gap.iter().map(|x| x * x).chain([1.0]).collect::<Vec<f64>>();
        Judged::new(&sums(before), &sums(after), &[1e-3; 7], &[1.0; 7], &[false; 7])
    }

    /// The gap of one joint, all others at the floor.
    fn one(joint: usize, gap: f64) -> [f64; 7] {
        std::array::from_fn(|j| if j == joint { gap } else { 1e-3 })
    }

    #[test]
    fn what_is_left_in_one_joint_is_not_lost_in_what_was_found_in_all() {
        // A payload is gone, a spot that rubs in the fourth joint is left: a hundredth of that joint's gap, squared.
        let spot = judged([1.0; 7], one(3, 0.1));
        assert!(spot.unexplained_fraction() < EXPLAINED.get());
        assert_eq!(spot.verdict(false, false), Verdict::PartlyExplained);
        assert_eq!(judged([1.0; 7], one(3, 1e-3)).verdict(false, false), Verdict::Explained);
        // Nothing was found, and six quiet joints make noise of the seventh's.
        let alone = judged(one(3, 0.03), one(3, 0.03));
        assert_eq!(alone.verdict(true, false), Verdict::UnknownEffect);
        assert_eq!(judged([2e-3; 7], one(3, 2e-3)).verdict(true, false), Verdict::NoGap);
        // A law outside the catalogue that accounts for all that this joint leaves concerns somebody; for less than that, nobody.
        let faint = judged([1.0; 7], one(3, 9e-3));
        let known = judged([1.0; 7], one(3, 1e-3));
        assert!(spot.concerned_by_laws(&known) && !faint.concerned_by_laws(&known));
        // A spring swings with noise in the band: what its joint leaves is no measure.
        let spring = Judged { floored: (0..7).map(|j| j != 3).collect(), ..spot };
        assert_eq!(spring.verdict(false, false), Verdict::Explained);
        // What only the sum shows still counts.
        assert_eq!(judged([0.02; 7], [0.02; 7]).verdict(true, false), Verdict::UnknownEffect);
    }
}
