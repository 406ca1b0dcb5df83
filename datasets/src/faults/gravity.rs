//! Accounts of gravity: a robot that stands otherwise than its description.

use super::motion::{Account, Kind, Scene};
use glam::DVec3;

/// Gravity on earth, m/s². A description may have another planet's, or another unit's; a robot stands on this one.
const EARTH: f64 = 9.81;
/// Gravities whose sizes differ by less than this, relative, are one: they are so on earth.
const ONE: f64 = 0.01;
/// The last step of a direction, rad.
const FINEST: f64 = 0.004;

impl Scene<'_> {
    /// The best gravity far from the robot's own, and the best near it: of another direction, of earth's size, or none, as where
    /// the drive bears the weight.
    pub fn gravities(&self) -> Vec<Account> {
        let own = self.model.gravity();
        let size = own.length();
        if size < 1e-6 {
            return Vec::new();
        }
        let look = |gravity: DVec3| Account {
            kind: Kind::Gravity,
            joints: Vec::new(),
            changes: Vec::new(),
            gravity: Some(gravity),
            value: gravity.length() / size,
            inside: 0,
            look: self.look(&self.model.clone().with_gravity(gravity), self.sample, &self.range),
        };
        let better = |a: &Account, b: &Account| a.look.total_cmp(&b.look);
        let down = own / size;
        let [x, y] = down.any_orthonormal_pair().into();
        let other_size = ((EARTH / size).ln().abs() > ONE).then_some(EARTH);
        let mut starts = Vec::new();
        for size in [Some(size), other_size].into_iter().flatten() {
            // A base that is tilted a little is an effect, and competes as such.
            starts.push(look(size * down));
            starts.extend([-down, x, -x, y, -y].map(|direction| look(size * direction)).into_iter().min_by(better));
        }
        let mut found: Vec<Account> = starts.into_iter().map(|start| turned(start, &look)).collect();
        found.push(look(DVec3::ZERO));
        found
    }
}

/// The direction of a gravity where its look is best.
fn turned(mut best: Account, look: &impl Fn(DVec3) -> Account) -> Account {
    let mut step = 0.2;
    while step > FINEST {
        let Some(from) = best.gravity else { break };
        let size = from.length();
        let [x, y] = (from / size).any_orthonormal_pair().into();
        let around = [x, -x, y, -y].map(|side| look((from + step * size * side).normalize() * size));
        match around.into_iter().min_by(|a, b| a.look.total_cmp(&b.look)) {
            Some(better) if better.look < best.look - 1e-9 => best = better,
            _ => step *= 0.5,
        }
    }
    best
}
