//! What several tests share: where the real samples are, how the program is run.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder of real data kept beside the repository, or `None` (said) where it is absent.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let path = root().join("../shared").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there; this test needs the shared real data", path.display());
    None
}

/// The real LS-DYNA samples of one kind of file.
pub fn samples(format: &str) -> Option<Vec<PathBuf>> {
    let folder = shared(&format!("samples/lsdyna/{format}"))?;
    let mut files: Vec<PathBuf> =
        folder.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    Some(files)
}

/// A file of the fixtures.
pub fn fixture(path: &str) -> PathBuf {
    root().join("fixtures").join(path)
}

/// Runs the program in `folder`.
pub fn crumple_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_crumple"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Runs the program in `folder`, which must exit with 0; returns its standard output.
pub fn crumple_ok(folder: &Path, arguments: &[&str]) -> String {
    let output = crumple_in(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "crumple {arguments:?} failed:\n{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program in `folder`, which must exit with `code`; returns its standard error.
pub fn crumple_fails(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = crumple_in(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "crumple {arguments:?} said:\n{error}");
    assert!(!error.contains("panicked"), "{error}");
    error
}

/// The Python with the client packages, or `None` (said) if the test command did not set it.
pub fn python() -> Option<Command> {
    python_of("CRUMPLE_PYTHON")
}

/// The Python that a variable names, in the same way.
pub fn python_of(variable: &str) -> Option<Command> {
    match std::env::var_os(variable) {
        Some(python) => Some(Command::new(python)),
        None => {
            eprintln!("skipped: {variable} is not set; tests/run installs the clients and sets it");
            None
        }
    }
}

/// Builds the bundled study of a group into `folder/curves.h5`.
pub fn build_fixture(folder: &Path, group: &str) -> PathBuf {
    let study = fixture(&format!("fe/{group}/study.toml"));
    let database = folder.join("curves.h5");
    crumple_ok(folder, &["build", study.to_str().unwrap(), "-o", database.to_str().unwrap()]);
    database
}
