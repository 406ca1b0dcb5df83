//! Rollouts of nominal and corrected models against logs: what `gapscope rollout` shows.

use gapscope_diagnosis::{Contender, RolloutOptions, rollouts};
use gapscope_effects::{Effect, ViscousFriction};
use gapscope_tests::{diagnose, robot, simulate};

#[test]
fn the_correction_carries_to_long_horizons_and_the_bounds_hold() {
    let model = robot("arm6");
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 3.0)).collect();
    let hidden = [Effect::ViscousFriction(ViscousFriction { viscous })];
    let logs: Vec<_> = (0..2).map(|seed| simulate(&model, &hidden, seed, 6.0, 250.0, 1e-6)).collect();
    let corrected = diagnose(&model, &logs).corrected;
    let options = RolloutOptions { horizon: 0.4, starts: 40, ..RolloutOptions::default() };
    let contenders = [
        Contender::plant("nominal", &model, &[]).unwrap(),
        Contender::plant("corrected", &model, &corrected.effects).unwrap(),
    ];
    let found = rollouts(&model, &logs, &contenders, &options).unwrap();
    let [before, after] = found.as_slice() else { panic!("one result a model") };
    assert_eq!(before.growth.horizons, after.growth.horizons);
    for (b, a) in before.growth.overall.iter().zip(&after.growth.overall) {
        assert!(a.median < 0.2 * b.median, "{} {}", a.median, b.median);
    }
    assert!(before.growth.leaves.median < after.growth.leaves.median);
    for model in [before, after] {
        let bound = model.bound.as_ref().unwrap();
        for i in 0..bound.horizons.len() {
            assert!(bound.truth[i] <= bound.tight[i] * (1.0 + 1e-6));
            assert!(bound.tight[i] <= bound.local[i] * (1.0 + 1e-9) && bound.local[i] <= bound.loose[i] * (1.0 + 1e-9));
        }
    }
    assert!(after.bound.as_ref().unwrap().delta.median < 0.2 * before.bound.as_ref().unwrap().delta.median);
    // The same input gives the same figures whatever the number of cores.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(found, pool.install(|| rollouts(&model, &logs, &contenders, &options).unwrap()));
}
