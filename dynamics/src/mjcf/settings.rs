//! What holds for the whole file: `<compiler>`, `<option>` and the default classes.

use super::error::MjcfError;
use super::note;
use super::source::Element;
use crate::finding::Finding;
use crate::model::GRAVITY;
use glam::DVec3;
use std::collections::BTreeMap;

/// Where inertia is taken from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FromGeom {
    Never,
    Always,
    /// From geoms where there is no `<inertial>`.
    Lacking,
}

/// What holds for the whole file.
#[derive(Debug)]
pub(super) struct Settings {
    /// Factor from the file's angles to rad.
    pub angle: f64,
    /// Axes of Euler angles in their order; capitals stand for the axes of the parent.
    pub euler: String,
    pub from_geom: FromGeom,
    /// Whether limits hold where `limited` does not say so.
    pub auto_limits: bool,
    /// Groups of geoms whose mass counts, both ends included.
    pub groups: (f64, f64),
    /// m/s².
    pub gravity: DVec3,
    /// Attributes by class and kind of element, those of outer classes included.
    classes: BTreeMap<String, BTreeMap<String, BTreeMap<String, String>>>,
}

impl Settings {
    pub fn read(root: &Element, findings: &mut Vec<Finding>) -> Result<Self, MjcfError> {
        let mut settings = Self {
            angle: std::f64::consts::PI / 180.0,
            euler: "xyz".to_owned(),
            from_geom: FromGeom::Lacking,
            auto_limits: true,
            groups: (0.0, 5.0),
            gravity: GRAVITY,
            classes: BTreeMap::new(),
        };
        for compiler in root.all("compiler") {
            settings.compiler(compiler, findings)?;
        }
        for option in root.all("option") {
            if let Some(gravity) = option.numbers("gravity", 3, [0.0; 3])? {
                settings.gravity = DVec3::from_array(gravity);
            }
            for medium in ["density", "viscosity"] {
                if option.number(medium, 0.0)? != 0.0 {
                    note(
                        findings,
                        "<option>",
                        format!("{medium} of a medium is not read: drag on links is no part of the model"),
                    );
                }
            }
        }
        for defaults in root.all("default") {
            settings.class(defaults, &BTreeMap::new(), 0)?;
        }
        Ok(settings)
    }

    fn compiler(&mut self, compiler: &Element, findings: &mut Vec<Finding>) -> Result<(), MjcfError> {
        let refused = |found: String, mend: &str| Err(MjcfError::new(found, mend).at(compiler));
        match compiler.get("angle") {
            None => {}
            Some("degree") => self.angle = std::f64::consts::PI / 180.0,
            Some("radian") => self.angle = 1.0,
            Some(other) => return refused(format!("found angle=\"{other}\""), "Write degree or radian"),
        }
        if let Some(axes) = compiler.get("eulerseq") {
            if axes.len() != 3 || !axes.chars().all(|axis| "xyzXYZ".contains(axis)) {
                return refused(format!("found eulerseq=\"{axes}\""), "Write three of x, y, z, X, Y, Z");
            }
            self.euler = axes.to_owned();
        }
        match compiler.get("inertiafromgeom") {
            None => {}
            Some("false") => self.from_geom = FromGeom::Never,
            Some("true") => self.from_geom = FromGeom::Always,
            Some(_) => self.from_geom = FromGeom::Lacking,
        }
        match compiler.get("autolimits") {
            None => {}
            Some(value) => self.auto_limits = value != "false",
        }
        if let Some([first, last]) = compiler.numbers("inertiagrouprange", 2, [0.0; 2])? {
            self.groups = (first, last);
        }
        if compiler.get("coordinate") == Some("global") {
            return refused(
                "coordinates are global".into(),
                "Save the model again with a newer MuJoCo, which writes local ones",
            );
        }
        if compiler.number("settotalmass", -1.0)? > 0.0 {
            return refused(
                "settotalmass scales all masses".into(),
                "Save the compiled model (mj_saveLastXML) and give that",
            );
        }
        for bound in ["boundmass", "boundinertia"] {
            if compiler.number(bound, 0.0)? > 0.0 {
                note(findings, "<compiler>", format!("{bound} is not read: bodies keep what the file gives them"));
            }
        }
        Ok(())
    }

    /// Reads a default class and those in it.
    fn class(
        &mut self,
        class: &Element,
        outer: &BTreeMap<String, BTreeMap<String, String>>,
        depth: usize,
    ) -> Result<(), MjcfError> {
        let name = match class.get("class") {
            Some(name) => name.to_owned(),
            None if depth == 0 => "main".to_owned(),
            None => return Err(MjcfError::new("the class has no name", "Give it one: class=\"…\"").at(class)),
        };
        // What is in the outermost class holds everywhere, in whatever order included files bring it.
        let mut own = outer.clone();
        if let Some(known) = self.classes.get(&name) {
            for (kind, attributes) in known {
                own.entry(kind.clone()).or_default().extend(attributes.clone());
            }
        }
        for element in class.children.iter().filter(|element| element.kind != "default") {
            own.entry(element.kind.clone()).or_default().extend(element.attributes.clone());
        }
        for inner in class.all("default") {
            self.class(inner, &own, depth + 1)?;
        }
        self.classes.insert(name, own);
        Ok(())
    }

    /// An element with the attributes that its class, or that of the bodies around it, gives it.
    pub fn filled(&self, element: &Element, around: Option<&str>) -> Result<Element, MjcfError> {
        let class = element.get("class").or(around);
        let known = self.classes.get(class.unwrap_or("main"));
        if known.is_none() && class.is_some_and(|class| class != "main") {
            let class = class.unwrap_or_default();
            return Err(MjcfError::new(
                format!("no default class is named `{class}`"),
                "Correct the name, or include the file that has it",
            )
            .at(element));
        }
        let mut filled = element.clone();
        for (name, value) in known.and_then(|kinds| kinds.get(&element.kind)).into_iter().flatten() {
            filled.attributes.entry(name.clone()).or_insert_with(|| value.clone());
        }
        Ok(filled)
    }
}
