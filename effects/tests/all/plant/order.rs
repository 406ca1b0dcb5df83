//! Order of the step.

use super::*;

/// Ratio of the errors at dt and dt/2 after 0.2 s, positions and velocities apart.
fn error_ratios(truth: &[f64], mut after: impl FnMut(f64) -> Vec<f64>) -> [f64; 2] {
    let n = truth.len() / 2;
    let (whole, half) = (after(1.0), after(0.5));
    let size =
        |x: &[f64], of: std::ops::Range<usize>| -> f64 { of.map(|i| (x[i] - truth[i]).powi(2)).sum::<f64>().sqrt() };
    [0..n, n..2 * n].map(|of| {
        let (whole, half) = (size(&whole, of.clone()), size(&half, of));
        assert!(whole > 1e-11, "the error {whole:e} is above rounding");
        whole / half
    })
}

#[test]
fn the_step_is_of_second_order_against_runge_kutta_of_the_rigid_robot() {
    const DT: f64 = 1e-3;
    for name in ["double_pendulum", "arm6", "arm7"] {
        let mut draw = Draw::new(4);
        let model = robot(name);
        let n = model.dof();
        let (q, v) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0));
        // Against gravity, so that the arm does not fall too fast.
        let mut tau = vec![0.0; n];
        model.gravity_torque(&mut Data::new(&model), &q, &mut tau);
        let truth = run(&mut Discrete::new(model.clone(), 1e-4, Integrator::Rk4), &q, &v, &tau, 2000);
        let ratios = error_ratios(&truth, |part| {
            let steps = (0.2 / (DT * part)).round() as usize;
            run(&mut Plant::nominal(&model, DT * part), &q, &v, &tau, steps)
        });
        for ratio in ratios {
            assert!((3.7..4.3).contains(&ratio), "{name}: halving dt divides the error by {ratio}");
        }
    }
}

#[test]
fn the_step_is_of_second_order_with_every_smooth_effect() {
    const DT: f64 = 1e-3;
    for seed in 0..8 {
        let (tree, mut draw) = calm_tree(seed, 2 + seed as usize % 5);
        let n = tree.dof();
        let mut effects = one_of_each(&mut draw, &tree);
        effects.retain(|e| !matches!(e, Effect::CoulombFriction(_)));
        for effect in &mut effects {
            if let Effect::JointCoupling(coupling) = effect {
                coupling.coulomb = 0.0;
            }
        }
        let sets: Vec<Vec<Effect>> = effects.iter().map(|e| vec![e.clone()]).chain([effects.clone()]).collect();
        for effects in sets {
            let (q, v, tau) = (draw.numbers(n, 1.0), draw.numbers(n, 0.5), draw.numbers(n, 3.0));
            let truth = Reference::new(&tree, &effects).runge_kutta(&q, &v, &tau, 2e-4, 1000);
            let ratios = error_ratios(&truth, |part| {
                let steps = (0.2 / (DT * part)).round() as usize;
                run(&mut Plant::new(&tree, &effects, DT * part).unwrap(), &q, &v, &tau, steps)
            });
            for ratio in ratios {
                assert!((3.6..4.4).contains(&ratio), "seed {seed}, {effects:?}: {ratio}");
            }
        }
    }
}

/// While nothing reverses, dry friction is a constant and the step keeps its order.
#[test]
fn dry_friction_in_one_direction_keeps_second_order() {
    let model = robot("double_pendulum");
    let effects = [coulomb(on_all(&model, || 0.05))];
    let (q, v, tau) = ([0.4, 0.6], [1.0, 8.0], [0.0, 0.0]);
    let steps = 500;
    let truth = Reference::new(&model, &effects).runge_kutta(&q, &v, &tau, 0.1 / steps as f64, steps);
    assert!(truth[2] > 0.1 && truth[3] > 0.1, "both joints still turn the way they did: {truth:?}");
    let ratios = error_ratios(&truth, |part| {
        let dt = 1e-3 * part;
        run(&mut Plant::new(&model, &effects, dt).unwrap(), &q, &v, &tau, (0.1 / dt).round() as usize)
    });
    assert!(ratios.iter().all(|r| (3.7..4.3).contains(r)), "{ratios:?}");
}
