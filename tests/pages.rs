//! Pages that are made: the command line from `--help`, exit codes and error codes from the types.
//!
//! CRUMPLE_WRITE_DOCS=1 cargo test --locked --release --test all pages

use std::fmt::Write;

use crate::common::{crumple_ok, root};
use crumple::failure::EXIT_CODES;
use serde_json::Value;

fn hold(name: &str, made: &str) {
    let path = root().join("docs").join(name);
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, made).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap();
    assert!(there == made, "docs/{name} is not what the program says; see tests/pages.rs");
}

/// The names below `Commands:` of a help text.
fn subcommands(help: &str) -> Vec<String> {
    let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = below.take_while(|line| !line.is_empty()).filter_map(|line| {
        let name = line.strip_prefix("  ").filter(|l| !l.starts_with(' '))?.split(' ').next()?;
        (name != "help").then(|| name.to_string())
    });
    names.collect()
}

fn describe(page: &mut String, command: &[String]) {
    let arguments: Vec<&str> = command.iter().map(String::as_str).chain(["--help"]).collect();
    let help = crumple_ok(root(), &arguments);
    let name = [&["crumple".to_string()], command].concat().join(" ");
    writeln!(
        page,
        "\n{} {name}\n\n```text\n{}\n```",
        "#".repeat(2 + command.len().min(2)),
        help.trim_end()
    )
    .unwrap();
    for inner in subcommands(&help) {
        describe(page, &[command, &[inner]].concat());
    }
}

#[test]
fn the_command_line_is_described() {
    let mut page = String::from(
        "# Command line\n\nThe output of `crumple COMMAND --help` for every command.\n",
    );
    describe(&mut page, &[]);
    assert!(
        page.matches("\n### crumple ").count() >= 18 && page.contains("\n#### crumple db copy\n")
    );
    hold("command-line.md", &page);
}

#[test]
fn exit_codes_and_error_codes_are_described() {
    let mut page = String::from(
        "# Exit codes and error codes\n\nScripts can rely on both: codes never change their meaning.\n\n| exit code | meaning |\n|---|---|\n",
    );
    for (code, meaning) in EXIT_CODES {
        writeln!(page, "| {code} | {meaning} |").unwrap();
    }
    page += "\nWith `--json` an error is a document on standard output ([its schema](../schemas/error.schema.json)): its code, the\nmessage, the causes that the message does not contain, and the file, line and column where they are known.\n\n| error code | meaning |\n|---|---|\n";
    let schema = std::fs::read_to_string(root().join("schemas/error.schema.json")).unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    for code in schema["$defs"]["ErrorCode"]["oneOf"].as_array().unwrap() {
        let (name, meaning) =
            (code["const"].as_str().unwrap(), code["description"].as_str().unwrap());
        writeln!(page, "| `{name}` | {} |", meaning.replace('\n', " ")).unwrap();
    }
    hold("error-codes.md", &page);
}
