//! The book as mdBook draws it: every page is there, and every link and picture on it leads somewhere.
//!
//! mdBook is a library here, so that a machine with nothing but a Rust toolchain builds the book.
#![allow(clippy::unwrap_used, missing_docs)]

use mdbook_driver::MDBook;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Where `mdbook build book` puts the pages: links out of the book count from there.
const DRAWN: &str = "book/book";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// Files below a folder, as paths within it.
fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let (mut found, mut folders) = (BTreeSet::new(), vec![folder.to_owned()]);
    while let Some(inside) = folders.pop() {
        for entry in fs::read_dir(inside).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else {
                found.insert(entry.strip_prefix(folder).unwrap().to_owned());
            }
        }
    }
    found
}

/// Values of an attribute in a page.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(&start).skip(1).filter_map(|rest| rest.split_once('"')).map(|(value, _)| value).collect()
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut done, part| {
        match part {
            Component::ParentDir => {
                done.pop();
            }
            Component::CurDir => {}
            part => done.push(part),
        }
        done
    })
}

#[test]
fn every_page_is_drawn_and_every_link_on_it_leads_somewhere() {
    let (root, out) = (root(), tempfile::tempdir().unwrap());
    let mut book = MDBook::load(root.join("book")).unwrap();
    out.path().clone_into(&mut book.config.build.build_dir);
    book.build().unwrap();

    let drawn = files(out.path());
    let summary = fs::read_to_string(root.join("book/src/SUMMARY.md")).unwrap();
    let chapters: Vec<&str> =
        summary.split("](").skip(1).filter_map(|rest| rest.split_once(".md)")).map(|(page, _)| page).collect();
    assert!(chapters.len() > 60, "only {} chapters", chapters.len());
    for chapter in chapters {
        assert!(drawn.contains(Path::new(&format!("{chapter}.html"))), "{chapter} is not drawn");
    }

    let pages: BTreeMap<&PathBuf, String> = drawn
        .iter()
        .filter(|file| file.extension().is_some_and(|ending| ending == "html"))
        // The page for addresses that are none takes them from the root of a server.
        .filter(|file| !file.ends_with("404.html"))
        .map(|file| (file, fs::read_to_string(out.path().join(file)).unwrap()))
        .collect();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (file, page) in &pages {
        for target in values(page, "href").into_iter().chain(values(page, "src")) {
            if target.contains(':') || target.is_empty() {
                continue;
            }
            seen += 1;
            let (path, place) = target.split_once('#').unwrap_or((target, ""));
            let from = Path::new(DRAWN).join(file);
            let to = if path.is_empty() { from } else { plain(&from.parent().unwrap().join(path)) };
            let inside = to.strip_prefix(DRAWN).map(Path::to_owned);
            let found = match &inside {
                Ok(inside) => match pages.get(inside) {
                    Some(other) => place.is_empty() || values(other, "id").contains(&place),
                    None => drawn.contains(inside),
                },
                // Out of the book, into the repository.
                Err(_) => root.join(&to).exists(),
            };
            if !found {
                wrong.push(format!("{}: {target}", file.display()));
            }
        }
    }
    assert!(seen > 1000, "only {seen} links were seen");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
