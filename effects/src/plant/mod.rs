//! A robot model with effects: inverse dynamics with them, and a step in time with them.
//!
//! Each effect puts its physics into the few elements a plant is made of: an actuation chain, inertias, gravity, springs,
//! ripple, contacts, drives (motors that turn on their own) and *directions*, combinations of joint speeds s = cᵀq̇ along
//! which friction or rotor inertia acts.

mod actuation;
mod drive;
mod elements;
mod friction;
mod hold;
mod jacobian;
mod residual;
mod state;
mod step;

pub use drive::Transmission;
pub use elements::Elements;
pub use friction::{Bristle, Direction};

use crate::error::{EffectError, check};
use crate::kind::Kind;
use crate::motion::{Motion, mean_size};
pub use actuation::Actuation;
use drive::Drive;
use friction::Row;
use gapscope_dynamics::{Data, Inertia, Model};
use glam::DVec3;
use jacobian::Tangent;
use nalgebra::DMatrix;
use step::Scratch;

/// Longest part of a step with play in a gear, s.
const LONGEST_WITH_PLAY: f64 = 2.5e-4;

/// A robot model with effects. As a model that steps it is the linearly implicit midpoint rule with set-valued dry friction:
///
/// (M + ½h B + ¼h² K) Δv = h (τ_eff − C q̇ − g − B v − K (q + ½h v)) − Σ c_i λ_i, |λ_i| ≤ h f_i,
///
/// with M, C, g at the midpoint, and λ_i such that the direction sticks (s⁺ = 0) where |λ_i| < h f_i and else opposes s⁺
/// (Moreau's time stepping; Stewart and Trinkle, Int. J. Num. Meth. Eng. 39 1996). Second order where motion is smooth,
/// first order at a reversal; it sticks without chatter and never creates energy by friction.
///
/// # State
/// The first 2n numbers of x are what the sensors would show: positions with the zero offset, of the link or, after
/// [`Plant::with_motor_encoders`], of the motor. The physics takes the offset off. Hidden state follows where an effect
/// has some: time since the start of the episode, past efforts, lagged efforts, bristles, and the wind-up of drives with
/// its rate. The first step after a start fills it from the effort it is given, as if that effort had been there before.
#[derive(Debug, Clone)]
pub struct Plant {
    dt: f64,
    model: Model,
    data: Data,
    pub(crate) actuation: Actuation,
    pub(crate) stiffness: Vec<f64>,
    /// Torque of the parallel springs at position zero, N m.
    pub(crate) spring_torque: Vec<f64>,
    /// Encoder zero offsets, measured − true.
    pub(crate) offset: Vec<f64>,
    pub(crate) ripples: Vec<Ripple>,
    pub(crate) contacts: Vec<Contact>,
    /// Where a force on each link acts: the centre of mass that its description has, m, in the link's frame. That of what was
    /// found of a link may lie anywhere where logs show no mass.
    pub(crate) centers: Vec<DVec3>,
    pub(crate) bristles: Vec<Bristle>,
    /// Whether friction changes with time.
    pub(crate) drifts: bool,
    directions: Vec<Direction>,
    drives: Vec<Drive>,
    motor_encoders: bool,
    rows: Vec<Row>,
    /// Parts in which a step is taken: impacts in the play of a gear need shorter ones.
    substeps: usize,
    scratch: Scratch,
    tangent: Tangent,
}

/// amplitude · sin(cycles · q + phase) on one joint.
#[derive(Debug, Clone, Copy)]
pub struct Ripple {
    /// Index of the joint.
    pub joint: usize,
    /// N m (N).
    pub amplitude: f64,
    /// Per radian (m) of the joint's true position.
    pub cycles: f64,
    /// rad.
    pub phase: f64,
}

impl Ripple {
    pub(crate) fn torque(&self, q: f64) -> f64 {
        self.amplitude * (self.cycles * q + self.phase).sin()
    }
}

/// A force at a link's centre of mass during some intervals.
#[derive(Debug, Clone)]
pub(crate) struct Contact {
    pub(crate) link: usize,
    pub(crate) force: DVec3,
    /// Where it acts, m, in the link's frame.
    pub(crate) point: DVec3,
    pub(crate) intervals: Vec<[f64; 2]>,
}

impl Contact {
    /// Part of the time from `start` to `end` during which the force is there.
    fn share(&self, start: f64, end: f64) -> f64 {
        let overlap = |[from, to]: [f64; 2]| (to.min(end) - from.max(start)).max(0.0);
        (self.intervals.iter().copied().map(overlap).sum::<f64>() / (end - start)).min(1.0)
    }
}

impl Plant {
    /// The robot as its URDF has it, damping and friction of `<dynamics>` included. `dt` is the length of a step in s.
    pub fn nominal(model: &Model, dt: f64) -> Plant {
        let mut plant = Plant::bare(model, dt);
        plant.assemble();
        plant
    }

    /// Friction that would drive a joint is no friction. What rounding leaves below zero is taken as zero.
    pub(crate) fn check_friction(&mut self) -> Result<(), EffectError> {
        for direction in &mut self.directions {
            let declared = match direction.parts.as_slice() {
                &[(j, _)] => (self.model.joints()[j].damping, self.model.joints()[j].friction),
                _ => (0.0, 0.0),
            };
            for (kind, parameter, sum, declared) in [
                (Kind::ViscousFriction, "viscous", &mut direction.viscous, declared.0),
                (Kind::CoulombFriction, "coulomb", &mut direction.coulomb, declared.1),
            ] {
                let expected = "at least the negative of what the URDF declares";
                check(kind, parameter, *sum - declared, *sum >= -1e-9 * declared, expected)?;
                *sum = sum.max(0.0);
            }
        }
        Ok(())
    }

    pub(crate) fn bare(model: &Model, dt: f64) -> Plant {
        let n = model.dof();
        let mut plant = Plant {
            dt,
            model: model.clone(),
            data: Data::new(model),
            actuation: Actuation::ideal(n),
            stiffness: vec![0.0; n],
            spring_torque: vec![0.0; n],
            offset: vec![0.0; n],
            ripples: Vec::new(),
            contacts: Vec::new(),
            centers: model.joints().iter().map(|j| j.inertia.center_of_mass().unwrap_or_default()).collect(),
            bristles: Vec::new(),
            drifts: false,
            directions: Vec::new(),
            drives: Vec::new(),
            motor_encoders: false,
            rows: Vec::new(),
            substeps: 1,
            scratch: Scratch::new(n, 0, 0),
            tangent: Tangent::new(n),
        };
        for (j, joint) in model.joints().iter().enumerate() {
            if joint.damping != 0.0 || joint.friction != 0.0 {
                let direction = plant.direction(&[(j, 1.0)]);
                direction.viscous += joint.damping;
                direction.coulomb += joint.friction;
            }
        }
        plant
    }

    /// Settles what depends on several effects: rotors of drives, rows of the friction solver, sizes of buffers.
    pub(crate) fn assemble(&mut self) {
        let n = self.model.dof();
        let middle: Vec<f64> = self
            .model
            .joints()
            .iter()
            .map(|j| j.limits.lower.zip(j.limits.upper).map_or(0.0, |(lower, upper)| 0.5 * (lower + upper)))
            .collect();
        let mut mass = DMatrix::zeros(n, n);
        self.model.mass_matrix(&mut self.data, &middle, &mut mass);
        let mut motors = 0;
        for drive in &mut self.drives {
            drive.stiffen(mass[(drive.joint, drive.joint)]);
            // An armature on the joint of a drive is the inertia of its rotor.
            if let Some(direction) = self.directions.iter_mut().find(|d| d.parts == [(drive.joint, 1.0)]) {
                drive.rotor = std::mem::take(&mut direction.inertia);
            }
            if drive.rotor > 0.0 {
                drive.motor = Some(n + motors);
                motors += 1;
            }
        }
        let directions = self.directions.iter().enumerate().map(|(i, d)| Row::dry(i, d));
        let bristles = self.bristles.iter().enumerate().map(|(i, b)| Row::bristle(i, b));
        let has_play = |drive: &Drive| drive.motor.is_some() && drive.half_gap > 0.0;
        let play = self.drives.iter().enumerate().filter(|(_, d)| has_play(d)).map(|(i, d)| Row::play(i, d));
        if self.drives.iter().any(has_play) {
            self.substeps = (self.dt / LONGEST_WITH_PLAY - 1e-9).ceil().max(1.0) as usize;
        }
        self.rows = directions.chain(bristles).chain(play).collect();
        self.scratch = Scratch::new(n, motors, self.directions.len());
    }

    /// The same plant with the encoders of elastic joints, and of joints with play, on the motor's side:
    /// positions and velocities of the state are then the motor's.
    #[must_use]
    pub fn with_motor_encoders(mut self) -> Plant {
        self.motor_encoders = true;
        self
    }

    /// Gain and bias (N m or N) of each joint's drive.
    pub fn drives(&self) -> Vec<(f64, f64)> {
        self.actuation.gain.iter().copied().zip(self.actuation.bias.iter().copied()).collect()
    }

    /// What each newton metre more that a joint takes needs of the torque that loads its gear, joint-major like the motion's
    /// signals: with friction that rises with the load, 1 / (1 − μ sign(q̇) sign(load)), and 1 without or where the joint stands.
    /// The sign of a load that noise drives to and fro is its mean.
    pub fn gears(&self, motion: &Motion) -> Vec<Vec<f64>> {
        let mut gears: Vec<Vec<f64>> = motion.v.iter().map(|v| vec![1.0; v.len()]).collect();
        for direction in self.directions.iter().filter(|d| d.load > 0.0) {
            let &[(j, _)] = direction.parts.as_slice() else { continue };
            let noise = self.actuation.gain[j] * motion.effort_noise.get(j).copied().unwrap_or(0.0);
            for ((gear, v), load) in gears[j].iter_mut().zip(&motion.v[j]).zip(&motion.load[j]) {
                if v.abs() >= motion.standstill[j] {
                    *gear = 1.0 / (1.0 - direction.load * v.signum() * mean_size(*load, noise).1);
                }
            }
        }
        gears
    }

    /// The rigid-body model with the inertial effects and the gravity of this plant.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The springs and plays between motors and links, one for each joint that has any.
    pub fn transmissions(&self) -> Vec<Transmission> {
        self.drives.iter().map(Drive::transmission).collect()
    }

    pub(crate) fn joint(&self, kind: Kind, joint: &str) -> Result<usize, EffectError> {
        self.model.joint_index(joint).ok_or_else(|| EffectError::UnknownJoint {
            kind,
            joint: joint.to_owned(),
            known: self.model.joints().iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// The direction with these parts, made where there is none yet.
    pub(crate) fn direction(&mut self, parts: &[(usize, f64)]) -> &mut Direction {
        let index = self.directions.iter().position(|d| d.parts == parts).unwrap_or_else(|| {
            self.directions.push(Direction { parts: parts.to_vec(), ..Direction::default() });
            self.directions.len() - 1
        });
        &mut self.directions[index]
    }

    /// The drive of a joint, made where there is none yet.
    pub(crate) fn drive(&mut self, joint: usize) -> &mut Drive {
        let index = self.drives.iter().position(|d| d.joint == joint).unwrap_or_else(|| {
            self.drives.push(Drive::rigid(joint));
            self.drives.len() - 1
        });
        &mut self.drives[index]
    }

    pub(crate) fn set_gravity(&mut self, gravity: DVec3) {
        self.model = self.model.clone().with_gravity(gravity);
    }

    pub(crate) fn add_inertia(&mut self, joint: usize, inertia: Inertia) {
        let sum = self.model.joints()[joint].inertia.add(&inertia);
        self.model = self.model.clone().with_inertia(joint, sum);
    }

    /// Smallest squared pivot of the mass matrix at `q` over its largest diagonal entry; near zero where no acceleration
    /// follows from a torque. Allocates.
    pub fn reciprocal_condition(&self, q: &[f64]) -> f64 {
        let mut mass = DMatrix::zeros(q.len(), q.len());
        self.model.mass_matrix(&mut Data::new(&self.model), q, &mut mass);
        for direction in &self.directions {
            for &(i, wi) in &direction.parts {
                for &(j, wj) in &direction.parts {
                    mass[(i, j)] += wi * wj * direction.inertia;
                }
            }
        }
        let largest = mass.diagonal().max();
        match mass.cholesky() {
            Some(factor) => factor.l().diagonal().iter().map(|l| l * l).fold(f64::INFINITY, f64::min) / largest,
            None => 0.0,
        }
    }
}
