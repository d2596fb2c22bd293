//! The files that a recipe names in a run's folder: text, or section of a binary file.

use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use crate::curve::recipe::ForceSource;
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::file::{self, is_file};
use crate::guess;
use crate::solver::{self, Selection};

/// A source file of a run before it is read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Located {
    /// As written in the recipe.
    pub file: String,
    pub path: PathBuf,
    /// Section of a binary file; `None` for a text file.
    pub section: Option<String>,
    /// A binary file next to the text file that has the same section.
    pub binary_beside: Option<(PathBuf, String)>,
    pub size_bytes: u64,
    pub blake3: String,
}

pub(super) fn force_file(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { file, .. } | ForceSource::Body { file, .. } => file,
    }
}

/// Finds the file a recipe names: the text file of that name, or the section of a binout
/// or of an OpenRadioss T01.
pub(super) fn locate_file(folder: &Path, name: &str) -> Result<Located, Error> {
    let names = file_names(folder)?;
    let text = named_text(folder, name, &names)?;
    let is_text = is_file(&text)?;
    let names_only = Selection { audit: false, ..Selection::nothing() };
    let (mut binout, mut damaged) = (None, None);
    let outputs = solver::runs::output_files(folder).map_err(|source| Error::io(folder, source))?;
    for path in outputs {
        let part = shown_name(&path);
        if !solver::is_named_like_binary(&part) {
            continue;
        }
        let sections = match solver::read_sections(&path, None, &names_only) {
            Ok(sections) => sections,
            // Only named like one; or broken, which matters where the text is missing.
            Err(error) if error.is_about("format") => continue,
            Err(error) if is_text && error.code() != ErrorCode::Io => continue,
            Err(error) => return Err(error.at(KeyPath::default())),
        };
        let states: usize = sections.iter().map(|s| s.time.len()).sum();
        if let Some(problem) = sections.iter().find_map(|s| s.problems.first())
            && states == 0
            && damaged.is_none()
        {
            damaged = Some(format!("{part} is damaged ({problem})"));
        }
        if let Some(section) = sections.iter().find(|s| is_section_of(&s.section, name)) {
            binout = Some((path, section.section.clone()));
            break;
        }
    }
    let (path, section, binary_beside) = match (is_text, binout) {
        // A solver that was requested the binary file alone may leave the header of the text.
        (true, Some((path, section))) if is_without_states(&text) => (path, Some(section), None),
        (true, binout) => (text, None, binout),
        (false, Some((path, section))) => (path, Some(section), None),
        (false, None) => {
            let mut found = if names.is_empty() { "no files".into() } else { names.join(", ") };
            if let Some(damaged) = damaged {
                found = format!("{found}; {damaged}");
            }
            let hint = guess::hint(name, &found);
            return Err(error!(
                Run,
                "the run's folder {} has no file \"{name}\": it has {found}{hint}",
                folder.display()
            )
            .at_key("file"));
        }
    };
    let parts = match section {
        Some(_) => solver::family(&path)?,
        None => vec![path.clone()],
    };
    Ok(Located { section, binary_beside, ..hashed_family(name, path, &parts)? })
}

/// The text file that a recipe calls `name`: the one of that name, or with a job id before it.
fn named_text(folder: &Path, name: &str, names: &[String]) -> Result<PathBuf, Error> {
    let exact = folder.join(name);
    let mut of_jobs = Vec::new();
    for name in names.iter().filter(|n| solver::without_job_id(n) == name) {
        if is_file(&folder.join(name))? {
            of_jobs.push(name);
        }
    }
    match of_jobs[..] {
        [first, second, ..] if !is_file(&exact)? => Err(error!(
            Run,
            "the run's folder {} has {first} and {second}: write in the recipe which one is meant",
            folder.display()
        )
        .at_key("file")),
        [only] => Ok(folder.join(only)),
        _ => Ok(exact),
    }
}

/// A text file with at most this many bytes may be a header without states.
const LONGEST_HEADER_BYTES: u64 = 1 << 20;

/// Whether a text file holds a header only.
pub(crate) fn is_without_states(text: &Path) -> bool {
    let is_short = text.metadata().is_ok_and(|meta| meta.len() <= LONGEST_HEADER_BYTES);
    let names_only = Selection { audit: false, ..Selection::nothing() };
    is_short
        && solver::read_sections(text, None, &names_only)
            .is_ok_and(|sections| sections.iter().all(|section| section.time.is_empty()))
}

/// A file with the size and hash of all its parts.
pub(super) fn hashed_family(
    name: &str,
    path: PathBuf,
    parts: &[PathBuf],
) -> Result<Located, Error> {
    let (size_bytes, blake3) = content_hash(parts)?;
    Ok(Located { file: name.into(), size_bytes, blake3, path, section: None, binary_beside: None })
}

/// Size and BLAKE3 of files one after the other.
pub(crate) fn content_hash(parts: &[PathBuf]) -> Result<(u64, String), Error> {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        let io = |source| Error::io(part, source);
        let file = file::open(part).map_err(io)?;
        hasher.update_reader(file).map_err(io)?;
    }
    Ok((hasher.count(), hasher.finalize().to_hex().to_string()))
}

pub(crate) fn shown_name(path: &Path) -> String {
    path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned())
}

/// Whether a binout's section holds what the text file of that name holds.
pub(crate) fn is_section_of(section: &str, name: &str) -> bool {
    section == name || section.strip_prefix(name).is_some_and(|rest| rest == "/forces")
}

fn file_names(folder: &Path) -> Result<Vec<String>, Error> {
    let names = folder.read_dir().and_then(|entries| {
        let name = |e: DirEntry| e.file_name().to_string_lossy().into_owned();
        entries.take(1_000).map(|entry| entry.map(name)).collect()
    });
    let mut names: Vec<String> = names.map_err(|source| Error::io(folder, source))?;
    names.sort();
    Ok(names)
}
