//! An index over many diagnoses: one page with a table to sort and filter, and any two side by side.

use super::effort::Effort;
use super::format::{NONE, group, percent, probability_figure};
use super::{plain, ticked, words};
use gapscope_diagnosis::schema::{Change, Diagnosis, Verdict};
use maud::{Markup, PreEscaped, html};

const SCRIPT: &str = include_str!("script/index.js");
/// Effects that a row names; the two side by side have them all.
const NAMED: usize = 3;

/// Files left out that stand above the table; the rest folds away.
const LEFT_OUT: usize = 3;

/// Headings; figures from the fifth on.
const HEADS: [&str; 9] =
    ["diagnosis", "robot", "verdict", "effects", "sure", "gap before", "gap after", "unexplained", "faults"];

/// One diagnosis of the index.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its folder, relative to the page; empty for the page's own.
    pub folder: String,
    /// Whether a report lies in it.
    pub has_report: bool,
    /// What it says.
    pub found: Found,
}

/// What the index says of a diagnosis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// Name of the robot.
    pub robot: String,
    /// The verdict in words, and the class of its colour.
    pub verdict: String,
    pub tone: &'static str,
    /// Effects in words, strongest first.
    pub effects: Vec<String>,
    /// Confidence of the strongest.
    pub sure: Option<f64>,
    /// The gap before and after, to sort by and as text.
    pub gap: [(f64, String); 2],
    /// What stays unexplained, a part of the squared gap.
    pub left: f64,
    /// Faults of the data in words.
    pub faults: Vec<String>,
    /// The answer in sentences.
    pub answer: Vec<String>,
    /// Each effect with its joints and confidence.
    pub details: Vec<String>,
}

impl From<&Diagnosis> for Found {
    fn from(found: &Diagnosis) -> Found {
        let [before, after] = gaps(&found.shrink.torque, found.effects.is_empty());
        let effects = plain::together(found);
        let effort = Effort::of(&found.gap.regimes);
        let detail = |e: &gapscope_diagnosis::schema::FoundEffect| {
            let (kind, place) = (words::capital(&words::effect(&e.kind)), words::joints(&e.joints, &found.joints));
            format!("{}, {place}, {}\u{202f}% sure", effort.say(&kind), probability_figure(e.confidence))
        };
        Found {
            robot: found.robot.clone(),
            verdict: words::verdict(found.verdict).into(),
            tone: super::tone_of(found.verdict, found.data.faults.is_empty() && found.data.doubts.is_empty()),
            effects: words::effects(&effects.iter().map(|e| e.kind.clone()).collect::<Vec<_>>())
                .iter()
                .map(|name| effort.say(name))
                .collect(),
            sure: effects.first().map(|e| e.confidence),
            gap: [before, after].map(|gap| (gap, percent(gap))),
            left: found.unexplained.fraction,
            faults: found.data.faults.iter().map(crate::input::fault_line).collect(),
            answer: plain::answer(found).into(),
            details: effects.iter().map(detail).collect(),
        }
    }
}

impl From<&gapscope_servo::schema::Diagnosis> for Found {
    fn from(found: &gapscope_servo::schema::Diagnosis) -> Found {
        let change = &found.shrink.position;
        let [before, after] = [change.before, change.after].map(|gap| gap.unwrap_or(f64::NAN));
        let unit = super::servo::unit(&found.gap.regimes, None);
        let gap = |gap: f64, beside: f64| {
            (gap, if gap.is_finite() { super::servo::offset(gap, beside, unit) } else { NONE.into() })
        };
        let gaps = [gap(before, after), gap(after, before)];
        let verdict = super::servo::schema::verdict(&found.verdict);
        let list = found.effects.iter();
        let detail = |e: &gapscope_servo::schema::FoundEffect| {
            let (kind, place) = (words::capital(&words::effect(&e.kind)), words::joints(&e.joints, &found.joints));
            format!("{kind}, {place}, {}\u{202f}% sure", probability_figure(e.confidence))
        };
        let details: Vec<String> = list.clone().map(detail).collect();
        Found {
            robot: found.robot.clone(),
            verdict: words::verdict(verdict).into(),
            tone: super::tone_of(verdict, true),
            effects: words::effects(&list.map(|e| e.kind.clone()).collect::<Vec<_>>()),
            sure: found.effects.first().map(|e| e.confidence),
            answer: super::servo_answer(found).into(),
            gap: gaps,
            left: found.unexplained.fraction,
            faults: vec![],
            details,
        }
    }
}

/// A row's figures in the order of the columns, to sort by.
struct Cell {
    text: String,
    sort: String,
    number: bool,
}

/// The page. `left_out` says in words which files could not be read.
pub fn page(title: &str, entries: &[Entry], left_out: &[String]) -> String {
    let content = html! {
        header {
            h1 { (title) ": " (group(entries.len())) @if entries.len() == 1 { " diagnosis" } @else { " diagnoses" } }
            p.tally {
                @for (verdict, tone, n) in verdicts(entries) { span class=(tone) { i.spot {} (group(n)) " " (verdict.to_lowercase()) } }
                @let faulty = entries.iter().filter(|entry| !entry.found.faults.is_empty()).count();
                @if faulty > 0 { span.partly { (group(faulty)) " with faults of the data" } }
            }
            @for text in left_out.iter().take(LEFT_OUT) { p.fault { (text) } }
            @if left_out.len() > LEFT_OUT {
                details {
                    summary { "and " (group(left_out.len() - LEFT_OUT)) " more that are left out" }
                    @for text in &left_out[LEFT_OUT..] { p.fault { (text) } }
                }
            }
        }
        main {
            div.tools.needs-script {
                label { "find " input id="find" type="search" placeholder="name, robot, effect"; }
                label { "verdict " select id="verdict" {
                    option value="" { "all" }
                    @for (verdict, ..) in verdicts(entries) { option { (verdict) } }
                } }
                span #shown role="status" {}
            }
            p.note.needs-script { "A heading sorts. Tick two rows to see them side by side." }
            div #beside {}
            div.scroll tabindex="0" role="region" aria-label="All diagnoses" {
                table #diagnoses .plain {
                    thead { tr {
                        th.needs-script scope="col" { span.sr { "side by side" } }
                        @for (i, head) in HEADS.iter().enumerate() {
                            th.number[i >= 4] scope="col" { button type="button" data-column=(i) { (head) } }
                        }
                    } }
                    tbody { @for (i, entry) in entries.iter().enumerate() { (row(i, entry)) } }
                }
            }
            p.note { "Gap of the effort, a torque or force: weighted rms, parts of its spread, on held-out data. Of a servo arm, whose logs hold none: by how much its free run is off. Unexplained: of the squared gap." }
            details { summary { "All answers in words" } div #answers { @for (i, entry) in entries.iter().enumerate() { (card(i, entry)) } } }
        }
        script { (PreEscaped(SCRIPT)) }
    };
    super::page(title, &content, "gapscope.index/1")
}

/// Each verdict that occurs, the class of its colour, and how often; in their usual order.
fn verdicts(entries: &[Entry]) -> Vec<(&'static str, &'static str, usize)> {
    use Verdict::{Explained, NoGap, NotExcited, PartlyExplained, UnknownEffect};
    let of = |verdict| {
        let name = words::verdict(verdict);
        (name, super::tone_of(verdict, true), entries.iter().filter(|entry| entry.found.verdict == name).count())
    };
    let all = [NoGap, Explained, PartlyExplained, UnknownEffect, NotExcited].map(of);
    all.into_iter().filter(|(.., n)| *n > 0).collect()
}

fn name(entry: &Entry) -> &str {
    if entry.folder.is_empty() { "." } else { &entry.folder }
}

fn row(i: usize, entry: &Entry) -> Markup {
    let found = &entry.found;
    let cells = cells(found);
    html! {
        tr data-name=(name(entry)) data-verdict=(found.verdict) data-card=(format!("card-{i}")) {
            td.needs-script { input type="checkbox" aria-label={ "side by side: " (name(entry)) }; }
            th scope="row" data-sort=(name(entry)) { (link(entry)) }
            @for (cell, head) in cells.iter().zip(&HEADS[1..]) {
                td.number[cell.number] .verdict[*head == "verdict"] data-sort=(cell.sort) data-label=(head) {
                    @if *head == "verdict" { i class={ "spot " (found.tone) } {} }
                    (cell.text)
                }
            }
        }
    }
}

fn link(entry: &Entry) -> Markup {
    let file = if entry.folder.is_empty() {
        "report.html".to_owned()
    } else {
        format!("{}/report.html", address(&entry.folder))
    };
    let parts = words::breaking(name(entry));
    html! { @if entry.has_report { a href=(file) { (parts) } } @else { (parts) } }
}

/// A path as an address: what a browser would read as something else is written by its code.
fn address(path: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.~/".contains(&b);
    let code = |b: u8| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") };
    // A first part with a colon would be a scheme.
    format!("./{}", path.bytes().map(code).collect::<String>())
}

fn cells(found: &Found) -> Vec<Cell> {
    let text = |text: String| Cell { sort: text.to_lowercase(), text, number: false };
    let number = |value: f64, text: String| {
        let sort = if value.is_finite() { format!("{value:e}") } else { String::new() };
        Cell { text, sort, number: true }
    };
    let mut kinds: Vec<String> = found.effects.iter().take(NAMED).cloned().collect();
    if found.effects.len() > NAMED {
        kinds.push(format!("{}\u{a0}more", found.effects.len() - NAMED));
    }
    let sure = found.sure.map_or(NONE.into(), |sure| format!("{}\u{202f}%", probability_figure(sure)));
    let [(before, before_text), (after, after_text)] = found.gap.clone();
    vec![
        text(found.robot.clone()),
        text(found.verdict.clone()),
        text(if kinds.is_empty() { "none".into() } else { kinds.join(", ") }),
        number(found.sure.unwrap_or(f64::NAN), sure),
        number(before, before_text),
        number(after, after_text),
        number(found.left, percent(found.left)),
        number(
            found.faults.len() as f64,
            if found.faults.is_empty() { NONE.into() } else { found.faults.len().to_string() },
        ),
    ]
}

/// Before and after; nothing was corrected where no effect was found.
fn gaps(change: &Change, none: bool) -> [f64; 2] {
    let [before, after] = change.gaps();
    [before, if none { before } else { after }]
}

/// The answer of one diagnosis, to stand beside another.
fn card(i: usize, entry: &Entry) -> Markup {
    let found = &entry.found;
    html! {
        article id=(format!("card-{i}")) {
            h2 { (link(entry)) }
            p.muted { (found.robot) ", " (found.verdict) }
            @for line in &found.answer { p { (line) } }
            @for fault in &found.faults { p.fault { (ticked(fault)) } }
            @if !found.details.is_empty() { ul { @for detail in &found.details { li { (detail) } } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn names_of_folders_are_addresses() {
        assert_eq!(address("a b/c:d#1"), "./a%20b/c%3Ad%231");
    }

    #[test]
    fn every_diagnosis_has_a_row_and_an_answer() {
        let entries: Vec<Entry> = sample::all()
            .into_iter()
            .map(|(name, diagnosis, _)| Entry { folder: name.into(), has_report: true, found: Found::from(&diagnosis) })
            .collect();
        let page = page("logs", &entries, &["bad/diagnosis.json: no JSON".into()]);
        assert_eq!(page.matches("<tr data-name").count(), entries.len());
        assert_eq!(page.matches("<article").count(), entries.len());
        assert!(page.contains("./explained/report.html") && page.contains("no JSON"));
        assert!(!page.contains("NaN") && !page.contains("<script>alert"));
    }
}
