//! Every example is run as a user would.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{fixture, root, says};

/// The example's program; cargo builds all examples before it runs the tests.
fn example(name: &str, arguments: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_crumple")).parent().unwrap().join("examples");
    let program: PathBuf = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(&program)
        .args(arguments)
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}; run cargo test without --test", program.display()));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn read_histories() {
    let path = fixture("fe/lead-car-wall/25kmh/nodout");
    let text = example("read_histories", &[path.to_str().unwrap(), "900001", "x_velocity"]);
    assert_eq!(text.lines().count(), 400);
    assert_eq!(text.lines().next(), Some("0.0 -6944.44"));
}

#[test]
fn cross_validation() {
    let text = example("cross_validation", &[]);
    let r2: Vec<f64> = text
        .lines()
        .map(|l| l.split("R² ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap())
        .collect();
    assert_eq!(r2.len(), 5);
    assert!(r2[3] > r2[0] && r2[3] > 0.95, "{text}");
    assert!((r2[4] - r2[3]).abs() < 0.02, "out-of-bag agrees with cross-validation: {text}");
}

/// What no feature tells is uniform, with the second feature as its width: at 0.9, 90 % lie
/// between 0.495 and 1.305, and its root mean square is 1/6.
#[test]
fn forest() {
    let text = example("forest", &[]);
    let lines: Vec<&str> = text.lines().collect();
    let numbers = |line: usize| -> Vec<f64> {
        lines[line].split([' ', ',', '[', ']', ':']).filter_map(|w| w.parse().ok()).collect()
    };
    let [.., predicted, _, low, high] = numbers(1)[..] else { panic!("{text}") };
    for (found, expected) in [(predicted, 0.9), (low, 0.495), (high, 1.305)] {
        assert!((found - expected).abs() < 0.08, "{text}");
    }
    let importance = numbers(3);
    assert!(importance[0] > 0.9 && importance[2] < 0.01, "{text}");
    assert!((numbers(4)[0] * 6.0 - 1.0).abs() < 0.05, "{text}");
}

/// A forest of unpruned trees explains most of Friedman's function, and only its five features.
#[test]
fn linfa_forest() {
    let text = example("linfa_forest", &[]);
    let numbers = |line: usize| -> Vec<f64> {
        let words = text.lines().nth(line).unwrap().split([' ', ',', '[', ']']);
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let (unseen, out_of_bag, importance) = (numbers(0)[0], numbers(1)[0], numbers(2));
    assert!(unseen > 0.9 && (unseen - out_of_bag).abs() < 0.03, "{text}");
    assert!(importance[..5].iter().all(|share| *share > 0.04), "{text}");
    assert!(importance.len() == 10 && importance[5..].iter().all(|share| *share < 0.03), "{text}");
}

#[test]
fn wall_impact() {
    let text = example("wall_impact", &[]);
    // Kinetic energy 2.3148 MJ: 0.15 up to the peak, 0.48 down to 0.3 m, and 1.6848 on the
    // rising line 1.8 + 0.5 (d − 0.3) MN: crush 0.3 + (sqrt(1.8² + 1.6848) − 1.8)/0.5.
    says(&text, "peak force 3.000 MN");
    says(&text, "max crush  1.1384 m");
}

/// The README's picture is what the example draws.
#[test]
fn picture() {
    let committed = std::fs::read_to_string(root().join("examples/picture.svg")).unwrap();
    assert!(
        example("picture", &[]) == committed,
        "draw it again: cargo run --example picture > examples/picture.svg"
    );
}

/// The README's other picture as well.
#[test]
fn train_set() {
    let committed = std::fs::read_to_string(root().join("examples/train_set.svg")).unwrap();
    assert!(
        example("train_set", &[]) == committed,
        "draw it again: cargo run --example train_set > examples/train_set.svg"
    );
}

/// The pictures of docs/feeding are what the example draws; each is small.
#[test]
fn feeding_pictures() {
    let folder = tempfile::tempdir().unwrap();
    example("feeding_pictures", &[folder.path().to_str().unwrap()]);
    let there = root().join("docs/feeding");
    let mut committed = crate::common::entries(&there);
    committed.retain(|name| name.ends_with(".svg"));
    assert_eq!(committed, crate::common::entries(folder.path()));
    for name in committed {
        let drawn = std::fs::read(folder.path().join(&name)).unwrap();
        assert!(
            drawn == std::fs::read(there.join(&name)).unwrap(),
            "{name}: draw it again: cargo run --release --example feeding_pictures docs/feeding"
        );
        // Half of it are the outlines of letters.
        assert!(drawn.len() < 35_000, "{name} has {} bytes", drawn.len());
    }
}

#[test]
fn every_example_is_run_here() {
    let here = std::fs::read_to_string(root().join("tests/examples.rs")).unwrap();
    for entry in root().join("examples").read_dir().unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "rs") {
            let name = path.file_stem().unwrap().to_str().unwrap().to_string();
            assert!(here.contains(&format!("example(\"{name}\"")), "{name} is not run");
        }
    }
}
