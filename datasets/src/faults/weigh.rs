//! How well an account of the logs holds: the torque of the model, with the freedom that an ordinary robot has, against
//! the effort. Two accounts of the same logs are compared by the difference of their scores, a log-likelihood ratio.

use super::sample::Sample;
use crate::robust::rms;
use gapscope_dynamics::{Data, Model};
use nalgebra::{DMatrix, DVector};

/// What lies below this share of the effort's variance is no evidence: no robot is known that well.
const FLOOR: f64 = 3e-4;
/// Places count as so many independent ones at most, a joint.
const MOST_INDEPENDENT: f64 = 120.0;
/// What it costs, in nats, to take a robot for one that has been used long.
const WORN: f64 = 3.0;
/// A robot described in grams is one whose efforts are this part of what the description takes, ...
const GRAMS: f64 = 1e-3;
/// ... within this, as a logarithm.
const NEAR: f64 = 0.7;
/// What is left of an effort, squared, is little below this.
const LITTLE: f64 = 0.03;
/// What two accounts leave of a joint, squared, is the same where it differs by less than this, as a logarithm.
const SAME: f64 = 0.3;
/// An autocorrelation below this is chance.
const REMEMBERED: f64 = 0.05;
/// Rounds of weighing the joints against each other.
const ROUNDS: usize = 4;
/// Columns of each joint: bias, viscous and dry friction, rotor, gain.
pub(crate) const OWN: usize = 5;

/// How far a robot may be from its description before an account loses by it: standard deviations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Freedom {
    /// Of masses, relative; first moments and inertia follow.
    pub bodies: f64,
    /// Of the gain of each drive, relative.
    pub gain: f64,
    /// What lies below this share of the effort's variance is no evidence.
    pub floor: f64,
}

impl Freedom {
    /// A used robot.
    pub const ORDINARY: Freedom = Freedom { bodies: 0.07, gain: 0.07, floor: FLOOR };
    /// The same, to tell a size once it is known that there is one: the least bit counts.
    pub const FINE: Freedom = Freedom { floor: 1e-6, ..Freedom::ORDINARY };
    /// One whose links are off by up to a third.
    pub const WORN: Freedom = Freedom { bodies: 0.2, gain: 0.1, floor: FLOOR };
    /// One that was described badly.
    pub const WIDE: Freedom = Freedom { bodies: 0.4, gain: 0.1, floor: FLOOR };
}

/// An account, weighed.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    /// Logarithm of its likelihood and of what it asks of the robot, up to a constant that all accounts share.
    pub score: f64,
    /// What it asks of the robot, in nats.
    pub asked: f64,
    /// Share of each joint's effort, squared, that it leaves.
    pub unexplained: Vec<f64>,
    /// Places that count as one independent one of what it leaves of each joint.
    remembered: Vec<f64>,
    /// Further factor of each joint's effort, 1 where the account has it right.
    pub gain: Vec<f64>,
    /// Its standard error.
    pub gain_error: Vec<f64>,
    /// Standard deviation of every column of the fit over that before it: of the links' parameters, then of what [`OWN`] says.
    pub narrowed: Vec<f64>,
    /// Places that had a say.
    places: usize,
    /// Mass that the effort asks the robot to have, over that of its description; gains of the drives are in it.
    pub mass: f64,
    /// Effort that each joint's own motion asks for beside friction and bias, over what the description takes for it.
    pub inertia: Vec<f64>,
    /// The same of all joints together: the heaviest count most.
    pub torque: f64,
    /// What it makes of the effort, joint-major, N m or N.
    pub predicted: Vec<Vec<f64>>,
}

impl Weighed {
    /// Whether nothing is left to ask: little of any effort, and of an ordinary robot.
    pub fn is_plain(&self, active: &[bool]) -> bool {
        let joints = active.iter().filter(|active| **active).count() as f64;
        self.leaves_little(active) && self.asked < 4.0 + 2.0 * joints
    }

    /// By how many nats it is likelier than another account of the same places. What the better one leaves of a joint is nearer to
    /// noise, and says how many of them count as one: a wrist's friction under another law than the fit's is left for as long as a
    /// motion lasts, and is no evidence of its own at every place.
    pub fn likelier_than(&self, other: &Weighed) -> f64 {
        let overcounted = |j: usize| {
            let gained = (other.unexplained[j] / self.unexplained[j]).ln();
            let least = self.remembered[j].min(other.remembered[j]);
            0.5 * gained * (independent(self.places) - independent_of(self.places, least))
        };
        let overcounted: f64 = (0..self.unexplained.len()).map(overcounted).sum();
        self.score - other.score - overcounted
    }

    /// Whether it leaves the same of every effort as another account, up to chance.
    pub fn leaves_the_same(&self, other: &Weighed, active: &[bool]) -> bool {
        let same = |j: usize| (self.unexplained[j] / other.unexplained[j]).ln().abs() < SAME;
        (0..active.len()).all(|j| !active[j] || same(j))
    }

    /// Whether little of any effort is left.
    pub fn leaves_little(&self, active: &[bool]) -> bool {
        self.unexplained.iter().zip(active).all(|(left, active)| !active || *left < LITTLE)
    }
}

/// Weighs an account by the likelier of two robots: a used one, and one that has been used long.
pub(crate) fn weigh_either(model: &Model, sample: &Sample, scale: &[f64], active: &[bool]) -> Weighed {
    let account = Rows::new(model, sample, scale, active);
    let ordinary = account.weigh(Freedom::ORDINARY);
    if ordinary.is_plain(active) {
        return ordinary;
    }
    let mut worn = account.weigh(Freedom::WORN);
    worn.score -= WORN;
    if worn.score > ordinary.score { worn } else { ordinary }
}

/// Weighs an account: `scale[j]` is what the effort of joint j was multiplied by when it was logged. Joints that are not
/// `active` have no say.
pub(crate) fn weigh(model: &Model, sample: &Sample, scale: &[f64], active: &[bool], freedom: Freedom) -> Weighed {
    Rows::new(model, sample, scale, active).weigh(freedom)
}

/// The effort of one joint at all places, linear in the columns that it knows: those of the links that it carries and its own.
struct Row {
    joint: usize,
    /// Its columns among all of them; its own [`OWN`] are the last.
    columns: Vec<usize>,
    /// (columns, places).
    table: DMatrix<f64>,
    /// Normal equations of the places that have a say.
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// Its places that have a say, each with the effort there, N m or N.
    target: Vec<(usize, f64)>,
    /// Sum of squares of what the description leaves.
    square: f64,
    /// Variance of the effort.
    variance: f64,
}

impl Row {
    /// Its part of a solution for all columns.
    fn part(&self, solution: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.columns.len(), self.columns.iter().map(|&i| solution[i]))
    }
}

/// An account as a linear fit, whatever the freedom.
struct Rows<'a> {
    model: &'a Model,
    sample: &'a Sample,
    /// What the description takes, joint-major.
    torque: Vec<Vec<f64>>,
    level: Vec<f64>,
    /// Active joints.
    rows: Vec<Row>,
    /// Places that have a say.
    places: usize,
}

impl<'a> Rows<'a> {
    fn new(model: &'a Model, sample: &'a Sample, scale: &[f64], active: &[bool]) -> Rows<'a> {
        let n = model.dof();
        // Places of a silent log have a prediction and no say.
        let heard: Vec<usize> = (0..sample.len()).filter(|&k| sample.silent != Some(sample.log[k])).collect();
        let torque = sample.torque(model);
        let most = torque.iter().map(|row| rms(row)).fold(0.0, f64::max);
        let level = (0..n).map(|j| level(model, j, &torque[j], most, scale[j])).collect();
        let columns = |j: usize| {
            let bodies = (0..n).filter(|&link| carries(model, j, link)).flat_map(|link| 10 * link..10 * link + 10);
            bodies.chain(10 * n + OWN * j..10 * n + OWN * (j + 1)).collect::<Vec<_>>()
        };
        let mut tables: Vec<(usize, Vec<usize>, DMatrix<f64>)> = (0..n)
            .filter(|&j| active[j])
            .map(|j| {
                let columns = columns(j);
                let table = DMatrix::zeros(columns.len(), sample.len());
                (j, columns, table)
            })
            .collect();
        let mut bodies = DMatrix::zeros(n, 10 * n);
        let mut data = Data::new(model);
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let slow: Vec<f64> = sample.v.iter().map(|v| 0.1 * rms(v)).collect();
        for k in 0..sample.len() {
            for j in 0..n {
                (q[j], v[j], a[j]) = (sample.q[j][k], sample.v[j][k], sample.a[j][k]);
            }
            model.regressor(&mut data, &q, &v, &a, &mut bodies);
            for (j, columns, table) in &mut tables {
                let (j, mut row) = (*j, table.column_mut(k));
                let links = columns.len() - OWN;
                row.iter_mut().zip(&columns[..links]).for_each(|(x, &i)| *x = bodies[(j, i)]);
                let dry = if slow[j] > 0.0 { (v[j] / slow[j]).tanh() } else { 0.0 };
                row.rows_mut(links, OWN).copy_from_slice(&[1.0, v[j], dry, a[j], torque[j][k]]);
            }
        }
        let row = |(joint, columns, table): (usize, Vec<usize>, DMatrix<f64>)| {
            let target: Vec<f64> = heard.iter().map(|&k| sample.effort[joint][k] / scale[joint]).collect();
            let left = heard.iter().zip(&target).map(|(&k, effort)| effort - torque[joint][k]);
            let left = DVector::from_iterator(heard.len(), left);
            let told = table.select_columns(&heard);
            let (normal, right) = (&told * told.transpose(), &told * &left);
            let (square, variance) = (left.norm_squared(), spread(&target));
            let target = heard.iter().copied().zip(target).collect();
            Row { joint, columns, table, normal, right, target, square, variance }
        };
        let rows = tables.into_iter().map(row).collect();
        Rows { model, sample, torque, level, rows, places: heard.len() }
    }

    /// Places of what is left of a joint that count as one: 1 + 2 Σ ρ_k over the first lags whose autocorrelation ρ_k is positive.
    fn remembered(&self, row: &Row, predicted: &[f64]) -> f64 {
        let left: Vec<(usize, f64)> =
            (row.target.iter()).map(|&(place, effort)| (self.sample.log[place], effort - predicted[place])).collect();
        let power: f64 = left.iter().map(|(_, x)| x * x).sum();
        let product = |lag: usize| -> f64 {
            let pairs = left.iter().zip(&left[lag..]).filter(|(a, b)| a.0 == b.0);
            pairs.map(|(a, b)| a.1 * b.1).sum()
        };
        let correlations = (1..left.len()).map(|lag| product(lag) / power);
        1.0 + 2.0 * correlations.take_while(|rho| *rho > REMEMBERED).sum::<f64>()
    }

    fn weigh(&self, freedom: Freedom) -> Weighed {
        let (model, n, places) = (self.model, self.model.dof(), self.places);
        let width = 10 * n + OWN * n;
        let mut prior = prior(model, self.sample, &self.level, freedom);
        let ordinary = prior.clone();
        let independent = independent(places);
        // Rows count as fewer where they are not independent.
        let worth = independent / places.max(1) as f64;
        let mut noise: Vec<f64> = self.rows.iter().map(|row| (0.1 * row.variance).max(1e-300)).collect();
        let mut solution = DVector::zeros(width);
        let mut last = None;
        let mut unexplained = vec![1.0; n];
        for _ in 0..ROUNDS {
            let mut sum = DMatrix::from_diagonal(&DVector::from_iterator(width, prior.iter().map(|s| s.powi(-2))));
            let mut b = DVector::zeros(width);
            for (row, noise) in self.rows.iter().zip(&noise) {
                let weight = worth / noise;
                for (from, &i) in row.columns.iter().enumerate() {
                    b[i] += weight * row.right[from];
                    row.columns.iter().enumerate().for_each(|(to, &k)| sum[(k, i)] += weight * row.normal[(to, from)]);
                }
            }
            // Scaled by the prior the matrix is at least the identity.
            let size = DVector::from_vec(prior.clone());
            for (mut column, s) in sum.column_iter_mut().zip(&size) {
                column.component_mul_assign(&size);
                column *= *s;
            }
            let Some(factor) = sum.cholesky() else { break };
            solution = factor.solve(&b.component_mul(&size)).component_mul(&size);
            last = Some(factor);
            keep_to_physics(model, &solution, &ordinary, &mut prior, freedom);
            for (row, noise) in self.rows.iter().zip(&mut noise) {
                let part = row.part(&solution);
                let left = row.square - 2.0 * part.dot(&row.right) + part.dot(&(&row.normal * &part));
                let share = left.max(0.0) / places.max(1) as f64 / row.variance.max(1e-300);
                let share = if share.is_finite() { share.max(freedom.floor) } else { 1e3 };
                unexplained[row.joint] = share;
                *noise = share * row.variance.max(1e-300);
            }
        }
        let inverse = last.map_or_else(|| DMatrix::zeros(0, 0), |factor| factor.inverse());
        let asked: f64 = solution.iter().zip(&prior).map(|(x, s)| 0.5 * (x / s).powi(2)).sum();
        let likelihood: f64 = self.rows.iter().map(|row| -0.5 * independent * unexplained[row.joint].ln()).sum();
        let gain_at = |j: usize| 10 * n + OWN * j + 4;
        let error = |j: usize| inverse.get((gain_at(j), gain_at(j))).map_or(1.0, |x| x.max(0.0).sqrt() * freedom.gain);
        let mut predicted = self.torque.clone();
        // Without what friction and bias take: the first three of the joint's own columns.
        let mut inertia = vec![(1.0, 1.0); n];
        let (mut sum, mut size) = (0.0, 0.0);
        let mut remembered = vec![1.0; n];
        for row in &self.rows {
            let (j, torque, mut part) = (row.joint, &self.torque[row.joint], row.part(&solution));
            let further = row.table.tr_mul(&part);
            predicted[j].iter_mut().zip(&further).for_each(|(torque, further)| *torque += further);
            remembered[j] = self.remembered(row, &predicted[j]);
            part.rows_mut(row.columns.len() - OWN, 3).fill(0.0);
            let further = row.table.tr_mul(&part);
            let torque_of_motion = torque.iter().zip(&further).map(|(torque, further)| (torque + further) * torque);
            let of_joint = (torque_of_motion.sum::<f64>(), torque.iter().map(|x| x * x).sum::<f64>());
            inertia[j] = if of_joint.1 > 0.0 { of_joint } else { (1.0, 1.0) };
            (sum, size) = (sum + inertia[j].0, size + inertia[j].1);
        }
        let described: f64 = model.joints().iter().map(|joint| joint.inertia.mass.abs()).sum();
        let further: f64 = (0..n).map(|j| solution[10 * j]).sum();
        let gains: Vec<f64> = self.rows.iter().map(|row| 1.0 + solution[gain_at(row.joint)]).collect();
        let mean_gain = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
        Weighed {
            score: likelihood - asked,
            mass: (1.0 + further / described.max(1e-9)) * mean_gain,
            inertia: inertia.iter().map(|(sum, size)| sum / size).collect(),
            torque: if size > 0.0 { sum / size } else { 1.0 },
            asked,
            unexplained,
            remembered,
            places,
            gain: (0..n).map(|j| 1.0 + solution[gain_at(j)]).collect(),
            gain_error: (0..n).map(error).collect(),
            narrowed: (0..width).map(|i| inverse.get((i, i)).map_or(1.0, |x| x.max(0.0).sqrt())).collect(),
            predicted,
        }
    }
}

/// Whether joint `j` moves `link`.
fn carries(model: &Model, j: usize, link: usize) -> bool {
    std::iter::successors(Some(link), |&link| model.joints()[link].parent).any(|link| link == j)
}

/// Friction and rotors take torque, they give none, and what hangs on the last link has a mass: where a solution says
/// otherwise, that column gets no more freedom than an error of the description has.
fn keep_to_physics(model: &Model, solution: &DVector<f64>, ordinary: &[f64], prior: &mut [f64], freedom: Freedom) {
    let n = model.dof();
    for j in 0..n {
        for i in 10 * n + OWN * j + 1..10 * n + OWN * j + 4 {
            if solution[i] < 0.0 {
                prior[i] = 0.1 * ordinary[i];
            }
        }
        let mass = freedom.bodies * model.joints()[j].inertia.mass.abs();
        if solution[10 * j] < 0.0 && mass > 0.0 && mass < ordinary[10 * j] {
            let share = mass / ordinary[10 * j];
            (10 * j..10 * j + 10).for_each(|i| prior[i] = share * ordinary[i]);
        }
    }
}

/// What is much torque for a joint: its limit, or the torque that the motion takes. `most` is what it takes of the joint that
/// bears most.
///
/// A thousandth of the effort is a description in grams, and its limits are in N m (N) all the same.
fn level(model: &Model, j: usize, torque: &[f64], most: f64, scale: f64) -> f64 {
    let limit = model.joints()[j].limits.effort.filter(|limit| *limit > 0.0 && limit.is_finite()).unwrap_or(0.0);
    let limit = if (scale.abs() / GRAMS).ln().abs() < NEAR { limit / GRAMS } else { limit };
    // A limit far beyond what the motion takes is that of another drive, or none. A wrist that bears next to nothing has the
    // friction of its drive all the same.
    let taken = rms(torque);
    limit.min((300.0 * taken).max(most)).max(2.0 * taken).max(1e-9)
}

/// Standard deviations of all columns.
fn prior(model: &Model, sample: &Sample, level: &[f64], freedom: Freedom) -> Vec<f64> {
    let n = model.dof();
    let total: f64 = model.joints().iter().map(|joint| joint.inertia.mass.abs()).sum();
    let mut prior = vec![1e-9; (10 + OWN) * n];
    for (j, joint) in model.joints().iter().enumerate() {
        let body = joint.inertia.parameters();
        let mass = body[0].abs();
        // Something may be screwed to the last link.
        let last = !model.joints().iter().any(|other| other.parent == Some(j));
        let heavier = freedom.bodies * mass + if last { 0.04 * total } else { 0.005 * total };
        let center = model.joints()[j].inertia.first_moment.length() / mass.max(1e-9);
        let trace = body[4] + body[6] + body[9];
        let size = (0.5 * trace.abs() / mass.max(1e-9)).sqrt().max(center).clamp(1e-3, 1e3);
        prior[10 * j] = heavier.max(1e-9);
        prior[10 * j + 1..10 * j + 4].fill((heavier * size).max(1e-9));
        prior[10 * j + 4..10 * j + 10].fill((2.0 * heavier * size * size).max(1e-9));
        let fastest = rms(&sample.v[j]).max(1e-9);
        let hardest = rms(&sample.a[j]).max(1e-9);
        let own = &mut prior[10 * n + OWN * j..][..OWN];
        own.copy_from_slice(&[
            0.08 * level[j],
            0.12 * level[j] / fastest,
            0.12 * level[j],
            0.12 * level[j] / hardest,
            freedom.gain,
        ]);
    }
    prior
}

/// Places count as so many independent ones: neighbours share half of their tents.
pub(crate) fn independent(places: usize) -> f64 {
    (0.5 * places as f64).min(MOST_INDEPENDENT)
}

/// The same where what is left is remembered over so many places.
fn independent_of(places: usize, remembered: f64) -> f64 {
    independent(places).min(places as f64 / remembered)
}

/// Variance.
pub(crate) fn spread(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    /// A two-link arm at 400 places, whose first joint's effort is off by some torque, N m.
    fn weighed(model: &Model, off: impl Fn(f64) -> f64) -> Weighed {
        let wave = |order: i32| -> Vec<Vec<f64>> {
            let at = |j: usize, k: usize| {
                let omega = 1.1 + 0.6 * j as f64;
                let turned = omega * 0.05 * k as f64 + f64::from(order) * std::f64::consts::FRAC_PI_2;
                omega.powi(order) * turned.sin()
            };
            (0..2).map(|j| (0..400).map(|k| at(j, k)).collect()).collect()
        };
        let mut sample = Sample {
            q: wave(0),
            v: wave(1),
            a: wave(2),
            effort: Vec::new(),
            log: vec![0; 400],
            tents: vec![[0.0; 3]; 400],
            silent: None,
        };
        sample.effort = sample.torque(model);
        sample.effort[0].iter_mut().enumerate().for_each(|(k, effort)| *effort += off(k as f64));
        weigh(model, &sample, &[1.0; 2], &[true; 2], Freedom::ORDINARY)
    }

    #[test]
    fn what_is_left_for_long_is_no_evidence_of_its_own_at_every_place() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let gained = |off: &dyn Fn(f64) -> f64| {
            let [better, worse] = [0.5, 1.0].map(|size| weighed(&model, |k| size * off(k)));
            let nats = better.likelier_than(&worse);
            assert!((nats + worse.likelier_than(&better)).abs() < 1e-9, "what speaks for one speaks against the other");
            nats / (better.score - worse.score)
        };
        // Signs that know nothing of each other.
        let noise = |k: f64| if (7.7 * k * k).sin() > 0.0 { 0.3 } else { -0.3 };
        assert!((gained(&noise) - 1.0).abs() < 0.05, "{}", gained(&noise));
        // One sign for twenty places, as another law of friction leaves it.
        let steps = |k: f64| noise((k / 20.0).floor());
        assert!((0.05..0.35).contains(&gained(&steps)), "{}", gained(&steps));
    }
}
