//! The header of every LS-DYNA ASCII file: title, version line, legend.

use super::line::integer;

/// The text between `ls-dyna` and `date` on the second line, blanks folded:
/// `smp d R13 R13.1.1_27_8731a0`, `smp.123264 s`, `(version 970)`.
pub(crate) fn version(line: &[u8]) -> Option<String> {
    const NAME: usize = b"ls-dyna".len();
    let text = &line[blanks(line)..];
    let name = text.get(..NAME)?;
    let end = memchr::memmem::find(&text[NAME..], b"date ").map_or(text.len(), |at| NAME + at);
    let version = String::from_utf8_lossy(&text[NAME..end]);
    let version = version.split_whitespace().collect::<Vec<_>>().join(" ");
    name.eq_ignore_ascii_case(b"ls-dyna").then_some(version)
}

/// One entry of a legend: id in columns 1-9, five blanks, title from column 15.
/// The width of the title differs by file and writer, so it runs to the line's end.
pub(crate) fn legend_entry(line: &[u8]) -> Option<(i64, Option<String>)> {
    let text = &line[blanks(line)..];
    let is_of_id = |k: usize, b: u8| b.is_ascii_digit() || k == 0 && matches!(b, b'+' | b'-');
    let end = (0..text.len()).find(|&k| !is_of_id(k, text[k])).unwrap_or(text.len());
    let title = String::from_utf8_lossy(&text[end..]).trim().to_string();
    Some((integer(&text[..end])?, (!title.is_empty()).then_some(title)))
}

fn blanks(line: &[u8]) -> usize {
    line.iter().take_while(|b| matches!(b, b' ' | b'\t')).count()
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
