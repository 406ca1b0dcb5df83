//! How far a motor turns ahead of its link along a measured run.

use crate::filter::{first_derivative, first_order, second_derivative, smoothed};
use crate::plant::CONTACT;
use crate::{Candidate, EncoderSide, Kind, Motion};
use gapscope_dynamics::{Data, Model};
use nalgebra::{DMatrix, Matrix2, Vector2};
use std::f64::consts::TAU;

/// Longest step of the oscillator, s: a contact at 20 Hz takes a hundred of them a period.
const STEP: f64 = 5e-4;

/// Damping ratio of the flattest response (Butterworth).
const FLAT: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Torque that shows play to be taken up, over what would wind the coupling by half the gap.
const TAKEN_UP: f64 = 0.01;

/// Samples, at least, from which a spring's first angle and its rate are told, by what it does in its first period.
const LEAST_SEEN: usize = 8;

/// Time in which play is crossed and its side known, s, places in the gap from which that is tried, and the longest time for
/// which it was let go before the first sample, s.
const CROSSED: f64 = 0.1;
const PLACES: usize = 8;
const LET_GO_FOR: f64 = 0.02;
/// Part of the squared torque at first to which play at rest must account for it for no other start to be tried.
const SETTLED: f64 = 0.01;
/// What another start must leave of what play at rest does: a gap that is not quite right is no other start.
const BEYOND_DOUBT: f64 = 0.25;

/// Half-width of the window that a spring's angle goes through before it is differentiated, s; about 18 Hz. Faster than that no
/// spring of a robot winds up, and noise would leak past where a joint rests.
const WIND_UP: f64 = 0.025;

/// Samples over which the rate of a spring is told as friction begins to hold its link.
const SLOPE_OVER: usize = 4;

/// A coupling that is so soft, under a link that falls, that it runs away begins anew from here, rad (m).
const LET_GO: f64 = 100.0;

/// What joins motor and link: torque k δ + d δ̇ beyond half the play on either side, and never a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coupling {
    /// k, N m/rad.
    pub stiffness: f64,
    /// d, N m s/rad.
    pub damping: f64,
    /// Half the play, rad.
    pub half_gap: f64,
}

impl Coupling {
    /// A spring by the resonance of an inertia on it, Hz, and its damping ratio.
    pub fn resonant(inertia: f64, frequency: f64, ratio: f64) -> Coupling {
        let omega = TAU * frequency;
        Coupling { stiffness: inertia * omega * omega, damping: 2.0 * ratio * inertia * omega, half_gap: 0.0 }
    }

    /// That of a candidate at its knob: elasticity or play; nothing for other kinds.
    fn of(drive: &Candidate) -> Option<Coupling> {
        let (frequency, ratio) = CONTACT;
        match drive.kind {
            Kind::JointElasticity => {
                Some(Coupling::resonant(drive.inertia, drive.shape, crate::joint_elasticity::RATIO))
            }
            Kind::Backlash => {
                let contact = Coupling::resonant(drive.inertia, frequency, ratio);
                Some(Coupling { half_gap: 0.5 * drive.shape, ..contact })
            }
            _ => None,
        }
    }

    /// The angle that a torque is seen to hold, after an angle that was expected: play lies anywhere in its gap while hardly
    /// any torque passes.
    fn held_by(&self, torque: f64, expected: f64) -> f64 {
        if torque.abs() > TAKEN_UP * self.stiffness * self.half_gap {
            torque / self.stiffness + self.half_gap * torque.signum()
        } else {
            expected.clamp(-self.half_gap, self.half_gap)
        }
    }

    /// Rate, 1/s, at which an angle is drawn to the one seen, so that the difference of the two dies away with all the
    /// damping that an oscillation about `inertia` can have without a peak in its response.
    fn pull(&self, inertia: f64) -> f64 {
        let omega = (self.stiffness / inertia).sqrt();
        let own = 0.5 * self.damping / (self.stiffness * inertia).sqrt();
        2.0 * (FLAT - own).max(0.0) * omega
    }

    fn torque(&self, delta: f64, rate: f64) -> f64 {
        let pressed = delta.signum() * (delta.abs() - self.half_gap).max(0.0);
        if self.half_gap == 0.0 {
            return self.stiffness * delta + self.damping * rate;
        }
        if pressed == 0.0 {
            return 0.0;
        }
        let torque = self.stiffness * pressed + self.damping * rate;
        if torque * pressed < 0.0 { 0.0 } else { torque }
    }
}

/// Wind-up δ = motor − link with its derivatives, sample by sample, rad, rad/s, rad/s² (m …).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WindUp {
    pub angle: Vec<f64>,
    pub rate: Vec<f64>,
    pub acceleration: Vec<f64>,
}

/// Friction of a joint along a run, which opposes the link's own speed: behind its motor another than the logged one.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Drag {
    /// Logged speed of the joint, sample by sample, rad/s (m/s).
    pub speed: Vec<f64>,
    /// Greatest dry friction, sample by sample, N m (N).
    pub dry: Vec<f64>,
    /// Viscous friction, N m s/rad (N s/m).
    pub viscous: f64,
    /// What friction takes at the logged speed, sample by sample, N m (N).
    pub taken: Vec<f64>,
    /// Samples at which the joint rests and its friction holds what nobody knows.
    pub holds: Vec<bool>,
}

/// An inertia on a coupling along a run: I δ̈ = drive + f(q̇_m − δ̇) − slope δ − τ_l(δ, δ̇).
///
/// Where the motor's motion is logged, I is the link's inertia and `drive` the torque that the link would take if it went with
/// its motor; where the link's is, I is the rotor's and `drive` the effort less what the rotor takes to go with its link.
/// Either way nothing is differentiated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Oscillator<'a> {
    /// Sample by sample, N m (N).
    pub drive: &'a [f64],
    /// I, sample by sample, kg m² (kg).
    pub inertia: &'a [f64],
    /// How fast the drive falls as the angle grows, N m/rad, sample by sample: a link that sags has another weight.
    pub slope: Option<&'a [f64]>,
    /// Friction f of the link, where its motor's motion is logged; `drive` is without it.
    pub drag: Option<&'a Drag>,
    /// What joins the two.
    pub coupling: Coupling,
    /// Time from one sample to the next, s.
    pub dt: f64,
}

impl Oscillator<'_> {
    /// The wind-up from rest under the first sample's drive, or from the state that it is `seen` to begin in.
    ///
    /// Left to itself the oscillation rings with the noise of the drive, and play chatters as no simulation follows.
    /// `seen` is the torque through the joint by the account of the other side of it: the angle is drawn to the one that it
    /// shows (Luenberger, IEEE Trans. Autom. Control 16(6) 1971). A torque that a model lacks shows up in full all the
    /// same, as the pull acts on what the angle does, not on what holds it.
    pub fn wind_up(&self, seen: Option<&[f64]>) -> WindUp {
        let first = self.drive.first().copied().unwrap_or(0.0);
        let at_rest = (first / self.coupling.stiffness + self.coupling.half_gap * first.signum(), 0.0);
        self.from(seen.and_then(|seen| self.start(seen, at_rest)).unwrap_or(at_rest), seen)
    }

    /// Puts the angle of a run left to itself where it is not known, from the angle and rate before to the angle behind.
    fn bridge(&self, angle: &mut [f64], unknown: &[bool]) {
        let mut k = 0;
        while let Some(from) = (k..angle.len()).find(|&k| unknown[k]) {
            let to = (from..angle.len()).find(|&k| !unknown[k]).unwrap_or(angle.len());
            k = to;
            let begin = from.saturating_sub(1);
            let rate = match from.checked_sub(1 + SLOPE_OVER).filter(|first| !unknown[*first..from].contains(&true)) {
                Some(first) => (angle[begin] - angle[first]) / (SLOPE_OVER as f64 * self.dt),
                None => 0.0,
            };
            let start = if from == 0 { self.drive[0] / self.coupling.stiffness } else { angle[begin] };
            let end = (to + 1).min(angle.len());
            let part = Oscillator { drive: &self.drive[begin..end], inertia: &self.inertia[begin..end], ..*self };
            let free = part.from((start, rate), None).angle;
            // What the two ends do not agree on is spread evenly.
            let off = if to < angle.len() { angle[to] - free[to - begin] } else { 0.0 };
            for k in from..to {
                angle[k] = free[k - begin] + off * (k - begin) as f64 / (to - begin) as f64;
            }
        }
    }

    /// First angle and rate of the run that comes nearest to the torque `seen` at first (least squares); nothing for what is
    /// too short to tell.
    fn start(&self, seen: &[f64], at_rest: (f64, f64)) -> Option<(f64, f64)> {
        if self.coupling.half_gap > 0.0 { self.start_of_play(seen, at_rest) } else { self.start_of_spring(seen) }
    }

    /// Of play, where it is not at rest under its load: somewhere in the gap, at a rate that it took up as it was let go.
    fn start_of_play(&self, seen: &[f64], at_rest: (f64, f64)) -> Option<(f64, f64)> {
        let samples = ((CROSSED / self.dt) as usize).clamp(LEAST_SEEN, self.drive.len().max(LEAST_SEEN));
        let (drive, inertia) = (self.drive.get(..samples)?, self.inertia.get(..samples)?);
        let first = Oscillator { drive, inertia, slope: self.slope.and_then(|slope| slope.get(..samples)), ..*self };
        let seen = seen.get(..samples)?;
        let off = |start: (f64, f64)| -> f64 {
            first.torque_from(start).iter().zip(seen).map(|(torque, seen)| (torque - seen).powi(2)).sum()
        };
        let least = off(at_rest);
        if least <= SETTLED * dot(seen, seen) {
            return Some(at_rest);
        }
        let let_go = LET_GO_FOR * drive.first()? / inertia.first()?;
        let angles = (0..=PLACES).map(|i| (2.0 * i as f64 / PLACES as f64 - 1.0) * self.coupling.half_gap);
        let starts = angles.flat_map(|angle| [0.0, 0.5, 1.0].map(|part| (angle, part * let_go)));
        let best = starts.map(|start| (off(start), start)).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(off, start)| if off < BEYOND_DOUBT * least { start } else { at_rest })
    }

    /// Of a spring: of the runs from any state, that in the first period.
    fn start_of_spring(&self, seen: &[f64]) -> Option<(f64, f64)> {
        let period = TAU * (self.inertia.first()? / self.coupling.stiffness).sqrt();
        let samples = ((period / self.dt) as usize).clamp(LEAST_SEEN, self.drive.len().max(LEAST_SEEN));
        let driven = Oscillator {
            drive: self.drive.get(..samples)?,
            inertia: self.inertia.get(..samples)?,
            slope: self.slope.and_then(|slope| slope.get(..samples)),
            ..*self
        };
        let still = vec![0.0; samples];
        let free = Oscillator { drive: &still, ..driven };
        // Without play the torque is linear in the state that it begins in.
        let [forced, wound, turning] =
            [driven.torque_from((0.0, 0.0)), free.torque_from((1.0, 0.0)), free.torque_from((0.0, 1.0 / period))];
        let rest: Vec<f64> = seen.get(..samples)?.iter().zip(&forced).map(|(seen, forced)| seen - forced).collect();
        let across = dot(&wound, &turning);
        let own = Matrix2::new(dot(&wound, &wound), across, across, dot(&turning, &turning));
        let start = own.cholesky()?.solve(&Vector2::new(dot(&wound, &rest), dot(&turning, &rest)));
        start.iter().all(|x| x.is_finite()).then_some((start[0], start[1] / period))
    }

    /// Torque through the coupling of a run left to itself from an angle and its rate, N m (N).
    fn torque_from(&self, start: (f64, f64)) -> Vec<f64> {
        self.from(start, None).torque(&self.coupling)
    }

    /// The wind-up from an angle and its rate, semi-implicit Euler in steps of half a millisecond.
    fn from(&self, (mut angle, mut rate): (f64, f64), seen: Option<&[f64]>) -> WindUp {
        let Oscillator { drive, inertia, slope, drag, coupling, dt } = *self;
        let steps = (dt / STEP).ceil().max(1.0);
        let h = dt / steps;
        let mut out = WindUp {
            angle: Vec::with_capacity(drive.len()),
            rate: Vec::with_capacity(drive.len()),
            acceleration: Vec::with_capacity(drive.len()),
        };
        // Friction of the last step, N m.
        let mut friction = 0.0;
        // Rate at which the angle is drawn to the one seen, rad/s: the link is seen to turn with it.
        let mut drawn = 0.0;
        for (k, (&now, &inertia)) in drive.iter().zip(inertia).enumerate() {
            out.angle.push(angle);
            out.rate.push(rate);
            let slope = slope.map_or(0.0, |slope| slope[k]);
            out.acceleration.push((now + friction - slope * angle - coupling.torque(angle, rate)) / inertia);
            let next = drive.get(k + 1).copied().unwrap_or(now);
            let seen = seen.map(|s| (s[k], s.get(k + 1).copied().unwrap_or(s[k])));
            let pull = -(-h * coupling.pull(inertia)).exp_m1();
            let per_torque = h / inertia;
            for i in 0..steps as usize {
                let part = (i as f64 + 0.5) / steps;
                let drive = now + (next - now) * part;
                rate += per_torque * (drive - slope * angle - coupling.torque(angle, rate));
                if let Some(drag) = drag {
                    let motor = drag.speed[k];
                    let motor = motor + (drag.speed.get(k + 1).copied().unwrap_or(motor) - motor) * part;
                    let free = motor - drawn - rate;
                    let wet = free / (1.0 + per_torque * drag.viscous);
                    // A link without inertia, or one that a fit in between made no body, has none to hold.
                    let hold = if inertia > 0.0 { per_torque * drag.dry[k] } else { 0.0 };
                    let link = wet - wet.clamp(-hold, hold);
                    friction = (free - link) / per_torque;
                    rate = motor - drawn - link;
                }
                angle += h * rate;
                if let Some((now, next)) = seen {
                    let off = coupling.held_by(now + (next - now) * part, angle) - angle;
                    drawn = pull * off / h;
                    angle += pull * off;
                }
            }
            if !(angle.abs() < LET_GO && rate.abs() < LET_GO / h) {
                (angle, rate, drawn) = (0.0, 0.0, 0.0);
            }
        }
        out
    }
}

impl WindUp {
    /// Of a motor along the logged motion of its link: of the torque that `turning` the motor leaves and of the one `taken`
    /// by the link, N m (N). A spring shows its angle by the torque that goes through it; a motor in its play, or behind a
    /// link that friction `holds`, by how it is driven.
    pub fn of_motor(
        turning: &[f64],
        taken: &[f64],
        holds: &[bool],
        rotor: f64,
        coupling: &Coupling,
        dt: f64,
    ) -> WindUp {
        let inertia = vec![rotor; turning.len()];
        let motor = Oscillator { drive: turning, inertia: &inertia, slope: None, drag: None, coupling: *coupling, dt };
        if coupling.half_gap > 0.0 && rotor > 0.0 {
            return motor.wind_up(Some(taken));
        }
        let mut wound: Vec<f64> = taken.iter().map(|torque| torque / coupling.stiffness).collect();
        wound = first_order(&wound, coupling.damping / coupling.stiffness, dt);
        if rotor > 0.0 {
            motor.bridge(&mut wound, holds);
        }
        WindUp::of(wound, dt)
    }

    /// Torque through the coupling, sample by sample, N m (N).
    pub fn torque(&self, coupling: &Coupling) -> Vec<f64> {
        self.angle.iter().zip(&self.rate).map(|(&angle, &rate)| coupling.torque(angle, rate)).collect()
    }

    /// Of an angle that is known.
    pub fn of(angle: Vec<f64>, dt: f64) -> WindUp {
        let smooth = smoothed(&angle, WIND_UP, dt);
        WindUp { rate: first_derivative(&smooth, dt), acceleration: second_derivative(&smooth, dt), angle }
    }
}

/// One joint along a run, its drive still open: what all else of a robot leaves of it.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRun {
    /// Effort delivered, N m (N).
    pub delivered: Vec<f64>,
    /// What a rigid drive without a rotor leaves of it, N m (N).
    pub rest: Vec<f64>,
    /// Acceleration, rad/s² (m/s²).
    pub acceleration: Vec<f64>,
    /// Inertia of the robot about the joint, kg m² (kg).
    pub inertia: Vec<f64>,
    /// How fast the torque that the robot takes about the joint grows with its angle, N m/rad (N/m).
    pub slope: Vec<f64>,
    /// Friction of the joint.
    pub(crate) drag: Drag,
    /// Time from one sample to the next, s.
    pub dt: f64,
}

impl JointRun {
    /// What a drive leaves, N m (N): the elasticity or play of a candidate at its knob with a rotor of some inertia, kg m²
    /// (kg), or a rigid one with that rotor where the candidate is of another kind. Play and spring to the side of the
    /// transmission that the candidate has, as [`crate::Plant::residuals`] has them for this joint alone.
    pub fn left_by(&self, drive: &Candidate, rotor: f64) -> Vec<f64> {
        let turning = |k: usize| self.delivered[k] - rotor * self.acceleration[k];
        let taken = |k: usize| self.delivered[k] - self.rest[k];
        let all = 0..self.rest.len();
        let (motor, link): (Vec<f64>, Vec<f64>) = all.clone().map(|k| (turning(k), taken(k))).unzip();
        let Some(coupling) = Coupling::of(drive) else {
            return motor.iter().zip(&link).map(|(motor, link)| motor - link).collect();
        };
        match drive.side {
            EncoderSide::Motor => {
                let smooth: Vec<f64> = link.iter().zip(&self.drag.taken).map(|(link, drag)| link - drag).collect();
                let own = Oscillator {
                    drive: &smooth,
                    inertia: &self.inertia,
                    slope: Some(&self.slope[..]),
                    drag: Some(&self.drag),
                    coupling,
                    dt: self.dt,
                };
                let passed = own.wind_up(Some(&motor)).torque(&coupling);
                all.map(|k| motor[k] - passed[k]).collect()
            }
            EncoderSide::Link => {
                let ahead = WindUp::of_motor(&motor, &link, &self.drag.holds, rotor, &coupling, self.dt);
                let passed = ahead.torque(&coupling);
                // Where friction holds the link, what its coupling holds is what the motor passes on.
                let taken = |k: usize| if self.drag.holds[k] { passed[k] } else { link[k] };
                all.map(|k| motor[k] - rotor * ahead.acceleration[k] - taken(k)).collect()
            }
        }
    }

    /// What a rigid drive would leave, N m (N), had the joint had the elasticity or play of a candidate, with a rotor of
    /// some inertia, kg m² (kg), where this run had a rigid one: no account of this run, but a simulation of rotor and link
    /// on the coupling under the torque that the link took.
    ///
    /// J θ̈ = u − T, I q̈ = T − h; where a rigid drive had to pass on T*, δ̈ = (T* − T(δ, δ̇)) (1/J + 1/I). With the motion of
    /// the link logged, a rigid drive leaves J δ̈, with that of the motor I δ̈.
    pub fn hidden_by(&self, drive: &Candidate, rotor: f64) -> Vec<f64> {
        let Some(coupling) = Coupling::of(drive) else { return vec![0.0; self.rest.len()] };
        let taken: Vec<f64> = self.delivered.iter().zip(&self.rest).map(|(effort, rest)| effort - rest).collect();
        let both: Vec<f64> = self.inertia.iter().map(|link| link * rotor / (link + rotor)).collect();
        let free = Oscillator { drive: &taken, inertia: &both, slope: None, drag: None, coupling, dt: self.dt };
        let of = |k: usize| match drive.side {
            EncoderSide::Motor => self.inertia[k],
            EncoderSide::Link => rotor,
        };
        // Of the angle, as what drives a spring that hardly moves is a small difference of large torques.
        let acceleration = second_derivative(&free.wind_up(None).angle, self.dt);
        acceleration.iter().enumerate().map(|(k, acceleration)| of(k) * acceleration).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Time between two evaluations of an inertia, s: it changes with the pose, and is linear between.
const EVERY: f64 = 0.02;

/// How fast the torque about one joint grows with its angle along a motion, the other joints as they are, sample by sample,
/// N m/rad (N/m): by differences, as inverse dynamics is as good as linear over so little.
pub(crate) fn slope_about(model: &Model, data: &mut Data, motion: &Motion, joint: usize) -> Vec<f64> {
    let n = model.dof();
    let [mut q, mut v, mut a, mut here, mut there] = std::array::from_fn(|_| vec![0.0; n]);
    (0..motion.len())
        .map(|k| {
            for j in 0..n {
                (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
            }
            model.inverse_dynamics(data, &q, &v, &a, &mut here);
            q[joint] += NUDGE;
            model.inverse_dynamics(data, &q, &v, &a, &mut there);
            (there[joint] - here[joint]) / NUDGE
        })
        .collect()
}

/// Step of that difference, rad (m).
const NUDGE: f64 = 1e-4;

/// Inertia of a robot about one joint along a motion, the other joints held, sample by sample, kg m² (kg).
pub(crate) fn inertia_about(model: &Model, data: &mut Data, motion: &Motion, joint: usize) -> Vec<f64> {
    let n = model.dof();
    let stride = ((EVERY / motion.dt) as usize).max(1);
    let (mut q, mut mass) = (vec![0.0; n], DMatrix::zeros(n, n));
    let mut at = |k: usize| {
        q.iter_mut().zip(motion.q).for_each(|(q, joint)| *q = joint[k]);
        model.mass_matrix(data, &q, &mut mass);
        mass[(joint, joint)]
    };
    let Some(last) = motion.len().checked_sub(1) else { return Vec::new() };
    let mut inertia = Vec::with_capacity(motion.len());
    let mut here = at(0);
    for begin in (0..=last).step_by(stride) {
        let end = (begin + stride).min(last);
        let there = at(end);
        let slope = (there - here) / (end - begin).max(1) as f64;
        inertia.extend((begin..(begin + stride).min(last + 1)).map(|k| here + slope * (k - begin) as f64));
        here = there;
    }
    inertia
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_that_begins_unwound_under_load_is_followed_from_the_first_sample() {
        let coupling = Coupling::resonant(0.2, 4.0, 0.05);
        let (drive, inertia) = (vec![3.0; 1000], vec![0.2; 1000]);
        let link = Oscillator { drive: &drive, inertia: &inertia, slope: None, drag: None, coupling, dt: 2e-3 };
        let truth = link.from((0.0, 0.0), None);
        let seen: Vec<f64> = (0..1000).map(|k| coupling.torque(truth.angle[k], truth.rate[k])).collect();
        let ahead = link.wind_up(Some(&seen));
        let static_angle = 3.0 / coupling.stiffness;
        let off = |ahead: &WindUp, k: usize| (ahead.angle[k] - truth.angle[k]).abs() / static_angle;
        assert!((0..25).all(|k| off(&ahead, k) < 0.05), "{}", off(&ahead, 0));
        let blind = link.wind_up(None);
        assert!(off(&blind, 0) > 0.9, "at rest under its load it would begin wound");
    }

    /// A link of 0.2 kg m² with dry friction on a spring behind a motor that swings, in steps of a fiftieth of a millisecond.
    #[test]
    fn friction_opposes_the_link_and_not_the_motor_that_is_logged() {
        let (inertia, rotor, friction, dt) = (0.2, 0.3, 1.5, 1e-3);
        let coupling = Coupling::resonant(inertia, 4.0, crate::joint_elasticity::RATIO);
        let omega = TAU * 0.7;
        let motor = |t: f64| {
            [0.6 * (omega * t).sin(), 0.6 * omega * (omega * t).cos(), -0.6 * omega.powi(2) * (omega * t).sin()]
        };
        let (mut q, mut v, h) = (0.0, 0.6 * omega, 2e-5);
        let mut passed = Vec::new();
        for k in 0..8000 {
            for i in 0..50 {
                let [theta, rate, _] = motor((f64::from(k) + f64::from(i) / 50.0) * dt);
                let torque = coupling.torque(theta - q, rate - v);
                if i == 0 {
                    passed.push(torque);
                }
                let free = v + h * torque / inertia;
                v = free - free.clamp(-h * friction / inertia, h * friction / inertia);
                q += h * v;
            }
        }
        let at = |k: usize| motor(k as f64 * dt);
        let samples = 0..passed.len();
        let delivered: Vec<f64> = samples.clone().map(|k| rotor * at(k)[2] + passed[k]).collect();
        let taken: Vec<f64> = samples.clone().map(|k| friction * at(k)[1].signum()).collect();
        let run = |friction: f64| JointRun {
            rest: samples.clone().map(|k| delivered[k] - inertia * at(k)[2] - taken[k]).collect(),
            delivered: delivered.clone(),
            acceleration: samples.clone().map(|k| at(k)[2]).collect(),
            inertia: vec![inertia; passed.len()],
            slope: vec![0.0; passed.len()],
            drag: Drag {
                speed: samples.clone().map(|k| at(k)[1]).collect(),
                dry: vec![friction; passed.len()],
                viscous: 0.0,
                taken: taken.iter().map(|taken| if friction > 0.0 { *taken } else { 0.0 }).collect(),
                holds: vec![false; passed.len()],
            },
            dt,
        };
        let drive = Candidate {
            shape: 4.0,
            inertia,
            side: EncoderSide::Motor,
            ..Candidate::new(Kind::JointElasticity, vec![0])
        };
        let left = |run: &JointRun| {
            let left = &run.left_by(&drive, rotor)[1000..];
            (dot(left, left) / left.len() as f64).sqrt()
        };
        let (own, of_motor) = (left(&run(friction)), left(&run(0.0)));
        assert!(own < 0.1 * friction && own < 0.6 * of_motor, "{own} and {of_motor}");
    }

    #[test]
    fn a_spring_behind_a_link_that_friction_holds_swings_as_it_is_driven() {
        let coupling = Coupling::resonant(0.2, 4.0, 0.05);
        let drive: Vec<f64> = (0..1000).map(|k| 2.0 + (0.01 * f64::from(k)).sin()).collect();
        let inertia = vec![0.3; 1000];
        let motor = Oscillator { drive: &drive, inertia: &inertia, slope: None, drag: None, coupling, dt: 1e-3 };
        let truth = motor.from((0.01, 0.3), None).angle;
        let most = truth.iter().fold(0.0f64, |most, angle| most.max(angle.abs()));
        let unknown: Vec<bool> = (0..1000).map(|k| (300..700).contains(&k)).collect();
        let mut angle: Vec<f64> =
            truth.iter().zip(&unknown).map(|(x, unknown)| if *unknown { 9.0 } else { *x }).collect();
        motor.bridge(&mut angle, &unknown);
        let off = truth.iter().zip(&angle).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 0.02 * most, "{off} of {most}");
    }

    #[test]
    fn a_play_that_begins_let_go_in_its_gap_is_followed_through_its_first_blow() {
        let coupling = Coupling { half_gap: 0.01, ..Coupling::resonant(0.2, 20.0, 0.1) };
        let (drive, inertia) = (vec![3.0; 200], vec![0.2; 200]);
        let motor = Oscillator { drive: &drive, inertia: &inertia, slope: None, drag: None, coupling, dt: 2e-3 };
        let truth = motor.torque_from((-0.0067, 0.12));
        let off = |start: (f64, f64)| -> f64 {
            motor.torque_from(start).iter().zip(&truth).map(|(torque, truth)| (torque - truth).powi(2)).sum()
        };
        let at_rest = (0.01 + 3.0 / coupling.stiffness, 0.0);
        let start = motor.start(&truth, at_rest).unwrap();
        assert!(off(start) < 0.2 * off(at_rest), "{start:?}: {} of {}", off(start), off(at_rest));
        // One that rests under its load stays as it is.
        let resting = motor.torque_from(at_rest);
        assert_eq!(motor.start(&resting, at_rest), Some(at_rest));
    }

    /// A rigid drive with a rotor of 0.3 kg m² behind a link of 0.2 kg m² that takes `torque` of time, 10 s at 1 kHz.
    fn rigid_run(torque: impl Fn(f64) -> f64) -> JointRun {
        let samples = 10_000;
        let taken: Vec<f64> = (0..samples).map(|k| torque(k as f64 * 1e-3)).collect();
        JointRun {
            delivered: taken,
            rest: vec![0.0; samples],
            acceleration: vec![0.0; samples],
            inertia: vec![0.2; samples],
            slope: vec![0.0; samples],
            drag: Drag {
                speed: vec![0.0; samples],
                dry: vec![0.0; samples],
                viscous: 0.0,
                taken: vec![0.0; samples],
                holds: vec![false; samples],
            },
            dt: 1e-3,
        }
    }

    #[test]
    fn a_slow_torque_winds_a_spring_by_torque_over_stiffness() {
        let omega = TAU * 0.5;
        let run = rigid_run(|t| 2.0 * (omega * t).cos());
        let on = |side| Candidate { shape: 8.0, inertia: 0.2, side, ..Candidate::new(Kind::JointElasticity, vec![0]) };
        let stiffness = 0.2 * (TAU * 8.0).powi(2);
        for (side, turns) in [(EncoderSide::Link, 0.3), (EncoderSide::Motor, 0.2)] {
            let hidden = run.hidden_by(&on(side), 0.3);
            let greatest = turns * omega * omega * 2.0 / stiffness;
            // What it began with has died away.
            for k in 4000..10_000 {
                let expected = -greatest * (omega * k as f64 * 1e-3).cos();
                assert!((hidden[k] - expected).abs() < 0.03 * greatest, "{side:?} {k}: {} {expected}", hidden[k]);
            }
        }
        assert!(run.hidden_by(&Candidate::new(Kind::Armature, vec![0]), 0.3).iter().all(|x| *x == 0.0));
    }

    #[test]
    fn play_does_nothing_but_where_its_load_changes_sign() {
        let play = |gap| Candidate { shape: gap, inertia: 0.2, ..Candidate::new(Kind::Backlash, vec![0]) };
        // What the gap does beyond the spring of its contact, once that has come to rest.
        let most = |run: &JointRun| -> f64 {
            let [open, closed] = [0.01, 0.0].map(|gap| run.hidden_by(&play(gap), 0.3));
            (4000..10_000).map(|k| (open[k] - closed[k]).abs()).fold(0.0, f64::max)
        };
        assert!(most(&rigid_run(|t| 2.0 + (TAU * 0.5 * t).cos())) < 1e-9);
        assert!(most(&rigid_run(|t| 2.0 * (TAU * 0.5 * t).cos())) > 0.1);
    }

    #[test]
    fn a_link_that_falls_faster_than_its_spring_holds_stays_finite() {
        let coupling = Coupling { stiffness: 10.0, damping: 0.0, half_gap: 0.0 };
        let (drive, inertia, slope) = (vec![1.0; 5000], vec![0.1; 5000], vec![-1000.0; 5000]);
        let link = Oscillator { drive: &drive, inertia: &inertia, slope: Some(&slope), drag: None, coupling, dt: 2e-3 };
        let ahead = link.wind_up(None);
        assert!(ahead.angle.iter().chain(&ahead.acceleration).all(|x| x.abs() < 1e7));
        assert!(ahead.angle.iter().any(|x| x.abs() > 1.0));
    }
}
