//! Every rule of the log format that a file can break, and the error that it gets.

use flate2::{Compression, write::GzEncoder};
use gapscope_datasets::{ColumnMap, LogError, LogErrorKind, ReadOptions, read_logs};
use std::io::Write;
use std::path::PathBuf;
use tempfile::TempDir;

const HEADER: &str = "time,position.a,position.b,effort.a,effort.b";

fn joints() -> Vec<String> {
    vec!["a".into(), "b".into()]
}

/// A log of 40 rows under `header`, `cell` making the text of each cell from row (from 0) and column.
fn log(header: &str, cell: impl Fn(usize, usize) -> String) -> String {
    let width = header.split([',', ';', '\t']).count();
    let separator = if header.contains(';') { ";" } else { "," };
    let row = |r: usize| (0..width).map(|c| cell(r, c)).collect::<Vec<_>>().join(separator);
    let rows: Vec<String> = (0..40).map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn plain(row: usize, column: usize) -> String {
    if column == 0 { format!("{}", row as f64 * 0.01) } else { format!("{}.{column}", row % 7) }
}

fn folder_of(files: &[(&str, &[u8])]) -> (TempDir, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let write = |(name, bytes): &(&str, &[u8])| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let paths = files.iter().map(write).collect();
    (folder, paths)
}

fn read_with(text: &[u8], options: &ReadOptions) -> Result<(usize, Vec<String>), LogError> {
    let (_folder, paths) = folder_of(&[("run.csv", text)]);
    let (episodes, findings) = read_logs(&paths, &joints(), options)?;
    let samples = episodes.iter().map(gapscope_datasets::Episode::len).sum();
    Ok((samples, findings.iter().map(ToString::to_string).collect()))
}

fn read(text: impl AsRef<[u8]>) -> Result<(usize, Vec<String>), LogError> {
    read_with(text.as_ref(), &ReadOptions::default())
}

/// Reads what cannot be read, and holds the error to what every error owes.
#[track_caller]
fn error(text: impl AsRef<[u8]>, kind: LogErrorKind, row: Option<usize>, column: Option<&str>) -> String {
    let error = read(text).unwrap_err();
    let line = error.to_string();
    assert_eq!((error.kind, error.row, error.column.as_deref()), (kind, row, column), "{line}");
    assert!(error.file.ends_with("run.csv") && line.contains("run.csv"), "{line}");
    assert!(!error.hint.is_empty(), "{line}");
    line
}

fn gzipped(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(text).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn a_plain_log_is_read_without_a_word() {
    assert_eq!(read(log(HEADER, plain)).unwrap(), (40, vec![]));
    assert_eq!(read(gzipped(log(HEADER, plain).as_bytes())).unwrap(), (40, vec![]));
}

#[test]
fn dialects_are_read() {
    let text = log(HEADER, plain);
    let cases = [
        text.replace('\n', "\r\n"),
        format!("\u{feff}{text}"),
        text.replace(',', " , "),
        text.replace(',', ";"),
        text.replace(',', "\t"),
        format!("# {text}"),
        format!("{text}\n\n"),
        text.replace(HEADER, "\"time\",\"position.a\",\"position.b\",\"effort.a\",\"effort.b\""),
        text.replace('\n', "\r"),
    ];
    for case in cases {
        let (samples, findings) = read(&case).unwrap();
        assert_eq!((samples, findings.len()), (40, 0), "{case:.60} {findings:?}");
    }
}

#[test]
fn joints_that_are_unknown_missing_or_doubled() {
    let line =
        error(log(&format!("{HEADER},velocity.c"), plain), LogErrorKind::UnknownJoint, Some(1), Some("velocity.c"));
    assert!(line.contains("joints are a, b"), "{line}");
    error(log("time,position.a,effort.a,effort.b", plain), LogErrorKind::MissingJoint, Some(1), Some("position.b"));
    error(log("time,position.a,position.b", plain), LogErrorKind::MissingJoint, Some(1), Some("effort.a"));
    error(log(&format!("{HEADER},effort.b"), plain), LogErrorKind::DoubledColumn, Some(1), Some("effort.b"));
    error(log(&HEADER.replace("time", "stamp"), plain), LogErrorKind::MissingColumn, Some(1), Some("time"));
    error(log(&format!("time,{HEADER}"), plain), LogErrorKind::DoubledColumn, Some(1), Some("time"));
}

#[test]
fn cells_that_hold_no_number() {
    let with =
        |bad: &'static str| log(HEADER, move |r, c| if (r, c) == (12, 3) { bad.to_owned() } else { plain(r, c) });
    for bad in ["abc", "1.2.3", "0x10", "1 2", "--1", "\u{0}", "1e", "\"1"] {
        let kind = read(with(bad)).unwrap_err().kind;
        assert!(
            matches!(kind, LogErrorKind::NotANumber | LogErrorKind::RaggedRow | LogErrorKind::Truncated),
            "{bad} {kind:?}"
        );
    }
    let line = error(with("abc"), LogErrorKind::NotANumber, Some(14), Some("effort.a"));
    assert!(line.contains("\"abc\""), "{line}");
    for bad in ["nan", "NaN", "inf", "-Infinity", "1e999"] {
        error(with(bad), LogErrorKind::NotFinite, Some(14), Some("effort.a"));
    }
    error(with(""), LogErrorKind::EmptyCell, Some(14), Some("effort.a"));
    error(with("  "), LogErrorKind::EmptyCell, Some(14), Some("effort.a"));
    error(with("1,5"), LogErrorKind::RaggedRow, Some(14), None);
    let commas = log(HEADER, |r, c| plain(r, c).replace('.', ",")).replace(HEADER, &HEADER.replace(',', ";"));
    let line = read(commas.replacen(',', ";", 0)).unwrap_err().to_string();
    assert!(line.contains("decimal") || line.contains("cells"), "{line}");
}

#[test]
fn decimal_commas_are_read_between_semicolons() {
    let header = HEADER.replace(',', ";");
    let text = log(&header, |r, c| plain(r, c).replace('.', ","));
    assert_eq!(read(text).unwrap(), (40, vec![]));
}

#[test]
fn rows_that_are_ragged_or_cut_off() {
    let text = log(HEADER, plain);
    let lines: Vec<&str> = text.lines().collect();
    let mut short = lines.clone();
    short[20] = "0.19,1,2,3";
    error(short.join("\n") + "\n", LogErrorKind::RaggedRow, Some(21), None);
    let mut long = lines.clone();
    long[20] = "0.19,1,2,3,4,5";
    error(long.join("\n") + "\n", LogErrorKind::RaggedRow, Some(21), None);
    let mut blank = lines.clone();
    blank.insert(10, "");
    blank[30] = "0.28,1,2,3,x";
    error(blank.join("\n") + "\n", LogErrorKind::NotANumber, Some(31), Some("effort.b"));

    let cut = &text[..text.len() - 8];
    error(cut, LogErrorKind::Truncated, Some(41), None);
    error(format!("{}-", &text[..text.len() - 4]), LogErrorKind::Truncated, Some(41), Some("effort.b"));
    let allow = ReadOptions { allow_truncated: true, ..ReadOptions::default() };
    let (samples, findings) = read_with(cut.as_bytes(), &allow).unwrap();
    assert_eq!(samples, 39);
    assert!(findings[0].contains("row 41") && findings[0].contains("up to row 40"), "{findings:?}");

    // A last row that looks whole but has no line end: read, and told; not read where logs may be truncated.
    let open = text.trim_end();
    let (samples, findings) = read(open).unwrap();
    assert!(samples == 40 && findings[0].contains("no line end"), "{findings:?}");
    assert_eq!(read_with(open.as_bytes(), &allow).unwrap().0, 39);

    let packed = gzipped(
        log(HEADER, |r, c| if c == 0 { plain(r, c) } else { format!("{}{}", plain(r, c), r * 7919 % 1000) }).as_bytes(),
    );
    let packed = &packed[..packed.len() * 3 / 4];
    let error = read(packed).unwrap_err();
    assert!(error.kind == LogErrorKind::Truncated && error.row.is_some(), "{error}");
    let (samples, findings) = read_with(packed, &allow).unwrap();
    assert!((20..40).contains(&samples), "{samples}");
    assert!(findings[0].contains("read up to row"), "{findings:?}");
}

#[test]
fn time_that_does_not_increase() {
    let with =
        |bad: &'static str| log(HEADER, move |r, c| if (r, c) == (12, 0) { bad.to_owned() } else { plain(r, c) });
    let line = error(with("0.11"), LogErrorKind::TimeNotIncreasing, Some(14), Some("time"));
    assert!(line.contains("stands still"), "{line}");
    let line = error(with("-3"), LogErrorKind::TimeNotIncreasing, Some(14), Some("time"));
    assert!(line.contains("backwards"), "{line}");
}

#[test]
fn files_that_are_no_csv() {
    error("", LogErrorKind::Empty, None, None);
    error(gzipped(b""), LogErrorKind::Empty, None, None);
    error("\n\n", LogErrorKind::NoHeader, Some(1), None);
    error("0,1,2,3,4\n0.1,1,2,3,4\n", LogErrorKind::NoHeader, Some(1), None);
    error("time position.a position.b effort.a effort.b\n0 1 2 3 4\n", LogErrorKind::NoHeader, Some(1), None);
    error(b"BZh9\x00\x00", LogErrorKind::UnknownContainer, None, None);
    error(b"\xff\xfet\x00i\x00m\x00e\x00", LogErrorKind::Encoding, Some(1), None);
    error(b"time,position.\xff\n", LogErrorKind::Encoding, Some(1), None);
    let missing = read_logs(&["/no/such/run.csv"], &joints(), &ReadOptions::default()).unwrap_err();
    assert!(missing.kind == LogErrorKind::CannotRead && missing.to_string().contains("/no/such/run.csv"), "{missing}");
    let none: [&str; 0] = [];
    assert_eq!(read_logs(&none, &joints(), &ReadOptions::default()).unwrap_err().kind, LogErrorKind::Empty);
    assert_eq!(read_logs(&["x"], &[], &ReadOptions::default()).unwrap_err().kind, LogErrorKind::MissingJoint);
}

#[test]
fn one_bad_file_fails_the_call_unless_it_may_be_left_out() {
    let good = log(HEADER, plain);
    let other = log(HEADER, |r, c| if c == 1 { format!("{}", r * r) } else { plain(r, c) });
    let bad = good.replace("position.a", "position.x");
    let (_folder, paths) =
        folder_of(&[("1.csv", good.as_bytes()), ("2.csv", bad.as_bytes()), ("3.csv", other.as_bytes())]);
    let error = read_logs(&paths, &joints(), &ReadOptions::default()).unwrap_err();
    assert!(error.file.ends_with("2.csv"), "{error}");
    let skip = ReadOptions { skip_bad_files: true, ..ReadOptions::default() };
    let (episodes, findings) = read_logs(&paths, &joints(), &skip).unwrap();
    assert_eq!(episodes.iter().map(|episode| episode.name.as_str()).collect::<Vec<_>>(), ["1.csv", "3.csv"]);
    assert!(
        findings.len() == 1 && findings[0].about == "2.csv" && findings[0].message.contains("left out"),
        "{findings:?}"
    );
    assert!(read_logs(&paths[1..2], &joints(), &skip).is_err());
}

#[test]
fn the_same_log_twice_is_read_once() {
    let text = log(HEADER, plain);
    let (_folder, mut paths) = folder_of(&[("1.csv", text.as_bytes()), ("2.csv", text.as_bytes())]);
    paths.push(paths[0].clone());
    let (episodes, findings) = read_logs(&paths, &joints(), &ReadOptions::default()).unwrap();
    assert_eq!(episodes.len(), 1);
    let messages: Vec<String> = findings.iter().map(ToString::to_string).collect();
    assert!(messages[0].contains("given twice") && messages[1].contains("same samples as 1.csv"), "{messages:?}");
}

#[test]
fn logs_too_short_give_no_episode_and_no_error() {
    let text: String = log(HEADER, plain).lines().take(8).map(|line| format!("{line}\n")).collect();
    let (samples, findings) = read(text).unwrap();
    assert!(samples == 0 && findings[0].contains("only 7 samples"), "{findings:?}");
}

#[test]
fn a_header_alone_is_an_error() {
    error(format!("{HEADER}\n"), LogErrorKind::Empty, Some(1), None);
}

#[test]
fn comments_units_and_separators_behind_each_cell() {
    let text = log(HEADER, plain);
    assert_eq!(read(format!("# made by a logger\n# at noon\n{text}")).unwrap(), (40, vec![]));
    let trailing = text.replace('\n', ",\n");
    assert_eq!(read(&trailing).unwrap(), (40, vec![]), "a comma behind each cell");
    assert_eq!(read(trailing.replacen(",\n", "\n", 1)).unwrap(), (40, vec![]), "but for the header");
    assert_eq!(read(text.replacen('\n', ",\n", 1)).unwrap(), (40, vec![]), "and in the header alone");
    let below = |row: &str| text.replacen('\n', &format!("\n{row}\n"), 1);
    let line = error(below(HEADER), LogErrorKind::NotANumber, Some(2), Some("time"));
    assert!(line.contains("header stands here once more"), "{line}");
    let (samples, findings) = read(below("s,rad,rad,Nm,Nm")).unwrap();
    assert!(samples == 40 && findings[0].contains("read as units"), "{findings:?}");
    let with_comment = error(
        format!("# hello\n{text}").replacen("position", "positoin", 1),
        LogErrorKind::MissingJoint,
        Some(1),
        Some("position.a"),
    );
    assert!(with_comment.contains("no column feeds"), "{with_comment}");
}

#[test]
fn names_that_are_nearly_right_and_those_of_another_robot() {
    let joints = vec!["slider".to_owned()];
    let (_folder, paths) = folder_of(&[("run.csv", log("time,position.slidr,effort.slider", plain).as_bytes())]);
    let line = read_logs(&paths, &joints, &ReadOptions::default()).unwrap_err().to_string();
    assert!(line.contains("--map \"position.slider=position.slidr\""), "{line}");
    let line = error(
        log("time,position.x1,position.x2,effort.x1,effort.x2", plain),
        LogErrorKind::MissingJoint,
        Some(1),
        Some("position.a"),
    );
    assert!(line.contains("`x1`, `x2`") && line.contains("position.a=position.x1"), "{line}");
    let line = error(log("0,0.1,0.2,1,2", plain), LogErrorKind::NoHeader, Some(1), None);
    assert!(line.contains("position.b,effort.a,effort.b"), "{line}");
}

#[test]
fn foreign_columns_are_mapped_and_scaled() {
    let text =
        log(
            "stamp;q_a;q_b;Torque a;Torque b;mode",
            |r, c| {
                if c == 0 { format!("{}", r * 10_000_000) } else { plain(r, c) }
            },
        );
    let map = ColumnMap::from_toml(
        "[columns]\ntime = { column = 'stamp', scale = 1e-9 }\n'position.*' = { column = 'q_{joint}', scale = 0.5 }\neffort.a = 'Torque a'\n",
    )
    .unwrap()
    .overlaid(ColumnMap::from_pairs(&["effort.b=Torque b"]).unwrap());
    let (_folder, paths) = folder_of(&[("run.csv", text.as_bytes())]);
    let (episodes, findings) = read_logs(&paths, &joints(), &ReadOptions { map, ..ReadOptions::default() }).unwrap();
    assert!((episodes[0].time[3] - 0.03).abs() < 1e-12);
    assert_eq!(episodes[0].position[0][5], 2.55);
    assert_eq!(episodes[0].effort[1][5], 5.4);
    assert!(findings[0].to_string().contains("not read: `mode`"), "{findings:?}");
}

#[test]
fn a_channel_with_a_bad_cell_is_left_out_where_that_is_allowed() {
    let header = format!("{HEADER},command.a,command.b");
    let text = log(&header, |r, c| if (r, c) == (12, 5) { String::new() } else { plain(r, c) });
    let line = error(&text, LogErrorKind::EmptyCell, Some(14), Some("command.a"));
    assert!(line.contains("ignore=command.*"), "{line}");
    let lenient = ReadOptions { drop_bad_channels: true, ..ReadOptions::default() };
    let (_folder, paths) = folder_of(&[("run.csv", text.as_bytes())]);
    let (episodes, findings) = read_logs(&paths, &joints(), &lenient).unwrap();
    assert!(episodes[0].command.is_none() && episodes[0].len() == 40);
    assert!(
        findings[0].message.contains("row 14") && findings[0].message.contains("command is left out"),
        "{findings:?}"
    );
    // A known disturbance, or a channel that is needed, is never left out.
    let text = text.replace("command", "disturbance");
    assert!(read_with(text.as_bytes(), &lenient).is_err());
    let mapped =
        ReadOptions { map: ColumnMap::from_pairs(&["ignore=disturbance.*"]).unwrap(), ..ReadOptions::default() };
    assert_eq!(read_with(text.as_bytes(), &mapped).unwrap(), (40, vec![]));
}
