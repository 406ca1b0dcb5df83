//! The robot as a skeleton in space: where its joints lie in the logs, and where models or a motion to come take them.
//!
//! Forward kinematics stands here alone: the page gets points, and its script only turns and draws them.

mod plays;

pub use plays::NEXT;

use super::packed::Packed;
use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, Model};
use glam::DVec3;
use serde::Serialize;

/// Instants of the logs that are kept over all joints, and the most of them.
const POINTS: usize = 4000;
const FRAMES: usize = 240;
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
    /// What plays beside the log.
    pub plays: Vec<Play>,
}

/// Skeletons that move together from one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Play {
    /// By which the page's buttons name it.
    pub name: &'static str,
    /// Words of its button.
    pub label: &'static str,
    /// Length, s.
    pub length: f64,
    /// Seconds of it in a second of the reader's.
    pub pace: f64,
    /// The robot first, then the models. Frames are evenly spaced; a model that leaves the finite numbers has fewer.
    pub skeletons: Vec<Moving>,
}

/// One skeleton that plays.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
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
    plays: Vec<PlayPacket>,
}

#[derive(Serialize)]
struct PlayPacket {
    name: &'static str,
    length: f64,
    pace: f64,
    skeletons: Vec<(&'static str, Vec<Packed>)>,
}

impl Scene {
    /// The skeleton in the logs; nothing else plays yet.
    pub fn new(model: &Model, episodes: &[Episode]) -> Scene {
        let skeleton = Skeleton::of(model);
        let most = most_frames(model);
        let total: f64 = episodes.iter().map(|e| e.len() as f64 * e.dt()).sum();
        let every = total / most as f64;
        let (mut time, mut frames, mut offset, mut next) = (vec![], vec![], 0.0, 0.0);
        for episode in episodes {
            let dt = episode.dt();
            for k in 0..episode.len() {
                let at = offset + k as f64 * dt;
                if at >= next {
                    time.push(at);
                    frames.push(skeleton.at(&sample(&episode.position, k)));
                    next = at + every;
                }
            }
            offset += episode.len() as f64 * dt;
        }
        let parents = model.joints().iter().map(|joint| joint.parent).collect();
        let joints = model.joints().iter().map(|joint| joint.name.clone()).collect();
        Scene { joints, parents, tips: skeleton.tips, time, frames, plays: Vec::new() }
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
            plays: self.plays.iter().map(Play::packet).collect(),
        }
    }

    /// Every frame in which the robot stands somewhere; what only a model does may leave the picture.
    pub fn robot_frames(&self) -> impl Iterator<Item = &Vec<DVec3>> {
        let played = self.plays.iter().filter_map(|play| play.skeletons.first());
        self.frames.iter().chain(played.flat_map(|robot| &robot.frames))
    }
}

impl Play {
    fn packet(&self) -> PlayPacket {
        PlayPacket {
            name: self.name,
            length: self.length,
            pace: self.pace,
            skeletons: self.skeletons.iter().map(|s| (s.class, rows(&s.frames))).collect(),
        }
    }
}

/// Frames of a motion that keep the page small whatever the robot.
fn most_frames(model: &Model) -> usize {
    (POINTS / (2 * model.dof() + 1)).clamp(20, FRAMES)
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

impl<'a> Skeleton<'a> {
    fn of(model: &'a Model) -> Skeleton<'a> {
        let carries = |j: &usize| model.joints().iter().any(|joint| joint.parent == Some(*j));
        let tips = (0..model.dof()).filter(|j| !carries(j)).collect();
        let mut skeleton = Skeleton { model, tips, reach: 1.0 };
        skeleton.measure();
        skeleton
    }

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
