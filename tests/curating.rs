//! Curating databases: cases are chosen, removed, renamed, joined, copied, tagged and written as
//! tables; what was renamed is still its study's; a command that is killed loses nothing.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok as ok, crumple_started, edited, entries,
    fixture, held_by_another, is_thorough, json, program, python, said, says, study_in,
};
use crumple::curve::Case;
use crumple::database::Database;
use hdf5_pure::{AttrValue, File as Hdf5};
use serde_json::Value;

const WALL: &str = "lead-car-wall";
const PAIR: &str = "lead-car-pair";
/// A curve that 24 t at 36 km/h may have.
const TABLE: &str = "d_mm,F_kN\n0,0\n50,1200\n500,1200\n1000,1200\n1020,1200\n";

fn ok_json(folder: &Path, line: &str) -> Value {
    json(&ok(folder, &format!("{line} --json")))
}

#[track_caller]
fn fails(folder: &Path, line: &str, expected: &str) {
    says(&crumple_fails(folder, 1, line), expected);
}

#[track_caller]
fn misused(folder: &Path, line: &str, expected: &str) {
    says(&crumple_fails(folder, 2, line), expected);
}

fn read(folder: &Path, name: &str) -> Database {
    Database::read(&folder.join(name)).unwrap()
}

/// A tag or note of one case of a large file changes this case alone, and reads no other; what others have put in stays.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn one_case_of_a_large_file_h5py_reads_as_before() {
    let folder = two_groups();
    let here = folder.path();
    let large = here.join("large.h5");
    let mut database = read(here, "curves.h5");
    let one = database.cases(WALL)[3].clone();
    let copies = 40_000_000 / fs::metadata(here.join("curves.h5")).unwrap().len() * 11;
    for k in 0..copies {
        let mut copy = one.clone();
        copy.id.name = format!("r{k:04}");
        database.put(copy).unwrap();
    }
    database.write(&large).unwrap();
    let run = |line: &str| {
        let output = python().current_dir(here).args(["-c", line]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    run("import h5py
with h5py.File('large.h5', 'a', libver='latest') as f:
    f.attrs['theirs'] = 'root'
    f['lead-car-wall'].attrs['theirs'] = 7
    f['lead-car-wall/r0007/theirs'] = [1.0, 2.0]
    f['theirs/of_all'] = [3.0]");
    let before = read(here, "large.h5");
    let checked = ok(here, "db check large.h5");
    let mut damaged = fs::read(&large).unwrap();
    assert!(damaged.len() > 32 << 20, "{} bytes", damaged.len());
    // A case whose values are others than were written: were it read, the file would be refused.
    let force = one.curves.original.force_n()[9].to_le_bytes();
    let at = memchr::memmem::rfind(&damaged, &force).unwrap();
    damaged[at] ^= 1;
    fs::write(&large, &damaged).unwrap();
    let refused = "do not match their fingerprint";
    for (line, expected) in [
        ("db tag large.h5 --case lead-car-wall/r0005 --case lead-car-wall/r0006 --add x", refused),
        (&format!("db tag large.h5 --case r{:04} --add x", copies - 1), refused),
        ("db note large.h5 --case r0007 --remove x", "none of the 1 chosen cases has the note"),
    ] {
        fails(here, line, expected);
    }
    assert!(fs::read(&large).unwrap() == damaged);
    ok(here, "db tag large.h5 --case r0007 --add seen,odd");
    ok(here, "db tag large.h5 --group lead-car-wall --case r0007 --remove odd");
    ok(here, "db note large.h5 --case lead-car-wall/r0007 --add Grüße");
    let mut after = fs::read(&large).unwrap();
    // Three changes.
    assert!(after.len() < damaged.len() + 3 * (40 << 10), "{}", after.len() - damaged.len());
    after[at] ^= 1;
    fs::write(&large, after).unwrap();
    let mut expected = before;
    let mut case = expected.cases(WALL).iter().find(|c| c.id.name == "r0007").unwrap().clone();
    case.provenance.tags = vec!["seen".into()];
    case.provenance.user_notes = vec!["Grüße".into()];
    expected.put(case).unwrap();
    assert!(expected == read(here, "large.h5"));
    assert_eq!(ok(here, "db check large.h5"), checked);
    fails(here, "db tag large.h5 --case r9999 --add x", "there is no case \"r9999\"");
    fails(here, "db tag large.h5 --case 36kmh --add x", "several groups have a case \"36kmh\"");
    let printed = run("import h5py
f = h5py.File('large.h5'); group = f['lead-car-wall']; case = group['r0007']
print(f.attrs['theirs'], group.attrs['theirs'], *case['theirs'], *f['theirs/of_all'])
print(case.attrs['tags'], case.attrs['user_notes'])");
    says(&printed, "root 7 1.0 2.0 3.0\n");
    says(&printed, "seen");
    says(&printed, "Grüße");
    // A file that h5py has written anew is changed too, in one way or the other.
    run("import h5py
with h5py.File('large.h5') as a, h5py.File('copied.h5', 'w', libver='latest') as b:
    for name in a: a.copy(name, b)
    for name in a.attrs: b.attrs[name] = a.attrs[name]");
    ok(here, "db tag copied.h5 --case r0007 --add copied");
    let copied = read(here, "copied.h5");
    let tagged = copied.all().filter(|case| case.provenance.tags.contains(&"copied".into()));
    assert_eq!(tagged.map(|case| &*case.id.name).collect::<Vec<_>>(), ["r0007"]);
}

/// The first warnings of many cases, and how many more there are; all of them where they are asked for.
#[test]
fn warnings_of_many_cases_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "vehicle-pair");
    let mut database = read(here, "curves.h5");
    let warned = database.all().find(|case| case.quality.warnings.len() == 1).unwrap().clone();
    let known = database.all().map(|case| case.quality.warnings.len()).sum::<usize>();
    let lines = |line: &str| -> Vec<String> {
        let output = crumple_in(here, line);
        let lines = String::from_utf8(output.stderr).unwrap();
        lines.lines().filter(|line| line.starts_with("warning: ")).map(String::from).collect()
    };
    let mut fill = |all: usize| {
        for k in known..all {
            let mut copy = warned.clone();
            copy.id.name = format!("r{k}");
            database.put(copy).unwrap();
        }
        database.write(&here.join("curves.h5")).unwrap();
    };
    fill(21);
    // One more would take as much room.
    assert_eq!(lines("db ls curves.h5").len(), 21);
    fill(30);
    let all = lines("db ls curves.h5 --verbose");
    assert!(all.len() >= 30);
    let shown = lines("db ls curves.h5");
    assert_eq!(shown[..20], all[..20]);
    let further = all.len() - 20;
    assert_eq!(
        shown[20..],
        [format!("warning: {further} further warnings: --verbose prints them")]
    );
    assert_eq!(lines("db ls curves.h5 --json"), all);
}

/// `GROUP/CASE` of all cases, in order.
fn names(folder: &Path, name: &str) -> Vec<String> {
    read(folder, name).all().map(|case| format!("{}/{}", case.id.group, case.id.name)).collect()
}

/// The names of cases in a group, in order of speed.
fn of(group: &str, cases: &[&str]) -> Vec<String> {
    cases.iter().map(|case| format!("{group}/{case}")).collect()
}

const RUNS: [&str; 7] = ["12kmh", "18kmh", "25kmh", "36kmh", "48kmh", "60kmh", "72kmh"];

/// A folder with the database of both groups of the lead car.
fn two_groups() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    build_fixture(folder.path(), WALL);
    build_fixture(folder.path(), PAIR);
    folder
}

#[test]
fn cases_are_chosen_by_group_name_speed_and_tag() {
    let folder = two_groups();
    let here = folder.path();
    let listed = |options: &str| -> Vec<String> {
        let document = ok_json(here, &format!("db ls curves.h5{options}"));
        let groups = document["groups"].as_object().unwrap();
        let of = |(group, cases): (&String, &Value)| {
            let cases = cases.as_array().unwrap().iter();
            cases.map(|c| format!("{group}/{}", c["name"].as_str().unwrap())).collect::<Vec<_>>()
        };
        groups.iter().flat_map(of).collect()
    };
    assert_eq!(listed("").len(), 11);
    assert_eq!(listed(" --group lead-car-wall"), of(WALL, &RUNS));
    assert_eq!(
        listed(" --group lead-car-wall --group lead-car-pair --speed 40km/h..50km/h"),
        ["lead-car-pair/48kmh", "lead-car-wall/48kmh"]
    );
    assert_eq!(listed(" --speed ..18km/h"), of(WALL, &["12kmh", "18kmh"]), "the end is among them");
    assert_eq!(listed(" --speed 5m/s..7m/s"), of(WALL, &["18kmh", "25kmh"]));
    assert_eq!(listed(" --speed 36km/h").len(), 2);
    assert_eq!(listed(" --speed ..13km/h --speed 18km/h"), of(WALL, &["12kmh", "18kmh"]));
    assert_eq!(listed(" --case lead-car-pair/72kmh --case 12kmh").len(), 2);
    ok(here, "db tag curves.h5 --speed 60km/h.. --add fast,doubtful");
    ok(here, "db tag curves.h5 --case lead-car-wall/60kmh --remove doubtful");
    assert_eq!(listed(" --tag doubtful").len(), 3);
    assert_eq!(listed(" --tag fast --group lead-car-wall"), of(WALL, &["60kmh", "72kmh"]));
    let text = ok(here, "db ls curves.h5 --group lead-car-wall");
    assert!(text.lines().next().unwrap().ends_with("tags"), "{text}");
    says(&text, "144.1 MN/m  doubtful, fast\n");
}

#[test]
fn what_cannot_be_chosen_is_said_with_what_is_there() {
    let folder = two_groups();
    let here = folder.path();
    let before = fs::read(here.join("curves.h5")).unwrap();
    #[rustfmt::skip]
    let cases = [
        ("db rm curves.h5 --case 36kmh", "curves.h5: several groups have a case \"36kmh\": choose one with --group, or write lead-car-pair/36kmh or lead-car-wall/36kmh"),
        ("db rm curves.h5 --case 37kmh", "curves.h5: there is no case \"37kmh\": there are lead-car-pair/36kmh (36 km/h), "),
        ("db tag curves.h5 --add x --speed 90km/h.. --group lead-car-pair", "no case has a speed of at least 90 km/h: there are lead-car-pair/36kmh (36 km/h), lead-car-pair/48kmh (48 km/h), lead-car-pair/60kmh (60 km/h), lead-car-pair/72kmh (72 km/h)"),
        ("db rm curves.h5 --tag odd --speed 30km/h..40km/h", "no case has a speed of 30 km/h to 40 km/h and has the tag \"odd\""),
        ("db copy curves.h5 --group wall --to-group x", "there is no group \"wall\": it has lead-car-pair, lead-car-wall"),
    ];
    cases.into_iter().for_each(|(line, expected)| fails(here, line, expected));
    for command in ["rm", "copy --to-group x", "tag --add x", "note --add x"] {
        let (name, options) = command.split_once(' ').unwrap_or((command, ""));
        let line = format!("db {name} curves.h5 {options}");
        misused(here, line.trim(), "choose the cases to be");
    }
    #[rustfmt::skip]
    let cases = [
        ("db rm curves.h5 --speed 40..50", "speed \"40\" has no unit: write for example \"40km/h\""),
        ("db rm curves.h5 --speed 50km/h..40km/h", "ends below its start"),
        ("db tag curves.h5 --group lead-car-wall", "nothing to do: give --add, --remove or --clear"),
        ("db copy curves.h5 --group lead-car-wall", "name the destination with"),
        ("db rename curves.h5 --to x", "--group"),
    ];
    cases.into_iter().for_each(|(line, expected)| misused(here, line, expected));
    fails(here, "db rm none.h5 --case x", "none.h5: No such file or directory");
    assert!(fs::read(here.join("curves.h5")).unwrap() == before);
    assert_eq!(entries(here), ["curves.h5"]);
}

/// What a database has gained, lost and changed: by group and name, in conditions and curves, not in tags.
#[test]
fn differences_of_two_databases_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let database = build_fixture(folder, WALL).display().to_string();
    let cases = read(folder, &database).cases(WALL).to_vec();
    let mut changed = Database::default();
    for (k, case) in cases.iter().enumerate() {
        let mut case = case.clone();
        match k {
            // The first is gone; of the second all forces are a tenth larger, the third has a tag.
            0 => continue,
            1 => {
                let curve = &case.curves.sampled;
                let larger = |curve: &crumple::curve::Curve| {
                    let force = curve.force_n().iter().map(|f| 1.1 * f).collect();
                    let (t, d) = (curve.time_s().to_vec(), curve.deflection_m().to_vec());
                    crumple::curve::Curve::new(t, d, force).unwrap()
                };
                (case.curves.sampled, case.curves.original) =
                    (larger(curve), larger(&case.curves.original));
            }
            2 => case.provenance.tags = vec!["reviewed".into()],
            4 => {
                _ = case
                    .conditions
                    .parameters
                    .insert("thickness_mm".into(), crumple::curve::Parameter::Number(3.5))
            }
            3 => case.id.name = "other".into(),
            _ => {}
        }
        changed.put(case).unwrap();
    }
    changed.write(&folder.join("after.h5")).unwrap();
    let found = ok_json(folder, &format!("db diff {database} after.h5 --accept-changed"));
    let name = |k: usize| format!("{WALL}/{}", cases[k].id.name);
    assert_eq!(found["removed"], serde_json::json!([name(0), name(3)]));
    assert_eq!(found["added"], serde_json::json!([format!("{WALL}/other")]));
    assert_eq!(found["unchanged"], cases.len() - 4);
    let parameter = &found["parameters"][0];
    assert_eq!((&parameter["before"], &parameter["after"]), (&Value::Null, &Value::from(3.5)));
    let of = &found["changed"][0];
    assert_eq!(
        (of["case"].as_str(), found["changed"].as_array().unwrap().len()),
        (Some(&*cases[1].id.name), 2)
    );
    for key in ["peak_force_difference", "force_l1"] {
        assert!((of[key].as_f64().unwrap() - 0.1).abs() < 1e-9, "{key}: {of}");
    }
    let text = ok(folder, &format!("db diff {database} after.h5 --accept-changed"));
    says(&text, " mass  max crush ");
    says(&text, "1 case added, 2 removed, 2 changed, ");
    says(&text, &format!("{WALL}/{}: thickness_mm - -> 3.5\n", cases[4].id.name));
    says(
        &ok(folder, &format!("db diff {database} {database}")),
        "0 cases added, 0 removed, 0 changed, ",
    );
    fails(folder, &format!("db diff {database} after.h5 --group nothing"), "nothing");
}

#[test]
fn removing_names_what_it_did_and_a_dry_run_does_nothing() {
    let folder = two_groups();
    let here = folder.path();
    let before = fs::read(here.join("curves.h5")).unwrap();
    let line = "db rm curves.h5 --group lead-car-wall --speed ..20km/h";
    let said = ok(here, &format!("{line} --dry-run"));
    says(&said, "\n18kmh          18 km/h (wall)");
    assert!(said.ends_with("would remove 2 cases from curves.h5\n"), "{said}");
    assert!(fs::read(here.join("curves.h5")).unwrap() == before);
    let document = ok_json(here, line);
    let removed = document["removed"].as_array().unwrap().iter();
    let removed: Vec<&str> = removed.map(|c| c["name"].as_str().unwrap()).collect();
    assert_eq!((removed, &document["dry_run"]), (vec!["12kmh", "18kmh"], &Value::Bool(false)));
    assert_eq!(names(here, "curves.h5").len(), 9);
    // A group of which nothing is left is gone.
    assert!(ok(here, "db rm curves.h5 --group lead-car-wall").contains("removed 5 cases"));
    assert_eq!(read(here, "curves.h5").groups().collect::<Vec<_>>(), [PAIR]);
    assert!(ok(here, "db check curves.h5").contains("4 cases checked, 0 findings"));
    // A build puts the study's runs back.
    build_fixture(here, WALL);
    assert_eq!(names(here, "curves.h5").len(), 11);
}

#[test]
fn cases_and_groups_get_other_names() {
    let folder = two_groups();
    let here = folder.path();
    let before = read(here, "curves.h5");
    let said = ok(here, "db rename curves.h5 --case lead-car-wall/36kmh --to reference");
    assert_eq!(
        said,
        "renamed lead-car-wall/36kmh to lead-car-wall/reference in curves.h5 (1 case)\n"
    );
    ok(here, "db rename curves.h5 --group lead-car-wall --to nose");
    let expected = of("nose", &["12kmh", "18kmh", "25kmh", "reference", "48kmh", "60kmh", "72kmh"]);
    assert_eq!(names(here, "curves.h5")[4..], expected);
    let after = read(here, "curves.h5");
    for (old, new) in before.cases(WALL).iter().zip(after.cases("nose")) {
        let mut renamed = old.clone();
        renamed.id.group = "nose".into();
        renamed.id.name = new.id.name.clone();
        assert!(renamed == *new, "{}", old.id.name);
    }
    #[rustfmt::skip]
    let cases = [
        ("db rename curves.h5 --group nose --to lead-car-pair", "there is a group \"lead-car-pair\" already: choose another name, or join them with crumple db copy --to-group"),
        ("db rename curves.h5 --group nose --case 12kmh --to 18kmh", "group \"nose\" has a case \"18kmh\" already"),
        ("db rename curves.h5 --group nose --case 12kmh --to a/b", "\"a/b\" is not a valid name for a case: it may not contain \"/\""),
        ("db rename curves.h5 --group nose --to .", "\".\" is not a valid name for a group"),
        ("db rename curves.h5 --group nase --to x", "there is no group \"nase\": it has lead-car-pair, nose"),
    ];
    cases.into_iter().for_each(|(line, expected)| fails(here, line, expected));
    assert!(ok(here, "db check curves.h5").contains("11 cases checked, 0 findings"));
}

/// A study in a folder of its own, with runs that it shares with nobody.
struct Studied {
    folder: tempfile::TempDir,
    study: PathBuf,
}

impl Studied {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let study = study_in(folder.path(), WALL);
        Self { folder, study }
    }

    fn here(&self) -> &Path {
        self.folder.path()
    }

    /// Replaces text of the manifest, which must be there.
    fn change(&self, from: &str, to: &str) {
        let text = fs::read_to_string(&self.study).unwrap();
        assert!(text.contains(from), "{from}");
        fs::write(&self.study, text.replace(from, to)).unwrap();
    }

    fn build(&self) -> Value {
        let study = self.study.to_str().unwrap();
        json(&ok(self.here(), &["build", study, "-o", "curves.h5", "--json"]))
    }

    fn outcomes(report: &Value) -> BTreeSet<&str> {
        let runs = report["runs"].as_array().unwrap();
        runs.iter().map(|run| run["outcome"].as_str().unwrap()).collect()
    }

    fn bytes(&self) -> Vec<u8> {
        fs::read(self.here().join("curves.h5")).unwrap()
    }

    /// Building again changes nothing, whatever was renamed.
    fn is_settled(&self) {
        let before = self.bytes();
        let report = self.build();
        assert_eq!(Self::outcomes(&report), BTreeSet::from(["unchanged"]));
        assert!(self.bytes() == before);
    }
}

#[test]
fn a_renamed_group_takes_its_cases_along() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    ok(here, "db tag curves.h5 --case 36kmh --add reviewed");
    ok(here, "db note curves.h5 --case 36kmh --add good");
    let before = read(here, "curves.h5");
    studied.change("group = \"lead-car-wall\"", "group = \"nose\"");
    let report = studied.build();
    // Nothing is read again.
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["unchanged"]));
    assert_eq!(report["moved"][0]["from"], "lead-car-wall/12kmh");
    assert_eq!(report["moved"][0]["to"], "nose/12kmh");
    assert_eq!(names(here, "curves.h5"), of("nose", &RUNS));
    let after = read(here, "curves.h5");
    for (old, new) in before.cases(WALL).iter().zip(after.cases("nose")) {
        let group = "nose".to_string();
        let mut moved = old.clone();
        moved.id.group = group.clone();
        moved.provenance.origin.as_mut().unwrap().group = group;
        assert!(moved == *new);
    }
    assert_eq!(after.cases("nose")[3].provenance.tags, ["reviewed"]);
    studied.is_settled();
    let text = {
        studied.change("group = \"nose\"", "group = \"front\"");
        ok(here, "build lead-car-wall.toml -o curves.h5")
    };
    says(&text, "note: group nose: renamed since it was built, 7 cases moved to front\n");
    // Renamed in the database it keeps that name, which is the one that a build names.
    ok(here, "db rename curves.h5 --group front --to mine");
    let text = ok(here, "build lead-car-wall.toml -o curves.h5");
    says(&text, "nothing has changed in curves.h5 (group mine)\n");
    assert!(ok(here, "db check curves.h5").contains("7 cases checked, 0 findings"));
}

#[test]
fn a_renamed_study_takes_its_cases_along() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    ok(here, "db tag curves.h5 --group lead-car-wall --add reviewed");
    ok(here, "db rename curves.h5 --case 36kmh --to reference");
    let study = read(here, "curves.h5").cases(WALL)[0].id.study.clone();
    // The study, then study and group at once, then a run as well.
    studied.change(&format!("\"{study}\""), "\"another\"");
    let report = studied.build();
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["built"]), "the recipe names the study");
    assert_eq!(report["removed"], serde_json::json!([]));
    studied.change("\"another\"", "\"a third\"");
    studied.change("group = \"lead-car-wall\"", "group = \"nose\"");
    studied.build();
    studied.change("name  = \"12kmh\"", "name  = \"slowest\"");
    let report = studied.build();
    assert_eq!(
        report["moved"],
        serde_json::json!([{ "from": "nose/12kmh", "to": "nose/slowest" }])
    );
    let expected =
        of("nose", &["slowest", "18kmh", "25kmh", "reference", "48kmh", "60kmh", "72kmh"]);
    assert_eq!(names(here, "curves.h5"), expected);
    let database = read(here, "curves.h5");
    for case in database.all() {
        assert_eq!(
            (&*case.id.study, &*case.provenance.tags),
            ("a third", &["reviewed".into()][..])
        );
    }
    studied.is_settled();
}

/// A manifest that was renamed with its study is known by the runs, if nobody else has them.
#[test]
fn a_manifest_that_moved_takes_its_cases_along_and_a_copy_does_not() {
    let mut studied = Studied::new();
    let here = studied.folder.path().to_path_buf();
    studied.build();
    let renamed = |studied: &Studied, path: &Path| {
        let text = fs::read_to_string(&studied.study).unwrap();
        let text = text.replace("group = \"lead-car-wall\"", "group = \"nose\"");
        fs::write(path, text).unwrap();
    };
    // Beside the first: two studies, two groups.
    let copy = here.join("copy.toml");
    renamed(&studied, &copy);
    let first = std::mem::replace(&mut studied.study, copy.clone());
    let report = studied.build();
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["built"]));
    assert_eq!(names(&here, "curves.h5").len(), 14);
    // A third of the same study and group takes the place of the first, and says so.
    let third = here.join("third.toml");
    let text = fs::read_to_string(&first).unwrap();
    let runs: Vec<&str> = text.split("[[run]]").collect();
    fs::write(&third, runs[..3].join("[[run]]")).unwrap();
    let output = crumple_in(&here, &format!("build {} -o curves.h5 --strict", third.display()));
    assert_eq!(output.status.code(), Some(3));
    let said = String::from_utf8(output.stderr).unwrap();
    says(&said, "both studies have one name and group; with another name in [study]");
    says(&said, &first.display().to_string());
    // So does another run under a name that is there.
    let whole = text.clone();
    let text = fs::read_to_string(&third).unwrap();
    assert!(text.contains("filter     = \"none\""), "{text}");
    fs::write(
        &first,
        text.replace("filter     = \"none\"", "filter     = \"none\"\ncontact_threshold = 0.02"),
    )
    .unwrap();
    let output = crumple_in(&here, &format!("build {} -o curves.h5 --strict", first.display()));
    assert_eq!(output.status.code(), Some(3));
    let said = String::from_utf8(output.stderr).unwrap();
    says(&said, "replaced ");
    says(&said, &format!(" and kept tags and notes, built from {}: both studies", third.display()));
    fs::write(&first, whole).unwrap();
    fs::remove_file(here.join("curves.h5")).unwrap();
    // In its place: one.
    studied.study = first.clone();
    studied.build();
    fs::remove_file(&first).unwrap();
    studied.study = copy;
    let report = studied.build();
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["unchanged"]));
    assert_eq!(names(&here, "curves.h5"), of("nose", &RUNS));
    studied.is_settled();
}

/// One manifest path for study after study, as scripts have it, costs nobody their cases.
#[test]
fn a_manifest_that_says_something_else_leaves_the_earlier_group() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    studied.change("group = \"lead-car-wall\"", "group = \"filtered\"");
    studied.change("filter     = \"none\"", "filter     = \"CFC60\"");
    let report = studied.build();
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["built"]));
    assert_eq!(report["earlier_groups"], serde_json::json!([WALL]));
    let cases = names(here, "curves.h5");
    assert_eq!(cases, [of("filtered", &RUNS), of(WALL, &RUNS)].concat());
    // Said once.
    assert_eq!(studied.build()["earlier_groups"], Value::Null);
}

#[test]
fn a_build_goes_on_with_what_was_renamed_in_the_database() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    ok(here, "db rename curves.h5 --group lead-car-wall --to nose");
    ok(here, "db rename curves.h5 --case 36kmh --to reference");
    studied.is_settled();
    // Built again, failed and left out, each under the name that it has now.
    studied.change("\"24t\"", "\"24.5t\"");
    let report = studied.build();
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["built"]));
    assert_eq!(report["runs"][3]["renamed"], "nose/reference");
    let database = read(here, "curves.h5");
    for case in database.all() {
        assert_eq!((&*case.id.group, case.conditions.masses.body_kg), ("nose", 24.5e3));
    }
    assert_eq!(database.cases("nose")[3].id.name, "reference");
    studied.change("/36kmh\"", "/37kmh\"");
    let output =
        crumple_in(here, &["build", studied.study.to_str().unwrap(), "-o", "curves.h5", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let report = json(&String::from_utf8(output.stdout).unwrap());
    assert_eq!(report["runs"][3]["outcome"], "failed");
    let error = report["runs"][3]["error"].as_str().unwrap();
    assert!(error.ends_with("(the case of an earlier build is kept)"));
    assert_eq!(names(here, "curves.h5").len(), 7);
    let text = fs::read_to_string(&studied.study).unwrap();
    let runs: Vec<&str> = text.split("[[run]]").filter(|run| !run.contains("\"36kmh\"")).collect();
    fs::write(&studied.study, runs.join("[[run]]")).unwrap();
    assert_eq!(studied.build()["removed"], serde_json::json!(["nose/reference"]));
    assert_eq!(names(here, "curves.h5").len(), 6);
}

#[test]
fn equal_curves_are_joined_once_and_different_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, WALL);
    fs::rename(here.join("curves.h5"), here.join("a.h5")).unwrap();
    build_fixture(here, PAIR);
    fs::rename(here.join("curves.h5"), here.join("b.h5")).unwrap();
    fs::copy(here.join("a.h5"), here.join("same.h5")).unwrap();
    ok(here, "db tag a.h5 --case 36kmh --add one");
    ok(here, "db tag same.h5 --case 36kmh --add two");
    ok(here, "db rename same.h5 --case 25kmh --to twenty-five");
    let document = ok_json(here, "db merge a.h5 b.h5 same.h5 -o all.h5");
    assert_eq!(document["added"].as_array().unwrap().len(), 11);
    assert_eq!(document["equal"].as_array().unwrap().len(), 7);
    let twenty_five = document["equal"].as_array().unwrap().iter().find(|e| e["case"] != e["now"]);
    assert_eq!(twenty_five.unwrap()["now"], "lead-car-wall/25kmh");
    let all = read(here, "all.h5");
    assert_eq!(all.all().count(), 11);
    assert_eq!(all.cases(WALL)[3].provenance.tags, ["one", "two"]);
    assert!(all.cases(WALL)[0] == read(here, "a.h5").cases(WALL)[0]);
    fails(
        here,
        "db merge a.h5 b.h5 -o all.h5",
        "all.h5 exists already: name it among the databases to be joined",
    );
    // Other curves under the same names.
    let study = study_in(here, WALL);
    let text = fs::read_to_string(&study).unwrap();
    fs::write(&study, text.replace("\"24t\"", "\"30t\"")).unwrap();
    ok(here, "build lead-car-wall.toml -o heavy.h5 -q");
    let before = fs::read(here.join("all.h5")).unwrap();
    fails(
        here,
        "db merge all.h5 heavy.h5 -o all.h5",
        "heavy.h5: other curves have these names already: lead-car-wall/12kmh, lead-car-wall/18kmh",
    );
    let dry = ok_json(here, "db merge all.h5 heavy.h5 -o all.h5 --rename --dry-run");
    assert_eq!(dry["renamed"][0]["now"], "lead-car-wall/12kmh_2");
    assert!(fs::read(here.join("all.h5")).unwrap() == before);
    ok(here, "db merge all.h5 heavy.h5 -o all.h5 --rename");
    assert_eq!(names(here, "all.h5").len(), 18);
    assert_eq!(read(here, "all.h5").cases(WALL)[1].conditions.masses.body_kg, 30e3);
    // Again: all of it is there.
    let again = ok(here, "db merge all.h5 heavy.h5 -o all.h5");
    says(&again, "0 cases added, 0 replaced, 7 already present");
    ok(here, "db merge heavy.h5 a.h5 -o heavy.h5 --replace");
    let replaced = read(here, "heavy.h5");
    assert!(
        replaced.all().all(|case| case.conditions.masses.body_kg == 24e3)
            && replaced.all().count() == 7
    );
    // Masses that are none, copies, and nothing else: equal speeds of other masses are distinguished.
    let found = ok_json(here, "db check all.h5");
    for finding in found["findings"].as_array().unwrap() {
        let expected = ["extraction", "energy_mismatch", "copy"];
        assert!(expected.contains(&finding["code"].as_str().unwrap()), "{finding}");
    }
}

#[test]
fn groups_of_two_kinds_are_not_joined() {
    let folder = two_groups();
    let here = folder.path();
    let expected = "curves.h5: lead-car-wall/36kmh has a closing speed, lead-car-wall/12kmh a wall speed: no model can be trained on both: use another group";
    fails(
        here,
        "db copy curves.h5 --group lead-car-pair --to-group lead-car-wall --rename",
        expected,
    );
    ok(here, "db copy curves.h5 --group lead-car-pair --to pairs.h5 --to-group lead-car-wall");
    fails(
        here,
        "db merge curves.h5 pairs.h5 -o all.h5",
        "pairs.h5: lead-car-wall/36kmh has a closing speed",
    );
    assert_eq!(entries(here), ["curves.h5", "pairs.h5"]);
}

#[test]
fn copies_go_to_groups_and_databases() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    let said = ok(here, "db copy curves.h5 --speed 20km/h..50km/h --to-group inner");
    says(&said, "added 3 cases of group inner (of curves.h5)");
    // A copy is nobody's: other masses make the study's cases again, and leave it.
    studied.change("\"24t\"", "\"24.5t\"");
    studied.build();
    let database = read(here, "curves.h5");
    assert!(database.cases("inner").iter().all(|case| case.conditions.masses.body_kg == 24e3));
    assert!(database.cases(WALL).iter().all(|case| case.conditions.masses.body_kg == 24.5e3));
    studied.is_settled();
    // In another database under its own group it is still the study's.
    ok(here, "db copy curves.h5 --group lead-car-wall --speed ..20km/h --to b.h5");
    assert_eq!(names(here, "b.h5"), of(WALL, &["12kmh", "18kmh"]));
    let report = ok_json(here, "build lead-car-wall.toml -o b.h5");
    let outcomes: Vec<&str> =
        report["runs"].as_array().unwrap().iter().map(|r| r["outcome"].as_str().unwrap()).collect();
    assert_eq!(outcomes[..3], ["unchanged", "unchanged", "built"]);
    let into_itself = "the copy of lead-car-wall/12kmh would be lead-car-wall/12kmh itself";
    #[rustfmt::skip]
    let cases = [
        ("db copy curves.h5 --case lead-car-wall/12kmh --to-group lead-car-wall", into_itself),
        ("db copy curves.h5 --case lead-car-wall/12kmh --to ./curves.h5", into_itself),
        ("db copy curves.h5 --case inner/36kmh --to c.h5 --to-group a/b", "\"a/b\" is not a valid name for a group"),
    ];
    cases.into_iter().for_each(|(line, expected)| fails(here, line, expected));
    assert!(!here.join("c.h5").exists());
}

#[test]
fn tags_and_notes_stay_when_a_case_is_made_again() {
    let studied = Studied::new();
    let here = studied.here();
    studied.build();
    ok(here, "db tag curves.h5 --group lead-car-wall --add reviewed,a");
    let note = "rides up, from 80 ms on";
    ok(here, &["db", "note", "curves.h5", "--case", "72kmh", "--add", note]);
    let before = studied.bytes();
    // What exists already changes nothing.
    ok(here, "db tag curves.h5 --group lead-car-wall --add a");
    assert!(studied.bytes() == before);
    studied.change("\"24t\"", "\"24.5t\"");
    assert_eq!(Studied::outcomes(&studied.build()), BTreeSet::from(["built"]));
    let last = read(here, "curves.h5").cases(WALL)[6].clone();
    assert_eq!(
        (last.provenance.tags, last.provenance.user_notes),
        (vec!["a".to_string(), "reviewed".into()], vec![note.to_string()])
    );
    let shown = ok(here, "db show curves.h5 --case 72kmh");
    says(&shown, "user's note: rides up, from 80 ms on\n");
    assert!(shown.contains("\nbuilt 20") && shown.contains("from /"), "{shown}");
    // As that of a file that is added again.
    fs::write(here.join("t.csv"), TABLE).unwrap();
    let add = "db add curves.h5 t.csv --group tests --speed 36km/h --kind wall --mass 24t";
    ok(here, add);
    ok(here, "db tag curves.h5 --case t --add test");
    ok(here, &format!("{add} --replace"));
    assert_eq!(read(here, "curves.h5").cases("tests")[0].provenance.tags, ["test"]);
    ok(here, "db tag curves.h5 --case t --clear");
    ok(here, "db tag curves.h5 --group lead-car-wall --remove a --add b");
    ok(here, "db note curves.h5 --case 72kmh --clear");
    let database = read(here, "curves.h5");
    assert!(
        database
            .cases(WALL)
            .iter()
            .all(|c| c.provenance.tags == ["b", "reviewed"] && c.provenance.user_notes.is_empty())
    );
    assert_eq!(database.cases("tests")[0].provenance.tags, [""; 0]);
    #[rustfmt::skip]
    let cases = [
        ("db tag curves.h5 --case 12kmh --remove c", "none of the 1 chosen cases has the tag \"c\": they have \"b\", \"reviewed\""),
        ("db tag curves.h5 --case 12kmh --add a;b", "\"a;b\" is not a tag: it may not contain"),
    ];
    cases.into_iter().for_each(|(line, expected)| fails(here, line, expected));
    let blank =
        crumple_fails(here, 1, &["db", "note", "curves.h5", "--case", "12kmh", "--add", " "]);
    says(&blank, "\" \" is not a note: it is blank");
    assert!(ok(here, "db check curves.h5").contains("8 cases checked"));
}

#[test]
fn tables_hold_what_the_database_does() {
    let folder = two_groups();
    let here = folder.path();
    ok(here, "db tag curves.h5 --group lead-car-wall --speed ..20km/h --add slow,odd");
    fs::write(here.join("t.csv"), TABLE).unwrap();
    let add = "db|add|curves.h5|t.csv|--group|a \"b\", c|--case|x,y|--speed|36km/h|--kind|wall|--mass|24t|--parameter|angle_deg=10|--parameter|obstacle=a, b";
    ok(here, &add.split('|').collect::<Vec<_>>());
    let said = ok(here, "db export curves.h5 -o tables --originals");
    assert_eq!(
        said,
        "wrote tables/cases.csv\nwrote tables/curves.csv\nwrote tables/originals.csv\n"
    );
    let database = read(here, "curves.h5");
    let cases: Vec<&Case> = database.all().collect();
    let rows = |name: &str| -> (csv::StringRecord, Vec<csv::StringRecord>) {
        let mut table = csv::Reader::from_path(here.join("tables").join(name)).unwrap();
        (table.headers().unwrap().clone(), table.records().map(|r| r.unwrap()).collect())
    };
    let (heading, lines) = rows("cases.csv");
    assert_eq!(lines.len(), 12);
    for (case, line) in cases.iter().zip(&lines) {
        let cell = |name: &str| &line[heading.iter().position(|h| h == name).unwrap()];
        assert_eq!((cell("group"), cell("case")), (&*case.id.group, &*case.id.name));
        assert_eq!(cell("speed_m_per_s").parse::<f64>().unwrap(), case.conditions.speed.m_per_s);
        assert_eq!(cell("work_J").parse::<f64>().unwrap(), case.quality.audit.work_j);
        assert_eq!(cell("other_mass_kg").parse().ok(), case.conditions.masses.other_kg);
        assert_eq!(cell("truncated"), case.is_truncated().to_string());
        assert_eq!(cell("tags"), case.provenance.tags.join(";"));
        let is_ours = case.id.name == "x,y";
        assert_eq!(cell("parameter_angle_deg"), if is_ours { "10.0" } else { "" });
        assert_eq!(cell("parameter_obstacle"), if is_ours { "a, b" } else { "" });
    }
    for name in ["curves.csv", "originals.csv"] {
        let (_, lines) = rows(name);
        let mut lines = lines.iter();
        for case in &cases {
            let curve =
                if name == "curves.csv" { &case.curves.sampled } else { &case.curves.original };
            let body = Hdf5::open(here.join("curves.h5")).unwrap();
            let body =
                body.dataset(&format!("{}/{}/body_force_N", case.id.group, case.id.name)).unwrap();
            let body = body.read_f64().unwrap();
            for (k, time_s) in curve.time_s().iter().enumerate() {
                let line = lines.next().unwrap();
                assert_eq!((&line[0], &line[1]), (&*case.id.group, &*case.id.name));
                let mut expected = vec![*time_s, curve.deflection_m()[k], curve.force_n()[k]];
                if name == "curves.csv" {
                    expected.extend([body[k], case.curves.closing_speed_m_per_s[k]]);
                }
                let found: Vec<f64> = line.iter().skip(2).map(|v| v.parse().unwrap()).collect();
                assert_eq!(found, expected);
            }
        }
        assert!(lines.next().is_none());
    }
    let few = ok_json(here, "db export curves.h5 --tag slow -o few");
    assert_eq!(
        (&few["cases"], entries(&here.join("few"))),
        (&Value::from(2), vec!["cases.csv".to_string(), "curves.csv".into()])
    );
    fails(here, "db export curves.h5 --tag none -o few", "no case has the tag \"none\"");
    fails(
        here,
        "db export curves.h5 -o t.csv",
        "t.csv is a file: tables are written into a folder",
    );
    // Tables that are not written anew may be of other cases.
    let output = crumple_in(here, "db export curves.h5 --group lead-car-pair -o tables");
    let said = String::from_utf8(output.stderr).unwrap();
    says(&said, "originals.csv existed before and may be of other cases: --originals rewrites it");
}

#[test]
fn cases_are_shown_beside_each_other() {
    let folder = two_groups();
    let here = folder.path();
    let line = "db show curves.h5 --compare --case lead-car-wall/36kmh --case lead-car-pair/48kmh --case lead-car-wall/36kmh";
    let document = ok_json(here, line);
    let database = read(here, "curves.h5");
    let (a, b) = (&database.cases(WALL)[3], &database.cases(PAIR)[1]);
    let cases = document["cases"].as_array().unwrap();
    assert_eq!((document["reference"].as_str().unwrap(), cases.len()), ("lead-car-wall/36kmh", 3));
    let number = |name: &str| cases[1][name].as_f64().unwrap();
    assert_eq!(
        number("speed_difference"),
        b.conditions.speed.m_per_s / a.conditions.speed.m_per_s - 1.0
    );
    assert_eq!(number("peak_force_difference"), b.peak_force_n() / a.peak_force_n() - 1.0);
    assert_eq!(number("work_difference"), b.quality.audit.work_j / a.quality.audit.work_j - 1.0);
    assert_eq!(
        number("max_deflection_difference"),
        b.max_deflection_m() / a.max_deflection_m() - 1.0
    );
    let (one, other) = (a.loading().unwrap().envelope, b.loading().unwrap().envelope);
    let end = one.end_m().min(other.end_m());
    assert_eq!(number("common_deflection_m"), end);
    // By a finer sum than the program's.
    let along = |k: usize| end * (k as f64 + 0.5) / 20_000.0;
    let sum = |f: &dyn Fn(f64) -> f64| (0..20_000).map(|k| f(along(k)).abs()).sum::<f64>();
    let l1 = sum(&|d| one.force_at(d) - other.force_at(d)) / sum(&|d| one.force_at(d));
    assert!((number("force_l1") / l1 - 1.0).abs() < 0.01, "{} against {l1}", number("force_l1"));
    assert_eq!(cases[2]["force_l1"], 0.0, "the same case");
    let text = ok(here, "db show curves.h5 --compare --group lead-car-wall --speed 36km/h..48km/h");
    says(&text, "speed          36 km/h (wall)  48 km/h (wall)   +33.3 %\n");
    says(&text, "\nforce L1 ");
    misused(
        here,
        "db show curves.h5 --compare --case lead-car-wall/36kmh",
        "--compare needs at least two cases",
    );
}

/// The study of `fixtures/databases/version-2.h5`.
const OLD_STUDY: &str = "[study]\nname = \"old study\"\nunits = \"mm-t-s\"\ngroup = \"old\"\nkind  = \"wall\"\n\n\
    [recipe]\ndeflection = { file = \"nodout\", node = 900001, component = \"x_displacement\" }\n\
    force      = { file = \"rwforc\", id = 1, component = \"normal_force\" }\nfilter     = \"none\"\n\
    sampling   = { states = 40, interval_ms = 7.5 }\n\n\
    [[run]]\npath  = \"36kmh\"\nspeed = \"36km/h\"\nmass  = \"24t\"\n\n\
    [[run]]\npath  = \"48kmh\"\nspeed = \"48km/h\"\nmass  = \"24t\"\n";

#[test]
fn databases_of_version_2_are_read_and_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let old = fs::read(fixture("databases/version-2.h5")).unwrap();
    fs::write(here.join("old.h5"), &old).unwrap();
    fs::write(here.join("study.toml"), OLD_STUDY).unwrap();
    for run in ["36kmh", "48kmh"] {
        fs::create_dir(here.join(run)).unwrap();
        for name in ["nodout", "rwforc", "case.json"] {
            let path = fixture(&format!("fe/lead-car-wall/{run}/{name}"));
            fs::copy(path, here.join(run).join(name)).unwrap();
        }
    }
    assert!(ok(here, "db ls old.h5").contains("36kmh  36 km/h (wall)"));
    assert!(ok(here, "db check old.h5").contains("2 cases checked, 0 findings"));
    // What an earlier extraction built is built again, once; a build that changes nothing leaves the
    // file as it is.
    for outcome in ["built", "unchanged"] {
        let report = ok_json(here, "build study.toml -o old.h5");
        assert_eq!(Studied::outcomes(&report), BTreeSet::from([outcome]));
    }
    fs::write(here.join("old.h5"), &old).unwrap();
    // The first change makes it one of this version, with the same curves.
    let before = read(here, "old.h5");
    ok(here, "db rename old.h5 --case 36kmh --to reference");
    let after = read(here, "old.h5");
    assert!(before.cases("old")[0].curves.original == after.cases("old")[0].curves.original);
    let version = Hdf5::open(here.join("old.h5")).unwrap().root().attrs().unwrap();
    assert_eq!(version["layout_version"].as_i64(), Some(3));
    assert!(ok(here, "db check old.h5").contains("2 cases checked, 0 findings"));
    // Its study knows it all the same.
    let report = ok_json(here, "build study.toml -o old.h5");
    assert_eq!(Studied::outcomes(&report), BTreeSet::from(["built"]));
    assert_eq!(report["runs"][0]["renamed"], "old/reference");
    // What others have put into it stays.
    fs::write(here.join("theirs.h5"), &old).unwrap();
    edited(&here.join("theirs.h5"), |file| {
        let case = file.group("old/36kmh").unwrap();
        case.set_attr("reviewed_by", AttrValue::String("Ada".into())).unwrap();
        file.dataset("old/36kmh/force_N")
            .unwrap()
            .set_attr("units", AttrValue::String("N".into()))
            .unwrap();
    });
    // So many that their header has no room for more.
    for dataset in ["old/48kmh/time_s", "old/48kmh/original/force_N"] {
        edited(&here.join("theirs.h5"), |file| {
            let mut dataset = file.dataset(dataset).unwrap();
            for k in 0..9 {
                dataset.set_attr(&format!("mine {k}"), AttrValue::I64(k)).unwrap();
            }
        });
    }
    ok(here, "db tag theirs.h5 --case 48kmh --add a");
    assert!(ok(here, "db check theirs.h5").contains("2 cases checked, 0 findings"));
    let file = Hdf5::open(here.join("theirs.h5")).unwrap();
    assert_eq!(
        file.group("old/36kmh").unwrap().attrs().unwrap()["reviewed_by"].as_str(),
        Some("Ada")
    );
    let force = file.dataset("old/36kmh/force_N").unwrap().attrs().unwrap();
    assert_eq!(force["units"].as_str(), Some("N"));
    let times = file.dataset("old/48kmh/time_s").unwrap().attrs().unwrap();
    assert_eq!(times["mine 8"].as_i64(), Some(8));
}

/// What others have put into a case or group goes where it goes.
#[test]
fn what_others_put_into_a_case_moves_with_it() {
    let folder = two_groups();
    let here = folder.path();
    let path = here.join("curves.h5");
    edited(&path, |file| {
        file.root().set_attr("project", AttrValue::String("nose 3".into())).unwrap();
        let case = file.group("lead-car-wall/36kmh").unwrap();
        case.set_attr("reviewed_by", AttrValue::String("Ada".into())).unwrap();
        case.create_dataset("photo", |d| {
            d.with_f64_data(&[0.5]);
        })
        .unwrap();
        let group = file.group(WALL).unwrap();
        group.set_attr("laboratory", AttrValue::String("B".into())).unwrap();
    });
    let there = |group: &str, case: &str| {
        let file = Hdf5::open(&path).unwrap();
        let text = |path: &str, name: &str| {
            file.group(path).unwrap().attrs().unwrap()[name].as_str().unwrap().to_string()
        };
        assert_eq!(file.root().attrs().unwrap()["project"].as_str(), Some("nose 3"));
        assert_eq!(text(group, "laboratory"), "B");
        assert_eq!(text(&format!("{group}/{case}"), "reviewed_by"), "Ada");
        let photo = file.dataset(&format!("{group}/{case}/photo")).unwrap();
        assert_eq!(photo.read_f64().unwrap(), [0.5]);
        assert!(ok(here, "db check curves.h5").contains("0 findings"));
    };
    let expected = read(here, "curves.h5");
    ok(here, "db rename curves.h5 --case lead-car-wall/36kmh --to reference");
    there(WALL, "reference");
    ok(here, "db rename curves.h5 --case lead-car-wall/48kmh --to 36kmh");
    ok(here, "db rename curves.h5 --group lead-car-wall --to nose");
    there("nose", "reference");
    ok(here, "db tag curves.h5 --group nose --add a");
    there("nose", "reference");
    build_fixture(here, WALL);
    there("nose", "reference");
    let now = read(here, "curves.h5");
    for (old, new) in expected.cases(WALL).iter().zip(now.cases("nose")) {
        assert!(
            old.curves.original == new.curves.original && old.curves.sampled == new.curves.sampled
        );
    }
    // It is not lost, and not taken along to where it does not belong.
    let would_lose = "would lose by rewriting the file: attribute nose/reference/reviewed_by, dataset nose/reference/photo";
    fails(here, "db rm curves.h5 --group nose --case reference", would_lose);
    let warning = crumple_fails(here, 3, "db copy curves.h5 --group nose --to b.h5 --strict");
    says(
        &warning,
        "curves.h5 holds objects that crumple did not write and does not copy: attribute /project",
    );
    ok(here, "db rm curves.h5 --group nose --case 12kmh");
    there("nose", "reference");
}

/// The date is the only thing that two builds of one study differ by, and can be given.
#[test]
fn builds_are_dated_and_reproducible() {
    let studied = Studied::new();
    let here = studied.here();
    let build = |name: &str, epoch: Option<&str>| {
        let mut command = program(here, &["build", "lead-car-wall.toml", "-o", name, "-q"]);
        command.env_remove("SOURCE_DATE_EPOCH");
        if let Some(epoch) = epoch {
            command.env("SOURCE_DATE_EPOCH", epoch);
        }
        assert!(command.output().unwrap().status.success());
        fs::read(here.join(name)).unwrap()
    };
    let (a, b) = (build("a.h5", Some("1000000000")), build("b.h5", Some("1000000000")));
    assert!(a == b);
    let case = read(here, "a.h5").cases(WALL)[0].clone();
    assert_eq!(case.provenance.built_utc.as_deref(), Some("2001-09-09T01:46:40Z"));
    build("c.h5", None);
    let now = read(here, "c.h5").cases(WALL)[0].provenance.built_utc.clone().unwrap();
    assert!(now.as_str() > "2026" && now.len() == 20 && now.ends_with('Z'), "{now}");
    // Nothing to do, nothing written.
    let before = build("a.h5", Some("2000000000"));
    assert!(before == a);
    // The sources as they were given, from the root on.
    let source = &case.provenance.sources[0];
    let path = Path::new(source.absolute_path.as_ref().unwrap());
    assert!(path.is_absolute() && path.ends_with("12kmh/nodout") && path.is_file(), "{source:?}");
    assert_eq!(case.provenance.origin.unwrap().manifest, studied.study.to_str().unwrap());
}

/// Commands that change a database, of the two databases `curves.h5` and `other.h5`, and the file
/// that they write.
const CHANGING: [(&str, &str); 9] = [
    ("build STUDY -o curves.h5", "curves.h5"),
    ("db add curves.h5 t.csv --group tests --speed 36km/h --kind wall --mass 24t", "curves.h5"),
    ("db rm curves.h5 --group lead-car-wall --speed ..20km/h", "curves.h5"),
    ("db rename curves.h5 --case lead-car-wall/36kmh --to reference", "curves.h5"),
    ("db rename curves.h5 --group lead-car-wall --to nose", "curves.h5"),
    ("db merge curves.h5 other.h5 -o curves.h5", "curves.h5"),
    ("db copy curves.h5 --group lead-car-wall --to-group copies", "curves.h5"),
    ("db tag curves.h5 --group lead-car-wall --add reviewed", "curves.h5"),
    ("db note curves.h5 --group lead-car-wall --add seen", "curves.h5"),
];

/// A folder with what the commands above need.
fn to_be_changed() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, PAIR);
    fs::rename(here.join("curves.h5"), here.join("other.h5")).unwrap();
    build_fixture(here, WALL);
    fs::write(here.join("t.csv"), TABLE).unwrap();
    let study = fixture("fe/lead-car-pair/study.toml").to_str().unwrap().to_string();
    (folder, study)
}

/// A case's place, tags, notes and forces.
type Said = (String, Vec<String>, Vec<String>, Vec<f64>);

/// Cases with what users say of them; dates differ from run to run.
fn state(path: &Path) -> Vec<Said> {
    let database = Database::read(path).unwrap();
    let said = |case: &Case| {
        let (path, of) = (format!("{}/{}", case.id.group, case.id.name), &case.provenance);
        (path, of.tags.clone(), of.user_notes.clone(), case.curves.original.force_n().to_vec())
    };
    database.all().map(said).collect()
}

/// Numbers from 0 to 1 that are spread evenly and look like nothing.
fn moments(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(|k| (k as f64 * 0.618_033_988_749_895 + 0.3).fract())
}

/// How long commands are left to run before they are killed: longer after one that was killed,
/// shorter after one that had ended, so that both happen however busy the machine is.
struct Aim(Duration);

impl Aim {
    /// At a command that takes about as long as `whole`.
    fn at(whole: Duration) -> Self {
        Self(whole.mul_f64(1.2))
    }

    fn wait(&self, moment: f64) {
        std::thread::sleep(self.0.mul_f64(moment));
    }

    fn killed(&mut self) {
        self.0 = self.0.mul_f64(1.15).min(Duration::from_secs(20));
    }

    fn ended(&mut self) {
        self.0 = self.0.mul_f64(0.85);
    }
}

/// Kills every changing command at many moments; `look` is shown the database each time.
fn kill_at_many_moments(look: &mut dyn FnMut(&Path)) {
    let kills = if is_thorough() { 200 } else { 20 };
    let (folder, study) = to_be_changed();
    let here = folder.path();
    let inputs = entries(here);
    for (line, output) in CHANGING {
        let words: Vec<&str> =
            line.split(' ').map(|word| if word == "STUDY" { &*study } else { word }).collect();
        let path = here.join(output);
        let before = fs::read(&path).unwrap();
        let old = state(&path);
        let begun = Instant::now();
        ok(here, &words);
        let mut aim = Aim::at(begun.elapsed());
        let new = state(&path);
        assert!(old != new, "{line}");
        let (mut killed, mut acknowledged) = (0, 0);
        for moment in moments(kills) {
            fs::write(&path, &before).unwrap();
            let mut child = crumple_started(here, &words);
            aim.wait(moment);
            let _ = child.kill();
            let found = if child.wait().unwrap().success() {
                acknowledged += 1;
                aim.ended();
                assert!(state(&path) == new, "{line}");
                continue;
            } else {
                state(&path)
            };
            killed += 1;
            aim.killed();
            assert!(found == old || found == new, "{line}");
            look(&path);
            let left: Vec<String> =
                entries(here).into_iter().filter(|name| !inputs.contains(name)).collect();
            assert!(left.len() <= 2, "{line}: {left:?}");
            // The next command clears what was left.
            ok(here, "db tag curves.h5 --speed 0km/h.. --add after");
            assert_eq!(entries(here), inputs, "{line}");
        }
        assert!(killed > 0, "{line}: {acknowledged} ended before they were killed");
        fs::write(&path, &before).unwrap();
    }
}

#[test]
fn killed_commands_leave_the_old_or_the_new() {
    let mut looked = 0;
    kill_at_many_moments(&mut |_| looked += 1);
    assert!(looked > CHANGING.len(), "{looked}");
}

/// `db ls` takes the stored stopped mass while it is that of the cases, and else computes it.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn a_list_of_what_h5py_changed_has_the_stopped_mass_of_the_cases() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let list = |database: &str| json(&ok(here, &["db", "ls", database, "--json", "-q"]));
    let stored = list("curves.h5")["stopped_mass"].clone();
    assert!(stored["lead-car-wall"]["residual_kg"].is_f64());
    let altered = |name: &str, change: &str| {
        fs::copy(here.join("curves.h5"), here.join(name)).unwrap();
        let script = format!(
            "import h5py\nwith h5py.File('{name}', 'a') as f:\n    g = f['lead-car-wall']\n    {change}"
        );
        assert!(python().current_dir(here).args(["-c", &script]).status().unwrap().success());
        list(name)["stopped_mass"].clone()
    };
    for (k, change) in [
        "del g.attrs['stopped_mass_kg']",
        "kg = g.attrs['stopped_mass_kg']; kg[3] = float('nan'); g.attrs['stopped_mass_kg'] = kg",
        "g.attrs['stopped_mass_residual_kg'] = [1.0, 2.0]",
    ]
    .into_iter()
    .enumerate()
    {
        assert_eq!(altered(&format!("{k}.h5"), change), stored, "{change}");
    }
    assert_eq!(
        altered("number.h5", "g.attrs['stopped_mass_residual_kg'] = 12.5")["lead-car-wall"]["residual_kg"],
        12.5
    );
    let fewer = altered("fewer.h5", "del g['36kmh']");
    ok(here, &["db", "rm", "curves.h5", "--case", "lead-car-wall/36kmh", "-q"]);
    assert_eq!(fewer, list("curves.h5")["stopped_mass"]);
    assert_ne!(fewer, stored);
}

/// h5py, which is the C library, judges the files.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_opens_databases_whose_writers_were_killed() {
    let seen = tempfile::tempdir().unwrap();
    let mut files = 0;
    kill_at_many_moments(&mut |path| {
        fs::copy(path, seen.path().join(format!("{files}.h5"))).unwrap();
        files += 1;
    });
    let look = "import h5py, pathlib, sys\n\
        files = list(pathlib.Path(sys.argv[1]).glob('*.h5'))\n\
        for path in files:\n\
        \x20   with h5py.File(path) as file:\n\
        \x20       for group in file.values():\n\
        \x20           for name in group.attrs['cases']:\n\
        \x20               assert len(group[name]['force_N'][:]) == len(group[name]['time_s'][:])\n\
        print(len(files))\n";
    let output = python().args(["-c", look]).arg(seen.path()).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    assert_eq!(String::from_utf8(output.stdout).unwrap().trim(), files.to_string());
}

/// Cases that are added one after the other while the adding commands are killed: all that were
/// acknowledged are there.
#[test]
fn every_acknowledged_case_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("t.csv"), TABLE).unwrap();
    let add = |case: &str| {
        let line = "db add c.h5 t.csv --group g --speed 36km/h --kind wall --mass 24t --case";
        crumple_started(here, &format!("{line} {case}"))
    };
    let begun = Instant::now();
    assert!(add("first").wait().unwrap().success());
    let mut aim = Aim::at(begun.elapsed());
    let mut acknowledged = BTreeSet::from(["g/first".to_string()]);
    let (mut asked, mut killed) = (acknowledged.clone(), 0);
    for (k, moment) in moments(if is_thorough() { 200 } else { 40 }).enumerate() {
        let mut child = add(&k.to_string());
        asked.insert(format!("g/{k}"));
        aim.wait(moment);
        let _ = child.kill();
        if child.wait().unwrap().success() {
            acknowledged.insert(format!("g/{k}"));
            aim.ended();
        } else {
            killed += 1;
            aim.killed();
        }
        let there: BTreeSet<String> = names(here, "c.h5").into_iter().collect();
        assert!(acknowledged.is_subset(&there) && there.is_subset(&asked), "{there:?}");
    }
    assert!(killed > 0 && acknowledged.len() > 1, "{killed} killed, {acknowledged:?}");
    ok(here, "db tag c.h5 --group g --add a");
    assert_eq!(entries(here), ["c.h5", "t.csv"]);
}

/// One writer at a time: the second gets a message, whatever it wants.
#[test]
fn a_second_writer_is_known() {
    let (folder, study) = to_be_changed();
    let here = folder.path();
    let before = fs::read(here.join("curves.h5")).unwrap();
    let held = held_by_another(&here.join("curves.h5"));
    for (line, _) in CHANGING {
        let line = line.replace("STUDY", &study);
        fails(
            here,
            &line,
            "curves.h5 is being written by another process: try again when it has finished",
        );
    }
    ok(here, "db ls curves.h5");
    ok(here, "db copy curves.h5 --group lead-car-wall --to new.h5");
    drop(held);
    assert!(fs::read(here.join("curves.h5")).unwrap() == before);
    // Two at once: each is done or refused, and nothing is lost.
    let tag = |tag: &str| {
        crumple_started(here, &["db", "tag", "curves.h5", "--group", WALL, "--add", tag])
    };
    let mut expected = BTreeSet::new();
    for round in 0..10 {
        let tags: Vec<String> = (0..3).map(|k| format!("t{round}-{k}")).collect();
        let children: Vec<_> = tags.iter().map(|name| tag(name)).collect();
        for (name, child) in tags.into_iter().zip(children) {
            let output = child.wait_with_output().unwrap();
            let error = String::from_utf8(output.stderr).unwrap();
            match output.status.code() {
                Some(0) => drop(expected.insert(name)),
                _ => assert!(error.contains("is being written by another process"), "{error}"),
            }
        }
    }
    let tags = read(here, "curves.h5").cases(WALL)[0].provenance.tags.clone();
    assert_eq!(tags.into_iter().collect::<BTreeSet<_>>(), expected);
    assert_eq!(entries(here), ["curves.h5", "new.h5", "other.h5", "t.csv"]);
}

/// Files that are edited in place are whole for the HDF5 library, with texts of variable length.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_reads_what_was_edited_in_place() {
    let folder = two_groups();
    let here = folder.path();
    let look = "import h5py, sys\n\
        count = 0\n\
        with h5py.File(sys.argv[1]) as file:\n\
        \x20   for group in file.values():\n\
        \x20       for name in group.attrs.get('cases', []):\n\
        \x20           assert all(isinstance(v, str) for v in group[name].attrs.values() if not hasattr(v, 'dtype'))\n\
        \x20           for curve in (group[name], group[name]['original']):\n\
        \x20               for column, data in curve.items():\n\
        \x20                   if isinstance(data, h5py.Dataset) and column not in ('time_s', 'photo'):\n\
        \x20                       assert len(data[:]) == len(curve['time_s'][:]), data.name\n\
        \x20                       count += 1\n\
        print(count)\n";
    let count = || {
        let output = python().args(["-c", look, "curves.h5"]).current_dir(here).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().trim().parse::<usize>().unwrap()
    };
    // Four columns beside the times of each case, and two at the solver's rate.
    assert_eq!(count(), 11 * 6);
    edited(&here.join("curves.h5"), |file| {
        let case = file.group("lead-car-wall/36kmh").unwrap();
        case.create_dataset("photo", |d| {
            d.with_f64_data(&[0.5]);
        })
        .unwrap();
    });
    ok(here, "db tag curves.h5 --group lead-car-wall --add a");
    assert_eq!(count(), 11 * 6);
    ok(here, "db rename curves.h5 --case lead-car-wall/36kmh --to reference");
    assert_eq!(count(), 11 * 6);
    ok(here, "db rename curves.h5 --group lead-car-wall --to nose");
    assert_eq!(count(), 11 * 6);
    build_fixture(here, WALL);
    assert_eq!(count(), 11 * 6);
    ok(here, "db rm curves.h5 --group nose --case 12kmh");
    ok(here, "db copy curves.h5 --group nose --to-group copies");
    assert_eq!(count(), 16 * 6);
}

/// Two designs in one group show in the order of their peaks.
#[test]
fn another_design_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (group, case) in [(WALL, "18kmh"), ("staged-lead-wall", "20kmh")] {
        build_fixture(here, group);
        let of = format!("db copy curves.h5 --group {group} --case {case}");
        ok(here, &format!("{of} --to-group mixed --to mixed.h5 -q"));
    }
    let said = said(&crumple_in(here, "db ls mixed.h5"));
    says(&said, "its peaks come in a different order from those of 18kmh");
}
