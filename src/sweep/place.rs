//! Which key of a plan an error is about.

use super::variables::{BindError, VariableError};
use crate::manifest::KeyPath;
use crate::plan::{DistributionError, Plan, PlanError, VaryError, What};

fn sweep(key: &str) -> KeyPath {
    KeyPath::of("sweep").key(key)
}

/// The key that tells why a plan cannot be carried out.
pub(super) fn key(plan: &Plan, error: &BindError) -> KeyPath {
    match error {
        BindError::Nothing => KeyPath::of("sweep"),
        BindError::Results => sweep("results"),
        BindError::Plan(PlanError::SamplingUnused) => sweep("sampling"),
        BindError::Plan(PlanError::TooMany { .. }) if plan.samples.is_none() => sweep("vary"),
        BindError::Plan(_) => sweep("samples"),
        BindError::Variable { number, source, what } => {
            let vary = sweep("vary").item(number - 1);
            match of_variable(source, *what) {
                Some(Key::Value(key)) => vary.key(key),
                Some(Key::Itself(key)) => vary.key(key).itself(),
                None => vary,
            }
        }
    }
}

/// A key of a variable: what it has, or that it is there at all.
enum Key {
    Value(&'static str),
    Itself(&'static str),
}

fn of_variable(error: &VariableError, what: What) -> Option<Key> {
    use Key::{Itself, Value};
    use VariableError as E;
    Some(match error {
        E::Spread(error) => return of_spread(error),
        E::Twice { .. } | E::NoTrain | E::NoCurve | E::NoVehicle | E::NoGapNamed => return None,
        E::Unknown { what: "vehicle", .. } | E::Vehicles { .. } | E::VehicleTwice { .. } => {
            Value(if matches!(error, E::Unknown { listed: false, .. }) {
                "vehicle"
            } else {
                "vehicles"
            })
        }
        E::Unknown { what: "train", .. } => Value("train"),
        E::Unknown { listed: true, .. } => Value("values"),
        E::Unknown { .. } => Value("curve"),
        E::Key { key, .. } => Itself(key),
        E::NoGap { .. } | E::NoContactGap => Value("factor"),
        E::Interface { .. } => Value("interface"),
        E::Name { .. } => match what {
            What::Speed => Value("train"),
            What::Mass => return None,
            _ => Value("curve"),
        },
        E::ZoneGap { .. } | E::GapUnused { .. } | E::NoBand { .. } | E::CurveUnused { .. } => {
            Value("curve")
        }
    })
}

fn of_spread(error: &VaryError) -> Option<Key> {
    use Key::{Itself, Value};
    Some(match error {
        VaryError::NoValues => Value("values"),
        VaryError::Steps { .. } => Value("steps"),
        VaryError::Together { key, .. } => Itself(key),
        VaryError::Unit { key, .. }
        | VaryError::NoNumber { key, .. }
        | VaryError::Range { key, .. } => Value(key),
        VaryError::Missing { .. } => Value("distribution"),
        VaryError::CurveValues | VaryError::NoSpread => return None,
        VaryError::Distribution(error) => Value(match error {
            DistributionError::Ends => "to",
            DistributionError::Triangle => "mode",
            DistributionError::Bounds => "max",
            DistributionError::Deviation => "sd",
            DistributionError::NotPositive | DistributionError::NothingLeft => "distribution",
        }),
    })
}
