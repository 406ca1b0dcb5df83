//! The report of a servo arm: the same page as of a robot whose logs hold torque, of position under the set points.

mod answer;
mod change;
pub mod schema;

use super::effort::Effort;
use super::format::{self, percent, percent_interval, percent_within, with_unit};
use super::gauge::{Figure, Gauge, JointGap};
use super::scene::Scene;
use super::{Top, curves, effects, heatmap, joints, reproduce, rest, section, series, setting, why, words};
use crate::input::Loaded;
use gapscope_datasets::{Doubt, Episode, Fault};
use gapscope_diagnosis::Origin;
use gapscope_diagnosis::schema::{Series, Verdict};
use gapscope_dynamics::{JointKind, Model};
use gapscope_servo::schema::{Diagnosis, Estimate, FoundDrive};
use gapscope_servo::{Evidence, Outcome, Signal};
use maud::{Markup, html};
use std::collections::BTreeMap;

pub use answer::{answer, nominal, offset, unit};
pub use change::{Changes, Line};

/// What is said where no further set points are proposed.
const NONE_PROPOSED: &str =
    "None: every number is known to a tenth of itself, or no motion of 20 s would tell it much better.";
/// Part of a joint's samples whose speed a curve shows: the fastest are noise of the encoder.
const USUAL: f64 = 0.99;

/// Everything of the page that the diagnosis does not hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Beside {
    scene: Option<Scene>,
    series: Vec<Series>,
    /// Unit of a thousandth of each joint's position.
    units: BTreeMap<String, &'static str>,
    /// Usual greatest speed of each joint, rad/s.
    speeds: BTreeMap<String, f64>,
    faults: Vec<Fault>,
    doubts: Vec<Doubt>,
    /// Faults and doubts in lines, as the findings have them.
    warnings: Vec<String>,
    origin: Option<Origin>,
    robot_file: String,
    logs: Vec<String>,
    drive_file: Option<String>,
    day: String,
}

impl Beside {
    /// What stands in the files; the runs come with [`Beside::with`].
    pub fn of_files(loaded: &Loaded, robot_file: String, logs: Vec<String>, drive_file: Option<String>) -> Beside {
        Beside {
            faults: loaded.faults.clone(),
            doubts: loaded.doubts.clone(),
            warnings: loaded.warnings(),
            origin: Some(loaded.origin.clone()),
            robot_file,
            logs,
            drive_file,
            day: setting::today(),
            ..Beside::default()
        }
    }

    /// What is wrong with the logs beyond doubt.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// What may be wrong with them.
    pub fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    /// Both in lines, as the findings have them.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What the drives push with.
    pub fn effort(&self) -> Effort {
        Effort::of_units(self.units.values().map(|unit| if *unit == "mm" { "N" } else { "N m" }))
    }

    /// Adds what a diagnosis made of the logs.
    #[must_use]
    pub fn with(mut self, model: &Model, episodes: &[Episode], outcome: &Outcome) -> Beside {
        let evidence = &outcome.evidence;
        let scene = Scene::new(model, episodes);
        let scene = scene.with_free_run(model, episodes, &evidence.nominal, &evidence.corrected);
        self.scene = Some(match &outcome.trajectory {
            Some(motion) => scene.with_motion(model, motion),
            None => scene,
        });
        for (j, joint) in model.joints().iter().enumerate() {
            let [unit, small] = if joint.kind == JointKind::Prismatic { ["m", "mm"] } else { ["rad", "mrad"] };
            self.series.push(lines(&joint.name, unit, j, episodes, evidence));
            self.units.insert(joint.name.clone(), small);
            self.speeds.insert(joint.name.clone(), usual_speed(episodes, j));
        }
        self
    }
}

fn lines(joint: &str, unit: &str, j: usize, episodes: &[Episode], evidence: &Evidence) -> Series {
    let mut lines = Series { joint: joint.to_owned(), unit: unit.to_owned(), ..Series::default() };
    let mut offset = 0.0;
    for (log, episode) in episodes.iter().enumerate() {
        if log > 0 {
            lines.breaks.push(lines.time.len());
        }
        let start = episode.time.first().copied().unwrap_or(0.0);
        lines.time.extend(episode.time.iter().map(|t| offset + t - start));
        offset += episode.len() as f64 * episode.dt();
        lines.measured.extend(&episode.position[j]);
        for (paths, line) in [(&evidence.nominal, &mut lines.nominal), (&evidence.corrected, &mut lines.corrected)] {
            line.extend(paths.get(log).and_then(|path| path.get(j)).into_iter().flatten());
        }
    }
    lines
}

fn usual_speed(episodes: &[Episode], j: usize) -> f64 {
    let of = |e: &Episode| -> Vec<f64> {
        let steps = e.time.windows(3).zip(e.position[j].windows(3));
        steps.map(|(t, q)| ((q[2] - q[0]) / (t[2] - t[0])).abs()).filter(|v| v.is_finite()).collect()
    };
    let mut speeds: Vec<f64> = episodes.iter().flat_map(of).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.get((USUAL * speeds.len() as f64) as usize).copied().filter(|v| *v > 0.0).unwrap_or(1.0)
}

/// The page. `corrected` is the file of the corrected model beside it.
pub fn html(outcome: &Outcome, beside: &Beside, corrected: &str) -> String {
    let Outcome { diagnosis, evidence, .. } = outcome;
    let gauge = gauge(diagnosis, evidence, beside);
    let findings: Vec<String> =
        diagnosis.data.findings.iter().filter(|finding| !beside.warnings.contains(finding)).cloned().collect();
    let data = &diagnosis.data;
    let top = Top {
        read: rest::Read {
            robot: &diagnosis.robot,
            joints: diagnosis.joints.len(),
            episodes: data.episodes,
            samples: data.samples,
            duration: data.duration,
            rate: data.rate,
            further: vec![("torque", "none in the logs".to_owned())],
            findings: &findings,
        },
        verdict: schema::verdict(&diagnosis.verdict),
        faults: &beside.faults,
        doubts: &beside.doubts,
        said: answer(diagnosis).into(),
        day: &beside.day,
    };
    let change = change::render(diagnosis, &outcome.corrected);
    let body = body(&gauge, diagnosis, evidence, beside, corrected, &top, change);
    super::report(&gauge, &top, beside.scene.as_ref(), &body, &diagnosis.schema)
}

fn gauge(diagnosis: &Diagnosis, evidence: &Evidence, beside: &Beside) -> Gauge {
    let gap = &diagnosis.gap.position;
    // Thousandths, unless a joint is off by a whole unit.
    let scale = if gap.rms.values().all(|rms| *rms < 0.9995) { 1e3 } else { 1.0 };
    let scaled = |map: &BTreeMap<String, f64>, joint: &str| map.get(joint).map(|rms| scale * rms);
    let figure =
        |map: &BTreeMap<String, f64>, joint: &str| scaled(map, joint).map(|value| Figure { value, ci95: None });
    let unit = |joint: &str| {
        let small = beside.units.get(joint).copied().unwrap_or("mrad");
        if scale > 1.0 { small } else { &small[1..] }.to_owned()
    };
    let joint = |name: &String| JointGap {
        name: name.clone(),
        unit: unit(name),
        before: figure(&gap.rms, name),
        after: figure(&evidence.remaining, name),
        floor: scaled(&gap.floor, name),
    };
    Gauge {
        effort: beside.effort(),
        what: "position",
        nominal: nominal(diagnosis),
        corrected: "the arm found here",
        robot: diagnosis.robot.clone(),
        joints: diagnosis.joints.iter().map(joint).collect(),
        series: beside.series.clone(),
    }
}

fn body(
    gauge: &Gauge,
    diagnosis: &Diagnosis,
    evidence: &Evidence,
    beside: &Beside,
    corrected: &str,
    top: &Top,
    change: Option<Markup>,
) -> Markup {
    let found = schema::effects(&diagnosis.effects);
    let all = &diagnosis.joints;
    let quiet = |joint: &str| gauge.joint(joint).is_none_or(|joint| !joint.is_above_floor());
    let nothing = match top.verdict {
        Verdict::NotExcited => "These logs cannot show one effect or another.",
        Verdict::UnknownEffect => "Nothing that I know explains what the drives leave.",
        _ => "The drives alone fit these logs.",
    };
    let regimes = schema::regimes(&diagnosis.gap.regimes);
    let left = schema::regimes(&evidence.left);
    let curves = schema::curves(&diagnosis.effects, &beside.speeds);
    html! {
        (section(super::OVER_TIME, "Position over time", "The arm runs free: a model starts where the log does and sees its set points alone.", &series::render(gauge)))
        (section("effects", "Effects", "What the arm has beside its drives, strongest first.",
            &effects::render(&found, all, "with it, position gap shrinks by", nothing)))
        (section("drive", "What drives each joint", "Found together with the effects, as the logs hold no torque.", &drives(diagnosis)))
        @if !found.is_empty() {
            (section("laws", "The law of each effect", "Friction over speed. No data lie behind the curves, as nothing measured the torque; what is no friction has its interval in the table above.",
                &curves::render(&curves, all, "None of the effects found is friction over speed.")))
        }
        @if let Some(change) = change { (section("change", "What to change", "", &change)) }
        (section("joints", "Position gap by joint", &weighted(diagnosis), &joints::render(gauge)))
        (section("regimes", "Where the gap lies", &format!("Share of each regime in its joint’s squared position gap, for {}.", gauge.nominal),
            &heatmap::render(all, &regimes, "Gap by joint and regime", "the joint’s squared position gap", &quiet, true)))
        (section("left", "What is left unexplained", "", &html! {
            p { (unexplained(diagnosis)) }
            (heatmap::render(all, &left, "What is left, by joint and regime", "the square of what is left at the joint", &quiet, false))
        }))
        (section("open", "What these logs leave open", "", &open(diagnosis)))
        @if let Some(why) = why::render(&schema::why(&diagnosis.why), all) {
            (section("why", "Why it is so", "What was proposed, against what, and by how much the logs spoke for it.", &why))
        }
        @let next = diagnosis.next_experiment.as_ref().map(schema::next_experiment);
        (section("next", "The next experiment", "",
            &rest::next_experiment(next.as_ref(), NONE_PROPOSED, beside.scene.as_ref().is_some_and(Scene::plays_next))))
        (section("data", "Data and findings", "", &rest::data(&top.read)))
        (section("reproduce", "How to reproduce", "", &reproduce::render(&reproduce::Made {
            robot: &beside.robot_file,
            logs: &beside.logs,
            options: beside.drive_file.as_ref().map_or_else(String::new, |file| format!(" --drive {}", reproduce::quote(&reproduce::shown(file)))),
            corrected: Some(corrected),
            what: "position",
            origin: beside.origin.as_ref(),
            day: &beside.day,
        })))
    }
}

/// The gap of all joints in one figure, before and after.
fn weighted(diagnosis: &Diagnosis) -> String {
    let change = &diagnosis.shrink.position;
    let lead = "Position of the free run less the measured one, rms on held-out data.";
    let (Some(before), Some(after), Some(shrink)) = (change.before, change.after, change.shrink) else {
        return lead.to_owned();
    };
    let interval =
        change.ci95.map_or_else(String::new, |ends| format!(" (95\u{202f}% interval {})", percent_interval(ends)));
    let unit = unit(&diagnosis.gap.regimes, None);
    let moves = if shrink < 0.0 { "grows" } else { "shrinks" };
    format!(
        "{lead} Over all joints, each by how far it is told to move, it {moves} from {} to {}, by {}{interval}.",
        offset(before, after, unit),
        offset(after, before, unit),
        percent_within(shrink.abs(), change.ci95)
    )
}

fn unexplained(diagnosis: &Diagnosis) -> String {
    let fraction = diagnosis.unexplained.fraction;
    if fraction <= 0.0 {
        return "Nothing above the encoder’s own step.".into();
    }
    format!("{} of the squared position gap is left above the encoder’s own step.", percent(fraction))
}

/// The kinds that say a constant is not the given one.
const OTHERWISE: [(&str, &str); 4] = [
    ("stiffness", "servo_gain_error"),
    ("damping", "servo_damping_error"),
    ("speed_limit", "speed_limit"),
    ("dead_band", "dead_band"),
];

/// Whether a constant of a joint is known, in words; nothing where the logs tell it.
pub fn known(diagnosis: &Diagnosis, joint: &str, name: &str) -> Option<&'static str> {
    let drive = diagnosis.drive.get(joint)?;
    let otherwise =
        |kind: &str| diagnosis.effects.iter().any(|e| e.kind == kind && e.joints.iter().any(|j| j == joint));
    if drive.given.iter().any(|given| given == name) {
        let found = OTHERWISE.iter().any(|(constant, kind)| *constant == name && otherwise(kind));
        return Some(if found { "not the given one" } else { "given" });
    }
    drive.constants.get(name).is_some_and(|found| !found.determined).then_some("not determined")
}

/// What a drive follows.
pub fn follows(drive: &FoundDrive) -> &'static str {
    match drive.follows {
        Signal::Command => "set point",
        Signal::Voltage => "voltage",
        Signal::Current => "current",
        Signal::Effort => "effort",
    }
}

fn drives(diagnosis: &Diagnosis) -> Markup {
    let drives = diagnosis.joints.iter().filter_map(|joint| Some((joint, diagnosis.drive.get(joint)?)));
    html! {
        div.scroll tabindex="0" role="region" aria-label="What drives each joint" {
            table.plain.drives {
                thead { tr {
                    th scope="col" { "constant" } th.number scope="col" { "value" } th.number scope="col" { "95 % interval" }
                } }
                @for (joint, drive) in drives {
                    tbody data-joints=(super::listed(std::slice::from_ref(joint))) {
                        tr { th scope="rowgroup" colspan="3" { b { (joint) } span.muted { " follows its " (follows(drive)) } } }
                        @if drive.constants.is_empty() { tr { td.muted colspan="3" { "No constant is determined." } } }
                        @for (name, found) in &drive.constants { (constant(name, found, known(diagnosis, joint, name))) }
                    }
                }
            }
        }
        @for (joint, drive) in diagnosis.drive.iter().filter(|(_, drive)| !drive.gains.is_empty()) {
            p.note data-joints=(super::listed(std::slice::from_ref(joint))) {
                (joint) ", gain of each log over the first one’s: "
                (drive.gains.iter().map(|(log, gain)| format!("{log} {}", format::plain(*gain))).collect::<Vec<_>>().join(", "))
            }
        }
    }
}

fn constant(name: &str, found: &Estimate, known: Option<&str>) -> Markup {
    let printed = format::estimate(&schema::estimate(found));
    html! {
        tr {
            td { (words::parameter(name)) }
            td.number { b { (printed.value) } (with_unit("", &printed.unit)) }
            td.number {
                @if known != Some("given") { (printed.interval.join(" ")) " " }
                @if let Some(known) = known { span.muted { (known) } }
            }
        }
    }
}

/// What the logs leave open, each with the joints that it holds for.
fn open(diagnosis: &Diagnosis) -> Markup {
    let mut list: Vec<(&str, Vec<String>)> = vec![];
    for joint in &diagnosis.joints {
        for text in diagnosis.drive.get(joint).into_iter().flat_map(|drive| &drive.open) {
            match list.iter_mut().find(|(other, _)| other == text) {
                Some((_, joints)) => joints.push(joint.clone()),
                None => list.push((text, vec![joint.clone()])),
            }
        }
    }
    html! {
        @if list.is_empty() { p { "Nothing: every constant of the drives is determined." } }
        @else {
            ul.findings {
                @for (text, joints) in &list {
                    li data-joints=(super::listed(joints)) { b { (words::joints(joints, &diagnosis.joints)) } ": " (super::ticked(text)) }
                }
            }
        }
    }
}
