//! What a page holds a model to: each joint's gap and its lines over time, whether of torque or of position.

use super::effort::Effort;
use super::words;
use gapscope_diagnosis::schema::{Diagnosis, Evidence, Series, TorqueGap};

/// The gap of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// What the drives push with.
    pub effort: Effort,
    /// The quantity: the word of the effort, or `position`.
    pub what: &'static str,
    /// The model before the corrections, as legends call it.
    pub nominal: &'static str,
    /// The model after them.
    pub corrected: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Every joint in model order.
    pub joints: Vec<JointGap>,
    /// Lines over time of the joints that have any.
    pub series: Vec<Series>,
}

/// The gap of one joint, rms.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointGap {
    /// Name.
    pub name: String,
    /// Unit of the figures.
    pub unit: String,
    /// With the model before the corrections.
    pub before: Option<Figure>,
    /// With the model after them.
    pub after: Option<Figure>,
    /// What noise alone gives.
    pub floor: Option<f64>,
}

/// A figure with its 95 % interval where there is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// Value.
    pub value: f64,
    /// Interval.
    pub ci95: Option<[f64; 2]>,
}

impl JointGap {
    /// Whether the interval of the gap lies above the noise floor.
    pub fn is_above_floor(&self) -> bool {
        let low = self.before.map(|gap| gap.ci95.map_or(gap.value, |ends| ends[0]));
        matches!((low, self.floor), (Some(low), Some(floor)) if low > floor)
    }
}

impl Gauge {
    /// The torque gap of a diagnosis.
    pub fn of(diagnosis: &Diagnosis, evidence: &Evidence) -> Gauge {
        let figure = |gap: &TorqueGap, joint: &str| {
            Some(Figure { value: *gap.rms.get(joint)?, ci95: gap.ci95.get(joint).copied() })
        };
        let before = &diagnosis.gap.torque;
        let remaining = evidence.remaining.as_ref().filter(|_| !diagnosis.effects.is_empty());
        let joint = |name: &String| JointGap {
            name: name.clone(),
            unit: words::torque_unit(name, evidence, &diagnosis.gap.regimes).to_owned(),
            before: figure(before, name),
            after: remaining.and_then(|gap| figure(&gap.torque, name)),
            floor: before.floor.get(name).copied(),
        };
        let mut series: Vec<Series> = evidence.torque.iter().filter(|s| !s.time.is_empty()).cloned().collect();
        if diagnosis.effects.is_empty() {
            // A model with no effects is the model as described.
            series.iter_mut().for_each(|lines| lines.corrected.clear());
        }
        let joints: Vec<JointGap> = diagnosis.joints.iter().map(joint).collect();
        let effort = Effort::of_units(joints.iter().map(|joint| joint.unit.as_str()));
        Gauge {
            effort,
            what: effort.word(),
            nominal: "model as described",
            corrected: "model with the effects",
            robot: diagnosis.robot.clone(),
            joints,
            series,
        }
    }

    /// A joint by its name.
    pub fn joint(&self, name: &str) -> Option<&JointGap> {
        self.joints.iter().find(|joint| joint.name == name)
    }

    /// The joint with the largest gap.
    pub fn largest(&self) -> Option<&JointGap> {
        let size = |joint: &&JointGap| joint.before.map_or(f64::NAN, |gap| gap.value);
        self.joints.iter().filter(|joint| size(joint).is_finite()).max_by(|a, b| size(a).total_cmp(&size(b)))
    }

    /// Whether there is a model after the corrections.
    pub fn has_after(&self) -> bool {
        self.joints.iter().any(|joint| joint.after.is_some())
    }

    /// How boldly a joint is drawn: its gap as a part of the largest with the same unit; `None` at the noise floor.
    pub fn boldness(&self, joint: &JointGap) -> Option<f64> {
        let size = |joint: &JointGap| joint.before.map(|gap| gap.value).filter(|value| value.is_finite());
        let same = self.joints.iter().filter(|other| other.unit == joint.unit);
        let most = same.filter_map(size).fold(0.0, f64::max);
        size(joint).filter(|_| joint.is_above_floor() && most > 0.0).map(|own| own / most)
    }
}
