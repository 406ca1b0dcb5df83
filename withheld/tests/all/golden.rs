//! Judgements and totals of a reference scorer written apart from this one, as `tests/withheld/agree.py` stored them.

use gapscope_withheld::{Answer, CaseScore, Score, Truth, judge};
use serde_json::{Value, json};

fn golden() -> Value {
    serde_json::from_str(include_str!("../../golden/judgements.json")).unwrap()
}

/// Numbers alike, whether JSON writes them as 1 or 1.0; parameters in any order.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.as_f64() == b.as_f64(),
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().all(|x| b.iter().any(|y| same(x, y))),
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(k, v)| b.get(k).is_some_and(|b| same(v, b)))
        }
        _ => a == b,
    }
}

#[test]
fn judgements_and_totals_are_those_of_the_reference() {
    let golden = golden();
    let mut scores = Vec::new();
    for case in golden["cases"].as_array().unwrap() {
        let truth: Truth = serde_json::from_value(case["truth"].clone()).unwrap();
        let answer: Option<Answer> = serde_json::from_value(case["diagnosis"].clone()).unwrap();
        let judgement = judge(&truth, answer.as_ref(), Some(&case["evaluation"]));
        let mut ours = serde_json::to_value(&judgement).unwrap();
        ours.as_object_mut().unwrap().remove("predicted_shrink");
        assert!(same(&ours, &case["judgement"]), "{}:\n{ours}\n{}", case["case"], case["judgement"]);
        let score = CaseScore::new(["sample", case["case"].as_str().unwrap()], &truth, judgement, 0.0, None);
        assert_eq!(serde_json::to_value(score.group).unwrap(), case["group"], "{}", case["case"]);
        scores.push(score);
    }
    assert_eq!(scores.len(), 30);
    let mut totals = serde_json::to_value(Score::new(scores).totals).unwrap();
    // Rows that the reference does not have.
    for row in ["none", "unknown"] {
        assert!(totals["confusion"].as_object_mut().unwrap().remove(row).is_some());
    }
    for (name, value) in golden["totals"].as_object().unwrap() {
        assert!(same(&totals[name], value), "{name}: {} against {value}", totals[name]);
    }
}

#[test]
fn the_truth_is_written_as_it_was_read() {
    for case in golden()["cases"].as_array().unwrap() {
        let truth: Truth = serde_json::from_value(case["truth"].clone()).unwrap();
        let written = serde_json::to_value(&truth).unwrap();
        assert!(same(&written, &case["truth"]), "{written}\n{}", case["truth"]);
    }
}

#[test]
fn a_case_without_a_gap_asks_for_no_claim() {
    let truth: Truth = serde_json::from_value(
        json!({"robot": "arm", "seed": 1, "noise": [0.0, 0.0, 0.0], "kinds": ["none"], "effects": [], "known": true}),
    )
    .unwrap();
    let judged = |verdict: &str, confidence: f64| {
        let effects = json!([{"kind": "armature", "confidence": confidence}]);
        let answer = serde_json::from_value(json!({"verdict": verdict, "effects": effects})).unwrap();
        judge(&truth, Some(&answer), None).exact
    };
    assert!(judged("no_gap", 0.4) && !judged("no_gap", 0.6) && !judged("explained", 0.4));
}
