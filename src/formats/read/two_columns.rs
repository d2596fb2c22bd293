//! Curve of a file of two columns below titles and labels, as T/HIS writes `.cur` files.
//!
//! Lines that begin with `$` or `#` are comments. Lines in front of the first pair of numbers are
//! titles and labels: of four, the second is the x axis and the third the y axis, else those that
//! name a deflection and a force; without any, the last comment may name both. Numbers are
//! separated by blanks, tabs, commas or semicolons; `CONTINUE` ends a curve, and another may follow.

use super::Input;
use super::columns::{Columns, MAX_POINTS, Places, check_curves};
use super::curve::{Metadata, stated_units, title};
use super::curve::{Place, shown};
use super::label::{Label, Quantity};
use super::text::{lines, number};
use crate::error::{Error, error};
use crate::guess;
use crate::unit::UnitSystem;

/// Lines in front of a curve: more are another kind of file.
const HEADERS: usize = 20;

/// Whether two numbers stand below at most so many lines.
pub(super) fn recognise(input: &Input<'_>) -> bool {
    let is_data = |line: &str| !line.trim().is_empty() && !line.starts_with(['$', '#']);
    let mut data = lines(input.beginning()).filter(|(_, line)| is_data(line)).take(HEADERS);
    data.any(|(_, line)| pair(&line).is_some())
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, Error> {
    let mut file = File::read(input.text)?;
    let found = file.choose(input.options.curve.as_deref())?;
    let given = input.options.units.or(file.units);
    let mut notes = Vec::new();
    let mut sizes = [1.0; 2];
    let axes = found.axes();
    let wanted = [(Quantity::Deflection, "first"), (Quantity::Force, "second")];
    for (k, (quantity, which)) in wanted.into_iter().enumerate() {
        let (line, text, label) = axes[k].clone().unwrap_or_else(|| {
            let label = Label { quantity, unit: None };
            (found.lines.first().copied().unwrap_or(1), format!("the {which} column"), label)
        });
        if label.quantity != quantity {
            return Err(error!(
                CurveFile,
                "{place}: expected {expected}, found \"{found}\"",
                expected = format!("a {} in the {which} column", quantity.name()),
                found = shown(&text),
                place = Place::Line(line)
            ));
        }
        sizes[k] = label.size(&text, given, Place::Line(line))?;
        notes.push(match (&label.unit, given) {
            (None, Some(units)) => format!("{}: in units {units} as given", quantity.name()),
            _ => format!("{}: \"{}\" of line {line} says its unit", quantity.name(), shown(&text)),
        });
    }
    let all_given = axes.iter().flatten().all(|(_, _, label)| label.unit.is_none());
    Ok(Columns {
        deflection_m: found.points.iter().map(|(x, _)| x * sizes[0]).collect(),
        force_n: found.points.iter().map(|(_, y)| y * sizes[1]).collect(),
        facts: file.facts,
        title: title(&found.name(), &mut notes),
        units: given.filter(|_| all_given),
        notes,
        ..Columns::at(Places::Lines(found.lines))
    })
}

/// An axis: its line, its text, and what that names.
type Axis = (u64, String, Label);

#[derive(Default)]
struct Found {
    /// Titles and labels with their lines.
    headers: Vec<(u64, String)>,
    /// The last comment in front of the points.
    comment: Option<(u64, String)>,
    points: Vec<(f64, f64)>,
    lines: Vec<u64>,
}

impl Found {
    /// The curve's label, else its title.
    fn name(&self) -> String {
        let header =
            if self.headers.len() == 4 { self.headers.last() } else { self.headers.first() };
        header.map_or(String::new(), |(_, text)| text.clone())
    }

    /// What the first and the second column are, as far as the file says.
    fn axes(&self) -> [Option<Axis>; 2] {
        if let [_, x, y, _] = &self.headers[..] {
            return [x, y].map(|(line, text)| {
                Label::of_axis(text).map(|label| (*line, text.clone(), label))
            });
        }
        let lines =
            self.headers.iter().chain(self.comment.iter().filter(|_| self.headers.is_empty()));
        let mut named = lines.flat_map(|(line, text)| {
            pieces(text).into_iter().filter_map(|piece| {
                Label::of_axis(&piece).map(|label| (*line, piece.clone(), label))
            })
        });
        [named.next(), named.next()]
    }
}

/// A text that names two axes, apart: behind a bracket, or at tabs, commas or several blanks.
pub(super) fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = vec![String::new()];
    for word in text.split([' ', '\t', ',', ';']) {
        let last = pieces.len() - 1;
        let is_closed = pieces[last].ends_with([']', ')']);
        let is_label = Label::parse(&pieces[last]).is_some_and(|label| label.unit.is_some());
        if !word.is_empty() && (is_closed || is_label) {
            pieces.push(word.into());
        } else if !word.is_empty() {
            let piece = &mut pieces[last];
            if !piece.is_empty() {
                piece.push(' ');
            }
            piece.push_str(word);
        }
    }
    pieces
}

struct File {
    curves: Vec<Found>,
    facts: Metadata,
    units: Option<UnitSystem>,
}

impl File {
    fn read(bytes: &[u8]) -> Result<Self, Error> {
        let mut file =
            Self { curves: vec![Found::default()], facts: Metadata::default(), units: None };
        for (at, line) in lines(bytes) {
            if let Some(comment) = line.strip_prefix(['$', '#']) {
                let comment = comment.trim_start_matches(['$', '#']).trim();
                file.facts.take(&line[..1], comment, Place::Line(at))?;
                file.units = file.units.or(stated_units(comment));
                if let Some(last) = file.curves.last_mut().filter(|c| c.points.is_empty()) {
                    last.comment = Some((at, label(comment)));
                }
                continue;
            }
            if line.trim().is_empty() {
                continue;
            }
            if line.trim().eq_ignore_ascii_case("CONTINUE") {
                file.curves.push(Found::default());
                check_curves(file.curves.len())?;
                continue;
            }
            if let Some(last) = file.curves.last_mut() {
                last.take(&line, at)?;
            }
        }
        file.curves.retain(|curve| !curve.points.is_empty());
        Ok(file)
    }

    /// The curve of that number or name, or the only one.
    fn choose(&mut self, asked: Option<&str>) -> Result<Found, Error> {
        let known = || {
            let curves = self.curves.iter().enumerate().take(20);
            curves
                .map(|(k, c)| format!("{} (\"{}\")", k + 1, shown(&c.name())))
                .collect::<Vec<_>>()
                .join(", ")
        };
        let at = match (asked, self.curves.len()) {
            (_, 0) => {
                let expected = "a curve: lines of two numbers";
                return Err(error!(
                    CurveFile,
                    "expected {expected}, found {found}",
                    found = "no such line"
                ));
            }
            (None, 1) => 0,
            (None, _) => {
                return Err(error!(
                    CurveFile,
                    "the file holds several curves: choose one with --curve: {known}",
                    known = known()
                ));
            }
            (Some(asked), _) => {
                let by_name = self.curves.iter().position(|c| c.name().trim() == asked.trim());
                let by_number = asked.trim().parse::<usize>().ok().and_then(|n| n.checked_sub(1));
                by_name.or(by_number.filter(|k| *k < self.curves.len())).ok_or_else(|| {
                    let asked = shown(asked);
                    let known = known();
                    error!(
                        CurveFile,
                        "the file has no curve \"{asked}\": it has {known}{}",
                        guess::hint(&asked, &known)
                    )
                })?
            }
        };
        Ok(self.curves.swap_remove(at))
    }
}

impl Found {
    fn take(&mut self, line: &str, at: u64) -> Result<(), Error> {
        if let Some(pair) = pair(line) {
            self.points.push(pair);
            self.lines.push(at);
            return if self.points.len() > MAX_POINTS {
                Err(error!(
                    CurveFile,
                    "the curve has more than {most} points: thin it",
                    most = MAX_POINTS
                ))
            } else {
                Ok(())
            };
        }
        if self.points.is_empty() && self.headers.len() < HEADERS {
            self.headers.push((at, label(line)));
            return Ok(());
        }
        let wrong = words(line).enumerate().find(|(_, word)| number(word).is_none());
        Err(match wrong {
            Some((field, word)) if words(line).count() == 2 => {
                let place = Place::Field { line: at, field: field + 1 };
                error!(
                    CurveFile,
                    "{place}: expected a number, found \"{found}\"",
                    found = shown(word)
                )
            }
            _ => error!(
                CurveFile,
                "{place}: expected {expected}, found \"{found}\"",
                expected = "two numbers, or CONTINUE behind a curve",
                found = shown(line),
                place = Place::Line(at)
            ),
        })
    }
}

/// Characters of a title or label that are looked at.
const LABEL: usize = 300;

fn label(line: &str) -> String {
    line.trim().chars().take(LABEL).collect()
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty())
}

/// The two numbers that a line holds, and nothing else.
fn pair(line: &str) -> Option<(f64, f64)> {
    let mut words = words(line);
    let pair = (number(words.next()?)?, number(words.next()?)?);
    words.next().is_none().then_some(pair)
}
