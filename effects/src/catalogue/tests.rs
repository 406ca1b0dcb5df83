//! Each card states what is asked of it, and states it as the law has it.

use super::*;
use crate::candidate::Range;
use crate::card::{Apart, Grid, Part, Place, Size, Turned};
use gapscope_dynamics::robots;

fn robot() -> Model {
    robots::model("arm6").unwrap().unwrap().model
}

/// A candidate of a kind at a knob that its card offers, on the last joints of an arm.
fn candidate(kind: Kind) -> Candidate {
    let range = Range { speed: 2.0, least: -1.0, span: 2.0, torque: 10.0, duration: 20.0 };
    let card = kind.card();
    let shape = match (card.knob.map(|knob| knob.grid), card.turning) {
        (Some(Grid::Fixed(grid)), _) => grid()[0],
        (Some(Grid::OfJoint(grid) | Grid::Scanned(grid)), _) => grid(&range)[0],
        (None, Some(turning)) => turning.first[0],
        (None, None) => 0.0,
    };
    let joints = match card.place {
        Place::Robot => vec![],
        Place::Pair => vec![4, 5],
        Place::Joint | Place::Leaf | Place::Link => vec![5],
    };
    Candidate { shape, inertia: 0.5, ..Candidate::new(kind, joints) }
}

/// An effect of a kind with coefficients that some robot could have.
fn effect(kind: Kind) -> Effect {
    let tried = (1..=10).map(|columns| {
        let body = [0.5, 0.0, 0.0, 0.05, 0.01, 0.0, 0.01, 0.0, 0.0, 0.01];
        let theta = if kind.card().body { body.to_vec() } else { vec![0.1; columns] };
        candidate(kind).effects(&robot(), &theta)
    });
    tried.filter_map(|effects| effects.into_iter().next()).next().expect("some number of coefficients makes an effect")
}

#[test]
fn every_kind_has_a_card_with_words_of_its_own() {
    let all: Vec<Kind> = Kind::every().collect();
    for (i, kind) in all.iter().enumerate() {
        let card = kind.card();
        assert!(!card.words.is_empty(), "{kind}: no words");
        assert!(all[..i].iter().all(|other| other.card().words != card.words), "{kind}: the words of another kind");
        let is_outside = Kind::OUTSIDE.contains(kind);
        assert_eq!(card.part == Part::Outside, is_outside, "{kind}");
        assert_eq!(card.part == Part::Servo, Kind::SERVO.contains(kind), "{kind}");
        assert!(is_outside || !card.meaning.is_empty(), "{kind}: no meaning");
        assert!(card.knob.is_none_or(|knob| !knob.what.is_empty()), "{kind}: a knob without a name");
        assert!(card.exact_to > 0.0 && card.exact_to < 0.1, "{kind}: {}", card.exact_to);
    }
}

#[test]
fn a_card_makes_effects_of_its_own_kind_with_the_parameters_that_it_names() {
    for kind in Kind::ALL {
        let (card, effect) = (kind.card(), effect(kind));
        assert_eq!(effect.kind(), kind);
        Plant::new(&robot(), std::slice::from_ref(&effect), 1e-3).unwrap();
        let names: Vec<&str> = effect.law().parameters().iter().map(|value| value.name).collect();
        let sizes: Vec<&str> = match card.size {
            Size::Along(gauges) => gauges.iter().map(|gauge| gauge.parameter).collect(),
            Size::PointMass(parameter) | Size::Knob(parameter, _) => vec![parameter],
            Size::Unasked => vec![],
        };
        assert!(!sizes.is_empty() || card.turning.is_some() || card.of_its_log(), "{kind}: no size");
        let asked = sizes.into_iter().chain(card.turning.map(|turning| turning.parameter.0));
        for parameter in asked.chain(card.rests.iter().flat_map(|rests| [rests.sliding, rests.at_rest])) {
            assert!(names.contains(&parameter), "{kind} has no `{parameter}`, but {names:?}");
        }
        // One joint's value does not stand in the way of another's.
        let again = effect.clone().absorb(effect.clone());
        let by_joint = effect.law().parameters().iter().all(|value| value.joint.is_some());
        assert_eq!(again.is_none(), by_joint, "{kind}: a value a joint is taken in, and nothing else");
        assert_eq!(effect.clone().at_rest().is_some(), card.rests.is_some(), "{kind}");
    }
}

#[test]
fn a_gauge_has_a_direction_for_each_column_and_a_body_ten() {
    let model = robot();
    let wave = |shift: f64| -> Vec<Vec<f64>> {
        (0..6).map(|j| (0..40).map(|k| (0.3 * f64::from(k) + f64::from(j) + shift).sin()).collect()).collect()
    };
    let signals = [0.0, 1.0, 2.0, 3.0].map(wave);
    let still = [0.01; 6];
    let motion = Motion {
        model: &model,
        bodies: &model,
        q: &signals[0],
        v: &signals[1],
        a: &signals[2],
        tau: &signals[3],
        nominal: &signals[3],
        load: &signals[3],
        taken: &signals[3],
        drives: &[],
        effort_noise: &[],
        held: None,
        dt: 0.01,
        start: 0.0,
        pushed: &[[0.0, 1.0]],
        standstill: &still,
    };
    for kind in Kind::ALL.into_iter().chain(Kind::OUTSIDE) {
        let (card, candidate) = (kind.card(), candidate(kind));
        let columns = candidate.columns(&motion);
        assert!(!columns.is_empty(), "{kind}");
        assert!(columns.iter().flat_map(|c| &c.rows).all(|(_, x)| x.len() == 40), "{kind}");
        assert_eq!(columns.len() == 10, card.body, "{kind}: ten columns are those of a body");
        assert!(candidate.scales(&model).is_none_or(|scales| scales.len() == columns.len()), "{kind}");
        assert!(card.body == candidate.link().is_some(), "{kind}");
        if let Size::Along(gauges) = card.size {
            assert!(gauges.iter().all(|gauge| gauge.direction.len() == columns.len()), "{kind}");
        }
        let secant = matches!(card.knob.map(|knob| knob.turned), Some(Turned::ToCoefficient(..)));
        assert_eq!(candidate.secant(&[0.01]).is_some(), secant, "{kind}");
    }
}

#[test]
fn kinds_exclude_each_other_alike_and_name_others_rightly() {
    let all = Kind::every;
    for kind in all() {
        let card = kind.card();
        assert!(all().all(|other| kind.excludes(other) == other.excludes(kind)), "{kind}");
        assert!(kind.excludes(kind), "{kind}");
        // What takes its place at rest is another account of the same force, and knows rest.
        assert!(card.sticks_as.is_none_or(|other| kind.excludes(other) && other.card().rests.is_some()), "{kind}");
        assert!(!matches!(card.apart, Apart::From(other, _) if other == kind), "{kind}");
    }
    assert!(Kind::CoulombFriction.excludes(Kind::StribeckFriction));
    assert!(Kind::TorqueSaturation.excludes(Kind::Rub) && !Kind::Rub.excludes(Kind::Catch));
    assert!(!Kind::CoulombFriction.excludes(Kind::ViscousFriction));
}

#[test]
fn there_is_one_rotor_and_a_motor_that_turns_comes_with_it() {
    let rotors: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| kind.card().rotor).collect();
    assert_eq!(rotors, [Candidate::rotor(0).kind]);
    for kind in Kind::ALL {
        let with = candidate(kind).effects(&robot(), &[0.1]);
        let comes = with.iter().any(|effect| effect.kind() == rotors[0]) && kind != rotors[0];
        assert_eq!(comes, kind.card().turning.is_some(), "{kind}");
        let Some(turning) = kind.card().turning else { continue };
        let (first, last, by) = turning.ladder;
        assert_eq!(by > 1.0, last > first, "{kind}: the ladder leads to its end");
        assert!(turning.first.iter().all(|knob| *knob <= turning.widest), "{kind}");
        assert!(kind.card().bends && kind.card().filters(), "{kind}");
    }
}

/// All that is plausible of a payload is small where its mass is; one that was not said to be of some size may be a load.
#[test]
fn a_light_payload_is_light_in_all_its_numbers() {
    let robot = robot();
    let of: Vec<Candidate> = Candidate::all(&robot).into_iter().filter(|c| c.kind == Kind::Payload).collect();
    assert_eq!(of.len(), 2, "a load and a light tool at the one end of the chain");
    let [load, tool] = [&of[0], &of[1]].map(|c| c.scales(&robot).unwrap());
    assert!(load.iter().zip(&tool).all(|(load, tool)| (tool / load - 0.25).abs() < 1e-12));
    let any = Candidate::new(Kind::Payload, of[0].joints.clone());
    assert_eq!(any.scales(&robot).unwrap(), load);
}
