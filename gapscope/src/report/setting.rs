//! What a report says beside diagnosis and evidence: the robot as a picture, what to change, where it all comes from.

use super::scene::Scene;
use crate::robot::Description;
use gapscope_datasets::{Episode, Trajectory};
use gapscope_diagnosis::{Corrected, Origin};
use gapscope_dynamics::{Loaded, Model};
use gapscope_export::{Robot, Target, TargetLedger, export};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Everything of a report that neither the public JSON nor the evidence holds; empty where it is not known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setting {
    /// The robot's skeleton.
    pub scene: Option<Scene>,
    /// What URDF and MJCF hold of the corrections, the format of the robot's own description first.
    pub ledgers: Vec<TargetLedger>,
    /// Digests of model and logs.
    pub origin: Option<Origin>,
    /// The day on which it was made, `2026-01-31`, UTC.
    pub made: String,
}

impl Setting {
    /// The setting of a diagnosis that was just made. `next` is the motion that it proposes, `loaded` the robot as it was
    /// given, joints held as in `model`.
    pub fn new(
        model: &Model,
        episodes: &[Episode],
        corrected: &Corrected,
        next: Option<&Trajectory>,
        description: &Description,
        loaded: Option<&Loaded>,
    ) -> Setting {
        let ledgers = loaded.map_or_else(Vec::new, |loaded| {
            let robot =
                Robot { text: description.text(), loaded, is_mjcf: description.is_mjcf(), dt: gapscope_export::DT };
            // A robot that has no URDF has nothing to paste into it.
            let targets = [Target::Urdf, Target::Mjcf].into_iter();
            targets.filter_map(|target| Some(export(target, &robot, corrected, &[]).ok()?.ledger)).collect()
        });
        let mut scene = Scene::new(model, episodes).with_rollouts(model, episodes, corrected);
        if let Some(trajectory) = next {
            scene = scene.with_motion(model, trajectory);
        }
        Setting { scene: Some(scene), ledgers, origin: corrected.made_from.clone(), made: today() }
    }
}

/// Today, UTC; or the day of `SOURCE_DATE_EPOCH`, which makes a report the same to the byte on any day.
pub fn today() -> String {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|seconds| seconds.parse().ok());
    let now = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs() as i64;
    chrono::DateTime::from_timestamp(given.unwrap_or_else(now), 0)
        .map_or_else(String::new, |time| time.format("%Y-%m-%d").to_string())
}
