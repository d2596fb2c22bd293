//! Messages: pages of `tests/messages`, errors as JSON, help, man pages, narrow terminals.
//!
//! A page of messages is a test: what is before its first case is done at the beginning of each.
//! A heading `##` is a case; a block with a file's name is that file, `diff` changes it, `sh` prepares,
//! and `console` shows what each command prints, on standard error too, and its exit code. A command
//! that fails leaves no file behind. To write the pages again (and look at the difference):
//! CRUMPLE_WRITE_DOCS=1 cargo test --locked --release --test all messages

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, entries, fixture, root, says,
};

macro_rules! pages {
    ($($name:ident: $page:literal;)*) => {
        const PAGES: &[&str] = &[$($page),*];
        $(#[test] fn $name() { holds($page); })*
    };
}

pages! {
    command_lines: "command-lines.md";
    files: "files.md";
    scenarios: "scenarios.md";
    studies: "studies.md";
    sweeps: "sweeps.md";
}

/// A line of `bash` in `here`: what it prints, and its exit code.
fn bash(line: &str, here: &Path, database: &Path) -> (String, i32) {
    let program = Path::new(env!("CARGO_BIN_EXE_crumple")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let output = Command::new("bash")
        .args(["-c", &format!("{line}\n")])
        .envs([("PATH", path), ("FIXTURES", fixture("").display().to_string())])
        .env("DATABASE", database)
        .current_dir(here)
        .output()
        .unwrap();
    let printed = [output.stdout, output.stderr].concat();
    let printed = String::from_utf8(printed).unwrap();
    let fixtures = fixture("").display().to_string();
    (printed.replace(&fixtures, "$FIXTURES/"), output.status.code().unwrap())
}

/// Does what a block of a page says; returns the block with what its commands print.
fn act(info: &str, body: &str, here: &Path, database: &Path) -> String {
    match info.split_once(' ') {
        Some(("diff", file)) => {
            let side = |other: char| -> String {
                let lines = body.lines().filter(|line| !line.starts_with(other));
                lines.map(|line| format!("{}\n", &line[1..])).collect()
            };
            let text = fs::read_to_string(here.join(file)).unwrap();
            assert_eq!(text.matches(&side('+')).count(), 1, "{file} has not once:\n{body}");
            fs::write(here.join(file), text.replacen(&side('+'), &side('-'), 1)).unwrap();
        }
        Some((_, file)) => fs::write(here.join(file), body).unwrap(),
        None if info == "sh" => {
            let (printed, code) = bash(body, here, database);
            assert_eq!(code, 0, "{body}{printed}");
        }
        None => {
            assert_eq!(info, "console");
            let commands = body.lines().filter_map(|line| line.strip_prefix("$ "));
            return commands
                .map(|command| {
                    let before = entries(here);
                    let (printed, code) = bash(command, here, database);
                    assert!(!printed.contains("panicked"), "{command}\n{printed}");
                    assert!(code == 0 || entries(here) == before, "{command} leaves a file behind");
                    let code =
                        if code == 0 { String::new() } else { format!("(exit code {code})\n") };
                    format!("$ {command}\n{}\n{code}", printed.trim_end())
                })
                .collect();
        }
    }
    body.into()
}

/// Each case of a page prints what the page says.
fn holds(page: &str) {
    let path = root().join("tests/messages").join(page);
    let text = fs::read_to_string(&path).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let database = build_fixture(elsewhere.path(), "lead-car-wall");
    let mut cases = text.split_inclusive("\n\n## ");
    let before = cases.next().unwrap();
    let mut made = before.to_string();
    let play = |text: &str, here: &Path| -> String {
        let mut parts = text.split("```");
        let mut out = parts.next().unwrap().to_string();
        while let (Some(block), Some(after)) = (parts.next(), parts.next()) {
            let (info, body) = block.split_once('\n').unwrap();
            out += &format!("```{info}\n{}```{after}", act(info, body, here, &database));
        }
        out
    };
    for case in cases {
        let folder = tempfile::tempdir().unwrap();
        play(before, folder.path());
        made += &play(case, folder.path());
    }
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        fs::write(&path, &made).unwrap();
    }
    for (number, (expected, found)) in text.lines().zip(made.lines()).enumerate() {
        assert_eq!(expected, found, "tests/messages/{page}, line {}", number + 1);
    }
    assert_eq!(text.len(), made.len(), "tests/messages/{page} is longer or shorter");
}

#[test]
fn every_page_is_held() {
    assert_eq!(entries(&root().join("tests/messages")), PAGES);
}

/// A pair whose recipe names no other body.
const STUDY_OF_A_PAIR: &str = "[study]
name = \"s\"
units = \"mm-t-s\"
group = \"g\"
kind  = \"pair\"

[recipe]
deflection = { file = \"nodout\", node = 900001, component = \"x_displacement\" }
force = { file = \"rwforc\", id = 1, component = \"normal_force\" }
sampling = { states = 400, interval_ms = 0.75 }

[[run]]
path  = \"25kmh\"
speed = \"25km/h\"
mass = \"24t\"
";

/// A scenario whose curve does not exist.
const SCENARIO: &str = "[run]
duration = \"100ms\"
[curves]
c = { file = \"none.csv\" }
[[train]]
name = \"A\"
speed = \"10m/s\"
vehicles = [ { name = \"A1\", mass = \"24t\" } ]
[wall]
[contact]
curve = \"c\"
";

/// With `--json` an error is one document on standard output, and nothing else is reported.
#[test]
fn errors_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    fs::write(here.join("study.toml"), STUDY_OF_A_PAIR).unwrap();
    fs::write(here.join("s.toml"), SCENARIO).unwrap();
    fs::write(here.join("text.h5"), "hello\n").unwrap();
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    let t = |arguments: &[&str], status: i32, code: &str| -> Value {
        let output = crumple_in(here, &[arguments, &["--json"]].concat());
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{arguments:?}");
        let document: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(document["error"]["code"], code, "{arguments:?}: {document}");
        assert!(!document["error"]["message"].as_str().unwrap().contains('\n'), "{document}");
        document["error"].clone()
    };
    let study = t(&["build", "study.toml", "-o", "c.h5"], 1, "study");
    assert_eq!(
        (&study["file"], &study["line"], &study["column"]),
        (&"study.toml".into(), &5.into(), &9.into())
    );
    let scenario = t(&["simulate", "s.toml"], 1, "io");
    assert_eq!((&scenario["line"], &scenario["column"]), (&4.into(), &14.into()));
    t(&["build", "none.toml", "-o", "c.h5"], 1, "io");
    t(&["db", "ls", "text.h5"], 1, "database");
    t(&["inspect", "text.h5"], 1, "solver_file");
    let guess = t(&["histories", nodout, "--component", "x_velocty"], 1, "solver_file");
    assert_eq!(guess["hint"], "did you mean \"x_velocity\"?");
    let group = t(&["train", "curves.h5", "--group", "lead-car-wal", "-o", "m"], 1, "database");
    assert_eq!(group["hint"], "did you mean \"lead-car-wall\"?");
    let command = t(&["bild"], 2, "usage");
    assert_eq!(command["hint"], "a similar subcommand exists: 'build'");
    let option = t(&["db", "ls", "--qiet"], 2, "usage");
    assert!(option["hint"].as_str().unwrap().contains("--quiet"), "{option}");
    t(&["predict", "m", "--speed", "36"], 2, "usage");
    t(&["histories", nodout, "-o", "a.parquet"], 2, "usage");
}

#[test]
fn without_arguments_the_order_of_work() {
    let help = crumple_fails(Path::new("."), 2, &[]);
    let at =
        |word: &str| help.find(&format!("crumple {word} ")).unwrap_or_else(|| panic!("{help}"));
    let order = ["inspect", "build", "validate", "train", "predict", "simulate", "report"];
    assert!(order.windows(2).all(|pair| at(pair[0]) < at(pair[1])), "{help}");
}

/// The commands of a help text.
fn commands(help: &str) -> Vec<String> {
    let listed = help.split("\nCommands:\n").nth(1).map(|rest| rest.split("\n\n").next().unwrap());
    let names = listed
        .into_iter()
        .flat_map(str::lines)
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names
        .map(|line| line.split_whitespace().next().unwrap().to_string())
        .filter(|name| name != "help")
        .collect()
}

#[test]
fn global_options_have_their_heading_and_every_command_its_page() {
    let folder = tempfile::tempdir().unwrap();
    crumple_ok(folder.path(), "man -o man/man1");
    let pages = folder.path().join("man/man1");
    let mut expected = 0;
    let mut left: Vec<Vec<String>> = vec![Vec::new()];
    while let Some(command) = left.pop() {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let help = crumple_ok(folder.path(), &[&words[..], &["--help"]].concat());
        assert!(!help.contains('\\'), "quotes of the source are not part of the help: {help}");
        let global = help.split("\nGlobal options:\n").nth(1).unwrap_or_else(|| panic!("{help}"));
        for option in ["--json", "--quiet", "--strict", "--help", "--version"] {
            assert!(global.contains(option), "{words:?} {option}: {help}");
            let before = help.split("\nGlobal options:\n").next().unwrap();
            assert!(!before.contains(&format!("  {option}")), "{words:?} {option}: {help}");
        }
        let name = [&["crumple"], &words[..]].concat().join("-");
        let page = fs::read_to_string(pages.join(format!("{name}.1"))).unwrap();
        says(&page, &format!(".TH {name} "));
        expected += 1;
        left.extend(commands(&help).into_iter().map(|sub| [&command[..], &[sub]].concat()));
    }
    assert_eq!(pages.read_dir().unwrap().count(), expected);
    assert!(expected > 20, "{expected}");
}

/// A file of one long line, such as a model where a scenario is meant, does not fill the log.
#[test]
fn a_long_line_is_shown_in_part() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        format!("{{\"format\":\"crumple model\",\"forces\":[{}0]}}\n", "1.5,".repeat(10_000));
    fs::write(folder.path().join("m.model"), text).unwrap();
    let error = crumple_fails(folder.path(), 1, "simulate m.model");
    says(&error, "1 | {\"format\":\"crumple model\"");
    assert!(error.lines().all(|line| line.chars().count() <= 200), "{error}");
}

/// What crumple prints on a terminal of so many columns, without the terminal's line ends.
#[cfg(target_os = "linux")]
fn on_a_terminal(folder: &Path, columns: usize, arguments: &str) -> String {
    let program = env!("CARGO_BIN_EXE_crumple");
    let output = Command::new("script")
        .args([
            "-qec",
            &format!("stty rows 40 cols {columns}; '{program}' {arguments}"),
            "/dev/null",
        ])
        .current_dir(folder)
        .env_remove("COLUMNS")
        .env("NO_COLOR", "1")
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).replace("\r\n", "\n")
}

/// Whether a text sets a colour or style; progress moves the cursor, which is neither.
#[cfg(target_os = "linux")]
fn has_colour(text: &str) -> bool {
    let mut sequences = text.split("\x1b[").skip(1);
    sequences.any(|rest| {
        rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';').starts_with('m')
    })
}

/// Tables and plots fit 60 columns, a pipe gets them whole, and NO_COLOR leaves no escape sequence.
#[cfg(target_os = "linux")]
#[test]
fn sixty_columns_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let piped = crumple_ok(here, "db ls curves.h5");
    assert!(piped.lines().any(|line| line.chars().count() > 60), "{piped}");
    for arguments in ["db ls curves.h5", "db show curves.h5 --group lead-car-wall --case 36kmh"] {
        for columns in [60, 72] {
            let text = on_a_terminal(here, columns, arguments);
            assert!(!has_colour(&text), "{text}");
            // Sentences and paths are as long as they are.
            let is_table = |line: &&str| !line.contains(": ") && !line.starts_with("from ");
            for line in text.lines().filter(is_table) {
                assert!(line.chars().count() <= columns, "{columns}: {line}\n{text}");
            }
        }
    }
    let whole = crumple_ok(here, "db ls curves.h5");
    assert_eq!(on_a_terminal(here, 300, "db ls curves.h5"), whole);
    // Every cell is in the narrow one too.
    let narrow = on_a_terminal(here, 60, "db ls curves.h5");
    for word in whole.split_whitespace() {
        assert!(narrow.contains(word), "{word} is not in\n{narrow}");
    }
    let help = on_a_terminal(here, 60, "");
    says(&help, "The usual order of work");
    assert!(help.lines().all(|line| line.chars().count() <= 60), "{help}");
    fs::write(here.join("study.toml"), STUDY_OF_A_PAIR).unwrap();
    let error = on_a_terminal(here, 60, "build study.toml -o c.h5");
    says(&error, "5 | kind  = \"pair\"\n  |         ^^^^^^\n");
    assert!(!has_colour(&error), "{error:?}");
}
