//! House rules that the compiler does not know: layering, schemas, what a file says first,
//! what a repository must not carry.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{entries, root};

/// Which module may name which others. One way only: a change here is a change of
/// architecture and belongs into ARCHITECTURE.md.
#[rustfmt::skip]
const MAY_NAME: [(&str, &str); 40] = [
    ("words", ""),
    ("parallel", ""),
    ("order", ""),
    ("table", ""),
    ("guess", ""),
    ("error", "guess"),
    ("unit", "guess"),
    ("clock", ""),
    ("os", ""),
    ("history", ""),
    ("piecewise", ""),
    ("plot", "words"),
    ("signal", "piecewise"),
    ("file", "os"),
    ("hdf5", "file os"),
    ("manifest", "guess file"),
    ("stream", ""),
    ("forest", "stream"),
    ("solver", "guess words signal history file os unit parallel order"),
    ("curve", "words signal piecewise history unit parallel order"),
    ("rating", "guess words curve signal history order"),
    ("study", "guess curve solver history manifest file unit"),
    ("history_hdf5", "solver history hdf5 file os unit"),
    ("dataset", "curve unit parallel order"),
    ("database", "guess dataset curve signal history hdf5 file unit parallel order"),
    ("build", "guess study database curve manifest file clock parallel"),
    ("curate", "guess dataset database curve signal file unit"),
    ("surrogate", "guess words dataset forest curve signal piecewise file unit order"),
    ("multibody", "curve piecewise unit"),
    ("nsdm", "curve signal piecewise stream parallel order"),
    ("formats", "guess words multibody surrogate dataset forest curve signal hdf5 file unit order"),
    ("import", "formats database curve history file unit clock"),
    ("plan", "stream unit"),
    ("scenario", "guess plan multibody surrogate formats database curve signal manifest unit order"),
    ("sweep", "guess scenario plan multibody hdf5 stream manifest file unit parallel order"),
    ("init", "guess scenario surrogate study solver curve signal history file unit parallel order"),
    ("assess", "guess words manifest scenario nsdm rating multibody surrogate dataset database solver curve signal history file unit parallel order"),
    ("charts", "guess words rating plan sweep scenario assess multibody surrogate dataset curve signal history plot unit order"),
    ("report", "words table rating charts assess scenario multibody surrogate dataset database curve plot unit order"),
    ("failure", "report charts sweep assess scenario import init curate nsdm formats multibody surrogate dataset build study database history_hdf5 rating solver manifest plot file"),
];

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The module a file of src/ belongs to.
fn module(path: &Path) -> String {
    let relative = path.strip_prefix(root().join("src")).unwrap();
    let first = relative.components().next().unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").to_string()
}

#[test]
fn layers_name_only_what_is_below() {
    let rules = BTreeMap::from(MAY_NAME);
    for path in files(&root().join("src"), "rs") {
        let this = module(&path);
        let text = fs::read_to_string(&path).unwrap();
        // The command line is above all rooms.
        if ["lib", "main", "cli"].contains(&this.as_str()) {
            continue;
        }
        let allowed = rules.get(this.as_str()).unwrap_or_else(|| panic!("{this} has no rule"));
        for (at, _) in text.match_indices("crate::") {
            let named: String = text[at + 7..]
                .chars()
                .take_while(|c| c.is_ascii_alphanumeric() || *c == '_')
                .collect();
            // Every room makes errors.
            let is_allowed = ["error", &this].contains(&&*named)
                || allowed.split(' ').any(|module| module == named);
            assert!(is_allowed, "{} names {named}, which is not below it", path.display());
        }
    }
}

#[test]
fn rules_are_one_way() {
    let position = |name: &str| MAY_NAME.iter().position(|(m, _)| *m == name);
    for (k, (module, below)) in MAY_NAME.iter().enumerate() {
        for name in below.split_whitespace() {
            assert!(position(name).unwrap() < k, "{module} and {name} could form a circle");
        }
    }
}

/// Operating systems differ in one file; tests may be of one of them.
#[test]
fn one_file_knows_operating_systems() {
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let knows = ["cfg(unix", "cfg(windows", "cfg(not(unix", "target_os", "std::os::"];
        let knows = knows.iter().find(|word| code.contains(**word));
        assert!(knows.is_none() || module(&path) == "os", "{} has {knows:?}", path.display());
    }
}

#[test]
fn only_one_room_names_the_hdf5_library() {
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains("hdf5_pure") || module(&path) == "hdf5", "{}", path.display());
    }
}

#[test]
fn the_library_never_prints_and_holds_one_unsafe_block() {
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        // The memory map, which a user asks for: its reason is there.
        let allowed = usize::from(path.ends_with("src/solver/source.rs"));
        assert_eq!(text.matches("unsafe {").count(), allowed, "{}", path.display());
        if module(&path) != "cli" {
            for macro_name in ["print!(", "println!(", "eprint!(", "eprintln!(", "dbg!("] {
                assert!(!text.contains(macro_name), "{} has {macro_name}", path.display());
            }
        }
    }
}

/// What takes control characters out of everything that is printed must be passed.
#[test]
fn only_the_output_prints() {
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        for printing in
            ["print!(", "println!(", "eprint!(", "eprintln!(", "stdout().lock", "stderr().lock"]
        {
            let allowed = path.ends_with("src/cli/output.rs");
            assert!(allowed || !text.contains(printing), "{} has {printing}", path.display());
        }
    }
}

/// A path may name a pipe, a device or a terabyte: `file` asks first.
#[test]
fn files_are_opened_where_their_kind_is_asked() {
    // These have asked themselves, or open what this program has made.
    let allowed = [
        "src/file/mod.rs",
        "src/file/write.rs",
        "src/solver/source.rs",
        "src/solver/decks.rs",
        "src/sweep/journal.rs",
        "src/cli/sweep.rs",
    ];
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let relative = path.strip_prefix(root()).unwrap();
        for call in ["File::open(", "fs::read(", "fs::read_to_string(", "OpenOptions::new("] {
            assert!(
                allowed.iter().any(|a| relative == Path::new(a)) || !code.contains(call),
                "{} has {call}",
                path.display()
            );
        }
    }
}

/// What a user's file can reach must not panic: outside tests there is no unwrap, and an expect
/// only where it says why it holds.
#[test]
fn no_unwrap_outside_tests() {
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let code: String = code
            .lines()
            .filter(|l| !l.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n");
        for call in [".unwrap()", "panic!(", "unreachable!(", "todo!(", "unimplemented!("] {
            assert!(!code.contains(call), "{} has {call}", path.display());
        }
        for (at, call) in code.match_indices(".expect(") {
            let reason = code[at + call.len()..].trim_start().strip_prefix('"');
            let words =
                reason.and_then(|r| r.split('"').next()).map_or(0, |r| r.split(' ').count());
            assert!(words >= 3, "{} has an expect without a reason", path.display());
        }
    }
}

/// Results are the same bits on every platform: these functions of the standard library are those of the C library,
/// and differ in their last digits; libm's do not.
#[test]
fn functions_are_the_same_on_every_platform() {
    let functions = [
        "powf", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "sin", "cos",
        "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh",
        "acosh", "atanh", "cbrt", "hypot",
    ];
    for path in files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for name in functions {
                let calls = [format!(".{name}("), format!("f64::{name}"), format!("f32::{name}")];
                let is_called = calls.iter().any(|call| line.contains(call.as_str()));
                assert!(!is_called, "{}: {line}: take libm's {name}", path.display());
            }
        }
    }
}

/// What src/ may hold. Growth is a decision: the commit that raises a number says why.
const BUDGET: [(&str, usize); 4] =
    [("lines", 89128), ("files", 303), ("public types", 164), ("error types", 9)];

#[test]
fn the_source_keeps_its_budget() {
    let (mut lines, mut files, mut public, mut errors) = (0, 0, 0, 0);
    for path in self::files(&root().join("src"), "rs") {
        let text = fs::read_to_string(&path).unwrap();
        files += 1;
        for line in text.lines() {
            lines += 1;
            let types = ["pub struct ", "pub enum ", "pub trait ", "pub type ", "pub union "];
            public += usize::from(types.iter().any(|t| line.starts_with(t)));
            errors +=
                usize::from(line.starts_with("#[derive") && line.contains("thiserror::Error"));
        }
    }
    for ((what, most), found) in BUDGET.into_iter().zip([lines, files, public, errors]) {
        assert!(
            found <= most,
            "src/ holds {found} {what}, its budget is {most}: shrink it, or raise BUDGET and say why in the commit"
        );
        // A budget far above what is there holds nothing.
        assert!(
            found + most / 50 + 2 >= most,
            "src/ holds {found} {what}: lower BUDGET from {most}"
        );
    }
}

#[test]
fn every_source_file_says_first_what_it_is_for() {
    for folder in ["src", "tests", "examples", "benches"] {
        for path in files(&root().join(folder), "rs") {
            let text = fs::read_to_string(&path).unwrap();
            assert!(text.starts_with("//! "), "{}", path.display());
        }
    }
}

/// Where the real files are absent, `tests/run` finds the tests that need the clients by name.
#[test]
fn tests_that_need_clients_are_found_by_name() {
    for path in files(&root().join("tests"), "rs") {
        let module = path.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        for behind in text.split("#[ignore = \"needs the Python clients").skip(1) {
            let name = behind.split("fn ").nth(1).unwrap().split('(').next().unwrap();
            let is_found = ["clients", "documents", "exports", "fmu", "mdf"].contains(&module)
                || ["h5py", "dask"].iter().any(|word| name.contains(word));
            assert!(is_found, "{module}::{name} needs h5py or dask in its name");
        }
    }
}

#[test]
fn dependencies_have_fixed_minor_versions() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    for table in ["dependencies", "dev-dependencies"] {
        let all = manifest[table].as_table().unwrap().iter();
        for (name, entry) in all.filter(|(_, entry)| entry.get("path").is_none()) {
            let version = entry.as_str().or_else(|| entry.get("version")?.as_str()).unwrap();
            assert!(version.matches('.').count() >= 1, "{name} = {version}");
        }
    }
}

/// The licence stands where people and programs look for it, and in every source that users get with
/// an export or a report.
#[test]
fn the_licence_is_stated() {
    let licence = "MIT OR Apache-2.0";
    let read = |path: &str| fs::read_to_string(root().join(path)).unwrap();
    let manifest: toml::Table = read("Cargo.toml").parse().unwrap();
    let package = |key: &str| manifest["package"][key].as_str().unwrap();
    assert_eq!(package("license"), licence);
    assert!(read("LICENSE-MIT").contains("Copyright (c) 2026 The crumple authors"));
    assert!(read("LICENSE-APACHE").contains("Version 2.0, January 2004"));
    let citation = read("CITATION.cff");
    for line in ["version: ".to_string() + package("version"), "  - MIT\n  - Apache-2.0".into()] {
        assert!(citation.contains(&format!("\n{line}\n")), "CITATION.cff has no {line}");
    }
    let c = root().join("src/formats/fmu/c");
    let mut handed_out = [files(&c, "c"), files(&c, "h")].concat();
    assert!(handed_out.len() > 10);
    handed_out
        .extend(["src/formats/modelica/spring.mo", "src/report/page.js"].map(|p| root().join(p)));
    for path in handed_out {
        let text = fs::read_to_string(&path).unwrap();
        let is_said = text.contains(&format!("SPDX-License-Identifier: {licence}"));
        assert!(is_said, "{} does not say its licence", path.display());
    }
}

/// Files of others have their source and their licence beside them.
#[test]
fn samples_have_source_and_licence() {
    let folder = root().join("fixtures/samples");
    let sources = fs::read_to_string(folder.join("SOURCES.md")).unwrap();
    for project in entries(&folder).into_iter().filter(|name| name != "SOURCES.md") {
        assert!(sources.contains(&format!("\n| {project} | https://")), "{project} has no source");
        let project_folder = folder.join(&project);
        assert!(project_folder.join("LICENSE").is_file(), "{project} has no licence");
        for kind in entries(&project_folder).into_iter().filter(|name| name != "LICENSE") {
            for name in entries(&project_folder.join(&kind)) {
                let file = format!("{project}/{kind}/{name}");
                assert!(sources.contains(&format!("\n| {file} |")), "{file} has no source");
            }
        }
    }
    assert!(fs::read_to_string(root().join("src/plot/font/LICENSE")).unwrap().contains("DejaVu"));
}

/// The fuzzer takes the dependencies of the program's own build, which one profile alone allows.
#[test]
fn the_fuzzer_is_built_on_the_same_profile() {
    let profile = |path: &str| {
        let text = fs::read_to_string(root().join(path)).unwrap();
        let file: toml::Table = text.parse().unwrap();
        let mut release = file["profile"]["release"].as_table().unwrap().clone();
        release.remove("package");
        release
    };
    assert_eq!(profile("Cargo.toml"), profile("tests/fuzz/Cargo.toml"));
}

/// The layout's description names every attribute and dataset that is written.
#[test]
fn the_database_layout_is_described() {
    let described = fs::read_to_string(root().join("schemas/curve_database.md")).unwrap();
    let code = fs::read_to_string(root().join("src/database/layout.rs")).unwrap();
    let mut names = Vec::new();
    for call in ["attr(\"", ".dataset(\"", "put(\""] {
        names.extend(code.match_indices(call).map(|(at, _)| {
            let rest = &code[at + call.len()..];
            &rest[..rest.find('"').unwrap()]
        }));
    }
    names.extend(["format", "layout_version", "written_by", "cases", "original"]);
    assert!(names.len() > 25);
    for name in names {
        assert!(described.contains(&format!("`{name}`")), "{name} is not described");
    }
}
