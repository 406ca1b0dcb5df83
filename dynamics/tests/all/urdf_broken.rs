//! Whatever the text, reading it ends in a model or an error that says something; never in a panic.

use gapscope_dynamics::{Model, robots};
use proptest::prelude::*;

/// What stands where a number stood.
const NUMBERS: [&str; 16] = [
    "nan", "inf", "-inf", "1e400", "-1e308", "1e308", "1e-320", "", "0", "-0", "-1", "1 2", "1,5", "${x}", "0x10",
    "\u{660}",
];

/// Tokens of URDF that turn up where they do not belong.
const TOKENS: [&str; 14] = [
    "<link name=\"link1\"/>",
    "<mimic joint=\"joint2\" multiplier=\"1e300\" offset=\"1e300\"/>",
    "type=\"floating\"",
    "<inertial>",
    "</robot>",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "&b;",
    "&#0;",
    "<![CDATA[",
    "<!--",
    "xmlns=\"a\"",
    "version=\"1.2\"",
    "<origin quat_xyzw=\"0 0 0 0\"/>",
    "<a:b/>",
];

/// A mimic, a branch, a prismatic joint, a `world` and visuals beside the robots of the crate.
const GRIPPER: &str = r#"<?xml version="1.0"?>
<robot name="gripper" version="1.1">
  <joint name="weld" type="fixed"><parent link="world"/><child link="palm"/></joint>
  <link name="palm"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <link name="left"><inertial><origin xyz="0 0 0.1" quat_xyzw="0 0 1 1"/><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
  <link name="right"><inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
  <joint name="joint1" type="prismatic"><origin xyz="0 0.1 0" rpy="0 0 1.5"/><parent link="palm"/><child link="left"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" velocity="0.1" effort="20"/><dynamics damping="1" friction="2"/></joint>
  <joint name="joint2" type="prismatic"><parent link="palm"/><child link="right"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.04" velocity="0.1" effort="20"/><mimic joint="joint1"/></joint>
</robot>
"#;

fn originals() -> Vec<String> {
    let mut texts: Vec<String> =
        robots::NAMES.iter().filter_map(|name| robots::urdf(name)).map(str::to_owned).collect();
    texts.push(GRIPPER.to_owned());
    texts.push(GRIPPER.replace("<mimic joint=\"joint1\"/>", ""));
    texts
}

/// One way to break a text. Places are parts of the whole.
#[derive(Debug, Clone)]
enum Break {
    Flip { at: f64, bit: u8 },
    Delete { at: f64, length: usize },
    Repeat { line: f64, to: f64 },
    Drop { line: f64 },
    Number { which: f64, by: usize },
    Insert { at: f64, token: usize },
    Swap { a: f64, b: f64 },
}

fn a_break() -> impl Strategy<Value = Break> {
    let part = || 0.0..1.0_f64;
    prop_oneof![
        1 => (part(), 0..8_u8).prop_map(|(at, bit)| Break::Flip { at, bit }),
        1 => (part(), 1..40_usize).prop_map(|(at, length)| Break::Delete { at, length }),
        2 => (part(), part()).prop_map(|(line, to)| Break::Repeat { line, to }),
        2 => part().prop_map(|line| Break::Drop { line }),
        6 => (part(), 0..NUMBERS.len()).prop_map(|(which, by)| Break::Number { which, by }),
        2 => (part(), 0..TOKENS.len()).prop_map(|(at, token)| Break::Insert { at, token }),
        2 => (part(), part()).prop_map(|(a, b)| Break::Swap { a, b }),
    ]
}

fn place(part: f64, of: usize) -> usize {
    ((part * of as f64) as usize).min(of.saturating_sub(1))
}

fn apply(bytes: &mut Vec<u8>, change: &Break) {
    if bytes.is_empty() {
        return;
    }
    match *change {
        Break::Flip { at, bit } => {
            let at = place(at, bytes.len());
            bytes[at] ^= 1 << bit;
        }
        Break::Delete { at, length } => {
            let at = place(at, bytes.len());
            let end = (at + length).min(bytes.len());
            bytes.drain(at..end);
        }
        Break::Insert { at, token } => {
            let at = place(at, bytes.len());
            bytes.splice(at..at, TOKENS[token].bytes());
        }
        Break::Repeat { line, to } => lines(bytes, |lines| {
            let copy = lines[place(line, lines.len())].clone();
            lines.insert(place(to, lines.len()), copy);
        }),
        Break::Drop { line } => lines(bytes, |lines| {
            lines.remove(place(line, lines.len()));
        }),
        Break::Swap { a, b } => lines(bytes, |lines| {
            let (a, b) = (place(a, lines.len()), place(b, lines.len()));
            lines.swap(a, b);
        }),
        Break::Number { which, by } => number(bytes, which, NUMBERS[by]),
    }
}

fn lines(bytes: &mut Vec<u8>, change: impl FnOnce(&mut Vec<Vec<u8>>)) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    change(&mut lines);
    *bytes = lines.join(&b'\n');
}

/// Replaces a word of digits.
fn number(bytes: &mut Vec<u8>, which: f64, by: &str) {
    let digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
    let starts: Vec<usize> =
        (1..bytes.len()).filter(|&i| digit(&bytes[i]) && matches!(bytes[i - 1], b'"' | b' ')).collect();
    if starts.is_empty() {
        return;
    }
    let start = starts[place(which, starts.len())];
    let end = (start..bytes.len()).find(|&i| matches!(bytes[i], b'"' | b' ')).unwrap_or(bytes.len());
    bytes.splice(start..end, by.bytes());
}

fn read(text: &str, locked: &[&str]) -> Result<(), TestCaseError> {
    match Model::from_urdf_locking(text, locked) {
        Err(error) => prop_assert!(!error.to_string().is_empty()),
        Ok(loaded) => {
            prop_assert!(loaded.model.dof() > 0);
            for joint in loaded.model.joints() {
                prop_assert!(joint.inertia.parameters().iter().all(|x| x.is_finite()));
                prop_assert!((joint.axis.length() - 1.0).abs() < 1e-12);
                prop_assert!(joint.inertia.mass >= 0.0 && joint.damping >= 0.0 && joint.friction >= 0.0);
            }
            for link in &loaded.links {
                prop_assert!(link.placement.translation.is_finite() && link.placement.rotation.is_finite());
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn broken_robots_do_not_panic(
        which in 0..5_usize,
        breaks in prop::collection::vec(a_break(), 1..5),
        lock in any::<bool>(),
    ) {
        let mut bytes = originals()[which].clone().into_bytes();
        for change in &breaks {
            apply(&mut bytes, change);
        }
        read(&String::from_utf8_lossy(&bytes), if lock { &["joint1"] } else { &[] })?;
    }

    #[test]
    fn arbitrary_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), inside in any::<bool>()) {
        let text = String::from_utf8_lossy(&bytes);
        read(&if inside { format!("<robot name='r'>{text}</robot>") } else { text.into_owned() }, &[])?;
    }

    #[test]
    fn arbitrary_values_do_not_panic(values in prop::collection::vec(any::<f64>(), 16)) {
        let mut text = GRIPPER.replace("<mimic joint=\"joint1\"/>", "");
        for (value, name) in values.iter().zip(["0.1\"/><inertia", "1e-4", "0 0 0.1", "0 0 1.5", "0 1 0", "0 -1 0", "0.04"].iter().cycle()) {
            let words = match name.split_whitespace().count() {
                3 => format!("{value} {} {}", values[1], values[2]),
                _ => name.replacen(|c: char| c.is_ascii_digit(), "", 0).replace("0.1", &value.to_string()).replace("1e-4", &value.to_string()),
            };
            text = text.replacen(name, &words, 1);
        }
        read(&text, &[])?;
    }
}

/// Each sort of breaking has its hits: else the test above would prove little.
#[test]
fn originals_load_unbroken() {
    let loaded: Vec<bool> = originals().iter().map(|text| Model::from_urdf(text).is_ok()).collect();
    assert_eq!(loaded, [true, true, true, false, true]);
    assert!(Model::from_urdf_locking(GRIPPER, &["joint2"]).is_ok());
}
