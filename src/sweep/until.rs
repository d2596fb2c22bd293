//! A sweep of random draws that ends as soon as a mean is known with a stated precision.
//!
//! Draw k does not depend on how many there are, so the first n rows of a plan are the sweep of the same plan with n
//! samples: what is written is that sweep, byte for byte, with its head and hash.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::ops::ControlFlow;
use std::path::Path;

use super::journal::{beside, sum, write_locked};
use super::row::{ShardFile, ShardHeader};
use super::statistics::ColumnStatistics;
use super::to_hdf5::is_hdf5;
use super::{Report, Shard, Sweep, WriteOptions};
use crate::error::{Error, error};
use crate::file::{WriterLock, not_written, target_of};
use crate::guess::hint;

/// When a sweep is precise enough.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Precision {
    /// Column of a result.
    pub column: String,
    /// Half the width of the 95 % confidence interval of its mean, or of the share over limits, in the column's unit.
    pub half_width: f64,
}

/// Draws before the precision is looked at for the first time.
const FIRST: u64 = 100;

/// Runs samples of the sweep until `precision` is reached, or cannot be, or all that its plan states, and writes the rows to `output` as
/// [`super::write()`] does. Fewer samples of an earlier run are kept. Gives the statistics of the column with the report.
///
/// # Errors
/// As [`super::write()`]; for plans with grids or strata, whose first rows are not a sample of the whole; for an output as HDF5; for an
/// unknown column.
pub(crate) fn write_until(
    sweep: &mut Sweep,
    output: &Path,
    precision: &Precision,
    options: &WriteOptions,
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<(Report, Option<f64>), Error> {
    if !sweep.is_random() {
        return Err(error!(
            Sweep,
            "--until needs variables that are all drawn at random: no grid (values, steps), no Latin hypercube"
        ));
    }
    if is_hdf5(output) || options.shard != Shard::WHOLE {
        return Err(error!(Sweep, "--until writes one .csv file, without shards"));
    }
    let columns = sweep.columns();
    let results = &columns[1 + sweep.variables.len()..columns.len() - 2];
    if !results.contains(&precision.column) {
        let all = results.join(", ");
        let guess = hint(&precision.column, &all);
        return Err(error!(
            Sweep,
            "--until: there is no result \"{}\": name it in results of [sweep], or one of {all}{guess}",
            precision.column
        ));
    }
    let output = &target_of(output).map_err(|e| not_written(output, e))?;
    let _lock = WriterLock::take(output)?;
    let most = sweep.items();
    let mut samples = match (options.restart, of_earlier_run(sweep, output, most)?) {
        (false, Some(earlier)) => earlier,
        _ => FIRST.min(most),
    };
    let mut options = *options;
    let mut resumed = None;
    loop {
        sweep.set_samples(samples)?;
        let mut report = write_locked(sweep, output, &options, &mut progress)?;
        options.restart = false;
        report.resumed = *resumed.get_or_insert(report.resumed);
        let of = report.columns.iter().find(|of| of.column == precision.column);
        let half_width = of.and_then(|of: &ColumnStatistics| of.half_width(report.rows));
        let is_precise = half_width.is_some_and(|half_width| half_width <= precision.half_width);
        let is_hopeless =
            of.is_some_and(|of| of.lasting_half_width(report.rows) > precision.half_width);
        if !report.is_complete() || is_precise || is_hopeless || samples == most {
            return Ok((report, half_width));
        }
        samples =
            further(samples, half_width.unwrap_or(f64::INFINITY) / precision.half_width).min(most);
        sweep.set_samples(samples)?;
        extend(output, &ShardHeader::of(sweep, Shard::WHOLE))?;
    }
}

/// How many samples are likely to do, if the interval is `ratio` times as wide as it may be: at least a fifth more, at most
/// four times as many.
fn further(samples: u64, ratio: f64) -> u64 {
    let n = samples as f64;
    (1.05 * n * ratio * ratio).clamp(1.2 * n, 4.0 * n).ceil() as u64
}

/// Samples of an earlier run of the same plan that stand at the output, or in the file under work.
fn of_earlier_run(sweep: &mut Sweep, output: &Path, most: u64) -> Result<Option<u64>, Error> {
    for path in [output.to_path_buf(), beside(output, ".part")] {
        if !path.exists() {
            continue;
        }
        let Some(ShardFile { head, .. }) = ShardFile::read_head(&path)? else { continue };
        if (1..=most).contains(&head.items) {
            sweep.set_samples(head.items)?;
            let is_same = head == ShardHeader::of(sweep, Shard::WHOLE);
            sweep.set_samples(most)?;
            if is_same {
                return Ok(Some(head.items));
            }
        }
    }
    Ok(None)
}

/// Makes a finished file the beginning of a longer one, under work.
fn extend(output: &Path, head: &ShardHeader) -> Result<(), Error> {
    let Some(finished) = ShardFile::read_head(output)? else { return Ok(()) };
    let (part, sums) = (beside(output, ".part"), beside(output, ".part.sums"));
    let create = |path: &Path| File::create(path).map_err(|e| not_written(path, e));
    let (mut rows, mut of_rows) = (BufWriter::new(create(&part)?), BufWriter::new(create(&sums)?));
    let failed = |e| not_written(&part, e);
    rows.write_all(head.text().as_bytes()).map_err(failed)?;
    finished.rows(|line| {
        rows.write_all(line).map_err(failed)?;
        of_rows.write_all(sum(line).as_bytes()).map_err(failed)?;
        Ok(true)
    })?;
    for file in [rows, of_rows] {
        let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
        file.sync_all().map_err(failed)?;
    }
    // Only now that its rows are in the other file.
    fs::remove_file(output).map_err(|e| not_written(output, e))
}
