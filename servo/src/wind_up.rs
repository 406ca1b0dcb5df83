//! A joint whose motor and link turn apart: a spring between them, or play.
//!
//! The motor has the rotor's inertia α and all friction; the link has the bodies. With x = θ − q the torque between them is
//! κ (x − play) + δ ẋ, and nothing within the play. κ is told by the frequency ω at which the link swings behind a motor that
//! stands: κ = σ M ω². The step is that of a rigid joint, the torque between taken at the same part of it.

use crate::law::{DAMPING, END, Law, Param, Row, way};

/// Frequency at which a link swings on the teeth that end its play, rad/s: 20 Hz, as hard as steps of 1 to 2 ms follow.
pub const CONTACT: f64 = 125.0;

/// Steps to where a link hangs on its spring: a spring twice as stiff as gravity comes to a thousandth of its turn.
const HANGS: usize = 10;

/// What lies between motor and link, in units of w.
#[derive(Debug, Clone, Copy)]
pub struct Shaft {
    stiffness: f64,
    damping: f64,
    half_gap: f64,
}

/// Positions and speeds of motor and link, rad and rad/s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wound {
    /// Motor.
    pub motor: [f64; 2],
    /// Link.
    pub link: [f64; 2],
}

impl Law {
    /// Whether motor and link turn apart.
    pub fn winds_up(&self) -> bool {
        self[Param::Spring].is_finite()
    }

    fn damping_ratio(&self) -> f64 {
        if self[Param::Gap] > 0.0 { self[Param::Contact] } else { DAMPING }
    }

    /// What lies between them, where the bodies' mean inertia is M; `None` where they turn as one.
    pub fn shaft(&self, mass: f64) -> Option<Shaft> {
        self.winds_up().then(|| {
            let inertia = (self[Param::Scale] * mass).max(1e-12);
            let frequency = self[Param::Spring];
            Shaft {
                stiffness: inertia * frequency * frequency,
                damping: 2.0 * self.damping_ratio() * inertia * frequency,
                half_gap: 0.5 * self[Param::Gap],
            }
        })
    }
}

/// Stiffness, N m/rad, and damping, N m s/rad, of the spring of a law, on bodies of a mean inertia, kg m².
pub fn spring_of(law: &Law, inertia: f64) -> (f64, f64) {
    let frequency = law[Param::Spring];
    (inertia * frequency * frequency, 2.0 * DAMPING * inertia * frequency)
}

impl Shaft {
    /// How far the spring is stretched; zero within the play.
    fn stretch(&self, x: f64) -> f64 {
        x - x.clamp(-self.half_gap, self.half_gap)
    }

    /// State at rest under the weight of the link at its angle, in units of w, that an encoder on one of the sides shows at
    /// `measured`.
    pub fn at_rest(&self, measured: f64, link_side: bool, weight: impl Fn(f64) -> f64) -> Wound {
        let mut x = 0.0;
        // A link that hangs on its spring turns by that, and its weight with it.
        for _ in 0..if link_side { 1 } else { HANGS } {
            let weight = weight(if link_side { measured } else { measured - x });
            x = weight / self.stiffness + self.half_gap * if weight == 0.0 { 0.0 } else { weight.signum() };
        }
        let (motor, link) = if link_side { (measured + x, measured) } else { (measured, measured - x) };
        Wound { motor: [motor, 0.0], link: [link, 0.0] }
    }

    /// Moves on by `h` s: `row` is the motor's, with its rotor; the link has `inertia` = σM/h and `push` without what comes
    /// through the shaft. `settle` says at which speed a motor of this factor and push ends.
    pub fn step(
        &self,
        h: f64,
        state: &mut Wound,
        row: &Row,
        inertia: f64,
        push: f64,
        settle: impl FnOnce(f64, f64) -> f64,
    ) {
        let ([theta, omega], [q, v]) = (state.motor, state.link);
        let stretch = self.stretch(theta - q);
        let in_contact = self.half_gap == 0.0 || stretch != 0.0;
        let drag = if in_contact { self.stiffness * way(h) + self.damping } else { 0.0 };
        let through = if in_contact { self.stiffness * stretch + (1.0 - END) * drag * (omega - v) } else { 0.0 };
        let both = END * drag;
        let link = (inertia + both).max(1e-300);
        // The link's speed is eliminated, so that friction meets one unknown.
        let factor = row.factor + both - both * both / link;
        let end = settle(factor, row.push - through + both * (push + through) / link);
        let link_end = (push + through + both * end) / link;
        state.motor = [Law::move_on(h, row.end, theta, omega, end), end];
        state.link = [Law::move_on(h, END, q, v, link_end), link_end];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::Order;

    /// A motor that is held, with a link behind it.
    fn law(frequency: f64, gap: f64) -> Law {
        let mut law = Law::default();
        law[Param::Scale] = 0.1;
        law[Param::Armature] = 1e-3;
        law[Param::Coulomb] = 1e3;
        law[Param::Spring] = frequency;
        law[Param::Gap] = gap;
        law
    }

    fn run(law: &Law, mut state: Wound, mass: f64, steps: usize, h: f64) -> Vec<Wound> {
        let shaft = law.shaft(mass).unwrap();
        (0..steps)
            .map(|_| {
                let row = law.row(h, state.motor[0], state.motor[1], Order::Off, 0.0);
                let inertia = law[Param::Scale] * mass / h;
                let push = inertia * state.link[1];
                let speed = state.motor[1];
                shaft.step(h, &mut state, &row, inertia, push, |factor, push| law.settle(&row, speed, factor, push));
                state
            })
            .collect()
    }

    #[test]
    fn a_link_behind_a_motor_that_stands_swings_at_its_frequency() {
        let law = law(30.0, 0.0);
        let start = Wound { link: [0.1, 0.0], ..Wound::default() };
        let path = run(&law, start, 0.02, 4000, 5e-4);
        assert!(path.iter().all(|state| state.motor[0] == 0.0));
        let crossings = path.windows(2).filter(|pair| pair[0].link[0] > 0.0 && pair[1].link[0] <= 0.0).count();
        // 2 s at 30 rad/s are 9.5 periods.
        assert!((9..=10).contains(&crossings), "{crossings}");
    }

    #[test]
    fn nothing_acts_within_the_play_and_the_link_stays_near_it() {
        let law = law(150.0, 0.04);
        let start = Wound { link: [0.0, 0.05], ..Wound::default() };
        let path = run(&law, start, 0.02, 600, 5e-4);
        assert!((path[300].link[1] - 0.05).abs() < 1e-9, "it flies freely for .4 s");
        assert!(run(&law, start, 0.02, 8000, 5e-4).iter().all(|state| state.link[0].abs() < 0.0215));
        let shaft = law.shaft(0.02).unwrap();
        let rest = shaft.at_rest(0.3, false, |_| 0.45);
        assert!((rest.link[0] - (0.3 - 0.02 - 0.45 / (0.1 * 0.02 * 150.0 * 150.0))).abs() < 1e-12);
    }

    #[test]
    fn a_link_comes_off_its_teeth_at_the_part_of_its_speed_that_their_damping_leaves() {
        for ratio in [0.05, 0.3] {
            let mut law = law(125.0, 0.04);
            law[Param::Contact] = ratio;
            let start = Wound { link: [0.0, 0.5], ..Wound::default() };
            let path = run(&law, start, 0.02, 8000, 5e-5);
            let flies_back = path.iter().find(|state| state.link[1] < 0.0 && state.link[0] < 0.0).unwrap();
            let back = flies_back.link[1];
            let left = (-std::f64::consts::PI * ratio / (1.0_f64 - ratio * ratio).sqrt()).exp();
            assert!((-back / 0.5 - left).abs() < 0.05, "{ratio}: {} for {left}", -back / 0.5);
        }
    }

    #[test]
    fn a_link_hangs_where_its_weight_there_stretches_the_spring() {
        let shaft = law(30.0, 0.0).shaft(0.02).unwrap();
        // σ M ω² = 1.8: half of that is the weight of the link when it lies level.
        let weight = |link: f64| 0.9 * link.sin();
        for link_side in [false, true] {
            let rest = shaft.at_rest(0.8, link_side, weight);
            let stretch = rest.motor[0] - rest.link[0];
            assert!((1.8 * stretch - weight(rest.link[0])).abs() < 1e-3, "{link_side}: {rest:?}");
            assert_eq!(if link_side { rest.link[0] } else { rest.motor[0] }, 0.8);
        }
    }
}
