//! What is claimed of joints and of the whole arm, and what was found of their drives, in public terms.

use crate::choice::Comparison;
use crate::choose::Chosen;
use crate::interval::{Interval, REACH, Spread};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::run::Signal;
use crate::schema::*;
use crate::whole::{Found, Whole};
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use gapscope_effects::ServoGainError;
use std::collections::BTreeMap;

/// Part of the claims beyond doubt that are there, on servo arms simulated by MuJoCo.
const THERE: f64 = 0.9;

/// Probability that what the logs speak for by so many nats is there.
pub fn confidence(nats: f64) -> f64 {
    THERE / (1.0 + (-nats).exp())
}

/// The claim of an effect of the whole arm.
pub fn whole_effect(found: &Found, model: &Model, joints: &[Joint]) -> FoundEffect {
    let half = |i: usize| REACH * found.covariance[(i, i)].max(0.0).sqrt();
    let number = |i: usize, unit: &str| {
        let (value, half) = (found.values[i], half(i));
        Estimate::new(Interval { value, ci95: [Some(value - half), Some(value + half)] }, unit)
    };
    let (parameters, at) = match found.whole {
        Whole::Tilt => {
            let own =
                [("roll", 0), ("pitch", 1)].map(|(name, i)| (name.to_owned(), Parameter::Single(number(i, "rad"))));
            (BTreeMap::from(own), vec![])
        }
        Whole::Payload => {
            let mass = found.values[0].max(1e-12);
            let com: Vec<f64> = found.values[1..4].iter().map(|moment| moment / mass).collect();
            let halves: Vec<f64> = (1..4).map(|i| half(i) / mass).collect();
            let end = |sign: f64| com.iter().zip(&halves).map(|(c, h)| c + sign * h).collect();
            let vector = Vector { value: com.clone(), ci95: [end(-1.0), end(1.0)], unit: "m".to_owned() };
            let own = [("mass", Parameter::Single(number(0, "kg"))), ("com", Parameter::Vector(vector))];
            let last = model.joints().last().map(|joint| joint.name.clone());
            (BTreeMap::from(own.map(|(name, own)| (name.to_owned(), own))), last.into_iter().collect())
        }
        Whole::Offset(joint) => {
            let name = model.joints()[joint].name.clone();
            let own = BTreeMap::from([(name.clone(), number(0, "rad"))]);
            (BTreeMap::from([("offset".to_owned(), Parameter::PerJoint(own))]), vec![name])
        }
    };
    FoundEffect {
        kind: found.whole.name().to_owned(),
        joints: if joints.is_empty() { vec![] } else { at },
        part: "further".to_owned(),
        confidence: confidence(found.nats),
        parameters,
        indistinguishable_from: vec![],
        shrink: EffectShrink { position: Some(1.0 - (1.0 - found.share).max(0.0).sqrt()) },
    }
}

/// Kinds over all joints, strongest first.
pub fn effects(
    joints: &[Joint],
    chosen: &[Option<Chosen>],
    spreads: &[Option<Spread>],
    before: Option<f64>,
) -> Vec<FoundEffect> {
    let mut found = Vec::new();
    for kind in Kind::ALL.into_iter().filter(|kind| !kind.is_part_of_base()) {
        let mut at: Vec<(usize, f64)> = Vec::new();
        for (j, c) in chosen.iter().enumerate() {
            let Some(c) = c else { continue };
            // Friction that rises towards rest says what plain friction would.
            let covered = kind == Kind::Coulomb && c.kinds.iter().any(|k| k.0 == Kind::Stribeck);
            let claim = c.kinds.iter().find(|k| k.0 == kind).filter(|k| !c.unclaimed.contains(&k.0) && !covered);
            // What the logs say nothing of is no claim.
            let told = |spread: &Spread| estimates(&joints[j], c, spread, kind).iter().any(|(_, e)| e.determined);
            let claim = claim.filter(|_| spreads[j].as_ref().is_none_or(told));
            at.extend(claim.map(|k| (j, k.1)));
        }
        let strongest = at.iter().map(|a| a.1).fold(f64::NEG_INFINITY, f64::max);
        if at.is_empty() {
            continue;
        }
        let mut parameters: BTreeMap<String, BTreeMap<String, Estimate>> = BTreeMap::new();
        let mut ties: Vec<String> = Vec::new();
        for &(j, _) in &at {
            let (Some(c), Some(spread)) = (&chosen[j], &spreads[j]) else { continue };
            for (name, estimate) in estimates(&joints[j], c, spread, kind) {
                parameters.entry(name).or_default().insert(joints[j].name.clone(), estimate);
            }
            for (_, rival) in c.ties.iter().filter(|tie| tie.0 == kind) {
                if !ties.iter().any(|name| name == rival.name()) {
                    ties.push(rival.name().to_owned());
                }
            }
        }
        found.push((
            strongest,
            FoundEffect {
                kind: kind.name().to_owned(),
                joints: at.iter().map(|&(j, _)| joints[j].name.clone()).collect(),
                part: if kind.cost() == 0.0 { "calibration" } else { "further" }.to_owned(),
                confidence: confidence(strongest),
                parameters: parameters.into_iter().map(|(name, own)| (name, Parameter::PerJoint(own))).collect(),
                indistinguishable_from: ties,
                shrink: EffectShrink { position: before.map(|_| share(chosen, &at)) },
            },
        ));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, effect)| effect).collect()
}

/// What the error of the joints loses by a kind, from the nats it is worth: 1 − exp(−nats/(N/2)).
fn share(chosen: &[Option<Chosen>], at: &[(usize, f64)]) -> f64 {
    let of = |&(j, nats): &(usize, f64)| {
        let samples = chosen[j].as_ref().map_or(1.0, |c| c.samples);
        1.0 - (-nats.max(0.0) / samples).exp()
    };
    at.iter().map(of).fold(0.0, f64::max)
}

/// Parameters of a kind at a joint, by public name.
fn estimates(joint: &Joint, chosen: &Chosen, spread: &Spread, kind: Kind) -> Vec<(String, Estimate)> {
    let law = &chosen.fit.law;
    let sigma = law[Param::Scale];
    let one = |&(param, name, unit): &(Param, &str, &str)| {
        let estimate = if kind == Kind::GainError {
            let ratio = ServoGainError::gain(1.0 / joint.start[Param::Scale], 1.0 / sigma);
            let scale = spread.scale(sigma);
            let ci95 = scale.ci95.map(|end| end.map(|end| end * joint.start[Param::Scale]));
            Estimate::new(Interval { value: ratio, ci95 }, unit)
        } else if param == Param::Spring {
            // A frequency behind a motor that stands, on the mean inertia of the bodies.
            let stiffness = |frequency: f64| joint.sizes.inertia * frequency * frequency;
            let frequency = spread.plain(param, law[param]);
            let ci95 = frequency.ci95.map(|end| end.map(|end| stiffness(end.max(0.0))));
            Estimate::new(Interval { value: stiffness(frequency.value), ci95 }, unit)
        } else if param.is_torque() {
            // Friction at rest is what it is at speed, and the rise on top.
            let at_rest = [Param::Rise, Param::Coulomb];
            let sum = if (kind, param) == (Kind::Stribeck, Param::Rise) { &at_rest[..] } else { &[param] };
            let mut interval = spread.torque(sum, law);
            let known = spread.scale_is_known();
            let over = if known { sigma } else { 1.0 };
            let base = if kind == Kind::DampingError { -joint.start[Param::Damping] / over } else { 0.0 };
            interval.value += base;
            interval.ci95 = interval.ci95.map(|end| end.map(|end| end + base));
            Estimate::new(interval, &unit_of(unit, joint.signal, known))
        } else {
            Estimate::new(spread.plain(param, law[param]), unit)
        };
        (name.to_owned(), estimate)
    };
    // The rotor that comes with a spring or with play is told as `armature`.
    let own = kind.parameters().iter().filter(|(param, _, _)| *param != Param::Armature || kind == Kind::Armature);
    let mut all: Vec<(String, Estimate)> = own.map(one).collect();
    if kind == Kind::Stribeck {
        all.push(one(&(Param::Coulomb, "coulomb", "N m")));
    }
    // Of friction that rises towards rest the parts of plain friction are told with it.
    let told_as = |other: Kind| other.base() == Some(kind) || (kind == Kind::Stribeck && other.base() == kind.base());
    let parts = chosen.kinds.iter().map(|own| own.0).filter(|other| other.is_part_of_base() && told_as(*other));
    all.extend(parts.flat_map(|part| part.parameters().iter().map(one)));
    all
}

/// A unit of torque, or of its ratio to the drive's scale.
fn unit_of(unit: &str, signal: Signal, known: bool) -> String {
    if known || signal == Signal::Effort { unit.to_owned() } else { format!("{unit}/(N m/{})", signal.unit()) }
}

/// What was found of a joint's drive.
pub fn drive(
    joint: &Joint,
    law: &Law,
    chosen: Option<&Chosen>,
    spread: Option<&Spread>,
    episodes: &[Episode],
) -> FoundDrive {
    let mut constants = BTreeMap::new();
    let mut open = Vec::new();
    let mut given = Vec::new();
    let scale_name = match joint.signal {
        Signal::Command => "stiffness",
        Signal::Voltage => "torque_per_volt",
        Signal::Current => "torque_constant",
        Signal::Effort => "torque",
    };
    let names = [
        (Param::Scale, scale_name),
        (Param::Damping, "damping"),
        (Param::Feedforward, "feedforward"),
        (Param::Latency, "latency"),
        (Param::Limit, "limit"),
        (Param::Speed, "speed_limit"),
        (Param::DeadBand, "dead_band"),
    ];
    if let (Some(spread), Some(chosen)) = (spread, chosen) {
        let sigma = law[Param::Scale];
        let known = spread.scale_is_known();
        for (param, name) in names {
            let free = chosen.fit.free.contains(&param);
            if joint.given[param as usize] {
                given.push(name.to_owned());
            }
            if !law[param].is_finite() || (!free && !joint.given[param as usize]) {
                continue;
            }
            let estimate = match param {
                Param::Scale => Estimate::new(spread.scale(sigma), &format!("N m/{}", joint.signal.unit())),
                Param::Damping | Param::Feedforward => {
                    Estimate::new(spread.torque(&[param], law), &unit_of("N m s/rad", joint.signal, known))
                }
                Param::Limit => Estimate::new(spread.plain(param, law[param]), joint.signal.unit()),
                Param::Latency => Estimate::new(spread.plain(param, law[param]), "s"),
                Param::Speed => Estimate::new(spread.plain(param, law[param]), "rad/s"),
                _ => Estimate::new(spread.plain(param, law[param]), "rad"),
            };
            constants.insert(name.to_owned(), estimate);
        }
        if !known {
            open.push(format!(
                "{scale_name}: gravity and the bodies' inertia show too little; torques are given as ratios to it"
            ));
        }
        let parted = joint.goes_off || joint.given[Param::Damping as usize];
        if !parted && chosen.fit.free.contains(&Param::Damping) {
            open.push(
                "derivative gain, back-EMF and viscous friction are one number here, `damping`: a stretch with the motor off would part them"
                    .to_owned(),
            );
        }
    }
    let differs = joint.runs.iter().any(|run| (run.gain - 1.0).abs() > 1e-9);
    let gains = joint.runs.iter().filter(|_| differs).map(|run| (episodes[run.log].name.clone(), run.gain)).collect();
    if joint.signal != Signal::Command && joint.runs.iter().all(|run| run.target.is_some()) {
        constants.insert(
            "feedback".to_owned(),
            Estimate {
                value: law[Param::Feedback],
                ci95: [None, None],
                unit: format!("{}/rad", joint.signal.unit()),
                determined: true,
            },
        );
    }
    FoundDrive { follows: joint.signal, constants, given, gains, open }
}

/// The comparisons of a joint.
pub fn reasons(joint: &Joint, chosen: Option<&Chosen>) -> Vec<Why> {
    let of = |c: &Comparison| Why {
        proposed: c.proposed.name().to_owned(),
        joints: vec![joint.name.clone()],
        against: if c.last { "the same without it" } else { "what was found before" }.to_owned(),
        odds: c.nats,
        taken: c.taken,
    };
    chosen.iter().flat_map(|c| c.why.iter().map(of)).collect()
}
