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
mod left;

use crate::numbers::decide::{CLEAR, LIGHTEST_ROTOR, UNNOTICED};
pub(crate) use least::Least;
use left::{beyond_doubt, dot, mean, mean_square, noisier, tells};

use crate::fit::estimate::Fit;
use crate::fit::plant::{aligned, plant_pushed};
use crate::fit::problem::Problem;
use crate::numbers::kernel::apply;
use crate::record::band::Row;
use crate::record::floor::noise_floor;
use crate::record::logs::Record;
use crate::record::rows;
use crate::record::signals::{Signals, derivative_kernel};
use gapscope_effects::{Candidate, EffectError, EncoderSide, JointRun, Kind, Place, Turning};
use nalgebra::{Matrix2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

/// Where the position may be logged.
const SIDES: [EncoderSide; 2] = [EncoderSide::Link, EncoderSide::Motor];
/// Rotors that are tried first with each knob, as parts of the inertia that they turn.
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
/// Two knobs that are nearer than this came to the same place, relative.
const APART: f64 = 0.1;
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
    logs: &'a Record<'a>,
    joint: usize,
    runs: Vec<&'a JointRun>,
    noisier: Vec<JointRun>,
    /// Samples of each episode at which the joint slides: at rest friction holds what nobody knows.
    slides: Vec<Vec<bool>>,
    /// What calibration of the joint's own is linear in beside its rotor, `[episode][column][sample]`: friction and bias.
    calibration: Vec<Vec<Vec<f64>>>,
    /// Directions of length one that it spans at the rows of the band, in each view that was asked for.
    spans: Mutex<Vec<(View, Span)>>,
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

/// Orthogonal directions of length one.
type Span = Arc<Vec<Vec<f64>>>;

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

impl Record<'_> {
    /// The best spring and the best play in the drive of each of some joints, encoders on either side, that are better than a
    /// rigid one, beside other effects, none of them such a drive; best first.
    pub(crate) fn accounts(
        &self,
        joints: &[usize],
        problem: &Problem,
        others: &Fit,
        through: bool,
    ) -> Result<Vec<Account>, EffectError> {
        if joints.is_empty() {
            return Ok(Vec::new());
        }
        let runs = self.joint_runs(problem, others)?;
        let mut found: Vec<Account> =
            joints.par_iter().flat_map(|&j| Study::new(self, &runs, j, through).best()).collect();
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
    fn new(logs: &'a Record<'a>, runs: &'a [Vec<JointRun>], joint: usize, through: bool) -> Study<'a> {
        let runs: Vec<&JointRun> = runs.iter().map(|joints| &joints[joint]).collect();
        let inertia = mean(&runs.iter().map(|run| mean(&run.inertia)).collect::<Vec<_>>());
        let mut study = Study {
            logs,
            joint,
            runs,
            noisier: Vec::new(),
            slides: logs.signals.iter().map(|s| s.slides(joint, logs.still[joint])).collect(),
            calibration: logs.signals.iter().map(|s| calibration(logs, s, joint)).collect(),
            spans: Mutex::default(),
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
        study.unnoticed = (UNNOTICED.get() * rows::effort_deviation(&logs.signals, joint)).powi(2);
        study.rigid = study.rigid_in(View::default());
        study.rotor = study.turn(rigid, study.rotor).1;
        study.rigid = study.rigid_in(View::default());
        study
    }

    /// The best accounts of each kind, the encoder on either side, that are better than a rigid drive.
    fn best(&self) -> Vec<Account> {
        if !tells(&self.rigid, &self.rigid.left) {
            return Vec::new();
        }
        let rest = self.rows(&Candidate::rotor(self.joint), self.rotor, View::default());
        let left_of = |e: usize| mean_square(&rest[self.logs.band.of_episode[e].clone()]);
        let episode = (0..self.runs.len()).max_by(|&a, &b| left_of(a).total_cmp(&left_of(b)));
        let first = self.rigid_in(View { episode, smooth: None });
        let tried: Vec<(Kind, Turning, EncoderSide)> = SIDES
            .into_iter()
            .flat_map(|side| turning().map(move |(kind, turning)| (kind, turning, side)))
            .filter(|(_, turning, side)| !self.through || turning.filtered == Some(*side))
            .collect();
        tried
            .into_par_iter()
            .flat_map(|(kind, turning, side)| self.best_of(kind, turning, side, episode, &first))
            .collect()
    }

    /// The best account of a kind, the encoder on one side; through a filter, that of each valley along the knob. `first` is what a
    /// rigid drive leaves of the episode that is looked at first.
    fn best_of(
        &self,
        kind: Kind,
        turning: Turning,
        side: EncoderSide,
        episode: Option<usize>,
        first: &Rigid,
    ) -> Vec<Account> {
        let at =
            &|shape: f64| Candidate { shape, side, inertia: self.inertia, ..Candidate::new(kind, vec![self.joint]) };
        let measured = |(drive, rotor): (Candidate, f64)| (self.measure(&drive, rotor), drive, rotor);
        // Where most of the time is spent in the gap, the rotor of a rigid drive is far off.
        let rotors = || ROTOR.iter().map(|part| part * self.inertia).chain([self.rotor]);
        let open: Vec<(Candidate, f64)> =
            turning.first.iter().flat_map(|&shape| rotors().map(move |rotor| (at(shape), rotor))).collect();
        let measures = self.first_measures(episode, first, &open);
        let mut tried: Vec<(f64, Candidate, f64)> =
            measures.into_iter().zip(open).map(|(measure, (drive, rotor))| (measure, drive, rotor)).collect();
        // Where a rigid drive leaves less than all of them, none near them leaves little. Through filters of their own, and of one
        // episode, that does not show yet.
        if !self.through {
            tried.retain(|(measure, ..)| *measure < 0.0);
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Each knob with its best rotor: what is left has valleys along the knob, through each filter others.
        let mut shapes: Vec<f64> = Vec::new();
        tried.retain(|(_, drive, _)| {
            let is_new = !shapes.contains(&drive.shape);
            shapes.push(drive.shape);
            is_new
        });
        tried.truncate(if self.through { turning.first.len() } else { FIRST });
        let descended: Vec<(Candidate, f64)> =
            tried.iter().map(|(_, drive, rotor)| self.descend(drive.clone(), *rotor)).collect();
        let both =
            tried.into_iter().map(|(_, drive, rotor)| (drive, rotor)).chain(descended.iter().cloned()).map(measured);
        let first = both.min_by(|a, b| a.0.total_cmp(&b.0));
        // To turn what is nowhere near takes most of the time, and it does not come near by it.
        let promises = |(_, drive, rotor): &(f64, Candidate, f64)| self.promises(drive, *rotor);
        let turned = first.filter(promises).map(|(_, drive, rotor)| self.turn(drive, rotor));
        if !self.through {
            return turned.and_then(|(drive, rotor)| self.account(drive, rotor, turning)).into_iter().collect();
        }
        // Its own filter is another now. Through filters of their own the valleys cannot be held against each other: their exact
        // laws tell them apart.
        let turned = turned.map(|(drive, rotor)| self.turn(drive, rotor));
        let mut accounts: Vec<Account> = Vec::new();
        for account in turned.into_iter().chain(descended).filter_map(|(d, rotor)| self.account(d, rotor, turning)) {
            let near = |other: &Account| (account.drive.shape / other.drive.shape).ln().abs() < APART;
            if !accounts.iter().any(near) {
                accounts.push(account);
            }
        }
        accounts
    }

    /// A drive as an account, where it is better than a rigid one beyond doubt.
    fn account(&self, drive: Candidate, rotor: f64, turning: Turning) -> Option<Account> {
        let drive = Candidate { knob_error: self.error(&drive, rotor), rotor, ..drive };
        let rigid = self.against(&drive, rotor);
        let beyond = beyond_doubt(&rigid, &self.left(&drive, rotor, &rigid))?;
        // A drive that may be rigid is another account's, and so is a gap that no gear has. At the edge of what a drive can be, it
        // stands in for something else.
        let (least, greatest) = turning.possible;
        let possible = drive.errors_from_rigid() >= CLEAR.get()
            && drive.shape <= turning.widest
            && (least..greatest).contains(&drive.shape)
            && self.shows(rotor);
        possible.then_some(Account { drive, beyond })
    }

    /// Whether a rotor is heavy enough for its drive to show. A link without inertia about its joint has no drive that turns
    /// on its own: some URDFs have such last links.
    fn shows(&self, rotor: f64) -> bool {
        self.inertia > 0.0 && rotor > 1.1 * LIGHTEST_ROTOR.get() * self.inertia
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
        rotor.max(LIGHTEST_ROTOR.get() * self.inertia)
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
            rotor = (rotor * bounded(step[1])).max(LIGHTEST_ROTOR.get() * self.inertia);
        }
        (drive, rotor)
    }
}

/// Knobs with rotors that are tried of a kind at a joint, the encoder on either side.
fn tries(kind: Kind) -> usize {
    kind.card().turning.map_or(0, |turning| SIDES.len() * turning.first.len() * (ROTOR.len() + 1))
}

/// The columns of a joint's own calibration along a log, its rotor aside: friction and bias.
fn calibration(logs: &Record<'_>, s: &Signals, joint: usize) -> Vec<Vec<f64>> {
    let motion = s.motion(logs.model, &logs.still);
    let of_joint = |kind: &Kind| {
        let card = kind.card();
        kind.is_calibration() && !card.rotor && !card.body && card.place == Place::Joint
    };
    let columns =
        Kind::ALL.into_iter().filter(of_joint).flat_map(|kind| Candidate::new(kind, vec![joint]).columns(&motion));
    columns.flat_map(|column| column.rows).filter(|(row, _)| *row == joint).map(|(_, x)| x).collect()
}

/// The kinds whose motor turns on its own, and how.
fn turning() -> impl Iterator<Item = (Kind, Turning)> {
    Kind::ALL.into_iter().filter_map(|kind| Some((kind, kind.card().turning?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{Armature, Backlash, CoulombFriction, Effect, ViscousFriction};

    /// What friction is beside a rigid drive hides a spring: beside each drive it is whatever leaves least.
    #[test]
    fn friction_and_bias_are_free_beside_a_drive() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let joint = || model.joints()[0].name.clone();
        let rubs = [
            Effect::ViscousFriction(ViscousFriction { viscous: [(joint(), 0.5)].into() }),
            Effect::CoulombFriction(CoulombFriction { coulomb: [(joint(), 0.3)].into() }),
        ];
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = generate(&model, &rubs, 1, &recipe, "log").unwrap();
        let record = Record::new(&model, &[log], &mut Vec::new());
        let noise = [1e-3; 2];
        let nothing = record.data(&noise).problem(Vec::new(), &Kind::ALL);
        let runs = record.joint_runs(&nothing, &Fit::on_all(&nothing, &[])).unwrap();
        let study = Study::new(&record, &runs, 0, false);
        let rest = study.at_rows(View::default(), |e| study.runs[e].left_by(&Candidate::rotor(0), 0.0));
        let left = mean_square(&study.rows(&Candidate::rotor(0), study.rotor, View::default()));
        assert!(left < 1e-3 * mean_square(&rest), "{left} of {}", mean_square(&rest));
    }

    /// What hits its stops hard may look more like a spring at first: each kind and side goes on to its exact law.
    #[test]
    fn of_a_drive_with_play_each_kind_and_side_goes_on_once() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let on = |value: f64| [(model.joints()[0].name.clone(), value)].into();
        let play = [Effect::Backlash(Backlash { gap: on(0.04) }), Effect::Armature(Armature { armature: on(0.5) })];
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = generate(&model, &play, 1, &recipe, "log").unwrap();
        let record = Record::new(&model, &[log], &mut Vec::new());
        let noise = [1e-3; 2];
        let nothing = record.data(&noise).problem(Vec::new(), &Kind::ALL);
        let accounts = record.accounts(&[0, 1], &nothing, &Fit::on_all(&nothing, &[]), false).unwrap();
        let of_first: Vec<_> =
            accounts.iter().filter(|a| a.drive.joints == [0]).map(|a| (a.drive.kind, a.drive.side)).collect();
        assert!(
            [EncoderSide::Link, EncoderSide::Motor].iter().all(|side| of_first.iter().any(|a| a.1 == *side)),
            "{accounts:?}"
        );
        let once = |account: &(Kind, EncoderSide)| of_first.iter().filter(|other| *other == account).count() == 1;
        assert!(of_first.iter().all(once), "{accounts:?}");
    }
}
