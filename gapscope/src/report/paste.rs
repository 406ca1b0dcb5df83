//! What to change in the robot description, ready to paste, and what no description holds.

use super::setting::Setting;
use super::words;
use gapscope_diagnosis::schema::Diagnosis;
use maud::{Markup, html};

/// The box and the table below it; `None` where no effect was found.
pub fn render(diagnosis: &Diagnosis, setting: &Setting, robot: &str) -> Option<Markup> {
    if diagnosis.effects.is_empty() {
        return None;
    }
    let command = format!("gapscope export FOLDER --robot {robot} --to urdf,mjcf");
    let Some(ledger) = &setting.ledger else {
        return Some(html! {
            p { "The corrected model for your simulator, where FOLDER is the one that holds this report:" }
            (boxed("paste", &command))
        });
    };
    let text: Vec<String> = ledger
        .paste
        .iter()
        .filter_map(|line| line.split_once(": "))
        .map(|(joint, element)| format!("<!-- in your URDF, joint {joint} -->\n{element}"))
        .collect();
    Some(html! {
        @if text.is_empty() {
            p { "Nothing here is a number of one joint’s friction. The whole corrected file, where FOLDER is the one that holds this report:" }
            (boxed("paste", &command))
        } @else {
            p { "Damping and friction in all, what the file had included: N m s/rad and N m, N s/m and N where a joint slides." }
            (boxed("paste", &text.join("\n")))
            p { "Or all of it at once, where FOLDER is the one that holds this report:" }
            (boxed("export", &command))
        }
        details {
            summary { "What a URDF holds of each effect" }
            div.scroll tabindex="0" role="region" aria-label="What a URDF holds of each effect" {
                table.plain {
                    thead { tr { th scope="col" { "effect" } th scope="col" { "joints" } th scope="col" { "in a URDF" } th scope="col" { "as" } } }
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
    })
}

fn boxed(id: &str, text: &str) -> Markup {
    html! {
        div.paste {
            pre id=(id) tabindex="0" { (text) }
            button.needs-script type="button" data-copy=(id) { "Copy" }
        }
    }
}
