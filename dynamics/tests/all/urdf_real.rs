//! URDFs of real robots load, with the findings they deserve. Data from `GAPSCOPE_DATA`, by default `../shared/data`,
//! seen from the workspace.

use gapscope_dynamics::{Loaded, Model};
use std::path::{Path, PathBuf};

fn data() -> Option<PathBuf> {
    let given = std::env::var_os("GAPSCOPE_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(given);
    if folder.is_dir() {
        return Some(folder);
    }
    skipped(&folder);
    None
}

#[allow(clippy::print_stdout, reason = "a skipped test says so")]
fn skipped(folder: &Path) {
    println!("skipped: no folder {}", folder.display());
}

#[track_caller]
fn load(path: &Path) -> Loaded {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Model::from_urdf(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn about(loaded: &Loaded) -> Vec<&str> {
    loaded.findings.iter().map(|finding| finding.about.as_str()).collect()
}

#[test]
fn robots_of_the_data_load() {
    let Some(data) = data() else { return };
    let pendulum = load(&data.join("double_pendulum/robot.urdf"));
    assert_eq!((pendulum.model.dof(), pendulum.model.base()), (2, "world"));
    assert_eq!(about(&pendulum), ["<axis> of a fixed joint", "joint `base_weld`"]);

    let emps = load(&data.join("emps/robot.urdf"));
    assert_eq!(emps.model.dof(), 1);
    assert_eq!(emps.model.joints()[0].inertia.mass, 95.1089);
    assert!(emps.findings.is_empty());

    // The last link has mass and, rounded, no inertia about its axis.
    let tx40 = load(&data.join("tx40/robot.urdf"));
    assert_eq!((tx40.model.dof(), about(&tx40)), (6, vec!["joint `joint_6`"]));

    // Three links with an inertia that no body has, four joints without position limits.
    let kinova = load(&data.join("kinova_gen3/robot.urdf"));
    assert_eq!((kinova.model.dof(), kinova.model.base()), (7, "world"));
    let links = about(&kinova).iter().filter(|about| about.starts_with("link")).count();
    let joints = about(&kinova).iter().filter(|about| about.starts_with("joint")).count();
    assert_eq!((links, joints, kinova.findings.len()), (3, 4, 8));
}

#[test]
fn robots_of_the_bank_load() {
    let Some(data) = data() else { return };
    let bank = data.join("../bank/sample");
    let Ok(cases) = std::fs::read_dir(&bank) else {
        return skipped(&bank);
    };
    let mut count = 0;
    for case in cases.flatten() {
        let path = case.path().join("robot.urdf");
        if path.is_file() {
            let loaded = load(&path);
            assert!(loaded.findings.is_empty(), "{}: {:?}", path.display(), loaded.findings);
            count += 1;
        }
    }
    assert!(count > 0, "no case with a robot in {}", bank.display());
}
