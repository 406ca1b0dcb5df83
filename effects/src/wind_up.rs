//! How far a motor turns ahead of its link along a measured run.

use crate::filter::{first_derivative, first_order, second_derivative, smoothed};
use crate::{Candidate, EncoderSide, Kind, Motion};
use gapscope_dynamics::{Data, Model};
use nalgebra::DMatrix;
use oscillator::{Begun, follow};
use std::borrow::Cow;
use std::f64::consts::TAU;

mod oscillator;

pub(crate) use oscillator::Oscillator;

/// Resonance of the link on its locked motor once the play is taken up, Hz, where no elasticity says otherwise;
/// and the damping ratio of that contact.
pub(crate) const CONTACT: (f64, f64) = (20.0, 0.05);
/// Damping ratio of the link on its locked motor behind a spring that is taken for granted where a log is explained: a log
/// hardly tells it.
pub(crate) const SPRING_DAMPING: f64 = 0.05;
/// Damping ratio of the flattest response (Butterworth).
const FLAT: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Torque that shows play to be taken up, over what would wind the coupling by half the gap.
const TAKEN_UP: f64 = 0.01;

/// Half-width of the window that a spring's angle goes through before it is differentiated, s; about 18 Hz. Faster than that no
/// spring of a robot winds up, and noise would leak past where a joint rests.
const WIND_UP: f64 = 0.025;

/// Samples over which the rate of a spring is told as friction begins to hold its link.
const SLOPE_OVER: usize = 4;

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
            Kind::JointElasticity => Some(Coupling::resonant(drive.inertia, drive.shape, SPRING_DAMPING)),
            Kind::Backlash => {
                let contact = Coupling::resonant(drive.inertia, frequency, ratio);
                Some(Coupling { half_gap: 0.5 * drive.shape, ..contact })
            }
            _ => None,
        }
    }

    /// The torque beyond which an angle is seen by it: play lies anywhere in its gap while hardly any torque passes.
    fn shown_from(&self) -> f64 {
        TAKEN_UP * self.stiffness * self.half_gap
    }

    /// Rate, 1/s, at which an angle is drawn to the one seen, so that the difference of the two dies away with all the
    /// damping that an oscillation about `inertia` can have without a peak in its response.
    fn pull(&self, inertia: f64) -> f64 {
        let omega = (self.stiffness / inertia).sqrt();
        let own = 0.5 * self.damping / (self.stiffness * inertia).sqrt();
        2.0 * (FLAT - own).max(0.0) * omega
    }

    fn torque(&self, delta: f64, rate: f64) -> f64 {
        passed(self.stiffness, self.damping, self.half_gap, delta, rate)
    }
}

/// Torque through a coupling at an angle and its rate. No path through it is longer than another, so that several go side by side.
#[inline(always)]
fn passed(stiffness: f64, damping: f64, half_gap: f64, delta: f64, rate: f64) -> f64 {
    let pressed = (delta.abs() - half_gap).max(0.0).copysign(delta);
    let torque = stiffness * pressed + damping * rate;
    // Play presses and never pulls.
    if half_gap == 0.0 || torque * pressed > 0.0 { torque } else { 0.0 }
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
    /// transmission that the candidate has, as a plant has them for this joint alone.
    pub fn left_by(&self, drive: &Candidate, rotor: f64) -> Vec<f64> {
        JointRun::left_by_each(&[(self, drive, rotor)]).pop().unwrap_or_default()
    }

    /// The same of several runs, drives and rotors, which is faster than one after the other.
    pub fn left_by_each(all: &[(&JointRun, &Candidate, f64)]) -> Vec<Vec<f64>> {
        let sides: Vec<Sides<'_>> = all.iter().map(|&(run, drive, rotor)| Sides::of(run, drive, rotor)).collect();
        let begun: Vec<Option<Begun<'_>>> = sides.iter().map(Sides::begun).collect();
        let mut followed = follow(&begun.iter().flatten().copied().collect::<Vec<_>>()).into_iter();
        let ends = begun.iter().map(|begun| begun.and_then(|_| followed.next()));
        sides.iter().zip(ends).map(|(sides, ahead)| sides.left(ahead)).collect()
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

/// A run with an account of its drive, seen from both sides of it.
struct Sides<'a> {
    run: &'a JointRun,
    side: EncoderSide,
    rotor: f64,
    /// What joins the sides; nothing where the drive is rigid.
    coupling: Option<Coupling>,
    /// Torque that the motor passes on where it goes with its link, N m (N).
    motor: Vec<f64>,
    /// Torque that the link takes, N m (N).
    link: Vec<f64>,
    /// What drives the side that is not logged, N m (N), and its inertia, kg m² (kg).
    driven: (Cow<'a, [f64]>, Cow<'a, [f64]>),
}

impl<'a> Sides<'a> {
    fn of(run: &'a JointRun, drive: &Candidate, rotor: f64) -> Sides<'a> {
        let samples = 0..run.rest.len();
        let motor: Vec<f64> = samples.clone().map(|k| run.delivered[k] - rotor * run.acceleration[k]).collect();
        let link: Vec<f64> = samples.map(|k| run.delivered[k] - run.rest[k]).collect();
        let coupling = Coupling::of(drive);
        let driven = match (&coupling, drive.side) {
            (None, _) => (Cow::Owned(Vec::new()), Cow::Owned(Vec::new())),
            (Some(_), EncoderSide::Motor) => {
                let smooth: Vec<f64> = link.iter().zip(&run.drag.taken).map(|(link, drag)| link - drag).collect();
                (Cow::Owned(smooth), Cow::Borrowed(&run.inertia[..]))
            }
            (Some(_), EncoderSide::Link) => (Cow::Owned(motor.clone()), Cow::Owned(vec![rotor; motor.len()])),
        };
        Sides { run, side: drive.side, rotor, coupling, motor, link, driven }
    }

    /// The side that is not logged, where it is to be followed: a spring behind a link shows its angle by itself.
    fn begun(&self) -> Option<Begun<'_>> {
        let coupling = self.coupling?;
        let (slope, drag, seen) = match self.side {
            EncoderSide::Motor => (Some(&self.run.slope[..]), Some(&self.run.drag), &self.motor),
            EncoderSide::Link if coupling.half_gap > 0.0 && self.rotor > 0.0 => (None, None, &self.link),
            EncoderSide::Link => return None,
        };
        let (drive, inertia) = (&self.driven.0[..], &self.driven.1[..]);
        let own = Oscillator { drive, inertia, slope, drag, coupling, dt: self.run.dt };
        Some((own, own.begins(Some(seen)), Some(seen)))
    }

    /// What is left of the effort, the other side having been followed where that was needed.
    fn left(&self, ahead: Option<WindUp>) -> Vec<f64> {
        let samples = 0..self.motor.len();
        let Some(coupling) = self.coupling else {
            return samples.map(|k| self.motor[k] - self.link[k]).collect();
        };
        let holds = &self.run.drag.holds;
        let ahead = ahead
            .unwrap_or_else(|| WindUp::of_motor(&self.motor, &self.link, holds, self.rotor, &coupling, self.run.dt));
        let passed = ahead.torque(&coupling);
        match self.side {
            EncoderSide::Motor => samples.map(|k| self.motor[k] - passed[k]).collect(),
            EncoderSide::Link => {
                // Where friction holds the link, what its coupling holds is what the motor passes on.
                let taken = |k: usize| if holds[k] { passed[k] } else { self.link[k] };
                samples.map(|k| self.motor[k] - self.rotor * ahead.acceleration[k] - taken(k)).collect()
            }
        }
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

    /// A light link dragged at one speed: what its coupling passes on is both frictions, however much one step of time slows it.
    #[test]
    fn a_link_that_is_dragged_takes_both_of_its_frictions() {
        let samples = 2000;
        let drag = Drag {
            speed: vec![0.5; samples],
            dry: vec![1.9; samples],
            viscous: 1.6,
            taken: vec![0.0; samples],
            holds: vec![false; samples],
        };
        let (idle, inertia) = (vec![0.0; samples], vec![0.006; samples]);
        for half_gap in [0.0, 0.01] {
            let coupling = Coupling { half_gap, ..Coupling::resonant(0.006, 20.0, 0.05) };
            let link =
                Oscillator { drive: &idle, inertia: &inertia, slope: None, drag: Some(&drag), coupling, dt: 5e-3 };
            let passed = link.wind_up(None).torque(&coupling)[samples - 1];
            assert!((passed.abs() - (1.9 + 1.6 * 0.5)).abs() < 1e-3, "{passed}");
        }
    }

    #[test]
    fn oscillators_side_by_side_do_what_each_does_alone() {
        let samples = 400;
        let drag = Drag {
            speed: (0..samples).map(|k| (0.02 * k as f64).sin()).collect(),
            dry: vec![0.4; samples],
            viscous: 0.3,
            taken: vec![0.0; samples],
            holds: vec![false; samples],
        };
        let drives: Vec<Vec<f64>> =
            (0..11).map(|i| (0..samples - 7 * i).map(|k| (0.05 * (k + i) as f64).cos()).collect()).collect();
        let inertia = vec![0.2; samples];
        let all: Vec<Begun<'_>> = (drives.iter().enumerate())
            .map(|(i, drive)| {
                let half_gap = if i % 3 == 0 { 0.01 } else { 0.0 };
                let coupling = Coupling { half_gap, ..Coupling::resonant(0.2, 4.0 + i as f64, 0.05) };
                let own = Oscillator {
                    drive,
                    inertia: &inertia,
                    slope: None,
                    drag: (i % 2 == 0).then_some(&drag),
                    coupling,
                    dt: 2e-3,
                };
                (own, (0.001 * i as f64, 0.1), (i % 4 != 1).then_some(&drive[..]))
            })
            .collect();
        for (together, (own, start, seen)) in follow(&all).into_iter().zip(&all) {
            let alone = own.from(*start, *seen);
            assert_eq!(together.angle.len(), own.drive.len());
            let off = together.angle.iter().zip(&alone.angle).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{off}");
        }
    }

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
        let coupling = Coupling::resonant(inertia, 4.0, SPRING_DAMPING);
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
        let torque_from = |start: (f64, f64)| motor.from(start, None).torque(&coupling);
        let truth = torque_from((-0.0067, 0.12));
        let off = |start: (f64, f64)| -> f64 {
            torque_from(start).iter().zip(&truth).map(|(torque, truth)| (torque - truth).powi(2)).sum()
        };
        let at_rest = (0.01 + 3.0 / coupling.stiffness, 0.0);
        let start = motor.start(&truth, at_rest).unwrap();
        assert!(off(start) < 0.2 * off(at_rest), "{start:?}: {} of {}", off(start), off(at_rest));
        // One that rests under its load stays as it is.
        let resting = torque_from(at_rest);
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
