//! The robot as a skeleton in space: where its joints lie in the logs, and where open-loop rollouts of the models take them.
//!
//! Forward kinematics stands here alone: the page gets points, and its script only turns and draws them.

use super::packed::Packed;
use gapscope_datasets::Episode;
use gapscope_diagnosis::Corrected;
use gapscope_dynamics::{Data, Model, StepModel};
use gapscope_effects::Plant;
use glam::DVec3;
use serde::Serialize;

/// Instants of the logs that are kept over all joints, and the most of them.
const POINTS: usize = 4000;
const FRAMES: usize = 240;
/// Frames and length of a rollout that plays, s.
const STEPS: usize = 40;
const HORIZON: f64 = 1.0;
/// Half the length of a joint's barrel, as a part of the robot's reach.
const BARREL: f64 = 0.045;
/// A link without joints behind it ends at this many times its centre of mass: at two a rod is as long as it is.
const TIP: f64 = 2.0;
/// A tip nearer than this part of the reach is not drawn.
const SHORT: f64 = 0.03;
/// Resolution of the points, as a part of the reach.
const STEP: f64 = 1e-3;

/// The skeleton over time. Points are in units of the robot's reach, in the frame of the base, z up.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// Joint names in model order.
    pub joints: Vec<String>,
    /// For each joint the joint that carries it; `None` at the base.
    pub parents: Vec<Option<usize>>,
    /// For each link that ends free the joint that moves it; its end stands behind the joints' points.
    pub tips: Vec<usize>,
    /// Time of each frame over all episodes one after another, s.
    pub time: Vec<f64>,
    /// `[frame][point]`: both ends of each joint's barrel, then the tips.
    pub frames: Vec<Vec<DVec3>>,
    /// Rollouts from one instant: the robot, the model as described, the model with the effects where there are any.
    pub rollouts: Vec<Rollout>,
    /// Length of the rollouts, s.
    pub horizon: f64,
}

/// One skeleton that plays.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// `measured`, `before` or `after`: classes of the style sheet.
    pub class: &'static str,
    /// As in [`Scene::frames`].
    pub frames: Vec<Vec<DVec3>>,
}

/// What the script reads.
#[derive(Serialize)]
pub struct Packet<'a> {
    joints: &'a [String],
    parents: Vec<i64>,
    tips: &'a [usize],
    step: f64,
    still: usize,
    time: Packed,
    /// One row for each coordinate of each point.
    points: Vec<Packed>,
    horizon: f64,
    rollouts: Vec<(&'static str, Vec<Packed>)>,
}

impl Scene {
    /// The skeleton in the logs, and rollouts of the model as described and with the corrections.
    pub fn new(model: &Model, episodes: &[Episode], corrected: &Corrected) -> Scene {
        let n = model.dof();
        let parents: Vec<Option<usize>> = model.joints().iter().map(|joint| joint.parent).collect();
        let leaves = (0..n).filter(|&j| !parents.contains(&Some(j)));
        let mut skeleton = Skeleton { model, tips: leaves.collect(), reach: 1.0 };
        skeleton.measure();
        let most = (POINTS / (2 * n + 1).max(1)).clamp(20, FRAMES);
        let total: f64 = episodes.iter().map(|e| e.len() as f64 * e.dt()).sum();
        let every = total / most as f64;
        let (mut time, mut frames, mut offset, mut next) = (vec![], vec![], 0.0, 0.0);
        for episode in episodes {
            for k in 0..episode.len() {
                let at = offset + k as f64 * episode.dt();
                if at >= next {
                    time.push(at);
                    frames.push(skeleton.at(&sample(&episode.position, k)));
                    next = at + every;
                }
            }
            offset += episode.len() as f64 * episode.dt();
        }
        let (rollouts, horizon) = rollouts(&skeleton, episodes, corrected).unwrap_or_default();
        let joints = model.joints().iter().map(|joint| joint.name.clone()).collect();
        Scene { joints, parents, tips: skeleton.tips, time, frames, rollouts, horizon }
    }

    /// The frame that shows the robot at its widest: folded up, its joints hide each other.
    pub fn still(&self) -> usize {
        let spread = |frame: &Vec<DVec3>| {
            let center = frame.iter().sum::<DVec3>() / frame.len().max(1) as f64;
            frame.iter().map(|p| (*p - center).length_squared()).sum::<f64>()
        };
        let spreads: Vec<f64> = self.frames.iter().map(spread).collect();
        (0..spreads.len()).max_by(|&a, &b| spreads[a].total_cmp(&spreads[b])).unwrap_or(0)
    }

    /// As numbers for the script.
    pub fn packet(&self) -> Packet<'_> {
        Packet {
            joints: &self.joints,
            parents: self.parents.iter().map(|p| p.map_or(-1, |p| p as i64)).collect(),
            tips: &self.tips,
            step: STEP,
            still: self.still(),
            time: Packed::new(&self.time, 1e-3),
            points: rows(&self.frames),
            horizon: self.horizon,
            rollouts: self.rollouts.iter().map(|r| (r.class, rows(&r.frames))).collect(),
        }
    }
}

fn rows(frames: &[Vec<DVec3>]) -> Vec<Packed> {
    let points = frames.first().map_or(0, Vec::len);
    (0..3 * points).map(|c| Packed::new(&frames.iter().map(|f| f[c / 3][c % 3]).collect::<Vec<_>>(), STEP)).collect()
}

fn sample(rows: &[Vec<f64>], k: usize) -> Vec<f64> {
    rows.iter().map(|row| row.get(k).copied().filter(|x| x.is_finite()).unwrap_or(0.0)).collect()
}

/// Points of a robot.
struct Skeleton<'a> {
    model: &'a Model,
    tips: Vec<usize>,
    reach: f64,
}

impl Skeleton<'_> {
    /// Finds the reach: the sum of all lengths from the base to the farthest point, at position zero.
    fn measure(&mut self) {
        let joints = self.model.joints();
        let mut far: Vec<f64> = Vec::with_capacity(joints.len());
        for joint in joints {
            let travel = match joint.kind {
                gapscope_dynamics::JointKind::Prismatic => {
                    [joint.limits.lower, joint.limits.upper].into_iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()))
                }
                _ => 0.0,
            };
            let base = joint.parent.map_or(0.0, |p| far[p]);
            far.push(base + joint.placement.translation.length() + travel.min(10.0));
        }
        let ends = self.tips.iter().map(|&j| far[j] + self.tip(j).length());
        let reach = far.iter().copied().chain(ends).fold(0.0, f64::max);
        self.reach = if reach.is_finite() && reach > 0.0 { reach } else { 1.0 };
        let reach = self.reach;
        self.tips = self.tips.iter().copied().filter(|&j| self.tip(j).length() > SHORT * reach).collect();
    }

    /// End of a free link in its own frame, m.
    fn tip(&self, joint: usize) -> DVec3 {
        let inertia = &self.model.joints()[joint].inertia;
        let tip = TIP * inertia.first_moment / inertia.mass;
        if tip.is_finite() { tip } else { DVec3::ZERO }
    }

    fn at(&self, q: &[f64]) -> Vec<DVec3> {
        let mut data = Data::new(self.model);
        self.model.forward_kinematics(&mut data, q);
        let barrel = |(j, joint): (usize, &gapscope_dynamics::Joint)| {
            let frame = data.world_from_link(j);
            let half = frame.rotation * joint.axis * (BARREL * self.reach);
            [frame.translation - half, frame.translation + half]
        };
        let ends = self.model.joints().iter().enumerate().flat_map(barrel);
        let tips = self.tips.iter().map(|&j| data.world_from_link(j).transform_point(self.tip(j)));
        ends.chain(tips).map(|point| point / self.reach).collect()
    }
}

/// Skeletons of the robot and the models from one instant of the longest log; `None` where nothing can be rolled out.
fn rollouts(skeleton: &Skeleton, episodes: &[Episode], corrected: &Corrected) -> Option<(Vec<Rollout>, f64)> {
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
    let mut list = vec![Rollout { class: "measured", frames: log }];
    list.push(Rollout { class: "before", frames: run(Plant::nominal(model, dt)) });
    if !corrected.effects.is_empty() {
        list.push(Rollout { class: "after", frames: run(corrected.plant(model, dt).ok()?) });
    }
    Some((list, (STEPS * stride) as f64 * dt))
}
