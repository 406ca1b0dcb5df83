//! What the logs of a used arm tell of its bodies.

use gapscope_datasets::{Perturbation, Recipe, Sensors, generate};
use gapscope_diagnosis::Outcome;
use gapscope_diagnosis::schema::{Combination, Verdict};
use gapscope_dynamics::{Model, robots};
use gapscope_effects::{Effect, GravityMisalignment, Plant};
use gapscope_tests::{diagnose, recipe, robot};
use std::collections::BTreeMap;

/// Differences of every link from its URDF, under the names of combinations.
fn differences(effects: &[Effect]) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    for effect in effects {
        let Effect::LinkInertiaError(link) = effect else { continue };
        let mut put = |name: &str, value: f64| {
            all.insert(format!("{name}.{}", link.joint), value);
        };
        put("mass_delta", link.mass_delta);
        let moments = ["x", "y", "z"].into_iter().zip(link.first_moment_delta);
        moments.for_each(|(axis, value)| put(&format!("first_moment_delta.{axis}"), value));
        let inertia = ["xx", "xy", "yy", "xz", "yz", "zz"].into_iter().zip(link.inertia_delta);
        inertia.for_each(|(axes, value)| put(&format!("inertia_delta.{axes}"), value));
    }
    all
}

#[test]
fn sums_over_links_hold_the_truth_where_single_links_do_not() {
    let model = robot("arm6");
    let (mut told, mut held, mut differ) = (0, 0, 0);
    for seed in 0..2 {
        let effects = Perturbation::scaled(2.0).draw(&model, seed);
        let sensors = Sensors { position_noise: 2e-5, ..Sensors::default() };
        let recipe = Recipe { sensors, ..recipe() };
        let log = |i: u64| generate(&model, &effects, 10 * seed + i, &recipe, "log.csv").unwrap();
        let truth = differences(&effects);
        let found: Vec<Combination> = diagnose(&model, &[log(0), log(1), log(2)]).diagnosis.combinations;
        for sum in found {
            let true_value: f64 = sum.terms.iter().map(|(name, weight)| weight * truth[name]).sum();
            assert!((sum.value - true_value).abs() < 2.0 * (sum.ci95[1] - sum.ci95[0]), "{sum:?}, truth {true_value}");
            told += 1;
            held += usize::from((sum.ci95[0]..=sum.ci95[1]).contains(&true_value));
            differ += usize::from(sum.differs());
        }
    }
    println!("{held} of {told} sums hold the truth, {differ} differ from the URDF");
    assert!(told >= 30 && differ >= told / 2, "{differ} of {told}");
    // Of thirty sums of 95 % intervals, fewer than these hold with less than 1 %.
    assert!(held as f64 >= 0.87 * told as f64, "{held} of {told}");
}

/// The description has a tool of two and a half times the wrist's own mass, which the arm that was logged lacks.
#[test]
fn a_tool_that_is_missing_is_told_though_it_outweighs_its_wrist() {
    let tool = "<link name=\"tool\"><inertial><origin xyz=\"0.04 0.012 0.16\"/><mass value=\"0.95\"/>\
        <inertia ixx=\"6e-4\" ixy=\"0\" ixz=\"0\" iyy=\"6e-4\" iyz=\"0\" izz=\"6e-4\"/></inertial></link>\
        <joint name=\"tool_mount\" type=\"fixed\"><parent link=\"link6\"/><child link=\"tool\"/></joint></robot>";
    let described = robots::arm6().replace("</robot>", tool);
    let described = Model::from_urdf(&described).unwrap().model;
    for seed in 0..2 {
        let effects = Perturbation::scaled(2.0).draw(&robot("arm6"), seed);
        let log = |i: u64| generate(&robot("arm6"), &effects, 10 * seed + i, &recipe(), "log.csv").unwrap();
        let Outcome { diagnosis, corrected, .. } = diagnose(&described, &[log(0), log(1), log(2)]);
        assert_eq!(diagnosis.verdict, Verdict::Explained, "{:?}", diagnosis.data.findings);
        let (left, floor) = (diagnosis.shrink.torque.after.unwrap(), diagnosis.shrink.reference.noise_floor);
        assert!(left < 2.0 * floor, "{left} is left, {floor} is noise");
        let kept = Plant::new(&described, &corrected.effects, 1e-3).unwrap().model().joints()[5].inertia;
        // Across its own axis the wrist's balance shows in no other link.
        assert!(kept.is_physical() && kept.first_moment.truncate().length() < 0.002, "{kept:?}");
    }
}

/// A first moment about an upright axis shows as the base is tilted alone. By columns under the model's gravity it was a bias.
#[test]
fn a_tilted_base_shows_what_the_first_link_is_off_by() {
    let model = robot("arm7");
    let of_first = |effect: &Effect| match effect {
        Effect::LinkInertiaError(link) if link.joint == "joint1" => Some(link.first_moment_delta),
        _ => None,
    };
    let mut effects = Perturbation::scaled(2.0).draw(&model, 3);
    effects.push(Effect::GravityMisalignment(GravityMisalignment { pitch: -0.042, roll: 0.046 }));
    for effect in &mut effects {
        if let Effect::LinkInertiaError(link) = effect
            && link.joint == "joint1"
        {
            link.first_moment_delta[0] = 0.08;
        }
    }
    let log = |i: u64| generate(&model, &effects, i, &recipe(), "log.csv").unwrap();
    let Outcome { diagnosis, corrected, .. } = diagnose(&model, &[log(1), log(2), log(3)]);
    assert!(diagnosis.effects.iter().all(|e| e.kind != "torque_bias"), "{:?}", diagnosis.effects);
    let found = corrected.effects.iter().find_map(of_first).unwrap();
    assert!((found[0] / 0.08 - 1.0).abs() < 0.2, "{found:?}");
}
