//! The answer on a servo arm in three sentences: what it is, how far it shrinks, what to beware of.

use super::super::effort::Effort;
use super::super::format::{figure, percent};
use super::super::{plain, words};
use super::schema;
use gapscope_diagnosis::schema::Verdict;
use gapscope_servo::schema::{Diagnosis, Regime};

/// One line each; terminal and page begin with these very words.
pub fn answer(diagnosis: &Diagnosis) -> [String; 3] {
    let effort = Effort::of(&schema::regimes(&diagnosis.gap.regimes));
    [cause(diagnosis), reach(diagnosis), caution(diagnosis)].map(|line| effort.say(&line))
}

fn cause(diagnosis: &Diagnosis) -> String {
    let effects = plain::effects(&schema::effects(&diagnosis.effects), &diagnosis.joints, &[]);
    match schema::verdict(&diagnosis.verdict) {
        Verdict::NotExcited => "No joint moves or is told to, so nothing can be said of its drive.".into(),
        Verdict::NoGap if effects.is_empty() => {
            "The drives alone explain these logs; no effect beyond them is needed.".into()
        }
        _ if effects.is_empty() => "Beside its drives the arm has something, and it is no effect that I know.".into(),
        Verdict::UnknownEffect => format!("{effects} Something else is at work that I do not know."),
        _ => effects,
    }
}

/// What the free run is held against.
pub fn nominal(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.gap.nominal == "given_servo" { "the given servo" } else { "perfect tracking" }
}

fn reach(diagnosis: &Diagnosis) -> String {
    let change = &diagnosis.shrink.position;
    let nominal = nominal(diagnosis);
    let unit = unit(&diagnosis.gap.regimes, None);
    match (change.before, change.after) {
        (Some(before), Some(after)) => format!(
            "Run free under its set points, the arm found here is off by {}; {nominal} is off by {}.",
            offset(after, before, unit),
            offset(before, after, unit)
        ),
        (Some(before), None) => {
            format!(
                "The arm found here cannot be run free on these logs; {nominal} is off by {}.",
                offset(before, before, unit)
            )
        }
        _ => "No arm can be run free on these logs.".into(),
    }
}

fn caution(diagnosis: &Diagnosis) -> String {
    if let Some(tie) = plain::first_tie(&schema::effects(&diagnosis.effects)) {
        return tie;
    }
    let largest =
        diagnosis.gap.position.rms.iter().filter(|(_, rms)| rms.is_finite()).max_by(|a, b| a.1.total_cmp(b.1));
    let Some((joint, rms)) = largest else { return "No joint's position could be compared.".into() };
    let left = diagnosis.unexplained.fraction;
    let left = match left {
        left if left >= 1.0 => "all of it".into(),
        left if left > 0.0005 => format!("{} of the squared gap", percent(left)),
        _ => "nothing".into(),
    };
    format!(
        "The gap is largest at {joint}, {} rms; {left} stays unexplained.",
        offset(*rms, *rms, unit(&diagnosis.gap.regimes, Some(joint)))
    )
}

/// An error of position, in thousandths or whole ones of `unit` as suits the larger of the two that are told together.
///
/// The unit is one of [`words::motion_unit`]: over joints that turn and joints that slide it names both.
pub fn offset(value: f64, beside: f64, unit: &str) -> String {
    // What would print as a thousand is a whole one.
    let small = value.max(beside) < 0.9995;
    let units: Vec<String> =
        unit.split(", ").map(|unit| if small { format!("m{unit}") } else { unit.into() }).collect();
    format!("{}\u{a0}{}", figure(if small { 1e3 * value } else { value }), units.join("\u{a0}or\u{a0}"))
}

/// Unit of the positions of a servo arm: of one joint, or of all together.
pub fn unit(regimes: &[Regime], joint: Option<&str>) -> &'static str {
    let regimes = schema::regimes(regimes);
    match joint {
        Some(joint) if words::implied_unit(joint, &regimes) == "N" => "m",
        Some(_) => "rad",
        None => words::motion_unit(&regimes, false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_servo::schema::*;
    use std::collections::BTreeMap;

    fn arm(kind: &str, parameter: &str, value: f64, unit: &str) -> Diagnosis {
        let found =
            Estimate { value, ci95: [Some(0.9 * value), Some(1.1 * value)], unit: unit.into(), determined: true };
        let effect = FoundEffect {
            kind: kind.into(),
            joints: vec!["elbow".into()],
            part: "further".into(),
            confidence: 0.9,
            parameters: BTreeMap::from([(
                parameter.into(),
                Parameter::PerJoint(BTreeMap::from([("elbow".into(), found)])),
            )]),
            indistinguishable_from: vec![],
            shrink: EffectShrink { position: None },
        };
        let per_joint = |value: f64| BTreeMap::from([("elbow".to_owned(), value)]);
        Diagnosis {
            schema: "gapscope.diagnosis/1".into(),
            robot: "arm".into(),
            joints: vec!["elbow".into()],
            data: DataSummary { episodes: 1, samples: 9, duration: 9.0, rate: 1.0, findings: vec![] },
            verdict: "explained".into(),
            gap: Gap {
                position: PositionGap { rms: per_joint(0.04), floor: per_joint(1e-4) },
                regimes: vec![],
                nominal: "given_servo".into(),
            },
            effects: vec![effect],
            drive: BTreeMap::new(),
            unexplained: Unexplained { fraction: 0.02 },
            shrink: Shrink {
                position: Change { before: Some(0.04), after: Some(0.002), shrink: Some(0.95), ci95: None },
            },
            why: vec![],
            next_experiment: None,
        }
    }

    #[test]
    fn the_answer_says_what_how_far_and_where() {
        let [cause, reach, caution] = answer(&arm("coulomb_friction", "coulomb", 0.2, "N m"));
        assert_eq!(cause, "elbow rubs: 0.200\u{a0}N\u{a0}m of dry friction that the model lacks.");
        assert_eq!(offset(0.0917, 1.0, "rad"), "0.0917\u{a0}rad");
        assert_eq!(offset(0.0917, 0.1, "rad, m"), "91.7\u{a0}mrad\u{a0}or\u{a0}mm");
        assert!(reach.contains("is off by 2.00\u{a0}mrad; the given servo is off by 40.0\u{a0}mrad"), "{reach}");
        assert_eq!(
            caution,
            "The gap is largest at elbow, 40.0\u{a0}mrad rms; 2\u{202f}% of the squared gap stays unexplained."
        );
        for (kind, parameter, said) in [
            ("speed_limit", "limit", "elbow moves no faster than 0.200"),
            ("servo_gain_error", "gain", "At elbow the servo pulls 0.200 times as hard as was given"),
            ("dead_band", "width", "At elbow the servo rests within 0.200"),
        ] {
            let unit = if kind == "servo_gain_error" { "-" } else { "rad" };
            let [cause, ..] = answer(&arm(kind, parameter, 0.2, unit));
            assert!(cause.starts_with(said), "{cause}");
        }
    }

    #[test]
    fn what_is_not_explained_is_said() {
        let mut nothing = arm("coulomb_friction", "coulomb", 0.2, "N m");
        nothing.effects.clear();
        nothing.verdict = "unknown_effect".into();
        nothing.unexplained.fraction = 1.19;
        let [cause, _, caution] = answer(&nothing);
        assert!(
            cause.contains("no effect that I know") && caution.contains("; all of it stays unexplained"),
            "{caution}"
        );
        nothing.verdict = "no_gap".into();
        assert!(answer(&nothing)[0].starts_with("The drives alone"));
    }
}
