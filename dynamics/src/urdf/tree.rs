//! The tree of links: parents found, loops and loose ends refused, sorted depth first.

use super::error::UrdfError;
use super::source::{Source, SourceJoint};
use crate::finding::Finding;
use std::collections::HashMap;
use urdf_rs::JointType;

/// A link in its place in the tree.
pub(super) struct Visit {
    /// Index of the link in the file; `None` for a `world` that is named but not described.
    pub link: Option<usize>,
    /// The joint to its parent, and the parent's place in the order; `None` for the root.
    pub parent: Option<(usize, usize)>,
}

/// The links depth first, children in the order of their joints in the document; the root first.
pub(super) fn sort(source: &Source, findings: &mut Vec<Finding>) -> Result<Vec<Visit>, UrdfError> {
    if source.links.is_empty() {
        return Err(UrdfError::NoLink);
    }
    let index: HashMap<&str, usize> = source.links.iter().enumerate().map(|(i, l)| (l.name.as_str(), i)).collect();
    // One more than the links of the file, for a `world` that is not among them.
    let world = source.links.len();
    let mut parent_joint: Vec<Option<usize>> = vec![None; world + 1];
    let mut children: Vec<Vec<(usize, usize)>> = vec![Vec::new(); world + 1];
    for (number, joint) in source.joints.iter().enumerate() {
        let unknown = |role, link: &str| UrdfError::UnknownLink {
            joint: joint.name.clone(),
            line: joint.line,
            role,
            link: link.to_owned(),
        };
        let parent = match index.get(joint.parent.as_str()) {
            Some(&parent) => parent,
            None if joint.parent == "world" && joint.kind == JointType::Fixed => world,
            None => return Err(unknown("parent", &joint.parent)),
        };
        let child = *index.get(joint.child.as_str()).ok_or_else(|| unknown("child", &joint.child))?;
        if let Some(first) = parent_joint[child] {
            let (link, first) = (joint.child.clone(), source.joints[first].name.clone());
            return Err(UrdfError::TwoParents { link, first, second: joint.name.clone() });
        }
        parent_joint[child] = Some(number);
        children[parent].push((number, child));
    }
    if let Some((number, _)) = children[world].first() {
        findings.push(world_read(&source.joints[*number]));
    }
    let described = |link: usize| link != world || !children[world].is_empty();
    let roots: Vec<usize> = (0..=world).filter(|&link| parent_joint[link].is_none() && described(link)).collect();
    let name = |link: usize| source.links.get(link).map_or("world", |link| &link.name).to_owned();
    let root = match roots.as_slice() {
        [root] => *root,
        [] => {
            return Err(UrdfError::Cycle { links: cycle(source, &parent_joint, &index, 0) });
        }
        several => {
            return Err(UrdfError::SeveralRoots { roots: several.iter().map(|&link| name(link)).collect() });
        }
    };
    let mut visited = vec![false; world + 1];
    let mut order: Vec<Visit> = Vec::with_capacity(world + 1);
    let mut stack = vec![(root, None)];
    while let Some((link, parent)) = stack.pop() {
        visited[link] = true;
        let place = order.len();
        order.push(Visit { link: (link != world).then_some(link), parent });
        stack.extend(children[link].iter().rev().map(|&(joint, child)| (child, Some((joint, place)))));
    }
    match (0..world).find(|&link| !visited[link]) {
        Some(loose) => Err(UrdfError::Cycle { links: cycle(source, &parent_joint, &index, loose) }),
        None => Ok(order),
    }
}

fn world_read(joint: &SourceJoint) -> Finding {
    let message = "names the parent `world`, which is no link of the file: read as the base";
    Finding::new(format!("joint `{}`", joint.name), message)
}

/// The loop above a link whose ancestors never end.
fn cycle(source: &Source, parent_joint: &[Option<usize>], index: &HashMap<&str, usize>, from: usize) -> Vec<String> {
    let parent = |link: usize| index.get(source.joints[parent_joint[link]?].parent.as_str()).copied();
    // As many steps up as there are links end inside the loop.
    let mut at = from;
    for _ in 0..source.links.len() {
        at = parent(at).unwrap_or(at);
    }
    let start = at;
    let mut links = Vec::new();
    loop {
        links.push(source.links[at].name.clone());
        at = parent(at).unwrap_or(start);
        if at == start {
            return links;
        }
    }
}
