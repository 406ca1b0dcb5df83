//! The size of an account that is taken, at its greatest likelihood.

use super::change::Change;
use super::decide::Decision;
use super::motion::{self, Account, Kind, OTHER_CLOCK};
use super::sample::Sample;
use super::weigh::{Freedom, weigh};
use crate::check::Logs;
use gapscope_dynamics::JointKind;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// By how many nats a unit with a name, or a right angle, may fit worse than what lies beside it: bodies that are off by a
/// few per cent move a factor by as much.
const NAMED: f64 = 12.0;
/// And further nats for each joint: a sixth more of its effort, squared, where no account leaves nothing.
const PER_JOINT: f64 = 9.0;
/// A factor is near a unit with a name where it differs by less than this, as a logarithm, ...
const NEAR: f64 = 0.05;
/// ... and may be that unit within this: bodies that are all off by a tenth move a factor by as much.
const WITHIN: f64 = 0.1;
/// By how many nats degrees are likelier than any other unit before a log is looked at: they are met a hundred times as often.
const MET: f64 = 5.0;
/// By how many nats gravity along an axis of the base may fit worse than what lies beside it.
const MET_TILT: f64 = 4.0;
/// A robot stands upright, hangs or is on a wall where its gravity is this near to an axis of its base, rad.
const UPRIGHT: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A unit with a name that limits ask for is that unit within a factor of two.
const UNTOLD: f64 = std::f64::consts::LN_2;

/// Factors that are tried on either side of one that limits alone tell, and from one to the next: up to thirty times.
const ROUGH: i32 = 23;
const STEP: f64 = 1.16;
/// Places at which they are tried.
const FEW: usize = 100;

impl Decision<'_> {
    /// An account whose factor or zero is brought to where its likelihood is greatest; what has a name stays.
    pub fn sharpened(&self, logs: &Logs, sample: &Sample, active: &[bool], account: Account) -> Account {
        if let (Kind::Gravity, Some(gravity)) = (account.kind, account.gravity) {
            let own = self.model.gravity();
            let at = |gravity: DVec3| {
                let (weighed, extra) = self.weighed(&self.model.clone().with_gravity(gravity), sample, active);
                (weighed.score - extra, gravity)
            };
            let mut best = at(gravity);
            let (size, mut step) = (gravity.length(), 0.04);
            while size > 0.0 && step > 0.004 {
                let [x, y] = (best.1 / size).any_orthonormal_pair().into();
                let around = [x, -x, y, -y].map(|side| at((best.1 + step * size * side).normalize() * size));
                match around.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some(better) if better.0 > best.0 + 1e-6 => best = better,
                    _ => step *= 0.4,
                }
            }
            // The axes of the base are the directions that are met: upside down, on a wall. What is left of the tilt is an effect.
            let axis = axis_of(best.1);
            let upright = best.1.angle_between(axis) < UPRIGHT || at(axis).0 > best.0 - MET_TILT;
            let found = if size > 0.0 && upright { axis } else { best.1 };
            return Account { gravity: Some(found), value: found.length() / own.length(), ..account };
        }
        let add = match account.kind {
            Kind::Zero => true,
            Kind::Scale | Kind::Clock => false,
            _ => return account,
        };
        let at = |value: f64| {
            let mut other = Account { value, ..account.clone() };
            for change in &mut other.changes {
                match change {
                    Change::Clock(factor) => *factor = 1.0 / value,
                    Change::Position(_, _, offset) if add => *offset = -value,
                    Change::Position(_, factor, _) => *factor = 1.0 / value,
                    _ => {}
                }
            }
            let mut changed = sample.clone();
            other.changes.iter().for_each(|change| motion::apply(change, &mut changed));
            let (weighed, extra) = self.weighed(self.model, &changed, active);
            (weighed.score - extra, other, weighed.leaves_little(active))
        };
        let mut best = at(account.value);
        if account.inside > 0 {
            // Limits tell that there is a factor, and hardly its size: the size that asks least of the efforts, at few places.
            let few = sample.thinned(sample.len().div_ceil(FEW).max(1));
            let ones = vec![1.0; active.len()];
            let rough = |i: i32| {
                let value = account.value * STEP.powi(i);
                let mut changed = few.clone();
                let change = |j: &usize| motion::apply(&Change::Position(*j, 1.0 / value, 0.0), &mut changed);
                account.joints.iter().for_each(change);
                (weigh(self.model, &changed, &ones, active, Freedom::ORDINARY).score, value)
            };
            let likeliest = (-ROUGH..=ROUGH).map(rough).max_by(|a, b| a.0.total_cmp(&b.0));
            let other = likeliest.map(|(_, value)| at(value)).filter(|other| other.0 > best.0);
            best = other.unwrap_or(best);
        }
        let mut step = 0.04;
        for _ in 0..9 {
            let moved = |step: f64| if add { best.1.value + step } else { best.1.value * (1.0 + step) };
            let around = [at(moved(step)), at(moved(-step))];
            match around.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(better) if better.0 > best.0 + 1e-6 => best = better,
                _ => step *= 0.4,
            }
        }
        // A right angle is a right angle, and a unit that has a name is that unit; a measured velocity tells a factor better
        // than bodies that are not known well.
        let mut near: Vec<f64> = Vec::new();
        if add {
            near.push((best.1.value / FRAC_PI_2).round() * FRAC_PI_2);
        } else if account.kind == Kind::Scale {
            let prismatic = self.model.joints()[account.joints[0]].kind == JointKind::Prismatic;
            near.extend(motion::position_units(prismatic).iter().map(|(_, factor)| *factor));
        } else {
            near.extend(motion::CLOCKS.iter().map(|(_, factor)| *factor));
        }
        let reach = match account.kind {
            Kind::Zero => 0.12,
            Kind::Clock => 0.15,
            // Limits tell that there is a unit, friction and rotors hardly which.
            _ if account.inside > 0 => UNTOLD,
            _ => WITHIN,
        };
        let most = NAMED + PER_JOINT * active.iter().filter(|active| **active).count() as f64;
        let off = |value: f64| if add { (value - best.1.value).abs() } else { (value / best.1.value).ln().abs() };
        let named = near.into_iter().filter(|value| *value != 0.0 && off(*value) < reach).map(&at);
        // Degrees are the unit that is met.
        let met = |(score, account, _): &(f64, Account, bool)| {
            score + if account.kind == Kind::Scale && account.value == 1f64.to_degrees() { MET } else { 0.0 }
        };
        // Further from where the fit has it, a unit is one only where the fit hardly tells.
        let close = if account.kind == Kind::Scale { NEAR } else { reach };
        // No body that is off moves a zero.
        let least = |value: f64| best.0 - if off(value) < close && !add { most } else { NAMED };
        // Where next to nothing is left, what is left is the robot's own.
        let named = named.filter(|(score, account, little)| {
            *score > least(account.value) || *little && !add && off(account.value) < close
        });
        if let Some(named) = named.max_by(|a, b| met(a).total_cmp(&met(b))) {
            return named.1;
        }
        let (measured, near) = match account.kind {
            // Velocities that are all off by one factor tell the clock, whatever bodies make of it.
            Kind::Clock => (motion::velocity_slope(logs).filter(|slope| slope.ln().abs() > OTHER_CLOCK), UNTOLD),
            Kind::Scale => (slope_of(logs, account.joints[0]).map(f64::recip), reach),
            _ => (None, reach),
        };
        measured.filter(|value| *value > 0.0 && off(*value) < near).map_or(best.1, |value| at(value).1)
    }
}

/// Gravity of the same size along the axis of the base that it is nearest to.
fn axis_of(gravity: DVec3) -> DVec3 {
    let along = |axis: &DVec3| gravity.dot(*axis).abs();
    let axis = DVec3::AXES.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or_default();
    // Without the sign of a zero.
    gravity.length() * gravity.dot(axis).signum() * axis + DVec3::ZERO
}

/// Speed measured over speed derived of one joint, in the first log that tells.
fn slope_of(logs: &Logs, j: usize) -> Option<f64> {
    logs.relations.iter().find_map(|relations| relations[j]).filter(|one| one.correlation > 0.95).map(|one| one.slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gravity_near_an_axis_of_the_base_is_along_it() {
        let near = DVec3::new(-9.78, 0.7, 0.3);
        assert_eq!(axis_of(near), DVec3::new(-near.length(), 0.0, 0.0));
        assert!(near.angle_between(axis_of(near)) < UPRIGHT);
        let tilted = DVec3::new(-9.7, 1.4, 0.3);
        assert!(tilted.angle_between(axis_of(tilted)) > UPRIGHT);
        assert_eq!(axis_of(DVec3::ZERO), DVec3::ZERO);
    }
}
