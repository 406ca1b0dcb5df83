//! Logs that are in memory already, as named arrays in the place of files.

use crate::arrays::{self, Array};
use crate::bound::Keeper;
use crate::episode::Episode;
use crate::error::{LogError, LogErrorKind};
use crate::options::ReadOptions;
use crate::read::merged;
use crate::request::Request;
use crate::time_stamps;
use gapscope_dynamics::Finding;

/// One run as named arrays: columns as in a CSV (`time`, `position.<joint>`, …), or whole quantities as in a `.npz`
/// (`time` \[T\], `position` \[T, n\], …). SI units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrays {
    /// What to call the run.
    pub name: String,
    /// Names of the columns of whole quantities; empty where they are in the robot's order.
    pub joints: Vec<String>,
    /// Name, lengths along the axes, and numbers with the last axis fastest.
    pub arrays: Vec<(String, Vec<usize>, Vec<f64>)>,
}

impl Arrays {
    /// The joints that the run names, in its order: its own list, or those of the columns `position.<joint>`.
    pub fn joints(&self) -> Vec<String> {
        if !self.joints.is_empty() {
            return self.joints.clone();
        }
        let named = self.arrays.iter().filter_map(|(name, ..)| name.strip_prefix("position."));
        let named: Vec<String> = named.map(str::to_owned).collect();
        let whole = self.arrays.iter().find(|(name, ..)| name == "position");
        match whole {
            Some((_, shape, _)) if named.is_empty() => {
                (1..=shape.get(1).copied().unwrap_or(1)).map(|joint| format!("joint{joint}")).collect()
            }
            _ => named,
        }
    }
}

/// Reads runs in memory into episodes as [`read_logs`](crate::read_logs) does files: with its rules, findings and errors.
///
/// # Errors
/// The first broken rule of the log format, in the order of `runs`; no partial result. Also if `runs` is empty.
pub fn read_arrays(
    runs: &[Arrays],
    joints: &[String],
    options: &ReadOptions,
) -> Result<(Vec<Episode>, Vec<Finding>), LogError> {
    if runs.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "no log is given").hint("Name one or more log files"));
    }
    if joints.is_empty() {
        return Err(LogError::new(LogErrorKind::MissingJoint, "the robot has no joint that moves")
            .hint("Check the joint types in the URDF"));
    }
    let request = Request { joints, options, look: false };
    let (mut kept, mut findings, mut first_error) = (Keeper::new(options.bound), Vec::new(), None);
    let mut good = 0;
    for (number, run) in runs.iter().enumerate() {
        match read_run(run, &request) {
            Ok((parts, notes)) => {
                good += 1;
                findings.extend(notes);
                parts.into_iter().for_each(|part| kept.add(number, part));
            }
            Err(error) if options.skip_bad_files => {
                findings.push(Finding::new(run.name.as_str(), format!("left out: {error}")));
                first_error.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    let (episodes, notes) = kept.finish();
    findings.extend(notes);
    match first_error {
        Some(error) if good == 0 => Err(error),
        _ => Ok((episodes, merged(findings))),
    }
}

fn read_run(run: &Arrays, request: &Request) -> Result<(Vec<Episode>, Vec<Finding>), LogError> {
    let mut held: Vec<Array> =
        run.arrays.iter().map(|(name, shape, values)| Array::numbers(name, shape.clone(), values.clone())).collect();
    if !run.joints.is_empty() {
        held.push(Array::texts("joint_names", run.joints.clone()));
    }
    let mut table = arrays::columns_or_whole(held, request)
        .and_then(|recording| recording.table(request))
        .map_err(|error| error.file(run.name.clone()))?;
    table.episode.stamps_kept = request.options.keep_stamps;
    let (parts, notes) = time_stamps::split(table, &run.name);
    Ok((parts, notes.into_iter().map(|note| Finding::new(&run.name, note)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::read_logs;

    fn joints() -> Vec<String> {
        ["a", "b"].map(str::to_owned).to_vec()
    }

    fn ramp(scale: f64) -> Vec<f64> {
        (0..30).map(|k| scale * f64::from(k)).collect()
    }

    fn columns() -> Arrays {
        let named = [("time", 0.01), ("position.a", 0.1), ("position.b", 0.2), ("effort.a", 1.0), ("effort.b", 2.0)];
        let arrays = named.map(|(name, scale)| (name.to_owned(), vec![30], ramp(scale))).to_vec();
        Arrays { name: "run".into(), arrays, ..Arrays::default() }
    }

    fn whole(names: &[&str]) -> Arrays {
        let both = |a: f64, b: f64| ramp(a).into_iter().zip(ramp(b)).flat_map(|(a, b)| [a, b]).collect();
        let arrays = vec![
            ("time".to_owned(), vec![30], ramp(0.01)),
            ("position".to_owned(), vec![30, 2], both(0.1, 0.2)),
            ("effort".to_owned(), vec![30, 2], both(1.0, 2.0)),
        ];
        Arrays { name: "run".into(), joints: names.iter().map(|&name| name.to_owned()).collect(), arrays }
    }

    #[test]
    fn arrays_are_read_as_the_file_with_the_same_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run");
        let run = columns();
        let mut text = run.arrays.iter().map(|(name, ..)| name.as_str()).collect::<Vec<_>>().join(",") + "\n";
        for k in 0..30 {
            let row: Vec<String> = run.arrays.iter().map(|(.., values)| values[k].to_string()).collect();
            text += &(row.join(",") + "\n");
        }
        std::fs::write(&file, text).unwrap();
        let (from_file, _) = read_logs(&[file], &joints(), &ReadOptions::default()).unwrap();
        let of = |run: Arrays| read_arrays(&[run], &joints(), &ReadOptions::default()).unwrap().0;
        assert_eq!(of(columns()), from_file);
        assert_eq!(of(whole(&["a", "b"])), from_file);
        assert_eq!(of(whole(&["b", "a"]))[0].position[0], from_file[0].position[1]);
    }

    #[test]
    fn what_is_wrong_names_the_run_and_the_column() {
        let mut run = columns();
        run.arrays[3].2[4] = f64::NAN;
        let error = read_arrays(&[run.clone()], &joints(), &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("run") && error.contains("effort.a") && error.contains("sample 5"), "{error}");
        let lenient = ReadOptions { skip_bad_files: true, ..ReadOptions::default() };
        let mut good = columns();
        good.name = "good".into();
        let (episodes, findings) = read_arrays(&[run, good], &joints(), &lenient).unwrap();
        assert_eq!((episodes.len(), episodes[0].name.as_str()), (1, "good"));
        assert!(findings[0].to_string().contains("left out"), "{findings:?}");
        assert!(read_arrays(&[], &joints(), &lenient).unwrap_err().to_string().contains("no log is given"));
        // An effort that is cut off, beside set points that would do without it.
        let mut cut = whole(&["a", "b"]);
        cut.arrays.push(("command".to_owned(), vec![30, 2], cut.arrays[1].2.clone()));
        cut.arrays[2] = ("effort".to_owned(), vec![5, 2], vec![1.0; 10]);
        let servo = ReadOptions { without_effort: true, ..ReadOptions::default() };
        let error = read_arrays(&[cut.clone()], &joints(), &servo).unwrap_err().to_string();
        assert!(error.contains("`effort`: it has the shape [5, 2], the log 30 samples"), "{error}");
        cut.arrays.remove(2);
        assert!(read_arrays(&[cut], &joints(), &servo).is_ok());
    }
}
