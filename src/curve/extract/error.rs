//! Why a run gives no curve.

use crate::curve::contact::milliseconds;
use crate::curve::energy;
use crate::error::Error;
use crate::signal::cfc;

/// Reasons why a run has no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum ExtractError {
    /// A history has fewer than two states.
    #[error("{what} holds {}: at least 2 are needed", crate::plural::counted(*states, "state"))]
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
        "{0}. No impact of this mass and speed has such a curve; crumple histories writes its force and displacement"
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
