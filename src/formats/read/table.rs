//! Tables of numbers in a text: titles, a header, a row of units, rows; or curves of two columns, one after the other.
//!
//! The header is the first line that names the required columns and is followed by a row with the same number of values, with or
//! without a row of units in between; otherwise the first line above such a row. Columns are separated by tabs, semicolons,
//! commas or blanks, whichever gives the header and the row below it the same number of fields. Lines that begin with
//! `#` or `$` are comments.
//!
//! Curves of two columns follow below titles and labels: of four lines the second is the x axis and the third the y axis,
//! else those that name a quantity; without any, the last comment may name both. `CONTINUE` or `endcurve` ends a curve,
//! and another may follow; `NAME #pts=N` begins one of a `Curveplot` file, whose labels are those of all its curves.

use super::columns::check_curves;
use super::curve::{CUT, Place, expected, miscounted, shown, value};
use super::encoding::{lines, number};
use super::label::{Label, Quantity, is_unit};
use crate::error::{Error, error};

/// Lines with content among which the header is looked for.
const MOST_TITLES: usize = 100;
/// Columns of a table, at most: guards time.
const MOST_COLUMNS: usize = 1_000;
/// Maximum characters of a unit, to distinguish a row of units from a header.
const UNIT: usize = 6;
/// Lines before a curve of two columns; more mean another kind of file.
const HEADS: usize = 20;
/// Characters of such a line that are examined.
const LABEL: usize = 300;
/// Words between two quantities of a title, the first of which is in the second column.
const VERSUS: [&str; 6] = ["vs", "vs.", "versus", "over", "against", "über"];
/// Titles that a note repeats.
const TITLES: usize = 3;

/// What separates the columns; the first four in the order in which they are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Tab,
    Semicolon,
    Comma,
    /// One or several blanks or tabs.
    Blanks,
    /// Any of these, as curves of two columns have them.
    Any,
}

impl Separator {
    const OF_TABLES: [Self; 4] = [Self::Tab, Self::Semicolon, Self::Comma, Self::Blanks];

    fn separates(self, c: char) -> bool {
        match self {
            Self::Tab => c == '\t',
            Self::Semicolon => c == ';',
            Self::Comma => c == ',',
            Self::Blanks => c.is_whitespace(),
            Self::Any => c.is_whitespace() || c == ',' || c == ';',
        }
    }

    /// The fields of a row, and how many there are with the empty ones at its end, which do not count.
    fn fields(self, line: &str) -> (Vec<&str>, usize) {
        let mut quoted = false;
        let split = line.split(|c: char| {
            quoted ^= c == '"';
            !quoted && self.separates(c)
        });
        let mut fields: Vec<&str> = if matches!(self, Self::Blanks | Self::Any) {
            let split = line.split(|c| self.separates(c)).filter(|field| !field.is_empty());
            split.take(MOST_COLUMNS).collect()
        } else {
            split.take(MOST_COLUMNS).map(|f| f.trim().trim_matches('"').trim()).collect()
        };
        let all = fields.len();
        while fields.last().is_some_and(|field| field.is_empty()) {
            fields.pop();
        }
        (fields, all)
    }

    /// The number in a field, which may be NaN or infinite; where commas do not separate, they may be decimal.
    fn any_number(self, field: &str) -> Option<f64> {
        match self {
            Self::Any => number(field),
            Self::Comma => field.parse().ok(),
            _ if field.contains('.') => field.parse().ok(),
            _ => field.replacen(',', ".", 1).parse().ok(),
        }
    }

    /// The sign in a field that is read as decimal, where both may be.
    fn decimal(self, field: &str) -> Option<char> {
        let is_either = !matches!(self, Self::Any | Self::Comma);
        field.chars().find(|c| is_either && matches!(c, '.' | ','))
    }

    /// Whether a field is meant as a number.
    fn is_number(self, field: &str) -> bool {
        self.any_number(field).is_some()
    }

    /// Whether the fields of a line are those of a row: two or more of them numbers.
    fn is_row(self, line: &str) -> bool {
        self.fields(line).0.iter().filter(|field| self.is_number(field)).count() > 1
    }

    /// Whether the fields are units: short words or texts in brackets, one of them a unit that is known.
    fn is_units(self, line: &str) -> bool {
        let fields = self.fields(line).0;
        let is_like_one = |field: &&str| {
            let is_short = field.chars().count() <= UNIT && !field.contains(' ');
            !self.is_number(field) && (is_short || unit_of(field) != *field)
        };
        fields.iter().all(is_like_one) && fields.iter().any(|field| is_unit(unit_of(field)))
    }

    /// The names in a header of as many columns as the row below it has.
    fn names(self, line: &str, row: &str) -> Option<Vec<String>> {
        let (columns, all) = self.fields(row);
        let columns = columns.len();
        let owned = |names: Vec<&str>| names.into_iter().map(String::from).collect::<Vec<_>>();
        let whole = owned(self.fields(line).0);
        if self != Self::Blanks {
            // The last fields of the row may be empty.
            return Some(whole).filter(|names| (columns..=all).contains(&names.len()));
        }
        let fits = |names: &Vec<String>| names.len() == columns && !is_title(names);
        // Names may hold single blanks, and a unit in brackets is not a name.
        let apart = line.trim().split("  ").flat_map(|part| part.split('\t')).map(str::trim);
        let apart = owned(apart.filter(|name| !name.is_empty()).collect());
        let is_split = whole.iter().all(|name| !name.starts_with(['[', '(', '<']));
        let whole = Some(whole).filter(|names| is_split && fits(names));
        Some(apart).filter(fits).or(whole).or_else(|| Some(pieces(line)).filter(fits))
    }
}

/// Purpose of reading a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Force over deflection.
    Curve,
    /// Values over time.
    History,
}

/// How well a line matches as the header, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Fit {
    /// It names the required quantities, and numbers follow.
    Header,
    Named,
    /// Numbers follow.
    Above,
    /// There is no header.
    Numbers,
}

/// A table within a text.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    /// The lines above it: each with its number.
    pub titles: Vec<(u64, String)>,
    /// The names of its columns, each with its line; none if it has none.
    pub names: Vec<(u64, String)>,
    /// The row below the header that holds units.
    pub units: Option<Row<'a>>,
    pub fit: Fit,
    /// The curve's own name, where each of several has one.
    pub name: String,
    /// Points that the file declares, and the line in which it does.
    declared: Option<(u64, String)>,
    pub columns: usize,
    separator: Separator,
    /// From the first row on, and how many lines are before that.
    rest: &'a str,
    before: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Row<'a> {
    pub line: u64,
    pub fields: Vec<&'a str>,
    separator: Separator,
}

impl<'a> Row<'a> {
    /// The text of a field, counted from 0; empty if there is none.
    pub(super) fn field(&self, field: usize) -> &'a str {
        self.fields.get(field).copied().unwrap_or_default()
    }

    /// The finite number in a field, or the text that is there.
    pub(super) fn number(&self, field: usize) -> Result<f64, &'a str> {
        let found = self.field(field);
        self.separator.any_number(found).filter(|value| value.is_finite()).ok_or(found)
    }
}

impl<'a> Table<'a> {
    /// The table of a text. `asked` are columns that the user has named.
    pub(super) fn of(text: &'a str, purpose: Purpose, asked: &[&str]) -> Self {
        let first: Vec<(u64, &str)> =
            lines(text).filter(|(_, line)| has_content(line)).take(MOST_TITLES + 2).collect();
        let is_header = |names: &[String]| names_all(names, purpose, asked);
        let candidates = (0..first.len().min(MOST_TITLES))
            .flat_map(|k| Separator::OF_TABLES.into_iter().map(move |separator| (k, separator)))
            .filter_map(|(k, separator)| {
                let (fit, names) = fit(&first[k..], separator, &is_header)?;
                Some((fit, k, separator, names))
            });
        // A header above numbers takes precedence; otherwise the first line that matches at all.
        let best = candidates.min_by_key(|(fit, k, ..)| (*fit != Fit::Header, *k, *fit));
        let (fit, k, separator, names) = best.unwrap_or_else(|| {
            // Nothing fits: report what is wrong with the first line.
            let line = first.first().map_or("", |(_, line)| line);
            let of = |c| Separator::OF_TABLES[..3].iter().copied().find(|s| s.separates(c));
            let separator = line.chars().find_map(of).unwrap_or(Separator::Comma);
            let names = separator.fields(line).0.into_iter().map(String::from).collect();
            (Fit::Above, 0, separator, names)
        });
        let row = |k: usize| first.get(k).map(|(line, text)| row(*line, text, separator));
        let has_header = fit != Fit::Numbers;
        let header_line = first.get(k).map_or(1, |(line, _)| *line);
        let is_units = |k: usize| first.get(k).is_some_and(|(_, text)| separator.is_units(text));
        let units = row(k + 1).filter(|_| has_header && is_units(k + 1));
        let begin = first.get(k + usize::from(has_header) + usize::from(units.is_some()));
        Self {
            titles: first[..k.min(first.len())]
                .iter()
                .map(|(line, text)| (*line, text.trim().replace('"', "")))
                .collect(),
            columns: if has_header { names.len() } else { row(k).map_or(0, |r| r.fields.len()) },
            names: names.into_iter().filter(|_| has_header).map(|n| (header_line, n)).collect(),
            units,
            fit,
            name: String::new(),
            declared: None,
            separator,
            rest: begin.map_or("", |(_, line)| &text[offset(text, line)..]),
            before: begin.map_or(0, |(line, _)| line - 1),
        }
    }

    /// The curves of two columns in a text, one after the other.
    pub(super) fn pairs(text: &'a str) -> Result<Vec<Self>, Error> {
        let mut tables: Vec<Self> = Vec::new();
        let (mut heads, mut shared): (Vec<(u64, String)>, Vec<_>) = Default::default();
        let (mut comment, mut declared, mut curves) = (None, None, 1);
        // Whether rows of the last table continue.
        let mut is_open = false;
        let end = |tables: &mut Vec<Self>, is_open: &mut bool, line: &str| {
            if let Some(last) = tables.last_mut().filter(|_| *is_open) {
                last.rest = &last.rest[..offset(last.rest, line)];
            }
            *is_open = false;
        };
        for (at, line) in lines(text) {
            let trimmed = line.trim();
            if let Some((name, points)) = trimmed.split_once("#pts=") {
                end(&mut tables, &mut is_open, line);
                if !heads.is_empty() {
                    shared = std::mem::take(&mut heads);
                    shared.retain(|(_, head)| !head.eq_ignore_ascii_case("curveplot"));
                    shared.truncate(3);
                }
                heads = shared.clone();
                heads.push((at, label(name)));
                declared = Some((at, points.trim().to_string()));
                curves += 1;
            } else if ["continue", "endcurve"].contains(&&*trimmed.to_ascii_lowercase()) {
                end(&mut tables, &mut is_open, line);
                (heads, comment, declared) = (Vec::new(), None, None);
                curves += usize::from(trimmed.eq_ignore_ascii_case("continue"));
            } else if is_open || trimmed.is_empty() || declared.is_some() && line.starts_with('*') {
            } else if trimmed.starts_with(['#', '$']) {
                comment = Some((at, label(trimmed.trim_start_matches(['$', '#']))));
            } else if is_pair(line) {
                let titles = std::mem::take(&mut heads);
                check_last(&titles)?;
                let name = if titles.len() == 4 { titles.last() } else { titles.first() };
                tables.push(Self {
                    name: name.map_or(String::new(), |(_, text)| text.clone()),
                    names: axes(&titles, comment.take(), line),
                    titles,
                    units: None,
                    fit: Fit::Numbers,
                    declared: declared.take(),
                    columns: 2,
                    separator: Separator::Any,
                    rest: &text[offset(text, line)..],
                    before: at - 1,
                });
                is_open = true;
            } else if heads.len() < HEADS {
                heads.push((at, label(line)));
            } else {
                return Err(not_two(at, line));
            }
            check_curves(curves)?;
        }
        Ok(tables)
    }

    /// Whether its names are those of the axes of a curve.
    pub(super) fn has_axes(&self) -> bool {
        self.separator == Separator::Any
    }

    pub(super) fn line(&self) -> u64 {
        self.names.first().map_or(self.before + 1, |(line, _)| *line)
    }

    /// The line of its header or, without one, of its first row.
    pub(super) fn begin(&self) -> u64 {
        if self.fit == Fit::Numbers { self.before + 1 } else { self.line() }
    }

    /// Whether it is two plain columns with blanks between, below one line at most.
    pub(super) fn is_plain_pair(&self) -> bool {
        let is_plain = |row: Row| row.fields.iter().all(|field| field.parse::<f64>().is_ok());
        self.separator == Separator::Blanks
            && self.titles.is_empty()
            && self.units.is_none()
            && self.columns == 2
            && self.rows().take(HEADS).all(is_plain)
    }

    /// The fields of its first row, in a message.
    pub(super) fn first_row(&self) -> String {
        self.rows().next().map_or(String::new(), |row| row.fields.join(" "))
    }

    /// The names that a comment above a table without a header gives its columns.
    pub(super) fn named_by(&mut self, line: u64, comment: &str) {
        let first = lines(self.rest).find(|(_, line)| has_content(line));
        let names = first.and_then(|(_, row)| self.separator.names(comment, row));
        let names = names.filter(|names| names_all(names, Purpose::Curve, &[]));
        self.names = names.into_iter().flatten().map(|name| (line, name)).collect();
    }

    /// Skipped lines in one note; `None` if there are none.
    pub(super) fn note(&self) -> Option<String> {
        let ((first, _), (last, _)) = (self.titles.first()?, self.titles.last()?);
        let lines = if first == last {
            format!("line {first} is a title")
        } else {
            format!("lines {first} to {last} are titles")
        };
        let shown = self.titles.iter().take(TITLES).map(|(_, title)| shown(title));
        let more = if self.titles.len() > TITLES { ", …" } else { "" };
        let shown: Vec<String> = shown.map(|title| format!("\"{title}\"")).collect();
        Some(format!("titles: {lines}, not part of the table: {}{more}", shown.join(", ")))
    }

    /// The rows in their order; those of separators alone, as spreadsheets write them, are not.
    fn rows(&self) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let (separator, before) = (self.separator, self.before);
        let rows = lines(self.rest).filter(|(_, line)| has_content(line));
        rows.map(move |(line, text)| row(before + line, text, separator))
    }

    /// Gives each row to `take`, and refuses rows that have other columns than the table, and points beside commas in the numbers of the
    /// columns `used` if one of them separates thousands.
    pub(super) fn each_row(
        &self,
        used: &[usize],
        mut take: impl FnMut(&Row) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut rows = 0;
        let mut signs = vec![Signs::default(); used.len()];
        for row in self.rows() {
            for (&column, signs) in used.iter().zip(&mut signs) {
                signs.see(self.separator, &row, column)?;
            }
            let found = row.fields.len();
            if self.has_axes() && found != 2 {
                return Err(not_two(row.line, &row.fields.join(" ")));
            }
            let is_less = found < self.columns && self.separator == Separator::Blanks;
            if found > self.columns || is_less {
                // A missing number is reported by its user.
                if is_less {
                    take(&row)?;
                }
                let remedy = if self.separator == Separator::Comma {
                    "write decimal points, or semicolons between columns, and name every column in the header"
                } else {
                    "name every column in the header, and leave none empty where blanks separate them"
                };
                return Err(error!(
                    CurveFile,
                    "{place}: expected {columns} fields, one for each column of the table, found {found}: {remedy}",
                    columns = self.columns,
                    place = Place::Line(row.line)
                ));
            }
            take(&row)?;
            rows += 1;
        }
        let separates = signs.iter().filter(|of| of.separates_thousands());
        for of in separates.filter_map(|of| of.first.as_ref()) {
            let others = signs.iter().filter_map(|other| other.first.as_ref());
            if let Some(other) = others.into_iter().find(|other| other.sign != of.sign) {
                return Err(of.differs_from(other));
            }
        }
        match &self.declared {
            Some((line, declared)) if declared.parse() != Ok(rows) => Err(miscounted(
                Place::Line(*line),
                "the curve",
                format_args!("{} points (#pts)", shown(declared)),
                format_args!("{rows} for it"),
                CUT,
            )),
            _ => Ok(()),
        }
    }
}

/// The first number of a column that has a sign that may be decimal.
#[derive(Clone)]
struct Signed {
    sign: char,
    place: (u64, usize),
    text: String,
}

impl Signed {
    fn differs_from(&self, other: &Self) -> Error {
        error!(
            CurveFile,
            "{place}: \"{text}\" has the sign \"{sign}\", and \"{other}\" in line {line} the sign \"{another}\": only one of them can be decimal; write numbers without separators of thousands",
            place = Place::Field { line: self.place.0, field: self.place.1 + 1 },
            text = shown(&self.text),
            sign = self.sign,
            other = shown(&other.text),
            line = other.place.0,
            another = other.sign
        )
    }
}

/// The signs of a column that may be decimal.
#[derive(Clone, Default)]
struct Signs {
    first: Option<Signed>,
    /// A number without one, other than 0.
    has_whole: bool,
    /// One with other than three digits behind it, or with more than three before.
    has_other: bool,
}

impl Signs {
    fn see(&mut self, separator: Separator, row: &Row, column: usize) -> Result<(), Error> {
        let text = row.field(column);
        let Some(sign) = separator.decimal(text) else {
            self.has_whole |= text.bytes().any(|b| (b'1'..=b'9').contains(&b));
            return Ok(());
        };
        if self.first.as_ref().is_none_or(|first| first.sign != sign) {
            if !separator.is_number(text) {
                return Ok(());
            }
            let now = Signed { sign, place: (row.line, column), text: text.into() };
            match &self.first {
                Some(first) => return Err(now.differs_from(first)),
                None => self.first = Some(now),
            }
        }
        let (before, behind) = text.split_once(sign).unwrap_or_default();
        let is_digits = |digits: &str| digits.bytes().all(|b| b.is_ascii_digit());
        let before = before.trim_start_matches(['+', '-']);
        let is_thousands = is_digits(behind)
            && behind.len() == 3
            && is_digits(before)
            && (1..=3).contains(&before.len());
        self.has_other |= !is_thousands;
        Ok(())
    }

    /// Whether all signs stand where thousands end, beside numbers that have none.
    fn separates_thousands(&self) -> bool {
        self.first.is_some() && self.has_whole && !self.has_other
    }
}

/// Where a line of a text begins.
fn offset(text: &str, line: &str) -> usize {
    line.as_ptr() as usize - text.as_ptr() as usize
}

fn row(line: u64, text: &str, separator: Separator) -> Row<'_> {
    Row { line, fields: separator.fields(text).0, separator }
}

/// Whether a line holds more than separators and is not a comment.
fn has_content(line: &str) -> bool {
    let text = line.trim();
    !text.starts_with(['#', '$']) && text.contains(|c: char| !" \t;,\"".contains(c))
}

fn label(line: &str) -> String {
    line.trim().chars().take(LABEL).collect()
}

/// Whether a line holds two numbers and nothing else.
pub(super) fn is_pair(line: &str) -> bool {
    let (fields, _) = Separator::Any.fields(line);
    fields.len() == 2 && fields.iter().all(|field| number(field).is_some())
}

fn not_two(line: u64, found: &str) -> Error {
    expected(Place::Line(line), "two numbers, or CONTINUE after a curve", found)
}

/// How the first of these lines fits as the header of a table, and its names.
fn fit(
    lines: &[(u64, &str)],
    separator: Separator,
    is_header: &dyn Fn(&[String]) -> bool,
) -> Option<(Fit, Vec<String>)> {
    let (first, behind) = (lines.first()?.1, &lines[1..]);
    let (fields, _) = separator.fields(first);
    if fields.len() > 1 && fields.iter().all(|field| separator.is_number(field)) {
        return Some((Fit::Numbers, Vec::new()));
    }
    let units = behind.first().is_some_and(|(_, line)| separator.is_units(line));
    let row = behind.get(usize::from(units)).filter(|(_, line)| separator.is_row(line));
    // Whether a text names a quantity of a curve, or a unit of one.
    let is_name = |n: &String| Label::of_axis(n).or_else(|| Label::of_column(n)).is_some();
    match row.and_then(|(_, row)| separator.names(first, row)) {
        Some(names) if is_header(&names) => Some((Fit::Header, names)),
        // A title of two words is above two columns as well as a header does.
        Some(names) if separator == Separator::Blanks && !names.iter().any(is_name) => None,
        Some(names) => Some((Fit::Above, names)),
        None => {
            let names: Vec<String> = fields.into_iter().map(String::from).collect();
            let is_header = separator != Separator::Blanks && is_header(&names);
            is_header.then_some((Fit::Named, names))
        }
    }
}

/// Whether names are parts of a title such as `Force (N) over displacement (m)`.
fn is_title(names: &[String]) -> bool {
    let first = |name: &String| name.split_whitespace().next().unwrap_or_default().to_lowercase();
    names.iter().any(|name| VERSUS.contains(&&*first(name)))
}

/// Whether names are those of the columns that are looked for, or what the user has named.
pub(super) fn names_all(names: &[String], purpose: Purpose, asked: &[&str]) -> bool {
    let has = |quantity: Quantity| {
        names.iter().any(|name| Label::of_column(name).is_some_and(|l| l.quantity == quantity))
    };
    let is_asked = |asked: &&str| names.iter().any(|name| name.eq_ignore_ascii_case(asked));
    names.len() > 1
        && !is_title(names)
        && (asked.iter().any(is_asked)
            || match purpose {
                Purpose::Curve => has(Quantity::Deflection) && has(Quantity::Force),
                Purpose::History => has(Quantity::Time),
            })
}

/// The unit that a field of a row of units holds.
pub(super) fn unit_of(field: &str) -> &str {
    let within = |open, close| field.strip_prefix(open)?.strip_suffix(close);
    within('[', ']').or_else(|| within('(', ')')).unwrap_or(field).trim()
}

/// Refuses a line above the rows that begins as they do: its second number is damaged. `36 km/h` is a title.
pub(super) fn check_last(heads: &[(u64, String)]) -> Result<(), Error> {
    let Some((line, head)) = heads.last() else { return Ok(()) };
    let is_word = |text: &str| {
        let has = |of: fn(char) -> bool| text.contains(of);
        has(char::is_alphabetic) && !has(|c| c.is_ascii_digit()) && text.parse::<f64>().is_err()
    };
    match Separator::Any.fields(head).0[..] {
        [first, second] if number(first).is_some() && !is_word(second) => {
            value(Place::Field { line: *line, field: 2 }, second).map(|_| ())
        }
        _ => Ok(()),
    }
}

/// The names of the two axes of a curve, as far as the lines above its first row name them.
fn axes(heads: &[(u64, String)], comment: Option<(u64, String)>, row: &str) -> Vec<(u64, String)> {
    if let [_, x, y, _] = heads {
        return vec![x.clone(), y.clone()];
    }
    let header = heads.last().and_then(|(line, text)| {
        let names = Separator::Blanks.names(text, row)?;
        names_all(&names, Purpose::Curve, &[]).then(|| names.into_iter().map(|n| (*line, n)))
    });
    if let Some(header) = header {
        return header.collect();
    }
    let comment = comment.filter(|_| heads.is_empty());
    let named = heads.iter().chain(&comment).flat_map(|(line, text)| {
        let pieces = pieces(text).into_iter().filter(|piece| Label::of_axis(piece).is_some());
        pieces.map(move |piece| (*line, piece))
    });
    let mut axes: Vec<_> = named.take(2).collect();
    if let [(line, _)] = axes[..] {
        axes.push((line, "the second column".into()));
    }
    axes
}

/// A text that names several columns, apart: after a bracket or a unit.
fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = vec![String::new()];
    for word in Separator::Any.fields(text).0 {
        let last = pieces.len() - 1;
        let is_closed = pieces[last].ends_with([']', ')', '>']);
        let is_label = Label::parse(&pieces[last]).is_some_and(|label| label.unit.is_some());
        if is_closed || is_label {
            pieces.push(word.into());
            continue;
        }
        let piece = &mut pieces[last];
        if !piece.is_empty() {
            piece.push(' ');
        }
        piece.push_str(word);
    }
    pieces
}
