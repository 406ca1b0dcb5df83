//! The report: one self-contained HTML page with inline SVG, no network, no scripts, the same bytes for the same input.

mod answer;
pub mod axis;
mod bars;
mod chart;
mod curves;
mod effects;
mod format;
mod heatmap;
mod joints;
mod power;
mod rest;
mod rollout;
pub mod score;
mod series;
mod shrink;
pub mod terminal;
mod words;

#[cfg(test)]
pub(crate) mod sample;
#[cfg(test)]
mod tests;

use gapscope_diagnosis::schema::{Diagnosis, Evidence, Verdict};
use maud::{DOCTYPE, Markup, PreEscaped, html};

pub use answer::sentences as answer_sentences;
pub use answer::{changed, headline, is_above_floor, largest};
pub use axis::Axis;
pub use format::{
    NONE, Printed, count, estimate, figure, percent, percent_figure, percent_interval, plain, probability_figure,
    significant, span, with_unit,
};
pub use heatmap::picture as heatmap_picture;
pub use power::line as power_line;
pub use rest::sentence as sentence_of_the_rest;
pub use rollout::page as rollout_page;
pub use series::picture as series_picture;
pub use words::{
    capital, effect, implied_unit, interval, joints as joint_list, motion_unit, outstanding, parameter, regime,
    regime_phrase, rest as words_of_the_rest, said_of, verdict,
};

/// Colours, type and layout; light and dark, wide, narrow and print.
const STYLE: &str = include_str!("style.css");

/// The report of a diagnosis as one HTML page.
///
/// Figures that are not numbers print as a dash; names from the user's files are escaped.
pub fn html(diagnosis: &Diagnosis, evidence: &Evidence) -> String {
    let sentences = answer::sentences(diagnosis, evidence);
    let title = format!("{}, {}", diagnosis.robot, words::verdict(diagnosis.verdict));
    let content = html! {
        (header(diagnosis, &sentences))
        main { (body(diagnosis, evidence)) }
    };
    page(&title, &content, &diagnosis.schema)
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
                meta name="generator" content={ "gapscope " (env!("CARGO_PKG_VERSION")) };
                title { "gapscope: " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (content)
                footer { "gapscope " (env!("CARGO_PKG_VERSION")) " · " (schema) }
            }
        }
    };
    page.into_string()
}

fn header(diagnosis: &Diagnosis, sentences: &[String; 3]) -> Markup {
    let data = &diagnosis.data;
    html! {
        header {
            p.kicker {
                "Gap between simulator and robot · " b { (diagnosis.robot) } " · " (count(data.episodes, "episode")) ", "
                (with_unit(&plain(data.duration), "s")) " at " (with_unit(&plain(data.rate), "Hz"))
            }
            @for fault in &data.faults { p.fault role="alert" { b { "Fault of the data. " } (crate::input::fault_line(fault)) } }
            @for doubt in &data.doubts { p.fault { b { "In doubt. " } (doubt.question) } }
            h1 class=(tone(diagnosis.verdict)) { (words::verdict(diagnosis.verdict)) }
            p.meaning { (words::verdict_meaning(diagnosis.verdict)) }
            dl.answer {
                @for (question, sentence) in ["Where", "Which", "How far"].into_iter().zip(sentences) {
                    div { dt { (question) } dd { (sentence.replace('–', "–\u{2060}")) } }
                }
            }
        }
    }
}

fn tone(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap | Verdict::Explained => "good",
        Verdict::PartlyExplained => "partly",
        Verdict::UnknownEffect | Verdict::NotExcited => "open",
    }
}

fn body(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let section = |id: &str, title: &str, lead: &str, content: Markup| {
        html! {
            section id=(id) aria-labelledby={ (id) "-title" } {
                h2 id={ (id) "-title" } { (title) }
                @if !lead.is_empty() { p.lead { (lead) } }
                (content)
            }
        }
    };
    let evaluated = diagnosis.verdict != Verdict::NotExcited || !diagnosis.gap.torque.rms.is_empty();
    html! {
        (section("effects", "Effects", "What the robot does that the model does not, strongest first. Of the effects reported with a confidence of 90 %, nine in ten are there.",
            effects::render(diagnosis)))
        @if evaluated {
            (figures(&section, diagnosis, evidence))
        }
        (section("alternatives", "What else it could be", "Other sets of effects that these logs do not exclude.", rest::alternatives(diagnosis)))
        (section("next", "The next experiment", "", rest::next_experiment(diagnosis)))
        @if !diagnosis.power.is_empty() {
            (section("power", "What these logs could have revealed", "The least size of each effect that would have been found. Anything smaller could be there, and nobody could tell from these logs.",
                power::render(diagnosis)))
        }
        (section("data", "Data", "", rest::data(diagnosis, evidence)))
        (section("reproduce", "How to reproduce", "", rest::reproduce(diagnosis, evidence)))
    }
}

/// The sections that rest on an evaluation: left out where the logs allowed none.
fn figures(section: &dyn Fn(&str, &str, &str, Markup) -> Markup, diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    html! {
        (section("regimes", "Where the gap lies", "Share of each regime in its joint’s squared torque gap, for the model as described, on held-out data.",
            heatmap::render(&diagnosis.joints, &diagnosis.gap.regimes, "Gap by joint and regime", "the joint’s squared torque gap")))
        (section("joints", "Torque gap by joint", "Measured torque less what the model needs for the same motion, rms on held-out data.",
            joints::render(diagnosis, evidence)))
        (section("torque", "Torque over time", "", series::render(diagnosis, evidence)))
        (section("shrink", "How far it shrinks", "", shrink::render(diagnosis)))
        (section("laws", "The law of each effect", "", curves::render(diagnosis, evidence)))
        (section("left", "What is left unexplained", "", rest::unexplained(diagnosis)))
    }
}
