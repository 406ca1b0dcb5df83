//! Parts that the made-up diagnoses are built of.

use gapscope_diagnosis::schema::*;

/// A wave without pattern, the same every time.
pub fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43758.5453;
    2.0 * (x - x.floor()) - 1.0
}

pub fn joints() -> Vec<String> {
    (1..=7).map(|i| format!("panda_joint{i}")).collect()
}

pub fn per_joint(names: &[String], values: &[f64]) -> PerJoint {
    names.iter().cloned().zip(values.iter().copied()).collect()
}

pub fn scalar(value: f64, half: f64, unit: &str) -> Estimate {
    Estimate {
        value: Quantity::Scalar(value),
        ci95: [Quantity::Scalar(value - half), Quantity::Scalar(value + half)],
        unit: unit.into(),
    }
}

pub fn vector(values: &[f64], half: f64, unit: &str) -> Estimate {
    let shift = |by: f64| Quantity::Vector(values.iter().map(|v| v + by).collect());
    Estimate { value: shift(0.0), ci95: [shift(-half), shift(half)], unit: unit.into() }
}

pub fn each(names: &[String], values: &[f64], half: f64, unit: &str) -> Parameter {
    Parameter::PerJoint(names.iter().cloned().zip(values.iter().map(|&v| scalar(v, half, unit))).collect())
}

pub fn found(
    kind: &str,
    joints: &[String],
    confidence: f64,
    shrink: f64,
    parameters: &[(&str, Parameter)],
) -> FoundEffect {
    FoundEffect {
        kind: kind.into(),
        joints: joints.to_vec(),
        part: Part::default(),
        confidence,
        parameters: parameters.iter().map(|(name, p)| ((*name).to_string(), p.clone())).collect(),
        indistinguishable_from: vec![],
        shrink: EffectShrink { torque: Some(shrink), ci95: Some([shrink - 0.02, shrink + 0.02]) },
    }
}

pub fn gap(names: &[String], rms: &[f64], regimes: Vec<Regime>) -> Gap {
    let scaled = |by: f64| per_joint(names, &rms.iter().map(|v| v * by).collect::<Vec<_>>());
    Gap {
        torque: TorqueGap {
            rms: scaled(1.0),
            floor: per_joint(names, &[0.048, 0.052, 0.041, 0.039, 0.012, 0.0114, 0.0087]),
            ci95: names.iter().cloned().zip(rms.iter().map(|v| [0.9 * v, 1.12 * v])).collect(),
        },
        one_step: StateGap { position: scaled(3.1e-5), velocity: scaled(0.0123456) },
        rollout: [0.1, 0.2, 0.5, 1.0, 2.0]
            .iter()
            .map(|&horizon: &f64| RolloutGap { horizon, position: scaled(0.012 * horizon.powf(1.6)) })
            .collect(),
        regimes,
    }
}

pub fn regime(
    joint: &str,
    name: &str,
    quantity: &str,
    unit: &str,
    interval: [Option<f64>; 2],
    share: f64,
    samples: f64,
) -> Regime {
    let ci95 = [(share - 0.04).max(0.0), (share + 0.04).min(1.0)];
    let bounds = Bounds { quantity: quantity.into(), unit: unit.into(), interval };
    Regime { joint: joint.into(), regime: name.into(), bounds, share, ci95, samples }
}

pub fn regimes(names: &[String]) -> Vec<Regime> {
    let mut list = vec![];
    for (i, joint) in names.iter().enumerate() {
        let w = 0.5 + 0.5 * noise(i + 3);
        let edge = 0.6 + 0.1 * i as f64;
        list.extend([
            regime(joint, "standstill", "speed", "rad/s", [None, Some(0.01)], 0.02 + 0.03 * w, 0.04),
            regime(
                joint,
                "reversal",
                "speed",
                "rad/s",
                [Some(0.0), Some(0.05)],
                if i == 1 { 0.62 } else { 0.08 + 0.3 * w },
                0.08,
            ),
            regime(joint, "low_speed", "speed", "rad/s", [Some(0.05), Some(0.2)], 0.21 * w, 0.22),
            regime(joint, "high_speed", "speed", "rad/s", [Some(edge), None], 0.18 + 0.1 * w, 0.25),
            regime(joint, "high_load", "load", "N m", [Some(20.0 - i as f64), None], 0.3 * w, 0.2),
            regime(joint, "high_acceleration", "acceleration", "rad/s²", [Some(2.5), None], 0.25 * w, 0.2),
        ]);
        for k in 0..3 {
            let from = -1.2 + 0.8 * k as f64 + 0.1 * i as f64;
            list.push(regime(
                joint,
                "pose",
                "position",
                "rad",
                [Some(from), Some(from + 0.8)],
                0.2 + 0.13 * k as f64,
                1.0 / 3.0,
            ));
        }
        for (from, to) in [(0.0, 1.0), (1.0, 5.0), (5.0, 15.0)] {
            list.push(regime(
                joint,
                "frequency_band",
                "frequency",
                "Hz",
                [Some(from), Some(to)],
                0.7 / (1.0 + from),
                1.0 / 3.0,
            ));
        }
        for k in 0..2 {
            let from = 20.0 * k as f64;
            list.push(regime(joint, "time", "time", "s", [Some(from), Some(from + 20.0)], 0.5, 0.5));
        }
    }
    list
}

pub fn change(before: f64, after: f64) -> Change {
    let shrink = 1.0 - after / before;
    Change {
        before: Some(before),
        after: Some(after),
        shrink: Some(shrink),
        ci95: Some([shrink - 0.012, shrink + 0.009]),
    }
}

pub fn shrink(before: f64, after: f64) -> Shrink {
    Shrink {
        torque: change(before, after),
        one_step: change(0.0312 * before, 0.0312 * (after + 0.01)),
        rollout: [0.1, 0.2, 0.5, 1.0, 2.0]
            .iter()
            .map(|&horizon: &f64| HorizonChange {
                horizon,
                change: change(
                    0.04 * before * horizon.powf(1.6),
                    0.04 * (after + 0.03 * before * horizon) * horizon.powf(1.3),
                ),
            })
            .collect(),
        reference: Reference { noise_floor: 0.0121, residual_network: Some(0.0291), pure_network: Some(0.0834) },
    }
}

/// Torque of the joints over four episodes of ten seconds.
pub fn torque(names: &[String], unit: &str, samples: usize) -> Vec<Series> {
    let series = |(j, joint): (usize, &String)| {
        let time: Vec<f64> = (0..samples).map(|i| 40.0 * i as f64 / samples as f64).collect();
        let size = 30.0 / (1.0 + j as f64);
        let corrected: Vec<f64> = time
            .iter()
            .map(|t| {
                let speed = (0.9 * t + j as f64).cos();
                size * (0.5 * t + 0.3 * j as f64).sin() + 0.2 * size * (2.3 * t).sin() + 0.06 * size * speed.signum()
            })
            .collect();
        let nominal = time
            .iter()
            .zip(&corrected)
            .map(|(t, v)| v - 0.06 * size * (0.9 * t + j as f64).cos().signum() - 0.03 * size)
            .collect();
        let measured = corrected.iter().enumerate().map(|(i, v)| v + 0.006 * size * noise(i)).collect();
        Series {
            joint: joint.clone(),
            unit: unit.into(),
            time,
            measured,
            nominal,
            corrected,
            breaks: vec![samples / 4, samples / 2, 3 * samples / 4],
        }
    };
    names.iter().enumerate().map(series).collect()
}

pub fn curve(kind: &str, joint: &str, x_label: &str, law: impl Fn(f64) -> f64, spread: f64) -> EffectCurve {
    let x = |i: usize, n: usize| -1.8 + 3.6 * i as f64 / (n - 1) as f64;
    EffectCurve {
        kind: kind.into(),
        joint: joint.into(),
        x_label: x_label.into(),
        unit: "N m".into(),
        data: (0..2000)
            .map(|i| (i, 1.8 * (0.37 * i as f64).sin() * noise(7 * i).abs()))
            .map(|(i, h)| [h, law(h) + spread * noise(3 * i + 1) * noise(5 * i)])
            .collect(),
        law: (0..201).map(|i| [x(i, 201), law(x(i, 201))]).collect(),
        band: vec![],
    }
}
