//! The fuzz targets on mutated seeds; the search that is guided by coverage is tests/fuzz/run.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::common::{is_thorough, root};

#[path = "fuzz/targets.rs"]
mod targets;

/// Flips a bit, sets a byte, zeroes, repeats or drops a range, or cuts, one to four times.
fn mutated(seed: &[u8], random: &mut impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=random(4) {
        let from = random(bytes.len() + 1);
        let to = (from + random(64)).min(bytes.len());
        let range = bytes[from..to].to_vec();
        match random(6) {
            0 if from < bytes.len() => bytes[from] ^= 1 << random(8),
            1 if from < bytes.len() => bytes[from] = b"\0\n -.0129*E="[random(12)],
            2 => bytes[from..to].fill(0),
            3 => drop(bytes.splice(from..from, range)),
            4 => drop(bytes.drain(from..to)),
            _ if random(8) == 0 => bytes.truncate(from),
            _ => {}
        }
    }
    bytes
}

fn keep(name: &str, bytes: &[u8]) -> String {
    let kept = root().join("target").join(format!("{name}-finding"));
    fs::write(&kept, bytes).unwrap();
    kept.display().to_string()
}

#[test]
fn mutated_seeds_give_results_or_errors() {
    let folder = tempfile::tempdir().unwrap();
    let script = root().join("tests/fuzz/make_corpus.py");
    assert!(Command::new("python3").arg(script).arg(folder.path()).status().unwrap().success());
    let mutations = if is_thorough() { 50_000 } else { 1_000 };
    // An input that takes longer ends the tests: nothing else can.
    let (began, watched) = channel::<Option<(&str, Vec<u8>)>>();
    let watch = std::thread::spawn(move || {
        let mut current = None;
        loop {
            match (watched.recv_timeout(Duration::from_secs(20)), &current) {
                (Ok(next), _) => current = next,
                (Err(RecvTimeoutError::Timeout), Some((name, bytes))) => {
                    eprintln!("{name}: an input takes longer than 20 s: {}", keep(name, bytes));
                    std::process::exit(1);
                }
                (Err(RecvTimeoutError::Timeout), None) => {}
                (Err(RecvTimeoutError::Disconnected), _) => break,
            }
        }
    });
    let mut state = 7u64;
    let mut random = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for name in targets::names() {
        let target = targets::target(name).unwrap();
        let mut seeds: Vec<_> = fs::read_dir(folder.path().join(name))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        assert!(!seeds.is_empty(), "{name} has no seeds: see make_corpus.py");
        seeds.sort();
        for seed in seeds {
            let valid = fs::read(&seed).unwrap();
            for number in 0..mutations {
                let bytes = if number == 0 { valid.clone() } else { mutated(&valid, &mut random) };
                began.send(Some((name, bytes.clone()))).unwrap();
                if catch_unwind(AssertUnwindSafe(|| target(&bytes))).is_err() {
                    panic!("{name}: mutation {number} of its {seed:?}: {}", keep(name, &bytes));
                }
            }
        }
    }
    drop(began);
    watch.join().unwrap();
    fs::remove_dir_all(targets::folder()).unwrap();
}
