//! The book and the README: every link resolves, every page is in the summary, no sentence and no README is long.

use gapscope_effects::Kind;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Words of a sentence, at most: more is not understood in one reading.
const LONGEST: usize = 25;
/// Lines of the README, at most: the rest is the book's.
const README: usize = 120;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Markdown files of the book. Pages that commands write lie in `docs`, which is a link here and is not followed.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join("book/src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let entry = entry.unwrap();
            if entry.file_type().unwrap().is_dir() {
                folders.push(entry.path());
            } else if entry.path().extension().is_some_and(|ending| ending == "md") {
                found.push(entry.path());
            }
        }
    }
    found.sort();
    assert!(found.len() > 40, "the book lost its pages: {}", found.len());
    found
}

/// Pages that lie in `docs`: most of them a command writes.
fn docs() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in ["docs", "docs/real", "docs/studies", "docs/withheld"] {
        let files = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
        found.extend(files.filter(|file| file.extension().is_some_and(|ending| ending == "md")));
    }
    found.sort();
    assert!(found.len() > 10, "the docs lost their pages: {}", found.len());
    found
}

/// A text without its fenced blocks; their lines become empty.
fn without_code(text: &str) -> String {
    let mut inside = false;
    let mut out = String::new();
    for line in text.lines() {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        if !inside && !fence {
            out += line;
        }
        out.push('\n');
    }
    out
}

/// A text with each stretch of inline code replaced by one word.
fn one_word_of_code(text: &str) -> String {
    text.split('`').enumerate().map(|(i, part)| if i % 2 == 0 { part } else { "code" }).collect()
}

/// Targets of the links and pictures in a text without code.
fn targets(text: &str) -> Vec<String> {
    let text = one_word_of_code(text);
    let after = text.split("](").skip(1);
    after.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.to_owned()).collect()
}

/// The anchor that mdBook and GitHub give a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().chars();
    let kept = kept.filter(|c| c.is_alphanumeric() || *c == ' ' || *c == '-' || *c == '_');
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

/// What is wrong with the links of a file.
fn broken(file: &Path) -> Vec<String> {
    let text = without_code(&fs::read_to_string(file).unwrap());
    let mut wrong = Vec::new();
    for target in targets(&text) {
        if target.starts_with("http://") || target.starts_with("https://") {
            continue;
        }
        let (path, place) = target.split_once('#').map_or((target.as_str(), None), |(path, place)| (path, Some(place)));
        let other = if path.is_empty() { file.to_path_buf() } else { file.parent().unwrap().join(path) };
        if !other.exists() {
            wrong.push(format!("{}: {target} does not exist", file.display()));
            continue;
        }
        if let Some(place) = place {
            let text = without_code(&fs::read_to_string(&other).unwrap());
            if !text.lines().any(|line| line.starts_with('#') && anchor(line) == place) {
                wrong.push(format!("{}: {target} has no such heading", file.display()));
            }
        }
    }
    wrong
}

/// The text of links without their targets; pictures vanish.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('[') {
        let Some((words, behind)) = after.split_once("](") else { break };
        let Some((_, behind)) = behind.split_once(')') else { break };
        match before.strip_suffix('!') {
            Some(before) => out += before,
            None => {
                out += before;
                out += words;
            }
        }
        rest = behind;
    }
    out + rest
}

/// Sentences of a page that are too long. Code, formulas, tables and HTML do not count; code in a line is one word.
fn long_sentences(text: &str) -> Vec<String> {
    let mut paragraphs = vec![String::new()];
    for line in without_code(text).lines().map(str::trim) {
        let prose = !(line.is_empty() || line.starts_with('|') || line.starts_with('<'));
        let item = line.starts_with("- ") || line.split_once(". ").is_some_and(|(n, _)| n.parse::<u32>().is_ok());
        if !prose || item || line.starts_with('#') {
            paragraphs.push(String::new());
        }
        if prose {
            let last = paragraphs.len() - 1;
            paragraphs[last] += line;
            paragraphs[last].push(' ');
        }
        if line.starts_with('#') {
            paragraphs.push(String::new());
        }
    }
    let mut long = Vec::new();
    for paragraph in paragraphs {
        let text = plain(&one_word_of_code(&paragraph));
        let mut sentence: Vec<&str> = Vec::new();
        for word in text.split_whitespace() {
            sentence.push(word);
            if word.trim_end_matches(['*', '”', ')']).ends_with(['.', '!', '?']) {
                long.extend(too_long(&sentence));
                sentence.clear();
            }
        }
        long.extend(too_long(&sentence));
    }
    long
}

fn too_long(sentence: &[&str]) -> Option<String> {
    let words = sentence.iter().filter(|word| word.chars().any(char::is_alphanumeric)).count();
    (words > LONGEST).then(|| format!("{words} words: {}", sentence.join(" ")))
}

#[test]
fn every_link_of_book_and_readme_resolves() {
    let files = pages().into_iter().chain(docs()).chain([root().join("README.md")]);
    let wrong: Vec<String> = files.flat_map(|file| broken(&file)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_page_is_in_the_summary() {
    let folder = root().join("book/src");
    let summary = fs::read_to_string(folder.join("SUMMARY.md")).unwrap();
    let listed: BTreeSet<PathBuf> = targets(&summary).iter().map(|target| folder.join(target)).collect();
    let missing: Vec<PathBuf> =
        pages().into_iter().filter(|page| !page.ends_with("SUMMARY.md") && !listed.contains(page)).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
    // The book reaches `docs` by a link.
    let in_book = |file: &PathBuf| folder.join(file.strip_prefix(root()).unwrap());
    let missing: Vec<PathBuf> = docs().into_iter().filter(|file| !listed.contains(&in_book(file))).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
}

#[test]
fn the_readme_is_one_screen_and_then_some() {
    let lines = fs::read_to_string(root().join("README.md")).unwrap().lines().count();
    assert!(lines <= README, "{lines} lines");
}

/// What the page of an effect has, beside what is true of it alone.
const PARTS: [&str; 5] = [
    "Source",
    "\n## What it looks like\n",
    "](../pictures/",
    "\n## How to provoke it\n",
    "\n## What it is confused with\n",
];

#[test]
fn every_effect_has_a_page_with_law_picture_provocation_and_confusions() {
    let folder = root().join("book/src/effects");
    let of_robots = Kind::ALL.iter().chain(&Kind::SERVO);
    let kinds: Vec<&str> = of_robots.map(|kind| kind.name()).collect();
    let index = fs::read_to_string(folder.join("index.md")).unwrap();
    for kind in kinds {
        let page = fs::read_to_string(folder.join(format!("{kind}.md"))).unwrap();
        for part in PARTS {
            assert!(page.contains(part), "{kind}.md lacks {part:?}");
        }
        let rivals = page.split("## What it is confused with").nth(1).unwrap().lines();
        assert!(rivals.skip(1).any(|line| line.starts_with("- ")), "{kind}.md names nothing that it is confused with");
        assert!(index.contains(&format!("({kind}.md)")), "{kind} is not in the index");
    }
}

#[test]
fn no_sentence_of_the_book_is_long() {
    let mut long = Vec::new();
    for page in pages().into_iter().chain([root().join("README.md")]) {
        let text = fs::read_to_string(&page).unwrap();
        long.extend(long_sentences(&text).into_iter().map(|sentence| format!("{}: {sentence}", page.display())));
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

#[test]
fn the_rules_find_what_they_are_for() {
    let words = |n: usize| vec!["word"; n].join(" ");
    assert!(long_sentences(&format!("{}.", words(LONGEST))).is_empty());
    assert_eq!(long_sentences(&format!("{}.\n{} end.", words(3), words(LONGEST))).len(), 1);
    assert_eq!(long_sentences(&format!("- [{}](a.md) `x y`\n", words(LONGEST))).len(), 1);
    assert!(long_sentences(&format!("| {} |\n```\n{}\n```\n", words(40), words(40))).is_empty());
    assert_eq!(targets("a [b](c.md) `[d](e)` ![f](g.svg)"), ["c.md", "g.svg"]);
    assert_eq!(anchor("## 3. A real drive"), "3-a-real-drive");
    let nowhere = std::env::temp_dir().join(format!("gapscope_book_{}.md", std::process::id()));
    fs::write(&nowhere, "# Here\n[a](#here) [b](#there) [c](nowhere.md)\n").unwrap();
    let wrong = broken(&nowhere);
    fs::remove_file(&nowhere).unwrap();
    assert_eq!(wrong.len(), 2, "{wrong:?}");
}
