//! Which files make up one: the continuations of a binary file, a run's several binouts, the histories of its restarts.

use std::path::{Path, PathBuf};

/// The files that are read together with `path`, itself first: of a binary file its
/// continuations `name%001`, `name%002`, … as far as they follow each other, with
/// `binout0000` the files `binout0001`, … that other processes of the run wrote, and with
/// `nameT01` the files `nameT02`, … of its restarts.
pub(crate) fn family(path: &Path) -> Vec<PathBuf> {
    let mut parts = with_continuations(path);
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(number) = restart_number(&name) {
        // Only the first of them stands for all, so that each can still be looked at alone.
        let is_first = number == 1 || !restart(path, number - 1).is_file();
        let further = || (number + 1..=LAST_RESTART).map(|n| restart(path, n));
        parts.extend(further().filter(|_| is_first).take_while(|part| part.is_file()));
        return parts;
    }
    let Some((job, number)) = process_number(&name) else { return parts };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut others: Vec<(u32, PathBuf)> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .filter_map(Result::ok)
        .filter_map(|e| {
            let name = e.file_name().to_string_lossy().into_owned();
            let (other, number) = process_number(&name)?;
            (other == job).then(|| (number, e.path()))
        })
        .collect();
    others.sort();
    // Only the first of them stands for all, so that each can still be looked at alone.
    if others.first().is_some_and(|(first, _)| *first == number) {
        for (_, other) in others.iter().skip(1).filter(|(_, path)| path.is_file()) {
            parts.extend(with_continuations(other));
        }
    }
    parts
}

/// What stands before `binout0000`, a job id or nothing, and its digits.
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
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.get(..name.len().saturating_sub(2)).unwrap_or_default();
    path.with_file_name(format!("{stem}{number:02}"))
}

fn with_continuations(path: &Path) -> Vec<PathBuf> {
    let mut parts = vec![path.to_path_buf()];
    parts.extend((1..).map(|n| continuation(path, n)).take_while(|part| part.is_file()));
    parts
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

/// Continuations looked for behind one that is missing.
const MAX_MISSING_FILES: usize = 20;

/// The first continuation that is missing although others are there, of any of the files, and what is therefore not
/// read.
pub(crate) fn missing_continuation(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    if let Some(number) = restart_number(&name) {
        let parts = family(path).len() as u32;
        let missing =
            |n: u32| restart(path, n).file_name().map(|n| n.to_string_lossy().into_owned());
        let is_there = |n: u32| restart(path, n).is_file();
        if number > 1 && !is_there(number - 1) {
            return Some(format!(
                "{} is not there, so that the record begins late",
                missing(number - 1)?
            ));
        }
        let next = number + parts;
        let goes_on = !is_there(next) && (next + 1..=LAST_RESTART).any(is_there);
        return missing(next).filter(|_| goes_on).map(unread_behind);
    }
    let first = |path: &Path| (1..).find(|&n| !continuation(path, n).is_file()).unwrap_or(1);
    family(path).iter().filter(|part| !is_continuation(part)).find_map(|part| {
        let missing = first(part);
        let later = missing + 1..=missing + MAX_MISSING_FILES;
        let missing = continuation(part, missing);
        let name = missing.file_name()?.to_string_lossy().into_owned();
        later.into_iter().any(|n| continuation(part, n).is_file()).then(|| unread_behind(name))
    })
}

fn unread_behind(missing: String) -> String {
    format!("{missing} is not there, so that what continues behind it is not read")
}
