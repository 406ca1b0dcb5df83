//! Accounts of gravity: a robot that stands otherwise than its description.

use super::motion::{Account, Kind, Scene};
use glam::DVec3;

impl Scene<'_> {
    /// The best gravity far from the robot's own, and the best near it.
    pub fn gravities(&self) -> Vec<Account> {
        let own = self.model.gravity();
        let size = own.length();
        if size < 1e-6 {
            return Vec::new();
        }
        let down = own / size;
        let [x, y] = down.any_orthonormal_pair().into();
        let look = |gravity: DVec3| Account {
            kind: Kind::Gravity,
            joints: Vec::new(),
            changes: Vec::new(),
            gravity: Some(gravity),
            value: gravity.length() / size,
            inside: 0,
            look: self.look(&self.model.clone().with_gravity(gravity), self.sample, &self.range),
        };
        let coarse: Vec<Account> = [-down, x, -x, y, -y, DVec3::ZERO, down * 2.0, down * 0.5]
            .into_iter()
            .map(|direction| look(size * direction))
            .collect();
        let far = coarse.into_iter().min_by(|a, b| a.look.total_cmp(&b.look));
        // A base that is tilted a little is an effect, and competes as such.
        let near = Some(look(own));
        let mut found = Vec::new();
        for mut best in far.into_iter().chain(near) {
            let mut step = 0.2 * size;
            for _ in 0..40 {
                let from = best.gravity.unwrap_or(own);
                if step < 0.004 * size || from.length() > 3.0 * size {
                    break;
                }
                let around = [down, -down, x, -x, y, -y].map(|direction| look(from + step * direction));
                match around.into_iter().min_by(|a, b| a.look.total_cmp(&b.look)) {
                    Some(better) if better.look < best.look - 1e-9 => best = better,
                    _ => step *= 0.5,
                }
            }
            found.push(best);
        }
        found
    }
}
