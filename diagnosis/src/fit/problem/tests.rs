//! A problem with known columns.

use super::*;
use crate::fit::estimate::Fit;
use crate::fit::support;
use crate::record::data::Data;
use crate::record::signals::standstill;
use gapscope_effects::Kind;

#[test]
fn known_columns_are_those_of_a_problem_without_them() {
    let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
    let (signals, band, ..) = support::fitted(Kind::CoulombFriction, |_| {});
    let (still, moving) = (standstill(&signals, 2), [true; 2]);
    let known = Known::new(&model, &signals, &band, &still, &moving);
    let terms: Vec<Term> =
        Candidate::all(&model).into_iter().map(|candidate| Term { candidate, tangent_at: None }).collect();
    assert!(terms.iter().filter(|term| known.of(&term.candidate).is_some()).count() > 10);
    let gram = |known: &Known| {
        let terms = terms.clone();
        let mut problem = Problem::new(&model, &signals, &band, &still, &moving, terms, known);
        problem.weigh(&band, &[]);
        let all = problem.all_columns();
        problem.gram(&all, &all)
    };
    let (with, without) = (gram(&known), gram(&Known::default()));
    assert!(without.norm() > 0.0 && (with - &without).norm() < 1e-12 * without.norm());
}

/// A load that never changes says nothing of how exact a law is: a bias takes it up.
#[test]
fn a_constant_effort_does_not_make_a_joint_more_tolerant() {
    let scale = |bias: f64| {
        let (.., problem, _) = support::fitted(Kind::CoulombFriction, |s| s.tau[0].iter_mut().for_each(|t| *t += bias));
        problem.scale
    };
    let (plain, biased) = (scale(0.0), scale(1e3));
    assert!(plain.iter().zip(&biased).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{plain:?} {biased:?}");
}

/// A column is what its coefficient takes of the logged effort, whatever was found beside it: the slope of the plant. Columns of
/// the torque itself are off by a quarter behind this gain, and by a fifth behind this gear.
#[test]
fn columns_are_slopes_of_the_plant_behind_gears_and_drives() {
    let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
    let signals = support::logs(&model, &[]);
    let found = [
        (Kind::TorqueGainError, 0.25),
        (Kind::LoadDependentFriction, 0.2),
        (Kind::TorqueBias, 1.5),
        (Kind::CoulombFriction, 2.0),
        (Kind::ViscousFriction, 1.0),
        (Kind::Armature, 0.2),
    ];
    let terms: Vec<Term> = found
        .iter()
        .flat_map(|(kind, _)| (0..2).map(|j| Candidate::new(*kind, vec![j])))
        .chain([Candidate::new(Kind::Payload, vec![1])])
        .map(|candidate| Term { candidate, tangent_at: None })
        .collect();
    support::on_data(&model, &signals, |data| {
        let problem = data.problem(terms.clone(), &Kind::ALL);
        let mut fit = Fit::on_all(&problem, &(0..terms.len()).collect::<Vec<_>>());
        let own = found.iter().flat_map(|(_, theta)| [*theta; 2]);
        let payload = [2.0, 0.2, 0.1, 0.3, 0.2, 0.0, 0.2, 0.0, 0.0, 0.2];
        fit.theta = std::iter::once(0.0).chain(own).chain(payload).collect();
        let loaded = data.loaded(&problem, &fit).unwrap();
        let data = Data { signals: &loaded, ..*data };
        let problem = data.problem(terms.clone(), &Kind::ALL);
        for (place, &column) in fit.columns.iter().enumerate().skip(1) {
            let step = 1e-4;
            let rest = |step: f64| {
                let mut moved = fit.clone();
                moved.theta[place] += step;
                data.rest(&problem, &moved).unwrap()
            };
            let (more, less) = (rest(step), rest(-step));
            let (mut square, mut off) = (0.0, 0.0);
            for (j, rows) in problem.joints.iter().enumerate() {
                let slope: Vec<f64> = (0..signals.len())
                    .flat_map(|e| {
                        let by = |(more, less): (&f64, &f64)| (less - more) / (2.0 * step);
                        let slope: Vec<f64> = more[e][j].iter().zip(&less[e][j]).map(by).collect();
                        data.band.filter_where(e, &loaded[e].slides(j, data.standstill[j]), &slope)
                    })
                    .map(|x| x.unwrap_or(0.0))
                    .collect();
                let told = rows.predict(&[column], &[1.0]);
                for (told, &row) in told.iter().zip(&rows.rows) {
                    square += slope[row].powi(2);
                    off += (told - slope[row]).powi(2);
                }
            }
            let kind = problem.entries.iter().find(|e| e.columns.contains(&column)).map(|e| e.candidate.kind);
            // A row about a reversal of the load is a mean of two slopes, and in this plane some moments have no torque.
            assert!(
                off < 0.05f64.powi(2) * square + 1e-9,
                "{kind:?} {column}: {} of {} off",
                off.sqrt(),
                square.sqrt()
            );
        }
    });
}
