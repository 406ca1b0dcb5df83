//! Faults that are one: the same of several logs, and clocks that were undone one after the other.

use super::{Fault, FaultKind, words};

/// Clocks of the same logs that were undone one after the other are one: a unit that has a name is undone before the model is
/// asked, and the model then tells what is left of it.
pub(super) fn composed(faults: Vec<Fault>) -> Vec<Fault> {
    let mut all: Vec<Fault> = Vec::new();
    for fault in faults {
        let same = |other: &&mut Fault| other.kind == FaultKind::TimeScale && other.files == fault.files;
        let Some(first) = all.iter_mut().find(same).filter(|_| fault.kind == FaultKind::TimeScale) else {
            all.push(fault);
            continue;
        };
        let factor = first.factor.zip(fault.factor).map(|(first, then)| first * then);
        let runs = words::clock_words(factor.unwrap_or(1.0));
        let left = fault.evidence.split_once(": ").map_or("", |(_, left)| left);
        let changes = first.changes.drain(..).chain(fault.changes).collect();
        let mend = words::mend_words(fault.kind, factor, first.mended);
        *first = Fault { factor, evidence: format!("{runs}: {left}"), mend, changes, ..first.clone() };
    }
    all
}

/// Faults that are the same but for the log become one, said of all where it is of all.
pub(super) fn merge(found: &mut Vec<Fault>, logs: usize) {
    let mut merged: Vec<Fault> = Vec::new();
    for fault in found.drain(..) {
        let same = |other: &&mut Fault| {
            other.kind == fault.kind && other.joints == fault.joints && other.changes == fault.changes
        };
        match merged.iter_mut().find(same) {
            Some(other) => {
                other.files.extend(fault.files);
                if other.files.len() >= logs {
                    other.files.clear();
                }
            }
            None => merged.push(fault),
        }
    }
    *found = merged;
}

#[cfg(test)]
mod tests {
    use super::super::change::Change;
    use super::*;

    fn clock(factor: f64, files: &[&str]) -> Fault {
        Fault {
            kind: FaultKind::TimeScale,
            joints: Vec::new(),
            files: files.iter().map(|file| (*file).to_owned()).collect(),
            factor: Some(factor),
            evidence: format!("the clock runs {factor} times as fast: the model then leaves 1 %"),
            mend: String::new(),
            mended: true,
            indistinguishable_from: Vec::new(),
            changes: vec![Change::Clock(1.0 / factor)],
            gravity: None,
        }
    }

    #[test]
    fn a_clock_in_two_steps_is_one_clock() {
        let found = composed(vec![clock(1e3, &[]), clock(0.05, &[]), clock(2.0, &["b"])]);
        assert_eq!(found.iter().map(|fault| fault.factor).collect::<Vec<_>>(), [Some(50.0), Some(2.0)]);
        assert_eq!(found[0].changes, [Change::Clock(1e-3), Change::Clock(20.0)]);
        assert!(
            found[0].evidence.starts_with("the clock runs 50 times") && found[0].mend.contains("0.02"),
            "{found:?}"
        );
    }
}
