//! The answer in a word.

use crate::schema::Verdict;

/// Fewer rows than this tell nothing.
pub const LEAST_ROWS: usize = 50;
/// A gap under this multiple of the noise floor is noise, as far as the estimate of the floor can tell.
const NEAR_FLOOR: f64 = 1.5;
/// A gap under this part of the effort's variation is nobody's concern.
const IMMATERIAL_GAP: f64 = 0.01;
/// Part of the squared gap that is no detail.
const LARGE: f64 = 0.1;
/// A gap over this part of the effort's variation matters, however much larger it was before.
const MATERIAL_GAP: f64 = 0.1;
/// Effects explain the gap if they leave less than this part of its square above the floor: about a twentieth of the gap.
const EXPLAINED: f64 = 0.003;

/// Weighted held-out gap before and after, and the noise floor in the same measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Of the nominal model.
    pub before: f64,
    /// With the effects.
    pub after: f64,
    /// Of a perfect model.
    pub floor: f64,
}

impl Judged {
    /// Squared gap left above the floor over the squared gap before.
    pub fn unexplained_fraction(&self) -> f64 {
        if self.before <= 0.0 {
            return 0.0;
        }
        ((self.after.powi(2) - self.floor.powi(2)) / self.before.powi(2)).clamp(0.0, 1.0)
    }

    /// Whether what is left is more than noise.
    pub fn leaves_any(&self) -> bool {
        self.after > NEAR_FLOOR * self.floor
    }

    /// Whether what is left is more than noise and more than explained gaps leave.
    pub fn leaves_much(&self) -> bool {
        self.leaves_any()
            && self.after > IMMATERIAL_GAP
            && (self.unexplained_fraction() > EXPLAINED || self.after > MATERIAL_GAP)
    }

    /// Whether so much is left that something unknown of the size of what was found is about.
    pub fn leaves_most(&self) -> bool {
        self.leaves_much() && self.unexplained_fraction() > LARGE
    }

    /// The answer in a word, by whether any effect was found, and whether a law outside the catalogue stands beside them.
    pub fn verdict(&self, no_effects: bool, outside: bool) -> Verdict {
        match (no_effects, self.leaves_much()) {
            (true, false) => Verdict::NoGap,
            (true, true) => Verdict::UnknownEffect,
            (false, false) if !outside => Verdict::Explained,
            (false, _) => Verdict::PartlyExplained,
        }
    }
}
