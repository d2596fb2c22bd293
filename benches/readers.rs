//! CPU time of reading a file into memory, for `benches/readers.py`, which compares it with
//! other readers in one run.
//!
//!     cargo bench --bench readers -- FILE [SECTION]

use std::path::Path;

use cpu_time::ProcessTime;
use crumple::solver::{Selection, read};

fn main() {
    // cargo adds --bench.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let Some(path) = arguments.first() else {
        println!("give a file and, of a binout, a section; see benches/readers.py");
        return;
    };
    let selection = Selection { section: arguments.get(1).cloned(), ..Selection::all() };
    for _ in 0..5 {
        let start = ProcessTime::now();
        let file = read(Path::new(path), None, &selection).expect("a readable file");
        let cpu_s = start.elapsed().as_secs_f64();
        println!("{cpu_s} {} {}", file.histories.len(), file.time.len());
    }
}
