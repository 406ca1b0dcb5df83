//! What the raw XML is read with: attributes and children by name, numbers copied into the reduced text, lines, and a
//! note of all that is not read.

use super::error::UrdfError;
use crate::finding::Finding;
use roxmltree::Node;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// At most some sixty characters of a text, for a message.
pub(super) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// Which numbers will do.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Range {
    Finite,
    Any,
}

pub(super) struct Reader<'a> {
    /// Byte offsets of the line ends.
    line_ends: Vec<usize>,
    /// The robot's namespace: elements of another are no URDF.
    namespace: Option<&'a str>,
    /// URDF version.
    pub(super) version: (u32, u32),
    pub(super) ignored: BTreeMap<String, usize>,
    pub(super) findings: Vec<Finding>,
    pub(super) out: String,
}

impl<'a> Reader<'a> {
    pub(super) fn new(xml: &str, robot: Node<'a, 'a>) -> Self {
        let version = plain(robot, "version").and_then(|text| {
            let (major, minor) = text.trim().split_once('.')?;
            Some((major.parse().ok()?, minor.parse().ok()?))
        });
        Self {
            line_ends: xml.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect(),
            namespace: robot.tag_name().namespace(),
            version: version.unwrap_or((1, 0)),
            ignored: BTreeMap::new(),
            findings: Vec::new(),
            out: String::from("<robot name=\"robot\">\n"),
        }
    }

    /// Copies an attribute of one number; whether it is there.
    pub(super) fn number(&mut self, node: Node, about: &str, field: &str, range: Range) -> Result<bool, UrdfError> {
        Ok(self.numbers::<1>(node, about, field, range)?.is_some())
    }

    /// Copies an attribute of `N` numbers into the reduced text.
    pub(super) fn numbers<const N: usize>(
        &mut self,
        node: Node,
        about: &str,
        field: &str,
        range: Range,
    ) -> Result<Option<[f64; N]>, UrdfError> {
        let Some(found) = plain(node, field) else {
            return Ok(None);
        };
        let values = parse::<N>(found).filter(|all| range == Range::Any || all.iter().all(|x| x.is_finite()));
        let Some(values) = values else {
            let expected = match (N, range) {
                (1, Range::Any) => "a number",
                (1, Range::Finite) => "a finite number",
                _ => "three finite numbers with spaces between",
            };
            return Err(self.wrong(node, about, field, found, expected));
        };
        let _ = write!(self.out, " {field}=\"{}\"", found.split_whitespace().collect::<Vec<_>>().join(" "));
        Ok(Some(values))
    }

    pub(super) fn wrong(&self, node: Node, about: &str, field: &str, found: &str, expected: &'static str) -> UrdfError {
        let hint = match () {
            () if found.contains("${") || found.contains("$(") => ": expand the file with xacro first",
            () if found.contains(',') => ": write a point for the decimal mark, and spaces between numbers",
            () => "",
        };
        UrdfError::Number {
            about: about.into(),
            line: self.line(node),
            field: format!("<{}> {field}", node.tag_name().name()),
            found: shorten(found),
            expected,
            hint,
        }
    }

    /// An attribute that must be there and not be blank.
    pub(super) fn attribute(
        &self,
        node: Node<'a, 'a>,
        about: &str,
        field: &'static str,
        mend: &'static str,
    ) -> Result<&'a str, UrdfError> {
        match plain(node, field) {
            Some(text) if !text.trim().is_empty() => Ok(text),
            _ => Err(UrdfError::Missing { about: about.into(), line: self.line(node), missing: field, mend }),
        }
    }

    /// The first child of each of these names, as the ROS parser takes it; a second one is a finding, all others are
    /// noted as not read.
    pub(super) fn children<const N: usize>(
        &mut self,
        node: Node<'a, 'a>,
        about: &str,
        names: [&str; N],
    ) -> Result<[Option<Node<'a, 'a>>; N], UrdfError> {
        let mut found = [None; N];
        for element in node.children().filter(Node::is_element) {
            self.reject_xacro(element)?;
            let at = self.urdf_name(element).and_then(|name| names.iter().position(|n| *n == name));
            let Some(slot) = at.and_then(|at| found.get_mut(at)) else {
                self.note(format!("<{}>", element.tag_name().name()));
                continue;
            };
            if slot.is_some() {
                let (name, line) = (element.tag_name().name(), self.line(element));
                let message = format!("has a second <{name}> (line {line}): the first counts; delete the other");
                self.findings.push(Finding::new(about, message));
            } else {
                *slot = Some(element);
            }
        }
        Ok(found)
    }

    pub(super) fn reject_xacro(&self, element: Node) -> Result<(), UrdfError> {
        match element.tag_name().namespace() {
            Some(space) if space.contains("xacro") && Some(space) != self.namespace => {
                let element_name = format!("xacro:{}", element.tag_name().name());
                Err(UrdfError::Xacro { element: element_name, line: self.line(element) })
            }
            _ => Ok(()),
        }
    }

    /// The element's name, where it is URDF's.
    pub(super) fn urdf_name(&self, element: Node<'a, 'a>) -> Option<&'a str> {
        (element.tag_name().namespace() == self.namespace).then(|| element.tag_name().name())
    }

    pub(super) fn note_attributes(&mut self, node: Node, known: &[&str]) {
        for attribute in node.attributes() {
            if attribute.namespace().is_some() || !known.contains(&attribute.name()) {
                self.note(format!("<{} {}>", node.tag_name().name(), attribute.name()));
            }
        }
    }

    pub(super) fn note(&mut self, kind: String) {
        *self.ignored.entry(kind).or_default() += 1;
    }

    pub(super) fn line(&self, node: Node) -> u32 {
        let at = node.range().start;
        u32::try_from(self.line_ends.partition_point(|end| *end < at)).unwrap_or(u32::MAX).saturating_add(1)
    }
}

/// An attribute without a namespace (roxmltree's own `attribute` takes one of any).
pub(super) fn plain<'a>(node: Node<'a, '_>, field: &str) -> Option<&'a str> {
    let attribute = node.attributes().find(|attribute| attribute.namespace().is_none() && attribute.name() == field)?;
    Some(attribute.value())
}

pub(super) fn parse<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut values = [0.0; N];
    let mut words = text.split_whitespace();
    for value in &mut values {
        *value = words.next()?.parse().ok()?;
    }
    words.next().is_none().then_some(values)
}

pub(super) fn not_read(kind: &str, count: usize) -> String {
    let why = match kind {
        "<visual>" | "<collision>" | "<material>" => ": no part of the dynamics",
        "<transmission>" => ": gear ratios and rotor inertias in it do not enter the model",
        "<gazebo>" => ": friction, damping and springs in it do not enter the model",
        "<axis> of a fixed joint" => ": it gives no direction, and a fixed joint needs none",
        "<safety_controller>" => ": soft limits do not enter the model",
        _ => "",
    };
    format!("{count} not read{why}")
}

pub(super) fn escape(name: &str) -> String {
    let mut text = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            '\'' => text.push_str("&apos;"),
            c => text.push(c),
        }
    }
    text
}
