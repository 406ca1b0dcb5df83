//! `gapscope diagnose` and `gapscope evaluate` on logs without torque: servo arms.

use crate::cli::{Diagnose, Evaluate};
use crate::input::Loaded;
use crate::report::terminal::{Paint, clean, wrap};
use crate::report::{self, Beside, joint_list};
use crate::rollout::Rollout;
use crate::summary;
use anyhow::{Context, Result, bail};
use gapscope_servo::schema::{Change, Diagnosis, Estimate, Evaluation, FoundDrive, FoundEffect, Parameter};
use gapscope_servo::{Given, Outcome, Paths, ServoModel};
use std::fmt::Write;
use std::path::Path;

/// Comparisons, logs and findings that a summary shows at most.
const SHOWN: usize = 12;
const FINDINGS: usize = 4;

/// Whether some log lacks the effort of some joint.
pub fn lacks_effort(loaded: &Loaded) -> bool {
    loaded.episodes.iter().any(|episode| !episode.has_effort())
}

fn given(file: Option<&Path>, loaded: &Loaded) -> Result<Given> {
    let Some(file) = file else { return Ok(Given::default()) };
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    let joints: Vec<String> = loaded.model.joints().iter().map(|joint| joint.name.clone()).collect();
    Given::from_toml(&text, &joints).with_context(|| file.display().to_string())
}

/// Diagnoses a servo arm; beside it what its report says of robot and files.
///
/// # Errors
/// A `--drive` file that cannot be read.
pub fn diagnosed(args: &Diagnose, loaded: &Loaded, progress: &(dyn Fn(&str, f64) + Sync)) -> Result<(Outcome, Beside)> {
    let given = given(args.drive.as_deref(), loaded)?;
    let outcome = gapscope_servo::diagnose(&loaded.model, &loaded.episodes, &given, loaded.said(), progress)?;
    let name = |path: &Path| path.display().to_string();
    let logs = args.input.logs.iter().map(|log| name(log)).collect();
    let beside = Beside::of_files(loaded, name(&args.input.robot), logs, args.drive.as_deref().map(name));
    let beside = beside.with(&loaded.model, &loaded.episodes, &outcome.evidence);
    Ok((outcome, beside))
}

/// The files of its results in a folder.
///
/// # Errors
/// Numbers that JSON cannot hold.
pub fn files(outcome: &Outcome, beside: &Beside, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
    let corrected = out.join("corrected.json").display().to_string();
    Ok(vec![
        ("diagnosis.json", Some(serde_json::to_string_pretty(&outcome.diagnosis)?)),
        ("corrected.json", Some(serde_json::to_string_pretty(&outcome.corrected)?)),
        ("report.html", Some(report::servo_html(outcome, beside, &corrected))),
    ])
}

/// The answer alone, in three sentences.
pub fn answer(diagnosis: &Diagnosis, paint: &Paint) -> String {
    let lines = report::servo_answer(diagnosis);
    let lines: Vec<String> = lines.iter().flat_map(|line| wrap(&clean(line), paint.width)).collect();
    plain(&lines)
}

/// Which, where and how far, a sentence each.
pub fn sentences(diagnosis: &Diagnosis) -> [String; 3] {
    let effects: Vec<String> = diagnosis.effects.iter().map(|found| effect(found, &diagnosis.joints)).collect();
    let which = if effects.is_empty() { "none is claimed".to_owned() } else { effects.join("; ") };
    let worst = place(diagnosis).unwrap_or_else(|| "no joint moves".to_owned());
    let far = format!("free run under the set points, held out: {}", change(&diagnosis.shrink.position));
    [format!("{}. Effects: {which}", headline(diagnosis)), worst, far]
}

fn place(diagnosis: &Diagnosis) -> Option<String> {
    let (joint, rms) = diagnosis.gap.position.rms.iter().max_by(|a, b| a.1.total_cmp(b.1))?;
    let nominal = if diagnosis.gap.nominal == "given_servo" { "the given servo" } else { "perfect tracking" };
    Some(format!("largest at {joint}: {} rms from {nominal}", mrad(*rms)))
}

/// The corrected servo arm of a file, where one is given.
fn corrected(file: Option<&Path>, loaded: &Loaded) -> Result<Option<ServoModel>> {
    let Some(file) = file else { return Ok(None) };
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    if !ServoModel::is_one(&text) {
        bail!(
            "{}: the logs hold no torque, but this corrected model has no `drive`; use one that `gapscope diagnose` made of logs without torque",
            file.display()
        );
    }
    Ok(Some(ServoModel::from_json(&text, &loaded.model).with_context(|| file.display().to_string())?))
}

/// Rolls a servo arm's models out under the set points of logs; returns what to print.
///
/// # Errors
/// A file that cannot be read or does not fit the robot or the logs; networks, which need a torque.
pub fn rolled(args: &Rollout, loaded: &Loaded) -> Result<String> {
    if args.residual.is_some() || args.pure.is_some() {
        bail!("the logs hold no torque: --residual and --pure step by it; leave them out");
    }
    let given = given(args.drive.as_deref(), loaded)?;
    let corrected = corrected(args.with.as_deref(), loaded)?;
    let (model, episodes) = (&loaded.model, &loaded.episodes);
    let growth = gapscope_servo::rollouts(model, episodes, &given, corrected.as_ref(), args.horizon, args.starts)?;
    let mut text = format!(
        "{} · rollouts under the set points, error of all joints' positions together, mrad: median (90 %)\n\n{:12}{:>10}{:>24}{:>24}\n",
        model.name(),
        "horizon, s",
        "rollouts",
        "nominal",
        if corrected.is_some() { "corrected" } else { "" }
    );
    let cell = |[median, high]: [f64; 2]| format!("{:.2} ({:.2})", 1e3 * median, 1e3 * high);
    for row in growth {
        let after = row.corrected.map_or(String::new(), cell);
        let _ = writeln!(text, "{:<12.3}{:>10}{:>24}{:>24}", row.horizon, row.starts, cell(row.nominal), after);
    }
    Ok(text)
}

/// Evaluates a servo arm's model.
///
/// # Errors
/// A file that cannot be read or does not fit the robot or the logs.
pub fn evaluated(args: &Evaluate, loaded: &Loaded) -> Result<(Evaluation, Paths)> {
    let given = given(args.drive.as_deref(), loaded)?;
    let corrected = corrected(args.with.as_deref(), loaded)?;
    Ok(gapscope_servo::evaluate(&loaded.model, &loaded.episodes, &given, corrected.as_ref())?)
}

/// One row for each sample: log, time, then measured and simulated position of each joint.
pub fn table(loaded: &Loaded, paths: &[Vec<Vec<f64>>]) -> String {
    let mut text = String::from("log,time");
    for channel in ["measured", "simulated"] {
        for joint in loaded.model.joints() {
            let _ = write!(text, ",{channel}.{}", joint.name);
        }
    }
    text.push('\n');
    for (episode, path) in loaded.episodes.iter().zip(paths) {
        for (k, time) in episode.time.iter().enumerate() {
            let _ = write!(text, "\"{}\",{time}", episode.name.replace('"', "\"\""));
            for row in episode.position.iter().chain(path) {
                let _ = write!(text, ",{}", row[k]);
            }
            text.push('\n');
        }
    }
    text
}

fn mrad(value: f64) -> String {
    format!("{:.2} mrad", 1e3 * value)
}

fn change(change: &Change) -> String {
    match (change.before, change.after) {
        (Some(before), Some(after)) => {
            let shrink = change.shrink.map_or("at the floor".to_owned(), |s| {
                format!("{}{:.1} %", if s < 0.0 { "+" } else { "−" }, 100.0 * s.abs())
            });
            format!("{} → {}  {shrink}", mrad(before), mrad(after))
        }
        (Some(before), None) => format!("{} → the corrected arm cannot be simulated there", mrad(before)),
        _ => "cannot be simulated".to_owned(),
    }
}

/// `11.3 (10.2 to 12.4) N m/rad`; open where the logs do not bound it.
fn estimate(found: &Estimate) -> String {
    let end = |end: Option<f64>| end.map_or("open".to_owned(), figure);
    let [low, high] = found.ci95;
    let interval = match (low, high) {
        (None, None) => String::new(),
        (Some(low), Some(high)) if low == high => String::new(),
        _ => format!(" ({} to {})", end(low), end(high)),
    };
    let word = if found.determined { "" } else { ", not determined" };
    let unit = if found.unit == "-" { String::new() } else { format!(" {}", found.unit) };
    format!("{}{interval}{unit}{word}", figure(found.value))
}

fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}

fn counted(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// The diagnosis in some lines.
pub fn summary(diagnosis: &Diagnosis, out: Option<&Path>, paint: &Paint) -> String {
    let data = &diagnosis.data;
    let mut lines = vec![
        format!(
            "{} · {}, {}, {:.0} s at {:.0} Hz, no torque: what drives each joint was found with its effects",
            diagnosis.robot,
            counted(diagnosis.joints.len(), "joint"),
            counted(data.episodes, "episode"),
            data.duration,
            data.rate
        ),
        format!("{}  {}", diagnosis.verdict.to_uppercase().replace('_', " "), headline(diagnosis)),
        String::new(),
    ];
    for (at, found) in diagnosis.effects.iter().enumerate() {
        lines.push(format!("{:8} {}", if at == 0 { "Which" } else { "" }, effect(found, &diagnosis.joints)));
        lines.extend(parameters(found).into_iter().map(|line| format!("{:11}{line}", "")));
    }
    if diagnosis.effects.is_empty() {
        lines.push("Which    none is claimed".to_owned());
    }
    for (at, (joint, drive)) in diagnosis.drive.iter().enumerate() {
        lines.push(format!("{:8} {joint}: {}", if at == 0 { "Drive" } else { "" }, driven(drive)));
        lines.extend(drive.open.iter().map(|open| format!("{:11}{open}", "")));
    }
    if let Some(place) = place(diagnosis) {
        lines.push(format!("Where    {place}"));
    }
    for regime in diagnosis.gap.regimes.iter().filter(|r| r.ci95[0] > r.samples).take(3) {
        lines.push(format!(
            "         {}  {}  {:.0} % of squared gap, {:.0} % of samples",
            regime.joint,
            regime.regime.replace('_', " "),
            100.0 * regime.share,
            100.0 * regime.samples
        ));
    }
    lines.push(format!("How far  free run under the set points, held out: {}", change(&diagnosis.shrink.position)));
    for (at, finding) in data.findings.iter().take(FINDINGS).enumerate() {
        lines.push(format!("{:8} {finding}", if at == 0 { "Notes" } else { "" }));
    }
    if data.findings.len() > FINDINGS {
        lines.push(format!("         and {} more, in diagnosis.json", data.findings.len() - FINDINGS));
    }
    if let Some(out) = out {
        lines.push(format!("Report   {}", out.join("report.html").display()));
    }
    format!("{}\n{}", answer(diagnosis, paint), plain(&lines))
}

/// Lines joined, free of control characters: a log's words cannot steer the terminal.
fn plain(lines: &[String]) -> String {
    summary::ordinary_spaces(&lines.iter().map(|line| clean(line)).collect::<Vec<_>>())
}

fn headline(diagnosis: &Diagnosis) -> String {
    let left = format!("{:.0} % of the squared gap is left", 100.0 * diagnosis.unexplained.fraction);
    match diagnosis.verdict.as_str() {
        "not_excited" => "no joint moves or is told to".to_owned(),
        "no_gap" => format!("the drives alone explain the logs; {left}"),
        "unknown_effect" => format!("something is there that no effect of the catalogue explains; {left}"),
        _ => format!("effects on top of the drives explain the logs; {left}"),
    }
}

fn effect(found: &FoundEffect, all: &[String]) -> String {
    let mut text = format!(
        "{}  {}  {:.0} % sure",
        found.kind.replace('_', " "),
        joint_list(&found.joints, all),
        (100.0 * found.confidence).min(99.9).floor()
    );
    if !found.indistinguishable_from.is_empty() {
        let kinds: Vec<String> = found.indistinguishable_from.iter().map(|kind| kind.replace('_', " ")).collect();
        let _ = write!(text, "; could also be {}", kinds.join(" or "));
    }
    text
}

fn parameters(found: &FoundEffect) -> Vec<String> {
    let row = |(name, found): (&String, &Parameter)| match found {
        Parameter::Single(e) => format!("{name}: {}", estimate(e)),
        Parameter::Vector(v) => {
            let cells: Vec<String> = v.value.iter().map(|x| figure(*x)).collect();
            format!("{name}: ({}) {}", cells.join(", "), v.unit)
        }
        Parameter::PerJoint(joints) => {
            let cells: Vec<String> = joints.iter().map(|(joint, e)| format!("{joint} {}", estimate(e))).collect();
            format!("{name}: {}", cells.join("; "))
        }
    };
    found.parameters.iter().map(row).collect()
}

fn driven(drive: &FoundDrive) -> String {
    let follows = report::servo_follows(drive);
    let cell = |(name, e): (&String, &Estimate)| {
        let known = if drive.given.contains(name) { " (given)" } else { "" };
        format!("{} {}{known}", name.replace('_', " "), estimate(e))
    };
    let cells: Vec<String> = drive.constants.iter().map(cell).collect();
    if cells.is_empty() {
        format!("follows its {follows}")
    } else {
        format!("follows its {follows}; {}", cells.join("; "))
    }
}

pub fn why(diagnosis: &Diagnosis) -> String {
    let mut lines =
        vec![String::new(), "Why      what was proposed, and by how many nats it won (+) or lost (-)".to_owned()];
    for why in &diagnosis.why {
        let word = if why.taken { "taken" } else { "no" };
        lines.push(format!(
            "  {word:5}  {:+9.1}  {} at {}, against {}",
            why.odds,
            why.proposed,
            why.joints.join(", "),
            why.against
        ));
    }
    plain(&lines)
}

pub fn evaluation_summary(evaluation: &Evaluation) -> String {
    let mut lines = Vec::new();
    if let Some(shrink) = &evaluation.shrink {
        lines.push(format!("How far  free run under the set points: {}", change(&shrink.position)));
    }
    if let Some(mean) = evaluation.mean_absolute {
        lines.push(format!("         mean absolute error {}", mrad(mean)));
    }
    for (at, (joint, rms)) in evaluation.gap.position.rms.iter().enumerate() {
        let after = evaluation.after.get(joint).map_or(String::new(), |after| format!(" → {}", mrad(*after)));
        lines.push(format!("{:8} {joint}  {} rms{after}", if at == 0 { "Where" } else { "" }, mrad(*rms)));
    }
    for (at, log) in evaluation.logs.iter().take(SHOWN).enumerate() {
        lines.push(format!("{:8} {}  {}", if at == 0 { "Logs" } else { "" }, log.log, change(&log.position)));
    }
    if evaluation.logs.len() > SHOWN {
        lines.push(format!("         and {} more", evaluation.logs.len() - SHOWN));
    }
    plain(&lines)
}
