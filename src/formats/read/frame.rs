//! Where the table of a text begins: below titles, at the header above rows of numbers.
//!
//! The header is the first line that names a deflection and a force, and behind which a row of as many numbers
//! follows, with or without a row of units between. Columns are separated by tabs, semicolons, commas or blanks,
//! whichever gives the header and the row below it the same number of fields.

use std::borrow::Cow;

use super::label::{Label, Quantity, is_unit};
use super::two_columns::pieces;

/// Lines with content among which the header is looked for.
const MOST_TITLES: usize = 100;
/// Columns of a table, at most: guards time.
pub(super) const MOST_COLUMNS: usize = 1_000;
/// Characters of a unit, at most: to tell a row of units from a header.
const UNIT: usize = 6;

/// What separates the columns, in the order in which they are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Tab,
    Semicolon,
    Comma,
    /// One or several blanks or tabs.
    Blanks,
}

impl Separator {
    const ALL: [Self; 4] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Blanks];

    /// The character that stands between columns once blanks have become tabs.
    pub(super) fn byte(self) -> u8 {
        match self {
            Self::Tab | Self::Blanks => b'\t',
            Self::Semicolon => b';',
            Self::Comma => b',',
        }
    }

    /// The fields of a row; empty ones at its end do not count.
    fn fields(self, line: &str) -> Vec<&str> {
        let mut fields: Vec<&str> = match self {
            Self::Blanks => line.split_whitespace().take(MOST_COLUMNS).collect(),
            _ => {
                let mut quoted = false;
                let split = line.split(|c: char| {
                    quoted ^= c == '"';
                    !quoted && c == char::from(self.byte())
                });
                let fields = split.take(MOST_COLUMNS).map(str::trim);
                fields.map(|field| field.trim_matches('"').trim()).collect()
            }
        };
        while fields.last().is_some_and(|field| field.is_empty()) {
            fields.pop();
        }
        fields
    }

    /// Whether a field is a number; where commas do not separate, they may be decimal.
    fn is_number(self, field: &str) -> bool {
        field.parse::<f64>().is_ok()
            || self != Self::Comma && field.replacen(',', ".", 1).parse::<f64>().is_ok()
    }
}

/// A table within a text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    pub separator: Separator,
    /// Bytes in front of the header, or of the first row if there is none.
    pub begin: usize,
    /// Lines in front of it.
    pub lines: u64,
    /// The titles above it: each with its line.
    pub titles: Vec<(u64, String)>,
    /// The names of the columns; those of a first row that is not a header are numbers.
    pub header: Vec<String>,
    pub fit: MatchQuality,
    /// Whether it could be read as two columns of plain numbers below one line.
    pub is_plain_pair: bool,
}

/// How well a line fits as the header, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum MatchQuality {
    /// It names a deflection and a force, and numbers follow.
    Header,
    Named,
    /// Numbers follow.
    Above,
    Numbers,
}

/// A line with content.
struct Line<'a> {
    begin: usize,
    /// Counted from 1.
    number: u64,
    text: Cow<'a, str>,
}

const TITLES: usize = 3;

impl Frame {
    /// The table of a text in UTF-8; `None` if no line can be its header. `asked` are columns that the user
    /// has named; `titles`: whether lines may stand above the header.
    pub(super) fn find(text: &[u8], asked: &[&str], titles: bool) -> Option<Self> {
        let lines = lines(text, MOST_TITLES + 2);
        let most = if titles { MOST_TITLES } else { 1 };
        let candidates = (0..lines.len().min(most))
            .flat_map(|k| Separator::ALL.into_iter().map(move |separator| (k, separator)));
        let mut best: Option<(MatchQuality, usize, Separator, Vec<String>)> = None;
        for (k, separator) in candidates {
            let Some((fit, header)) = fit(&lines[k..], separator, asked) else { continue };
            // A header above numbers wins wherever it stands; else the first line that fits at all.
            let rank = |fit: MatchQuality, k: usize| (fit != MatchQuality::Header, k, fit);
            if best.as_ref().is_none_or(|(other, at, ..)| rank(fit, k) < rank(*other, *at)) {
                best = Some((fit, k, separator, header));
            }
        }
        let (fit, k, separator, header) = best?;
        let title = |line: &Line| (line.number, line.text.trim().replace('"', ""));
        let row = lines.get(k + 1).unwrap_or(&lines[k]);
        let is_plain = |line: &Line| {
            let fields = separator.fields(&line.text);
            fields.len() == 2 && fields.iter().all(|f| f.parse::<f64>().is_ok())
        };
        Some(Self {
            separator,
            begin: lines[k].begin,
            lines: lines[k].number - 1,
            titles: lines[..k].iter().map(title).collect(),
            header,
            fit,
            is_plain_pair: separator == Separator::Blanks && k == 0 && is_plain(row),
        })
    }

    /// The table whose header is the first line with content, separated as it stands there.
    pub(super) fn at_first_line(text: &[u8], separator: u8) -> Self {
        let separator = Separator::ALL.into_iter().find(|s| s.byte() == separator);
        let first = lines(text, 1).into_iter().next();
        let (begin, before) = first.map_or((text.len(), 0), |line| (line.begin, line.number - 1));
        Self {
            separator: separator.unwrap_or(Separator::Comma),
            begin,
            lines: before,
            titles: Vec::new(),
            header: Vec::new(),
            fit: MatchQuality::Named,
            is_plain_pair: false,
        }
    }

    /// What was skipped, in one line; `None` if nothing was.
    pub(super) fn note(&self) -> Option<String> {
        let ((first, _), (last, _)) = (self.titles.first()?, self.titles.last()?);
        let lines = if first == last {
            format!("line {first} is a title")
        } else {
            format!("lines {first} to {last} are titles")
        };
        let shown = self.titles.iter().take(TITLES).map(|(_, title)| super::curve::shown(title));
        let more = if self.titles.len() > TITLES { ", …" } else { "" };
        let shown: Vec<String> = shown.map(|title| format!("\"{title}\"")).collect();
        Some(format!("titles: {lines} and no part of the table: {}{more}", shown.join(", ")))
    }

    /// The table with one character between columns.
    pub(super) fn table<'a>(&self, text: &'a [u8]) -> Cow<'a, [u8]> {
        let text = &text[self.begin..];
        if self.separator != Separator::Blanks {
            return Cow::Borrowed(text);
        }
        let mut table = Vec::with_capacity(text.len());
        for (k, line) in text.split_inclusive(|&b| b == b'\n').enumerate() {
            let line = String::from_utf8_lossy(line);
            match (k, line.starts_with('#')) {
                (0, _) => table.extend(self.header.join("\t").bytes()),
                (_, true) => table.extend(line.trim_end().bytes()),
                _ => {
                    let fields: Vec<&str> = line.split_whitespace().collect();
                    table.extend(fields.join("\t").bytes());
                }
            }
            table.push(b'\n');
        }
        Cow::Owned(table)
    }
}

/// The first lines that hold more than separators and are not comments.
fn lines(text: &[u8], most: usize) -> Vec<Line<'_>> {
    let mut begin = 0;
    let split = text.split_inclusive(|&b| b == b'\n').enumerate().map(|(k, line)| {
        let at = begin;
        begin += line.len();
        Line { begin: at, number: k as u64 + 1, text: String::from_utf8_lossy(line) }
    });
    let has_content = |line: &Line<'_>| {
        let text = line.text.trim();
        !text.starts_with('#') && text.contains(|c: char| !" \t;,\"".contains(c))
    };
    split.filter(has_content).take(most).collect()
}

/// How the first of these lines fits as the header of a table, and its names.
fn fit(
    lines: &[Line<'_>],
    separator: Separator,
    asked: &[&str],
) -> Option<(MatchQuality, Vec<String>)> {
    let (first, behind) = lines.split_first()?;
    let row = |line: &Line<'_>| separator.fields(&line.text).len();
    let units =
        behind.first().is_some_and(|line| is_units(&separator.fields(&line.text), separator));
    let numbers = behind
        .get(usize::from(units))
        .filter(|line| is_row(&separator.fields(&line.text), separator));
    let header = match numbers {
        Some(numbers) => names(&first.text, separator, row(numbers)),
        None => None,
    };
    let fields = separator.fields(&first.text);
    let all_numbers = fields.len() > 1 && fields.iter().all(|field| separator.is_number(field));
    let owned = || fields.iter().map(std::string::ToString::to_string).collect();
    match header {
        _ if all_numbers => Some((MatchQuality::Numbers, owned())),
        Some(header) if names_both(&header, asked) => Some((MatchQuality::Header, header)),
        // A title of two words stands above two columns as well as a header does.
        Some(header)
            if separator == Separator::Blanks && !header.iter().any(|name| is_name(name)) =>
        {
            None
        }
        Some(header) => Some((MatchQuality::Above, header)),
        None => {
            let header: Vec<String> = owned();
            let is_header = separator != Separator::Blanks && names_both(&header, asked);
            is_header.then_some((MatchQuality::Named, header))
        }
    }
}

/// The names in a header of so many columns.
pub(super) fn names(line: &str, separator: Separator, columns: usize) -> Option<Vec<String>> {
    let owned = |names: Vec<&str>| names.into_iter().map(String::from).collect::<Vec<_>>();
    let fits = |names: &Vec<String>| names.len() == columns;
    let whole = Some(owned(separator.fields(line))).filter(fits);
    if separator != Separator::Blanks {
        return whole;
    }
    // Names may hold single blanks.
    let apart = line.trim().split("  ").flat_map(|part| part.split('\t')).map(str::trim);
    let apart = owned(apart.filter(|name| !name.is_empty()).collect());
    Some(apart).filter(fits).or(whole).or_else(|| Some(pieces(line)).filter(fits))
}

/// Whether names are those of a table's columns: a deflection and a force, or what the user has named.
pub(super) fn names_both(names: &[String], asked: &[&str]) -> bool {
    let has = |quantity: Quantity| {
        names.iter().any(|name| Label::of_column(name).is_some_and(|l| l.quantity == quantity))
    };
    let is_asked = |asked: &&str| names.iter().any(|name| name.eq_ignore_ascii_case(asked));
    if asked.iter().any(is_asked) {
        names.len() > 1
    } else {
        names.len() > 1 && has(Quantity::Deflection) && has(Quantity::Force)
    }
}

/// Whether a text names a quantity of a curve, or a unit of one.
fn is_name(text: &str) -> bool {
    Label::of_column(text).or_else(|| Label::of_axis(text)).is_some()
}

/// Whether the fields are those of a row: two or more of them numbers.
fn is_row(fields: &[&str], separator: Separator) -> bool {
    fields.iter().filter(|field| separator.is_number(field)).count() > 1
}

/// Whether the fields are units: short words or texts in brackets, one of them a unit that is known.
fn is_units(fields: &[&str], separator: Separator) -> bool {
    let is_like_one = |field: &&str| {
        let is_short = field.chars().count() <= UNIT && !field.contains(' ');
        !separator.is_number(field) && (is_short || unit_of(field) != *field)
    };
    fields.iter().all(is_like_one) && fields.iter().any(|field| is_unit(unit_of(field)))
}

/// The unit that a field of a row of units holds.
pub(super) fn unit_of(field: &str) -> &str {
    let within = |open, close| field.strip_prefix(open)?.strip_suffix(close);
    within('[', ']').or_else(|| within('(', ')')).unwrap_or(field).trim()
}

/// Whether a row of so many fields is one of units.
pub(super) fn is_row_of_units(fields: &[&str]) -> bool {
    is_units(fields, Separator::Semicolon)
}
