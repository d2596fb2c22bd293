//! Statistics of the columns of a sweep, updated row by row.

use serde::Serialize;

use super::Report;
use super::row::{BETWEEN, Line, Row, ShardHeader, Status};
use crate::order;
use crate::plan::{OVER_LIMITS, RESULTS, ResultName};
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
    /// Standard deviation of one row; of two rows and more.
    pub sd: Option<f64>,
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
    /// Mean so far and sum of the squares about it (Welford, Technometrics 4, 1962).
    about: (f64, f64),
    min: f64,
    max: f64,
    /// Of the rows in the sample, NaN where there is no number.
    sample: Vec<f64>,
}

impl Column {
    fn close(self) -> ColumnStatistics {
        let mut sample: Vec<f64> = self.sample.into_iter().filter(|v| !v.is_nan()).collect();
        sample.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let last = sample.len().checked_sub(1)?;
            let at = share * last as f64;
            let (low, high) = (at.floor() as usize, at.ceil() as usize);
            let (a, b) = (sample[low], sample[high]);
            Some(a + (b - a) * (at - at.floor()))
        };
        let [p5, median, p95] = SHARES.map(quantile);
        let some = |value: f64| (self.count > 0).then_some(value);
        ColumnStatistics {
            count: self.count,
            min: some(self.min),
            mean: some(self.sum / self.count as f64),
            sd: (self.count > 1).then(|| (self.about.1 / (self.count - 1) as f64).sqrt()),
            max: some(self.max),
            p5,
            median,
            p95,
            quantiles_from: sample.len() as u64,
            column: self.name,
        }
    }
}

/// The choices of a curve.
struct Choice {
    column: usize,
    name: String,
    /// Curves that were chosen, in the order in which they came.
    names: Vec<String>,
    /// Of the rows in the sample, the place of the curve's name.
    sample: Vec<f64>,
}

/// How a result follows a varied quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Sensitivity {
    pub varied: String,
    pub result: String,
    /// Spearman's: 1 if the result always grows with the quantity, −1 if it always falls, about 0 if it does not
    /// follow it in one direction. Of a choice of curves, which have no order, the correlation ratio of the ranks, from 0 to 1.
    pub rank_correlation: f64,
    /// Rows that it rests on.
    pub rows: u64,
}

/// Rank correlations are not given for fewer rows.
const LEAST_ROWS: usize = 10;
/// Results that follow nothing: errors of the method.
const NO_MEASURES: [ResultName; 2] = [ResultName::EnergyError, ResultName::MomentumError];

/// The result that a column holds, by its name; `None` for what is varied.
pub(super) fn result_of(name: &str) -> Option<ResultName> {
    let quantity = name.split('[').next();
    RESULTS.into_iter().find(|(_, own)| Some(*own) == quantity).map(|(result, _)| result)
}

/// Of `rows` items about [`SAMPLE`] have a hash that is not above this, of fewer all.
pub(super) fn sample_threshold(rows: u64) -> u64 {
    if rows <= SAMPLE { u64::MAX } else { (u64::MAX / rows).saturating_mul(SAMPLE) }
}

fn sensitivities(columns: &[Column], choices: &[Choice]) -> Vec<Sensitivity> {
    let result_of = |column: &Column| result_of(&column.name);
    let (varied, results): (Vec<&Column>, Vec<&Column>) =
        columns.iter().partition(|column| result_of(column).is_none());
    let measures =
        results.into_iter().filter(|c| result_of(c).is_some_and(|r| !NO_MEASURES.contains(&r)));
    let of_numbers = varied.iter().map(|of| (&*of.name, &of.sample, false));
    let of_choices = choices.iter().map(|of| (&*of.name, &of.sample, true));
    let varied: Vec<(&str, &Vec<f64>, bool)> = of_numbers.chain(of_choices).collect();
    let ranks_of = |sample: &[f64]| {
        let is_whole = sample.iter().all(|value| !value.is_nan());
        is_whole.then(|| ranks(sample))
    };
    let of_varied: Vec<Option<Vec<f64>>> =
        varied.iter().map(|(_, sample, _)| ranks_of(sample)).collect();
    let mut all = Vec::new();
    for result in measures {
        let of_result = ranks_of(&result.sample);
        for ((varied, sample, is_choice), of_varied) in varied.iter().zip(&of_varied) {
            let follows = if *is_choice { correlation_ratio } else { correlation };
            let (correlation, rows) = match (of_varied, &of_result) {
                (Some(x), Some(y)) => (follows(x, y), x.len()),
                _ => {
                    let pairs = sample.iter().zip(&result.sample);
                    let pairs = pairs.filter(|(x, y)| !(x.is_nan() || y.is_nan()));
                    let (x, y): (Vec<f64>, Vec<f64>) = pairs.map(|(x, y)| (*x, *y)).unzip();
                    (follows(&ranks(&x), &ranks(&y)), x.len())
                }
            };
            if let Some(rank_correlation) = correlation.filter(|_| rows >= LEAST_ROWS) {
                let (varied, result) = (varied.to_string(), result.name.clone());
                all.push(Sensitivity { varied, result, rank_correlation, rows: rows as u64 });
            }
        }
    }
    all
}

/// The rank of each value; equal ones share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order::sort(&mut order, |&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut from = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let mean = from as f64 + 0.5 * (equal.len() - 1) as f64;
        equal.iter().for_each(|&k| ranks[k] = mean);
        from += equal.len();
    }
    ranks
}

/// Pearson's correlation; `None` if one of the two does not vary.
fn correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (x - mean_x, y - mean_y);
        (xx, yy, xy) = (xx + x * x, yy + y * y, xy + x * y);
    }
    (xx > 0.0 && yy > 0.0).then(|| xy / (xx * yy).sqrt())
}

/// Root of the share of the variance of `y` that lies between the groups of equal `x`, less what chance brings on average (Kelley, Proc.
/// Natl. Acad. Sci. 21, 1935); `None` if there is one group, or `y` does not vary.
fn correlation_ratio(x: &[f64], y: &[f64]) -> Option<f64> {
    let mut pairs: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    order::sort(&mut pairs, |a, b| a.0.total_cmp(&b.0));
    let about_mean = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
    };
    let groups = pairs.chunk_by(|a, b| a.0 == b.0);
    let (mut count, mut within) = (0, 0.0);
    for group in groups {
        count += 1;
        within += about_mean(&mut group.iter().map(|pair| pair.1));
    }
    let whole = about_mean(&mut y.iter().copied());
    let (rows, count) = (y.len() as f64, f64::from(count));
    let is_known = count > 1.0 && rows > count && whole > 0.0;
    is_known.then(|| (1.0 - within / (rows - count) / (whole / (rows - 1.0))).max(0.0).sqrt())
}

/// Quantile of the normal distribution that leaves out 2.5 %.
const Z: f64 = 1.959_963_985;

/// Below so many numbers Student's quantile differs from the normal one by more than 4 %.
const LEAST_NUMBERS: u64 = 30;

impl ColumnStatistics {
    /// How far the mean of all possible rows is from this one at most, with 95 % probability, if these are drawn
    /// at random; of [`OVER_LIMITS`] the share of all `rows`, those of which it is not known taken as either. `None`
    /// for fewer numbers than the normal distribution is good for.
    pub(crate) fn half_width(&self, rows: u64) -> Option<f64> {
        if self.column == OVER_LIMITS {
            let mean = self.mean?;
            let share = |over: f64| over / rows as f64;
            let over = mean * self.count as f64;
            // The interval of a rare event is not centred on the share that was seen.
            let (low, _) = share_interval(share(over), rows);
            let (_, high) = share_interval(share(over + (rows - self.count) as f64), rows);
            return Some((mean - low).max(high - mean));
        }
        (self.count >= LEAST_NUMBERS).then_some(Z * self.sd? / (self.count as f64).sqrt())
    }

    /// What the rows of which [`OVER_LIMITS`] is not known leave of its half width, however many more there are: half of
    /// the least share of them that is likely.
    pub(crate) fn lasting_half_width(&self, rows: u64) -> f64 {
        if self.column != OVER_LIMITS || rows == 0 {
            return 0.0;
        }
        0.5 * share_interval((rows - self.count) as f64 / rows as f64, rows).0
    }
}

/// A share of `count` runs with the interval that holds it with 95 % probability (Wilson, JASA 22, 1927).
pub(crate) fn share_interval(share: f64, count: u64) -> (f64, f64) {
    let n = count as f64;
    let centre = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    // At both ends the difference would be a rounding error.
    let low = if share > 0.0 { (centre - half).max(0.0) / scale } else { 0.0 };
    let high = if share < 1.0 { ((centre + half) / scale).min(1.0) } else { 1.0 };
    (low, high)
}

/// The number that a word of a message is, without the punctuation about it; names with digits are not numbers.
fn number(word: &str) -> Option<f64> {
    let bare = word.trim_matches(['(', ')', ',', ';', ':', '.', '%', '±']);
    bare.parse().ok().filter(|_| bare.contains(|c: char| c.is_ascii_digit()))
}

/// What a warning says without its numbers.
fn kind(message: &str) -> String {
    let words = message.split(' ').map(|word| number(word).map_or(word, |_| ""));
    words.collect::<Vec<_>>().join(" ")
}

/// A warning of several rows, with the range of each number that differs between them.
struct Reason {
    kind: String,
    /// Of the first row.
    words: Vec<String>,
    /// Smallest and largest of each word that is a number, as they are written.
    ranges: Vec<Option<[(f64, String); 2]>>,
    count: u64,
}

impl Reason {
    fn new(kind: String, message: &str) -> Self {
        let words: Vec<String> = message.split(' ').map(String::from).collect();
        let range = |word: &String| {
            let value = number(word)?;
            Some([(value, word.clone()), (value, word.clone())])
        };
        Self { kind, ranges: words.iter().map(range).collect(), words, count: 1 }
    }

    fn add(&mut self, message: &str) {
        self.count += 1;
        let Self { words, ranges, .. } = Self::new(String::new(), message);
        if words.len() != self.words.len() {
            return;
        }
        for (known, new) in self.ranges.iter_mut().zip(ranges) {
            if let (Some([low, high]), Some([one, _])) = (known, new) {
                if one.0 < low.0 {
                    *low = one;
                } else if one.0 > high.0 {
                    *high = one;
                }
            }
        }
    }

    fn text(&self) -> String {
        let word = |(word, range): (&String, &Option<[(f64, String); 2]>)| match range {
            Some([low, high]) if low.1 != high.1 => format!("{} to {}", low.1, high.1),
            _ => word.clone(),
        };
        let words: Vec<String> = self.words.iter().zip(&self.ranges).map(word).collect();
        words.join(" ")
    }
}

/// Counts each warning of a row.
fn count(reasons: &mut Vec<Reason>, message: &str) {
    for warning in message.split(BETWEEN) {
        let kind = kind(warning);
        match reasons.iter().position(|known| known.kind == kind) {
            Some(k) => reasons[k].add(warning),
            None if reasons.len() < REASONS => reasons.push(Reason::new(kind, warning)),
            None => {}
        }
    }
}

/// A report, row by row.
pub(super) struct Tally {
    head: ShardHeader,
    pub report: Report,
    columns: Vec<Column>,
    choices: Vec<Choice>,
    reasons: Vec<Reason>,
    /// An item is in the sample if its hash is not above this.
    threshold: u64,
}

const MESSAGES: usize = 3;
/// Different reasons of warnings that are counted.
const REASONS: usize = 1000;

impl Tally {
    pub(crate) fn new(head: &ShardHeader) -> Self {
        let rows = head.count();
        let column = |c: usize| Column {
            name: head.columns[c].clone(),
            count: 0,
            sum: 0.0,
            about: (0.0, 0.0),
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            sample: Vec::new(),
        };
        let choice = |c: usize| Choice {
            column: c,
            name: head.columns[c].clone(),
            names: Vec::new(),
            sample: Vec::new(),
        };
        let threshold = sample_threshold(rows);
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
                reasons: Vec::new(),
                columns: Vec::new(),
                sensitivities: Vec::new(),
            },
            columns: head.number_columns().map(column).collect(),
            choices: head.choice_columns().map(choice).collect(),
            reasons: Vec::new(),
            head: head.clone(),
            threshold,
        }
    }

    /// Takes a row with its numbers, in order of the columns, of which NaN is left out; `chosen` gives the name of the curve
    /// in a column of choices.
    pub(crate) fn see<'a>(
        &mut self,
        item: u64,
        numbers: impl Iterator<Item = f64>,
        chosen: impl Fn(usize) -> Option<&'a str>,
        status: Status,
        message: &str,
    ) {
        let sampled = mix(item) <= self.threshold;
        for (column, value) in self.columns.iter_mut().zip(numbers) {
            if sampled {
                column.sample.push(value);
            }
            if value.is_nan() {
                continue;
            }
            column.count += 1;
            column.sum += value;
            let off = value - column.about.0;
            column.about.0 += off / column.count as f64;
            column.about.1 += off * (value - column.about.0);
            column.min = column.min.min(value);
            column.max = column.max.max(value);
        }
        for choice in self.choices.iter_mut().filter(|_| sampled) {
            let name = chosen(choice.column).unwrap_or_default();
            let known = choice.names.iter().position(|known| known == name);
            choice.sample.push(known.unwrap_or(choice.names.len()) as f64);
            if known.is_none() {
                choice.names.push(name.into());
            }
        }
        let report = &mut self.report;
        report.done += 1;
        report.warned += u64::from(status == Status::Warned);
        if status == Status::Warned {
            count(&mut self.reasons, message);
        }
        report.failed += u64::from(status == Status::Failed);
        if status == Status::Failed && report.messages.len() < MESSAGES {
            report.messages.push((item, message.into()));
        }
    }

    /// Takes a row; `names[k]` are those of value `k`, if it is an index.
    pub(crate) fn see_row(&mut self, row: &Row, names: &[Vec<String>]) {
        let columns: Vec<usize> = self.head.number_columns().collect();
        let numbers = columns.into_iter().map(|c| row.values[c - 1]);
        let chosen = |c: usize| Some(&**names.get(c - 1)?.get(row.values[c - 1] as usize)?);
        self.see(row.item, numbers, chosen, row.status, &row.message);
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
        let chosen = |c: usize| line.values.get(c - 1).copied();
        self.see(next, numbers.into_iter(), chosen, line.status, &line.message);
        true
    }

    pub(crate) fn close(mut self) -> Report {
        self.report.sensitivities = sensitivities(&self.columns, &self.choices);
        self.report.reasons = self.reasons.iter().map(|r| (r.text(), r.count)).collect();
        self.report.columns = self.columns.into_iter().map(Column::close).collect();
        self.report
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shard;
    use super::*;

    /// Against ranks and correlations by hand, with ties and missing numbers.
    #[test]
    fn results_follow_what_is_varied() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, -2.0]), [2.5, 1.0, 2.5, 0.0]);
        let columns =
            ["speed_m_per_s[A]", "gap_m[x]", "peak_force_N[A|wall]", "final_v_m_per_s[A]"];
        let rows = 12;
        let (x, gap) = (|k: u32| f64::from(k), |_| 1.0);
        let force = |k: u32| f64::from(k).powi(3);
        let last = |k: u32| if k == 3 { f64::NAN } else { -f64::from(k / 2) };
        let of: [&dyn Fn(u32) -> f64; 4] = [&x, &gap, &force, &last];
        let column = |(name, of): (&&str, &&dyn Fn(u32) -> f64)| Column {
            name: name.to_string(),
            count: 0,
            sum: 0.0,
            about: (0.0, 0.0),
            min: 0.0,
            max: 0.0,
            sample: (0..rows).map(of).collect(),
        };
        let columns: Vec<Column> = columns.iter().zip(&of).map(column).collect();
        let found = sensitivities(&columns, &[]);
        let names: Vec<(&str, u64)> = found.iter().map(|s| (&*s.result, s.rows)).collect();
        assert_eq!(names, [("peak_force_N[A|wall]", 12), ("final_v_m_per_s[A]", 11)]);
        assert!((found[0].rank_correlation - 1.0).abs() < 1e-12);
        // Of 11 rows, five pairs have equal results: the squares of the ranks add up to 110, and without the
        // order within the pairs to 107.5.
        let expected = -(107.5f64 / 110.0).sqrt();
        assert!((found[1].rank_correlation - expected).abs() < 1e-12, "{found:?}");
        // Two pairs in two groups: 0.5 + 0.5 of 5 within them, of 2 and 3 degrees of freedom.
        let ratio = correlation_ratio(&[1.0, 0.0, 0.0, 1.0], &[4.0, 1.0, 2.0, 3.0]).unwrap();
        assert!((ratio - (1.0 - 0.5 / (5.0 / 3.0_f64)).sqrt()).abs() < 1e-12, "{ratio}");
        // No more between the groups than chance brings, one group, and groups of one row.
        assert_eq!(correlation_ratio(&[0.0, 1.0, 1.0, 0.0], &[1.0, 2.0, 3.0, 4.0]), Some(0.0));
        assert_eq!(correlation_ratio(&[0.0; 4], &[1.0, 2.0, 3.0, 4.0]), None);
        assert_eq!(correlation_ratio(&[0.0, 1.0], &[1.0, 2.0]), None);
        let (low, high) = share_interval(0.0, 20);
        assert!(low == 0.0 && (high - 0.161).abs() < 1e-3, "{high}");
        for count in [7, 100, 300, 2410] {
            assert_eq!((share_interval(0.0, count).0, share_interval(1.0, count).1), (0.0, 1.0));
        }
        // None of 20 over a limit: the true share may be 16 % all the same.
        let none: &dyn Fn(u32) -> f64 = &|_| 0.0;
        let verdicts = Column { count: 20, ..column((&OVER_LIMITS, &none)) };
        let half_width = verdicts.close().half_width(20).unwrap();
        assert!((half_width - high).abs() < 1e-12, "{half_width}");
    }

    /// Interfaces whose names differ by a digit have their own warnings, each with the range of its numbers.
    #[test]
    fn warnings_are_counted_by_their_words() {
        let warning = |of: &str, share: f64| format!("{of} is crushed {share} m (4.5 %), -1e-3.");
        let mut reasons: Vec<Reason> = Vec::new();
        count(&mut reasons, &warning("A1|A2", 2.0));
        count(&mut reasons, &[warning("A2|A3", 9.0), warning("A1|A2", 0.5)].join(BETWEEN));
        count(&mut reasons, &warning("A1|A2", 1.0));
        let texts: Vec<(String, u64)> = reasons.iter().map(|r| (r.text(), r.count)).collect();
        let first = "A1|A2 is crushed 0.5 to 2 m (4.5 %), -1e-3.".to_string();
        assert_eq!(texts, [(first, 3), (warning("A2|A3", 9.0), 1)]);
    }

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
                tally.see(item, [x, f64::NAN].into_iter(), |_| None, Status::Ok, "");
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
