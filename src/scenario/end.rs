//! Ends of vehicles from models: crush force, rate and stopped mass at one end, and the plates
//! that meet.
//!
//! Models give speed and deflection against a wall, or of two equal ends together. An end takes
//! half of the deflection of two, twice their reduced stopped mass, and twice their stiffness.

use std::sync::Arc;

use super::layout::{Connection, End, Role};
use crate::curve::{CurveUnloading, Envelope, ForceCurve};
use crate::error::{Error, ErrorCode, error};
use crate::multibody::{
    Damping, EnvelopeEnd, ForceLaw, Interface, RateFactor, Stopping, Unloading,
};
use crate::surrogate::crush_law::{CrushCurve, CrushLaw, per_crush_force};
use crate::surrogate::{Model, QueryPoint};
use crate::unit::SpeedKind;

/// Stiffness and damping between two plates, or a plate and the wall: ten times as stiff as any end
/// we have seen, so that little of the crush is theirs, and damped enough not to ring.
const PLATES_N_PER_M: f64 = 5e9;
const PLATES_N_S_PER_M: f64 = 3e5;

/// A crush force as the chain takes it, with its warnings.
pub(super) struct Crush {
    /// Loads from (0, 0); of an end over its own deflection.
    pub curve: ForceCurve,
    pub rate: RateFactor,
    /// Of an end; between vehicles of one mass the curve contains it.
    pub stopping: Option<Stopping>,
    /// Speed at which the model was evaluated, in m/s of its kind.
    pub speed_m_per_s: f64,
    pub warnings: Vec<String>,
}

/// How an end counts what its model counts: two ends together, or one.
struct EndScaling {
    /// Model's deflection per deflection of the end.
    deflection: f64,
    /// Model's speed per closing speed of the two vehicles.
    speed: f64,
}

impl EndScaling {
    fn of(kind: SpeedKind, at: Role) -> Self {
        let against_wall = at == Role::Wall;
        match kind {
            SpeedKind::Wall => {
                Self { deflection: 1.0, speed: if against_wall { 1.0 } else { 0.5 } }
            }
            SpeedKind::Closing => {
                Self { deflection: 2.0, speed: if against_wall { 2.0 } else { 1.0 } }
            }
        }
    }

    /// The envelope over the deflection of the end, with values times `factor`.
    fn per_end(&self, of_model: &Envelope, factor: f64) -> Result<Envelope, Error> {
        let d = of_model.deflection_m().iter().map(|d| d / self.deflection).collect();
        let f = of_model.force_n().iter().map(|f| f * factor).collect();
        Envelope::new(d, f).map_err(below)
    }
}

fn below(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::below(ErrorCode::Scenario, error)
}

/// Least share of the give of end and plates together that is the end's.
const MIN_END_COMPLIANCE_SHARE: f64 = 0.1;

/// The end of a vehicle whose neighbours close at `closing_m_per_s`.
pub(super) fn crush_end(
    model: &Model,
    end: &End<'_>,
    closing_m_per_s: f64,
    scale: f64,
) -> Result<Crush, Error> {
    let coordinates = EndScaling::of(model.speed_kind, end.at);
    let speed_m_per_s = coordinates.speed * closing_m_per_s;
    let (law, at) = crush_curve(model, speed_m_per_s)?;
    let loading = coordinates.per_end(&at.standing_n, scale)?;
    let stopped_kg = coordinates.per_end(&at.stopped_kg, coordinates.deflection)?;
    let stiffness = model.unloading_n_per_m(speed_m_per_s);
    // The plates give way, too: half as much for each of two ends.
    let plates_m_per_n = if end.at == Role::Wall { 1.0 } else { 0.5 } / PLATES_N_PER_M;
    let of_end = |k: f64| {
        let m_per_n = 1.0 / (k * coordinates.deflection * scale);
        1.0 / (m_per_n - plates_m_per_n).max(MIN_END_COMPLIANCE_SHARE * m_per_n)
    };
    let unloading = CurveUnloading::of(stiffness.map(of_end));
    let mut warnings = warnings(model, speed_m_per_s);
    if model.speed_kind == SpeedKind::Wall && end.at != Role::Wall {
        warnings.push(
            "its runs hit a wall: between two vehicles each end is taken to load as against a wall at half their closing speed".into(),
        );
    }
    Ok(Crush {
        curve: ForceCurve {
            unloading,
            data_end_m: Some(model.largest_crush_m() / coordinates.deflection),
            ..ForceCurve::bare(loading)
        },
        rate: RateFactor {
            sensitivity_sqrt_s_per_m: law.sensitivity,
            share: coordinates.speed,
            behind: end.behind,
            ahead: end.ahead,
        },
        stopping: Some(Stopping {
            body: end.body,
            zone: end.zone,
            stopped_kg: Arc::new(stopped_kg),
        }),
        speed_m_per_s,
        warnings,
    })
}

/// The crush force between two vehicles of one mass, or one and the wall, that close at
/// `speed_m_per_s`: each is moved by `F_f M/(M − m_s)`.
pub(super) fn crush_between(
    model: &Model,
    slot: &Connection<'_>,
    (behind, ahead): (usize, Option<usize>),
    speed_m_per_s: f64,
    scale: f64,
) -> Result<Crush, Error> {
    let (law, at) = crush_curve(model, speed_m_per_s)?;
    // Of two equal masses half is what moves along their deflection.
    let moved_kg = if slot.role == Role::Wall { slot.mass_kg } else { 0.5 * slot.mass_kg };
    let factor = |d: f64| per_crush_force(at.stopped_kg.force_at(d), moved_kg);
    let deflection_m = at.standing_n.deflection_m().to_vec();
    let points = deflection_m.iter().zip(at.standing_n.force_n());
    let force_n = points.map(|(&d, f)| f * scale * factor(d)).collect();
    let stiffness = model.unloading_n_per_m(speed_m_per_s).map(|k| k * scale);
    let unloading = CurveUnloading::of(stiffness);
    let curve = ForceCurve::bare(Envelope::new(deflection_m, force_n).map_err(below)?);
    let sensitivity_sqrt_s_per_m = law.sensitivity;
    Ok(Crush {
        curve: ForceCurve { unloading, data_end_m: Some(model.largest_crush_m()), ..curve },
        rate: RateFactor { sensitivity_sqrt_s_per_m, share: 1.0, behind, ahead },
        stopping: None,
        speed_m_per_s,
        warnings: warnings(model, speed_m_per_s),
    })
}

fn crush_curve(model: &Model, speed_m_per_s: f64) -> Result<(&CrushLaw, CrushCurve), Error> {
    model.crush_curve(speed_m_per_s).ok_or_else(|| {
        error!(
            Scenario at "model",
            "its group \"{}\" has no crush law for the end of a vehicle: expected contact forces and speeds of two or more runs that differ in speed alone, against a wall or between equal masses; give front and rear a mass and a curve",
            model.group
        )
    })
}

fn warnings(model: &Model, speed_m_per_s: f64) -> Vec<String> {
    let mass_kg = model.mass_kg;
    let point = QueryPoint { speed_m_per_s, features: &[], mass_kg, closing_m_per_s: None };
    model.warnings(&point).iter().map(std::string::ToString::to_string).collect()
}

/// The interface of two plates that meet after `gap_m`.
pub(super) fn plates(name: &str, gap_m: f64) -> Result<Interface, Error> {
    let spring = Envelope::new(vec![0.0, 1.0], vec![0.0, PLATES_N_PER_M]).map_err(below)?;
    let law = ForceLaw::new(spring, Unloading::Elastic, EnvelopeEnd::Slope);
    let damping = Damping::constant(PLATES_N_S_PER_M).map_err(below)?;
    Ok(Interface::new(name, law, gap_m).with_damping(damping))
}
