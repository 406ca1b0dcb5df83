//! The region of parameters: of a diagnosis with known errors, in Rust and in the Python that goes out beside it.

use gapscope_diagnosis::schema::{Covariance, ParameterError};
use gapscope_export::{RANGES_SCHEMA, Ranges, SAMPLER};
use std::process::Command;

/// Two parameters that go together and are determined, and one that no log tells.
fn ranges() -> Ranges {
    let one = |name: &str, value: f64, half: f64, is_determined: bool| {
        format!(
            r#"{{"kind": "coulomb_friction", "parameter": "coulomb", "joint": "{name}", "value": {value}, "answer": {value},
            "error": 0.1, "is_determined": {is_determined}, "range": [{}, {}], "unit": "N m"}}"#,
            value - half,
            value + half
        )
    };
    let text = format!(
        r#"{{"schema": "{RANGES_SCHEMA}", "robot": "arm", "probability": 0.9, "radius": 2.0, "radius_open": 3.0,
        "parameters": [{}, {}, {}], "determined": [[0.1, 0.0], [0.08, 0.06], [0, 0]], "open": [[0], [0], [5]], "fixed": []}}"#,
        one("a", 1.0, 0.2, true),
        one("b", 2.0, 0.2, true),
        one("c", 3.0, 0.0, false)
    );
    serde_json::from_str(&text).unwrap()
}

#[test]
fn correlations_count() {
    let ranges = ranges();
    let distance = |a: f64, b: f64| ranges.distance(&[1.0 + a, 2.0 + b, 3.0]).unwrap()[0];
    assert!((distance(0.2, 0.16) - 1.0).abs() < 1e-12, "along what goes together: two errors");
    assert!(distance(0.2, -0.16) > 2.5, "against it");
    assert_eq!((distance(0.0, 0.0), ranges.distance(&[1.0])), (0.0, None));
    let [determined, open] = ranges.distance(&[1.0, 2.0, 18.0]).unwrap();
    assert!(determined.abs() < 1e-12 && (open - 1.0).abs() < 1e-12, "three spreads of what no log tells");
    // Half-widths .2 and .2 over .2 and .4; what is open does not count.
    assert!((ranges.widths(0.2).unwrap() - (0.2f64 * 0.2 / (0.2 * 0.4)).sqrt()).abs() < 1e-12);
}

/// Two numbers, each known to .1, of which the logs tell the sum to .01 and the difference not at all.
fn sum_alone(freedom: f64) -> Covariance {
    let one = |joint: &str| ParameterError {
        kind: "link_inertia_error".into(),
        parameter: "mass_delta".into(),
        joint: Some(joint.into()),
        component: None,
        value: 1.0,
        answer: None,
        error: (0.5f64 * (0.01 + 1e-4)).sqrt(),
        spread: Some(0.1),
        unit: "kg".into(),
    };
    let together = (1e-4 - 0.01) / (1e-4 + 0.01);
    let correlation = vec![vec![1.0], vec![together, 1.0]];
    Covariance { parameters: vec![one("a"), one("b")], correlation, freedom }
}

#[test]
fn what_no_log_tells_is_kept_apart_from_what_it_tells() {
    let ranges = Ranges::of("arm", &sum_alone(29.0)).unwrap();
    assert_eq!((ranges.determined[0].len(), ranges.open[0].len()), (1, 1));
    // One number and 29 degrees of freedom: 90 % of t.
    assert!((ranges.radius - 1.699_127).abs() < 1e-5, "{}", ranges.radius);
    let sum =
        ranges.distance(&[1.0 + 0.5 * 0.01 * 2f64.sqrt() * 1.699_127, 1.0 + 0.5 * 0.01 * 2f64.sqrt() * 1.699_127]);
    let [determined, open] = sum.unwrap();
    assert!((determined - 1.0).abs() < 1e-5 && open < 1e-6, "{determined} {open}");
    let [determined, open] = ranges.distance(&[1.1, 0.9]).unwrap();
    assert!(determined < 1e-6 && (0.3..1.0).contains(&open), "{determined} {open}");
    assert!(ranges.widths(0.2).is_none(), "neither number is determined by itself");
    // The less sure the errors are themselves, the wider; of files that do not say it there is no region.
    assert!(Ranges::of("arm", &sum_alone(3.0)).unwrap().radius > 1.3 * ranges.radius);
    assert!(Ranges::of("arm", &sum_alone(0.0)).is_none());
}

/// Said to be skipped where Python has no NumPy.
#[test]
fn the_sampler_stays_in_the_region_and_fills_it() {
    let ready = Command::new("python3").args(["-c", "import numpy"]).output().is_ok_and(|out| out.status.success());
    if !ready {
        eprintln!("skipped: no python3 with NumPy on this machine");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("sample_ranges.py", SAMPLER);
    write("ranges.json", &serde_json::to_string(&ranges()).unwrap());
    write(
        "check.py",
        "import numpy as np, sample_ranges\n\
         r = sample_ranges.Ranges()\n\
         rng = np.random.default_rng(1)\n\
         x = np.array([r.sample(rng) for _ in range(4000)])\n\
         assert all(r.holds(one) for one in x) and (x[:, 2] == 3).all()\n\
         assert not r.holds(np.array([1.2, 1.84, 3]))\n\
         far = np.array([r.sample(rng, open=1.0) for _ in range(400)])\n\
         assert all(r.holds(one) for one in far) and far[:, 2].std() > 4\n\
         # Evenly over an ellipse: a quarter of the radius squared in each direction.\n\
         covariance = np.cov(x.T) / (r.radius**2 / 4)\n\
         assert np.allclose(covariance, r.determined @ r.determined.T, atol=1e-3), covariance\n",
    );
    let out = Command::new("python3").arg("check.py").current_dir(folder.path()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}
