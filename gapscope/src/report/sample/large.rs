//! A page that is as large as pages get: thirty joints with long names, a thousand episodes.

use super::super::scene::{Moving, Play, Scene};
use super::super::setting::Setting;
use super::parts::*;
use super::{Case, explained};
use gapscope_diagnosis::Origin;
use gapscope_diagnosis::schema::Combination;
use glam::DVec3;

const JOINTS: usize = 30;
const EPISODES: usize = 1000;
/// Samples of an episode.
const SAMPLES: usize = 20;
const FRAMES: usize = 60;

/// The diagnosis, and what its page says beside it.
pub fn large() -> (Case, Setting) {
    let (_, mut diagnosis, mut evidence) = explained();
    let names: Vec<String> =
        (1..=JOINTS).map(|j| format!("left_front_manipulator_segment_{j:02}_rotation_joint")).collect();
    let rms: Vec<f64> = (0..JOINTS).map(|j| 2.5 / (1.0 + 0.3 * j as f64)).collect();
    diagnosis.robot = "chain_with_many_joints_and_long_names".into();
    diagnosis.joints = names.clone();
    diagnosis.data.episodes = EPISODES;
    diagnosis.data.samples = EPISODES * SAMPLES;
    diagnosis.data.findings = (0..EPISODES)
        .map(|e| format!("session_{e:04}.csv: gap of 0.12 s at t = 7.31 s; the episode is split there"))
        .collect();
    diagnosis.gap = gap(&names, &rms, regimes(&names));
    diagnosis.gap.torque.floor = names.iter().map(|name| (name.clone(), 0.04)).collect();
    let after: Vec<f64> = rms.iter().map(|x| 0.06 * x).collect();
    evidence.remaining = Some(gap(&names, &after, vec![]));
    diagnosis.effects.retain(|effect| effect.kind == "coulomb_friction");
    diagnosis.effects[0].joints = names.clone();
    // As wide as numbers get: those of a servo whose torque is known as a ratio.
    let of = |parameter: &str| (parameter.to_owned(), each(&names, &rms, 0.04, "N m per N m/rad"));
    diagnosis.effects[0].parameters = ["coulomb", "static_friction", "stribeck_velocity", "viscous"].map(of).into();
    diagnosis.unexplained.regimes = regimes(&names);
    let of = |name: &String| Combination {
        words: format!("first moment along x of {name}_link and all it carries (zero pose)"),
        terms: [].into(),
        value: -0.000873,
        ci95: [-0.007304, 0.005558],
        unit: "kg m".into(),
    };
    diagnosis.combinations = names.iter().map(of).collect();
    diagnosis.power.clear();
    evidence.torque = torque(&names, "N m", EPISODES * SAMPLES);
    for series in &mut evidence.torque {
        series.breaks = (1..EPISODES).map(|e| e * SAMPLES).collect();
    }
    evidence.curves = names
        .iter()
        .zip(rms)
        .map(|(joint, f)| curve("coulomb_friction", joint, "speed, rad/s", move |v| -f * v.signum(), 0.3 * f))
        .collect();
    evidence.logs = (0..EPISODES).map(|e| format!("logs/session_{e:04}.csv")).collect();
    let digest = |e: usize| format!("{:064x}", 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(e as u64 + 1));
    let origin = Origin { robot: digest(0), logs: (0..EPISODES).map(digest).collect() };
    let setting =
        Setting { scene: Some(scene(&names)), ledgers: vec![], origin: Some(origin), made: "2026-01-31".into() };
    (("large", diagnosis, evidence), setting)
}

/// A chain that swings.
fn scene(names: &[String]) -> Scene {
    let stand = |t: f64| -> Vec<DVec3> {
        let mut at = DVec3::ZERO;
        let mut ends = vec![];
        for j in 0..names.len() {
            let angle = 0.06 * (t + 0.2 * j as f64).sin() * j as f64;
            at += DVec3::new(angle.sin(), 0.3 * angle.cos(), -angle.cos()) / names.len() as f64;
            let half = 0.045 * [DVec3::Y, DVec3::Z, DVec3::X][j % 3];
            ends.extend([at - half, at + half]);
        }
        ends
    };
    let frames: Vec<Vec<DVec3>> = (0..FRAMES).map(|k| stand(0.1 * k as f64)).collect();
    let moving =
        |class, late: f64| Moving { class, frames: (0..FRAMES).map(|k| stand(0.1 * k as f64 - late)).collect() };
    Scene {
        joints: names.to_vec(),
        parents: (0..names.len()).map(|j| j.checked_sub(1)).collect(),
        tips: vec![],
        time: (0..FRAMES).map(|k| 0.1 * k as f64).collect(),
        frames,
        plays: vec![Play {
            name: "rollout",
            label: "Play a rollout",
            length: 1.0,
            pace: 0.25,
            skeletons: vec![moving("measured", 0.0), moving("before", 0.8), moving("after", 0.1)],
        }],
    }
}
