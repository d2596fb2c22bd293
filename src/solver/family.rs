//! Which files belong together: the continuations of a binary file, a run's several binouts, the histories of its restarts.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::file::is_file;

/// The files that are read together with `path`, itself first: of a binary file its
/// continuations `name%001`, `name%002`, … as far as they follow each other, with
/// `binout0000` the files `binout0001`, … that other processes of the run wrote, and with
/// `nameT01` the files `nameT02`, … of its restarts.
pub(crate) fn family(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut parts = with_continuations(path)?;
    let name = name_of(path);
    if let Some(number) = restart_number(&name) {
        // Only the first of them includes all, so that each can still be read alone.
        let is_first = number == 1 || !is_file(&restart(path, number - 1))?;
        for next in (number + 1..=LAST_RESTART).map(|n| restart(path, n)) {
            if !is_first || !is_file(&next)? {
                break;
            }
            parts.push(next);
        }
        return Ok(parts);
    }
    let Some((job, number)) = process_number(&name) else { return Ok(parts) };
    let folder = crate::file::folder_of(path);
    let mut others: Vec<(u32, PathBuf)> = Vec::new();
    let io = |source| Error::io(folder, source);
    for entry in folder.read_dir().map_err(io)? {
        let entry = entry.map_err(io)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let other = process_number(&name).filter(|(other, _)| *other == job);
        others.extend(other.map(|(_, number)| (number, entry.path())));
    }
    others.sort();
    // Only the first of them includes all, so that each can still be read alone.
    if others.first().is_some_and(|(first, _)| *first == number) {
        for (_, other) in others.iter().skip(1) {
            if is_file(other)? {
                parts.extend(with_continuations(other)?);
            }
        }
    }
    Ok(parts)
}

/// The text before `binout0000`, a job id or nothing, and its digits.
fn process_number(name: &str) -> Option<(&str, u32)> {
    let (job, digits) = name.rsplit_once("binout")?;
    let is_job = job.is_empty() || job.ends_with('.');
    let is_number = digits.len() == 4 && digits.bytes().all(|b| b.is_ascii_digit());
    (is_job && is_number).then(|| digits.parse().ok().map(|number| (job, number))).flatten()
}

/// OpenRadioss counts the files of a run's restarts with two digits.
const LAST_RESTART: u32 = 99;

/// The number of `nameT01`, of which a run and each of its restarts write one.
pub(crate) fn restart_number(name: &str) -> Option<u32> {
    let (_, digits) = name.rsplit_once('T')?;
    let is_number = digits.len() == 2 && digits.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| digits.parse().ok()).flatten().filter(|&number| number > 0)
}

/// The file of another restart.
fn restart(path: &Path, number: u32) -> PathBuf {
    let name = name_of(path);
    let stem = name.get(..name.len().saturating_sub(2)).unwrap_or_default();
    path.with_file_name(format!("{stem}{number:02}"))
}

fn with_continuations(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut parts = vec![path.to_path_buf()];
    loop {
        let next = continuation(path, parts.len());
        if !is_file(&next)? {
            return Ok(parts);
        }
        parts.push(next);
    }
}

fn continuation(path: &Path, number: usize) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(format!("%{number:03}"));
    PathBuf::from(name)
}

/// Whether a file continues another.
pub(super) fn is_continuation(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().contains('%'))
}

/// Continuations looked for after one that is missing.
const MAX_MISSING_FILES: usize = 20;

/// The first continuation that is missing although others are there, of any of the files, and what is therefore not
/// read.
pub(crate) fn missing_continuation(path: &Path) -> Result<Option<String>, Error> {
    if let Some(number) = restart_number(&name_of(path)) {
        let before = restart(path, number.saturating_sub(1));
        if number > 1 && !is_file(&before)? {
            let missing = name_of(&before);
            return Ok(Some(format!("{missing} is missing, so the record starts late")));
        }
        let next = number + family(path)?.len() as u32;
        return unread_behind((next..=LAST_RESTART).map(|n| restart(path, n)));
    }
    for part in family(path)?.iter().filter(|part| !is_continuation(part)) {
        let next = with_continuations(part)?.len();
        let unread =
            unread_behind((next..=next + MAX_MISSING_FILES).map(|n| continuation(part, n)))?;
        if unread.is_some() {
            return Ok(unread);
        }
    }
    Ok(None)
}

/// The files not read because the first of them is missing.
fn unread_behind(mut files: impl Iterator<Item = PathBuf>) -> Result<Option<String>, Error> {
    let Some(missing) = files.next() else { return Ok(None) };
    if is_file(&missing)? {
        return Ok(None);
    }
    for file in files {
        if is_file(&file)? {
            let missing = name_of(&missing);
            return Ok(Some(format!("{missing} is missing, so its continuation is not read")));
        }
    }
    Ok(None)
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}
