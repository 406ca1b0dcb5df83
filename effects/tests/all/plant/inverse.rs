//! Forward and inverse.

use super::*;

#[test]
fn forward_and_inverse_agree_for_each_effect_and_for_all_together() {
    const DT: f64 = 1e-6;
    let mut draw = Draw::new(1);
    for seed in 0..12 {
        let tree = draw.tree(1 + seed % 7);
        let model = rubbing(&mut draw, &tree);
        let n = model.dof();
        let each = one_of_each(&mut draw, &model);
        let sets: Vec<Vec<Effect>> = each.iter().map(|e| vec![e.clone()]).chain([vec![], each.clone()]).collect();
        for effects in sets {
            let mut reference = Reference::new(&model, &effects);
            let mut plant = Plant::new(&model, &effects, DT).unwrap();
            let (q, v) = moving_state(&mut draw, &reference, n, 0.1);
            let tau = draw.numbers(n, 30.0);
            let truth = reference.acceleration(&q, &v, &tau);
            let inverse = inverse_acceleration(&mut plant, &q, &v, &tau, &vec![0.05; n]);
            assert_close(&inverse, &truth, 1e-8);
            let x = run(&mut plant, &q, &v, &tau, 1);
            let forward: Vec<f64> = (0..n).map(|j| (x[n + j] - v[j]) / DT).collect();
            // The step's mean acceleration: half a step away from the state, and rounded by 1e-16 / DT.
            assert_close(&forward, &truth, 2e-3);
            let (half_q, half_v): (Vec<f64>, Vec<f64>) =
                (0..n).map(|j| (0.5 * (q[j] + x[j]), 0.5 * (v[j] + x[n + j]))).unzip();
            assert_close(&forward, &reference.acceleration(&half_q, &half_v, &tau), 1e-7);
        }
    }
}

/// Below standstill dry friction takes up what it can hold, and no more.
#[test]
fn the_residual_at_standstill_is_what_dry_friction_cannot_hold() {
    let model = slider();
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), 3.0)].into())], 1e-3).unwrap();
    for (effort, rest) in [(0.0, 0.0), (2.9, 0.0), (-2.9, 0.0), (3.5, 0.5), (-7.0, -4.0)] {
        for speed in [0.0, 0.009, -0.009] {
            let mut residual = [f64::NAN];
            plant.residual(&[0.0], &[speed], &[0.0], &[effort], &[0.01], &mut residual);
            assert!((residual[0] - rest).abs() < 1e-12, "{effort} N at {speed} m/s leaves {}", residual[0]);
        }
        let mut residual = [f64::NAN];
        plant.residual(&[0.0], &[-0.02], &[0.0], &[effort], &[0.01], &mut residual);
        assert!((residual[0] - (effort + 3.0)).abs() < 1e-12, "in motion friction has one value");
    }
}
