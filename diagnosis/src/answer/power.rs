//! Power: the least size of each effect that the logs would have revealed beside the effects found.
//!
//! An effect of size θ along a direction φ of the problem lowers the deviance by θ² φᵀSφ, S being the information that the
//! chosen set and the alignment leave in its columns (a Schur complement of the normal equations). It is named where that
//! pays its cost of complexity, lies beyond the standard errors that pruning asks for, and moves some joint by as much
//! torque as anything must that is to be named.

use crate::fit::problem::Problem;
use crate::numbers::decide::TWENTY_TO_ONE;
use crate::schema::Power;
use crate::search::climb::{Competition, excludes};
use crate::search::drive::Least;
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::{Candidate, Effect, Gauge, Kind, Size};
use nalgebra::{DMatrix, DVector};

/// Part of a column's size below which what the set leaves of it is rounding.
const ROUNDING: f64 = 1e-7;

/// The least size of every effect at every joint; kinds in the order of the catalogue. The knob of an effect that has one,
/// where it is not the size itself, is that in the middle of its grid. Those of springs and play in the `drives` are known.
pub fn power(model: &Model, problem: &Problem, set: &[usize], drives: &[Least]) -> Vec<Power> {
    let mut places: Vec<(usize, &[usize])> = Vec::new();
    for entry in &problem.entries {
        if let Some(order) = Kind::ALL.iter().position(|kind| *kind == entry.candidate.kind) {
            places.push((order, &entry.candidate.joints));
        }
    }
    places.sort();
    places.dedup();
    let competition = Competition::new(problem);
    let linear =
        places.into_iter().flat_map(|(order, joints)| sizes(model, &competition, set, Kind::ALL[order], joints));
    let mut power: Vec<Power> = linear.chain(drives.iter().map(|least| of_drive(model, least))).collect();
    power.sort_by_key(|power| Kind::ALL.iter().position(|kind| kind.name() == power.kind));
    power
}

/// The least spring or play in a drive.
fn of_drive(model: &Model, Least { kind, joint, drive }: &Least) -> Power {
    let joints = [*joint];
    let (parameter, units) = kind.card().turning.map_or(("", [""; 2]), |turning| turning.parameter);
    let value =
        |effect: Effect| effect.law().parameters().into_iter().find(|v| v.name == parameter)?.value.first().copied();
    let size = drive.as_ref().and_then(|(drive, rotor)| drive.effects(model, &[*rotor]).into_iter().find_map(value));
    named(model, *kind, &joints, parameter, size, unit(model, &joints, units))
}

fn named(model: &Model, kind: Kind, joints: &[usize], parameter: &str, size: Option<f64>, unit: &str) -> Power {
    Power {
        kind: kind.name().to_owned(),
        joints: joints.iter().map(|&j| model.joints()[j].name.clone()).collect(),
        parameter: parameter.to_owned(),
        size: size.filter(|size| size.is_finite()),
        unit: unit.to_owned(),
    }
}

/// The least sizes of one kind at one place.
fn sizes(model: &Model, competition: &Competition<'_>, set: &[usize], kind: Kind, joints: &[usize]) -> Vec<Power> {
    let problem = competition.problem;
    let mut here: Vec<usize> = (0..problem.entries.len())
        .filter(|&c| problem.entries[c].candidate.kind == kind && problem.entries[c].candidate.joints == joints)
        .collect();
    here.sort_by(|&a, &b| problem.entries[a].candidate.shape.total_cmp(&problem.entries[b].candidate.shape));
    let Some(&first) = here.first() else { return Vec::new() };
    let named = |parameter, size, unit| named(model, kind, joints, parameter, size, unit);
    let card = kind.card();
    if let Size::Knob(parameter, units) = card.size {
        // The knob is the size: the greatest limit of the grid that cuts enough away.
        let seen = |&&c: &&usize| least(competition, set, c, &[1.0], false).is_some_and(|least| least <= 1.0);
        let limit = here.iter().rev().find(seen).map(|&c| problem.entries[c].candidate.shape);
        return vec![named(parameter, limit, unit(model, joints, units))];
    }
    // A late effort is linear about no delay; a knob that is a choice is no size.
    let late = card.is_late();
    let c = if late || card.is_chosen() { first } else { here[here.len() / 2] };
    let candidate = &problem.entries[c].candidate;
    let point = point_mass(model, candidate);
    let gauges: &[Gauge] = match card.size {
        Size::Along(gauges) => gauges,
        Size::PointMass(parameter) => &[Gauge { parameter, nothing: 0.0, direction: &point, beside_others: false }],
        Size::Knob(..) | Size::Unasked => &[],
    };
    (gauges.iter())
        .map(|gauge| {
            let theta = least(competition, set, c, gauge.direction, gauge.beside_others)
                // The alignment takes up half a sample of any delay.
                .map(|theta| if late { theta + problem.bounds[0].1 } else { theta });
            let coefficients: Vec<f64> = gauge.direction.iter().map(|x| x * theta.unwrap_or(1.0)).collect();
            let effects = candidate.effects(model, &coefficients);
            let effect = effects.iter().find(|effect| effect.kind() == kind);
            let value = effect.and_then(|e| e.law().parameters().into_iter().find(|v| v.name == gauge.parameter));
            let size = theta.and(value.as_ref()).and_then(|v| Some((v.value.first()? - gauge.nothing).abs()));
            named(gauge.parameter, size, value.map_or("", |v| unit(model, joints, [v.unit, v.unit_prismatic])))
        })
        .collect()
}

fn unit(model: &Model, joints: &[usize], [turning, sliding]: [&'static str; 2]) -> &'static str {
    let slides = joints.first().is_some_and(|&j| model.joints()[j].kind == JointKind::Prismatic);
    if slides { sliding } else { turning }
}

/// A kilogram at the centre of mass of a candidate's link, in the ten inertial parameters.
fn point_mass(model: &Model, candidate: &Candidate) -> [f64; 10] {
    let center = candidate.joints.first().and_then(|&j| model.joints()[j].inertia.center_of_mass());
    let [x, y, z] = center.unwrap_or_default().to_array();
    [1.0, x, y, z, y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y]
}

/// The least multiple of a direction of a candidate's coefficients at which the selection names it beside a set; `None`
/// where the logs do not show it.
fn least(
    competition: &Competition<'_>,
    set: &[usize],
    c: usize,
    direction: &[f64],
    beside_others: bool,
) -> Option<f64> {
    let problem = competition.problem;
    let others: Vec<usize> = set.iter().copied().filter(|&other| other != c && !excludes(problem, other, c)).collect();
    let with: Vec<usize> = others.iter().copied().chain([c]).collect();
    let own: Vec<usize> = problem.entries[c].columns.clone().collect();
    let base: Vec<usize> = problem.columns(&with).into_iter().filter(|column| !own.contains(column)).collect();
    let gram = problem.gram(&own, &own);
    let information = &gram - explained(problem, &base, &own);
    let mut direction = DVector::from_column_slice(direction);
    if beside_others {
        let fixed = direction.imax();
        let free: Vec<usize> = (0..own.len()).filter(|&i| i != fixed).collect();
        let inner = DMatrix::from_fn(free.len(), free.len(), |i, j| information[(free[i], free[j])]);
        let cross = DVector::from_fn(free.len(), |i, _| information[(free[i], fixed)]);
        let answer = inner.cholesky()?.solve(&cross);
        free.iter().zip(answer.iter()).for_each(|(&i, x)| direction[i] = -x);
    }
    let gain = direction.dot(&(&information * &direction));
    if gain.is_nan() || gain <= ROUNDING * direction.dot(&(&gram * &direction)) {
        return None;
    }
    let price = competition.prior(&others) - competition.prior(&with) + problem.occam(&own, &information);
    // Half of the deviance is a nat.
    Some((2.0 * price.max(TWENTY_TO_ONE.get()) / gain).sqrt())
}

/// The part of some columns' inner products that others explain.
fn explained(problem: &Problem, base: &[usize], own: &[usize]) -> DMatrix<f64> {
    let mut inner = problem.gram(base, base);
    for i in 0..base.len() {
        inner[(i, i)] = inner[(i, i)] * (1.0 + ROUNDING) + f64::MIN_POSITIVE.sqrt();
    }
    let cross = problem.gram(base, own);
    let nothing = DMatrix::zeros(own.len(), own.len());
    inner.cholesky().map_or(nothing, |factor| cross.tr_mul(&factor.solve(&cross)))
}
