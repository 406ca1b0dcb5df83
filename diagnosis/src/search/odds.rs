//! By how much one account of the logs is likelier than another, each at its exact law.

use crate::record::logs::Record;
use crate::search::chosen::{Chosen, Rest};
use gapscope_effects::EffectError;
use std::sync::Arc;

/// What joints bear at rest beyond friction: `[joint][row]`, N m or N.
type Borne = Vec<Vec<Option<f64>>>;

impl Chosen {
    /// By how many nats this account of the logs is likelier than another, each at its exact law.
    pub fn odds_against(&self, other: &Chosen, logs: &Record<'_>) -> Result<f64, EffectError> {
        let (own, others) = (logs.rest(self)?, logs.rest(other)?);
        let filtered =
            (self.filters_unlike(other) || other.filters_unlike(self)) && logs.noisier.len() == logs.signals.len();
        let equalizers = filtered.then(|| logs.at_one_noise([(self, &own), (other, &others)])).transpose()?;
        let at = |i: usize| equalizers.as_ref().map(|both| &both[i]);
        // What is left of the better account is nearer to noise: it says how many rows of a rest count as one.
        let counts: Vec<f64> =
            self.exact.correlation().iter().zip(other.exact.correlation()).map(|(a, b)| a.min(*b)).collect();
        let open = match filtered {
            true => Some([logs.unpredicted(self, &own)?, logs.unpredicted(other, &others)?]),
            false => None,
        };
        let unpredicted = |i: usize| open.as_ref().map(|both| both[i].as_slice());
        let evidence = |of: &Chosen, i: usize| of.exact.evidence(&of.fit, at(i), unpredicted(i), &logs.band);
        let (mut evidence, mut others_evidence) = (evidence(self, 0), evidence(other, 1));
        // What a law filters out of the noise at rest says nothing for it.
        let bar = |(own, other): (&f64, &f64)| if filtered { own.max(*other) } else { own.min(*other) };
        let bar: Vec<f64> = evidence.noise.iter().zip(&others_evidence.noise).map(bar).collect();
        evidence.at_rest(&logs.borne(&own), &bar, &counts, &logs.band);
        others_evidence.at_rest(&logs.borne(&others), &bar, &counts, &logs.band);
        Ok(evidence.against(&others_evidence) + self.prior() - other.prior())
    }
}

impl Record<'_> {
    /// What an account leaves of every run.
    pub(crate) fn rest(&self, chosen: &Chosen) -> Result<Arc<Rest>, EffectError> {
        if let Some(rest) = chosen.rest.get() {
            return Ok(rest.clone());
        }
        let rest = Arc::new(self.data(&chosen.noise).rest(&chosen.exact, &chosen.fit)?);
        Ok(chosen.rest.get_or_init(|| rest).clone())
    }

    /// What joints bear at rest beyond friction.
    fn borne(&self, rest: &Rest) -> Borne {
        (0..self.model.dof()).map(|j| self.at_rest(j, rest)).collect()
    }

    /// What is left of a joint at the rows at which it rests, N m or N.
    pub(crate) fn at_rest(&self, joint: usize, rest: &Rest) -> Vec<Option<f64>> {
        let rows = self.signals.iter().zip(rest).enumerate().flat_map(|(e, (s, rest))| {
            let still = s.rests(joint, self.still[joint]);
            self.band.filter_where(e, &still, &rest[joint])
        });
        rows.collect()
    }
}
