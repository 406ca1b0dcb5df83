//! An inertia on a coupling along a run; several are followed side by side.

use super::{Coupling, Drag, SLOPE_OVER, WindUp, dot, passed};
use multiversion::multiversion;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::TAU;

/// Longest step of the oscillator, s: a contact at 20 Hz takes a hundred of them a period.
const STEP: f64 = 5e-4;

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

/// A coupling that is so soft, under a link that falls, that it runs away begins anew from here, rad (m).
const LET_GO: f64 = 100.0;

/// Oscillators that are followed side by side: a step waits for the one before, so that the processor has time for so many.
const LANES: usize = 32;

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
        self.from(self.begins(seen), seen)
    }

    /// The state that a run begins in: at rest under the first sample's drive, or as it is `seen`.
    pub fn begins(&self, seen: Option<&[f64]>) -> (f64, f64) {
        let first = self.drive.first().copied().unwrap_or(0.0);
        let at_rest = (first / self.coupling.stiffness + self.coupling.half_gap * first.signum(), 0.0);
        seen.and_then(|seen| self.start(seen, at_rest)).unwrap_or(at_rest)
    }

    /// Puts the angle of a run left to itself where it is not known, from the angle and rate before to the angle behind.
    pub fn bridge(&self, angle: &mut [f64], unknown: &[bool]) {
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
    pub(super) fn start(&self, seen: &[f64], at_rest: (f64, f64)) -> Option<(f64, f64)> {
        if self.coupling.half_gap > 0.0 { self.start_of_play(seen, at_rest) } else { self.start_of_spring(seen) }
    }

    /// Of play, where it is not at rest under its load: somewhere in the gap, at a rate that it took up as it was let go.
    fn start_of_play(&self, seen: &[f64], at_rest: (f64, f64)) -> Option<(f64, f64)> {
        let samples = ((CROSSED / self.dt) as usize).clamp(LEAST_SEEN, self.drive.len().max(LEAST_SEEN));
        let (drive, inertia) = (self.drive.get(..samples)?, self.inertia.get(..samples)?);
        let first = Oscillator { drive, inertia, slope: self.slope.and_then(|slope| slope.get(..samples)), ..*self };
        let seen = seen.get(..samples)?;
        let off = |ahead: &WindUp| -> f64 {
            ahead.torque(&self.coupling).iter().zip(seen).map(|(torque, seen)| (torque - seen).powi(2)).sum()
        };
        let least = off(&first.from(at_rest, None));
        if least <= SETTLED * dot(seen, seen) {
            return Some(at_rest);
        }
        let let_go = LET_GO_FOR * drive.first()? / inertia.first()?;
        let angles = (0..=PLACES).map(|i| (2.0 * i as f64 / PLACES as f64 - 1.0) * self.coupling.half_gap);
        let starts: Vec<Begun<'_>> =
            angles.flat_map(|angle| [0.0, 0.5, 1.0].map(|part| (first, (angle, part * let_go), None))).collect();
        let ends = follow(&starts);
        let best = ends.iter().zip(&starts).map(|(end, begun)| (off(end), begun.1)).min_by(|a, b| a.0.total_cmp(&b.0));
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
            together(&[(driven, (0.0, 0.0), None), (free, (1.0, 0.0), None), (free, (0.0, 1.0 / period), None)])
                .map(|ahead| ahead.torque(&self.coupling));
        let rest: Vec<f64> = seen.get(..samples)?.iter().zip(&forced).map(|(seen, forced)| seen - forced).collect();
        let across = dot(&wound, &turning);
        let own = Matrix2::new(dot(&wound, &wound), across, across, dot(&turning, &turning));
        let start = own.cholesky()?.solve(&Vector2::new(dot(&wound, &rest), dot(&turning, &rest)));
        start.iter().all(|x| x.is_finite()).then_some((start[0], start[1] / period))
    }

    /// The wind-up from an angle and its rate.
    pub fn from(&self, start: (f64, f64), seen: Option<&[f64]>) -> WindUp {
        let [one] = together(&[(*self, start, seen)]);
        one
    }
}

/// An oscillator with the angle and the rate that it begins from, and the torque through its coupling that is seen.
pub(super) type Begun<'a> = (Oscillator<'a>, (f64, f64), Option<&'a [f64]>);

/// The wind-ups of oscillators that do not know of each other. Step waits for step in each, so that several side by side take
/// hardly longer than one.
pub(super) fn follow(all: &[Begun<'_>]) -> Vec<WindUp> {
    let some = |some: &[Begun<'_>]| match some.len() {
        1 => padded::<1>(some),
        2 => padded::<2>(some),
        3 | 4 => padded::<4>(some),
        5..=8 => padded::<8>(some),
        9..=16 => padded::<16>(some),
        _ => padded::<LANES>(some),
    };
    all.chunks(LANES).flat_map(some).collect()
}

/// As many as there are, beside the first once more in each free place.
fn padded<const L: usize>(all: &[Begun<'_>]) -> Vec<WindUp> {
    let lanes: [Begun<'_>; L] = std::array::from_fn(|l| *all.get(l).unwrap_or(&all[0]));
    let mut found: Vec<WindUp> = together(&lanes).into();
    found.truncate(all.len());
    found
}

/// Semi-implicit Euler in steps of half a millisecond.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw+avx2+fma", "x86_64+avx2+fma"))]
fn together<const L: usize>(all: &[Begun<'_>; L]) -> [WindUp; L] {
    let samples = all.iter().map(|(own, ..)| own.drive.len()).max().unwrap_or(0);
    let longest = all.iter().map(|(own, ..)| own.dt).fold(0.0, f64::max);
    let steps = (longest / STEP).ceil().max(1.0);
    let rubs = all.iter().any(|(own, ..)| own.drag.is_some());
    let sees = all.iter().any(|(.., seen)| seen.is_some());
    let mut out: [WindUp; L] = std::array::from_fn(|l| {
        let room = || Vec::with_capacity(all[l].0.drive.len());
        WindUp { angle: room(), rate: room(), acceleration: room() }
    });
    let h: [f64; L] = std::array::from_fn(|l| all[l].0.dt / steps);
    let stiffness: [f64; L] = std::array::from_fn(|l| all[l].0.coupling.stiffness);
    let (compliance, steps_per_second) = (stiffness.map(f64::recip), h.map(f64::recip));
    let damping: [f64; L] = std::array::from_fn(|l| all[l].0.coupling.damping);
    let half_gap: [f64; L] = std::array::from_fn(|l| all[l].0.coupling.half_gap);
    let shown_from: [f64; L] = std::array::from_fn(|l| all[l].0.coupling.shown_from());
    let viscous: [f64; L] = std::array::from_fn(|l| all[l].0.drag.map_or(0.0, |drag| drag.viscous));
    let (mut angle, mut rate) = (all.map(|(_, start, _)| start.0), all.map(|(_, start, _)| start.1));
    // Friction of the last step, N m, and the rate at which the angle is drawn to the one seen, rad/s: the link is seen to turn
    // with it.
    let (mut friction, mut drawn) = ([0.0; L], [0.0; L]);
    for k in 0..samples {
        let mut at = Sample::<L>::default();
        for l in 0..L {
            let (own, _, seen) = &all[l];
            let Some(&now) = own.drive.get(k) else { continue };
            let after = |of: &[f64]| of.get(k + 1).copied().unwrap_or(of[k]) - of[k];
            let inertia = own.inertia[k];
            at.slope[l] = own.slope.map_or(0.0, |slope| slope[k]);
            (at.drive[l], at.drive_rises[l]) = (now, after(own.drive));
            at.per_torque[l] = h[l] / inertia;
            if let Some(drag) = own.drag {
                (at.motor[l], at.motor_rises[l]) = (drag.speed[k], after(&drag.speed));
                // A link without inertia, or one that a fit in between made no body, has none to hold.
                at.hold[l] = if inertia > 0.0 { at.per_torque[l] * drag.dry[k] } else { 0.0 };
                at.wet[l] = 1.0 / (1.0 + at.per_torque[l] * viscous[l]);
            }
            if let Some(seen) = seen {
                (at.seen[l], at.seen_rises[l]) = (seen[k], after(seen));
                at.pull[l] = -(-h[l] * own.coupling.pull(inertia)).exp_m1();
            }
            let held = own.coupling.torque(angle[l], rate[l]);
            out[l].angle.push(angle[l]);
            out[l].rate.push(rate[l]);
            out[l].acceleration.push((now + friction[l] - at.slope[l] * angle[l] - held) / inertia);
        }
        let mut slip = [0.0; L];
        for i in 0..steps as usize {
            let part = (i as f64 + 0.5) / steps;
            for l in 0..L {
                let drive = at.drive[l] + at.drive_rises[l] * part;
                let passed = passed(stiffness[l], damping[l], half_gap[l], angle[l], rate[l]);
                rate[l] += at.per_torque[l] * (drive - at.slope[l] * angle[l] - passed);
            }
            if rubs {
                for l in 0..L {
                    let motor = at.motor[l] + at.motor_rises[l] * part - drawn[l];
                    let free = motor - rate[l];
                    // Both frictions at the speed that comes of them: what the dry one leaves, the wet one slows.
                    let link = (free - free.max(-at.hold[l]).min(at.hold[l])) * at.wet[l];
                    slip[l] = free - link;
                    rate[l] = motor - link;
                }
            }
            for l in 0..L {
                angle[l] += h[l] * rate[l];
            }
            if sees {
                for l in 0..L {
                    let torque = at.seen[l] + at.seen_rises[l] * part;
                    let wound = torque * compliance[l] + half_gap[l].copysign(torque);
                    let inside = angle[l].max(-half_gap[l]).min(half_gap[l]);
                    let held = if torque.abs() > shown_from[l] { wound } else { inside };
                    let off = at.pull[l] * (held - angle[l]);
                    drawn[l] = off * steps_per_second[l];
                    angle[l] += off;
                }
            }
        }
        for l in 0..L {
            friction[l] = if all[l].0.drag.is_some() { slip[l] / at.per_torque[l] } else { 0.0 };
            if !(angle[l].abs() < LET_GO && rate[l].abs() < LET_GO / h[l]) {
                (angle[l], rate[l], drawn[l]) = (0.0, 0.0, 0.0);
            }
        }
    }
    out
}

/// What holds from one sample to the next, for each of some oscillators: a number, and what it grows by.
struct Sample<const L: usize> {
    drive: [f64; L],
    drive_rises: [f64; L],
    slope: [f64; L],
    per_torque: [f64; L],
    motor: [f64; L],
    motor_rises: [f64; L],
    hold: [f64; L],
    wet: [f64; L],
    seen: [f64; L],
    seen_rises: [f64; L],
    pull: [f64; L],
}

impl<const L: usize> Default for Sample<L> {
    fn default() -> Self {
        let no = [0.0; L];
        Sample {
            drive: no,
            drive_rises: no,
            slope: no,
            per_torque: no,
            motor: no,
            motor_rises: no,
            hold: no,
            wet: [1.0; L],
            seen: no,
            seen_rises: no,
            pull: no,
        }
    }
}
