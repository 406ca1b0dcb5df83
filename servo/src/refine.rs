//! The numbers of effects of the whole arm, anew and all at once, once all joints have an account.

use crate::account::{Accounts, accounts, without};
use crate::around::Motion;
use crate::choice::TAKEN;
use crate::choose::Chosen;
use crate::fit::Fit;
use crate::kinds::Kind;
use crate::law::Param;
use crate::prepare::Joint;
use crate::settle::{Search, Settled, misfit, worth};
use crate::whole::{Found, Whole, put};
use gapscope_dynamics::Model;
use nalgebra::DMatrix;
use std::ops::Range;

/// The numbers of effects that were found, anew and all at once, with the encoder zeros that joints were found to have: beside what
/// else the joints have, or without it, where their first numbers may have called it up. What is not missed beside the others is
/// left out. Leaves the joints in the surroundings of the model without them.
pub fn refine(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    found: &[Found],
) -> Option<Vec<Found>> {
    let has = |goes: &dyn Fn(Kind) -> bool| chosen.iter().flatten().flat_map(|own| &own.kinds).any(|own| goes(own.0));
    let mut tried = vec![accounts(chosen)];
    if has(&|_| true) {
        tried.push(without(chosen, joints, |_, _| true));
    }
    // What a body's lever is short of stands as rotors: they are looked at without.
    if found.iter().any(|own| own.whole == Whole::Payload) && has(&|kind| kind == Kind::Armature) {
        tried.push(without(chosen, joints, |_, kind| kind == Kind::Armature));
    }
    let mut kept: Vec<Found> = found.iter().cloned().chain(chosen.iter().enumerate().filter_map(zero)).collect();
    // A zero that is not among them is right.
    let mut motions = motions.to_vec();
    for own in &kept {
        let Whole::Offset(joint) = own.whole else { continue };
        motions.iter_mut().for_each(|motion| motion.put_zero_off(joint, 0.0));
        for account in tried.iter_mut().filter_map(|accounts| accounts[joint].as_mut()) {
            account.put_zero_off(0.0);
        }
    }
    while !kept.is_empty() {
        let search = search_of(&kept, model, &motions, joints.len())?;
        let Some(settled) = settle_best(&search, &kept, joints, &tried, None) else {
            // Where only numbers at their bounds go with the logs, something else is there.
            let bodies = kept.iter().filter(|own| !own.whole.is_zero());
            let weakest = bodies.min_by(|a, b| a.nats.total_cmp(&b.nats))?.whole;
            put(joints, &search.plain);
            kept.retain(|own| own.whole != weakest);
            continue;
        };
        let samples = worth(joints, &settled.fits);
        let spread = search.spread(joints, &settled)?;
        let places = search.places();
        for (own, (_, numbers)) in kept.iter_mut().zip(&places) {
            own.values = settled.values[numbers.clone()].to_vec();
            own.covariance = spread.view((numbers.start, numbers.start), (numbers.len(), numbers.len())).into();
        }
        let mut needless = needless(&places, &settled, &spread, samples.iter().sum());
        if needless.is_empty() {
            // Off nothing by far may lie what leads to a poorer account than there is without it.
            needless.extend(not_missed(&kept, &settled, model, &motions, joints, &tried));
        }
        put(joints, &search.plain);
        if needless.is_empty() {
            return Some(kept);
        }
        kept.retain(|own| !needless.contains(&own.whole));
    }
    Some(kept)
}

/// The encoder zero that a joint was found to have.
fn zero((j, own): (usize, &Option<Chosen>)) -> Option<Found> {
    let own = own.as_ref().filter(|own| own.kinds.iter().any(|(kind, _)| *kind == Kind::Offset))?;
    let (values, covariance) = (vec![own.fit.law[Param::Offset]], DMatrix::zeros(1, 1));
    Some(Found { whole: Whole::Offset(j), values, covariance, nats: 0.0, share: 0.0, beside: Vec::new() })
}

/// A search for the numbers of effects all at once.
fn search_of<'a>(kept: &[Found], model: &'a Model, motions: &'a [Motion], joints: usize) -> Option<Search<'a>> {
    let wholes: Vec<Whole> = kept.iter().map(|own| own.whole).collect();
    Search::new(&wholes, model, motions, &vec![None; joints], false)
}

/// What a search settles at beside the accounts, of those tried, that leave least; each joint is worth so many `samples`, or as many
/// as it is beside the first of them.
fn settle_best(
    search: &Search,
    kept: &[Found],
    joints: &mut [Joint],
    tried: &[Accounts],
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

/// The body or the tilted base without which what is left, settled anew, loses less than its price.
fn not_missed(
    kept: &[Found],
    settled: &Settled,
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    tried: &[Accounts],
) -> Option<Whole> {
    let samples = worth(joints, &settled.fits);
    let bodies = kept.iter().map(|own| own.whole).filter(|whole| !whole.is_zero());
    let lost = |whole: Whole| {
        let rest: Vec<Found> = kept.iter().filter(|own| own.whole != whole).cloned().collect();
        let search = search_of(&rest, model, motions, joints.len())?;
        let poor = settle_best(&search, &rest, joints, tried, Some(&samples))?;
        let lost = score(&poor.fits, &samples) - score(&settled.fits, &samples);
        (lost < whole.price(samples.iter().sum()) + TAKEN).then_some((lost, whole))
    };
    bodies.filter_map(lost).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, whole)| whole)
}
