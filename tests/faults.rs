//! A fault at every call: whatever one call on a file is told, the old content is there or the new, the
//! error says so, and the next run leaves nothing behind. `faults.c` is what fails the calls, in the program
//! as it is and all that it is made of; nothing in the program knows of it.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use crate::common::{contents, crumple_ok, edited, fixture, is_thorough, root};

type Contents = BTreeMap<PathBuf, Vec<u8>>;

/// What fails the calls, as a library.
fn library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults.so");
        let mut command = Command::new("cc");
        command.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library);
        let output = command.arg(root().join("tests/faults.c")).arg("-ldl").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        library
    })
}

/// A folder, and a command line in it.
struct Trial<'a> {
    here: &'a Path,
    line: &'a str,
}

impl Trial<'_> {
    /// Runs it with faults; the calls up to its end.
    fn run(&self, how: &str, at: usize) -> (Output, Vec<String>) {
        let calls = tempfile::NamedTempFile::new().unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_crumple"))
            .args(self.line.split(' '))
            .env("SOURCE_DATE_EPOCH", "1767225600")
            .env("RAYON_NUM_THREADS", "1")
            .env("LD_PRELOAD", library())
            .env("FAULTS_BELOW", self.here)
            .env("FAULTS_LOG", calls.path())
            .env("FAULTS_HOW", how)
            .env("FAULTS_AT", at.to_string())
            .current_dir(self.here)
            .output()
            .unwrap();
        let calls = fs::read_to_string(calls.path()).unwrap();
        (output, calls.lines().map(str::to_string).collect())
    }

    /// Makes the folder hold this and nothing else.
    fn restore(&self, before: &Contents) {
        for (path, bytes) in contents(self.here) {
            if before.get(&path) != Some(&bytes) {
                fs::remove_file(self.here.join(path)).unwrap();
            }
        }
        for (path, bytes) in before {
            let path = self.here.join(path);
            if !path.exists() {
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, bytes).unwrap();
            }
        }
    }

    /// Fails each of its calls.
    fn hold(&self) {
        let before = contents(self.here);
        let (output, calls) = self.run("once", 0);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let after = contents(self.here);
        assert!(before != after, "{} writes nothing", self.line);
        let plain = output.stdout;
        let mut wrong = Vec::new();
        for how in ["short", "once", "on", "kill"] {
            for at in numbers(how, &calls) {
                self.restore(&before);
                let (output, calls) = self.run(how, at);
                let call = calls.get(at.max(1) - 1).cloned().unwrap_or_default();
                let result = self.judged(how, &call, &output, &before, &after);
                let again = result.and_then(|()| {
                    let now = contents(self.here);
                    let is_new = after.iter().all(|(path, bytes)| now.get(path) == Some(bytes));
                    let (output, _) = self.run("once", 0);
                    let said = String::from_utf8_lossy(&output.stderr).into_owned();
                    if !is_new && (output.status.code() != Some(0)) {
                        return Err(format!("the next run: {said}"));
                    }
                    let now = contents(self.here);
                    let differ: Vec<_> = now
                        .keys()
                        .chain(after.keys())
                        .filter(|path| now.get(*path) != after.get(*path))
                        .collect();
                    if differ.is_empty() {
                        Ok(())
                    } else {
                        Err(format!("after the next run {differ:?} differ; it said {said}"))
                    }
                });
                if let Err(what) = again {
                    wrong.push(format!("{how} {at} ({call}): {what}"));
                }
            }
        }
        let _ = plain;
        assert!(
            wrong.is_empty(),
            "crumple {}: {} of its faults:\n{}",
            self.line,
            wrong.len(),
            wrong.join("\n")
        );
    }

    /// What a run with a fault has left and said.
    fn judged(
        &self,
        how: &str,
        call: &str,
        output: &Output,
        before: &Contents,
        after: &Contents,
    ) -> Result<(), String> {
        let said = String::from_utf8_lossy(&output.stderr);
        let now = contents(self.here);
        for path in before.keys().chain(after.keys()) {
            let there = now.get(path);
            if there != before.get(path) && there != after.get(path) {
                return Err(format!("{} is neither old nor new; it said {said}", path.display()));
            }
        }
        let is_work =
            |name: &str| [".part", ".lock", ".sums"].iter().any(|end| name.ends_with(end));
        for path in now.keys().filter(|p| !before.contains_key(*p) && !after.contains_key(*p)) {
            if !is_work(&path.to_string_lossy()) {
                return Err(format!("{} is left; it said {said}", path.display()));
            }
        }
        let is_new = after.iter().all(|(path, bytes)| now.get(path) == Some(bytes));
        match output.status.code() {
            Some(137) if how == "kill" => Ok(()),
            Some(0) if is_new => Ok(()),
            Some(0) => Err(format!("it says that all is well, and said {said}")),
            Some(1) if how != "short" => {
                let (_, path) = call.split_once(' ').unwrap_or_default();
                let name = path.rsplit('/').next().unwrap_or_default();
                let name = name.trim_start_matches(".crumple-");
                let name = ["", ".part", ".lock", ".sums", ".part"]
                    .iter()
                    .fold(name, |name, end| name.strip_suffix(end).unwrap_or(name));
                const CAUSES: [&str; 4] = [
                    "Input/output error",
                    "No space left on device",
                    "Cannot allocate memory",
                    "No locks available",
                ];
                if said.contains("panicked")
                    || !said.starts_with("error: ")
                    || !said.contains(name)
                    || !CAUSES.iter().any(|cause| said.contains(cause))
                {
                    return Err(format!("it said {said}"));
                }
                Ok(())
            }
            other => Err(format!("it ends with {other:?} and said {said}")),
        }
    }
}

/// The calls that are failed: all of them, or of those that do the same with the same file the first and the
/// last.
fn numbers(how: &str, calls: &[String]) -> BTreeSet<usize> {
    if how == "short" {
        return [0].into();
    }
    if is_thorough() {
        return (1..=calls.len()).collect();
    }
    let of = |call: &String| {
        let position = |c: &String| c == call;
        [calls.iter().position(position), calls.iter().rposition(position)]
    };
    calls.iter().flat_map(of).flatten().map(|k| k + 1).collect()
}
