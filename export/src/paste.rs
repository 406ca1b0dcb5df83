//! What a user pastes into a file of their own: for each joint that changes its name, then text, numbers to four digits.
//! Numbers are totals: what the nominal robot has is included.

use crate::number::number;
use crate::totals::Totals;
use gapscope_dynamics::{Joint, Model};

/// Elements for joints of a URDF: `joint2: <dynamics damping="0" friction="1.3"/>`.
pub fn urdf(nominal: &Model, totals: &Totals) -> Vec<String> {
    let line = |(j, joint): (usize, &Joint)| {
        let (damping, friction) = (totals.damping[j], totals.friction[j]);
        let changed = damping != joint.damping || friction != joint.friction;
        let [damping, friction] = [damping, friction].map(short);
        changed.then(|| format!("{}: <dynamics damping=\"{damping}\" friction=\"{friction}\"/>", joint.name))
    };
    nominal.joints().iter().enumerate().filter_map(line).collect()
}

/// Attributes for joints of an MJCF, those that change: `joint2: frictionloss="1.3" armature="0.02"`.
pub fn mjcf(nominal: &Model, totals: &Totals) -> Vec<String> {
    let line = |(j, joint): (usize, &Joint)| {
        // Like the writer of whole files: the rest of a spring is told in what the encoder shows.
        let sprung = totals.stiffness[j] > 0.0;
        let rest = if sprung { totals.rest[j] + totals.offset[j] } else { 0.0 };
        let attributes = [
            ("damping", joint.damping, totals.damping[j]),
            ("frictionloss", joint.friction, totals.friction[j]),
            ("armature", nominal.armature()[j], totals.armature[j].max(0.0)),
            ("stiffness", 0.0, totals.stiffness[j]),
            ("springref", 0.0, rest),
            ("ref", 0.0, totals.offset[j]),
        ];
        let changed = attributes.iter().filter(|(_, before, after)| before != after);
        let text: Vec<String> = changed.map(|(name, _, after)| format!("{name}=\"{}\"", short(*after))).collect();
        (!text.is_empty()).then(|| format!("{}: {}", joint.name, text.join(" ")))
    };
    nominal.joints().iter().enumerate().filter_map(line).collect()
}

fn short(x: f64) -> String {
    number(format!("{x:.3e}").parse().unwrap_or(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;
    use gapscope_effects::{Armature, CoulombFriction, Effect};

    #[test]
    fn what_changes_is_told_once_for_each_format() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let name = model.joints()[1].name.clone();
        let effects = [
            Effect::CoulombFriction(CoulombFriction { coulomb: [(name.clone(), 0.123456)].into() }),
            Effect::Armature(Armature { armature: [(name.clone(), 0.02)].into() }),
        ];
        let totals = Totals::new(&model, &effects).unwrap();
        let damping = short(model.joints()[1].damping);
        assert_eq!(urdf(&model, &totals), [format!("{name}: <dynamics damping=\"{damping}\" friction=\"0.1235\"/>")]);
        assert_eq!(mjcf(&model, &totals), [format!("{name}: frictionloss=\"0.1235\" armature=\"0.02\"")]);
    }
}
