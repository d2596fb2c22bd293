//! `crumple rate`: how far a prediction is from its reference, by every measure.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crumple::file;
use crumple::rating::deceleration::Deceleration;
use crumple::rating::magnitude_phase::MagnitudePhase;
use crumple::rating::{self, Quantity, Rating, Settings, Signal, table};
use crumple::solver::{self, ReadError, Selection, WantedId};
use crumple::unit::TIME;

use super::{CommandResult, Failure, Manners, Outcome, output};

/// Most bytes of a table that is rated: some million rows.
const MAX_TABLE_BYTES: u64 = 256 << 20;

/// Rate a prediction against a reference: ratios, peaks, ISO/TS 18571, CORA and others
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple rate test.csv result.csv --column-a x_acceleration --column-b 'a_m_per_s2[A1]' --cfc 60
  crumple rate fe/nodout result.csv --id-a 900001 --component-a x_velocity --scale-a 0.001 \\
      --column-b 'v_m_per_s[A1]' --to 150ms
  crumple rate 36kmh/nodout 48kmh/nodout --id 900001 --component x_acceleration --cfc 60 --json
  crumple rate test.csv model.csv --time-unit-a ms --time-unit-b s
A is the reference r, B the prediction p. Each is a CSV file (a header line; the first column is the
time) or any file that crumple histories reads. Both are filtered if asked, then interpolated
linearly at common times 0.1 ms apart (10 kHz, as ISO/TS 18571 wants it). Accelerations are negative
while the body is slowed down. ISO/TS 18571 and CORA take up to 2 s: choose with --from and --to.")]
pub struct Args {
    /// Reference: CSV or a solver's file
    #[arg(value_name = "A")]
    reference: PathBuf,
    /// Prediction: CSV or a solver's file
    #[arg(value_name = "B")]
    prediction: PathBuf,
    #[command(flatten)]
    both: Both,
    #[command(flatten)]
    of_a: OfA,
    #[command(flatten)]
    of_b: OfB,
    /// Filter both with this channel frequency class, such as 60 or 180
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    cfc: Option<u32>,
    /// Begin of what is rated, with its unit, such as 10ms
    #[arg(long, value_parser = time, allow_hyphen_values = true)]
    from: Option<f64>,
    /// End of what is rated, with its unit
    #[arg(long, value_parser = time, allow_hyphen_values = true)]
    to: Option<f64>,
    /// What the signals are (default: an acceleration if both names say so)
    #[arg(long, value_enum)]
    quantity: Option<QuantityArgument>,
}

/// Where the signal stands in both files.
#[derive(clap::Args)]
struct Both {
    /// Column of the CSV files
    #[arg(long, conflicts_with_all = ["column_a", "column_b"])]
    column: Option<String>,
    /// Node, wall or interface of the solver's files; 3:surfa is one side
    #[arg(long, conflicts_with_all = ["id_a", "id_b"])]
    id: Option<WantedId>,
    /// Component of the solver's files, named as in binout, such as x_velocity
    #[arg(long, conflicts_with_all = ["component_a", "component_b"])]
    component: Option<String>,
    /// Section of binouts, such as nodout or rwforc/forces
    #[arg(long)]
    section: Option<String>,
    /// Kind of the solver's files (nodout, rcforc, …), if their content does not tell
    #[arg(long)]
    format: Option<String>,
}

#[derive(clap::Args)]
struct OfA {
    /// Column of A
    #[arg(long)]
    column_a: Option<String>,
    /// Node, wall or interface of A
    #[arg(long)]
    id_a: Option<WantedId>,
    /// Component of A
    #[arg(long)]
    component_a: Option<String>,
    /// Factor on the values of A, such as 0.001 from mm/s to m/s, or -1 (default: 1)
    #[arg(long, value_parser = factor, allow_hyphen_values = true)]
    scale_a: Option<f64>,
    /// Unit of the times of A (default: s)
    #[arg(long, value_enum)]
    time_unit_a: Option<TimeUnit>,
}

#[derive(clap::Args)]
struct OfB {
    /// Column of B
    #[arg(long)]
    column_b: Option<String>,
    /// Node, wall or interface of B
    #[arg(long)]
    id_b: Option<WantedId>,
    /// Component of B
    #[arg(long)]
    component_b: Option<String>,
    /// Factor on the values of B (default: 1)
    #[arg(long, value_parser = factor, allow_hyphen_values = true)]
    scale_b: Option<f64>,
    /// Unit of the times of B (default: s)
    #[arg(long, value_enum)]
    time_unit_b: Option<TimeUnit>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum TimeUnit {
    S,
    Ms,
    Us,
}

impl TimeUnit {
    fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Ms => "ms",
            Self::Us => "us",
        }
    }

    /// Its length in s.
    fn seconds(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e-3,
            Self::Us => 1e-6,
        }
    }

    /// The unit that the name of a column ends with: `time_ms`, `time [ms]`, `t (ms)`.
    fn at_the_end_of(name: &str) -> Option<Self> {
        let name = name.trim_end_matches([')', ']', ' ']);
        let (_, unit) = name.rsplit_once(['_', '(', '[', ' ', '/'])?;
        [Self::S, Self::Ms, Self::Us].into_iter().find(|u| u.name() == unit)
    }
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum QuantityArgument {
    /// Adds the means of the deceleration
    Acceleration,
    /// Anything else
    Other,
}

fn time(text: &str) -> Result<f64, String> {
    TIME.parse(text).map_err(|e| e.to_string())
}

fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|f| f.is_finite() && *f != 0.0);
    factor.ok_or_else(|| format!("\"{text}\" is no factor: write for example 0.001 or -1"))
}

/// Where one signal stands.
struct Place<'a> {
    /// Letter of the file on the command line.
    letter: char,
    path: &'a Path,
    column: Option<&'a str>,
    id: Option<WantedId>,
    component: Option<&'a str>,
    section: Option<&'a str>,
    format: Option<&'a str>,
    scale: f64,
    unit: Option<TimeUnit>,
}

/// A signal as it was read, and what tells its kind.
struct Read {
    signal: Signal,
    column: String,
    is_table: bool,
    problems: usize,
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    let both = &args.both;
    let common = |letter, path| Place {
        letter,
        path,
        column: both.column.as_deref(),
        id: both.id,
        component: both.component.as_deref(),
        section: both.section.as_deref(),
        format: both.format.as_deref(),
        scale: 1.0,
        unit: None,
    };
    let (a, b) = (common('a', args.reference.as_path()), common('b', args.prediction.as_path()));
    let a = Place {
        column: args.of_a.column_a.as_deref().or(a.column),
        id: args.of_a.id_a.or(a.id),
        component: args.of_a.component_a.as_deref().or(a.component),
        scale: args.of_a.scale_a.unwrap_or(1.0),
        unit: args.of_a.time_unit_a,
        ..a
    };
    let b = Place {
        column: args.of_b.column_b.as_deref().or(b.column),
        id: args.of_b.id_b.or(b.id),
        component: args.of_b.component_b.as_deref().or(b.component),
        scale: args.of_b.scale_b.unwrap_or(1.0),
        unit: args.of_b.time_unit_b,
        ..b
    };
    let (reference, prediction) = (a.read(manners)?, b.read(manners)?);
    used(args, [reference.is_table, prediction.is_table])?;
    same_unit_of_time(&a, &reference.signal, &b, &prediction.signal)?;
    let named = [&reference.column, &prediction.column].map(|name| Quantity::named(name));
    let quantity = match args.quantity {
        Some(QuantityArgument::Acceleration) => Quantity::Acceleration,
        Some(QuantityArgument::Other) => Quantity::Other,
        None if named == [Quantity::Acceleration; 2] => Quantity::Acceleration,
        None => Quantity::Other,
    };
    let settings = Settings { quantity, cfc: args.cfc, from_s: args.from, to_s: args.to };
    let rating = rating::rate(&reference.signal, &prediction.signal, &settings)?;
    for warning in &rating.warnings {
        manners.warn(warning);
    }
    if manners.json {
        output::print_json(&rating)?;
    } else {
        output::print(|out| print(out, &rating))?;
    }
    let clean = rating.warnings.is_empty() && reference.problems + prediction.problems == 0;
    Ok(if clean { Outcome::Clean } else { Outcome::Warned })
}

/// Refuses what chooses nothing: a column of a solver's file, a node of a table.
fn used(args: &Args, is_table: [bool; 2]) -> Result<(), Failure> {
    let (both, a, b) = (&args.both, &args.of_a, &args.of_b);
    let [a_is_table, b_is_table] = is_table;
    let (any_table, all_tables) = (a_is_table || b_is_table, a_is_table && b_is_table);
    let column = "names a column of a CSV file, but that is a solver's: use --id and --component";
    let history = "chooses a history of a solver's file, but that is a CSV: use --column";
    for (option, given, fits, why) in [
        ("--column", both.column.is_some(), any_table, column),
        ("--column-a", a.column_a.is_some(), a_is_table, column),
        ("--column-b", b.column_b.is_some(), b_is_table, column),
        ("--id", both.id.is_some(), !all_tables, history),
        ("--id-a", a.id_a.is_some(), !a_is_table, history),
        ("--id-b", b.id_b.is_some(), !b_is_table, history),
        ("--component", both.component.is_some(), !all_tables, history),
        ("--component-a", a.component_a.is_some(), !a_is_table, history),
        ("--component-b", b.component_b.is_some(), !b_is_table, history),
        ("--section", both.section.is_some(), !all_tables, history),
    ] {
        if given && !fits {
            return Err(Failure::Usage(format!("{option} {why}")));
        }
    }
    Ok(())
}

/// Records that differ this much in length are in different units, or worth a word.
const LENGTHS: f64 = 100.0;

/// Units are not guessed: records of very different lengths must say theirs.
fn same_unit_of_time(a: &Place, of_a: &Signal, b: &Place, of_b: &Signal) -> Result<(), Failure> {
    let length = |signal: &Signal| signal.range_s().1 - signal.range_s().0;
    let (long_a, long_b) = (length(of_a), length(of_b));
    let ratio = (long_a / long_b).max(long_b / long_a);
    if ratio < LENGTHS || (a.unit.is_some() && b.unit.is_some()) {
        return Ok(());
    }
    Err(failed(format!(
        "{} lasts {long_a} s and {} {long_b} s, if both count time in s: say the units with --time-unit-a and --time-unit-b (s, ms or us)",
        a.path.display(),
        b.path.display()
    )))
}

/// A failure with a message of the command's own.
fn failed(message: String) -> Failure {
    Failure::Failed(message.into())
}

impl Place<'_> {
    fn read(&self, manners: Manners) -> Result<Read, Failure> {
        let is_table = self.path.extension().is_some_and(|extension| {
            ["csv", "tsv", "txt"].iter().any(|e| extension.eq_ignore_ascii_case(e))
        });
        if is_table && self.format.is_none() {
            return self.read_table();
        }
        match self.read_solver_file(manners) {
            // Any other name may hold a table as well, if its columns are asked for.
            Err(Failure::Failed(error))
                if self.column.is_some()
                    && matches!(error.downcast_ref(), Some(ReadError::UnknownFormat { .. })) =>
            {
                self.read_table()
            }
            Err(Failure::Failed(error))
                if matches!(error.downcast_ref(), Some(ReadError::UnknownFormat { .. })) =>
            {
                let letter = self.letter;
                Err(failed(format!(
                    "{error}; a CSV file has the ending .csv, or --column-{letter}"
                )))
            }
            other => other,
        }
    }

    fn read_table(&self) -> Result<Read, Failure> {
        let path = self.path.display();
        let text = file::read(self.path, MAX_TABLE_BYTES);
        let text = text.map_err(|e| failed(format!("{path}: {e}")))?;
        let columns = table::read(&mut &*text, self.column).map_err(|error| {
            let how = match error {
                table::TableError::NoColumn { .. } | table::TableError::SeveralColumns { .. } => {
                    format!(" with --column-{}", self.letter)
                }
                _ => String::new(),
            };
            failed(format!("{path}: {error}{how}"))
        })?;
        let said = TimeUnit::at_the_end_of(&columns.time_name);
        if self.unit.is_none()
            && let Some(unit) = said.filter(|unit| *unit != TimeUnit::S)
        {
            return Err(failed(format!(
                "{path}: line 1, column 1 (\"{}\"): expected a time in s: say --time-unit-{} {}",
                columns.time_name,
                self.letter,
                unit.name()
            )));
        }
        let signal = self.signal(&columns.name, &columns.time, &columns.values)?;
        Ok(Read { signal, column: columns.name, is_table: true, problems: 0 })
    }

    fn read_solver_file(&self, manners: Manners) -> Result<Read, Failure> {
        let selection = Selection {
            ids: self.id.map(|id| vec![id]),
            components: self.component.map(|component| vec![component.into()]),
            section: self.section.map(Into::into),
            ..Selection::all()
        };
        let file = solver::read(self.path, self.format, &selection)?;
        if let Some(section) = self.section.filter(|section| **section != *file.section) {
            return Err(Failure::Usage(format!(
                "{} has no section \"{section}\": it is a text file with the one section \"{}\"",
                self.path.display(),
                file.format
            )));
        }
        for problem in &file.problems {
            manners.warn(&format!("{}: {problem}", self.path.display()));
        }
        let (path, letter) = (self.path.display(), self.letter);
        let history = match &file.histories[..] {
            [history] => history,
            [] => return Err(failed(format!("{path}: it holds no history"))),
            [first, .., last] => {
                return Err(failed(format!(
                    "{path}: {} histories fit, from {} to {}: choose one with --id-{letter} and --component-{letter} (crumple inspect lists them)",
                    file.histories.len(),
                    first.label(),
                    last.label()
                )));
            }
        };
        let label = history.label();
        if let Some(state) = history.values.iter().position(|v| v.is_nan()) {
            return Err(failed(format!(
                "{path}: {label}: state {} at time {}: expected a number, but the file holds none there: leave it out with --from or --to after writing the rest by crumple histories",
                state + 1,
                history.time[state]
            )));
        }
        let signal = self.signal(&label, &history.time, &history.values)?;
        Ok(Read { signal, column: label, is_table: false, problems: file.problems.len() })
    }

    /// The signal in s and scaled.
    fn signal(&self, column: &str, time: &[f64], values: &[f64]) -> Result<Signal, Failure> {
        let seconds = self.unit.unwrap_or(TimeUnit::S).seconds();
        let name = format!("{}: {column}", self.path.display());
        let scaled = |values: &[f64], by: f64| values.iter().map(|v| v * by).collect();
        Signal::new(&name, scaled(time, seconds), scaled(values, self.scale))
            .map_err(|error| failed(format!("{name}: {error}")))
    }
}

fn print(out: &mut dyn Write, rating: &Rating) -> io::Result<()> {
    writeln!(out, "reference   {}", rating.reference.name)?;
    writeln!(out, "prediction  {}", rating.prediction.name)?;
    let filter = match rating.cfc {
        Some(class) => format!("CFC {class} on both, "),
        None => String::new(),
    };
    writeln!(
        out,
        "{filter}interpolated at {} common times from {} to {}, {} apart (10 kHz)",
        rating.samples,
        milliseconds(rating.from_s),
        milliseconds(rating.to_s),
        milliseconds(rating.interval_s),
    )?;
    let (rows, notes): (Vec<_>, Vec<_>) =
        rows(rating).into_iter().map(|[measure, value, note]| (vec![measure, value], note)).unzip();
    let mut table = Vec::new();
    output::table(&mut table, &["measure", "value"], &rows)?;
    let table = String::from_utf8_lossy(&table).into_owned();
    let notes = std::iter::once(String::new()).chain(notes);
    for (line, note) in table.lines().zip(notes) {
        writeln!(out, "{}", format!("{line}  {note}").trim_end())?;
    }
    Ok(())
}

fn milliseconds(time_s: f64) -> String {
    // Rounded to a nanosecond, as sums of intervals are not exact.
    format!("{} ms", (time_s * 1e9).round() / 1e6)
}

/// The lines of the table: measure, value, and what belongs to it.
fn rows(rating: &Rating) -> Vec<[String; 3]> {
    let percent = |ratio: f64| format!("{:.2} %", ratio * 100.0);
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let mut rows = Vec::new();
    let mut row = |measure: &str, value: Option<String>, more: String| {
        rows.push([measure.to_string(), or_dash(value), more]);
    };
    row("l1_ratio", rating.l1_ratio.map(percent), "sum|p-r|/sum|r|".into());
    row("rms_ratio", rating.rms_ratio.map(percent), String::new());
    row("peak_norm", rating.peak_norm.map(percent), "mean|p-r|/max|r|".into());
    let left_out = rating.pointwise.map(|p| format!("{} left out", percent(p.left_out)));
    row("pointwise", rating.pointwise.map(|p| percent(p.mean)), left_out.unwrap_or_default());
    let at = format!("at {}", milliseconds(rating.max_abs.time_s));
    row("max_abs", Some(format!("{:.5}", rating.max_abs.value)), at);
    for (number, peak) in rating.peaks.iter().enumerate() {
        let at = format!("of {:.5} at {}", peak.value, milliseconds(peak.time_s));
        let (value, more) = match (peak.error, peak.shift_s) {
            (Some(error), Some(shift_s)) => {
                let word = if shift_s < 0.0 { "earlier" } else { "later" };
                (percent(error), format!("{at}, {} {word}", milliseconds(shift_s.abs())))
            }
            _ => ("missing".into(), at),
        };
        row(&format!("peak {}", number + 1), Some(value), more);
    }
    row("integral", rating.integral_error.map(percent), "of p over that of r, less 1".into());
    let mut errors = |name: &str, of: Option<MagnitudePhase>| {
        let parts = of.map(|e| format!("M {:.4}, P {:.4}", e.magnitude, e.phase));
        row(name, of.map(|e| format!("{:.4}", e.combined)), parts.unwrap_or_default());
    };
    errors("Sprague-Geers", rating.sprague_geers);
    errors("Russell", rating.russell);
    let parts = rating.iso18571.map(|i| {
        format!(
            "{}; corridor {:.3}, phase {:.3}, magnitude {:.3}, slope {:.3}",
            i.grade.name(),
            i.corridor,
            i.phase,
            i.magnitude,
            i.slope
        )
    });
    let score = |rating: f64| format!("{rating:.3}");
    row("ISO/TS 18571", rating.iso18571.map(|i| score(i.rating)), parts.unwrap_or_default());
    let parts = rating.cora.map(|c| {
        format!(
            "corridor {:.3}, cross-correlation {:.3} (progression {:.3}, size {:.3}, phase {:.3})",
            c.corridor, c.cross_correlation, c.progression, c.size, c.phase
        )
    });
    row("CORA", rating.cora.map(|c| score(c.rating)), parts.unwrap_or_default());
    if let Some(of) = rating.deceleration {
        let both = |value: fn(&Deceleration) -> Option<f64>| {
            let number = |of: &Deceleration| or_dash(value(of).map(|v| format!("{v:.5}")));
            (Some(number(&of.prediction)), format!("reference {}", number(&of.reference)))
        };
        let (value, more) = both(|d| d.mean);
        row("mean deceleration", value, more);
        let (value, more) = both(|d| d.largest_120ms_mean);
        row("largest 120 ms mean", value, more);
    }
    rows
}
