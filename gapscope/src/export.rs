//! `gapscope export`: the corrected model for simulators, with a ledger of what they hold.

mod args;

use crate::cli::{Input, Kind};
use crate::input::Reading;
use crate::learned::{self, Trained};
use crate::robot::Description;
use crate::{input, output, robot, stored};
use anyhow::{Context, Result, bail, ensure};
use gapscope_datasets::Episode;
use gapscope_diagnosis::Corrected;
use gapscope_dynamics::{Loaded, Model};
use gapscope_export::{
    DT, Exported, LEDGER_SCHEMA, Ledger, Ranges, Robot, SAMPLER, Target, TargetLedger, export, fmu,
    weights as weights_for_c,
};
use std::fmt::Write;
use std::path::PathBuf;

pub use args::Export;

/// Name of the ledger's file.
const LEDGER: &str = "ledger.json";
/// Names of the files with the region of parameters.
const RANGES: [&str; 2] = ["ranges.json", "sample_ranges.py"];
/// Name of the file with a residual's weights.
const RESIDUAL: &str = "residual.bin";

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
    let asked: Vec<Target> = args.to.iter().map(|&target| target.into()).collect();
    let mut targets: Vec<Target> = Vec::new();
    for target in asked.iter().copied().chain(asked.iter().filter_map(|target| target.needs())) {
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    ensure!(
        args.residual.is_none() || targets.iter().any(|target| matches!(target, Target::C | Target::Fmu)),
        "a residual is written for the targets c, cpp and fmu alone; add one: --to c"
    );
    // An FMU has the weights in itself.
    let weights = (args.residual.is_some() && targets.contains(&Target::C)).then_some(RESIDUAL);
    let ledger = (!targets.is_empty()).then_some(LEDGER);
    let regions = if args.ranges { &RANGES[..] } else { &[] };
    let names = targets.iter().map(|target| target.file()).chain(ledger).chain(weights).chain(regions.iter().copied());
    let files: Vec<PathBuf> = names.map(|f| out.join(f)).collect();
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

    let description = robot::read(&args.robot, &args.reading.xacro_args)?;
    let loaded = loaded(args, &description, &text)?;
    let corrected = Corrected::from_json(&text, &loaded.model).with_context(|| name.to_string())?;
    let ranges = args.ranges.then(|| ranges(&file)).transpose()?;
    let logs = logs(args, &loaded)?;
    let residual = args.residual.as_ref().map(|path| residual(path, &loaded.model, &corrected)).transpose()?;
    let dt = step(args.dt, residual.as_ref())?;
    let robot = Robot { text: description.text(), loaded: &loaded, is_mjcf: description.is_mjcf(), dt };
    let mut exported: Vec<Exported> =
        targets.iter().map(|&target| Ok(export(target, &robot, &corrected, &logs)?)).collect::<Result<_>>()?;
    let network =
        residual.as_ref().map(|Trained { network, on, dt, .. }| weights_for_c(network, *on, loaded.model.dof(), *dt));
    for (exported, file) in exported.iter_mut().zip(&files) {
        if exported.target == Target::Fmu {
            let unit = fmu(&loaded.model, &exported.text, dt, network.as_deref())?;
            exported.ledger.notes.push(unit.note);
            output::write_bytes(file, &unit.bytes)?;
        } else {
            output::write(file, &exported.text)?;
        }
    }
    if let (Some(name), Some(network)) = (weights, &network) {
        output::write_bytes(&out.join(name), network)?;
    }
    let mut told = String::new();
    if let Some(ranges) = &ranges {
        let json = serde_json::to_string_pretty(ranges)? + "\n";
        output::write(&out.join(RANGES[0]), &json)?;
        output::write(&out.join(RANGES[1]), SAMPLER)?;
        let _ = writeln!(
            told,
            "{}\n  {} parameters, a region that holds the robot with {:.0} %; {} samples it\n",
            out.join(RANGES[0]).display(),
            ranges.parameters.len(),
            100.0 * ranges.probability,
            RANGES[1]
        );
    }
    if targets.is_empty() {
        return Ok(told);
    }
    let ledger = Ledger {
        schema: LEDGER_SCHEMA.to_owned(),
        robot: corrected.robot.clone(),
        logs: logs.iter().map(|log| log.name.clone()).collect(),
        targets: exported.into_iter().map(|exported| exported.ledger).collect(),
    };
    output::write(&out.join(LEDGER), &(serde_json::to_string_pretty(&ledger)? + "\n"))?;
    for target in &ledger.targets {
        told += &table(target, &out.join(&target.file).display().to_string());
    }
    let _ = write!(told, "{} has the same as JSON.", out.join(LEDGER).display());
    Ok(told)
}

fn same_file(a: &std::path::Path, b: &std::path::Path) -> bool {
    a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b)
}

/// The region of parameters of the diagnosis beside a corrected model.
fn ranges(corrected: &std::path::Path) -> Result<Ranges> {
    let file = corrected.with_file_name("diagnosis.json");
    let name = file.display();
    let text = std::fs::read_to_string(&file).with_context(|| {
        format!("cannot read {name}, which has the standard errors; give the folder that `gapscope diagnose` wrote")
    })?;
    let diagnosis = stored::diagnosis(&text).with_context(|| {
        format!("{name} is no diagnosis of logs with torque, whose parameters have standard errors")
    })?;
    Ranges::new(&diagnosis).with_context(|| {
        format!(
            "{name} has no standard errors: no effect was found, or another version wrote it; diagnose the logs anew"
        )
    })
}

/// A residual, which must have been trained on the very physics that it will stand on.
fn residual(path: &std::path::Path, robot: &Model, corrected: &Corrected) -> Result<Trained> {
    let trained = learned::read(path, Kind::Residual, robot)?;
    let below = trained.physics.as_ref().map_or(&[][..], |physics| &physics.effects);
    ensure!(
        below == corrected.effects,
        "{} was trained on {}, and would correct once more what the effects do; train it with \
         `gapscope train residual … --with` the corrected.json that is exported",
        path.display(),
        if below.is_empty() { "the robot as described" } else { "another corrected model" }
    );
    let (shape, n) = ([trained.network.inputs(), trained.network.outputs()], robot.dof());
    ensure!(
        shape == [3 * n, trained.on.outputs(n)],
        "{} has {} inputs and {} outputs, expected {} and {}; train it for this robot",
        path.display(),
        shape[0],
        shape[1],
        3 * n,
        trained.on.outputs(n)
    );
    Ok(trained)
}

/// The length of a step, s: the one asked for, which a residual's must be.
///
/// # Errors
/// A length that is none, or that a residual was not trained for.
pub fn step(asked: Option<f64>, residual: Option<&Trained>) -> Result<f64> {
    let dt = asked.or(residual.map(|residual| residual.dt)).unwrap_or(DT);
    ensure!(dt.is_finite() && (1e-6..=1.0).contains(&dt), "--dt is {dt}, expected seconds from 0.000001 to 1");
    if let Some(other) = residual.map(|residual| residual.dt).filter(|other| *other != dt) {
        bail!(
            "--dt is {dt}, but the residual was trained for steps of {other} s; leave --dt out, or train it with --dt {dt}"
        );
    }
    Ok(dt)
}

/// The robot, with the joints held that the diagnosis did not have.
fn loaded(args: &Export, description: &Description, corrected: &str) -> Result<Loaded> {
    let loaded = description.model(&args.robot, &args.reading.lock)?;
    let Ok(value) = serde_json::from_str::<serde_json::Value>(corrected) else { return Ok(loaded) };
    let Some(known) = value.get("weights").and_then(|weights| weights.as_object()) else { return Ok(loaded) };
    let absent = loaded.model.joints().iter().map(|joint| &joint.name).filter(|name| !known.contains_key(*name));
    let mut held = args.reading.lock.clone();
    held.extend(absent.cloned());
    // Where none of the joints is known it is another robot, which reading the corrections says better.
    if held.len() == args.reading.lock.len() || held.len() - args.reading.lock.len() == loaded.model.dof() {
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
    let whole = robot::read(&args.robot, &args.reading.xacro_args)?.model(&args.robot, &args.reading.lock)?;
    let mut lock = args.reading.lock.clone();
    lock.extend(whole.model.joints().iter().map(|joint| joint.name.clone()).filter(|name| locked(name)));
    let reading = Reading { lock, ..args.reading.clone() };
    let input = Input { robot: args.robot.clone(), logs: args.logs.clone(), reading, ..Input::default() };
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
        let a_file = if target.target == "mjcf" { "the <joint>s of an MJCF" } else { "a URDF" };
        let _ = writeln!(text, "To paste into {a_file} of your own:");
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
            Command::Train(args) => crate::train::run(&args),
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
    fn covers_come_with_the_c_file_and_a_unit_with_its_note() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        case(folder);
        let (robot, out) = (folder.join("logs/robot.urdf"), folder.join("out"));
        let words = ["export", path(folder), "--robot", path(&robot), "--to", "cpp,fmu,simulink", "--out", path(&out)];
        let told = run(&words).unwrap();
        let mut names: Vec<String> =
            std::fs::read_dir(&out).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        assert_eq!(names, ["ledger.json", "robot.c", "robot.fmu", "robot.hpp", "robot_sfun.c"]);
        assert!(std::fs::read(out.join("robot.fmu")).unwrap().starts_with(b"PK"));
        assert!(told.contains("a binary for ") || told.contains("no binary"), "{told}");
        let ledger: Ledger = serde_json::from_str(&std::fs::read_to_string(out.join(LEDGER)).unwrap()).unwrap();
        assert_eq!(ledger.targets.len(), 4);
        assert!(
            ledger.targets.iter().all(|target| target.effects.iter().all(|effect| effect.how.words() == "written"))
        );
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

    #[test]
    fn a_residual_goes_out_with_the_physics_that_it_was_trained_on() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        case(folder);
        let (robot, log) = (folder.join("logs/robot.urdf"), folder.join("logs/episode_0.csv"));
        let train = |out: &str, more: &[&str]| {
            let out = folder.join(out);
            let words =
                ["train", "residual", path(&robot), path(&log), "--hidden", "4", "--epochs", "1", "--dt", "0.01"];
            run(&[&words[..], &["--out", path(&out)], more].concat()).unwrap();
            out
        };
        let export = |residual: &Path, to: &str, more: &[&str]| {
            let out = folder.join("c");
            let words = ["export", path(folder), "--robot", path(&robot), "--to", to, "--force", "--out", path(&out)];
            run(&[&words[..], &["--residual", path(residual)], more].concat()).map_err(|error| format!("{error:#}"))
        };
        let corrected = folder.join("corrected.json");
        let (bare, own) = (train("bare", &[]), train("own", &["--with", path(&corrected)]));
        let refused = |told: Result<String, String>, part: &str| {
            let error = told.unwrap_err();
            assert!(error.contains(part), "{error}");
        };
        refused(export(&bare, "c", &[]), "the robot as described");
        refused(export(&own, "mjcf", &[]), "--to c");
        refused(export(&own, "c", &["--dt", "0.02"]), "steps of 0.01 s");
        refused(export(&own, "c", &["--dt", "-1"]), "--dt is -1");
        export(&own, "c", &[]).unwrap();
        let text = std::fs::read_to_string(folder.join("c/robot.c")).unwrap();
        assert!(text.contains("#define GAPSCOPE_DT 0.01\n"), "{}", &text[..1000]);
        assert!(std::fs::read(folder.join("c/residual.bin")).unwrap().starts_with(b"GSRESID1"));
    }

    #[test]
    fn ranges_come_from_a_diagnosis_with_standard_errors() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        case(folder);
        let (robot, log) = (folder.join("logs/robot.urdf"), folder.join("logs/episode_0.csv"));
        let words = ["export", path(folder), "--robot", path(&robot), "--ranges"];
        let error = format!("{:#}", run(&words).unwrap_err());
        assert!(error.contains("diagnosis.json, which has the standard errors"), "{error}");
        std::fs::write(folder.join("diagnosis.json"), "{}").unwrap();
        let error = format!("{:#}", run(&words).unwrap_err());
        assert!(error.contains("no diagnosis of logs with torque"), "{error}");
        let model = gapscope_dynamics::Model::from_urdf(&std::fs::read_to_string(&robot).unwrap()).unwrap().model;
        let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
        let logs = gapscope_datasets::read_logs(&[log], &joints, &gapscope_datasets::ReadOptions::default()).unwrap().0;
        let found = gapscope_diagnosis::diagnose(&model, &logs, Vec::new(), &|_: &str, _: f64| {}).unwrap();
        std::fs::write(folder.join("diagnosis.json"), serde_json::to_string(&found.diagnosis).unwrap()).unwrap();
        let told = run(&words).unwrap();
        let text = std::fs::read_to_string(folder.join("export/ranges.json")).unwrap();
        let ranges: Ranges = serde_json::from_str(&text).unwrap();
        assert!(told.contains(&format!("{} parameters", ranges.parameters.len())), "{told}");
        assert!(folder.join("export/sample_ranges.py").exists() && !folder.join("export/ledger.json").exists());
        // The estimate lies in the middle, and an interval of friction is narrower than its range.
        let middle: Vec<f64> = ranges.parameters.iter().map(|p| p.value).collect();
        assert!(ranges.distance(&middle).unwrap().iter().all(|away| *away < 1e-9));
        let coulomb = ranges.parameters.iter().find(|p| p.name() == "coulomb_friction.coulomb.joint1").unwrap();
        assert!(coulomb.error > 0.0 && (coulomb.value - 0.2).abs() < 4.0 * coulomb.error, "{coulomb:?}");
        assert!(coulomb.range[1] - coulomb.range[0] > 2.0 * 1.96 * coulomb.error);
        // What the answer does not name has a range as well, about nothing.
        let viscous = ranges.parameters.iter().find(|p| p.name() == "viscous_friction.viscous.joint1").unwrap();
        assert!(viscous.answer.is_none() && viscous.value.abs() < 4.0 * viscous.error, "{viscous:?}");
    }
}
