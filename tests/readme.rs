//! The README's commands do what it says, and its numbers are the program's.

use std::path::PathBuf;
use std::process::Command;

use crate::common::{crumple_ok, root};

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).unwrap()
}

/// Lines of the fenced blocks of one language.
fn blocks(language: &str) -> Vec<String> {
    let text = readme();
    let fence = format!("```{language}\n");
    let inside = text.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap());
    inside.flat_map(str::lines).map(str::to_string).collect()
}

#[test]
fn commands_of_the_readme_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut here: PathBuf = folder.path().into();
    let mut run = 0;
    for line in blocks("sh") {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["cd", to] => here = here.join(to),
            ["crumple", ref arguments @ ..] => {
                let output = Command::new(env!("CARGO_BIN_EXE_crumple"))
                    .args(arguments)
                    .current_dir(&here)
                    .output()
                    .unwrap();
                let error = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{line}\n{error}");
                run += 1;
            }
            [] | ["#", ..] => {}
            // The two commands of a fresh clone: CI runs them.
            ["cargo", "run", "--release", "--", "demo"] | ["tests/run"] => {}
            _ => panic!("nothing runs this line of the README: {line}"),
        }
    }
    assert!(run >= 12, "{run} commands");
}

/// CI runs the two commands of a fresh clone.
#[test]
fn ci_runs_the_two_commands() {
    let ci = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(ci.contains("cargo run --locked --release -- demo"));
    assert!(ci.lines().any(|l| l == "tests/run"));
}

#[test]
fn table_of_the_readme_is_the_demos() {
    let folder = tempfile::tempdir().unwrap();
    let demo = crumple_ok(folder.path(), &["demo"]);
    let table = blocks("text");
    assert_eq!(table.iter().filter(|l| l.contains("FE's own, body")).count(), 3, "three groups");
    for line in table {
        assert!(demo.lines().any(|l| l == line), "the demo does not print: {line}\n{demo}");
    }
}

/// The tables of the methods are those that the commands print.
#[test]
fn tables_of_the_methods_are_those_of_compare() {
    let folder = tempfile::tempdir().unwrap();
    crumple_ok(folder.path(), &["demo", "-o", ".", "-q"]);
    let group = crumple_ok(folder.path(), &["compare", "curves.h5", "--group", "lead-car-wall"]);
    let train = crumple_ok(folder.path(), &["compare", "--train", "train-set.toml", "-q"]);
    let tables = blocks("txt");
    assert_eq!(tables.iter().filter(|l| l.starts_with("nsdm")).count(), 2, "two tables");
    for line in tables {
        let printed = group.lines().chain(train.lines()).any(|l| l == line);
        assert!(printed, "compare does not print: {line}\n{group}\n{train}");
    }
}

/// The errors of *auto*, chosen anew without each left-out speed, are those that validate prints.
#[test]
fn nested_errors_of_the_readme_are_those_of_validate() {
    let folder = tempfile::tempdir().unwrap();
    for group in ["lead-car-pair", "lead-car-wall", "vehicle-pair"] {
        crate::common::build_fixture(folder.path(), group);
    }
    let printed = crumple_ok(folder.path(), &["validate", "curves.h5", "--nested"]);
    // The rows of means have no speed behind the name.
    let means: Vec<Vec<&str>> = printed
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>())
        .filter(|words| words.first() == Some(&"auto") && words[2] == "%")
        .collect();
    let column = |at: usize| -> Vec<&str> { means.iter().map(|words| words[at]).collect() };
    let (force, velocity) = (column(1), column(8));
    let sentence = format!(
        "force errors of {}, {} and {} % and velocity errors of {}, {} and {} %",
        force[0], force[1], force[2], velocity[0], velocity[1], velocity[2]
    );
    let text = readme().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains(&sentence), "the README does not say: {sentence}\n{printed}");
}
