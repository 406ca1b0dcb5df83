//! Adaptive integration: tolerance met, order of the dense output, agreement with fixed steps, honest failure.

use crate::common;

use common::{Draw, assert_close};
use gapscope_dynamics::{Adaptive, Discrete, DormandPrince, Integrator, StepError, StepModel};

fn circle(_: f64, x: &[f64], dx: &mut [f64]) {
    (dx[0], dx[1]) = (-x[1], x[0]);
}

#[test]
fn tighter_tolerances_are_met_with_more_steps() {
    let mut steps = 0;
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        let mut x = [1.0, 0.0];
        let more = DormandPrince::new(2, tolerance, tolerance).integrate(circle, [0.0, 10.0], &mut x, |_| {}).unwrap();
        let error = (x[0] - 10f64.cos()).hypot(x[1] - 10f64.sin());
        assert!(error < 30.0 * tolerance, "{tolerance:e}: {error:e}");
        assert!(more > steps);
        steps = more;
    }
}

#[test]
fn dense_output_stays_within_the_tolerance_and_joins_the_steps() {
    let (mut x, mut worst, mut end) = ([1.0, 0.0], 0f64, 0.0);
    DormandPrince::new(2, 1e-8, 1e-8)
        .integrate(circle, [0.0, 7.0], &mut x, |dense| {
            assert_eq!(dense.span[0], end);
            end = dense.span[1];
            for k in 0..=10 {
                let t = dense.span[0] + (dense.span[1] - dense.span[0]) * f64::from(k) / 10.0;
                let mut at = [0.0; 2];
                dense.at(t, &mut at);
                worst = worst.max((at[0] - t.cos()).hypot(at[1] - t.sin()));
            }
        })
        .unwrap();
    assert_eq!(end, 7.0);
    assert!(worst < 3e-7, "{worst:e}");
}

#[test]
fn time_dependence_is_seen_at_the_right_times() {
    let mut x = [0.0];
    DormandPrince::new(1, 1e-9, 1e-9)
        .integrate(|t, _, dx| dx[0] = 5.0 * t.powi(4), [1.0, 2.0], &mut x, |_| {})
        .unwrap();
    assert_close(&x, &[31.0], 1e-12);
}

#[test]
fn the_adaptive_step_is_the_limit_of_fixed_ones_and_remembers_nothing() {
    let mut draw = Draw::new(3);
    let model = draw.tree(3);
    let (x, tau) = (draw.numbers(6, 1.0), draw.numbers(3, 1.0));
    let mut adaptive = Adaptive::new(model.clone(), 0.1, 1e-11);
    let mut fixed = Discrete::new(model, 0.1 / 2000.0, Integrator::Rk4);
    let (mut a, mut b) = (x.clone(), x.clone());
    adaptive.step(&mut a, &tau);
    (0..2000).for_each(|_| fixed.step(&mut b, &tau));
    assert_close(&a, &b, 1e-9);
    adaptive.step(&mut [0.5; 6], &[9.0; 3]);
    let mut again = x.clone();
    adaptive.step(&mut again, &tau);
    assert_eq!(a, again);
}

#[test]
fn a_motion_that_blows_up_is_an_error_and_not_a_hang() {
    let mut x = [1.0];
    let blown = DormandPrince::new(1, 1e-8, 1e-8).integrate(|_, x, dx| dx[0] = x[0] * x[0], [0.0, 2.0], &mut x, |_| {});
    assert!(matches!(blown, Err(StepError::TooShort { time }) if (time - 1.0).abs() < 1e-3), "{blown:?}");
}
