//! `crumple rate`: how far a prediction is from its reference, by every measure.

use std::fmt::Display;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use super::arguments::{FileKind, one_of};
use super::{
    CommandResult, Failure, GlobalOptions, Outcome, failed_at, output, usage, usage_error,
};
use crate::charts::Motion;
use crate::error::{Error, error};
use crate::history::time_gaps;
use crate::multibody::STANDARD_GRAVITY_M_PER_S2;
use crate::rating::acceptance::{ACCEPTANCE, RunAcceptance, STANDARD, StageAcceptance, accept};
use crate::rating::differences::{Deceleration, MagnitudePhase};
use crate::rating::iso18571::Iso18571;
use crate::rating::{self, Quantity, Rating, RatingSettings, Signal};
use crate::solver::{self, Selection, WantedId};
use crate::table::Table;
use crate::unit::{M_PER_S_PER_KM_PER_H, M_PER_S_PER_MPH, Shown, TIME};
use crate::{file, formats};

/// Maximum number of bytes of a table that is rated: some million rows.
const MAX_TABLE_BYTES: u64 = 256 << 20;

/// Rate a prediction against a reference: ratios, peaks, ISO/TS 18571, CORA and others
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple rate test.csv:x_acceleration 'result.csv:a_m_per_s2[A1]' --cfc 60
  crumple rate fe/nodout:900001:x_velocity,scale=0.001 'result.csv:v_m_per_s[A1]' --to 150ms
  crumple rate 36kmh/nodout:900001:x_acceleration,scale=-0.001 48kmh/nodout:900001:x_acceleration,scale=-0.001 --cfc 60 --json
  crumple rate fe/binout:rwforc/forces:1:normal_force fe/rwforc:1:normal_force
  crumple rate test.csv,time=ms model.csv,time=s
  crumple rate one.csv other.csv      # two results of crumple simulate: the acceptance rule, interface by interface
A is the reference r, B the prediction p. Each is a CSV file (a header line; the first column is the
time), FILE:COLUMN, an MDF 4 file, FILE:CHANNEL, or any file that crumple histories reads, FILE:ID:COMPONENT, in a binout with
several sections FILE:SECTION:ID:COMPONENT; append ,scale=FACTOR for the values and ,time=UNIT for
the times (s, ms, us). What both share can be given once, by --id and --component or --column. Both
are filtered on request, then interpolated linearly at common times 0.1 ms apart (10 kHz, as required
by ISO/TS 18571). Accelerations are negative during deceleration. ISO/TS 18571 and CORA take at most 2 s:
choose with --from and --to. Of two results of crumple simulate, without a column, every interface that both have is
rated by the acceptance rule for numerical crash models that rail practice quotes from EN 15227:2020+A1:2024: the same
sequence, dissipated energy within 10 % of the initial one, displacement and mean force of each stage within 10 %.")]
pub(super) struct Args {
    /// Reference: CSV, MDF or solver file, with the column or history to take
    #[arg(value_name = "A", value_parser = Address::parse, allow_hyphen_values = true)]
    reference: Address,
    /// Prediction: CSV, MDF or solver file, with the column or history to take
    #[arg(value_name = "B", value_parser = Address::parse, allow_hyphen_values = true)]
    prediction: Address,
    #[command(flatten)]
    both: SignalOptions,
    /// Filter both with this channel frequency class, such as 60 or 180
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    cfc: Option<u32>,
    /// Start of the rated interval, with its unit, such as 10ms
    #[arg(long, value_parser = time, allow_hyphen_values = true)]
    from: Option<f64>,
    /// End of the rated interval, with its unit
    #[arg(long, value_parser = time, allow_hyphen_values = true)]
    to: Option<f64>,
    /// Kind of the signals (default: acceleration if both names indicate it)
    #[arg(long, value_parser = one_of(QUANTITIES))]
    quantity: Option<Quantity>,
}

/// Where the signal is in both files.
#[derive(clap::Args)]
struct SignalOptions {
    /// Column of the CSV files
    #[arg(long)]
    column: Option<String>,
    /// Node, wall or interface of the solver files; 3:surfa is one side
    #[arg(long)]
    id: Option<WantedId>,
    /// Component of the solver files, named as in binout, such as x_velocity
    #[arg(long)]
    component: Option<String>,
    /// Section of binouts, such as nodout or rwforc/forces
    #[arg(long)]
    section: Option<String>,
    /// Kind of the solver files (nodout, rcforc, …), if not recognised by their content
    #[arg(long)]
    format: Option<String>,
}

/// A failure to rate with a message of the command's own.
fn not_rated(message: String) -> Failure {
    error!(Rating, "{message}").into()
}

/// Where one signal stands, as it is written on the command line.
#[derive(Clone, Debug, PartialEq)]
struct Address {
    path: PathBuf,
    /// What follows the file's name: a column, or a history.
    within: Option<String>,
    scale: f64,
    /// Of the times.
    unit: Option<TimeUnit>,
}

impl Address {
    fn parse(text: &str) -> Result<Self, String> {
        let (mut rest, mut scale, mut unit) = (text, 1.0, None);
        // A comma may be in names as well.
        while let Some((before, last)) = rest.rsplit_once(',') {
            if let Some(value) = last.strip_prefix("scale=") {
                scale = factor(value)?;
            } else if let Some(value) = last.strip_prefix("time=") {
                unit = Some(unit_named(value).ok_or_else(|| {
                    format!("\"{value}\" is not a unit of time here: write s, ms or us")
                })?);
            } else {
                break;
            }
            rest = before;
        }
        // The longest beginning that is a file, since names may hold colons.
        let colons = rest.rmatch_indices(':').map(|(at, _)| at);
        let end =
            std::iter::once(rest.len()).chain(colons).find(|&at| Path::new(&rest[..at]).exists());
        // No such file: what is missing is reported when it is read.
        let end = end.unwrap_or_else(|| rest.find(':').unwrap_or(rest.len()));
        let within = rest.get(end + 1..).map(String::from);
        Ok(Self { path: rest[..end].into(), within, scale, unit })
    }
}

/// The history of a solver file that an address names.
#[derive(Clone, Debug, Default, PartialEq)]
struct HistoryAddress<'a> {
    section: Option<&'a str>,
    id: Option<WantedId>,
    component: Option<&'a str>,
}

impl<'a> HistoryAddress<'a> {
    /// `ID`, `COMPONENT`, `ID:COMPONENT` or `SECTION:ID:COMPONENT`; an id may have a side,
    /// `3:surfa`.
    fn parse(text: &'a str) -> Result<Self, String> {
        if let Ok(id) = text.parse() {
            return Ok(Self { id: Some(id), ..Self::default() });
        }
        let Some((before, component)) = text.rsplit_once(':') else {
            return Ok(Self { component: Some(text), ..Self::default() });
        };
        let component = Some(component);
        if let Ok(id) = before.parse() {
            return Ok(Self { section: None, id: Some(id), component });
        }
        let (section, id) = match before.split_once(':') {
            Some((section, id)) => {
                let wrong =
                    |e| format!("\"{text}\": \"{id}\" is not an id ({e}): write ID:COMPONENT");
                (section, Some(id.parse().map_err(wrong)?))
            }
            None => (before, None),
        };
        Ok(Self { section: Some(section), id, component })
    }
}

/// A unit of times, and its length in s.
type TimeUnit = (&'static str, f64);

const TIME_UNITS: [TimeUnit; 3] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

fn unit_named(name: &str) -> Option<TimeUnit> {
    TIME_UNITS.into_iter().find(|(unit, _)| *unit == name)
}

/// The unit that the name of a column ends with: `time_ms`, `time [ms]`, `t (ms)`, `Time <TIME/0.001>;`.
fn unit_at_the_end_of(name: &str) -> Option<TimeUnit> {
    let name = name.trim_end_matches([')', ']', ' ', ';', '>']);
    let (_, unit) = name.rsplit_once(['_', '(', '[', ' ', '/'])?;
    let size = unit.parse::<f64>().ok().filter(|_| name.contains('<'));
    let by_size = || TIME_UNITS.into_iter().find(|(_, seconds)| Some(*seconds) == size);
    // Both signs for micro.
    unit_named(&unit.to_lowercase().replace(['µ', 'μ'], "u")).or_else(by_size)
}

/// What signals may be.
const QUANTITIES: &[(&str, Quantity, &str)] = &[
    ("acceleration", Quantity::Acceleration, "Adds the means of the deceleration"),
    ("other", Quantity::Other, "Anything else"),
];

fn time(text: &str) -> Result<f64, String> {
    TIME.parse(text).map_err(|e| e.to_string())
}

fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|f| f.is_finite() && *f != 0.0);
    factor.ok_or_else(|| format!("\"{text}\" is not a factor: write for example 0.001 or -1"))
}

/// Where one signal stands, by its address and the options for both.
struct SignalRequest<'a> {
    address: &'a Address,
    both: &'a SignalOptions,
}

/// A signal as it was read, and what shows its kind.
struct LoadedSignal {
    signal: Signal,
    column: String,
    is_table: bool,
    /// Of its values, where its name says it and they are not scaled.
    unit: Option<ValueUnit>,
    /// Of its file; they have been printed.
    problems: Vec<String>,
}

/// Signals whose phase error is smaller have one shape; and a factor that is off by less is that of a unit.
const SAME_SHAPE: f64 = 0.02;

/// A unit of values, its SI unit and its size in it.
type ValueUnit = (&'static str, &'static str, f64);

/// Units of values, and how the names of columns write them.
const VALUE_UNITS: [(ValueUnit, &str); 12] = [
    (("m/s²", "m/s²", 1.0), "m_per_s2 m/s2 m/s^2 m/s**2 m/s²"),
    (("mm/s²", "m/s²", 1e-3), "mm_per_s2 mm/s2 mm/s^2 mm/s**2 mm/s²"),
    (("g", "m/s²", STANDARD_GRAVITY_M_PER_S2), "g"),
    (("m/s", "m/s", 1.0), "m_per_s m/s"),
    (("mm/s", "m/s", 1e-3), "mm_per_s mm/s"),
    (("km/h", "m/s", M_PER_S_PER_KM_PER_H), "km_per_h km/h kmh kph"),
    (("mph", "m/s", M_PER_S_PER_MPH), "mph"),
    (("m", "m", 1.0), "m"),
    (("mm", "m", 1e-3), "mm"),
    (("N", "N", 1.0), "n"),
    (("kN", "N", 1e3), "kn"),
    (("MN", "N", 1e6), "mn"),
];

/// The unit at the end of a column's name: `acc_g`, `v_m_per_s[A1]`, `force [kN]`.
fn value_unit(column: &str) -> Option<ValueUnit> {
    let name = column.to_lowercase();
    let (head, inside) = name
        .strip_suffix([']', ')'])
        .and_then(|name| name.rsplit_once(['[', '(']))
        .unwrap_or((&name, ""));
    let end = |unit: &str| {
        unit == inside || head.strip_suffix(unit).is_some_and(|quantity| quantity.ends_with('_'))
    };
    let units = VALUE_UNITS.into_iter();
    units.filter(|(_, ways)| ways.split(' ').any(end)).map(|(unit, _)| unit).next()
}

/// A factor with six digits behind the point, but no zeros at the end.
fn short(factor: f64) -> String {
    let text = format!("{factor:.6}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    if args.are_runs()? {
        args.refuse_of_signals()?;
        return rate_runs(&args.reference.path, &args.prediction.path, options);
    }
    let both = &args.both;
    let [a, b] = [&args.reference, &args.prediction].map(|address| SignalRequest { address, both });
    let (reference, prediction) = (a.read(options)?, b.read(options)?);
    used(args, [reference.is_table, prediction.is_table])?;
    same_unit_of_time(&a, &reference.signal, &b, &prediction.signal)?;
    let named = [&reference.column, &prediction.column].map(|name| Quantity::named(name));
    let quantity = match args.quantity {
        Some(quantity) => quantity,
        None if named == [Quantity::Acceleration; 2] => Quantity::Acceleration,
        None => Quantity::Other,
    };
    let settings = RatingSettings { quantity, cfc: args.cfc, from_s: args.from, to_s: args.to };
    let mut rating = rating::rate(&reference.signal, &prediction.signal, &settings)?;
    if let (Some((of_a, quantity_a, size_a)), Some((of_b, quantity_b, size_b))) =
        (reference.unit, prediction.unit)
        && of_a != of_b
    {
        let remedy = match quantity_a == quantity_b {
            true => format!(
                "write the factor after the file's name: {},scale={}",
                b.path().display(),
                // Quotients of sizes have digits that say nothing.
                format!("{:.12e}", size_b / size_a).parse::<f64>().unwrap_or(size_b / size_a)
            ),
            false => "they are different quantities".into(),
        };
        rating.warnings.push(format!(
            "according to their names, the reference is in {of_a} and the prediction in {of_b}, and they are compared as they stand: {remedy}"
        ));
    }
    if let (None, Some(of)) = (reference.unit.zip(prediction.unit), &rating.sprague_geers)
        && of.phase < SAME_SHAPE
    {
        let times = 1.0 + of.magnitude;
        let units = [
            1e3,
            1e6,
            1.0 / M_PER_S_PER_KM_PER_H,
            1.0 / M_PER_S_PER_MPH,
            STANDARD_GRAVITY_M_PER_S2,
        ];
        let factor = units.into_iter().flat_map(|size| [size, 1.0 / size]);
        if let Some(factor) = factor.into_iter().find(|f| (times / f - 1.0).abs() < SAME_SHAPE) {
            rating.warnings.push(format!(
                "the prediction is {} times the reference throughout: if they are in different units, write ,scale={} after what names the prediction",
                short(factor),
                short(b.address.scale / factor)
            ));
        }
    }
    options.warn_all(&rating.warnings);
    rating.warnings.extend([reference.problems, prediction.problems].concat());
    options.show(&rating, |out| print(out, &rating))?;
    Ok(Outcome::warned_if(!rating.warnings.is_empty()))
}

impl Args {
    /// Refuses what is for signals alone.
    fn refuse_of_signals(&self) -> Result<(), Failure> {
        let addresses = [&self.reference, &self.prediction];
        for (given, what) in [
            (addresses.iter().any(|address| address.scale != 1.0), "scale="),
            (addresses.iter().any(|address| address.unit.is_some()), "time="),
            (self.from.is_some(), "--from"),
            (self.to.is_some(), "--to"),
            (self.cfc.is_some(), "--cfc"),
            (self.quantity.is_some(), "--quantity"),
        ] {
            if given {
                return usage(format!(
                    "{what} is for one signal: name its column after the file, {}:COLUMN; without columns two whole results are compared",
                    self.reference.path.display()
                ));
            }
        }
        Ok(())
    }

    /// Whether both files are results of runs, of which no column is named.
    fn are_runs(&self) -> Result<bool, Failure> {
        let SignalOptions { column, id, component, section, format } = &self.both;
        let is_named = column.is_some()
            || id.is_some()
            || component.is_some()
            || section.is_some()
            || format.is_some();
        let is_result = |address: &Address| -> Result<bool, Failure> {
            let may_be = address.within.is_none() && !is_named && address.path.exists();
            let is_result = may_be && FileKind::of(&address.path)? == FileKind::Result;
            Ok(is_result && has_deflections(&address.path))
        };
        let (reference, prediction) = (&self.reference, &self.prediction);
        let (result, other) = match (is_result(reference)?, is_result(prediction)?) {
            (true, false) => (reference, prediction),
            (false, true) => (prediction, reference),
            (both, _) => return Ok(both),
        };
        if is_named || other.within.is_some() {
            return Ok(false);
        }
        let path = other.path.display();
        file::open(&other.path).map_err(|e| not_rated(format!("{path}: {e}")))?;
        usage(format!(
            "{path} is not the result of a run, as {result} is (a table with deflection_m of its interfaces, as crumple simulate writes it): to compare two columns, name each after its file, {result}:COLUMN",
            result = result.path.display()
        ))
    }
}

/// Whether a table has deflections and forces of interfaces, as `crumple simulate -o` writes them.
fn has_deflections(path: &Path) -> bool {
    let mut header = Vec::new();
    let read = file::open(path)
        .map(|f| BufReader::new(f).take(MAX_TABLE_BYTES).read_until(b'\n', &mut header));
    let has = |column: &str| String::from_utf8_lossy(&header).contains(column);
    // The MDF file of a run always has them.
    let has_both = || has(",deflection_m[") && has(",force_N[");
    read.is_ok() && (header.starts_with(b"MDF ") || has_both())
}

/// Interfaces that begin within so many s of each other have no order.
const TIE_S: f64 = 0.002;

/// Two runs by the acceptance rule.
fn rate_runs(reference: &Path, prediction: &Path, options: GlobalOptions) -> CommandResult {
    let read = |path: &Path| -> Result<Motion, Failure> {
        let text = file::read(path, MAX_TABLE_BYTES).map_err(|e| failed_at(path, e))?;
        formats::run_table(text)
            .and_then(|table| Motion::of_csv(&table))
            .map_err(|e| failed_at(path, e))
    };
    let (r, p) = (read(reference)?, read(prediction)?);
    let gaps = options.warn_of(reference, &r.gaps()).max(options.warn_of(prediction, &p.gaps()));
    let Some(found) = accept(&r.stages(), &p.stages(), TIE_S) else {
        return usage(format!(
            "{} and {} have no interface in common that takes energy: to rate one column, name it: {}:COLUMN",
            reference.display(),
            prediction.display(),
            reference.display()
        ));
    };
    let outcome = options.warn_all(["reference", "prediction"].into_iter().enumerate().filter_map(
        |(of, who)| {
            let is_cut = |s: &&StageAcceptance| s.counts && [s.reference, s.prediction][of].is_cut;
            let cut: Vec<&str> = found.stages.iter().filter(is_cut).map(|s| &*s.stage).collect();
            (!cut.is_empty()).then(|| {
                format!(
                    "the {who} ends while these are still being crushed, so crush and energy are not final: {}",
                    cut.join(", ")
                )
            })
        },
    ));
    options.show(&found, |out| print_runs(out, &found))?;
    Ok(outcome.max(gaps))
}

fn print_runs(out: &mut dyn Write, found: &RunAcceptance) -> io::Result<()> {
    let largest = |of: fn(&StageAcceptance) -> f64| found.stages.iter().map(of).fold(0.0, f64::max);
    let energy = Shown::energy(found.initial_energy_j);
    let force = Shown::force(largest(|s| s.reference.mean_force_n));
    let signed = |error: f64| format!("{:+.1} %", 100.0 * error);
    let table = Table::of(&found.stages)
        .column("interface", |s| &s.stage)
        .column("energy", |s| energy.text(s.reference.dissipated_j))
        .column("other", |s| energy.text(s.prediction.dissipated_j))
        .column("of initial", |s| signed(s.acceptance.energy_error))
        .column("crush", |s| format!("{:.3} m", s.reference.displacement_m))
        .column("other", |s| format!("{:.3} m", s.prediction.displacement_m))
        .column("error", |s| or_dash(s.acceptance.displacement_error.map(signed)))
        .column("mean force", |s| force.text(s.reference.mean_force_n))
        .column("other", |s| force.text(s.prediction.mean_force_n))
        .column("error", |s| or_dash(s.acceptance.mean_force_error.map(signed)))
        .column("within 10 %", |s| match (s.counts, s.acceptance.passes) {
            (false, _) => "does not count",
            (true, true) => "yes",
            (true, false) => "no",
        });
    output::table(out, table)?;
    let [r, p] = found.sequences.each_ref().map(|names| names.join(", "));
    let sequence = match found.same_sequence {
        true if r.is_empty() => "no interface counts".into(),
        true => format!("the same sequence: {r}"),
        false if p.is_empty() || r.is_empty() => "one of the sequences is empty".into(),
        false => format!("another sequence: {p} instead of {r}"),
    };
    writeln!(out, "{sequence}")?;
    if !found.missing.is_empty() {
        writeln!(out, "not in both: {}", found.missing.join(", "))?;
    }
    let is_cut = |s: &&StageAcceptance| s.counts && (s.reference.is_cut || s.prediction.is_cut);
    let cut: Vec<&str> = found.stages.iter().filter(is_cut).map(|s| &*s.stage).collect();
    if !cut.is_empty() {
        writeln!(out, "not final in one of the runs: {}", cut.join(", "))?;
    }
    let verdict = if found.passes { "passes" } else { "fails" };
    writeln!(
        out,
        "energy of all {} of {} taken by the reference; {verdict}: {ACCEPTANCE} of each interface that takes at least 1 % of the energy in one of the runs, and the same sequence ({STANDARD})",
        signed(found.energy_error),
        energy.text(found.initial_energy_j)
    )
}

/// Refuses what chooses nothing: a column of a solver file, a node of a table.
fn used(args: &Args, is_table: [bool; 2]) -> Result<(), Failure> {
    let both = &args.both;
    let [a_is_table, b_is_table] = is_table;
    let (any_table, all_tables) = (a_is_table || b_is_table, a_is_table && b_is_table);
    let column =
        "names a column of a CSV file, but this is a solver file: use --id and --component";
    let history = "chooses a history of a solver file, but this is a CSV file: use --column";
    for (option, given, fits, why) in [
        ("--column", both.column.is_some(), any_table, column),
        ("--id", both.id.is_some(), !all_tables, history),
        ("--component", both.component.is_some(), !all_tables, history),
        ("--section", both.section.is_some(), !all_tables, history),
    ] {
        if given && !fits {
            return usage(format!("{option} {why}"));
        }
    }
    Ok(())
}

/// Records that differ this much in length are probably in different units.
const LENGTHS: f64 = 100.0;

/// Units are not guessed: for records of very different lengths they must be given.
fn same_unit_of_time(
    a: &SignalRequest,
    of_a: &Signal,
    b: &SignalRequest,
    of_b: &Signal,
) -> Result<(), Failure> {
    let length = |signal: &Signal| signal.range_s().1 - signal.range_s().0;
    let (long_a, long_b) = (length(of_a), length(of_b));
    let ratio = (long_a / long_b).max(long_b / long_a);
    if ratio < LENGTHS || (a.address.unit.is_some() && b.address.unit.is_some()) {
        return Ok(());
    }
    Err(not_rated(format!(
        "{} lasts {long_a} s and {} {long_b} s, if both count time in s: write the unit of each after its name, such as {},time=s and {},time=ms",
        a.path().display(),
        b.path().display(),
        a.path().display(),
        b.path().display()
    )))
}

impl SignalRequest<'_> {
    fn path(&self) -> &Path {
        &self.address.path
    }

    fn column(&self) -> Option<&str> {
        self.address.within.as_deref().or(self.both.column.as_deref())
    }

    fn read(&self, options: GlobalOptions) -> Result<LoadedSignal, Failure> {
        let is_table = self.path().extension().is_some_and(|extension| {
            ["csv", "tsv", "txt", "crv", "cur", "mf4", "mdf"]
                .iter()
                .any(|e| extension.eq_ignore_ascii_case(e))
        });
        if is_table && self.both.format.is_none() {
            return self.read_table(options);
        }
        match self.read_solver_file(options) {
            // Any other name may hold a table as well.
            Err(error) if error.downcast_ref().is_some_and(|e: &Error| e.is_about("format")) => {
                match self.read_table(options) {
                    Err(_) if self.column().is_none() => Err(not_rated(format!(
                        "{error}; a CSV file has the extension .csv, or its column after its name: {}:COLUMN",
                        self.path().display()
                    ))),
                    read => read,
                }
            }
            other => other,
        }
    }

    fn read_table(&self, options: GlobalOptions) -> Result<LoadedSignal, Failure> {
        let path = self.path().display();
        let text = file::read(self.path(), MAX_TABLE_BYTES);
        let text = text.map_err(|e| not_rated(format!("{path}: {e}")))?;
        let read = formats::history(&text, self.column()).map_err(|error| {
            let how = if error.is_about("column") {
                format!(" after the file's name: {path}:COLUMN")
            } else {
                String::new()
            };
            not_rated(format!("{path}: {error}{how}"))
        })?;
        let (line, time_name) = &read.time_name;
        let said = unit_at_the_end_of(time_name);
        if self.address.unit.is_none()
            && let Some(unit) = said.filter(|(_, seconds)| *seconds != 1.0)
        {
            return Err(not_rated(format!(
                "{path}: line {line}, column 1 (\"{time_name}\"): expected a time in s: write {path},time={}",
                unit.0
            )));
        }
        let signal = self.signal(&read.name, &read.time, &read.values)?;
        let problems = self.warned_of(&time_gaps(&read.time), options);
        let column = format!("{} {}", read.name, read.title);
        let unit = value_unit(&read.name).filter(|_| self.address.scale == 1.0);
        Ok(LoadedSignal { signal, column, is_table: true, unit, problems })
    }

    fn read_solver_file(&self, options: GlobalOptions) -> Result<LoadedSignal, Failure> {
        let within = self.address.within.as_deref();
        let named = within.map(HistoryAddress::parse).transpose().map_err(usage_error)?;
        let named = named.unwrap_or_default();
        let section = named.section.or(self.both.section.as_deref());
        let selection = Selection {
            ids: named.id.or(self.both.id).map(|id| vec![id]),
            components: named
                .component
                .or(self.both.component.as_deref())
                .map(|name| vec![name.into()]),
            section: section.map(Into::into),
            ..Selection::all()
        };
        let file = solver::read(self.path(), self.both.format.as_deref(), &selection)?;
        let problems = self.warned_of(&file.problems, options);
        let path = self.path().display();
        let history = match &file.histories[..] {
            [history] => history,
            [] => return Err(not_rated(format!("{path}: it holds no history"))),
            [first, .., last] => {
                return Err(not_rated(format!(
                    "{path}: {} histories match, from {} to {}: choose one as {path}:ID:COMPONENT (crumple inspect lists them)",
                    file.histories.len(),
                    first.label(),
                    last.label()
                )));
            }
        };
        let label = history.label();
        if let Some(state) = history.values.iter().position(|v| v.is_nan()) {
            return Err(not_rated(format!(
                "{path}: {label}: state {} at time {}: expected a number, but the file holds none there: choose an interval without it with --from and --to, after writing the rest with crumple histories",
                state + 1,
                history.time[state]
            )));
        }
        let signal = self.signal(&label, &history.time, &history.values)?;
        Ok(LoadedSignal { signal, column: label, is_table: false, unit: None, problems })
    }

    /// Warns of what is wrong with the file, and returns it.
    fn warned_of<W: Display>(&self, problems: &[W], options: GlobalOptions) -> Vec<String> {
        let path = self.path().display();
        let problems: Vec<String> = problems.iter().map(|p| format!("{path}: {p}")).collect();
        options.warn_all(&problems);
        problems
    }

    /// The signal in s and scaled.
    fn signal(&self, column: &str, time: &[f64], values: &[f64]) -> Result<Signal, Failure> {
        let seconds = self.address.unit.map_or(1.0, |(_, seconds)| seconds);
        let name = format!("{}: {column}", self.path().display());
        let scaled = |values: &[f64], by: f64| values.iter().map(|v| v * by).collect();
        Signal::new(&name, scaled(time, seconds), scaled(values, self.address.scale))
            .map_err(|error| not_rated(format!("{name}: {error}")))
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
    let rows = rows(rating);
    let measures = Table::of(&rows)
        .column("measure", |[measure, ..]| measure)
        .column("value", |[_, value, _]| value);
    let mut table = Vec::new();
    output::table(&mut table, measures)?;
    let table = String::from_utf8_lossy(&table).into_owned();
    // What belongs to a value goes on behind it.
    let notes = std::iter::once("").chain(rows.iter().map(|[.., note]| note.as_str()));
    for (line, note) in table.lines().zip(notes) {
        writeln!(out, "{}", format!("{line}  {note}").trim_end())?;
    }
    Ok(())
}

fn milliseconds(time_s: f64) -> String {
    // Rounded to a nanosecond, as sums of intervals are not exact.
    format!("{} ms", (time_s * 1e9).round() / 1e6)
}

/// Five significant digits.
fn digits(value: f64) -> String {
    let decimals = (4.0 - libm::log10(value.abs().max(1e-9)).floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "-".into())
}

/// The lines of the table: measure, value, and what belongs to it.
fn rows(rating: &Rating) -> Vec<[String; 3]> {
    let percent = |ratio: f64| format!("{:.2} %", ratio * 100.0);
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
    row("max_abs", Some(digits(rating.max_abs.value)), at);
    for (number, peak) in rating.peaks.iter().enumerate() {
        let at = format!("of {} at {}", digits(peak.value), milliseconds(peak.time_s));
        let (value, more) = match (peak.error, peak.shift_s) {
            (Some(error), Some(shift_s)) => {
                let word = if shift_s < 0.0 { "earlier" } else { "later" };
                (percent(error), format!("{at}, {} {word}", milliseconds(shift_s.abs())))
            }
            _ => ("missing".into(), at),
        };
        row(&format!("peak {}", number + 1), Some(value), more);
    }
    row("integral", rating.integral_error.map(percent), "of p over that of r, minus 1".into());
    let mut errors = |name: &str, of: Option<MagnitudePhase>| {
        let parts = of.map(|e| format!("M {:.4}, P {:.4}", e.magnitude, e.phase));
        row(name, of.map(|e| format!("{:.4}", e.combined)), parts.unwrap_or_default());
    };
    errors("Sprague-Geers", rating.sprague_geers);
    errors("Russell", rating.russell);
    let parts = rating.iso18571.map(iso18571_parts);
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
            let number = |of: &Deceleration| or_dash(value(of).map(digits));
            (Some(number(&of.prediction)), format!("reference {}", number(&of.reference)))
        };
        let span = |of: Deceleration| {
            let ends = of.from_s.zip(of.to_s);
            ends.map_or("-".into(), |(from, to)| format!("{:.1} to {:.1} ms", 1e3 * from, 1e3 * to))
        };
        let (value, more) = both(|d| d.mean);
        let spans = format!("{more}; {}, reference {}", span(of.prediction), span(of.reference));
        row("mean deceleration", value, spans);
        let (value, more) = both(|d| d.largest_120ms_mean);
        row("largest 120 ms mean", value, more);
    }
    rows
}

fn iso18571_parts(rating: Iso18571) -> String {
    format!(
        "{}; corridor {:.3}, phase {:.3}, magnitude {:.3}, slope {:.3}",
        rating.grade.name(),
        rating.corridor,
        rating.phase,
        rating.magnitude,
        rating.slope
    )
}
