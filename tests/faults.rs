//! A fault at every call: whatever call on a file fails, there is the old content or the new, the error says so,
//! and the next run leaves nothing behind. `faults.c` is what fails the calls, those of the program as it is and
//! of all that it is made of; nothing in the program knows of it.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use crate::common::containers::binout_of;
use crate::common::{
    build_fixture, contents, crumple_ok, demo_folder, edited, fixture, is_thorough, root,
    write_contents,
};
use hdf5_pure::{AttrValue, Error, File, Group};

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

/// A command line in a folder, with what was there before and what is there after.
struct Trial<'a> {
    here: &'a Path,
    line: &'a str,
    before: Contents,
    after: Contents,
    /// Whether HDF5 files are compared by their objects.
    by_objects: bool,
}

/// A run with a fault.
struct Faulty<'a> {
    how: &'a str,
    at: usize,
    output: Output,
    calls: Vec<String>,
}

/// Holds a command against each fault; the folder is then as the command leaves it.
fn hold(here: &Path, line: &str) {
    hold_all(here, line, false);
}

fn hold_all(here: &Path, line: &str, by_objects: bool) {
    let before = contents(here);
    let mut trial = Trial { here, line, before, after: Contents::new(), by_objects };
    let whole = trial.run("once", 0);
    assert_eq!(whole.output.status.code(), Some(0), "{line}: {}", whole.said());
    trial.after = contents(here);
    assert!(trial.before != trial.after, "{line} writes nothing");
    let mut wrong = Vec::new();
    for how in ["short", "once", "on", "kill", "memory"] {
        let calls = match how {
            "memory" => {
                trial.restore();
                trial.run(how, 0).calls
            }
            _ => whole.calls.clone(),
        };
        for at in numbers(how, &calls) {
            trial.restore();
            let faulty = trial.run(how, at);
            let held = trial.judged(&faulty).and_then(|()| trial.next());
            let call = faulty.calls.get(at.max(1) - 1).map_or("", String::as_str);
            wrong.extend(
                held.err()
                    .map(|why| format!("{how} {at} ({call}): {why}; it said: {}", faulty.said())),
            );
        }
    }
    trial.restore();
    trial.run("once", 0);
    assert!(wrong.is_empty(), "{line}: {} faults:\n{}", wrong.len(), wrong.join("\n"));
}

/// The calls that are failed: all of them, or some of those that do the same with the same file.
fn numbers(how: &str, calls: &[String]) -> BTreeSet<usize> {
    if how == "short" {
        return [0].into();
    }
    if is_thorough() {
        return (1..=calls.len()).collect();
    }
    // Continuations that are looked for are many.
    let alike = |call: &str| call.split('%').next().unwrap_or_default().to_string();
    let mut places: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (k, call) in calls.iter().enumerate() {
        places.entry(alike(call)).or_default().push(k + 1);
    }
    let some = |all: Vec<usize>| match how {
        "once" => vec![all[0], all[all.len() / 3], all[all.len() - 1]],
        _ => vec![all[all.len() / 2]],
    };
    places.into_values().flat_map(some).collect()
}

/// What an error says of its cause.
const CAUSES: [&str; 6] = [
    "Input/output error",
    "No space left on device",
    "Cannot allocate memory",
    "No locks available",
    // Of a folder that could not be examined and so was to be made, and a database that was to be read.
    "File exists",
    "No such file or directory",
];

/// The name of the file of a call, without what is added to those of files under work.
fn name_of(call: &str) -> &str {
    let name = call.rsplit(['/', ' ']).next().unwrap_or_default();
    let name = name.strip_prefix(".crumple-").unwrap_or(name);
    let ends = [".sums", ".part", ".lock"];
    ends.iter().fold(name, |name, end| name.strip_suffix(end).unwrap_or(name))
}

impl Faulty<'_> {
    fn said(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }

    /// The names of the files whose calls failed.
    fn names(&self) -> Vec<&str> {
        let failed = self.calls.iter().skip(self.at - 1);
        let failed = failed.take(if self.how == "once" { 1 } else { usize::MAX });
        failed.map(|call| name_of(call)).collect()
    }
}

/// Whether two HDF5 files have the same objects. An editor that cannot read where there is room puts them elsewhere.
fn has_same_objects(a: &Vec<u8>, b: &Vec<u8>) -> bool {
    let objects = |bytes: &Vec<u8>| {
        let file = bytes.starts_with(b"\x89HDF").then(|| File::from_bytes(bytes.clone()))?.ok()?;
        let mut found = Vec::new();
        list(&file.root(), "", &mut found).ok()?;
        Some(found)
    };
    objects(a).is_some_and(|of_a| objects(b).is_some_and(|of_b| of_a == of_b))
}

/// The attributes and values of all objects, by their names.
fn list(group: &Group, name: &str, found: &mut Vec<(String, Vec<u8>)>) -> Result<(), Error> {
    let attributes = |of: HashMap<String, AttrValue>| {
        format!("{:?}", of.into_iter().collect::<BTreeMap<_, _>>()).into_bytes()
    };
    found.push((name.into(), attributes(group.attrs()?)));
    let mut datasets: Vec<_> = group.iter_datasets()?.collect();
    datasets.sort_by(|(a, _), (b, _)| a.cmp(b));
    for (of, dataset) in datasets {
        found.push((format!("{name}/{of}"), attributes(dataset.attrs()?)));
        let kind = format!("{:?} {:?}", dataset.shape()?, dataset.datatype()?);
        found.push((format!("{name}/{of}"), kind.into_bytes()));
        found.push((format!("{name}/{of}"), dataset.read_raw()?));
    }
    let mut groups: Vec<_> = group.iter_groups()?.collect();
    groups.sort_by(|(a, _), (b, _)| a.cmp(b));
    groups.iter().try_for_each(|(of, group)| list(group, &format!("{name}/{of}"), found))
}

/// Files under work, which the next run takes up or removes.
fn is_under_work(path: &Path) -> bool {
    path.extension().is_some_and(|end| ["part", "sums", "lock"].iter().any(|own| end == *own))
}

impl Trial<'_> {
    fn is_same(&self, a: Option<&Vec<u8>>, b: Option<&Vec<u8>>) -> bool {
        a == b || self.by_objects && a.zip(b).is_some_and(|(a, b)| has_same_objects(a, b))
    }

    fn run<'h>(&self, how: &'h str, at: usize) -> Faulty<'h> {
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
        Faulty { how, at, output, calls: calls.lines().map(str::to_string).collect() }
    }

    /// Makes the folder what it was.
    fn restore(&self) {
        let mut missing = self.before.clone();
        for (path, bytes) in contents(self.here) {
            if self.before.get(&path) == Some(&bytes) {
                missing.remove(&path);
            } else {
                fs::remove_file(self.here.join(path)).unwrap();
            }
        }
        write_contents(self.here, &missing);
    }

    /// Whether the folder holds all that the command writes.
    fn is_done(&self) -> bool {
        let now = contents(self.here);
        self.after.iter().all(|(path, bytes)| self.is_same(now.get(path), Some(bytes)))
    }

    /// What a run with a fault may leave and say.
    fn judged(&self, faulty: &Faulty<'_>) -> Result<(), String> {
        let now = contents(self.here);
        let paths: BTreeSet<&PathBuf> =
            [&self.before, &self.after, &now].into_iter().flat_map(Contents::keys).collect();
        for path in paths.into_iter().filter(|path| !is_under_work(path)) {
            let there = now.get(path);
            if !self.is_same(there, self.before.get(path))
                && !self.is_same(there, self.after.get(path))
            {
                return Err(format!("{} is neither old nor new", path.display()));
            }
        }
        let said = faulty.said();
        let is = |holds: bool, what: &str| if holds { Ok(()) } else { Err(what.to_string()) };
        match (faulty.how, faulty.output.status.code()) {
            (_, Some(0)) => is(self.is_done(), "it says that all is well"),
            ("kill", Some(137)) => Ok(()),
            // What no file tells the size of ends the program at once.
            ("memory", None) => {
                let is_ended = faulty.output.status.signal() == Some(6);
                is(is_ended && said.contains("memory allocation of"), "it ends without a word")
            }
            ("memory", Some(1)) => is(said.contains("not enough memory"), "no word of memory"),
            ("once" | "on", Some(1)) => {
                is(said.contains("error: ") && !said.contains("panicked"), "it has no error")?;
                is(faulty.names().iter().any(|name| said.contains(name)), "it names no file")?;
                is(CAUSES.iter().any(|cause| said.contains(cause)), "it names no cause")
            }
            (_, code) => Err(format!("it ends with {code:?}")),
        }
    }

    /// The next run does it, and leaves nothing else.
    fn next(&self) -> Result<(), String> {
        let was_done = self.is_done();
        let next = self.run("once", 0);
        if !was_done && next.output.status.code() != Some(0) {
            return Err(format!("the next run says: {}", next.said()));
        }
        let now = contents(self.here);
        let mut paths = now.keys().chain(self.after.keys());
        match paths.find(|path| !self.is_same(now.get(*path), self.after.get(*path))) {
            None => Ok(()),
            Some(path) => Err(format!("{} is another after the next run", path.display())),
        }
    }
}

/// A study of one run that has all that a run may have: text and binary files, a deck with an include, what
/// the solver took.
fn study_of_one(here: &Path) -> PathBuf {
    let (source, run) = (fixture("fe/lead-car-wall"), here.join("25kmh"));
    fs::create_dir(&run).unwrap();
    for name in ["nodout", "rwforc", "case.json"] {
        fs::copy(source.join("25kmh").join(name), run.join(name)).unwrap();
    }
    fs::write(run.join("binout0000"), binout_of(&run)).unwrap();
    fs::write(run.join("main.k"), "*KEYWORD\n*INCLUDE\nparts.k\n*END\n").unwrap();
    fs::write(run.join("parts.k"), "*PART\nbuffer\n1,1,1\n*END\n").unwrap();
    let text = fs::read_to_string(source.join("study.toml")).unwrap();
    let mut runs = text.split("[[run]]");
    let head = runs.next().unwrap();
    let own = runs.find(|run| run.contains("\"25kmh\"")).unwrap();
    let path = here.join("study.toml");
    fs::write(&path, format!("{head}[[run]]{own}")).unwrap();
    path
}

#[test]
fn builds_survive_every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let study = study_of_one(here);
    hold(here, "build study.toml -o new.h5");
    // Into a database that has another group, and a case that is changed.
    crumple_ok(here, "db copy new.h5 --group lead-car-wall --to-group other");
    let text = fs::read_to_string(&study).unwrap();
    fs::write(&study, text.replace("24t", "24.1t")).unwrap();
    hold(here, "build study.toml -o new.h5");
}

/// The bundled study of one group, thinned to two cases.
fn small_database(here: &Path) {
    build_fixture(here, "lead-car-wall");
    for speed in ["..20km/h", "40km/h.."] {
        crumple_ok(here, &["db", "rm", "curves.h5", "--group", "lead-car-wall", "--speed", speed]);
    }
    for (what, text) in [("tag", "seen"), ("note", "by hand")] {
        let add = ["db", what, "curves.h5", "--group", "lead-car-wall", "--add", text];
        crumple_ok(here, &add);
    }
}

#[test]
fn changed_databases_survive_every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    small_database(here);
    hold(here, "db tag curves.h5 --group lead-car-wall --add checked");
    hold(here, "db rename curves.h5 --case lead-car-wall/36kmh --to reference");
    hold(here, "db rm curves.h5 --case lead-car-wall/reference");
}

#[test]
fn databases_with_what_others_put_in_survive_every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    small_database(here);
    edited(&here.join("curves.h5"), |file| {
        let case = file.root().group("lead-car-wall").unwrap().group("36kmh").unwrap();
        case.set_attr("theirs", AttrValue::String("kept".into())).unwrap();
        case.create_dataset("theirs", |dataset| {
            dataset.with_f64_data(&[1.0, 2.0]);
        })
        .unwrap();
    });
    hold_all(here, "db note curves.h5 --case lead-car-wall/36kmh --add looked_at", true);
}

#[test]
fn joined_databases_survive_every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    small_database(here);
    let curve = "deflection_m,force_N\n0,0\n0.1,2e6\n0.2,3e6\n0.3,3e6\n0.4,3e6\n0.5,3e6\n";
    fs::write(here.join("nose.csv"), curve).unwrap();
    hold(
        here,
        "db add b.h5 nose.csv --group tests --speed 36km/h --kind wall --mass 24t --unloading 80MN/m",
    );
    hold(here, "db copy curves.h5 --case lead-car-wall/25kmh --to b.h5");
    hold(here, "db merge curves.h5 b.h5 -o c.h5");
    hold(here, "db export c.h5 -o tables --originals");
}

#[test]
fn sweeps_survive_every_fault() {
    let demo = demo_folder();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::copy(demo.path().join("lead.model"), here.join("lead.model")).unwrap();
    let scenario = fs::read_to_string(demo.path().join("scenario.toml")).unwrap();
    // What is written matters here, not how the runs end.
    let short = scenario.replace("300ms", "3ms");
    assert_ne!(short, scenario);
    fs::write(here.join("scenario.toml"), short).unwrap();
    hold(here, "sweep scenario.toml -q -o a.csv");
    hold(here, "sweep scenario.toml -q -o a.h5");
    for shard in ["1/2", "2/2"] {
        let name = format!("s{}.csv", &shard[..1]);
        crumple_ok(here, &["sweep", "scenario.toml", "-q", "--shard", shard, "-o", &name]);
    }
    hold(here, "sweep merge s1.csv s2.csv -o b.csv");
    hold(here, "sweep merge s1.csv s2.csv -o b.h5");
    // What an earlier run has left, the last row torn.
    let rows = fs::read(here.join("a.csv")).unwrap();
    fs::write(here.join("c.csv.part"), &rows[..rows.len() - 9]).unwrap();
    hold(here, "sweep scenario.toml -q -o c.csv");
}

#[test]
fn models_and_exports_survive_every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    small_database(here);
    hold(here, "train curves.h5 --model nearest -o a.model");
    hold(here, "predict a.model --speed 30km/h -o p.json -o p.csv");
    hold(here, "export a.model --speed 30km/h --to lsdyna -o p.k");
    hold(here, "export a.model --speed 30km/h --to fmi2 -o p.fmu");
    hold(here, "export a.model --to table -o p.h5");
    hold(here, "export curves.h5 --case 36kmh --to iso-mme -o p.mme");
}

/// A file that cannot be examined is not replaced as if it were not there, and a link not in its target's place.
#[test]
fn faults_hide_neither_files_nor_links() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    small_database(here);
    crumple_ok(here, "train curves.h5 --model nearest -o a.model");
    fs::write(here.join("real.json"), "{}").unwrap();
    std::os::unix::fs::symlink("real.json", here.join("link.json")).unwrap();
    let before = contents(here);
    for line in [
        "predict a.model --speed 30km/h -q -o curves.h5",
        "predict a.model --speed 30km/h -q -o link.json",
    ] {
        let trial =
            Trial { here, line, before: before.clone(), after: Contents::new(), by_objects: false };
        let calls = trial.run("once", 0).calls;
        for at in numbers("once", &calls) {
            fs::write(here.join("real.json"), "{}").unwrap();
            let faulty = trial.run("once", at);
            let database = fs::read(here.join("curves.h5")).unwrap();
            assert!(database == before[Path::new("curves.h5")], "{}: {line}", calls[at - 1]);
            assert!(here.join("link.json").is_symlink(), "{}: {line}", calls[at - 1]);
            assert!(!faulty.said().contains("panicked"), "{}", faulty.said());
        }
    }
}
