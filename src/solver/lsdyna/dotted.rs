//! One value per line behind a label with dots, as `deforc` and `jntforc` print them.
//!
//! Never seen with data; read as the source of LSTC's converter `l2a` writes them.

use super::ascii::Body;
use super::line::{Field, Line, integer, real, shown};
use crate::history::EntityId;
use crate::solver::problem::Place;
use crate::solver::states::{States, TableId};

/// "label padded with dots to column 30, value in columns 31–44, id in columns 31–40".
const LABEL: usize = 30;
const VALUE: (usize, usize) = (31, 44);
const ID: (usize, usize) = (31, 40);
/// Labels of one file; more are damage.
const MAX_TABLES: usize = 100;

/// Reader of either file; each label is a table of one column.
pub struct Dotted {
    /// Labels that begin an entity.
    entities: &'static [&'static str],
    tables: Vec<(String, TableId)>,
    entity: Option<EntityId>,
}

impl Dotted {
    pub fn new(entities: &'static [&'static str]) -> Self {
        Self { entities, tables: Vec::new(), entity: None }
    }
}

/// The label of a line, without its dots.
pub fn label(line: &[u8]) -> Option<&str> {
    let label = std::str::from_utf8(line.get(..LABEL)?).ok()?;
    let is_label = label.starts_with(' ') && label.ends_with('.');
    is_label.then(|| label.trim_end_matches('.').trim())
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
    fn is_signature(&self, line: &[u8]) -> bool {
        label(line).is_some_and(|label| self.entities.contains(&label))
    }

    fn line(&mut self, line: &Line<'_>, states: &mut States<'_>) {
        if line.is_blank() {
            return;
        }
        if self.value(line, states).is_none() {
            let found = shown(line.columns(1, 44));
            let message = format!("expected a label and its value, found \"{}\"", found.trim_end());
            states.damage(line, Some([VALUE.0, VALUE.1]), message);
        }
    }

    fn interrupt(&mut self) {
        self.entity = None;
    }

    fn end(&mut self, _: Place, _: &mut States<'_>) {}
}

impl Dotted {
    fn value(&mut self, line: &Line<'_>, states: &mut States<'_>) -> Option<()> {
        let label = label(line.text)?;
        let width = line.text.trim_ascii_end().len();
        if self.entities.contains(&label) {
            self.entity = None;
            (width == ID.1).then_some(())?;
            self.entity = Some(EntityId::new(integer(line.columns(ID.0, ID.1))?));
            return Some(());
        }
        (width == VALUE.1).then_some(())?;
        if label == "time" {
            self.entity = None;
            let time = match real(line.columns(VALUE.0, VALUE.1)) {
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
        states.row(table, self.entity?, line, |_| Some(VALUE));
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
