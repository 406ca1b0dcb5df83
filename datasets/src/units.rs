//! The row of units that loggers write below the header.

use crate::episode::Channel;
use crate::header::Plan;
use ::csv::ByteRecord;
use std::f64::consts::PI;

/// Takes the units of a row into the scales of the plan; `None` where it is no such row.
pub(crate) fn take(record: &ByteRecord, header: &[String], plan: &mut Plan) -> Option<String> {
    let cell = |index: usize| std::str::from_utf8(record.get(index).unwrap_or_default()).unwrap_or("1").trim();
    let is_number = |text: &str| text.replace(',', ".").parse::<f64>().is_ok();
    let cells: Vec<&str> = plan.feeds.iter().map(|feed| cell(feed.index)).collect();
    if cells.iter().all(|cell| cell.is_empty()) || cells.iter().any(|cell| is_number(cell)) {
        return None;
    }
    // Where a cell is the name above it, the header is repeated.
    if plan.feeds.iter().any(|feed| header.get(feed.index).is_some_and(|name| name == cell(feed.index))) {
        return None;
    }
    let mut unknown = Vec::new();
    let mut scaled = Vec::new();
    for (feed, unit) in plan.feeds.iter_mut().zip(&cells) {
        match scale(feed.channel, unit.trim_matches(['[', ']', '(', ')'])) {
            Some(1.0) => {}
            Some(scale) => {
                feed.scale *= scale;
                scaled.push(format!("{} in {unit}", feed.column));
            }
            None if unit.is_empty() => {}
            None => unknown.push(format!("{} in {unit:?}", feed.column)),
        }
    }
    let mut note = "the row below the header is read as units".to_owned();
    if !scaled.is_empty() {
        note.push_str(&format!("; brought to SI units: {}", scaled.join(", ")));
    }
    if !unknown.is_empty() {
        note.push_str(&format!("; not known, read as SI units: {}", unknown.join(", ")));
    }
    Some(note)
}

/// The factor from a unit to that of SI.
fn scale(channel: Option<Channel>, unit: &str) -> Option<f64> {
    let unit: String = unit.chars().filter(|c| !" ·*.".contains(*c)).collect();
    let is = |names: &[&str]| names.contains(&unit.as_str());
    match channel {
        None if is(&["s", "sec", "seconds"]) => Some(1.0),
        None if is(&["ms"]) => Some(1e-3),
        None if is(&["us", "µs", "μs"]) => Some(1e-6),
        None if is(&["ns"]) => Some(1e-9),
        Some(Channel::Position | Channel::Command) if is(&["rad", "m"]) => Some(1.0),
        Some(Channel::Position | Channel::Command) if is(&["deg", "degrees", "°"]) => Some(PI / 180.0),
        Some(Channel::Position | Channel::Command) if is(&["mm", "mrad"]) => Some(1e-3),
        Some(Channel::Velocity) if is(&["rad/s", "m/s"]) => Some(1.0),
        Some(Channel::Velocity) if is(&["deg/s", "°/s"]) => Some(PI / 180.0),
        Some(Channel::Velocity) if is(&["mm/s", "mrad/s"]) => Some(1e-3),
        Some(Channel::Velocity) if is(&["rpm", "1/min", "rev/min"]) => Some(PI / 30.0),
        Some(Channel::Effort | Channel::EffortLink | Channel::Disturbance) if is(&["Nm", "N"]) => Some(1.0),
        Some(Channel::Effort | Channel::EffortLink | Channel::Disturbance) if is(&["mNm", "Nmm", "mN"]) => Some(1e-3),
        Some(Channel::Temperature) if is(&["°C", "C", "degC"]) => Some(1.0),
        _ => None,
    }
}
