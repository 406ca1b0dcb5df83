//! What the skeleton can play beside the log: open-loop rollouts, the free run of a servo arm, and the motion to log next.

use super::{Moving, Play, Scene, Skeleton, most_frames, sample};
use gapscope_datasets::{Episode, Trajectory};
use gapscope_diagnosis::Corrected;
use gapscope_dynamics::{Model, StepModel};
use gapscope_effects::Plant;

/// Frames and length of a rollout, s, and its pace: it is over in a second.
const STEPS: usize = 40;
const HORIZON: f64 = 1.0;
const SLOWED: f64 = 0.25;
/// The play that is the next experiment.
pub const NEXT: &str = "next";
/// Longest stretch of a free run, s.
const STRETCH: f64 = 12.0;

impl Scene {
    /// Adds rollouts under the logged effort: the robot, the model as described, and with the effects where there are any.
    pub fn with_rollouts(mut self, model: &Model, episodes: &[Episode], corrected: &Corrected) -> Scene {
        self.plays.extend(rollouts(&Skeleton::of(model), episodes, corrected));
        self
    }

    /// Adds free runs under the set points, `[log][joint][sample]`: the stretch in which the nominal arm is furthest off.
    pub fn with_free_run(
        mut self,
        model: &Model,
        episodes: &[Episode],
        nominal: &[Vec<Vec<f64>>],
        corrected: &[Vec<Vec<f64>>],
    ) -> Scene {
        self.plays.extend(free_run(&Skeleton::of(model), episodes, nominal, corrected));
        self
    }

    /// Whether the next experiment can be played.
    pub fn plays_next(&self) -> bool {
        self.plays.iter().any(|play| play.name == NEXT)
    }

    /// Adds a motion that the robot is to follow.
    pub fn with_motion(mut self, model: &Model, trajectory: &Trajectory) -> Scene {
        self.plays.extend(motion(&Skeleton::of(model), trajectory));
        self
    }
}

/// `None` where the motion is not one of this robot's joints, or has no two rows.
fn motion(skeleton: &Skeleton, trajectory: &Trajectory) -> Option<Play> {
    let last = trajectory.time.len().checked_sub(1).filter(|last| *last > 0)?;
    let fits = trajectory.joints.iter().eq(skeleton.model.joints().iter().map(|joint| &joint.name));
    let steps = most_frames(skeleton.model).min(last);
    let frames = (0..=steps).map(|s| skeleton.at(&sample(&trajectory.position, s * last / steps))).collect();
    let skeletons = vec![Moving { class: "measured", frames }];
    let length = trajectory.duration();
    fits.then_some(Play { name: NEXT, label: "Play the next experiment", length, pace: 1.0, skeletons })
}

/// From one instant of the longest log; `None` where nothing can be rolled out.
fn rollouts(skeleton: &Skeleton, episodes: &[Episode], corrected: &Corrected) -> Option<Play> {
    let whole = |e: &&Episode| e.has_effort() && e.effort_unknown.is_empty() && e.len() > 2 * STEPS;
    let episode = episodes.iter().filter(whole).max_by_key(|e| e.len())?;
    let (model, dt) = (skeleton.model, episode.dt());
    let start = episode.len() / 4;
    let stride = ((HORIZON / dt) as usize).min(episode.len() - start - 2) / STEPS;
    if stride == 0 {
        return None;
    }
    let [q, before, after] = [start, start - 1, start + 1].map(|k| sample(&episode.position, k));
    let v: Vec<f64> = match &episode.velocity {
        Some(velocity) => sample(velocity, start),
        None => before.iter().zip(&after).map(|(a, b)| (b - a) / (2.0 * dt)).collect(),
    };
    let run = |mut plant: Plant| {
        let mut x = vec![0.0; plant.state_len()];
        plant.start_at(start as f64 * dt, &q, &v, &mut x);
        let mut frames = vec![skeleton.at(&q)];
        for step in 0..STEPS {
            for k in 0..stride {
                plant.step(&mut x, &sample(&episode.effort, start + step * stride + k));
            }
            let place = &x[..model.dof()];
            if place.iter().any(|q| !q.is_finite()) {
                break;
            }
            frames.push(skeleton.at(place));
        }
        frames
    };
    let log = (0..=STEPS).map(|s| skeleton.at(&sample(&episode.position, start + s * stride))).collect();
    let mut skeletons = vec![Moving { class: "measured", frames: log }];
    skeletons.push(Moving { class: "before", frames: run(Plant::nominal(model, dt)) });
    if !corrected.effects.is_empty() {
        skeletons.push(Moving { class: "after", frames: run(corrected.plant(model, dt).ok()?) });
    }
    let length = (STEPS * stride) as f64 * dt;
    Some(Play { name: "rollout", label: "Play a rollout", length, pace: SLOWED, skeletons })
}

/// `None` where no log has two samples.
fn free_run(
    skeleton: &Skeleton,
    episodes: &[Episode],
    nominal: &[Vec<Vec<f64>>],
    corrected: &[Vec<Vec<f64>>],
) -> Option<Play> {
    let stretches = episodes.iter().zip(nominal).enumerate().filter(|(_, (e, _))| e.len() > 1 && e.dt() > 0.0);
    let far = |e: &Episode, path: &[Vec<f64>], from: usize, to: usize| {
        let rows = path.iter().zip(&e.position);
        let square =
            rows.map(|(a, b)| (from..=to).map(|k| (a[k] - b[k]).powi(2)).filter(|x| x.is_finite()).sum::<f64>());
        square.sum::<f64>()
    };
    let candidates = stretches.flat_map(|(log, (e, path))| {
        let length = ((STRETCH / e.dt()) as usize).clamp(1, e.len() - 1);
        // Stretches overlap by half.
        (0..e.len() - length).step_by(length.div_ceil(2)).map(move |from| {
            let to = from + length;
            (far(e, path, from, to), log, from, to)
        })
    });
    let (_, log, from, to) = candidates.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let episode = &episodes[log];
    let steps = most_frames(skeleton.model).min(to - from);
    let frames = |path: &[Vec<f64>]| {
        let places = (0..=steps).map(|s| from + s * (to - from) / steps);
        let sound = |k: &usize| path.iter().all(|row| row.get(*k).is_some_and(|q| q.is_finite()));
        places.take_while(sound).map(|k| skeleton.at(&sample(path, k))).collect::<Vec<_>>()
    };
    let robot = (0..=steps).map(|s| skeleton.at(&sample(&episode.position, from + s * (to - from) / steps))).collect();
    let mut skeletons = vec![Moving { class: "measured", frames: robot }];
    for (class, paths) in [("before", nominal), ("after", corrected)] {
        let frames = paths.get(log).map(|path| frames(path)).unwrap_or_default();
        if !frames.is_empty() {
            skeletons.push(Moving { class, frames });
        }
    }
    let length = episode.time[to] - episode.time[from];
    Some(Play { name: "free-run", label: "Play the free run", length, pace: 1.0, skeletons })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn a_motion_plays_from_its_first_row_to_its_last() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
        let time: Vec<f64> = (0..500).map(|k| 0.01 * f64::from(k)).collect();
        let position = vec![time.clone(), time.iter().map(|t| -t).collect()];
        let trajectory = Trajectory { joints, time, position, ..Trajectory::default() };
        let scene = Scene::new(&model, &[]).with_motion(&model, &trajectory);
        let [play] = scene.plays.as_slice() else { panic!("one play") };
        assert!((play.length - 4.99).abs() < 1e-9 && play.name == NEXT);
        let skeleton = Skeleton::of(&model);
        let frames = &play.skeletons[0].frames;
        assert_eq!(frames[0], skeleton.at(&[0.0, 0.0]));
        assert_eq!(*frames.last().unwrap(), skeleton.at(&[4.99, -4.99]));
        let other = Trajectory { joints: vec!["other".into()], ..trajectory };
        assert!(Scene::new(&model, &[]).with_motion(&model, &other).plays.is_empty());
    }
}
