//! Reading what an earlier call wrote.

use gapscope_diagnosis::schema::Diagnosis;
use serde_json::Value;

/// The diagnosis of the text of a diagnosis.json whose logs hold torque.
///
/// JSON has no infinity: the error of a rollout that diverges is `null` in the file, and a joint without a figure here.
///
/// # Errors
/// A text that is no such diagnosis.
pub fn diagnosis(text: &str) -> serde_json::Result<Diagnosis> {
    let mut value: Value = serde_json::from_str(text)?;
    if let Some(gap) = value.get_mut("gap") {
        drop_null(gap);
    }
    serde_json::from_value(value)
}

fn drop_null(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|_, member| !member.is_null());
            map.values_mut().for_each(drop_null);
        }
        // An open end of an interval stays what it is.
        Value::Array(list) => list.iter_mut().for_each(drop_null),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_rollout_that_diverges_is_read_back_without_a_figure() {
        let (_, mut written, _) = sample::explained();
        let joint = written.joints[0].clone();
        written.gap.rollout[0].position.insert(joint.clone(), f64::INFINITY);
        written.gap.regimes[0].bounds.interval = [None, Some(1.0)];
        let text = serde_json::to_string(&written).unwrap();
        assert!(serde_json::from_str::<Diagnosis>(&text).is_err(), "else this file is not needed");
        let read = diagnosis(&text).unwrap();
        written.gap.rollout[0].position.remove(&joint);
        assert_eq!(read, written);
        assert!(diagnosis("{}").is_err() && diagnosis("[").is_err());
    }
}
