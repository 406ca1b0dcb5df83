//! What a list of effects comes to, joint by joint: the numbers that stand in a file.

use gapscope_dynamics::{Data, Model};
use gapscope_effects::{Effect, EffectError, JointCoupling, Plant, Transmission};
use nalgebra::{DMatrix, DVector};

/// Sums over effects, one number a joint in the model's order, on top of what the nominal robot has.
#[derive(Debug, Clone)]
pub struct Totals {
    /// Bodies and gravity with the effects.
    pub model: Model,
    /// Viscous friction, N m s/rad (N s/m).
    pub damping: Vec<f64>,
    /// Dry friction, N m (N).
    pub friction: Vec<f64>,
    /// Rotor inertia that turns with the joint, kg m² (kg).
    pub armature: Vec<f64>,
    /// Stiffness of the parallel spring, N m/rad (N/m).
    pub stiffness: Vec<f64>,
    /// True position at which it is relaxed, rad (m); 0 without a spring.
    pub rest: Vec<f64>,
    /// Measured position less the true one, rad (m).
    pub offset: Vec<f64>,
    /// Effort delivered over effort commanded.
    pub gain: Vec<f64>,
    /// Effort that is delivered beside that, N m (N).
    pub bias: Vec<f64>,
    /// Greatest effort delivered, N m (N); infinite without one.
    pub limit: Vec<f64>,
    /// Time by which effort acts late, s.
    pub delay: f64,
    /// Time constant of the first-order response, s; 0 without one.
    pub lag: f64,
    /// What turns with two joints.
    pub couplings: Vec<JointCoupling>,
    /// What stands between motors and links.
    pub transmissions: Vec<Transmission>,
    /// What each joint moves by for a torque at its link with all other joints free, in the zero pose, 1/(kg m²) (1/kg): the
    /// diagonal of M⁻¹, without the rotors that turn on their own.
    pub mobility: Vec<f64>,
    /// Inertia about each joint in the middle of the range, rotor included, kg m² (kg).
    pub inertia: Vec<f64>,
}

impl Totals {
    /// The sums of a robot's effects.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn new(nominal: &Model, effects: &[Effect]) -> Result<Totals, EffectError> {
        let n = nominal.dof();
        // The length of the step enters none of the numbers.
        let plant = Plant::new(nominal, effects, 1e-3)?;
        let joints = nominal.joints();
        let mut t = Totals {
            model: plant.model().clone(),
            damping: joints.iter().map(|j| j.damping).collect(),
            friction: joints.iter().map(|j| j.friction).collect(),
            armature: nominal.armature().to_vec(),
            stiffness: vec![0.0; n],
            rest: vec![0.0; n],
            offset: vec![0.0; n],
            gain: vec![1.0; n],
            bias: vec![0.0; n],
            limit: vec![f64::INFINITY; n],
            delay: 0.0,
            lag: 0.0,
            couplings: Vec::new(),
            transmissions: plant.transmissions(),
            mobility: vec![0.0; n],
            inertia: vec![0.0; n],
        };
        for effect in effects {
            t.add(effect);
        }
        for j in 0..n {
            // What the catalogue takes off may leave no more than rounding.
            t.damping[j] = t.damping[j].max(0.0);
            t.friction[j] = t.friction[j].max(0.0);
            if t.stiffness[j] > 0.0 {
                t.rest[j] /= t.stiffness[j];
            }
        }
        // The rotor of an elastic drive turns with its motor.
        for transmission in &t.transmissions {
            t.armature[transmission.joint] -= transmission.rotor;
        }
        let mass = t.mass(&middle(nominal));
        t.inertia = mass.diagonal().iter().copied().collect();
        let mut mass = t.mass(&vec![0.0; n]);
        for coupling in &t.couplings {
            let mut turns = DVector::zeros(n);
            for (joint, by) in coupling.joints.iter().zip([1.0, coupling.ratio]) {
                if let Some(j) = nominal.joint_index(joint) {
                    turns[j] = by;
                }
            }
            mass.ger(coupling.armature, &turns, &turns, 1.0);
        }
        if let Some(inverse) = mass.try_inverse() {
            t.mobility = inverse.diagonal().iter().copied().collect();
        }
        Ok(t)
    }

    /// Mass matrix of the links and of what turns with them, kg m² (kg).
    fn mass(&self, q: &[f64]) -> DMatrix<f64> {
        let n = self.model.dof();
        let mut mass = DMatrix::zeros(n, n);
        self.model.mass_matrix(&mut Data::new(&self.model), q, &mut mass);
        for j in 0..n {
            mass[(j, j)] += self.armature[j] - self.model.armature()[j];
        }
        mass
    }

    fn add(&mut self, effect: &Effect) {
        let model = self.model.clone();
        let sum = |to: &mut Vec<f64>, from: &std::collections::BTreeMap<String, f64>| {
            for (joint, value) in from {
                if let Some(j) = model.joint_index(joint) {
                    to[j] += value;
                }
            }
        };
        match effect {
            Effect::ViscousFriction(e) => sum(&mut self.damping, &e.viscous),
            Effect::CoulombFriction(e) => sum(&mut self.friction, &e.coulomb),
            Effect::Armature(e) => sum(&mut self.armature, &e.armature),
            Effect::JointZeroOffset(e) => sum(&mut self.offset, &e.offset),
            Effect::TorqueBias(e) => sum(&mut self.bias, &e.bias),
            Effect::ParallelSpring(e) => {
                sum(&mut self.stiffness, &e.stiffness);
                let torque = e
                    .stiffness
                    .iter()
                    .map(|(joint, k)| (joint.clone(), k * e.rest_position.get(joint).copied().unwrap_or(0.0)));
                sum(&mut self.rest, &torque.collect());
            }
            Effect::TorqueGainError(e) => {
                for (joint, gain) in &e.gain {
                    if let Some(j) = model.joint_index(joint) {
                        self.gain[j] *= gain;
                    }
                }
            }
            Effect::TorqueSaturation(e) => {
                for (joint, limit) in &e.limit {
                    if let Some(j) = model.joint_index(joint) {
                        self.limit[j] = self.limit[j].min(*limit);
                    }
                }
            }
            Effect::ActuationDelay(e) => self.delay += e.delay,
            Effect::ActuatorLag(e) => self.lag += e.time_constant,
            Effect::JointCoupling(e) => self.couplings.push(e.clone()),
            // Bodies and gravity are in the plant's model; the rest has laws of its own, which targets write one by one.
            Effect::Payload(_)
            | Effect::LinkInertiaError(_)
            | Effect::GravityMisalignment(_)
            | Effect::StribeckFriction(_)
            | Effect::LoadDependentFriction(_)
            | Effect::PreslidingFriction(_)
            | Effect::ThermalDrift(_)
            | Effect::TorqueRipple(_)
            | Effect::JointElasticity(_)
            | Effect::Backlash(_)
            | Effect::ExternalContact(_) => {}
        }
    }
}

/// The middle of every joint's range, rad (m); 0 without one.
fn middle(model: &Model) -> Vec<f64> {
    let of = |limits: &gapscope_dynamics::Limits| limits.lower.zip(limits.upper).map_or(0.0, |(l, u)| 0.5 * (l + u));
    model.joints().iter().map(|joint| of(&joint.limits)).collect()
}
