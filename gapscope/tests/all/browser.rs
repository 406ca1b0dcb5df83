//! Pages as a person uses them, in a real browser where there is one.

use std::io::Write;
use std::path::Path;
use std::process::Command;

/// What the script says where there is no browser.
const SKIPPED: i32 = 77;

/// Runs the browser's script on pages; says so where it was skipped.
pub fn look(pages: &[&Path], flags: &[&str]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/report/browser.py");
    // A Python that has playwright may be another than the one of the path.
    let python = std::env::var("GAPSCOPE_PYTHON").unwrap_or_else(|_| "python3".into());
    let Ok(output) = Command::new(python).arg(script).args(pages).args(flags).output() else {
        return skipped("skipped: no Python on this machine\n");
    };
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    match output.status.code() {
        Some(SKIPPED) => skipped(&said),
        code => assert_eq!(code, Some(0), "{said}"),
    }
}

/// Says so past the test runner, which keeps what a passing test prints to itself.
fn skipped(said: &str) {
    // A line that cannot be written is none.
    let _ = std::io::stderr().write_all(format!("the page was not looked at in a browser: {said}").as_bytes());
}
