//! What the logs could have revealed: the least size of each effect, joint by joint.

use super::format::{NONE, range, significant, with_unit};
use super::words;
use gapscope_diagnosis::schema::{Diagnosis, Power};
use maud::{Markup, html};

/// Kinds that a line of text names.
const TOLD: [&str; 4] = ["coulomb_friction", "viscous_friction", "torque_bias", "payload"];

/// The table: effects in rows, joints in columns; what concerns the whole robot stands in a column of its own.
pub fn render(diagnosis: &Diagnosis) -> Markup {
    let rows = rows(&diagnosis.power);
    let whole = diagnosis.power.iter().any(|p| p.joints.is_empty());
    html! {
        div.scroll tabindex="0" role="region" aria-label="Least size of each effect by joint" {
            table.inner.figures {
                thead {
                    tr {
                        th scope="col" { "effect" }
                        th scope="col" { "size of" }
                        @for joint in &diagnosis.joints { th.number scope="col" { (joint) } }
                        @if whole { th.number scope="col" { "whole robot" } }
                        th scope="col" { "unit" }
                    }
                }
                tbody {
                    @for row in rows {
                        @let first = row[0];
                        tr {
                            th scope="row" { (words::capital(&words::effect(&first.kind))) }
                            td { (measure(first)) }
                            @for joint in &diagnosis.joints {
                                td.number { (cell(&row, |p| p.joints.last() == Some(joint))) }
                            }
                            @if whole { td.number { (cell(&row, |p| p.joints.is_empty())) } }
                            td.nowrap { (with_unit("", &first.unit).trim()) }
                        }
                    }
                }
            }
        }
        p.note {
            "Beside the effects found, at the selection’s own bar; – where no size shows. A coupling stands at its second joint, "
            "a load at the joint that carries it, as a point at the link’s centre of mass. Springs and play in a drive show by "
            "what the rotor behind them does: – where none was found."
        }
    }
}

/// One line: from what size the commonest effects would have been found, over the joints.
pub fn line(power: &[Power]) -> Option<String> {
    let told: Vec<String> = TOLD
        .iter()
        .filter_map(|kind| {
            let sizes: Vec<&Power> = power.iter().filter(|p| p.kind == *kind && p.size.is_some()).collect();
            let size = |p: &&Power| p.size.unwrap_or(f64::NAN);
            let least = sizes.iter().map(size).fold(f64::INFINITY, f64::min);
            let most = sizes.iter().map(size).fold(0.0, f64::max);
            let [from, to] = [least, most].map(|x| significant(x, 2));
            let span = if from == to { from } else { range(&from, &to) };
            Some(format!("{} from {}", words::effect(kind), with_unit(&span, &sizes.first()?.unit)))
        })
        .collect();
    (!told.is_empty()).then(|| format!("{} would have been seen", words::list(&told, "and")))
}

/// Entries that share kind, parameter and unit, in the order in which they come.
fn rows(power: &[Power]) -> Vec<Vec<&Power>> {
    let mut rows: Vec<Vec<&Power>> = vec![];
    for entry in power {
        let same = |row: &&mut Vec<&Power>| {
            let first = row[0];
            (&first.kind, &first.parameter, &first.unit) == (&entry.kind, &entry.parameter, &entry.unit)
        };
        match rows.iter_mut().find(same) {
            Some(row) => row.push(entry),
            None => rows.push(vec![entry]),
        }
    }
    rows
}

fn cell(row: &[&Power], here: impl Fn(&Power) -> bool) -> String {
    let size = row.iter().find(|p| here(p)).and_then(|p| p.size);
    size.map_or(NONE.into(), |size| significant(size, 2))
}

/// The parameter, and which way its size counts.
fn measure(power: &Power) -> String {
    let name = words::parameter(&power.parameter);
    match (power.kind.as_str(), power.parameter.as_str()) {
        ("joint_elasticity", "stiffness") | ("torque_saturation", "limit") => format!("{name}, at most"),
        ("torque_gain_error", "gain") => format!("{name}, off one by"),
        ("stribeck_friction", "static") => format!("{name}, above Coulomb"),
        _ => name,
    }
}
