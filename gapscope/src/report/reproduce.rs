//! How to check it all: who made this of what and when, and the commands that make it again.

use gapscope_diagnosis::Origin;
use maud::{Markup, html};
use std::path::Path;

/// Digits of a digest that tell files apart by eye; `corrected.json` has them all.
const DIGITS: usize = 16;
/// Logs that are listed at once; the rest folds away.
const LISTED: usize = 8;
/// What stands in a command for logs that it does not name: none are known, or more than are read.
const LOGS: &str = "LOG...";

/// What a diagnosis was made of, and what it wrote.
pub struct Made<'a> {
    /// Robot description and logs as given on the command line; may be empty.
    pub robot: &'a str,
    pub logs: &'a [String],
    /// Further options of the call, ready for a shell; empty for none.
    pub options: String,
    /// The corrected model that was written; `None` where the model needs no correction.
    pub corrected: Option<&'a str>,
    /// The quantity whose samples can be written.
    pub what: &'static str,
    /// Digests of model and logs.
    pub origin: Option<&'a Origin>,
    /// The day, UTC; may be empty.
    pub day: &'a str,
}

/// Version, day, digests, commands.
pub fn render(made: &Made) -> Markup {
    let or = |text: &str, otherwise: &str| {
        if text.is_empty() { otherwise.to_string() } else { quote(&shown(text)) }
    };
    let robot = or(made.robot, "ROBOT.urdf");
    let logs: Vec<String> = made.logs.iter().map(|log| quote(&shown(log))).collect();
    let many = logs.len() > LISTED;
    let logs = if logs.is_empty() || many { LOGS.into() } else { logs.join(" ") };
    let with = made.corrected.map_or_else(String::new, |file| format!(" --with {}", or(file, "corrected.json")));
    let options = &made.options;
    let commands = [
        (
            "The same figures on logs that this diagnosis has not seen".to_owned(),
            format!("gapscope evaluate {robot} OTHER_LOG...{options}{with}"),
        ),
        (
            format!("Measured and modelled {} of every sample, to check the figures by other means", made.what),
            format!("gapscope evaluate {robot} {logs}{options}{with} --predictions predictions.csv"),
        ),
        ("This report and diagnosis.json again".to_owned(), format!("gapscope diagnose {robot} {logs}{options}")),
    ];
    html! {
        dl.facts {
            div { dt { "program" } dd { "gapscope " (env!("CARGO_PKG_VERSION")) } }
            @if !made.day.is_empty() { div { dt { "made on" } dd { (made.day) } } }
        }
        (digests(made))
        @for (i, (what, command)) in commands.iter().enumerate() {
            p { (what) ":" }
            (boxed(&format!("command-{i}"), command))
        }
        @if many { p.note { code { (LOGS) } " stands for the " (made.logs.len()) " logs above, in their order." } }
        p.note { "Names are relative to the folder in which the command was called, or bare where it was given a whole path." }
    }
}

/// Text to copy. Its lines break between words alone: half a flag is none.
pub fn boxed(id: &str, text: &str) -> Markup {
    let line = |line: &str| {
        html! { @for (i, word) in line.split(' ').enumerate() { @if i > 0 { " " } @if !word.is_empty() { span.word { (word) } } } }
    };
    html! {
        div.paste {
            pre id=(id) tabindex="0" { @for (i, text) in text.split('\n').enumerate() { @if i > 0 { "\n" } (line(text)) } }
            button.needs-script type="button" data-copy=(id) { "Copy" }
        }
    }
}

fn digests(made: &Made) -> Markup {
    let Some(origin) = made.origin else { return html! {} };
    let robot = (shown(made.robot), origin.robot.as_str());
    let logs = made.logs.iter().zip(&origin.logs).map(|(log, digest)| (shown(log), digest.as_str()));
    let rows: Vec<(String, &str)> = std::iter::once(robot).chain(logs).collect();
    let list = |rows: &[(String, &str)]| {
        html! {
            ul.digests {
                @for (name, digest) in rows {
                    li { span { (name) } " " code title=(digest) { (digest.chars().take(DIGITS).collect::<String>()) } }
                }
            }
        }
    };
    html! {
        p { "Digests of what was read:" }
        (list(&rows[..rows.len().min(LISTED)]))
        @if rows.len() > LISTED {
            details { summary { "and " (rows.len() - LISTED) " more" } (list(&rows[LISTED..])) }
        }
    }
}

/// A path as it may leave this machine: relative as it was given, else the name alone.
pub fn shown(path: &str) -> String {
    let as_path = Path::new(path);
    let inside = as_path.is_relative() && !path.starts_with("..");
    let name = as_path.file_name().map(|name| name.to_string_lossy().into_owned());
    if inside { path.to_owned() } else { name.unwrap_or_else(|| path.to_owned()) }
}

/// A word as a shell takes it.
pub fn quote(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
    if text.chars().all(plain) { text.into() } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_path_of_this_machine_leaves_it() {
        assert_eq!(shown("logs/run 1.csv"), "logs/run 1.csv");
        for path in ["/home/me/logs/run 1.csv", "../logs/run 1.csv"] {
            assert_eq!(shown(path), "run 1.csv");
        }
    }
}
