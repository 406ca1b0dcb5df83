//! What follows the figures: what is left, alternatives, the next experiment, the data, and how to check it all.

use super::format::{NONE, count, figure, group, percent, plain, with_interval, with_unit};
use super::{heatmap, words};
use gapscope_diagnosis::schema::{Combination, Diagnosis, Evidence, Gap, NextExperiment, Verdict};
use maud::{Markup, html};

/// Less than this part of the squared gap is a trace: its map folds away.
const TRACE: f64 = 0.005;
/// Findings that are listed at once; the rest folds away.
const LISTED: usize = 12;

/// What is left after the effects, and where.
pub fn unexplained(diagnosis: &Diagnosis) -> Markup {
    let left = &diagnosis.unexplained;
    html! {
        @if matches!(diagnosis.verdict, Verdict::NoGap | Verdict::NotExcited) {
            p { (words::verdict_meaning(diagnosis.verdict)) }
        } @else {
            p { (sentence(diagnosis)) }
            @if left.fraction > 0.0 && !left.regimes.is_empty() {
                @let map = heatmap::render(&diagnosis.joints, &left.regimes, "What is left, by joint and regime", "the square of what is left at the joint", &|joint: &str| !super::is_above_floor(diagnosis, joint), false);
                // Shares of next to nothing are no place to look at.
                @if left.fraction < TRACE {
                    details { summary { "Where this trace lies, by joint and regime" } (map) }
                } @else { (map) }
            }
        }
    }
}

/// How much is left after the effects, and where most clearly, in words.
pub fn sentence(diagnosis: &Diagnosis) -> String {
    let left = &diagnosis.unexplained;
    if matches!(diagnosis.verdict, Verdict::NoGap | Verdict::NotExcited) {
        return words::verdict_meaning(diagnosis.verdict).into();
    }
    if left.fraction <= 0.0 {
        return "Nothing above the noise floor.".into();
    }
    let when = if diagnosis.effects.is_empty() { ", since no effect was found" } else { " after the effects" };
    let place = words::outstanding(&left.regimes).first().map_or(String::new(), |first| {
        let (phrase, share) = (words::regime_phrase(first), percent(first.share));
        format!("; most clearly at {} {phrase}, with {share} of what is left there", first.joint)
    });
    let fraction = percent(left.fraction);
    format!(
        "{fraction} of the squared torque gap is left above the noise floor{when}{place}. {}",
        words::rest(left, &diagnosis.joints)
    )
}

/// What the logs determine of bodies; nothing where no body differs.
pub fn bodies(diagnosis: &Diagnosis) -> Option<Markup> {
    let row = |sum: &Combination| {
        let (value, ends) = with_interval(sum.value, Some(sum.ci95));
        html! {
            tr {
                th scope="row" { (words::capital(&sum.words)) }
                td.number { (with_unit(&value, &sum.unit)) }
                td.number.nowrap { (ends.unwrap_or_default()) }
            }
        }
    };
    (!diagnosis.combinations.is_empty()).then(|| html! {
        table.plain {
            thead { tr { th scope="col" { "of" } th.number scope="col" { "off by" } th.number scope="col" { "95 %" } } }
            tbody { @for sum in &diagnosis.combinations { (row(sum)) } }
        }
    })
}

/// Other sets of effects that the logs do not exclude.
pub fn alternatives(diagnosis: &Diagnosis) -> Markup {
    if diagnosis.alternatives.is_empty() {
        let text = match diagnosis.verdict {
            Verdict::NotExcited => "The logs do not tell.",
            _ => "None: no other set of effects of the catalogue comes near.",
        };
        return html! { p { (text) } };
    }
    html! {
        table.plain {
            thead { tr { th scope="col" { "instead of all effects above" } th scope="col" { "fits these logs" } } }
            tbody {
                @for alternative in &diagnosis.alternatives {
                    @let names: Vec<String> = alternative.effects.iter().map(|kind| words::effect(kind)).collect();
                    tr {
                        td { @if names.is_empty() { "no effect at all" } @else { (words::capital(&names.join(" + "))) } }
                        td { (words::beside_the_answer(alternative.probability)) }
                    }
                }
            }
        }
    }
}

/// What is said where no motion is proposed.
pub fn none_proposed(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap | Verdict::Explained => "None needed: these logs leave nothing to separate.",
        _ => "None proposed.",
    }
}

/// The motion that would tell more, or `none`; `playable` where the robot on the page can play it.
pub fn next_experiment(next: Option<&NextExperiment>, none: &str, playable: bool) -> Markup {
    let Some(next) = next else { return html! { p { (none) } } };
    html! {
        div.callout {
            @let told = words::sentences(&words::in_words(&next.motion));
            @let (act, gain) = told.split_once(". ").unwrap_or((&told, ""));
            p { b { (super::ticked(act.trim_end_matches('.'))) "." } }
            p { (super::ticked(&words::sentences(&words::in_words(&next.why)))) @if !gain.is_empty() { " " (super::ticked(gain)) } }
            @if let Some(file) = &next.trajectory {
                p { code { (file) } " beside this report has time, position, velocity and acceleration of every joint, from rest to rest, within the URDF’s limits. Diagnose its log together with these." }
            }
            @if playable {
                p.tools.needs-script { button type="button" data-play=(super::scene::NEXT) { "Play it on the robot above" } }
            }
        }
    }
}

/// What was read.
pub struct Read<'a> {
    /// Name of the robot.
    pub robot: &'a str,
    /// Number of joints, episodes and samples.
    pub joints: usize,
    pub episodes: usize,
    pub samples: usize,
    /// Length of all, s, and rate, Hz.
    pub duration: f64,
    pub rate: f64,
    /// Further facts: a word and what it is.
    pub further: Vec<(&'static str, String)>,
    /// What was odd.
    pub findings: &'a [String],
}

impl Read<'_> {
    /// The same in the fewest words.
    pub fn in_short(&self) -> Markup {
        html! {
            b { (self.robot) } " · " (count(self.joints, "joint")) ", " (count(self.episodes, "episode")) ", "
            (with_unit(&plain(self.duration), "s")) " at " (with_unit(&plain(self.rate), "Hz"))
        }
    }
}

/// What was read, and what was odd in it.
pub fn data(read: &Read) -> Markup {
    html! {
        dl.facts {
            div { dt { "robot" } dd { (read.robot) ", " (count(read.joints, "joint")) } }
            div { dt { "episodes" } dd { (group(read.episodes)) } }
            div { dt { "samples" } dd { (group(read.samples)) } }
            div { dt { "length" } dd { (with_unit(&plain(read.duration), "s")) } }
            div { dt { "rate" } dd { (with_unit(&plain(read.rate), "Hz")) } }
            @for (what, value) in &read.further { div { dt { (what) } dd { (value) } } }
        }
        h3 { "Findings" }
        @if read.findings.is_empty() {
            p { "None: nothing odd in the robot description or the logs." }
        } @else {
            (listed(&read.findings[..read.findings.len().min(LISTED)]))
            @if read.findings.len() > LISTED {
                details { summary { "and " (group(read.findings.len() - LISTED)) " more" } (listed(&read.findings[LISTED..])) }
            }
        }
    }
}

fn listed(findings: &[String]) -> Markup {
    html! { ul.findings { @for finding in findings { li { (super::ticked(finding)) } } } }
}

/// Gap of every joint in its own units, before and, where known, after.
pub fn figures(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let gap = &diagnosis.gap;
    let after = evidence.remaining.as_ref();
    html! {
        div.scroll tabindex="0" role="region" aria-label="The gap by joint in SI units" {
            table.inner.figures {
                thead {
                    tr {
                        th scope="col" { "joint" }
                        th.number scope="col" { "one step, position" }
                        th.number scope="col" { "one step, velocity" }
                        @for rollout in &gap.rollout {
                            th.number scope="col" { "rollout " (with_unit(&plain(rollout.horizon), "s")) ", position" }
                        }
                    }
                }
                tbody {
                    @for joint in &diagnosis.joints {
                        @let unit = words::position_unit(joint, evidence, &gap.regimes);
                        tr {
                            th scope="row" { (joint) }
                            td.number { (pair(gap, after, unit, |g| g.one_step.position.get(joint).copied())) }
                            td.number { (pair(gap, after, &format!("{unit}/s"), |g| g.one_step.velocity.get(joint).copied())) }
                            @for i in 0..gap.rollout.len() {
                                td.number { (pair(gap, after, unit, |g| g.rollout.get(i)?.position.get(joint).copied())) }
                            }
                        }
                    }
                }
            }
        }
        p.note { "Rms of the model as described" @if after.is_some() { " → with the effects" } ", held-out data." }
    }
}

fn pair(before: &Gap, after: Option<&Gap>, unit: &str, pick: impl Fn(&Gap) -> Option<f64>) -> String {
    let Some(first) = pick(before) else {
        return NONE.into();
    };
    match after.and_then(&pick) {
        Some(second) => format!("{} → {}", figure(first), with_unit(&figure(second), unit)),
        None => with_unit(&figure(first), unit),
    }
}
