//! The input of an extraction: the run's histories, and its settings in the manifest.

use crate::curve::Masses;
use crate::curve::recipe::{Filter, RecordedMotion, Sampling};
use crate::history::History;
use crate::unit::{SpeedKind, UnitSystem};

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
#[derive(Clone, Debug)]
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
    /// Of the run, if its deck gives it.
    pub deck_speed: Option<DeckSpeed>,
    /// Share of the peak force above which a record is in contact.
    pub contact_threshold: f64,
    /// Settings of the record in the run's entry.
    pub stated: Stated,
    /// Names and speeds of the study's other runs, to name what was mistaken for what.
    pub others: &'a [(String, f64)],
}

/// The impact speed of a run's deck.
#[derive(Clone, Debug, PartialEq)]
pub struct DeckSpeed {
    /// In m/s; of half a model the closing speed.
    pub m_per_s: f64,
    /// Name of the deck and line of the velocity in it.
    pub place: String,
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
