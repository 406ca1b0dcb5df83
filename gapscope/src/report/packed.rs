//! Numbers for the page's script: whole steps, each as the difference to the one before, which keeps the page small.

use serde::{Serialize, Serializer};

/// A series in whole steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packed(Vec<Option<i64>>);

impl Packed {
    /// Values in steps of `step`; what is no number stays out and shows as a gap.
    pub fn new(values: &[f64], step: f64) -> Packed {
        let steps = |v: &f64| (v.is_finite() && step > 0.0).then(|| (v / step).round().clamp(-1e12, 1e12) as i64);
        Packed(values.iter().map(steps).collect())
    }
}

impl Serialize for Packed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut last = 0;
        serializer.collect_seq(self.0.iter().map(|value| {
            value.map(|value| {
                let difference = value - last;
                last = value;
                difference
            })
        }))
    }
}

/// The step that tells four thousand places of a range apart, and no number where the range is none.
pub fn step(values: impl IntoIterator<Item = f64>) -> f64 {
    let (from, to) = super::axis::extent(values);
    (to - from) / 4000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_and_gaps() {
        let packed = Packed::new(&[1.0, 1.5, f64::NAN, 0.5], 0.5);
        assert_eq!(serde_json::to_string(&packed).unwrap_or_default(), "[2,1,null,-2]");
    }
}
