//! Figures that a fresh log confirms.

use super::*;

#[test]
fn a_fresh_log_shrinks_as_the_diagnosis_says() {
    let model = robot("arm6");
    let outcome = found(&model, &with_payload());
    let read = Corrected::from_json(&outcome.corrected.to_json().unwrap(), &model).unwrap();
    let fresh = [simulate(&model, &with_payload(), 77, 8.0, RATE, NOISE)];
    let (evaluation, predictions) = evaluate(&model, &fresh, Some(&read)).unwrap();
    assert_eq!(evaluation.schema, "gapscope.evaluation/1");
    let (own, other) = (&outcome.diagnosis.shrink, evaluation.shrink.as_ref().unwrap());
    let (a, b) = (own.torque.shrink.unwrap(), other.torque.shrink.unwrap());
    assert!((a - b).abs() < 0.03 && b > 0.9, "torque shrinks by {a}, on a fresh log by {b}");
    let (a, b) = (own.one_step.shrink.unwrap(), other.one_step.shrink.unwrap());
    assert!((a - b).abs() < 0.1, "one step shrinks by {a}, on a fresh log by {b}");
    assert!(other.rollout.len() >= 4);
    for (a, b) in own.rollout.iter().zip(&other.rollout) {
        assert_eq!(a.horizon, b.horizon);
        assert!(a.change.shrink.unwrap() > 0.5 && b.change.shrink.unwrap() > 0.5, "{a:?} {b:?}");
    }
    // The figures can be had from the predictions: weighted rms over joints, w from corrected.json.
    let rms = |of: &dyn Fn(&gapscope_diagnosis::Predictions) -> &Vec<Vec<f64>>| -> f64 {
        let joints = model.joints().iter().enumerate().map(|(j, joint)| {
            let errors = || predictions.iter().flat_map(|p| p.measured[j].iter().zip(&of(p)[j]).map(|(m, x)| m - x));
            read.weights[&joint.name].powi(2) * errors().map(|e| e * e).sum::<f64>() / errors().count() as f64
        });
        (joints.sum::<f64>() / model.dof() as f64).sqrt()
    };
    let change = serde_json::to_value(&other.torque).unwrap();
    let (before, after) = (change["before"].as_f64().unwrap(), change["after"].as_f64().unwrap());
    assert!((rms(&|p| &p.nominal) / before - 1.0).abs() < 1e-9, "{} and {before}", rms(&|p| &p.nominal));
    assert!((rms(&|p| &p.corrected) / after - 1.0).abs() < 1e-9, "{} and {after}", rms(&|p| &p.corrected));
}

/// The fresh log is as long as each log of the diagnosis: it has the same horizons.
#[test]
fn a_fresh_log_has_the_horizons_of_the_diagnosis() {
    let model = robot("arm6");
    let outcome = found(&model, &mixed());
    let fresh = [simulate(&model, &mixed(), 77, 8.0, RATE, NOISE)];
    let (evaluation, _) = evaluate(&model, &fresh, Some(&outcome.corrected)).unwrap();
    let horizons = |gap: &gapscope_diagnosis::schema::Gap| gap.rollout.iter().map(|r| r.horizon).collect::<Vec<_>>();
    assert_eq!(horizons(&evaluation.gap), horizons(&outcome.diagnosis.gap));
}

#[test]
fn without_a_corrected_model_there_is_a_gap_and_no_shrink() {
    let model = robot("arm6");
    let fresh = [simulate(&model, &mixed(), 78, 8.0, RATE, NOISE), simulate(&model, &mixed(), 79, 8.0, RATE, NOISE)];
    let (evaluation, _) = evaluate(&model, &fresh, None).unwrap();
    let json = serde_json::to_value(&evaluation).unwrap();
    assert!(json["shrink"].is_null());
    assert_eq!(keys(&json), ["gap", "logs", "schema", "shrink"]);
    assert_eq!(json["logs"].as_array().unwrap().len(), 2);
    assert!(evaluation.gap.torque.rms["joint2"] > 1.0);
}

// The public JSON.

#[test]
fn what_predicts_held_out_data_worse_is_in_neither_answer_nor_corrected_model() {
    let model = robot("arm6");
    let mut outcome = found(&model, &with_payload());
    assert!(!outcome.corrected.effects.is_empty() && !outcome.diagnosis.combinations.is_empty());
    outcome.diagnosis.shrink.torque.ci95 = Some([-0.5, -0.1]);
    outcome.within_physics(&model);
    let diagnosis = &outcome.diagnosis;
    assert!(diagnosis.effects.is_empty() && outcome.corrected.effects.is_empty());
    assert!(diagnosis.combinations.is_empty() && diagnosis.covariance.is_none());
    assert_eq!(diagnosis.verdict, Verdict::UnknownEffect);
    let changes = diagnosis.shrink.rollout.iter().map(|at| &at.change);
    for change in changes.chain([&diagnosis.shrink.torque, &diagnosis.shrink.one_step]) {
        assert_eq!((change.after, change.ci95), (change.before, None));
    }
}
