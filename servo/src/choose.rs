//! Which effects a joint has: kinds are added, exchanged and dropped while the score of the fit rises.
//!
//! The score of a comparison is Schwarz's, with two things put right for logs of real servos. Errors of a simulation are
//! coloured, so that the effective number of independent samples counts, and each stretch of a log (motor on, motor off)
//! has an error level of its own, so that a long stretch of a poor kind does not drown a short good one.
//! Sources: Schwarz, Ann. Statist. 6(2) 1978; Geyer, Statist. Sci. 7(4) 1992, section 3.3 (initial positive sequence).

use crate::fit::{Fit, fit, normal};
use crate::interval::Spread;
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::run::Signal;
use crate::simulate::{STEP_PART, STEPS, errors, simulate};

/// A kind must lower the squared error by this share of what is left, and its square root by this share of perfect tracking's
/// error: no servo is modelled to better, and no integrator is another's to better.
pub const RELEVANT: [f64; 2] = [0.04, 0.005];
/// Steps of a fit that only decides whether a kind is worth more.
const TRIAL: usize = 8;
/// Steps of a fit that is kept.
const FULL: usize = 25;
/// Nats from which on a kind is taken: no law of a servo is exact, and what is left of it speaks for some kind or other.
const TAKEN: f64 = 4.0;
/// Kinds that one joint may have at most, before what is needless is dropped.
const MOST: usize = 9;
/// Kinds that stand in from the beginning, and are dropped where the logs do not speak for them.
const USUAL: [Kind; 5] = [Kind::Coulomb, Kind::Viscous, Kind::Load, Kind::Armature, Kind::Bias];
/// A delay that nobody was told of is claimed from this many samples on: within one, it is the logger's order of reading and
/// writing.
const CLAIMED_DELAY: f64 = 1.5;

/// One comparison.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Kind that was proposed.
    pub proposed: Kind,
    /// By how many nats the logs speak for it.
    pub nats: f64,
    /// Whether it was taken.
    pub taken: bool,
    /// Whether it was held against the account with it dropped, at the end.
    pub last: bool,
}

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
}

/// Effective number of independent samples in errors of runs, from their autocorrelation.
pub fn independent(joint: &Joint, errors: &[f64]) -> f64 {
    let mut from = 0;
    let mut total = 0.0;
    for run in &joint.runs {
        let part = &errors[from..from + run.time.len()];
        from += run.time.len();
        let energy: f64 = part.iter().map(|e| e * e).sum();
        if energy <= 0.0 {
            continue;
        }
        let mut time = 1.0;
        // Lags grow by a quarter: long memories cost no more than short ones.
        let (mut lag, mut width) = (1usize, 1usize);
        while lag < part.len() / 3 {
            let product: f64 = part[lag..].iter().zip(part).map(|(a, b)| a * b).sum();
            if product <= 0.05 * energy {
                break;
            }
            time += 2.0 * width as f64 * product / energy;
            width = (lag / 4).max(1);
            lag += width;
        }
        total += part.len() as f64 / time;
    }
    total.max(4.0)
}

/// Weights each stretch of each log by its own level of error, so that a stretch with twice the error counts a quarter.
/// The level is no less than the encoder's step.
pub fn weigh(joint: &mut Joint, law: &Law) {
    let step = joint.encoder_step();
    let mut path = Vec::new();
    let [least, greatest] = STEPS;
    let length = (STEP_PART * law.time_constant(joint.sizes.inertia)).clamp(least, greatest);
    for run in &mut joint.runs {
        run.step = length;
        simulate(law, run, &mut path);
        let mut sums = [(0.0, 0.0); 2];
        for k in 0..path.len() {
            let sum = &mut sums[usize::from(run.on[k])];
            *sum = (sum.0 + (path[k] - run.position[k]).powi(2), sum.1 + 1.0);
        }
        let level = sums.map(|(square, count): (f64, f64)| (square / count.max(1.0)).sqrt() + step);
        for k in 0..path.len() {
            run.weight[k] = step / level[usize::from(run.on[k])];
        }
    }
}

/// Kinds that are tried in earnest in each round.
const TRIED: usize = 3;

/// Takes out of a change of the errors what the free parameters can do themselves.
struct Projector<'a> {
    sensitivity: &'a [Vec<f64>],
    inverse: Option<nalgebra::DMatrix<f64>>,
}

impl<'a> Projector<'a> {
    fn new(sensitivity: &'a [Vec<f64>]) -> Self {
        let (mut normal, _) = normal(sensitivity, &[]);
        for i in 0..sensitivity.len() {
            normal[(i, i)] *= 1.0 + 1e-9;
        }
        Projector { sensitivity, inverse: normal.try_inverse() }
    }

    fn clear(&self, mut change: Vec<f64>) -> Vec<f64> {
        let Some(inverse) = &self.inverse else { return change };
        let (_, along) = normal(self.sensitivity, &change);
        let parts = inverse * along;
        for (part, column) in parts.iter().zip(self.sensitivity) {
            change.iter_mut().zip(column).for_each(|(c, s)| *c -= part * s);
        }
        change
    }
}

/// A choice under way.
struct Choice<'a> {
    joint: &'a mut Joint,
    base: Vec<Param>,
    /// Squared error of perfect tracking in the units of the costs.
    perfect: f64,
}

impl Choice<'_> {
    fn free(&self, kinds: &[Kind]) -> Vec<Param> {
        let mut free = self.base.clone();
        for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
            if !free.contains(param) {
                free.push(*param);
            }
        }
        free
    }

    /// The best fit of some kinds from a law, with those of `new` started afresh.
    fn fit(&self, law: &Law, kinds: &[Kind], new: Option<Kind>, steps: usize) -> Fit {
        let free = self.free(kinds);
        let from = |start: f64| {
            let mut law = *law;
            for (param, _, _) in new.iter().flat_map(|kind| kind.parameters()) {
                if !self.joint.given[*param as usize] {
                    law[*param] = start * self.joint.ranges.scale[*param as usize];
                }
            }
            fit(&law, &free, &self.joint.runs, &self.joint.ranges, steps)
        };
        let starts: &[f64] = new.map_or(&[1.0], Kind::starts);
        let mut fits: Vec<Fit> = starts.iter().map(|&start| from(start)).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        fits.swap_remove(0)
    }

    /// The kinds that promise most beside a fit, by one linearised step: at most [`TRIED`].
    fn screen(&self, best: &Fit, kinds: &[Kind], possible: &[Kind], why: &mut Vec<Comparison>) -> Vec<Kind> {
        let samples = independent(self.joint, &best.errors);
        let project = Projector::new(&best.sensitivity);
        let mut promises = Vec::new();
        for &kind in possible.iter().filter(|kind| !kinds.contains(kind)) {
            if kind == Kind::Stribeck && !kinds.contains(&Kind::Coulomb) {
                continue;
            }
            let gain = kind.starts().iter().map(|&start| self.promise(best, &project, kind, start)).fold(0.0, f64::max);
            let rest = (best.cost - gain).max(1e-3 * best.cost);
            let nats = 0.5 * samples * (best.cost / rest).ln() - 0.5 * samples.ln() - kind.cost();
            if nats > 0.0 && gain > self.least(rest) {
                promises.push((nats, kind));
            } else {
                why.push(Comparison { proposed: kind, nats, taken: false, last: false });
            }
        }
        promises.sort_by(|a, b| b.0.total_cmp(&a.0));
        promises.into_iter().take(TRIED).map(|(_, kind)| kind).collect()
    }

    /// Squared error that a kind would take away if errors were linear in it from a small start on.
    fn promise(&self, best: &Fit, project: &Projector, kind: Kind, start: f64) -> f64 {
        let Some(&(param, _, _)) = kind.parameters().first() else { return 0.0 };
        let mut law = best.law;
        if kind == Kind::Stribeck {
            law[Param::StribeckVelocity] = self.joint.ranges.scale[Param::StribeckVelocity as usize];
        }
        let size = self.joint.ranges.scale[param as usize];
        let threshold = matches!(kind, Kind::Saturation | Kind::SpeedLimit | Kind::DeadBand);
        if threshold {
            law[param] = start * size;
        } else {
            law[param] += 0.1 * start * size;
        }
        let mut moved = Vec::new();
        errors(&law, &self.joint.runs, &mut moved);
        let change: Vec<f64> = moved.iter().zip(&best.errors).map(|(m, b)| m - b).collect();
        let clear = project.clear(change);
        let energy: f64 = clear.iter().map(|c| c * c).sum();
        let along: f64 = clear.iter().zip(&best.errors).map(|(c, e)| c * e).sum();
        let signed = matches!(param, Param::Bias | Param::Offset | Param::Scale | Param::Damping | Param::Latency);
        if energy <= 0.0 || (!signed && along >= 0.0) { 0.0 } else { along * along / energy }
    }

    /// Nats by which a richer fit is ahead of a poorer one.
    fn nats(&self, rich: &Fit, poor: &Fit, kind: Kind, samples: f64) -> f64 {
        let more = kind.parameters().len() as f64;
        0.5 * samples * (poor.cost / rich.cost.max(1e-300)).ln() - 0.5 * more * samples.ln() - kind.cost()
    }

    /// The least fall of the squared error that counts, where `rest` is left.
    fn least(&self, rest: f64) -> f64 {
        (RELEVANT[0] * rest).max(RELEVANT[1] * RELEVANT[1] * self.perfect)
    }

    fn relevant(&self, rich: &Fit, poor: &Fit) -> bool {
        poor.cost - rich.cost > self.least(rich.cost)
    }

    fn measure_perfect(&mut self) {
        let mut sum = 0.0;
        for run in &self.joint.runs {
            let Some(target) = &run.target else {
                // Without a set point the motion itself is what a model has to explain.
                let mean = run.position.iter().sum::<f64>() / run.position.len() as f64;
                sum += run.position.iter().zip(&run.weight).map(|(q, w)| (w * (q - mean)).powi(2)).sum::<f64>();
                continue;
            };
            for k in 0..run.time.len() {
                if run.on[k] {
                    sum += (run.weight[k] * (target.at(k) - run.position[k])).powi(2);
                }
            }
        }
        self.perfect = sum;
    }
}

/// Finds what one joint has. Leaves the weights of its runs as the last fit had them.
pub fn choose(joint: &mut Joint) -> Chosen {
    let given = joint.given;
    let mut base: Vec<Param> = [Param::Scale, Param::Damping].into_iter().filter(|p| !given[*p as usize]).collect();
    let closed = joint.runs.iter().any(|run| run.target.is_some());
    if closed && joint.signal == Signal::Command && !given[Param::Latency as usize] {
        base.push(Param::Latency);
    }
    let mut law = joint.start;
    for (param, part) in [(Param::Scale, 0.3), (Param::Damping, 0.3)] {
        if !given[param as usize] {
            law[param] = part * joint.ranges.scale[param as usize];
        }
    }
    let possible: Vec<Kind> = Kind::ALL.into_iter().filter(|&kind| is_possible(joint, kind, closed)).collect();
    let mut choice = Choice { joint, base, perfect: 0.0 };
    // What most servos have stands in from the beginning: beside each other these show, and each hides behind the rest's lack.
    let mut kinds: Vec<Kind> = USUAL.into_iter().filter(|kind| possible.contains(kind)).collect();
    for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
        law[*param] = 0.1 * choice.joint.ranges.scale[*param as usize];
    }
    law[Param::Bias] = 0.0;
    let mut why = Vec::new();
    let mut best = choice.fit(&law, &kinds, None, FULL);
    loop {
        weigh(choice.joint, &best.law);
        choice.measure_perfect();
        best = choice.fit(&best.law, &kinds, None, FULL);
        if kinds.len() >= MOST {
            break;
        }
        let mut top: Option<(f64, Kind, Fit)> = None;
        let screened = choice.screen(&best, &kinds, &possible, &mut why);
        for kind in screened {
            let with: Vec<Kind> = kinds.iter().copied().chain([kind]).collect();
            let rich = choice.fit(&best.law, &with, Some(kind), TRIAL);
            let samples = independent(choice.joint, &rich.errors);
            let nats = choice.nats(&rich, &best, kind, samples);
            let wins = nats > TAKEN && choice.relevant(&rich, &best);
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
    weigh(choice.joint, &best.law);
    choice.measure_perfect();
    best = choice.fit(&best.law, &kinds, None, FULL);
    let kept = drop_needless(&choice, &mut kinds, &mut best, &mut why);
    let ties = ties(&choice, &kinds, &best, &possible);
    let samples = independent(choice.joint, &best.errors);
    let mut found = kept;
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
        let taken = nats > TAKEN;
        why.push(Comparison { proposed: Kind::Delay, nats, taken, last: true });
        if taken {
            found.push((Kind::Delay, nats));
        }
    }
    let unclaimed = found.iter().map(|f| f.0).filter(|kind| kind.needs_given() && !is_given(joint, *kind)).collect();
    Chosen { fit: best, kinds: found, unclaimed, ties, why, samples }
}

fn is_given(joint: &Joint, kind: Kind) -> bool {
    kind.parameters().iter().all(|(param, _, _)| joint.given[*param as usize])
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
        Kind::Saturation => !given && closed,
        // Gravity must show, or an offset of the encoder is nothing to the joint.
        Kind::Offset => joint.sizes.gravity > 0.0,
        _ => true,
    }
}

/// Drops what the fit does not miss; what stays, with the nats it is worth.
fn drop_needless(
    choice: &Choice,
    kinds: &mut Vec<Kind>,
    best: &mut Fit,
    why: &mut Vec<Comparison>,
) -> Vec<(Kind, f64)> {
    loop {
        let samples = independent(choice.joint, &best.errors);
        let mut worth = Vec::new();
        for &kind in kinds.iter() {
            // What stands on a kind goes with it.
            let without: Vec<Kind> = kinds
                .iter()
                .copied()
                .filter(|other| *other != kind && !(kind == Kind::Coulomb && *other == Kind::Stribeck))
                .collect();
            let mut law = best.law;
            for (param, _, _) in kind.parameters() {
                law[*param] = choice.joint.start[*param];
            }
            if kind == Kind::Coulomb {
                law[Param::Rise] = 0.0;
            }
            let poor = choice.fit(&law, &without, None, TRIAL);
            let nats = choice.nats(best, &poor, kind, samples);
            // The bodies of the URDF weigh something for certain: where their weight alone accounts for a constant torque,
            // and fixes the drive's scale, no bias takes its place.
            let weightless =
                kind == Kind::Bias && !Spread::of(best).scale_is_known() && Spread::of(&poor).scale_is_known();
            let relevant = choice.relevant(best, &poor) && !weightless;
            worth.push((kind, nats, relevant, poor, without));
        }
        let needless = worth
            .iter()
            .enumerate()
            .filter(|(_, (_, nats, relevant, _, _))| *nats <= TAKEN || !relevant)
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1))
            .map(|(at, _)| at);
        let Some(at) = needless else {
            why.extend(worth.iter().map(|w| Comparison { proposed: w.0, nats: w.1, taken: true, last: true }));
            return worth.into_iter().map(|w| (w.0, w.1)).collect();
        };
        let (kind, nats, _, poor, without) = worth.swap_remove(at);
        why.push(Comparison { proposed: kind, nats, taken: false, last: true });
        *kinds = without;
        *best = choice.fit(&poor.law, kinds, None, FULL);
    }
}

/// A rival ties with a kind if the error with it in the kind's place is at most this much more.
const TIE: f64 = 0.02;

fn ties(choice: &Choice, kinds: &[Kind], best: &Fit, possible: &[Kind]) -> Vec<(Kind, Kind)> {
    let mut ties = Vec::new();
    for &kind in kinds {
        for &rival in kind.rivals().iter().filter(|rival| possible.contains(rival) && !kinds.contains(rival)) {
            if rival == Kind::Stribeck && !kinds.contains(&Kind::Coulomb) {
                continue;
            }
            let mut law = best.law;
            for (param, _, _) in kind.parameters() {
                law[*param] = choice.joint.start[*param];
            }
            let instead: Vec<Kind> = kinds.iter().copied().filter(|k| *k != kind).chain([rival]).collect();
            let other = choice.fit(&law, &instead, Some(rival), TRIAL);
            if other.cost.sqrt() <= (1.0 + TIE) * best.cost.sqrt() {
                ties.push((kind, rival));
            }
        }
    }
    ties
}
