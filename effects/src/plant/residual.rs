//! What a plant leaves of a measured motion: the effort that was logged less the effort that the plant would have logged.

use super::friction::hold;
use super::{Direction, Plant};
use crate::Motion;
use crate::filter::{bristle, early, first_order, late};
use crate::motion::mean_size;
use crate::wind_up::{Coupling, Drag, JointRun, Oscillator, WindUp, inertia_about, slope_about};

/// Steps of Newton's method towards an effort that friction under load grows with; it is a contraction.
const LOAD_STEPS: usize = 4;

/// What one sample needs to know beyond itself.
#[derive(Default)]
struct Past<'a> {
    /// Time since the start of the episode, s; infinite for a warm drive.
    time: f64,
    /// Deflection of each bristle over its greatest one; `None` for bristles that slide.
    bristles: Option<&'a [f64]>,
    /// Standard deviation of the noise of each joint's effort, N m (N); empty where it has none.
    effort_noise: &'a [f64],
}

/// A drive along a run.
struct Turning {
    joint: usize,
    rotor: f64,
    ahead: WindUp,
    /// Torque through the coupling, sample by sample, N m (N).
    passed: Vec<f64>,
}

impl Plant {
    /// Residual torque of one sample of a measured motion.
    ///
    /// r = τ − [ID(q, q̇, q̈) + K q + friction + rotor inertia − bias] / gain, N m (N), written to `residual`.
    /// Below the speed `standstill[j]` dry friction is a set: it takes up as much of the rest as it can hold.
    /// One sample knows nothing of the past: delay, lag and contact are left out, joints count as rigid, bristles as
    /// sliding and drives as warm; [`Plant::residuals`] knows them. Slices have length n. Allocates nothing.
    pub fn residual(&mut self, q: &[f64], v: &[f64], a: &[f64], tau: &[f64], standstill: &[f64], residual: &mut [f64]) {
        self.rest(q, v, a, tau, standstill, &Past { time: f64::INFINITY, ..Past::default() }, residual);
        for (rest, gain) in residual.iter_mut().zip(&self.actuation.gain) {
            *rest /= gain;
        }
    }

    /// Residual torque of a whole measured run, joint-major like its signals, N m (N): [`Plant::residual`] with all that a
    /// sample does not show. Efforts are delayed and lagged, bristles bend, drives warm up and contacts push as the run has it.
    ///
    /// An elastic drive's motor turns ahead of its link by the wind-up δ, and its rotor takes J δ̈ more than with a rigid drive
    /// (Spong, J. Dyn. Sys. 109(4) 1987). With the link's position logged, a spring is wound by what the link is seen to take, and
    /// play is crossed as the logged effort drives the rotor, drawn to the same. With the motor's logged, the link swings
    /// behind it as its inertia and the joint have it, drawn to what the motor is seen to pass on, and every joint takes the torque
    /// of that motion.
    ///
    /// Behind a delay what is left is told at the effort that was logged: between two samples its noise would be smaller than
    /// it is. Behind a lag it is told where the effort acts: the other way round, the torque that the motion takes and its
    /// rate, noise of the position would grow with the frequency and pull the time constant to zero.
    pub fn residuals(&mut self, motion: &Motion) -> Vec<Vec<f64>> {
        let limited = self.limited(motion);
        let acting = self.late(&limited, motion.dt);
        let mut rest = self.residuals_where_it_acts(motion, &acting);
        let (delay, lag) = (self.actuation.delay, self.actuation.lag);
        if delay > 0.0 && lag == 0.0 {
            for ((rest, acting), logged) in rest.iter_mut().zip(&acting).zip(&limited) {
                let taken: Vec<f64> = acting.iter().zip(&*rest).map(|(acting, rest)| acting - rest).collect();
                let needed = early(&taken, delay, motion.dt);
                *rest = logged.iter().zip(needed).map(|(logged, needed)| logged - needed).collect();
            }
        }
        rest
    }

    /// The same where the effort acts, `tau` delayed and lagged.
    fn residuals_where_it_acts(&mut self, motion: &Motion, tau: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let bristles = self.bristles_along(motion);
        let mut rest = self.run(motion, tau, &bristles, &[]);
        let turns = |plant: &Plant, d: usize| plant.drives[d].rotor > 0.0 || plant.motor_encoders;
        if (0..self.drives.len()).any(|d| turns(self, d)) {
            let drags = self.drags(motion, tau, &rest, &bristles);
            let turning = self.turning(motion, tau, &rest, &drags);
            if self.motor_encoders {
                rest = self.run(motion, tau, &bristles, &turning);
                // Where the link sticks its friction holds anything, but the motor passes on what its coupling holds.
                for drive in &turning {
                    let j = drive.joint;
                    for (k, rest) in rest[j].iter_mut().enumerate() {
                        let delivered = self.actuation.at_joint(j, tau[j][k]);
                        *rest = delivered - drive.rotor * motion.a[j][k] - drive.passed[k];
                    }
                }
            } else {
                for drive in &turning {
                    let j = drive.joint;
                    for (k, rest) in rest[j].iter_mut().enumerate() {
                        if drags[j].holds[k] && drive.rotor > 0.0 {
                            let delivered = self.actuation.at_joint(j, tau[j][k]);
                            *rest = delivered - drive.rotor * motion.a[j][k] - drive.passed[k];
                        }
                        *rest -= drive.rotor * drive.ahead.acceleration[k];
                    }
                }
            }
        }
        for (row, gain) in rest.iter_mut().zip(&self.actuation.gain) {
            row.iter_mut().for_each(|rest| *rest /= gain);
        }
        rest
    }

    /// Effort of a measured run as its limits leave it, the gain not yet multiplied with.
    fn limited(&self, motion: &Motion) -> Vec<Vec<f64>> {
        let limit = |(j, x): (usize, &Vec<f64>)| {
            let (gain, bias, limit) = (self.actuation.gain[j], self.actuation.bias[j], self.actuation.limit[j]);
            let mut x = x.clone();
            if limit.is_finite() {
                x.iter_mut().zip(motion.cut(j, gain, bias, limit)).for_each(|(x, cut)| *x += cut / gain);
            }
            x
        };
        motion.tau.iter().enumerate().map(limit).collect()
    }

    /// Efforts as they act, delayed and lagged.
    fn late(&self, efforts: &[Vec<f64>], dt: f64) -> Vec<Vec<f64>> {
        efforts.iter().map(|x| first_order(&late(x, self.actuation.delay, dt), self.actuation.lag, dt)).collect()
    }

    /// Every joint along a measured run, its drive still open: of a plant whose drives are rigid. Efforts, rests and
    /// inertias are over the joint's gain, as the log's effort is.
    pub fn joint_runs(&mut self, motion: &Motion) -> Vec<JointRun> {
        let tau = self.late(&self.limited(motion), motion.dt);
        let rest = self.residuals_where_it_acts(motion, &tau);
        let bristles = self.bristles_along(motion);
        let acting: Vec<Vec<f64>> = rest
            .iter()
            .zip(&self.actuation.gain)
            .map(|(rest, gain)| rest.iter().map(|rest| rest * gain).collect())
            .collect();
        let drags = self.drags(motion, &tau, &acting, &bristles);
        tau.into_iter()
            .zip(rest)
            .zip(drags)
            .enumerate()
            .map(|(j, ((tau, rest), drag))| {
                let gain = self.actuation.gain[j];
                let over_gain = |x: Vec<f64>| x.into_iter().map(|x| x / gain).collect();
                let inertia = inertia_about(&self.model, &mut self.data, motion, j);
                let slope = slope_about(&self.model, &mut self.data, motion, j);
                JointRun {
                    delivered: tau.iter().map(|&tau| self.actuation.at_joint(j, tau) / gain).collect(),
                    rest,
                    acceleration: motion.a[j].clone(),
                    inertia: inertia.iter().map(|inertia| inertia / gain).collect(),
                    slope: slope.iter().map(|slope| slope / gain).collect(),
                    drag: Drag {
                        dry: over_gain(drag.dry),
                        viscous: drag.viscous / gain,
                        taken: over_gain(drag.taken),
                        ..drag
                    },
                    dt: motion.dt,
                }
            })
            .collect()
    }

    fn bristles_along(&self, motion: &Motion) -> Vec<Vec<f64>> {
        self.bristles.iter().map(|b| bristle(&motion.v[b.joint], b.stiffness / b.coulomb, motion.dt)).collect()
    }

    /// Friction of each joint by itself along a run that leaves `rest`, the gain not yet divided by.
    fn drags(&mut self, motion: &Motion, tau: &[Vec<f64>], rest: &[Vec<f64>], bristles: &[Vec<f64>]) -> Vec<Drag> {
        let smooth = |d: &Direction| match d.parts.as_slice() {
            [_] => Direction { parts: d.parts.clone(), inertia: d.inertia, ..Direction::default() },
            _ => d.clone(),
        };
        let smooth: Vec<Direction> = self.directions.iter().map(smooth).collect();
        let directions = std::mem::replace(&mut self.directions, smooth);
        let without = self.run(motion, tau, bristles, &[]);
        self.directions = directions;
        let mut delivered = vec![0.0; motion.q.len()];
        (0..motion.q.len())
            .map(|j| {
                let own = self.directions.iter().find(|d| d.parts == [(j, 1.0)]);
                let mut bound = |k: usize| {
                    delivered[j] = self.actuation.at_joint(j, tau[j][k]);
                    let time = motion.start + k as f64 * motion.dt;
                    own.map_or(0.0, |own| own.bound(motion.v[j][k], time, &delivered).max(0.0))
                };
                let dry: Vec<f64> = (0..motion.len()).map(&mut bound).collect();
                let rests = |(speed, dry): (&f64, &f64)| speed.abs() < motion.standstill[j] && *dry > 0.0;
                Drag {
                    holds: motion.v[j].iter().zip(&dry).map(rests).collect(),
                    dry,
                    viscous: own.map_or(0.0, |own| own.viscous.max(0.0)),
                    taken: without[j].iter().zip(&rest[j]).map(|(without, with)| without - with).collect(),
                    speed: motion.v[j].clone(),
                }
            })
            .collect()
    }

    /// One pass over a run, the gain not yet divided by, with links behind their logged motors.
    fn run(&mut self, motion: &Motion, tau: &[Vec<f64>], bristles: &[Vec<f64>], turning: &[Turning]) -> Vec<Vec<f64>> {
        let n = motion.q.len();
        let mut out = vec![Vec::with_capacity(motion.len()); n];
        let [mut q, mut v, mut a, mut effort, mut rest] = std::array::from_fn(|_| vec![0.0; n]);
        let mut bent = vec![0.0; bristles.len()];
        let mut dry = vec![Vec::with_capacity(motion.len()); n];
        for k in 0..motion.len() {
            for j in 0..n {
                (q[j], v[j], a[j], effort[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k], tau[j][k]);
            }
            for drive in turning {
                q[drive.joint] -= drive.ahead.angle[k];
                v[drive.joint] -= drive.ahead.rate[k];
                a[drive.joint] -= drive.ahead.acceleration[k];
            }
            bent.iter_mut().zip(bristles).for_each(|(b, run)| *b = run[k]);
            let past = Past {
                time: motion.start + k as f64 * motion.dt,
                bristles: Some(&bent),
                effort_noise: motion.effort_noise,
            };
            self.rest(&q, &v, &a, &effort, motion.standstill, &past, &mut rest);
            dry.iter_mut()
                .zip(&self.scratch.smooth)
                .zip(&rest)
                .for_each(|((dry, smooth), rest)| dry.push(smooth - rest));
            for drive in turning {
                // The rotor turns as the motor does, ahead of the link.
                rest[drive.joint] -= drive.rotor * drive.ahead.acceleration[k];
            }
            out.iter_mut().zip(&rest).for_each(|(out, rest)| out.push(*rest));
        }
        let open: Vec<usize> = turning.iter().map(|drive| drive.joint).collect();
        self.hold(motion, tau, &open, &mut out, &mut dry);
        // Dry friction jumps as the speed changes sign; the signals about that are smooth.
        for (j, (out, dry)) in
            out.iter_mut().zip(&dry).enumerate().filter(|(_, (_, dry))| dry.iter().any(|f| *f != 0.0))
        {
            for (k, smeared) in motion.smeared(dry, &motion.v[j], motion.standstill[j]).into_iter().enumerate() {
                if motion.v[j][k].abs() >= motion.standstill[j] {
                    out[k] += dry[k] - smeared;
                }
            }
        }
        out
    }

    /// Wind-up of every drive, from what links take that go with their motors.
    fn turning(&mut self, motion: &Motion, tau: &[Vec<f64>], rest: &[Vec<f64>], drags: &[Drag]) -> Vec<Turning> {
        (0..self.drives.len())
            .map(|d| {
                let drive = &self.drives[d];
                let (j, rotor) = (drive.joint, drive.rotor);
                let coupling =
                    Coupling { stiffness: drive.stiffness, damping: drive.damping, half_gap: drive.half_gap };
                let delivered = |k: usize| self.actuation.at_joint(j, tau[j][k]);
                // The torque that the link takes: the effort less the rest and the rotor's part.
                let taken: Vec<f64> =
                    (0..motion.len()).map(|k| delivered(k) - rest[j][k] - rotor * motion.a[j][k]).collect();
                // The torque that the motor passes on.
                let turning: Vec<f64> = (0..motion.len()).map(|k| delivered(k) - rotor * motion.a[j][k]).collect();
                let ahead = if self.motor_encoders {
                    let inertia = inertia_about(&self.model, &mut self.data, motion, j);
                    let slope = slope_about(&self.model, &mut self.data, motion, j);
                    let drag = &drags[j];
                    let smooth: Vec<f64> = taken.iter().zip(&drag.taken).map(|(taken, drag)| taken - drag).collect();
                    let link = Oscillator {
                        drive: &smooth,
                        inertia: &inertia,
                        slope: Some(&slope),
                        drag: Some(drag),
                        coupling,
                        dt: motion.dt,
                    };
                    link.wind_up(Some(&turning))
                } else {
                    WindUp::of_motor(&turning, &taken, &drags[j].holds, rotor, &coupling, motion.dt)
                };
                let passed = ahead.torque(&coupling);
                Turning { joint: j, rotor, ahead, passed }
            })
            .collect()
    }

    /// Residual of one sample before the gain; `tau` has gone through delay and lag already.
    #[expect(clippy::too_many_arguments, reason = "one sample's signals")]
    fn rest(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        tau: &[f64],
        standstill: &[f64],
        past: &Past<'_>,
        residual: &mut [f64],
    ) {
        let s = &mut self.scratch;
        for j in 0..q.len() {
            s.delivered[j] = self.actuation.at_joint(j, tau[j]);
            s.q[j] = q[j] - self.offset[j];
        }
        self.model.inverse_dynamics(&mut self.data, &s.q[..q.len()], v, a, residual);
        if past.time.is_finite() && !self.contacts.is_empty() {
            self.contact_torque(past.time);
            residual.iter_mut().zip(&self.scratch.contact).for_each(|(r, torque)| *r -= torque);
        }
        let s = &mut self.scratch;
        for j in 0..q.len() {
            residual[j] = s.delivered[j] + self.spring_torque[j] - residual[j] - self.stiffness[j] * s.q[j];
        }
        for ripple in &self.ripples {
            residual[ripple.joint] += ripple.torque(s.q[ripple.joint]);
        }
        for drive in &self.drives {
            residual[drive.joint] -= drive.rotor * a[drive.joint];
        }
        for direction in &self.directions {
            let force = direction.viscous * direction.along(v) + direction.inertia * direction.along(a);
            for &(j, weight) in &direction.parts {
                residual[j] -= weight * force;
            }
        }
        s.smooth[..q.len()].copy_from_slice(residual);
        let sliding = |bound: f64, speed: f64, band: f64, hold: f64| {
            let limit = bound.max(0.0);
            if speed.abs() >= band { bound * speed.signum() } else { hold.clamp(-limit, limit) }
        };
        for (i, b) in self.bristles.iter().enumerate() {
            residual[b.joint] -= match past.bristles {
                Some(bent) => b.coulomb * bent[i],
                None => sliding(b.coulomb, v[b.joint], standstill[b.joint], residual[b.joint]),
            };
        }
        // What stands holds what all that slides leaves. Where a coupling of joints holds some torque, what overcomes all else
        // is not known: there friction under load goes by the effort itself.
        let band = |direction: &Direction| -> f64 {
            direction.parts.iter().map(|&(j, weight)| weight.abs() * standstill[j]).sum()
        };
        let stands = |direction: &Direction| direction.along(v).abs() < band(direction);
        let held = |j: usize| {
            let joins = |d: &&Direction| d.parts.len() > 1 && d.parts.iter().any(|&(of, _)| of == j);
            self.directions.iter().filter(joins).any(stands)
        };
        for direction in self.directions.iter().filter(|d| !stands(d)) {
            let speed = direction.along(v);
            let loaded = direction.load > 0.0 && held(direction.parts[0].0);
            let bound = if loaded {
                direction.bound(speed, past.time, &s.delivered)
            } else {
                direction.unloaded_bound(speed, past.time)
            };
            for &(j, weight) in &direction.parts {
                residual[j] -= weight * bound * speed.signum();
            }
        }
        let bound = |i: usize| {
            let direction = &self.directions[i];
            stands(direction).then(|| direction.bound(direction.along(v), past.time, &s.delivered).max(0.0))
        };
        hold(&self.directions, bound, residual, &mut s.held);
        // Friction that grows with the load takes its part of the effort that overcomes all else: from the effort predicted,
        // not from the one measured, which with μ = 1 would explain itself.
        for direction in self.directions.iter().filter(|d| d.load > 0.0) {
            let (&[(j, _)], speed) = (direction.parts.as_slice(), direction.along(v)) else { continue };
            if speed.abs() >= standstill[j] && !held(j) {
                let (needed, part) = (s.delivered[j] - residual[j], direction.load * speed.signum());
                let mut effort = needed / (1.0 - part * needed.signum());
                let noise = self.actuation.gain[j] * past.effort_noise.get(j).copied().unwrap_or(0.0);
                // effort = needed + part · E|effort|; Newton's method, exact at once where the sign is certain.
                for _ in 0..LOAD_STEPS {
                    let (size, slope) = mean_size(effort, noise);
                    effort -= (effort - needed - part * size) / (1.0 - part * slope);
                }
                residual[j] = s.delivered[j] - effort;
            }
        }
    }
}
