//! Run folders: which folders below one contain solver files, which files those are, and which continue each other.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::detect::detect;
pub(crate) use super::detect::is_named_like_output;
use super::detect::{named, without_job_id};
use super::is_output;
use super::source::{self, Access};
use crate::error::Error;
use crate::file::is_file;

/// Folders deeper than this are not examined.
const DEEPEST: usize = 12;
/// Folders that are examined, so that a whole disk is not walked.
const MOST_FOLDERS: usize = 20_000;
/// Names of one folder that are examined.
const MOST_NAMES: usize = 100_000;

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RunFolders {
    /// Folders with solver files, in order of their names; nothing below them is examined.
    pub runs: Vec<PathBuf>,
    /// Folders that hold neither solver files nor folders, likewise.
    pub without_files: Vec<PathBuf>,
    /// Folders that cannot be examined, each with the reason.
    pub unreadable: Vec<(PathBuf, String)>,
}

/// The run folders at or below `root`: itself if it holds solver files, else all below that do.
///
/// Hidden folders are passed over; a folder that is reached by several links counts once. A link out of
/// `root` may lead to a run, but what lies below its target is not searched: it may be a whole disk.
pub(crate) fn run_folders(root: &Path) -> io::Result<RunFolders> {
    if !fs::metadata(root)?.is_dir() {
        let message = "this is not a folder: give a run's folder, or one above runs";
        return Err(io::Error::new(io::ErrorKind::NotADirectory, message));
    }
    root.read_dir()?;
    let real = fs::canonicalize(root)?;
    let mut walk = Walk { root: real, found: RunFolders::default(), seen: HashSet::new() };
    walk.scan_folder(root, 0);
    Ok(walk.found)
}

/// The solver files of a folder in order of their names, each family of a binary file once.
///
/// # Errors
/// If the folder, or what continues a file, cannot be read.
pub fn output_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in folder.read_dir()?.take(MOST_NAMES) {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // A pipe would wait for its writer.
        if is_named_like_output(&name)
            && is_file(&path).map_err(io::Error::other)?
            && !is_continuation(&path)
        {
            files.push(path);
        }
    }
    // Other files end like the history of a restart, too: their content decides.
    let is_restart = |name: &str| restart_number(name).is_some_and(|number| number > 1);
    files.retain(|path| {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        !is_restart(&name) || is_output(path)
    });
    files.sort();
    let mut further = HashSet::new();
    for path in &files {
        further.extend(family(path).map_err(io::Error::other)?.into_iter().skip(1));
    }
    files.retain(|path| !further.contains(path));
    Ok(files)
}

/// Files of a folder that are opened to see what they are.
const MOST_OPENED: usize = 50;

/// The files of a folder that hold what a solver writes under other names, and those names: a run whose files were renamed.
pub(crate) fn renamed_files(folder: &Path) -> Vec<(PathBuf, &'static str)> {
    let entries = folder.read_dir().into_iter().flatten();
    let mut files: Vec<PathBuf> = entries
        .take(MOST_NAMES)
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    let opened = files.into_iter().take(MOST_OPENED);
    let renamed = opened.filter_map(|path| {
        let source = source::open(&path, Access::Plain).ok()?;
        let format = detect(&path, &*source).ok()?;
        Some((path, format.name))
    });
    renamed.collect()
}

struct Walk {
    /// The real place of the folder that was given.
    root: PathBuf,
    found: RunFolders,
    /// Real places of the folders that were examined: links may lead in circles.
    seen: HashSet<PathBuf>,
}

impl Walk {
    fn scan_folder(&mut self, folder: &Path, depth: usize) {
        let place = fs::canonicalize(folder).unwrap_or_else(|_| folder.into());
        let leads_out = !place.starts_with(&self.root);
        if self.seen.len() >= MOST_FOLDERS || !self.seen.insert(place.clone()) {
            return;
        }
        let files = output_files(folder).and_then(|files| Ok((files, folders_in(folder)?)));
        match files {
            Err(error) => self.found.unreadable.push((folder.into(), error.to_string())),
            Ok((files, _)) if !files.is_empty() => self.found.runs.push(folder.into()),
            Ok((_, below)) if below.is_empty() || depth == DEEPEST => {
                self.found.without_files.push(folder.into());
            }
            Ok(_) if leads_out => {
                let why = format!(
                    "it is a link to {}, which is not a run and lies outside the folder searched: name that folder if there are runs below it",
                    place.display()
                );
                self.found.unreadable.push((folder.into(), why));
            }
            Ok((_, below)) => below.iter().for_each(|path| self.scan_folder(path, depth + 1)),
        }
    }
}

/// The folders in a folder that are not hidden, in order of their names.
fn folders_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut folders: Vec<PathBuf> = folder
        .read_dir()?
        .take(MOST_NAMES)
        .filter_map(Result::ok)
        .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
        .map(|entry| entry.path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    Ok(folders)
}

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

/// What to do with the file that a restart has written beside a text file, such as `nodout01`, which is not read with it.
pub(crate) fn unread_restart(path: &Path) -> Option<String> {
    let own = name_of(path);
    // Files of other names are counted by their users.
    named(without_job_id(&own)).ok().filter(|format| !format.is_binary())?;
    let is_of_restart = |name: &String| {
        let number = name.strip_prefix(&own).filter(|number| !number.is_empty());
        number.is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
    };
    let there = crate::file::folder_of(path).read_dir().into_iter().flatten().flatten();
    let names = there.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let first = names.filter(is_of_restart).min()?;
    Some(format!(
        "{first} is not read: it is named like the file of a restart; append its states to this file, or move it away if they are in it"
    ))
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
        let next = number + family(path)?.len() as u32;
        let unread = unread_behind((next..=LAST_RESTART).map(|n| restart(path, n)))?;
        let before = match number > 1 {
            true => Some(record_before(path, number)?),
            false => None,
        };
        let said: Vec<String> = before.into_iter().chain(unread).collect();
        return Ok((!said.is_empty()).then(|| said.join("; ")));
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

/// What comes before a continuation read alone.
fn record_before(path: &Path, number: u32) -> Result<String, Error> {
    let mut first = number;
    while first > 1 && is_file(&restart(path, first - 1))? {
        first -= 1;
    }
    let name = |n: u32| name_of(&restart(path, n));
    if first == number {
        return Ok(format!("{} is missing, so the record starts late", name(number - 1)));
    }
    let (before, read) = (name(number - 1), name(first));
    Ok(match first {
        1 => format!("it continues {before}: read {read} for the whole record"),
        _ => format!(
            "it continues {before}: read {read} for all there is, since {} is missing",
            name(first - 1)
        ),
    })
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

pub(super) fn name_of(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(root: &Path, paths: &[PathBuf]) -> Vec<String> {
        paths.iter().map(|p| p.strip_prefix(root).unwrap().display().to_string()).collect()
    }

    #[test]
    fn finds_the_folders_that_hold_solver_files() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for path in ["b/36/old", "b/25", "a/deep/48", "empty", ".hidden/72", "c"] {
            fs::create_dir_all(root.join(path)).unwrap();
        }
        for path in ["b/36/nodout", "b/25/crashT01", "a/deep/48/binout0000", ".hidden/72/nodout"] {
            fs::write(root.join(path), "").unwrap();
        }
        fs::write(root.join("b/36/old/nodout"), "").unwrap();
        fs::write(root.join("c/notes.txt"), "").unwrap();
        let found = run_folders(root).unwrap();
        assert_eq!(names(root, &found.runs), ["a/deep/48", "b/25", "b/36"]);
        assert_eq!(names(root, &found.without_files), ["c", "empty"]);
        assert_eq!(run_folders(&root.join("b/36")).unwrap().runs, [root.join("b/36")]);
        assert!(run_folders(&root.join("c/notes.txt")).is_err());
        assert!(run_folders(&root.join("none")).is_err());
    }

    #[test]
    fn a_family_of_binary_files_is_one() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["binout0000", "binout0000%001", "binout0003", "nodout", "main.k", "d3plot"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let files = output_files(folder.path()).unwrap();
        assert_eq!(names(folder.path(), &files), ["binout0000", "nodout"]);
    }

    #[test]
    fn renamed_files_are_known_by_what_they_hold() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes"), "nothing\n").unwrap();
        assert_eq!(renamed_files(folder.path()), []);
        let bytes = [8, 8, 8, 1, 1, 1, 0, 0];
        fs::write(folder.path().join("other"), bytes).unwrap();
        assert_eq!(renamed_files(folder.path()), [(folder.path().join("other"), "binout")]);
    }

    #[cfg(unix)]
    #[test]
    fn links_in_a_circle_end() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("a")).unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("a/up")).unwrap();
        assert_eq!(run_folders(folder.path()).unwrap(), RunFolders::default());
    }
}
