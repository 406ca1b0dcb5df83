//! The diagnosis of a servo arm in the terms that the parts of the page share with one of torque.

use gapscope_diagnosis::schema::{
    Bounds, EffectCurve, EffectShrink, Estimate, FoundEffect, NextExperiment, Parameter, Part, Quantity, Regime,
    Verdict, Why,
};
use gapscope_servo::schema as servo;
use std::collections::BTreeMap;

/// Points of a law over speed on either side of rest.
const POINTS: usize = 40;

/// The verdict; a word of a later version counts as one that nothing explains.
pub fn verdict(word: &str) -> Verdict {
    serde_json::from_value(word.into()).unwrap_or(Verdict::UnknownEffect)
}

/// An estimate; what the logs do not bound is infinite.
pub fn estimate(found: &servo::Estimate) -> Estimate {
    let [low, high] = found.ci95;
    Estimate {
        value: Quantity::Scalar(found.value),
        ci95: [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)].map(Quantity::Scalar),
        unit: unit(&found.unit),
    }
}

/// `N m/(N m/rad)` as a person says it: where the drive's scale is not known, torques are told per unit of it.
fn unit(unit: &str) -> String {
    match unit.split_once("/(") {
        Some((torque, scale)) => format!("{torque} per {}", scale.trim_end_matches(')')),
        None => unit.to_owned(),
    }
}

pub fn effects(list: &[servo::FoundEffect]) -> Vec<FoundEffect> {
    let parameter = |found: &servo::Parameter| match found {
        servo::Parameter::Single(e) => Parameter::Single(estimate(e)),
        servo::Parameter::Vector(v) => Parameter::Single(Estimate {
            value: Quantity::Vector(v.value.clone()),
            ci95: v.ci95.clone().map(Quantity::Vector),
            unit: v.unit.clone(),
        }),
        servo::Parameter::PerJoint(joints) => {
            Parameter::PerJoint(joints.iter().map(|(joint, e)| (joint.clone(), estimate(e))).collect())
        }
    };
    let effect = |found: &servo::FoundEffect| FoundEffect {
        kind: found.kind.clone(),
        joints: found.joints.clone(),
        part: if found.part == "calibration" { Part::Calibration } else { Part::Further },
        confidence: found.confidence,
        parameters: found.parameters.iter().map(|(name, found)| (name.clone(), parameter(found))).collect(),
        indistinguishable_from: found.indistinguishable_from.clone(),
        shrink: EffectShrink { torque: found.shrink.position, ci95: None },
    };
    list.iter().map(effect).collect()
}

pub fn regimes(list: &[servo::Regime]) -> Vec<Regime> {
    let bounds =
        |b: &servo::Bounds| Bounds { quantity: b.quantity.clone(), unit: b.unit.clone(), interval: b.interval };
    let regime = |r: &servo::Regime| Regime {
        joint: r.joint.clone(),
        regime: r.regime.clone(),
        bounds: bounds(&r.bounds),
        share: r.share,
        ci95: r.ci95,
        samples: r.samples,
    };
    list.iter().map(regime).collect()
}

pub fn next_experiment(next: &servo::NextExperiment) -> NextExperiment {
    let servo::NextExperiment { why, separates, motion, trajectory, separation } = next.clone();
    NextExperiment { why, separates, motion, trajectory, separation }
}

pub fn why(list: &[servo::Why]) -> Vec<Why> {
    let why = |w: &servo::Why| Why {
        proposed: w.proposed.clone(),
        joints: w.joints.clone(),
        against: w.against.clone(),
        odds: w.odds,
        taken: w.taken,
    };
    list.iter().map(why).collect()
}

/// Friction over speed, up to a joint's own `speeds`, rad/s. What hangs on something else has its figures alone.
pub fn curves(list: &[servo::FoundEffect], speeds: &BTreeMap<String, f64>) -> Vec<EffectCurve> {
    let of = |effect: &servo::FoundEffect| -> Vec<EffectCurve> {
        effect.joints.iter().filter_map(|joint| curve(effect, joint, *speeds.get(joint)?)).collect()
    };
    list.iter().flat_map(of).collect()
}

fn curve(effect: &servo::FoundEffect, joint: &str, top: f64) -> Option<EffectCurve> {
    let names: &[&str] = match effect.kind.as_str() {
        "coulomb_friction" => &["coulomb"],
        "viscous_friction" => &["viscous"],
        "stribeck_friction" => &["coulomb", "static", "stribeck_velocity"],
        _ => return None,
    };
    // A joint that creeps passes zero on a slope.
    let creep = effect.parameters.get("creep_velocity").and_then(|own| own.at(joint)).map(|own| own.value);
    let sign = |v: f64| creep.map_or(v.signum(), |creep| (v / creep).clamp(-1.0, 1.0));
    let law = |p: &[f64], v: f64| match p {
        [viscous] if effect.kind == "viscous_friction" => viscous * v,
        [coulomb] => coulomb * sign(v),
        [coulomb, at_rest, fade] => (coulomb + (at_rest - coulomb) * (-(v / fade).powi(2)).exp()) * sign(v),
        _ => f64::NAN,
    };
    let found: Vec<&servo::Estimate> =
        names.iter().map(|name| effect.parameters.get(*name)?.at(joint)).collect::<Option<_>>()?;
    let values: Vec<f64> = found.iter().map(|e| e.value).collect();
    let ends: Option<Vec<[f64; 2]>> = found.iter().map(|e| Some([e.ci95[0]?, e.ci95[1]?])).collect();
    // Rest is left out: friction has no one value there. Both signs of it stand next to each other.
    let half = (0..POINTS).map(|i| top * (i as f64 + 0.01) / POINTS as f64);
    let speeds: Vec<f64> = half.clone().rev().map(|v| -v).chain(half).collect();
    let band = ends.map_or_else(Vec::new, |ends| {
        speeds
            .iter()
            .map(|&v| {
                let at_corners = (0..1usize << ends.len()).map(|corner| {
                    let p: Vec<f64> = ends.iter().enumerate().map(|(i, e)| e[corner >> i & 1]).collect();
                    law(&p, v)
                });
                at_corners.fold([v, f64::INFINITY, f64::NEG_INFINITY], |[v, a, b], y| [v, a.min(y), b.max(y)])
            })
            .collect()
    });
    let unit = found.first().map_or("", |e| e.unit.as_str());
    let unit = if effect.kind == "viscous_friction" { unit.replacen("N m s/rad", "N m", 1) } else { unit.to_owned() };
    Some(EffectCurve {
        kind: effect.kind.clone(),
        joint: joint.to_owned(),
        x_label: "speed, rad/s".into(),
        unit: self::unit(&unit),
        data: vec![],
        law: speeds.iter().map(|&v| [v, law(&values, v)]).collect(),
        band,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stribeck(high: Option<f64>) -> servo::FoundEffect {
        let one = |value: f64, ci95| {
            let found = servo::Estimate { value, ci95, unit: "N m/(N m/rad)".into(), determined: true };
            servo::Parameter::PerJoint(BTreeMap::from([("a".to_owned(), found)]))
        };
        servo::FoundEffect {
            kind: "stribeck_friction".into(),
            joints: vec!["a".into()],
            part: "further".into(),
            confidence: 0.9,
            parameters: BTreeMap::from([
                ("coulomb".into(), one(1.0, [Some(0.9), high])),
                ("static".into(), one(2.0, [Some(1.8), Some(2.2)])),
                ("stribeck_velocity".into(), one(0.1, [Some(0.08), Some(0.12)])),
            ]),
            indistinguishable_from: vec![],
            shrink: servo::EffectShrink { position: None },
        }
    }

    #[test]
    fn the_band_holds_the_law_and_ends_where_the_intervals_do() {
        let [curve] = curves(&[stribeck(Some(1.1))], &BTreeMap::from([("a".into(), 1.0)])).try_into().unwrap();
        assert!(curve.law.iter().zip(&curve.band).all(|(l, b)| b[1] <= l[1] && l[1] <= b[2]));
        let [_, low, high] = *curve.band.last().unwrap();
        assert!((low - 0.9).abs() < 1e-6 && (high - 1.1).abs() < 1e-6);
        assert_eq!(curve.unit, "N m per N m/rad");
        // Where the logs do not bound a parameter, no band is drawn.
        assert!(curves(&[stribeck(None)], &BTreeMap::from([("a".into(), 1.0)]))[0].band.is_empty());
    }

    #[test]
    fn friction_of_a_joint_that_creeps_passes_zero_on_a_slope() {
        let at_rest = |effect: &servo::FoundEffect| {
            let [curve] =
                curves(std::slice::from_ref(effect), &BTreeMap::from([("a".into(), 1.0)])).try_into().unwrap();
            let nearest = curve.law.iter().min_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
            nearest.unwrap()[1].abs()
        };
        let mut effect = stribeck(Some(1.1));
        assert!(at_rest(&effect) > 1.9);
        let creep =
            servo::Estimate { value: 0.3, ci95: [Some(0.2), Some(0.4)], unit: "rad/s".into(), determined: true };
        let creep = servo::Parameter::PerJoint(BTreeMap::from([("a".to_owned(), creep)]));
        effect.parameters.insert("creep_velocity".into(), creep);
        assert!(at_rest(&effect) < 0.1);
    }

    #[test]
    fn open_ends_and_unknown_verdicts_are_told() {
        let found = servo::Estimate { value: 1.0, ci95: [Some(0.5), None], unit: "N m".into(), determined: false };
        assert_eq!(super::super::super::format::estimate(&estimate(&found)).interval, ["[0.50,\u{a0}open]"]);
        assert_eq!(verdict("no_gap"), Verdict::NoGap);
        assert_eq!(verdict("of_a_later_version"), Verdict::UnknownEffect);
    }
}
