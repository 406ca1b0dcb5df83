//! What the logs of a used arm tell of its bodies.

use gapscope_datasets::{Perturbation, Recipe, Sensors, generate};
use gapscope_diagnosis::schema::Combination;
use gapscope_effects::Effect;
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
