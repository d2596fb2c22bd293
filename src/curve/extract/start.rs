//! Start of contact in a record, the record from there on (time and deflection count from it), and the impact speed.

use super::ExtractError;
use super::record::{Record, impulse};
use super::{Notes, Setup, StatedContact};
use crate::curve::contact::{self, OR_BY, STATED_BY, milliseconds};
use crate::curve::{Curve, ForceKind, loading};
use crate::unit::{Shown, Speed, km_per_h};

/// A beginning of the crush, as a share of it, that brings less than this share of the impulse
/// is doubtful: light noses of real runs bring twice as much and more.
const BEGINNING: (f64, f64) = (0.15, 0.003);
/// A contact found within a step that closes more than this share of the crush is uncertain.
const CERTAIN_SHARE: f64 = 0.01;
/// Most noses touch as the run begins; a contact somewhere in the first interval of a run is uncertain where that closes more than this.
const FIRST_SHARE: f64 = 0.03;
/// Crush before the record's first state, as a share of the rest, that deserves a warning.
const MISSING_SHARE: f64 = 0.005;
/// Impulse before the contact that the manifest states, as a share of the loading branch's, likewise.
const EARLY_SHARE: f64 = 0.001;
/// Over this share of the crush a body is slowed down.
const SLOWING_SHARE: f64 = 0.1;
/// A body slows down some milliseconds after the touch: a record that begins within these may not show it.
const RESPONSE_S: f64 = 5e-3;
/// Times that differ by less than this share are one: files print seven digits.
const SAME_TIME: f64 = 1e-6;

/// Where contact begins, and how sure that is.
pub(super) struct Start {
    pub time_s: f64,
    by: StartBy,
}

enum StartBy {
    /// The manifest's contact time or gap.
    Manifest,
    /// The first state, which is in contact already; the crush before it, at least and at most, and whether the run's speed is
    /// that of this state.
    FirstState { missing_m: (f64, f64), at_full_speed: bool, at_most_s: Option<f64> },
    /// A crossing within an output interval of this length; what the body had moved before the first state, if that is so near
    /// that a contact before it would be the same.
    Crossing { interval_s: f64, at_most_s: Option<f64>, moved_m: f64 },
    /// The deceleration of the body, which starts later: reported where it is found.
    Body,
}

impl Start {
    /// Where the manifest says, else where the force does.
    pub(crate) fn find(
        setup: &Setup<'_>,
        record: &mut Record,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        match setup.stated.contact {
            Some(StatedContact::Time { s: time_s }) => {
                if !record.holds(time_s) {
                    return Err(record.outside("contact_time", time_s));
                }
                remarks.notes.extend(found_elsewhere(record, time_s, setup));
                Ok(Self { time_s, by: StartBy::Manifest })
            }
            Some(StatedContact::Gap { m }) => {
                let time_s = closing_time(record, m)?;
                remarks.note(format!("contact: the gap closes at {}", milliseconds(time_s)));
                remarks.notes.extend(found_elsewhere(record, time_s, setup));
                Ok(Self { time_s, by: StartBy::Manifest })
            }
            None => Self::in_force(record, setup, remarks),
        }
    }

    /// Where the contact force begins, if the recipe names one; else the record's.
    fn in_force(
        record: &mut Record,
        setup: &Setup<'_>,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let (onset, force_n) = onset(record, setup)?;
        if record.contact.is_none() {
            record.force_n = force_n;
        }
        let of_body = record.contact.is_none() && record.force_kind == ForceKind::Body;
        if of_body {
            let since_s = onset.time_s - record.time_s.first().copied().unwrap_or_default();
            let earlier = match onset.interval_s {
                Some(_) if since_s > RESPONSE_S => "the first touch is some milliseconds earlier",
                Some(_) => {
                    "the record begins less than 5 ms before, so the first touch may lie before it"
                }
                None => "the record begins there, and the first touch may be earlier",
            };
            remarks.warn(format!(
                "contact: found at {}, where the body starts to slow down; {earlier}, and the crush is too short by the distance travelled in between: name the contact force in the recipe (contact = {{ file = …, id = …, component = … }}, the wall's in rwforc or the contact's in rcforc), or set contact_time in the run",
                milliseconds(onset.time_s)
            ));
        }
        remarks.warnings.extend(onset.warnings);
        if !record.holds(onset.time_s) {
            return Err(record.outside("the contact", onset.time_s));
        }
        let by = match onset.interval_s {
            _ if of_body => StartBy::Body,
            Some(interval_s) => {
                let is_near = onset.time_s - record.time_s[0] < contact::PAUSE_S;
                let moved_m = record.deflection_m[0].abs();
                // A body that moved no further than at the speed of its first state since time 0 has not been slowed down.
                let at_speed_m = (record.rate_m_per_s[0] * record.time_s[0]).abs();
                let is_free = moved_m <= (1.0 + MISSING_SHARE) * at_speed_m;
                let moved_m = if is_near && !is_free { moved_m } else { 0.0 };
                StartBy::Crossing { interval_s, at_most_s: onset.at_most_s, moved_m }
            }
            None => {
                let missing_m = missing_m(record, setup);
                // Its displacement does not count from there, so it has been slowed down.
                let at_full_speed = record.deflection_m[0] != 0.0 && !is_slowed(record, setup);
                StartBy::FirstState { missing_m, at_full_speed, at_most_s: onset.at_most_s }
            }
        };
        Ok(Self { time_s: onset.time_s, by })
    }

    /// By how much the crush may be off because contact lies somewhere in a step.
    pub(crate) fn uncertainty(
        &self,
        contact: &FromContact,
        setup: &Setup<'_>,
        remarks: &mut Notes,
    ) {
        let curve = &contact.curve;
        let crush_m = curve.deflection_m()[loading::loading_end(curve)];
        let step_m = |interval_s: f64| contact.closing_m_per_s[0].abs() * interval_s;
        match self.by {
            StartBy::Crossing { moved_m, .. }
                if moved_m > MISSING_SHARE * crush_m && setup.stated.offset_m == 0.0 =>
            {
                remarks.warn(format!(
                    "contact: the body had moved {:.1} mm before the record's first state, and the force begins less than 10 ms after it: if contact began before, that crush is missing and the speed is that of a body which has been slowed down; provide the earlier states, or set contact_time if it begins there",
                    moved_m * 1e3
                ));
            }
            StartBy::Crossing { .. } | StartBy::FirstState { .. } | StartBy::Body
                if setup.stated.offset_m <= 0.0
                    && let Some(found) = light_beginning(curve) =>
            {
                remarks.warn(format!("contact: {found}: if contact starts later, set {STATED_BY}"));
            }
            StartBy::Crossing { interval_s, at_most_s, .. }
                if step_m(interval_s) > CERTAIN_SHARE * crush_m =>
            {
                let most_mm = at_most_s.filter(|&s| s > interval_s).map(|most_s| {
                    format!(
                        " (up to {:.2} mm where the force rises over several states)",
                        step_m(most_s) * 1e3
                    )
                });
                remarks.warn(format!(
                    "contact: its place between two states is uncertain by about {:.2} mm{}, {:.1} % of the crush: set {STATED_BY}{OR_BY}",
                    step_m(interval_s) * 1e3,
                    most_mm.unwrap_or_default(),
                    100.0 * step_m(interval_s) / crush_m
                ));
            }
            StartBy::FirstState { missing_m, .. }
                if setup.stated.offset_m > 0.0
                    && (missing_m.0 - setup.stated.offset_m)
                        .max(setup.stated.offset_m - missing_m.1)
                        > MISSING_SHARE * crush_m =>
            {
                remarks.warn(format!(
                    "contact: offset = {:.1} mm, but judging by its first state, the record, which starts in contact, lacks {} of the crush",
                    setup.stated.offset_m * 1e3,
                    shown_missing(missing_m)
                ));
            }
            StartBy::FirstState { missing_m, at_full_speed, .. }
                if missing_m.1 > MISSING_SHARE * crush_m && setup.stated.offset_m == 0.0 =>
            {
                let (least_m, most_m) = missing_m;
                let share = |m: f64| 100.0 * m / (crush_m + m);
                let (shares, offset) = match least_m < most_m {
                    true if least_m == 0.0 => (
                        format!("up to {:.1} %", share(most_m)),
                        "the body still has the run's speed, so none are if the clock does not begin at the impact; else set offset in the run to what is missing".into(),
                    ),
                    true => (
                        format!("{:.1} to {:.1} %", share(least_m), share(most_m)),
                        "the bodies slow down over the first distance before the force is recorded, and move by the second; set offset in the run to what is missing".into(),
                    ),
                    false => (
                        format!("{:.1} %", share(most_m)),
                        format!(
                            "set offset = \"{:.1}mm\" in the run, less any gap that the body had to cross first",
                            most_m * 1e3
                        ),
                    ),
                };
                // No speed and no offset replaces the work done over so much of the crush.
                let is_much = least_m > SLOWING_SHARE * crush_m;
                let remedy = match at_full_speed && most_m > SLOWING_SHARE * crush_m {
                    true if is_much => ", and the run's speed is that of its first state, by when it has been slowed down: provide the earlier states, or leave the run out".into(),
                    true => format!(
                        ", and the run's speed is that of its first state, by when it has been slowed down: state the impact speed; {offset}, or provide the earlier states"
                    ),
                    false if is_much => "; provide the earlier states, or leave the run out".into(),
                    false => format!("; {offset}, or provide the earlier states"),
                };
                let gap = match is_much && least_m == most_m {
                    true => ", less any gap that the body had to cross first",
                    false => "",
                };
                remarks.warn(format!(
                    "contact: the record starts at {}, in contact: the first {} of the crush ({shares}{gap}) are missing{remedy}",
                    milliseconds(self.time_s),
                    shown_missing(missing_m)
                ));
            }
            StartBy::FirstState { at_most_s: Some(most_s), .. }
                if step_m(most_s) > FIRST_SHARE * crush_m =>
            {
                remarks.warn(format!(
                    "contact: it may lie anywhere in the first interval and is taken at the first state; the crush may be up to {:.2} mm ({:.1} %) too large (contact_time or gap in the run sets it)",
                    step_m(most_s) * 1e3,
                    100.0 * step_m(most_s) / crush_m
                ));
            }
            StartBy::FirstState { .. } => remarks.note(
                "contact: the record starts in contact, so deflection counts from its first state",
            ),
            StartBy::Crossing { .. } | StartBy::Manifest | StartBy::Body => {}
        }
    }

    /// Force before the contact, gap or offset that the manifest states.
    pub(crate) fn force_before(
        &self,
        time_s: &[f64],
        force_n: &[f64],
        contact: &FromContact,
        remarks: &mut Notes,
    ) {
        if !matches!(self.by, StartBy::Manifest) && contact.time_s <= self.time_s {
            return;
        }
        // A state at the contact itself is the curve's first.
        let earliest_s = contact.time_s - SAME_TIME * contact.time_s.abs();
        let before = time_s.partition_point(|&t| t < earliest_s);
        let early_ns = impulse(&time_s[..before], &force_n[..before]);
        let end = loading::loading_end(&contact.curve);
        let rest_ns = impulse(&contact.curve.time_s()[..=end], &contact.curve.force_n()[..=end]);
        if early_ns > EARLY_SHARE * (early_ns + rest_ns) {
            remarks.warn(format!(
                "contact: before {}, the start that is stated, the force reaches {} and its impulse {}, {:.1} % of that up to the maximum crush: the curve leaves it out; check contact_time, gap and offset",
                milliseconds(contact.time_s),
                Shown::one_force(force_n[..before].iter().copied().fold(0.0, f64::max)),
                Shown::one_impulse(early_ns),
                100.0 * early_ns / (early_ns + rest_ns)
            ));
        }
    }
}

/// A body that is slower by at most this share has the speed of its run.
const FULL_SPEED: f64 = 1e-3;

/// The crush before a record that begins in contact, at least and at most: its first displacement, or, where that counts from the first
/// state, what the body travels until then. If the motion was recorded before the force, the bodies have slowed down over part of
/// it at least; a nose is stopped before the body is. A body that still has the run's speed, in a record that counts its displacement
/// from there, may have crushed nothing: its clock may not begin at the impact.
fn missing_m(record: &Record, setup: &Setup<'_>) -> (f64, f64) {
    let most_m = match record.deflection_m[0].abs() {
        0.0 => (record.rate_m_per_s[0] * record.time_s[0]).abs(),
        displacement_m => displacement_m,
    };
    let least_m = record.slowed_over_m.map_or(most_m, |slowed_m| slowed_m.min(most_m));
    let is_open = !is_slowed(record, setup) && record.deflection_m[0] == 0.0;
    (if is_open { 0.0 } else { least_m }, most_m)
}

/// Whether the body is slower than its run's speed in the first state.
fn is_slowed(record: &Record, setup: &Setup<'_>) -> bool {
    let bodies = if setup.half_model { 2.0 } else { 1.0 };
    setup.manifest_speed_m_per_s.is_none_or(|speed_m_per_s| {
        bodies * record.rate_m_per_s[0].abs() < (1.0 - FULL_SPEED) * speed_m_per_s
    })
}

fn shown_missing((least_m, most_m): (f64, f64)) -> String {
    match least_m < most_m {
        true => format!("{:.1} to {:.1} mm", least_m * 1e3, most_m * 1e3),
        false => format!("{:.1} mm", most_m * 1e3),
    }
}

/// When the force begins, if the manifest states another contact.
fn found_elsewhere(record: &Record, stated_s: f64, setup: &Setup<'_>) -> Option<String> {
    let (found, _) = onset(record, setup).ok()?;
    let is_elsewhere = (found.time_s - stated_s).abs() > found.interval_s.unwrap_or(0.0);
    is_elsewhere.then(|| {
        format!(
            "contact: {} as stated; the force starts at {}",
            milliseconds(stated_s),
            milliseconds(found.time_s)
        )
    })
}

/// By the contact force, if the recipe names one; else by the record's. With the force that it was found in, in which an impulse's has
/// its values at the contact.
fn onset(record: &Record, setup: &Setup<'_>) -> Result<(contact::Onset, Vec<f64>), ExtractError> {
    let (time_s, mut force_n) = match &record.contact {
        Some(contact) => (&contact.time_s, contact.values.clone()),
        None => (&record.time_s, record.force_n.clone()),
    };
    let threshold_n = contact::threshold_n(&force_n, setup.contact_threshold);
    let onset = contact::onset(time_s, &force_n, threshold_n).ok_or(ExtractError::NoContact)?;
    let from_rest = record.time_s[0] == 0.0 && record.deflection_m[0] == 0.0;
    let onset = match setup.of_impulse {
        true => onset.by_impulse(time_s, &mut force_n, threshold_n, from_rest),
        false => onset,
    };
    Ok((onset, force_n))
}

/// When the bodies have moved towards each other by `gap_m` from the first state, in the
/// direction in which they first move.
fn closing_time(record: &Record, gap_m: f64) -> Result<f64, ExtractError> {
    let (t, d) = (&record.time_s, &record.deflection_m);
    let direction = if record.rate_m_per_s[0] < 0.0 { -1.0 } else { 1.0 };
    let travel = |i: usize| direction * (d[i] - d[0]);
    let most_m = (0..d.len()).map(travel).fold(0.0, f64::max);
    let i = (1..d.len() - 1)
        .find(|&i| travel(i) >= gap_m)
        .ok_or(ExtractError::GapStaysOpen { gap_m, most_m })?;
    let share = (gap_m - travel(i - 1)) / (travel(i) - travel(i - 1));
    Ok(t[i - 1] + share.clamp(0.0, 1.0) * (t[i] - t[i - 1]))
}

/// That a curve begins with hardly any force, if it does.
pub(in crate::curve) fn light_beginning(curve: &Curve) -> Option<String> {
    let crush_m = curve.deflection_m()[loading::loading_end(curve)];
    (impulse_share_to(curve, BEGINNING.0 * crush_m) < BEGINNING.1).then(|| {
        format!(
            "the first {:.0} % of the crush ({:.0} mm) contribute less than {} % of the impulse",
            BEGINNING.0 * 100.0,
            BEGINNING.0 * crush_m * 1e3,
            BEGINNING.1 * 100.0
        )
    })
}

/// Share of the loading branch's impulse up to a deflection.
fn impulse_share_to(curve: &Curve, deflection_m: f64) -> f64 {
    let (t, d, f) = (curve.time_s(), curve.deflection_m(), curve.force_n());
    let end = loading::loading_end(curve);
    let steps = |to: usize| (1..=to).map(|i| 0.5 * (f[i] + f[i - 1]) * (t[i] - t[i - 1]));
    let there = (0..=end).take_while(|&i| d[i] <= deflection_m).count().saturating_sub(1);
    let whole: f64 = steps(end).sum();
    if whole > 0.0 { steps(there + 1).sum::<f64>() / whole } else { 1.0 }
}

/// The record from contact on.
pub(super) struct FromContact {
    pub curve: Curve,
    pub closing_m_per_s: Vec<f64>,
    pub time_s: f64,
    /// The last state that contact has not changed.
    pub before: usize,
}

impl FromContact {
    /// Time and deflection counted from contact, between two states where it lies there.
    pub(crate) fn of(
        record: &Record,
        contact_s: f64,
        offset_m: f64,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let contact_m = record.at(&record.deflection_m, contact_s)?;
        // A rebound can travel further than the crush: what the impact does first counts.
        let direction = if record.at(&record.rate_m_per_s, contact_s)? < 0.0 { -1.0 } else { 1.0 };
        let travel = |i: usize| direction * (record.deflection_m[i] - contact_m);
        let next = record.time_s.partition_point(|&t| t <= contact_s);
        let most_m = (next..record.time_s.len()).map(travel).fold(0.0, f64::max);
        if most_m <= 0.0 {
            return Err(ExtractError::NoDeflection);
        }
        if direction < 0.0 {
            remarks.note("deflection: sign flipped, positive in compression");
        }
        let start_s = if offset_m >= 0.0 {
            contact_s
        } else {
            closed_s(record, contact_s, -offset_m, most_m, travel)?
        };
        if offset_m != 0.0 {
            remarks.note(format!(
                "offset: the deflection at contact is {} mm",
                (offset_m * 1e6).round() / 1e3
            ));
        }
        let next = record.time_s.partition_point(|&t| t <= start_s);
        let (mut time_s, mut deflection_m) = (vec![0.0], vec![offset_m.max(0.0)]);
        let mut force_n = vec![record.at(&record.force_n, start_s)?];
        let mut closing_m_per_s = vec![direction * record.at(&record.rate_m_per_s, start_s)?];
        for i in next..record.time_s.len() {
            time_s.push(record.time_s[i] - start_s);
            deflection_m.push(travel(i) + offset_m);
            force_n.push(record.force_n[i]);
            closing_m_per_s.push(direction * record.rate_m_per_s[i]);
        }
        Ok(Self {
            curve: Curve::new(time_s, deflection_m, force_n)?,
            closing_m_per_s,
            time_s: start_s,
            before: record.time_s.partition_point(|&t| t <= contact_s).saturating_sub(1),
        })
    }
}

/// When the bodies have moved by `slack_m` after contact: where the surfaces meet later than
/// found, the curve begins where they do.
fn closed_s(
    record: &Record,
    contact_s: f64,
    slack_m: f64,
    most_m: f64,
    travel: impl Fn(usize) -> f64,
) -> Result<f64, ExtractError> {
    let next = record.time_s.partition_point(|&t| t <= contact_s);
    let i = (next..record.time_s.len())
        .find(|&i| travel(i) >= slack_m)
        .ok_or(ExtractError::OffsetTooLarge { offset_m: -slack_m, most_m })?;
    let (from_s, from_m) =
        if i == next { (contact_s, 0.0) } else { (record.time_s[i - 1], travel(i - 1)) };
    let share = (slack_m - from_m) / (travel(i) - from_m);
    Ok(from_s + share * (record.time_s[i] - from_s))
}

/// Two speeds of one impact may differ by this share before it is reported.
const SAME_SPEED: f64 = 0.01;

/// Source of the impact speed.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum SpeedBy {
    Manifest,
    Record,
    Deck,
}

pub(super) struct ImpactSpeed {
    pub speed: Speed,
    pub by: SpeedBy,
    /// What the record shows before contact, or in its first state; `None` where the file has
    /// no velocities.
    pub recorded_m_per_s: Option<f64>,
}

impl ImpactSpeed {
    /// The manifest's speed, else the record's, else the deck's. Where two of them differ, both
    /// are reported. `before`: the last state that contact has not changed; none if it is in the motion, before the
    /// force begins.
    pub(crate) fn of(
        setup: &Setup<'_>,
        record: &Record,
        before: Option<usize>,
        remarks: &mut Notes,
    ) -> Result<Self, ExtractError> {
        let differ = |a: f64, b: f64| (a - b).abs() > SAME_SPEED * a.max(b);
        let first = record.first_rate_m_per_s.abs();
        let of_state = before.map_or(first, |state| record.rate_m_per_s[state].abs());
        let recorded = record.missing_velocity.is_none().then_some(of_state);
        if let Some(recorded) = recorded
            && differ(first, recorded)
        {
            let used = match setup.manifest_speed_m_per_s {
                Some(_) => "",
                None => "; the latter is used",
            };
            remarks.warn(format!(
                "speed: {} in the first state, {} in the last before contact{used}",
                km_per_h(first),
                km_per_h(recorded)
            ));
        }
        let (m_per_s, by, name) = match (setup.manifest_speed_m_per_s, recorded) {
            (Some(speed), _) => (speed, SpeedBy::Manifest, "study's"),
            (None, Some(speed)) => (speed, SpeedBy::Record, "record's"),
            (None, None) => match &setup.deck_speed {
                Some((deck, _)) => (*deck, SpeedBy::Deck, "deck's"),
                None => {
                    let component = record.missing_velocity.clone().unwrap_or_default();
                    return Err(ExtractError::NoSpeed { component });
                }
            },
        };
        let deck = setup.deck_speed.as_ref();
        let of_record = recorded.map(|v| ("the record".to_string(), v));
        let of_deck = deck.map(|(speed, place)| (format!("the deck {place}"), *speed));
        for (who, other) in of_record.into_iter().chain(of_deck) {
            if differ(m_per_s, other) {
                remarks.warn(format!(
                    "speed: {who} states {}; the {name} {} is used",
                    km_per_h(other),
                    km_per_h(m_per_s)
                ));
            }
        }
        match (by, deck) {
            (SpeedBy::Record, _) => {
                remarks.note(format!("speed: {} taken from the record", km_per_h(m_per_s)));
            }
            (SpeedBy::Deck, Some((_, place))) => {
                remarks.note(format!("speed: {} taken from the deck {place}", km_per_h(m_per_s)))
            }
            _ => {}
        }
        if m_per_s > 0.0 {
            let speed = Speed { m_per_s, kind: setup.kind };
            Ok(Self { speed, by, recorded_m_per_s: recorded })
        } else {
            Err(ExtractError::Standing)
        }
    }
}
