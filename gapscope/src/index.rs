//! `gapscope report`: one page over all diagnoses below a folder.

use crate::report::{Entry, Found, index_page};
use crate::{output, stored};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};

/// The file that makes a folder a diagnosis.
const DIAGNOSIS: &str = "diagnosis.json";
/// Folders inside folders that are searched: a link that leads back ends here.
const DEPTH: usize = 12;
/// Diagnoses of one page; more make a page that no one reads and that opens slowly.
const MOST: usize = 5000;

/// Arguments of `report`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope report runs                          writes runs/index.html over all diagnoses below runs
  gapscope report runs --out week.html --force")]
pub struct Report {
    /// Folder with diagnoses, at any depth
    pub folder: PathBuf,
    /// The page [default: index.html in the folder]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace a page that is there already
    #[arg(long)]
    pub force: bool,
}

/// Writes the page; returns what to print.
///
/// # Errors
/// A folder that cannot be read or holds no diagnosis, or a page that exists or cannot be written.
pub fn run(args: &Report) -> Result<String> {
    let out = args.out.clone().unwrap_or_else(|| args.folder.join("index.html"));
    if out.symlink_metadata().is_ok() && !args.force {
        bail!(
            "{} exists already; choose another file with --out, or allow it to be replaced with --force",
            out.display()
        );
    }
    let mut folders = Vec::new();
    search(&args.folder, DEPTH, &mut folders)
        .with_context(|| format!("cannot read the folder {}", args.folder.display()))?;
    folders.sort();
    if folders.is_empty() {
        bail!("no {DIAGNOSIS} lies in {} or below; `gapscope diagnose` writes one", args.folder.display());
    }
    let mut left_out = Vec::new();
    if folders.len() > MOST {
        left_out.push(format!("{} diagnoses beyond the first {MOST} are left out.", folders.len() - MOST));
        folders.truncate(MOST);
    }
    let mut entries = Vec::new();
    for folder in &folders {
        let name = relative(folder, &out, &args.folder);
        match read(&folder.join(DIAGNOSIS)) {
            Ok(found) => {
                entries.push(Entry { folder: name, has_report: folder.join("report.html").is_file(), found });
            }
            Err(error) => left_out.push(format!("{name}/{DIAGNOSIS} is left out: {error:#}")),
        }
    }
    let title = args.folder.canonicalize().unwrap_or_else(|_| args.folder.clone());
    let title = title.file_name().map_or_else(|| "diagnoses".into(), |name| name.to_string_lossy().into_owned());
    output::write(&out, &index_page(&title, &entries, &left_out))?;
    let mut text = format!("{} of {} diagnoses  {}", entries.len(), folders.len(), out.display());
    for line in left_out {
        text += &format!("\n{}", line.replace(char::is_control, " "));
    }
    Ok(text)
}

/// Folders below that hold a diagnosis. What may not be entered is passed over, but for the first.
fn search(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let children: Vec<PathBuf> = std::fs::read_dir(folder)?.filter_map(|e| Some(e.ok()?.path())).collect();
    if children.iter().any(|child| child.ends_with(DIAGNOSIS) && child.is_file()) {
        found.push(folder.to_owned());
    }
    for child in children.iter().filter(|child| child.is_dir()) {
        if depth > 0 {
            let _ = search(child, depth - 1, found);
        }
    }
    Ok(())
}

/// The folder as seen from the page; whole where the page lies elsewhere.
fn relative(folder: &Path, page: &Path, searched: &Path) -> String {
    let home = page.parent().unwrap_or(Path::new(""));
    let inside = folder.strip_prefix(home).or_else(|_| folder.strip_prefix(searched)).unwrap_or(folder);
    inside.to_string_lossy().replace('\\', "/")
}

fn read(file: &Path) -> Result<Found> {
    let text = std::fs::read_to_string(file)?;
    match stored::diagnosis(&text) {
        Ok(diagnosis) => Ok(Found::from(&diagnosis)),
        // A servo arm's has other figures; what is neither is told as the one that is commoner.
        Err(error) => match serde_json::from_str::<gapscope_servo::schema::Diagnosis>(&text) {
            Ok(diagnosis) => Ok(Found::from(&diagnosis)),
            Err(_) => Err(error).context("it is no diagnosis that this version wrote"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    fn args(folder: &Path) -> Report {
        Report { folder: folder.to_owned(), out: None, force: false }
    }

    #[test]
    fn finds_diagnoses_at_any_depth_and_tells_what_is_none() {
        let dir = tempfile::tempdir().unwrap();
        for (name, diagnosis, _) in sample::all() {
            let text = serde_json::to_string(&diagnosis).unwrap();
            output::write(&dir.path().join("deep").join(name).join(DIAGNOSIS), &text).unwrap();
        }
        output::write(&dir.path().join("broken").join(DIAGNOSIS), "{").unwrap();
        let told = run(&args(dir.path())).unwrap();
        assert!(told.starts_with("6 of 7 diagnoses") && told.contains("broken/diagnosis.json is left out"), "{told}");
        let page = std::fs::read_to_string(dir.path().join("index.html")).unwrap();
        assert!(page.contains("deep/explained"));
        let again = run(&args(dir.path())).unwrap_err().to_string();
        assert!(again.contains("--force"), "{again}");
    }

    #[test]
    fn two_hundred_diagnoses_make_one_small_page() {
        let dir = tempfile::tempdir().unwrap();
        let texts: Vec<String> =
            sample::all().iter().map(|(_, diagnosis, _)| serde_json::to_string(diagnosis).unwrap()).collect();
        for i in 0..200 {
            output::write(&dir.path().join(format!("run_{i:03}")).join(DIAGNOSIS), &texts[i % texts.len()]).unwrap();
        }
        let told = run(&args(dir.path())).unwrap();
        let page = dir.path().join("index.html");
        let bytes = std::fs::metadata(&page).unwrap().len();
        assert!(told.starts_with("200 of 200 diagnoses") && bytes < 600_000, "{told}, {bytes} bytes");
        crate::report::look(&[&page], &["--index"]);
    }

    #[test]
    fn a_folder_without_a_diagnosis_is_told() {
        let dir = tempfile::tempdir().unwrap();
        assert!(run(&args(dir.path())).unwrap_err().to_string().contains("gapscope diagnose"));
    }
}
