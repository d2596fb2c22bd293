//! The way of a new user from raw run folders to the report: the commands of
//! docs/from-runs-to-train.md and those that `crumple` names without arguments, in folders that hold
//! nothing but what a solver wrote; and what is reported when something is not as it should be.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::containers::binout_of;
use crate::common::{crumple_fails, crumple_in, crumple_ok, fixture, root, says, shared};
use crate::readme::run;

const TEXTS: &[&str] = &["nodout", "rwforc"];

/// Copies some of the files of a run into a folder of its own.
fn copy(from: &Path, to: &Path, files: &[&str]) {
    fs::create_dir_all(to).unwrap();
    for file in files {
        fs::write(to.join(file), fs::read(from.join(file)).unwrap()).unwrap();
    }
}

/// The commands of the page, in their order.
fn commands_of_the_page() -> Vec<String> {
    let text = fs::read_to_string(root().join("docs/from-runs-to-train.md")).unwrap();
    let lines = text.lines().map(|line| line.strip_prefix("$ ").unwrap_or(line));
    let mut is_code = false;
    let commands = lines.filter(|line| {
        is_code ^= line.starts_with("```");
        is_code && line.starts_with("crumple ")
    });
    commands.map(String::from).collect()
}

/// Goes the page's way from `fe/lead-car-wall` in `here`, and looks at what it leads to.
fn go_the_pages_way(here: &Path) -> Duration {
    let commands = commands_of_the_page();
    assert!((5..=8).contains(&commands.len()), "{commands:?}");
    let start = Instant::now();
    commands.iter().for_each(|command| drop(run(command, here)));
    let took = start.elapsed();
    let page = fs::read_to_string(here.join("two.html")).unwrap();
    for part in [
        "36kmh",
        "48kmh",
        "Predicted curve at 42 km/h",
        "Scenario two-scenario.toml",
        "mean deceleration",
        "Next FE run: 42 km/h",
    ] {
        assert!(page.contains(part), "the report lacks {part}");
    }
    let study = fs::read_to_string(here.join("two.toml")).unwrap();
    assert!(!study.contains("fill in") && !study.contains("Left out"), "{study}");
    assert!(fs::read_to_string(here.join("two42.k")).unwrap().contains("*DEFINE_CURVE"));
    assert!(fs::read_to_string(here.join("two42.svg")).unwrap().contains("</svg>"));
    took
}

#[test]
fn the_page_leads_from_raw_texts_and_from_a_binout_to_a_report() {
    let source = fixture("fe/lead-car-wall");
    let (texts, binouts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for run in ["36kmh", "48kmh"] {
        let below = format!("fe/lead-car-wall/{run}");
        copy(&source.join(run), &texts.path().join(&below), TEXTS);
        fs::create_dir_all(binouts.path().join(&below)).unwrap();
        let binout = binouts.path().join(&below).join("binout0000");
        fs::write(binout, binout_of(&source.join(run))).unwrap();
    }
    let took = go_the_pages_way(texts.path()).max(go_the_pages_way(binouts.path()));
    // The page says less than a second. Machines are shared, so only a minute would be wrong.
    println!("from raw runs to the report in {took:.2?}");
    assert!(took < Duration::from_secs(60), "{took:?}");
}

/// The files as the solver left them: all of them, the binary alone, and text in one run and binary
/// in the other.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn the_page_leads_from_all_files_of_a_solver_to_a_report() {
    let source = shared("fe/lead-car-wall");
    let all = ["nodout", "rwforc", "rcforc", "glstat", "crashT01", "crashT01_TITLES"];
    for (first, second) in
        [(&all[..], &all[..]), (&["crashT01"], &["crashT01"]), (TEXTS, &["crashT01"])]
    {
        let folder = tempfile::tempdir().unwrap();
        for (run, files) in [("36kmh", first), ("48kmh", second)] {
            let below = folder.path().join("fe/lead-car-wall").join(run);
            copy(&source.join(run), &below, files);
        }
        let took = go_the_pages_way(folder.path());
        println!("from {first:?} and {second:?} in {took:.2?}");
        assert!(took < Duration::from_secs(60), "{took:?}");
    }
}

/// What `crumple` shows as the usual order of work can be typed as it is there, also where
/// folders have names with spaces and umlauts.
#[test]
fn the_usual_order_of_work_works() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("Läufe vom März");
    for (run, name) in [("36kmh", "Stoß 36 km h"), ("48kmh", "Stoß 48 km h"), ("60kmh", "Stoß 60")]
    {
        copy(&fixture("fe/lead-car-wall").join(run), &here.join("Läufe").join(name), TEXTS);
    }
    let help = crumple_fails(&here, 2, &[]);
    let order = help.lines().filter(|line| line.starts_with("  crumple "));
    let commands: Vec<&str> =
        order.map(|line| line.trim_start().split("  ").next().unwrap()).collect();
    assert_eq!(commands.len(), 9, "{help}");
    for command in commands {
        let words = command.split(' ').skip(1).map(|word| match word {
            "RUNS" => "Läufe",
            "M" => "m.model",
            word => word,
        });
        crumple_ok(&here, &words.collect::<Vec<_>>());
    }
    let study = fs::read_to_string(here.join("study.toml")).unwrap();
    says(&study, "path = \"Läufe/Stoß 36 km h\"");
    says(&study, "group = \"Läufe\"");
    assert!(fs::read_to_string(here.join("report.html")).unwrap().contains("Stoß 48 km h"));
}

/// A run that was killed spoils nothing of the others: neither their mass nor their recipe.
#[test]
fn a_killed_run_says_nothing_of_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    copy(&fixture("fe/lead-car-wall/36kmh"), &here.join("runs/36kmh"), TEXTS);
    copy(&fixture("fe/lead-car-wall/48kmh"), &here.join("runs/48kmh"), TEXTS);
    let alone = crumple_ok(here, "init runs/36kmh --group runs -o alone.toml");
    let nodout = here.join("runs/48kmh/nodout");
    let whole = fs::read(&nodout).unwrap();
    for states in [20, 40, 80] {
        let end = whole.len() * states / 400;
        fs::write(&nodout, &whole[..end]).unwrap();
        let output = crumple_in(here, &["init", "runs", "-o", &format!("{states}.toml")]);
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "", "{states} states");
        let printed = String::from_utf8(output.stdout).unwrap();
        let died = "left out: runs/48kmh: it terminated early: the record ends at ";
        says(&printed, died);
        let without_its_run: Vec<&str> =
            printed.lines().filter(|line| !line.starts_with("left out: ")).collect();
        let expected = alone.replace("alone.toml", &format!("{states}.toml"));
        let expected = expected.replace("runs (given)", "runs (guessed)");
        assert_eq!(without_its_run, expected.lines().collect::<Vec<_>>());
    }
    // Another file of the same histories may hold more of them.
    let copied = binout_of(&fixture("fe/lead-car-wall/48kmh"));
    fs::write(here.join("runs/48kmh/binout0000"), copied).unwrap();
    let printed = crumple_ok(here, "init runs -o binout.toml");
    let hint = "; binout0000 also holds it, and is read where there is no nodout\n";
    says(&printed, hint);
    fs::remove_file(here.join("runs/48kmh/binout0000")).unwrap();
    // The run that died counts as damage for --strict.
    let strict = crumple_in(here, "init runs -o strict.toml --strict");
    assert_eq!(strict.status.code(), Some(3));
    // A force that was cut early tells as little, and is called by its end, not by another recipe.
    fs::write(&nodout, &whole).unwrap();
    let rwforc = here.join("runs/48kmh/rwforc");
    let text = fs::read_to_string(&rwforc).unwrap();
    let first: Vec<&str> = text.split_inclusive('\n').take(40).collect();
    fs::write(&rwforc, first.concat()).unwrap();
    let printed = crumple_ok(here, "init runs -o force.toml");
    says(&printed, "left out: runs/48kmh: it terminated early: the record ends at 22.");
    says(&printed, "\n36kmh  36 km/h  24.00 t ");
}

#[test]
fn what_is_not_as_it_should_be_is_said_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let source = fixture("fe/lead-car-wall");
    copy(&source.join("36kmh"), &here.join("runs/36kmh"), TEXTS);
    copy(&source.join("48kmh"), &here.join("runs/48kmh"), TEXTS);
    let fails = |arguments: &[&str], expected: &str| {
        let error = crumple_fails(here, 1, &[&["init"], arguments].concat());
        says(&error, expected);
        assert!(!here.join("study.toml").exists(), "{arguments:?}");
    };
    // For a wrong path the message lists what is there.
    fails(&["run"], "run: No such file or directory (os error 2); did you mean runs?");
    fails(&["runs/36kmh", "runs/49kmh"], "runs/49kmh: No such file");
    fails(&["runs/49kmh"], "did you mean runs/48kmh?");
    fails(&["elsewhere"], "elsewhere: No such file or directory (os error 2)\n");
    fails(&["runs/36kmh/nodout"], "this is not a folder: give a run's folder, or one above runs");
    // A file with another name than the solver's.
    fs::rename(here.join("runs/48kmh/nodout"), here.join("runs/48kmh/Nodout.txt")).unwrap();
    fails(
        &["runs/48kmh"],
        "it has rwforc (runs/48kmh/Nodout.txt: if it is the nodout, rename it accordingly)",
    );
    // A folder without anything, beside one with a run.
    fs::remove_dir_all(here.join("runs/48kmh")).unwrap();
    fs::create_dir(here.join("runs/48kmh")).unwrap();
    let printed = crumple_ok(here, "init runs");
    says(&printed, "left out: runs/48kmh: the folder is empty");
    assert!(
        printed.ends_with(
            "wrote study.toml (1 run): check the guessed values, then run crumple build\n"
        )
    );
    // What is left to fill in is counted where the next step is named.
    fs::remove_file(here.join("runs/36kmh/rwforc")).unwrap();
    let printed = crumple_ok(here, "init runs -o mass.toml");
    assert!(printed.ends_with("wrote mass.toml (1 run): incomplete, 1 line to fill in or to give as an option; then run crumple build\n"), "{printed}");
}
