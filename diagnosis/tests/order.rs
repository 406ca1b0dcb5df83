//! The order of the house: files import downwards, and nowhere in a circle.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Storeys of the diagnosis, lowest first: a file imports from its own and from those before.
const STOREYS: [&str; 8] = ["schema", "numbers", "record", "fit", "search", "answer", "carry", "diagnose"];

/// Lines that a file is read in at one sitting; its tests do not count.
const LINES: usize = 400;

/// Crates with circles that are still to be opened, and the files in them.
const OPEN: [(&str, usize); 5] = [("dynamics", 10), ("gapscope", 5), ("network", 3), ("servo", 6), ("withheld", 4)];

/// The files of a crate by module path, without comments and tests.
struct Crate(BTreeMap<String, String>);

impl Crate {
    fn read(source: &Path) -> Crate {
        let mut files = BTreeMap::new();
        let mut open = vec![source.to_owned()];
        while let Some(folder) = open.pop() {
            for entry in std::fs::read_dir(&folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else if path.extension().is_some_and(|end| end == "rs") {
                    let name = path.strip_prefix(source).unwrap().with_extension("");
                    let parts: Vec<&str> = name.iter().map(|part| part.to_str().unwrap()).collect();
                    let parts = match parts.as_slice() {
                        [before @ .., "mod"] | [before @ .., "lib" | "main"] => before,
                        all => all,
                    };
                    files.insert(parts.join("::"), code(&std::fs::read_to_string(&path).unwrap()));
                }
            }
        }
        Crate(files)
    }

    /// The file that holds the longest beginning of a path, re-exports followed; nothing for the face of the crate.
    fn home(&self, path: &[String], depth: usize) -> Option<String> {
        let (file, rest) = (0..=path.len())
            .rev()
            .find_map(|k| self.0.contains_key(&path[..k].join("::")).then(|| (path[..k].join("::"), &path[k..])))?;
        if let (Some(name), true) = (rest.first(), depth < 4) {
            let own: Vec<String> = parts(&file);
            for (at, text) in self.0[&file].match_indices("use ") {
                if !self.0[&file][..at].trim_end().ends_with("pub") && !self.0[&file][..at].trim_end().ends_with(')') {
                    continue;
                }
                let tree = &self.0[&file][at + text.len()..];
                for mut leaf in leaves(&tree[..tree.find(';').unwrap_or(0)]) {
                    if leaf.last() == Some(name) && leaf.len() > 1 {
                        if leaf[0] == "crate" {
                            leaf.remove(0);
                        } else {
                            leaf.splice(0..0, own.clone());
                        }
                        return self.home(&leaf, depth + 1);
                    }
                }
            }
        }
        Some(file).filter(|file| !file.is_empty())
    }

    /// Of each file those that it imports from, by paths that begin with `crate` or `super`.
    fn imports(&self) -> BTreeMap<String, BTreeSet<String>> {
        let of = |(file, text): (&String, &String)| {
            let mut found = BTreeSet::new();
            for root in ["crate::", "super::"] {
                for (at, _) in text.match_indices(root) {
                    let before = text[..at].chars().next_back();
                    if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
                        continue;
                    }
                    for leaf in leaves(&text[at..]) {
                        let mut base = if root == "crate::" { Vec::new() } else { parts(file) };
                        let ups = leaf.iter().take_while(|part| *part == "super").count();
                        base.truncate(base.len().saturating_sub(ups));
                        base.extend(leaf.into_iter().skip(ups.max(1)));
                        found.extend(self.home(&base, 0).filter(|home| home != file));
                    }
                }
            }
            (file.clone(), found)
        };
        self.0.iter().filter(|(file, _)| !file.is_empty()).map(of).collect()
    }
}

fn parts(module: &str) -> Vec<String> {
    module.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect()
}

/// The text up to its tests, without comments.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// All paths of a use tree, or the one path that a text begins with.
fn leaves(text: &str) -> Vec<Vec<String>> {
    let mut path: Vec<String> = Vec::new();
    let mut rest = text.trim_start();
    loop {
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if end > 0 {
            path.push(rest[..end].to_owned());
            rest = &rest[end..];
        }
        if let Some(after) = rest.strip_prefix("::") {
            rest = after;
        } else if let Some(inside) = rest.strip_prefix('{') {
            let mut depth = 0;
            let (mut all, mut begin) = (Vec::new(), 0);
            for (at, c) in inside.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth > 0 => depth -= 1,
                    ',' | '}' if depth == 0 => {
                        all.extend(leaves(&inside[begin..at]).into_iter().map(|leaf| [path.clone(), leaf].concat()));
                        begin = at + 1;
                        if c == '}' {
                            break;
                        }
                    }
                    _ => {}
                }
            }
            return all;
        } else {
            return if path.is_empty() { Vec::new() } else { vec![path] };
        }
    }
}

/// Files that can be come back to from themselves, each with what leads on.
fn circles(imports: &BTreeMap<String, BTreeSet<String>>) -> BTreeMap<String, Vec<String>> {
    let reach = |from: &String| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&String> = imports[from].iter().collect();
        while let Some(next) = open.pop() {
            if seen.insert(next.clone()) {
                open.extend(imports.get(next).into_iter().flatten());
            }
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<String>> = imports.keys().map(|file| (file, reach(file))).collect();
    let back = |file: &String, next: &String| reached.get(next).is_some_and(|of| of.contains(file));
    (imports.iter())
        .map(|(file, next)| (file.clone(), next.iter().filter(|next| back(file, next)).cloned().collect::<Vec<_>>()))
        .filter(|(_, next)| !next.is_empty())
        .collect()
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn paths_are_read_from_trees_and_followed_through_faces() {
    assert_eq!(
        leaves("crate::a::{b, c::{self, D as E}};"),
        [["crate", "a", "b"].map(str::to_owned).to_vec()]
            .into_iter()
            .chain(
                [vec!["crate", "a", "c", "self"], vec!["crate", "a", "c", "D"]]
                    .map(|p| p.iter().map(|s| s.to_string()).collect())
            )
            .collect::<Vec<Vec<String>>>()
    );
    let files = [
        ("", "pub use low::Low; pub mod high;"),
        ("low", "pub struct Low;"),
        ("high", "pub use part::Part; use crate::Low; mod part;"),
        ("high::part", "use super::super::low::Low; use super::Part;"),
        ("round", "fn f() { crate::high::part::g() }"),
        ("back", "use crate::{round::f, low}; use crate::high::Part;"),
    ];
    let files = Crate(files.map(|(name, text)| (name.to_owned(), code(text))).into());
    let imports = files.imports();
    let of = |file: &str| imports[file].iter().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(of("high"), ["low"]);
    assert_eq!(of("high::part"), ["low"], "a face that hands on what it was given is passed through");
    assert_eq!(of("round"), ["high::part"]);
    assert_eq!(of("back"), ["high::part", "low", "round"]);
    assert!(circles(&imports).is_empty());
    let round: BTreeMap<String, BTreeSet<String>> =
        [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a")].map(|(a, b)| (a.to_owned(), [b.to_owned()].into())).into();
    assert_eq!(circles(&round).keys().map(String::as_str).collect::<Vec<_>>(), ["a", "b", "c"]);
}

#[test]
fn the_diagnosis_imports_downwards() {
    let house = Crate::read(&workspace().join("diagnosis/src"));
    let storey = |file: &str| {
        let first = file.split("::").next().unwrap_or_default();
        STOREYS.iter().position(|storey| *storey == first)
    };
    let mut upwards = Vec::new();
    for (file, imports) in house.imports() {
        let own = storey(&file).unwrap_or_else(|| panic!("{file} stands in no storey; storeys are {STOREYS:?}"));
        upwards
            .extend(imports.iter().filter(|other| storey(other) > Some(own)).map(|other| format!("{file} → {other}")));
    }
    assert!(upwards.is_empty(), "{upwards:#?}");
}

#[test]
fn no_crate_has_a_circle_of_files_that_is_not_known() {
    let mut found: BTreeMap<String, BTreeMap<String, Vec<String>>> = BTreeMap::new();
    for entry in std::fs::read_dir(workspace()).unwrap() {
        let room = entry.unwrap().path();
        if room.join("src/lib.rs").exists() || room.join("src/main.rs").exists() {
            let name = room.file_name().unwrap().to_str().unwrap().to_owned();
            found.insert(name, circles(&Crate::read(&room.join("src")).imports()));
        }
    }
    for (name, circles) in found {
        let known = OPEN.iter().find(|(room, _)| *room == name).map_or(0, |(_, files)| *files);
        assert!(circles.len() <= known, "{name}: {} files in circles, {known} are known: {circles:#?}", circles.len());
        assert!(
            circles.len() == known,
            "{name}: {} files in circles; say so in the list of those known",
            circles.len()
        );
    }
}

#[test]
fn files_of_the_diagnosis_and_of_the_effects_are_read_in_one_sitting() {
    for house in ["diagnosis", "effects"] {
        for (file, text) in Crate::read(&workspace().join(house).join("src")).0 {
            let lines = text.lines().count();
            assert!(lines <= LINES, "{house}: {file} has {lines} lines");
        }
    }
}

#[test]
fn no_rule_of_the_diagnosis_is_for_a_single_kind() {
    for (file, text) in Crate::read(&workspace().join("diagnosis/src"))
        .0
        .iter()
        .filter(|(file, _)| *file != "fit::support" && !file.ends_with("tests"))
    {
        for (at, _) in text.match_indices("Kind::") {
            let before = text[..at].chars().next_back();
            let name: String = text[at + 6..].chars().take_while(|c| c.is_alphanumeric()).collect();
            let is_whole = before.is_some_and(|c| c.is_alphanumeric());
            let allowed =
                ["ALL", "OUTSIDE", "Prismatic", "Revolute", "card"].contains(&name.as_str()) || name.is_empty();
            assert!(is_whole || allowed, "{file}: Kind::{name}; what is true of a kind stands on its card");
        }
    }
}
