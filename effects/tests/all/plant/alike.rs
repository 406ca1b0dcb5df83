//! Effects that are another model or another effort.

use super::*;

/// Same residual and same step.
fn assert_same(a: &mut Plant, b: &mut Plant, draw: &mut Draw, n: usize, tolerance: f64) {
    for _ in 0..10 {
        let (q, v, acceleration) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 5.0));
        let tau = draw.numbers(n, 20.0);
        let mut rest = [vec![0.0; n], vec![0.0; n]];
        a.residual(&q, &v, &acceleration, &tau, &vec![0.1; n], &mut rest[0]);
        b.residual(&q, &v, &acceleration, &tau, &vec![0.1; n], &mut rest[1]);
        assert_close(&rest[0], &rest[1], tolerance);
        assert_close(&run(a, &q, &v, &tau, 5), &run(b, &q, &v, &tau, 5), tolerance);
    }
}

#[test]
fn armature_is_the_models_rotor_inertia() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let extra: Vec<f64> = (0..n).map(|_| between(&mut draw, 0.0, 1.0)).collect();
        let armature = model.joints().iter().zip(&extra).map(|(j, i)| (j.name.clone(), *i)).collect();
        let sum: Vec<f64> = model.armature().iter().zip(&extra).map(|(a, b)| a + b).collect();
        let mut effect = Plant::new(&model, &[Effect::Armature(Armature { armature })], 1e-3).unwrap();
        assert_same(&mut effect, &mut Plant::nominal(&model.clone().with_armature(&sum), 1e-3), &mut draw, n, 1e-9);
    }
}

#[test]
fn payload_is_more_inertia_of_its_link() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let body = payload(&mut draw, &model);
        let j = model.joint_index(&body.joint).unwrap();
        let heavier = model.clone().with_inertia(j, with_body(&model, &body));
        let mut effect = Plant::new(&model, &[Effect::Payload(body)], 1e-3).unwrap();
        assert_eq!(effect.model().joints()[j].inertia, heavier.joints()[j].inertia);
        assert_same(&mut effect, &mut Plant::nominal(&heavier, 1e-3), &mut draw, n, 1e-14);
    }
}

#[test]
fn a_link_error_is_another_inertia_of_that_link() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let error = heavier_link(&mut draw, &model);
        let j = model.joint_index(&error.joint).unwrap();
        let heavier = model.clone().with_inertia(j, model.joints()[j].inertia.add(&delta(&error)));
        let mut effect = Plant::new(&model, &[Effect::LinkInertiaError(error)], 1e-3).unwrap();
        assert_eq!(effect.model().joints()[j].inertia, heavier.joints()[j].inertia);
        assert_same(&mut effect, &mut Plant::nominal(&heavier, 1e-3), &mut draw, n, 1e-14);
    }
}

#[test]
fn tilt_is_another_gravity() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let tilt = GravityMisalignment { roll: draw.uniform(0.5), pitch: draw.uniform(0.5) };
        let ((sr, cr), (sp, cp)) = (tilt.roll.sin_cos(), tilt.pitch.sin_cos());
        let tilted = model.clone().with_gravity(9.81 * DVec3::new(sp, -sr * cp, -cr * cp));
        let mut effect = Plant::new(&model, &[Effect::GravityMisalignment(tilt)], 1e-3).unwrap();
        assert_same(&mut effect, &mut Plant::nominal(&tilted, 1e-3), &mut draw, n, 1e-14);
    }
}

/// Roll about x, then pitch about y, both fixed in the world: the world's gravity seen from the turned base.
#[test]
fn tilt_is_gravity_seen_from_a_turned_base() {
    let mut draw = Draw::new(3);
    for _ in 0..20 {
        let (roll, pitch) = (draw.uniform(1.5), draw.uniform(1.5));
        let world_from_base = DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
        let seen = world_from_base.transpose() * DVec3::new(0.0, 0.0, -9.81);
        let gravity = GravityMisalignment { roll, pitch }.gravity();
        assert!((seen - gravity).length() < 1e-12, "roll {roll}, pitch {pitch}: {gravity}, expected {seen}");
    }
}

#[test]
fn bias_and_gain_are_another_effort() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let gain: Vec<f64> = (0..n).map(|_| between(&mut draw, 0.5, 1.5)).collect();
        let bias = draw.numbers(n, 5.0);
        let named = |x: &[f64]| model.joints().iter().zip(x).map(|(j, x)| (j.name.clone(), *x)).collect();
        let effects = [
            Effect::TorqueGainError(TorqueGainError { gain: named(&gain) }),
            Effect::TorqueBias(TorqueBias { bias: named(&bias) }),
        ];
        let mut with = Plant::new(&model, &effects, 1e-3).unwrap();
        let mut nominal = Plant::nominal(&model, 1e-3);
        let (q, v, tau) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 20.0));
        let delivered: Vec<f64> = (0..n).map(|j| gain[j] * tau[j] + bias[j]).collect();
        assert_eq!(run(&mut with, &q, &v, &tau, 5), run(&mut nominal, &q, &v, &delivered, 5));
        // The residual is in the units of the log: less by the gain.
        let mut rest = [vec![0.0; n], vec![0.0; n]];
        let a = draw.numbers(n, 5.0);
        with.residual(&q, &v, &a, &tau, &vec![0.0; n], &mut rest[0]);
        nominal.residual(&q, &v, &a, &delivered, &vec![0.0; n], &mut rest[1]);
        let scaled: Vec<f64> = rest[0].iter().zip(&gain).map(|(r, g)| r * g).collect();
        assert_close(&scaled, &rest[1], 1e-13);
    }
}

/// Two effects of a kind add up, and the order in which effects are given does not matter.
#[test]
fn effects_add_up_in_any_order() {
    for (model, mut draw) in trees().skip(1) {
        let n = model.dof();
        let mut effects = one_of_each(&mut draw, &model);
        // A bias acts on top of a gain wherever it stands.
        let mut forth = Plant::new(&model, &effects, 1e-3).unwrap();
        effects.reverse();
        assert_same(&mut forth, &mut Plant::new(&model, &effects, 1e-3).unwrap(), &mut draw, n, 1e-8);
        let viscous = |b: f64| Effect::ViscousFriction(ViscousFriction { viscous: on_all(&model, || b) });
        let mut two = Plant::new(&model, &[viscous(0.4), viscous(0.6)], 1e-3).unwrap();
        assert_same(&mut two, &mut Plant::new(&model, &[viscous(1.0)], 1e-3).unwrap(), &mut draw, n, 1e-13);
    }
}

/// What the URDF declares is in the nominal plant, and an effect counts beyond it.
#[test]
fn damping_and_friction_of_the_urdf_are_in_the_nominal_plant() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut joints = model.joints().to_vec();
        joints.iter_mut().for_each(|j| (j.damping, j.friction) = (0.0, 0.0));
        let bare = Model::new("tree".into(), "base".into(), joints)
            .unwrap()
            .with_armature(model.armature())
            .with_gravity(model.gravity());
        let of = |value: fn(&Joint) -> f64| model.joints().iter().map(|j| (j.name.clone(), value(j))).collect();
        let effects =
            [Effect::ViscousFriction(ViscousFriction { viscous: of(|j| j.damping) }), coulomb(of(|j| j.friction))];
        let mut declared = Plant::nominal(&model, 1e-3);
        assert_same(&mut declared, &mut Plant::new(&bare, &effects, 1e-3).unwrap(), &mut draw, n, 1e-13);
    }
}
