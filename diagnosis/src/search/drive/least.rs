//! The least spring or play in a drive that the logs would have revealed.
//!
//! Neither has a column, so rotor and link are simulated on each under the torque that the link took, with the rotor that
//! was found: what that makes of the torque beyond noise and another rotor is what a rigid drive would have left, and is
//! held against the bar of the search itself.

use super::{Rigid, Runs, Study, beyond_doubt, dot, mean, tells, turning};
use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::numbers::decide::FLOOR_KNOWN_TO;
use crate::record::logs::Record;
use gapscope_effects::{Candidate, EffectError, EncoderSide, Kind, Turning};
use rayon::prelude::*;

/// The least spring or play of one joint.
#[derive(Debug, Clone)]
pub(crate) struct Least {
    /// Spring or play.
    pub kind: Kind,
    /// Where it is.
    pub joint: usize,
    /// The stiffest spring or the narrowest gap that would have shown, and the rotor that it was tried with, kg m² (kg).
    pub drive: Option<(Candidate, f64)>,
}

impl Record<'_> {
    /// The least spring and play of every joint beside a fit's other effects, encoders on one side; `noise` is the noise
    /// floor of each joint, N m or N.
    pub(crate) fn least_drives(
        &self,
        problem: &Problem,
        fit: &Fit,
        side: EncoderSide,
        noise: &[f64],
    ) -> Result<Vec<Least>, EffectError> {
        let rigid = |c: &usize| {
            let candidate = &problem.entries[*c].candidate;
            !candidate.kind.card().rotor && !candidate.turns()
        };
        let others = Fit { set: fit.set.iter().copied().filter(rigid).collect(), ..fit.clone() };
        let runs = self.joint_runs(problem, &others)?;
        let of_joint = |j: usize| {
            let mut study = self.moving[j].then(|| Study::new(self, &runs, j, false));
            let mut least = |kind, through| {
                let study = study.as_mut()?;
                study.through = through;
                study.least(kind, side, noise[j])
            };
            let mut of = |(kind, turning): (Kind, Turning)| {
                // As they are, and through a filter: that which comes first on the ladder is the less.
                let (first, ..) = turning.ladder;
                let drives = [false, true].map(|through| least(kind, through)).into_iter().flatten();
                let far = |drive: &(Candidate, f64)| (drive.0.shape / first).ln().abs();
                Least { kind, joint: j, drive: drives.min_by(|a, b| far(a).total_cmp(&far(b))) }
            };
            turning().map(&mut of).collect::<Vec<_>>()
        };
        Ok((0..self.model.dof()).into_par_iter().flat_map_iter(of_joint).collect())
    }
}

impl Study<'_> {
    /// The first of ever softer springs, or ever wider gaps, that the search would have told from a rigid drive; nothing
    /// where no rotor shows, without which neither does anything to the torque.
    fn least(&self, kind: Kind, side: EncoderSide, floor: f64) -> Option<(Candidate, f64)> {
        let rotor = self.rotor;
        let turning = kind.card().turning?;
        if !self.shows(rotor) || (self.through && turning.filtered != Some(side)) {
            return None;
        }
        let (first, last, by) = turning.ladder;
        let knobs =
            (0..).map(|i| first * by.powi(i)).take_while(|knob| if by > 1.0 { *knob <= last } else { *knob >= last });
        let at = |shape| Candidate { shape, side, inertia: self.inertia, ..Candidate::new(kind, vec![self.joint]) };
        let found = knobs.map(at).find(|drive| self.would_show(drive, rotor, floor));
        found.map(|drive| (drive, rotor))
    }

    /// Whether the search would have told a drive from a rigid one.
    fn would_show(&self, drive: &Candidate, rotor: f64, floor: f64) -> bool {
        let rigid = self.against(drive, rotor);
        let hidden = self.hidden(drive, rotor, &rigid);
        let with = vec![rigid.nothing; hidden.len()];
        let without =
            Rigid { left: hidden.iter().map(|hidden| hidden + rigid.nothing).collect(), ..rigid.into_owned() };
        if !tells(&without, &without.left) {
            return false;
        }
        if beyond_doubt(&without, &with).is_none() {
            return false;
        }
        let floor = floor * (mean(&without.noise) / mean(&self.rigid.noise).max(f64::MIN_POSITIVE)).sqrt();
        mean(&hidden).sqrt().hypot(floor) > FLOOR_KNOWN_TO.get() * floor
    }

    /// Mean square of each block that a rigid drive with the best rotor would leave of a drive, beyond noise, (N m)².
    fn hidden(&self, drive: &Candidate, rotor: f64, rigid: &Rigid) -> Vec<f64> {
        let view = self.view(drive, rotor);
        let difference = |of: Runs| -> Vec<f64> {
            let mut own = self.at_rows(view, |e| self.run(of, e).hidden_by(drive, rotor));
            if drive.kind.card().turning.is_some_and(|turning| turning.closes) {
                // Its contact is a spring, with or without a gap.
                let closed = Candidate { shape: 0.0, ..drive.clone() };
                let contact = self.at_rows(view, |e| self.run(of, e).hidden_by(&closed, rotor));
                own.iter_mut().zip(contact).for_each(|(own, contact)| *own -= contact);
            }
            let heavier = self.at_rows(view, |e| self.run(of, e).acceleration.clone());
            let part = dot(&own, &heavier) / dot(&heavier, &heavier).max(f64::MIN_POSITIVE);
            let own = own.iter().zip(&heavier).map(|(own, heavier)| own - part * heavier).collect();
            self.beside_calibration(view, vec![own]).remove(0)
        };
        let own = difference(Runs::Logged);
        let noisier = difference(Runs::Noisier);
        let noise = self.mean_squares(noisier.iter().zip(&own).map(|(noisier, own)| noisier - own).collect());
        // Play is so sensitive that noise might account for all of it.
        let beyond = |((own, noise), rigid): ((&f64, &f64), &f64)| (own - noise.min(*rigid)).max(0.0);
        self.mean_squares(own).iter().zip(&noise).zip(&rigid.noise).map(beyond).collect()
    }
}
