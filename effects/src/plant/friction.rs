//! Dry friction, bristles and play: the forces that the step finds by projected Gauss–Seidel.

use super::Plant;
use super::drive::Drive;

/// Sweeps of the solver in one stage; it stops earlier once the impulses have settled.
const SWEEPS: usize = 60;
/// Relative change of an impulse at which it has settled.
const TOLERANCE: f64 = 1e-10;

/// A combination of joint speeds s = Σ weight · q̇_joint and what acts along it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Direction {
    /// Indices of joints with their weights.
    pub parts: Vec<(usize, f64)>,
    /// b in −b s, N m s/rad.
    pub viscous: f64,
    /// I in −I ṡ, kg m².
    pub inertia: f64,
    /// f in −f sign s, N m.
    pub coulomb: f64,
    /// What standstill adds to f, N m; it fades with e^{−(s/v)²}.
    pub static_rise: f64,
    /// v of the static rise, rad/s.
    pub stribeck_velocity: f64,
    /// What the start of the episode adds to f, N m; it fades with e^{−t/T}.
    pub cold_rise: f64,
    /// T of the cold rise, s.
    pub time_constant: f64,
    /// What each N m of delivered effort of the first joint adds to f.
    pub load: f64,
}

impl Direction {
    pub(super) fn along(&self, x: &[f64]) -> f64 {
        along(&self.parts, x)
    }

    /// Greatest dry friction at a speed, a time since the start of the episode and delivered efforts, N m.
    pub(super) fn bound(&self, speed: f64, time: f64, delivered: &[f64]) -> f64 {
        let mut bound = self.unloaded_bound(speed, time);
        if let (true, Some(&(joint, _))) = (self.load > 0.0, self.parts.first()) {
            bound += self.load * delivered[joint].abs();
        }
        bound
    }

    /// The same without what the delivered effort adds.
    pub(super) fn unloaded_bound(&self, speed: f64, time: f64) -> f64 {
        let mut bound = self.coulomb;
        if self.static_rise > 0.0 {
            bound += self.static_rise * (-(speed / self.stribeck_velocity).powi(2)).exp();
        }
        if self.cold_rise != 0.0 {
            bound += self.cold_rise * (-time / self.time_constant).exp();
        }
        bound
    }

    /// ∂bound/∂speed, N m s/rad.
    pub(super) fn bound_slope(&self, speed: f64) -> f64 {
        if self.static_rise == 0.0 {
            return 0.0;
        }
        let ratio = speed / self.stribeck_velocity;
        -2.0 * ratio / self.stribeck_velocity * self.static_rise * (-ratio * ratio).exp()
    }
}

/// Bristles on one joint: Dahl's friction, ż = s − σ abs(s) z / f with the force −σ z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bristle {
    /// Index of the joint.
    pub joint: usize,
    /// f, N m.
    pub coulomb: f64,
    /// σ, N m/rad.
    pub stiffness: f64,
}

impl Bristle {
    /// Force σ z⁺ against the motion, of a step `h` at the end of which the speed is `free` − `mobility` · h σ z⁺:
    /// the root of Dahl's law by the implicit Euler rule, z⁺ = (z + h s) / (1 + h σ abs(s) / f).
    ///
    /// As abs(z) ≤ f/σ, the force stays within f. The rule loses energy and never makes any:
    /// σ z⁺ h s = ½σ(z⁺² − z²) + ½σ(z⁺ − z)² + h σ² z⁺² abs(s)/f.
    pub(super) fn force(&self, h: f64, free: f64, mobility: f64, z: f64) -> f64 {
        let (sigma, f) = (self.stiffness, self.coulomb);
        // With S = abs(s): (U − S)(1 + a S) = μ (z + h S), where the sign of s is that of free − μ z.
        let mu = mobility * h * sigma;
        let rest = free - mu * z;
        let (u, c) = (rest.signum() * free, rest.abs());
        let a = h * sigma / f;
        let b = 1.0 + mu * h - a * u;
        let root = (b * b + 4.0 * a * c).sqrt();
        let speed = if b >= 0.0 { 2.0 * c / (b + root) } else { (root - b) / (2.0 * a) };
        let s = rest.signum() * speed;
        (sigma * (z + h * s) / (1.0 + a * speed)).max(-f).min(f)
    }
}

/// One unknown impulse of the step, along a combination of speeds.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) parts: Vec<(usize, f64)>,
    pub(super) law: Law,
    pub(super) impulse: f64,
    pub(super) mobility: f64,
    /// Greatest impulse, N m s; the scale of what has settled.
    pub(super) limit: f64,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Law {
    Dry(usize),
    Bristle(usize),
    Play(usize),
}

impl Row {
    pub(super) fn dry(index: usize, direction: &Direction) -> Row {
        Row::new(direction.parts.clone(), Law::Dry(index))
    }

    pub(super) fn bristle(index: usize, bristle: &Bristle) -> Row {
        Row::new(vec![(bristle.joint, 1.0)], Law::Bristle(index))
    }

    pub(super) fn play(index: usize, drive: &Drive) -> Row {
        Row::new(drive.parts().to_vec(), Law::Play(index))
    }

    fn new(parts: Vec<(usize, f64)>, law: Law) -> Row {
        Row { parts, law, impulse: 0.0, mobility: 0.0, limit: 0.0 }
    }
}

pub(super) fn along(parts: &[(usize, f64)], x: &[f64]) -> f64 {
    parts.iter().map(|&(j, weight)| weight * x[j]).sum()
}

/// Takes from what is `left` of joints, N m (N), the forces that leave least of it: of each direction that stands, `bound` tells
/// by its place, any up to that bound (projected Gauss–Seidel). A coupling and the frictions of its two joints share what they
/// hold.
pub(super) fn hold<D: std::borrow::Borrow<Direction>>(
    directions: &[D],
    bound: impl Fn(usize) -> Option<f64>,
    left: &mut [f64],
    forces: &mut [f64],
) {
    forces.fill(0.0);
    let standing = || directions.iter().map(D::borrow).enumerate().filter_map(|(i, d)| Some((i, d, bound(i)?)));
    // Directions that share no joint settle in one sweep.
    let shared = standing().any(|(_, d, _)| d.parts.len() > 1);
    for _ in 0..if shared { SWEEPS } else { 1 } {
        let (mut change, mut largest) = (0.0f64, 0.0f64);
        for (i, direction, bound) in standing() {
            let square: f64 = direction.parts.iter().map(|&(_, weight)| weight * weight).sum();
            let next = (forces[i] + direction.along(left) / square).clamp(-bound, bound);
            let by = next - forces[i];
            direction.parts.iter().for_each(|&(j, weight)| left[j] -= weight * by);
            forces[i] = next;
            (change, largest) = (change.max(by.abs()), largest.max(next.abs()));
        }
        if change <= TOLERANCE * largest {
            break;
        }
    }
}

impl Plant {
    /// Takes the impulses of dry friction, bristles and play of a time `h` from `scratch.v_end`.
    /// Bounds are those at `time` and the predicted speed `scratch.v`.
    pub(super) fn solve_impulses(&mut self, h: f64, time: f64, bristles: &[f64], locked: bool) {
        let s = &mut self.scratch;
        for row in &mut self.rows {
            row.impulse = 0.0;
            row.limit = match row.law {
                Law::Dry(index) => {
                    let direction = &self.directions[index];
                    h * direction.bound(direction.along(&s.v), time, &s.delivered)
                }
                Law::Bristle(index) => h * self.bristles[index].coulomb,
                Law::Play(_) if locked => 0.0,
                Law::Play(_) => f64::MIN_POSITIVE,
            };
            row.mobility = row
                .parts
                .iter()
                .flat_map(|&(i, wi)| row.parts.iter().map(move |&(j, wj)| (i, wi, j, wj)))
                .map(|(i, wi, j, wj)| wi * s.mass_inverse[(i, j)] * wj)
                .sum();
        }
        for _ in 0..SWEEPS {
            let mut settled = true;
            for row in &mut self.rows {
                // Nothing to hold, nothing to hold it on, or a state that is not finite.
                if !(row.limit > 0.0 && row.mobility > 0.0) {
                    continue;
                }
                let speed = along(&row.parts, &s.v_end);
                let free = speed + row.mobility * row.impulse;
                let wanted = match row.law {
                    Law::Dry(_) => (row.impulse + speed / row.mobility).max(-row.limit).min(row.limit),
                    Law::Bristle(index) => h * self.bristles[index].force(h, free, row.mobility, bristles[index]),
                    Law::Play(index) => {
                        let drive = &self.drives[index];
                        drive.contact_impulse(h, drive.across(&s.q_start), drive.across(&s.v_start), free, row.mobility)
                    }
                };
                let change = wanted - row.impulse;
                if change == 0.0 {
                    continue;
                }
                row.impulse = wanted;
                for &(i, wi) in &row.parts {
                    for j in 0..s.v_end.len() {
                        s.v_end[j] -= s.mass_inverse[(j, i)] * wi * change;
                    }
                }
                settled &= change.abs() <= TOLERANCE * row.limit.max(wanted.abs());
            }
            if settled {
                break;
            }
        }
        // A joint whose friction is not used up stands still, to the last bit that the sweeps leave.
        for row in &self.rows {
            if let (Law::Dry(_), &[(j, _)], true) = (row.law, row.parts.as_slice(), row.impulse.abs() < row.limit) {
                s.v_end[j] = 0.0;
            }
        }
    }

    /// Moves the bristles to the end of a step of length `h` that has been solved.
    pub(super) fn bend_bristles(&self, h: f64, bristles: &mut [f64]) {
        for row in &self.rows {
            if let Law::Bristle(index) = row.law {
                bristles[index] = row.impulse / (h * self.bristles[index].stiffness);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_bristle_obeys_its_bound_its_law_and_dissipates(
            speeds in prop::collection::vec(-2.0..2.0_f64, 1..200),
            stiffness in 1.0..1e5_f64,
            coulomb in 0.01..10.0_f64,
            mobility in 1e-6..50.0_f64,
        ) {
            let bristle = Bristle { joint: 0, coulomb, stiffness };
            let (h, mut z, mut lost) = (0.002, 0.0, 0.0);
            for free in speeds {
                let force = bristle.force(h, free, mobility, z);
                prop_assert!(force.abs() <= coulomb * (1.0 + 1e-12));
                let s = free - mobility * h * force;
                let law = (z + h * s) / (1.0 + h * stiffness * s.abs() / coulomb);
                prop_assert!((force - stiffness * law).abs() <= 1e-7 * coulomb, "{} {}", force, stiffness * law);
                let end = force / stiffness;
                let stored = 0.5 * stiffness * (end * end - z * z);
                lost += force * h * s - stored;
                prop_assert!(force * h * s - stored >= -1e-8 * coulomb * h, "{} {}", force * h * s, stored);
                z = end;
            }
            prop_assert!(lost >= -1e-12);
        }
    }
}
