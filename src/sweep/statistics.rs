//! Statistics of the columns of a sweep, updated row by row.

use serde::Serialize;

use super::Report;
use super::row::{Line, Row, ShardHeader, Status};
use crate::stream::mix;

/// Quantiles come from all rows of a sweep up to this size; of a larger one from about as many
/// rows, chosen by their item.
const SAMPLE: u64 = 20_000;
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Statistics of one column, over the rows that have a number there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ColumnStatistics {
    pub column: String,
    pub count: u64,
    pub min: Option<f64>,
    pub mean: Option<f64>,
    pub max: Option<f64>,
    /// 5 %, by linear interpolation between order statistics.
    pub p5: Option<f64>,
    pub median: Option<f64>,
    pub p95: Option<f64>,
    /// Rows that the quantiles rest on.
    pub quantiles_from: u64,
}

struct Column {
    name: String,
    count: u64,
    sum: f64,
    min: f64,
    max: f64,
    sample: Vec<f64>,
}

impl Column {
    fn close(mut self) -> ColumnStatistics {
        self.sample.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let last = self.sample.len().checked_sub(1)?;
            let at = share * last as f64;
            let (low, high) = (at.floor() as usize, at.ceil() as usize);
            let (a, b) = (self.sample[low], self.sample[high]);
            Some(a + (b - a) * (at - at.floor()))
        };
        let [p5, median, p95] = SHARES.map(quantile);
        let some = |value: f64| (self.count > 0).then_some(value);
        ColumnStatistics {
            count: self.count,
            min: some(self.min),
            mean: some(self.sum / self.count as f64),
            max: some(self.max),
            p5,
            median,
            p95,
            quantiles_from: self.sample.len() as u64,
            column: self.name,
        }
    }
}

/// A report, row by row.
pub(super) struct Tally {
    head: ShardHeader,
    pub report: Report,
    columns: Vec<Column>,
    /// An item is in the sample if its hash is not above this.
    threshold: u64,
}

const MESSAGES: usize = 3;

impl Tally {
    pub(crate) fn new(head: &ShardHeader) -> Self {
        let rows = head.count();
        let column = |c: usize| Column {
            name: head.columns[c].clone(),
            count: 0,
            sum: 0.0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            sample: Vec::new(),
        };
        let threshold =
            if rows <= SAMPLE { u64::MAX } else { (u64::MAX / rows).saturating_mul(SAMPLE) };
        Self {
            report: Report {
                items: head.items,
                shard: head.shard,
                rows,
                resumed: 0,
                done: 0,
                failed: 0,
                warned: 0,
                messages: Vec::new(),
                columns: Vec::new(),
            },
            columns: head.number_columns().map(column).collect(),
            head: head.clone(),
            threshold,
        }
    }

    /// Takes a row with its numbers, in order of the columns; NaN is left out.
    pub(crate) fn see(
        &mut self,
        item: u64,
        numbers: impl Iterator<Item = f64>,
        status: Status,
        message: &str,
    ) {
        let sampled = mix(item) <= self.threshold;
        for (column, value) in self.columns.iter_mut().zip(numbers) {
            if value.is_nan() {
                continue;
            }
            column.count += 1;
            column.sum += value;
            column.min = column.min.min(value);
            column.max = column.max.max(value);
            if sampled {
                column.sample.push(value);
            }
        }
        let report = &mut self.report;
        report.done += 1;
        report.warned += u64::from(status == Status::Warned);
        report.failed += u64::from(status == Status::Failed);
        if status == Status::Failed && report.messages.len() < MESSAGES {
            report.messages.push((item, message.into()));
        }
    }

    pub(crate) fn see_row(&mut self, row: &Row) {
        let columns: Vec<usize> = self.head.number_columns().collect();
        let numbers = columns.into_iter().map(|c| row.values[c - 1]);
        self.see(row.item, numbers, row.status, &row.message);
    }

    /// Takes a line that ought to be the next one; false if it is not, or is not whole.
    pub(crate) fn see_line(&mut self, line: &[u8]) -> bool {
        let head = &self.head;
        let next = head.rows().start + self.report.done;
        let parsed = Line::parse(line, head.columns.len())
            .filter(|line| line.item == next && next < head.rows().end);
        let Some(line) = parsed else { return false };
        let numbers = head.number_columns().map(|c| Line::number(line.values.get(c - 1)?));
        let Some(numbers) = numbers.collect::<Option<Vec<f64>>>() else { return false };
        self.see(next, numbers.into_iter(), line.status, &line.message);
        true
    }

    pub(crate) fn close(mut self) -> Report {
        self.report.columns = self.columns.into_iter().map(Column::close).collect();
        self.report
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shard;
    use super::*;

    #[test]
    fn of_small_and_large_sweeps() {
        for rows in [101u64, 200_001] {
            let head = ShardHeader {
                version: String::new(),
                hash: String::new(),
                items: rows,
                shard: Shard::WHOLE,
                columns: ["item", "x", "y", "status", "message"].map(String::from).to_vec(),
            };
            let mut tally = Tally::new(&head);
            for item in 0..rows {
                let x = item as f64 / (rows - 1) as f64;
                tally.see(item, [x, f64::NAN].into_iter(), Status::Ok, "");
            }
            let [x, y] = &tally.close().columns[..] else { panic!() };
            assert_eq!((x.count, x.min, x.max), (rows, Some(0.0), Some(1.0)));
            assert!((x.mean.unwrap() - 0.5).abs() < 1e-12);
            let tolerance = if rows == 101 { 1e-12 } else { 0.01 };
            for (found, expected) in [(x.p5, 0.05), (x.median, 0.5), (x.p95, 0.95)] {
                assert!((found.unwrap() - expected).abs() < tolerance, "{found:?}");
            }
            assert!(x.quantiles_from < 21_000);
            assert_eq!((y.count, y.mean, y.median), (0, None, None));
        }
    }
}
