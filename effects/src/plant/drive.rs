//! A joint whose motor turns on its own: a spring with damping, or play, between motor and link.

use crate::wind_up::CONTACT;

/// The wind-up δ = motor − link of one joint, both on the joint's side of the gear, and what acts along it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drive {
    pub(crate) joint: usize,
    /// The motor's coordinate behind those of the links; `None` without a rotor's inertia.
    pub(super) motor: Option<usize>,
    /// Inertia of the rotor, kg m².
    pub(super) rotor: f64,
    /// k, N m/rad; 0 until known.
    pub(crate) stiffness: f64,
    /// d, N m s/rad.
    pub(crate) damping: f64,
    /// Half the play, rad.
    pub(crate) half_gap: f64,
}

/// What stands between the motor and the link of one joint, as the plant has settled it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transmission {
    /// Index of the joint.
    pub joint: usize,
    /// Inertia of the rotor on the joint's side of the gear, kg m² (kg); 0 where the motor follows at once.
    pub rotor: f64,
    /// Stiffness of the spring, or of the contact behind the play, N m/rad (N/m).
    pub stiffness: f64,
    /// Its damping, N m s/rad (N s/m).
    pub damping: f64,
    /// The whole play, rad (m).
    pub gap: f64,
}

impl Drive {
    pub(super) fn transmission(&self) -> Transmission {
        let Drive { joint, rotor, stiffness, damping, half_gap, .. } = *self;
        Transmission { joint, rotor, stiffness, damping, gap: 2.0 * half_gap }
    }

    pub(super) fn rigid(joint: usize) -> Drive {
        Drive { joint, motor: None, rotor: 0.0, stiffness: 0.0, damping: 0.0, half_gap: 0.0 }
    }

    /// Gives play without elasticity the stiffness of its contact; `inertia` is the link's about the joint, kg m².
    pub(super) fn stiffen(&mut self, inertia: f64) {
        if self.stiffness == 0.0 {
            let (frequency, ratio) = CONTACT;
            let omega = std::f64::consts::TAU * frequency;
            self.stiffness = inertia * omega * omega;
            self.damping = 2.0 * ratio * inertia * omega;
        }
    }

    /// Parts of δ among the coordinates of links and motors.
    pub(super) fn parts(&self) -> [(usize, f64); 2] {
        [(self.motor.unwrap_or(self.joint), 1.0), (self.joint, -1.0)]
    }

    /// δ of coordinates, or its rate of speeds.
    pub(super) fn across(&self, x: &[f64]) -> f64 {
        self.motor.map_or(0.0, |motor| x[motor] - x[self.joint])
    }

    /// δ at rest under a torque.
    pub(super) fn wind_up(&self, torque: f64) -> f64 {
        let play = if torque == 0.0 { 0.0 } else { self.half_gap * torque.signum() };
        torque / self.stiffness + play
    }

    /// Impulse from motor to link over a time `h` that begins with the wind-up `delta` of rate `rate`, where the rate at
    /// the end is `free` − `mobility` · impulse.
    ///
    /// On either side the torque is k p + d ṗ for a penetration p > 0 of half the gap, no less than 0 (contact never
    /// pulls) and no more than 2 k p (so that it begins and ends without a jump), at the middle of the step.
    /// Each bound rises with the rate at the end, so the impulse is the least of those of the two upper laws.
    pub(super) fn contact_impulse(&self, h: f64, delta: f64, rate: f64, free: f64, mobility: f64) -> f64 {
        let side = |sign: f64| {
            let (delta, rate, free) = (sign * delta, sign * rate, sign * free);
            let law = |k: f64, d: f64| {
                let open = k * (delta - self.half_gap + 0.25 * h * (rate + free)) + 0.5 * d * (rate + free);
                h * open / (1.0 + h * mobility * (0.25 * h * k + 0.5 * d))
            };
            law(self.stiffness, self.damping).min(law(2.0 * self.stiffness, 0.0)).max(0.0)
        };
        side(1.0) - side(-1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn play_transmits_nothing_inside_the_gap_and_never_pulls() {
        let drive = Drive { stiffness: 400.0, damping: 3.0, half_gap: 0.01, ..Drive::rigid(0) };
        let h = 1e-6;
        for delta in [-0.009, 0.0, 0.009] {
            assert_eq!(drive.contact_impulse(h, delta, 2.0, 2.0, 0.0), 0.0);
        }
        for k in -40..=40 {
            let rate = 0.5 * f64::from(k);
            let torque = drive.contact_impulse(h, 0.012, rate, rate, 0.0) / h;
            assert!((0.0..=2.0 * 400.0 * 0.0021).contains(&torque), "{torque}");
            let other = drive.contact_impulse(h, -0.012, -rate, -rate, 0.0) / h;
            assert!((torque + other).abs() < 1e-12);
        }
        assert!((drive.contact_impulse(h, 0.015, 0.0, 0.0, 0.0) / h - 2.0).abs() < 1e-9);
        assert!((drive.wind_up(2.0) - 0.015).abs() < 1e-12 && drive.wind_up(0.0) == 0.0);
    }
}
