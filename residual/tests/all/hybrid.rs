//! f_hyb over the rigid model, a plant with effects and a user's closure; discrete and continuous; one state and many.

use gapscope_dynamics::{Data, Discrete, Integrator, Model, StepModel, Transitions, central_differences, robots};
use gapscope_effects::{Effect, Plant, ViscousFriction};
use gapscope_network::{Activation, Init, Learner, Mlp, Net, Regressor, ShapeError, TrainSettings};
use gapscope_residual::{
    Continuous, Hybrid, On, Orthogonal, ResidualError, Scheme, StepFn, Tangents, examples, learn, rigid_rate,
};
use nalgebra::DMatrix;

const DT: f64 = 0.01;

fn arm(name: &str) -> Model {
    robots::model(name).unwrap().unwrap().model
}

fn numbers(count: usize, phase: f64) -> Vec<f64> {
    (0..count).map(|i| (1.7 * i as f64 + phase).sin()).collect()
}

/// A correction given by a closure.
struct Formula<F> {
    shape: [usize; 2],
    formula: F,
}

impl<F: FnMut(&[f64], &mut [f64])> Regressor for Formula<F> {
    fn inputs(&self) -> usize {
        self.shape[0]
    }
    fn outputs(&self) -> usize {
        self.shape[1]
    }
    fn predict(&mut self, x: &[f64], y: &mut [f64]) {
        (self.formula)(x, y);
    }
}

/// Steps of `truth` from many states.
fn seen(truth: &mut dyn StepModel, rows: usize) -> Transitions {
    let n = truth.joints();
    let mut out = Transitions::new(n, truth.dt());
    let mut x = vec![0.0; truth.state_len()];
    for row in 0..rows {
        let (q, v, tau) = (numbers(n, row as f64), numbers(n, 0.3 + 1.1 * row as f64), numbers(n, 0.7 * row as f64));
        truth.start(&q, &v, &mut x);
        let before = x.clone();
        let tau: Vec<f64> = tau.iter().map(|t| 10.0 * t).collect();
        truth.step(&mut x, &tau);
        out.push(&before, &tau, &x);
    }
    out
}

#[test]
fn a_correction_of_the_right_kind_makes_any_physics_right() {
    // Truth: the same robot with torques off by −2 v.
    let model = arm("arm6");
    let n = 6;
    let discrete = Discrete::new(model.clone(), DT, Integrator::SemiImplicitEuler);
    let damping = |x: &[f64], r: &mut [f64]| (0..6).for_each(|j| r[j] = -2.0 * x[6 + j]);
    let formula = || Formula { shape: [3 * n, n], formula: damping };
    let mut truth = Hybrid::new(discrete.clone(), formula(), On::Torque).unwrap();
    let seen = seen(&mut truth, 40);
    let mut data = Data::new(&model);
    let mut own = discrete.clone();
    let rows = examples(&mut own, &seen, On::Torque).unwrap();
    for (x, r) in rows.inputs.chunks(3 * n).zip(rows.targets.chunks(n)) {
        assert!((0..n).all(|j| (r[j] + 2.0 * x[n + j]).abs() < 1e-8), "{r:?}");
    }
    // The acceleration that is missing is M⁻¹ times that torque.
    let rows = examples(&mut own, &seen, On::Acceleration).unwrap();
    let (mut with, mut without) = (vec![0.0; n], vec![0.0; n]);
    for (x, r) in rows.inputs.chunks(3 * n).zip(rows.targets.chunks(n)) {
        let (q, v, tau) = (&x[..n], &x[n..2 * n], &x[2 * n..]);
        let less: Vec<f64> = tau.iter().zip(v).map(|(tau, v)| tau - 2.0 * v).collect();
        model.forward_dynamics(&mut data, q, v, &less, &mut with);
        model.forward_dynamics(&mut data, q, v, tau, &mut without);
        assert!((0..n).all(|j| (r[j] - (with[j] - without[j])).abs() < 1e-8 * (1.0 + r[j].abs())));
    }
    // A table of the right corrections, put on each kind of physics, brings every step to where it was seen.
    let closure = || {
        let mut inner = discrete.clone();
        StepFn::new(n, DT, move |x: &mut [f64], tau: &[f64]| inner.step(x, tau))
    };
    let plant = || Plant::nominal(&model, DT);
    let physics: [&dyn Fn() -> Box<dyn StepModel>; 3] =
        [&|| Box::new(discrete.clone()), &|| Box::new(closure()), &|| Box::new(plant())];
    for make in physics {
        for on in [On::NextState, On::Acceleration, On::Torque] {
            let rows = examples(&mut *make(), &seen, on).unwrap();
            let mut next = 0;
            let outputs = on.outputs(n);
            let table = |_: &[f64], r: &mut [f64]| {
                r.copy_from_slice(&rows.targets[next * outputs..(next + 1) * outputs]);
                next += 1;
            };
            let corrected = Boxed(make());
            let mut hybrid = Hybrid::new(corrected, Formula { shape: [3 * n, outputs], formula: table }, on).unwrap();
            let errors = seen.one_step_errors(&mut hybrid);
            let most = errors.chunks(2 * n).flat_map(|e| &e[n..]).fold(0.0f64, |m, e| m.max(e.abs()));
            assert!(most < 1e-7, "{on:?}: {most}");
        }
    }
}

/// `Box<dyn StepModel>` as a model.
struct Boxed(Box<dyn StepModel>);

impl StepModel for Boxed {
    fn joints(&self) -> usize {
        self.0.joints()
    }
    fn dt(&self) -> f64 {
        self.0.dt()
    }
    fn state_len(&self) -> usize {
        self.0.state_len()
    }
    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        self.0.start(q, v, x);
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        self.0.step(x, tau);
    }
}

#[test]
fn a_learned_residual_shrinks_the_one_step_error_of_states_not_seen() {
    let model = arm("double_pendulum");
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 0.15)).collect();
    let mut truth = Plant::new(&model, &[Effect::ViscousFriction(ViscousFriction { viscous })], DT).unwrap();
    let all = seen(&mut truth, 1500);
    let (train, test) = (all.filtered(|i| i % 5 != 0), all.filtered(|i| i % 5 == 0));
    let settings = TrainSettings { epochs: 80, cosine: true, penalty: 1e-3, ..TrainSettings::default() };
    let mut learner = Learner { hidden: vec![32], activation: Activation::Tanh, settings };
    learner.settings.adam.rate = 3e-3;
    for on in [On::NextState, On::Acceleration, On::Torque] {
        let mut physics = Plant::nominal(&model, DT);
        let rms = |model: &mut dyn StepModel| {
            let errors = test.one_step_errors(model);
            (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
        };
        let before = rms(&mut physics);
        let trained = learn::<f64>(&mut physics, &train, Some(&test), on, &learner, None, &mut |_| {}).unwrap();
        if on == On::Acceleration {
            // The same correction in continuous time, added to v̇.
            let net = Net::new(trained.network.clone());
            for scheme in [Scheme::Rk4, Scheme::Adaptive { tolerance: 1e-8 }] {
                let mut bare = Continuous::new(
                    2,
                    DT,
                    rigid_rate(model.clone()),
                    Formula { shape: [6, 2], formula: |_: &[f64], r: &mut [f64]| r.fill(0.0) },
                    scheme,
                )
                .unwrap();
                let mut model = Continuous::new(2, DT, rigid_rate(model.clone()), net.clone(), scheme).unwrap();
                let (before, after) = (rms(&mut bare), rms(&mut model));
                assert!(after < 0.5 * before, "{scheme:?}: {before} → {after}");
            }
        }
        let after = rms(&mut Hybrid::new(physics, Net::new(trained.network), on).unwrap());
        assert!(after < 0.15 * before, "{on:?}: {before} → {after}");
    }
    let other = Transitions::new(3, DT);
    let error = examples(&mut truth, &other, On::Torque).unwrap_err();
    assert!(matches!(error, ResidualError::Differs { what: "joints", .. }), "{error}");
    let other = Transitions::new(2, 0.02);
    assert!(matches!(examples(&mut truth, &other, On::Torque), Err(ResidualError::Differs { .. })));
}

#[test]
fn a_network_of_another_shape_is_refused_with_both_shapes() {
    let physics = Discrete::new(arm("arm7"), DT, Integrator::Rk4);
    let network = Mlp::<f32>::zeros(&[21, 7], Activation::Tanh).unwrap();
    let error = Hybrid::new(physics, Net::new(network), On::NextState).err().unwrap();
    assert_eq!(error, ShapeError::Network { expected: [21, 14], found: [21, 7] }.into());
}

#[test]
fn in_continuous_time_the_correction_is_integrated_with_the_physics() {
    let model = arm("arm6");
    let n = 6;
    let none = || Formula { shape: [3 * n, n], formula: |_: &[f64], r: &mut [f64]| r.fill(0.0) };
    let mut rk4 = Continuous::new(n, DT, rigid_rate(model.clone()), none(), Scheme::Rk4).unwrap();
    let mut discrete = Discrete::new(model.clone(), DT, Integrator::Rk4);
    let (mut x, tau) = (numbers(2 * n, 0.2), numbers(n, 0.5));
    let mut y = x.clone();
    for _ in 0..20 {
        rk4.step(&mut x, &tau);
        discrete.step(&mut y, &tau);
    }
    assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-11), "RK4 is RK4");

    // ẋ = v, v̇ = τ + r with r = −x: a harmonic oscillator, whose solution is known.
    let rate = |x: &[f64], tau: &[f64], rate: &mut [f64]| rate.copy_from_slice(&[x[1], tau[0]]);
    let spring = |shape: [usize; 2]| Formula {
        shape,
        formula: |x: &[f64], r: &mut [f64]| {
            r.fill(0.0);
            *r.last_mut().unwrap() = -x[0];
        },
    };
    for (scheme, tolerance) in [
        (Scheme::Rk4, 1e-7),
        (Scheme::Adaptive { tolerance: 1e-6 }, 1e-5),
        (Scheme::Adaptive { tolerance: 1e-11 }, 1e-9),
    ] {
        for shape in [[3, 1], [3, 2]] {
            let dt = if scheme == Scheme::Rk4 { 0.02 } else { 1.0 };
            let mut model = Continuous::new(1, dt, rate, spring(shape), scheme).unwrap();
            let mut x = [1.0, 0.0];
            (0..(6.0 / dt).round() as usize).for_each(|_| model.step(&mut x, &[0.0]));
            let error = (x[0] - 6.0_f64.cos()).abs().max((x[1] + 6.0_f64.sin()).abs());
            assert!(error < tolerance, "{scheme:?}: {error}");
        }
    }
    assert!(Continuous::new(1, 0.1, rate, spring([3, 3]), Scheme::Rk4).is_err());
    // A state that leaves the finite numbers ends the step rather than halving it for ever.
    let wild = Formula { shape: [3, 1], formula: |_: &[f64], r: &mut [f64]| r.fill(f64::INFINITY) };
    let mut model = Continuous::new(1, 0.1, rate, wild, Scheme::Adaptive { tolerance: 1e-9 }).unwrap();
    model.step(&mut [0.0, 0.0], &[0.0]);
}

#[test]
fn many_states_at_once_are_one_state_at_a_time() {
    let model = arm("arm7");
    for (on, physics) in kinds(&model) {
        let network = small(&[21, 40, on.outputs(7)]);
        let mut hybrid = Hybrid::new(physics, Net::new(network), on).unwrap();
        for rows in [1, 8, 67, 130] {
            let (mut x, tau) = (numbers(rows * 14, 0.1), numbers(rows * 7, 0.4));
            let mut y = x.clone();
            hybrid.step_batch(&mut x, &tau);
            y.chunks_mut(14).zip(tau.chunks(7)).for_each(|(y, tau)| hybrid.step(y, tau));
            assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-10 * y.abs().max(1.0)), "{on:?}");
        }
    }
}

fn kinds(model: &Model) -> Vec<(On, Discrete)> {
    let physics = || Discrete::new(model.clone(), DT, Integrator::SemiImplicitEuler);
    [On::NextState, On::Acceleration, On::Torque].into_iter().map(|on| (on, physics())).collect()
}

/// A network whose outputs are small.
fn small(sizes: &[usize]) -> Mlp<f64> {
    let mut network = Mlp::new(sizes, Activation::Tanh, Init::Xavier, 1).unwrap();
    network.parameters_mut().iter_mut().for_each(|p| *p *= 0.1);
    network
}

#[test]
fn derivatives_agree_with_differences() {
    let model = arm("arm6");
    let (x, tau) = (numbers(12, 0.2), numbers(6, 0.5));
    for (on, physics) in kinds(&model) {
        let mut hybrid = Hybrid::new(physics, Net::new(small(&[18, 20, on.outputs(6)])), on).unwrap();
        let zeros = || (DMatrix::zeros(12, 12), DMatrix::zeros(12, 6));
        let ((mut exact, mut numeric), mut plain) = ((zeros(), zeros()), zeros());
        hybrid.jacobian(&x, &tau, &mut exact.0, &mut exact.1);
        central_differences(&mut hybrid, &x, &tau, &mut numeric.0, &mut numeric.1);
        for (exact, numeric) in [(&exact.0, &numeric.0), (&exact.1, &numeric.1)] {
            let worst = (exact - numeric).amax() / numeric.amax();
            assert!(worst < 1e-6, "{on:?}: {worst:e}");
        }
        kinds(&model)[0].1.jacobian(&x, &tau, &mut plain.0, &mut plain.1);
        assert!((exact.0 - plain.0).amax() > 1e-6, "the correction has a part in it");
    }
}

#[test]
fn what_physics_can_explain_is_not_learned() {
    // Torques: a change of inertial parameters (the tangents are the regressor) and a spring, which no inertia is.
    let model = arm("double_pendulum");
    let (n, p, rows) = (2, 20, 200);
    let mut data = Data::new(&model);
    let mut regressor = nalgebra::DMatrix::zeros(n, p);
    let mut tangents_at = |x: &[f64], out: &mut [f64]| {
        model.regressor(&mut data, &x[..2], &x[2..4], &x[4..6], &mut regressor);
        (0..n).for_each(|i| (0..p).for_each(|j| out[i * p + j] = regressor[(i, j)]));
    };
    let inputs: Vec<f64> = (0..rows).flat_map(|r| numbers(6, 1.3 * f64::from(r))).collect();
    let delta = numbers(p, 0.5);
    let (mut values, mut targets, mut explainable) = (vec![], vec![], vec![]);
    for x in inputs.chunks(6) {
        let mut own = vec![0.0; n * p];
        tangents_at(x, &mut own);
        for (i, row) in own.chunks(p).enumerate() {
            let inertial: f64 = row.iter().zip(&delta).map(|(a, b)| a * b).sum();
            explainable.push(inertial);
            targets.push(inertial + 5.0 * x[i].powi(3));
        }
        values.extend(own);
    }
    let tangents = Tangents::new(values.clone(), p).unwrap();
    let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let before = size(&explainable);
    tangents.project_out(&mut explainable).unwrap();
    assert!(size(&explainable) < 1e-7 * before, "what is in the span goes");
    tangents.project_out(&mut targets).unwrap();
    let along = |y: &[f64]| {
        let products = (0..p).map(|j| {
            let column: Vec<f64> = values.iter().skip(j).step_by(p).copied().collect();
            let dot: f64 = column.iter().zip(y).map(|(a, b)| a * b).sum();
            dot.abs() / (size(&column) * size(y)).max(1e-12)
        });
        products.fold(0.0, f64::max)
    };
    assert!(along(&targets) < 1e-7 && size(&targets) > 0.1);
    // A network's outputs, made orthogonal over the same rows.
    let mut net = Net::new(Mlp::<f64>::new(&[6, 8, n], Activation::Tanh, Init::He, 1).unwrap());
    let mut raw = vec![0.0; n * rows as usize];
    inputs.chunks(6).zip(raw.chunks_mut(n)).for_each(|(x, y)| net.predict(x, y));
    assert!(along(&raw) > 1e-2);
    let coefficients = tangents.coefficients(&raw).unwrap();
    let mut orthogonal = Orthogonal::new(net, tangents_at, coefficients);
    let mut y = vec![0.0; n * rows as usize];
    inputs.chunks(6).zip(y.chunks_mut(n)).for_each(|(x, y)| orthogonal.predict(x, y));
    assert!(along(&y) < 1e-5, "{}", along(&y));
    assert!(tangents.coefficients(&y[1..]).is_err() && Tangents::new(vec![0.0; 7], 2).is_err());
}
