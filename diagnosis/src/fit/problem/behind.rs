//! Columns of torque as columns of effort: what stands between a law and the logged effort makes more or less of it.

use super::{JointRows, Problem};
use crate::record::band::Band;
use crate::record::signals::Signals;
use gapscope_effects::Behind;

/// What one newton metre more takes of the logged effort of a joint, at a row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Between {
    /// Before gear and drive.
    gear: f64,
    /// Before the drive.
    drive: f64,
}

impl Between {
    fn of(self, behind: Behind) -> f64 {
        match behind {
            Behind::Gear => self.gear,
            Behind::Drive => self.drive,
            Behind::Nothing => 1.0,
        }
    }
}

impl Problem {
    /// Puts all columns behind the gears and drives that were found.
    pub(super) fn put_behind(&mut self, signals: &[Signals], band: &Band, standstill: &[f64]) {
        // The alignment is of the effort as it acts.
        let mut behind = vec![Behind::Drive; self.bounds.len()];
        for entry in &self.entries {
            behind[entry.columns.clone()].fill(entry.candidate.kind.card().behind);
        }
        for (j, rows) in self.joints.iter_mut().enumerate() {
            let columns: Vec<Behind> = rows.columns.iter().map(|&c| behind[c]).collect();
            let between = between(rows, j, signals, band, standstill);
            for (values, between) in rows.values.chunks_exact_mut(columns.len().max(1)).zip(between) {
                values.iter_mut().zip(&columns).for_each(|(x, behind)| *x *= between.of(*behind));
            }
        }
    }
}

/// At each row of a joint; empty where there is nothing between.
fn between(rows: &JointRows, joint: usize, signals: &[Signals], band: &Band, standstill: &[f64]) -> Vec<Between> {
    let gain = |s: &Signals| s.drives.get(joint).map_or(1.0, |(gain, _)| *gain);
    let rigid = |s: &Signals| gain(s) == 1.0 && s.gears.get(joint).is_none_or(|gear| gear.iter().all(|x| *x == 1.0));
    if signals.iter().all(rigid) {
        return Vec::new();
    }
    let mut all = vec![Between { gear: 1.0, drive: 1.0 }; band.rows.len()];
    for (e, s) in signals.iter().enumerate() {
        let own = &mut all[band.of_episode[e].clone()];
        let drive = 1.0 / gain(s);
        own.fill(Between { gear: drive, drive });
        if let Some(gear) = s.gears.get(joint) {
            let gears = band.filter_where(e, &s.slides(joint, standstill[joint]), gear);
            own.iter_mut().zip(gears).for_each(|(between, gear)| between.gear *= gear.unwrap_or(1.0));
        }
    }
    rows.rows.iter().map(|&row| all[row]).collect()
}
