//! Gaps, where they lie, and how far they shrink.

use super::PerJoint;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where the gap of the nominal model lies, on held-out data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Inverse-dynamics torque, N m (N for prismatic joints).
    pub torque: TorqueGap,
    /// One step x_{t+1} − f_phys(x_t, τ_t).
    pub one_step: StateGap,
    /// Open-loop rollouts under the logged effort, by horizon.
    pub rollout: Vec<RolloutGap>,
    /// Share of each regime in its joint's squared torque gap.
    pub regimes: Vec<Regime>,
}

/// Torque gap per joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TorqueGap {
    /// Root mean square of measured minus nominal torque.
    pub rms: PerJoint,
    /// What the noise of the log alone gives.
    pub floor: PerJoint,
    /// 95 % interval of `rms` by block bootstrap.
    pub ci95: BTreeMap<String, [f64; 2]>,
}

/// One-step error per joint, rms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateGap {
    /// rad (m).
    pub position: PerJoint,
    /// rad/s (m/s).
    pub velocity: PerJoint,
}

/// Position error of rollouts at one horizon, rms over starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RolloutGap {
    /// Horizon, s.
    pub horizon: f64,
    /// rad (m).
    pub position: PerJoint,
}

/// One regime of one joint: `standstill`, `reversal`, `low_speed`, `high_speed`, `high_load`, `high_acceleration`, `pose`, `frequency_band` or `time`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Regime {
    /// Joint name.
    pub joint: String,
    /// Name of the regime.
    pub regime: String,
    /// What bounds the regime: quantity with unit and its interval, e.g. `speed`, `rad/s`, `[0, 0.05]`.
    pub bounds: Bounds,
    /// Part of the joint's squared torque gap that lies in this regime.
    pub share: f64,
    /// 95 % interval of `share`.
    pub ci95: [f64; 2],
    /// Part of the samples that lie in this regime (for a frequency band, part of the effort's variation): a share well above
    /// it marks the regime.
    pub samples: f64,
}

/// Interval of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Quantity, e.g. `speed`.
    pub quantity: String,
    /// Unit.
    pub unit: String,
    /// From, to; `None` where open.
    pub interval: [Option<f64>; 2],
}

/// How far the gap shrinks on held-out data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shrink {
    /// Weighted rms torque.
    pub torque: Change,
    /// Rms one-step velocity error over the joints that move, rad/s (m/s).
    pub one_step: Change,
    /// Rms rollout position error over the joints that move, by horizon, rad (m).
    pub rollout: Vec<HorizonChange>,
    /// Reference figures in the measure of `torque.after`.
    pub reference: Reference,
}

/// A gap before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Nominal model; `None` where it cannot be simulated (singular mass matrix) or every rollout leaves for infinity.
    pub before: Option<f64>,
    /// Corrected model; `None` where it cannot be simulated.
    pub after: Option<f64>,
    /// 1 − after/before; `None` where `before` is at the floor.
    pub shrink: Option<f64>,
    /// 95 % interval of `shrink`.
    pub ci95: Option<[f64; 2]>,
}

impl Change {
    /// That of a model that was left as it is.
    pub fn undo(&mut self) {
        self.after = self.before;
        self.shrink = self.before.map(|_| 0.0);
        self.ci95 = None;
    }

    /// The gap before and after, NaN where it is unknown: for arithmetic and for printing.
    pub fn gaps(&self) -> [f64; 2] {
        [self.before, self.after].map(|gap| gap.unwrap_or(f64::NAN))
    }
}

/// A gap before and after at one horizon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HorizonChange {
    /// Horizon, s.
    pub horizon: f64,
    /// The change.
    #[serde(flatten)]
    pub change: Change,
}

/// Reference figures, in the measure of `torque.after`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// What noise alone gives.
    pub noise_floor: f64,
    /// A residual network on top of the nominal model, held out; `None` where it was not trained.
    pub residual_network: Option<f64>,
    /// A network alone, (q, q̇, q̈) to torque, held out; `None` where it was not trained.
    pub pure_network: Option<f64>,
}
