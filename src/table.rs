//! CSV tables that somebody else has written: a header line, then rows, with the place of what is
//! wrong.

use csv::StringRecord;

/// The rows below a header line. Separated by commas, semicolons or tabs, whichever stand in the
/// header; lines that begin with `#` are comments.
pub(crate) struct CsvTable<'a> {
    reader: csv::Reader<&'a [u8]>,
    header: StringRecord,
    /// Lines of the file in front of the text.
    lines_before: u64,
    separator: u8,
}

pub(crate) struct Row {
    record: StringRecord,
    /// Line in the file, counted from 1.
    pub line: u64,
    /// Whether a comma cannot separate fields, so that it may stand in a number.
    decimal_comma: bool,
}

/// A field that holds no number, or none that is finite.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NoNumber {
    /// Line in the file, counted from 1.
    pub line: u64,
    /// Field of the row, counted from 1.
    pub column: usize,
    /// What stands there.
    pub found: String,
    /// Whether it is a number, but NaN or infinite.
    pub is_number: bool,
}

impl<'a> CsvTable<'a> {
    /// The table in `text`, which `lines_before` other lines of its file precede.
    pub(crate) fn open(text: &'a [u8], lines_before: u64) -> Result<Self, csv::Error> {
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
        Self::separated(text, lines_before, separator(text))
    }

    /// The same, where what separates the columns is known.
    pub(crate) fn separated(
        text: &'a [u8],
        lines_before: u64,
        separator: u8,
    ) -> Result<Self, csv::Error> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .delimiter(separator)
            .from_reader(text);
        let header = reader.headers()?.clone();
        Ok(Self { reader, header, lines_before, separator })
    }

    /// The names of the columns.
    pub(crate) fn header(&self) -> &StringRecord {
        &self.header
    }

    /// Line of the header in the file, counted from 1.
    pub(crate) fn header_line(&self) -> u64 {
        self.lines_before + self.header.position().map_or(1, csv::Position::line)
    }

    /// The header as a row, for tables that have none.
    pub(crate) fn header_row(&self) -> Row {
        let decimal_comma = self.separator != b',';
        Row { record: self.header.clone(), line: self.header_line(), decimal_comma }
    }

    /// The rows in their order.
    pub(crate) fn rows(&mut self) -> impl Iterator<Item = Result<Row, csv::Error>> {
        let before = self.lines_before;
        let decimal_comma = self.separator != b',';
        self.reader.records().map(move |record| {
            let record = record?;
            let line = before + record.position().map_or(0, csv::Position::line);
            Ok(Row { record, line, decimal_comma })
        })
    }
}

impl Row {
    /// The text of a field, counted from 0; empty if there is none.
    pub(crate) fn field(&self, field: usize) -> &str {
        self.record.get(field).unwrap_or_default()
    }

    /// The texts of all fields.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &str> {
        self.record.iter()
    }

    /// The finite number in a field, counted from 0; between semicolons or tabs with a decimal
    /// comma or point.
    pub(crate) fn number(&self, field: usize) -> Result<f64, NoNumber> {
        let found = self.field(field);
        let parsed = if self.decimal_comma && !found.contains('.') {
            found.replacen(',', ".", 1).parse::<f64>()
        } else {
            found.parse::<f64>()
        };
        match parsed {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(NoNumber {
                line: self.line,
                column: field + 1,
                found: found.into(),
                is_number: parsed.is_ok(),
            }),
        }
    }
}

/// What separates the columns of the first line of `text` that is not a comment (`#`): the first
/// comma, semicolon or tab outside of quotes.
pub(crate) fn separator(text: &[u8]) -> u8 {
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    let mut lines = text.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let header = lines.find(|line| !line.is_empty() && line[0] != b'#').unwrap_or_default();
    let mut quoted = false;
    let found = header.iter().find(|&&byte| {
        quoted ^= byte == b'"';
        !quoted && matches!(byte, b',' | b';' | b'\t')
    });
    found.copied().unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_decides() {
        let t =
            |text: &str, expected: u8| assert_eq!(separator(text.as_bytes()), expected, "{text}");
        t("d_m,force_N\n0;0\n", b',');
        t("d_m;force_N;\"a, b\"\n", b';');
        t("\"a, b\"\td\n", b'\t');
        t("\u{feff}# by hand; run 3\r\n\r\nd_m,force_N\n", b',');
        t("\r\nd_m;force_N\n", b';');
        t("d_m\n", b',');
        t("", b',');
    }
}
