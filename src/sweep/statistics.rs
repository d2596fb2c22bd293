//! Statistics of the columns of a sweep, updated row by row.

use serde::Serialize;

use super::Report;
use super::row::{Line, ShardHeader, Status};
use super::run::Written;
use crate::stream::mix;

/// Quantiles come from all rows of a sweep up to this size; of a larger one from about as many
/// rows, chosen by their item.
const SAMPLE: u64 = 20_000;
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Statistics of one column, over the rows that have a number there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// Name of the column.
    pub column: String,
    /// Rows with a number.
    pub count: u64,
    /// Smallest number.
    pub min: Option<f64>,
    /// Mean.
    pub mean: Option<f64>,
    /// Largest number.
    pub max: Option<f64>,
    /// 5 %, by linear interpolation between order statistics.
    pub p5: Option<f64>,
    /// 50 %, as `p5`.
    pub median: Option<f64>,
    /// 95 %, as `p5`.
    pub p95: Option<f64>,
    /// Rows that the quantiles rest on.
    pub quantiles_from: u64,
}

/// Follows columns of numbers.
#[derive(Clone, Debug)]
pub(crate) struct Statistics {
    columns: Vec<Column>,
    /// An item is in the sample if its hash is not above this.
    threshold: u64,
}

#[derive(Clone, Debug)]
struct Column {
    name: String,
    count: u64,
    sum: f64,
    min: f64,
    max: f64,
    sample: Vec<f64>,
}

impl Statistics {
    /// Of these columns, over `rows` rows.
    pub(crate) fn new(columns: &[String], rows: u64) -> Self {
        let column = |name: &String| Column {
            name: name.clone(),
            count: 0,
            sum: 0.0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            sample: Vec::new(),
        };
        let threshold =
            if rows <= SAMPLE { u64::MAX } else { (u64::MAX / rows).saturating_mul(SAMPLE) };
        Self { columns: columns.iter().map(column).collect(), threshold }
    }

    /// Takes the numbers of a row, in order of the columns; NaN is left out.
    pub(crate) fn see(&mut self, item: u64, values: impl Iterator<Item = f64>) {
        let sampled = mix(item) <= self.threshold;
        for (column, value) in self.columns.iter_mut().zip(values) {
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
    }

    /// The statistics so far.
    pub(crate) fn close(self) -> Vec<ColumnStatistics> {
        self.columns.into_iter().map(Column::close).collect()
    }
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

/// What a report needs, row by row.
pub(super) struct Tally {
    head: ShardHeader,
    statistics: Statistics,
    pub rows: u64,
    pub done: u64,
    pub resumed: u64,
    failed: u64,
    warned: u64,
    messages: Vec<(u64, String)>,
}

/// Messages of failed rows that a report repeats.
const MESSAGES: usize = 3;

impl Tally {
    pub(crate) fn new(head: &ShardHeader) -> Self {
        let rows = head.rows().end - head.rows().start;
        let numbers: Vec<String> = (1..head.columns.len())
            .filter(|&c| !head.is_text(c))
            .map(|c| head.columns[c].clone())
            .collect();
        Self {
            head: head.clone(),
            statistics: Statistics::new(&numbers, rows),
            rows,
            done: 0,
            resumed: 0,
            failed: 0,
            warned: 0,
            messages: Vec::new(),
        }
    }

    /// Takes a row that has just been run.
    pub(crate) fn see(&mut self, Written { row, .. }: &Written) {
        let head = &self.head;
        let numbers = row.values.iter().enumerate().filter(|(k, _)| !head.is_text(k + 1));
        self.statistics.see(row.item, numbers.map(|(_, value)| *value));
        self.count(row.item, row.status, &row.message);
    }

    /// Takes the numbers of a row that is counted by itself.
    pub(crate) fn statistics_see(&mut self, item: u64, values: impl Iterator<Item = f64>) {
        self.statistics.see(item, values);
    }

    pub(crate) fn count(&mut self, item: u64, status: Status, message: &str) {
        self.done += 1;
        match status {
            Status::Ok => {}
            Status::Warned => self.warned += 1,
            Status::Failed => {
                self.failed += 1;
                if self.messages.len() < MESSAGES {
                    self.messages.push((item, message.into()));
                }
            }
        }
    }

    /// Takes a line that ought to be the next one; false if it is not, or is not whole.
    pub(crate) fn see_line(&mut self, line: &[u8]) -> bool {
        let head = &self.head;
        let next = head.rows().start + self.done;
        let parsed = Line::parse(line, head.columns.len())
            .filter(|line| line.item == next && next < head.rows().end);
        let Some(line) = parsed else { return false };
        let numbers = line.values.iter().enumerate().filter(|(k, _)| !head.is_text(k + 1));
        let numbers: Option<Vec<f64>> = numbers.map(|(_, field)| Line::number(field)).collect();
        let Some(numbers) = numbers else { return false };
        self.statistics.see(next, numbers.into_iter());
        self.count(next, line.status, &line.message);
        true
    }

    pub(crate) fn close(self) -> Report {
        Report {
            items: self.head.items,
            shard: self.head.shard,
            rows: self.rows,
            resumed: self.resumed,
            done: self.done,
            failed: self.failed,
            warned: self.warned,
            messages: self.messages,
            columns: self.statistics.close(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_small_and_large_sweeps() {
        for rows in [101u64, 200_001] {
            let mut statistics = Statistics::new(&["x".into(), "y".into()], rows);
            for item in 0..rows {
                let x = item as f64 / (rows - 1) as f64;
                statistics.see(item, [x, f64::NAN].into_iter());
            }
            let [x, y] = &statistics.close()[..] else { panic!() };
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
