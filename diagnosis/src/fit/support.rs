//! A problem for tests.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::fit::terms::Term;
use crate::record::band::Band;
use crate::record::data::Data;
use crate::record::known::Known;
use crate::record::signals::{Signals, standstill};
use gapscope_datasets::{Recipe, generate};
use gapscope_dynamics::{Model, robots};
use gapscope_effects::{Candidate, Effect, Kind};

/// A kind fitted to the first joint of a double pendulum, of logs to which something is done.
pub(crate) fn fitted(kind: Kind, done: impl Fn(&mut Signals)) -> (Vec<Signals>, Band, Problem, Fit) {
    fitted_as(vec![Candidate::new(kind, vec![0])], done)
}

/// The same of some candidates.
pub(crate) fn fitted_as(candidates: Vec<Candidate>, done: impl Fn(&mut Signals)) -> (Vec<Signals>, Band, Problem, Fit) {
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let mut signals = logs(&model, &[]);
    signals.iter_mut().for_each(done);
    let (band, problem, fit) = on_data(&model, &signals, |data| {
        let terms: Vec<Term> = candidates.into_iter().map(|candidate| Term { candidate, tangent_at: None }).collect();
        let all: Vec<usize> = (0..terms.len()).collect();
        let mut problem = data.problem(terms, &Kind::ALL);
        problem.split(data.band);
        let fit = Fit::on_all(&problem, &all);
        (data.band.clone(), problem, fit)
    });
    (signals, band, problem, fit)
}

/// Three logs of a robot with some effects.
pub(crate) fn logs(model: &Model, effects: &[Effect]) -> Vec<Signals> {
    let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
    (1..4).map(|seed| Signals::new(model, &generate(model, effects, seed, &recipe, "log").unwrap()).unwrap()).collect()
}

/// What is made of the data of some logs whose joints all move, with noise of a thousandth.
pub(crate) fn on_data<T>(model: &Model, signals: &[Signals], make: impl FnOnce(&Data<'_>) -> T) -> T {
    let n = model.dof();
    make(&Data {
        model,
        signals,
        band: &Band::new(signals),
        standstill: &standstill(signals, n),
        moving: &vec![true; n],
        noise: &vec![1e-3; n],
        known: &Known::default(),
    })
}

/// Torque on the first joint, from its velocity.
pub(crate) fn torque(law: fn(f64) -> f64) -> impl Fn(&mut Signals) {
    move |s| s.tau[0].iter_mut().zip(&s.v[0]).for_each(|(tau, v)| *tau += law(*v))
}
