//! `glstat`: energies and other quantities of the whole model, one labelled line each.
//!
//! A state is label → value, and labels may be absent. Truncation removes them from the end, so a last state that ends
//! early is incomplete. Unexpected text between the labels is counted.

use super::ascii::{Body, boxed};
use super::dotted::split;
use super::line::{Line, integer, is_whole_real, real, shown};
use crate::solver::Format;
use crate::solver::states::StateReader;
use crate::solver::states::repeat::Part;

const STATE: &[u8] = b" dt of cycle";
/// "label padded with dots to column 32, value columns 33–46".
const LABEL: usize = 32;
const VALUE_WIDTH: usize = 14;

/// Labels whose component in binout is not the label with underscores.
const NAMES: [(&str, &str); 3] = [
    ("total energy / initial energy", "energy_ratio"),
    ("energy ratio w/o eroded energy", "energy_ratio_wo_eroded"),
    ("time per zone cycle.(nanosec)", "nzc"),
];

pub(crate) const FORMAT: Format =
    Format::text("glstat", "entity", boxed::<Glstat>, |line| line.starts_with(STATE));

#[derive(Clone, Default)]
struct Glstat {
    /// Inside a block of mass properties, which ends with a row of stars.
    in_properties: bool,
}

const PROPERTIES: &[u8] = b"m a s s   p r o p e r t i e s";
/// What lines of text between the labels begin with.
const TEXTS: [&[u8]; 4] = [b"number of ", b"reached the ", b"added mass", b"percentage increase"];

impl Body for Glstat {
    fn line(&mut self, line: &Line<'_>, states: &mut StateReader<'_>) -> Option<()> {
        if line.text.starts_with(STATE) {
            states.begin(None, line.into());
            states.part(line, &line.text[STATE.len()..], Part::Unread);
            if !line.is_heading() {
                states.mark_damaged();
            }
            return Some(());
        }
        let Some((mut component, from)) = component(line.text) else {
            let text = line.text.trim_ascii();
            let is_ruler = self.in_properties && text.iter().all(|&b| b == b'*');
            self.in_properties = (self.in_properties && !is_ruler) || text.starts_with(PROPERTIES);
            if !is_ruler && !line.is_heading() {
                states.damage(line, None, "expected a label and its value, found stars".into());
            } else if !(is_ruler || self.in_properties || is_text(text)) {
                states.skip_line(line);
            }
            return Some(());
        };
        let columns = [from + 1, value_end(line.text, from)];
        if !is_value(&component, from, line, states) {
            let found = shown(line.columns(columns[0], columns[1]));
            let message = format!("expected a number of {VALUE_WIDTH} columns, found \"{found}\"");
            states.damage(line, Some(columns), message);
            return Some(());
        }
        // Only a wall's number may be after the value.
        let rest = line.text.get(columns[1]..).unwrap_or_default().trim_ascii();
        let wall = wall_number(rest);
        if !rest.is_empty() && wall.is_none() {
            let message = "expected the line to end after its value";
            states.damage(line, Some([columns[1] + 1, line.text.len()]), message.into());
            return Some(());
        }
        // With several walls the label repeats, and the wall follows the value.
        if let Some(wall) = wall {
            component = format!("{component}_wall_{wall}");
        }
        if component != "time" {
            states.scalar(&component, line, columns);
            return Some(());
        }
        let text = line.columns(columns[0], columns[1]);
        states.part(line, text, Part::Time);
        match real(text).number() {
            Some(time) if states.is_pending() && states.pending_time().is_none() => {
                states.set_time(time);
            }
            // The line that opens a state is missing: its time opens it.
            Some(time) => states.begin(Some(time), line.into()),
            None => states.damage(line, Some(columns), "expected a time".into()),
        }
        Some(())
    }
}

/// Whether what is after a label is a number with nothing cut from it.
fn is_value(label: &str, from: usize, line: &Line<'_>, states: &mut StateReader<'_>) -> bool {
    let value = line.columns(from + 1, value_end(line.text, from));
    // The number of elements at the smallest step has fewer columns.
    let is_count = integer(value).is_some() && is_text(line.text.trim_ascii());
    let (end, usual) = (from + value.len(), LABEL + VALUE_WIDTH);
    let is_number = end == usual || is_whole_real(value.trim_ascii());
    is_count || is_number && states.allows_width(label, end, usual, line)
}

fn is_text(text: &[u8]) -> bool {
    TEXTS.iter().any(|known| text.starts_with(known))
}

/// Where the value that begins after `from` ends: with a whole number, else where values
/// usually end.
fn value_end(text: &[u8], from: usize) -> usize {
    let behind = text.get(from..).unwrap_or_default();
    let blanks = behind.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let word = behind[blanks..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
    if is_whole_real(&behind[blanks..blanks + word]) {
        from + blanks + word
    } else {
        from + VALUE_WIDTH
    }
}

/// The number after `wall#`, which follows the value of a stonewall energy.
fn wall_number(rest: &[u8]) -> Option<i64> {
    integer(rest.strip_prefix(b"wall#")?)
}

/// The component a label names, as binout does, and where the label ends; `None` if the line
/// has no label.
fn component(text: &[u8]) -> Option<(String, usize)> {
    let (label, end) = split(text, LABEL)?;
    // Dots are in other text as well; there, no number follows them.
    let value = text.get(end..value_end(text, end).min(text.len())).unwrap_or_default();
    let is_value = end == LABEL || is_whole_real(value.trim_ascii());
    let known = NAMES.iter().find(|(l, _)| *l == label);
    let name = known.map(|(_, name)| name.to_string()).or_else(|| {
        // The tables of mass properties ("row1= …") can have a point in that column.
        // Stars are of lines that were overwritten.
        let is_text = label.starts_with(|c: char| c.is_ascii_alphabetic());
        let is_label = is_text && !label.contains(['=', '*']);
        let words = label.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        is_label.then(|| words.collect::<Vec<_>>().join("_"))
    });
    name.filter(|_| is_value).map(|name| (name, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wall_has_its_own_energy() {
        fn t(rest: &str, expected: Option<i64>) {
            assert_eq!(wall_number(rest.as_bytes()), expected, "{rest:?}");
        }
        t("wall# 1", Some(1));
        t("wall#12", Some(12));
        t("", None);
    }

    #[test]
    fn labels_become_binout_names() {
        fn t(line: &str, expected: Option<&str>) {
            let name = component(line.as_bytes()).map(|(name, _)| name);
            assert_eq!(name.as_deref(), expected, "{line:?}");
        }
        t(" kinetic energy.................   9.93442E-06", Some("kinetic_energy"));
        t(" hourglass energy ..............   0.00000E+00", Some("hourglass_energy"));
        t(" total energy / initial energy..   1.00000E+00", Some("energy_ratio"));
        t(" energy ratio w/o eroded energy.   1.00000E+00", Some("energy_ratio_wo_eroded"));
        t(" time per zone cycle.(nanosec)..             0", Some("nzc"));
        t(" number of shell elements that  ", None);
        t("     total mass of body          = 1.24485715E-07", None);
        t(" ************************************************************", None);
    }
}
