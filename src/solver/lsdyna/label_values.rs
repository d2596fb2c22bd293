//! Rows of labels and numbers (`xforce=   1.0000E+00   yforce= …`): where the numbers are.

use super::line::Line;

/// A component, its label, and the width of the number right behind the label.
pub struct Labelled {
    pub component: &'static str,
    pub label: &'static str,
    pub width: usize,
}

/// First and last column of every component's number; `None` for labels that the line does
/// not have. The line must end with its last number, or with `tail` columns behind it: a cut
/// line does not.
pub fn fields(
    line: &Line<'_>,
    labels: &[Labelled],
    tail: usize,
) -> Option<Vec<Option<(usize, usize)>>> {
    let text = line.text.trim_ascii_end();
    let fields: Vec<Option<(usize, usize)>> = labels
        .iter()
        .map(|l| {
            let at = memchr::memmem::find(text, l.label.as_bytes())? + l.label.len();
            Some((at + 1, at + l.width))
        })
        .collect();
    let end = fields.iter().flatten().map(|(_, to)| *to).max()?;
    // Stars outside a number: lines were overwritten, and what stands behind is of another.
    let in_number =
        |at: usize| fields.iter().flatten().any(|&(from, to)| (from..=to).contains(&(at + 1)));
    let stars = memchr::memchr_iter(b'*', text).any(|at| !in_number(at));
    let whole = end == text.len() || (tail > 0 && end + tail == text.len());
    (whole && !stars).then_some(fields)
}

/// The components' names.
pub fn components<const N: usize>(labels: &[Labelled; N]) -> [&'static str; N] {
    labels.each_ref().map(|l| l.component)
}

/// Short for a table of labels.
pub const fn labelled(component: &'static str, label: &'static str, width: usize) -> Labelled {
    Labelled { component, label, width }
}
