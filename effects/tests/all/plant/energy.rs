//! Energy.

use super::*;

/// Most that the energy rises above its lowest value so far, as part of the kinetic energy at the start.
fn greatest_rise(model: &Model, effects: &[Effect], q: &[f64], v: &[f64], dt: f64, seconds: f64) -> f64 {
    let n = model.dof();
    let mut reference = Reference::new(model, effects);
    let mut plant = Plant::new(model, effects, dt).unwrap();
    let mut x = vec![0.0; 2 * n];
    plant.start(q, v, &mut x);
    let start = reference.energy(q, v);
    let scale = model.kinetic_energy(&mut Data::new(model), q, v).max(1.0);
    let (mut lowest, mut rise) = (start, 0.0f64);
    for _ in 0..(seconds / dt).round() as usize {
        plant.step(&mut x, &vec![0.0; n]);
        let energy = reference.energy(&x[..n], &x[n..]);
        assert!(energy.is_finite());
        rise = rise.max(energy - lowest);
        lowest = lowest.min(energy);
    }
    rise / scale
}

/// Without effort, friction of all sorts only takes energy away: no rise beyond 1e-4 of the kinetic energy at the start,
/// which is what the midpoint rule leaves at dt = 0.5 ms on these trees.
#[test]
fn friction_never_creates_energy() {
    const TOLERANCE: f64 = 1e-4;
    for seed in 0..16 {
        let n = 1 + seed as usize % 6;
        let (tree, mut draw) = calm_tree(seed, n);
        let mut effects = one_of_each(&mut draw, &tree);
        effects.retain(|e| {
            matches!(
                e,
                Effect::ViscousFriction(_)
                    | Effect::CoulombFriction(_)
                    | Effect::JointCoupling(_)
                    | Effect::ParallelSpring(_)
                    | Effect::Armature(_)
            )
        });
        let (q, v) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0));
        let sets: Vec<Vec<Effect>> = effects.iter().map(|e| vec![e.clone()]).chain([effects.clone()]).collect();
        for effects in sets.iter().filter(|set| set.iter().any(|e| is_dry(e) || e.kind() == Kind::ViscousFriction)) {
            let rise = greatest_rise(&tree, effects, &q, &v, 5e-4, 1.0);
            let kinds: Vec<Kind> = effects.iter().map(Effect::kind).collect();
            assert!(rise < TOLERANCE, "seed {seed}, {n} joints, {kinds:?}: rises by {rise:e}");
        }
    }
}

/// Dry friction alone, on a level rail: the energy is ½ m v², and it falls at every step until the block stands.
#[test]
fn dry_friction_takes_energy_at_every_step() {
    let model = slider();
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), 3.0)].into())], 1e-2).unwrap();
    let mut x = vec![0.0, -2.0];
    while x[1] != 0.0 {
        let before = x[1];
        plant.step(&mut x, &[0.0]);
        assert!(x[1].abs() < before.abs(), "{before} to {}", x[1]);
        assert!(x[1] <= 0.0, "friction does not reverse a motion");
    }
}

/// Springs and gravity alone: over 10 s at dt = 1 ms the energy stays within 1e-3 of its span.
#[test]
fn springs_conserve_energy() {
    let model = robot("double_pendulum");
    let spring = ParallelSpring {
        stiffness: [("joint1".into(), 3.0), ("joint2".into(), 1.0)].into(),
        rest_position: [("joint1".into(), 0.3), ("joint2".into(), -0.2)].into(),
    };
    let effects = [Effect::ParallelSpring(spring)];
    let mut reference = Reference::new(&model, &effects);
    let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
    let mut x = vec![0.0; 4];
    plant.start(&[0.8, -0.5], &[0.0, 0.0], &mut x);
    let start = reference.energy(&x[..2], &x[2..]);
    let (mut worst, mut kinetic) = (0.0f64, 0.0f64);
    let mut data = Data::new(&model);
    for _ in 0..10_000 {
        plant.step(&mut x, &[0.0, 0.0]);
        worst = worst.max((reference.energy(&x[..2], &x[2..]) - start).abs());
        kinetic = kinetic.max(model.kinetic_energy(&mut data, &x[..2], &x[2..]));
    }
    assert!(kinetic > 0.1, "it swings: {kinetic} J");
    assert!(worst < 1e-3 * kinetic, "energy strays by {worst:e} J of {kinetic} J");
}

/// A slider on a spring: half a period later it is on the other side.
#[test]
fn a_spring_swings_at_its_own_frequency() {
    let model = slider();
    let spring =
        ParallelSpring { stiffness: [("rail".into(), 50.0)].into(), rest_position: [("rail".into(), 0.2)].into() };
    let half_period = std::f64::consts::PI * (2.0f64 / 50.0).sqrt();
    let steps = 1000;
    let mut plant = Plant::new(&model, &[Effect::ParallelSpring(spring)], half_period / f64::from(steps)).unwrap();
    let x = run(&mut plant, &[0.5], &[0.0], &[0.0], steps as usize);
    assert!((x[0] - (-0.1)).abs() < 1e-5 && x[1].abs() < 1e-4, "{x:?}");
}

/// The midpoint rule keeps the energy of a linear oscillator to rounding, however stiff the spring is against the step.
#[test]
fn a_stiff_spring_keeps_its_energy_to_rounding() {
    let model = slider();
    for (stiffness, dt) in [(50.0, 5e-3), (1e4, 1e-2), (1e9, 1e-2)] {
        let spring = ParallelSpring {
            stiffness: [("rail".into(), stiffness)].into(),
            rest_position: [("rail".into(), 0.0)].into(),
        };
        let mut plant = Plant::new(&model, &[Effect::ParallelSpring(spring)], dt).unwrap();
        let energy = |x: &[f64]| 0.5 * (stiffness * x[0] * x[0] + 2.0 * x[1] * x[1]);
        let mut x = vec![0.3, 0.0];
        let start = energy(&x);
        for _ in 0..2000 {
            plant.step(&mut x, &[0.0]);
            assert!((energy(&x) / start - 1.0).abs() < 1e-9, "{stiffness} N/m at {dt} s: {}", energy(&x) / start);
        }
    }
}
