//! What a fit does not miss is dropped; what could stand in the place of what stays is told.

use crate::choice::{Choice, Comparison, FULL, Poorer, SURE, TAKEN, TRIAL, is_given};
use crate::fit::{Fit, cost, normal};
use crate::interval::Spread;
use crate::kinds::Kind;
use crate::weigh::independent;

/// Drops what the fit does not miss; what stays, with the nats it is worth, and the account without its spring or play.
pub fn drop_needless(
    choice: &Choice,
    kinds: &mut Vec<Kind>,
    best: &mut Fit,
    why: &mut Vec<Comparison>,
) -> (Vec<(Kind, f64)>, Option<Poorer>) {
    // Of the richest account: a poorer one may lack what is there.
    let least = choice.beyond(&best.errors);
    loop {
        let samples = independent(choice.joint, &best.errors);
        let mut worth = Vec::new();
        let mut sure = Vec::new();
        let missing = Missing::new(best);
        let spread = Spread::of(best, choice.joint);
        for &kind in kinds.iter() {
            let off = choice.off_nothing(best, kind, samples, &spread);
            let surely = choice.surely(best, kinds, kind, samples, &missing);
            if let Some((nats, _)) = surely.filter(|(_, loss)| off > TAKEN && *loss > least) {
                sure.push((kind, nats));
                continue;
            }
            // What stands on a kind goes with it.
            let without: Vec<Kind> =
                kinds.iter().copied().filter(|other| *other != kind && other.base() != Some(kind)).collect();
            let mut law = best.law;
            kind.clear(&mut law, &choice.joint.start, &without);
            let poor = choice.fit(&law, &without, None, TRIAL);
            // Its number must lie off nothing as well: a fit falls by what a loop that answers late does.
            let nats = choice.nats(best, &poor, kind, samples).min(off);
            // The bodies of the URDF weigh something for certain: where their weight alone accounts for a constant torque,
            // and fixes the drive's scale, no bias takes its place.
            let weightless = kind == Kind::Bias
                && !Spread::of(best, choice.joint).scale_is_known()
                && Spread::of(&poor, choice.joint).scale_is_known();
            let relevant = choice.relevant(best, &poor) && poor.cost - best.cost > least && !weightless;
            worth.push((kind, nats, relevant, poor, without));
        }
        let needless = worth
            .iter()
            .enumerate()
            .filter(|(_, (_, nats, relevant, _, _))| *nats <= TAKEN || !relevant)
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))
            .map(|(at, _)| at);
        // Each fit of a pair takes its time: where every kind is felt smoothly, one at a time is enough.
        if needless.is_none()
            && kinds.iter().any(|kind| kind.is_threshold())
            && let Some((pair, nats, without, poor)) = needless_pair(choice, kinds, best, samples)
        {
            why.extend(pair.map(|proposed| Comparison { proposed, nats, taken: false, last: true }));
            *kinds = without;
            *best = choice.fit(&poor.law, kinds, None, FULL);
            continue;
        }
        let Some(at) = needless else {
            why.extend(worth.iter().map(|w| Comparison { proposed: w.0, nats: w.1, taken: true, last: true }));
            why.extend(sure.iter().map(|s| Comparison { proposed: s.0, nats: s.1, taken: true, last: true }));
            let kept = worth.iter().map(|w| (w.0, w.1)).chain(sure).collect();
            let apart = worth.into_iter().find(|w| w.0.turns_apart());
            return (kept, apart.map(|(kind, _, _, fit, kinds)| Poorer { kind, kinds, fit }));
        };
        let (kind, nats, _, poor, without) = worth.swap_remove(at);
        why.push(Comparison { proposed: kind, nats, taken: false, last: true });
        *kinds = without;
        *best = choice.fit(&poor.law, kinds, None, FULL);
    }
}

/// Two kinds of calibration that the fit does not miss together, though it misses each beside the other: what one does to the
/// motion the other undoes.
fn needless_pair(
    choice: &Choice,
    kinds: &[Kind],
    best: &Fit,
    samples: f64,
) -> Option<([Kind; 2], f64, Vec<Kind>, Fit)> {
    let is_based_on = |kind: Kind| kinds.iter().any(|other| other.base() == Some(kind));
    let usual: Vec<Kind> = kinds.iter().copied().filter(|kind| kind.cost() == 0.0 && !is_based_on(*kind)).collect();
    let missing = Missing::new(best);
    for (i, &a) in usual.iter().enumerate() {
        for &b in &usual[i + 1..] {
            if choice.surely_both(best, [a, b], samples, &missing) {
                continue;
            }
            let without: Vec<Kind> = kinds.iter().copied().filter(|other| ![a, b].contains(other)).collect();
            let mut law = best.law;
            [a, b].into_iter().for_each(|kind| kind.clear(&mut law, &choice.joint.start, &without));
            let poor = choice.fit(&law, &without, None, TRIAL);
            let nats = choice.nats(best, &poor, a, samples) - 0.5 * b.parameters().len() as f64 * samples.ln();
            if nats <= TAKEN || !choice.relevant(best, &poor) {
                return Some(([a, b], nats, without, poor));
            }
        }
    }
    None
}

/// What a fit loses without some of its parameters, to second order.
struct Missing {
    inverse: Option<nalgebra::DMatrix<f64>>,
}

impl Missing {
    fn new(fit: &Fit) -> Missing {
        let (mut information, _) = normal(&fit.sensitivity, &fit.errors);
        for i in 0..fit.free.len() {
            information[(i, i)] = information[(i, i)] * (1.0 + 1e-9) + 1e-30;
        }
        Missing { inverse: information.try_inverse() }
    }

    /// dᵀ C⁻¹ d with the covariance C of the parameters at `at` and their distance d from where they would be; and the change of
    /// all parameters that takes them there at the least cost.
    fn loss(&self, at: &[usize], distance: &[f64]) -> Option<(f64, nalgebra::DVector<f64>)> {
        let inverse = self.inverse.as_ref()?;
        let block = nalgebra::DMatrix::from_fn(at.len(), at.len(), |i, j| inverse[(at[i], at[j])]);
        let d = nalgebra::DVector::from_column_slice(distance);
        let pull = block.lu().solve(&d)?;
        let loss = d.dot(&pull);
        let change = nalgebra::DVector::from_fn(inverse.nrows(), |i, _| {
            -at.iter().zip(pull.iter()).map(|(&j, pull)| inverse[(i, j)] * pull).sum::<f64>()
        });
        (loss.is_finite() && loss > 0.0).then_some((loss, change))
    }
}

impl Choice<'_> {
    /// Nats by which the number of a kind lies off nothing, by all that may move it; infinite where nothing is no number of it.
    fn off_nothing(&self, best: &Fit, kind: Kind, samples: f64, spread: &Spread) -> f64 {
        let Some(&(param, _, _)) = kind.parameters().first() else { return f64::INFINITY };
        let distance = best.law[param] - self.joint.start[param];
        if kind.is_threshold() || !distance.is_finite() {
            return f64::INFINITY;
        }
        let Some(deviation) = spread.deviation(param) else { return f64::INFINITY };
        let more = kind.parameters().len() as f64;
        0.5 * (distance / deviation.max(1e-300)).powi(2) - 0.5 * more * samples.ln() - kind.cost()
    }

    /// What a fit loses without some parameters where there can be no doubt of them: to second order, as far as the errors there
    /// bear it out.
    fn clear_loss(&self, best: &Fit, kinds: &[Kind], missing: &Missing) -> Option<(f64, f64)> {
        let (mut at, mut distance) = (Vec::new(), Vec::new());
        for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
            at.push(best.free.iter().position(|free| free == param)?);
            distance.push(best.law[*param] - self.joint.start[*param]);
        }
        let (linear, change) = missing.loss(&at, &distance)?;
        let mut there = best.law;
        for (&param, change) in best.free.iter().zip(change.iter()) {
            let [least, greatest] = self.joint.ranges.bounds[param as usize];
            there[param] = (there[param] + change).clamp(least, greatest);
        }
        let loss = linear.min(cost(&there, &self.joint.runs) - best.cost);
        Some((loss, at.len() as f64)).filter(|_| loss > 4.0 * self.least(best.cost))
    }

    /// Whether there can be no doubt of two kinds together.
    fn surely_both(&self, best: &Fit, pair: [Kind; 2], samples: f64, missing: &Missing) -> bool {
        self.clear_loss(best, &pair, missing).is_some_and(|(loss, numbers)| {
            0.5 * samples * ((best.cost + loss) / best.cost.max(1e-300)).ln() - 0.5 * numbers * samples.ln() > SURE
        })
    }

    /// Nats that a kind is worth where there can be no doubt of it, and the squared error without it beyond that with it; `None`
    /// where a fit without it must say.
    fn surely(&self, best: &Fit, kinds: &[Kind], kind: Kind, samples: f64, missing: &Missing) -> Option<(f64, f64)> {
        // Beside a limit or a dead band no kind is felt evenly.
        let is_even = kind.is_linear() && !kinds.iter().any(|other| other.is_threshold());
        if !is_even || kind == Kind::Bias || kinds.iter().any(|other| other.base() == Some(kind)) {
            return None;
        }
        let (loss, more) = self.clear_loss(best, &[kind], missing)?;
        let nats =
            0.5 * samples * ((best.cost + loss) / best.cost.max(1e-300)).ln() - 0.5 * more * samples.ln() - kind.cost();
        (nats > SURE).then_some((nats, loss))
    }
}

/// Puts rivals in the place of kinds where the logs prefer them; whether any was.
pub fn exchange(
    choice: &Choice,
    kinds: &mut Vec<Kind>,
    best: &mut Fit,
    possible: &[Kind],
    why: &mut Vec<Comparison>,
) -> bool {
    let mut any = false;
    for kind in kinds.clone() {
        let rivals: Vec<_> = instead_of(choice, kinds, best, possible, kind).collect();
        for (rival, instead, other) in rivals {
            let samples = independent(choice.joint, &other.errors);
            let more = rival.parameters().len() as f64 - kind.parameters().len() as f64;
            let nats = 0.5 * samples * (best.cost / other.cost.max(1e-300)).ln() - 0.5 * more * samples.ln()
                + kind.cost()
                - rival.cost();
            let taken = nats > TAKEN;
            why.push(Comparison { proposed: rival, nats, taken, last: false });
            if taken {
                *best = choice.fit(&other.law, &instead, None, FULL);
                *kinds = instead;
                any = true;
                break;
            }
        }
    }
    any
}

/// Fits with each rival of a kind in its place.
fn instead_of<'a>(
    choice: &'a Choice,
    kinds: &'a [Kind],
    best: &'a Fit,
    possible: &'a [Kind],
    kind: Kind,
) -> impl Iterator<Item = (Kind, Vec<Kind>, Fit)> + 'a {
    let stands = kinds.contains(&kind);
    let rivals = kind.rivals().iter().copied().filter(move |rival| stands && possible.contains(rival));
    // What exists only against a given value is no rival where nothing is given.
    let rivals =
        rivals.filter(|rival| !kinds.contains(rival) && (!rival.needs_given() || is_given(choice.joint, *rival)));
    rivals.filter(move |rival| rival.base().is_none_or(|base| kinds.contains(&base) && base != kind)).map(
        move |rival| {
            let mut law = best.law;
            let stay = |other: &Kind| *other != kind && other.base() != Some(kind);
            let instead: Vec<Kind> = kinds.iter().copied().filter(stay).chain([rival]).collect();
            kind.clear(&mut law, &choice.joint.start, &instead);
            let other = choice.fit(&law, &instead, Some(rival), TRIAL);
            (rival, instead, other)
        },
    )
}

/// A rival ties with a kind if the error with it in the kind's place is at most this much more.
const TIE: f64 = 0.02;

/// Pairs of a kind that was taken and one that could stand in its place.
pub fn ties(choice: &Choice, kinds: &[Kind], best: &Fit, possible: &[Kind]) -> Vec<(Kind, Kind)> {
    let mut ties = Vec::new();
    for &kind in kinds {
        for (rival, _, other) in instead_of(choice, kinds, best, possible, kind) {
            if other.cost.sqrt() <= (1.0 + TIE) * best.cost.sqrt() {
                ties.push((kind, rival));
            }
        }
    }
    ties
}
