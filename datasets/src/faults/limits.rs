//! Units of positions by the robot's limits alone: what logs without effort can tell.

use super::change::Change;
use super::{Doubt, Fault, FaultKind, Faults, figure};
use crate::check::{Logs, excess};
use crate::episode::Episode;
use crate::faults::units::position_units;
use gapscope_dynamics::Model;

/// Positions that were converted may pass the limits by this much, rad or m: the log's zero may be another than the URDF's.
const ZERO: f64 = 0.5;

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
            "the positions are in {unit}, {} times what they should be: {} would pass the limits of the robot by more than their span, and all joints keep to theirs when converted",
            figure(factor),
            names.join(", ")
        );
        let changes = joints.iter().map(|&j| Change::Position(j, 1.0 / factor, 0.0)).collect();
        let all: Vec<usize> = (0..episodes.len()).collect();
        found.faults.push(Fault::new(
            &logs,
            FaultKind::PositionScale,
            &joints,
            &all,
            Some(factor),
            evidence,
            changes,
        ));
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
        Place {
            beyond: span.is_some_and(|span| excess(logs, joint, 1.0, low, high) > span),
            fits_converted: span.is_none() || excess(logs, joint, 1.0 / factor, low, high) < ZERO,
            largest: low.abs().max(high.abs()),
        }
    }
}
