//! A reference motion as a table, with a start from rest and a stop.

use super::Reference;
use crate::trajectory::Trajectory;
use std::f64::consts::PI;

/// Time in which a trajectory gathers pace from rest, and in which it comes to rest again, s; a quarter of it at most.
const EASE: f64 = 2.0;

impl Trajectory {
    /// A reference motion of so many seconds, sampled at `rate` Hz, with a start from rest and a stop: it runs along the same
    /// path, at its own pace after the first two seconds and until the last two. Allocates.
    pub fn sample(motion: &Reference, joints: Vec<String>, seconds: f64, rate: f64) -> Trajectory {
        let n = joints.len();
        let samples = (seconds * rate).round().max(2.0) as usize;
        let empty = || vec![Vec::with_capacity(samples + 1); n];
        let (mut position, mut velocity, mut acceleration) = (empty(), empty(), empty());
        let time: Vec<f64> = (0..=samples).map(|k| k as f64 / rate).collect();
        for &t in &time {
            let [s, rate, change] = eased(t, seconds);
            let (q, v, a) = motion.at(s);
            for j in 0..n {
                position[j].push(q[j]);
                velocity[j].push(rate * v[j]);
                acceleration[j].push(rate * rate * a[j] + change * v[j]);
            }
        }
        Trajectory { joints, time, position, velocity, acceleration }
    }
}

/// Time along the motion at time `t`, its first and its second derivative: the pace rises as ½ (1 − cos) and falls likewise.
fn eased(t: f64, seconds: f64) -> [f64; 3] {
    let ease = EASE.min(0.25 * seconds);
    let rising = |t: f64| {
        let angle = PI * t / ease;
        [0.5 * (t - ease / PI * angle.sin()), 0.5 * (1.0 - angle.cos()), 0.5 * PI / ease * angle.sin()]
    };
    if t < ease {
        rising(t)
    } else if t > seconds - ease {
        let [way, pace, change] = rising((seconds - t).max(0.0));
        [seconds - ease - way, pace, -change]
    } else {
        [t - 0.5 * ease, 1.0, 0.0]
    }
}
