//! Whether a joint's motor turns on its own: springs and play in the drives, each tried at its exact law.
//!
//! Their torque is not linear in stiffness or gap, not even nearly: a resonance moves, an impact comes earlier. So each joint
//! is looked at alone, all else of the robot along its measured motion, and each account of its drive is turned to where it
//! leaves least. An account that swings with the noise of the position also explains some of it; what noise alone would
//! leave is found by a second run with more of it, and taken off (a simulation of the error in the variables, Cook and
//! Stefanski, J. Am. Stat. Assoc. 89(428) 1994).

use crate::band::Row;
use crate::corrected::{aligned, plant_pushed};
use crate::diagnose::Logs;
use crate::estimate::Fit;
use crate::floor::noise_floor;
use crate::gap;
use crate::kernel::apply;
use crate::problem::Problem;
use crate::signals::{Signals, derivative_kernel};
use gapscope_effects::{Candidate, EffectError, EncoderSide, JointRun, Kind};
use nalgebra::{Matrix2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// Resonances of the link on its locked motor that are tried first, Hz.
const RESONANCE: [f64; 6] = [2.0, 3.0, 4.5, 6.5, 9.0, 13.0];
/// Gaps that are tried first, rad or m: the basin of the true one is narrow.
const GAP: [f64; 10] = [0.003, 0.0045, 0.0065, 0.0095, 0.013, 0.018, 0.025, 0.035, 0.05, 0.07];
/// Rotors that are tried first with each, as parts of the inertia that they turn.
const ROTOR: [f64; 7] = [0.1, 0.2, 0.33, 0.5, 0.7, 1.0, 1.4];
/// The best so many of these pairs go on.
const FIRST: usize = 3;
/// Steps of the search for the best knob and rotor, relative: the first, and where it ends.
const STEPS: (f64, f64) = (0.2, 0.004);
/// Moves of that search, at most.
const MOVES: usize = 40;
/// Gauss–Newton steps from each first try, and the farthest that one goes, relative.
const DESCENTS: usize = 3;
const FARTHEST: f64 = 0.5;
/// A drive is not rigid where over the blocks of time that tell, the logarithm of what an account of it leaves is less by so
/// many standard errors (a burst of chatter is one block, and counts no more than its logarithm), ...
const BEYOND_DOUBT: f64 = 1.0;
/// ... and this part of the mean square, or less.
const PART: f64 = 0.85;
/// Part of the noise, and of the effort, below which what is left of a block of time is as good as nothing: play may show in
/// few of them.
const OF_NOISE: f64 = 0.25;
pub(crate) const NOTHING: f64 = 1e-3;
/// Resonances, Hz, between which a spring is one that somebody would build and that these logs could show.
const SOFTEST: f64 = 1.5;
const STIFFEST: f64 = 20.0;
/// A rotor lighter than this part of what it turns would not show.
const LIGHTEST: f64 = 0.05;
/// So many blocks of time must show something at all: a joint that its load holds on one side may cross its play once or twice.
const LEAST_TELLING: usize = 2;
const SEED: u64 = 5;

/// An account of one joint's drive that leaves less than a rigid one.
#[derive(Debug, Clone)]
pub(crate) struct Account {
    /// Spring or play at the knob found.
    pub drive: Candidate,
    /// By how many standard errors it is better.
    pub beyond: f64,
}

/// One joint in all logs, and the same with more noise.
struct Study<'a> {
    logs: &'a Logs<'a>,
    joint: usize,
    runs: Vec<&'a JointRun>,
    noisier: Vec<JointRun>,
    /// Mean square that counts as nothing, (N m)².
    nothing: f64,
    /// Mean square of the noise in each block as a rigid drive has it, (N m)².
    noise: Vec<f64>,
    /// Inertia of the robot about the joint, kg m² (kg).
    inertia: f64,
}

impl Logs<'_> {
    /// The best account of the drive of each of some joints that is better than a rigid one, beside other effects, none of
    /// them such a drive; best first.
    pub(crate) fn accounts(
        &self,
        joints: &[usize],
        problem: &Problem,
        others: &Fit,
    ) -> Result<Vec<Account>, EffectError> {
        let effects = others.effects(problem, self.model);
        let outside = problem.outside(&others.set);
        let runs: Vec<Vec<JointRun>> = self
            .signals
            .par_iter()
            .map(|s| {
                let mut plant = plant_pushed(self.model, &effects, EncoderSide::Link, s.dt, &s.pushed)?;
                let mut runs =
                    aligned(self.model, s, &self.still, others.alignment(), |motion| plant.joint_runs(motion));
                // What a law outside the catalogue takes is as good as taken by the link.
                for &c in &outside {
                    let columns = problem.entries[c].candidate.columns(&s.motion(self.model, &self.still));
                    for (column, theta) in columns.iter().zip(others.own(problem, c).1) {
                        for (j, torque) in &column.rows {
                            runs[*j].rest.iter_mut().zip(torque).for_each(|(rest, torque)| *rest -= theta * torque);
                        }
                    }
                }
                Ok(runs)
            })
            .collect::<Result<_, EffectError>>()?;
        let mut found: Vec<Account> = joints.par_iter().filter_map(|&j| Study::new(self, &runs, j).best()).collect();
        found.sort_by(|a, b| b.beyond.total_cmp(&a.beyond));
        Ok(found)
    }
}

impl<'a> Study<'a> {
    fn new(logs: &'a Logs<'a>, runs: &'a [Vec<JointRun>], joint: usize) -> Study<'a> {
        let runs: Vec<&JointRun> = runs.iter().map(|joints| &joints[joint]).collect();
        let inertia = mean(&runs.iter().map(|run| mean(&run.inertia)).collect::<Vec<_>>());
        let mut study = Study { logs, joint, runs, noisier: Vec::new(), nothing: 0.0, noise: Vec::new(), inertia };
        let rigid = Candidate::new(Kind::Armature, vec![joint]);
        let rotor = study.rotor(&rigid);
        let rest: Vec<Vec<f64>> = study.runs.iter().map(|run| run.left_by(&rigid, rotor)).collect();
        // What is white of the effort, and not taken up by the motion, is noise of its measurement.
        let alone: Vec<Vec<Vec<f64>>> = rest.iter().map(|rest| vec![rest.clone()]).collect();
        let floor = noise_floor(&logs.signals, &logs.band, &alone, 1, 0.0)[0];
        let white = |s: &Signals| {
            let left = floor / (2.0 * logs.band.cutoff * s.raw.dt).sqrt();
            left.min(s.effort_noise[joint])
        };
        study.noisier = logs
            .signals
            .iter()
            .zip(&study.runs)
            .enumerate()
            .map(|(e, (s, run))| {
                let seed = SEED.wrapping_add((e * logs.model.dof() + joint) as u64);
                noisier(s, run, s.position_noise[joint], white(s), seed)
            })
            .collect();
        study.noise = study.noise(&rigid, rotor, &study.rows(&rigid, rotor));
        let effort = mean(&logs.signals.iter().map(|s| mean_square(&s.tau[joint])).collect::<Vec<_>>());
        study.nothing = OF_NOISE * mean(&study.noise) + NOTHING * NOTHING * effort;
        study
    }

    fn best(&self) -> Option<Account> {
        let rigid = Candidate::new(Kind::Armature, vec![self.joint]);
        let rotor = self.rotor(&rigid);
        let (_, rigid_rotor) = self.turn(rigid.clone(), rotor);
        let without = self.left(&rigid, rigid_rotor);
        if without.iter().filter(|left| **left > 2.0 * self.nothing).count() < LEAST_TELLING {
            return None;
        }
        let rigid_measure = self.measure(&rigid, rigid_rotor);
        let rest = self.rows(&rigid, rigid_rotor);
        let left_of = |e: usize| mean_square(&rest[self.logs.band.of_episode[e].clone()]);
        let episode = (0..self.runs.len()).max_by(|&a, &b| left_of(a).total_cmp(&left_of(b))).unwrap_or(0);
        let mut best: Option<(f64, Candidate, f64)> = None;
        for side in [EncoderSide::Link, EncoderSide::Motor] {
            for (kind, grid) in [(Kind::JointElasticity, &RESONANCE[..]), (Kind::Backlash, &GAP)] {
                let at = &|shape: f64| Candidate {
                    shape,
                    side,
                    inertia: self.inertia,
                    ..Candidate::new(kind, vec![self.joint])
                };
                let measured = |(drive, rotor): (Candidate, f64)| (self.measure(&drive, rotor), drive, rotor);
                // Where most of the time is spent in the gap, the rotor of a rigid drive is far off.
                let rotors = || ROTOR.iter().map(|part| part * self.inertia).chain([rigid_rotor]);
                let mut tried: Vec<(f64, Candidate, f64)> = grid
                    .iter()
                    .flat_map(|&shape| rotors().map(move |rotor| (at(shape), rotor)))
                    .map(|(drive, rotor)| (self.first_measure(episode, &drive, rotor), drive, rotor))
                    .collect();
                tried.sort_by(|a, b| a.0.total_cmp(&b.0));
                tried.truncate(FIRST);
                let descended: Vec<(Candidate, f64)> =
                    tried.iter().map(|(_, drive, rotor)| self.descend(drive.clone(), *rotor)).collect();
                let tried = tried.into_iter().map(|(_, drive, rotor)| (drive, rotor)).chain(descended).map(measured);
                let first = tried.min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, first, rotor)) = first.filter(|(least, ..)| *least < rigid_measure) else { continue };
                let (drive, rotor) = self.turn(first, rotor);
                let measure = self.measure(&drive, rotor);
                if best.as_ref().is_none_or(|(least, ..)| measure < *least) {
                    best = Some((measure, drive, rotor));
                }
            }
        }
        let (_, drive, rotor) = best?;
        let with = self.left(&drive, rotor);
        let gain = mean(&without.iter().zip(&with).map(|(r, d)| (r / d).ln()).collect::<Vec<_>>());
        let telling: Vec<f64> = without
            .iter()
            .zip(&with)
            .filter(|(r, d)| r.max(**d) > 2.0 * self.nothing)
            .map(|(r, d)| (r / d).ln())
            .collect();
        let beyond = telling.iter().sum::<f64>() / mean_square(&telling).sqrt() / (telling.len().max(1) as f64).sqrt();
        // At the edge of what a drive can be, it stands in for something else.
        let possible = rotor > 1.1 * LIGHTEST * self.inertia
            && (drive.kind != Kind::JointElasticity || (SOFTEST..STIFFEST).contains(&drive.shape));
        let knob_error = self.error(&drive, rotor);
        (possible && beyond > BEYOND_DOUBT && (gain > -PART.ln() || mean(&with) < PART * mean(&without)))
            .then_some(Account { drive: Candidate { knob_error, ..drive }, beyond })
    }

    /// The rotor with which a rigid drive leaves least, by least squares.
    fn rotor(&self, rigid: &Candidate) -> f64 {
        let (mut product, mut square) = (0.0, 0.0);
        for run in &self.runs {
            for (rest, a) in run.left_by(rigid, 0.0).iter().zip(&run.acceleration) {
                product += rest * a;
                square += a * a;
            }
        }
        let rotor = if square > 0.0 { product / square } else { 0.0 };
        rotor.max(LIGHTEST * self.inertia)
    }

    /// Knob and rotor of a drive after some Gauss–Newton steps in compliance or gap, in which what is left is nearly linear;
    /// blocks count by what is left of them.
    fn descend(&self, mut drive: Candidate, mut rotor: f64) -> (Candidate, f64) {
        let power = if drive.kind == Kind::JointElasticity { -0.5 } else { 1.0 };
        for _ in 0..DESCENTS {
            let rest = self.rows(&drive, rotor);
            let mut size = vec![(0.0, 0.0); self.logs.band.blocks];
            for (row, rest) in self.logs.band.rows.iter().zip(&rest) {
                size[row.block].0 += rest * rest;
                size[row.block].1 += 1.0;
            }
            let weight = |row: &Row| 1.0 / (size[row.block].0 / size[row.block].1 + self.nothing);
            let by = 1.0 + STEPS.1;
            let knob = self.rows(&Candidate { shape: drive.shape * by.powf(power), ..drive.clone() }, rotor);
            let motor = self.rows(&drive, rotor * by);
            let mut gram = Matrix2::zeros();
            let mut moment = Vector2::zeros();
            for (i, row) in self.logs.band.rows.iter().enumerate() {
                let slope = Vector2::new(knob[i] - rest[i], motor[i] - rest[i]) / STEPS.1;
                gram += weight(row) * slope * slope.transpose();
                moment -= weight(row) * slope * rest[i];
            }
            let Some(step) = gram.lu().solve(&moment).filter(|step| step.iter().all(|x| x.is_finite())) else { break };
            let bounded = |step: f64| 1.0 + step.clamp(-FARTHEST, FARTHEST);
            drive.shape *= bounded(step[0]).powf(power);
            rotor = (rotor * bounded(step[1])).max(LIGHTEST * self.inertia);
        }
        (drive, rotor)
    }

    /// What a drive leaves at the rows of the band.
    fn rows(&self, drive: &Candidate, rotor: f64) -> Vec<f64> {
        self.rows_of(self.runs.iter().copied(), drive, rotor)
    }

    fn rows_of<'r>(&self, runs: impl Iterator<Item = &'r JointRun>, drive: &Candidate, rotor: f64) -> Vec<f64> {
        runs.enumerate().flat_map(|(e, run)| self.logs.band.filter(e, &run.left_by(drive, rotor))).collect()
    }

    /// Knob and rotor where a drive leaves least: a search along the two in steps that become smaller.
    fn turn(&self, drive: Candidate, rotor: f64) -> (Candidate, f64) {
        let mut best = (self.measure(&drive, rotor), drive, rotor);
        let mut step = STEPS.0;
        for _ in 0..MOVES {
            if step < STEPS.1 {
                break;
            }
            let mut tries = vec![(1.0, 1.0 + step), (1.0, 1.0 / (1.0 + step))];
            if best.1.shape > 0.0 {
                tries.extend([(1.0 + step, 1.0), (1.0 / (1.0 + step), 1.0)]);
            }
            let next = tries
                .into_iter()
                .map(|(knob, by)| (Candidate { shape: knob * best.1.shape, ..best.1.clone() }, by * best.2))
                .filter(|(_, rotor)| *rotor >= LIGHTEST * self.inertia)
                .map(|(drive, rotor)| (self.measure(&drive, rotor), drive, rotor))
                .find(|next| next.0 < best.0);
            match next {
                Some(next) => best = next,
                None => step /= 2.0,
            }
        }
        (best.1, best.2)
    }

    /// Mean logarithm of what is left of the blocks: a burst of chatter counts as one block that is off.
    fn measure(&self, drive: &Candidate, rotor: f64) -> f64 {
        mean_logarithm(self.left(drive, rotor))
    }

    /// A first look at the same: of one episode alone, and with a rigid drive's noise.
    fn first_measure(&self, episode: usize, drive: &Candidate, rotor: f64) -> f64 {
        let mut rows = vec![0.0; self.logs.band.rows.len()];
        let rest = self.logs.band.filter(episode, &self.runs[episode].left_by(drive, rotor));
        rows[self.logs.band.of_episode[episode].clone()].copy_from_slice(&rest);
        mean_logarithm(self.beyond(rows, &self.noise))
    }

    /// Mean square of each block that a drive leaves beyond noise and nothing, (N m)².
    fn left(&self, drive: &Candidate, rotor: f64) -> Vec<f64> {
        let rest = self.rows(drive, rotor);
        let noise = self.noise(drive, rotor, &rest);
        // Play is so sensitive that noise might account for all of it: no more is taken off than of a rigid drive.
        let noise: Vec<f64> = noise.iter().zip(&self.noise).map(|(noise, rigid)| noise.min(*rigid)).collect();
        self.beyond(rest, &noise)
    }

    fn beyond(&self, rest: Vec<f64>, noise: &[f64]) -> Vec<f64> {
        let left = self.mean_squares(rest).into_iter().zip(noise);
        left.map(|(left, noise)| (left - noise).max(0.0) + self.nothing).collect()
    }

    /// Mean square of what more noise changes of a rest, in each block, (N m)².
    fn noise(&self, drive: &Candidate, rotor: f64, rest: &[f64]) -> Vec<f64> {
        let noisier = self.rows_of(self.noisier.iter(), drive, rotor);
        self.mean_squares(noisier.iter().zip(rest).map(|(noisier, rest)| noisier - rest).collect())
    }

    /// Of every block that has rows.
    fn mean_squares(&self, rows: Vec<f64>) -> Vec<f64> {
        gap::squares(&self.logs.band, &vec![rows], |_| true).iter().map(|block| block[0] / block[1]).collect()
    }

    /// Standard error of the knob, the rotor free: sandwich over blocks.
    fn error(&self, drive: &Candidate, rotor: f64) -> f64 {
        let rest = self.rows(drive, rotor);
        let slope = |step: f64, moved: Vec<f64>, back: Vec<f64>| -> Vec<f64> {
            moved.iter().zip(&back).map(|(m, b)| (m - b) / (2.0 * step)).collect()
        };
        let by = STEPS.1 * drive.shape;
        let knob = |by: f64| self.rows(&Candidate { shape: drive.shape + by, ..drive.clone() }, rotor);
        let knob = slope(by, knob(by), knob(-by));
        let by = STEPS.1 * rotor;
        let rotor = slope(by, self.rows(drive, rotor + by), self.rows(drive, rotor - by));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // The knob's slope less what the rotor could make up for.
        let part = dot(&knob, &rotor) / dot(&rotor, &rotor).max(f64::MIN_POSITIVE);
        let own: Vec<f64> = knob.iter().zip(&rotor).map(|(k, r)| k - part * r).collect();
        let mut scores = vec![0.0; self.logs.band.blocks];
        for (row, (own, rest)) in self.logs.band.rows.iter().zip(own.iter().zip(&rest)) {
            scores[row.block] += own * rest;
        }
        dot(&scores, &scores).sqrt() / dot(&own, &own).max(f64::MIN_POSITIVE)
    }
}

/// A run in which a joint's position and effort have noise of some standard deviation once more.
fn noisier(s: &Signals, run: &JointRun, position: f64, effort: f64, seed: u64) -> JointRun {
    let kernel = derivative_kernel(s.raw.dt);
    let mut random = Pcg64::seed_from_u64(seed);
    let samples = s.raw.position.first().map_or(0, Vec::len);
    let mut white = |deviation: f64| -> Vec<f64> {
        (0..samples).map(|_| deviation * random.sample::<f64, _>(StandardNormal)).collect()
    };
    let (position, effort) = (white(position), white(effort));
    let mut noisier = run.clone();
    for k in 0..run.rest.len() {
        let from = s.first + k * s.stride - kernel.reach;
        let (acceleration, effort) = (apply(&kernel.second, &position, from), apply(&kernel.value, &effort, from));
        noisier.acceleration[k] += acceleration;
        noisier.delivered[k] += effort;
        noisier.rest[k] += effort - run.inertia[k] * acceleration;
    }
    noisier
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

fn mean_logarithm(x: Vec<f64>) -> f64 {
    let mean = mean(&x.into_iter().map(f64::ln).collect::<Vec<_>>());
    if mean.is_finite() { mean } else { f64::INFINITY }
}

fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64
}
