//! Residual and pure learning against each other: with plenty of data both find the robot.

use gapscope_dynamics::{StepModel, Transitions};
use gapscope_effects::{Effect, Plant, ViscousFriction};
use gapscope_network::{Activation, Learner, Net, TrainSettings};
use gapscope_pure::Pure;
use gapscope_residual::{Hybrid, On};
use gapscope_tests::robot;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const DT: f64 = 0.02;

fn steps(truth: &mut Plant, rows: usize, seed: u64) -> Transitions {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut seen = Transitions::new(2, DT);
    let mut x = vec![0.0; truth.state_len()];
    for _ in 0..rows {
        let mut draw = |most: f64| -> [f64; 2] { std::array::from_fn(|_| random.random_range(-most..most)) };
        let (q, v, tau) = (draw(1.2), draw(3.0), draw(1.5));
        truth.start(&q, &v, &mut x);
        let before = x.clone();
        truth.step(&mut x, &tau);
        seen.push(&before, &tau, &x);
    }
    seen
}

/// What a model makes of the test states: velocities after one step.
fn velocities(model: &mut dyn StepModel, test: &Transitions) -> Vec<f64> {
    test.rows()
        .flat_map(|(x, tau, _)| {
            let mut x = x.to_vec();
            model.step(&mut x, tau);
            x[2..].to_vec()
        })
        .collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, c), v| (s + v * v, c + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}

#[test]
fn residual_and_pure_agree_with_plenty_of_data() {
    let model = robot("double_pendulum");
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 0.2)).collect();
    let mut truth = Plant::new(&model, &[Effect::ViscousFriction(ViscousFriction { viscous })], DT).unwrap();
    let (few, plenty, test) = (steps(&mut truth, 150, 1), steps(&mut truth, 8000, 2), steps(&mut truth, 500, 3));
    let physics = || Plant::nominal(&model, DT);
    // How far residual and pure are from each other, and each from the robot, relative to the gap of physics alone.
    let gap = rms(test.one_step_errors(&mut physics()).chunks(4).flat_map(|e| e[2..].to_vec()));
    let mut run = |train: &Transitions, epochs: usize| -> [f64; 3] {
        let settings = TrainSettings { epochs, cosine: true, ..TrainSettings::default() };
        let mut learner = Learner { hidden: vec![48, 48], activation: Activation::Tanh, settings };
        learner.settings.adam.rate = 4e-3;
        let on = On::NextState;
        let residual =
            gapscope_residual::learn::<f32>(&mut physics(), train, None, on, &learner, None, &mut |_| {}).unwrap();
        let pure = gapscope_pure::learn::<f32>(train, None, &learner, &mut |_| {}).unwrap();
        let hybrid = velocities(&mut Hybrid::new(physics(), Net::new(residual.network), on).unwrap(), &test);
        let pure = velocities(&mut Pure::new(2, DT, Net::new(pure.network)).unwrap(), &test);
        let robot = velocities(&mut truth, &test);
        let apart = |a: &[f64], b: &[f64]| rms(a.iter().zip(b).map(|(a, b)| a - b)) / gap;
        [apart(&hybrid, &pure), apart(&hybrid, &robot), apart(&pure, &robot)]
    };
    let (little, much) = (run(&few, 400), run(&plenty, 80));
    assert!(much[1] < 0.1, "residual against robot: {much:?}");
    assert!(much[0] < 0.25 && much[2] < 0.25, "each other, and pure against robot: {much:?}");
    assert!(little[0] > 2.0 * much[0], "with few data they do not agree: {little:?}, {much:?}");
}
