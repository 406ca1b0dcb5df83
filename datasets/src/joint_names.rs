//! Which joint of the robot a joint of a log is, where the two have other names for it.
//!
//! The rules, in this order; the first under which most joints match is taken, and it must match one to one:
//! 1. the names are the same;
//! 2. they are, but for upper and lower case, for `-`, `/`, ` ` and `.` in the place of `_`, and for an ending
//!    `.pos`, `_joint` or `.q`;
//! 3. they are, once the beginning that all joints of the log share, or all of the robot, is left out;
//! 4. the log has no names, and as many joints as the robot: the robot's order.

use crate::column_map::ColumnMap;
use crate::episode::Channel;
use std::collections::{BTreeMap, BTreeSet};

/// Begins the name of a joint that the log does not name: `#1`, `#2`, ….
pub(crate) const UNNAMED: char = '#';

/// Gives native columns the names of the robot's `joints`; what was matched is returned, to be said.
///
/// Columns of joints that the robot lacks become foreign where `extra` joints are allowed. What the map takes keeps its
/// name.
pub(crate) fn matched(columns: &mut [String], joints: &[String], map: &ColumnMap, extra: bool) -> Vec<String> {
    let logged: Vec<String> = {
        let mut seen = BTreeSet::new();
        columns
            .iter()
            .filter(|column| !map.takes(column))
            .filter_map(|column| native(column))
            .filter(|name| seen.insert(*name))
            .map(str::to_owned)
            .collect()
    };
    if logged.is_empty() || (!extra && joints.iter().all(|joint| logged.contains(joint))) {
        return Vec::new();
    }
    let Some(pairs) = pairs(&logged, joints) else { return Vec::new() };
    let mut notes = Vec::new();
    let renamed: Vec<String> =
        pairs.iter().filter(|(from, to)| from != to).map(|(from, to)| format!("{from} is {to}")).collect();
    if !renamed.is_empty() {
        notes.push(format!("joints of the log and the robot's: {}", renamed.join(", ")));
    }
    let left: Vec<&String> = logged.iter().filter(|name| !pairs.contains_key(*name)).collect();
    if extra && !left.is_empty() {
        let names: Vec<&str> = left.iter().map(|name| name.as_str()).collect();
        notes.push(format!("joints that the robot lacks are left out: {}", names.join(", ")));
    }
    for column in columns.iter_mut().filter(|column| !map.takes(column)) {
        let Some(name) = native(column) else { continue };
        let channel = &column[..column.len() - name.len() - 1];
        match pairs.get(name) {
            Some(to) => *column = format!("{channel}.{to}"),
            // No longer a native name, so that it is passed over.
            None if extra => *column = format!("{channel}:{name}"),
            None => {}
        }
    }
    notes
}

/// How many of the robot's `joints` a log names that names `logged`.
pub(crate) fn count(logged: &[String], joints: &[String]) -> usize {
    pairs(logged, joints).map_or(0, |pairs| pairs.len())
}

/// The joint in a native name.
fn native(column: &str) -> Option<&str> {
    let (channel, joint) = column.split_once('.')?;
    (Channel::from_name(channel).is_some() && !joint.is_empty()).then_some(joint)
}

/// What of a name is compared.
type Rule<'a> = &'a dyn Fn(&str) -> String;

/// From the log's name of a joint to the robot's.
fn pairs(logged: &[String], joints: &[String]) -> Option<BTreeMap<String, String>> {
    if logged.iter().all(|name| name.starts_with(UNNAMED)) {
        let pairs = || logged.iter().cloned().zip(joints.iter().cloned()).collect();
        return (logged.len() == joints.len()).then(pairs);
    }
    let same = |name: &str| name.to_owned();
    let (log_start, robot_start) = (shared_start(logged), shared_start(joints));
    let without = |start: usize| move |name: &str| core(name).get(start..).unwrap_or_default().to_owned();
    let plain = |name: &str| core(name);
    let rules: [(Rule, Rule); 5] = [
        (&same, &same),
        (&plain, &plain),
        (&without(log_start), &plain),
        (&plain, &without(robot_start)),
        (&without(log_start), &without(robot_start)),
    ];
    let mut best: Option<BTreeMap<String, String>> = None;
    for (of_log, of_robot) in rules {
        if let Some(found) = one_to_one(logged, joints, of_log, of_robot)
            && best.as_ref().is_none_or(|best| found.len() > best.len())
        {
            best = Some(found);
        }
    }
    best.filter(|best| !best.is_empty())
}

fn one_to_one(logged: &[String], joints: &[String], of_log: Rule, of_robot: Rule) -> Option<BTreeMap<String, String>> {
    let by_core: BTreeMap<String, &String> = joints.iter().map(|joint| (of_robot(joint), joint)).collect();
    let mut found = BTreeMap::new();
    let mut taken = BTreeSet::new();
    for name in logged {
        let core = of_log(name);
        if let Some(joint) = by_core.get(&core).filter(|_| !core.is_empty()) {
            if !taken.insert(core) {
                return None;
            }
            found.insert(name.clone(), (*joint).clone());
        }
    }
    (by_core.len() == joints.len()).then_some(found)
}

/// A name in lower case, `_` between its words, without the endings that loggers add.
fn core(name: &str) -> String {
    let mut text: String =
        name.trim().to_lowercase().chars().map(|c| if "-/ .".contains(c) { '_' } else { c }).collect();
    for ending in ["_pos", "_position", "_q", "_joint"] {
        if let Some(rest) = text.strip_suffix(ending).filter(|rest| !rest.is_empty()) {
            text = rest.to_owned();
        }
    }
    text
}

/// Bytes at the start of all cores that are the same, up to the last `_`.
fn shared_start(names: &[String]) -> usize {
    let cores: Vec<String> = names.iter().map(|name| core(name)).collect();
    let Some(first) = cores.first().filter(|_| cores.len() > 1) else { return 0 };
    let mut shared = first.len();
    for name in &cores {
        shared = shared.min(first.bytes().zip(name.bytes()).take_while(|(a, b)| a == b).count());
    }
    first.as_bytes()[..shared].iter().rposition(|byte| *byte == b'_').map_or(0, |at| at + 1)
}

/// Whether a name is another but for one letter that is wrong, missing or too many, two that are exchanged, or case and signs.
pub(crate) fn misspelt(name: &str, wanted: &str) -> bool {
    let plain =
        |text: &str| text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect::<Vec<char>>();
    let (a, b) = (plain(name), plain(wanted));
    if a == b || a.len() < 4 || a.len().abs_diff(b.len()) > 1 {
        return a == b;
    }
    // Numbers tell joints apart: joint1 is not joint2 misspelt.
    let digits = |text: &[char]| text.iter().filter(|c| c.is_ascii_digit()).copied().collect::<Vec<char>>();
    let same = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let (rest_a, rest_b) = (&a[same..], &b[same..]);
    let swapped =
        rest_a.len() > 1 && rest_b.len() > 1 && rest_a[..2] == [rest_b[1], rest_b[0]] && rest_a[2..] == rest_b[2..];
    let replaced = a.len() == b.len() && rest_a.get(1..) == rest_b.get(1..);
    let added = rest_a.get(1..) == Some(rest_b) || rest_b.get(1..) == Some(rest_a);
    digits(&a) == digits(&b) && (swapped || replaced || added)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    fn after(columns: &str, joints: &str) -> (String, Vec<String>) {
        let mut columns = names(columns);
        let notes = matched(&mut columns, &names(joints), &ColumnMap::default(), true);
        (columns.join(" "), notes)
    }

    #[test]
    fn endings_prefixes_and_case_do_not_matter() {
        assert_eq!(after("position.a.pos position.B.pos", "a b").0, "position.a position.b");
        assert_eq!(after("effort.left_j1 effort.left_j2", "j1 j2").0, "effort.j1 effort.j2");
        assert_eq!(after("effort.j1 effort.j2", "arm/j1 arm/j2").0, "effort.arm/j1 effort.arm/j2");
        assert_eq!(after("effort.l/j1 effort.l/j2", "r_j1_joint r_j2_joint").0, "effort.r_j1_joint effort.r_j2_joint");
    }

    #[test]
    fn unnamed_joints_are_in_the_robots_order() {
        let (columns, notes) = after("position.#1 position.#2", "z a");
        assert_eq!(columns, "position.z position.a");
        assert!(notes[0].contains("#1 is z"), "{notes:?}");
        assert_eq!(after("position.#1", "z a").0, "position.#1");
    }

    #[test]
    fn joints_that_the_robot_lacks_are_passed_over() {
        let (columns, notes) = after("time position.a position.grip", "a");
        assert_eq!(columns, "time position.a position:grip");
        assert!(notes[0].contains("grip"), "{notes:?}");
    }

    #[test]
    fn two_joints_of_one_core_are_no_match() {
        assert_eq!(after("position.A position.a.pos", "a b").0, "position.A position.a.pos");
    }
}
