//! What a report says of the rows, counted row by row.

use super::Report;
use super::row::{Line, ShardHeader, Status};
use super::run::Written;
use super::statistics::Statistics;

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
