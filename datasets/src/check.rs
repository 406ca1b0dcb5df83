//! Logs held against themselves and against the robot's model.

mod dynamics;
mod effort;
mod order;
mod position;
mod sampling;
mod signal;
mod units;
mod velocity;

pub(crate) use dynamics::{Fit, fit};
pub(crate) use position::excess;
pub(crate) use signal::{Traits, prediction_errors, trimmed_rms};
pub(crate) use velocity::Relation;

use crate::episode::Episode;
use gapscope_dynamics::{Finding, Model};

/// Holds logs against themselves and against the nominal model, and says in plain words what is doubtful, with the
/// likely cause and the mend. None of the findings is an error.
///
/// Told are: positions in degrees (millimetres), velocity that is not the derivative of position (other unit, other
/// sign, delayed, another joint's), velocity that is quantised or noisier than the derivative, effort of the opposite
/// sign to the model, joints in another order, position glitches and wraps, coarse encoder steps, repeated samples,
/// joints that do not move, constant channels, and limits of the URDF that are exceeded.
///
/// The cost is linear in the number of samples; the model is evaluated at a few thousand of them at most. Episodes
/// whose joints are not those of the model, by count, are passed over.
pub fn check_logs(model: &Model, episodes: &[Episode]) -> Vec<Finding> {
    let fits = |episode: &&Episode| {
        let n = model.dof();
        n > 0 && episode.len() >= 20 && episode.position.len() == n && episode.effort.len() == n
    };
    let episodes: Vec<&Episode> = episodes.iter().filter(fits).collect();
    if episodes.is_empty() {
        return Vec::new();
    }
    let logs = Logs::new(model, &episodes);
    let mut report = Report { logs: &logs, findings: Vec::new() };
    let scale = units::check(&logs, &mut report);
    position::check(&logs, scale.as_deref(), &mut report);
    sampling::check(&logs, &mut report);
    velocity::check(&logs, &mut report);
    effort::check(&logs, scale.as_deref(), &mut report);
    report.findings
}

/// The logs with what several rules ask of them.
pub(crate) struct Logs<'a> {
    pub(crate) model: &'a Model,
    pub(crate) episodes: &'a [&'a Episode],
    /// Median step of time of each episode, s.
    pub(crate) dt: Vec<f64>,
    /// `[episode][joint]`.
    pub(crate) traits: Vec<Vec<signal::Traits>>,
    /// `[episode][joint]`, where there is a velocity and the joint moves.
    pub(crate) relations: Vec<Vec<Option<velocity::Relation>>>,
}

/// What was seen of logs, to be put beside them again.
pub(crate) struct Seen {
    dt: Vec<f64>,
    traits: Vec<Vec<signal::Traits>>,
    relations: Vec<Vec<Option<velocity::Relation>>>,
}

impl<'a> Logs<'a> {
    /// The same logs as those of which this was seen.
    pub(crate) fn again(model: &'a Model, episodes: &'a [&'a Episode], seen: Seen) -> Self {
        Self { model, episodes, dt: seen.dt, traits: seen.traits, relations: seen.relations }
    }

    /// What was seen.
    pub(crate) fn seen(self) -> Seen {
        Seen { dt: self.dt, traits: self.traits, relations: self.relations }
    }

    pub(crate) fn new(model: &'a Model, episodes: &'a [&'a Episode]) -> Self {
        let dt: Vec<f64> = episodes.iter().map(|episode| episode.dt()).collect();
        let of = |(episode, dt): (&&Episode, &f64)| {
            episode.position.iter().map(|position| signal::Traits::of(&episode.time, position, *dt)).collect()
        };
        let traits = episodes.iter().zip(&dt).map(of).collect();
        let mut logs = Self { model, episodes, dt, traits, relations: Vec::new() };
        logs.relations = velocity::relations(&logs);
        logs
    }

    /// Unit of a joint's position.
    pub(crate) fn unit(&self, joint: usize) -> &'static str {
        if self.is_prismatic(joint) { "m" } else { "rad" }
    }

    /// Factor from SI to the unit that logs carry by mistake.
    pub(crate) fn other_unit(&self, joint: usize) -> (f64, &'static str) {
        if self.is_prismatic(joint) { (1000.0, "mm") } else { (180.0 / std::f64::consts::PI, "degrees") }
    }

    pub(crate) fn is_prismatic(&self, joint: usize) -> bool {
        self.model.joints()[joint].kind == gapscope_dynamics::JointKind::Prismatic
    }
}

/// A joint of a log for which a rule fires, and by how much.
#[derive(Debug, Clone, Copy)]
struct Case {
    episode: usize,
    joint: usize,
    value: f64,
}

struct Report<'a> {
    logs: &'a Logs<'a>,
    findings: Vec<Finding>,
}

impl Report<'_> {
    /// One finding for all cases of a rule, its message made from the range of their values.
    fn add(&mut self, cases: &[Case], message: impl Fn(&str) -> String) {
        if cases.is_empty() {
            return;
        }
        let low = cases.iter().map(|case| case.value).fold(f64::INFINITY, f64::min);
        let high = cases.iter().map(|case| case.value).fold(f64::NEG_INFINITY, f64::max);
        let range =
            if figure(low) == figure(high) { figure(low) } else { format!("{} to {}", figure(low), figure(high)) };
        self.findings.push(Finding::new(self.about(cases), message(&range)));
    }

    /// A finding about joints of all logs.
    fn add_joints(&mut self, joints: &[usize], message: String) {
        let names: Vec<&str> = joints.iter().map(|&joint| self.logs.model.joints()[joint].name.as_str()).collect();
        self.findings.push(Finding::new(names.join(", "), message));
    }

    fn about(&self, cases: &[Case]) -> String {
        let distinct = |of: fn(&Case) -> usize| cases.iter().map(of).collect::<std::collections::BTreeSet<_>>();
        let joints = distinct(|case| case.joint);
        let episodes = distinct(|case| case.episode);
        let names: Vec<&str> = joints.iter().map(|&joint| self.logs.model.joints()[joint].name.as_str()).collect();
        let joints = if joints.len() == self.logs.model.dof() && joints.len() > 2 {
            "all joints".to_owned()
        } else {
            names.join(", ")
        };
        let logs: Vec<&str> = episodes.iter().map(|&episode| self.logs.episodes[episode].name.as_str()).collect();
        match logs.len() {
            count if count == self.logs.episodes.len() && count > 1 => joints,
            count if count > 3 => format!("{joints} in {}, {} and {} more", logs[0], logs[1], count - 2),
            _ => format!("{joints} in {}", logs.join(", ")),
        }
    }
}

/// A number with about three significant digits.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    if !(0..=6).contains(&digits) && !(-4..0).contains(&digits) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", digits.max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let cases = [
            (0.0, "0"),
            (1.0, "1"),
            (12.345, "12.3"),
            (-0.00381469, "-0.00381"),
            (57.2958, "57.3"),
            (123456.0, "123456"),
            (1.5e-9, "1.50e-9"),
        ];
        for (value, text) in cases {
            assert_eq!(figure(value), text);
        }
    }
}
