//! Fields of a card: in fixed columns, or between commas.

use nom::IResult;
use nom::Parser;
use nom::bytes::complete::{tag, take_till, take_while_m_n};
use nom::multi::{many0, separated_list0};

use super::super::line::{Line, integer, shown};
use super::keyword::Format;
use crate::solver::problem::Place;

/// Bytes kept of a title or heading; the manual's end at 80.
const MAX_TEXT: usize = 200;

/// One field and its columns, counted from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Field<'a> {
    pub text: &'a [u8],
    pub columns: [usize; 2],
}

/// One card, cut into fields.
pub(super) struct Card<'a> {
    pub text: &'a [u8],
    pub place: Place,
    format: Format,
    fields: Vec<Field<'a>>,
}

impl Format {
    fn width(self) -> usize {
        match self {
            Self::Standard => 10,
            Self::Long => 20,
        }
    }
}

impl<'a> Card<'a> {
    pub(crate) fn new(line: &Line<'a>, format: Format) -> Self {
        fn fixed(text: &[u8], width: usize) -> IResult<&[u8], Vec<&[u8]>> {
            many0(take_while_m_n(1, width, |_: u8| true)).parse(text)
        }
        fn free(text: &[u8]) -> IResult<&[u8], Vec<&[u8]>> {
            separated_list0(tag(","), take_till(|b| b == b',')).parse(text)
        }
        let text = line.text.trim_ascii_end();
        let comma = usize::from(text.contains(&b','));
        let cut = if comma == 1 { free(text) } else { fixed(text, format.width()) };
        let mut start = 1;
        let fields = cut.map_or_else(|_| Vec::new(), |(_, fields)| fields).into_iter();
        let fields = fields.map(|text| {
            let columns = [start, start + text.len().max(1) - 1];
            start += text.len() + comma;
            Field { text: text.trim_ascii(), columns }
        });
        Self { text, place: line.into(), format, fields: fields.collect() }
    }

    pub(crate) fn is_blank(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// Field `k`, counted from 0; blank beyond the end of the card.
    pub(crate) fn field(&self, k: usize) -> Field<'a> {
        self.fields.get(k).copied().unwrap_or_default()
    }

    pub(crate) fn fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a, '_> {
        self.fields.iter().copied()
    }

    /// An id and the text after it. The text may hold commas, so the card counts as
    /// free only when its first columns are no number by themselves.
    pub(crate) fn id_and_text(&self) -> (Field<'a>, Option<String>) {
        let width = self.format.width().min(self.text.len());
        let (id, title) = self.text.split_at(width);
        let free_id = self.field(0);
        let is_free = free_id.columns[1] < width && integer(id).is_none() && !blank(id);
        if is_free && let Some(title) = self.text.get(free_id.columns[1]..) {
            return (free_id, text(title.strip_prefix(b",").unwrap_or(title)));
        }
        (Field { text: id.trim_ascii(), columns: [1, width.max(1)] }, text(title))
    }
}

fn blank(bytes: &[u8]) -> bool {
    bytes.trim_ascii().is_empty()
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
    use super::*;

    fn card(text: &str, format: Format) -> Card<'_> {
        let text = text.as_bytes();
        Card::new(&Line { text, number: 1, byte: 0, ended: true, overlong: false }, format)
    }

    #[test]
    fn cuts_fixed_and_free_cards() {
        fn t(text: &str, format: Format, expected: &[(&str, [usize; 2])]) {
            let card = card(text, format);
            let fields: Vec<_> = card.fields().map(|f| (f.text, f.columns)).collect();
            let expected: Vec<_> = expected.iter().map(|(t, c)| (t.as_bytes(), *c)).collect();
            assert_eq!(fields, expected, "{text:?}");
        }
        let (standard, long) = (Format::Standard, Format::Long);
        t("         1       2.5", standard, &[("1", [1, 10]), ("2.5", [11, 20])]);
        t("11.00000E10", standard, &[("11.00000E1", [1, 10]), ("0", [11, 11])]);
        t("         1       2.5", long, &[("1       2.5", [1, 20])]);
        t("1, 2.5,,x ", standard, &[("1", [1, 1]), ("2.5", [3, 6]), ("", [8, 8]), ("x", [9, 9])]);
        t(",7", standard, &[("", [1, 1]), ("7", [2, 2])]);
        t("", standard, &[]);
    }

    #[test]
    fn splits_ids_from_titles() {
        fn t(line: &str, format: Format, id: &str, title: Option<&str>) {
            let card = card(line, format);
            let (field, text) = card.id_and_text();
            assert_eq!((field.text, text.as_deref()), (id.as_bytes(), title), "{line:?}");
        }
        let (standard, long) = (Format::Standard, Format::Long);
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
