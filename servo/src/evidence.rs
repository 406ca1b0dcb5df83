//! What a report draws beside the diagnosis: the free runs, and where what is left of the gap lies.

use crate::diagnose::Paths;
use crate::gap::{self, Errors};
use crate::prepare::Joint;
use crate::schema::{PerJoint, Regime};

/// Free runs and what is left; not part of the public JSON.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    /// The nominal arm's positions.
    pub nominal: Paths,
    /// The corrected arm's positions, each on a log or half of one that its parameters did not see.
    pub corrected: Paths,
    /// Root mean square of the corrected arm's position less the log's, by joint, rad.
    pub remaining: PerJoint,
    /// Regimes of what is left.
    pub left: Vec<Regime>,
}

impl Evidence {
    /// Of the errors before and after.
    pub(crate) fn new(before: &Errors, after: &Errors, joints: &[Joint]) -> Evidence {
        Evidence {
            nominal: gap::paths(before, joints),
            corrected: gap::paths(after, joints),
            remaining: gap::by_joint(after, joints),
            left: gap::regimes(after, joints),
        }
    }
}
