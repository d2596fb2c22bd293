//! Files of a run that is still going: a writer appends to them while they are read. Every
//! reading is the beginning of the whole file.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::common::{fixture, is_thorough, shared};
use crumple::solver::{ProblemCode, Selection, SolverFile, read_from, read_sections};

/// Bytes appended at once: no divisor of any line's or record's length.
const APPENDED: usize = 137;
/// What an unfinished end may be called.
const AT_THE_END: [ProblemCode; 4] = [
    ProblemCode::IncompleteState,
    ProblemCode::CutRecord,
    ProblemCode::BadLine,
    ProblemCode::NoVersionLine,
];

/// Appends `bytes` to one file after the other in `folder`, until `stop`; the file that is
/// being written is in `current`.
fn write(bytes: &[u8], folder: &Path, name: &str, current: &Mutex<PathBuf>, stop: &AtomicBool) {
    for round in 0.. {
        let path = folder.join(round.to_string()).join(name);
        std::fs::create_dir(path.parent().unwrap()).unwrap();
        File::create(&path).unwrap();
        *current.lock().unwrap() = path.clone();
        for chunk in bytes.chunks(APPENDED) {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            OpenOptions::new().append(true).open(&path).unwrap().write_all(chunk).unwrap();
            std::thread::sleep(Duration::from_micros(20));
        }
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Holds a reading against the whole file's section.
fn is_beginning(read: &SolverFile, whole: &SolverFile) {
    let states = read.time.len();
    let name = &read.section;
    assert_eq!(bits(&read.time), bits(&whole.time[..states]), "{name}");
    // A first state that ends between two rows cannot be distinguished from a whole one.
    assert!(states < 2 || read.entities == whole.entities, "{name}: {:?}", read.entities);
    // T01's forces are differences of its impulses: at the end a one-sided one.
    let is_rate = read.format == "t01" && (name.ends_with("forc") || name == "rbdout");
    let compared = if is_rate { states.saturating_sub(1) } else { states };
    for history in &read.histories {
        let other = whole.history(history.entity, &history.component).unwrap();
        let (a, b) = (&history.values[..compared], &other.values[..compared]);
        assert_eq!(bits(a), bits(b), "{name}: {} of {states} states", history.label());
    }
    for problem in &read.problems {
        // Forces are differences of impulses, of which one state has none.
        let is_one = states == 1 && problem.code == ProblemCode::AbsentComponent;
        let is_end = is_one || AT_THE_END.contains(&problem.code);
        assert!(is_end, "{name}, {states} states: {problem}");
    }
}

/// Reads a growing file until many of the readings had states.
fn grow(format: &str, name: &str, bytes: &[u8]) {
    let whole = read_from(format, &[Box::new(bytes.to_vec())], &Selection::all()).unwrap();
    assert!(whole.iter().any(|section| section.time.len() > 10), "{format}");
    let folder = tempfile::tempdir().unwrap();
    let current = Mutex::new(PathBuf::new());
    let stop = AtomicBool::new(false);
    let wanted = if is_thorough() { 1_000 } else { 200 };
    let (mut with_states, mut cut) = (0, 0);
    std::thread::scope(|scope| {
        scope.spawn(|| write(bytes, folder.path(), name, &current, &stop));
        // However a check ends, the writer ends too.
        struct End<'a>(&'a AtomicBool);
        impl Drop for End<'_> {
            fn drop(&mut self) {
                self.0.store(true, Ordering::Relaxed);
            }
        }
        let _end = End(&stop);
        while with_states < wanted {
            let path = current.lock().unwrap().clone();
            if !path.is_file() {
                continue;
            }
            let sections = match read_sections(&path, None, &Selection::all()) {
                Ok(sections) => sections,
                // The file has no line or record yet that tells its kind.
                Err(error) if error.to_string().contains(": the readers take ") => continue,
                Err(error) => panic!("{error}"),
            };
            for section in &sections {
                let whole = whole.iter().find(|w| w.section == section.section).unwrap();
                is_beginning(section, whole);
            }
            with_states += usize::from(sections.iter().any(|s| s.time.len() > 1));
            cut += usize::from(sections.iter().any(|s| !s.problems.is_empty()));
        }
    });
    assert!(cut > wanted / 10, "{with_states} with states, {cut} cut");
}

fn grow_file(format: &str, path: &Path) {
    let name = path.file_name().unwrap().to_str().unwrap();
    grow(format, name, &std::fs::read(path).unwrap());
}

#[test]
fn a_growing_nodout_is_a_beginning_of_the_whole() {
    grow_file("nodout", &fixture("fe/lead-car-pair/36kmh/nodout"));
}

#[test]
fn a_growing_rcforc_is_a_beginning_of_the_whole() {
    grow_file("rcforc", &fixture("fe/lead-car-pair/36kmh/rcforc"));
}

#[test]
fn a_growing_rwforc_is_a_beginning_of_the_whole() {
    grow_file("rwforc", &fixture("fe/lead-car-wall/25kmh/rwforc"));
}

#[test]
fn a_growing_t01_is_a_beginning_of_the_whole() {
    grow_file("t01", &fixture("t01/lead-car-pair/36kmh/crashT01"));
}

#[test]
fn a_growing_binout_is_a_beginning_of_the_whole() {
    grow_binout(&fixture("samples/lasso-python/binout/lasso_r12_smp_s_sph_rwforc"));
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn a_growing_binout_of_several_processes_is_a_beginning_of_the_whole() {
    let folder = shared("samples/lsdyna/binout");
    grow_binout(&folder.join("dynareadout_r11.1_mpp_s_nodout_rcforc"));
}

fn grow_binout(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    let sections =
        |bytes: &[u8]| read_from("binout", &[Box::new(bytes.to_vec())], &Selection::all()).unwrap();
    // As much of it as is whole.
    let end = (100_000..).find(|&end| sections(&bytes[..end])[0].problems.is_empty()).unwrap();
    grow("binout", "binout0000", &bytes[..end]);
}
