//! docs/verification.md: numbered cases with their sources, tolerances and what was found, written by
//! the tests that hold them.
//!
//! CRUMPLE_WRITE_DOCS=1 cargo test --locked --release --test all verification -- --include-ignored

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::PathBuf;

use crate::common::{entries, held, root, samples_by_kind, shared};
use crate::{engine, known_solutions};
use crumple::solver::{self, Selection};

/// A case with a closed form: the test that holds it, what it is, and where it comes from.
type Closed = ((&'static str, fn()), &'static str, &'static str);

/// A test and its name.
macro_rules! named {
    ($($path:tt)*) => { (stringify!($($path)*), $($path)* as fn()) };
}

#[rustfmt::skip]
const CLOSED: [Closed; 10] = [
    (named!(known_solutions::case_1_constant_force_against_a_wall), "A constant force stops a body at a wall", "d = m v²/2F, t = m v/F"),
    (named!(known_solutions::case_2_linear_spring_against_a_wall), "A linear spring stops a body at a wall", "d = v √(m/k), t = (π/2) √(m/k), F = v √(m k)"),
    (named!(known_solutions::case_3_two_bodies_with_constant_force), "Two bodies with a constant force between them", "d = μ v²/2F, common velocity m₁ v/(m₁ + m₂)"),
    (named!(known_solutions::case_4_unloading_gives_the_restitution), "Unloading on a line", "e² = (F²/2k)/(μ v²/2)"),
    (named!(known_solutions::case_5_free_chain_of_two_way_springs), "A free chain of springs that push and pull", "v(t) = Σ q cos(ωt) φ, ω = 2 √(k/m) sin(jπ/2N)"),
    (named!(known_solutions::case_6_wall_curve_and_doubled_pair_curve_move_alike), "A body at a wall and one of a pair", "same force, deflection doubled, at twice the speed"),
    (named!(known_solutions::case_7_mass_and_force_scale_together), "Mass and force scaled together", "the motion does not change"),
    (named!(known_solutions::orders_of_convergence_are_two_and_four), "Orders of the two schemes on a spring", "halving the step divides the error by 4, and by 16"),
    (named!(engine::a_damped_spring_follows_its_closed_form), "A spring with a damper", "v = v₀ e^(−ζωt) (cos ω_d t − ζω/ω_d sin ω_d t)"),
    (named!(engine::a_braked_body_slows_down_evenly), "A body that brakes", "v = v₀ − μ g t"),
];

/// A second implementation that must agree: the test, what is compared, with what, and how closely.
#[rustfmt::skip]
const SECOND: [(&str, &str, &str, &str, &str); 13] = [
    ("engine", "verlet_moves_random_chains_as_the_reference_does", "random chains of 1 to 16 bodies", "our own reference method, which integrates exactly piece by piece", "largest speed error 3.5e-4 m/s (1.6e-4 for 9 of 10 chains, median 2.5e-5)"),
    ("clients", "forest_is_as_accurate_as_scikit_learn_on_the_fe_table", "errors of the forest on the FE table", "scikit-learn", "in the test"),
    ("clients", "onnx_runtime_predicts_the_same", "predictions of an exported forest", "ONNX Runtime", "6e-8 of the force"),
    ("clients", "objective_rating_metrics_and_numpy_rate_the_same", "ratings of two signals (ISO/TS 18571)", "objective-rating-metrics, NumPy", "1e-9"),
    ("clients", "pyisomme_rates_the_same", "ratings of two signals", "pyisomme", "1e-9"),
    ("clients", "exudyn_moves_eight_cars_against_eight_alike", "a train of 16 vehicles", "Exudyn", "1e-8 of the initial speed"),
    ("fmu", "the_c_law_is_ours_bit_by_bit", "the C source of the FMU", "the Rust law", "bit by bit"),
    ("fmu", "one_mass_moves_as_in_our_own_runs", "an FMU in a co-simulation", "FMPy", "1e-6 in displacement and speed, 1e-5 in force"),
    ("exports", "calculix_moves_a_mass_as_our_elastic_run", "an exported spring", "CalculiX", "1e-4 in displacement and restitution, 1e-3 in speed"),
    ("exports", "rumoca_moves_a_mass_as_our_run", "an exported Modelica model", "Rumoca", "1e-5 in displacement, 1e-4 in speed, 2e-3 in force, 1e-3 in restitution"),
    ("binout", "lasso_reads_the_same", "values of binouts", "lasso-python", "equal"),
    ("clients", "h5py_reads_what_db_show_prints", "values of databases", "h5py", "equal"),
    ("openradioss", "t01_and_text_of_every_run_agree", "T01 of our own FE runs", "the text files of the same runs", "six digits"),
];

fn hold(made: &str) {
    let path = root().join("docs/verification.md");
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, made).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap();
    assert!(
        there == made,
        "docs/verification.md is not what the tests say; see tests/verification.rs"
    );
}

/// Files below folders whose names end so.
fn found(folders: &[PathBuf], end: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for folder in folders {
        for name in entries(folder) {
            let path = folder.join(&name);
            match path.is_dir() {
                true => files.extend(found(&[path], end)),
                false if name.ends_with(end) => files.push(path),
                false => {}
            }
        }
    }
    files
}

/// Of every kind of solver file: how many real ones are read, and the versions that wrote them.
fn real_files(page: &mut String) {
    let mut kinds: BTreeMap<String, (usize, BTreeSet<String>)> = BTreeMap::new();
    for (kind, files) in samples_by_kind() {
        for path in files.values() {
            let nothing = Selection { audit: false, ..Selection::nothing() };
            let Ok(sections) = solver::read_sections(path, None, &nothing) else { continue };
            let (count, versions) = kinds.entry(kind.clone()).or_default();
            *count += 1;
            for section in sections {
                let version = section.version.or(section.solver);
                versions.extend(
                    version.map(|v| v.split_whitespace().take(3).collect::<Vec<_>>().join(" ")),
                );
            }
        }
    }
    for path in found(&[shared("samples/openradioss"), shared("fe")], "T01") {
        let nothing = Selection { audit: false, ..Selection::nothing() };
        let Ok(sections) = solver::read_sections(&path, None, &nothing) else { continue };
        let (count, versions) = kinds.entry("t01".into()).or_default();
        *count += 1;
        // A T01 gives weekday, date and time of its run, the program and the platform.
        for version in sections.into_iter().filter_map(|section| section.version) {
            let words: Vec<&str> = version.split_whitespace().skip(6).collect();
            versions.insert(words.join(" ").replace(",", ""));
        }
    }
    for format in solver::formats() {
        kinds.entry(format.to_string()).or_default();
    }
    for (kind, (count, versions)) in kinds {
        let versions: Vec<String> = versions.into_iter().collect();
        let versions = match (count, versions.is_empty()) {
            (0, _) => "**no real file has validated it**".into(),
            (_, true) => "the files do not say".into(),
            _ => versions.join(", "),
        };
        writeln!(page, "| {kind} | {count} | {versions} |").unwrap();
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn the_page_says_what_the_tests_find() {
    let mut page = String::from(
        "# Verification\n\nNumbered cases, each checked by the test named. Deviations are given relative to the tolerance, rounded up; \
         above 1 the test fails.\n\n## Closed forms\n\nTolerances are half a unit of the last printed digit (7 to 8 digits), and \
         1e-9 m/s and m for the reference method.\n\n| no. | case | source | values compared | largest deviation / tolerance | test |\n|---|---|---|---|---|---|\n",
    );
    for (k, ((name, test), case, source)) in CLOSED.into_iter().enumerate() {
        held();
        test();
        let found = held();
        assert!(!found.is_empty(), "{case} compares nothing");
        let worst = found.iter().copied().fold(0.0_f64, f64::max);
        writeln!(
            page,
            "| {} | {case} | {source} | {} | {:.1} | `{name}` |",
            k + 1,
            found.len(),
            (worst * 10.0).ceil() / 10.0
        )
        .unwrap();
    }
    page += "\n## Second implementations\n\n| no. | what | against | tolerance | test |\n|---|---|---|---|---|\n";
    for (k, (file, test, what, against, tolerance)) in SECOND.into_iter().enumerate() {
        let source = std::fs::read_to_string(root().join(format!("tests/{file}.rs"))).unwrap();
        assert!(source.contains(&format!("fn {test}(")), "tests/{file}.rs has no {test}");
        // A tolerance is one that the file's tests have.
        for number in tolerance.split([' ', '(', ')', ',']).filter(|word| word.contains("e-")) {
            assert!(source.contains(number), "{test} does not have {number}");
        }
        let no = CLOSED.len() + k + 1;
        writeln!(page, "| {no} | {what} | {against} | {tolerance} | `{file}::{test}` |").unwrap();
    }
    page += "\n## Real files\n\nFiles of public projects and of our own runs, read without problems or with the problem that their project \
             reports; `fixtures/samples` contains those whose licence permits redistribution.\n\n| kind | files | written by |\n|---|---|---|\n";
    real_files(&mut page);
    page += "\n## Not detectable\n\nA force that is recorded up to about 5 ms late or 8 ms early (earlier still with fewer than two other runs of the \
             design); force, mass and speed that are wrong \
             together; one design that replaces another at a single speed and has the same title, level and order of peaks.\n";
    hold(&page);
}
