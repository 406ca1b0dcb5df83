//! Servo arms drawn at random: chains of 1 to 7 small links, each joint with a position servo.

use crate::robot::Robot;
use gapscope_dynamics::{Data, Model, UrdfError};
use nalgebra::DMatrix;
use rand::RngExt;
use rand_pcg::Pcg64;
use std::fmt::Write;

/// Most joints of an arm.
const JOINTS: usize = 7;
/// Axes of joints 1 to 7 of an arm of several: the base turns about the vertical, then shoulder, elbow, forearm, wrist.
const AXES: [&str; JOINTS] = ["0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1", "0 1 0"];
/// Length of the first link, m, and its mass, kg; each link is this part of the one before, times a factor of its own.
const FIRST: [[f64; 2]; 2] = [[0.10, 0.18], [0.12, 0.30]];
const TAPER: f64 = 0.85;
/// Set point error that holds a joint against the greatest weight of its links, rad.
const SAG: [f64; 2] = [0.03, 0.12];
/// Natural frequency that a servo has at least, rad/s: the greater of both stiffnesses is taken.
const FREQUENCY: [f64; 2] = [15.0, 40.0];
/// Time constant of the closed loop, damping over stiffness, s.
const TIME: [f64; 2] = [0.03, 0.1];
/// Friction of size 1 is what a set point error of this size overcomes, rad: 12-bit encoders have steps of 1.5 mrad.
const FRICTION: f64 = 0.02;
/// Payload of size 1, as a part of the arm's mass, and force of size 1, as a part of its weight.
const PAYLOAD: f64 = 0.15;
const FORCE: f64 = 0.3;
/// Part of its time constant in which the fastest damping of an arm is stepped, and least and greatest step of the physics, s.
const RESOLVED: f64 = 0.15;
const STEPS: [f64; 2] = [1e-4, 5e-4];
/// Postures at which weight and inertia are looked at.
const POSTURES: usize = 24;
/// How far joints turn from the middle, rad.
const REACH: f64 = 1.5;

/// One joint's servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    /// N m/rad.
    pub(crate) stiffness: f64,
    /// N m s/rad.
    pub(crate) damping: f64,
    /// Greatest torque of the stiffness, N m.
    pub(crate) torque_limit: f64,
    /// rad/s.
    pub(crate) speed_limit: f64,
    /// rad.
    pub(crate) dead_band: f64,
    /// Time by which set points act late, s.
    pub(crate) latency: f64,
}

/// An arm with the greatest weight that each joint holds, N m.
#[derive(Debug, Clone)]
pub(crate) struct Arm {
    pub(crate) robot: Robot,
    pub(crate) drives: Vec<Drive>,
    pub(crate) weight: Vec<f64>,
    /// Step of the physics that its fastest damping asks for, s.
    pub(crate) step: f64,
}

/// Draws an arm.
pub(crate) fn arm(random: &mut Pcg64) -> Result<Arm, UrdfError> {
    let n = random.random_range(1..=JOINTS);
    let urdf = urdf(n, random);
    let model = Model::from_urdf(&urdf)?.model;
    let (mut weight, mut inertia, mut lightest) = (vec![0.0_f64; n], vec![0.0; n], vec![f64::INFINITY; n]);
    let (mut data, mut mass, mut gravity) = (Data::new(&model), DMatrix::zeros(n, n), vec![0.0; n]);
    for _ in 0..POSTURES {
        let q: Vec<f64> = (0..n).map(|_| random.random_range(-REACH..REACH)).collect();
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.mass_matrix(&mut data, &q, &mut mass);
        let free = mass.clone().try_inverse();
        for j in 0..n {
            // What a joint feels of the arm where all others give way.
            let alone = free.as_ref().map_or(mass[(j, j)], |free| 1.0 / free[(j, j)]);
            lightest[j] = lightest[j].min(alone);
            weight[j] = weight[j].max(gravity[j].abs());
            inertia[j] += mass[(j, j)] / POSTURES as f64;
        }
    }
    let drives: Vec<Drive> = (0..n)
        .map(|j| {
            let frequency = random.random_range(FREQUENCY[0]..FREQUENCY[1]);
            let held = weight[j] / random.random_range(SAG[0]..SAG[1]);
            let stiffness = held.max(inertia[j] * frequency * frequency);
            let damping = stiffness * random.random_range(TIME[0]..TIME[1]);
            let none = f64::INFINITY;
            Drive { stiffness, damping, torque_limit: none, speed_limit: none, dead_band: 0.0, latency: 0.0 }
        })
        .collect();
    let total: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
    let robot = Robot {
        name: format!("servo_arm{n}"),
        urdf,
        friction: drives.iter().map(|drive| FRICTION * drive.stiffness).collect(),
        inertia,
        middle: vec![0.0; n],
        payload: PAYLOAD * total,
        force: FORCE * total * model.gravity().length(),
        model,
    };
    let fastest = drives.iter().zip(&lightest).map(|(drive, inertia)| drive.damping / inertia).fold(0.0, f64::max);
    let step = (RESOLVED / fastest).clamp(STEPS[0], STEPS[1]);
    Ok(Arm { robot, drives, weight, step })
}

fn urdf(n: usize, random: &mut Pcg64) -> String {
    let mut text = String::from("<robot name=\"servo_arm\">\n  <link name=\"base\"/>\n");
    let [mut length, mut mass] = FIRST.map(|[least, most]| random.random_range(least..most));
    let mut offset = 0.0;
    for j in 0..n {
        // A pendulum of one joint swings in a vertical plane.
        let axis = if n == 1 { AXES[1] } else { AXES[j] };
        let (length_here, mass_here) = (length * random.random_range(0.7..1.2), mass * random.random_range(0.7..1.3));
        let [x, y] = std::array::from_fn(|_| random.random_range(-0.015..0.015));
        let big = mass_here * length_here * length_here / 12.0;
        // A box as wide as a servo, 3 cm.
        let small = mass_here * 0.03 * 0.03 / 6.0;
        let parent = if j == 0 { "base".to_owned() } else { format!("link{j}") };
        let number = j + 1;
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            r#"  <link name="link{number}">
    <inertial>
      <origin xyz="{x:.4} {y:.4} {half:.4}"/>
      <mass value="{mass_here:.4}"/>
      <inertia ixx="{big:.3e}" ixy="0" ixz="0" iyy="{big:.3e}" iyz="0" izz="{small:.3e}"/>
    </inertial>
  </link>
  <joint name="joint{number}" type="revolute">
    <parent link="{parent}"/>
    <child link="link{number}"/>
    <origin xyz="0 0 {offset:.4}"/>
    <axis xyz="{axis}"/>
    <limit lower="-2.6" upper="2.6" effort="10" velocity="12"/>
  </joint>
"#,
            half = 0.5 * length_here,
            big = big + small
        );
        offset = length_here;
        length *= TAPER;
        mass *= TAPER;
    }
    text.push_str("</robot>\n");
    text
}
