//! Fields of a card: in fixed columns, or between commas.

use super::super::line::{Line, integer, shown};
use crate::solver::problem::Place;

/// Bytes kept of a title or heading; the manual's end at 80.
const MAX_TEXT: usize = 200;

/// One field, its columns, counted from 1, and the place of its card.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub text: &'a [u8],
    pub columns: [usize; 2],
    pub place: Place,
}

pub(super) struct Card<'a> {
    pub text: &'a [u8],
    pub place: Place,
    width: usize,
    fields: Vec<Field<'a>>,
}

impl<'a> Card<'a> {
    /// Cuts a card into fields of that width, or at commas.
    pub(crate) fn new(line: &Line<'a>, width: usize) -> Self {
        let (text, place) = (line.text.trim_ascii_end(), line.into());
        let comma = usize::from(text.contains(&b','));
        let cut: Vec<&[u8]> = match comma {
            1 => text.split(|b| *b == b',').collect(),
            _ => text.chunks(width).collect(),
        };
        let mut start = 1;
        let fields = cut.into_iter().map(|text| {
            let columns = [start, start + text.len().max(1) - 1];
            start += text.len() + comma;
            Field { text: text.trim_ascii(), columns, place }
        });
        Self { text, place, width, fields: fields.collect() }
    }

    pub(crate) fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// Field `k`, counted from 0; blank beyond the end of the card.
    pub(crate) fn field(&self, k: usize) -> Field<'a> {
        let beyond = Field { text: b"", columns: [0, 0], place: self.place };
        self.fields.get(k).copied().unwrap_or(beyond)
    }

    pub(crate) fn fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a, '_> {
        self.fields.iter().copied()
    }

    /// An id and the text after it. The text may hold commas, so the card counts as
    /// free only when its first columns are no number by themselves.
    pub(crate) fn id_and_text(&self) -> (Field<'a>, Option<String>) {
        let width = self.width.min(self.text.len());
        let (id, title) = self.text.split_at(width);
        let free_id = self.field(0);
        let is_free =
            free_id.columns[1] < width && integer(id).is_none() && !id.trim_ascii().is_empty();
        if is_free && let Some(title) = self.text.get(free_id.columns[1]..) {
            return (free_id, text(title.strip_prefix(b",").unwrap_or(title)));
        }
        let columns = [1, width.max(1)];
        (Field { text: id.trim_ascii(), columns, place: self.place }, text(title))
    }
}

/// Text as the solver takes it, without the blanks around it; `None` when blank.
pub(super) fn text(bytes: &[u8]) -> Option<String> {
    let bytes = bytes.trim_ascii();
    let kept = bytes.get(..MAX_TEXT).unwrap_or(bytes);
    let text = shown(kept);
    (!text.is_empty()).then_some(text)
}

/// Bytes of damaged text shown in a message.
const MAX_SHOWN: usize = 80;

/// Enough of a line to know it again, for messages.
pub(super) fn start(line: &[u8]) -> String {
    shown(line.get(..MAX_SHOWN).unwrap_or(line))
}

#[cfg(test)]
mod tests {
    use super::super::keyword::{LONG, STANDARD};
    use super::*;

    fn card(text: &str, width: usize) -> Card<'_> {
        let text = text.as_bytes();
        Card::new(&Line { text, number: 1, byte: 0, ended: true, overlong: false }, width)
    }

    #[test]
    fn cuts_fixed_and_free_cards() {
        fn t(text: &str, width: usize, expected: &[(&str, [usize; 2])]) {
            let card = card(text, width);
            let fields: Vec<_> = card.fields().map(|f| (f.text, f.columns)).collect();
            let expected: Vec<_> = expected.iter().map(|(t, c)| (t.as_bytes(), *c)).collect();
            assert_eq!(fields, expected, "{text:?}");
        }
        let (standard, long) = (STANDARD, LONG);
        t("         1       2.5", standard, &[("1", [1, 10]), ("2.5", [11, 20])]);
        t("11.00000E10", standard, &[("11.00000E1", [1, 10]), ("0", [11, 11])]);
        t("         1       2.5", long, &[("1       2.5", [1, 20])]);
        t("1, 2.5,,x ", standard, &[("1", [1, 1]), ("2.5", [3, 6]), ("", [8, 8]), ("x", [9, 9])]);
        t(",7", standard, &[("", [1, 1]), ("7", [2, 2])]);
        t("", standard, &[]);
    }

    #[test]
    fn splits_ids_from_titles() {
        fn t(line: &str, width: usize, id: &str, title: Option<&str>) {
            let card = card(line, width);
            let (field, text) = card.id_and_text();
            assert_eq!((field.text, text.as_deref()), (id.as_bytes(), title), "{line:?}");
        }
        let (standard, long) = (STANDARD, LONG);
        t("     80085Left_on_left", standard, "80085", Some("Left_on_left"));
        t("         2 Between sheets", standard, "2", Some("Between sheets"));
        t("         1front, left", standard, "1", Some("front, left"));
        t("12, front, left", standard, "12", Some("front, left"));
        t("                   3nose", long, "3", Some("nose"));
        t("          no id", standard, "", Some("no id"));
        t("         1", standard, "1", None);
        t("7", standard, "7", None);
        t("", standard, "", None);
    }
}
