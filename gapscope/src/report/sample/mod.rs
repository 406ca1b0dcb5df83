//! Made-up diagnoses for the tests and for looking at the page: none comes from a robot.

mod large;
mod parts;

use gapscope_diagnosis::schema::*;
use parts::*;
use std::collections::BTreeMap;

pub use large::large;

type Case = (&'static str, Diagnosis, Evidence);

/// One case for every verdict and a robot with a single prismatic joint.
pub fn all() -> Vec<Case> {
    vec![explained(), partly(), unknown(), no_gap(), not_excited(), prismatic()]
}

/// Seven joints, three effects that explain the gap.
pub fn explained() -> Case {
    let names = joints();
    let coulomb = [0.81, 1.51, 0.623, 0.58, 0.42, 0.31, 0.24];
    let viscous = [0.51, 0.72, 0.33, 0.35, 0.12, 0.094, 0.071];
    let coulomb_effect =
        found("coulomb_friction", &names, 0.984, 0.71, &[("coulomb", each(&names, &coulomb, 0.041, "N m"))]);
    let payload = found(
        "payload",
        &names[6..],
        0.97,
        0.22,
        &[
            ("mass", Parameter::Single(scalar(1.2134, 0.06, "kg"))),
            ("com", Parameter::Single(vector(&[0.0123, -0.0041, 0.0987], 0.004, "m"))),
            ("inertia", Parameter::Single(vector(&[0.0021, 0.0001, 0.0019, -0.00003, 0.0, 0.0008], 0.0006, "kg m²"))),
        ],
    );
    let mut payload = payload;
    payload.indistinguishable_from = vec!["link_inertia_error".into(), "torque_gain_error".into()];
    let delay = found("actuation_delay", &[], 0.81, 0.04, &[("delay", Parameter::Single(scalar(0.0042, 0.0003, "s")))]);
    let viscous_effect = found(
        "viscous_friction",
        &names[1..4],
        0.93,
        0.11,
        &[("viscous", each(&names[1..4], &viscous[1..4], 0.03, "N m s/rad"))],
    );
    let mut curves = vec![];
    for (j, joint) in names.iter().enumerate() {
        let f = coulomb[j];
        curves.push(curve("coulomb_friction", joint, "speed, rad/s", move |v| -f * (v / 0.02).tanh(), 0.3 * f));
    }
    for (j, joint) in names.iter().enumerate() {
        let m = 7.0 - j as f64;
        curves.push(curve("payload", joint, "gravity torque of the payload, N m", move |v| m * v, 0.4 * m));
    }
    for (j, joint) in names[1..4].iter().enumerate() {
        let b = viscous[j + 1];
        curves.push(curve("viscous_friction", joint, "speed, rad/s", move |v| -b * v, 0.3 * b));
    }
    let rms = [0.91, 1.23456, 0.72, 0.81, 0.31, 0.22, 0.151];
    let diagnosis = Diagnosis {
        schema: DIAGNOSIS_SCHEMA.into(),
        robot: "panda".into(),
        joints: names.clone(),
        data: DataSummary {
            episodes: 4,
            samples: 20000,
            duration: 40.0,
            rate: 500.0,
            band: 15.0,
            faults: vec![],
            doubts: vec![],
            findings: vec![
                "velocity.panda_joint3 is missing: derived from position".into(),
                "URDF: link panda_hand has no inertial; taken as massless, and this is a long remark that runs over the width of a terminal".into(),
                "run_02.csv: gap of 0.12 s at t = 7.31 s; the episode is split there".into(),
                "effort looks like motor current times a constant: no torque sensor on the link side".into(),
            ],
        },
        covariance: None,
        verdict: Verdict::Explained,
        gap: gap(&names, &rms, regimes(&names)),
        effects: vec![coulomb_effect, payload, viscous_effect, delay],
        combinations: vec![Combination {
            words: "mass of panda_link7 and all it carries".into(),
            terms: [("mass_delta.panda_joint7".to_owned(), 1.0)].into(),
            value: 0.76,
            ci95: [0.72, 0.80],
            unit: "kg".into(),
        }],
        alternatives: vec![
            Alternative { effects: vec!["stribeck_friction".into(), "payload".into()], probability: 0.11 },
            Alternative { effects: vec!["coulomb_friction".into(), "link_inertia_error".into()], probability: 0.02 },
        ],
        why: Vec::new(),
        unexplained: Unexplained {
            fraction: 0.031,
            learnable: 0.04,
            resembles: None,
            regimes: vec![regime(&names[3], "reversal", "speed", "rad/s", [Some(0.0), Some(0.05)], 0.41, 0.08)],
        },
        shrink: shrink(0.2134, 0.0151),
        next_experiment: Some(NextExperiment {
            why: "A payload and an error of the last link's inertia pull alike while the wrist keeps its direction.".into(),
            separates: vec!["payload".into(), "link_inertia_error".into()],
            motion: "follow next_experiment.csv (look for collisions first): moves between postures with pauses of panda_joint5, panda_joint7 alone, 20 s. payload and link_inertia_error would then lie 34 standard errors apart".into(),
            trajectory: Some("next_experiment.csv".into()),
            separation: Some(34.2),
        }),
        power: power(&names),
    };
    let evidence = Evidence {
        torque: torque(&names, "N m", 6000),
        curves,
        remaining: Some(gap(&names, &[0.071, 0.092, 0.068, 0.091, 0.031, 0.019, 0.0124], vec![])),
        robot_file: "panda.urdf".into(),
        logs: vec!["run_01.csv".into(), "run 02.csv".into()],
        corrected_file: "run_01.gapscope/corrected.json".into(),
    };
    ("explained", diagnosis, evidence)
}

/// Least sizes of some effects, one of a kind that the logs show no size of.
fn power(names: &[String]) -> Vec<Power> {
    let one = |kind: &str, joints: &[String], parameter: &str, size: f64, unit: &str| Power {
        kind: kind.into(),
        joints: joints.to_vec(),
        parameter: parameter.into(),
        size: size.is_finite().then_some(size),
        unit: unit.into(),
    };
    let mut all = vec![];
    for (j, name) in names.iter().enumerate() {
        let (here, part) = (std::slice::from_ref(name), 1.0 / (1.0 + j as f64));
        all.push(one("coulomb_friction", here, "coulomb", 0.043 * part, "N m"));
        all.push(one("viscous_friction", here, "viscous", 0.031 * part, "N m s/rad"));
        all.push(one("joint_zero_offset", here, "offset", if j == 0 { f64::INFINITY } else { 0.0021 }, "rad"));
        all.push(one("joint_elasticity", here, "stiffness", 21000.0 * part, "N m/rad"));
    }
    all.push(one("payload", &names[names.len() - 1..], "mass", 0.0123, "kg"));
    all.push(one("gravity_misalignment", &[], "roll", 0.00081, "rad"));
    all.push(one("gravity_misalignment", &[], "pitch", 0.00094, "rad"));
    all
}

/// Part of the gap is left.
pub fn partly() -> Case {
    let (_, mut diagnosis, mut evidence) = explained();
    diagnosis.verdict = Verdict::PartlyExplained;
    diagnosis.effects.truncate(1);
    evidence.curves.retain(|c| c.kind == "coulomb_friction");
    diagnosis.shrink = shrink(0.2134, 0.0951);
    let names = joints();
    let law = |law: &str, joints: &[String]| Lookalike { law: law.into(), joints: joints.to_vec() };
    let laws = vec![law("link_drag", &names[6..]), law("rub", &names[1..4])];
    let resembles = Some(Resemblance { laws, share: 0.87 });
    diagnosis.unexplained = Unexplained { fraction: 0.284, learnable: 0.62, resembles, regimes: regimes(&names) };
    diagnosis.alternatives.clear();
    diagnosis.combinations.clear();
    ("partly", diagnosis, evidence)
}

/// A gap that nothing explains.
pub fn unknown() -> Case {
    let (_, mut diagnosis, mut evidence) = partly();
    diagnosis.verdict = Verdict::UnknownEffect;
    diagnosis.effects.clear();
    diagnosis.shrink = shrink(0.2134, 0.2134);
    diagnosis.unexplained.fraction = 1.0;
    diagnosis.next_experiment = None;
    evidence.curves.clear();
    evidence.remaining = None;
    for series in &mut evidence.torque {
        series.corrected.clear();
    }
    ("unknown", diagnosis, evidence)
}

/// Model and robot agree; names that a page must escape.
pub fn no_gap() -> Case {
    let (_, mut diagnosis, mut evidence) = unknown();
    diagnosis.verdict = Verdict::NoGap;
    diagnosis.robot = "arm <b>&amp; \"co\"</b>".into();
    diagnosis.joints[0] = "<script>alert(1)</script>".into();
    let names = diagnosis.joints.clone();
    diagnosis.gap = gap(&names, &[0.048, 0.052, 0.041, 0.039, 0.012, 0.0114, 0.0087], vec![]);
    evidence.torque = torque(&names, "N m", 400);
    let at_floor = Change { before: Some(0.0122), after: Some(0.0122), shrink: None, ci95: None };
    diagnosis.shrink.torque = at_floor.clone();
    for h in &mut diagnosis.shrink.rollout {
        h.change = at_floor.clone();
    }
    diagnosis.unexplained = Unexplained { fraction: 0.0, learnable: 0.0, resembles: None, regimes: vec![] };
    diagnosis.data.findings.clear();
    ("no_gap", diagnosis, evidence)
}

/// Nothing moved: every list that can be empty is.
pub fn not_excited() -> Case {
    let (_, mut diagnosis, _) = no_gap();
    let nothing = Change { before: Some(0.0), after: Some(0.0), shrink: None, ci95: None };
    diagnosis.verdict = Verdict::NotExcited;
    diagnosis.robot = "ur5e".into();
    diagnosis.joints = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"].map(String::from).to_vec();
    let empty = || StateGap { position: BTreeMap::new(), velocity: BTreeMap::new() };
    diagnosis.gap = Gap {
        torque: TorqueGap { rms: BTreeMap::new(), floor: BTreeMap::new(), ci95: BTreeMap::new() },
        one_step: empty(),
        rollout: vec![],
        regimes: vec![],
    };
    diagnosis.shrink = Shrink {
        torque: nothing.clone(),
        one_step: nothing,
        rollout: vec![],
        reference: Reference { noise_floor: 0.0, residual_network: None, pure_network: None },
    };
    diagnosis.data.findings = vec!["no joint moves by more than 0.01 rad".into()];
    diagnosis.next_experiment = Some(NextExperiment {
        why: "The logs hold no motion to learn from.".into(),
        separates: vec![],
        motion: "Move every joint through at least 0.5 rad at several speeds, with reversals, for 20 s.".into(),
        trajectory: None,
        separation: None,
    });
    diagnosis.power.clear();
    ("not_excited", diagnosis, Evidence::default())
}

/// One prismatic joint, figures in N and m.
pub fn prismatic() -> Case {
    let (_, mut diagnosis, _) = explained();
    let names = vec!["slide".to_string()];
    diagnosis.robot = "emps".into();
    diagnosis.joints = names.clone();
    diagnosis.gap = gap(&names, &[20.3], regimes(&names));
    for regime in &mut diagnosis.gap.regimes {
        regime.bounds.unit = regime.bounds.unit.replace("N m", "N").replace("rad", "m");
    }
    diagnosis.gap.torque.floor = per_joint(&names, &[1.7]);
    diagnosis.gap.rollout.truncate(1);
    diagnosis.shrink.rollout.truncate(1);
    let map: BTreeMap<String, Estimate> = [("slide".to_string(), scalar(20.1, 0.4, "N"))].into();
    diagnosis.effects = vec![found("coulomb_friction", &names, 0.999, 0.9, &[("coulomb", Parameter::PerJoint(map))])];
    diagnosis.unexplained = Unexplained { fraction: 0.0, learnable: 0.0, resembles: None, regimes: vec![] };
    diagnosis.alternatives.clear();
    diagnosis.combinations.clear();
    diagnosis.next_experiment = None;
    diagnosis.power = power(&names)[..1].to_vec();
    diagnosis.power[0].unit = "N".into();
    let mut evidence = Evidence { torque: torque(&names, "N", 3000), ..Evidence::default() };
    let mut law = curve("coulomb_friction", "slide", "speed, m/s", |v| -20.0 * v.signum(), 4.0);
    law.unit = "N".into();
    evidence.curves = vec![law];
    ("prismatic", diagnosis, evidence)
}

/// An evaluation on three logs.
pub fn evaluation(corrected: bool) -> Evaluation {
    let (_, diagnosis, _) = explained();
    let log = |name: &str| LogEvaluation {
        log: name.into(),
        torque: diagnosis.gap.torque.clone(),
        shrink: corrected.then(|| change(0.21, 0.016)),
    };
    Evaluation {
        schema: EVALUATION_SCHEMA.into(),
        gap: diagnosis.gap.clone(),
        shrink: corrected.then(|| diagnosis.shrink.clone()),
        logs: vec![log("run_05.csv"), log("run_06.csv"), log("run_07.csv")],
    }
}
