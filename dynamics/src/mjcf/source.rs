//! The XML of an MJCF file, with the files that it includes in their places.

use super::error::MjcfError;
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// An element of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Element {
    /// Name of the element, as `joint`.
    pub kind: String,
    /// Its attributes.
    pub attributes: BTreeMap<String, String>,
    /// Elements in it, in order.
    pub children: Vec<Element>,
    /// File that it stands in, with a comma and a space behind; empty in the outer one.
    pub file: String,
    /// Line in that file, from 1.
    pub line: usize,
}

/// How deep includes and elements may stand in one another, and how many elements there may be.
const DEEPEST: usize = 200;
const MOST: usize = 1_000_000;

impl Element {
    /// An attribute's text.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    /// Elements of this kind in it.
    pub fn all<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = &'a Element> + 'a {
        self.children.iter().filter(move |child| child.kind == kind)
    }

    /// The numbers of an attribute: `fewest` to `N` of them; those that lack keep what `values` has.
    pub fn numbers<const N: usize>(
        &self,
        name: &str,
        fewest: usize,
        mut values: [f64; N],
    ) -> Result<Option<[f64; N]>, MjcfError> {
        let Some(text) = self.get(name) else { return Ok(None) };
        let parsed: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        match parsed.filter(|all| (fewest..=N).contains(&all.len()) && all.iter().all(|x| x.is_finite())) {
            Some(all) => {
                values[..all.len()].copy_from_slice(&all);
                Ok(Some(values))
            }
            None => {
                let short: String = text.chars().take(60).collect();
                let expected = if fewest == N { N.to_string() } else { format!("{fewest} to {N}") };
                Err(MjcfError::new(
                    format!("found {name}=\"{short}\", expected {expected} finite numbers"),
                    "Correct the attribute",
                )
                .at(self))
            }
        }
    }

    /// One number of an attribute.
    pub fn number(&self, name: &str, default: f64) -> Result<f64, MjcfError> {
        Ok(self.numbers(name, 1, [default])?.map_or(default, |[value]| value))
    }
}

/// Name of the outermost element.
pub(super) fn outermost(xml: &str) -> Option<String> {
    Document::parse(xml).ok().map(|document| document.root_element().tag_name().name().to_owned())
}

/// Reads a file and what it includes.
pub(super) fn read(xml: &str, include: &dyn Fn(&str) -> Result<String, String>) -> Result<Element, MjcfError> {
    let mut count = 0;
    let root = parse(xml, "", include, 0, &mut count)?;
    if root.kind != "mujoco" {
        return Err(MjcfError::new(
            format!("found <{}> as the outermost element, expected <mujoco>", root.kind),
            "Give an MJCF or a URDF file",
        ));
    }
    Ok(root)
}

fn parse(
    xml: &str,
    file: &str,
    include: &dyn Fn(&str) -> Result<String, String>,
    depth: usize,
    count: &mut usize,
) -> Result<Element, MjcfError> {
    let place = if file.is_empty() { String::new() } else { format!("{file}: ") };
    let document = Document::parse(xml).map_err(|error| {
        MjcfError::new(
            format!("{place}the text is not well-formed XML ({error})"),
            "Mend it there, or write it again with the tool that made it",
        )
    })?;
    let ends: Vec<usize> = xml.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect();
    let file = if file.is_empty() { String::new() } else { format!("{file}, ") };
    element(document.root_element(), &file, &ends, include, depth, count)
}

fn element(
    node: Node,
    file: &str,
    ends: &[usize],
    include: &dyn Fn(&str) -> Result<String, String>,
    depth: usize,
    count: &mut usize,
) -> Result<Element, MjcfError> {
    let mut new = Element {
        kind: node.tag_name().name().to_owned(),
        attributes: node.attributes().map(|a| (a.name().to_owned(), a.value().to_owned())).collect(),
        children: Vec::new(),
        file: file.to_owned(),
        line: 1 + ends.partition_point(|end| *end < node.range().start),
    };
    *count += 1;
    if depth > DEEPEST || *count > MOST {
        return Err(MjcfError::new(
            "elements or includes stand in one another too deep, or are too many",
            "Does a file include itself?",
        )
        .at(&new));
    }
    for child in node.children().filter(Node::is_element) {
        let child = element(child, file, ends, include, depth + 1, count)?;
        if child.kind != "include" {
            new.children.push(child);
            continue;
        }
        let name = child.get("file").unwrap_or_default();
        let text = include(name).map_err(|why| {
            MjcfError::new(format!("the included file {name:?} cannot be read: {why}"), "Keep it beside the model")
                .at(&child)
        })?;
        new.children.extend(parse(&text, name, include, depth + 10, count)?.children);
    }
    Ok(new)
}
