//! The search for effects of the whole arm: what they are worth beside what its joints were found to have, and in its place.

use crate::around::Motion;
use crate::choice::{BEYOND, TAKEN};
use crate::choose::{Chosen, restore};
use crate::fit::Fit;
use crate::kinds::Kind;
use crate::law::Param;
use crate::prepare::Joint;
use crate::rest::lasting;
use crate::settle::{Account, LOCAL, STEPS, Search, Settled, fit_all, misfit, worth};
use crate::weigh::{independent, least, tracking};
use crate::whole::{Found, Whole, around, put};
use gapscope_dynamics::Model;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::ops::Range;

/// A rival ties if the error with it is at most this much more.
const TIE: f64 = 0.02;

/// What looking for effects of the whole arm gives.
pub struct Outcome {
    /// The likeliest one that the logs speak for.
    pub found: Option<Found>,
    /// Effects of the whole arm that could stand in the place of biases and offsets.
    pub ties: Vec<Whole>,
}

/// Looks for an effect of the whole arm beside, or in the place of, what its joints were found to have. Leaves the joints in
/// the surroundings of the model that it is given.
pub fn look(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    without: &[Whole],
) -> Outcome {
    let beside = accounts(chosen);
    let instead = without_load(chosen, joints, without);
    // Behind a zero that is off all links hang elsewhere.
    let mut turned = motions.to_vec();
    for (j, own) in beside.iter().enumerate() {
        let offset = own.as_ref().map_or(0.0, |own| own.law[Param::Offset]);
        turned.iter_mut().for_each(|motion| motion.put_zero_off(j, offset));
    }
    let plain = around(model, &turned);
    put(joints, &plain);
    let perfect: Vec<f64> = joints.iter().map(tracking).collect();
    // What more rounds of the same account take away speaks for no effect.
    let fits = fit_all(joints, &beside, STEPS * LOCAL);
    let calls_up = saved(joints, &beside, &instead, &fits) > 0.0;
    let mut poor = (beside.clone(), fits.clone());
    if calls_up {
        // Nor does what they do better without what was called up by an effect that is found by now.
        put(joints, &around(model, motions));
        let alone = fit_all(joints, &instead, STEPS * LOCAL);
        let accounts = restored(joints, chosen, &alone);
        let fits = fit_all(joints, &accounts, STEPS * LOCAL);
        if nats(joints, &poor.1, &fits) + saved(joints, &beside, &accounts, &fits) > 0.0 {
            poor = (accounts, fits);
        }
        put(joints, &plain);
    }
    let (had, poor) = poor;
    let mut outcome = Outcome { found: None, ties: Vec::new() };
    for whole in candidates(chosen).into_iter().filter(|whole| !without.contains(whole)) {
        let Some(search) = Search::new(&[whole], model, &turned, &fits, true) else { continue };
        let none = vec![0.0; whole.numbers()];
        put(joints, &plain);
        let price = whole.price(worth(joints, &fits).iter().sum());
        let mut tried: Vec<(f64, Settled, f64)> = Vec::new();
        let mut hold = |joints: &[Joint], settled: Settled, accounts: &[Option<Account>]| {
            let saved = saved(joints, &had, accounts, &settled.fits);
            tried.push((nats(joints, &poor, &settled.fits) - price + saved, settled, saved));
        };
        // A zero is what the joint has of its own, until it stands in the place of what others have.
        let is_own = matches!(whole, Whole::Offset(_));
        if !is_own
            && search.promise(joints, &fits) > 0.5 * price
            && let Some(settled) = search.settle(joints, &beside, &none)
        {
            hold(joints, settled, &beside);
        }
        // What it called up at the joints may be all that they have of the kind; what is missed beside it comes back.
        let is_turned = calls_up && turned != motions;
        let upright = is_turned.then(|| Search::new(&[whole], model, motions, &fits, true)).flatten();
        let upright = upright.as_ref().unwrap_or(&search);
        if calls_up
            && let Some(alone) = upright.settle(joints, &instead, &none)
            && let Some(base) = upright.around(&alone.values)
        {
            put(joints, &base);
            let accounts = restored(joints, chosen, &alone.fits);
            let settled = upright.settle(joints, &accounts, &alone.values).unwrap_or(alone);
            let has_constant = |free: &[Param]| free.iter().any(|param| matches!(param, Param::Bias | Param::Offset));
            let (total, other) = (sum(&poor), sum(&settled.fits));
            if !is_own
                && other.sqrt() <= (1.0 + TIE) * total.sqrt()
                && !accounts.iter().flatten().any(|own| has_constant(&own.free))
            {
                outcome.ties.push(whole);
            }
            hold(joints, settled, &accounts);
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some((nats, settled, saved)) = tried.into_iter().next() else { continue };
        let falls = |j: usize| {
            let (rich, poor) = (settled.fits[j].as_ref()?, poor[j].as_ref()?);
            let (fall, least) = (poor.cost - rich.cost, least(rich.cost, perfect[j]));
            Some((fall / poor.cost.max(1e-300), fall > least, fall / lasting(&joints[j], &rich.errors).max(1e-300)))
        };
        let falls: Vec<(f64, bool, f64)> = (0..joints.len()).filter_map(falls).collect();
        let share = falls.iter().map(|(part, _, _)| *part).fold(0.0, f64::max);
        // At one joint it is held against what lasts as a kind of that joint is. Joints that agree say more: what lasts beside the
        // first effect of an arm may be its second.
        let at_least = |times: f64| falls.iter().filter(|(_, shows, beyond)| *shows && *beyond > times).count();
        let relevant = at_least(BEYOND) > 0 || at_least(1.0) > 1;
        // Its numbers must lie off nothing as well: a fit may fall by what they do not do.
        let nats = nats.min(settled.nats() - price + saved);
        if nats > TAKEN
            && relevant
            && search.is_possible(&settled.values)
            && outcome.found.as_ref().is_none_or(|found| nats > found.nats)
        {
            let (covariance, laws) = (search.covariance(&settled), settled.laws());
            if !whole.is_told(&settled.values, &covariance) {
                continue;
            }
            outcome.found = Some(Found { whole, values: settled.values, covariance, nats, share, laws });
        }
    }
    put(joints, &plain);
    outcome
}

/// The numbers of effects that were found, anew and all at once, with the encoder zeros that joints were found to have: beside what
/// else the joints have, or beside nothing, which their first numbers may have called up. What is not missed beside the others is
/// left out. Leaves the joints in the surroundings of the model without them.
pub fn refine(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    found: &[Found],
) -> Option<Vec<Found>> {
    let mut tried = vec![accounts(chosen), bare(chosen, joints)];
    // What a body's lever is short of stands as rotors: they are looked at without.
    let has_rotor = |own: &Option<Chosen>| own.iter().flat_map(|own| &own.kinds).any(|own| own.0 == Kind::Armature);
    if found.iter().any(|own| own.whole == Whole::Payload) && chosen.iter().any(has_rotor) {
        tried.push(without(chosen, joints, |_, kind| kind == Kind::Armature));
    }
    let offset = |(j, own): (usize, &Option<Chosen>)| {
        let fit =
            own.as_ref().filter(|own| own.kinds.iter().any(|(kind, _)| *kind == Kind::Offset)).map(|own| &own.fit)?;
        let (values, covariance) = (vec![fit.law[Param::Offset]], DMatrix::zeros(1, 1));
        Some(Found { whole: Whole::Offset(j), values, covariance, nats: 0.0, share: 0.0, laws: Vec::new() })
    };
    let mut kept: Vec<Found> = found.iter().cloned().chain(chosen.iter().enumerate().filter_map(offset)).collect();
    // A zero that is not among them is right.
    let mut motions = motions.to_vec();
    for own in &kept {
        let Whole::Offset(joint) = own.whole else { continue };
        motions.iter_mut().for_each(|motion| motion.put_zero_off(joint, 0.0));
        for account in tried.iter_mut().filter_map(|accounts| accounts[joint].as_mut()) {
            account.put_zero_off(0.0);
        }
    }
    loop {
        if kept.is_empty() {
            return Some(kept);
        }
        let search = search_of(&kept, model, &motions, joints.len())?;
        let settled = settle_best(&search, &kept, joints, &tried, None)?;
        let samples = worth(joints, &settled.fits);
        let places = search.places();
        let spread = search.spread(joints, &settled)?;
        put(joints, &search.plain);
        let mut needless = needless(&places, &settled, &spread, samples.iter().sum());
        for (own, (_, numbers)) in kept.iter_mut().zip(&places) {
            own.values = settled.values[numbers.clone()].to_vec();
            own.covariance = spread.view((numbers.start, numbers.start), (numbers.len(), numbers.len())).into();
        }
        // Off nothing by far may lie what leads to a poorer account than there is without it.
        let bodies = kept.iter().filter(|own| needless.is_empty() && !matches!(own.whole, Whole::Offset(_)));
        for whole in bodies.map(|own| own.whole).collect::<Vec<_>>() {
            let rest: Vec<Found> = kept.iter().filter(|own| own.whole != whole).cloned().collect();
            let without = search_of(&rest, model, &motions, joints.len())?;
            let poor = settle_best(&without, &rest, joints, &tried, Some(&samples));
            put(joints, &search.plain);
            let lost = poor.map_or(f64::INFINITY, |poor| score(&poor.fits, &samples) - score(&settled.fits, &samples));
            if lost < whole.price(samples.iter().sum()) + TAKEN {
                needless.push(whole);
            }
        }
        if needless.is_empty() {
            return Some(kept);
        }
        kept.retain(|own| !needless.contains(&own.whole));
    }
}

/// A search for the numbers of effects all at once.
fn search_of<'a>(kept: &[Found], model: &'a Model, motions: &'a [Motion], joints: usize) -> Option<Search<'a>> {
    let wholes: Vec<Whole> = kept.iter().map(|own| own.whole).collect();
    Search::new(&wholes, model, motions, &vec![None; joints], false)
}

/// What a search settles at beside the accounts, of those tried, that leave least.
fn settle_best(
    search: &Search,
    kept: &[Found],
    joints: &mut [Joint],
    tried: &[Vec<Option<Account>>],
    samples: Option<&[f64]>,
) -> Option<Settled> {
    let values: Vec<f64> = kept.iter().flat_map(|own| own.values.iter().copied()).collect();
    let settled = tried.iter().filter_map(|accounts| search.settle(joints, accounts, &values));
    let settled: Vec<Settled> = settled.filter(|settled| search.is_possible(&settled.values)).collect();
    let own = settled.first().map(|settled| worth(joints, &settled.fits))?;
    let samples = samples.unwrap_or(&own);
    settled.into_iter().min_by(|a, b| score(&a.fits, samples).total_cmp(&score(&b.fits, samples)))
}

/// Nats of misfit of fits, and what their parameters cost.
fn score(fits: &[Option<Fit>], samples: &[f64]) -> f64 {
    let price = |(fit, samples): (&Option<Fit>, &f64)| {
        fit.as_ref().map_or(0.0, |fit| 0.5 * fit.free.len() as f64 * samples.max(2.0).ln())
    };
    misfit(fits, samples) + fits.iter().zip(samples).map(price).sum::<f64>()
}

/// Effects that the logs do not miss: the weakest beside the others, then the weakest beside those that are left, while what is lost
/// in all is less than their price.
fn needless(
    places: &[(Whole, Range<usize>)],
    settled: &Settled,
    covariance: &DMatrix<f64>,
    samples: f64,
) -> Vec<Whole> {
    let (mut out, mut numbers, mut price) = (Vec::new(), Vec::new(), 0.0);
    loop {
        let more = |(whole, own): &(Whole, Range<usize>)| {
            let with: Vec<usize> = numbers.iter().copied().chain(own.clone()).collect();
            let price = price + whole.price(samples) + TAKEN;
            (settled.loss(covariance, &with) - price, *whole, with, price)
        };
        let left = places.iter().filter(|(whole, _)| !out.contains(whole));
        let Some(weakest) = left.map(more).min_by(|a, b| a.0.total_cmp(&b.0)) else { return out };
        if weakest.0 > 0.0 {
            return out;
        }
        out.push(weakest.1);
        (numbers, price) = (weakest.2, weakest.3);
    }
}

/// Accounts of the joints without any kind.
fn bare(chosen: &[Option<Chosen>], joints: &[Joint]) -> Vec<Option<Account>> {
    without(chosen, joints, |_, _| true)
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

/// Accounts of the joints without what a body, a tilted base or a zero looks like to one joint, but for zeros that stand.
fn without_load(chosen: &[Option<Chosen>], joints: &[Joint], found: &[Whole]) -> Vec<Option<Account>> {
    without(chosen, joints, |j, kind| {
        is_called_up(kind) && !(kind == Kind::Offset && found.contains(&Whole::Offset(j)))
    })
}

/// Whether an effect of the whole arm calls a kind up at a joint: what looks like load, and springs, which take over what is jolted.
fn is_called_up(kind: Kind) -> bool {
    kind.looks_like_load() || kind.turns_apart()
}

/// Accounts of the joints without the kinds that go.
fn without(chosen: &[Option<Chosen>], joints: &[Joint], goes: impl Fn(usize, Kind) -> bool) -> Vec<Option<Account>> {
    let one = |(j, (own, joint)): (usize, (&Option<Chosen>, &Joint))| {
        let own = own.as_ref()?;
        let mut account = Account { law: own.fit.law, free: own.fit.free.clone() };
        let stay: Vec<Kind> = own.kinds.iter().map(|own| own.0).filter(|kind| !goes(j, *kind)).collect();
        for kind in own.kinds.iter().map(|own| own.0).filter(|kind| goes(j, *kind)) {
            kind.clear(&mut account.law, &joint.start, &stay);
            let stays = |param: &Param| stay.iter().any(|kind| kind.parameters().iter().any(|own| own.0 == *param));
            account.free.retain(|param| stays(param) || !kind.parameters().iter().any(|(own, _, _)| own == param));
        }
        Some(account)
    };
    chosen.iter().zip(joints).enumerate().map(one).collect()
}

/// Accounts of the joints as they are surrounded now, from fits without what looks like load on: with what is missed of it.
fn restored(joints: &mut [Joint], chosen: &[Option<Chosen>], fits: &[Option<Fit>]) -> Vec<Option<Account>> {
    let one = |((joint, own), fit): ((&mut Joint, &Option<Chosen>), &Option<Fit>)| {
        let (own, fit) = (own.as_ref()?, fit.as_ref()?);
        let (among, kept) = own.kinds.iter().map(|own| own.0).partition(|kind: &Kind| is_called_up(*kind));
        let Fit { law, free, .. } = restore(joint, &fit.law, kept, among);
        Some(Account { law, free })
    };
    joints.par_iter_mut().zip(chosen).zip(fits).map(one).collect()
}

fn accounts(chosen: &[Option<Chosen>]) -> Vec<Option<Account>> {
    let of = |own: &Chosen| Account { law: own.fit.law, free: own.fit.free.clone() };
    chosen.iter().map(|own| own.as_ref().map(of)).collect()
}

/// Nats that accounts save by the parameters that they have less than others, by what their own fits are worth.
fn saved(joints: &[Joint], than: &[Option<Account>], accounts: &[Option<Account>], fits: &[Option<Fit>]) -> f64 {
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

fn sum(fits: &[Option<Fit>]) -> f64 {
    fits.iter().flatten().map(|fit| fit.cost).sum()
}
