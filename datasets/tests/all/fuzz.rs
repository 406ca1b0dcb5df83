//! Broken bytes and broken headers never panic, and never give numbers that are not in the file.

use flate2::{Compression, write::GzEncoder};
use gapscope_datasets::{ColumnMap, Episode, LogError, ReadOptions, read_logs};
use proptest::prelude::*;
use std::io::Write;

fn text() -> Vec<u8> {
    let mut text = b"time,position.a,position.b,effort.a,effort.b,velocity.a,velocity.b,mode\n".to_vec();
    for row in 0..60 {
        let t = f64::from(row) * 0.01;
        writeln!(text, "{t},{},{},{},{},{},{},x", t.sin(), -t, t * 1e-7, 3.0, 1e3 * t, -0.0).unwrap();
    }
    text
}

fn gzipped(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text).unwrap();
    encoder.finish().unwrap()
}

fn read(bytes: &[u8], options: &ReadOptions) -> Result<Vec<Episode>, LogError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    read_logs(&[file.path()], &["a".into(), "b".into()], options).map(|(episodes, _)| episodes)
}

/// Whatever comes back is sound: finite, rectangular, increasing in time; an error names the file and says something.
fn sound(result: Result<Vec<Episode>, LogError>) {
    match result {
        Ok(episodes) => {
            for episode in episodes {
                assert!(episode.len() >= 20 && episode.time.windows(2).all(|pair| pair[0] < pair[1]));
                for channel in gapscope_datasets::Channel::ALL {
                    for row in episode.channel(channel).into_iter().flatten() {
                        assert!(row.len() == episode.len() && row.iter().all(|x| x.is_finite()));
                    }
                }
            }
        }
        Err(error) => assert!(!error.file.is_empty() && error.to_string().len() > error.file.len() + 5),
    }
}

fn options(kind: u8) -> ReadOptions {
    ReadOptions {
        map: if kind & 4 > 0 { ColumnMap::from_pairs(&["velocity.a=mode"]).unwrap() } else { ColumnMap::default() },
        allow_truncated: kind & 1 > 0,
        skip_bad_files: kind & 2 > 0,
        drop_bad_channels: kind & 8 > 0,
        ..ReadOptions::default()
    }
}

const BYTES: &[u8] = b",;\t\n\r\"0123456789.eE+-naif# \x00\xff\xef\xbb\xbf";

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_changed_in_text(
        edits in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(BYTES), 0..3u8), 1..12),
        cut in prop::option::of(any::<prop::sample::Index>()),
        kind in any::<u8>(),
        pack in any::<bool>(),
    ) {
        let mut bytes = text();
        for (place, byte, what) in edits {
            let place = place.index(bytes.len());
            match what {
                0 => bytes[place] = byte,
                1 => bytes.insert(place, byte),
                _ => { bytes.remove(place); }
            }
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        sound(read(&if pack { gzipped(&bytes) } else { bytes }, &options(kind)));
    }

    #[test]
    fn bytes_changed_in_gzip(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
        kind in any::<u8>(),
    ) {
        let mut bytes = gzipped(&text());
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        sound(read(&bytes, &options(kind)));
    }

    #[test]
    fn headers_of_any_names(
        names in prop::collection::vec(prop::sample::select(vec![
            "time", "position.a", "position.b", "effort.a", "effort.b", "velocity.a", "velocity.", ".a", "position", "",
            " time ", "disturbance.b", "position.c", "effort_link.a", "\"x", "#time", "1.5", "Zeit", "position.a.b",
        ]), 0..10),
        rows in prop::collection::vec(prop::collection::vec(-3..4i32, 0..10), 0..30),
        kind in any::<u8>(),
    ) {
        let mut text = names.join(",");
        for (index, row) in rows.iter().enumerate() {
            let cells: Vec<String> = std::iter::once(index as i32).chain(row.iter().copied()).map(|x| x.to_string()).collect();
            text += &format!("\n{}", cells.join(","));
        }
        sound(read(text.as_bytes(), &options(kind)));
    }

    #[test]
    fn maps_of_any_text(lines in prop::collection::vec(prop::sample::select(vec![
        "[columns]", "time = 't'", "position.a = 'x'", "\"position.*\" = '{joint}'", "x = {", "}", "scale = 1", "ignore = ['a']",
        "effort = { column = 'c', scale = -1 }", "effort.a = { column = 'c', scale = inf }", "time.x = 3", "=",
    ]), 0..6)) {
        let _ = ColumnMap::from_toml(&lines.join("\n"));
        let _ = ColumnMap::from_pairs(&lines);
    }
}

#[test]
fn every_cut_of_the_text_is_an_error_or_the_same_numbers() {
    let text = text();
    let whole = &read(&text, &ReadOptions::default()).unwrap()[0];
    let allow = ReadOptions { allow_truncated: true, ..ReadOptions::default() };
    for cut in (0..text.len()).step_by(7) {
        for episode in read(&text[..cut], &allow).into_iter().flatten() {
            assert_eq!(episode.position, whole.part(0, episode.len(), "").position, "cut at {cut}");
        }
    }
}
