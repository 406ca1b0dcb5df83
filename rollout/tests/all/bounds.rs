//! The bounds hold where the constants are known, step by step, and in their order.

use gapscope_dynamics::{Discrete, Integrator, Model, StepModel, robots};
use gapscope_effects::{Effect, Plant, ViscousFriction};
use gapscope_rollout::{Norm, Region, bounds, geometric, lipschitz_constant};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// x ↦ A x + B τ + c sin x on two joints: Lipschitz in the Euclidean norm with ‖A‖ + c.
#[derive(Clone)]
struct Known {
    matrix: DMatrix<f64>,
    bend: f64,
}

impl StepModel for Known {
    fn joints(&self) -> usize {
        2
    }
    fn dt(&self) -> f64 {
        0.1
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let next = &self.matrix * DVector::from_column_slice(x);
        for i in 0..4 {
            x[i] = next[i] + self.bend * x[i].sin() + 0.1 * tau[i % 2];
        }
    }
}

fn known(entries: &[f64], norm: f64, bend: f64) -> Known {
    let matrix = DMatrix::from_row_slice(4, 4, entries);
    let size = matrix.singular_values().max().max(1e-9);
    Known { matrix: matrix * (norm / size), bend }
}

/// The truth: another map of the same kind with a shift, from the same start.
fn truth(model: &Known, shift: f64, steps: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let efforts: Vec<Vec<f64>> = (0..steps).map(|k| vec![(0.7 * k as f64).sin(), (0.4 * k as f64).cos()]).collect();
    let mut states = vec![vec![0.3, -0.2, 0.5, 0.1]];
    for tau in &efforts {
        let mut next = states.last().unwrap().clone();
        model.clone().step(&mut next, tau);
        next.iter_mut().enumerate().for_each(|(i, x)| *x += shift * (1.0 + i as f64).cos());
        states.push(next);
    }
    (states, efforts)
}

proptest! {
    #[test]
    fn the_bound_holds_on_maps_with_known_constants(
        entries in prop::collection::vec(-1.0..1.0_f64, 16),
        norm in 0.2..1.3_f64,
        bend in 0.0..0.3_f64,
        shift in 1e-4..1e-2_f64,
    ) {
        let mut model = known(&entries, norm, bend);
        let (states, efforts) = truth(&model, shift, 30);
        let horizons: Vec<usize> = (1..=30).collect();
        let euclid = Norm::weighted(&[1.0; 4]);
        let found = bounds(&mut model, &states, &efforts, &horizons, &euclid).unwrap();
        let (lipschitz, room) = (norm + bend, 1.0 + 1e-6);
        prop_assert!(found.lipschitz <= lipschitz * room);
        let delta = found.delta.iter().copied().fold(0.0, f64::max);
        for (i, &k) in found.horizons.iter().enumerate() {
            prop_assert!(found.truth[i] <= geometric(delta, lipschitz, k) * room);
            prop_assert!(found.truth[i] <= found.tight[i] * room);
            prop_assert!(found.tight[i] <= found.local[i] * room);
            prop_assert!(found.local[i] <= found.loose[i] * room);
        }
    }

    /// e_{k+1} ≤ L e_k + δ, and the closed form obeys the same recursion: the step of the proof.
    #[test]
    fn the_induction_step_holds(
        entries in prop::collection::vec(-1.0..1.0_f64, 16),
        norm in 0.2..1.3_f64,
        bend in 0.0..0.3_f64,
        shift in 1e-4..1e-2_f64,
        lipschitz in prop_oneof![Just(1.0), 0.0..2.0_f64, 1.0 - 1e-9..1.0 + 1e-9_f64],
    ) {
        let mut model = known(&entries, norm, bend);
        let (states, efforts) = truth(&model, shift, 20);
        let horizons: Vec<usize> = (1..=20).collect();
        let found = bounds(&mut model, &states, &efforts, &horizons, &Norm::weighted(&[1.0; 4])).unwrap();
        let mut error = 0.0;
        for k in 0..20 {
            prop_assert!(found.truth[k] <= (norm + bend) * error + found.delta[k] + 1e-12);
            error = found.truth[k];
        }
        for k in 0..40 {
            let (now, next) = (geometric(shift, lipschitz, k), geometric(shift, lipschitz, k + 1));
            prop_assert!((next - (lipschitz * now + shift)).abs() <= 1e-9 * next.max(shift));
        }
    }
}

#[test]
fn a_constant_of_one_adds_up() {
    assert_eq!(geometric(0.5, 1.0, 7), 3.5);
    assert!((geometric(0.5, 1.0 + 1e-13, 7) - 3.5).abs() < 1e-12);
    assert_eq!(geometric(0.5, 0.0, 7), 0.5);
    assert!((geometric(0.5, 2.0, 3) - 3.5).abs() < 1e-14);
}

#[test]
fn the_maps_own_constant_is_found_by_sampling() {
    let model = known(&[0.3; 16], 0.9, 0.2);
    let region = Region { state: vec![[-0.3, 0.3]; 4], effort: vec![[-1.0, 1.0]; 2] };
    let found = lipschitz_constant(|| model.clone(), &region, &Norm::weighted(&[1.0; 4]), 400, 3);
    assert!(found <= 1.1 + 1e-6 && found > 1.08, "{found}");
    let again = lipschitz_constant(|| model.clone(), &region, &Norm::weighted(&[1.0; 4]), 400, 3);
    assert_eq!(found, again);
}

fn arm() -> Model {
    robots::model("arm7").unwrap().unwrap().model
}

#[test]
fn on_an_arm_the_bounds_come_in_their_order_and_less_damping_missed_means_less_error() {
    let model = arm();
    let friction = |b: f64| {
        let viscous = model.joints().iter().map(|j| (j.name.clone(), b)).collect();
        Plant::new(&model, &[Effect::ViscousFriction(ViscousFriction { viscous })], 0.002).unwrap()
    };
    let mut robot = friction(1.0);
    let mut x = vec![0.0; 14];
    robot.start(&[0.1, -0.5, 0.2, -1.9, 0.1, 1.5, 0.3], &[0.4, 0.3, -0.5, 0.6, 0.2, -0.4, 0.5], &mut x);
    let (mut states, mut efforts) = (vec![x.clone()], vec![]);
    let mut data = gapscope_dynamics::Data::new(&model);
    for _ in 0..100 {
        let mut tau = vec![0.0; 7];
        model.gravity_torque(&mut data, &x[..7], &mut tau);
        robot.step(&mut x, &tau);
        states.push(x.clone());
        efforts.push(tau);
    }
    let norm = Norm::with_time(7, 0.1);
    let mut last = f64::INFINITY;
    for b in [0.0, 0.9] {
        let found = bounds(&mut friction(b), &states, &efforts, &[1, 10, 50, 100], &norm).unwrap();
        for i in 0..4 {
            assert!(found.truth[i] <= found.tight[i] * (1.0 + 1e-6));
            assert!(found.tight[i] <= found.local[i] * (1.0 + 1e-9) && found.local[i] <= found.loose[i] * (1.0 + 1e-9));
        }
        assert!((found.truth[0] - found.delta[0]).abs() < 1e-12);
        assert!(found.truth[3] < 0.3 * last);
        last = found.truth[3];
    }
    // Rigid-body Euler steps have a constant near one in this norm, not below it: dt/T couples velocity to position.
    let region = Region::around(&states, &efforts);
    let rigid = || Discrete::new(arm(), 0.002, Integrator::SemiImplicitEuler);
    let constant = lipschitz_constant(rigid, &region, &norm, 64, 1);
    assert!(constant > 1.0 && constant < 1.5, "{constant}");
}
