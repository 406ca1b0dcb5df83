//! An exported model in MuJoCo: golden figures, made by `export/golden/make.py`.

use gapscope_diagnosis::Corrected;
use gapscope_dynamics::robots;
use gapscope_effects::Plant;
use gapscope_export::{Robot, Target, export};

#[test]
fn mujoco_takes_the_torque_of_the_corrected_robot() {
    let loaded = robots::model("arm6").unwrap().unwrap();
    let corrected = Corrected::from_json(include_str!("../../golden/corrected.json"), &loaded.model).unwrap();
    let robot = Robot { text: robots::arm6(), loaded: &loaded, is_mjcf: false, dt: gapscope_export::DT };
    let text = export(Target::Mjcf, &robot, &corrected, &[]).unwrap().text;
    assert_eq!(
        text,
        include_str!("../../golden/robot.xml"),
        "run export/golden/make.py: MuJoCo has not seen this file"
    );

    let figures: serde_json::Value = serde_json::from_str(include_str!("../../golden/figures.json")).unwrap();
    let gain: Vec<f64> = loaded.model.joints().iter().map(|j| if j.name == "joint2" { 0.9 } else { 1.0 }).collect();
    let mut plant = Plant::new(&loaded.model, &corrected.effects, 1e-3).unwrap();
    let mut rest = [0.0; 6];
    let states = figures["states"].as_array().unwrap();
    assert!(states.len() >= 20);
    for state in states {
        let [q, v, a, left] =
            ["q", "v", "a", "left"].map(|name| -> Vec<f64> { serde_json::from_value(state[name].clone()).unwrap() });
        plant.residual(&q, &v, &a, &[0.0; 6], &[1e-9; 6], &mut rest);
        for j in 0..6 {
            // Ours is told in the effort as logged, MuJoCo's at the joint.
            let (ours, theirs) = (rest[j] * gain[j], left[j]);
            assert!((ours - theirs).abs() < 1e-6 * theirs.abs().max(1.0), "joint{}: {ours} {theirs}", j + 1);
        }
    }
}
