//! Accounts of what was done to the motion: units, signs and zeros of positions, the clock, gravity, the order of joints.

use super::FaultKind;
use super::change::Change;
use super::order;
use super::sample::Sample;
pub(crate) use super::units::{CLOCKS, position_units, velocity_slope};
use crate::check::fit;
use crate::episode::Channel;
use gapscope_dynamics::{JointKind, Model};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// An unexplained share below this counts as this.
const FLOOR: f64 = 4e-3;
/// What an effort that is counted the other way round counts.
const TURNED: f64 = 0.5;
/// What positions beyond the URDF's limits count, a joint, in the unit of [`look`].
const BEYOND: f64 = 0.7;
/// Positions that pass the limits by more spans than this cannot be.
const FAR: f64 = 3.0;
/// What a clock counts that a measured velocity speaks against.
const AGAINST_VELOCITY: f64 = 2.0;

/// The motor's side of a gear, or counts, make positions this many times larger at least; what is smaller has a unit with a name.
const LEAST_GEAR: f64 = 4.0;
/// A velocity off by more than this, as a logarithm, may be that of another clock.
pub(crate) const OTHER_CLOCK: f64 = 0.2;
/// A clock and a velocity agree where they differ by less than this, as a logarithm.
const AGREES: f64 = 0.1;

/// Part of a joint's torque that its motion takes at least, beside weight.
const MOVES: f64 = 0.005;

/// Places at which grids are looked at.
const COARSE: usize = 60;
/// What a gain far from one counts where a clock is looked for.
const GAIN: f64 = 0.2;

/// What kind of thing was done to the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Positions times a factor.
    Scale,
    /// Positions negated.
    Sign,
    /// Positions and efforts negated.
    Axis,
    /// Positions from another zero.
    Zero,
    /// Time times a factor.
    Clock,
    /// Gravity of another size or direction.
    Gravity,
    /// Joints, positions or efforts under each other's names.
    Order,
}

impl Kind {
    /// What is then wrong.
    pub fn of_fault(self) -> FaultKind {
        match self {
            Kind::Scale => FaultKind::PositionScale,
            Kind::Sign => FaultKind::PositionSign,
            Kind::Axis => FaultKind::AxisSign,
            Kind::Zero => FaultKind::PositionZero,
            Kind::Clock => FaultKind::TimeScale,
            Kind::Gravity => FaultKind::Gravity,
            Kind::Order => FaultKind::JointOrder,
        }
    }
}

/// One account of the motion.
#[derive(Debug, Clone)]
pub(crate) struct Account {
    pub kind: Kind,
    /// Joints concerned.
    pub joints: Vec<usize>,
    /// How the log is undone.
    pub changes: Vec<Change>,
    /// Gravity, m/s², where it is another.
    pub gravity: Option<DVec3>,
    /// What was logged over what is true; the zero's place for zeros, rad or m.
    pub value: f64,
    /// Joints that lie far beyond their limits as logged, less those that do so under it.
    pub inside: i32,
    /// First look: the sum of the logarithms of what is left of each joint's effort. The lower the better.
    pub look: f64,
}

/// What the first look needs of the logs.
pub(crate) struct Scene<'a> {
    pub model: &'a Model,
    pub sample: &'a Sample,
    /// Joints whose effort says something.
    pub active: &'a [bool],
    /// Joints that move.
    pub moves: &'a [bool],
    /// Lowest and highest position.
    pub range: Vec<(f64, f64)>,
    /// Whether the steps of time are longer than those of any log.
    pub slow: bool,
    /// Speed measured over speed derived, where the log has a velocity that follows the motion.
    pub velocity: Option<f64>,
}

impl Scene<'_> {
    /// The account "as logged".
    pub fn as_logged(&self) -> f64 {
        self.look(self.model, self.sample, &self.range)
    }

    /// How little of the effort a sample leaves unexplained, whatever the gain of each joint.
    pub fn look(&self, model: &Model, sample: &Sample, range: &[(f64, f64)]) -> f64 {
        let torque = sample.torque(model);
        let left = |j: usize| first_look(&sample.effort[j], &torque[j], &sample.v[j]);
        (0..model.dof()).map(|j| if self.active[j] { left(j) } else { 0.0 } + BEYOND * beyond(model, j, range[j])).sum()
    }

    /// Whether the velocities that were measured speak for another clock, or may: they are all off, and by one factor.
    pub fn velocity_asks(&self) -> bool {
        self.velocity.is_some_and(|slope| slope.abs().ln().abs() > OTHER_CLOCK)
    }

    /// Whether they speak for a clock with so many seconds a true second: what a true velocity is then off by.
    pub fn velocity_says(&self, logged: f64) -> bool {
        self.velocity_asks() && self.velocity.is_some_and(|slope| (slope.abs() / logged).ln().abs() < AGREES)
    }

    /// The look of changed positions and time, and how many joints more are then within their limits.
    fn changed(&self, changes: &[Change]) -> (f64, i32) {
        let mut sample = self.sample.clone();
        let mut range = self.range.clone();
        let mut against = 0.0;
        for change in changes {
            apply(change, &mut sample);
            match change {
                Change::Position(j, factor, offset) => {
                    let (low, high) = range[*j];
                    let ends = [low * factor + offset, high * factor + offset];
                    range[*j] = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                }
                Change::Order(order, channels) if channels.contains(&Channel::Position) => {
                    range = order.iter().map(|&j| range[j]).collect();
                }
                Change::Clock(factor) if self.velocity.is_some() => {
                    against += if self.velocity_says(factor.recip()) { -AGAINST_VELOCITY } else { AGAINST_VELOCITY };
                }
                _ => {}
            }
        }
        (self.look(self.model, &sample, &range) + against, self.far(&self.range) - self.far(&range))
    }

    /// How many joints lie where they cannot be.
    pub fn far(&self, range: &[(f64, f64)]) -> i32 {
        (0..self.model.dof()).map(|j| i32::from(past(self.model, j, range[j]) > FAR)).sum()
    }

    fn account(&self, kind: Kind, joints: Vec<usize>, changes: Vec<Change>, value: f64) -> Account {
        let (look, inside) = self.changed(&changes);
        Account { kind, joints, changes, gravity: None, value, inside, look }
    }

    /// The best accounts, one or two of each kind.
    pub fn accounts(&self) -> Vec<Account> {
        let few = self.sample.thinned(self.sample.len().div_ceil(COARSE).max(1));
        let coarse = Scene { sample: &few, range: self.range.clone(), ..*self };
        let mut all = Vec::new();
        all.extend(self.scales(&coarse));
        all.extend(self.signs());
        all.extend(self.zeros(&coarse));
        all.extend(self.clocks(&coarse));
        all.extend(self.gravities());
        all.extend(order::orders(self.model, self.sample, self.active).into_iter().map(|(order, channels)| {
            let joints = (0..order.len()).filter(|&j| order[j] != j).collect();
            self.account(Kind::Order, joints, vec![Change::Order(order, channels)], 1.0)
        }));
        all.sort_by(|a, b| a.look.total_cmp(&b.look));
        all
    }

    /// Positions in another unit: each joint alone, and all of a kind together.
    fn scales(&self, coarse: &Scene) -> Vec<Account> {
        let prismatic = |j: usize| self.model.joints()[j].kind == JointKind::Prismatic;
        let mut groups: Vec<Vec<usize>> = (0..self.model.dof()).filter(|&j| self.moves[j]).map(|j| vec![j]).collect();
        for kind in [false, true] {
            let alike: Vec<usize> = (0..self.model.dof()).filter(|&j| prismatic(j) == kind && self.moves[j]).collect();
            if alike.len() > 1 {
                groups.push(alike);
            }
        }
        let mut best = Vec::new();
        for group in groups {
            let on = |scene: &Scene, logged: f64| {
                let changes = group.iter().map(|&j| Change::Position(j, 1.0 / logged, 0.0)).collect();
                scene.account(Kind::Scale, group.clone(), changes, logged)
            };
            let at = |logged: f64| on(self, logged);
            let grid = (0..65).map(|i| LEAST_GEAR * 1.115_f64.powi(i));
            let units = position_units(prismatic(group[0])).into_iter().map(|(_, factor)| factor);
            let looks = grid.chain(units).map(|logged| on(coarse, logged));
            let Some(found) = looks.min_by(|a, b| a.look.total_cmp(&b.look)).map(|found| at(found.value)) else {
                continue;
            };
            let fine = refined(found, 0.06, |value, step| value * (1.0 + step), &at);
            // A unit that has a name is that unit, where the fit does not deny it.
            let named = position_units(prismatic(group[0]))
                .into_iter()
                .map(|(_, factor)| at(factor))
                .filter(|named| (named.value / fine.value).ln().abs() < 0.1 && named.look < fine.look + 0.3)
                .min_by(|a, b| a.look.total_cmp(&b.look));
            best.push(named.unwrap_or(fine));
        }
        best
    }

    fn signs(&self) -> Vec<Account> {
        let moving: Vec<usize> = (0..self.model.dof()).filter(|&j| self.moves[j]).collect();
        let mut groups: Vec<Vec<usize>> = moving.iter().map(|&j| vec![j]).collect();
        if moving.len() > 1 {
            groups.push(moving);
        }
        let turned = |joints: Vec<usize>| {
            let position: Vec<Change> = joints.iter().map(|&j| Change::Position(j, -1.0, 0.0)).collect();
            let both = position.iter().cloned().chain(joints.iter().map(|&j| Change::Effort(j, -1.0))).collect();
            [self.account(Kind::Sign, joints.clone(), position, -1.0), self.account(Kind::Axis, joints, both, -1.0)]
        };
        groups.into_iter().flat_map(turned).collect()
    }

    fn zeros(&self, coarse: &Scene) -> Vec<Account> {
        let turning = |j: &usize| self.model.joints()[*j].kind != JointKind::Prismatic;
        let mut best = Vec::new();
        for j in (0..self.model.dof()).filter(turning) {
            let on = |scene: &Scene, zero: f64| {
                scene.account(Kind::Zero, vec![j], vec![Change::Position(j, 1.0, -zero)], zero)
            };
            let at = |zero: f64| on(self, zero);
            // With zero itself: a small offset is an effect, and competes as such.
            let grid = (-11..=12).map(|i| f64::from(i) * PI / 12.0);
            let looks = grid.map(|zero| on(coarse, zero));
            let Some(found) = looks.min_by(|a, b| a.look.total_cmp(&b.look)).map(|found| at(found.value)) else {
                continue;
            };
            let fine = refined(found, 0.12, |value, step| value + step, &at);
            // A right angle is a right angle.
            let square = at((fine.value / (PI / 2.0)).round() * PI / 2.0);
            let near = (square.value - fine.value).abs() < 0.06 && square.look < fine.look + 0.2 && square.value != 0.0;
            best.push(if near { square } else { fine });
        }
        best
    }

    fn clocks(&self, coarse: &Scene) -> Vec<Account> {
        let on = |scene: &Scene, logged: f64| {
            let mut account = scene.account(Kind::Clock, Vec::new(), vec![Change::Clock(1.0 / logged)], logged);
            account.look += GAIN * scene.gain_after(logged);
            account
        };
        let at = |logged: f64| on(self, logged);
        // Numbers of rows, or units of time, where no log of a robot is so slow.
        let most = if self.slow { 120 } else { 34 };
        let grid = (1..most).flat_map(|i| [1.1_f64.powi(i), 1.1_f64.powi(-i.min(34))]);
        let looks = grid.map(|logged| on(coarse, logged));
        let Some(found) = looks.min_by(|a, b| a.look.total_cmp(&b.look)).map(|found| at(found.value)) else {
            return vec![];
        };
        let fine = refined(found, 0.05, |value, step| value * (1.0 + step), &at);
        let named = CLOCKS
            .into_iter()
            .map(|(_, factor)| at(factor))
            .filter(|named| (named.value / fine.value).ln().abs() < 0.12 || self.slow)
            .filter(|named| named.look < fine.look + 0.3)
            .min_by(|a, b| a.look.total_cmp(&b.look));
        // A measured velocity that another clock would put right names that clock.
        let measured = self.velocity.map(f64::abs).filter(|slope| slope.ln().abs() > OTHER_CLOCK).map(at);
        let found = [Some(named.unwrap_or(fine)), measured].into_iter().flatten();
        found.filter(|account| self.slow || self.moves_under(account.value)).collect()
    }

    /// Whether the motion takes torque beside weight by another clock: one that leaves none explains by leaving the motion out.
    fn moves_under(&self, logged: f64) -> bool {
        let mut sample = self.sample.clone();
        apply(&Change::Clock(1.0 / logged), &mut sample);
        let (torque, weight) = (sample.torque(self.model), sample.weight(self.model));
        let part = |j: usize| {
            let inertia: Vec<f64> = torque[j].iter().zip(&weight[j]).map(|(all, weight)| all - weight).collect();
            crate::robust::rms(&inertia) / crate::robust::rms(&torque[j]).max(f64::MIN_POSITIVE)
        };
        (0..self.model.dof())
            .filter(|&j| self.active[j] && weight[j].iter().any(|x| *x != 0.0))
            .all(|j| part(j) > MOVES)
    }

    /// How far the gains of the joints lie from one on another clock: the median of their logarithms' sizes. Without gravity,
    /// nothing else tells a clock.
    fn gain_after(&self, logged: f64) -> f64 {
        let mut sample = self.sample.clone();
        apply(&Change::Clock(1.0 / logged), &mut sample);
        let torque = sample.torque(self.model);
        let far = |j: usize| {
            fit(&sample.effort[j], &torque[j], &sample.v[j], None).map_or(5.0, |fit| fit.gain.abs().ln().abs())
        };
        let mut all: Vec<f64> = (0..self.model.dof()).filter(|&j| self.active[j]).map(far).collect();
        crate::robust::median(&mut all).unwrap_or(0.0)
    }
}

/// How little of an effort a torque of any gain leaves beside a bias and friction that takes energy: the logarithm of its share,
/// squared, and more where the gain is negative.
fn first_look(effort: &[f64], torque: &[f64], speed: &[f64]) -> f64 {
    let slow = 0.1 * crate::robust::rms(speed);
    let dry: Vec<f64> = speed.iter().map(|v| if slow > 0.0 { (v / slow).tanh() } else { 0.0 }).collect();
    let without_mean = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
        x.iter().map(|x| x - mean).collect::<Vec<f64>>()
    };
    let rows = [&dry[..], speed, torque, effort].map(without_mean);
    let dot = |a: usize, b: usize| rows[a].iter().zip(&rows[b]).map(|(a, b)| a * b).sum::<f64>();
    let all = dot(3, 3);
    let raised = torque.iter().map(|x| x * x).sum::<f64>();
    if !(all > 0.0 && all.is_finite() && dot(2, 2) > 1e-6 * raised && raised.is_finite()) {
        return 0.0;
    }
    // Friction goes with the torque's gain or is none: every choice of its parts, the best that keeps to that.
    let choices: [&[usize]; 4] = [&[0, 1, 2], &[0, 2], &[1, 2], &[2]];
    let left = |columns: &&[usize]| {
        let normal = DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
            dot(columns[a], columns[b]) * if a == b { 1.0 + 1e-9 } else { 1.0 }
        });
        let right = DVector::from_fn(columns.len(), |a, _| dot(columns[a], 3));
        let found = normal.cholesky()?.solve(&right);
        let gain = found[columns.len() - 1];
        let takes = found.iter().all(|x| x * gain >= 0.0);
        let turned = if gain < 0.0 { TURNED } else { 0.0 };
        takes.then(|| ((all - found.dot(&right)).max(0.0) / all).max(FLOOR).ln() + turned)
    };
    choices.iter().filter_map(left).fold(0.0, f64::min)
}

/// Applies what concerns a sample.
pub(crate) fn apply(change: &Change, sample: &mut Sample) {
    match change {
        Change::Clock(factor) => {
            sample.v.iter_mut().flatten().for_each(|v| *v /= factor);
            sample.a.iter_mut().flatten().for_each(|a| *a /= factor * factor);
        }
        Change::Position(j, factor, offset) => {
            sample.q[*j].iter_mut().for_each(|q| *q = *q * factor + offset);
            sample.v[*j].iter_mut().chain(&mut sample.a[*j]).for_each(|x| *x *= factor);
        }
        Change::Effort(j, factor) => sample.effort[*j].iter_mut().for_each(|effort| *effort *= factor),
        Change::Order(order, channels) => {
            let sort = |table: &mut Vec<Vec<f64>>| *table = order.iter().map(|&j| table[j].clone()).collect();
            if channels.contains(&Channel::Position) {
                [&mut sample.q, &mut sample.v, &mut sample.a].into_iter().for_each(sort);
            }
            if channels.contains(&Channel::Effort) {
                sort(&mut sample.effort);
            }
        }
        _ => {}
    }
}

/// Moves an account's value to where its look is best.
fn refined(mut best: Account, mut step: f64, moved: impl Fn(f64, f64) -> f64, at: &impl Fn(f64) -> Account) -> Account {
    for _ in 0..12 {
        let around = [step, -step].map(|step| at(moved(best.value, step)));
        match around.into_iter().min_by(|a, b| a.look.total_cmp(&b.look)) {
            Some(better) if better.look < best.look - 1e-9 => best = better,
            _ => step *= 0.4,
        }
    }
    best
}

/// 1 where positions pass the limits by a good part of their span, 0 elsewhere.
fn beyond(model: &Model, j: usize, range: (f64, f64)) -> f64 {
    f64::from(u8::from(past(model, j, range) > 0.15))
}

/// How far positions pass a joint's limits, over their span; 0 where it has none.
fn past(model: &Model, j: usize, (low, high): (f64, f64)) -> f64 {
    let joint = &model.joints()[j];
    let limits = joint.limits.lower.zip(joint.limits.upper).filter(|_| joint.kind != JointKind::Continuous);
    limits
        .filter(|(lower, upper)| upper > lower)
        .map_or(0.0, |(lower, upper)| (lower - low).max(high - upper).max(0.0) / (upper - lower))
}
