//! What the chosen histories of a run say in SI: speed, crush, times, masses.

use super::Proposed;
use super::agree::Agreed;
use super::given::UserHints;
use super::masses::{MassEstimates, is_near};
use super::propose::Recorded;
use super::record::{RawMasses, Record};
use super::sampling::{Times, interval};
use super::units::Magnitudes;
use crate::curve::contact;
use crate::signal::integral;
use crate::unit::UnitSystem;

/// Speeds that differ by less are one.
pub(super) const SAME_SPEED: f64 = 0.01;

/// All runs of a proposal with what they have in common.
pub(super) struct Measured<'a> {
    pub agreed: &'a Agreed,
    pub recorded: &'a [Recorded],
    /// As many as were recorded, or none if the units are not known.
    pub runs: &'a [SiRun<'a>],
    pub(crate) units: &'a Proposed<UnitSystem>,
}

pub(super) struct SiRun<'a> {
    pub recorded: &'a Recorded,
    /// Closing speed before the contact, twice the run's for half a model.
    pub speed_m_per_s: f64,
    /// The state that it is taken from, and its time.
    pub state: (usize, f64),
    pub crush_m: f64,
    pub times: Times,
    pub body: MassEstimates,
    pub other: Option<MassEstimates>,
    /// Times and values of the force, positive in compression.
    pub force: Option<(Vec<f64>, Vec<f64>)>,
}

impl Record {
    /// What depends on the units.
    pub(super) fn magnitudes(&self) -> Magnitudes {
        let (begin, end) = (self.contact(), self.loading_end().unwrap_or(self.time.len() - 1));
        Magnitudes {
            speed: self.closing(0),
            crush: (self.travel[end] - self.travel[begin.min(end)]).abs(),
            loading_time: self.time[end] - self.time[begin.min(end)],
            mass: self.masses().map(|masses| masses.body),
        }
    }
}

impl<'a> SiRun<'a> {
    pub(super) fn of(recorded: &'a Recorded, units: UnitSystem, given: &UserHints) -> Self {
        let record = &recorded.record;
        let bodies = if given.half_model { 2.0 } else { 1.0 };
        let time_s: Vec<f64> = record.time.iter().map(|t| t * units.time_s).collect();
        let force = record.force.as_ref().map(|force| in_si(force, units));
        let contact_s = force.as_ref().and_then(|(time_s, force_n)| {
            let threshold_n = contact::threshold_n(force_n);
            Some(contact::onset(time_s, force_n, threshold_n)?.time_s)
        });
        let contact_s = contact_s.unwrap_or(time_s[0]).max(time_s[0]);
        let before = time_s.partition_point(|&t| t <= contact_s).saturating_sub(1);
        // The first velocities are the deck's; where they have changed by the contact, these count.
        let is_kept = is_near(record.closing(0), record.closing(before), SAME_SPEED);
        let state = if is_kept { 0 } else { before };
        let end = record.loading_end().unwrap_or(time_s.len() - 1);
        let crush = (record.travel[end] - record.travel[before.min(end)]).abs();
        let (momentum, energy) = (record.masses(), record.masses_by_energy());
        // A kinetic energy has the unit of mass times speed squared.
        let weighed = |of: fn(&RawMasses) -> Option<f64>| MassEstimates {
            by_momentum: momentum.as_ref().and_then(of).map(|mass| mass * units.mass_kg),
            in_free_flight: momentum.is_some_and(|masses| masses.in_free_flight),
            by_energy: energy.as_ref().and_then(of).map(|mass| mass * units.mass_kg),
        };
        let of_force = force.as_ref().map(|(time_s, _)| interval(time_s));
        Self {
            recorded,
            speed_m_per_s: bodies * record.closing(state) * units.speed(),
            state: (state, time_s[state]),
            crush_m: bodies * crush * units.length_m,
            times: Times {
                contact_s,
                last_s: time_s[time_s.len() - 1],
                interval_s: of_force.unwrap_or_else(|| interval(&time_s)),
                states: record.states,
            },
            body: weighed(|masses| Some(masses.body)),
            other: record.velocities.get(1).map(|_| weighed(|masses| masses.other)),
            force,
        }
    }
}

/// Times in s and forces in N, turned so that their impulse is positive.
fn in_si((time, force): &(Vec<f64>, Vec<f64>), units: UnitSystem) -> (Vec<f64>, Vec<f64>) {
    let time_s: Vec<f64> = time.iter().map(|t| t * units.time_s).collect();
    let sign = match integral(time, force).last() {
        Some(impulse) if *impulse < 0.0 => -1.0,
        _ => 1.0,
    };
    (time_s, force.iter().map(|f| sign * f * units.force()).collect())
}
