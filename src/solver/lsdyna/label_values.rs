//! Rows of labels and numbers (`xforce=   1.0000E+00   yforce= …`): where the numbers are.
//!
//! A number is the text between its label and the next one, so that a label that comes or
//! goes with a release, and a gap of another width, change nothing. Within one file widths stay:
//! once numbers fill their usual columns, one that does not has lost some of its digits.

use super::line::{Line, is_whole_real};
use crate::solver::problem::{Diagnostics, Place, ProblemCode};
use crate::solver::states::StateReader;

/// A component and its label, which ends with `=`.
pub(crate) type Label = (&'static str, &'static str);

/// How wide the numbers after each label of a file are, and where that was first seen.
#[derive(Clone, Default)]
pub(crate) struct Widths {
    of: Vec<Width>,
    /// Labels come in the same order in every state.
    next: usize,
}

#[derive(Clone)]
struct Width {
    label: String,
    excess: isize,
    /// Where it was first seen, and whether more than once.
    place: Place,
    is_confirmed: bool,
}

/// Labels whose widths are noted; real files have about thirty.
const MAX_LABELS: usize = 1_000;

impl Widths {
    /// Whether the widths are the same, however often they were seen.
    pub(crate) fn agrees(&self, other: &Self) -> bool {
        let widths =
            |of: &Self| of.of.iter().map(|w| (w.label.clone(), w.excess)).collect::<Vec<_>>();
        widths(self) == widths(other)
    }

    /// Whether a number that is so much wider than usual can be that of the label. A first one that those below do not
    /// confirm is reported.
    pub(crate) fn allow(
        &mut self,
        label: &str,
        excess: isize,
        place: Place,
        problems: &mut Diagnostics,
    ) -> bool {
        let is_it = |at: &usize| self.of.get(*at).is_some_and(|of| of.label == label);
        let hint = Some(self.next).filter(is_it);
        let Some(at) = hint.or_else(|| self.of.iter().position(|of| of.label == label)) else {
            if self.of.len() < MAX_LABELS {
                self.of.push(Width { label: label.into(), excess, place, is_confirmed: false });
            }
            return true;
        };
        self.next = (at + 1) % self.of.len();
        let known = &mut self.of[at];
        if excess == known.excess {
            known.is_confirmed = true;
            return true;
        }
        let is_first_odd = known.excess != 0 && (excess == 0 || !known.is_confirmed);
        if is_first_odd {
            let message =
                format!("the number of \"{label}\" is not as wide as those below: was it cut?");
            problems.add(ProblemCode::BadLine, Some(known.place), message);
            (known.excess, known.place, known.is_confirmed) = (excess, place, false);
        }
        is_first_odd
    }
}

/// First and last column of every component's number, which usually has `width` columns; `None` for
/// labels that the line does not have. `None` for the row if something else than one number is
/// after a label.
pub(crate) fn fields(
    line: &Line<'_>,
    labels: &[Label],
    width: usize,
    states: &mut StateReader<'_>,
) -> Option<Vec<Option<(usize, usize)>>> {
    let text = line.text.trim_ascii_end();
    // Beginning and end of each label, and which of the components it names.
    let mut marks: Vec<(usize, usize, Option<usize>)> = Vec::new();
    let equals: Vec<usize> = memchr::memchr_iter(b'=', text).collect();
    for (k, (_, label)) in labels.iter().enumerate() {
        let ends_here = |at: &&usize| text[..=**at].ends_with(label.as_bytes());
        let mut found = equals.iter().filter(ends_here);
        let Some(at) = found.next() else { continue };
        // A label that is there twice: two rows were joined.
        if found.next().is_some() {
            return None;
        }
        marks.push((at + 1 - label.len(), at + 1, Some(k)));
    }
    if marks.is_empty() {
        return None;
    }
    for equals in equals {
        if !marks.iter().any(|&(from, to, _)| (from..to).contains(&equals)) {
            let word = text[..equals].trim_ascii_end();
            let start = word.iter().rposition(u8::is_ascii_whitespace).map_or(0, |at| at + 1);
            marks.push((start, equals + 1, None));
        }
    }
    marks.sort_unstable();
    let ends = marks.iter().skip(1).map(|mark| mark.0).chain([text.len()]);
    let mut fields = vec![None; labels.len()];
    for (&(_, from, known), to) in marks.iter().zip(ends) {
        let value = text.get(from..to)?.trim_ascii_end();
        if let Some(k) = known {
            if !(is_number(value, width)
                && states.allows_width(labels[k].1, value.len(), width, line))
            {
                return None;
            }
            fields[k] = Some((from + 1, from + value.len()));
        } else if value.is_empty() {
            return None;
        }
    }
    // Stars outside a number: lines were overwritten, and what is after is of another.
    let in_number =
        |at: usize| fields.iter().flatten().any(|&(from, to)| (from..=to).contains(&(at + 1)));
    let stars = memchr::memchr_iter(b'*', text).any(|at| !in_number(at));
    (!stars).then_some(fields)
}

/// Whether the text after a label is one number: a whole one, or, whatever it holds, one
/// that fills the usual width.
pub(crate) fn is_number(text: &[u8], width: usize) -> bool {
    text.len() == width || is_whole_real(text.trim_ascii())
}

/// First and last column of the `count` numbers between the bytes `from` and `to`: apart from
/// each other, or in columns of the usual width that end at `to`.
pub(crate) fn numbers(
    line: &Line<'_>,
    from: usize,
    to: usize,
    count: usize,
    width: usize,
) -> Option<Vec<(usize, usize)>> {
    let text = line.text.get(from..to)?;
    let mut apart = Vec::with_capacity(count);
    let mut at = 0;
    while let Some(start) = text[at..].iter().position(|b| !b.is_ascii_whitespace()) {
        let start = at + start;
        let length = text[start..].iter().position(u8::is_ascii_whitespace);
        at = length.map_or(text.len(), |length| start + length);
        if apart.len() == count || !is_whole_real(&text[start..at]) {
            apart.clear();
            break;
        }
        apart.push((from + start + 1, from + at));
    }
    if apart.len() == count {
        return Some(apart);
    }
    let first = to.checked_sub(count * width).filter(|&first| first >= from)?;
    let is_apart = line.text[from..first].trim_ascii().is_empty();
    is_apart.then(|| (0..count).map(|k| (first + k * width + 1, first + (k + 1) * width)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Selection;

    fn values(text: &str) -> Option<Vec<Option<String>>> {
        let line = Line { text: text.as_bytes(), number: 1, byte: 0, ended: true, overlong: false };
        let selection = Selection::all();
        let mut states = StateReader::new(&selection);
        let fields = fields(&line, &[("a", "x="), ("b", "y=")], 10, &mut states)?;
        let of = |field: &Option<(usize, usize)>| {
            field.map(|(from, to)| text[from - 1..to].trim().to_string())
        };
        Some(fields.iter().map(of).collect())
    }

    #[test]
    fn a_number_is_what_stands_behind_its_label() {
        let (a, b) = (Some("1.50E+00".to_string()), Some("-2.50E+00".to_string()));
        let both = Some(vec![a.clone(), b.clone()]);
        assert_eq!(values(" n  7  x=  1.50E+00  y= -2.50E+00"), both);
        assert_eq!(values(" x=     1.50E+00 set =  145 y=-2.50E+00  id =   9"), both);
        assert_eq!(values(" y= -2.50E+00 x=  1.50E+00"), both, "in any order");
        assert_eq!(values(" x=  1.50E+00 set = 145"), Some(vec![a, None]));
        assert_eq!(values(" x=********** y= -2.50E+00"), Some(vec![Some("*".repeat(10)), b]));
    }

    #[test]
    fn a_number_that_lost_digits_among_whole_ones_is_cut() {
        let selection = Selection::all();
        let mut states = StateReader::new(&selection);
        let mut read = |text: &str| {
            let line =
                Line { text: text.as_bytes(), number: 1, byte: 0, ended: true, overlong: false };
            fields(&line, &[("a", "x=")], 10, &mut states).is_some()
        };
        assert!(read(" x= 1.50E+00"), "another release's width");
        assert!(read(" x= 2.50E+00"));
        assert!(read(" x=  1.50E+00"), "the usual one");
        assert!(!read(" x= 1.50E+00"));
        assert!(read(" x= -1.50E+00"));
        assert_eq!(states.problems.into_list().len(), 1, "the first is said");
    }

    #[test]
    fn what_is_cut_or_joined_is_no_row() {
        for text in [
            " x=  1.50E+0 y= -2.50E+00",
            " x=  1.50E+00 y=",
            " x=  1.50E+00 set =",
            " x=  1.50E+00  y= -2.5 x=  1.50E+00",
            " x=  1.50E+00 7 y= -2.50E+00",
            " ** x=  1.50E+00 y= -2.50E+00",
            " z=  1.50E+00",
        ] {
            assert_eq!(values(text), None, "{text}");
        }
    }
}
