//! Files cut and overwritten at many places: what is returned is what the undamaged file
//! has, or a problem says what was given up.

use std::collections::HashMap;
use std::path::Path;

use crate::common::{fixture, is_thorough, shared};
use crumple::solver::{ProblemCode, Selection, SolverFile, read_from};

/// Bytes of a sample that are used: the damage of a state shows on few states.
const SIZE: usize = 60_000;

/// Places at which a file is cut, and ranges that are overwritten.
fn cuts_and_ranges() -> (usize, usize) {
    if is_thorough() { (1_000, 100) } else { (200, 40) }
}

/// Bytes overwritten: at least some values, at most several states.
const SHORTEST: usize = 32;
const LONGEST: usize = 4_096;

fn read(format: &str, bytes: &[u8]) -> Vec<SolverFile> {
    read_from(format, &[Box::new(bytes.to_vec())], &Selection::all()).unwrap()
}

/// Numbers that look random and are the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }
}

/// The beginning of a text, as long as it is read without a problem.
fn beginning(format: &str, text: &[u8]) -> Vec<u8> {
    if text.len() <= SIZE {
        return text.to_vec();
    }
    let line_ends = (0..SIZE).rev().filter(|&at| text[at] == b'\n');
    for at in line_ends {
        if read(format, &text[..=at])[0].problems.is_empty() {
            return text[..=at].to_vec();
        }
    }
    panic!("no beginning of the {format} is read without a problem")
}

/// Values of a state by label.
fn state(file: &SolverFile, k: usize) -> impl Iterator<Item = (String, f64)> {
    file.histories.iter().map(move |h| (h.label(), h.values[k]))
}

fn is_same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Holds a damaged reading against the whole one. `excused` says of a wrong number that no
/// reader could know it.
fn check(
    name: &str,
    whole: &SolverFile,
    damaged: &SolverFile,
    excused: impl Fn(&str, usize) -> bool,
) {
    let by_label: HashMap<String, &Vec<f64>> =
        whole.histories.iter().map(|h| (h.label(), &h.values)).collect();
    // An id that was overwritten is another one; that needs a problem.
    let known = |label: &String| by_label.contains_key(label);
    let unknown =
        damaged.histories.iter().find(|h| !known(&h.label())).map(crumple::history::History::label);
    assert!(unknown.is_none() || !damaged.problems.is_empty(), "{name}: {unknown:?}");
    let state = |k| state(damaged, k).filter(|(label, _)| known(label));
    let mut next = 0;
    for (k, time) in damaged.time.iter().enumerate() {
        // States come in the order of the file, each once.
        let found = (next..whole.time.len()).find(|&i| {
            whole.time[i] == *time
                && state(k).all(|(label, v)| v.is_nan() || is_same(by_label[&label][i], v))
        });
        if let Some(i) = found {
            next = i + 1;
            for (label, value) in state(k) {
                let lost = value.is_nan() && !by_label[&label][i].is_nan();
                assert!(!lost || !damaged.problems.is_empty(), "{name}: {label} lost silently");
            }
            continue;
        }
        let same_time = (next..whole.time.len()).find(|&i| whole.time[i] == *time);
        let i = same_time.unwrap_or_else(|| panic!("{name}: there is no state at time {time}"));
        next = i + 1;
        for (label, value) in state(k) {
            let true_value = by_label[&label][i];
            let said = damaged.problems.iter().any(|p| p.code == ProblemCode::SuspectZeros);
            assert!(
                is_same(true_value, value) || value.is_nan() || said || excused(&label, i),
                "{name}: {label} of state {i} is {value} instead of {true_value}: {:?}",
                damaged.problems
            );
        }
    }
    let complete = damaged.time.len() == whole.time.len();
    assert!(
        complete
            || damaged.problems.iter().any(|p| p.code != ProblemCode::SuspectZeros)
            || is_cut_between(damaged, whole),
        "{name}: states are missing silently"
    );
}

/// Whether the damaged file only ends earlier, between two states.
fn is_cut_between(damaged: &SolverFile, whole: &SolverFile) -> bool {
    damaged.time[..] == whole.time[..damaged.time.len()]
}

fn damage_text(format: &str, path: &Path) {
    let name = path.display().to_string();
    let text = beginning(format, &std::fs::read(path).unwrap());
    let whole = read(format, &text).remove(0);
    assert!(!whole.time.is_empty(), "{name} has no state");
    let never = |_: &str, _: usize| false;
    let mut random = Random(text.len() as u64);
    let (cuts, ranges) = cuts_and_ranges();
    for step in 0..cuts {
        let cut = text.len() * step / cuts + random.below(text.len() / cuts + 1);
        let cut = cut.min(text.len());
        let file = read(format, &text[..cut]).remove(0);
        check(&format!("{name} cut at {cut}"), &whole, &file, never);
        assert!(is_cut_between(&file, &whole), "{name} cut at {cut}: a state before is lost");
    }
    for _ in 0..ranges {
        let from = random.below(text.len());
        let to = (from + SHORTEST + random.below(LONGEST - SHORTEST)).min(text.len());
        for byte in [0, b'*'] {
            let mut bytes = text.clone();
            bytes[from..to].fill(byte);
            let file = read(format, &bytes).remove(0);
            let what = format!("{name} overwritten with {byte} from {from} to {to}");
            check(&what, &whole, &file, never);
            // What was whole before the damage still is; so is the end of the file.
            let line = text[..from].iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
            let before = read(format, &text[..line]).remove(0).time.len();
            let kept = file.time.len() >= before && file.time[..before] == whole.time[..before];
            assert!(kept || before < 2, "{what}: states before it are lost");
            let last_state = text.len() - text.len() / whole.time.len() * 5 / 2;
            if to < last_state && before > 2 {
                assert_eq!(file.time.last(), whole.time.last(), "{what}: the end is lost");
            }
        }
    }
}

/// The first states of a text, as far as it is read without a problem.
fn first_states(format: &str, text: &[u8], count: usize) -> Vec<u8> {
    let line_ends = (0..text.len()).filter(|&at| text[at] == b'\n');
    let whole = |at: &usize| {
        let file = read(format, &text[..=*at]).remove(0);
        file.time.len() == count && file.problems.is_empty()
    };
    let at = line_ends.take_while(|&at| at < 4 * SIZE).find(whole);
    text[..=at.unwrap_or_else(|| panic!("{format}: no {count} whole states"))].to_vec()
}

/// Cuts the last of a few states at every byte: what is returned are the states before it,
/// with every value, or all of them.
fn cut_the_last_state(format: &str, path: &Path) {
    let name = path.display().to_string();
    let text = std::fs::read(path).unwrap();
    let count = read(format, &text)[0].time.len().min(3);
    let text = first_states(format, &text, count);
    let before = first_states(format, &text, count - 1).len();
    let whole = read(format, &text).remove(0);
    for cut in before..text.len() {
        let file = read(format, &text[..cut]).remove(0);
        let states = file.time.len();
        assert!(states >= count - 1, "{name} cut at {cut}: {states} states");
        assert_eq!(file.time[..], whole.time[..states], "{name} cut at {cut}");
        assert_eq!(file.histories.len(), whole.histories.len(), "{name} cut at {cut}");
        for (a, b) in file.histories.iter().zip(&whole.histories) {
            let same = a.values.iter().zip(&b.values).all(|(a, b)| is_same(*a, *b));
            assert!(same && a.label() == b.label(), "{name} cut at {cut}: {}", a.label());
        }
        let line = text[..cut].rsplit(|&b| b == b'\n').next().unwrap();
        let is_named = line.trim_ascii().is_empty() || !file.problems.is_empty();
        assert!(is_named, "{name} cut at {cut}: a cut line is not named");
    }
}

macro_rules! text_samples {
    ($($name:ident: $format:literal, $path:literal;)*) => {
        $(
            #[test]
            #[ignore = "needs ../shared (the real files)"]
            fn $name() {
                let folder = shared("samples/lsdyna");
                damage_and_cut($format, &folder.join($format).join($path));
            }
        )*
    };
}

fn damage_and_cut(format: &str, path: &Path) {
    damage_text(format, path);
    cut_the_last_state(format, path);
}

#[test]
fn rwforc() {
    damage_and_cut("rwforc", &fixture("samples/lasso-python/rwforc/l2a_lasso_r12_smp_s"));
}

#[test]
fn matsum_of_l2a() {
    damage_and_cut("matsum", &fixture("samples/lasso-python/matsum/l2a_lasso_r12_smp_s"));
}

text_samples! {
    nodout_with_rotations: "nodout", "pillars_r13.1.1_smp_d_rot_legend";
    nodout_of_l2a: "nodout", "l2a_scheckmate_root_r10.1_smp_s_norot";
    rcforc: "rcforc", "pillars_r13.1.1_smp_d_slave_master";
    glstat: "glstat", "pillars_r13.1.1_smp_d";
    matsum: "matsum", "pillars_r13.1.1_smp_d";
    secforc: "secforc", "l2a_scheckmate_root_r10.1_smp_s";
    bndout: "bndout", "pillars_r13.1.1_first300";
    sleout: "sleout", "pillars_r13.1.1_smp_d";
    swforc: "swforc", "pillars_r13.1.1_smp_d_beamweld";
    abstat: "abstat", "pillars_r13.1.1_airbag_open";
    elout_of_beams: "elout", "pillars_r13.1.1_beam";
    elout_of_solids: "elout", "l2a_scheckmate_root_r10.1_solid_strain_first50";
}

#[test]
fn our_nodout_with_many_nodes() {
    damage_and_cut("nodout", &fixture("fe/lead-car-pair/36kmh/nodout"));
}

/// A binary file has no checksums: zeros among values are only known by what stands around
/// them. A value whose neighbours in time are zero as well cannot be known to be damaged, nor
/// can one in the first state.
fn damage_binary(format: &str, path: &Path, size: usize) {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).unwrap();
    let bytes = &bytes[..bytes.len().min(size)];
    let whole = read(format, bytes);
    let section =
        |files: &[SolverFile], name: &str| files.iter().find(|f| f.section == name).cloned();
    let excused =
        |file: &SolverFile, label: &str, i: usize| {
            // Neighbouring values of the record count as well: the range may end within one.
            let component = label.split('[').next().unwrap().to_string();
            i == 0
                || file.histories.iter().filter(|h| *h.component == *component).any(|h| {
                    h.values[i - 1] == 0.0 || h.values.get(i + 1).is_some_and(|v| *v == 0.0)
                })
        };
    let mut random = Random(bytes.len() as u64);
    let (cuts, ranges) = cuts_and_ranges();
    for step in 0..cuts {
        let cut = bytes.len() * step / cuts;
        let Ok(files) = read_from(format, &[Box::new(bytes[..cut].to_vec())], &Selection::all())
        else {
            continue;
        };
        for file in &whole {
            let Some(damaged) = section(&files, &file.section) else { continue };
            let what = format!("{name}, {} cut at {cut}", file.section);
            assert!(is_cut_between(&damaged, file), "{what}: a state before is lost");
            if format == "t01" && ["rwforc", "rcforc", "rbdout"].contains(&&*file.section) {
                continue; // differences at the end of a cut file are one-sided
            }
            check(&what, file, &damaged, |_, _| false);
        }
    }
    for _ in 0..ranges {
        let from = random.below(bytes.len());
        let to = (from + SHORTEST + random.below(LONGEST - SHORTEST)).min(bytes.len());
        let mut copy = bytes.to_vec();
        copy[from..to].fill(0);
        let Ok(files) = read_from(format, &[Box::new(copy)], &Selection::all()) else { continue };
        for file in &whole {
            if format == "t01" && ["rwforc", "rcforc", "rbdout"].contains(&&*file.section) {
                continue; // one lost state changes the difference beside it
            }
            let what = format!("{name}, {} zeroed from {from} to {to}", file.section);
            let Some(damaged) = section(&files, &file.section) else {
                // The directory that names the section is gone.
                assert!(files.iter().all(|f| !f.problems.is_empty()), "{what}: lost silently");
                continue;
            };
            check(&what, file, &damaged, |label, i| excused(file, label, i));
        }
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn binout_of_many_nodes() {
    let folder = shared("samples/lsdyna/binout");
    damage_binary("binout", &folder.join("rowan_r14.1.1_smp_d_run0001"), 200_000);
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn binout_of_few_nodes() {
    let folder = shared("samples/lsdyna/binout");
    damage_binary("binout", &folder.join("dynareadout_r11.1_mpp_s_nodout_rcforc"), 100_000);
}

#[test]
fn binout_of_a_wall() {
    let path = fixture("samples/lasso-python/binout/lasso_r12_smp_s_sph_rwforc");
    damage_binary("binout", &path, 100_000);
}

#[test]
fn openradioss_t01() {
    damage_binary("t01", &fixture("t01/lead-car-pair/36kmh/crashT01"), 60_000);
}
