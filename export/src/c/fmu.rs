//! An FMU: the C file with a cover for FMI 2.0 co-simulation, its description, and a binary where this machine can build one.

use crate::xml::attribute;
use gapscope_dynamics::{JointKind, Model};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{Cursor, Write};
use std::process::Command;
use xmlwriter::{Indent, Options, XmlWriter};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Name of the model in FMI's functions, and of its binary.
const IDENTIFIER: &str = "robot";
const COVER: &str = include_str!("fmu.c");
/// Folder of the binary for this machine in FMI 2.0, and how its file ends; none on others.
const PLATFORM: Option<(&str, &str)> = if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
    Some(("linux64", "so"))
} else if cfg!(all(target_os = "macos", target_pointer_width = "64")) {
    Some(("darwin64", "dylib"))
} else {
    None
};

/// A file that simulators load.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fmu {
    /// The zip archive.
    pub bytes: Vec<u8>,
    /// What it has no binary for, or what it has one for, in a sentence without its end.
    pub note: String,
}

/// Packs `code`, which `super::write` made for steps of `dt` (s), and the weights of a residual, if there is one.
///
/// # Errors
/// A folder for the compiler that cannot be made.
pub fn fmu(model: &Model, code: &str, dt: f64, residual: Option<&[u8]>) -> std::io::Result<Fmu> {
    let guid = guid(code, residual);
    let has_residual = if residual.is_some() { "1" } else { "0" };
    let cover = COVER.replace("@GUID@", &guid).replace("@RESIDUAL@", has_residual);
    let binary = build(code, &cover)?;
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // No time of day: the same robot gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let mut add = |name: &str, bytes: &[u8]| -> std::io::Result<()> {
        zip.start_file(name, options)?;
        zip.write_all(bytes)
    };
    add("modelDescription.xml", description(model, &guid, dt).as_bytes())?;
    add("sources/robot.c", code.as_bytes())?;
    add("sources/fmu.c", cover.as_bytes())?;
    if let Some(weights) = residual {
        add("resources/residual.bin", weights)?;
    }
    if let (Ok(library), Some((folder, ending))) = (&binary, PLATFORM) {
        add(&format!("binaries/{folder}/{IDENTIFIER}.{ending}"), library)?;
    }
    let note = match (binary, PLATFORM) {
        (Ok(_), Some((folder, _))) => format!("it holds a binary for {folder}; elsewhere build one from its sources"),
        (Err(why), _) => format!("it holds no binary: {why}; build one from its sources"),
        (Ok(_), None) => "it holds no binary for this machine; build one from its sources".to_owned(),
    };
    Ok(Fmu { bytes: zip.finish()?.into_inner(), note })
}

/// What tells this FMU from others: the same for the same robot.
fn guid(code: &str, residual: Option<&[u8]>) -> String {
    let half = |salt: u8| {
        let mut digest = DefaultHasher::new();
        (salt, code, residual).hash(&mut digest);
        digest.finish()
    };
    format!("{{{:016x}{:016x}}}", half(0), half(1))
}

/// The shared library, or why there is none.
fn build(code: &str, cover: &str) -> std::io::Result<Result<Vec<u8>, String>> {
    if PLATFORM.is_none() {
        return Ok(Err("FMI 2.0 has no name for this platform".to_owned()));
    }
    let folder = tempfile::tempdir()?;
    for (name, text) in [("robot.c", code), ("fmu.c", cover)] {
        std::fs::write(folder.path().join(name), text)?;
    }
    let flags = ["-std=c99", "-O2", "-fPIC", "-shared", "robot.c", "fmu.c", "-lm", "-o", "library"];
    Ok(match Command::new("cc").args(flags).current_dir(folder.path()).output() {
        Err(_) => Err("there is no C compiler `cc` here".to_owned()),
        Ok(built) if !built.status.success() => {
            let said = String::from_utf8_lossy(&built.stderr);
            Err(format!("the C compiler `cc` failed ({})", said.lines().next().unwrap_or("without a word")))
        }
        Ok(_) => Ok(std::fs::read(folder.path().join("library"))?),
    })
}

/// What a variable is in FMI's terms.
struct Variable {
    name: String,
    about: &'static str,
    unit: &'static str,
    causality: &'static str,
    variability: &'static str,
    /// With a start value of zero, or calculated from those that have one.
    starts: bool,
}

/// All variables by their references: five blocks with one for each joint.
fn variables(model: &Model) -> Vec<Variable> {
    let blocks = [
        ("effort", "effort as it is logged or commanded, held over a step", ["N.m", "N"], "input", "continuous", true),
        ("position", "measured position", ["rad", "m"], "output", "continuous", false),
        ("velocity", "measured speed", ["rad/s", "m/s"], "output", "continuous", false),
        ("start.position", "position at the start", ["rad", "m"], "parameter", "fixed", true),
        ("start.velocity", "speed at the start", ["rad/s", "m/s"], "parameter", "fixed", true),
    ];
    let of = |(block, about, units, causality, variability, starts): (&str, _, [&'static str; 2], _, _, _)| {
        let block = block.to_owned();
        model.joints().iter().map(move |joint| Variable {
            name: format!("{block}.{}", joint.name),
            about,
            unit: units[usize::from(joint.kind == JointKind::Prismatic)],
            causality,
            variability,
            starts,
        })
    };
    blocks.into_iter().flat_map(of).collect()
}

/// `modelDescription.xml`.
fn description(model: &Model, guid: &str, dt: f64) -> String {
    let mut xml = XmlWriter::new(Options { indent: Indent::Spaces(2), ..Options::default() });
    let variables = variables(model);
    xml.start_element("fmiModelDescription");
    xml.write_attribute("fmiVersion", "2.0");
    xml.write_attribute("modelName", &attribute(model.name()));
    xml.write_attribute("guid", guid);
    xml.write_attribute("description", "The corrected model of a robot: efforts in, measured positions and speeds out");
    xml.write_attribute("generationTool", concat!("gapscope ", env!("CARGO_PKG_VERSION")));
    xml.write_attribute("variableNamingConvention", "flat");
    xml.start_element("CoSimulation");
    xml.write_attribute("modelIdentifier", IDENTIFIER);
    for can in ["canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate"] {
        xml.write_attribute(can, "true");
    }
    xml.start_element("SourceFiles");
    for name in ["robot.c", "fmu.c"] {
        xml.start_element("File");
        xml.write_attribute("name", name);
        xml.end_element();
    }
    xml.end_element();
    xml.end_element();
    units(&mut xml);
    xml.start_element("LogCategories");
    xml.start_element("Category");
    xml.write_attribute("name", "logStatusError");
    xml.end_element();
    xml.end_element();
    xml.start_element("DefaultExperiment");
    xml.write_attribute("startTime", "0");
    xml.write_attribute("stepSize", &dt);
    xml.end_element();
    xml.start_element("ModelVariables");
    for (reference, variable) in variables.iter().enumerate() {
        xml.start_element("ScalarVariable");
        xml.write_attribute("name", &attribute(&variable.name));
        xml.write_attribute("valueReference", &reference);
        xml.write_attribute("description", variable.about);
        xml.write_attribute("causality", variable.causality);
        xml.write_attribute("variability", variable.variability);
        if variable.causality != "input" {
            xml.write_attribute("initial", if variable.starts { "exact" } else { "calculated" });
        }
        xml.start_element("Real");
        xml.write_attribute("unit", variable.unit);
        if variable.starts {
            xml.write_attribute("start", "0");
        }
        xml.end_element();
        xml.end_element();
    }
    xml.end_element();
    xml.start_element("ModelStructure");
    for list in ["Outputs", "InitialUnknowns"] {
        xml.start_element(list);
        for (reference, _) in variables.iter().enumerate().filter(|(_, variable)| variable.causality == "output") {
            xml.start_element("Unknown");
            xml.write_attribute("index", &(reference + 1));
            xml.end_element();
        }
        xml.end_element();
    }
    xml.end_element();
    xml.end_document()
}

/// Units by their exponents of SI's base units.
fn units(xml: &mut XmlWriter) {
    let all: [(&str, &[(&str, &str)]); 6] = [
        ("N.m", &[("kg", "1"), ("m", "2"), ("s", "-2")]),
        ("N", &[("kg", "1"), ("m", "1"), ("s", "-2")]),
        ("rad", &[("rad", "1")]),
        ("m", &[("m", "1")]),
        ("rad/s", &[("rad", "1"), ("s", "-1")]),
        ("m/s", &[("m", "1"), ("s", "-1")]),
    ];
    xml.start_element("UnitDefinitions");
    for (name, bases) in all {
        xml.start_element("Unit");
        xml.write_attribute("name", name);
        xml.start_element("BaseUnit");
        for (base, exponent) in bases {
            xml.write_attribute(base, exponent);
        }
        xml.end_element();
        xml.end_element();
    }
    xml.end_element();
}
