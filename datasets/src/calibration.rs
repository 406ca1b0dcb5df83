//! The calibration file of a LeRobot arm: what a per cent of a motor's range is in radians.

use crate::error::{LogError, LogErrorKind};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

/// Steps of a turn of the motors' encoders, from the first to the last: LeRobot divides 360 degrees by them.
const STEPS: f64 = 4095.0;

/// What a per cent of each motor's range is, as LeRobot's calibration writes it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Calibration {
    motors: BTreeMap<String, Motor>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Motor {
    #[serde(default)]
    drive_mode: i64,
    range_min: f64,
    range_max: f64,
}

impl Calibration {
    /// Reads the JSON file that `lerobot-calibrate` wrote: for each motor `range_min`, `range_max` and `drive_mode`.
    ///
    /// # Errors
    /// A file that cannot be read, or does not have this form.
    pub fn from_json_file(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|error| {
            LogError::new(LogErrorKind::CannotRead, format!("the calibration cannot be read: {error}"))
                .file(path.display().to_string())
                .hint("Check the path")
        })?;
        Self::from_json(&text).map_err(|error| error.file(path.display().to_string()))
    }

    /// Reads the text of such a file.
    ///
    /// # Errors
    /// Text that does not have this form.
    pub fn from_json(text: &str) -> Result<Self, LogError> {
        let wrong = |found: String| {
            LogError::new(LogErrorKind::ColumnMap, found)
                .hint("Give the file that lerobot-calibrate wrote, with range_min and range_max for each motor")
        };
        let motors: BTreeMap<String, Motor> =
            serde_json::from_str(text).map_err(|error| wrong(format!("this is no calibration of LeRobot: {error}")))?;
        for (name, motor) in &motors {
            let span = motor.range_max - motor.range_min;
            if !(span > 0.0 && span <= STEPS + 1.0) {
                return Err(wrong(format!("the range of `{name}` is {} to {}", motor.range_min, motor.range_max)));
            }
        }
        Ok(Self { motors })
    }

    /// Turns positions of a motor in per cent, −100 to 100 or for a gripper 0 to 100, into rad from the middle of its
    /// range; `false` where it does not know the motor.
    #[cfg_attr(not(feature = "parquet"), allow(dead_code))]
    pub(crate) fn to_rad(&self, motor: &str, values: &mut [f64]) -> bool {
        let Some(known) = self.motors.get(motor) else { return false };
        let span = (known.range_max - known.range_min) * TAU / STEPS;
        let sense = if known.drive_mode == 0 { 1.0 } else { -1.0 };
        let (middle, width) = if motor.contains("gripper") { (50.0, 100.0) } else { (0.0, 200.0) };
        values.iter_mut().for_each(|value| *value = sense * (*value - middle) / width * span);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{"elbow": {"id": 1, "drive_mode": 0, "homing_offset": 7, "range_min": 1000, "range_max": 3047.5},
        "gripper": {"id": 2, "drive_mode": 1, "homing_offset": 0, "range_min": 2000, "range_max": 3000}}"#;

    #[test]
    fn per_cent_become_rad_from_the_middle() {
        let calibration = Calibration::from_json(FILE).unwrap();
        let mut values = [-100.0, 0.0, 100.0];
        assert!(calibration.to_rad("elbow", &mut values));
        // Half of all steps: half a turn from end to end.
        let quarter = TAU / 4.0;
        assert!((values[0] + quarter).abs() < 1e-12 && values[1] == 0.0 && (values[2] - quarter).abs() < 1e-12);
        let mut values = [0.0, 50.0];
        assert!(calibration.to_rad("gripper", &mut values));
        assert!(values[0] > 0.0 && values[1] == 0.0);
        assert!(!calibration.to_rad("wrist", &mut values));
    }

    #[test]
    fn what_is_no_calibration_is_refused() {
        for text in ["", "[]", r#"{"a": {}}"#, r#"{"a": {"range_min": 5, "range_max": 5}}"#] {
            assert!(!Calibration::from_json(text).unwrap_err().hint.is_empty(), "{text}");
        }
    }
}
