//! A corrected arm that follows set points: simulated logs.

use crate::arm::simulate_arm;
use crate::given::Given;
use crate::model::{ServoModel, ServoModelError};
use crate::prepare::joints;
use crate::weigh::weigh;
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;

/// The positions of a corrected arm under set points, as a log with both and no torque. It begins at rest at the first ones.
///
/// # Errors
/// A model that does not fit the robot, or drives that follow a current: set points say nothing of one.
pub fn follow(
    model: &Model,
    corrected: &ServoModel,
    name: &str,
    time: Vec<f64>,
    set_points: Vec<Vec<f64>>,
) -> Result<Episode, ServoModelError> {
    let mut episode = Episode {
        name: name.to_owned(),
        joints: model.joints().iter().map(|joint| joint.name.clone()).collect(),
        time,
        position: set_points.clone(),
        command: Some(set_points),
        ..Episode::default()
    };
    let mut all = joints(model, std::slice::from_ref(&episode), &Given::default());
    let laws = corrected.laws(&mut all)?;
    all.iter_mut().zip(&laws).for_each(|(joint, law)| weigh(joint, law));
    let laws: Vec<_> = laws.into_iter().map(Some).collect();
    episode.position = simulate_arm(&corrected.bodies(model)?, &laws, &all, 0);
    Ok(episode)
}
