//! `gapscope withheld` from end to end, on banks small enough for every run.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const SMALL: [&str; 16] = [
    "--cases",
    "1",
    "--none",
    "1",
    "--unknown",
    "1",
    "--robots",
    "double_pendulum",
    "--seconds",
    "3",
    "--episodes",
    "2",
    "--tests",
    "1",
    "--seed",
    "5",
];

fn gapscope(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gapscope"));
    command.arg("withheld").args(args);
    command
}

fn make(bank: &Path, args: &[&str], threads: &str) -> Output {
    let mut command = gapscope(&["make", bank.to_str().unwrap()]);
    command.args(args).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

fn small(folder: &Path) -> PathBuf {
    let bank = folder.join("bank");
    let made = make(&bank, &SMALL, "2");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    bank
}

fn score(bank: &Path, args: &[&str]) -> Output {
    gapscope(&["score", bank.to_str().unwrap()]).args(args).output().unwrap()
}

/// Every file under a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn sealed(bank: &Path) -> PathBuf {
    bank.with_file_name("bank.sealed")
}

/// Fails with exit status 1 and says all of `words`.
fn refused(output: &Output, words: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` is not in: {said}");
    }
}

#[test]
fn the_same_settings_make_the_same_bytes_and_the_truth_lies_apart() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let bank = small(folders[0].path());
    let other = folders[1].path().join("bank");
    assert!(make(&other, &SMALL, "1").status.success());
    let open = files(&bank);
    assert_eq!(open, files(&other));
    assert_eq!(files(&sealed(&bank)), files(&sealed(&other)));

    let names = ["episode_0.csv", "episode_1.csv", "robot.urdf"];
    let expected: Vec<PathBuf> =
        (0..3).flat_map(|i| names.map(|name| PathBuf::from(format!("case_00{i}/{name}")))).collect();
    assert_eq!(open.keys().cloned().collect::<Vec<_>>(), expected);
    // Robots do not differ from case to case, and no file names an effect.
    for i in 1..3 {
        assert_eq!(open[Path::new("case_000/robot.urdf")], open[&PathBuf::from(format!("case_00{i}/robot.urdf"))]);
    }
    let mut kinds = Vec::new();
    for i in 0..3 {
        let truth = fs::read_to_string(sealed(&bank).join(format!("case_00{i}/truth.json"))).unwrap();
        let truth: Value = serde_json::from_str(&truth).unwrap();
        for kind in truth["kinds"].as_array().unwrap() {
            kinds.push(kind.as_str().unwrap().to_owned());
        }
        for effect in truth["effects"].as_array().unwrap() {
            let power = effect["power"].as_array().unwrap();
            assert!(effect["kind"] == "torque_saturation" || power.len() == 2, "{effect}");
        }
    }
    assert_eq!(kinds.len(), 3);
    for (name, bytes) in open.iter().filter(|(name, _)| name.extension().is_some_and(|e| e == "csv")) {
        let text = String::from_utf8_lossy(bytes);
        assert!(kinds.iter().all(|kind| !text.contains(kind.as_str())), "{}", name.display());
        assert_eq!(text.lines().count(), 1501, "{}", name.display());
    }
}

#[test]
fn an_interrupted_bank_is_gone_on_with_and_one_of_other_settings_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let bank = small(folder.path());
    let (open, hidden) = (files(&bank), files(&sealed(&bank)));
    // Cut off between the two folders of one case, and in the middle of writing another.
    fs::remove_dir_all(bank.join("case_001")).unwrap();
    fs::remove_dir_all(bank.join("case_002")).unwrap();
    fs::remove_dir_all(sealed(&bank).join("case_002")).unwrap();
    fs::create_dir(bank.join(".case_002.part")).unwrap();
    fs::write(bank.join(".case_002.part/episode_0.csv"), "time\n0").unwrap();
    let kept = |path: &Path| fs::metadata(path).unwrap().modified().unwrap();
    let before = kept(&bank.join("case_000/episode_0.csv"));
    assert!(make(&bank, &SMALL, "2").status.success());
    assert_eq!((files(&bank), files(&sealed(&bank))), (open.clone(), hidden.clone()));
    assert_eq!(kept(&bank.join("case_000/episode_0.csv")), before);

    let mut other = SMALL;
    other[15] = "6";
    refused(&make(&bank, &other, "2"), &["other settings", "bank.json"]);
    assert_eq!((files(&bank), files(&sealed(&bank))), (open, hidden));
}

#[test]
fn settings_that_make_no_bank_are_refused_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let bank = folder.path().join("bank");
    for (args, words) in [
        (vec!["--cases", "0"], vec!["no case"]),
        (vec!["--seconds", "0.5"], vec!["--seconds", "0.5"]),
        (vec!["--seconds", "nan"], vec!["--seconds"]),
        (vec!["--episodes", "0"], vec!["--episodes"]),
        (vec!["--tests", "0"], vec!["--tests"]),
        (vec!["--robots", "arm9"], vec!["arm9", "arm7"]),
        (vec!["--used", "--none", "1"], vec!["--used", "--cases"]),
        (vec!["--used", "2", "--cases", "0"], vec!["no case"]),
    ] {
        refused(&make(&bank, &args, "1"), &words);
        assert!(!bank.exists() && !sealed(&bank).exists(), "{args:?}");
    }
    let urdf = folder.path().join("broken.urdf");
    fs::write(&urdf, "<robot name=\"x\"><link name=\"a\"/></robot>").unwrap();
    refused(&make(&bank, &["--robots", urdf.to_str().unwrap()], "1"), &["broken.urdf"]);
    // A folder that holds something else is left alone.
    fs::create_dir(&bank).unwrap();
    fs::write(bank.join("mine.txt"), "mine").unwrap();
    refused(&make(&bank, &SMALL, "1"), &["exists already"]);
    assert_eq!(files(folder.path()).len(), 2);
}

#[test]
fn a_bank_is_scored() {
    let folder = tempfile::tempdir().unwrap();
    let bank = small(folder.path());
    let out = folder.path().join("out");
    let answers = folder.path().join("answers");
    let keep = ["--keep", answers.to_str().unwrap()];
    let scored = score(&bank, &[&keep[..], &["--json", "--out", out.to_str().unwrap()]].concat());
    assert!(scored.status.success(), "{}", String::from_utf8_lossy(&scored.stderr));
    let json: Value = serde_json::from_slice(&scored.stdout).unwrap();
    assert_eq!(json["schema"], "gapscope.withheld/1");
    let cases = json["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 3);
    assert!(cases.iter().all(|case| case["error"].is_null() && case["seconds"].as_f64().unwrap() > 0.0));
    // The robot without an effect is known as such, and where a model was corrected, it was evaluated on sealed episodes.
    assert_eq!(json["totals"]["none"]["exact"], 1.0);
    assert!(cases.iter().filter(|case| case["kinds"][0] != "none").any(|case| case["shrink"].is_number()));
    let written: Value = serde_json::from_slice(&fs::read(out.join("score.json")).unwrap()).unwrap();
    assert_eq!(written, json);
    assert!(fs::read_to_string(out.join("score.html")).unwrap().starts_with("<!DOCTYPE html>"));
    let page = fs::read_to_string(out.join("score.md")).unwrap();
    for picture in ["confusion.svg", "calibration.svg", "size.svg"] {
        assert!(page.contains(&format!("]({picture})")), "{picture}");
        assert!(fs::read_to_string(out.join(picture)).unwrap().starts_with("<svg xmlns"), "{picture}");
    }

    // What was kept gives the same count and error of confidence, without a diagnosis more.
    let calibrate = gapscope(&["calibrate", bank.to_str().unwrap(), "--answers", keep[1], "--json"]).output().unwrap();
    let calibrated: Value = serde_json::from_slice(&calibrate.stdout).unwrap();
    assert_eq!((&calibrated["cases"], &calibrated["unanswered"]), (&3.into(), &0.into()));
    assert_eq!(calibrated["overall"]["n"], json["totals"]["reported_effects"]);
    assert_eq!(calibrated["overall"]["error"], json["totals"]["calibration_error"]);
    assert!(calibrated["overall"]["n"].as_u64().unwrap() > 0, "{calibrated}");
    refused(&score(&bank, &keep), &["answers", "diagnosis.json", "--force"]);
    let silent = score(&bank, &[&keep[..], &["--force", "--exe", "/bin/false"]].concat());
    assert!(silent.status.success() && files(&answers).is_empty());

    refused(&score(&bank, &["--out", out.to_str().unwrap()]), &["score.json", "--force"]);
    fs::remove_file(out.join("score.json")).unwrap();
    refused(&score(&bank, &["--out", out.to_str().unwrap()]), &["score.html", "--force"]);
    fs::write(out.join("score.json"), scored.stdout.trim_ascii_end()).unwrap();
    assert_eq!(fs::read(out.join("score.json")).unwrap(), scored.stdout.trim_ascii_end());
}

#[test]
fn used_arms_are_made_and_counted_apart() {
    let folder = tempfile::tempdir().unwrap();
    let bank = folder.path().join("bank");
    let args = ["--used", "2", "--cases", "2", "--robots", "double_pendulum", "--seconds", "3", "--episodes", "1"];
    let made = make(&bank, &args, "2");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for i in 0..2 {
        let head = fs::read_to_string(bank.join(format!("case_00{i}/episode_0.csv"))).unwrap();
        assert!(head.lines().next().unwrap().contains("velocity."));
        let truth = fs::read_to_string(sealed(&bank).join(format!("case_00{i}/truth.json"))).unwrap();
        let truth: Value = serde_json::from_str(&truth).unwrap();
        assert_eq!(truth["used"], 2);
        let parts = truth["effects"].as_array().unwrap().iter().map(|effect| effect["part"].as_str().unwrap());
        assert!(parts.filter(|part| *part == "further").count() < 2);
    }
    let out = folder.path().join("out");
    let scored = score(&bank, &["--exe", "/bin/false", "--json", "--out", out.to_str().unwrap()]);
    let json: Value = serde_json::from_slice(&scored.stdout).unwrap();
    assert_eq!((&json["arms"][0]["used"], &json["arms"][0]["n"]), (&2.into(), &2.into()));
    assert_eq!(json["arms"][0]["impossible"], Value::Null);
    for page in ["score.html", "score.md"] {
        let page = fs::read_to_string(out.join(page)).unwrap();
        assert!(page.contains("Used arms") && page.contains("used 2"));
    }
}

#[test]
fn a_bank_without_its_truth_and_binaries_that_do_not_answer_are_told() {
    let folder = tempfile::tempdir().unwrap();
    refused(&score(&folder.path().join("bank"), &[]), &["cannot find the bank"]);
    let bank = small(folder.path());
    refused(&score(&bank, &["--exe", "/no/such/binary"]), &["/no/such/binary"]);
    refused(&score(&bank, &["--timeout", "0"]), &["--timeout"]);
    let silent = score(&bank, &["--exe", "/bin/false", "--json"]);
    assert!(silent.status.success());
    let json: Value = serde_json::from_slice(&silent.stdout).unwrap();
    assert_eq!(json["totals"]["reported_effects"], 0);
    assert!(json["cases"].as_array().unwrap().iter().all(|case| case["error"].is_string() && case["exact"] == false));
    let hasty = score(&bank, &["--timeout", "0.001", "--json"]);
    let json: Value = serde_json::from_slice(&hasty.stdout).unwrap();
    assert!(json["cases"].as_array().unwrap().iter().all(|case| case["error"] == "timeout"));

    fs::write(sealed(&bank).join("case_001/truth.json"), "{").unwrap();
    refused(&score(&bank, &["--exe", "/bin/false"]), &["case_001", "not the truth"]);
    fs::remove_file(sealed(&bank).join("case_001/truth.json")).unwrap();
    refused(&score(&bank, &["--exe", "/bin/false"]), &["case_001", "truth.json is missing"]);
    fs::remove_dir_all(sealed(&bank)).unwrap();
    refused(&score(&bank, &[]), &["bank.sealed is missing"]);
    refused(&score(folder.path(), &[]), &["holds no case"]);
}

#[test]
fn banks_are_counted_apart_and_together() {
    let folder = tempfile::tempdir().unwrap();
    let bank = small(folder.path());
    let other = folder.path().join("other");
    let mut settings = SMALL;
    settings[15] = "6";
    assert!(make(&other, &settings, "2").status.success());
    // No answers: what is counted is cases.
    let names = [other.to_str().unwrap(), "--exe", "/bin/false"];
    let out = folder.path().join("out");
    let scored = score(&bank, &[&names[..], &["--json", "--out", out.to_str().unwrap()]].concat());
    assert!(scored.status.success(), "{}", String::from_utf8_lossy(&scored.stderr));
    let json: Value = serde_json::from_slice(&scored.stdout).unwrap();
    let banks: Vec<&str> = json["banks"].as_array().unwrap().iter().map(|b| b["bank"].as_str().unwrap()).collect();
    assert_eq!(banks, ["bank", "other"]);
    let none = |totals: &Value| totals["none"]["n"].as_u64().unwrap();
    assert_eq!((none(&json["totals"]), none(&json["banks"][0]["totals"])), (2, 1));
    assert_eq!(json["cases"].as_array().unwrap().len(), 6);
    let page = fs::read_to_string(out.join("score.md")).unwrap();
    assert!(page.contains("| | bank | other | all |") && page.contains("| other/case_001 |"), "{page}");
    let text = String::from_utf8(score(&bank, &names).stdout).unwrap();
    assert!(text.lines().next().unwrap().split_whitespace().eq(["bank", "other", "all"]), "{text}");

    refused(&score(&bank, &[bank.to_str().unwrap()]), &["two banks are named bank"]);
}
