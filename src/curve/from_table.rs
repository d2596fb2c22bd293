//! From a table of force over deflection to the curve of a case: with times like an FE record,
//! without them by the motion that the table itself implies.
//!
//! **Without times** the maximum deflection of the table is taken as the maximum crush. A body
//! that starts at the impact speed `v0` and is stopped there by the table's own force has
//! `v(d)² = v0² (1 − W(d)/W(end))`; time is the integral of `dd/v`. After it the table's own
//! unloading branch, or a line of the unloading stiffness, drives the body back; then both part.
//! Every point of the table is a state, with states between them at an eighth of the common
//! interval, so that straight lines over time follow the motion.

use std::fmt::Display;
use std::ops::RangeInclusive;

use super::extract::{self, ExtractError, Extracted, Notes, Record, Setup, Stated, StatedContact};
use super::recipe::{Filter, Sampling};
use super::retrace::{Impact, Table, retrace};
use super::{Curve, EnergyAudit, Quality, RecordedCurves, above_0, contact, energy, loading};
use crate::error::{Error, ErrorCode, error};
use crate::signal::interpolate;
use crate::unit::Shown;
use crate::words::counted;

/// Study of the cases that were added from files and not built of FE runs.
pub(crate) const IMPORTED: &str = "imported";

fn impossible_table(impossible: energy::ImpossibleRun) -> Error {
    impossible_for(&impossible.found, impossible.cause_in_file())
}

fn impossible_for(found: impl Display, cause: impl Display) -> Error {
    error!(
        Other,
        "{found}: such an impact is impossible; {cause}. Correct speed, mass or units (--speed, --mass, and --units or in crumple export --input-units), or take the curve as it is with --accept-energy"
    )
}

/// The message of an extraction error for a table, which has no recipe.
fn of_table(error: ExtractError) -> Error {
    match error {
        ExtractError::ImpossibleRun(found) => impossible_table(found),
        ExtractError::Prescribed(found) => error!(
            Other,
            "{found}: the test was slow, or the times are in another unit. --time-column none takes its force over deflection without the times"
        ),
        ExtractError::NoContact => error!(
            Other,
            "the force of the record is never positive, which is not a contact: check its column"
        ),
        ExtractError::NoDeflection => error!(
            Other,
            "the deflection does not grow after contact: check its column, and whether it is compression"
        ),
        ExtractError::Curve(error) => error,
        other => Error::below(ErrorCode::Other, other),
    }
}

/// The curve of a table under an impact.
///
/// # Errors
/// It names what is impossible, and what to change.
pub fn from_table(table: &Table<'_>, impact: &Impact) -> Result<(RecordedCurves, Quality), Error> {
    // As many of everything as there are deflections, so that no index is out of bounds.
    let deflection = table.deflection_m.len();
    let (force, time) = (table.force_n.len(), table.time_s.map_or(deflection, <[f64]>::len));
    let body = table.body_force_n.map_or(force, <[f64]>::len);
    if force != deflection || time != deflection || body != force {
        return Err(error!(
            Other,
            "columns differ in length: {time} times, {deflection} deflections, {force} forces",
            force = force.min(body)
        ));
    }
    above_0("the speed", impact.speed.m_per_s)?;
    impact.masses.check()?;
    if deflection < 2 {
        return Err(error!(Other, "a curve needs at least 2 states, found {deflection}"));
    }
    match table.time_s {
        Some(time_s) => recorded(table, time_s, impact),
        None => retraced(table, impact),
    }
}

/// A deflection at contact below this share of the largest is rounding.
const LEAST_OFFSET: f64 = 1e-6;

/// Maximum number of states at the common interval: 15 s of 0.75 ms.
const MOST_STATES: usize = 20_000;

/// The motion that the table implies.
fn retraced(table: &Table<'_>, impact: &Impact) -> Result<(RecordedCurves, Quality), Error> {
    let interval_s = Sampling::default().interval_s;
    let motion = retrace(table, impact, interval_s)?;
    let (mut notes, mut warnings) = (motion.notes, motion.warnings);
    // A force that has fallen to 0 has no branch from which to take it.
    let most_m = table.deflection_m.iter().copied().fold(0.0, f64::max);
    let has_branch = table.deflection_m.last() < Some(&most_m);
    let stated = impact.unloading_stiffness_n_per_m.filter(|_| !has_branch);
    let original = Curve::new(motion.time_s, motion.deflection_m, motion.force_n)?;
    let claim = energy::StatedConditions {
        curve: &original,
        masses: impact.masses,
        speed: impact.speed,
        closing_m_per_s: None,
        recorded_m_per_s: None,
        units: impact.units,
        is_body_force: false,
        others: &Vec::new,
    };
    match claim.check() {
        Ok(_) => {}
        Err(impossible) if impact.accept_energy => {
            warnings.push(format!("accept_energy: {}", impossible.found));
        }
        Err(impossible) => return Err(impossible_table(impossible)),
    }
    let audit = energy::audit(&original, impact.masses, impact.speed);
    if (audit.ratio() - 1.0).abs() > EnergyAudit::TOLERANCE {
        warnings.push(format!(
            "energy: the curve absorbs {:.1} % of the kinetic energy",
            audit.ratio() * 100.0
        ));
    }
    let at = original.time_s();
    let last_s = at[at.len() - 1];
    let times: Vec<f64> =
        (0..MOST_STATES).map(|i| i as f64 * interval_s).take_while(|&t| t <= last_s).collect();
    if times.len() == MOST_STATES {
        warnings.push(format!(
            "short: the motion takes {last_s:.1} s, of which the first {MOST_STATES} states are sampled"
        ));
    }
    let of =
        |values: &[f64]| interpolate(at, values, &times).map_err(|_| super::retrace::endless());
    let sampled = (of(original.deflection_m())?, of(original.force_n())?);
    let closing_speed_m_per_s = of(&motion.closing_m_per_s)?;
    if let Ok(branch) = loading::loading_branch(&original)
        && branch.dropped > 0
    {
        notes.push(format!(
            "loading branch: {} removed because the deflection hardly advanced",
            counted(branch.dropped, "state")
        ));
    }
    let curves = RecordedCurves {
        force_kind: impact.force_kind,
        sampled: Curve::new(times, sampled.0, sampled.1)?,
        closing_speed_m_per_s,
        contact_time_s: 0.0,
        unloading_stiffness_n_per_m: loading::unloading_stiffness(&original).or(stated),
        original,
    };
    Ok((curves, Quality { audit, notes, warnings }))
}

/// A record over time is extracted as that of an FE run, without a filter.
fn recorded(
    table: &Table<'_>,
    time_s: &[f64],
    impact: &Impact,
) -> Result<(RecordedCurves, Quality), Error> {
    let mut notes = vec!["motion: from the file's times, not filtered".to_string()];
    let before = impact.contact_time_s.is_none().then(|| before_zero(time_s, table.force_n));
    let before = before.flatten();
    let share = before.unwrap_or(contact::THRESHOLD);
    let guessed = begins_in_contact(time_s, table.force_n, share);
    let contact = impact.contact_time_s.or_else(|| {
        guessed.then(|| {
            notes.push("contact: the record starts at contact".into());
            time_s[0]
        })
    });
    // A record that begins at the contact that it states, as an exported case does, counts its deflection from there.
    let begins = impact.contact_time_s == Some(time_s[0]);
    let largest_m = table.deflection_m.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
    let first_m = Some(table.deflection_m[0]).filter(|d| begins && *d > LEAST_OFFSET * largest_m);
    let taken_off_m = table.deflection_m[0];
    if contact == Some(time_s[0])
        && first_m.is_none()
        && taken_off_m.abs() > LEAST_OFFSET * largest_m
    {
        notes.push(format!(
            "deflection: counts from contact, where the record has {:.1} mm",
            taken_off_m * 1e3
        ));
    }
    let length_s = time_s[time_s.len() - 1] - time_s[0];
    let sampling = |interval_s: f64| {
        let states = (length_s / interval_s) as usize;
        let least = Sampling::default().states;
        Sampling { states: states.saturating_add(1).clamp(least, MOST_STATES), interval_s }
    };
    let setup = Setup {
        filter: Filter::None,
        sampling: sampling(Sampling::default().interval_s),
        kind: impact.speed.kind,
        half_model: false,
        masses: impact.masses,
        manifest_speed_m_per_s: Some(impact.speed.m_per_s),
        deck_speed: None,
        contact_threshold: share,
        of_impulse: false,
        stated: Stated {
            contact: contact.map(|s| StatedContact::Time { s }),
            offset_m: first_m.unwrap_or(0.0),
            accept_energy: impact.accept_energy,
            ..Stated::default()
        },
        others: &Vec::new,
    };
    let mut remarks = Notes::default();
    let (d, f) = (table.deflection_m, table.force_n);
    let record = Record::of_columns(time_s, d, f, impact.units, &mut remarks).map_err(of_table)?;
    let (fastest, stated) = (fastest(&record), impact.speed.m_per_s);
    // What else is impossible then follows from it.
    let too_fast_or_slow = || {
        let found = format!(
            "its deflection grows by {fastest:.4} m/s at most, but {stated:.4} m/s is stated"
        );
        impossible_for(found, OTHER_SPEED)
    };
    let extracted = |setup: &Setup<'_>| {
        extract::curve_of(record.clone(), remarks.clone(), setup).map_err(|error| {
            match error {
                ExtractError::ImpossibleRun(_) if !SPEEDS.contains(&(fastest / stated)) => {
                    too_fast_or_slow()
                }
                error => of_table(error),
            }
            // Times that repeat make other things impossible.
            .followed_by(&remarks.warnings.iter().map(|w| format!("; {w}")).collect::<String>())
        })
    };
    let mut found = extracted(&setup)?;
    // A short crush needs more states than the usual interval gives, as far as the record has them.
    let end = loading::loading_end(&found.curves.original);
    let crush_s = found.curves.original.time_s()[end];
    let interval_s = Sampling::interval_for(crush_s, crush_s / end.max(1) as f64);
    if interval_s < setup.sampling.interval_s {
        found = extracted(&Setup { sampling: sampling(interval_s), ..setup })?;
        notes.push(format!(
            "sampling: one state every {} ms, as the crush is short",
            (interval_s * 1e9).round() / 1e6
        ));
    }
    let Extracted { curves, quality, .. } = found;
    let Quality { audit, notes: of_record, mut warnings } = quality;
    let curves = RecordedCurves { force_kind: impact.force_kind, ..curves };
    // A table has no run: its own line states the contact.
    let of_table =
        |w: &String| w.replace(contact::STATED_BY, STATED_BY).replace(contact::OR_BY, "");
    warnings.iter_mut().for_each(|w| *w = of_table(w));
    if let Some(share) = before {
        warnings.push(format!(
            "contact: there is a force before time 0, the offset or noise of a sensor: contact is taken where it exceeds {:.1} % of its peak; take both off the record, or set {STATED_BY}",
            100.0 * share
        ));
    } else if impact.contact_time_s.is_none() && guessed {
        warnings.extend(
            starts_late(&curves, impact.speed.m_per_s).map(|found| format!("contact: {found}")),
        );
    }
    let closing = &curves.closing_speed_m_per_s;
    if let Some(found) = other_speed(closing, impact.speed.m_per_s, SPEEDS) {
        if !impact.accept_energy {
            return Err(impossible_for(found, OTHER_SPEED));
        }
        warnings.push(format!("accept_energy: {found}"));
    } else if let Some(found) = other_speed(closing, impact.speed.m_per_s, SAME_SPEED) {
        warnings.push(format!("speed: {found}"));
    }
    if let Some(stated) = impact.unloading_stiffness_n_per_m {
        match unloading_of_record(curves.unloading_stiffness_n_per_m, stated) {
            Ok(note) => notes.push(note),
            Err(warning) => warnings.push(warning),
        }
    }
    notes.extend(of_record);
    Ok((curves, Quality { audit, notes, warnings }))
}

/// The largest mean rate of the deflection in m/s over a twentieth of a record: noise and a single wrong value do not make it.
fn fastest(record: &Record) -> f64 {
    let (t, d) = (&record.time_s, &record.deflection_m);
    let over = (t.len() / 20).max(1);
    let rates = (over..t.len()).map(|i| (d[i] - d[i - over]) / (t[i] - t[i - over]));
    rates.fold(0.0, |most, rate| rate.abs().max(most))
}

/// A record begins with its impact speed: what it begins with, if that as a share of it is not within limits.
fn other_speed(
    closing_m_per_s: &[f64],
    stated_m_per_s: f64,
    limits: RangeInclusive<f64>,
) -> Option<String> {
    let begins = closing_m_per_s.iter().take(FIRST_STATES).copied().fold(0.0, f64::max);
    let ratio = begins / stated_m_per_s;
    (!limits.contains(&ratio)).then(|| {
        format!("its deflection starts at {begins:.4} m/s, but {stated_m_per_s:.4} m/s is stated")
    })
}

/// Initial speeds of a record as shares of the stated one that are possible, and those that go without a word.
const SPEEDS: RangeInclusive<f64> = 0.8..=1.25;
const SAME_SPEED: RangeInclusive<f64> = 0.95..=1.05;

const OTHER_SPEED: &str = "the times are in another unit, the speed is that of another run, or the test was slow (--time-column none takes its force over deflection without the times)";
/// States in which the speed of a record's beginning is looked for.
const FIRST_STATES: usize = 4;

/// Note on a stated stiffness, in N/m, other than that of the record; a warning
/// if the record has none.
fn unloading_of_record(found: Option<f64>, stated: f64) -> Result<String, String> {
    match found {
        Some(found) => Ok(format!(
            "unloading: {} in the record, {} is stated",
            Shown::one_stiffness(found),
            Shown::one_stiffness(stated)
        )),
        None => Err("unloading: a record over time unloads as recorded, but this one ends before it unloads; the stated stiffness is not used".into()),
    }
}

/// What states the contact of a table, in messages.
const STATED_BY: &str = "\"# contact_time_s: …\" above the header";

/// Whether the force of a record rises above a share of its largest within the first interval: what lies
/// before contact is then not in it, and its deflection counts from contact already.
fn begins_in_contact(time_s: &[f64], force_n: &[f64], share: f64) -> bool {
    let positive = positive(time_s, force_n);
    let threshold_n = contact::threshold_n(&positive, share);
    positive.iter().take(2).any(|f| *f > threshold_n)
}

/// A force whose impulse is positive.
fn positive(time_s: &[f64], force_n: &[f64]) -> Vec<f64> {
    let impulse: f64 = (1..time_s.len())
        .map(|i| (force_n[i] + force_n[i - 1]) * (time_s[i] - time_s[i - 1]))
        .sum();
    force_n.iter().map(|f| f * impulse.signum()).collect()
}

/// States before time 0 that show what a sensor does without a contact.
const LEAST_BEFORE: usize = 5;
/// Of a larger share of the peak it may be a contact, whose recording was triggered late.
const MOST_BEFORE: f64 = 0.1;
/// Noise of so few states may be larger later.
const NOISE: f64 = 1.5;

/// The share of its peak above which the force of a test's record is in contact, if it has an offset or noise: tests begin before the
/// impact, at time 0 (ISO/TS 13499, SAE J211). The first half of that is taken, since a trigger may be late.
fn before_zero(time_s: &[f64], force_n: &[f64]) -> Option<f64> {
    let states = time_s.partition_point(|&t| t < 0.0) / 2;
    let positive = positive(time_s, force_n);
    let peak_n = contact::threshold_n(&positive, 1.0);
    let most_n = positive[..states].iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    let share = NOISE * most_n / peak_n;
    // What is there from the beginning is not a first touch before a late trigger.
    let first_n = positive[..states.div_ceil(3)].iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    (states >= LEAST_BEFORE
        && first_n > 0.5 * most_n
        && share > contact::THRESHOLD
        && share < MOST_BEFORE)
        .then_some(share)
}

/// A record that begins with a larger share of its peak, and less than this of its speed, lacks what was before.
const MOST_FIRST: f64 = 0.1;
const FULL_SPEED: f64 = 0.998;

/// What of a record that seems to begin in contact may be missing, or not be contact.
fn starts_late(curves: &RecordedCurves, speed_m_per_s: f64) -> Option<String> {
    let force_n = curves.original.force_n();
    let peak_n = contact::threshold_n(force_n, 1.0);
    let first = force_n[0] / peak_n;
    // A force may begin with a step: then the body has its speed.
    let is_slowed = curves.closing_speed_m_per_s[0] < FULL_SPEED * speed_m_per_s;
    if first > MOST_FIRST && is_slowed {
        return Some(format!(
            "the record begins with {:.0} % of its peak force, and the body is slower than stated: the crush before it is missing",
            100.0 * first
        ));
    }
    extract::light_beginning(&curves.original)
        .map(|found| format!("{found}: if contact starts later, set {STATED_BY}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{ForceKind, Masses};
    use crate::unit::{Speed, SpeedKind, UnitSystem};

    fn impact(v: f64, m: f64) -> Impact {
        Impact {
            force_kind: ForceKind::Contact,
            speed: Speed { m_per_s: v, kind: SpeedKind::Wall },
            masses: Masses { body_kg: m, other_kg: None },
            unloading_stiffness_n_per_m: None,
            body_unloading_stiffness_n_per_m: None,
            contact_time_s: None,
            units: UnitSystem::SI,
            accept_energy: false,
        }
    }

    /// A mass on a linear spring: d = d_max sin ωt, stopped after a quarter of the period, and
    /// rebounded with its own speed by the same stiffness.
    #[test]
    fn a_linear_spring_gives_a_sine() {
        let (m, v, k): (f64, f64, f64) = (24e3, 10.0, 40e6);
        let omega = (k / m).sqrt();
        let end = v / omega;
        let d: Vec<f64> = (0..=4).map(|i| end * f64::from(i) / 4.0).collect();
        let f: Vec<f64> = d.iter().map(|d| k * d).collect();
        let table = Table { deflection_m: &d, force_n: &f, time_s: None, body_force_n: None };
        let (curves, quality) = from_table(&table, &impact(v, m)).unwrap();
        assert!((quality.audit.ratio() - 1.0).abs() < 1e-12);
        let stiffness = curves.unloading_stiffness_n_per_m.unwrap();
        assert!((stiffness / k - 1.0).abs() < 1e-9, "{stiffness}");
        assert_eq!(quality.warnings.len(), 1, "the steepest rise stands for the unloading");
        let half = std::f64::consts::PI / omega;
        for ((t, d), v_is) in curves
            .sampled
            .time_s()
            .iter()
            .zip(curves.sampled.deflection_m())
            .zip(&curves.closing_speed_m_per_s)
            .filter(|((t, _), _)| **t < half)
        {
            assert!((d - end * (omega * t).sin()).abs() < 2e-5 * end, "{d} at {t}");
            assert!((v_is - v * (omega * t).cos()).abs() < 2e-4 * v, "{v_is} at {t}");
        }
        let last = curves.closing_speed_m_per_s.last().unwrap();
        assert!((last + v).abs() < 1e-9 * v, "thrown back at {last}");
        // Every point of the table is a state.
        for point in &d {
            assert!(curves.original.deflection_m().contains(point), "{point}");
        }
    }

    /// A constant force: v falls linearly with time, in 2 d/v.
    #[test]
    fn a_constant_force_stops_in_twice_the_crush_over_the_speed() {
        let (d, f) = ([0.0, 0.2, 0.4, 0.5], [2.4e6; 4]);
        let table = Table { deflection_m: &d, force_n: &f, time_s: None, body_force_n: None };
        let mut impact = impact(10.0, 24e3);
        let error = from_table(&table, &impact).unwrap_err().to_string();
        assert!(error.contains("never rises, so its unloading stiffness must be given"), "{error}");
        // How steep a jump is depends on the width that it was given.
        let jump =
            Table { deflection_m: &[0.0, 5e-5, 0.4, 0.5], force_n: &[0.0, 2e6, 2e6, 2e6], ..table };
        let error = from_table(&jump, &impact).unwrap_err().to_string();
        assert!(error.contains("the curve rises by jumps alone, so its unloading"), "{error}");
        impact.unloading_stiffness_n_per_m = Some(1e8);
        let (curves, quality) = from_table(&table, &impact).unwrap();
        let end = loading::loading_end(&curves.original);
        assert!((curves.original.time_s()[end] - 0.1).abs() < 1e-12);
        assert!((curves.unloading_stiffness_n_per_m.unwrap() - 1e8).abs() < 1.0);
        assert_eq!(quality.warnings, [""; 0]);
    }

    /// An unloading branch of the table is followed; its area is what comes back.
    #[test]
    fn an_unloading_branch_tells_the_rebound() {
        let (d, f) = ([0.0, 0.5, 1.0, 0.99, 0.98], [2.4e6, 2.4e6, 2.4e6, 1.2e6, 0.0]);
        let table = Table { deflection_m: &d, force_n: &f, time_s: None, body_force_n: None };
        let v = (2.0 * 2.4e6 / 24e3_f64).sqrt();
        let (curves, _) = from_table(&table, &impact(v, 24e3)).unwrap();
        let back = curves.closing_speed_m_per_s.last().unwrap();
        assert!((back + (2.0 * 2.4e4 / 24e3_f64).sqrt()).abs() < 1e-9, "{back}");
        assert!((curves.unloading_stiffness_n_per_m.unwrap() / 1.2e8 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_motion_follows_the_force_of_the_body() {
        let (d, f) = ([0.0, 0.1, 0.3, 0.5], [0.0, 8e6, 1e6, 3e6]);
        let body = [0.0, 3e6, 3e6, 3e6];
        let table =
            Table { deflection_m: &d, force_n: &f, time_s: None, body_force_n: Some(&body) };
        let (curves, _) = from_table(&table, &impact(10.0, 24e3)).unwrap();
        let at = curves.original.deflection_m().iter().position(|d| *d == 0.3).unwrap();
        let work = 0.15e6 + 0.6e6;
        let expected = 10.0 * (1.0_f64 - work / (work + 0.6e6)).sqrt();
        let t = curves.original.time_s();
        let rate = (curves.original.deflection_m()[at + 1]
            - curves.original.deflection_m()[at - 1])
            / (t[at + 1] - t[at - 1]);
        assert!((rate / expected - 1.0).abs() < 1e-2, "{rate} instead of {expected}");
    }

    #[test]
    fn what_no_impact_can_be_is_refused() {
        let (d, f) = ([0.0, 0.2, 0.4, 0.5], [0.0, 1e6, 2e6, 3e6]);
        let table = Table { deflection_m: &d, force_n: &f, time_s: None, body_force_n: None };
        let error = from_table(&table, &impact(10.0, 24e3)).unwrap_err().to_string();
        assert!(error.contains("the curve absorbs 0.5417 times the kinetic energy"), "{error}");
        assert!(error.contains("--accept-energy"), "{error}");
        let accepted = Impact { accept_energy: true, ..impact(10.0, 24e3) };
        assert!(from_table(&table, &accepted).unwrap().1.warnings[1].starts_with("accept_energy"));
        let ends = Table { force_n: &[0.0, 1e6, 2e6, 0.0], ..table };
        let error = from_table(&ends, &accepted).unwrap_err().to_string();
        assert!(error.contains("the force at the maximum deflection is 0"), "{error}");
        // A force of next to nothing at the end would take for ever.
        let crawls = Table { force_n: &[1e6, 1e-9, 1e-9, 1e-9], ..table };
        let error = from_table(&crawls, &accepted).unwrap_err().to_string();
        assert!(error.contains("a body almost stops moving"), "{error}");
        let soft = Impact { unloading_stiffness_n_per_m: Some(1e6), ..accepted };
        let error = from_table(&table, &soft).unwrap_err().to_string();
        assert!(error.contains("1000000 N/m is softer than the line"), "{error}");
    }
}
