//! The search for effects of the whole arm: what they are worth beside what its joints were found to have, and in its place.

use crate::account::{Account, Accounts, accounts, beginnings, without};
use crate::around::Motion;
use crate::choice::{BEYOND, SURE, TAKEN};
use crate::choose::{Chosen, restore};
use crate::fit::Fit;
use crate::kinds::Kind;
use crate::law::Param;
use crate::prepare::Joint;
use crate::rest::lasting;
use crate::settle::{LOCAL, STEPS, Search, Settled, fit_all, worth};
use crate::weigh::{independent, least, tracking};
use crate::whole::{Around, Found, Whole, around, put};
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// A rival ties if the error with it is at most this much more.
const TIE: f64 = 0.02;

/// What looking for effects of the whole arm gives.
pub struct Outcome {
    /// The likeliest one that the logs speak for.
    pub found: Option<Found>,
    /// Effects of the whole arm that could stand in the place of biases and offsets.
    pub ties: Vec<Whole>,
}

/// Looks for an effect of the whole arm beside, or in the place of, what its joints were found to have; `found` are those that
/// stand already. Leaves the joints in the surroundings of the model that it is given.
pub fn look(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    found: &[Whole],
) -> Outcome {
    let before = Before::new(model, motions, joints, chosen, found);
    let mut outcome = Outcome { found: None, ties: Vec::new() };
    for whole in candidates(chosen).into_iter().filter(|whole| !found.contains(whole)) {
        let Some(search) = Search::new(&[whole], model, &before.turned, &before.fits, true) else { continue };
        let beside = before.beside(whole, &search, joints);
        let instead = before.instead(whole, &search, joints);
        if instead.as_ref().is_some_and(|own| before.ties(whole, own)) {
            outcome.ties.push(whole);
        }
        let tried = [beside, instead].into_iter().flatten();
        let Some(best) = tried.max_by(|a, b| a.nats.total_cmp(&b.nats)) else { continue };
        let claim = before.claim(whole, &search, best, joints);
        let claim = claim.filter(|own| outcome.found.as_ref().is_none_or(|found| own.nats > found.nats));
        outcome.found = claim.or(outcome.found);
    }
    put(joints, &before.plain);
    outcome
}

/// What the joints have before an effect of the whole arm is looked for.
struct Before<'a> {
    model: &'a Model,
    /// How the arm moved by its encoders, and by them less the zeros that joints were found to have: behind a zero that is off all
    /// links hang elsewhere.
    motions: &'a [Motion],
    turned: Vec<Motion>,
    /// Surroundings of the arm that moved so.
    plain: Around,
    /// What the joints were found to have, its laws, and the same without what such an effect calls up.
    chosen: &'a [Option<Chosen>],
    accounts: Accounts,
    without_load: Accounts,
    /// Whether there is anything of that kind.
    calls_up: bool,
    /// Fits of what they were found to have.
    fits: Vec<Option<Fit>>,
    /// The account without an effect that others are held against, and its fits.
    poor: (Accounts, Vec<Option<Fit>>),
    /// Squared error of perfect tracking, by joint.
    perfect: Vec<f64>,
}

/// An effect with what the joints have beside it.
struct Attempt {
    settled: Settled,
    accounts: Accounts,
    /// By how many nats it is ahead of the account without it, and those among them that fewer parameters of joints save.
    nats: f64,
    saved: f64,
}

impl<'a> Before<'a> {
    fn new(
        model: &'a Model,
        motions: &'a [Motion],
        joints: &mut [Joint],
        chosen: &'a [Option<Chosen>],
        found: &[Whole],
    ) -> Before<'a> {
        let accounts = accounts(chosen);
        // Zeros that stand are no longer called up by anything else.
        let stands = |j: usize, kind: Kind| kind == Kind::Offset && found.contains(&Whole::Offset(j));
        let without_load = without(chosen, joints, |j, kind| is_called_up(kind) && !stands(j, kind));
        let mut turned = motions.to_vec();
        for (j, own) in accounts.iter().enumerate() {
            let offset = own.as_ref().map_or(0.0, |own| own.law[Param::Offset]);
            turned.iter_mut().for_each(|motion| motion.put_zero_off(j, offset));
        }
        let plain = around(model, &turned);
        put(joints, &plain);
        let perfect = joints.iter().map(tracking).collect();
        // What more rounds of the same account take away speaks for no effect.
        let fits = fit_all(joints, &accounts, STEPS * LOCAL);
        let calls_up = saved(joints, &accounts, &without_load, &fits) > 0.0;
        let mut poor = (accounts.clone(), fits.clone());
        if calls_up {
            // Nor does what they do better without that which an effect called up that is found by now.
            put(joints, &around(model, motions));
            let alone = fit_all(joints, &without_load, STEPS * LOCAL);
            let fewer = restored(joints, chosen, &alone);
            let fits = fit_all(joints, &fewer, STEPS * LOCAL);
            if nats(joints, &poor.1, &fits) + saved(joints, &accounts, &fewer, &fits) > 0.0 {
                poor = (fewer, fits);
            }
            put(joints, &plain);
        }
        Before { model, motions, turned, plain, chosen, accounts, without_load, calls_up, fits, poor, perfect }
    }

    fn attempt(&self, whole: Whole, settled: Settled, accounts: Accounts, joints: &[Joint]) -> Attempt {
        let saved = saved(joints, &self.poor.0, &accounts, &settled.fits);
        let nats = nats(joints, &self.poor.1, &settled.fits) - self.price(whole, joints) + saved;
        Attempt { settled, accounts, nats, saved }
    }

    fn price(&self, whole: Whole, joints: &[Joint]) -> f64 {
        whole.price(worth(joints, &self.fits).iter().sum())
    }

    /// The effect beside all that the joints have. A zero is one of these, until it stands in the place of what others have.
    fn beside(&self, whole: Whole, search: &Search, joints: &mut [Joint]) -> Option<Attempt> {
        put(joints, &self.plain);
        let promises = !whole.is_zero() && search.promise(joints, &self.fits) > 0.5 * self.price(whole, joints);
        let none = vec![0.0; whole.numbers()];
        let settled = promises.then(|| search.settle(joints, &self.accounts, &none)).flatten()?;
        Some(self.attempt(whole, settled, self.accounts.clone(), joints))
    }

    /// The effect in the place of what it may have called up at the joints; what is missed beside it comes back.
    fn instead(&self, whole: Whole, search: &Search, joints: &mut [Joint]) -> Option<Attempt> {
        if !self.calls_up {
            return None;
        }
        let is_turned = self.turned != self.motions;
        let upright = is_turned.then(|| Search::new(&[whole], self.model, self.motions, &self.fits, true)).flatten();
        let search = upright.as_ref().unwrap_or(search);
        let alone = search.settle(joints, &self.without_load, &vec![0.0; whole.numbers()])?;
        // By all that it does where nothing else does it, and all that it saves.
        let most = saved(joints, &self.poor.0, &self.without_load, &alone.fits);
        if alone.nats() - self.price(whole, joints) + most <= TAKEN {
            return None;
        }
        put(joints, &search.around(&alone.values)?);
        let accounts = restored(joints, self.chosen, &alone.fits);
        let settled = search.settle(joints, &accounts, &alone.values).unwrap_or(alone);
        Some(self.attempt(whole, settled, accounts, joints))
    }

    /// Whether an effect could stand in the place of the biases and offsets of joints.
    fn ties(&self, whole: Whole, own: &Attempt) -> bool {
        let is_constant = |param: &Param| matches!(param, Param::Bias | Param::Offset);
        let total = |fits: &[Option<Fit>]| fits.iter().flatten().map(|fit| fit.cost).sum::<f64>();
        !whole.is_zero()
            && total(&own.settled.fits).sqrt() <= (1.0 + TIE) * total(&self.poor.1).sqrt()
            && !own.accounts.iter().flatten().any(|account| account.free.iter().any(is_constant))
    }

    /// What may be claimed of an attempt.
    fn claim(&self, whole: Whole, search: &Search, own: Attempt, joints: &[Joint]) -> Option<Found> {
        let Attempt { settled, nats, saved, .. } = own;
        let falls = |j: usize| {
            let (rich, poor) = (settled.fits[j].as_ref()?, self.poor.1[j].as_ref()?);
            let (fall, least) = (poor.cost - rich.cost, least(rich.cost, self.perfect[j]));
            Some((fall / poor.cost.max(1e-300), fall > least, fall / lasting(&joints[j], &rich.errors).max(1e-300)))
        };
        let falls: Vec<(f64, bool, f64)> = (0..joints.len()).filter_map(falls).collect();
        let share = falls.iter().map(|(part, _, _)| *part).fold(0.0, f64::max);
        // At one joint it is held against what lasts as a kind of that joint is. Joints that agree say more: what lasts beside the
        // first effect of an arm may be its second.
        let at_least = |times: f64| falls.iter().filter(|(_, shows, beyond)| *shows && *beyond > times).count();
        let is_relevant = at_least(BEYOND) > 0 || at_least(1.0) > 1;
        // Its numbers must lie off nothing as well: a fit may fall by what they do not do.
        let nats = nats.min(settled.nats() - self.price(whole, joints) + saved);
        if nats <= TAKEN || !is_relevant || !search.is_possible(&settled.values) {
            return None;
        }
        let covariance = search.covariance(&settled);
        let is_told = nats > SURE || whole.is_told(&settled.values, &covariance);
        let beside = beginnings(self.chosen, &settled.fits);
        is_told.then_some(Found { whole, values: settled.values, covariance, nats, share, beside })
    }
}

/// Effects of the whole arm that may be behind what its joints have: a zero too, where joints behind it have something of its kind.
fn candidates(chosen: &[Option<Chosen>]) -> Vec<Whole> {
    let hangs = |own: &Option<Chosen>| {
        own.iter().flat_map(|own| &own.kinds).any(|(kind, _)| matches!(kind, Kind::Bias | Kind::Offset))
    };
    let last = chosen.iter().rposition(hangs).unwrap_or(0);
    let zeros = (0..last).filter(|&j| hangs(&chosen[j])).map(Whole::Offset);
    Whole::ALL.into_iter().chain(zeros).collect()
}

/// Whether an effect of the whole arm calls a kind up at a joint: what looks like load, and springs, which take over what is jolted.
fn is_called_up(kind: Kind) -> bool {
    kind.looks_like_load() || kind.turns_apart()
}

/// Accounts of the joints as they are surrounded now, from fits without what looks like load on: with what is missed of it.
fn restored(joints: &mut [Joint], chosen: &[Option<Chosen>], fits: &[Option<Fit>]) -> Accounts {
    let one = |((joint, own), fit): ((&mut Joint, &Option<Chosen>), &Option<Fit>)| {
        let (own, fit) = (own.as_ref()?, fit.as_ref()?);
        let (among, kept) = own.kinds.iter().map(|own| own.0).partition(|kind: &Kind| is_called_up(*kind));
        let Fit { law, free, .. } = restore(joint, &fit.law, kept, among);
        Some(Account { law, free })
    };
    joints.par_iter_mut().zip(chosen).zip(fits).map(one).collect()
}

/// Nats that accounts save by the parameters that they have less than others, by what their own fits are worth.
fn saved(joints: &[Joint], than: &Accounts, accounts: &Accounts, fits: &[Option<Fit>]) -> f64 {
    let count = |account: &Option<Account>| account.as_ref().map_or(0.0, |account| account.free.len() as f64);
    let of = |(j, fit): (usize, &Option<Fit>)| {
        let fewer = count(&than[j]) - count(&accounts[j]);
        Some(0.5 * fewer * independent(&joints[j], &fit.as_ref()?.errors).ln())
    };
    fits.iter().enumerate().filter_map(of).sum()
}

/// Nats by which richer fits are ahead of poorer ones, before what they cost.
fn nats(joints: &[Joint], poor: &[Option<Fit>], rich: &[Option<Fit>]) -> f64 {
    let one = |((joint, poor), rich): ((&Joint, &Option<Fit>), &Option<Fit>)| match (poor, rich) {
        (Some(poor), Some(rich)) => 0.5 * independent(joint, &rich.errors) * (poor.cost / rich.cost.max(1e-300)).ln(),
        _ => 0.0,
    };
    joints.iter().zip(poor).zip(rich).map(one).sum()
}
