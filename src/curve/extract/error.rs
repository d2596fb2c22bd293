//! Why a run gives no curve.

use crate::curve::contact::milliseconds;
use crate::curve::{CurveError, energy};
use crate::signal::cfc;

/// Why a run gives no curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a variant is its message, a field what that says")]
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

impl ExtractError {
    /// Whether it speaks of the force's file rather than of the motion's.
    pub(crate) fn is_of_force(&self) -> bool {
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
    /// The file of the deflection.
    Motion,
    /// The file of the force.
    Force,
}
