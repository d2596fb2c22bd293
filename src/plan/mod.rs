//! Plan of a sweep (TOML): what is varied, over which values or distribution.
//!
//! The names in it are resolved by the scenario; here numbers get their units and
//! item `k` its values.

pub(crate) mod draw;

use serde::Deserialize;

use crate::error::{Error, error};
use crate::unit::{LENGTH, MASS, SPEED, TextVisitor};
use draw::Distribution;

/// More items than any cluster could run; keeps a mistyped number from passing.
pub(crate) const MAX_ITEMS: u64 = 1_000_000_000_000;

/// A `--plan` file: the `[sweep]` table by itself.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PlanFile {
    /// What is varied.
    pub(crate) sweep: Plan,
}

/// The `[sweep]` table: many runs of one scenario.
///
/// Variables with `values` or `steps` form a grid: all combinations, the last one listed
/// changing fastest. Variables with a `distribution` are drawn `samples` times at each point
/// of the grid.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Plan {
    /// Of the random draws; 0 if absent.
    #[serde(default)]
    pub(crate) seed: u64,
    /// Draws at each point of the grid; needed if a variable has a distribution.
    pub(crate) samples: Option<u64>,
    /// How distributions are drawn.
    #[serde(default)]
    pub(crate) sampling: Sampling,
    /// Results to keep; from `peak_force` to `momentum_error` if absent.
    pub(crate) results: Option<Vec<ResultName>>,
    /// What is varied, in the order of the columns.
    pub(crate) vary: Vec<Vary>,
}

/// How distributions are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum Sampling {
    /// Each draw by itself (Monte Carlo).
    #[default]
    Random,
    /// One draw in each of as many equally likely ranges as there are samples, for every
    /// variable.
    LatinHypercube,
}

/// A result of each run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum ResultName {
    /// Of each interface.
    PeakForce,
    /// Of each interface.
    MaxDeflection,
    /// Of each interface.
    MaxDeflectionTime,
    /// Of each interface.
    Restitution,
    /// Of each body.
    FinalSpeed,
    /// Of each body.
    MeanDeceleration,
    /// Of the run.
    EnergyError,
    /// Of the run.
    MomentumError,
    /// Of each body: over 120 ms.
    MovingMeanDeceleration,
    /// Of each body: over the contact that changes its speed most.
    MainMeanDeceleration,
    /// Of each vehicle: speed of an unrestrained occupant after 0.6 m.
    SecondaryImpact,
    /// Of each vehicle: occupant load criterion.
    OccupantLoad,
    /// Of each interface: energy that it has taken.
    Energy,
    /// Of the run: 1 if a vehicle is over a limit of the scenario, else 0; no value if that is not known.
    OverLimits,
}

/// The column of [`ResultName::OverLimits`].
pub(crate) const OVER_LIMITS: &str = "over_limits";

/// Results that are written if none are named, the first of [`RESULTS`].
pub(crate) const USUAL_RESULTS: usize = 8;

/// All results in the order of their columns, each with what these begin with: the quantity of a single run.
pub(crate) const RESULTS: [(ResultName, &str); 14] = [
    (ResultName::PeakForce, "peak_force_N"),
    (ResultName::MaxDeflection, "max_deflection_m"),
    (ResultName::MaxDeflectionTime, "max_deflection_time_s"),
    (ResultName::Restitution, "restitution"),
    (ResultName::FinalSpeed, "final_v_m_per_s"),
    (ResultName::MeanDeceleration, "mean_deceleration_m_per_s2"),
    (ResultName::EnergyError, "energy_error"),
    (ResultName::MomentumError, "momentum_error"),
    (ResultName::MovingMeanDeceleration, "moving_mean_deceleration_m_per_s2"),
    (ResultName::MainMeanDeceleration, "main_mean_deceleration_m_per_s2"),
    (ResultName::SecondaryImpact, "secondary_impact_m_per_s"),
    (ResultName::OccupantLoad, "occupant_load_m_per_s2"),
    (ResultName::Energy, "energy_J"),
    (ResultName::OverLimits, OVER_LIMITS),
];

/// One thing that is varied.
#[derive(Clone, Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Vary {
    /// What is varied.
    pub(crate) what: What,
    /// Of a speed: the train.
    pub(crate) train: Option<String>,
    /// Of a mass: the vehicle.
    pub(crate) vehicle: Option<String>,
    /// Of a mass: several vehicles, or "all".
    pub(crate) vehicles: Option<Vehicles>,
    /// Each of `vehicles` by itself, instead of one value for all of them.
    #[serde(default)]
    pub(crate) each: bool,
    /// Of a gap, band, force or curve: the name among the curves.
    pub(crate) curve: Option<String>,
    /// Of a gap: "contact", the first contact.
    pub(crate) interface: Option<String>,
    /// Values are factors on what the scenario has. Of a force they always are.
    #[serde(default)]
    pub(crate) factor: bool,
    /// The values; of a curve, names among the curves that take its place.
    pub(crate) values: Option<Vec<Entry>>,
    /// First of `steps` evenly spaced values, or lower end of a distribution.
    pub(crate) from: Option<Entry>,
    /// Last of `steps` evenly spaced values, or upper end of a distribution.
    pub(crate) to: Option<Entry>,
    /// Number of evenly spaced values, including both ends.
    pub(crate) steps: Option<u64>,
    /// How values are drawn, if they are.
    pub(crate) distribution: Option<DistributionName>,
    /// Of the quantity itself, also of a lognormal one, before it is truncated.
    pub(crate) mean: Option<Entry>,
    /// Standard deviation of the quantity itself, before it is truncated.
    pub(crate) sd: Option<Entry>,
    /// Of a triangular distribution: the likeliest value.
    pub(crate) mode: Option<Entry>,
    /// Nothing below is drawn (normal, lognormal).
    pub(crate) min: Option<Entry>,
    /// Nothing above is drawn (normal, lognormal).
    pub(crate) max: Option<Entry>,
}

/// What is varied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum What {
    /// Speed of a train.
    #[default]
    Speed,
    /// Mass of vehicles.
    Mass,
    /// Free distance before contact.
    Gap,
    /// Member of a curve's band: −1 its lower edge, 0 the curve, 1 its upper edge.
    Band,
    /// Factor on a curve's force.
    Force,
    /// One of several curves in place of this one.
    Curve,
}

impl What {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Mass => "mass",
            Self::Gap => "gap",
            Self::Band => "band",
            Self::Force => "force",
            Self::Curve => "curve",
        }
    }
}

/// Vehicles by name, or all of them.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a list of vehicles, or \"all\"")]
pub(crate) enum Vehicles {
    /// By name.
    List(Vec<String>),
    /// `all`.
    Word(String),
}

/// Distribution of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum DistributionName {
    /// `from`, `to`.
    Uniform,
    /// `from`, `mode`, `to`.
    Triangular,
    /// `mean`, `sd`, and `min`, `max` if it is truncated.
    Normal,
    /// As normal; the logarithm is normal.
    Lognormal,
}

/// A number, a number with a unit, or a name, as written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entry(pub String);

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let expecting = "a number, or text such as a number with its unit";
        let parse = |text: &str| Ok(Self(text.into()));
        deserializer.deserialize_any(TextVisitor { expecting, parse })
    }
}

#[cfg(test)]
impl schemars::JsonSchema for Entry {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Entry".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": ["string", "number"] })
    }
}

/// The values of one variable, in SI.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Spread {
    List(Vec<f64>),
    /// Names, of which an item has one by its index.
    Names(Vec<String>),
    /// `steps` even values from `from` to `to`.
    Even {
        from: f64,
        to: f64,
        /// Number of values, 2 or more.
        steps: u64,
    },
    Drawn(Distribution),
}

impl Spread {
    /// Values along the grid; 1 of a distribution.
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::List(values) => values.len() as u64,
            Self::Names(names) => names.len() as u64,
            Self::Even { steps, .. } => *steps,
            Self::Drawn(_) => 1,
        }
    }
}

/// The variables of a checked plan, and how many items they make.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Design {
    pub(crate) spreads: Vec<Spread>,
    samples: u64,
    pub(crate) items: u64,
    seed: u64,
    sampling: Sampling,
}

impl Design {
    /// Whether every variable is drawn by itself.
    pub(crate) fn is_random(&self) -> bool {
        self.sampling == Sampling::Random
            && self.spreads.iter().all(|spread| matches!(spread, Spread::Drawn(_)))
    }
}

impl Plan {
    pub(crate) fn design(&self, spreads: Vec<Spread>) -> Result<Design, Error> {
        let drawn = spreads.iter().any(|s| matches!(s, Spread::Drawn(_)));
        let samples = match (self.samples, drawn) {
            (Some(0), _) => {
                return Err(error!(Sweep at "samples", "sweep.samples is 0: expected 1 or more"));
            }
            (Some(samples), true) => samples,
            (None, true) => {
                return Err(error!(
                    Sweep at "samples",
                    "a variable has a distribution: add samples = … to [sweep], the draws at each point of the grid"
                ));
            }
            (Some(_), false) => {
                return Err(error!(
                    Sweep at "samples",
                    "sweep.samples is given, but no variable has a distribution: remove samples"
                ));
            }
            (None, false) => 1,
        };
        if self.sampling == Sampling::LatinHypercube && !drawn {
            return Err(error!(
                Sweep at "sampling",
                "sweep.sampling = \"latin_hypercube\" is given, but no variable has a distribution"
            ));
        }
        let items = spreads
            .iter()
            .try_fold(samples, |items, spread| items.checked_mul(spread.len()))
            .filter(|items| *items <= MAX_ITEMS);
        let Some(items) = items else {
            let factors = [samples].into_iter().chain(spreads.iter().map(Spread::len));
            let factors: Vec<String> = factors.filter(|n| *n > 1).map(|n| n.to_string()).collect();
            let key = if self.samples.is_some() { "samples" } else { "vary" };
            return Err(error!(
                Sweep at key,
                "the sweep has {} items: {MAX_ITEMS} at most; shorten values, steps or samples",
                    factors.join(" × ")
            ));
        };
        let (seed, sampling) = (self.seed, self.sampling);
        Ok(Design { spreads, samples, items, seed, sampling })
    }
}

impl Design {
    /// Values of item `item` (`item < items`), one per variable in SI; of names the index.
    ///
    /// They depend on nothing but the plan and `item`.
    pub(crate) fn values(&self, item: u64, values: &mut Vec<f64>) {
        let (point, sample) = (item / self.samples, item % self.samples);
        values.clear();
        values.resize(self.spreads.len(), 0.0);
        let mut rest = point;
        for (value, spread) in values.iter_mut().zip(&self.spreads).rev() {
            let count = spread.len();
            let index = rest % count;
            rest /= count;
            *value = match spread {
                Spread::List(list) => list[index as usize],
                Spread::Names(_) => index as f64,
                Spread::Even { to, .. } if index + 1 == count => *to,
                Spread::Even { from, to, .. } => {
                    from + (to - from) * (index as f64 / (count - 1) as f64)
                }
                Spread::Drawn(_) => 0.0,
            };
        }
        for (k, (value, spread)) in values.iter_mut().zip(&self.spreads).enumerate() {
            if let Spread::Drawn(distribution) = spread {
                *value = distribution.quantile(self.share(k as u64, item, point, sample));
            }
        }
    }

    /// Where in (0, 1) variable `k` of an item lies.
    fn share(&self, k: u64, item: u64, point: u64, sample: u64) -> f64 {
        let unit = draw::unit(self.seed, k, item);
        match self.sampling {
            Sampling::Random => unit,
            Sampling::LatinHypercube => {
                let key = draw::key(draw::key(self.seed, k), point);
                let stratum = draw::permuted(sample, self.samples, key);
                // The sum may round up to 1 in the last of very many strata.
                ((stratum as f64 + unit) / self.samples as f64).min(1.0 - f64::EPSILON / 2.0)
            }
        }
    }
}

impl Vary {
    pub(crate) fn spread(&self) -> Result<Spread, Error> {
        if let Some(name) = self.distribution {
            self.refuse("distribution: remove one of them", &["values", "steps"])?;
            return Ok(Spread::Drawn(self.drawn(name)?));
        }
        let grid = "a grid, which takes values, or from, to and steps";
        self.refuse(grid, &["mean", "sd", "mode", "min", "max"])?;
        match (&self.values, &self.from, &self.to, self.steps) {
            (Some(values), None, None, None) => {
                if values.is_empty() {
                    return Err(error!(Sweep at "values", "values is empty: give one or more"));
                }
                if self.what == What::Curve {
                    return Ok(Spread::Names(values.iter().map(|v| v.0.clone()).collect()));
                }
                let numbers: Result<Vec<f64>, Error> =
                    values.iter().map(|value| self.number("values", value)).collect();
                Ok(Spread::List(numbers?))
            }
            (None, Some(from), Some(to), Some(steps)) => {
                if self.what == What::Curve {
                    return Err(error!(Sweep, "a curve needs values = [\"…\"], names in [curves]"));
                }
                if steps < 2 {
                    return Err(error!(Sweep at "steps", "steps is {steps}: expected 2 or more"));
                }
                let (from, to) = (self.number("from", from)?, self.number("to", to)?);
                Ok(Spread::Even { from, to, steps })
            }
            _ => Err(error!(Sweep, "give values = […], or from, to and steps, or a distribution")),
        }
    }

    fn drawn(&self, name: DistributionName) -> Result<Distribution, Error> {
        if self.what == What::Curve {
            return Err(error!(Sweep, "a curve needs values = [\"…\"], names in [curves]"));
        }
        let ends = || Ok::<_, Error>((self.need("from", &self.from)?, self.need("to", &self.to)?));
        match name {
            DistributionName::Uniform => {
                let uniform = "uniform, which takes from and to";
                self.refuse(uniform, &["mean", "sd", "mode", "min", "max"])?;
                let (from, to) = ends()?;
                Ok(Distribution::uniform(from, to)?)
            }
            DistributionName::Triangular => {
                let triangular = "triangular, which takes from, mode and to";
                self.refuse(triangular, &["mean", "sd", "min", "max"])?;
                let (from, to) = ends()?;
                Ok(Distribution::triangular(from, self.need("mode", &self.mode)?, to)?)
            }
            DistributionName::Normal | DistributionName::Lognormal => {
                let normal = "normal and lognormal, which take mean, sd, min and max";
                self.refuse(normal, &["from", "to", "mode"])?;
                let (mean, sd) = (self.need("mean", &self.mean)?, self.need("sd", &self.sd)?);
                let bound = |key: &'static str, entry: &Option<Entry>, open: f64| {
                    entry.as_ref().map_or(Ok(open), |entry| self.number(key, entry))
                };
                let min = bound("min", &self.min, f64::NEG_INFINITY)?;
                let max = bound("max", &self.max, f64::INFINITY)?;
                match name {
                    DistributionName::Normal => Ok(Distribution::normal(mean, sd, min, max)?),
                    _ => Ok(Distribution::lognormal(mean, sd, min, max)?),
                }
            }
        }
    }

    fn need(&self, key: &'static str, entry: &Option<Entry>) -> Result<f64, Error> {
        match entry {
            Some(entry) => self.number(key, entry),
            None => Err(error!(Sweep at "distribution", "the distribution needs {key} = …")),
        }
    }

    /// Refuses keys that do not go with `with`.
    fn refuse(&self, with: &'static str, keys: &[&'static str]) -> Result<(), Error> {
        let given = |key: &str| match key {
            "values" => self.values.is_some(),
            "from" => self.from.is_some(),
            "to" => self.to.is_some(),
            "steps" => self.steps.is_some(),
            "mean" => self.mean.is_some(),
            "sd" => self.sd.is_some(),
            "mode" => self.mode.is_some(),
            "min" => self.min.is_some(),
            _ => self.max.is_some(),
        };
        match keys.iter().find(|key| given(key)) {
            Some(&key) => Err(error!(Sweep at key, "{key} does not go with {with}").itself()),
            None => Ok(()),
        }
    }

    fn number(&self, key: &'static str, entry: &Entry) -> Result<f64, Error> {
        let text = &entry.0;
        let dimension = match (self.what, self.factor) {
            (What::Speed, false) => Some(&SPEED),
            (What::Mass, false) => Some(&MASS),
            (What::Gap, false) => Some(&LENGTH),
            _ => None,
        };
        let value = match dimension {
            Some(dimension) => {
                dimension.parse(text).map_err(|source| error!(Sweep at key, "{key}: {source}"))?
            }
            None => text.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(
                || error!(Sweep at key, "{key}: \"{text}\" is not a number: write for example 0.9"),
            )?,
        };
        let (low, high) = match (self.what, self.factor) {
            // How far values scatter has no sign of its own to check here.
            _ if key == "sd" => (0.0, f64::INFINITY),
            (What::Band, _) => (-1.0, 1.0),
            // A train may come against the other.
            (What::Speed, false) => (f64::NEG_INFINITY, f64::INFINITY),
            // A mean or a bound below zero may be meant: what is drawn is checked by the run.
            _ if key != "values" && key != "from" && key != "to" => {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
            _ => (0.0, f64::INFINITY),
        };
        if value < low || value > high {
            let range = if high.is_finite() {
                format!("from {low} to {high}")
            } else {
                format!("{low} or more")
            };
            return Err(error!(Sweep at key, "{key}: {text} is out of range: expected {range}"));
        }
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn design(text: &str) -> Result<Design, String> {
        let plan: Plan = toml::from_str(text).map_err(|e| e.message().to_string())?;
        let spreads: Result<Vec<Spread>, Error> = plan.vary.iter().map(Vary::spread).collect();
        plan.design(spreads.map_err(|e| e.to_string())?).map_err(|e| e.to_string())
    }

    fn values(design: &Design, item: u64) -> Vec<f64> {
        let mut values = Vec::new();
        design.values(item, &mut values);
        values
    }

    #[test]
    fn the_last_variable_of_a_grid_changes_fastest() {
        let design = design(
            "vary = [ { what = \"speed\", values = [\"36km/h\", \"20m/s\"] },\n\
             { what = \"gap\", from = \"0mm\", to = \"30mm\", steps = 3 } ]",
        )
        .unwrap();
        assert_eq!(design.items, 6);
        let all: Vec<Vec<f64>> = (0..6).map(|k| values(&design, k)).collect();
        assert_eq!(
            all,
            [[10.0, 0.0], [10.0, 0.015], [10.0, 0.03], [20.0, 0.0], [20.0, 0.015], [20.0, 0.03]]
        );
    }

    /// Latin hypercube: every one of the equally likely ranges is met once, at each grid point.
    #[test]
    fn a_latin_hypercube_meets_every_range_once() {
        let design = design(
            "seed = 3\nsamples = 100\nsampling = \"latin_hypercube\"\n\
             vary = [ { what = \"force\", values = [1, 2] },\n\
             { what = \"band\", distribution = \"uniform\", from = -1, to = 1 },\n\
             { what = \"force\", distribution = \"uniform\", from = 0, to = 1 } ]",
        )
        .unwrap();
        assert_eq!(design.items, 200);
        let mut orders = Vec::new();
        for point in 0..2 {
            for variable in [1, 2] {
                let order: Vec<usize> = (0..100)
                    .map(|k| values(&design, 100 * point + k)[variable])
                    .map(|v| if variable == 1 { 0.5 * (v + 1.0) } else { v })
                    .map(|share| (share * 100.0) as usize)
                    .collect();
                let mut sorted = order.clone();
                sorted.sort();
                assert_eq!(sorted, (0..100).collect::<Vec<_>>());
                orders.push(order);
            }
        }
        orders.sort();
        orders.dedup();
        assert_eq!(orders.len(), 4, "variables and grid points are shuffled each its own way");
    }

    #[test]
    fn says_what_is_wrong_with_a_plan() {
        fn t(vary: &str, expected: &str) {
            let text = format!("samples = 2\nvary = [ {{ {vary} }} ]");
            assert_eq!(design(&text).unwrap_err(), expected);
        }
        #[rustfmt::skip]
        let cases = [
            ("what = \"mass\", values = [24]", "values: mass \"24\" has no unit: write for example \"24t\" or \"24kg\""),
            ("what = \"mass\", factor = true, values = [\"24t\"]", "values: \"24t\" is not a number: write for example 0.9"),
            ("what = \"band\", values = [1.5]", "values: 1.5 is out of range: expected from -1 to 1"),
            ("what = \"force\", values = [-1]", "values: -1 is out of range: expected 0 or more"),
            ("what = \"force\", values = []", "values is empty: give one or more"),
            ("what = \"force\", from = 1, to = 2, steps = 1", "steps is 1: expected 2 or more"),
            ("what = \"force\", from = 1, to = 2", "give values = […], or from, to and steps, or a distribution"),
            ("what = \"force\", distribution = \"normal\", mean = 1", "the distribution needs sd = …"),
            ("what = \"force\", distribution = \"uniform\", from = 1, to = 2, sd = 1", "sd does not go with uniform, which takes from and to"),
            ("what = \"force\", from = 1, max = 2", "max does not go with a grid, which takes values, or from, to and steps"),
            ("what = \"force\", values = [1]", "sweep.samples is given, but no variable has a distribution: remove samples"),
        ];
        cases.into_iter().for_each(|(vary, expected)| t(vary, expected));
    }

    #[test]
    fn too_many_items_are_refused_by_number() {
        let even = "{ what = \"force\", from = 0, to = 1, steps = 1000000000 }";
        let error = design(&format!("vary = [ {even}, {even} ]")).unwrap_err();
        assert_eq!(
            error,
            "the sweep has 1000000000 × 1000000000 items: 1000000000000 at most; shorten values, steps or samples"
        );
        let one = design(&format!("vary = [ {even} ]")).unwrap();
        assert_eq!(values(&one, 999_999_999), [1.0]);
    }
}
