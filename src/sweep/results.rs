//! The rows of a finished sweep as columns of numbers.

use std::path::Path;

use super::row::{FORMAT, Line, ShardFile, ShardHeader, bad_row};
use super::statistics::{result_of, sample_threshold};
use super::to_hdf5::{FinishedTable, is_table};
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
    /// Names of the columns of these choices, such as `curve[nose]`.
    pub(crate) curves: Vec<String>,
    pub(crate) results: Vec<ResultColumn>,
    /// Rows of the file.
    pub(crate) rows: u64,
}

impl SweepColumns {
    /// Reads the file of a sweep, CSV or HDF5; of one with more than 20 000 rows about as many, chosen by their item.
    ///
    /// # Errors
    /// If the file is not a finished sweep, or a row is damaged.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        if is_table(path) {
            let table = FinishedTable::open(path)?;
            let mut columns = Self::none(&table.head);
            let threshold = sample_threshold(columns.rows);
            table.numbers(|item| mix(item) <= threshold, |numbers| columns.take(numbers))?;
            return Ok(columns.sorted());
        }
        let file = ShardFile::read_head(path)?.ok_or_else(|| {
            error!(Sweep, "{}: expected \"# {FORMAT}\" in the first line and a complete header: run its sweep again with --restart", path.display())
        })?;
        let mut columns = Self::none(&file.head);
        let threshold = sample_threshold(columns.rows);
        let mut next = file.head.rows().start;
        file.rows(|line| {
            let item = next;
            next += 1;
            let parsed = Line::parse(line, file.head.columns.len());
            let Some(line) = parsed.filter(|line| line.item == item) else { return Ok(false) };
            if mix(item) > threshold {
                return Ok(true);
            }
            let number = |k: usize| Line::number(line.values.get(k - 1)?);
            let numbers: Option<Vec<f64>> = file.head.number_columns().map(number).collect();
            columns.take(&numbers.ok_or_else(|| bad_row(path, item))?);
            Ok(true)
        })?;
        Ok(columns.sorted())
    }

    /// The columns of numbers without rows yet, all among the results.
    fn none(head: &ShardHeader) -> Self {
        let column = |k: usize| ResultColumn { name: head.columns[k].clone(), values: Vec::new() };
        let results = head.number_columns().map(column).collect();
        let curves = head.columns.iter().filter(|name| name.starts_with("curve[")).cloned();
        Self { varied: Vec::new(), curves: curves.collect(), results, rows: head.count() }
    }

    fn take(&mut self, numbers: &[f64]) {
        self.results.iter_mut().zip(numbers).for_each(|(column, &n)| column.values.push(n));
    }

    fn sorted(self) -> Self {
        let all = self.results.into_iter();
        let (results, varied) = all.partition(|c| result_of(&c.name).is_some());
        Self { varied, results, ..self }
    }
}
