//! One C99 file that steps the corrected robot as our own plant does, and the weights of a residual for it.
//!
//! The code is the same for every robot (`c/*.c`); in its middle stand tables with the elements that the robot's plant is
//! made of. So a law stands here once more, in C, and a test holds the two together to rounding.

mod carry;
mod fmu;
mod weights;

pub use carry::carry;
pub use fmu::{Fmu, fmu};
pub use weights::weights;

use crate::number::number;
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::{Elements, Plant};
use glam::{DMat3, DVec3};
use std::fmt::{Display, Write};

const HEAD: &str = include_str!("c/head.h");
/// A class of C++ over the C file.
pub const CPP: &str = include_str!("c/robot.hpp");
/// A Simulink S-function over the C file.
pub const SIMULINK: &str = include_str!("c/robot_sfun.c");
const CODE: [&str; 4] =
    [include_str!("c/body.c"), include_str!("c/step.c"), include_str!("c/sample.c"), include_str!("c/residual.c")];

/// The file. `standstill` is the speed below which each joint counts as standing, rad/s (m/s), for what tells of single
/// samples.
pub fn write(plant: &Plant, standstill: &[f64]) -> String {
    let e = plant.elements();
    let past = e.delay.0 + usize::from(e.delay.1 > 0.0);
    let motors = e.transmissions.iter().filter(|t| t.rotor > 0.0).count();
    let mut out = format!(
        "/* The corrected model of a robot, written by gapscope {}. C99, nothing but libm and the C library.\n   \
         Where only its declarations are wanted, define GAPSCOPE_HEADER_ONLY before it is included. */\n",
        env!("CARGO_PKG_VERSION")
    );
    out += &[
        ("JOINTS", e.model.dof().to_string()),
        ("DT", double(e.dt)),
        ("PAST", past.to_string()),
        ("BRISTLES", e.bristles.len().to_string()),
        ("DRIVES", e.transmissions.len().to_string()),
        ("MOTORS", motors.to_string()),
        ("DIRECTIONS", e.directions.len().to_string()),
        ("RIPPLES", e.ripples.len().to_string()),
    ]
    .iter()
    .fold(HEAD.to_owned(), |text, (name, value)| text.replace(&format!("@{name}@"), value));
    let names = e.model.joints().iter().map(|joint| string(&joint.name));
    table(&mut out, "const char *const gapscope_joints", "GAPSCOPE_JOINTS", names);
    tables(&mut out, &e, standstill);
    CODE.iter().fold(out, |out, code| out + code)
}

fn tables(out: &mut String, e: &Elements, standstill: &[f64]) {
    table(out, "static const body bodies", "N", bodies(e.model));
    let gravity = e.model.gravity().to_array();
    table(out, "static const double gravity", "3", gravity.into_iter().map(double));
    for (name, values) in [
        ("gain", &e.actuation.gain[..]),
        ("bias", &e.actuation.bias),
        ("limit", &e.actuation.limit),
        ("stiffness", e.stiffness),
        ("spring_torque", e.spring_torque),
        ("offset", e.offset),
        ("standstill", standstill),
    ] {
        table(out, &format!("static const double {name}"), "N", values.iter().map(|x| double(*x)));
    }
    let directions = e.directions.iter().map(|d| {
        let first = d.parts.first().copied().unwrap_or_default();
        let second = d.parts.get(1).copied().unwrap_or((first.0, 0.0));
        let rest =
            [d.viscous, d.inertia, d.coulomb, d.static_rise, d.stribeck_velocity, d.cold_rise, d.time_constant, d.load];
        format!(
            "{{ {}, {{ {}, {} }}, {}, {} }}",
            d.parts.len(),
            first.0,
            second.0,
            row(&[first.1, second.1]),
            rest.map(double).join(", ")
        )
    });
    table(out, "static const direction directions", "GAPSCOPE_LENGTH(DIRECTIONS)", directions);
    let bristles =
        e.bristles.iter().map(|b| format!("{{ {}, {}, {} }}", b.joint, double(b.coulomb), double(b.stiffness)));
    table(out, "static const bristle bristles", "GAPSCOPE_LENGTH(GAPSCOPE_BRISTLES)", bristles);
    let ripples = e
        .ripples
        .iter()
        .map(|r| format!("{{ {}, {} }}", r.joint, [r.amplitude, r.cycles, r.phase].map(double).join(", ")));
    table(out, "static const ripple ripples", "GAPSCOPE_LENGTH(RIPPLES)", ripples);
    let mut motors = e.model.dof()..;
    let drives = e.transmissions.iter().map(|t| {
        let motor = (t.rotor > 0.0).then(|| motors.next()).flatten().map_or("-1".to_owned(), |m| m.to_string());
        let rest = [t.rotor, t.stiffness, t.damping, 0.5 * t.gap].map(double).join(", ");
        format!("{{ {}, {motor}, {rest} }}", t.joint)
    });
    table(out, "static const drive drives", "GAPSCOPE_LENGTH(GAPSCOPE_DRIVES)", drives);
    let (steps, fraction) = e.delay;
    let _ = writeln!(
        out,
        "static const int delay_steps = {steps}, substeps = {}, motor_encoders = {};",
        e.substeps,
        i32::from(e.motor_encoders)
    );
    let _ =
        writeln!(out, "static const double delay_fraction = {}, lag = {};", double(fraction), double(e.actuation.lag));
}

fn bodies(model: &Model) -> impl Iterator<Item = String> + '_ {
    model.joints().iter().zip(model.armature()).map(|(joint, armature)| {
        let parent = joint.parent.map_or(-1, |parent| parent as i64);
        let prismatic = i32::from(joint.kind == JointKind::Prismatic);
        format!(
            "{{ {parent}, {prismatic}, {}, {}, {}, {}, {}, {}, {} }}",
            matrix(&joint.placement.rotation),
            vector(joint.placement.translation),
            vector(joint.axis),
            double(joint.inertia.mass),
            vector(joint.inertia.first_moment),
            matrix(&joint.inertia.rotational),
            double(*armature)
        )
    })
}

/// An array of rows; C has none without any.
fn table(out: &mut String, declaration: &str, length: &str, rows: impl Iterator<Item = impl Display>) {
    let rows: Vec<String> = rows.map(|row| format!("    {row}")).collect();
    let rows = if rows.is_empty() { "    { 0 }".to_owned() } else { rows.join(",\n") };
    let _ = writeln!(out, "{declaration}[{length}] = {{\n{rows}\n}};");
}

/// A number as a double, the shortest that reads back to the same bits.
fn double(x: f64) -> String {
    if x.is_infinite() {
        return if x > 0.0 { "DBL_MAX" } else { "-DBL_MAX" }.to_owned();
    }
    let text = number(x);
    if text.contains(['.', 'e']) { text } else { text + ".0" }
}

fn row(x: &[f64]) -> String {
    format!("{{ {} }}", x.iter().map(|x| double(*x)).collect::<Vec<_>>().join(", "))
}

fn vector(x: DVec3) -> String {
    row(&x.to_array())
}

/// Row by row.
fn matrix(m: &DMat3) -> String {
    row(&m.transpose().to_cols_array())
}

/// A name as a string that no name can end.
fn string(name: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'.' | b' ' | b'/');
    let text: String =
        name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("\\{b:03o}") }).collect();
    format!("\"{text}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_what_c_reads() {
        assert_eq!(string("a\"\\*/\n"), "\"a\\042\\134\\052/\\012\"");
        assert_eq!((double(2.0), double(f64::INFINITY), double(1e-9)), ("2.0".into(), "DBL_MAX".into(), "1e-9".into()));
    }
}
