//! The raw XML: what stands in the file, what is missing, repeated or not read; and the part that bears on the
//! dynamics, written anew for urdf-rs (which fills in what is missing, skips words that are no numbers, and refuses
//! files for the shapes of visuals).

use super::error::UrdfError;
use super::reader::{Range, Reader, escape, not_read, parse, plain, shorten};
use crate::finding::Finding;
use roxmltree::{Document, Node};
use std::collections::HashMap;
use std::fmt::Write as _;
use urdf_rs::JointType;

/// The most links, and the most joints, that are read.
const MOST: usize = 10_000;

/// What the file says, short of the values.
pub(super) struct Source {
    /// The robot's name.
    pub name: String,
    /// Whether a limit that is not given means "none" (URDF 1.2) rather than zero.
    pub open_limits: bool,
    /// Links in the order of the document.
    pub links: Vec<SourceLink>,
    /// Joints in the order of the document.
    pub joints: Vec<SourceJoint>,
    /// Links and joints in the same order, in well-formed URDF, with nothing but what is read.
    pub reduced: String,
}

/// A link as it stands in the file.
pub(super) struct SourceLink {
    pub name: String,
    pub line: u32,
    /// The line of `<mass>`, where there is an `<inertial>`.
    pub mass_line: Option<u32>,
    /// `quat_xyzw` of the inertial's origin.
    pub quaternion: Option<[f64; 4]>,
}

/// A joint as it stands in the file.
pub(super) struct SourceJoint {
    pub name: String,
    pub line: u32,
    pub kind: JointType,
    pub parent: String,
    pub child: String,
    /// The line of `<axis>`, where there is one.
    pub axis_line: Option<u32>,
    /// Which of lower, upper, velocity, effort are given; `None` without `<limit>`.
    pub limits: Option<[bool; 4]>,
    /// The joint that it mimics.
    pub mimic: Option<String>,
    /// `quat_xyzw` of the origin.
    pub quaternion: Option<[f64; 4]>,
}

impl Source {
    /// Reads the text, checks its form, and adds a finding for each kind of field that is not read.
    pub fn read(xml: &str, findings: &mut Vec<Finding>) -> Result<Self, UrdfError> {
        let document = Document::parse(xml).map_err(|e| UrdfError::Xml(e.to_string()))?;
        let robot = document.root_element();
        let reader = Reader::new(xml, robot);
        if robot.tag_name().name() != "robot" {
            return Err(not_urdf(robot.tag_name().name()));
        }
        reader.read(robot, findings)
    }
}

fn not_urdf(found: &str) -> UrdfError {
    let hint = match found {
        "mujoco" => " (this is MuJoCo's MJCF)",
        "sdf" => " (this is SDFormat)",
        "COLLADA" => " (this is COLLADA)",
        _ => "",
    };
    UrdfError::NotUrdf { found: shorten(found), hint }
}

fn unique<T>(what: &'static str, all: &[T], key: impl Fn(&T) -> (&str, u32)) -> Result<(), UrdfError> {
    let mut seen = HashMap::new();
    for item in all {
        let (name, second) = key(item);
        if let Some(first) = seen.insert(name, second) {
            return Err(UrdfError::Duplicate { what, name: name.to_owned(), first, second });
        }
    }
    Ok(())
}

impl<'a> Reader<'a> {
    fn read(mut self, robot: Node<'a, 'a>, findings: &mut Vec<Finding>) -> Result<Source, UrdfError> {
        let name = match plain(robot, "name") {
            Some(name) if !name.trim().is_empty() => name.to_owned(),
            _ => {
                self.findings.push(Finding::new("<robot>", "has no name: read as `robot`"));
                "robot".to_owned()
            }
        };
        self.note_attributes(robot, &["name", "version"]);
        let (mut links, mut joints) = (Vec::new(), Vec::new());
        for element in robot.children().filter(Node::is_element) {
            self.reject_xacro(element)?;
            match self.urdf_name(element) {
                Some("link") => links.push(element),
                Some("joint") => joints.push(element),
                _ => self.note(format!("<{}>", element.tag_name().name())),
            }
        }
        for (what, found) in [("links", links.len()), ("joints", joints.len())] {
            if found > MOST {
                return Err(UrdfError::TooMany { what, found, most: MOST });
            }
        }
        let links: Vec<SourceLink> = links.into_iter().map(|link| self.link(link)).collect::<Result<_, _>>()?;
        let joints: Vec<SourceJoint> = joints.into_iter().map(|joint| self.joint(joint)).collect::<Result<_, _>>()?;
        unique("link", &links, |link: &SourceLink| (&link.name, link.line))?;
        unique("joint", &joints, |joint: &SourceJoint| (&joint.name, joint.line))?;
        self.out.push_str("</robot>\n");
        findings.append(&mut self.findings);
        findings.extend(self.ignored.iter().map(|(kind, count)| Finding::new(kind, not_read(kind, *count))));
        Ok(Source { name, open_limits: self.version >= (1, 2), links, joints, reduced: self.out })
    }

    fn link(&mut self, link: Node<'a, 'a>) -> Result<SourceLink, UrdfError> {
        let name = self.attribute(link, "link", "name", "name=\"…\" to the <link>")?.to_owned();
        let about = format!("link `{name}`");
        let line = self.line(link);
        self.note_attributes(link, &["name"]);
        let [inertial] = self.children(link, &about, ["inertial"])?;
        let _ = write!(self.out, "<link name=\"{}\">", escape(&name));
        let (mut mass_line, mut quaternion) = (None, None);
        if let Some(inertial) = inertial {
            self.note_attributes(inertial, &[]);
            let [origin, mass, inertia] = self.children(inertial, &about, ["origin", "mass", "inertia"])?;
            let missing = |missing, mend| UrdfError::Missing { about: about.clone(), line, missing, mend };
            let mass = mass.ok_or_else(|| missing("<mass> in its <inertial>", "<mass value=\"…\"/> in kg"))?;
            mass_line = Some(self.line(mass));
            self.out.push_str("<inertial>");
            quaternion = self.origin(origin, &about)?;
            self.note_attributes(mass, &["value"]);
            self.out.push_str("<mass");
            if !self.number(mass, &about, "value", Range::Finite)? {
                return Err(missing("value in its <mass>", "value=\"…\" in kg"));
            }
            self.out.push_str("/>");
            self.inertia(inertia, &about, line)?;
            self.out.push_str("</inertial>");
        }
        self.out.push_str("</link>\n");
        Ok(SourceLink { name, line, mass_line, quaternion })
    }

    fn inertia(&mut self, inertia: Option<Node<'a, 'a>>, about: &str, line: u32) -> Result<(), UrdfError> {
        self.out.push_str("<inertia");
        let Some(inertia) = inertia else {
            self.findings.push(Finding::new(about, "has an <inertial> without <inertia>: read as a point mass"));
            self.out.push_str(" ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>");
            return Ok(());
        };
        self.note_attributes(inertia, &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]);
        for field in ["ixx", "iyy", "izz"] {
            if !self.number(inertia, about, field, Range::Finite)? {
                let missing = "ixx, iyy or izz in its <inertia>";
                let mend = "the moments of inertia about the centre of mass, in kg m²";
                return Err(UrdfError::Missing { about: about.into(), line, missing, mend });
            }
        }
        let mut absent = Vec::new();
        for field in ["ixy", "ixz", "iyz"] {
            if !self.number(inertia, about, field, Range::Finite)? {
                absent.push(field);
                let _ = write!(self.out, " {field}=\"0\"");
            }
        }
        if !absent.is_empty() {
            let message = format!("has no {} in its <inertia>: read as 0", absent.join(", "));
            self.findings.push(Finding::new(about, message));
        }
        self.out.push_str("/>");
        Ok(())
    }

    fn joint(&mut self, joint: Node<'a, 'a>) -> Result<SourceJoint, UrdfError> {
        let name = self.attribute(joint, "joint", "name", "name=\"…\" to the <joint>")?.to_owned();
        let about = format!("joint `{name}`");
        let line = self.line(joint);
        self.note_attributes(joint, &["name", "type"]);
        let (kind, kind_name) = self.kind(joint, &name, &about)?;
        let fixed = kind == JointType::Fixed;
        let fields = ["origin", "parent", "child", "axis", "limit", "dynamics", "mimic"];
        let [origin, parent, child, axis, limit, dynamics, mimic] = self.children(joint, &about, fields)?;
        let missing = |missing, mend| UrdfError::Missing { about: about.clone(), line, missing, mend };
        let parent = parent.ok_or_else(|| missing("<parent>", "<parent link=\"…\"/>"))?;
        let child = child.ok_or_else(|| missing("<child>", "<child link=\"…\"/>"))?;
        for end in [parent, child] {
            self.note_attributes(end, &["link"]);
        }
        let parent = self.attribute(parent, &about, "link", "link=\"…\" to its <parent>")?.to_owned();
        let child = self.attribute(child, &about, "link", "link=\"…\" to its <child>")?.to_owned();
        let (p, c, n) = (escape(&parent), escape(&child), escape(&name));
        let _ =
            write!(self.out, "<joint name=\"{n}\" type=\"{kind_name}\"><parent link=\"{p}\"/><child link=\"{c}\"/>");
        let quaternion = self.origin(origin, &about)?;
        let mut read = SourceJoint {
            axis_line: axis.map(|axis| self.line(axis)),
            limits: None,
            mimic: None,
            name,
            line,
            kind,
            parent,
            child,
            quaternion,
        };
        if fixed {
            self.fixed_extras(axis, mimic);
        } else {
            self.axis(axis, &about)?;
            read.limits = self.limit(limit, &about)?;
            self.dynamics(dynamics, &about)?;
            read.mimic = self.mimic(mimic, &about)?;
        }
        self.out.push_str("</joint>\n");
        Ok(read)
    }

    /// What makes no difference on a fixed joint: an axis that would be an error elsewhere, and mimic.
    fn fixed_extras(&mut self, axis: Option<Node<'a, 'a>>, mimic: Option<Node<'a, 'a>>) {
        if let Some(text) = axis.and_then(|axis| plain(axis, "xyz")) {
            let numbers: Vec<_> = text.split_whitespace().map(str::parse::<f64>).collect();
            let direction = numbers.len() == 3
                && numbers.iter().all(|x| x.as_ref().is_ok_and(|x| x.is_finite()))
                && numbers.iter().any(|x| x != &Ok(0.0));
            if !direction {
                self.note("<axis> of a fixed joint".into());
            }
        }
        if mimic.is_some() {
            self.note("<mimic> of a fixed joint".into());
        }
    }

    fn kind(&self, joint: Node, name: &str, about: &str) -> Result<(JointType, &'static str), UrdfError> {
        let found = self.attribute(joint, about, "type", "type=\"revolute\", continuous, prismatic or fixed")?;
        Ok(match found.trim() {
            "revolute" => (JointType::Revolute, "revolute"),
            "continuous" => (JointType::Continuous, "continuous"),
            "prismatic" => (JointType::Prismatic, "prismatic"),
            "fixed" => (JointType::Fixed, "fixed"),
            "floating" => (JointType::Floating, "floating"),
            "planar" => (JointType::Planar, "planar"),
            "spherical" => (JointType::Spherical, "spherical"),
            other => {
                let (joint_name, line) = (name.to_owned(), self.line(joint));
                return Err(UrdfError::UnknownType { joint: joint_name, line, found: shorten(other) });
            }
        })
    }

    fn axis(&mut self, axis: Option<Node<'a, 'a>>, about: &str) -> Result<(), UrdfError> {
        let Some(axis) = axis else { return Ok(()) };
        self.note_attributes(axis, &["xyz"]);
        self.out.push_str("<axis");
        if self.numbers::<3>(axis, about, "xyz", Range::Finite)?.is_none() {
            let (line, mend) = (self.line(axis), "xyz=\"0 0 1\", the direction in the joint's frame");
            return Err(UrdfError::Missing { about: about.into(), line, missing: "xyz in its <axis>", mend });
        }
        self.out.push_str("/>");
        Ok(())
    }

    fn limit(&mut self, limit: Option<Node<'a, 'a>>, about: &str) -> Result<Option<[bool; 4]>, UrdfError> {
        let Some(limit) = limit else { return Ok(None) };
        let fields = ["lower", "upper", "velocity", "effort"];
        self.note_attributes(limit, &fields);
        self.out.push_str("<limit");
        let mut given = [false; 4];
        for (given, field) in given.iter_mut().zip(fields) {
            *given = self.number(limit, about, field, Range::Any)?;
        }
        if !given[2] {
            self.out.push_str(" velocity=\"0\"");
        }
        self.out.push_str("/>");
        Ok(Some(given))
    }

    fn dynamics(&mut self, dynamics: Option<Node<'a, 'a>>, about: &str) -> Result<(), UrdfError> {
        let Some(dynamics) = dynamics else {
            return Ok(());
        };
        self.note_attributes(dynamics, &["damping", "friction"]);
        self.out.push_str("<dynamics");
        for field in ["damping", "friction"] {
            self.number(dynamics, about, field, Range::Finite)?;
        }
        self.out.push_str("/>");
        Ok(())
    }

    fn mimic(&mut self, mimic: Option<Node<'a, 'a>>, about: &str) -> Result<Option<String>, UrdfError> {
        let Some(mimic) = mimic else { return Ok(None) };
        let leader = self.attribute(mimic, about, "joint", "joint=\"…\" to its <mimic>")?.to_owned();
        self.note_attributes(mimic, &["joint", "multiplier", "offset"]);
        let _ = write!(self.out, "<mimic joint=\"{}\"", escape(&leader));
        for field in ["multiplier", "offset"] {
            self.number(mimic, about, field, Range::Finite)?;
        }
        self.out.push_str("/>");
        Ok(Some(leader))
    }

    fn origin(&mut self, origin: Option<Node<'a, 'a>>, about: &str) -> Result<Option<[f64; 4]>, UrdfError> {
        let Some(origin) = origin else {
            return Ok(None);
        };
        self.note_attributes(origin, &["xyz", "rpy", "quat_xyzw"]);
        self.out.push_str("<origin");
        self.numbers::<3>(origin, about, "xyz", Range::Finite)?;
        let angles = self.numbers::<3>(origin, about, "rpy", Range::Finite)?.is_some();
        self.out.push_str("/>");
        let Some(found) = plain(origin, "quat_xyzw") else {
            return Ok(None);
        };
        let wrong = |expected| self.wrong(origin, about, "quat_xyzw", found, expected);
        if angles {
            return Err(wrong("either rpy or quat_xyzw, not both"));
        }
        if self.version < (1, 1) {
            return Err(wrong("rpy, since readers of URDF 1.0 ignore quat_xyzw; or <robot version=\"1.1\" …>"));
        }
        let quaternion = parse::<4>(found).filter(|q| q.iter().all(|x| x.is_finite() && x.abs() < 1e100));
        match quaternion.filter(|q| q.iter().any(|x| x.abs() > 1e-9)) {
            Some(quaternion) => Ok(Some(quaternion)),
            None => Err(wrong("four finite numbers x y z w, not all zero")),
        }
    }
}
