//! Reads one component of one node from a nodout and prints it over time.
//!
//!     cargo run --example read_histories -- run/nodout 900001 x_displacement

use std::error::Error;
use std::path::Path;

use crumple::solver::{self, Selection};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, path, id, component] = &arguments[..] else {
        return Err("expected: file, id, component".into());
    };
    let selection = Selection {
        ids: Some(vec![id.parse()?]),
        components: Some(vec![component.clone()]),
        ..Selection::all()
    };
    let file = solver::read(Path::new(path), None, &selection)?;
    for problem in &file.problems {
        eprintln!("{problem}");
    }
    for history in &file.histories {
        for (time, value) in history.time.iter().zip(&history.values) {
            println!("{time:?} {value:?}");
        }
    }
    Ok(())
}
