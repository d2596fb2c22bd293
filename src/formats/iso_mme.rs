//! ISO-MME: a folder of channels over time, of a recorded case or of a multi-body run; SI.
//!
//! Layout: ISO/TS 13499, version 1.6. `NAME.mme` describes the test, `Channel/NAME.chn` lists the channels, and
//! `Channel/NAME.001` and so on hold one channel each: `key :value` lines, then one value per line.

use super::Exported;
use super::text::nine_digits;
use crate::curve::{Case, ForceKind};
use crate::error::{Error, error};
use crate::unit::km_per_h;

/// One quantity over time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    /// Sixteen characters: test object, position, location, dimension, direction, filter class.
    pub code: String,
    /// Its description.
    pub name: String,
    /// Its SI unit.
    pub unit: &'static str,
    /// One per sample.
    pub values: Vec<f64>,
}

/// Description of a folder of channels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Test<'a> {
    /// Name of its files.
    pub name: &'a str,
    /// Description of the event in one line.
    pub title: &'a str,
    /// Mass and speed of each body, in kg and m/s.
    pub bodies: Vec<(f64, f64)>,
    /// Time of the first sample, in s.
    pub start_s: f64,
    pub interval_s: f64,
    /// Further lines, as remarks.
    pub remarks: Vec<String>,
}

/// Deviation of a time from an even one that is rounding.
const EVEN: f64 = 1e-6;
/// Test objects have one character.
const OBJECTS: &str = "123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ";

/// The character of the `k`-th body, counted from 0; `None` beyond 35.
pub(crate) fn object(k: usize) -> Option<char> {
    OBJECTS.chars().nth(k)
}

/// The channels of a case: deflection, closing speed, force.
pub(super) fn write_case(case: &Case) -> Result<Exported, Error> {
    let sampled = &case.curves.sampled;
    let channel = |code: &str, name: &str, unit, values: &[f64]| Channel {
        code: code.into(),
        name: name.into(),
        unit,
        values: values.to_vec(),
    };
    let force = match case.curves.force_kind {
        ForceKind::Contact => "contact force",
        ForceKind::Body => "force of the body's motion",
    };
    let channels = [
        channel("11VEHC000000DSXP", "deflection", "m", sampled.deflection_m()),
        channel("11VEHC000000VEXP", "closing speed", "m/s", &case.curves.closing_speed_m_per_s),
        channel("11VEHC000000FOXP", force, "N", sampled.force_n()),
    ];
    let speed = km_per_h(case.conditions.speed.m_per_s);
    let title = format!(
        "{} {} {speed} ({})",
        case.id.group,
        case.id.name,
        case.conditions.speed.kind.name()
    );
    let times = sampled.time_s();
    let name = super::export_curve::stem_of(&case.id.group, &case.id.name);
    let bodies = [(case.conditions.masses.body_kg, case.conditions.speed.m_per_s)];
    let test = Test {
        name: &name,
        title: &title,
        bodies: bodies
            .into_iter()
            .chain(case.conditions.masses.other_kg.map(|m| (m, 0.0)))
            .collect(),
        start_s: times[0],
        interval_s: interval_s(times)?,
        remarks: vec![
            "deflection and force positive in compression; time 0 is the first contact".into(),
            format!("force_kind: {}", case.curves.force_kind.name()),
            format!("speed_kind: {}", case.conditions.speed.kind.name()),
            "contact_time_s: 0".into(),
            format!("recipe {}", case.provenance.recipe),
        ],
    };
    let notes = super::sampled_note(case).into_iter().collect();
    Ok(Exported { notes, ..folder(&test, &channels)? })
}

/// The interval of even times.
pub(crate) fn interval_s(times: &[f64]) -> Result<f64, Error> {
    let steps = times.len().saturating_sub(1).max(1) as f64;
    let interval = (times[times.len() - 1] - times[0]) / steps;
    let uneven = |(i, t): (usize, &f64)| {
        (t - times[0] - i as f64 * interval).abs() > EVEN * interval.abs().max(f64::MIN_POSITIVE)
    };
    match times.iter().enumerate().find(|&(i, t)| uneven((i, t))) {
        Some((i, t)) => Err(error!(
            Export,
            "{format} takes {needs}",
            format = "iso-mme",
            needs = format!("histories at even times, sample {} is at {t} s", i + 1)
        )),
        None => Ok(interval),
    }
}

/// The files of a test.
pub(crate) fn folder(test: &Test<'_>, channels: &[Channel]) -> Result<Exported, Error> {
    if channels.len() > 999 {
        let needs = format!("999 channels or fewer, found {}", channels.len());
        return Err(error!(Export, "{format} takes {needs}", format = "iso-mme"));
    }
    let name = test.name;
    let mut files = vec![
        (format!("{name}.mme"), described(test).into_bytes()),
        (format!("Channel/{name}.chn"), listed(channels).into_bytes()),
    ];
    for (k, channel) in channels.iter().enumerate() {
        files.push((format!("Channel/{name}.{:03}", k + 1), values(test, channel).into_bytes()));
    }
    Ok(Exported { files, ..Exported::default() })
}

/// A line of a header: the key padded to 28 columns.
fn line(key: &str, value: &str) -> String {
    let value: String =
        value.chars().map(|c| if c.is_ascii() && !c.is_control() { c } else { '?' }).collect();
    format!("{key:<28}:{value}\n")
}

fn described(test: &Test<'_>) -> String {
    let mut text = line("Data format edition number", "1.6");
    for key in ["Laboratory name", "Customer name", "Customer test ref number"] {
        text += &line(key, "NOVALUE");
    }
    text += &line("Title", test.title);
    text += &line("Medium No./number of media", "1/1");
    text += &line("Type of the test", "Finite-element or multi-body simulation");
    text += &line("Number of test objects", &test.bodies.len().to_string());
    for (k, (mass_kg, speed_m_per_s)) in test.bodies.iter().enumerate() {
        let k = k + 1;
        text += &line(&format!("Mass of test object {k}"), &mass_kg.to_string());
        text += &line(&format!("Velocity test object {k}"), &speed_m_per_s.to_string());
    }
    for remark in &test.remarks {
        text += &line("Comments", remark);
    }
    text
}

fn listed(channels: &[Channel]) -> String {
    let mut text = line("Instrumentation standard", "ISO 6487");
    text += &line("Number of channels", &channels.len().to_string());
    for (k, channel) in channels.iter().enumerate() {
        let name = format!("{} / {}", channel.code, channel.name);
        text += &line(&format!("Name of channel {:03}", k + 1), &name);
    }
    text
}

fn values(test: &Test<'_>, channel: &Channel) -> String {
    let at = |k: usize| test.start_s + k as f64 * test.interval_s;
    let extreme = |is_better: fn(f64, f64) -> bool| {
        let all = channel.values.iter().copied().enumerate();
        all.reduce(|best, next| if is_better(next.1, best.1) { next } else { best })
    };
    let mut text = line("Test object number", &channel.code[..1]);
    text += &line("Name of the channel", &channel.name);
    text += &line("Laboratory channel code", "NOVALUE");
    text += &line("Customer channel code", "NOVALUE");
    text += &line("Channel code", &channel.code);
    text += &line("Unit", channel.unit);
    text += &line("Reference system", "NOVALUE");
    text += &line("Channel amplitude class", "NOVALUE");
    text += &line("Reference channel", "implicit");
    text += &line("Reference channel name", "NOVALUE");
    text += &line("Time of first sample", &nine_digits(test.start_s));
    text += &line("Sampling interval", &nine_digits(test.interval_s));
    text += &line("Number of samples", &channel.values.len().to_string());
    for (which, best) in [("maximum", extreme(|a, b| a > b)), ("minimum", extreme(|a, b| a < b))] {
        let Some((k, value)) = best else { continue };
        text += &line(&format!("First global {which} value"), &nine_digits(value));
        text += &line(&format!("Time of {which} value"), &nine_digits(at(k)));
    }
    for value in &channel.values {
        text += &nine_digits(*value);
        text.push('\n');
    }
    text
}
