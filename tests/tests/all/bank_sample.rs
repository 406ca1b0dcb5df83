//! Withheld cases of the sample bank, against their sealed truth. Read from `GAPSCOPE_BANK`, by default `../shared/bank`.
//!
//! The bank was simulated by other physics than this project's. Only cases that this version can name are judged: one
//! effect of its catalogue, or none.

use gapscope_diagnosis::schema::Verdict;
use gapscope_effects::Kind;
use gapscope_tests::{diagnose, folder, read_set};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// Signature over noise below which nobody can tell an effect at a joint (`score.py` of the bank).
const DETECTABLE: f64 = 5.0;

/// What is sealed: the kind of the only effect, or none, with the joints that must and those that may be named.
struct Truth {
    kind: Option<String>,
    needed: BTreeSet<String>,
    allowed: BTreeSet<String>,
}

/// The truth of a case; `None` where it is not for this version: two effects, one it does not know, or one below noise.
fn truth(sealed: &Path) -> Option<Truth> {
    let text = std::fs::read_to_string(sealed.join("truth.json")).unwrap();
    let truth: Value = serde_json::from_str(&text).unwrap();
    let effects = truth["effects"].as_array().unwrap();
    if effects.is_empty() {
        return Some(Truth { kind: None, needed: BTreeSet::new(), allowed: BTreeSet::new() });
    }
    let [effect] = effects.as_slice() else { return None };
    let kind = effect["kind"].as_str().unwrap();
    let is_linear = |kind: Kind| kind.card().weighs && !kind.card().is_late() && !kind.card().of_its_log();
    if !Kind::named(kind).is_some_and(is_linear) {
        return None;
    }
    let names: Vec<String> =
        effect["joint_names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect();
    let power: Vec<f64> = effect["power"].as_array().unwrap().iter().map(|p| p.as_f64().unwrap()).collect();
    if power.iter().all(|p| *p < DETECTABLE) {
        return None;
    }
    let index = |i: usize| effect["joints"][i].as_u64().unwrap() as usize;
    let needed = names.iter().enumerate().filter(|(i, _)| power[index(*i)] >= DETECTABLE).map(|(_, n)| n.clone());
    // The base and the flange stand for all joints.
    let robot_wide = [Kind::GravityMisalignment, Kind::Payload].iter().any(|k| k.name() == kind);
    let needed = if robot_wide { BTreeSet::new() } else { needed.collect() };
    Some(Truth { kind: Some(kind.to_owned()), needed, allowed: names.into_iter().collect() })
}

#[test]
fn cases_of_one_known_effect_or_none_are_named_exactly() {
    let Some(bank) = folder("GAPSCOPE_BANK", "../shared/bank") else { return };
    let mut cases: Vec<_> = std::fs::read_dir(bank.join("sample")).unwrap().map(|e| e.unwrap().path()).collect();
    cases.sort();
    // Every third: `gapscope withheld score` judges them all.
    let cases = cases.into_iter().step_by(3);
    let (mut judged, mut wrong) = (0, Vec::new());
    for case in cases {
        let name = case.file_name().unwrap().to_string_lossy().into_owned();
        let Some(truth) = truth(&bank.join("sample.sealed").join(&name)) else { continue };
        let (model, episodes) = read_set(&case, "episode_");
        let diagnosis = diagnose(&model, &episodes).diagnosis;
        judged += 1;
        let found: Vec<(&str, &[String])> =
            diagnosis.effects.iter().map(|e| (e.kind.as_str(), e.joints.as_slice())).collect();
        let right = match (&truth.kind, found.as_slice()) {
            (None, []) => diagnosis.verdict == Verdict::NoGap,
            (Some(kind), [(found, joints)]) => {
                let joints: BTreeSet<String> = joints.iter().cloned().collect();
                found == kind
                    && truth.needed.is_subset(&joints)
                    && joints.is_subset(&truth.allowed)
                    && diagnosis.verdict == Verdict::Explained
            }
            _ => false,
        };
        if !right {
            let expected = (truth.kind.as_deref().unwrap_or("none"), &truth.needed);
            wrong.push(format!("{name}: {expected:?}, but found {found:?}, {:?}", diagnosis.verdict));
        }
    }
    assert!(judged >= 4, "only {judged} cases could be judged");
    assert!(wrong.is_empty(), "{} of {judged} cases are wrong:\n{}", wrong.len(), wrong.join("\n"));
}
