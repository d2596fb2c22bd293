//! What several tests share: where the real files are, how programs are run, the demo's folder and
//! the bundled databases, each made once.
//!
//! A test that needs more than a Rust toolchain bears `#[ignore = "needs …"]`. What it asks for here
//! panics where it is absent, so that no such test can pass without having tested anything.

pub mod containers;
pub mod crash;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, OnceLock};

use serde_json::Value;

/// The repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder of real files kept beside the repository.
pub fn shared(folder: &str) -> PathBuf {
    let path = root().join("../shared").join(folder);
    assert!(path.is_dir(), "this test needs the real files of {}, which is absent", path.display());
    path
}

/// Whether the real files beside the repository are to be read too: they are there, or must be.
pub fn is_with_shared() -> bool {
    let must = std::env::var_os("CRUMPLE_REQUIRE_ALL").is_some_and(|value| !value.is_empty());
    must || root().join("../shared").is_dir()
}

/// The folders of real LS-DYNA samples: one per project in the fixtures, and those of `../shared`
/// where they are. In each, one folder per kind of file.
fn sample_folders() -> Vec<PathBuf> {
    let own = fixture("samples");
    let mut folders: Vec<PathBuf> = entries(&own).into_iter().map(|name| own.join(name)).collect();
    folders.retain(|path| path.is_dir());
    if is_with_shared() {
        folders.push(shared("samples/lsdyna"));
    }
    folders
}

/// The real LS-DYNA samples by their kinds and names. What is in `../shared` as well counts once.
pub fn samples_by_kind() -> BTreeMap<String, BTreeMap<String, PathBuf>> {
    let mut kinds: BTreeMap<String, BTreeMap<String, PathBuf>> = BTreeMap::new();
    for folder in sample_folders() {
        for kind in entries(&folder).into_iter().filter(|kind| folder.join(kind).is_dir()) {
            for name in entries(&folder.join(&kind)) {
                let path = folder.join(&kind).join(&name);
                kinds.entry(kind.clone()).or_default().entry(name).or_insert(path);
            }
        }
    }
    kinds
}

/// The real LS-DYNA samples of one kind of file.
pub fn samples(kind: &str) -> Vec<PathBuf> {
    let files = samples_by_kind().remove(kind).unwrap_or_default();
    assert!(!files.is_empty(), "no sample of {kind}");
    files.into_values().collect()
}

/// A file of the fixtures.
pub fn fixture(path: &str) -> PathBuf {
    root().join("fixtures").join(path)
}

/// The sorted names of what is in a folder.
pub fn entries(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

thread_local! {
    static HELD: std::cell::RefCell<Vec<f64>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// Holds a deviation against its tolerance, and keeps their ratio for docs/verification.md.
#[track_caller]
pub fn within_tolerance(deviation: f64, tolerance: f64) {
    assert!(deviation.abs() <= tolerance, "{deviation:e} exceeds {tolerance:e}");
    HELD.with_borrow_mut(|held| held.push(deviation.abs() / tolerance));
}

/// The ratios held since the last call, on this thread.
pub fn held() -> Vec<f64> {
    HELD.take()
}

/// Whether this run also repeats what only watches: `.ci/thorough` sets it.
pub fn is_thorough() -> bool {
    std::env::var_os("CRUMPLE_THOROUGH").is_some()
}

/// The date of everything that is built here, so that what is built twice is the same.
const DATE: &str = "1767225600";

/// Arguments of the program: a line of words, or a list of them.
pub trait Arguments: std::fmt::Debug {
    fn words(&self) -> Vec<&str>;
}

impl Arguments for str {
    fn words(&self) -> Vec<&str> {
        self.split(' ').collect()
    }
}

impl Arguments for String {
    fn words(&self) -> Vec<&str> {
        self.split(' ').collect()
    }
}

impl Arguments for [&str] {
    fn words(&self) -> Vec<&str> {
        self.to_vec()
    }
}

impl<const N: usize> Arguments for [&str; N] {
    fn words(&self) -> Vec<&str> {
        self.to_vec()
    }
}

impl Arguments for Vec<&str> {
    fn words(&self) -> Vec<&str> {
        self.clone()
    }
}

/// The program, to be run in `folder`.
pub fn program(folder: &Path, arguments: &(impl Arguments + ?Sized)) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_crumple"));
    command.args(arguments.words()).current_dir(folder);
    command
}

/// Starts the program in `folder`; what it says on standard error is kept.
pub fn crumple_started(folder: &Path, arguments: &(impl Arguments + ?Sized)) -> Child {
    let mut command = program(folder, arguments);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The lock of the file at `path`, as a process that writes it holds it.
pub fn held_by_another(path: &Path) -> std::fs::File {
    let name = format!("{}.lock", path.file_name().unwrap().to_str().unwrap());
    let file = std::fs::File::create(path.with_file_name(name)).unwrap();
    file.try_lock().unwrap();
    file
}

/// Runs the program in `folder`.
pub fn crumple_in(folder: &Path, arguments: &(impl Arguments + ?Sized)) -> Output {
    program(folder, arguments).env("SOURCE_DATE_EPOCH", DATE).output().unwrap()
}

/// Runs the program in `folder`, which must exit with 0; returns its standard output.
pub fn crumple_ok(folder: &Path, arguments: &(impl Arguments + ?Sized)) -> String {
    let output = crumple_in(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "crumple {arguments:?} failed:\n{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program in `folder`, which must exit with `code`; returns what it said of it.
pub fn crumple_fails(folder: &Path, code: i32, arguments: &(impl Arguments + ?Sized)) -> String {
    let output = crumple_in(folder, arguments);
    let error = said(&output);
    assert_eq!(output.status.code(), Some(code), "crumple {arguments:?} said:\n{error}");
    assert!(!error.contains("panicked"), "{error}");
    error
}

/// Asserts that a text holds what is expected.
#[track_caller]
pub fn says(text: &str, expected: &str) {
    assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
}

pub fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// The JSON document of a file.
pub fn read_json(path: &Path) -> Value {
    json(&std::fs::read_to_string(path).unwrap())
}

/// What a failing command said: on standard error, and with --json as a document on standard output.
pub fn said(output: &Output) -> String {
    let document: Option<Value> = serde_json::from_slice(&output.stdout).ok();
    let message =
        document.as_ref().and_then(|d| d["error"]["message"].as_str()).unwrap_or_default();
    format!("{}{message}", String::from_utf8_lossy(&output.stderr))
}

/// The Python with the client packages, which `tests/run` installs.
pub fn python() -> Command {
    python_of("CRUMPLE_PYTHON")
}

/// The Python that an environment variable names.
pub fn python_of(variable: &str) -> Command {
    let python = std::env::var_os(variable);
    Command::new(python.unwrap_or_else(|| {
        panic!(
            "this test needs Python clients: {variable} is not set; tests/run installs and sets it"
        )
    }))
}

/// Runs a script of `tests/python` and parses what it prints.
pub fn run_python(mut python: Command, script: &str, arguments: &[&str]) -> Value {
    let output =
        python.arg(root().join("tests/python").join(script)).args(arguments).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script}: {error}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Puts the bundled study of a group into `folder/curves.h5`. The first group of a folder is a copy
/// of a database that was built once for all tests.
pub fn build_fixture(folder: &Path, group: &str) -> PathBuf {
    static BUILT: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let build = |database: &Path| {
        let study = fixture(&format!("fe/{group}/study.toml"));
        crumple_ok(folder, &["build", study.to_str().unwrap(), "-o", database.to_str().unwrap()]);
    };
    let database = folder.join("curves.h5");
    if database.exists() {
        build(&database);
        return database;
    }
    let mut built = BUILT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let bytes = built.entry(group.into()).or_insert_with(|| {
        let elsewhere = tempfile::tempdir().unwrap();
        let database = elsewhere.path().join("curves.h5");
        build(&database);
        std::fs::read(&database).unwrap()
    });
    std::fs::write(&database, bytes).unwrap();
    database
}

/// A copy of a bundled study that may be changed.
pub fn study_in(folder: &Path, group: &str) -> PathBuf {
    let source = fixture(&format!("fe/{group}/study.toml"));
    let parent = source.parent().unwrap().display().to_string();
    let text = std::fs::read_to_string(&source).unwrap();
    // The name of the case stays that of the folder.
    let mut own = String::new();
    for line in text.lines() {
        match line.strip_prefix("path  = \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(run) => own += &format!("path  = \"{parent}/{run}\"\nname  = \"{run}\"\n"),
            None => own += &format!("{line}\n"),
        }
    }
    let path = folder.join(format!("{group}.toml"));
    std::fs::write(&path, own).unwrap();
    path
}

/// Changes a database by `edit`, as any HDF5 program may.
pub fn edited(path: &Path, edit: impl FnOnce(&hdf5_pure::File)) {
    let file = loop {
        match hdf5_pure::File::open_rw(path) {
            // A process that another test is just starting holds our locks until it runs.
            Err(hdf5_pure::Error::FileLocked(_)) => std::thread::yield_now(),
            opened => break opened.unwrap(),
        }
    };
    edit(&file);
    file.commit().unwrap();
    file.close().unwrap();
}

/// What `crumple demo` printed and wrote, kept in memory, so that every test has its own copy.
pub struct Demo {
    /// Its standard output.
    pub printed: String,
    files: BTreeMap<PathBuf, Vec<u8>>,
}

/// The demo, run once for all tests.
pub fn demo() -> &'static Demo {
    static DEMO: OnceLock<Demo> = OnceLock::new();
    DEMO.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let printed = crumple_ok(folder.path(), &["demo"]);
        Demo { printed, files: contents(&folder.path().join("crumple-demo")) }
    })
}

impl Demo {
    /// Writes the demo's files into `folder`.
    pub fn copy_to(&self, folder: &Path) {
        write_contents(folder, &self.files);
    }
}

/// Writes files into `folder`.
pub fn write_contents(folder: &Path, files: &BTreeMap<PathBuf, Vec<u8>>) {
    for (path, bytes) in files {
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

/// A temporary folder with the demo's files.
pub fn demo_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    demo().copy_to(folder.path());
    folder
}

/// The files below `folder`, by their paths in it.
pub fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for name in entries(folder) {
        let (path, name) = (folder.join(&name), Path::new(&name));
        if path.is_dir() {
            files.extend(contents(&path).into_iter().map(|(p, bytes)| (name.join(p), bytes)));
        } else {
            files.insert(name.into(), std::fs::read(path).unwrap());
        }
    }
    files
}
