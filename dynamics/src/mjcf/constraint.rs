//! What ties joints together or drives them: tendons, equality constraints, actuators.

use super::error::MjcfError;
use super::settings::Settings;
use super::source::Element;
use crate::finding::Finding;
use crate::model::{Joint, Model};
use crate::urdf::Loaded;

/// Refuses tendons and equality constraints by name, unless all joints that they concern are held.
pub(super) fn check(root: &Element, locked: &[&str]) -> Result<(), MjcfError> {
    let held = |names: &[&str]| !names.is_empty() && names.iter().all(|name| locked.contains(name));
    let lock = |names: &[&str]| -> String {
        let flags: Vec<String> = names.iter().map(|name| format!("--lock {name}")).collect();
        if flags.is_empty() { String::new() } else { format!("; or hold its joints still: {}", flags.join(" ")) }
    };
    for tendon in root.all("tendon").flat_map(|tendons| &tendons.children) {
        let joints: Vec<&str> = tendon.all("joint").filter_map(|joint| joint.get("joint")).collect();
        if !held(&joints) {
            return Err(MjcfError::new(
                "a tendon couples joints, and the model has independent joints",
                format!("Take it out, with what drives it{}", lock(&joints)),
            )
            .at(tendon));
        }
    }
    for equality in root.all("equality").flat_map(|equalities| &equalities.children) {
        if equality.get("active") == Some("false") {
            continue;
        }
        let joints: Vec<&str> = ["joint1", "joint2"].iter().filter_map(|name| equality.get(name)).collect();
        if !(equality.kind == "joint" && held(&joints)) {
            return Err(MjcfError::new(
                "an equality constraint couples bodies or joints, and the model has independent joints",
                format!("Take it out, or write active=\"false\"{}", lock(&joints)),
            )
            .at(equality));
        }
    }
    Ok(())
}

/// Gives joints the effort limits of their actuators, and says what else the actuators hold.
pub(super) fn limit_effort(root: &Element, settings: &Settings, loaded: Loaded) -> Result<Loaded, MjcfError> {
    let Loaded { model, mut findings, links } = loaded;
    let mut joints: Vec<Joint> = model.joints().to_vec();
    let mut count = 0;
    for actuator in root.all("actuator").flat_map(|actuators| &actuators.children) {
        count += 1;
        let filled = settings.filled(actuator, None)?;
        let joint = filled.get("joint").and_then(|name| joints.iter_mut().find(|joint| joint.name == name));
        let Some(joint) = joint else { continue };
        let [gear, ..] = filled.numbers("gear", 1, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?.unwrap_or([1.0; 6]);
        let force = filled.numbers("forcerange", 2, [0.0; 2])?.or(match actuator.kind.as_str() {
            "motor" => filled.numbers("ctrlrange", 2, [0.0; 2])?,
            _ => None,
        });
        let limit = force.map(|[low, high]| gear.abs() * low.abs().max(high.abs())).filter(|limit| *limit > 0.0);
        joint.limits.effort = joint.limits.effort.or(limit);
    }
    if count > 0 {
        findings.push(Finding::new(
            "<actuator>",
            format!("{count} read for effort limits alone: the logs hold the effort at the joints, so gears and gains are not needed"),
        ));
    }
    let armature = model.armature().to_vec();
    let limited = Model::new(model.name().to_owned(), model.base().to_owned(), joints)
        .map_err(|error| MjcfError::new(error.to_string(), "Correct the model"))?;
    Ok(Loaded { model: limited.with_armature(&armature).with_gravity(settings.gravity), findings, links })
}
