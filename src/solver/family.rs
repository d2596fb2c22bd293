//! Which files make up one: the continuations of a binary file, and a run's several binouts.

use std::path::{Path, PathBuf};

/// The files that are read together with `path`, itself first: of a binary file its
/// continuations `name%001`, `name%002`, … as far as they follow each other, and with
/// `binout0000` the files `binout0001`, … that other processes of the run wrote.
pub(crate) fn family(path: &Path) -> Vec<PathBuf> {
    let mut parts = with_continuations(path);
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let Some(number) = process_number(&name) else { return parts };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut others: Vec<(u32, PathBuf)> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .filter_map(Result::ok)
        .filter_map(|e| Some((process_number(&e.file_name().to_string_lossy())?, e.path())))
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

/// The digits of `binout0000`.
fn process_number(name: &str) -> Option<u32> {
    let digits = name.strip_prefix("binout")?;
    let is_number = digits.len() == 4 && digits.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| digits.parse().ok()).flatten()
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

/// The first continuation that is missing although later ones are there, of any of the files.
pub(crate) fn missing_continuation(path: &Path) -> Option<String> {
    let first = |path: &Path| (1..).find(|&n| !continuation(path, n).is_file()).unwrap_or(1);
    family(path).iter().filter(|part| !is_continuation(part)).find_map(|part| {
        let missing = first(part);
        let later = missing + 1..=missing + MAX_MISSING_FILES;
        let missing = continuation(part, missing);
        let name = missing.file_name()?.to_string_lossy().into_owned();
        later.into_iter().any(|n| continuation(part, n).is_file()).then_some(name)
    })
}
