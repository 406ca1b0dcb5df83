//! The bodies of a file walked from the world outwards: joints, and what each of them moves.

use super::error::MjcfError;
use super::frame::placement;
use super::geom;
use super::note;
use super::settings::{FromGeom, Settings};
use super::source::Element;
use crate::finding::Finding;
use crate::model::{Inertia, Joint, JointKind, Limits, Model, Placement};
use crate::urdf::{LinkFrame, Loaded};
use glam::{DMat3, DVec3};

/// The model of the bodies.
pub(super) fn assemble(
    root: &Element,
    settings: &Settings,
    locked: &[&str],
    findings: Vec<Finding>,
) -> Result<Loaded, MjcfError> {
    let mut walk = Walk {
        settings,
        locked,
        joints: Vec::new(),
        armature: Vec::new(),
        links: Vec::new(),
        held: Vec::new(),
        findings,
    };
    walk.links.push(LinkFrame { name: "world".to_owned(), joint: None, placement: Placement::IDENTITY });
    for world in root.all("worldbody") {
        walk.inside(world, None, Placement::IDENTITY, world.get("childclass"), true)?;
    }
    if let Some(unknown) = locked.iter().find(|name| !walk.held.iter().any(|held| held == *name)) {
        let known: Vec<&str> = walk.joints.iter().map(|joint| joint.name.as_str()).collect();
        return Err(MjcfError::new(
            format!("no joint is named `{unknown}`, which is to be held"),
            format!("The joints are {}", known.join(", ")),
        ));
    }
    if walk.joints.is_empty() {
        return Err(MjcfError::new("the model has no hinge and no slide", "Give a model with joints that move"));
    }
    for joint in &walk.joints {
        if joint.inertia.mass > 0.0 && !joint.inertia.is_physical() {
            note(&mut walk.findings, format!("body `{}`", joint.link), "has an inertia that no body has");
        }
    }
    let name = root.get("model").unwrap_or("robot").to_owned();
    let model = Model::new(name, "world".to_owned(), walk.joints)
        .map_err(|error| MjcfError::new(error.to_string(), "Correct the model"))?
        .with_armature(&walk.armature);
    Ok(Loaded { model, findings: walk.findings, links: walk.links })
}

struct Walk<'a> {
    settings: &'a Settings,
    locked: &'a [&'a str],
    joints: Vec<Joint>,
    armature: Vec<f64>,
    links: Vec<LinkFrame>,
    /// Joints that were held, by name.
    held: Vec<String>,
    findings: Vec<Finding>,
}

/// Elements of a body that count for its motion.
const MOVES: [&str; 3] = ["joint", "freejoint", "inertial"];

/// An element of a body, where the frames that it stands in lie in the body's, and the class that holds there.
type Framed<'e> = (&'e Element, Placement, Option<&'e str>);

impl Walk<'_> {
    /// What stands in a body, or in a frame of it, that lies at `place` in the link that `carrier` moves.
    fn inside(
        &mut self,
        element: &Element,
        carrier: Option<usize>,
        place: Placement,
        class: Option<&str>,
        in_world: bool,
    ) -> Result<(), MjcfError> {
        for child in &element.children {
            match child.kind.as_str() {
                "body" => self.body(child, carrier, place, class, in_world)?,
                "frame" if in_world && child.children.iter().any(|inner| MOVES.contains(&inner.kind.as_str())) => {
                    return Err(
                        MjcfError::new("a joint or an inertial stands in no body", "Put it into a <body>").at(child)
                    );
                }
                "frame" => {
                    let inner = place.compose(&placement(child, self.settings)?);
                    self.inside(child, carrier, inner, child.get("childclass").or(class), in_world)?;
                }
                "replicate" | "composite" | "flexcomp" | "attach" => {
                    return Err(MjcfError::new(
                        "it makes further bodies, and is not read",
                        "Save the compiled model (mj_saveLastXML) and give that",
                    )
                    .at(child));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn body(
        &mut self,
        body: &Element,
        carrier: Option<usize>,
        place: Placement,
        class: Option<&str>,
        in_world: bool,
    ) -> Result<(), MjcfError> {
        let class = body.get("childclass").or(class);
        let name = body.get("name").map_or_else(|| format!("body{}", self.links.len()), str::to_owned);
        let mut own = Vec::new();
        self.own(body, Placement::IDENTITY, class, &mut own)?;
        let joints: Vec<(Element, Placement)> = own
            .iter()
            .filter(|(child, ..)| ["joint", "freejoint"].contains(&child.kind.as_str()))
            .map(|(joint, within, class)| Ok((self.settings.filled(joint, *class)?, *within)))
            .collect::<Result<_, MjcfError>>()?;
        if let Some(free) = joints
            .iter()
            .map(|(joint, _)| joint)
            .find(|joint| joint.kind == "freejoint" || joint.get("type") == Some("free"))
        {
            if in_world && !has_joint(body) {
                note(
                    &mut self.findings,
                    format!("body `{name}`"),
                    "floats freely and carries no joint: left out, as an object of the scene",
                );
                return Ok(());
            }
            return Err(MjcfError::new(
                "the base floats, and the model has a fixed base",
                "For a robot that is bolted down, take the free joint out",
            )
            .at(free));
        }
        let mut carrier = carrier;
        // From the frame of the carrying link to that of the body.
        let mut frame = place.compose(&placement(body, self.settings)?);
        let count = joints.len();
        for (at, (joint, within)) in joints.iter().enumerate() {
            let joint_name = joint.get("name").map_or_else(|| format!("{name}_joint{}", at + 1), str::to_owned);
            let link = if at + 1 == count { name.clone() } else { format!("{name}/{joint_name}") };
            (carrier, frame) = self.joint((joint, within), joint_name, link, carrier, frame)?;
        }
        self.links.push(LinkFrame { name: name.clone(), joint: carrier, placement: frame });
        let inertial = own.iter().find(|(child, ..)| child.kind == "inertial");
        let inertia = self.inertia(body, inertial, class)?;
        if let Some(carrier) = carrier {
            let moved = &mut self.joints[carrier].inertia;
            *moved = moved.add(&inertia.transform(&frame));
            if count > 0 && inertia.mass == 0.0 && !body.children.iter().any(|child| child.kind == "body") {
                return Err(
                    MjcfError::new("it moves and has no mass", "Give it an <inertial>, or geoms with a mass").at(body)
                );
            }
        }
        self.inside(body, carrier, frame, class, false)
    }

    /// The joints and inertials of a body, through the frames that stand in it, in their order.
    fn own<'e>(
        &self,
        element: &'e Element,
        place: Placement,
        class: Option<&'e str>,
        own: &mut Vec<Framed<'e>>,
    ) -> Result<(), MjcfError> {
        for child in &element.children {
            if child.kind == "frame" {
                let inner = place.compose(&placement(child, self.settings)?);
                self.own(child, inner, child.get("childclass").or(class), own)?;
            } else if MOVES.contains(&child.kind.as_str()) {
                own.push((child, place, class));
            }
        }
        Ok(())
    }

    /// Adds a joint, which stands `within` the body, that moves the frame `frame` of `carrier`; the joint, or the carrier
    /// where it is held, and where the body's frame lies in its link.
    fn joint(
        &mut self,
        (joint, within): (&Element, &Placement),
        name: String,
        link: String,
        carrier: Option<usize>,
        frame: Placement,
    ) -> Result<(Option<usize>, Placement), MjcfError> {
        let refused = |found: String, mend: &str| Err(MjcfError::new(found, mend).at(joint));
        let hinge = match joint.get("type") {
            None | Some("hinge") => true,
            Some("slide") => false,
            Some(other) => {
                return refused(
                    format!("a {other} joint has several degrees of freedom, and is not read"),
                    "Write it as hinges, one behind another",
                );
            }
        };
        let axis = joint.numbers("axis", 3, [0.0; 3])?.map_or(DVec3::Z, DVec3::from_array);
        let Some(axis) = axis.try_normalize() else {
            return refused("its axis has no length".into(), "Give a direction");
        };
        let axis = within.rotation * axis;
        let unit = if hinge { self.settings.angle } else { 1.0 };
        let anchor = joint.numbers("pos", 3, [0.0; 3])?.map_or(DVec3::ZERO, DVec3::from_array);
        let anchor = within.rotation * anchor + within.translation;
        let reference = unit * joint.number("ref", 0.0)?;
        // The body lies as the file draws it where the position is `ref`.
        let back = if hinge {
            Placement { rotation: DMat3::from_axis_angle(axis, -reference), translation: DVec3::ZERO }
        } else {
            Placement { rotation: DMat3::IDENTITY, translation: -reference * axis }
        };
        let at_anchor = Placement { rotation: DMat3::IDENTITY, translation: anchor };
        let place = frame.compose(&at_anchor).compose(&back);
        let body_in_link = Placement { rotation: DMat3::IDENTITY, translation: -anchor };
        if self.locked.contains(&name.as_str()) {
            self.held.push(name);
            return Ok((carrier, place.compose(&body_in_link)));
        }
        let range = joint.numbers("range", 2, [0.0; 2])?;
        let limited = match joint.get("limited") {
            Some("true") => true,
            Some("false") => false,
            _ => self.settings.auto_limits && range.is_some(),
        };
        let limits = range.filter(|_| limited).map(|[low, high]| (unit * low, unit * high));
        let effort = joint.numbers("actuatorfrcrange", 2, [0.0; 2])?.map(|[low, high]| low.abs().max(high.abs()));
        for (field, what) in [("stiffness", "a spring"), ("springdamper", "a spring")] {
            if joint.get(field).is_some_and(|text| text.split_whitespace().any(|x| x.parse() != Ok(0.0))) {
                note(
                    &mut self.findings,
                    format!("joint `{name}`"),
                    format!(
                        "{field}: {what} at a joint is no part of the nominal model; where it acts, the diagnosis will find it"
                    ),
                );
            }
        }
        for field in ["damping", "frictionloss", "armature"] {
            if joint.number(field, 0.0)? < 0.0 {
                return refused(format!("its {field} is negative"), "Give a positive one");
            }
        }
        self.armature.push(joint.number("armature", 0.0)?);
        self.joints.push(Joint {
            name,
            link,
            parent: carrier,
            kind: match (hinge, limits.is_some()) {
                (false, _) => JointKind::Prismatic,
                (true, true) => JointKind::Revolute,
                (true, false) => JointKind::Continuous,
            },
            placement: place,
            axis,
            inertia: Inertia::ZERO,
            limits: Limits { lower: limits.map(|l| l.0), upper: limits.map(|l| l.1), velocity: None, effort },
            damping: joint.number("damping", 0.0)?,
            friction: joint.number("frictionloss", 0.0)?,
        });
        Ok((Some(self.joints.len() - 1), body_in_link))
    }

    /// Inertia of a body, in its frame.
    fn inertia(&self, body: &Element, own: Option<&Framed>, class: Option<&str>) -> Result<Inertia, MjcfError> {
        match (own, self.settings.from_geom) {
            (Some((inertial, within, _)), FromGeom::Never | FromGeom::Lacking) => {
                Ok(geom::inertial(inertial, self.settings)?.transform(within))
            }
            (None, FromGeom::Never) => Ok(Inertia::ZERO),
            _ => self.of_geoms(body, Placement::IDENTITY, class),
        }
    }

    fn of_geoms(&self, element: &Element, place: Placement, class: Option<&str>) -> Result<Inertia, MjcfError> {
        let mut sum = Inertia::ZERO;
        for child in &element.children {
            match child.kind.as_str() {
                "geom" => {
                    let filled = self.settings.filled(child, class)?;
                    if let Some(inertia) = geom::of_geom(&filled, self.settings)? {
                        sum = sum.add(&inertia.transform(&place));
                    }
                }
                "frame" => {
                    let inner = place.compose(&placement(child, self.settings)?);
                    sum = sum.add(&self.of_geoms(child, inner, child.get("childclass").or(class))?);
                }
                _ => {}
            }
        }
        Ok(sum)
    }
}

/// Whether a hinge, slide or ball stands in a body or in those on it.
fn has_joint(body: &Element) -> bool {
    body.children.iter().any(|child| match child.kind.as_str() {
        "joint" => child.get("type") != Some("free"),
        "body" | "frame" => has_joint(child),
        _ => false,
    })
}
