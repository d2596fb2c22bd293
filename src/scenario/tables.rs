//! The tables of a scenario (TOML).

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

use crate::curve::{ForceKind, Parameter};
use crate::multibody::{EnvelopeEnd, Method, Resistance};
use crate::plan::Plan;
use crate::surrogate::max_crush::MaxCrushRule;
use crate::unit::{
    ForceText, ImpactSpeedText, LengthText, MassText, SignedSpeedText, StiffnessText, TimeText,
    UnitSystem,
};

/// A scenario as written.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Times of the run.
    pub(crate) run: RunTable,
    /// Curves, used below by name.
    pub(crate) curves: BTreeMap<String, CurveTable>,
    /// The moving train, then the one it meets, if any.
    pub(crate) train: Vec<TrainTable>,
    /// A rigid wall in place of a second train.
    pub(crate) wall: Option<WallTable>,
    /// Between the two noses, or nose and wall.
    pub(crate) contact: ContactTable,
    /// Limits that results are compared with.
    pub(crate) limits: Option<LimitsTable>,
    /// FE's run of the whole, for `crumple compare --train`; a run takes no notice of it.
    pub(crate) reference: Option<ReferenceTable>,
    /// What `crumple sweep` varies; a single run takes no notice of it.
    pub(crate) sweep: Option<Plan>,
}

/// Limits of a standard, as configuration: they belong to an edition and a category of vehicles.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct LimitsTable {
    /// Such as "EN 15227".
    pub(crate) standard: String,
    /// Such as "2020+A1:2024".
    pub(crate) edition: String,
    /// Of the mean decelerations of the first contact and of the one that changes the speed most, in g.
    pub(crate) mean_deceleration_g: f64,
    /// Limit of the speed at which an unrestrained occupant meets the interior after 0.6 m.
    pub(crate) secondary_impact: Option<ImpactSpeedText>,
    /// Limit of the occupant load criterion, in g.
    pub(crate) occupant_load_g: Option<f64>,
    /// Trains whose vehicles (without crush zones that are masses of their own) are compared with
    /// them, by name; all if absent.
    pub(crate) trains: Option<Vec<String>>,
}

/// Where FE's speeds of the vehicles are.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ReferenceTable {
    /// Solver file with the nodes, such as a nodout, a binout or a T01; a case.json next to it says how long FE
    /// took.
    pub(crate) file: PathBuf,
    /// Units of the file, such as "mm-t-s".
    #[cfg_attr(test, schemars(with = "String"))]
    pub(crate) units: UnitSystem,
    /// Component of the nodes, `x_velocity` if absent.
    #[serde(default = "x_velocity")]
    pub(crate) component: String,
    /// Node of each vehicle, by the vehicle's name.
    pub(crate) nodes: BTreeMap<String, i64>,
    /// FE's time of the first contact; 0 if absent.
    pub(crate) contact: Option<TimeText>,
    /// The comparison ends here, counted from the contact; with the record if absent.
    pub(crate) until: Option<TimeText>,
}

fn x_velocity() -> String {
    "x_velocity".into()
}

/// Times of the run.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RunTable {
    /// From the first contact; the last output is the last whole output_interval in it.
    pub(crate) duration: TimeText,
    /// Of the recorded states; 0.75 ms if absent.
    #[serde(default = "default_interval")]
    pub(crate) output_interval: TimeText,
    /// Longest integration step.
    pub(crate) step: Option<TimeText>,
    /// How the motion is integrated.
    #[serde(default)]
    pub(crate) method: Method,
    /// Which speed an interface's model curve is predicted for; `local` if absent.
    #[serde(default)]
    pub(crate) interface_speed: InterfaceSpeed,
}

/// 0.75 ms, as in the reference data.
fn default_interval() -> TimeText {
    TimeText(0.75e-3)
}

/// Which speed an interface's model curve is predicted for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum InterfaceSpeed {
    /// The speed at which the trains meet.
    Train,
    /// The interface's own closing speed: the largest from the contact to the first peak of the force.
    #[default]
    Local,
}

/// One curve: exactly one of `model`, `file`, `database` and `stages`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CurveTable {
    /// Model file; the curve is predicted for the speed of the interface.
    pub(crate) model: Option<PathBuf>,
    /// Curve file: predicted curve (JSON), table (CSV), or any other format of `crumple db add --list`.
    pub(crate) file: Option<PathBuf>,
    /// Of a file that does not state its units, such as "mm-t-s".
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub(crate) units: Option<UnitSystem>,
    /// Of a file of several curves: number or name of the one to use.
    pub(crate) curve: Option<String>,
    /// Curve database, with `case`.
    pub(crate) database: Option<PathBuf>,
    /// Case of the database, as "group/case".
    pub(crate) case: Option<String>,
    /// Stages in series on one stroke, such as those of a coupler, the first one first.
    pub(crate) stages: Option<Vec<StageTable>>,
    /// Unloading stiffness; the curve's own if absent.
    pub(crate) unloading: Option<StiffnessText>,
    /// Free distance before contact: between the surfaces that meet, so between mid-surfaces of
    /// meshed plates less half of both thicknesses.
    pub(crate) gap: Option<LengthText>,
    /// Name of the curve of the extension, for coupled vehicles; its gap is the slack. It counts from the initial distance, also
    /// after a crush.
    pub(crate) tension: Option<String>,
    /// Damper in parallel with the curve. It acts while the curve is in contact (also at zero force, but
    /// not in a gap left by earlier crush), and only pushes. With a tension curve it acts along both and
    /// may pull.
    pub(crate) damping: Option<DampingTable>,
    /// Force law.
    #[serde(default)]
    pub(crate) law: LawName,
    /// What the force does beyond the curve. Default: `bottom`, as exports do, for curves of models,
    /// predicted curves and database cases; `hold` for others.
    pub(crate) end: Option<EnvelopeEnd>,
    /// Of a model: the rule for the maximum crush; the model's own if absent.
    #[serde(default)]
    pub(crate) max_crush: Option<MaxCrushRule>,
    /// Of a model: values of its further parameters.
    #[serde(default)]
    pub(crate) parameters: BTreeMap<String, Parameter>,
    /// Of a model, predicted curve or database case: the force that is taken; if absent the
    /// one that the vehicles need (body force for one mass, contact force for split ones). Of a CSV file that does not state it: the force that it
    /// holds; if absent the body force, with a warning.
    pub(crate) force: Option<ForceKind>,
    /// Of a model or predicted curve: member of the band of the force that is taken, from −1
    /// (lower edge) through 0 (the curve) to 1 (upper edge).
    pub(crate) band: Option<f64>,
    /// Factor on the force, and on the curve's own unloading stiffness.
    pub(crate) scale: Option<f64>,
}

/// A stage of a staged curve.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct StageTable {
    /// For people, such as "deformation tube".
    pub(crate) name: Option<String>,
    /// Length of the stage.
    pub(crate) stroke: LengthText,
    /// Force at the start of the stage, 0 if absent: it steps there from the stage before, over 0.1 mm.
    pub(crate) from: Option<ForceText>,
    /// Force at its end; the same as at its start if absent.
    pub(crate) to: Option<ForceText>,
}

/// A damper's coefficient over the magnitude of the closing speed, piecewise linear and held
/// beyond its ends; one pair of values for a constant one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DampingTable {
    /// Closing speeds, increasing; 0 if absent.
    #[serde(default = "zero")]
    pub(crate) speed_m_per_s: Vec<f64>,
    /// The coefficient at each.
    #[serde(rename = "coefficient_N_s_per_m")]
    pub(crate) coefficient_n_s_per_m: Vec<f64>,
}

fn zero() -> Vec<f64> {
    vec![0.0]
}

/// Force law of an interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum LawName {
    /// Elastic-plastic: unloads on a line of the unloading stiffness, or a steeper one, so that energy once dissipated never comes back.
    #[default]
    Memory,
    /// Follows the curve back, as in the reference model.
    Elastic,
    /// Of a model: its crush force `Q(d; v) (1 + β√u)`, which follows the closing speed `u` in the
    /// run, and unloads like `memory`.
    Rate,
}

/// A train.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainTable {
    /// Of the train, such as "A".
    pub(crate) name: String,
    /// In the direction in which the first train moves; below 0 if it moves against it.
    pub(crate) speed: SignedSpeedText,
    /// Curve of the interfaces between its vehicles; not needed where both facing ends come from a
    /// model.
    pub(crate) inner: Option<String>,
    /// Clear distance between its vehicles before contact: between the surfaces that meet, so
    /// between mid-surfaces of meshed plates less half of both thicknesses; the curve's own if
    /// absent.
    pub(crate) gap: Option<LengthText>,
    /// Running and braking resistance of its vehicles; none if absent.
    pub(crate) resistance: Option<Resistance>,
    /// From the nose back.
    pub(crate) vehicles: Vec<VehicleTable>,
}

/// A vehicle.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct VehicleTable {
    /// Of the vehicle, as in the results.
    pub(crate) name: String,
    /// Of the whole vehicle.
    pub(crate) mass: MassText,
    /// Curve of the interface behind it, in place of the train's `inner`.
    pub(crate) behind: Option<String>,
    /// Clear distance behind it, in place of the train's `gap`.
    pub(crate) gap: Option<LengthText>,
    /// Model of both of its ends, but for one that `front` or `rear` describes: the crush force between crush zone and
    /// body, and the mass that is stopped.
    pub(crate) ends: Option<String>,
    /// The crush zone at its front (the end towards the train's nose), as a body of its own.
    pub(crate) front: Option<CrushZoneTable>,
    /// The same at its rear.
    pub(crate) rear: Option<CrushZoneTable>,
}

impl VehicleTable {
    /// Its ends that are crush zones, `front` before `rear`.
    pub(crate) fn zones(&self) -> impl Iterator<Item = CrushZone<'_>> {
        self.front_zone().into_iter().chain(self.rear_zone())
    }

    /// The end towards the train's nose, if it is a crush zone.
    pub(crate) fn front_zone(&self) -> Option<CrushZone<'_>> {
        self.zone("front", self.front.as_ref())
    }

    /// The other end.
    pub(crate) fn rear_zone(&self) -> Option<CrushZone<'_>> {
        self.zone("rear", self.rear.as_ref())
    }

    fn zone<'a>(
        &'a self,
        end: &'static str,
        table: Option<&'a CrushZoneTable>,
    ) -> Option<CrushZone<'a>> {
        let of_table = |t: &'a CrushZoneTable| (t.curve.as_str(), t.mass.map(|m| m.0));
        let (curve, mass_kg) = table.map(of_table).or(self.ends.as_deref().map(|c| (c, None)))?;
        Some(CrushZone { end, curve, mass_kg })
    }

    /// Mass without the crush zones that have one of their own, in kg.
    pub(crate) fn body_mass_kg(&self) -> f64 {
        self.mass.0 - self.zones().filter_map(|zone| zone.mass_kg).sum::<f64>()
    }
}

/// An end of a vehicle whose crush zone is a body of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CrushZone<'a> {
    /// `front` or `rear`.
    pub(crate) end: &'static str,
    /// Curve between it and the body.
    pub(crate) curve: &'a str,
    /// `None` if a model knows what is stopped.
    pub(crate) mass_kg: Option<f64>,
}

impl CrushZone<'_> {
    /// Whether a model knows its mass.
    pub(crate) fn is_of_model(&self) -> bool {
        self.mass_kg.is_none()
    }
}

/// A mass split off a vehicle's end: the spring of `curve` lies between it and the body.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CrushZoneTable {
    /// Part of the vehicle's mass. If absent, the curve is a model, which determines how much
    /// mass the crush zone stops.
    pub(crate) mass: Option<MassText>,
    /// Curve between it and the body.
    pub(crate) curve: String,
}

/// A rigid wall.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct WallTable {
    /// As in the results.
    #[serde(default = "wall_name")]
    pub(crate) name: String,
}

fn wall_name() -> String {
    "wall".into()
}

/// The first contact.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactTable {
    /// Name of its curve; not needed where the noses come from models.
    pub(crate) curve: Option<String>,
    /// Free distance between the surfaces before contact; the curve's own if absent.
    pub(crate) gap: Option<LengthText>,
}
