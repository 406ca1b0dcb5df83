//! What to change in the robot description, ready to paste, and what no description holds.

use super::setting::Setting;
use super::words;
use gapscope_diagnosis::schema::Diagnosis;
use gapscope_export::{How, TargetLedger};
use maud::{Markup, html};

/// The boxes and the tables below them; `None` where no effect was found.
pub fn render(diagnosis: &Diagnosis, setting: &Setting, robot: &str) -> Option<Markup> {
    if diagnosis.effects.is_empty() {
        return None;
    }
    let command = format!("gapscope export FOLDER --robot {robot} --to urdf,mjcf");
    let [own, others @ ..] = setting.ledgers.as_slice() else {
        return Some(html! {
            p { "The corrected model for your simulator, where FOLDER is the one that holds this report:" }
            (super::reproduce::boxed("export", &command))
        });
    };
    let pasted = setting.ledgers.iter().any(|ledger| !ledger.paste.is_empty());
    Some(html! {
        @if pasted {
            p { "Numbers are totals: what the file had is included. Units are those of the joint: N m s/rad and N m, N s/m and N where it slides." }
            div.grid-two.top { (one(own)) @for other in others { (one(other)) } }
            p { "Or all of it at once, where FOLDER is the one that holds this report:" }
        } @else {
            p { "Nothing here is a number of one joint. The whole corrected file, where FOLDER is the one that holds this report:" }
        }
        (super::reproduce::boxed("export", &command))
        @for ledger in &setting.ledgers {
            details {
                summary { "What " (format_of(ledger)) " holds of each effect" }
                (table(ledger, diagnosis))
            }
        }
    })
}

fn format_of(ledger: &TargetLedger) -> &'static str {
    if ledger.target == "mjcf" { "an MJCF" } else { "a URDF" }
}

/// What to paste into one format, a line for each joint.
fn one(ledger: &TargetLedger) -> Markup {
    let mjcf = ledger.target == "mjcf";
    let lines: Vec<(&str, &str)> = ledger.paste.iter().filter_map(|line| line.split_once(": ")).collect();
    let line = |(joint, text): &(&str, &str)| match mjcf {
        true => format!("{joint}:  {text}"),
        false => format!("{text}  <!-- {joint} -->"),
    };
    let text: Vec<String> = lines.iter().map(line).collect();
    let lacking: Vec<String> =
        ledger.effects.iter().filter(|entry| entry.how == How::LeftOut).map(|entry| entry.kind.clone()).collect();
    html! {
        @if !text.is_empty() {
            div {
                h3 { @if mjcf { "Attributes for the joints of an MJCF" } @else { "Elements for the joints of a URDF" } }
                (super::reproduce::boxed(&format!("paste-{}", ledger.target), &text.join("\n")))
                @if !lacking.is_empty() {
                    p.note { (words::capital(format_of(ledger))) " has nothing for " (words::list(&words::effects(&lacking), "and")) "." }
                }
            }
        }
    }
}

fn table(ledger: &TargetLedger, diagnosis: &Diagnosis) -> Markup {
    let name = format!("What {} holds of each effect", format_of(ledger));
    html! {
        div.scroll tabindex="0" role="region" aria-label=(name) {
            table.plain {
                thead { tr { th scope="col" { "effect" } th scope="col" { "joints" } th scope="col" { "there" } th scope="col" { "as" } } }
                tbody {
                    @for entry in &ledger.effects {
                        tr data-joints=(super::listed(&entry.joints)) {
                            td { (words::capital(&words::effect(&entry.kind))) }
                            td { (words::joints(&entry.joints, &diagnosis.joints)) }
                            td { (entry.how.words()) }
                            td { (super::ticked(&entry.r#as)) }
                        }
                    }
                }
            }
        }
    }
}
