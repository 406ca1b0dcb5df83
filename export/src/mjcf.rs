//! A whole MJCF model of the corrected robot: bodies, joints, what stands between motors and links, drives.

mod carry;
mod step;

pub use carry::carry;

use crate::number::{number, numbers, vector};
use crate::totals::Totals;
use crate::xml::attribute;
use gapscope_dynamics::{Inertia, Joint, JointKind, Model, Placement};
use gapscope_effects::{Effect, Transmission};
use glam::{DMat3, DQuat, DVec3};
use nalgebra::Matrix3;
use step::{BRISTLE, BRISTLE_DAMPING, timestep};
use xmlwriter::{Indent, Options, XmlWriter};

/// Mass of a body that has none, kg, and its moments, kg m²: MuJoCo refuses a moving body without. Far below what any robot
/// notices, far above the 1e-15 below which MuJoCo takes it for nothing.
const NEXT_TO_NOTHING: (f64, f64) = (1e-6, 1e-9);

/// Part of a step that dry friction takes to stop a joint, and the constraint's impedance. MuJoCo's defaults let a joint creep
/// at up to .02 s · acceleration before friction takes its full size; these at a step's.
const STOP: (f64, f64) = (1.0, 0.99);

/// Impedance of the contact of a play, next to MuJoCo's least, .0001: the less, the nearer the constraint is to a spring. One
/// part in 1/SOFT of the torque that would stop the two sides at once comes on top.
const SOFT: f64 = 1e-3;

/// The model as MJCF, for MuJoCo 4.0.
pub fn write(nominal: &Model, totals: &Totals, effects: &[Effect]) -> String {
    let step = timestep(nominal, totals, effects);
    let options = Options { indent: Indent::Spaces(2), ..Options::default() };
    let mut writer = Writer { xml: XmlWriter::new(options), model: &totals.model, totals, step };
    writer.mujoco(effects);
    writer.xml.end_document()
}

struct Writer<'a> {
    xml: XmlWriter,
    /// The bodies with the effects.
    model: &'a Model,
    totals: &'a Totals,
    /// s.
    step: f64,
}

/// Moments with what a body next to nothing has, where one of them is less: MuJoCo refuses moments that are not positive.
fn positive(inertia: DMat3) -> DMat3 {
    let least = Matrix3::from_column_slice(&inertia.to_cols_array()).symmetric_eigenvalues().min();
    if least >= NEXT_TO_NOTHING.1 {
        inertia
    } else {
        inertia + DMat3::from_diagonal((NEXT_TO_NOTHING.1 - least) * DVec3::ONE)
    }
}

/// Name of the rotor's joint of an elastic drive.
pub fn motor_joint(joint: &str) -> String {
    format!("{joint}_motor")
}

impl Writer<'_> {
    fn mujoco(&mut self, effects: &[Effect]) {
        self.xml.start_element("mujoco");
        self.set("model", self.model.name());
        let physical = self.model.joints().iter().all(|joint| joint.inertia.is_physical());
        self.xml.start_element("compiler");
        self.set("angle", "radian");
        if !physical {
            self.set("balanceinertia", "true");
        }
        self.xml.end_element();
        self.xml.start_element("option");
        self.set("timestep", &number(self.step));
        self.set("integrator", "implicitfast");
        self.set("gravity", &vector(self.model.gravity()));
        self.xml.end_element();
        self.xml.start_element("worldbody");
        self.children(None);
        self.xml.end_element();
        self.tendons();
        self.actuators(effects);
        self.xml.end_element();
    }

    fn set(&mut self, name: &str, value: &str) {
        self.xml.write_attribute(name, &attribute(value));
    }

    /// Sets what is not its default.
    fn set_number(&mut self, name: &str, value: f64, default: f64) {
        if value != default {
            self.set(name, &number(value));
        }
    }

    /// The bodies that hang from a link.
    fn children(&mut self, parent: Option<usize>) {
        let model = self.model;
        for (j, joint) in model.joints().iter().enumerate().filter(|(_, joint)| joint.parent == parent) {
            if let Some(transmission) = self.rotor(j).copied() {
                self.rotor_body(joint, &transmission);
            }
            self.xml.start_element("body");
            self.set("name", &joint.link);
            self.place(&joint.placement);
            self.inertial(&joint.inertia);
            self.joint(j, joint);
            self.children(Some(j));
            self.xml.end_element();
        }
    }

    /// What stands between motor and link of a joint whose motor turns on its own.
    fn rotor(&self, joint: usize) -> Option<&Transmission> {
        self.totals.transmissions.iter().find(|t| t.joint == joint && t.rotor > 0.0)
    }

    fn place(&mut self, placement: &Placement) {
        self.set("pos", &vector(placement.translation));
        if placement.rotation != DMat3::IDENTITY {
            let q = DQuat::from_mat3(&placement.rotation).normalize();
            self.set("quat", &numbers(&[q.w, q.x, q.y, q.z]));
        }
    }

    fn inertial(&mut self, inertia: &Inertia) {
        self.xml.start_element("inertial");
        match inertia.center_of_mass() {
            Some(com) => {
                let i = positive(inertia.about_center_of_mass());
                let (x, y, z) = (i.x_axis, i.y_axis, i.z_axis);
                self.set("mass", &number(inertia.mass));
                self.set("pos", &vector(com));
                self.set("fullinertia", &numbers(&[x.x, y.y, z.z, x.y, x.z, y.z]));
            }
            None => self.nothing(),
        }
        self.xml.end_element();
    }

    fn nothing(&mut self) {
        self.set("mass", &number(NEXT_TO_NOTHING.0));
        self.set("pos", "0 0 0");
        self.set("diaginertia", &numbers(&[NEXT_TO_NOTHING.1; 3]));
    }

    /// What hinge and slide, of link and rotor, have in common.
    fn start_joint(&mut self, name: &str, j: usize, joint: &Joint) {
        self.xml.start_element("joint");
        self.set("name", name);
        if joint.kind == JointKind::Prismatic {
            self.set("type", "slide");
        }
        self.set("axis", &vector(joint.axis));
        self.set_number("ref", self.totals.offset[j], 0.0);
    }

    fn joint(&mut self, j: usize, joint: &Joint) {
        let t = self.totals;
        self.start_joint(&joint.name, j, joint);
        if let (Some(lower), Some(upper)) = (joint.limits.lower, joint.limits.upper) {
            self.set("range", &numbers(&[lower, upper]));
        }
        self.set_number("damping", t.damping[j], 0.0);
        if t.friction[j] > 0.0 {
            self.set("frictionloss", &number(t.friction[j]));
            self.stop("solreffriction", "solimpfriction");
        }
        self.set_number("armature", t.armature[j].max(0.0), 0.0);
        if t.stiffness[j] > 0.0 {
            self.set("stiffness", &number(t.stiffness[j]));
            // In what the encoder shows, as `range` and `ref` are.
            self.set_number("springref", t.rest[j] + t.offset[j], 0.0);
        }
        self.xml.end_element();
    }

    /// How fast dry friction stops what it acts on.
    fn stop(&mut self, solref: &str, solimp: &str) {
        // Negative numbers are stiffness and damping themselves; dry friction has no stiffness.
        self.set(solref, &numbers(&[-1.0, -STOP.0 / self.step]));
        self.set(solimp, &numbers(&[STOP.1, STOP.1, 0.001]));
    }

    /// A rotor that turns about the joint's axis. Its inertia is that of an armature: it does not feel its carrier turn.
    fn rotor_body(&mut self, joint: &Joint, transmission: &Transmission) {
        self.xml.start_element("body");
        self.set("name", &format!("{}_rotor", joint.name));
        self.place(&joint.placement);
        self.xml.start_element("inertial");
        self.nothing();
        self.xml.end_element();
        self.start_joint(&motor_joint(&joint.name), transmission.joint, joint);
        self.set("armature", &number(transmission.rotor));
        self.xml.end_element();
        self.xml.end_element();
    }

    fn tendons(&mut self) {
        let t = self.totals;
        let turning: Vec<&Transmission> = t.transmissions.iter().filter(|t| t.rotor > 0.0).collect();
        if turning.is_empty() && t.couplings.is_empty() {
            return;
        }
        self.xml.start_element("tendon");
        for drive in turning {
            let joint = self.model.joints()[drive.joint].name.clone();
            self.xml.start_element("fixed");
            self.set("name", &format!("{joint}_wind_up"));
            if drive.gap > 0.0 {
                self.play(drive);
            } else {
                self.set("springlength", "0 0");
                self.set("stiffness", &number(drive.stiffness));
                self.set_number("damping", drive.damping, 0.0);
            }
            self.part(&motor_joint(&joint), 1.0);
            self.part(&joint, -1.0);
            self.xml.end_element();
        }
        for coupling in &t.couplings {
            let [a, b] = &coupling.joints;
            self.xml.start_element("fixed");
            self.set("name", &format!("{a}_{b}_coupling"));
            self.set_number("damping", coupling.viscous, 0.0);
            if coupling.coulomb > 0.0 {
                self.set("frictionloss", &number(coupling.coulomb));
                self.stop("solreffriction", "solimpfriction");
            }
            self.set_number("armature", coupling.armature, 0.0);
            self.part(a, 1.0);
            self.part(b, coupling.ratio);
            self.xml.end_element();
        }
        self.xml.end_element();
    }

    /// Play as a tendon between limits: as our contact, a limit presses and never pulls, and nothing acts between the two. A
    /// constraint of impedance d passes on d/((1 − d) A) · (stiffness · depth + damping · rate) where A, 1/kg m², is how easily
    /// the tendon gives way in the zero pose (MuJoCo's documentation, "Computation: constraint model").
    fn play(&mut self, drive: &Transmission) {
        let gives_way = 1.0 / drive.rotor + self.totals.mobility[drive.joint];
        self.set("limited", "true");
        self.set("range", &numbers(&[-0.5 * drive.gap, 0.5 * drive.gap]));
        // MuJoCo divides what stands here by the impedance.
        let of_constraint = |of_force: f64| -of_force * gives_way * (1.0 - SOFT);
        self.set("solreflimit", &numbers(&[of_constraint(drive.stiffness), of_constraint(drive.damping)]));
        self.set("solimplimit", &numbers(&[SOFT, SOFT, 1.0]));
    }

    fn part(&mut self, joint: &str, coefficient: f64) {
        self.xml.start_element("joint");
        self.set("joint", joint);
        self.set("coef", &number(coefficient));
        self.xml.end_element();
    }

    fn actuators(&mut self, effects: &[Effect]) {
        self.xml.start_element("actuator");
        let model = self.model;
        for (j, joint) in model.joints().iter().enumerate() {
            self.motor(j, joint);
        }
        for effect in effects {
            match effect {
                Effect::StribeckFriction(e) => {
                    for (joint, &coulomb) in &e.coulomb {
                        let at_rest = e.r#static.get(joint).copied().unwrap_or(coulomb);
                        let velocity = e.stribeck_velocity.get(joint).copied().unwrap_or(1.0);
                        let inertia = model.joint_index(joint).map_or(0.0, |j| self.totals.inertia[j]);
                        let stiffness = at_rest / BRISTLE;
                        let damping = 2.0 * BRISTLE_DAMPING * (stiffness * inertia).sqrt();
                        self.bristles(joint, "stribeck", [stiffness, damping, coulomb, at_rest, velocity]);
                    }
                }
                Effect::PreslidingFriction(e) => {
                    for (joint, &f) in &e.coulomb {
                        let stiffness = e.bristle_stiffness.get(joint).copied().unwrap_or(f / BRISTLE);
                        self.bristles(joint, "presliding", [stiffness, 0.0, f, f, 1.0]);
                    }
                }
                Effect::TorqueRipple(e) => {
                    for (joint, &amplitude) in &e.amplitude {
                        let cycles = e.cycles.get(joint).copied().unwrap_or(1.0);
                        let phase = e.phase.get(joint).copied().unwrap_or(0.0);
                        let offset = model.joint_index(joint).map_or(0.0, |j| self.totals.offset[j]);
                        self.start_passive(joint, "ripple");
                        // Cogging goes by the measured position, ripple by the true one.
                        self.set("cogging", &numbers(&[amplitude, cycles, phase - cycles * offset]));
                        self.xml.end_element();
                    }
                }
                _ => {}
            }
        }
        self.xml.end_element();
    }

    /// The drive of a joint: delay, lag, gain, bias and limit, in this order.
    fn motor(&mut self, j: usize, joint: &Joint) {
        let t = self.totals;
        let name = if self.rotor(j).is_some() { motor_joint(&joint.name) } else { joint.name.clone() };
        self.xml.start_element("general");
        self.set("name", &joint.name);
        self.set("joint", &name);
        if let Some(effort) = joint.limits.effort {
            self.set("ctrlrange", &numbers(&[-effort, effort]));
        }
        if t.limit[j].is_finite() {
            self.set("forcerange", &numbers(&[-t.limit[j], t.limit[j]]));
        }
        if t.delay > 0.0 {
            self.set("delay", &number(t.delay));
            // Read at the start of a step, the line between two commands is their mean over the step, each held, as our
            // own delay has it; the nearest one before would be late by up to a step.
            self.set("interp", "linear");
            // One more than the delay spans, as a part of a step counts.
            self.set("nsample", &number((t.delay / self.step).ceil() + 1.0));
        }
        if t.lag > 0.0 {
            self.set("dyntype", "filterexact");
            self.set("dynprm", &number(t.lag));
        }
        self.set("gainprm", &number(t.gain[j]));
        if t.bias[j] != 0.0 {
            self.set("biastype", "affine");
            self.set("biasprm", &numbers(&[t.bias[j], 0.0, 0.0]));
        }
        self.xml.end_element();
    }

    /// LuGre friction: stiffness, damping, friction at speed and at rest, and the speed between.
    fn bristles(&mut self, joint: &str, name: &str, mut lugre: [f64; 5]) {
        if lugre[3] <= 0.0 {
            return;
        }
        // The law divides by the friction at speed.
        lugre[2] = lugre[2].max(1e-6 * lugre[3]);
        self.start_passive(joint, name);
        self.set("lugre", &numbers(&lugre));
        self.xml.end_element();
    }

    /// A motor without terminals, which only resists: no constant, so no current.
    fn start_passive(&mut self, joint: &str, name: &str) {
        self.xml.start_element("dcmotor");
        self.set("name", &format!("{joint}_{name}"));
        self.set("joint", joint);
        self.set("input", "none");
        self.set("motorconst", "0");
        self.set("resistance", "1");
    }
}
