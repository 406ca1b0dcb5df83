//! Whether a joint's motor turns on its own: springs and play in the drives, each tried at its exact law.
//!
//! Their torque is not linear in stiffness or gap, not even nearly: a resonance moves, an impact comes earlier. So each joint
//! is looked at alone, all else of the robot along its measured motion, and each account of its drive is turned to where it
//! leaves least. An account that swings with the noise of the position also explains some of it; what noise alone would
//! leave is found by a second run with more of it, and taken off (a simulation of the error in the variables, Cook and
//! Stefanski, J. Am. Stat. Assoc. 89(428) 1994). Springs whose account multiplies the noise of the link's acceleration are
//! looked for through a filter as well.

mod choice;
mod least;

pub(crate) use least::Least;

use crate::band::Row;
use crate::corrected::{aligned, plant_pushed};
use crate::diagnose::Logs;
use crate::estimate::Fit;
use crate::floor::noise_floor;
use crate::gap;
use crate::kernel::apply;
use crate::problem::Problem;
use crate::signals::{Signals, derivative_kernel};
use gapscope_effects::{Candidate, EffectError, EncoderSide, JointRun, Kind, Turning};
use nalgebra::{Matrix2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use std::borrow::Cow;
use std::f64::consts::TAU;

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
const NOTHING: f64 = 1e-3;
/// A rotor lighter than this part of what it turns would not show.
const LIGHTEST: f64 = 0.05;
/// So many blocks of time must show something at all: a joint that its load holds on one side may cross its play once or twice.
const LEAST_TELLING: usize = 2;
/// Standard errors from a rigid drive up to which the drive may be rigid: what the best of the hundred tries at each joint
/// finds in noise, and what [`crate::search`] asks of a drive before any log is seen, k²/2 = 13 nats.
const RIGID: f64 = 5.0;
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
    /// Samples of each episode at which the joint slides: at rest friction holds what nobody knows.
    slides: Vec<Vec<bool>>,
    /// Inertia of the robot about the joint, kg m² (kg).
    inertia: f64,
    /// Rotor with which a rigid drive leaves least, kg m² (kg).
    rotor: f64,
    /// Mean square of the effort that counts as nothing, (N m)².
    unnoticed: f64,
    /// What a rigid drive leaves of all episodes.
    rigid: Rigid,
    /// Whether springs are held against a rigid drive through a filter, and nothing else is tried.
    through: bool,
}

/// Runs as they were logged, or with some noise more.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Runs {
    Logged,
    Noisier,
}

/// How what is left is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct View {
    /// One episode alone.
    episode: Option<usize>,
    /// Through a low-pass filter of this cut-off, rad/s.
    smooth: Option<f64>,
}

/// What a rigid drive leaves in a view, block by block, (N m)²: accounts are held against it.
#[derive(Debug, Clone, Default)]
struct Rigid {
    /// Of that, noise.
    noise: Vec<f64>,
    /// Mean square that counts as nothing.
    nothing: f64,
    /// Beyond noise and nothing.
    left: Vec<f64>,
}

impl Logs<'_> {
    /// The best account of the drive of each of some joints that is better than a rigid one, beside other effects, none of
    /// them such a drive; best first.
    pub(crate) fn accounts(
        &self,
        joints: &[usize],
        problem: &Problem,
        others: &Fit,
        through: bool,
    ) -> Result<Vec<Account>, EffectError> {
        let runs = self.joint_runs(problem, others)?;
        let mut found: Vec<Account> =
            joints.par_iter().filter_map(|&j| Study::new(self, &runs, j, through).best()).collect();
        found.sort_by(|a, b| b.beyond.total_cmp(&a.beyond));
        Ok(found)
    }

    /// What effects leave of each joint in each log, their drives still open.
    pub(crate) fn joint_runs(&self, problem: &Problem, others: &Fit) -> Result<Vec<Vec<JointRun>>, EffectError> {
        let effects = others.effects(problem, self.model);
        let outside = problem.outside(&others.set);
        self.signals
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
            .collect()
    }
}

impl<'a> Study<'a> {
    fn new(logs: &'a Logs<'a>, runs: &'a [Vec<JointRun>], joint: usize, through: bool) -> Study<'a> {
        let runs: Vec<&JointRun> = runs.iter().map(|joints| &joints[joint]).collect();
        let inertia = mean(&runs.iter().map(|run| mean(&run.inertia)).collect::<Vec<_>>());
        let mut study = Study {
            logs,
            joint,
            runs,
            noisier: Vec::new(),
            slides: logs.signals.iter().map(|s| s.slides(joint, logs.still[joint])).collect(),
            inertia,
            rotor: 0.0,
            unnoticed: 0.0,
            rigid: Rigid::default(),
            through,
        };
        let rigid = Candidate::rotor(joint);
        study.rotor = study.least_squares_rotor(&rigid);
        let rest: Vec<Vec<f64>> = study.runs.iter().map(|run| run.left_by(&rigid, study.rotor)).collect();
        // What is white of the effort, and not taken up by the motion, is noise of its measurement.
        let alone: Vec<Vec<Vec<f64>>> = rest.iter().map(|rest| vec![rest.clone()]).collect();
        let floor = noise_floor(&logs.signals, &logs.band, &alone, 1)[0];
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
        let effort = mean(&logs.signals.iter().map(|s| mean_square(&s.tau[joint])).collect::<Vec<_>>());
        study.unnoticed = NOTHING * NOTHING * effort;
        study.rigid = study.rigid_in(View::default());
        study.rotor = study.turn(rigid, study.rotor).1;
        study.rigid = study.rigid_in(View::default());
        study
    }

    fn best(&self) -> Option<Account> {
        if !tells(&self.rigid, &self.rigid.left) {
            return None;
        }
        let rest = self.rows(&Candidate::rotor(self.joint), self.rotor, View::default());
        let left_of = |e: usize| mean_square(&rest[self.logs.band.of_episode[e].clone()]);
        let episode = (0..self.runs.len()).max_by(|&a, &b| left_of(a).total_cmp(&left_of(b)));
        let first = self.rigid_in(View { episode, smooth: None });
        let mut best: Option<(f64, Candidate, f64)> = None;
        for side in [EncoderSide::Link, EncoderSide::Motor] {
            for (kind, turning) in turning() {
                if self.through && turning.filtered != Some(side) {
                    continue;
                }
                let at = &|shape: f64| Candidate {
                    shape,
                    side,
                    inertia: self.inertia,
                    ..Candidate::new(kind, vec![self.joint])
                };
                let measured = |(drive, rotor): (Candidate, f64)| (self.measure(&drive, rotor), drive, rotor);
                // Where most of the time is spent in the gap, the rotor of a rigid drive is far off.
                let rotors = || ROTOR.iter().map(|part| part * self.inertia).chain([self.rotor]);
                let open: Vec<(Candidate, f64)> =
                    turning.first.iter().flat_map(|&shape| rotors().map(move |rotor| (at(shape), rotor))).collect();
                let measures = self.first_measures(episode, &first, &open);
                let mut tried: Vec<(f64, Candidate, f64)> =
                    measures.into_iter().zip(open).map(|(measure, (drive, rotor))| (measure, drive, rotor)).collect();
                tried.sort_by(|a, b| a.0.total_cmp(&b.0));
                tried.truncate(FIRST);
                let descended: Vec<(Candidate, f64)> =
                    tried.iter().map(|(_, drive, rotor)| self.descend(drive.clone(), *rotor)).collect();
                let tried = tried.into_iter().map(|(_, drive, rotor)| (drive, rotor)).chain(descended).map(measured);
                let first = tried.min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, first, rotor)) = first.filter(|(least, ..)| *least < 0.0) else { continue };
                let (drive, rotor) = self.turn(first, rotor);
                // Its own filter is another now.
                let (drive, rotor) = if self.through { self.turn(drive, rotor) } else { (drive, rotor) };
                let measure = self.measure(&drive, rotor);
                // A drive that may be rigid is another account's, and so is a gap that no gear has.
                let drive = Candidate { knob_error: self.error(&drive, rotor), ..drive };
                if drive.errors_from_rigid() < RIGID || drive.shape > turning.widest {
                    continue;
                }
                if best.as_ref().is_none_or(|(least, ..)| measure < *least) {
                    best = Some((measure, drive, rotor));
                }
            }
        }
        let (_, drive, rotor) = best?;
        let rigid = self.against(&drive, rotor);
        let beyond = beyond_doubt(&rigid, &self.left(&drive, rotor, &rigid))?;
        // At the edge of what a drive can be, it stands in for something else.
        let (least, greatest) = drive.kind.card().turning?.possible;
        let possible = self.shows(rotor) && (least..greatest).contains(&drive.shape);
        possible.then_some(Account { drive, beyond })
    }

    /// Whether a rotor is heavy enough for its drive to show. A link without inertia about its joint has no drive that turns
    /// on its own: some URDFs have such last links.
    fn shows(&self, rotor: f64) -> bool {
        self.inertia > 0.0 && rotor > 1.1 * LIGHTEST * self.inertia
    }

    /// The rotor with which a rigid drive leaves least, by least squares.
    fn least_squares_rotor(&self, rigid: &Candidate) -> f64 {
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
        let power = drive.kind.card().turning.map_or(1.0, |turning| turning.power);
        let view = self.view(&drive, rotor);
        let nothing = self.against(&drive, rotor).nothing;
        for _ in 0..DESCENTS {
            let by = 1.0 + STEPS.1;
            let stiffer = Candidate { shape: drive.shape * by.powf(power), ..drive.clone() };
            let moved = [(&drive, rotor), (&stiffer, rotor), (&drive, rotor * by)];
            let rows = self.rows_each(&moved.map(|(drive, rotor)| (Runs::Logged, drive, rotor)), view);
            let [rest, knob, motor] = rows.as_slice() else { break };
            let mut size = vec![(0.0, 0.0); self.logs.band.blocks];
            for (row, rest) in self.logs.band.rows.iter().zip(rest) {
                size[row.block].0 += rest * rest;
                size[row.block].1 += 1.0;
            }
            let weight = |row: &Row| 1.0 / (size[row.block].0 / size[row.block].1 + nothing);
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

    /// What a drive leaves at the rows of the band; nothing of the episodes that are not looked at.
    fn rows(&self, drive: &Candidate, rotor: f64, view: View) -> Vec<f64> {
        self.rows_each(&[(Runs::Logged, drive, rotor)], view).pop().unwrap_or_default()
    }

    /// The same of several, each of these runs or those, a drive and a rotor.
    fn rows_each(&self, asked: &[(Runs, &Candidate, f64)], view: View) -> Vec<Vec<f64>> {
        let all: Vec<(&JointRun, &Candidate, f64)> = (asked.iter())
            .flat_map(|&(of, drive, rotor)| self.episodes(view).map(move |e| (self.run(of, e), drive, rotor)))
            .collect();
        let mut left = JointRun::left_by_each(&all).into_iter();
        asked.iter().map(|_| self.at_rows(view, |_| left.next().unwrap_or_default())).collect()
    }

    fn run(&self, of: Runs, episode: usize) -> &JointRun {
        match of {
            Runs::Logged => self.runs[episode],
            Runs::Noisier => &self.noisier[episode],
        }
    }

    /// Episodes that are looked at.
    fn episodes(&self, view: View) -> impl Iterator<Item = usize> {
        (0..self.runs.len()).filter(move |e| view.episode.is_none_or(|only| only == *e))
    }

    /// A torque of each episode at the rows of the band, in a view.
    fn at_rows(&self, view: View, mut torque: impl FnMut(usize) -> Vec<f64>) -> Vec<f64> {
        let mut rows = vec![0.0; self.logs.band.rows.len()];
        for e in self.episodes(view) {
            let seen = smooth(torque(e), view.smooth, self.runs[e].dt);
            let at_rows = self.logs.band.filter_where(e, &self.slides[e], &seen);
            for (row, seen) in rows[self.logs.band.of_episode[e].clone()].iter_mut().zip(at_rows) {
                *row = seen.unwrap_or(0.0);
            }
        }
        rows
    }

    /// How an account of the drive is held against a rigid one: springs, where a filter is asked for, through one that cuts
    /// at the resonance of rotor and link on the spring.
    fn view(&self, drive: &Candidate, rotor: f64) -> View {
        let filtered =
            self.through && drive.kind.card().turning.is_some_and(|turning| turning.filtered == Some(drive.side));
        let resonance = || TAU * drive.shape * (1.0 + drive.inertia / rotor).sqrt();
        View { episode: None, smooth: filtered.then(resonance) }
    }

    fn rigid_in(&self, view: View) -> Rigid {
        let account = Candidate::rotor(self.joint);
        let (rest, noise) = self.rows_and_noise(&account, self.rotor, view);
        let seen: Vec<f64> = noise.iter().copied().filter(|noise| *noise > 0.0).collect();
        let nothing = OF_NOISE * mean(&seen) + self.unnoticed;
        let mut rigid = Rigid { noise, nothing, left: Vec::new() };
        rigid.left = self.beyond(rest, &taken_off(&rigid.noise, &rigid, view), nothing);
        rigid
    }

    /// What a rigid drive leaves where an account of a drive is held against it.
    fn against(&self, drive: &Candidate, rotor: f64) -> Cow<'_, Rigid> {
        let view = self.view(drive, rotor);
        if view.smooth.is_none() { Cow::Borrowed(&self.rigid) } else { Cow::Owned(self.rigid_in(view)) }
    }

    /// Knob and rotor where a drive leaves least: a search along the two in steps that become smaller, through the filter
    /// of the first, as each through its own would favour those whose filter hides what they leave.
    fn turn(&self, drive: Candidate, rotor: f64) -> (Candidate, f64) {
        let view = self.view(&drive, rotor);
        let rigid = self.against(&drive, rotor);
        let level = |drive: &Candidate, rotor: f64| mean_logarithm(self.left_in(drive, rotor, &rigid, view));
        let mut best = (level(&drive, rotor), drive, rotor);
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
                .map(|(drive, rotor)| (level(&drive, rotor), drive, rotor))
                .find(|next| next.0 < best.0);
            match next {
                Some(next) => best = next,
                None => step /= 2.0,
            }
        }
        (best.1, best.2)
    }

    /// Mean logarithm of what is left of the blocks over what a rigid drive leaves: a burst of chatter counts as one block
    /// that is off.
    fn measure(&self, drive: &Candidate, rotor: f64) -> f64 {
        let rigid = self.against(drive, rotor);
        mean_logarithm(self.left(drive, rotor, &rigid)) - mean_logarithm(&rigid.left)
    }

    /// A first look at the same of several drives with their rotors: of one episode alone, and with a rigid drive's noise.
    fn first_measures(&self, episode: Option<usize>, plain: &Rigid, all: &[(Candidate, f64)]) -> Vec<f64> {
        let measure = |rows: Vec<f64>, rigid: &Rigid, view: View| {
            let left = self.beyond(rows, &taken_off(&rigid.noise, rigid, view), rigid.nothing);
            mean_logarithm(&left) - mean_logarithm(&rigid.left)
        };
        if self.through {
            let one = |(drive, rotor): &(Candidate, f64)| {
                let view = View { episode, ..self.view(drive, *rotor) };
                measure(self.rows(drive, *rotor, view), &self.rigid_in(view), view)
            };
            return all.iter().map(one).collect();
        }
        let view = View { episode, smooth: None };
        let asked: Vec<(Runs, &Candidate, f64)> =
            all.iter().map(|(drive, rotor)| (Runs::Logged, drive, *rotor)).collect();
        self.rows_each(&asked, view).into_iter().map(|rows| measure(rows, plain, view)).collect()
    }

    /// Mean square of each block that a drive leaves beyond noise and nothing, (N m)².
    fn left(&self, drive: &Candidate, rotor: f64, rigid: &Rigid) -> Vec<f64> {
        self.left_in(drive, rotor, rigid, self.view(drive, rotor))
    }

    fn left_in(&self, drive: &Candidate, rotor: f64, rigid: &Rigid, view: View) -> Vec<f64> {
        let (rest, noise) = self.rows_and_noise(drive, rotor, view);
        let noise = taken_off(&noise, rigid, view);
        self.beyond(rest, &noise, rigid.nothing)
    }

    fn beyond(&self, rest: Vec<f64>, noise: &[f64], nothing: f64) -> Vec<f64> {
        let left = self.mean_squares(rest).into_iter().zip(noise);
        left.map(|(left, noise)| (left - noise).max(0.0) + nothing).collect()
    }

    /// What a drive leaves at the rows of the band, and the mean square of what more noise changes of that in each block, (N m)².
    fn rows_and_noise(&self, drive: &Candidate, rotor: f64, view: View) -> (Vec<f64>, Vec<f64>) {
        let asked = [Runs::Logged, Runs::Noisier].map(|of| (of, drive, rotor));
        let mut both = self.rows_each(&asked, view).into_iter();
        let (rest, noisier) = (both.next().unwrap_or_default(), both.next().unwrap_or_default());
        let noise = self.mean_squares(noisier.iter().zip(&rest).map(|(noisier, rest)| noisier - rest).collect());
        (rest, noise)
    }

    /// Of every block that has rows.
    fn mean_squares(&self, rows: Vec<f64>) -> Vec<f64> {
        gap::squares(&self.logs.band, &vec![rows], |_| true).iter().map(|block| block[0] / block[1]).collect()
    }

    /// Standard error of the knob, the rotor free: sandwich over blocks.
    fn error(&self, drive: &Candidate, rotor: f64) -> f64 {
        let view = self.view(drive, rotor);
        let knob = |by: f64| Candidate { shape: drive.shape + by, ..drive.clone() };
        let by = [STEPS.1 * drive.shape, STEPS.1 * rotor];
        let (more, less) = (knob(by[0]), knob(-by[0]));
        let moved = [(drive, rotor), (&more, rotor), (&less, rotor), (drive, rotor + by[1]), (drive, rotor - by[1])];
        let rows = self.rows_each(&moved.map(|(drive, rotor)| (Runs::Logged, drive, rotor)), view);
        let slope = |step: f64, moved: &[f64], back: &[f64]| -> Vec<f64> {
            moved.iter().zip(back).map(|(m, b)| (m - b) / (2.0 * step)).collect()
        };
        let [rest, more, less, heavier, lighter] = rows.as_slice() else { return f64::INFINITY };
        let (knob, rotor) = (slope(by[0], more, less), slope(by[1], heavier, lighter));
        // The knob's slope less what the rotor could make up for.
        let part = dot(&knob, &rotor) / dot(&rotor, &rotor).max(f64::MIN_POSITIVE);
        let own: Vec<f64> = knob.iter().zip(&rotor).map(|(k, r)| k - part * r).collect();
        let mut scores = vec![0.0; self.logs.band.blocks];
        for (row, (own, rest)) in self.logs.band.rows.iter().zip(own.iter().zip(rest)) {
            scores[row.block] += own * rest;
        }
        dot(&scores, &scores).sqrt() / dot(&own, &own).max(f64::MIN_POSITIVE)
    }
}

/// The kinds whose motor turns on its own, and how.
fn turning() -> impl Iterator<Item = (Kind, Turning)> {
    Kind::ALL.into_iter().filter_map(|kind| Some((kind, kind.card().turning?)))
}

/// Whether enough blocks of time show something, by what is left of each.
fn tells(rigid: &Rigid, left: &[f64]) -> bool {
    left.iter().filter(|left| **left > 2.0 * rigid.nothing).count() >= LEAST_TELLING
}

/// By how many standard errors less is left of the blocks with an account than by a rigid drive, where that is beyond
/// doubt and worth it.
fn beyond_doubt(rigid: &Rigid, with: &[f64]) -> Option<f64> {
    let ratios = || rigid.left.iter().zip(with);
    let gain = mean(&ratios().map(|(r, d)| (r / d).ln()).collect::<Vec<_>>());
    let telling: Vec<f64> =
        ratios().filter(|(r, d)| r.max(**d) > 2.0 * rigid.nothing).map(|(r, d)| (r / d).ln()).collect();
    let beyond = telling.iter().sum::<f64>() / mean_square(&telling).sqrt() / (telling.len().max(1) as f64).sqrt();
    (beyond > BEYOND_DOUBT && (gain > -PART.ln() || mean(with) < PART * mean(&rigid.left))).then_some(beyond)
}

/// What is taken off for the noise of an account: what a rigid drive has of it at most, as play is so sensitive that noise
/// might account for all that it leaves; through a filter, where noise is nearly the same for both, what it has more.
fn taken_off(noise: &[f64], rigid: &Rigid, view: View) -> Vec<f64> {
    if view.smooth.is_some() {
        return vec![mean(noise) - mean(&rigid.noise); noise.len()];
    }
    noise.iter().zip(&rigid.noise).map(|(noise, rigid)| noise.min(*rigid)).collect()
}

/// A signal through a low-pass filter: two first-order lags of the same cut-off, rad/s, in a row.
pub(crate) fn smooth(mut x: Vec<f64>, cutoff: Option<f64>, dt: f64) -> Vec<f64> {
    if let Some(cutoff) = cutoff {
        let pass = -(-cutoff * dt).exp_m1();
        let (mut once, mut twice) = (0.0, 0.0);
        for x in &mut x {
            once += pass * (*x - once);
            twice += pass * (once - twice);
            *x = twice;
        }
    }
    x
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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

fn mean_logarithm(x: impl AsRef<[f64]>) -> f64 {
    let mean = mean(&x.as_ref().iter().map(|x| x.ln()).collect::<Vec<_>>());
    if mean.is_finite() { mean } else { f64::INFINITY }
}

fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64
}
