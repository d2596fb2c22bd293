//! Extraction: from the histories of one run to its curve.
//!
//! Order of work: SI; common times of motion and force; cut; sign of the force; contact time; filter (force only, at its
//! original rate); deflection from contact on; speed; bounds of energy and impulse; resampling; audit. Contact is found before
//! filtering, because a filter without phase shift begins ahead of it.
//!
//! The sign of the deflection is the direction of motion at contact, not of the largest value: at low speeds the rebound
//! travels further than the crush.

mod consistency;
mod record;
mod start;

use super::contact::milliseconds;
use super::recipe::{Filter, RecordedMotion, Sampling};
use super::{Curve, EnergyAudit, ForceKind, Masses, Quality, RecordedCurves, energy, loading};
use crate::error::{Error, ErrorCode, error};
use crate::history::History;
use crate::signal::cfc;
use crate::unit::{Speed, SpeedKind, UnitSystem};
use crate::words::counted;
use consistency::Motion;
pub(crate) use record::Record;
use record::sample;
pub(super) use start::light_beginning;
use start::{FromContact, ImpactSpeed, SpeedBy, Start};

/// The curve of a run and what was found on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Extracted {
    /// Impact speed.
    pub speed: Speed,
    /// Force over deflection, sampled and as recorded.
    pub curves: RecordedCurves,
    /// Energy audit, notes and warnings.
    pub quality: Quality,
    /// Whether the speed is the deck's, so that damage of the deck matters.
    pub speed_is_decks: bool,
}

/// Extracts the curve of one run.
///
/// Order of work: SI, common times, cut, sign of the force, contact, filter (force only, at its
/// original rate), deflection from contact on, speed, resampling, audit and its bounds.
///
/// # Errors
/// It says which history cannot be used and what to change.
pub fn extract(measured: &Measured<'_>, setup: &Setup<'_>) -> Result<Extracted, Error> {
    let impossible = |error: Error| error.coded_as(ErrorCode::Run);
    setup.masses.check().map_err(impossible)?;
    setup.sampling.check().map_err(|e| error!(Run at "sampling", "{e}"))?;
    let (MeasuredForce::Contact(force) | MeasuredForce::Body(force, _)) = measured.force;
    let Measured { displacement, minus_displacement, velocity, minus_velocity, contact, .. } =
        *measured;
    let further = [minus_displacement, velocity, minus_velocity, contact].into_iter().flatten();
    for history in [displacement, force].into_iter().chain(further) {
        let (values, times) = (history.values.len(), history.time.len());
        if values != times {
            return Err(error!(Run, "{} has {values} values for {times} times", history.label()));
        }
    }
    of_run(measured, setup).map_err(|reason| Error::below(ErrorCode::Run, reason))
}

/// The same, for callers that decide by the reason.
pub(crate) fn of_run(
    measured: &Measured<'_>,
    setup: &Setup<'_>,
) -> Result<Extracted, ExtractError> {
    let mut remarks = Notes::default();
    let record = Record::of(measured, setup, &mut remarks)?;
    remarks.warnings.extend(consistency::masses(measured, setup.masses));
    curve_of(record, remarks, setup)
}

/// The curve of a record, which left these remarks.
pub(crate) fn curve_of(
    mut record: Record,
    mut remarks: Notes,
    setup: &Setup<'_>,
) -> Result<Extracted, ExtractError> {
    // Before the filter, which without phase shift begins ahead of the contact.
    let start = Start::find(setup, &mut record, &mut remarks)?;
    let accepted = |checked: Result<Notes, energy::ImpossibleRun>| match checked {
        Err(impossible) if setup.stated.accept_energy => {
            Ok(Notes::warning(format!("accept_energy: {}", impossible.found)))
        }
        checked => checked,
    };
    remarks.append(accepted(consistency::displacement(&record))?);
    let recorded_n = record.force_n.clone();
    remarks.warnings.extend(consistency::spike(&record.time_s, &recorded_n));
    if let Filter::Cfc(class) = setup.filter {
        filter(class, &mut record, &mut remarks)?;
    }
    let offset_m = setup.stated.offset_m;
    let contact = FromContact::of(&record, start.time_s, offset_m, &mut remarks)?;
    start.uncertainty(&contact, setup, &mut remarks);
    if let Filter::Cfc(class) = setup.filter {
        remarks.warnings.extend(consistency::filter(class, &contact.curve, &recorded_n));
    }
    start.force_before(&record.time_s, &recorded_n, &contact, &mut remarks);
    let motion = Motion::of(&contact, setup.masses);
    motion.is_free()?;
    motion.flight(&record, &mut remarks);
    let (along_time, mass) = (motion.momentum(), motion.mass(&record));
    let is_slowed = contact.time_s <= record.time_s[0] && record.slowed_over_m.is_some();
    let before = (!is_slowed).then_some(contact.before);
    let FromContact { curve: original, closing_m_per_s: closing, time_s: contact_s, .. } = contact;
    let ImpactSpeed { speed, by, recorded_m_per_s } =
        ImpactSpeed::of(setup, &record, before, &mut remarks)?;
    let claim = energy::StatedConditions {
        curve: &original,
        masses: setup.masses,
        speed,
        closing_m_per_s: record.missing_velocity.is_none().then_some(&closing[..]),
        recorded_m_per_s,
        units: record.units,
        is_body_force: record.force_kind == ForceKind::Body,
        others: setup.others,
    };
    let balance = match claim.check() {
        Ok(balance) => balance,
        Err(impossible) if setup.stated.accept_energy => {
            remarks.warn(format!("accept_energy: {}", impossible.found));
            claim.balance()
        }
        Err(impossible) => {
            let says = |what: &str| remarks.warnings.iter().any(|w| w.starts_with(what));
            // What is left out has slowed the bodies down.
            let is_second_hit = says("contact: ignored")
                && recorded_m_per_s
                    .is_some_and(|v| v < (1.0 - SECOND_HIT) * record.first_rate_m_per_s.abs());
            let is_cut =
                setup.stated.offset_m > 0.0 && claim.balance().work.is_some_and(|work| work < 1.0);
            let impossible = match is_second_hit {
                true => impossible.by_earlier_force(),
                false if is_cut => impossible.by_offset(),
                false => impossible,
            };
            return Err(impossible.into());
        }
    };
    remarks.append(accepted(along_time)?);
    remarks.append(accepted(mass)?);
    let (sampled, closing_speed_m_per_s) = sample(&original, &closing, setup, &mut remarks)?;
    consistency::sampling(&original, &sampled, &mut remarks);
    if let Some(time_s) = &record.motion_time_s {
        let from_contact: Vec<f64> = time_s.iter().map(|t| t - contact_s).collect();
        remarks.warnings.extend(consistency::coarse_motion(
            &original,
            (&sampled, &closing_speed_m_per_s),
            setup.masses,
            &from_contact,
        ));
    }
    audited(&original, &closing, record.force_kind, balance, &mut remarks);
    Ok(Extracted {
        speed,
        quality: Quality {
            audit: energy::audit(&original, setup.masses, speed),
            notes: remarks.notes,
            warnings: remarks.warnings,
        },
        curves: RecordedCurves {
            force_kind: record.force_kind,
            sampled,
            closing_speed_m_per_s,
            unloading_stiffness_n_per_m: loading::unloading_stiffness(&original),
            original,
            contact_time_s: contact.time_s,
        },
        speed_is_decks: by == SpeedBy::Deck,
    })
}

fn filter(class: u32, record: &mut Record, remarks: &mut Notes) -> Result<(), ExtractError> {
    let filtered = cfc::filter(class, &record.time_s, &record.force_n)?;
    if filtered.resampled {
        remarks.note(format!(
            "filter: intervals differ by up to {:.1} %, so the force was filtered at their mean",
            filtered.spread * 100.0
        ));
    }
    record.force_n = filtered.values;
    Ok(())
}

/// By this share a force before the contact has changed the speed, if it is more than noise.
const SECOND_HIT: f64 = 0.05;
/// Most by which the work of a contact force may exceed the kinetic energy, as its ratio: crush zones of a tenth of the vehicle
/// and some more are stopped by it before the body is.
const MOST_CONTACT_WORK: f64 = 1.15;
/// Impulse and change of momentum that differ by no more than this share confirm the mass.
const MOMENTUM_AGREES: f64 = 0.02;

/// Notes on energy, impulse and the loading branch of a curve, whose states have these closing speeds in m/s.
fn audited(
    curve: &Curve,
    closing: &[f64],
    kind: ForceKind,
    balance: energy::EnergyBalance,
    remarks: &mut Notes,
) {
    let is_truncated = loading::loading_end(curve) + 1 == curve.time_s().len();
    if let (true, ForceKind::Contact, Some(work), Some(impulse)) =
        (is_truncated, kind, balance.work, balance.impulse)
    {
        // The crush zone has lost all of its speed, the body only a part: the earlier the record ends, the more that is
        // of the body's loss.
        let (first, last) = (closing[0], closing[closing.len() - 1]);
        let most = 1.0 + (MOST_CONTACT_WORK - 1.0) * first / (first - last);
        let is_usual = |ratio: f64| (1.0..=most).contains(&ratio);
        let is_more =
            work > 1.0 + EnergyAudit::TOLERANCE || impulse > 1.0 + energy::IMPULSE_TOLERANCE;
        if is_more && is_usual(work) && is_usual(impulse) {
            remarks.note(format!(
                "energy: up to the last state the contact force has {:.1} % of the energy and {:.1} % of the momentum that the body has lost: it stops the crush zone before the body",
                work * 100.0,
                impulse * 100.0
            ));
            return of_loading_branch(curve, remarks);
        }
    }
    if let Some(work) = balance.work.filter(|w| (w - 1.0).abs() > EnergyAudit::TOLERANCE) {
        let of = if is_truncated { " lost up to the last state" } else { "" };
        let share = work * 100.0;
        let is_contact = kind == ForceKind::Contact
            && !is_truncated
            && (1.0..=MOST_CONTACT_WORK).contains(&work);
        let agrees = |i: f64| (i - 1.0).abs() <= MOMENTUM_AGREES;
        if is_contact && balance.impulse.is_some_and(agrees) {
            remarks.note(format!(
                "energy: the work of the contact force is {share:.1} % of the kinetic energy, but its impulse equals the change of momentum: it stops the crush zone before the body"
            ));
        } else {
            remarks
                .warn(format!("energy: the curve absorbs {share:.1} % of the kinetic energy{of}"));
        }
    }
    if let Some(impulse) = balance.impulse.filter(|i| (i - 1.0).abs() > energy::IMPULSE_TOLERANCE) {
        remarks.warn(format!(
            "impulse: the force accounts for {:.1} % of the recorded change of momentum",
            impulse * 100.0
        ));
    }
    of_loading_branch(curve, remarks);
}

/// Notes on the loading branch of a curve, and whether it is whole.
fn of_loading_branch(curve: &Curve, remarks: &mut Notes) {
    if loading::loading_end(curve) + 1 == curve.time_s().len() {
        remarks.warn(
            "truncated: the maximum deflection is at the last state, so the record ends while loading",
        );
    }
    if let Ok(branch) = loading::loading_branch(curve)
        && branch.dropped > 0
    {
        remarks.note(format!(
            "loading branch: {} removed because the deflection did not advance",
            counted(branch.dropped, "sample")
        ));
    }
}

/// Choices that were made, and what the user should check.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Notes {
    /// Choices made, for the record.
    pub notes: Vec<String>,
    /// What the user should check.
    pub warnings: Vec<String>,
}

impl Notes {
    /// A single warning.
    pub(crate) fn warning(warning: String) -> Self {
        Self { notes: Vec::new(), warnings: vec![warning] }
    }

    /// Adds a note.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Adds a warning.
    pub(crate) fn warn(&mut self, warning: impl Into<String>) {
        self.warnings.push(warning.into());
    }

    /// Adds other remarks after these.
    pub(crate) fn append(&mut self, other: Self) {
        self.notes.extend(other.notes);
        self.warnings.extend(other.warnings);
    }
}

/// The histories of one run, in the solver's units.
pub struct Measured<'a> {
    /// Those of the solver files.
    pub units: UnitSystem,
    /// Of the recipe's node.
    pub displacement: &'a History,
    /// Of the node that is subtracted, if the recipe names one.
    pub minus_displacement: Option<&'a History>,
    /// Velocities of the same nodes, where the file has them.
    pub velocity: Option<&'a History>,
    /// Of the node that is subtracted.
    pub minus_velocity: Option<&'a History>,
    /// The force of the curve.
    pub force: MeasuredForce<'a>,
    /// Contact force that marks the start of contact for a body force.
    pub contact: Option<&'a History>,
}

/// The force, or what makes it.
pub enum MeasuredForce<'a> {
    /// The force on the obstacle.
    Contact(&'a History),
    /// Acceleration or velocity of the body's node, to be multiplied by its mass.
    Body(&'a History, RecordedMotion),
}

/// Settings of a run in the manifest.
#[derive(Clone)]
pub struct Setup<'a> {
    /// Of the force.
    pub filter: Filter,
    /// Common times.
    pub sampling: Sampling,
    /// What the speed is measured against.
    pub kind: SpeedKind,
    /// One of two identical bodies against the symmetry plane: closing speed and
    /// deflection are twice the run's.
    pub half_model: bool,
    /// Of the body, or of both bodies.
    pub masses: Masses,
    /// Of the run, if the manifest gives it.
    pub manifest_speed_m_per_s: Option<f64>,
    /// Of the run in m/s, if its deck gives it, of half a model the closing speed; with the name of the
    /// deck and the line of the velocity in it.
    pub deck_speed: Option<(f64, String)>,
    /// Share of the peak force above which a record is in contact.
    pub contact_threshold: f64,
    /// Whether the force that shows the contact is the central difference of an impulse.
    pub of_impulse: bool,
    /// Settings of the record in the run's entry.
    pub stated: Stated,
    /// Names and speeds of the study's other runs, to name what was mistaken for what.
    pub others: &'a (dyn Fn() -> Vec<(String, f64)> + Sync),
}

/// What a run's entry states of its record, in the place of what would be found in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stated {
    /// When contact begins.
    pub contact: Option<StatedContact>,
    /// Deflection at contact.
    pub offset_m: f64,
    /// Solver's time after which the record is not used.
    pub truncate_s: Option<f64>,
    /// 1 or −1: factor that makes the file's force positive in compression.
    pub force_sign: Option<f64>,
    /// Accept the run whatever its energy and impulse.
    pub accept_energy: bool,
}

/// Where contact begins by the manifest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StatedContact {
    /// At this time of the solver.
    Time {
        /// In s.
        s: f64,
    },
    /// When the bodies have moved by this from the first state.
    Gap {
        /// In m.
        m: f64,
    },
}

/// Reasons why a run has no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum ExtractError {
    /// A history has fewer than two states.
    #[error("{what} holds {}: at least 2 are needed", crate::words::counted(*states, "state"))]
    TooShort { origin: Origin, what: &'static str, states: usize },
    /// A value is not a finite number.
    #[error(
        "{what} of state {state} is {value}: expected a finite number; look for the problem with crumple inspect"
    )]
    NotFinite { origin: Origin, what: String, state: usize, value: f64 },
    /// The force never exceeds what counts as contact.
    #[error(
        "the force is never positive: there is no contact in this record; check id, component, sign and units"
    )]
    NoContact,
    /// Deflection and force have no common times.
    #[error("the histories of deflection and force have no time in common")]
    NoOverlap,
    /// A time of the manifest lies outside the record.
    #[error(
        "{key} = {at} lies outside the record, which runs from {first} to {last}",
        at = milliseconds(*time_s), first = milliseconds(*first_s), last = milliseconds(*last_s)
    )]
    OutsideRecord { key: &'static str, time_s: f64, first_s: f64, last_s: f64 },
    /// The bodies never close the gap that the manifest states.
    #[error(
        "gap = {gap_mm} mm is never closed: the bodies approach each other by at most {most_mm:.3} mm",
        gap_mm = gap_m * 1e3, most_mm = most_m * 1e3
    )]
    GapStaysOpen { gap_m: f64, most_m: f64 },
    /// The deflection never reaches the offset that the manifest states.
    #[error(
        "offset = {offset_mm} mm is never made up for: the deflection grows by {most_mm:.3} mm at most",
        offset_mm = offset_m * 1e3, most_mm = most_m * 1e3
    )]
    OffsetTooLarge { offset_m: f64, most_m: f64 },
    /// No crash can have such a curve.
    #[error("{0}")]
    ImpossibleRun(#[from] energy::ImpossibleRun),
    /// The motion of the body is prescribed, whatever the force.
    #[error(
        "{0}. No impact of this mass and speed has such a curve: write a table of deflection and force, which crumple histories gives, and add it with crumple db add"
    )]
    Prescribed(String),
    /// The deflection does not grow after contact.
    #[error("the deflection does not grow after contact: check node, component and direction")]
    NoDeflection,
    /// Neither manifest nor file contains the speed.
    #[error(
        "the study gives no speed and the file has no {component} to take it from: add speed = \"…km/h\""
    )]
    NoSpeed { component: String },
    /// The body does not move in the first state.
    #[error(
        "the body is at rest in the first state: name a node of the moving body, or add speed = \"…km/h\" to the run"
    )]
    Standing,
    /// The force cannot be filtered.
    #[error("{0}")]
    Filter(#[from] cfc::CfcError),
    /// The columns are not a curve.
    #[error("{0}")]
    Curve(#[from] Error),
}

impl ExtractError {
    /// Whether it speaks of the force's file rather than of the motion's.
    pub(crate) fn is_of_force(&self) -> bool {
        match self {
            Self::TooShort { origin, .. } | Self::NotFinite { origin, .. } => {
                *origin == Origin::Force
            }
            Self::NoContact | Self::Filter(_) | Self::ImpossibleRun(_) => true,
            _ => false,
        }
    }
}

/// The history that an error speaks of, by its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    Motion,
    Force,
}
