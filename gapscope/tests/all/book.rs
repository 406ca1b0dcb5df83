//! The commands of the book and the README exist, and the effects on the pages can be simulated.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn gapscope() -> Command {
    Command::new(env!("CARGO_BIN_EXE_gapscope"))
}

/// Files below a folder whose names end so; links are not followed.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_dir() {
            found.extend(files(&entry.path(), ending));
        } else if entry.path().extension().is_some_and(|e| e == ending) {
            found.push(entry.path());
        }
    }
    found
}

/// Lines of fenced blocks that start with `gapscope`, without comment.
fn commands(text: &str) -> Vec<String> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if inside && line.starts_with("gapscope ") {
            found.push(line.split(" #").next().unwrap_or(line).trim().to_owned());
        }
    }
    found
}

/// Whether a command line names a subcommand, flags and values that exist. `--help` at its end keeps it from being run.
fn parses(line: &str) -> bool {
    let words = line.split_whitespace().skip(1);
    gapscope().args(words).arg("--help").output().unwrap().status.success()
}

#[test]
fn every_command_of_book_and_readme_exists() {
    let by_hand = ["README.md", "docs/python.md", "docs/export-c.md"].map(|page| root().join(page));
    let pages = files(&root().join("book/src"), "md").into_iter().chain(by_hand);
    let (mut seen, mut wrong) = (0, Vec::new());
    for page in pages {
        for line in commands(&fs::read_to_string(&page).unwrap()) {
            seen += 1;
            if !parses(&line) {
                wrong.push(format!("{}: {line}", page.display()));
            }
        }
    }
    assert!(seen > 60, "only {seen} commands were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for line in
        ["gapscope diagnose a b --no-such-flag", "gapscope no-such-command", "gapscope generate --motion wiggle"]
    {
        assert!(!parses(line), "{line}");
    }
}

#[test]
fn the_effects_on_the_pages_are_those_of_the_files_and_can_be_simulated() {
    let out = tempfile::tempdir().unwrap();
    let all = files(&root().join("book/src/effects"), "json");
    assert_eq!(all.len(), 22, "one file for each kind of the catalogue");
    for file in all {
        let kind = file.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&file).unwrap();
        let page = fs::read_to_string(file.with_extension("md")).unwrap();
        assert!(page.contains(&format!("```json\n{}\n```", text.trim_end())), "{kind}: page and file differ");
        assert!(text.contains(&format!("\"kind\": \"{kind}\"")), "{kind}: the file has another kind");
        let mut command = gapscope();
        command.args(["generate", "arm6", "--episodes", "1", "--seconds", "2", "--effects"]).arg(&file);
        let done = command.arg("--out").arg(out.path().join(kind)).output().unwrap();
        assert!(done.status.success(), "{kind}: {}", String::from_utf8_lossy(&done.stderr));
    }
}
