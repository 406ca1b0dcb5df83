//! The robot description from a file: URDF, xacro or MJCF, told by content.

use anyhow::{Context, Result, bail};
use gapscope_dynamics::{Finding, Loaded, Model};
use std::path::Path;
use std::process::Command;

/// The text of a robot description, and what was done to get it.
pub struct Description {
    text: String,
    findings: Vec<Finding>,
}

/// Reads the file; a xacro file is expanded by the user's own `xacro`.
///
/// # Errors
/// A file that cannot be read, is no text, or cannot be expanded.
pub fn read(path: &Path, xacro_args: &[String]) -> Result<Description> {
    let name = path.display();
    let bytes = std::fs::read(path).with_context(|| format!("cannot read the robot description {name}"))?;
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        bail!("{name} is UTF-16 text: save it as UTF-8");
    }
    let text = String::from_utf8(bytes)
        .map_err(|_| anyhow::anyhow!("{name} is not UTF-8 text; expected a URDF or MJCF file, before the logs"))?;
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if !start.starts_with('<') {
        bail!("{name} is no XML; expected a URDF or MJCF file: the robot comes first, then the logs");
    }
    if !is_xacro(&text) {
        return Ok(Description { text, findings: Vec::new() });
    }
    let output = Command::new("xacro").arg(path).args(xacro_args).output().with_context(|| {
        format!("{name} is a xacro file, and `xacro` cannot be run: install it (`pip install xacro`, or ROS), or expand the file on a machine that has it: xacro {name} > robot.urdf")
    })?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        bail!("xacro cannot expand {name}: {}", why.trim().lines().last().unwrap_or("it gives no reason"));
    }
    let text = String::from_utf8(output.stdout).context("xacro wrote something that is not UTF-8 text")?;
    let finding = Finding::new(name.to_string(), "a xacro file: expanded by the `xacro` command of this machine");
    Ok(Description { text, findings: vec![finding] })
}

fn is_xacro(text: &str) -> bool {
    text.contains("xmlns:xacro") && (text.contains("<xacro:") || text.contains("${") || text.contains("$("))
}

impl Description {
    /// A URDF or MJCF text that is in memory.
    pub fn of(text: String) -> Description {
        Description { text, findings: Vec::new() }
    }

    /// The text, xacro expanded.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it is MJCF.
    pub fn is_mjcf(&self) -> bool {
        Model::is_mjcf(&self.text)
    }

    /// The model, with the joints named in `locked` held at zero. Files that an MJCF includes lie beside `path`.
    ///
    /// # Errors
    /// A description that breaks a rule; the text names place and mend.
    pub fn model(&self, path: &Path, locked: &[String]) -> Result<Loaded> {
        let locked: Vec<&str> = locked.iter().map(String::as_str).collect();
        let cannot = || format!("{} cannot be used", path.display());
        let mut loaded = if self.is_mjcf() {
            let include = |file: &str| {
                let file = path.parent().unwrap_or(Path::new("")).join(file);
                std::fs::read_to_string(file).map_err(|error| error.to_string())
            };
            Model::from_mjcf(&self.text, &include, &locked).with_context(cannot)?
        } else {
            Model::from_urdf_locking(&self.text, &locked).with_context(cannot)?
        };
        loaded.findings.splice(0..0, self.findings.iter().cloned());
        Ok(loaded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn xacro_is_told_from_urdf_that_only_names_it() {
        assert!(!is_xacro("<robot xmlns:xacro=\"x\"><link name=\"a\"/></robot>"));
        assert!(is_xacro("<robot xmlns:xacro=\"x\"><xacro:arm/></robot>"));
    }

    #[test]
    fn a_log_in_the_place_of_the_robot_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        std::fs::write(&path, "time,position.a\n").unwrap();
        let error = read(&path, &[]).err().unwrap().to_string();
        assert!(error.contains("the robot comes first"), "{error}");
    }

    #[test]
    fn an_mjcf_file_is_read_with_what_lies_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.xml");
        std::fs::write(&path, "<mujoco><include file=\"body.xml\"/></mujoco>").unwrap();
        let body = "<mujoco><worldbody><body><joint name=\"j\"/><geom size=\"1\"/></body></worldbody></mujoco>";
        std::fs::write(folder.path().join("body.xml"), body).unwrap();
        let loaded = read(&path, &[]).unwrap().model(&path, &[]).unwrap();
        assert_eq!(loaded.model.joints()[0].name, "j");
    }
}
