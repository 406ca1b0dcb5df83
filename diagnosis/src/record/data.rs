//! What a problem is made from.

use crate::record::band::Band;
use crate::record::known::Known;
use crate::record::signals::Signals;
use gapscope_dynamics::Model;

/// The logs that a problem is made from.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// The nominal robot.
    pub model: &'a Model,
    /// Signals of every episode.
    pub signals: &'a [Signals],
    /// Rows.
    pub band: &'a Band,
    /// Speed per joint below which it stands.
    pub standstill: &'a [f64],
    /// Joints that move.
    pub moving: &'a [bool],
    /// Noise floor of each joint.
    pub noise: &'a [f64],
    /// Columns that are the same in every problem of these logs.
    pub known: &'a Known,
}
