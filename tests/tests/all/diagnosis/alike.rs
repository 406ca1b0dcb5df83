//! What must not change a diagnosis, and what must change it in step.

use super::*;

/// Parameters by kind, name and joint.
fn parameters(diagnosis: &Diagnosis) -> BTreeMap<(String, String, String), Vec<f64>> {
    let mut all = BTreeMap::new();
    for effect in &diagnosis.effects {
        for (name, parameter) in &effect.parameters {
            let mut put = |joint: &str, e: &Estimate| {
                all.insert((effect.kind.clone(), name.clone(), joint.to_owned()), numbers(&e.value))
            };
            match parameter {
                Parameter::Single(e) => drop(put("", e)),
                Parameter::PerJoint(map) => map.iter().for_each(|(joint, e)| drop(put(joint, e))),
            }
        }
    }
    all
}

/// Same effects, parameters and shrink within `tolerance`, relative.
#[track_caller]
fn assert_alike(a: &Diagnosis, b: &Diagnosis, tolerance: f64) {
    assert_eq!(a.verdict, b.verdict);
    assert_eq!(names(a), names(b), "{}\n{}", summary(a), summary(b));
    let (pa, pb) = (parameters(a), parameters(b));
    for (key, x) in &pa {
        for (x, y) in x.iter().zip(&pb[key]) {
            assert!((x - y).abs() <= tolerance * x.abs().max(y.abs()).max(0.1), "{key:?}: {x} and {y}");
        }
    }
    let (sa, sb) = (a.shrink.torque.shrink.unwrap(), b.shrink.torque.shrink.unwrap());
    assert!((sa - sb).abs() <= tolerance.max(1e-12), "shrink {sa} and {sb}");
}

/// The JSON with every joint's name replaced.
fn renamed_json(value: &Value, new: &dyn Fn(&str) -> String) -> Value {
    match value {
        Value::String(text) => Value::String(new(text)),
        Value::Array(list) => list.iter().map(|v| renamed_json(v, new)).collect(),
        Value::Object(object) => object.iter().map(|(k, v)| (new(k), renamed_json(v, new))).collect(),
        other => other.clone(),
    }
}

/// Equal up to rounding: dry friction is solved joint by joint in the order of their names.
fn close(x: Option<f64>, y: Option<f64>) -> bool {
    x.zip(y).is_some_and(|(x, y)| (x - y).abs() <= 1e-9 * x.abs().max(y.abs()))
}

/// Places where two JSON trees differ.
fn differences(a: &Value, b: &Value, at: &str, out: &mut Vec<String>) {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) if x.keys().eq(y.keys()) => {
            x.iter().for_each(|(key, x)| differences(x, &y[key], &format!("{at}/{key}"), out));
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            x.iter().zip(y).enumerate().for_each(|(i, (x, y))| differences(x, y, &format!("{at}/{i}"), out));
        }
        (Value::Number(x), Value::Number(y)) if close(x.as_f64(), y.as_f64()) => {}
        _ if a == b => {}
        _ => out.push(format!("{at}: {a} and {b}")),
    }
}

/// Other names, in the opposite order of the alphabet, and nothing else changes.
#[test]
fn joints_by_other_names_give_the_same_diagnosis() {
    let model = robot("arm6");
    let new = |name: &str| -> String {
        match name.strip_prefix("joint").and_then(|number| number.parse::<u32>().ok()) {
            Some(number) => format!("axis{}", 9 - number),
            None => name.to_owned(),
        }
    };
    let mut joints = model.joints().to_vec();
    joints.iter_mut().for_each(|j| j.name = new(&j.name));
    let renamed = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let episodes = logs(&model, &mixed());
    let mut other = episodes.clone();
    other.iter_mut().for_each(|e| e.joints.iter_mut().for_each(|j| *j = new(j)));
    let json = |outcome: &Outcome| serde_json::to_value(&outcome.diagnosis).unwrap();
    let (before, after) = (diagnose(&model, &episodes), diagnose(&renamed, &other));
    assert_alike(
        &before.diagnosis,
        &{
            // Back to the old names, to be compared key by key.
            let back = renamed_json(&json(&after), &|name| match name
                .strip_prefix("axis")
                .and_then(|n| n.parse::<u32>().ok())
            {
                Some(number) => format!("joint{}", 9 - number),
                None => name.to_owned(),
            });
            serde_json::from_value::<Diagnosis>(back).unwrap()
        },
        1e-9,
    );
    // Joints inside lists are sorted by name, so only those lists may differ in order.
    let sorted = |mut value: Value| {
        fn sort(value: &mut Value) {
            match value {
                Value::Array(list) => {
                    list.iter_mut().for_each(sort);
                    if list.iter().all(Value::is_string) {
                        list.sort_by_key(ToString::to_string);
                    }
                }
                Value::Object(object) => object.values_mut().for_each(sort),
                _ => {}
            }
        }
        sort(&mut value);
        value
    };
    let mut differing = Vec::new();
    differences(&sorted(renamed_json(&json(&before), &new)), &sorted(json(&after)), "", &mut differing);
    assert!(differing.is_empty(), "{}", differing.join("\n"));
}

/// Two double pendulums on one base, in either order.
#[test]
fn branches_in_another_order_give_the_same_diagnosis() {
    let pendulum = robot("double_pendulum");
    let pair = |order: [&str; 2]| {
        let joints = order.iter().enumerate().flat_map(|(i, side)| {
            pendulum.joints().iter().cloned().map(move |mut joint| {
                joint.name = format!("{side}_{}", joint.name);
                joint.link = format!("{side}_{}", joint.link);
                joint.parent = joint.parent.map(|p| p + 2 * i);
                if joint.parent.is_none() {
                    let at = glam::DVec3::X * if *side == "left" { -1.0 } else { 1.0 };
                    joint.placement = Placement { translation: joint.placement.translation + at, ..joint.placement };
                }
                joint
            })
        });
        Model::new("pair".into(), "base".into(), joints.collect()).unwrap()
    };
    let (forth, back) = (pair(["left", "right"]), pair(["right", "left"]));
    let truth = [viscous([("left_joint1", 0.1), ("right_joint2", 0.05)]), coulomb([("right_joint1", 0.15)])];
    let episodes = logs(&forth, &truth);
    let mut other = episodes.clone();
    for episode in &mut other {
        let swap = |rows: &mut Vec<Vec<f64>>| rows.rotate_left(2);
        swap(&mut episode.position);
        swap(&mut episode.effort);
        episode.command.as_mut().map(swap);
        episode.joints.rotate_left(2);
    }
    let (a, b) = (diagnose(&forth, &episodes), diagnose(&back, &other));
    assert_finds(&a, &truth);
    assert_alike(&a.diagnosis, &b.diagnosis, 1e-6);
}

#[test]
fn another_origin_of_time_gives_the_same_diagnosis() {
    let model = robot("arm6");
    let episodes = logs(&model, &mixed());
    let first = diagnose(&model, &episodes);
    for (origin, tolerance) in [(-3.0, 1e-6), (1e4, 1e-5), (1.7e9, 2e-3)] {
        let mut other = episodes.clone();
        other.iter_mut().for_each(|e| e.time.iter_mut().for_each(|t| *t += origin));
        assert_alike(&first.diagnosis, &diagnose(&model, &other).diagnosis, tolerance);
    }
}

#[test]
fn a_log_in_two_parts_gives_nearly_the_same_diagnosis() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0), ("joint3", 5.0)]), bias([("joint4", 2.0)])];
    let whole = simulate(&model, &truth, 5, 16.0, RATE, NOISE);
    let middle = whole.len() / 2;
    let parts = [whole.part(0, middle, "first"), whole.part(middle, whole.len(), "second")];
    assert_alike(&diagnose(&model, &[whole]).diagnosis, &diagnose(&model, &parts).diagnosis, 0.02);
}

#[test]
fn the_order_of_the_logs_hardly_matters() {
    let model = robot("arm6");
    let mut episodes = logs(&model, &mixed());
    let first = diagnose(&model, &episodes);
    episodes.rotate_left(1);
    assert_alike(&first.diagnosis, &diagnose(&model, &episodes).diagnosis, 0.01);
}

/// A robot twice as heavy under twice the effort moves the same: effects are twice as large, the shrink is the same.
#[test]
fn all_efforts_and_inertias_scaled_scale_the_effects() {
    const FACTOR: f64 = 4.0;
    let model = robot("arm6");
    let mut heavy = model.clone();
    for j in 0..6 {
        let scaled = heavy.joints()[j].inertia.parameters().map(|p| FACTOR * p);
        heavy = heavy.with_inertia(j, gapscope_dynamics::Inertia::from_parameters(&scaled));
    }
    let truth = [viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0)]), bias([("joint4", 2.0)])];
    let episodes = logs(&model, &truth);
    let mut other = episodes.clone();
    other.iter_mut().for_each(|e| e.effort.iter_mut().flatten().for_each(|x| *x *= FACTOR));
    let (light, heavy) = (diagnose(&model, &episodes).diagnosis, diagnose(&heavy, &other).diagnosis);
    assert_eq!(names(&light), names(&heavy));
    let (a, b) = (parameters(&light), parameters(&heavy));
    for (key, x) in &a {
        assert!((FACTOR * x[0] - b[key][0]).abs() < 1e-9 * b[key][0].abs(), "{key:?}: {x:?} and {:?}", b[key]);
    }
    let (x, y) = (light.shrink.torque.shrink.unwrap(), heavy.shrink.torque.shrink.unwrap());
    assert!((x - y).abs() < 1e-9, "shrink {x} and {y}");
    for (joint, rms) in &light.gap.torque.rms {
        assert!((FACTOR * rms - heavy.gap.torque.rms[joint]).abs() < 1e-9 * FACTOR * rms);
    }
}

/// A joint counted the other way round: position, effort and bias change their sign, friction does not.
#[test]
fn a_joint_counted_the_other_way_round_gives_the_same_diagnosis() {
    let model = robot("arm6");
    let mut joints = model.joints().to_vec();
    joints[2].axis = -joints[2].axis;
    let turned = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let truth = [viscous([("joint3", 6.0)]), bias([("joint3", 3.0)])];
    let episodes = logs(&model, &truth);
    let mut other = episodes.clone();
    for episode in &mut other {
        episode.position[2].iter_mut().chain(&mut episode.effort[2]).for_each(|x| *x = -*x);
    }
    let (a, b) = (diagnose(&model, &episodes), diagnose(&turned, &other));
    assert_finds(&a, &truth);
    assert_finds(&b, &[viscous([("joint3", 6.0)]), bias([("joint3", -3.0)])]);
    let at = |d: &Diagnosis, kind: &str, name: &str| parameters(d)[&(kind.into(), name.into(), "joint3".into())][0];
    let viscous = [&a, &b].map(|o| at(&o.diagnosis, "viscous_friction", "viscous"));
    let bias = [&a, &b].map(|o| at(&o.diagnosis, "torque_bias", "bias"));
    assert!((viscous[0] - viscous[1]).abs() < 1e-6 && (bias[0] + bias[1]).abs() < 1e-6, "{viscous:?} {bias:?}");
}

/// More noise: the same names, wider intervals.
#[test]
fn more_noise_widens_the_intervals() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0)])];
    let width = |noise: f64| {
        let episodes: Vec<Episode> = (1..4).map(|seed| simulate(&model, &truth, seed, 8.0, RATE, noise)).collect();
        let diagnosis = diagnose(&model, &episodes).diagnosis;
        assert!(
            names(&diagnosis).contains(&("viscous_friction".into(), vec!["joint2".into()])),
            "{}",
            summary(&diagnosis)
        );
        let effect = diagnosis.effects.iter().find(|e| e.kind == "viscous_friction").unwrap();
        let e = estimate(effect, "viscous", Some(&"joint2".to_owned()));
        numbers(&e.ci95[1])[0] - numbers(&e.ci95[0])[0]
    };
    let (quiet, noisy) = (width(1e-6), width(3e-4));
    assert!(noisy > 1.5 * quiet, "widths {quiet} and {noisy}");
}

// The same bytes.

#[test]
fn the_same_logs_give_the_same_bytes() {
    let model = robot("arm7");
    let effects = [viscous([("joint2", 8.0)]), coulomb([("joint4", 4.0)])];
    let episodes = logs(&model, &effects);
    let bytes = || {
        let outcome = diagnose(&model, &episodes);
        (serde_json::to_string(&outcome.diagnosis).unwrap(), outcome.corrected.to_json().unwrap(), outcome.evidence)
    };
    let first = bytes();
    assert!(first == bytes(), "a second run");
    // However many cores there are.
    for threads in [1, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(first == pool.install(bytes), "{threads} threads");
    }
}

// Other logs.
