//! Errors of the spring and damper: what is wrong with a motion, a law or the settings of a fit.

use super::{FEWEST_SAMPLES, MAX_POPULATION};

/// Why there is no target, law, motion or fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NsdmError {
    /// Too few samples.
    #[error("a motion needs at least {FEWEST_SAMPLES} samples, found {samples}")]
    TooShort {
        /// Number of samples.
        samples: usize,
    },
    /// Columns that differ in length.
    #[error(
        "columns differ in length: {time} times, {velocity} velocities, {acceleration} accelerations"
    )]
    Lengths {
        /// Number of times.
        time: usize,
        /// Number of velocities.
        velocity: usize,
        /// Number of accelerations.
        acceleration: usize,
    },
    /// A value that is not finite.
    #[error("the {column} of sample {sample} is {value}: expected a finite number")]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// Counted from 1.
        sample: usize,
        /// Its value.
        value: f64,
    },
    /// A time that does not increase.
    #[error("time does not increase at sample {sample}: {time_s} s follows {before_s} s")]
    TimeOrder {
        /// Counted from 1.
        sample: usize,
        /// Time in s.
        time_s: f64,
        /// Time of the sample before, in s.
        before_s: f64,
    },
    /// A time below 0.
    #[error("the first time is {time_s} s: times count from contact, so expected 0 or more")]
    BeforeContact {
        /// Time in s.
        time_s: f64,
    },
    /// A gap between two times that is too long to be in seconds.
    #[error(
        "no sample for {interval_s} s before {time_s} s, too long to follow: expected times in seconds"
    )]
    Interval {
        /// Length of the gap in s.
        interval_s: f64,
        /// Time at its end, in s.
        time_s: f64,
    },
    /// A mass or speed that is not above 0.
    #[error("the {what} is {value}: expected a finite number above 0")]
    NotPositive {
        /// Which quantity.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The reference never moves forwards.
    #[error("the reference never moves forwards: is the velocity positive at contact?")]
    NoDisplacement,
    /// Nodes and values that differ in number, or fewer than two.
    #[error(
        "a law needs a value at each of at least 2 nodes, found {nodes} nodes and {values} values"
    )]
    NodeCount {
        /// Number of nodes.
        nodes: usize,
        /// Number of values.
        values: usize,
    },
    /// A node or value that breaks the invariant of a law.
    #[error(
        "node {node} of a law is ({at}, {value}): expected nodes that increase from 0 and values of 0 or more, all finite"
    )]
    Node {
        /// Counted from 1.
        node: usize,
        /// Where it is, in m or m/s.
        at: f64,
        /// Its value.
        value: f64,
    },
    /// A motion that is not finite.
    #[error("the motion of {mass_kg} kg is not finite: it is too light for this spring or damper")]
    Diverged {
        /// Mass in kg.
        mass_kg: f64,
    },
    /// A population out of range.
    #[error("the population is {population}: expected 4 to {MAX_POPULATION}")]
    Population {
        /// Individuals of a generation.
        population: usize,
    },
    /// Too many generations.
    #[error("{count} generations: expected fewer than 2^32")]
    Generations {
        /// Number of generations.
        count: usize,
    },
    /// A weight of the velocity below 0.
    #[error(
        "the weight of the velocity is {weight_per_s2} 1/s²: expected a finite number of 0 or more"
    )]
    Weight {
        /// Weight in 1/s².
        weight_per_s2: f64,
    },
    /// Too few fits to show a spread.
    #[error("{seeds} fits show no spread: at least {fewest} seeds are needed")]
    Seeds {
        /// Number of fits.
        seeds: usize,
        /// Number that is needed.
        fewest: usize,
    },
}
