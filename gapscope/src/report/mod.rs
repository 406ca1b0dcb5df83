//! The report: one self-contained HTML page with inline SVG, no network, the same bytes for the same input.
//!
//! It says everything without its scripts; they turn the robot, zoom the lines and filter by joint.

mod answer;
pub mod axis;
mod bars;
mod chart;
pub mod clause;
mod curves;
mod effects;
pub mod effort;
mod format;
mod gauge;
mod heatmap;
mod index;
mod joints;
mod packed;
mod paste;
pub mod plain;
mod power;
mod reproduce;
mod rest;
mod rollout;
mod scene;
pub mod score;
mod series;
pub mod servo;
mod setting;
mod shrink;
mod skeleton;
pub mod terminal;
mod why;
mod words;

#[cfg(test)]
pub(crate) mod sample;
#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::browser::look;

use gapscope_datasets::{Doubt, Fault};
use gapscope_diagnosis::schema::{Diagnosis, Evidence, Verdict};
use gauge::Gauge;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde::Serialize;

pub use answer::sentences as answer_sentences;
pub use answer::{changed, headline, is_above_floor};
pub use axis::Axis;
pub use format::{
    NONE, Printed, count, estimate, figure, percent, percent_figure, percent_interval, percent_within, plain,
    probability_figure, rolled_out, significant, span, with_unit,
};
pub use heatmap::picture as heatmap_picture;
pub use index::{Entry, Found, page as index_page};
pub use plain::largest;
pub use power::line as power_line;
pub use rest::sentence as sentence_of_the_rest;
pub use rollout::page as rollout_page;
pub use series::picture as series_picture;
pub use servo::{Beside, answer as servo_answer, html as servo_html};
pub use setting::Setting;
pub use words::{
    account, beside_the_answer, capital, effect, effects, implied_unit, in_words, interval, joints as joint_list, list,
    motion_unit, outstanding, parameter, regime, regime_phrase, rest as words_of_the_rest, said_of, sentences, verdict,
};

/// Colours, type and layout; light and dark, wide, narrow and print.
const STYLE: &str = include_str!("style.css");
/// Style and code of the chart that can be zoomed: uPlot, MIT licence.
const CHART_STYLE: &str = include_str!("uplot/uPlot.min.css");
const CHART: &str = include_str!("uplot/uPlot.iife.min.js");
const CHART_LICENCE: &str = include_str!("uplot/LICENSE");
/// The scripts of the report, which share one scope.
const SCRIPTS: [&str; 3] =
    [include_str!("script/page.js"), include_str!("script/skeleton.js"), include_str!("script/series.js")];
/// The section of lines over time, to which the list of joints leads.
const OVER_TIME: &str = "over-time";
/// What the page may load: nothing.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// What the scripts read.
#[derive(Serialize)]
struct Packet<'a> {
    words: Words<'a>,
    series: Vec<series::Packet<'a>>,
    scene: Option<scene::Packet<'a>>,
}

/// What the scripts call things.
#[derive(Serialize)]
struct Words<'a> {
    what: &'a str,
    nominal: &'a str,
    corrected: &'a str,
}

/// The report of a diagnosis as one HTML page.
///
/// Figures that are not numbers print as a dash; names from the user's files are escaped.
pub fn html(diagnosis: &Diagnosis, evidence: &Evidence, setting: &Setting) -> String {
    let gauge = Gauge::of(diagnosis, evidence);
    let top = Top {
        read: read(diagnosis),
        verdict: diagnosis.verdict,
        faults: &diagnosis.data.faults,
        doubts: &diagnosis.data.doubts,
        said: plain::answer(diagnosis).into(),
        day: &setting.made,
    };
    report(&gauge, &top, setting.scene.as_ref(), &body(&gauge, diagnosis, evidence, setting), &diagnosis.schema)
}

/// The page of any diagnosis: the answer, the robot, then the body.
fn report(gauge: &Gauge, top: &Top, scene: Option<&scene::Scene>, body: &Markup, schema: &str) -> String {
    let title = format!("{}, {}", gauge.robot, words::verdict(top.verdict));
    let words = Words { what: gauge.what, nominal: gauge.nominal, corrected: gauge.corrected };
    let packet = Packet { words, series: series::packets(gauge), scene: scene.map(scene::Scene::packet) };
    // A name that closes the script would end it: no text of JSON needs the sign as such.
    let data = serde_json::to_string(&packet).unwrap_or_default().replace('<', "\\u003c");
    let said = html! {
        (header(gauge, top, scene))
        (contents(body))
        main { (body) }
    };
    let content = html! {
        (PreEscaped(gauge.effort.say_page(&said.0)))
        p #filter role="status" hidden { "Showing " b {} " only " button type="button" { "Show all joints" } }
        script type="application/json" id="packet" { (PreEscaped(data)) }
        script { (PreEscaped(format!("/*\n{CHART_LICENCE}*/\n{CHART}"))) }
        script { (PreEscaped(format!("(() => {{\n{}\n}})();", SCRIPTS.join("\n")))) }
    };
    page(&title, &content, schema)
}

/// Sections in their order, as the line of links below the answer calls them.
const CONTENTS: [(&str, &str); 18] = [
    (OVER_TIME, "Over time"),
    ("effects", "Effects"),
    ("drive", "Drives"),
    ("laws", "Laws"),
    ("change", "What to change"),
    ("joints", "By joint"),
    ("regimes", "Where"),
    ("shrink", "How far"),
    ("left", "What is left"),
    ("bodies", "Bodies"),
    ("alternatives", "What else"),
    ("open", "Left open"),
    ("why", "Why"),
    ("next", "Next"),
    ("power", "Could have shown"),
    ("data", "Data"),
    ("reproduce", "Reproduce"),
    ("top", "↑ Top"),
];

/// A line of links to the sections that the page has; it stays in sight.
fn contents(body: &Markup) -> Markup {
    let there = |id: &&(&str, &str)| id.0 == "top" || body.0.contains(&format!("<section id=\"{}\"", id.0));
    html! {
        nav.contents aria-label="Sections" {
            @for (id, name) in CONTENTS.iter().filter(there) { a href={ "#" (id) } { (name) } }
        }
    }
}

/// One self-contained page.
fn page(title: &str, content: &Markup, schema: &str) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="generator" content={ "gapscope " (env!("CARGO_PKG_VERSION")) };
                title { "gapscope: " (title) }
                style { (PreEscaped(CHART_STYLE)) (PreEscaped(STYLE)) }
            }
            body {
                (content)
                footer { "gapscope " (env!("CARGO_PKG_VERSION")) " · " (schema) }
            }
        }
    };
    page.into_string()
}

/// What stands on top of a report.
struct Top<'a> {
    read: rest::Read<'a>,
    verdict: Verdict,
    faults: &'a [Fault],
    doubts: &'a [Doubt],
    /// The answer, a line each.
    said: Vec<String>,
    /// The day on which it was made; may be empty.
    day: &'a str,
}

fn read(diagnosis: &Diagnosis) -> rest::Read<'_> {
    let data = &diagnosis.data;
    rest::Read {
        robot: &diagnosis.robot,
        joints: diagnosis.joints.len(),
        episodes: data.episodes,
        samples: data.samples,
        duration: data.duration,
        rate: data.rate,
        further: vec![("torque compared below", with_unit(&plain(data.band), "Hz"))],
        findings: &data.findings,
    }
}

fn header(gauge: &Gauge, top: &Top, scene: Option<&scene::Scene>) -> Markup {
    html! {
        header #top {
            div.opening {
                div {
                    p.kicker { (top.read.in_short()) @if !top.day.is_empty() { " · " span.nowrap { (top.day) } } }
                    // What is wrong with the logs comes before any verdict on them, and no such verdict is green.
                    @for fault in top.faults { p.fault role="alert" { b { "Fault of the data. " } (ticked(&crate::input::fault_line(fault))) } }
                    @for doubt in top.doubts { p.fault { b { "In doubt. " } (ticked(&words::capital(&doubt.question))) } }
                    @let (tone, of) = tone(top);
                    h1 class=(tone) { (words::verdict(top.verdict)) (of) }
                    div.said { @for line in &top.said { p { (words::breaking_text(&unbroken(line))) } } }
                }
                (skeleton::picture(gauge, scene))
                (skeleton::list(gauge))
            }
        }
    }
}

/// Class of the verdict, and what it holds for beside the logs as they are.
fn tone(top: &Top) -> (&'static str, &'static str) {
    let of = match top {
        _ if top.faults.iter().any(|fault| fault.mended) => ", of mended logs",
        _ if !top.faults.is_empty() => ", of faulty logs",
        _ if !top.doubts.is_empty() => ", with a question open",
        _ => "",
    };
    (tone_of(top.verdict, of.is_empty()), of)
}

/// Class of a verdict's colour; `sound` logs are those without fault or question.
fn tone_of(verdict: Verdict, sound: bool) -> &'static str {
    match verdict {
        Verdict::NoGap | Verdict::Explained if sound => "good",
        Verdict::NoGap | Verdict::Explained | Verdict::PartlyExplained => "partly",
        Verdict::UnknownEffect | Verdict::NotExcited => "open",
    }
}

/// One part of the page under its heading.
fn section(id: &str, title: &str, lead: &str, content: &Markup) -> Markup {
    html! {
        section id=(id) aria-labelledby={ (id) "-title" } {
            h2 id={ (id) "-title" } { (title) }
            @if !lead.is_empty() { p.lead { (lead) } }
            (content)
        }
    }
}

fn body(gauge: &Gauge, diagnosis: &Diagnosis, evidence: &Evidence, setting: &Setting) -> Markup {
    let evaluated = diagnosis.verdict != Verdict::NotExcited || !diagnosis.gap.torque.rms.is_empty();
    let robot = match evidence.robot_file.as_str() {
        "" => "ROBOT.urdf".to_owned(),
        file => reproduce::shown(file),
    };
    html! {
        @if evaluated { (section(OVER_TIME, "Torque over time", "", &series::render(gauge))) }
        @let lead = match diagnosis.effects.len() {
            0 => "",
            _ => "What the robot does that the model does not, strongest first. Of the effects reported with a confidence of 90 %, nine in ten are there.",
        };
        (section("effects", "Effects", lead,
            &effects::render(&plain::together(diagnosis), &diagnosis.joints, "alone, torque gap shrinks by", words::nothing_found(diagnosis.verdict))))
        @if evaluated && !diagnosis.effects.is_empty() { (laws(diagnosis, evidence)) }
        @if let Some(paste) = paste::render(diagnosis, setting, &robot) {
            (section("change", "What to change", "", &paste))
        }
        @if evaluated { (figures(gauge, diagnosis, evidence)) }
        @if let Some(bodies) = rest::bodies(diagnosis) {
            (section("bodies", "What the logs tell of bodies", "Sums over all that a joint carries, where those of single links are not told: differences from the robot description, surest first.", &bodies))
        }
        @if evaluated && diagnosis.verdict != Verdict::NoGap {
            (section("alternatives", "What else it could be", "Other sets of effects that these logs do not exclude.", &rest::alternatives(diagnosis)))
        }
        @if let Some(why) = why::render(&diagnosis.why, &diagnosis.joints) {
            (section("why", "Why it is so", "What was proposed, against what, and by how much the logs spoke for it.", &why))
        }
        (section("next", "The next experiment", "", &{
            let none = rest::none_proposed(diagnosis.verdict);
            rest::next_experiment(diagnosis.next_experiment.as_ref(), none, setting.scene.as_ref().is_some_and(scene::Scene::plays_next))
        }))
        @if !diagnosis.power.is_empty() {
            (section("power", "What these logs could have revealed", "The least size of each effect that would have been found. Anything smaller could be there, and nobody could tell from these logs.",
                &power::render(diagnosis)))
        }
        (section("data", "Data and findings", "", &html! {
            (rest::data(&read(diagnosis)))
            details { summary { "The gap by joint in SI units" } (rest::figures(diagnosis, evidence)) }
        }))
        (section("reproduce", "How to reproduce", "", &reproduce::render(&reproduce::Made {
            robot: &evidence.robot_file,
            logs: &evidence.logs,
            options: String::new(),
            corrected: (!diagnosis.effects.is_empty()).then_some(evidence.corrected_file.as_str()),
            what: "torque",
            origin: setting.origin.as_ref(),
            day: &setting.made,
        })))
    }
}

fn laws(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    html! {
        (section("laws", "The law of each effect", "Each dot is what the data ask of this effect; the band is its 95 % interval. Laws of several parameters have no band: the table above has their intervals.",
            &curves::render(&curves::of(evidence, &diagnosis.effects), &diagnosis.joints, "No curves were kept for this report.")))
    }
}

/// The sections that rest on an evaluation: left out where the logs allowed none.
fn figures(gauge: &Gauge, diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let quiet = |joint: &str| !is_above_floor(diagnosis, joint);
    let [place, _, how_far] = answer::sentences(diagnosis, evidence);
    html! {
        (section("joints", "Torque gap by joint", "Measured torque less what the model needs for the same motion, rms on held-out data.",
            &joints::render(gauge)))
        (section("regimes", "Where the gap lies", "In which regimes of the motion the model as described is off, on held-out data.",
            &html! {
                p.point { (unbroken(&place)) }
                (heatmap::render(&diagnosis.joints, &diagnosis.gap.regimes, "Gap by joint and regime", "the joint’s squared torque gap", &quiet, true))
            }))
        (section("shrink", "How far it shrinks", "", &html! {
            p.point { (unbroken(&how_far)) }
            (shrink::render(diagnosis))
        }))
        (section("left", "What is left unexplained", "", &rest::unexplained(diagnosis)))
    }
}

/// A text whose ranges stay in one line.
fn unbroken(text: &str) -> String {
    text.replace('–', "–\u{2060}")
}

/// Names of joints for the page's filter, as JSON; none stands for the whole robot.
fn listed(joints: &[String]) -> String {
    serde_json::to_string(joints).unwrap_or_default()
}

/// Text whose parts between backticks are code.
fn ticked(text: &str) -> Markup {
    let parts: Vec<&str> = text.split('`').collect();
    // An odd one stays what it is.
    let paired = parts.len() % 2 == 1;
    html! {
        @if paired {
            @for (i, part) in parts.iter().enumerate() { @if i % 2 == 1 { code { (part) } } @else { (part) } }
        } @else { (text) }
    }
}
