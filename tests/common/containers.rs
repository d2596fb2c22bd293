//! binout files as the tests need them: written record by record, or made of a run's text files.

use std::path::Path;

use crumple::history::Side;
use crumple::solver::{Entity, Selection, SolverFile, read};

/// A binout as it grows, record by record.
pub struct Written {
    pub bytes: Vec<u8>,
}

impl Written {
    pub fn new() -> Self {
        Self { bytes: vec![8, 8, 8, 1, 1, 1, 0, 0] }
    }

    pub fn record(&mut self, command: u8, payload: &[u8]) {
        self.bytes.extend((payload.len() as u64 + 9).to_le_bytes());
        self.bytes.push(command);
        self.bytes.extend(payload);
    }

    pub fn cd(&mut self, path: &str) {
        self.record(2, path.as_bytes());
    }

    pub fn data(&mut self, name: &str, kind: u8, values: &[u8]) {
        let mut payload = vec![kind, name.len() as u8];
        payload.extend(name.as_bytes());
        payload.extend(values);
        self.record(3, &payload);
    }

    pub fn reals(&mut self, name: &str, values: &[f64]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.data(name, 10, &bytes);
    }

    pub fn ids(&mut self, section: &str, ids: &[i64]) {
        self.cd(&format!("/{section}/metadata"));
        let bytes: Vec<u8> = ids.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.data("ids", 4, &bytes);
    }

    /// A section of one width with what its text says of itself, its entities and their values.
    fn section(&mut self, section: &str, file: &SolverFile, keeps: impl Fn(&str) -> bool) {
        const TITLE: usize = 80;
        let integers = |values: &[i64]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let ids: Vec<i64> = file.entities.iter().map(|entity| entity.id.id).collect();
        self.ids(section, &ids);
        let sides = file.entities.iter().map(|e| Some(i64::from(e.id.side? == Side::SurfB)));
        if let Some(sides) = sides.collect::<Option<Vec<i64>>>() {
            let bytes: Vec<u8> = integers(&sides);
            self.data("side", 4, &bytes);
        }
        let legend: String = file.entities.iter().map(|e| padded(&e.title, TITLE)).collect();
        let bytes: Vec<u8> = integers(&ids);
        self.data("legend_ids", 4, &bytes);
        self.data("legend", 1, legend.as_bytes());
        self.data("version", 1, file.version.as_deref().unwrap_or_default().as_bytes());
        for (state, &time) in file.time.iter().enumerate() {
            self.cd(&format!("/{section}/d{:06}", state + 1));
            self.reals("time", &[time]);
            for component in file.components.iter().filter(|component| keeps(component)) {
                let of = |e: &Entity| Some(file.history(Some(e.id), component)?.values[state]);
                let values: Option<Vec<f64>> = file.entities.iter().map(of).collect();
                self.reals(component, &values.unwrap());
            }
        }
    }
}

/// A text in a field of a fixed width.
fn padded(text: &Option<String>, width: usize) -> String {
    format!("{:<width$}", text.as_deref().unwrap_or_default())
}

/// The text histories of a run as one binout, with the titles of their entities.
pub fn binout_of(run: &Path) -> Vec<u8> {
    binout_with(run, |_| true)
}

/// The same with some of their components.
pub fn binout_with(run: &Path, keeps: impl Fn(&str) -> bool) -> Vec<u8> {
    let mut out = Written::new();
    for (name, section) in [("nodout", "nodout"), ("rwforc", "rwforc/forces"), ("rcforc", "rcforc")]
    {
        let path = run.join(name);
        if path.exists() {
            out.section(section, &read(&path, None, &Selection::all()).unwrap(), &keeps);
        }
    }
    out.bytes
}
