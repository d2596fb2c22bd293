//! `deforc` and `jntforc`: forces of discrete elements (springs and dampers) and of joints, one value per
//! line after a label with dots.
//!
//! Never tested with real data; read as the source of LSTC's converter `l2a` writes them.

use super::ascii::Body;
use super::label_values::is_number;
use super::line::{Line, integer, real};
use crate::history::EntityId;
use crate::solver::Format;
use crate::solver::states::repeat::Part;
use crate::solver::states::{KeyedTables, StateReader};

/// "label padded with dots to column 30, value in columns 31–44, id in columns 31–40".
const LABEL: usize = 30;
const VALUE_WIDTH: usize = 14;
/// Labels of one file; more are damage.
const MAX_TABLES: usize = 100;

/// Labels that begin an entity.
const ELEMENTS: &[&str] = &["spring/damper number"];
const JOINTS: &[&str] = &["joint number", "joint ID", "joint stiffness id number"];

pub(crate) const DEFORC: Format = Format::text(
    "deforc",
    "element",
    || of(ELEMENTS),
    |line| label(line).is_some_and(|label| ELEMENTS.contains(&label)),
);

pub(crate) const JNTFORC: Format = Format::text(
    "jntforc",
    "joint",
    || of(JOINTS),
    |line| label(line).is_some_and(|label| JOINTS.contains(&label)),
);

/// Reader of either file; each label is a table of one column.
#[derive(Clone)]
struct Dotted {
    /// Labels that begin an entity.
    entities: &'static [&'static str],
    tables: KeyedTables<String>,
}

fn of(entities: &'static [&'static str]) -> Box<dyn Body> {
    Box::new(Dotted { entities, tables: KeyedTables::default() })
}

impl Dotted {
    fn value(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        let text = line.text.trim_ascii_end();
        let (label, from) = split(text, LABEL)?;
        let value = &text[from..];
        if self.entities.contains(&label) {
            states.entity = integer(value).map(EntityId::new);
            return states.entity.map(drop);
        }
        if !(is_number(value, VALUE_WIDTH)
            && states.allows_width(label, value.len(), VALUE_WIDTH, line))
        {
            return None;
        }
        if label == "time" {
            states.entity = None;
            let time = real(value).number();
            states.part(line, value, Part::Time);
            states.begin(time, line.into());
            return time.map(drop);
        }
        let name = component(label);
        let table = self
            .tables
            .get(name, MAX_TABLES, |name| states.table("values of one label", [name.as_str()]))?;
        states.row(table, states.entity?, line, |_| Some((from + 1, text.len())));
        Some(())
    }
}

impl Body for Dotted {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if self.value(line, states).is_none() {
            const END: usize = LABEL + VALUE_WIDTH;
            states.unexpected(line, Some([LABEL + 1, END]), "a label and its value", END);
        }
        Some(())
    }
}

/// The label of a line, without its dots.
fn label(line: &[u8]) -> Option<&str> {
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
