//! What logs can tell of each joint: which of a robot's parameters their information matrix determines.

use super::sample::Sample;
use super::weigh::{Freedom, OWN, weigh};
use crate::check::Logs;
use crate::episode::Episode;
use gapscope_dynamics::Model;

/// A parameter is determined where the logs leave less than this of the spread that used robots have in it.
const DETERMINED: f64 = 0.3;

/// For each joint, which parameters logs determine beside all others: of the drive `bias`, `viscous_friction`,
/// `coulomb_friction`, `armature` and `torque_gain_error`, of the link that it moves `mass`, `first_moment` and `inertia`
/// (at least one component of it).
pub fn determined(model: &Model, episodes: &[Episode]) -> Vec<Vec<&'static str>> {
    let n = model.dof();
    let fits = |episode: &&Episode| episode.len() >= 40 && episode.position.len() == n && episode.effort.len() == n;
    let episodes: Vec<&Episode> = episodes.iter().filter(fits).collect();
    if episodes.is_empty() {
        return vec![Vec::new(); n];
    }
    let logs = Logs::new(model, &episodes);
    let sample = Sample::new(&logs);
    let active: Vec<bool> =
        (0..n).map(|j| episodes.iter().all(|episode| !episode.effort_unknown.contains(&j))).collect();
    let narrowed = weigh(model, &sample, &vec![1.0; n], &active, Freedom::ORDINARY).narrowed;
    let is = |i: usize| narrowed[i] < DETERMINED;
    let of = |j: usize| {
        let own = ["torque_bias", "viscous_friction", "coulomb_friction", "armature", "torque_gain_error"];
        let drive = (0..OWN).filter(|i| active[j] && is(10 * n + OWN * j + i)).map(|i| own[i]);
        let body = [("mass", 0..1), ("first_moment", 1..4), ("inertia", 4..10)];
        let link = body.into_iter().filter(|(_, range)| range.clone().any(|i| is(10 * j + i))).map(|(name, _)| name);
        drive.chain(link).collect()
    };
    (0..n).map(of).collect()
}
