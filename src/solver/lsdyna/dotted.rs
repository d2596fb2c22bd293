//! One value per line after a label with dots, as `deforc` and `jntforc` print them.
//!
//! Never tested with real data; read as the source of LSTC's converter `l2a` writes them.

use super::ascii::Body;
use super::label_values::{Widths, is_number};
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::states::{StateReader, TableId};

/// "label padded with dots to column 30, value in columns 31–44, id in columns 31–40".
const LABEL: usize = 30;
const VALUE_WIDTH: usize = 14;
/// Labels of one file; more are damage.
const MAX_TABLES: usize = 100;

/// Reader of either file; each label is a table of one column.
pub(crate) struct Dotted {
    /// Labels that begin an entity.
    entities: &'static [&'static str],
    tables: Vec<(String, TableId)>,
    entity: Option<EntityId>,
    widths: Widths,
}

impl Dotted {
    pub(crate) fn new(entities: &'static [&'static str]) -> Self {
        Self { entities, tables: Vec::new(), entity: None, widths: Widths::default() }
    }
}

/// The label of a line, without its dots.
pub(crate) fn label(line: &[u8]) -> Option<&str> {
    split(line, LABEL).map(|(label, _)| label)
}

/// The label of a line, without its dots, and where the dots end. One dot ends a label only
/// where labels usually end, at column `usual`.
pub(crate) fn split(line: &[u8], usual: usize) -> Option<(&str, usize)> {
    let end = match memchr::memmem::rfind(line, b"..") {
        Some(at) => at + 2,
        None => (line.get(usual - 1) == Some(&b'.')).then_some(usual)?,
    };
    let label = std::str::from_utf8(line.get(..end)?).ok()?;
    label.starts_with(' ').then(|| (label.trim_end_matches('.').trim(), end))
}

/// The name of a component in a binout: `x-force` is `x_force`, `d(phi)/dt (degrees)` is
/// `d(phi)_dt`.
fn component(label: &str) -> String {
    let label = label.replace("(local)", "");
    let label = label.trim();
    if label == "change in length" {
        return "displacement".into();
    }
    if let Some((rate, _)) = label.split_once("/dt") {
        return format!("{rate}_dt");
    }
    let words = label.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.collect::<Vec<_>>().join("_")
}

impl Body for Dotted {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) {
        if line.is_blank() {
            return;
        }
        if self.value(line, states).is_none() {
            let found = shown(line.columns(1, LABEL + VALUE_WIDTH));
            let message = format!("expected a label and its value, found \"{}\"", found.trim_end());
            states.damage(line, Some([LABEL + 1, LABEL + VALUE_WIDTH]), message);
        }
    }

    fn interrupt(&mut self) {
        self.entity = None;
    }
}

impl Dotted {
    fn value(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let (label, from) = split(text, LABEL)?;
        let value = &text[from..];
        if self.entities.contains(&label) {
            self.entity = None;
            self.entity = Some(EntityId::new(integer(value)?));
            return Some(());
        }
        let excess = value.len() as isize - VALUE_WIDTH as isize;
        if !(is_number(value, VALUE_WIDTH) && self.widths.allow(label, excess, line, states)) {
            return None;
        }
        if label == "time" {
            self.entity = None;
            let time = match real(value) {
                Field::Real(time) => Some(time),
                _ => None,
            };
            states.begin(time, line.into());
            return time.map(drop);
        }
        let name = component(label);
        let known = self.tables.iter().find(|(n, _)| *n == name).map(|(_, table)| *table);
        let table = match known {
            Some(table) => table,
            None if self.tables.len() < MAX_TABLES => {
                let table = states.table("values of one label", &[&name]);
                self.tables.push((name, table));
                table
            }
            None => return None,
        };
        states.row(table, self.entity?, line, |_| Some((from + 1, text.len())));
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_become_binout_names() {
        fn t(line: &str, expected: &str) {
            assert_eq!(component(label(line.as_bytes()).unwrap()), expected, "{line:?}");
        }
        t(" x-force......................   1.00000E+00", "x_force");
        t(" x-moment (local) ............   1.00000E+00", "x_moment");
        t(" change in length.............   1.00000E+00", "displacement");
        t(" d(phi)/dt (degrees)..........   1.00000E+00", "d(phi)_dt");
        t(" phi (degrees)................   1.00000E+00", "phi_degrees");
        t(" theta-moment-stiffness.......   1.00000E+00", "theta_moment_stiffness");
    }
}
