//! Which effects a joint has: kinds are added, exchanged and dropped while the score of the fit rises.

use crate::choice::{Bar, Choice, Comparison, FULL, Poorer, TAKEN, TRIAL, is_given};
use crate::excerpt;
use crate::fit::{Fit, fit};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::needless::{drop_needless, exchange, ties};
use crate::prepare::Joint;
use crate::run::Signal;
use crate::weigh::{independent, weigh};

/// Kinds that one joint may have at most, before what is needless is dropped.
const MOST: usize = 9;
/// Kinds that stand in from the beginning, and are dropped where the logs do not speak for them.
const USUAL: [Kind; 5] = [Kind::Coulomb, Kind::Viscous, Kind::Load, Kind::Armature, Kind::Bias];
/// A delay that nobody was told of is claimed from this many samples on: within one, it is the logger's order of reading and
/// writing.
const CLAIMED_DELAY: f64 = 1.5;

/// What was found of one joint.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// The fit of all that is free.
    pub fit: Fit,
    /// Kinds that were taken, with the nats that they lose if dropped.
    pub kinds: Vec<(Kind, f64)>,
    /// Kinds among them that are no claim: parts of a drive that nobody gave.
    pub unclaimed: Vec<Kind>,
    /// What could stand in the place of a kind with an error of at most 2 % more.
    pub ties: Vec<(Kind, Kind)>,
    /// The comparisons that decided.
    pub why: Vec<Comparison>,
    /// Independent samples that the errors are worth.
    pub samples: f64,
    /// The account without its spring or play, where it has one.
    pub poorer: Option<Poorer>,
    /// Whether a delay is a kind of the account, and no name for the latency of its drive.
    delay_is_free: bool,
}

impl Chosen {
    /// The account, to begin another choice with.
    pub fn account(&self) -> From {
        // A latency is a part of the drive, whether it is told as a delay or not.
        let kinds = self.kinds.iter().map(|(kind, _)| *kind).filter(|kind| *kind != Kind::Delay || self.delay_is_free);
        From::Account(self.fit.law, kinds.collect())
    }

    /// Puts what the whole arm says of its encoder's zero in the place of what the joint alone said; nothing where it is right.
    pub fn put_zero_off(&mut self, offset: Option<f64>) {
        if offset.is_none() {
            self.kinds.retain(|(kind, _)| *kind != Kind::Offset);
            self.fit.free.retain(|param| *param != Param::Offset);
        }
        self.fit.law[Param::Offset] = offset.unwrap_or(0.0);
    }

    /// The same without its spring or play.
    pub fn rigid(&self) -> From {
        match &self.poorer {
            Some(poorer) => From::Account(poorer.fit.law, poorer.kinds.clone()),
            None => self.account(),
        }
    }
}

/// A choice that begins with what most servos have, and the kinds that it has to choose from.
fn begin(joint: &mut Joint, bar: Bar) -> (Choice<'_>, Vec<Kind>, Vec<Kind>) {
    let given = joint.given;
    let mut base: Vec<Param> = [Param::Scale, Param::Damping].into_iter().filter(|p| !given[*p as usize]).collect();
    let closed = joint.runs.iter().any(|run| run.target.is_some());
    if closed && joint.signal == Signal::Command && !given[Param::Latency as usize] {
        base.push(Param::Latency);
    }
    let mut law = joint.start;
    for (param, part) in [(Param::Scale, 0.3), (Param::Damping, 0.3)] {
        if !given[param as usize] && !joint.bounded[param as usize] {
            law[param] = part * joint.ranges.scale[param as usize];
        }
    }
    let possible: Vec<Kind> = Kind::ALL.into_iter().filter(|&kind| is_possible(joint, kind, closed)).collect();
    // What most servos have stands in from the beginning: beside each other these show, and each hides behind the rest's lack.
    let kinds: Vec<Kind> = USUAL.into_iter().filter(|kind| possible.contains(kind)).collect();
    for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
        law[*param] = 0.1 * joint.ranges.scale[*param as usize];
    }
    law[Param::Bias] = 0.0;
    (Choice { joint, base, perfect: 0.0, bare: law, bar }, kinds, possible)
}

impl Choice<'_> {
    /// The law where a choice of the usual `kinds` begins: next to nothing, or an account beside them, where that misses less; its
    /// kinds join them.
    fn nearer(&self, law: &Law, own: &[Kind], kinds: &mut Vec<Kind>) -> Law {
        let more = own.iter().filter(|kind| !kinds.contains(kind));
        let all: Vec<Kind> = kinds.iter().chain(more).copied().collect();
        let bare = self.fit(&self.bare, kinds, None, TRIAL);
        let near = self.fit(law, &all, None, TRIAL);
        if near.cost >= bare.cost {
            return bare.law;
        }
        *kinds = all;
        near.law
    }
}

/// Where a choice begins.
#[derive(Debug, Clone, Default)]
pub enum From {
    /// At nothing.
    #[default]
    Nothing,
    /// At nothing, or at an account that was found in near surroundings, with what most servos have beside it: where less is missed.
    Near(Law, Vec<Kind>),
    /// At an account that was found before, in other surroundings.
    Account(Law, Vec<Kind>),
}

impl From {
    /// At nothing too, where it begins at an account.
    pub fn or_nothing(self) -> From {
        match self {
            From::Account(law, kinds) => From::Near(law, kinds),
            other => other,
        }
    }

    /// Its law, where it has one.
    pub fn law(&self) -> Option<Law> {
        match self {
            From::Nothing => None,
            From::Near(law, _) | From::Account(law, _) => Some(*law),
        }
    }
}

/// Finds what one joint has, by an excerpt of long logs; its parameters are those of all. Leaves the weights of its runs as the
/// last fit had them.
pub fn choose(joint: &mut Joint, from: &From, bar: Bar) -> Chosen {
    let Some(mut part) = excerpt::of_joint(joint) else { return choose_by_all(joint, from, bar) };
    let mut found = choose_by_all(&mut part, from, bar);
    weigh(joint, &found.fit.law);
    let refit = |own: &Fit, rounds: usize| fit(&own.law, &own.free, &joint.runs, &joint.ranges, rounds);
    found.fit = refit(&found.fit, FULL);
    if let Some(poorer) = &mut found.poorer {
        poorer.fit = refit(&poorer.fit, TRIAL);
    }
    found.samples = independent(joint, &found.fit.errors);
    found
}

/// The fit of an account, from a law on, with those of some kinds that it misses: the one that is missed most first.
pub fn restore(joint: &mut Joint, law: &Law, mut kinds: Vec<Kind>, mut among: Vec<Kind>) -> Fit {
    let (choice, _, _) = begin(joint, Bar::Noise);
    let mut best = choice.fit(law, &kinds, None, TRIAL);
    loop {
        let with = |(at, &kind): (usize, &Kind)| {
            let with: Vec<Kind> = kinds.iter().copied().chain([kind]).collect();
            let rich = choice.fit(&best.law, &with, Some(kind), TRIAL);
            let nats = choice.nats(&rich, &best, kind, independent(choice.joint, &rich.errors));
            (nats > TAKEN && choice.relevant(&rich, &best)).then_some((nats, at, rich))
        };
        let top = among.iter().enumerate().filter_map(with).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, at, rich)) = top else { return best };
        kinds.push(among.remove(at));
        best = rich;
    }
}

fn choose_by_all(joint: &mut Joint, from: &From, bar: Bar) -> Chosen {
    let given = joint.given;
    let (mut choice, mut kinds, possible) = begin(joint, bar);
    let mut why = Vec::new();
    let start = match from {
        From::Nothing => choice.bare,
        From::Near(law, own) => choice.nearer(law, own, &mut kinds),
        From::Account(law, own) => {
            kinds.clone_from(own);
            *law
        }
    };
    let mut best = choice.fit(&start, &kinds, None, FULL);
    let usual = kinds.len();
    loop {
        choice.weigh(&best.law);
        best = choice.fit(&best.law, &kinds, None, FULL);
        if kinds.len() >= MOST {
            break;
        }
        let mut top: Option<(f64, Kind, Fit)> = None;
        let screened = choice.screen(&best, &kinds, &possible, kinds.len() == usual, &mut why);
        for kind in screened {
            let with: Vec<Kind> = kinds.iter().copied().chain([kind]).collect();
            let rich = choice.fit(&best.law, &with, Some(kind), TRIAL);
            let samples = independent(choice.joint, &rich.errors);
            let nats = choice.nats(&rich, &best, kind, samples);
            let wins = nats > TAKEN && best.cost - rich.cost > choice.least_added(rich.cost);
            why.push(Comparison { proposed: kind, nats, taken: false, last: false });
            if wins && top.as_ref().is_none_or(|(most, _, _)| nats > *most) {
                top = Some((nats, kind, rich));
            }
        }
        let Some((nats, kind, rich)) = top else { break };
        kinds.push(kind);
        if let Some(said) = why.iter_mut().rev().find(|c| c.proposed == kind && c.nats == nats) {
            said.taken = true;
        }
        best = choice.fit(&rich.law, &kinds, None, FULL);
    }
    choice.weigh(&best.law);
    best = choice.fit(&best.law, &kinds, None, FULL);
    let (mut kept, mut poorer) = drop_needless(&choice, &mut kinds, &mut best, &mut why);
    if exchange(&choice, &mut kinds, &mut best, &possible, &mut why) {
        (kept, poorer) = drop_needless(&choice, &mut kinds, &mut best, &mut why);
    }
    let ties = ties(&choice, &kinds, &best, &possible);
    let samples = independent(choice.joint, &best.errors);
    let delay_is_free = kinds.contains(&Kind::Delay);
    let mut found = kept;
    let least = choice.beyond(&best.errors);
    let joint = choice.joint;
    // A latency of the drive that shows beyond the logger's own order is a delay to any simulator without one.
    if !given[Param::Latency as usize]
        && best.free.contains(&Param::Latency)
        && best.law[Param::Latency] > CLAIMED_DELAY * joint.dt
    {
        let mut without = best.law;
        without[Param::Latency] = joint.dt.min(best.law[Param::Latency]);
        let free: Vec<Param> = best.free.iter().copied().filter(|p| *p != Param::Latency).collect();
        let poor = fit(&without, &free, &joint.runs, &joint.ranges, TRIAL);
        let nats = 0.5 * samples * (poor.cost / best.cost.max(1e-300)).ln() - 0.5 * samples.ln() - Kind::Delay.cost();
        let taken = nats > TAKEN && poor.cost - best.cost > least;
        why.push(Comparison { proposed: Kind::Delay, nats, taken, last: true });
        if taken {
            found.push((Kind::Delay, nats));
        }
    }
    let unclaimed = found.iter().map(|f| f.0).filter(|kind| kind.needs_given() && !is_given(joint, *kind)).collect();
    Chosen { fit: best, kinds: found, unclaimed, ties, why, samples, poorer, delay_is_free }
}

/// Whether a kind can be asked for at all.
fn is_possible(joint: &Joint, kind: Kind, closed: bool) -> bool {
    let given = is_given(joint, kind);
    match kind {
        // Motor on and motor off part what brakes in the drive from what brakes in the gear; so does a known drive.
        Kind::Viscous => joint.given[Param::Damping as usize] || joint.goes_off,
        Kind::GainError | Kind::DampingError => given,
        Kind::Delay => given && closed,
        Kind::DeadBand => closed && given,
        Kind::SpeedLimit => closed,
        Kind::Feedforward => closed && !given,
        Kind::Saturation => !given && closed,
        Kind::Elasticity | Kind::Backlash => closed,
        // Gravity must show, or an offset of the encoder is nothing to the joint.
        Kind::Offset => joint.sizes.gravity > 0.0,
        _ => true,
    }
}
