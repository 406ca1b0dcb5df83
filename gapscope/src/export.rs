//! `gapscope export`: the corrected model for simulators, with a ledger of what they hold.

use crate::cli::{Export, Input};
use crate::robot::Description;
use crate::{input, output, robot};
use anyhow::{Context, Result, bail};
use gapscope_datasets::Episode;
use gapscope_diagnosis::Corrected;
use gapscope_dynamics::Loaded;
use gapscope_export::{Exported, LEDGER_SCHEMA, Ledger, Robot, Target, TargetLedger, export};
use std::fmt::Write;
use std::path::PathBuf;

/// Name of the ledger's file.
const LEDGER: &str = "ledger.json";

/// Writes the corrected model and its ledger; returns what to print.
///
/// # Errors
/// Bad input, or files that exist or cannot be written.
pub fn run(args: &Export) -> Result<String> {
    let file = if args.results.is_dir() { args.results.join("corrected.json") } else { args.results.clone() };
    let name = file.display();
    let text = std::fs::read_to_string(&file).with_context(|| {
        format!("cannot read {name}; give the folder that `gapscope diagnose` wrote, or its corrected.json")
    })?;
    let out = match &args.out {
        Some(out) => out.clone(),
        None => output::new_folder(file.parent().unwrap_or(std::path::Path::new("")), "export")?,
    };
    let mut targets: Vec<Target> = Vec::new();
    for target in args.to.iter().map(|&target| target.into()) {
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    if targets.contains(&Target::IsaacLab) && !targets.contains(&Target::Urdf) {
        targets.push(Target::Urdf);
    }
    let files: Vec<PathBuf> = targets.iter().map(|target| target.file()).chain([LEDGER]).map(|f| out.join(f)).collect();
    if let (Some(there), false) = (files.iter().find(|file| file.symlink_metadata().is_ok()), args.force) {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            there.display()
        );
    }
    // The user's own file may be the very one that would be replaced.
    if let Some(same) = files.iter().find(|file| same_file(file, &args.robot)) {
        bail!("{} is the robot description itself; choose another folder with --out", same.display());
    }

    let description = robot::read(&args.robot, &args.xacro_args)?;
    let loaded = loaded(args, &description, &text)?;
    let corrected = Corrected::from_json(&text, &loaded.model).with_context(|| name.to_string())?;
    let logs = logs(args, &loaded)?;
    let robot = Robot { text: description.text(), loaded: &loaded, is_mjcf: description.is_mjcf() };
    let exported: Vec<Exported> =
        targets.iter().map(|&target| Ok(export(target, &robot, &corrected, &logs)?)).collect::<Result<_>>()?;
    for (exported, file) in exported.iter().zip(&files) {
        output::write(file, &exported.text)?;
    }
    let ledger = Ledger {
        schema: LEDGER_SCHEMA.to_owned(),
        robot: corrected.robot.clone(),
        logs: logs.iter().map(|log| log.name.clone()).collect(),
        targets: exported.into_iter().map(|exported| exported.ledger).collect(),
    };
    output::write(&out.join(LEDGER), &(serde_json::to_string_pretty(&ledger)? + "\n"))?;
    let mut told = String::new();
    for target in &ledger.targets {
        told += &table(target, &out.join(&target.file).display().to_string());
    }
    let _ = write!(told, "{} has the same as JSON.", out.join(LEDGER).display());
    Ok(told)
}

fn same_file(a: &std::path::Path, b: &std::path::Path) -> bool {
    a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}

/// The robot, with the joints held that the diagnosis did not have.
fn loaded(args: &Export, description: &Description, corrected: &str) -> Result<Loaded> {
    let loaded = description.model(&args.robot, &args.lock)?;
    let Ok(value) = serde_json::from_str::<serde_json::Value>(corrected) else { return Ok(loaded) };
    let Some(known) = value.get("weights").and_then(|weights| weights.as_object()) else { return Ok(loaded) };
    let absent = loaded.model.joints().iter().map(|joint| &joint.name).filter(|name| !known.contains_key(*name));
    let mut held = args.lock.clone();
    held.extend(absent.cloned());
    // Where none of the joints is known it is another robot, which reading the corrections says better.
    if held.len() == args.lock.len() || held.len() - args.lock.len() == loaded.model.dof() {
        return Ok(loaded);
    }
    description.model(&args.robot, &held)
}

/// The logs, read for the joints that the diagnosis had.
fn logs(args: &Export, loaded: &Loaded) -> Result<Vec<Episode>> {
    if args.logs.is_empty() {
        return Ok(Vec::new());
    }
    let locked = |name: &String| loaded.model.joint_index(name).is_none();
    let whole = robot::read(&args.robot, &args.xacro_args)?.model(&args.robot, &args.lock)?;
    let mut lock = args.lock.clone();
    lock.extend(whole.model.joints().iter().map(|joint| joint.name.clone()).filter(|name| locked(name)));
    let input = Input {
        robot: args.robot.clone(),
        logs: args.logs.clone(),
        map: args.map.clone(),
        map_file: args.map_file.clone(),
        xacro_args: args.xacro_args.clone(),
        lock,
        ..Input::default()
    };
    let read = input::load(&input)?;
    if read.model.dof() != loaded.model.dof() {
        bail!("the logs lack joints that the diagnosis had; give logs of all {} joints", loaded.model.dof());
    }
    Ok(read.episodes)
}

/// The ledger of a target as a table.
fn table(target: &TargetLedger, file: &str) -> String {
    let mut text = format!("{file}\n");
    let rows: Vec<[String; 4]> = target
        .effects
        .iter()
        .map(|entry| {
            let on = if entry.joints.is_empty() { "robot".to_owned() } else { entry.joints.join(" ") };
            let loss = entry.loss.map_or_else(|| "unknown".to_owned(), |loss| format!("{loss:.3}"));
            [format!("{} ({on})", entry.kind), entry.how.words().to_owned(), loss, entry.r#as.clone()]
        })
        .collect();
    let head = ["effect", "", "shrink lost", "as"].map(str::to_owned);
    let wide = |column: usize| rows.iter().chain([&head]).map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths = [wide(0), wide(1), wide(2)];
    for [effect, how, loss, note] in [&head].into_iter().chain(&rows) {
        let _ = writeln!(
            text,
            "  {effect:<a$}  {how:<b$}  {loss:>c$}  {note}",
            a = widths[0],
            b = widths[1],
            c = widths[2]
        );
    }
    if rows.is_empty() {
        text += "  no effect: the nominal robot\n";
    }
    match target.shrink.zip(target.shrink_here) {
        Some((shrink, here)) => {
            let _ = writeln!(
                text,
                "The torque gap shrinks by {shrink:.3} with the corrected model, by {here:.3} with what stands here."
            );
        }
        None => match target.shrink {
            Some(shrink) => {
                let _ = writeln!(
                    text,
                    "The torque gap shrinks by {shrink:.3} with the corrected model; with what stands here it is unknown."
                );
            }
            None => {
                text += "What the shrink falls by is unknown: no logs were given, or their gap is that of noise. Give logs with --logs.\n"
            }
        },
    }
    if !target.paste.is_empty() {
        text += "To paste into a URDF of your own:\n";
    }
    for line in &target.paste {
        let _ = writeln!(text, "  {line}");
    }
    for note in &target.notes {
        let _ = writeln!(text, "Note: {note}.");
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;
    use std::path::Path;

    fn run(words: &[&str]) -> Result<String> {
        match Cli::try_parse_from(["gapscope"].iter().chain(words)).unwrap().command {
            Command::Generate(args) => crate::generate::run(&args),
            Command::Export(args) => super::run(&args),
            _ => unreachable!(),
        }
    }

    fn path(path: &Path) -> &str {
        path.to_str().unwrap()
    }

    /// A folder with logs of a pendulum with friction, and the corrections that a perfect diagnosis would have written.
    fn case(folder: &Path) {
        let effects = r#"[{"kind": "coulomb_friction", "coulomb": {"joint1": 0.2, "joint2": 0.1}},
            {"kind": "armature", "armature": {"joint1": 0.02, "joint2": 0.01}}]"#;
        std::fs::write(folder.join("effects.json"), effects).unwrap();
        let (file, out) = (folder.join("effects.json"), folder.join("logs"));
        let words =
            ["double_pendulum", "--effects", path(&file), "--episodes", "2", "--seconds", "4", "--out", path(&out)];
        run(&[&["generate"], &words[..]].concat()).unwrap();
        let corrected = format!(
            r#"{{"schema": "gapscope.model/1", "robot": "double_pendulum", "weights": {{"joint1": 1, "joint2": 1}},
            "standstill": {{"joint1": 0.01, "joint2": 0.01}}, "band": 10, "encoder_side": "link", "alignment": 0, "effects": {effects}}}"#
        );
        std::fs::write(folder.join("corrected.json"), corrected).unwrap();
    }

    #[test]
    fn the_ledger_says_what_is_lost_and_nothing_is_overwritten() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        case(folder);
        let (robot, out) = (folder.join("logs/robot.urdf"), folder.join("out"));
        let log = folder.join("logs/episode_1.csv");
        let words = [
            "export",
            path(folder),
            "--robot",
            path(&robot),
            "--to",
            "urdf,mjcf",
            "--out",
            path(&out),
            "--logs",
            path(&log),
        ];
        let told = run(&words).unwrap();
        assert!(told.contains("To paste into a URDF of your own:\n  joint1: <dynamics"), "{told}");
        let ledger: Ledger = serde_json::from_str(&std::fs::read_to_string(out.join(LEDGER)).unwrap()).unwrap();
        let [urdf, mjcf] = &ledger.targets[..] else { panic!("{ledger:?}") };
        assert_eq!((urdf.file.as_str(), mjcf.file.as_str(), ledger.logs.len()), ("robot.urdf", "robot.xml", 1));
        // A URDF has no rotors: what that costs is what is lost in all.
        let loss =
            |target: &TargetLedger, kind: &str| target.effects.iter().find(|e| e.kind == kind).unwrap().loss.unwrap();
        let lost = urdf.shrink.unwrap() - urdf.shrink_here.unwrap();
        assert!(lost > 0.02 && (loss(urdf, "armature") - lost).abs() < 1e-9, "{urdf:?}");
        assert_eq!(loss(urdf, "coulomb_friction"), 0.0);
        assert_eq!((mjcf.shrink, loss(mjcf, "armature")), (mjcf.shrink_here, 0.0));

        let before = std::fs::read_to_string(out.join("robot.xml")).unwrap();
        let error = run(&words).unwrap_err().to_string();
        assert!(error.contains("robot.urdf exists already") && error.contains("--force"), "{error}");
        let forced = run(&[&words[..8], &["--force"]].concat()).unwrap();
        assert!(forced.contains("unknown"), "without logs no figure: {forced}");
        assert_eq!(std::fs::read_to_string(out.join("robot.xml")).unwrap(), before);
        let own = ["export", path(folder), "--robot", path(&robot), "--to", "urdf", "--force", "--out"];
        let error = run(&[&own[..], &[path(&folder.join("logs"))]].concat()).unwrap_err().to_string();
        assert!(error.contains("the robot description itself"), "{error}");
        run(&["export", path(folder), "--robot", path(&robot), "--to", "isaaclab", "--out", path(&folder.join("lab"))])
            .unwrap();
        assert!(folder.join("lab/isaaclab_robot.py").exists() && folder.join("lab/robot.urdf").exists());
        // By itself it makes a new folder beside the results each time.
        run(&own[..7]).unwrap();
        run(&own[..6]).unwrap();
        assert!(folder.join("export/robot.urdf").exists() && folder.join("export.2/robot.urdf").exists());
    }

    #[test]
    fn what_cannot_be_is_an_error_that_names_the_mend() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        case(folder);
        let robot = folder.join("logs/robot.urdf");
        let fails = |results: &Path, robot: &Path, part: &str| {
            let words = ["export", path(results), "--robot", path(robot), "--to", "mjcf"];
            let error = format!("{:#}", run(&words).unwrap_err());
            assert!(error.contains(part), "{error}");
        };
        fails(&folder.join("logs"), &robot, "the folder that `gapscope diagnose` wrote");
        fails(folder, &folder.join("none.urdf"), "cannot read the robot description");
        fails(&folder.join("effects.json"), &robot, "not a corrected model");
        let other = folder.join("other.urdf");
        std::fs::write(&other, gapscope_dynamics::robots::arm6().replace("joint1", "shoulder")).unwrap();
        fails(folder, &other, "use the URDF that the diagnosis was made with");
        assert!(!folder.join("export").exists());
        // Joints that the diagnosis did not have are held.
        std::fs::write(&other, gapscope_dynamics::robots::arm6()).unwrap();
        run(&["export", path(folder), "--robot", path(&other), "--to", "mjcf"]).unwrap();
        let text = std::fs::read_to_string(folder.join("export/robot.xml")).unwrap();
        assert!(text.contains("\"joint2\"") && !text.contains("\"joint3\""), "{text}");
    }
}
