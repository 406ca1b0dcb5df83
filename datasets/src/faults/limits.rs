//! Units of positions by the robot's limits alone: what logs without effort can tell.

use super::change::Change;
use super::{Doubt, Fault, FaultKind, Faults, figure};
use crate::check::{Logs, excess};
use crate::episode::Episode;
use crate::faults::units::position_units;
use gapscope_dynamics::Model;

/// Positions that were converted may pass the limits by this much, rad or m: the log's zero may be another than the URDF's.
const ZERO: f64 = 0.5;

/// A joint without limits that goes further than this from zero, rad, is in degrees.
const FAR: f64 = 4.0 * std::f64::consts::PI;

/// A position in per cent of a calibrated range goes no further than this.
const WHOLE_RANGE: f64 = 100.0;

/// Looks for positions in degrees, or in mm, in logs that do not hold the effort.
///
/// They are that if some joint passes its limits by more than their span, and all joints of its kind keep to theirs when
/// converted.
pub(super) fn search(model: &Model, episodes: &[&Episode]) -> Faults {
    let fits = |episode: &&Episode| !episode.is_empty() && episode.position.len() == model.dof();
    let episodes: Vec<&Episode> = episodes.iter().copied().filter(fits).collect();
    if episodes.is_empty() {
        return Faults::default();
    }
    let logs = Logs::new(model, &episodes);
    let mut found = Faults::default();
    for prismatic in [false, true] {
        let joints: Vec<usize> = (0..model.dof()).filter(|&j| logs.is_prismatic(j) == prismatic).collect();
        // The first is the usual one. Others would fit as well in a log whose joints stay near zero.
        let (unit, factor) = position_units(prismatic)[0];
        let places: Vec<Place> = joints.iter().map(|&j| Place::of(&logs, j, factor)).collect();
        let beyond: Vec<usize> =
            joints.iter().zip(&places).filter(|(_, place)| place.beyond).map(|(&j, _)| j).collect();
        if beyond.is_empty() || !places.iter().all(|place| place.fits_converted) {
            continue;
        }
        let names: Vec<&str> = beyond.iter().map(|&j| model.joints()[j].name.as_str()).collect();
        let evidence = format!(
            "the positions are in {unit}, {} times what they should be: {} would pass the limits of the robot by more than their span, or go round many times, and all joints keep to theirs when converted",
            figure(factor),
            names.join(", ")
        );
        let changes = joints.iter().map(|&j| Change::Position(j, 1.0 / factor, 0.0)).collect();
        let all: Vec<usize> = (0..episodes.len()).collect();
        found.faults.push(Fault::new(&logs, FaultKind::PositionScale, &joints, &all, Some(factor), evidence, changes));
        if !prismatic && places.iter().all(|place| place.largest <= WHOLE_RANGE) {
            found.doubts.push(Doubt {
                question: "are the positions in degrees, or in per cent of a calibrated range? None passes 100, and they are read as degrees. If they are per cent, scale and zero of each joint are not known: give --calibration FILE".to_owned(),
                joints: Vec::new(),
                effects: Vec::new(),
            });
        }
    }
    found
}

/// Where a joint's positions lie, against its limits.
struct Place {
    /// Beyond the limits by more than their span.
    beyond: bool,
    /// Near enough to the limits when converted.
    fits_converted: bool,
    /// Greatest position, without its sign.
    largest: f64,
}

impl Place {
    fn of(logs: &Logs, joint: usize, factor: f64) -> Place {
        let low = logs.traits.iter().map(|traits| traits[joint].low).fold(f64::INFINITY, f64::min);
        let high = logs.traits.iter().map(|traits| traits[joint].high).fold(f64::NEG_INFINITY, f64::max);
        let limits = &logs.model.joints()[joint].limits;
        let span = limits.lower.zip(limits.upper).map(|(lower, upper)| upper - lower).filter(|span| *span > 0.0);
        let largest = low.abs().max(high.abs());
        Place {
            beyond: match span {
                Some(span) => excess(logs, joint, 1.0, low, high) > span,
                None => !logs.is_prismatic(joint) && largest > FAR,
            },
            fits_converted: match span {
                Some(_) => excess(logs, joint, 1.0 / factor, low, high) < ZERO,
                None => logs.is_prismatic(joint) || largest / factor < FAR,
            },
            largest,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::episode::Episode;
    use crate::faults::{FaultKind, find_faults, mend};
    use gapscope_dynamics::Model;

    fn model() -> Model {
        let link = |name: &str| {
            format!(
                "<link name=\"{name}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
            )
        };
        let joint = |name: &str, parent: &str, child: &str| {
            format!(
                "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\" effort=\"5\" velocity=\"9\"/></joint>"
            )
        };
        let text = format!(
            "<robot name=\"two\"><link name=\"base\"/>{}{}{}{}</robot>",
            link("upper"),
            link("lower"),
            joint("a", "base", "upper"),
            joint("b", "upper", "lower")
        );
        Model::from_urdf(&text).unwrap().model
    }

    /// A log without torque whose joints swing by `size`, about a middle of `middle`.
    fn log(size: f64, middle: f64) -> Episode {
        let time: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
        let row = |w: f64| time.iter().map(|t| middle + size * (w * t).sin()).collect::<Vec<f64>>();
        let position = vec![row(2.0), row(3.0)];
        Episode {
            name: "run".into(),
            joints: vec!["a".into(), "b".into()],
            command: Some(position.clone()),
            position,
            time,
            ..Episode::default()
        }
    }

    #[test]
    fn degrees_are_told_by_the_limits_and_mended_with_the_set_points() {
        let (model, logs) = (model(), [log(60.0, 30.0)]);
        let found = find_faults(&model, &logs);
        assert_eq!(found.faults[0].kind, FaultKind::PositionScale);
        assert!(found.doubts[0].question.contains("--calibration"), "{:?}", found.doubts);
        let (_, mended) = mend(&model, &logs, &found.faults);
        let expected = logs[0].position[1][7].to_radians();
        assert!((mended[0].position[1][7] - expected).abs() < 1e-12);
        assert!((mended[0].command.as_ref().unwrap()[1][7] - expected).abs() < 1e-12);
    }

    #[test]
    fn beyond_a_hundred_they_are_no_per_cent_and_beyond_all_limits_nothing_is_said() {
        assert!(find_faults(&model(), &[log(50.0, 60.0)]).doubts.is_empty());
        for (size, middle) in [(0.5, 0.2), (1.9, 0.5), (500.0, 0.0)] {
            let found = find_faults(&model(), &[log(size, middle)]);
            assert!(found.faults.is_empty() && found.doubts.is_empty(), "{size} {middle}: {found:?}");
        }
    }
}
