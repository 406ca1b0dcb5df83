//! Used arms: a little is off everywhere, and one thing may be beside that.
//!
//! Each fault is there with probability 0.7. With u and f as in [`crate::draw`]: Coulomb f u and viscous f u per rad/s in all
//! joints, or one of the two; every link's mass within 8 %, its centre within 1 cm, its inertia stretched within 10 % a
//! direction; rotors 0.15 f u s²/rad and biases ± f u in all joints. On arms that are used much: mass within a third, centre
//! within 2 cm, stretch within 20 %; a tool as the payload of `draw`, missing in the URDF or there alone; a cable's spring at
//! one joint; and Coulomb friction larger one way by up to 0.4 of itself, exactly what Coulomb friction and a bias are together.

use crate::case::CaseSpec;
use crate::draw::{Drawn, Sort, difference, draw};
use crate::robot::Robot;
use crate::truth::{Part, SealedEffect, Used};
use gapscope_datasets::{Recipe, ReferenceKind, Sensors, other_body};
use gapscope_dynamics::Model;
use gapscope_effects::{Armature, CoulombFriction, Effect, Kind, LinkInertiaError, TorqueBias, ViscousFriction};
use glam::{DMat3, DQuat, DVec3};
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Probability of each fault, and of friction that differs by direction where there is Coulomb friction.
const THERE: f64 = 0.7;
/// Probability that friction is Coulomb friction alone, and that it is viscous alone.
const ALONE: f64 = 0.2;
/// Most that a link is off by: part of its mass, centre of mass in m, logarithm of its stretch along an axis.
const LINKS: [[f64; 3]; 2] = [[0.08, 0.01, 0.1], [1.0 / 3.0, 0.02, 0.2]];
/// Least and most that friction is larger one way, as a part of itself.
const DIRECTION: [f64; 2] = [0.1, 0.4];
/// Dry friction that stands in for Coulomb friction in the joints that have it.
const DRY: [Kind; 3] = [Kind::StribeckFriction, Kind::PreslidingFriction, Kind::ThermalDrift];
/// Rates of the logs, Hz.
const RATES: [f64; 6] = [100.0, 125.0, 200.0, 250.0, 500.0, 1000.0];
/// Longest physics step, s.
const STEP: f64 = 5e-4;
/// Fewest and most bits of the logged position over a turn.
const BITS: [i32; 2] = [16, 20];
/// Noise of the encoder at the motor, which the servo reads: far below a count of the log, rad.
const MOTOR_NOISE: f64 = 5e-7;
/// Least and greatest cut-off of the logged velocity, Hz; no more than a fifth of the rate.
const CUTOFF: [f64; 2] = [15.0, 60.0];
/// Least and greatest noise of the logged effort, its correlation time in s, and its step; parts of the rms effort.
const EFFORT_NOISE: [f64; 2] = [0.005, 0.015];
const EFFORT_TIME: [f64; 2] = [0.004, 0.03];
const EFFORT_STEP: [f64; 2] = [0.001, 0.005];

/// Joints at which a fault gives way to an effect that would hide it.
#[derive(Default)]
struct Taken {
    coulomb: bool,
    rotor: Vec<usize>,
    bias: Vec<usize>,
    link: Vec<usize>,
}

impl Taken {
    /// What an effect takes.
    fn by(&mut self, effect: &SealedEffect) {
        let is = |kind: Kind| effect.kind == kind.name();
        // One dry friction a joint.
        self.coulomb |= DRY.into_iter().any(is);
        // A drive that winds up has a rotor of its own.
        if is(Kind::JointElasticity) || is(Kind::Backlash) {
            self.rotor.extend(&effect.joints);
        }
        // A bias moves a spring's rest position, and a payload is the last link's error.
        if is(Kind::ParallelSpring) {
            self.bias.extend(&effect.joints);
        }
        if is(Kind::Payload) {
            self.link.extend(&effect.joints);
        }
    }
}

/// A used arm: the robot as its URDF has it, and all that it has beside that, calibration first.
pub(crate) fn arm(robot: &Robot, used: Used, spec: &CaseSpec, random: &mut Pcg64) -> (Robot, Vec<Drawn>) {
    let further: Vec<Drawn> = spec.sorts.iter().map(|sort| further(*sort, robot, spec, random)).collect();
    let (mut robot, mut drawn) = (robot.clone(), Vec::new());
    if used == Used::Much {
        if random.random_bool(THERE) {
            let tool = known(Kind::Payload, &robot, spec, random);
            // In the URDF there is one too many as often as it is missing.
            drawn.push(if random.random_bool(0.5) { too_many(&mut robot, tool) } else { tool });
        }
        if random.random_bool(THERE) {
            drawn.push(known(Kind::ParallelSpring, &robot, spec, random));
        }
    }
    let mut taken = Taken::default();
    drawn.iter().chain(&further).for_each(|drawn| taken.by(&drawn.sealed));
    let mut workshop = Workshop { robot: &robot, spec, taken, random };
    let friction = workshop.friction(used);
    drawn.splice(0..0, friction);
    drawn.extend(workshop.links(used));
    drawn.extend(workshop.rotors());
    drawn.iter_mut().for_each(|drawn| drawn.sealed.part = Some(Part::Calibration));
    drawn.extend(further);
    (robot, drawn)
}

/// How a used arm moves and what its sensors make of it.
pub(crate) fn recipe(random: &mut Pcg64) -> Recipe {
    let rate = RATES.choose(random).copied().unwrap_or(RATES[0]);
    let count = TAU / 2f64.powi(random.random_range(BITS[0]..=BITS[1]));
    let mut within = |[least, most]: [f64; 2]| random.random_range(least..most);
    let sensors = Sensors {
        position_noise: MOTOR_NOISE,
        log_step: count,
        velocity_cutoff: Some(within(CUTOFF).min(0.2 * rate)),
        effort_noise: within(EFFORT_NOISE),
        effort_noise_time: within(EFFORT_TIME),
        effort_step: within(EFFORT_STEP),
        ..Sensors::IDEAL
    };
    let motion = if random.random_bool(0.5) { ReferenceKind::Fourier } else { ReferenceKind::PointToPoint };
    let substeps = (1.0 / (rate * STEP)).ceil() as usize;
    Recipe { rate, substeps, motion, sensors, ..Recipe::default() }
}

fn known(kind: Kind, robot: &Robot, spec: &CaseSpec, random: &mut Pcg64) -> Drawn {
    draw(Sort::Known(kind), robot, spec.difficulty, spec.episodes + spec.tests, spec.seconds, random)
}

/// What is beside the calibration. Dry friction is drawn until it is in all joints.
fn further(sort: Sort, robot: &Robot, spec: &CaseSpec, random: &mut Pcg64) -> Drawn {
    let everywhere = DRY.map(Sort::Known).contains(&sort);
    loop {
        let mut drawn = draw(sort, robot, spec.difficulty, spec.episodes + spec.tests, spec.seconds, random);
        if !everywhere || drawn.sealed.joints.len() == robot.dof() {
            drawn.sealed.part = Some(Part::Further);
            return drawn;
        }
    }
}

/// Puts a tool into the URDF, so that the arm has it no more than before: what the arm lacks of its description.
fn too_many(robot: &mut Robot, mut tool: Drawn) -> Drawn {
    let [Effect::Payload(body)] = tool.effects.as_mut_slice() else { return tool };
    let mut name = "tool".to_owned();
    while robot.urdf.contains(&format!("\"{name}\"")) || robot.urdf.contains(&format!("\"{name}_mount\"")) {
        name.push('_');
    }
    let link = robot.model.joints().last().map_or("", |joint| joint.link.as_str());
    let ([x, y, z], [xx, xy, yy, xz, yz, zz]) = (body.com, body.inertia);
    let described = format!(
        r#"  <link name="{name}">
    <inertial>
      <origin xyz="{x} {y} {z}"/>
      <mass value="{mass}"/>
      <inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" iyz="{yz}" izz="{zz}"/>
    </inertial>
  </link>
  <joint name="{name}_mount" type="fixed">
    <parent link="{link}"/>
    <child link="{name}"/>
  </joint>
</robot>"#,
        mass = body.mass
    );
    let urdf = robot.urdf.replace("</robot>", &described);
    // A description that cannot be added to stays; then the tool is missing from it.
    let Ok(loaded) = Model::from_urdf(&urdf) else { return tool };
    (robot.urdf, robot.model) = (urdf, loaded.model);
    body.mass = -body.mass;
    body.inertia = body.inertia.map(|i| -i);
    tool.sealed.parameters.insert("mass".into(), json!(body.mass));
    tool
}

/// Where calibration faults are drawn.
struct Workshop<'a> {
    robot: &'a Robot,
    spec: &'a CaseSpec,
    taken: Taken,
    random: &'a mut Pcg64,
}

impl Workshop<'_> {
    fn is_there(&mut self) -> bool {
        self.random.random_bool(THERE)
    }

    /// Joints but those that are taken.
    fn joints(&self, taken: &[usize]) -> Vec<usize> {
        (0..self.robot.dof()).filter(|j| !taken.contains(j)).collect()
    }

    /// Sizes at some joints in the way of friction, `scale` times.
    fn sizes(&mut self, joints: &[usize], scale: f64) -> Vec<f64> {
        let (low, high) = self.spec.difficulty.sizes();
        joints.iter().map(|&j| scale * self.robot.friction[j] * self.random.random_range(low..high)).collect()
    }

    fn sign(&mut self) -> f64 {
        if self.random.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    fn map(&self, joints: &[usize], values: &[f64]) -> BTreeMap<String, f64> {
        joints.iter().zip(values).map(|(&j, &value)| (self.robot.joint(j), value)).collect()
    }

    fn drawn(&self, kind: Kind, joints: Vec<usize>, parameters: Value, effects: Vec<Effect>) -> Option<Drawn> {
        if joints.is_empty() {
            return None;
        }
        let parameters = if let Value::Object(parameters) = parameters { parameters } else { Map::new() };
        let joint_names = joints.iter().map(|&j| self.robot.joint(j)).collect();
        let kind = kind.name().to_owned();
        let sealed = SealedEffect { kind, joints, joint_names, power: vec![], part: None, parameters };
        Some(Drawn { sealed, effects, contacts: vec![], outside: None, rotor: None, motor_encoder: false })
    }

    /// Viscous and Coulomb friction of all joints, and the biases, which friction that differs by direction adds to.
    fn friction(&mut self, used: Used) -> Vec<Drawn> {
        let all = self.joints(&[]);
        let turned = self.joints(&self.taken.bias);
        let (mut found, mut bias) = (Vec::new(), vec![0.0; all.len()]);
        if self.is_there() {
            let which: f64 = self.random.random_range(0.0..1.0);
            if which >= ALONE {
                let b = self.sizes(&all, 1.0);
                let effect = ViscousFriction { viscous: self.map(&all, &b) };
                let effects = vec![Effect::ViscousFriction(effect)];
                found.extend(self.drawn(Kind::ViscousFriction, all.clone(), json!({ "b": b }), effects));
            }
            if which < 1.0 - ALONE && !self.taken.coulomb {
                let fc = self.sizes(&all, 1.0);
                if used == Used::Much && self.is_there() {
                    for &j in &turned {
                        bias[j] += self.sign() * fc[j] * self.random.random_range(DIRECTION[0]..DIRECTION[1]);
                    }
                }
                let effect = CoulombFriction { coulomb: self.map(&all, &fc) };
                let effects = vec![Effect::CoulombFriction(effect)];
                found.extend(self.drawn(Kind::CoulombFriction, all, json!({ "fc": fc }), effects));
            }
        }
        if self.is_there() {
            for (&j, size) in turned.iter().zip(self.sizes(&turned, 1.0)) {
                bias[j] += self.sign() * size;
            }
        }
        let bias: Vec<f64> = turned.iter().map(|&j| bias[j]).collect();
        if bias.iter().any(|b| *b != 0.0) {
            let effects = vec![Effect::TorqueBias(TorqueBias { bias: self.map(&turned, &bias) })];
            found.extend(self.drawn(Kind::TorqueBias, turned, json!({ "bias": bias }), effects));
        }
        found
    }

    /// Every link but a body without mass.
    fn links(&mut self, used: Used) -> Option<Drawn> {
        if !self.is_there() {
            return None;
        }
        let [mass, center, stretch] = LINKS[usize::from(used == Used::Much)];
        let mut joints = self.joints(&self.taken.link);
        joints.retain(|&j| self.robot.model.joints()[j].inertia.mass > 0.0);
        let errors: Vec<LinkInertiaError> = joints.iter().map(|&j| self.link(j, mass, center, stretch)).collect();
        let parameters = json!({
            "mass_delta": errors.iter().map(|e| e.mass_delta).collect::<Vec<_>>(),
            "first_moment_delta": errors.iter().map(|e| e.first_moment_delta).collect::<Vec<_>>(),
            "inertia_delta": errors.iter().map(|e| e.inertia_delta).collect::<Vec<_>>(),
        });
        let effects = errors.into_iter().map(Effect::LinkInertiaError).collect();
        self.drawn(Kind::LinkInertiaError, joints, parameters, effects)
    }

    fn link(&mut self, joint: usize, mass: f64, center: f64, stretch: f64) -> LinkInertiaError {
        let factor = 1.0 + self.random.random_range(-mass..mass);
        let [shift, stretch] = [center, stretch]
            .map(|most| DVec3::from_array(std::array::from_fn(|_| self.random.random_range(-most..most))));
        let turn = DQuat::from_array(std::array::from_fn(|_| self.random.sample(StandardNormal)));
        let axes = DMat3::from_quat(turn.normalize());
        let body = &self.robot.model.joints()[joint].inertia;
        difference(self.robot, joint, &other_body(body, factor, shift, axes, stretch))
    }

    fn rotors(&mut self) -> Option<Drawn> {
        if !self.is_there() {
            return None;
        }
        let joints = self.joints(&self.taken.rotor);
        let ia = self.sizes(&joints, 0.15);
        let effects = vec![Effect::Armature(Armature { armature: self.map(&joints, &ia) })];
        self.drawn(Kind::Armature, joints, json!({ "ia": ia }), effects)
    }
}
