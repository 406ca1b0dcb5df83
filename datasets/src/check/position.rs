//! Positions by themselves: limits, spikes, wraps, encoder steps, joints that stand still.

use super::{Case, Logs, Report};

/// `scale` brings positions to the SI unit, where they are not.
pub(super) fn check(logs: &Logs, scale: Option<&[f64]>, report: &mut Report) {
    let (mut outside, mut fast, mut glitches, mut wraps, mut coarse) = (vec![], vec![], vec![], vec![], vec![]);
    for e in 0..logs.episodes.len() {
        for (j, joint) in logs.model.joints().iter().enumerate() {
            let traits = &logs.traits[e][j];
            let case = |value: f64| case_of(e, j, value);
            let scale = scale.map_or(1.0, |scale| scale[j]);
            let beyond = excess(logs, j, scale, traits.low, traits.high);
            if beyond > 2e-3 && traits.wraps.is_empty() {
                outside.push(case(beyond));
            }
            if let Some(limit) = joint.limits.velocity.filter(|limit| *limit > 0.0) {
                let fastest = scale * fastest(logs, e, j);
                if fastest > 1.05 * limit {
                    fast.push(case(fastest / limit));
                }
            }
            if !traits.glitches.is_empty() {
                glitches.push(case(traits.glitches.len() as f64));
            }
            if !traits.wraps.is_empty() && !logs.is_prismatic(j) {
                wraps.push(case(traits.wraps.len() as f64));
            }
            // Differences of neighbouring samples tell speed only in steps of step/dt.
            if let Some(step) = traits.step.filter(|step| step / logs.dt[e] > 0.1 * traits.speed && traits.moves()) {
                coarse.push(case(step));
            }
        }
    }
    let unit = |cases: &[Case]| cases.first().map_or("rad", |case| logs.unit(case.joint));
    let (of_outside, of_coarse) = (unit(&outside), unit(&coarse));
    report.add(&outside, |value| format!("the position passes the URDF's limits by {value} {of_outside}: another zero or unit than the URDF's, or limits that do not belong to this robot"));
    report.add(&fast, |value| {
        format!("the speed reaches {value} times the URDF's velocity limit: the limit is not that of this robot, or the unit of position or time is another")
    });
    report.add(&glitches, |value| format!("the position has single samples that jump ({value} in a log): a reading went wrong there; a diagnosis takes the course of their neighbours instead"));
    report.add(&wraps, |value| {
        format!("the position jumps by about a full turn ({value} times in a log): the angle is wrapped; unwrap it")
    });
    report.add(&coarse, |value| format!("the encoder's step is {value} {of_coarse}, coarse for so slow a motion: speeds are smooth only after filtering"));

    let mut reference = vec![];
    for (e, episode) in logs.episodes.iter().enumerate() {
        for (j, command) in episode.command.iter().flatten().enumerate() {
            let traits = &logs.traits[e][j];
            let far = 1e3 * (traits.high - traits.low + traits.high.abs().max(traits.low.abs()).max(1.0));
            let wild = command.iter().filter(|value| value.abs() > far).count();
            if wild > 0 {
                reference.push(case_of(e, j, wild as f64));
            }
        }
    }
    report.add(&reference, |value| format!("the command has samples that cannot be, a thousand times beyond the motion ({value} in a log): they were written from memory that was never set; do without the channel (ignore = [\"command.*\"] in the column map)"));

    let still: Vec<usize> =
        (0..logs.model.dof()).filter(|&j| logs.traits.iter().all(|traits| !traits[j].moves())).collect();
    if !still.is_empty() {
        report.add_joints(&still, "does not move in any log: nothing can be told of its friction and inertia; move it, or make it `fixed` in the URDF".to_owned());
    }
}

fn case_of(episode: usize, joint: usize, value: f64) -> Case {
    Case { episode, joint, value }
}

/// How far a range passes the limits of a joint when it is multiplied by `scale`; 0 within, and for joints without limits.
pub(crate) fn excess(logs: &Logs, joint: usize, scale: f64, low: f64, high: f64) -> f64 {
    let joint = &logs.model.joints()[joint];
    if joint.kind == gapscope_dynamics::JointKind::Continuous {
        return 0.0;
    }
    let below = joint.limits.lower.map_or(0.0, |lower| lower - scale * low);
    let above = joint.limits.upper.map_or(0.0, |upper| scale * high - upper);
    below.max(above).max(0.0)
}

/// Greatest speed over windows.
fn fastest(logs: &Logs, e: usize, j: usize) -> f64 {
    let (time, traits) = (&logs.episodes[e].time, &logs.traits[e][j]);
    let window = traits.window;
    let speed = |k: usize| (traits.smooth[k + window] - traits.smooth[k]).abs() / (time[k + window] - time[k]);
    let near_wrap = |k: usize| traits.wraps.iter().any(|wrap| (k..=k + window).contains(wrap));
    (0..time.len() - window).step_by((window / 2).max(1)).filter(|&k| !near_wrap(k)).map(speed).fold(0.0, f64::max)
}
