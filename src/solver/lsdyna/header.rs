//! The header of every LS-DYNA ASCII file: title, version line, legend.

use nom::IResult;
use nom::Parser;
use nom::bytes::complete::{tag, tag_no_case, take_until};
use nom::character::complete::{i64 as integer, space0, space1};
use nom::combinator::{opt, rest};
use nom::sequence::{preceded, terminated};

/// The text between `ls-dyna` and `date` on the second line, blanks folded:
/// `smp d R13 R13.1.1_27_8731a0`, `smp.123264 s`, `(version 970)`.
pub(crate) fn version(line: &[u8]) -> Option<String> {
    fn parse(line: &[u8]) -> IResult<&[u8], &[u8]> {
        let (line, _) = preceded(space0, tag_no_case("ls-dyna")).parse(line)?;
        let (line, version) = opt(terminated(take_until("date "), rest)).parse(line)?;
        Ok((line, version.unwrap_or(line)))
    }
    let (_, version) = parse(line).ok()?;
    let text = String::from_utf8_lossy(version);
    Some(text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Follows the fence around a legend, line by line.
#[derive(Debug, Default)]
pub(crate) struct LegendFence {
    inside: bool,
}

impl LegendFence {
    /// Whether a legend was opened and not closed.
    pub(crate) fn is_open(&self) -> bool {
        self.inside
    }

    /// Ends the legend without its closing line.
    pub(crate) fn close(&mut self) {
        self.inside = false;
    }

    /// Whether this line belongs to a legend (its two fence lines included).
    pub(crate) fn covers(&mut self, line: &[u8]) -> bool {
        let text = line.trim_ascii();
        // One l2a release wrote the opening line without its closing brace.
        if text.starts_with(b"{BEGIN LEGEND") {
            self.inside = true;
            true
        } else if text.starts_with(b"{END LEGEND") {
            self.inside = false;
            true
        } else {
            self.inside
        }
    }
}

/// One entry of a legend: id in columns 1-9, five blanks, title from column 15.
/// The width of the title differs by file and writer, so it runs to the line's end.
pub(crate) fn legend_entry(line: &[u8]) -> Option<(i64, Option<String>)> {
    fn parse(line: &[u8]) -> IResult<&[u8], i64> {
        let (line, id) = preceded(space0, integer).parse(line)?;
        // A title that touches its id would make it ambiguous.
        let (line, _) = opt(space1).parse(line)?;
        Ok((line, id))
    }
    if tag::<_, _, nom::error::Error<&[u8]>>(" Entity #").parse(line).is_ok() {
        return None;
    }
    let (title, id) = parse(line).ok()?;
    let title = String::from_utf8_lossy(title).trim().to_string();
    Some((id, (!title.is_empty()).then_some(title)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_version_lines_of_all_generations() {
        fn t(line: &str, expected: Option<&str>) {
            assert_eq!(version(line.as_bytes()).as_deref(), expected, "{line:?}");
        }
        t(
            "                         ls-dyna smp.123264 s           date 01/12/2018",
            Some("smp.123264 s"),
        );
        t(
            "                    ls-dyna smp d R13 R13.1.1_27_8731a0 date 07/28/2023",
            Some("smp d R13 R13.1.1_27_8731a0"),
        );
        t(
            "                         ls-dyna (version 970)     date 1/1/2004",
            Some("(version 970)"),
        );
        t("                    ls-dyna smp d R16", Some("smp d R16"));
        t(" some other text", None);
    }

    #[test]
    fn reads_legend_entries() {
        fn t(line: &str, expected: Option<(i64, Option<&str>)>) {
            let entry = legend_entry(line.as_bytes());
            let entry = entry.as_ref().map(|(id, title)| (*id, title.as_deref()));
            assert_eq!(entry, expected, "{line:?}");
        }
        t("        1     FERRULE_TO_ANVIL    ", Some((1, Some("FERRULE_TO_ANVIL"))));
        t("  1100002                         ", Some((1100002, None)));
        t(" 84340382     slave of 2", Some((84340382, Some("slave of 2"))));
        t(" Entity #        Title", None);
        t("", None);
    }
}
