//! `gapscope rollout` with networks that `gapscope train` wrote.

use crate::support::{gapscope, pendulum, said};

#[test]
fn networks_stand_beside_the_nominal_model_and_what_does_not_fit_is_refused() {
    let dir = pendulum();
    let folder = dir.path();
    let gapscope = |arguments: &str| gapscope(folder, arguments.split(' '));
    let network = "robot.urdf log.csv --hidden 16 --epochs 60 --rate 0.01 --cosine --out";
    for arguments in
        [format!("train residual {network} residual --on acceleration"), format!("train pure {network} pure")]
    {
        let output = gapscope(&arguments);
        assert!(output.status.success(), "{}", said(&output));
    }

    let rollout = |more: &str| {
        let arguments = format!("rollout robot.urdf log.csv --horizon 0.3 --starts 30 --out page.html --force {more}");
        gapscope(&arguments)
    };
    let output = rollout("--residual residual --pure pure/weights.json");
    let text = said(&output);
    assert!(output.status.success() && text.contains("hybrid") && text.contains("pure"), "{text}");
    // The last horizon: nominal, hybrid, how many times less, pure, how many times less.
    let row = text.lines().find(|line| line.starts_with("0.3 ")).unwrap();
    let cells: Vec<&str> = row.split_whitespace().collect();
    let times: f64 = cells[4].parse().unwrap();
    assert!(cells[3] == "÷" && times > 2.0, "the residual takes friction away: {row}");
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(page.contains("with a residual network") && page.contains("network alone") && !page.contains("NaN"));

    for (more, told) in [
        ("--residual pure", "--pure"),
        ("--pure residual", "--residual"),
        ("--residual nowhere", "nowhere"),
        ("--residual residual/training.json", "holds no weights"),
        ("--residual residual/learning_curve.csv", ".safetensors"),
    ] {
        let output = rollout(more);
        assert!(output.status.code() == Some(1) && said(&output).contains(told), "{more}: {}", said(&output));
    }
    let spoil = |file: &str, from: &str, to: &str| {
        let path = folder.join("residual").join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let told = said(&rollout("--residual residual"));
        std::fs::write(&path, text).unwrap();
        told
    };
    assert!(spoil("training.json", "joint1", "elbow").contains("elbow"));
    assert!(spoil("training.json", "\"acceleration\"", "\"next-state\"").contains("6 to 4"));
    assert!(spoil("training.json", "\"dt\": 0.01", "\"dt\": 0.0123").contains("--dt 0.01"));
    assert!(spoil("training.json", "gapscope.training/1", "another/1").contains("another/1"));
    assert!(spoil("training.json", "{", "").contains("no record"));
    std::fs::remove_file(folder.join("pure/training.json")).unwrap();
    assert!(said(&rollout("--pure pure")).contains("pure/training.json"));
}
