//! Cut and damaged files: complete states are returned, what is missing is named, nothing panics.

use crate::common::{fixture, is_thorough, samples, samples_by_kind, says};
use crumple::solver::{ProblemCode, Selection, SolverFile, formats, read_from};
use proptest::prelude::*;

fn read(format: &str, bytes: &[u8]) -> SolverFile {
    read_from(format, &[Box::new(bytes.to_vec())], &Selection::all()).unwrap().remove(0)
}

/// Byte offsets at which the states of a nodout begin: its state lines, one per state.
fn state_starts(text: &[u8]) -> Vec<usize> {
    let mut starts: Vec<usize> = Vec::new();
    let mut last: &[u8] = b"";
    let mut at = 0;
    for line in text.split_inclusive(|&b| b == b'\n') {
        if line.starts_with(b" n o d a l") {
            if line != last {
                starts.push(at);
            }
            last = line;
        }
        at += line.len();
    }
    starts
}

/// End of the last line of each state's rows: from there on the state is complete.
fn state_ends(text: &[u8], starts: &[usize]) -> Vec<usize> {
    let next = starts.iter().skip(1).copied().chain([text.len()]);
    let last_row = next.map(|end| text[..end].trim_ascii_end().len());
    last_row.map(|end| end + text[end..].iter().position(|&b| b == b'\n').unwrap() + 1).collect()
}

/// Cuts a nodout at every byte of its last two states.
fn cut_everywhere(name: &str, text: &[u8]) {
    cut_each(1, name, text);
}

/// Cut at every `step`-th byte of the last two states.
fn cut_each(step: usize, name: &str, text: &[u8]) {
    let whole = read("nodout", text);
    assert_eq!(whole.problems, [], "{name}");
    let states = whole.time.len();
    let starts = state_starts(text);
    let ends = state_ends(text, &starts);
    assert_eq!(starts.len(), states, "{name}");
    for cut in (starts[states - 2]..text.len()).step_by(step) {
        let file = read("nodout", &text[..cut]);
        let complete = ends.iter().filter(|&&end| end <= cut).count();
        assert_eq!(file.time.len(), complete, "{name} cut at byte {cut}");
        for (cut_history, history) in file.histories.iter().zip(&whole.histories) {
            assert_eq!(cut_history.values, history.values[..complete], "{name} cut at {cut}");
        }
        // Bytes of a state that is not whole need a problem; blank lines between do not.
        let partial = text[ends[complete - 1]..cut].iter().any(|b| !b.is_ascii_whitespace());
        assert_eq!(!file.problems.is_empty(), partial, "{name} cut at {cut}: {:?}", file.problems);
        if partial {
            let named = file.problems.iter().any(|p| p.code == ProblemCode::IncompleteState);
            assert!(named, "{name} cut at {cut}: {:?}", file.problems);
        }
    }
}

#[test]
fn our_nodout_cut_at_every_byte_of_its_last_two_states() {
    let text = std::fs::read(fixture("fe/lead-car-pair/36kmh/nodout")).unwrap();
    // The last of 400 states behave like the last of 5, in a hundredth of the time.
    let fifth = state_starts(&text)[5];
    cut_everywhere("lead-car-pair/36kmh", &text[..fifth]);
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn rotations_and_touching_fields_cut() {
    let files = samples("nodout");
    // Rows and fields are longer: a prime meets each of their columns in turn.
    let step = if is_thorough() { 1 } else { 5 };
    for path in files {
        let text = std::fs::read(&path).unwrap();
        let starts = state_starts(&text);
        let states = starts.len().min(4);
        if !(2..=4).contains(&states) || text.len() / starts.len() > 20_000 {
            continue; // header only, one state, or too long for every byte
        }
        let end = starts.get(states).copied().unwrap_or(text.len());
        cut_each(step, &path.display().to_string(), &text[..end]);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn a_missing_rotational_block_is_named() {
    let files = samples("nodout");
    let path = files.iter().find(|p| p.display().to_string().contains("rot_legend")).unwrap();
    let text = std::fs::read(path).unwrap();
    let starts = state_starts(&text);
    // The third state without its rotational block: its second state line and all below.
    let third = &text[starts[2]..starts[3]];
    let second_line = third[10..].windows(10).position(|w| w == b" n o d a l").unwrap() + 10;
    let file = read("nodout", &text[..starts[2] + second_line]);
    assert_eq!(file.time.len(), 2);
    says(&file.problems[0].to_string(), "2 of 2 rotational rows are missing, the first of 1100002");
}

#[test]
fn the_other_formats_cut_at_every_byte_of_their_end() {
    let mut samples = samples_by_kind();
    for format in text_formats().into_iter().filter(|format| *format != "nodout") {
        for path in samples.remove(format).unwrap_or_default().into_values() {
            let text = std::fs::read(&path).unwrap();
            let whole = read(format, &text);
            let states = whole.time.len();
            if states < 3 {
                continue;
            }
            // Of long files every n-th byte, as each cut reads all before it.
            let step = 1 + text.len() / if is_thorough() { 150_000 } else { 30_000 };
            let last = text.len().saturating_sub(3_000).max(text.len() / 2)..text.len();
            for cut in last.step_by(step) {
                let file = read(format, &text[..cut]);
                let kept = file.time.len();
                assert!(kept <= states);
                for (cut_history, history) in file.histories.iter().zip(&whole.histories) {
                    let same = cut_history
                        .values
                        .iter()
                        .zip(&history.values)
                        .all(|(a, b)| a.to_bits() == b.to_bits());
                    assert!(same, "{} cut at {cut}", path.display());
                }
                // A line that is cut within its text must not pass silently.
                let last_line = text[..cut].rsplit(|&b| b == b'\n').next().unwrap();
                let rest = text[cut..].split(|&b| b == b'\n').next().unwrap();
                let within = !last_line.trim_ascii().is_empty() && !rest.trim_ascii().is_empty();
                assert!(
                    !within || !file.problems.is_empty(),
                    "{} cut at {cut}: a cut line is not named",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn a_problem_says_line_columns_and_what_was_found() {
    let text = std::fs::read_to_string(fixture("fe/lead-car-wall/25kmh/nodout")).unwrap();
    let (line, row) =
        text.lines().enumerate().filter(|(_, l)| l.starts_with("   900001 ")).nth(3).unwrap();
    let stars = text.replacen(row, &format!("{}************{}", &row[..10], &row[22..]), 1);
    let file = read("nodout", stars.as_bytes());
    assert_eq!(
        file.problems[0].to_string(),
        format!(
            "line {}, columns 11-22: expected a real number, found \"************\" (overflowed field)",
            line + 1
        )
    );
    assert_eq!(file.time.len(), 400, "the state stays");
    assert_eq!(file.histories[0].values.iter().filter(|v| v.is_nan()).count(), 1);
}

#[test]
fn a_node_that_appears_later_is_named_and_left_out() {
    let text = std::fs::read_to_string(fixture("fe/lead-car-wall/25kmh/nodout")).unwrap();
    let at = text.match_indices("   900001 ").nth(7).unwrap().0;
    let line = &text[at..at + text[at..].find('\n').unwrap() + 1];
    let grown = format!(
        "{}{line}{}{}",
        &text[..at],
        line.replace("900001", "900009"),
        &text[at + line.len()..]
    );
    let file = read("nodout", grown.as_bytes());
    assert_eq!(file.time.len(), 400);
    assert_eq!(file.entities.len(), 1);
    assert_eq!(file.problems[0].code, ProblemCode::UnexpectedEntity);
}

/// Small real-looking files of every format, for mutation.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let head = |path: &str, lines: usize| -> Vec<u8> {
        let text = std::fs::read_to_string(fixture(path)).unwrap();
        text.split_inclusive('\n').take(lines).collect::<String>().into_bytes()
    };
    let glstat = "\n ls-dyna smp d R14 date 1\n\n\n dt of cycle       1 is controlled by shell\n\n \
         time...........................   0.00000E+00\n kinetic energy.................   1.20000E+09\n\n\n \
         dt of cycle       2 is controlled by shell\n\n time...........................   7.51397E-04\n \
         kinetic energy.................   1.19962E+09\n";
    vec![
        ("nodout", head("fe/lead-car-pair/36kmh/nodout", 40)),
        ("rcforc", head("fe/lead-car-pair/36kmh/rcforc", 30)),
        ("rwforc", head("fe/lead-car-wall/25kmh/rwforc", 20)),
        ("glstat", glstat.as_bytes().to_vec()),
    ]
}

/// The formats that are lines of text.
fn text_formats() -> Vec<&'static str> {
    let binary = ["binout", "t01"]; // in tests of their own
    formats().filter(|name| !binary.contains(name)).collect()
}

fn any_result(format: &str, bytes: &[u8]) {
    let file = read(format, bytes);
    for history in &file.histories {
        assert_eq!(history.values.len(), file.time.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2_000)) {
        for format in text_formats() {
            any_result(format, &bytes);
        }
    }

    #[test]
    fn flipped_bits_and_cuts_never_panic(
        flips in proptest::collection::vec((any::<prop::sample::Index>(), 0u8..8), 0..20),
        cut in any::<prop::sample::Index>(),
    ) {
        for (format, seed) in seeds() {
            let mut bytes = seed.clone();
            for (index, bit) in &flips {
                let at = index.index(bytes.len());
                bytes[at] ^= 1 << bit;
            }
            bytes.truncate(cut.index(bytes.len()) + 1);
            any_result(format, &bytes);
        }
    }
}
