//! The rows of a finished sweep as columns of numbers.

use std::path::Path;

use super::row::{FORMAT, Line, ShardFile, bad_row};
use super::statistics::{result_of, sample_threshold};
use crate::error::{Error, error};
use crate::stream::mix;

/// A column of numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResultColumn {
    /// As in the file, such as `peak_force_N[A1|wall]`.
    pub(crate) name: String,
    /// In SI, one for each row; NaN where there is none.
    pub(crate) values: Vec<f64>,
}

/// Columns of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SweepColumns {
    /// What was varied, but for choices of curves.
    pub(crate) varied: Vec<ResultColumn>,
    pub(crate) results: Vec<ResultColumn>,
    /// Rows of the file.
    pub(crate) rows: u64,
}

impl SweepColumns {
    /// Reads the CSV file of a sweep; of one with more than 20 000 rows about as many, chosen by their item.
    ///
    /// # Errors
    /// If the file is not a finished sweep, or a row is damaged.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let file = ShardFile::read_head(path)?.ok_or_else(|| {
            error!(Sweep, "{}: expected \"# {FORMAT}\" in the first line and a whole head: run its sweep again with --restart", path.display())
        })?;
        let numbers: Vec<usize> = file.head.number_columns().collect();
        let column =
            |&k: &usize| ResultColumn { name: file.head.columns[k].clone(), values: Vec::new() };
        let mut columns: Vec<ResultColumn> = numbers.iter().map(column).collect();
        let threshold = sample_threshold(file.head.count());
        let mut next = file.head.rows().start;
        file.rows(|line| {
            let item = next;
            next += 1;
            let parsed = Line::parse(line, file.head.columns.len());
            let Some(line) = parsed.filter(|line| line.item == item) else { return Ok(false) };
            if mix(item) > threshold {
                return Ok(true);
            }
            for (column, k) in columns.iter_mut().zip(&numbers) {
                let number = line.values.get(k - 1).and_then(|field| Line::number(field));
                column.values.push(number.ok_or_else(|| bad_row(path, item))?);
            }
            Ok(true)
        })?;
        let (results, varied) = columns.into_iter().partition(|c| result_of(&c.name).is_some());
        Ok(Self { varied, results, rows: file.head.count() })
    }
}
