//! The thin covers of the C file, each compiled with a driver of its own and held to our plant.

use crate::{CASES, Draw, answers, code, command, compile, corrected, effects, has, has_compiler, same};
use gapscope_diagnosis::EncoderSide;
use gapscope_dynamics::{Loaded, Model, StepModel, robots};
use gapscope_effects::Plant;
use gapscope_export::{Robot, Target, export, fmu, weights};
use gapscope_network::{Activation, Init, Mlp, Net};
use gapscope_residual::{Hybrid, On};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::io::{Cursor, Read};
use std::path::Path;
use zip::ZipArchive;

const DT: f64 = 2e-3;

/// A robot with one of every kind that the C file holds.
struct Arm {
    loaded: Loaded,
    code: String,
    plant: Plant,
}

fn arm() -> Arm {
    let loaded = Model::from_urdf(robots::arm6()).unwrap();
    let all = corrected(&loaded.model, effects(&CASES.join(","), &loaded.model), EncoderSide::Motor);
    let code = code(robots::arm6(), &loaded, &all, DT);
    let plant = all.plant(&loaded.model, DT).unwrap();
    Arm { loaded, code, plant }
}

/// Files that a cover needs, written into a folder.
fn write(folder: &Path, files: &[(&str, &str)]) {
    files.iter().for_each(|(name, text)| std::fs::write(folder.join(name), text).unwrap());
}

/// The text that `export` gives for a target.
fn exported(arm: &Arm, target: Target) -> String {
    let robot = Robot { text: robots::arm6(), loaded: &arm.loaded, is_mjcf: false, dt: DT };
    let held = corrected(&arm.loaded.model, effects(CASES[0], &arm.loaded.model), EncoderSide::Link);
    export(target, &robot, &held, &[]).unwrap().text
}

/// Random episodes: the commands `s` and `t` of the drivers, and positions and speeds after each step of a model.
fn episodes(model: &mut impl StepModel, n: usize) -> (String, Vec<Vec<f64>>) {
    let mut draw = Draw(Pcg64::seed_from_u64(5));
    let (mut commands, mut wanted) = (String::new(), Vec::new());
    for _ in 0..3 {
        let (q, v) = (draw.some(n, 1.0), draw.some(n, 1.0));
        command(&mut commands, 's', &[&q, &v]);
        let mut x = vec![0.0; model.state_len()];
        model.start(&q, &v, &mut x);
        for _ in 0..15 {
            let tau = draw.some(n, 4.0);
            command(&mut commands, 't', &[&tau]);
            model.step(&mut x, &tau);
            wanted.push(x[..2 * n].to_vec());
        }
    }
    (commands, wanted)
}

fn agree(folder: &Path, model: &mut impl StepModel, n: usize) {
    let (commands, wanted) = episodes(model, n);
    let told = answers(folder, &commands);
    assert_eq!(told.len(), wanted.len());
    for (i, (wanted, told)) in wanted.iter().zip(&told).enumerate() {
        same(wanted, told, &format!("answer {i}"));
    }
}

#[test]
fn the_class_of_cpp_steps_as_the_plant() {
    if !has_compiler() || !has("c++") {
        return;
    }
    let mut arm = arm();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let header = exported(&arm, Target::Cpp);
    write(folder, &[("robot.c", &arm.code), ("robot.hpp", &header), ("driver.cpp", include_str!("driver.cpp"))]);
    compile(folder, "cc", &["-std=c99", "-c", "robot.c"]);
    for standard in ["-std=c++11", "-std=c++20"] {
        compile(folder, "c++", &[standard, "driver.cpp", "robot.o", "-lm", "-o", "robot"]);
    }
    let n = arm.loaded.model.dof();
    agree(folder, &mut arm.plant, n);
    // A file that is none is an exception that names it; the driver answers with its text's length instead of numbers.
    let told = answers(folder, "w none.bin\n");
    assert_eq!(told, [vec!["cannot read none.bin".len() as f64]]);
}

/// MATLAB is not here: `simstruc.h` is a stand-in with the functions that the S-function calls, by MathWorks' documentation.
#[test]
fn the_s_function_steps_as_the_plant() {
    if !has_compiler() {
        return;
    }
    let mut arm = arm();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let s_function = exported(&arm, Target::Simulink);
    write(
        folder,
        &[
            ("robot.c", &arm.code),
            ("robot_sfun.c", &s_function),
            ("simstruc.h", include_str!("simstruc.h")),
            ("simulink.c", include_str!("driver_simulink.c")),
        ],
    );
    compile(folder, "cc", &["-std=c99", "-DMATLAB_MEX_FILE", "-I.", "robot_sfun.c", "robot.c", "-lm", "-o", "robot"]);
    let n = arm.loaded.model.dof();
    agree(folder, &mut arm.plant, n);
}

fn member(archive: &[u8], name: &str) -> Option<Vec<u8>> {
    let mut archive = ZipArchive::new(Cursor::new(archive)).unwrap();
    let mut bytes = Vec::new();
    archive.by_name(name).ok()?.read_to_end(&mut bytes).unwrap();
    Some(bytes)
}

fn text(archive: &[u8], name: &str) -> String {
    String::from_utf8(member(archive, name).unwrap()).unwrap()
}

/// The sources of an FMU with a driver that calls FMI's functions; with `prefix` those that are linked into a program.
fn build(folder: &Path, archive: &[u8], prefix: &[&str]) {
    let (robot, cover) = (text(archive, "sources/robot.c"), text(archive, "sources/fmu.c"));
    let guid = text(archive, "modelDescription.xml").split("guid=\"").nth(1).unwrap()[..34].to_owned();
    let driver = include_str!("driver_fmu.c").replace("@GUID@", &guid);
    write(folder, &[("robot.c", &robot), ("fmu.c", &cover), ("driver.c", &driver)]);
    compile(folder, "cc", &[&["-std=c99"], prefix, &["robot.c", "fmu.c", "driver.c", "-lm", "-o", "robot"]].concat());
}

#[test]
fn the_fmu_steps_as_the_plant() {
    if !has_compiler() {
        return;
    }
    let mut arm = arm();
    let (model, n) = (&arm.loaded.model, arm.loaded.model.dof());
    let unit = fmu(model, &arm.code, DT, None).unwrap();
    assert_eq!(fmu(model, &arm.code, DT, None).unwrap().bytes, unit.bytes, "the same robot, the same bytes");
    let description = text(&unit.bytes, "modelDescription.xml");
    let document = roxmltree::Document::parse(&description).unwrap();
    let variables: Vec<_> = document.descendants().filter(|node| node.has_tag_name("ScalarVariable")).collect();
    assert_eq!(variables.len(), 5 * n);
    let joint = &model.joints()[1].name;
    assert_eq!(variables[n + 1].attribute("name"), Some(&format!("position.{joint}")[..]));
    if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        assert!(
            member(&unit.bytes, "binaries/linux64/robot.so").is_some_and(|library| library.starts_with(b"\x7fELF"))
        );
        assert!(unit.note.contains("a binary for linux64"), "{}", unit.note);
    }
    for prefix in [&[][..], &["-DFMI2_FUNCTION_PREFIX=robot_"]] {
        let folder = tempfile::tempdir().unwrap();
        build(folder.path(), &unit.bytes, prefix);
        agree(folder.path(), &mut arm.plant, n);
        // Two steps in one, a saved state, and what must be refused; see the driver.
        let checks = answers(folder.path(), "c\n");
        assert_eq!(checks, [vec![1.0; 9]]);
    }
}

#[test]
fn any_name_of_a_joint_stands_in_the_description() {
    let xml = robots::double_pendulum().replace("joint1", "a&lt;b&amp;c");
    let loaded = Model::from_urdf(&xml).unwrap();
    assert_eq!(loaded.model.joints()[0].name, "a<b&c");
    let held = corrected(&loaded.model, Vec::new(), EncoderSide::Link);
    let unit = fmu(&loaded.model, &code(&xml, &loaded, &held, DT), DT, None).unwrap();
    let description = text(&unit.bytes, "modelDescription.xml");
    let document = roxmltree::Document::parse(&description).unwrap();
    assert!(document.descendants().any(|node| node.attribute("name") == Some("position.a<b&c")), "{description}");
    let robot = Robot { text: &xml, loaded: &loaded, is_mjcf: false, dt: DT };
    let mjcf = export(Target::Mjcf, &robot, &held, &[]).unwrap().text;
    assert!(roxmltree::Document::parse(&mjcf).is_ok(), "{mjcf}");
}

#[test]
fn the_fmu_reads_its_residual_from_its_resources() {
    if !has_compiler() {
        return;
    }
    let loaded = Model::from_urdf(robots::double_pendulum()).unwrap();
    let n = loaded.model.dof();
    let held = corrected(&loaded.model, effects(CASES[1], &loaded.model), EncoderSide::Link);
    let code = code(robots::double_pendulum(), &loaded, &held, DT);
    let network = Mlp::<f32>::new(&[3 * n, 8, n], Activation::Tanh, Init::Xavier, 5).unwrap();
    let bytes = weights(&network, On::Torque, n, DT);
    let unit = fmu(&loaded.model, &code, DT, Some(&bytes)).unwrap();
    assert_ne!(
        text(&unit.bytes, "modelDescription.xml"),
        text(&fmu(&loaded.model, &code, DT, None).unwrap().bytes, "modelDescription.xml"),
        "another GUID"
    );
    let folder = tempfile::tempdir().unwrap();
    build(folder.path(), &unit.bytes, &[]);
    std::fs::create_dir(folder.path().join("re sources")).unwrap();
    let weights = member(&unit.bytes, "resources/residual.bin").unwrap();
    std::fs::write(folder.path().join("re sources/residual.bin"), weights).unwrap();
    let physics = held.plant(&loaded.model, DT).unwrap();
    let mut hybrid = Hybrid::new(physics, Net::new(network.cast::<f64>()), On::Torque).unwrap();
    agree(folder.path(), &mut hybrid, n);
}
