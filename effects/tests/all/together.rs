//! Effects together: the plant stays finite, friction makes no energy, and a step allocates nothing.

use crate::support;

use gapscope_dynamics::{Data, StepModel, robots};
use gapscope_effects::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use support::{DT, Run, all};

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Every effect on each of some joints; robot-wide ones and the coupling once.
fn everything(joints: &[&str]) -> Vec<Effect> {
    let once = [
        Kind::GravityMisalignment,
        Kind::ActuationDelay,
        Kind::ActuatorLag,
        Kind::ExternalContact,
        Kind::JointCoupling,
    ];
    let mut effects = all(joints[0]);
    for joint in &joints[1..] {
        effects.extend(all(joint).into_iter().filter(|e| !once.contains(&e.kind())));
    }
    effects
}

#[test]
fn with_every_effect_at_once_a_servo_holds_the_arm_for_20_s() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let n = model.dof();
    for (seed, motor) in [(1, false), (2, true)] {
        let mut run = Run::new(&model, &everything(&["joint1", "joint3", "joint6"]), DT);
        if motor {
            run.plant = run.plant.with_motor_encoders();
        }
        let mut random = Pcg64::seed_from_u64(seed);
        let mut data = Data::new(&model);
        let mut goal = [0.0, -1.2, 1.1, -1.0, 0.8, 0.3];
        run.plant.start(&goal, &[0.0; 6], &mut run.x);
        let (mut tau, mut wanted) = ([0.0; 6], [0.0; 6]);
        for k in 0..10_000 {
            if k % 300 == 0 {
                goal.iter_mut().for_each(|g| *g += random.random_range(-0.3..0.3));
            }
            for j in 0..n {
                wanted[j] = 100.0 * (goal[j] - run.x[j]) - 20.0 * run.x[n + j] + random.random_range(-5.0..5.0);
            }
            let (q, v) = run.x[..2 * n].split_at(n);
            model.inverse_dynamics(&mut data, q, v, &wanted, &mut tau);
            run.step(&tau);
            assert!(run.x.iter().all(|x| x.is_finite()), "step {k}");
            assert!(run.x[n..2 * n].iter().all(|v| v.abs() < 30.0), "step {k}: {:?}", &run.x[n..2 * n]);
        }
    }
}

#[test]
fn a_step_and_a_residual_allocate_nothing() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let mut run = Run::new(&model, &everything(&["joint1", "joint4"]), DT);
    let tau = [1.0; 6];
    run.plant.start_at(1.2, &[0.1; 6], &[0.0; 6], &mut run.x);
    let before = COUNT.with(Cell::get);
    for _ in 0..20 {
        run.plant.step(&mut run.x, &tau);
    }
    let mut rest = [0.0; 6];
    run.plant.residual(&[0.1; 6], &[0.2; 6], &[0.3; 6], &tau, &[1e-3; 6], &mut rest);
    assert_eq!(COUNT.with(Cell::get) - before, 0, "allocations");
    assert!(rest.iter().all(|r| r.is_finite()));
}

#[test]
fn the_same_state_and_effort_give_the_same_step() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let mut run = Run::new(&model, &everything(&["joint1", "joint5"]), DT);
    for k in 0..200 {
        let tau: Vec<f64> = (0..6).map(|j| (0.1 * f64::from(k) + f64::from(j)).sin()).collect();
        let mut again = run.x.clone();
        run.step(&tau);
        run.plant.clone().step(&mut again, &tau);
        assert_eq!(run.x, again);
    }
}

#[test]
fn friction_only_ever_takes_energy() {
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    // Free of friction the rule itself keeps energy to within this, as the first round shows.
    let own_error = 3e-3;
    let friction = [
        Kind::ViscousFriction,
        Kind::CoulombFriction,
        Kind::StribeckFriction,
        Kind::PreslidingFriction,
        Kind::ThermalDrift,
        Kind::JointCoupling,
    ];
    let rounds = [None].into_iter().chain(friction.map(Some));
    for kind in rounds {
        let effects: Vec<Effect> = all("joint1").into_iter().filter(|e| Some(e.kind()) == kind).collect();
        let mut run = Run::new(&model, &effects, DT);
        run.plant.start(&[1.5, -1.0], &[2.0, -3.0], &mut run.x);
        let mut data = Data::new(&model);
        let mut energy = |x: &[f64]| {
            let bristle =
                if kind == Some(Kind::PreslidingFriction) { 0.5 * 30.0 * x[x.len() - 1].powi(2) } else { 0.0 };
            let coupled = if kind == Some(Kind::JointCoupling) { 0.5 * 0.01 * (x[2] - x[3]).powi(2) } else { 0.0 };
            model.kinetic_energy(&mut data, &x[..2], &x[2..4])
                + model.potential_energy(&mut data, &x[..2])
                + bristle
                + coupled
        };
        let (first, mut least) = (energy(&run.x), energy(&run.x));
        for _ in 0..2500 {
            run.step(&[0.0, 0.0]);
            assert!(energy(&run.x) < least + own_error, "{kind:?}: {} after {least}", energy(&run.x));
            least = least.min(energy(&run.x));
        }
        assert!(kind.is_none() || least < first - 0.5, "{kind:?}: {first} J, {least} J");
    }
}

#[test]
fn a_state_that_is_not_finite_does_not_panic() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let mut run = Run::new(&model, &everything(&["joint1", "joint5"]), DT);
    for (index, value) in [(0, f64::NAN), (7, f64::INFINITY), (0, 1e300)] {
        run.x.fill(0.0);
        run.x[index] = value;
        run.step(&[f64::MAX; 6]);
        run.step(&[f64::NAN; 6]);
    }
}
