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
