//! The plant's state as a list of numbers.

use super::Plant;

/// Lengths of the parts of x behind positions and velocities; all zero without an effect that has hidden state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    joints: usize,
    clock: usize,
    history: usize,
    lagged: usize,
    bristles: usize,
    wind_up: usize,
}

/// The parts of x.
pub(super) struct State<'a> {
    /// Measured positions, n.
    pub(super) q: &'a mut [f64],
    /// Measured velocities, n.
    pub(super) v: &'a mut [f64],
    /// Time since the start of the episode, and 1 once the hidden state has been filled. Empty without hidden state.
    pub(super) clock: &'a mut [f64],
    /// Past efforts, latest first, n each.
    pub(super) history: &'a mut [f64],
    /// The lag's output, n or none.
    pub(super) lagged: &'a mut [f64],
    /// Bristle deflections, in the order of the plant's bristles.
    pub(super) bristles: &'a mut [f64],
    /// Wind-up and its rate of each drive.
    pub(super) wind_up: &'a mut [f64],
}

impl Layout {
    pub(super) fn len(&self) -> usize {
        2 * self.joints + self.clock + self.history + self.lagged + self.bristles + self.wind_up
    }

    pub(super) fn split(self, x: &mut [f64]) -> State<'_> {
        let (q, rest) = x.split_at_mut(self.joints);
        let (v, rest) = rest.split_at_mut(self.joints);
        let (clock, rest) = rest.split_at_mut(self.clock);
        let (history, rest) = rest.split_at_mut(self.history);
        let (lagged, rest) = rest.split_at_mut(self.lagged);
        let (bristles, wind_up) = rest.split_at_mut(self.bristles);
        State { q, v, clock, history, lagged, bristles, wind_up }
    }
}

impl Plant {
    pub(super) fn layout(&self) -> Layout {
        let joints = self.model.dof();
        let history = joints * self.actuation.past(self.dt);
        let lagged = if self.actuation.lag > 0.0 { joints } else { 0 };
        let (bristles, wind_up) = (self.bristles.len(), 2 * self.drives.len());
        let timed = self.drifts || !self.contacts.is_empty();
        let clock = if timed || history + lagged + bristles + wind_up > 0 { 2 } else { 0 };
        Layout { joints, clock, history, lagged, bristles, wind_up }
    }

    /// Positions that the drives' own encoders show in a state, rad or m, written to `q` (n): on joints with a spring or
    /// play and a rotor those of the motors, on all others those of the links. A servo closes its loop over them, whatever the
    /// log shows. Before the first step motors count as turned with their links. Allocates nothing.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn drive_positions(&self, x: &[f64], q: &mut [f64]) {
        q.copy_from_slice(&x[..q.len()]);
        let wind_up = &x[x.len() - 2 * self.drives.len()..];
        for (drive, wind_up) in self.drives.iter().zip(wind_up.chunks_exact(2)) {
            match (drive.motor.is_some(), self.motor_encoders) {
                (true, false) => q[drive.joint] += wind_up[0],
                (false, true) => q[drive.joint] -= wind_up[0],
                _ => {}
            }
        }
    }
}
