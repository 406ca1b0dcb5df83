//! Random seeded trees, motions and effects, and the laws of the catalogue written out a second time.
#![allow(dead_code, unused_imports)]

// The trees of the dynamics' own property tests.
#[path = "../../../dynamics/tests/common/mod.rs"]
mod trees;

use gapscope_dynamics::{Data, Inertia, Model, robots};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, GravityMisalignment, JointCoupling, LinkInertiaError, ParallelSpring, Payload,
    TorqueBias, TorqueGainError, ViscousFriction,
};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
pub use trees::{Draw, assert_close};

/// Uniform in [low, high).
pub fn between(draw: &mut Draw, low: f64, high: f64) -> f64 {
    low + 0.5 * (high - low) * (1.0 + draw.uniform(1.0))
}

/// The built-in robot of this name.
pub fn robot(name: &str) -> Model {
    robots::model(name).unwrap().unwrap().model
}

/// The same tree with random damping and friction declared in its URDF.
pub fn rubbing(draw: &mut Draw, model: &Model) -> Model {
    let mut joints = model.joints().to_vec();
    for joint in &mut joints {
        joint.damping = between(draw, 0.0, 2.0);
        joint.friction = between(draw, 0.0, 2.0);
    }
    Model::new(model.name().into(), model.base().into(), joints)
        .unwrap()
        .with_armature(model.armature())
        .with_gravity(model.gravity())
}

/// A tree with links of even weight, so that its fastest motions are slow against a step of a millisecond.
pub fn calm_tree(seed: u64, n: usize) -> (Model, Draw) {
    let mut draw = Draw::new(seed);
    let tree = draw.tree(n);
    (tree.with_armature(&vec![0.5; n]), draw)
}

/// Index of each joint in the map, with its value.
fn by_index(model: &Model, map: &BTreeMap<String, f64>) -> Vec<(usize, f64)> {
    map.iter().map(|(name, value)| (model.joint_index(name).unwrap(), *value)).collect()
}

/// One value a joint.
pub fn on_all(model: &Model, mut value: impl FnMut() -> f64) -> BTreeMap<String, f64> {
    model.joints().iter().map(|joint| (joint.name.clone(), value())).collect()
}

/// A physical body at the last joint that no other joint hangs from.
pub fn payload(draw: &mut Draw, model: &Model) -> Payload {
    let body = draw.inertia();
    let i = body.about_center_of_mass();
    Payload {
        joint: model.joints().last().unwrap().name.clone(),
        mass: body.mass,
        com: body.center_of_mass().unwrap().to_array(),
        inertia: [i.x_axis.x, i.x_axis.y, i.y_axis.y, i.x_axis.z, i.y_axis.z, i.z_axis.z],
    }
}

/// A link that is heavier than its URDF by a real body.
pub fn heavier_link(draw: &mut Draw, model: &Model) -> LinkInertiaError {
    let [mass, x, y, z, xx, xy, yy, xz, yz, zz] = draw.inertia().parameters();
    LinkInertiaError {
        joint: model.joints()[draw.below(model.dof())].name.clone(),
        mass_delta: mass,
        first_moment_delta: [x, y, z],
        inertia_delta: [xx, xy, yy, xz, yz, zz],
    }
}

/// One effect of each kind that the robot can have, with random parameters; dry friction is in coulomb_friction and joint_coupling.
pub fn one_of_each(draw: &mut Draw, model: &Model) -> Vec<Effect> {
    let mut effects = vec![
        Effect::ViscousFriction(ViscousFriction { viscous: on_all(model, || between(draw, 0.1, 2.0)) }),
        Effect::CoulombFriction(CoulombFriction { coulomb: on_all(model, || between(draw, 0.1, 2.0)) }),
        Effect::Armature(Armature { armature: on_all(model, || between(draw, 0.01, 0.5)) }),
        Effect::TorqueGainError(TorqueGainError { gain: on_all(model, || between(draw, 0.7, 1.4)) }),
        Effect::TorqueBias(TorqueBias { bias: on_all(model, || draw.uniform(3.0)) }),
        Effect::ParallelSpring(ParallelSpring {
            stiffness: on_all(model, || between(draw, 1.0, 20.0)),
            rest_position: on_all(model, || draw.uniform(1.0)),
        }),
        Effect::Payload(payload(draw, model)),
        Effect::LinkInertiaError(heavier_link(draw, model)),
        Effect::GravityMisalignment(GravityMisalignment { roll: draw.uniform(0.2), pitch: draw.uniform(0.2) }),
    ];
    if model.dof() > 1 {
        effects.push(Effect::JointCoupling(JointCoupling {
            joints: [model.joints()[0].name.clone(), model.joints()[1].name.clone()],
            ratio: [1.0, -1.0, 0.5][draw.below(3)],
            coulomb: between(draw, 0.1, 2.0),
            viscous: between(draw, 0.1, 2.0),
            armature: between(draw, 0.01, 0.5),
        }));
    }
    effects
}

/// The catalogue's laws in matrices, from `effects.md` and not from the plant: M q̈ = rhs away from standstill.
pub struct Reference {
    model: Model,
    data: Data,
    gain: Vec<f64>,
    bias: Vec<f64>,
    stiffness: DMatrix<f64>,
    viscous: DMatrix<f64>,
    rotors: DMatrix<f64>,
    /// Combination of speeds and dry friction along it.
    dry: Vec<(DVector<f64>, f64)>,
}

impl Reference {
    pub fn new(model: &Model, effects: &[Effect]) -> Reference {
        let n = model.dof();
        let unit = |j: usize| DVector::from_fn(n, |i, _| if i == j { 1.0 } else { 0.0 });
        let mut r = Reference {
            model: model.clone(),
            data: Data::new(model),
            gain: vec![1.0; n],
            bias: vec![0.0; n],
            stiffness: DMatrix::zeros(n, n),
            viscous: DMatrix::zeros(n, n),
            rotors: DMatrix::zeros(n, n),
            dry: Vec::new(),
        };
        for (j, joint) in model.joints().iter().enumerate() {
            r.viscous[(j, j)] += joint.damping;
            r.dry.push((unit(j), joint.friction));
        }
        for effect in effects {
            match effect {
                Effect::ViscousFriction(e) => {
                    by_index(model, &e.viscous).iter().for_each(|&(j, b)| r.viscous[(j, j)] += b)
                }
                Effect::CoulombFriction(e) => {
                    by_index(model, &e.coulomb).iter().for_each(|&(j, f)| r.dry.push((unit(j), f)));
                }
                Effect::Armature(e) => by_index(model, &e.armature).iter().for_each(|&(j, i)| r.rotors[(j, j)] += i),
                Effect::TorqueGainError(e) => by_index(model, &e.gain).iter().for_each(|&(j, g)| r.gain[j] *= g),
                Effect::TorqueBias(e) => by_index(model, &e.bias).iter().for_each(|&(j, b)| r.bias[j] += b),
                Effect::ParallelSpring(e) => {
                    for (j, k) in by_index(model, &e.stiffness) {
                        r.stiffness[(j, j)] += k;
                        r.bias[j] += k * e.rest_position[&model.joints()[j].name];
                    }
                }
                Effect::Payload(e) => {
                    let j = model.joint_index(&e.joint).unwrap();
                    r.model = r.model.clone().with_inertia(j, with_body(&r.model, e));
                }
                Effect::LinkInertiaError(e) => {
                    let j = model.joint_index(&e.joint).unwrap();
                    let inertia = r.model.joints()[j].inertia.add(&delta(e));
                    r.model = r.model.clone().with_inertia(j, inertia);
                }
                Effect::GravityMisalignment(e) => {
                    let ((sr, cr), (sp, cp)) = (e.roll.sin_cos(), e.pitch.sin_cos());
                    r.model = r.model.clone().with_gravity(9.81 * glam::DVec3::new(sp, -sr * cp, -cr * cp));
                }
                Effect::JointCoupling(e) => {
                    let at = |name: &String| unit(model.joint_index(name).unwrap());
                    let c = at(&e.joints[0]) + e.ratio * at(&e.joints[1]);
                    r.viscous += e.viscous * &c * c.transpose();
                    r.rotors += e.armature * &c * c.transpose();
                    r.dry.push((c, e.coulomb));
                }
                #[allow(unreachable_patterns)]
                other => panic!("write the law of {} down here", other.kind()),
            }
        }
        r
    }

    /// Acceleration in motion, dry friction at its full size against every speed.
    pub fn acceleration(&mut self, q: &[f64], v: &[f64], tau: &[f64]) -> Vec<f64> {
        let n = q.len();
        let mut mass = DMatrix::zeros(n, n);
        let mut bias = vec![0.0; n];
        self.model.mass_matrix(&mut self.data, q, &mut mass);
        self.model.bias(&mut self.data, q, v, &mut bias);
        let (q, v) = (DVector::from_column_slice(q), DVector::from_column_slice(v));
        let mut force = DVector::from_fn(n, |j, _| self.gain[j] * tau[j] + self.bias[j] - bias[j]);
        force -= &self.stiffness * q + &self.viscous * &v;
        for (c, coulomb) in &self.dry {
            let speed = c.dot(&v);
            if speed != 0.0 {
                force -= *coulomb * speed.signum() * c;
            }
        }
        (mass + &self.rotors).lu().solve(&force).unwrap().as_slice().to_vec()
    }

    /// The least speed over all combinations that carry dry friction.
    pub fn least_speed(&self, v: &[f64]) -> f64 {
        let v = DVector::from_column_slice(v);
        self.dry.iter().map(|(c, _)| c.dot(&v).abs()).fold(f64::INFINITY, f64::min)
    }

    /// Kinetic, potential and spring energy, J, rotors included.
    pub fn energy(&mut self, q: &[f64], v: &[f64]) -> f64 {
        let rigid = self.model.kinetic_energy(&mut self.data, q, v) + self.model.potential_energy(&mut self.data, q);
        let (q, v) = (DVector::from_column_slice(q), DVector::from_column_slice(v));
        let offset: f64 = self.bias.iter().zip(q.iter()).map(|(b, q)| b * q).sum();
        rigid + 0.5 * (v.dot(&(&self.rotors * &v)) + q.dot(&(&self.stiffness * &q))) - offset
    }

    /// Classical Runge–Kutta steps with the effort held, on motions without dry friction.
    pub fn runge_kutta(&mut self, q: &[f64], v: &[f64], tau: &[f64], dt: f64, steps: usize) -> Vec<f64> {
        let n = q.len();
        let mut x = DVector::from_iterator(2 * n, q.iter().chain(v).copied());
        for _ in 0..steps {
            let mut slope = |x: &DVector<f64>| {
                let (q, v) = x.as_slice().split_at(n);
                let a = self.acceleration(q, v, tau);
                DVector::from_iterator(2 * n, v.iter().copied().chain(a))
            };
            let k1 = slope(&x);
            let k2 = slope(&(&x + 0.5 * dt * &k1));
            let k3 = slope(&(&x + 0.5 * dt * &k2));
            let k4 = slope(&(&x + dt * &k3));
            x += dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        }
        x.as_slice().to_vec()
    }
}

/// The inertia of the payload's link with the payload on it.
pub fn with_body(model: &Model, body: &Payload) -> Inertia {
    let j = model.joint_index(&body.joint).unwrap();
    let [xx, xy, yy, xz, yz, zz] = body.inertia;
    let about_com = glam::DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
    model.joints()[j].inertia.add(&Inertia::from_com(body.mass, body.com.into(), about_com))
}

/// The ten numbers of a link's error.
pub fn delta(error: &LinkInertiaError) -> Inertia {
    let ([x, y, z], [xx, xy, yy, xz, yz, zz]) = (error.first_moment_delta, error.inertia_delta);
    Inertia {
        mass: error.mass_delta,
        first_moment: glam::DVec3::new(x, y, z),
        rotational: glam::DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]),
    }
}

/// Whether the effect holds dry friction.
pub fn is_dry(effect: &Effect) -> bool {
    match effect {
        Effect::CoulombFriction(_) => true,
        Effect::JointCoupling(e) => e.coulomb > 0.0,
        _ => false,
    }
}

/// A state whose speeds, and sums of speeds that rub, are all above `least`.
pub fn moving_state(draw: &mut Draw, reference: &Reference, n: usize, least: f64) -> (Vec<f64>, Vec<f64>) {
    loop {
        let (q, v) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0));
        if reference.least_speed(&v) > least && v.iter().all(|v| v.abs() > least) {
            return (q, v);
        }
    }
}
