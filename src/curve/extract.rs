//! Extraction: from the histories of one run to its curve.

use super::contact::{self, milliseconds};
use super::recipe::{BodyMotion, Filter, Recipe};
use super::resample::interpolate;
use super::{Curve, CurveError, EnergyAudit, Masses, cfc, energy, loading};
use crate::history::{History, derivative};
use crate::unit::{Speed, SpeedKind, UnitSystem, km_per_h};

/// The histories of one run, in the solver's units.
pub struct Measured<'a> {
    pub units: UnitSystem,
    pub displacement: &'a History,
    pub minus_displacement: Option<&'a History>,
    /// Velocities of the same nodes, where the file has them.
    pub velocity: Option<&'a History>,
    pub minus_velocity: Option<&'a History>,
    pub force: MeasuredForce<'a>,
    /// Contact force that tells when contact begins, beside a body force.
    pub contact: Option<&'a History>,
}

/// The force, or what makes it.
pub enum MeasuredForce<'a> {
    Contact(&'a History),
    /// Acceleration or velocity of the body's node, to be multiplied by its mass.
    Body(&'a History, BodyMotion),
}

/// What the manifest says of a run.
#[derive(Clone, Debug)]
pub struct Setup<'a> {
    pub recipe: &'a Recipe,
    pub kind: SpeedKind,
    /// One of two identical bodies against the symmetry plane: closing speed and
    /// deflection are twice the run's.
    pub half_model: bool,
    pub masses: Masses,
    pub manifest_speed_m_per_s: Option<f64>,
    pub deck_speed: Option<DeckSpeed>,
    pub stated: Stated,
    /// Names and speeds of the study's other runs, to name what was mistaken for what.
    pub others: &'a [(String, f64)],
}

/// The impact speed of a run's deck.
#[derive(Clone, Debug, PartialEq)]
pub struct DeckSpeed {
    pub m_per_s: f64,
    /// Name of the deck and line of the velocity in it.
    pub place: String,
}

/// What a run's entry states of its record, in the place of what would be found in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stated {
    pub contact: Option<StatedContact>,
    /// Deflection at contact.
    pub offset_m: f64,
    /// Solver's time behind which the record is not used.
    pub truncate_s: Option<f64>,
    /// 1 or −1: factor that makes the file's force positive in compression.
    pub force_sign: Option<f64>,
    /// Take the run whatever its energy and impulse say.
    pub accept_energy: bool,
}

/// Where contact begins by the manifest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StatedContact {
    /// At this time of the solver.
    Time { s: f64 },
    /// When the bodies have moved by this from the first state.
    Gap { m: f64 },
}

/// The curve of a run and what was found on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Extracted {
    pub speed: Speed,
    pub sampled: Curve,
    pub closing_speed_m_per_s: Vec<f64>,
    pub original: Curve,
    pub contact_time_s: f64,
    /// Whether the speed is the deck's, so that damage of the deck matters.
    pub speed_is_decks: bool,
    pub unloading_stiffness_n_per_m: Option<f64>,
    pub audit: EnergyAudit,
    /// Choices made, for the record.
    pub notes: Vec<String>,
    /// What the user should look at.
    pub warnings: Vec<String>,
}

/// Why a run gives no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExtractError {
    #[error("{what} holds {states} states: at least 2 are needed")]
    TooShort { origin: Origin, what: &'static str, states: usize },
    #[error(
        "{what} of state {state} is {value}: expected a finite number; look for the problem with crumple inspect"
    )]
    NotFinite { origin: Origin, what: String, state: usize, value: f64 },
    #[error(
        "the force never exceeds {threshold_n:.0} N (its largest is {largest_n} N): there is no contact in this record; look at id, component, sign and units"
    )]
    NoContact { threshold_n: f64, largest_n: f64 },
    #[error("the histories of deflection and force have no time in common")]
    NoOverlap,
    #[error(
        "{key} = {at} lies outside the record, which goes from {first} to {last}",
        at = milliseconds(*time_s), first = milliseconds(*first_s), last = milliseconds(*last_s)
    )]
    OutsideRecord { key: &'static str, time_s: f64, first_s: f64, last_s: f64 },
    #[error(
        "gap = {gap_mm} mm is never closed: the bodies move towards each other by {most_mm:.3} mm at most",
        gap_mm = gap_m * 1e3, most_mm = most_m * 1e3
    )]
    GapStaysOpen { gap_m: f64, most_m: f64 },
    #[error(
        "offset = {offset_mm} mm is never made up for: the deflection grows by {most_mm:.3} mm at most",
        offset_mm = offset_m * 1e3, most_mm = most_m * 1e3
    )]
    OffsetTooLarge { offset_m: f64, most_m: f64 },
    #[error("{0}")]
    Impossible(#[from] energy::Impossible),
    #[error("the deflection does not grow after contact: check node, component and direction")]
    NoDeflection,
    #[error(
        "the manifest gives no speed and the file has no {component} to take it from: add speed = \"…km/h\""
    )]
    NoSpeed { component: &'static str },
    #[error("the first state does not move: add speed = \"…km/h\" to the run")]
    Standing,
    #[error("{0}")]
    Filter(#[from] cfc::CfcError),
    #[error("{0}")]
    Curve(#[from] CurveError),
}

/// Times of two files count as equal up to the six digits that solvers print.
const SAME_TIME: f64 = 1e-5;
/// Two speeds of one impact may differ by this share before it is said.
const SAME_SPEED: f64 = 0.01;
/// A beginning of the crush, as a share of it, that brings less than this share of the impulse
/// is doubtful: light noses of real runs bring twice as much and more.
const BEGINNING: (f64, f64) = (0.15, 0.003);
/// A contact found within a step that closes more than this share of the crush is uncertain.
const CERTAIN_SHARE: f64 = 0.01;

/// Extracts the curve of one run.
///
/// Order of work: SI, common times, cut, sign of the force, contact, filter (force only, at its
/// original rate), deflection from contact on, speed, resampling, audit and its bounds.
///
/// # Errors
/// [`ExtractError`] says which history cannot be used and what to change.
pub fn extract(measured: &Measured<'_>, setup: &Setup<'_>) -> Result<Extracted, ExtractError> {
    let mut notes = Vec::new();
    let mut warnings = Vec::new();
    let motion = Motion::of(measured, setup, &mut notes)?;
    let force = force(measured, setup, &mut notes)?;
    let mut record = on_common_times(motion, force, &mut notes)?;
    truncate(&mut record, setup.stated.truncate_s, &mut notes)?;
    let sign = match setup.stated.force_sign {
        Some(sign) => sign,
        None => sign_of_impulse(&record.time_s, &record.force_n),
    };
    if sign < 0.0 {
        notes.push("force: sign flipped, positive in compression".into());
    }
    record.force_n.iter_mut().for_each(|f| *f *= sign);
    // Before the filter, which without phase shift begins ahead of the contact.
    let start = find_contact(measured, setup, &record, &mut notes, &mut warnings)?;
    if let Filter::Cfc(class) = setup.recipe.filter {
        let filtered = cfc::filter(class, &record.time_s, &record.force_n)?;
        if filtered.resampled {
            notes.push(format!(
                "filter: intervals differ by up to {:.1} %, so the force was filtered at their mean",
                filtered.spread * 100.0
            ));
        }
        record.force_n = filtered.values;
    }
    let contact = from_contact(&record, start.time_s, setup.stated.offset_m, &mut notes)?;
    let (original, closing) = (contact.curve, contact.closing_m_per_s);
    start.say_uncertainty(&original, &closing, &mut notes, &mut warnings);
    let (speed, by) = speed(measured, setup, &record, contact.before, &mut notes, &mut warnings)?;
    let recorded = measured.velocity.map(|_| recorded_speed(&record, contact.before));
    let claim = energy::Claim {
        curve: &original,
        masses: setup.masses,
        speed,
        closing_m_per_s: measured.velocity.map(|_| &closing[..]),
        recorded_m_per_s: recorded,
        units: measured.units,
        is_body_force: matches!(measured.force, MeasuredForce::Body(..)),
        others: setup.others,
    };
    let balance = match claim.check() {
        Ok(balance) => balance,
        Err(impossible) if setup.stated.accept_energy => {
            warnings.push(format!("accept_energy: {}", impossible.found()));
            claim.balance()
        }
        Err(impossible) => return Err(impossible.into()),
    };
    let (sampled, closing_speed_m_per_s) =
        sample(&original, &closing, setup, &mut notes, &mut warnings)?;
    let audit = energy::audit(&original, setup.masses, speed);
    // Of a run that ended while loading: of what it had stopped by then.
    if let Some(work) = balance.work.filter(|w| (w - 1.0).abs() > EnergyAudit::TOLERANCE) {
        warnings.push(format!(
            "energy: the curve takes up {:.1} % of the kinetic energy",
            work * 100.0
        ));
    }
    if let Some(impulse) = balance.impulse.filter(|i| (i - 1.0).abs() > energy::IMPULSE_TOLERANCE) {
        warnings.push(format!(
            "impulse: the force gives {:.1} % of the recorded change of momentum",
            impulse * 100.0
        ));
    }
    if loading::loading_end(&original) + 1 == original.time_s().len() {
        warnings.push(
            "truncated: the largest deflection is the last state, so the run ended while loading"
                .into(),
        );
    }
    if let Ok(branch) = loading::loading_branch(&original)
        && branch.dropped > 0
    {
        notes.push(format!(
            "loading branch: {} samples removed because the deflection did not advance",
            branch.dropped
        ));
    }
    Ok(Extracted {
        speed,
        sampled,
        closing_speed_m_per_s,
        unloading_stiffness_n_per_m: loading::unloading_stiffness(&original),
        original,
        contact_time_s: contact.time_s,
        speed_is_decks: by == SpeedBy::Deck,
        audit,
        notes,
        warnings,
    })
}

/// Removes the states behind the manifest's end of the record.
fn truncate(
    record: &mut Record,
    until_s: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<(), ExtractError> {
    let Some(until_s) = until_s else { return Ok(()) };
    let kept = record.time_s.iter().take_while(|&&t| t <= until_s).count();
    if kept < 2 {
        let (first_s, last_s) = (record.time_s[0], record.time_s[record.time_s.len() - 1]);
        let key = "truncate";
        return Err(ExtractError::OutsideRecord { key, time_s: until_s, first_s, last_s });
    }
    let removed = record.time_s.len() - kept;
    record.time_s.truncate(kept);
    record.deflection_m.truncate(kept);
    record.rate_m_per_s.truncate(kept);
    record.force_n.truncate(kept);
    notes.push(format!("truncate: {removed} states after {} removed", milliseconds(until_s)));
    Ok(())
}

/// The sign of `∫F dt`: a single state that is wrong does not turn it.
fn sign_of_impulse(time_s: &[f64], force_n: &[f64]) -> f64 {
    let impulse: f64 = (1..time_s.len())
        .map(|i| 0.5 * (force_n[i] + force_n[i - 1]) * (time_s[i] - time_s[i - 1]))
        .sum();
    if impulse < 0.0 { -1.0 } else { 1.0 }
}

/// Where contact begins, and how sure that is.
struct Start {
    time_s: f64,
    by: StartBy,
}

enum StartBy {
    /// The manifest's contact time or gap.
    Manifest,
    /// The first state, which is in contact already.
    FirstState,
    /// A crossing within an output interval of this length.
    Crossing { interval_s: f64 },
    /// The body's slowing down, which is later: said where it is found.
    Body,
}

fn find_contact(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    record: &Record,
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<Start, ExtractError> {
    let t = &record.time_s;
    let (first_s, last_s) = (t[0], t[t.len() - 1]);
    match setup.stated.contact {
        Some(StatedContact::Time { s: time_s }) => {
            if !(first_s..last_s).contains(&time_s) {
                let key = "contact_time";
                return Err(ExtractError::OutsideRecord { key, time_s, first_s, last_s });
            }
            say_found(record, time_s, notes);
            return Ok(Start { time_s, by: StartBy::Manifest });
        }
        Some(StatedContact::Gap { m }) => {
            let time_s = closing_time(record, m)?;
            notes.push(format!("contact: the gap is closed at {}", milliseconds(time_s)));
            say_found(record, time_s, notes);
            return Ok(Start { time_s, by: StartBy::Manifest });
        }
        None => {}
    }
    let onset = match measured.contact {
        Some(contact) => {
            let units = measured.units;
            let what = "contact force";
            let signal = Signal::of(contact, units, units.force(), what, Origin::Force, notes)?;
            let sign = sign_of_impulse(&signal.time_s, &signal.values);
            let force_n: Vec<f64> = signal.values.iter().map(|f| sign * f).collect();
            notes.push(format!("contact: found by {}", contact.label()));
            onset(&signal.time_s, &force_n)?
        }
        None => onset(t, &record.force_n)?,
    };
    let of_body = measured.contact.is_none() && matches!(measured.force, MeasuredForce::Body(..));
    if of_body {
        warnings.push(format!(
            "contact: found at {} where the body slows down; what touches first is stopped earlier by some milliseconds, and the crush is too short by as much times the speed: name the contact force in the recipe (contact = {{ file = \"rwforc\", id = 1, component = \"normal_force\" }}), or say contact_time in the run",
            milliseconds(onset.time_s)
        ));
    }
    warnings.extend(onset.warnings);
    if !(first_s..last_s).contains(&onset.time_s) {
        let (key, time_s) = ("the contact", onset.time_s);
        return Err(ExtractError::OutsideRecord { key, time_s, first_s, last_s });
    }
    let by = match onset.interval_s {
        _ if of_body => StartBy::Body,
        Some(interval_s) => StartBy::Crossing { interval_s },
        None => StartBy::FirstState,
    };
    Ok(Start { time_s: onset.time_s, by })
}

/// Says when the force begins, if the manifest states another contact.
fn say_found(record: &Record, stated_s: f64, notes: &mut Vec<String>) {
    let Ok(found) = onset(&record.time_s, &record.force_n) else { return };
    if (found.time_s - stated_s).abs() > found.interval_s.unwrap_or(0.0) {
        notes.push(format!(
            "contact: {} as the manifest has it; the force begins at {}",
            milliseconds(stated_s),
            milliseconds(found.time_s)
        ));
    }
}

fn onset(time_s: &[f64], force_n: &[f64]) -> Result<contact::Onset, ExtractError> {
    let threshold_n = contact::threshold_n(force_n);
    contact::onset(time_s, force_n, threshold_n).ok_or_else(|| {
        let largest_n = force_n.iter().copied().fold(0.0, f64::max);
        ExtractError::NoContact { threshold_n, largest_n }
    })
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

/// The record from contact on.
struct FromContact {
    curve: Curve,
    closing_m_per_s: Vec<f64>,
    time_s: f64,
    /// The last state that contact has not changed.
    before: usize,
}

/// Time and deflection counted from contact, between two states where it lies there.
fn from_contact(
    record: &Record,
    contact_s: f64,
    offset_m: f64,
    notes: &mut Vec<String>,
) -> Result<FromContact, ExtractError> {
    let at = |values: &[f64], time_s: f64| {
        interpolate(&record.time_s, values, &[time_s])
            .map(|v| v[0])
            .map_err(|_| ExtractError::NoOverlap)
    };
    let contact_m = at(&record.deflection_m, contact_s)?;
    // A rebound can travel further than the crush: what the impact does first counts.
    let direction = if at(&record.rate_m_per_s, contact_s)? < 0.0 { -1.0 } else { 1.0 };
    let travel = |i: usize| direction * (record.deflection_m[i] - contact_m);
    let next = record.time_s.partition_point(|&t| t <= contact_s);
    let most_m = (next..record.time_s.len()).map(travel).fold(0.0, f64::max);
    if most_m <= 0.0 {
        return Err(ExtractError::NoDeflection);
    }
    if direction < 0.0 {
        notes.push("deflection: sign flipped, positive in compression".into());
    }
    // Below 0 the surfaces meet later than found: the curve begins where they do.
    let start_s = match offset_m < 0.0 {
        false => contact_s,
        true => {
            let i = (next..record.time_s.len())
                .find(|&i| travel(i) >= -offset_m)
                .ok_or(ExtractError::OffsetTooLarge { offset_m, most_m })?;
            let (from_s, from_m) = match i == next {
                true => (contact_s, 0.0),
                false => (record.time_s[i - 1], travel(i - 1)),
            };
            let share = (-offset_m - from_m) / (travel(i) - from_m);
            from_s + share * (record.time_s[i] - from_s)
        }
    };
    if offset_m != 0.0 {
        notes.push(format!("offset: the deflection at contact is {} mm", offset_m * 1e3));
    }
    let next = record.time_s.partition_point(|&t| t <= start_s);
    let (mut time_s, mut deflection_m) = (vec![0.0], vec![offset_m.max(0.0)]);
    let mut force_n = vec![at(&record.force_n, start_s)?];
    let mut closing_m_per_s = vec![direction * at(&record.rate_m_per_s, start_s)?];
    for i in next..record.time_s.len() {
        time_s.push(record.time_s[i] - start_s);
        deflection_m.push(travel(i) + offset_m);
        force_n.push(record.force_n[i]);
        closing_m_per_s.push(direction * record.rate_m_per_s[i]);
    }
    Ok(FromContact {
        curve: Curve::new(time_s, deflection_m, force_n)?,
        closing_m_per_s,
        time_s: start_s,
        before: record.time_s.partition_point(|&t| t <= contact_s).saturating_sub(1),
    })
}

impl Start {
    /// Says by how much the crush may be off because contact lies somewhere in a step.
    fn say_uncertainty(
        &self,
        curve: &Curve,
        closing_m_per_s: &[f64],
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) {
        let crush_m = curve.deflection_m()[loading::loading_end(curve)];
        let step_m = |interval_s: f64| closing_m_per_s[0].abs() * interval_s;
        match self.by {
            StartBy::Crossing { .. } | StartBy::FirstState | StartBy::Body
                if impulse_share_to(curve, BEGINNING.0 * crush_m) < BEGINNING.1 =>
            {
                warnings.push(format!(
                    "contact: the first {:.0} % of the crush ({:.0} mm) bring less than {} % of the impulse: if that is no contact yet, say contact_time or gap in the run",
                    BEGINNING.0 * 100.0,
                    BEGINNING.0 * crush_m * 1e3,
                    BEGINNING.1 * 100.0
                ));
            }
            StartBy::Crossing { interval_s } if step_m(interval_s) > CERTAIN_SHARE * crush_m => {
                warnings.push(format!(
                    "contact: it lies in a step of {:.2} mm, so the crush is uncertain by up to {:.1} % (contact_time or gap in the run says where)",
                    step_m(interval_s) * 1e3,
                    100.0 * step_m(interval_s) / crush_m
                ));
            }
            StartBy::FirstState => notes.push(
                "contact: the record begins in contact, so the deflection counts from its first state"
                    .into(),
            ),
            StartBy::Crossing { .. } | StartBy::Manifest | StartBy::Body => {}
        }
    }
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

/// A history in SI with strictly increasing times.
struct Signal {
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl ExtractError {
    /// Whether it speaks of the force's file rather than of the motion's.
    pub fn is_of_force(&self) -> bool {
        match self {
            Self::TooShort { origin, .. } | Self::NotFinite { origin, .. } => {
                *origin == Origin::Force
            }
            Self::NoContact { .. } | Self::Filter(_) | Self::Impossible(_) => true,
            _ => false,
        }
    }
}

/// Which history an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Motion,
    Force,
}

impl Signal {
    fn of(
        history: &History,
        units: UnitSystem,
        factor: f64,
        what: &'static str,
        origin: Origin,
        notes: &mut Vec<String>,
    ) -> Result<Self, ExtractError> {
        if let Some(i) = history.values.iter().position(|v| !v.is_finite()) {
            let what = history.label();
            return Err(ExtractError::NotFinite {
                origin,
                what,
                state: i + 1,
                value: history.values[i],
            });
        }
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        for (&t, &v) in history.time.iter().zip(&history.values) {
            let t = t * units.time_s;
            if time_s.last().is_none_or(|&last| t > last) {
                time_s.push(t);
                values.push(v * factor);
            }
        }
        let skipped = history.time.len() - time_s.len();
        if skipped > 0 {
            notes.push(format!("{what}: {skipped} states left out because time did not increase"));
        }
        if time_s.len() < 2 {
            return Err(ExtractError::TooShort { origin, what, states: time_s.len() });
        }
        Ok(Self { time_s, values })
    }
}

/// Relative displacement and its rate, in the direction of the file.
struct Motion {
    time_s: Vec<f64>,
    deflection_m: Vec<f64>,
    rate_m_per_s: Vec<f64>,
}

impl Motion {
    fn of(
        measured: &Measured<'_>,
        setup: &Setup<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Self, ExtractError> {
        let units = measured.units;
        let twice = if setup.half_model { 2.0 } else { 1.0 };
        let relative = |node: &History, minus: Option<&History>, factor, what, notes: &mut _| {
            let mut signal = Signal::of(node, units, factor, what, Origin::Motion, notes)?;
            if let Some(minus) = minus {
                let minus = Signal::of(minus, units, factor, what, Origin::Motion, notes)?;
                for (value, minus) in signal.values.iter_mut().zip(&minus.values) {
                    *value -= minus;
                }
            }
            Ok::<_, ExtractError>(signal)
        };
        let (node, minus) = (measured.displacement, measured.minus_displacement);
        let displacement = relative(node, minus, units.length_m * twice, "displacement", notes)?;
        if setup.half_model {
            notes.push("half model: deflection and speed are twice the run's".into());
        }
        let rate_m_per_s = match measured.velocity {
            Some(velocity) => {
                let factor = units.speed() * twice;
                relative(velocity, measured.minus_velocity, factor, "velocity", notes)?.values
            }
            None => {
                notes.push(
                    "closing speed: displacement differentiated, the file has no velocity".into(),
                );
                derivative(&displacement.time_s, &displacement.values)
            }
        };
        Ok(Self { time_s: displacement.time_s, deflection_m: displacement.values, rate_m_per_s })
    }
}

/// The force in N, in the direction of the file, at its own rate.
fn force(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    notes: &mut Vec<String>,
) -> Result<Signal, ExtractError> {
    let units = measured.units;
    let mass = setup.masses.body_kg;
    Ok(match measured.force {
        MeasuredForce::Contact(history) => {
            Signal::of(history, units, units.force(), "force", Origin::Force, notes)?
        }
        MeasuredForce::Body(history, BodyMotion::Acceleration) => Signal::of(
            history,
            units,
            mass * units.acceleration(),
            "acceleration",
            Origin::Force,
            notes,
        )?,
        MeasuredForce::Body(history, BodyMotion::Velocity) => {
            let velocity =
                Signal::of(history, units, mass * units.speed(), "velocity", Origin::Force, notes)?;
            notes.push("body force: mass times the central difference of the velocity".into());
            Signal { values: derivative(&velocity.time_s, &velocity.values), ..velocity }
        }
    })
}

/// Motion and force at the same times.
struct Record {
    time_s: Vec<f64>,
    deflection_m: Vec<f64>,
    rate_m_per_s: Vec<f64>,
    force_n: Vec<f64>,
    /// Rate of the first state of the motion, before any cut.
    first_rate_m_per_s: f64,
}

fn on_common_times(
    motion: Motion,
    force: Signal,
    notes: &mut Vec<String>,
) -> Result<Record, ExtractError> {
    let first_rate_m_per_s = motion.rate_m_per_s[0];
    let last_s = motion.time_s[motion.time_s.len() - 1].abs();
    let same = motion.time_s.len() == force.time_s.len()
        && motion
            .time_s
            .iter()
            .zip(&force.time_s)
            .all(|(a, b)| (a - b).abs() <= SAME_TIME * last_s);
    if same {
        return Ok(Record {
            time_s: motion.time_s,
            deflection_m: motion.deflection_m,
            rate_m_per_s: motion.rate_m_per_s,
            force_n: force.values,
            first_rate_m_per_s,
        });
    }
    let (from, to) = (motion.time_s[0], motion.time_s[motion.time_s.len() - 1]);
    let (time_s, force_n): (Vec<f64>, Vec<f64>) = force
        .time_s
        .iter()
        .zip(&force.values)
        .filter(|(t, _)| (from..=to).contains(*t))
        .map(|(&t, &f)| (t, f))
        .unzip();
    if time_s.len() < 2 {
        return Err(ExtractError::NoOverlap);
    }
    notes.push(format!(
        "times: the force has {} states and the motion {}; the motion was interpolated to {} common ones",
        force.time_s.len(),
        motion.time_s.len(),
        time_s.len()
    ));
    let at = |values: &[f64]| {
        interpolate(&motion.time_s, values, &time_s).map_err(|_| ExtractError::NoOverlap)
    };
    Ok(Record {
        deflection_m: at(&motion.deflection_m)?,
        rate_m_per_s: at(&motion.rate_m_per_s)?,
        time_s,
        force_n,
        first_rate_m_per_s,
    })
}

/// Who says the impact speed.
#[derive(Clone, Copy, PartialEq)]
enum SpeedBy {
    Manifest,
    Record,
    Deck,
}

/// The speed that the record shows: before contact, or of its first state.
fn recorded_speed(record: &Record, before: usize) -> f64 {
    record.rate_m_per_s[before].abs()
}

/// The impact speed: the manifest's, else the record's, else the deck's. Where two of them
/// differ, both are said.
fn speed(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
    record: &Record,
    before: usize,
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<(Speed, SpeedBy), ExtractError> {
    let differ = |a: f64, b: f64| (a - b).abs() > SAME_SPEED * a.max(b);
    let first = record.first_rate_m_per_s.abs();
    let recorded = measured.velocity.map(|_| recorded_speed(record, before));
    if let Some(recorded) = recorded
        && differ(first, recorded)
    {
        warnings.push(format!(
            "speed: the first state moves at {}, the last before contact at {}; the latter is the record's",
            km_per_h(first),
            km_per_h(recorded)
        ));
    }
    let (m_per_s, by, name) = match (setup.manifest_speed_m_per_s, recorded) {
        (Some(speed), _) => (speed, SpeedBy::Manifest, "manifest's"),
        (None, Some(speed)) => (speed, SpeedBy::Record, "record's"),
        (None, None) => match &setup.deck_speed {
            Some(deck) => (deck.m_per_s, SpeedBy::Deck, "deck's"),
            None => {
                let component = setup.recipe.deflection.component.velocity();
                return Err(ExtractError::NoSpeed { component });
            }
        },
    };
    let deck = setup.deck_speed.as_ref();
    let of_record = recorded.map(|v| ("the record".to_string(), v));
    let of_deck = deck.map(|d| (format!("the deck {}", d.place), d.m_per_s));
    for (who, other) in of_record.into_iter().chain(of_deck) {
        if differ(m_per_s, other) {
            warnings.push(format!(
                "speed: {who} says {}, the {name} {} is used",
                km_per_h(other),
                km_per_h(m_per_s)
            ));
        }
    }
    match (by, deck) {
        (SpeedBy::Record, _) => {
            notes.push(format!("speed: {} taken from the record", km_per_h(m_per_s)));
        }
        (SpeedBy::Deck, Some(deck)) => {
            notes.push(format!("speed: {} taken from the deck {}", km_per_h(m_per_s), deck.place))
        }
        _ => {}
    }
    match m_per_s > 0.0 {
        true => Ok((Speed { m_per_s, kind: setup.kind }, by)),
        false => Err(ExtractError::Standing),
    }
}

/// The curve at the recipe's common times, as far as the record reaches.
fn sample(
    original: &Curve,
    closing: &[f64],
    setup: &Setup<'_>,
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Result<(Curve, Vec<f64>), ExtractError> {
    let sampling = setup.recipe.sampling;
    let at = original.time_s();
    let last_s = at[at.len() - 1];
    // The last state may come a rounding error before its nominal time.
    let reach = last_s * (1.0 + 1e-9);
    let times: Vec<f64> = (0..sampling.states)
        .map(|i| i as f64 * sampling.interval_s)
        .take_while(|&t| t <= reach)
        .map(|t| t.min(last_s))
        .collect();
    if times.len() < sampling.states {
        let short = format!(
            "short: the record holds {} of {} states from contact on",
            times.len(),
            sampling.states
        );
        // A record that was cut on purpose is as short as was asked for.
        match setup.stated.truncate_s {
            Some(_) => notes.push(short),
            None => warnings.push(short),
        }
    }
    let at_times =
        |values: &[f64]| interpolate(at, values, &times).map_err(|_| ExtractError::NoOverlap);
    let deflection = at_times(original.deflection_m())?;
    let force = at_times(original.force_n())?;
    let closing = at_times(closing)?;
    Ok((Curve::new(times.clone(), deflection, force)?, closing))
}
