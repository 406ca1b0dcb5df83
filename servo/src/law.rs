//! The law of one servo joint, in units of what its drive follows.
//!
//! A drive turns a signal w into a torque s·w: the error of the set point (rad), a voltage (V), a current (A) or a torque
//! itself (N m). Divided by s, the joint's equation of motion is
//!
//! w = σ (M q̈ + c + g(q − ζ)) + α q̈ + (β·on + ν) q̇ + friction − δ,   σ = 1/s,
//!
//! where w of a set point u is its error with λ u̇ on top: a derivative gain on the error is β = λ.
//!
//! linear in all that a log may or may not determine: where gravity and the bodies' inertia do not show, σ goes to zero and the
//! ratios stay. Friction is set-valued at rest, and its bound is φ + ρ e^{−(q̇/v)²} + (μ + μ_s e^{−(q̇/v)²}) abs(w). Where it
//! creeps it is no longer set-valued: up to a speed it is that part of its bound which the speed is of that one.
//! Source of the friction with load: Duclusaud, Passault, Padois, Ly, "Extended friction models for the physics simulation of
//! servo actuators", ICRA 2025.

use gapscope_effects::{DeadBand, SpeedLimit};

/// A parameter of a joint's law. `Scale` is 1/s; torques are in units of w.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(usize)]
pub enum Param {
    /// σ, unit of w per N m.
    Scale,
    /// α, unit of w per rad/s².
    Armature,
    /// β, unit of w per rad/s: derivative gain and back-EMF, gone where the motor is off.
    Damping,
    /// ν, the same of viscous friction, always there.
    Viscous,
    /// φ, unit of w.
    Coulomb,
    /// ρ, unit of w.
    Rise,
    /// v, rad/s.
    StribeckVelocity,
    /// μ.
    Load,
    /// μ_s.
    LoadRise,
    /// Speed up to which dry friction grows in proportion, rad/s: a joint under load creeps. At zero it sticks.
    Creep,
    /// δ, unit of w.
    Bias,
    /// ζ, rad: measured less true position.
    Offset,
    /// Time by which the set point acts late, s.
    Latency,
    /// Greatest w.
    Limit,
    /// Greatest speed, rad/s.
    Speed,
    /// Error of the set point within which the drive does nothing, rad.
    DeadBand,
    /// Unit of w per rad of set point error, at the gain of the first log.
    Feedback,
    /// Frequency at which the link swings behind a motor that stands, rad/s; infinite where they turn as one.
    Spring,
    /// Play between motor and link, rad.
    Gap,
    /// Damping ratio of the teeth that end a play: ζ leaves exp(−πζ/√(1 − ζ²)) of the speed at which they meet.
    Contact,
    /// λ, unit of w per rad/s of the set point: a derivative gain that acts on the error, or a feed-forward of speed.
    Feedforward,
}

/// Damping ratio of a spring: what steel and plastic have; no log of a servo tells it apart. That of teeth a log tells, as it
/// stands for how they come off each other.
pub const DAMPING: f64 = 0.05;

/// How many parameters a law has.
pub const PARAMS: usize = 21;

impl Param {
    /// All, in the order of [`Law::values`].
    pub const ALL: [Param; PARAMS] = [
        Param::Scale,
        Param::Armature,
        Param::Damping,
        Param::Viscous,
        Param::Coulomb,
        Param::Rise,
        Param::StribeckVelocity,
        Param::Load,
        Param::LoadRise,
        Param::Creep,
        Param::Bias,
        Param::Offset,
        Param::Latency,
        Param::Limit,
        Param::Speed,
        Param::DeadBand,
        Param::Feedback,
        Param::Spring,
        Param::Gap,
        Param::Contact,
        Param::Feedforward,
    ];

    /// Whether its unit is that of w over something, so that 1/σ makes a torque of it.
    pub fn is_torque(self) -> bool {
        matches!(
            self,
            Param::Armature
                | Param::Damping
                | Param::Viscous
                | Param::Coulomb
                | Param::Rise
                | Param::Bias
                | Param::Limit
                | Param::Feedforward
        )
    }
}

/// The parameters of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// By [`Param`].
    pub values: [f64; PARAMS],
    /// Whether the encoder is on the link's side of a spring or of play.
    pub link_side: bool,
}

impl Default for Law {
    /// A drive without limits and a joint without friction; infinite stiffness.
    fn default() -> Law {
        let mut values = [0.0; PARAMS];
        values[Param::StribeckVelocity as usize] = 1.0;
        values[Param::Limit as usize] = f64::INFINITY;
        values[Param::Speed as usize] = f64::INFINITY;
        values[Param::Feedback as usize] = 1.0;
        values[Param::Spring as usize] = f64::INFINITY;
        values[Param::Contact as usize] = DAMPING;
        Law { values, link_side: false }
    }
}

impl std::ops::Index<Param> for Law {
    type Output = f64;
    fn index(&self, param: Param) -> &f64 {
        &self.values[param as usize]
    }
}

impl std::ops::IndexMut<Param> for Law {
    fn index_mut(&mut self, param: Param) -> &mut f64 {
        &mut self.values[param as usize]
    }
}

/// Weight of a step's end in the implicit rule where inertia is next to nothing: at one half the rule is of second order and rings
/// there; this loses a tenth of a step of phase and damps by a third a step.
pub(crate) const END: f64 = 0.6;

/// Weight of a step's end for an inertia and a drag, both as factors of speed: one half, unless that would ring by more than a
/// rule with [`END`] does. A tenth of a step of phase is an inertia of a tenth of a step times the damping: more than many rotors.
#[inline]
pub(crate) fn end_weight(inertia: f64, drag: f64) -> f64 {
    let light = (END - 0.5) * drag;
    if inertia >= light { 0.5 } else { END - inertia / drag }
}

/// What a drive is told over a step.
#[derive(Debug, Clone, Copy)]
pub enum Order {
    /// Follow a set point (rad), mean over the step, with a gain (unit of w per rad), and w on top of what its error asks for.
    Follow(f64, f64, f64),
    /// Deliver w.
    Deliver(f64),
    /// Motor off.
    Off,
}

/// What a step of one joint comes to before other joints and friction: (`inertia` + …) v⁺ = `impulse` ∓ friction, all over h.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Factor of the speed at the end, without σM/h.
    pub factor: f64,
    /// Right-hand side, without σ(M v/h − c − g).
    pub push: f64,
    /// w that is delivered if the joint stays where it is.
    pub delivered: f64,
    /// By how much less is delivered in the middle of the step for each rad/s on its way.
    pub yields: f64,
    /// Part of `push` and of `factor` that is the drive's: its stiffness and its damping.
    pub drive: [f64; 2],
    /// Weight of the step's end.
    pub end: f64,
}

/// Part of a step at the end of which the position enters the feedback: half of the way that the step makes.
pub(crate) fn way(h: f64) -> f64 {
    0.5 * h
}

/// Part of a step over which a servo acts whose error goes evenly from one value to another, and the mean error over that part:
/// switched by whole steps, it would rattle at the edge of its band as no servo does.
#[inline]
fn acting_part(band: f64, from: f64, to: f64) -> (f64, f64) {
    let change = to - from;
    let acts = [from, to].map(|error| DeadBand::acts(band, error));
    if band == 0.0 || change == 0.0 || (acts == [true; 2] && from * to > 0.0) || acts == [false; 2] {
        return (f64::from(u8::from(acts[0])), 0.5 * (from + to));
    }
    let [a, b] = [-band, band].map(|edge| ((edge - from) / change).clamp(0.0, 1.0));
    let (entry, exit) = (a.min(b), a.max(b));
    let part = entry + 1.0 - exit;
    let sum = entry * (from + 0.5 * entry * change) + (1.0 - exit) * (to - 0.5 * (1.0 - exit) * change);
    (part, sum / part.max(1e-300))
}

impl Law {
    /// Time constant of the closed loop, s: damping over stiffness, or the period of the undamped loop over 2π where that is
    /// longer; `inertia` is σ M.
    pub fn time_constant(&self, inertia: f64) -> f64 {
        let stiffness = self[Param::Feedback].max(1e-9);
        let slow = (self[Param::Damping] + self[Param::Viscous]) / stiffness;
        slow.max(((self[Param::Scale] * inertia + self[Param::Armature]) / stiffness).sqrt())
    }

    /// Time within which damping alone stops a joint that its drive lets go, s; `inertia` is M.
    pub fn coasting(&self, inertia: f64) -> f64 {
        let drag = (self[Param::Damping] + self[Param::Viscous]).max(1e-12);
        (self[Param::Scale] * inertia + self[Param::Armature]) / drag
    }

    /// Position at the end of a step, rad.
    pub fn move_on(h: f64, end: f64, q: f64, v: f64, v_end: f64) -> f64 {
        q + h * ((1.0 - end) * v + end * v_end)
    }

    /// The row of a step of `h` s from (q, v) under an order; `inertia` is σM/h of what turns with the motor.
    #[inline(always)]
    pub fn row(&self, h: f64, q: f64, v: f64, order: Order, inertia: f64) -> Row {
        let p = &self.values;
        let damping = if matches!(order, Order::Off) { 0.0 } else { p[Param::Damping as usize] };
        let gone = way(h) * v;
        let (mut stiffness, mut w) = match order {
            Order::Off => (0.0, 0.0),
            Order::Deliver(w) => (0.0, w),
            Order::Follow(target, gain, more) => {
                let error = target - q;
                // A set point is the mean over the step.
                let (part, mean) = acting_part(p[Param::DeadBand as usize], error, error - 2.0 * gone);
                (part * gain, part * (gain * (mean + gone) + more))
            }
        };
        let limit = p[Param::Limit as usize];
        let middle = w - stiffness * gone;
        if middle.abs() > limit {
            (stiffness, w) = (0.0, limit.copysign(middle));
        }
        let of_drive = stiffness * way(h) + damping;
        let drag = of_drive + p[Param::Viscous as usize];
        let armature = p[Param::Armature as usize] / h;
        let end = end_weight(inertia + armature, drag);
        Row {
            drive: [w - (1.0 - end) * of_drive * v, end * of_drive],
            factor: armature + end * drag,
            push: armature * v + w + p[Param::Bias as usize] - (1.0 - end) * drag * v,
            delivered: w,
            yields: 0.5 * h * stiffness + damping,
            end,
        }
    }

    /// Bound of dry friction over a step whose mean speed is `speed`.
    #[inline(always)]
    pub fn bound(&self, row: &Row, speed: f64) -> f64 {
        let p = &self.values;
        let (mut bound, mut loaded) = (p[Param::Coulomb as usize], p[Param::Load as usize]);
        let (rise, load_rise) = (p[Param::Rise as usize], p[Param::LoadRise as usize]);
        if rise > 0.0 || load_rise > 0.0 {
            let ratio = speed / p[Param::StribeckVelocity as usize];
            let fade = (-ratio * ratio).exp();
            bound += rise * fade;
            loaded += load_rise * fade;
        }
        bound + loaded * (row.delivered - row.yields * speed).abs()
    }

    /// Whether friction changes with speed or load.
    #[inline]
    pub fn is_friction_plain(&self) -> bool {
        let p = &self.values;
        p[Param::Load as usize] == 0.0 && p[Param::LoadRise as usize] == 0.0 && p[Param::Rise as usize] == 0.0
    }

    /// Speed at the end of a step that begins at `v`, from the whole factor and push of a row. Friction that changes with speed or
    /// load is that of the middle of the step: where it begins, friction would lag by half a step.
    #[inline(always)]
    pub fn settle(&self, row: &Row, v: f64, factor: f64, push: f64) -> f64 {
        let end = self.settle_at(factor, push, self.bound(row, v), row.drive);
        if self.is_friction_plain() {
            return end;
        }
        self.settle_at(factor, push, self.bound(row, 0.5 * (v + end)), row.drive)
    }

    /// Speed at the end of a step under a bound of friction.
    #[inline(always)]
    fn settle_at(&self, factor: f64, push: f64, bound: f64, [own_push, own_factor]: [f64; 2]) -> f64 {
        let creep = self.values[Param::Creep as usize];
        if creep > 0.0 {
            let creeps = push / (factor + bound / creep);
            if creeps.abs() <= creep {
                return creeps;
            }
        } else if push.abs() <= bound {
            return 0.0;
        }
        let end = (push - bound.copysign(push)) / factor;
        let coasting = || (push - own_push - bound.copysign(push)) / (factor - own_factor).max(1e-300);
        SpeedLimit::speed(end, self.values[Param::Speed as usize], coasting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_under_load_sticks_or_creeps() {
        let mut law = Law::default();
        law[Param::Scale] = 1.0;
        law[Param::Coulomb] = 0.2;
        let h = 1e-3;
        let row = law.row(h, 0.0, 0.0, Order::Deliver(0.1), 1.0 / h);
        // No inertia to speak of: what the drive delivers is what friction holds.
        let speed = |law: &Law, push: f64| law.settle(&row, 0.0, 1e-9, push);
        assert_eq!(speed(&law, 0.1), 0.0);
        law[Param::Creep] = 0.05;
        assert!((speed(&law, 0.1) - 0.025).abs() < 1e-6);
        assert!((speed(&law, -0.2) + 0.05).abs() < 1e-6);
        // Beyond its bound it slides, and friction is the same.
        assert!((law.settle(&row, 0.0, 2.0, 0.6) - 0.2).abs() < 1e-9);
    }

    #[test]
    fn a_drive_at_its_speed_neither_drives_nor_holds_a_load() {
        let mut law = Law::default();
        (law[Param::Scale], law[Param::Damping], law[Param::Speed]) = (1.0, 0.3, 2.0);
        let (h, inertia) = (1e-3, 0.01);
        let end = |push: f64, load: f64| {
            let row = law.row(h, 0.0, 2.5, Order::Deliver(push), inertia / h);
            law.settle(&row, 2.5, row.factor + inertia / h, row.push + inertia / h * 2.5 + load)
        };
        // Without its drive a load of 1 N m is faster by h/inertia of it, and none goes on as it went.
        assert!((end(5.0, 1.0) - 2.6).abs() < 1e-9);
        assert!((end(5.0, 0.0) - 2.5).abs() < 1e-9);
        // What it asks for less than its own damping brakes.
        assert!(end(0.1, 0.0) < 2.5 && end(-5.0, 0.0) < 2.1);
    }

    #[test]
    fn a_servo_acts_for_the_part_of_a_step_that_lies_outside_its_dead_band() {
        for (band, from, to, part, mean) in [
            (0.0, 0.1, -0.3, 1.0, -0.1),
            (1.0, 3.0, 2.0, 1.0, 2.5),
            (1.0, 0.5, -0.5, 0.0, 0.0),
            (1.0, 2.0, 0.0, 0.5, 1.5),
            (1.0, 0.0, -4.0, 0.75, -2.5),
            (1.0, 3.0, -2.0, 0.6, 5.0 / 6.0),
            (1.0, 0.3, 0.3, 0.0, 0.3),
        ] {
            let found = acting_part(band, from, to);
            assert!((found.0 - part).abs() < 1e-12 && (found.1 - mean).abs() < 1e-12, "{band} {from} {to}: {found:?}");
        }
    }
}
