//! The region of parameters: of a diagnosis with known errors, in Rust and in the Python that goes out beside it.

use gapscope_export::{RANGES_SCHEMA, Ranges, SAMPLER};
use std::process::Command;

/// Two parameters that go together.
fn ranges() -> Ranges {
    let one = |name: &str, value: f64| {
        format!(
            r#"{{"kind": "coulomb_friction", "parameter": "coulomb", "joint": "{name}", "value": {value}, "error": 0.1, "range": [0, 1], "unit": "N m"}}"#
        )
    };
    let text = format!(
        r#"{{"schema": "{RANGES_SCHEMA}", "robot": "arm", "probability": 0.9, "radius": 2.0, "parameters": [{}, {}],
        "factor": [[0.1, 0.0], [0.08, 0.06]], "fixed": []}}"#,
        one("a", 1.0),
        one("b", 2.0)
    );
    serde_json::from_str(&text).unwrap()
}

#[test]
fn correlations_count() {
    let ranges = ranges();
    let distance = |a: f64, b: f64| ranges.distance(&[1.0 + a, 2.0 + b]).unwrap();
    assert!((distance(0.2, 0.16) - 1.0).abs() < 1e-12, "along what goes together: two errors");
    assert!(distance(0.2, -0.16) > 2.5, "against it");
    assert_eq!((distance(0.0, 0.0), ranges.distance(&[1.0])), (0.0, None));
    let [about, volume] = ranges.widths(0.2).unwrap();
    // Half-widths .2 and .2 over .2 and .4; the region is π r² |F| of the four that its box has.
    assert!((about - (0.2f64 * 0.2 / (0.2 * 0.4)).sqrt()).abs() < 1e-12, "{about}");
    let area = std::f64::consts::PI * 4.0 * 0.1 * 0.06;
    assert!((volume - (area / (4.0 * 0.2 * 0.4)).sqrt()).abs() < 1e-9, "{volume}");
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
         assert all(r.holds(one) for one in x)\n\
         assert not r.holds(np.array([1.2, 1.84]))\n\
         # Evenly over an ellipse: a quarter of the radius squared in each direction.\n\
         covariance = np.cov(x.T) / (r.radius**2 / 4)\n\
         assert np.allclose(covariance, r.factor @ r.factor.T, atol=1e-3), covariance\n",
    );
    let out = Command::new("python3").arg("check.py").current_dir(folder.path()).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}
