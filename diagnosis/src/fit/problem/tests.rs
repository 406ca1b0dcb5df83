//! A problem with known columns.

use super::*;
use crate::fit::support;
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
        let all: Vec<usize> = (0..problem.bounds.len()).collect();
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
