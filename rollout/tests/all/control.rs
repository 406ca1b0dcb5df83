//! Controllers on models and plants: tracking, planning, promised and paid.

use gapscope_dynamics::{Model, StepModel, robots};
use gapscope_effects::{CoulombFriction, Effect, Payload, Plant};
use gapscope_rollout::control::{ComputedTorque, Controller, Ilqr, Mppi, MppiSettings, Task, run};

const DT: f64 = 0.01;

fn robot() -> Model {
    robots::model("double_pendulum").unwrap().unwrap().model
}

fn task() -> Task {
    Task::reach(&robot(), &[0.2, -0.3], &[1.2, 0.6], [0.8, 0.2], DT)
}

fn plant(effects: &[Effect]) -> Plant {
    Plant::new(&robot(), effects, DT).unwrap()
}

fn friction() -> Effect {
    Effect::CoulombFriction(CoulombFriction { coulomb: [("joint1".into(), 0.3), ("joint2".into(), 0.2)].into() })
}

fn payload() -> Effect {
    Effect::Payload(Payload {
        joint: "joint2".into(),
        mass: 0.4,
        com: [0.0, 0.0, -0.2],
        inertia: [0.001, 0.0, 0.001, 0.0, 0.0, 0.001],
    })
}

#[test]
fn computed_torque_tracks_on_the_model_it_inverts_even_out_of_dry_friction() {
    for effects in [vec![], vec![friction()], vec![payload(), friction()]] {
        let mut controller = ComputedTorque::new(plant(&effects), &robot(), &task(), [20.0, 1.0]);
        let own = run(&mut controller, &mut plant(&effects), &task());
        assert!(own.position_error < 2e-3, "{effects:?}: {}", own.position_error);
        let mut naive = ComputedTorque::new(plant(&[]), &robot(), &task(), [20.0, 1.0]);
        let paid = run(&mut naive, &mut plant(&effects), &task());
        assert!(effects.is_empty() || paid.position_error > 4.0 * own.position_error);
    }
}

#[test]
fn ilqr_lowers_the_cost_and_its_plan_costs_on_the_model_what_it_promised() {
    let task = Task { weights: [100.0, 1.0, 0.1], ..task() };
    let effects = [payload(), friction()];
    let mut first = ComputedTorque::new(plant(&effects), &robot(), &task, [20.0, 1.0]);
    let before = run(&mut first, &mut plant(&effects), &task).cost;
    let mut plan = Ilqr::new(plant(&effects), &task).plan(&mut first);
    let paid = run(&mut plan, &mut plant(&effects), &task).cost;
    assert!((plan.cost - paid).abs() < 1e-9 * paid, "{} {paid}", plan.cost);
    assert!(plan.cost < 0.95 * before, "{} {before}", plan.cost);
    // A wrong model promises less than it pays, and the right one pays less than the wrong one.
    let mut first = ComputedTorque::new(plant(&[]), &robot(), &task, [20.0, 1.0]);
    let mut wrong = Ilqr::new(plant(&[]), &task).plan(&mut first);
    let wrong_paid = run(&mut wrong, &mut plant(&effects), &task).cost;
    assert!(wrong.cost < wrong_paid && paid < wrong_paid, "{} {wrong_paid} {paid}", wrong.cost);
}

/// On a linear system with quadratic cost the optimum is known: one Newton step finds it, and no plan near it is better.
#[test]
fn ilqr_is_optimal_where_the_optimum_is_known() {
    struct Cart;
    impl StepModel for Cart {
        fn joints(&self) -> usize {
            1
        }
        fn dt(&self) -> f64 {
            0.1
        }
        fn step(&mut self, x: &mut [f64], tau: &[f64]) {
            x[0] += 0.1 * x[1];
            x[1] += 0.1 * tau[0];
        }
    }
    struct Still;
    impl Controller for Still {
        fn command(&mut self, _: usize, _: &[f64], tau: &mut [f64]) {
            tau.fill(0.0);
        }
    }
    let mut reference = vec![vec![1.0, 0.0]; 31];
    reference[0] = vec![0.0, 0.0];
    let task =
        Task { dt: 0.1, reference, effort: vec![vec![0.0]; 30], limit: vec![f64::INFINITY], weights: [1.0, 0.1, 0.01] };
    let plan = Ilqr::new(Cart, &task).plan(&mut Still);
    let found = run(&mut plan.clone(), &mut Cart, &task);
    struct Fixed(Vec<Vec<f64>>);
    impl Controller for Fixed {
        fn command(&mut self, step: usize, _: &[f64], tau: &mut [f64]) {
            tau.copy_from_slice(&self.0[step]);
        }
    }
    for k in [0, 7, 29] {
        for change in [-0.05, 0.05] {
            let mut efforts = found.efforts.clone();
            efforts[k][0] += change;
            let other = run(&mut Fixed(efforts), &mut Cart, &task).cost;
            assert!(other > found.cost, "step {k}: {other} {}", found.cost);
        }
    }
}

fn settings() -> MppiSettings {
    MppiSettings { samples: 256, horizon: 25, deviation: vec![0.6, 0.3], correlation: 0.8, temperature: 0.05, seed: 1 }
}

#[test]
fn mppi_tracks_and_is_the_same_whatever_the_number_of_cores() {
    let task = task();
    let planned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut planner = Mppi::new(|| plant(&[]), &task, settings());
            run(&mut planner, &mut plant(&[]), &task)
        })
    };
    let (one, two) = (planned(1), planned(2));
    assert_eq!(one, two);
    assert!(one.position_error < 0.03, "{}", one.position_error);
}

#[test]
fn mppi_with_the_right_model_pays_less_than_with_the_wrong_one() {
    let (task, effects) = (task(), [payload(), friction()]);
    let cost = |planned: &[Effect]| {
        let mut planner = Mppi::new(|| plant(planned), &task, settings());
        run(&mut planner, &mut plant(&effects), &task).cost
    };
    assert!(cost(&effects) < 0.7 * cost(&[]), "{} {}", cost(&effects), cost(&[]));
}
