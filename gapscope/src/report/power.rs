//! What the logs could have revealed: the least size of each effect, joint by joint.

use super::format::{NONE, significant, with_unit};
use super::words;
use gapscope_diagnosis::schema::{Diagnosis, Power};
use maud::{Markup, html};

/// Kinds that a line of text names.
const TOLD: [&str; 4] = ["coulomb_friction", "viscous_friction", "torque_bias", "payload"];

/// Sizes that nothing has, by unit: a mass that no joint carries, an angle beyond half a turn. Where only more would show,
/// nothing does.
const NOTHING_HAS: [(&str, f64); 2] = [("kg", 1e3), ("rad", std::f64::consts::PI)];
/// A gear that loses more than it transmits stands still.
const NO_GEAR: f64 = 1.0;

/// Joints that have a column each; of more the least and the greatest size stand with their joints.
const COLUMNS: usize = 12;

/// The table: effects in rows, joints in columns; what concerns the whole robot stands in a column of its own.
pub fn render(diagnosis: &Diagnosis) -> Markup {
    let many = diagnosis.joints.len() > COLUMNS;
    let rows = rows(&diagnosis.power);
    let whole = diagnosis.power.iter().any(|p| p.joints.is_empty());
    html! {
        div.scroll tabindex="0" role="region" aria-label="Least size of each effect by joint" {
            table.inner.figures {
                thead {
                    tr {
                        th scope="col" { "effect" }
                        th scope="col" { "size of" }
                        @if many { th.number scope="col" { "least" } th.number scope="col" { "greatest" } }
                        @else { @for joint in &diagnosis.joints { th.number scope="col" { (joint) } } }
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
                            @if many { @for end in ends(&row) { td.number.named { (end) } } }
                            @else {
                                @for joint in &diagnosis.joints {
                                    td.number { (cell(&row, |p| p.joints.last() == Some(joint))) }
                                }
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
            let mut sizes: Vec<&Power> = power.iter().filter(|p| p.kind == *kind && shown(p).is_some()).collect();
            // Joints that slide have another unit than those that turn: the commoner one is told.
            let of = |unit: &str| sizes.iter().filter(|p| p.unit == unit).count();
            let unit = sizes.iter().max_by_key(|p| of(&p.unit))?.unit.clone();
            sizes.retain(|p| p.unit == unit);
            let size = |p: &&Power| p.size.unwrap_or(f64::NAN);
            let least = sizes.iter().map(size).fold(f64::INFINITY, f64::min);
            let most = sizes.iter().map(size).fold(0.0, f64::max);
            let [from, to] = [least, most].map(|x| significant(x, 2));
            let (name, unit) = (words::effect(kind), &sizes.first()?.unit);
            Some(if from == to {
                format!("{name} from {}", with_unit(&from, unit))
            } else {
                format!("{name} from {from} to {}, by joint,", with_unit(&to, unit))
            })
        })
        .collect();
    (!told.is_empty()).then(|| format!("{} would have been seen", words::list(&told, "and").replace(",,", ",")))
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

/// The least and the greatest size of a row, each with its joint.
fn ends(row: &[&Power]) -> [String; 2] {
    let sizes = || row.iter().filter_map(|p| Some((shown(p)?, p.joints.last()?)));
    let by_size = |a: &(f64, &String), b: &(f64, &String)| a.0.total_cmp(&b.0);
    [sizes().min_by(by_size), sizes().max_by(by_size)]
        .map(|end| end.map_or(NONE.into(), |(size, joint)| format!("{} at {joint}", significant(size, 2))))
}

fn cell(row: &[&Power], here: impl Fn(&Power) -> bool) -> String {
    row.iter().find(|p| here(p)).and_then(|p| shown(p)).map_or(NONE.into(), |size| significant(size, 2))
}

/// The least size that shows; `None` where nothing of a size that there is would.
fn shown(power: &Power) -> Option<f64> {
    let by_unit = NOTHING_HAS.iter().find(|(unit, _)| *unit == power.unit).map(|(_, most)| *most);
    let most = if power.kind == "load_dependent_friction" { Some(NO_GEAR) } else { by_unit };
    power.size.filter(|size| most.is_none_or(|most| *size < most))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_size_that_nothing_has_is_none() {
        let of = |kind: &str, unit: &str, size: f64| Power {
            kind: kind.into(),
            joints: vec![],
            parameter: String::new(),
            size: Some(size),
            unit: unit.into(),
        };
        let shows = |kind, unit, size| shown(&of(kind, unit, size)).is_some();
        assert!(!shows("joint_zero_offset", "rad", 4.3e11) && shows("joint_zero_offset", "rad", 1.8));
        assert!(!shows("load_dependent_friction", "-", 100.0) && shows("load_dependent_friction", "-", 0.2));
        assert!(!shows("payload", "kg", 2e3) && shows("torque_saturation", "N m", 2e3));
    }

    #[test]
    fn of_many_joints_the_ends_stand_with_their_names() {
        let (_, mut diagnosis, _) = sample::explained();
        assert!(!render(&diagnosis).into_string().contains("greatest"));
        diagnosis.joints = (0..=COLUMNS).map(|j| format!("joint{j}")).collect();
        let one = |joint: usize, size: f64| Power {
            kind: "coulomb_friction".into(),
            joints: vec![format!("joint{joint}")],
            parameter: "coulomb".into(),
            size: Some(size),
            unit: "N m".into(),
        };
        diagnosis.power = vec![one(0, 0.2), one(3, 0.01), one(5, 0.7)];
        let table = render(&diagnosis).into_string();
        assert!(
            table.contains("0.010 at joint3") && table.contains("0.70 at joint5") && !table.contains("joint12"),
            "{table}"
        );
    }
}
