//! The commands of README.md and docs/ do what the text says, and the tables there are what they
//! print, byte for byte.
//!
//! A fenced block `sh` holds commands; a block `console` holds commands behind `$ ` and all that each
//! prints on standard output. A document's commands run one after the other in the demo's folder.
//! To write the outputs into the documents again (and look at the difference before it is committed):
//! CRUMPLE_WRITE_DOCS=1 cargo test --locked --release --test all readme

use std::path::Path;
use std::process::Command;

use crate::common::{demo, root};

/// Every document with commands: a test for each, so that they run side by side.
macro_rules! documents {
    ($($name:ident: $path:literal;)*) => {
        const DOCUMENTS: &[&str] = &[$($path),*];
        $(
            #[test]
            fn $name() {
                holds($path);
            }
        )*
    };
}

documents! {
    the_readme_holds: "README.md";
    from_runs_to_train_holds: "docs/from-runs-to-train.md";
    the_tour_holds: "docs/tour.md";
    the_reference_holds: "docs/reference.md";
    init_holds: "docs/init.md";
    scenarios_hold: "docs/scenario.md";
    the_command_line_holds: "docs/command-line.md";
    error_codes_hold: "docs/error-codes.md";
    results_hold: "docs/results.md";
    multi_body_holds: "docs/multi-body.md";
    formats_and_damage_hold: "docs/formats-and-damage.md";
    forest_holds: "docs/forest.md";
    sweeps_hold: "docs/sweeps.md";
    scale_holds: "docs/scale.md";
    databases_hold: "docs/databases.md";
    verification_holds: "docs/verification.md";
    feeding_holds: "docs/feeding/README.md";
    feeding_lsdyna_holds: "docs/feeding/lsdyna.md";
    feeding_radioss_holds: "docs/feeding/radioss.md";
    feeding_calculix_holds: "docs/feeding/calculix.md";
    feeding_adams_holds: "docs/feeding/adams.md";
    feeding_fmi_holds: "docs/feeding/fmi.md";
    feeding_modelica_holds: "docs/feeding/modelica.md";
    feeding_matlab_holds: "docs/feeding/matlab.md";
    feeding_iso_mme_holds: "docs/feeding/iso-mme.md";
    feeding_two_variables_holds: "docs/feeding/two-variables.md";
    feeding_other_tools_holds: "docs/feeding/other-tools.md";
    feeding_importing_holds: "docs/feeding/importing.md";
}

/// Runs all commands of a document and compares it with what they print.
fn holds(name: &str) {
    let path = root().join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().join("crumple-demo");
    demo().copy_to(&here);
    let printed = with_outputs(&text, &here);
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, &printed).unwrap();
        return;
    }
    for (number, (said, expected)) in text.lines().zip(printed.lines()).enumerate() {
        assert_eq!(
            said,
            expected,
            "{name}, line {}: the command prints something else",
            number + 1
        );
    }
    assert!(text == printed, "{name} is longer or shorter than what its commands print");
}

/// The text with what its commands really print.
fn with_outputs(text: &str, here: &Path) -> String {
    let mut out = String::new();
    let mut block = None;
    for line in text.split_inclusive('\n') {
        match (block, line.trim_end()) {
            (None, fence) if fence.starts_with("```") => block = Some(&fence[3..]),
            (Some(_), "```") => block = None,
            (Some("sh"), command) => {
                run(command, here);
            }
            (Some("console"), command) => {
                // What is there as output is replaced by what is printed.
                let Some(command) = command.strip_prefix("$ ") else { continue };
                out += line;
                out += &run(command, here);
                continue;
            }
            _ => {}
        }
        out += line;
    }
    out
}

/// Standard output of one line of a document.
pub fn run(line: &str, here: &Path) -> String {
    match line.split_whitespace().next() {
        None | Some("#") => return String::new(),
        Some("crumple" | "sed") => {}
        // CI runs the two commands of a fresh clone; what the demo writes is already here.
        _ if ["cargo run --release -- demo", "tests/run", "cd crumple-demo"].contains(&line) => {
            return String::new();
        }
        _ => panic!("nothing runs this line: {line}"),
    }
    if line == "crumple demo" {
        return demo().printed.clone();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_crumple")).parent().unwrap();
    let mut path = vec![program.to_path_buf()];
    path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap()));
    let output = Command::new("bash")
        .args(["-o", "pipefail", "-c", line])
        .env("PATH", std::env::join_paths(path).unwrap())
        .current_dir(here)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}\n{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// The Python package's tests execute the notebook.
#[test]
fn every_document_is_held() {
    let mut folders = vec!["docs".to_string()];
    while let Some(folder) = folders.pop() {
        for name in crate::common::entries(&root().join(&folder)) {
            let name = format!("{folder}/{name}");
            if root().join(&name).is_dir() {
                folders.push(name);
            } else if ![".svg", ".png", ".ipynb"].iter().any(|end| name.ends_with(end)) {
                assert!(
                    DOCUMENTS.contains(&name.as_str()),
                    "{name} is not in the list of this file"
                );
            }
        }
    }
}

/// Each page on feeding a tool has a command that is run, and each picture is shown.
#[test]
fn pages_on_feeding_have_commands_and_pictures() {
    let pages = DOCUMENTS.iter().filter(|name| name.starts_with("docs/feeding/"));
    let texts: Vec<String> =
        pages.map(|name| std::fs::read_to_string(root().join(name)).unwrap()).collect();
    assert!(texts.iter().all(|text| text.contains("```sh\ncrumple ")));
    for name in crate::common::entries(&root().join("docs/feeding")) {
        let is_shown = texts.iter().any(|text| text.contains(&format!("]({name})")));
        assert!(is_shown || name == "README.md", "no page shows or names {name}");
    }
}

/// Files and headings that the documents link to are there.
#[test]
fn links_lead_somewhere() {
    let others = ["CONTRIBUTING.md", "ARCHITECTURE.md"];
    for name in DOCUMENTS.iter().chain(&others) {
        let path = root().join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        for link in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
            if link.starts_with("http") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target =
                if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(target.exists(), "{name} links to {link}");
            if !heading.is_empty() {
                let text = std::fs::read_to_string(&target).unwrap();
                let is_there =
                    text.lines().filter(|l| l.starts_with('#')).any(|l| anchor(l) == heading);
                assert!(is_there, "{name} links to {link}");
            }
        }
    }
}

/// A heading's anchor: small letters, hyphens for spaces, no other signs.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
    text.chars().filter(|c| c.is_alphanumeric() || *c == '-').collect()
}

#[test]
fn the_readme_has_at_most_900_words() {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let words = text.split_whitespace().filter(|w| w.contains(char::is_alphanumeric)).count();
    assert!(words <= 900, "{words} words; the rest belongs into docs/");
}
