//! Curve of an ISO-MME test (ISO/TS 13499): a channel of displacement and one of force over time.
//!
//! A channel file has lines `name :value`, then one value per line. Characters 13 and 14 of its
//! channel code are the dimension: `DS` for displacement, `FO` for force, `TI` for time. With the implicit
//! reference channel, or without any, times are the time of the first sample and multiples of the interval, in s;
//! with an explicit one they are the values of the channel named by `Reference channel name`.

use std::fs;
use std::path::{Path, PathBuf};

use super::columns::{LISTED, check_points, no_curve, several_curves};
use super::curve::{
    CUT, Metadata, Place, ReadCurve, expected, miscounted, shown, source_file, title, value,
};
use super::encoding::{decoded, lines, number};
use super::label::Quantity;
use super::{Input, MAX_CURVE_BYTES};
use crate::curve::SourceFile;
use crate::error::{Error, error};
use crate::file;
use crate::signal::interpolate;
use crate::unit::{MASS, SPEED};

/// Files of a folder that are examined: a test has some hundred channels.
const MOST_FILES: usize = 1_000;

/// The tests that a folder holds: its `.mme` files, else the folders in it that have one.
pub(super) fn tests(folder: &Path) -> Vec<PathBuf> {
    let of = |folder: &Path| -> Vec<PathBuf> {
        let names = names(folder).unwrap_or_default().into_iter();
        names.filter(|path| has_extension(path, "mme") && !path.is_dir()).collect()
    };
    let own = of(folder);
    if !own.is_empty() {
        own
    } else {
        let within = names(folder).unwrap_or_default().into_iter();
        within.filter(|path| path.is_dir() && !of(path).is_empty()).collect()
    }
}

/// Refuses a folder of several tests: each has a speed of its own.
pub(super) fn check_one(folder: &Path, tests: &[PathBuf]) -> Result<(), Error> {
    match tests {
        [only] if only.parent() == Some(folder) && !only.is_dir() => Ok(()),
        tests => {
            let known = tests.iter().take(LISTED).map(|test| test.display().to_string());
            let (tests, known) = (tests.len(), known.collect::<Vec<_>>().join(" "));
            Err(error!(
                CurveFile,
                "the folder holds {tests} ISO-MME tests: give each one you need separately: {known}"
            ))
        }
    }
}

pub(super) fn recognise(input: &Input<'_>) -> bool {
    let is_header = |line: &str| line.to_ascii_lowercase().starts_with("channel code");
    input.path.is_dir()
        || has_extension(input.path, "mme")
        || lines(input.beginning()).any(|(_, line)| is_header(line))
}

pub(super) fn read(input: &Input<'_>) -> Result<ReadCurve, Error> {
    let mut columns = ReadCurve::default();
    test_facts(input, &mut columns)?;
    let (mut found, mut bytes_left) = (Vec::new(), MAX_CURVE_BYTES);
    for path in channel_files(input.path)? {
        let named = |source: Error| {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            error!(CurveFile, "{file}: {source}").caused_by(source)
        };
        let bytes = file::read(&path, bytes_left).map_err(|e| named(e.into()))?;
        bytes_left -= bytes.len() as u64;
        if let Some(channel) = Channel::read(&path, &bytes).map_err(named)? {
            found.push(channel);
        }
    }
    let (times, found): (Vec<Channel>, Vec<Channel>) =
        found.into_iter().partition(|channel| channel.quantity == Quantity::Time);
    let (deflection, force) = choose(found, input.options.curve.as_deref())?;
    let (motion_s, at_s) = (deflection.times(&times)?, force.times(&times)?);
    for channel in [&deflection, &force] {
        let (code, what) = (&channel.code, channel.quantity.terms().name);
        columns.notes.push(format!("{what}: channel {code} in {}", channel.unit));
        if channel.file.path != input.path.display().to_string() {
            columns.files.push(channel.file.clone());
        }
    }
    columns.facts = merged(columns.facts, &[deflection.facts, force.facts]);
    columns.title = title(&force.name, &mut columns.notes);
    columns.notes.extend(force.note());
    if motion_s == at_s {
        columns.deflection_m = deflection.values;
        columns.force_n = force.values;
        columns.time_s = Some(at_s);
        columns.lines = force.lines;
        return Ok(columns);
    }
    let (from_s, to_s) = (motion_s.first().copied(), motion_s.last().copied());
    let (from_s, to_s) = (from_s.unwrap_or_default(), to_s.unwrap_or_default());
    let common: Vec<usize> =
        (0..at_s.len()).filter(|&i| (from_s..=to_s).contains(&at_s[i])).collect();
    let time_s: Vec<f64> = common.iter().map(|&i| at_s[i]).collect();
    if motion_s.len() > 1 && !time_s.is_empty() {
        columns.deflection_m = interpolate(&motion_s, &deflection.values, &time_s)
            .map_err(|e| error!(CurveFile, "expected common times, found {e}"))?;
    }
    columns.notes.push(format!(
        "times: they differ between the channels; the displacement was interpolated to {} of the force's",
        time_s.len()
    ));
    columns.force_n = common.iter().map(|&i| force.values[i]).collect();
    columns.lines = common.iter().map(|&i| force.lines[i]).collect();
    columns.deflection_m.truncate(time_s.len());
    columns.time_s = Some(time_s);
    Ok(columns)
}

/// Reads the `.mme` file of the test: that of the folder, or the given one.
fn test_facts(input: &Input<'_>, columns: &mut ReadCurve) -> Result<(), Error> {
    if !input.path.is_dir() {
        described(input.text, &mut columns.facts);
        return comments(input.text, &mut columns.facts);
    }
    let Some(path) = names(input.path)?.into_iter().find(|p| has_extension(p, "mme")) else {
        return Ok(());
    };
    let bytes = file::read(&path, MAX_CURVE_BYTES)?;
    columns.files.push(source_file(&path, &bytes));
    let text = decoded(&bytes).text;
    described(&text, &mut columns.facts);
    comments(&text, &mut columns.facts)
}

/// Takes masses (kg) and velocities (m/s) of the test objects.
fn described(bytes: &str, facts: &mut Metadata) {
    let header = Header::read(bytes);
    // In kg and m/s, unless a unit stands behind the number.
    let of = |what: &str, k: usize| {
        let dimension = if what == "mass" { &MASS } else { &SPEED };
        let text = |key: String| {
            let text = header.text(&key);
            number(text).or_else(|| dimension.parse(text.trim()).ok())
        };
        text(format!("{what} test object {k}"))
            .or_else(|| text(format!("{what} of test object {k}")))
    };
    facts.mass_kg = of("mass", 1).filter(|m| *m > 0.0);
    facts.other_mass_kg = of("mass", 2).filter(|m| *m > 0.0);
    let closing = of("velocity", 1).map(|v| (v - of("velocity", 2).unwrap_or(0.0)).abs());
    facts.speed_m_per_s = closing.filter(|v| *v > 0.0);
}

/// The first available value.
fn merged(first: Metadata, others: &[Metadata]) -> Metadata {
    others.iter().fold(first, |a, b| Metadata {
        force: a.force.or(b.force),
        speed_m_per_s: a.speed_m_per_s.or(b.speed_m_per_s),
        speed_kind: a.speed_kind.or(b.speed_kind),
        mass_kg: a.mass_kg.or(b.mass_kg),
        other_mass_kg: a.other_mass_kg.or(b.other_mass_kg),
        ..a
    })
}

/// Takes the facts of lines `Comments :key: value`.
fn comments(bytes: &str, facts: &mut Metadata) -> Result<(), Error> {
    for (at, line) in lines(bytes) {
        if let Some((key, value)) = line.split_once(':')
            && key.trim().eq_ignore_ascii_case("comments")
        {
            facts.take("Comments :", value, Place::Line(at))?;
        }
    }
    Ok(())
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted))
}

/// Content of a folder, in order.
fn names(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.filter_map(Result::ok).take(MOST_FILES);
    let mut names: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    names.sort();
    Ok(names)
}

/// The channel files of a test: of its folder, of its `.mme` file, or beside one of them.
fn channel_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    let is_channel = |p: &Path| {
        let digits = |e: &std::ffi::OsStr| e.to_string_lossy().bytes().all(|b| b.is_ascii_digit());
        p.extension().is_some_and(digits) && p.is_file()
    };
    let parent = crate::file::folder_of(path);
    let is_folder = path.is_dir();
    if !is_folder && !has_extension(path, "mme") {
        let same = |p: &PathBuf| p.file_stem() == path.file_stem() && is_channel(p);
        // A named file is a channel whatever its name.
        let mut beside: Vec<PathBuf> = names(parent)?.into_iter().filter(same).collect();
        if !beside.iter().any(|p| p.file_name() == path.file_name()) {
            beside.push(path.into());
        }
        let own = beside.iter_mut().find(|p| p.file_name() == path.file_name());
        own.into_iter().for_each(|own| *own = path.into());
        return Ok(beside);
    }
    let folder = if is_folder { path } else { parent };
    let is_named = |p: &PathBuf| {
        p.is_dir() && p.file_name().is_some_and(|n| n.eq_ignore_ascii_case("channel"))
    };
    let within = names(folder)?.into_iter().find(is_named);
    let all = names(within.as_deref().unwrap_or(folder))?;
    let mut all: Vec<PathBuf> = all.into_iter().filter(|p| is_channel(p)).collect();
    // Of several tests in one folder, those of the test that was named.
    if !is_folder && all.iter().any(|p| p.file_stem() == path.file_stem()) {
        all.retain(|p| p.file_stem() == path.file_stem());
    }
    Ok(all)
}

/// A channel of displacement, force or time, in SI.
struct Channel {
    code: String,
    name: String,
    quantity: Quantity,
    unit: String,
    times: Times,
    values: Vec<f64>,
    lines: Vec<u64>,
    facts: Metadata,
    file: SourceFile,
}

/// The times of a channel's values.
enum Times {
    /// Of the first value, and the interval between two.
    Even { first_s: f64, interval_s: f64, is_stated: bool },
    /// Those of the channel with this code or name; of the only one of time, if it is empty.
    Of { channel: String, line: u64 },
}

impl Channel {
    /// In s, one per value.
    fn times(&self, channels: &[Self]) -> Result<Vec<f64>, Error> {
        let (wanted, line) = match &self.times {
            Times::Even { first_s, interval_s, .. } => {
                return Ok((0..self.values.len())
                    .map(|i| first_s + i as f64 * interval_s)
                    .collect());
            }
            Times::Of { channel, line } => (channel, *line),
        };
        let is_wanted = |c: &&Self| c.code == *wanted || c.name == *wanted;
        let found = match (wanted.is_empty(), channels) {
            (true, [only]) => Some(only),
            _ => channels.iter().find(is_wanted),
        };
        let file = Path::new(&self.file.path).file_name().unwrap_or_default().to_string_lossy();
        let named = |source| error!(CurveFile, "{file}: {source}").caused_by(source);
        let Some(found) = found else {
            let known: Vec<&str> = channels.iter().map(|c| &*c.code).take(LISTED).collect();
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            return Err(named(error!(
                CurveFile,
                "{place}: the times are those of another channel: expected \"Reference channel :implicit\" with an interval, or \"Reference channel name :\" with the code of a channel of time (…TI…) beside it; there are {known}",
                place = Place::Line(line)
            )));
        };
        if found.values.len() == self.values.len() {
            Ok(found.values.clone())
        } else {
            Err(named(miscounted(
                Place::Line(line),
                format_args!("the reference channel {}", found.code),
                format_args!("{} times", found.values.len()),
                format_args!("{} values", self.values.len()),
                "name the channel of its own times",
            )))
        }
    }

    /// How its times were read, if not in the usual way.
    fn note(&self) -> Option<String> {
        match &self.times {
            Times::Even { is_stated: true, .. } => None,
            Times::Even { .. } => Some(
                "times: those of first sample and interval; the file names no reference channel"
                    .into(),
            ),
            Times::Of { channel, .. } => Some(format!("times: those of the channel {channel}")),
        }
    }

    /// The channel of a file; `None` if it is of another dimension.
    fn read(path: &Path, bytes: &[u8]) -> Result<Option<Self>, Error> {
        let file = source_file(path, bytes);
        let bytes = &decoded(bytes).text;
        let header = Header::read(bytes);
        let code = header.text("channel code");
        let quantity = match code.get(12..14) {
            Some("DS") => Quantity::Deflection,
            Some("FO") => Quantity::Force,
            Some("TI") => Quantity::Time,
            _ => return Ok(None),
        };
        let (line, unit) = header.entry("unit");
        let size = quantity.known_size_of(unit, Place::Line(line))?;
        let times = match quantity {
            Quantity::Time => Times::Even { first_s: 0.0, interval_s: 0.0, is_stated: true },
            Quantity::Deflection | Quantity::Force => header.times()?,
        };
        let (values, lines) = header.values(bytes, size)?;
        let mut facts = Metadata::default();
        comments(bytes, &mut facts)?;
        Ok(Some(Self {
            code: code.into(),
            name: header.text("name of the channel").into(),
            quantity,
            unit: unit.into(),
            times,
            values,
            lines,
            facts,
            file,
        }))
    }
}

/// The lines `name :value` of a channel file.
struct Header {
    /// Line, name in lower case, value.
    entries: Vec<(u64, String, String)>,
}

/// The standard's text for an entry without a value.
const NO_VALUE: &str = "NOVALUE";
/// Lines of a header: a few dozen.
const HEADER_LINES: usize = 1_000;

impl Header {
    fn read(bytes: &str) -> Self {
        let entries = lines(bytes).take(HEADER_LINES).filter_map(|(at, line)| {
            let (name, value) = line.split_once(':')?;
            Some((at, name.trim().to_ascii_lowercase(), value.trim().to_string()))
        });
        Self { entries: entries.collect() }
    }

    /// Line and value of an entry; line 1 and nothing if there is none.
    fn entry(&self, name: &str) -> (u64, &str) {
        let found = self.entries.iter().find(|(_, n, _)| n == name);
        found.map_or((1, ""), |(line, _, value)| (*line, value))
    }

    fn text(&self, name: &str) -> &str {
        self.entry(name).1
    }

    fn number(&self, name: &str) -> Result<f64, Error> {
        let (line, text) = self.entry(name);
        let what = format_args!("\"{name} :\" with a number");
        number(text).ok_or_else(|| expected(Place::Line(line), what, text))
    }

    /// Of which channel the times are, or how they follow from an interval.
    fn times(&self) -> Result<Times, Error> {
        let (line, reference) = self.entry("reference channel");
        let is = |text: &str| reference.eq_ignore_ascii_case(text);
        let is_stated = is("implicit");
        if !(is_stated || is("") || is(NO_VALUE)) {
            let name = self.text("reference channel name");
            let name = if name.eq_ignore_ascii_case(NO_VALUE) { "" } else { name };
            // Some programs write the channel itself instead.
            let channel = if is("explicit") { name } else { reference };
            return Ok(Times::Of { channel: channel.into(), line });
        }
        let first_s = self.number("time of first sample")?;
        let interval_s = self.number("sampling interval")?;
        if interval_s <= 0.0 {
            let (line, found) = self.entry("sampling interval");
            return Err(expected(Place::Line(line), "an interval above 0 in s", found));
        }
        Ok(Times::Even { first_s, interval_s, is_stated })
    }

    /// The values, in SI, and their lines.
    fn values(&self, bytes: &str, size: f64) -> Result<(Vec<f64>, Vec<u64>), Error> {
        let (mut values, mut at) = (Vec::new(), Vec::new());
        for (line, text) in lines(bytes).filter(|(_, t)| !t.contains(':') && !t.trim().is_empty()) {
            values.push(value(Place::Line(line), text)? * size);
            at.push(line);
            check_points(values.len())?;
        }
        let (line, declared) = self.entry("number of samples");
        match declared.parse::<usize>() {
            Ok(count) if count == values.len() => Ok((values, at)),
            _ => Err(miscounted(
                Place::Line(line),
                "number of samples",
                shown(declared),
                format_args!("{} values", values.len()),
                CUT,
            )),
        }
    }
}

/// The channels of the codes that were requested, or the only ones.
fn choose(found: Vec<Channel>, asked: Option<&str>) -> Result<(Channel, Channel), Error> {
    let codes = |quantity: Quantity, from: &[Channel]| {
        let of = from.iter().filter(|c| c.quantity == quantity);
        let codes: Vec<String> = of.map(|c| c.code.clone()).take(20).collect();
        if codes.is_empty() { "none".into() } else { codes.join(", ") }
    };
    let known = format!(
        "displacement {}; force {} (both codes, with a comma between)",
        codes(Quantity::Deflection, &found),
        codes(Quantity::Force, &found)
    );
    let is_asked = |channel: &Channel| {
        asked.is_none_or(|asked| asked.split(',').any(|code| code.trim() == channel.code))
    };
    let (deflections, forces): (Vec<Channel>, Vec<Channel>) = found
        .into_iter()
        .filter(is_asked)
        .partition(|channel| channel.quantity == Quantity::Deflection);
    let is_one_alone = deflections.len() + forces.len() == 1;
    let (mut deflections, mut forces) = (deflections.into_iter(), forces.into_iter());
    let first = (deflections.next(), forces.next());
    let has_more = deflections.next().is_some() || forces.next().is_some();
    match (first, asked) {
        ((Some(deflection), Some(force)), _) if !has_more => Ok((deflection, force)),
        ((Some(_), Some(_)), _) => Err(several_curves(&known)),
        (_, Some(asked)) if is_one_alone => Err(error!(
            CurveFile,
            "{asked} is one channel, and a curve needs two: the file has {known}"
        )),
        (_, Some(asked)) => Err(no_curve(asked, &known)),
        (_, None) => Err(error!(
            CurveFile,
            "expected a channel of displacement (code …DS…) and one of force (…FO…), found {known}"
        )),
    }
}
