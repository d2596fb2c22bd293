//! Data sets: the cases of a group, checked and converted into tables {v, d, …} → F.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::ops::Range;
use std::sync::Arc;

use linfa::Dataset;
use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};

use crate::curve::BodyMotion;
use crate::curve::body::body_motion;
use crate::curve::group::key_of;
use crate::curve::loading::loading_branch;
use crate::curve::replicates::mean_of;
use crate::curve::stopped_mass::{LoadingRun, StoppedMass};
use crate::curve::{Case, Envelope, ForceKind, Masses, Parameter};
use crate::error::{Error, error};
use crate::order;
use crate::parallel;
use crate::unit::{SpeedKind, UnitSystem, km_per_h};

/// One case as models see it: a run, or the mean of runs that differ in nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingCase {
    /// Name of the case.
    pub name: String,
    /// Names of the runs that it is the mean of; one as a rule.
    pub runs: Vec<String>,
    /// With its records over time.
    pub case: Arc<Case>,
    /// Speed before contact, in m/s, of the set's kind.
    pub speed_m_per_s: f64,
    /// Values of the set's [`features`](TrainingSet::features).
    pub features: Vec<f64>,
    /// Mass that moves along the deflection.
    pub effective_mass_kg: f64,
    /// Loading branch at the solver's rate.
    pub envelope: Envelope,
    /// Loading branch at the common interval, as the reference method uses it.
    pub sampled: Envelope,
    /// The body's motion, and the force that follows from it.
    pub motion: BodyMotion,
    /// Whether the record ended while loading, so that the maximum deflection is not known.
    pub truncated: bool,
    /// Measured unloading stiffness, in N/m, if the record reaches so far.
    pub unloading_stiffness_n_per_m: Option<f64>,
}

/// A column of the table besides speed and deflection: a number, or whether the case is of
/// a category.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Feature {
    /// Name of the case parameter.
    pub parameter: String,
    /// The category that counts 1; all others count 0. `None` for a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub category: Option<String>,
}

/// The parameter that masses become if they differ within a group.
pub(crate) const MASS: &str = "mass_kg";
/// Masses that differ by less than this share are one: mass scaling and rounding change one design by that much, and no model of
/// speed alone could take them otherwise.
pub(crate) const SAME_MASS: f64 = 5e-3;

pub(crate) fn is_same_mass(a_kg: f64, b_kg: f64) -> bool {
    (a_kg / b_kg - 1.0).abs() <= SAME_MASS
}

/// The same for other numbers, of which only the rounding is known.
const SAME_NUMBER: f64 = 1e-9;
/// The mass of the other body of a pair, where it is not that of the first.
pub(crate) const OTHER_MASS: &str = "other_mass_kg";

/// The cases of one group.
///
/// Invariant: at least one case, in order of speed, then features; no two cases equal in
/// both, since runs that are so enter as their mean; one kind of speed and force.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingSet {
    /// Name of the group.
    pub group: String,
    /// What the speeds are measured against.
    pub speed_kind: SpeedKind,
    /// Which force the curves hold.
    pub force_kind: ForceKind,
    /// Masses of the first case.
    pub masses: Masses,
    /// Units of the solver files, if all cases come from one system.
    pub units: Option<UnitSystem>,
    /// Further parameters in which the cases differ; what all share is left out.
    pub features: Vec<Feature>,
    /// The cases, in order of speed, then features.
    pub cases: Vec<Arc<TrainingCase>>,
}

impl Feature {
    /// Whether it is a mass of the bodies, and not of the structure.
    pub(crate) fn is_mass(&self) -> bool {
        [MASS, OTHER_MASS].contains(&&*self.parameter)
    }

    fn value(&self, parameter: &Parameter) -> Option<f64> {
        match (parameter, &self.category) {
            (Parameter::Number(value), None) => Some(*value),
            (Parameter::Category(found), Some(category)) => {
                Some(if found == category { 1.0 } else { 0.0 })
            }
            _ => None,
        }
    }

    /// Name of the column: `angle_deg`, `obstacle=pole`.
    pub fn name(&self) -> String {
        match &self.category {
            Some(category) => format!("{}={category}", self.parameter),
            None => self.parameter.clone(),
        }
    }
}

/// Whether cases of one speed differ in mass alone, if at all.
pub(crate) fn are_masses(features: &[Feature]) -> bool {
    features.iter().all(Feature::is_mass)
}

/// The values of `features` for the parameters of a query.
pub(crate) fn feature_values(
    features: &[Feature],
    parameters: &BTreeMap<String, Parameter>,
) -> Result<Vec<f64>, Error> {
    let asked = |feature: &Feature| {
        let known: Vec<&str> = features
            .iter()
            .filter(|f| f.parameter == feature.parameter)
            .filter_map(|f| f.category.as_deref())
            .collect();
        let among = if known.is_empty() {
            " as a finite number".into()
        } else {
            format!(", one of {}", known.join(", "))
        };
        let name = &feature.parameter;
        if name == MASS {
            return error!(
                Dataset,
                "the model needs {name}, the mass of the body: give --mass, or --parameter {name}=…"
            );
        }
        if name == OTHER_MASS {
            return error!(
                Dataset,
                "the model needs {name}, the mass of the other body: give --parameter {name}=…, or in a scenario parameters = {{ {name} = … }} of the curve"
            );
        }
        error!(
            Dataset,
            "the model needs {name}{among}: give --parameter {name}=…, or in a scenario parameters = {{ {name} = … }} of the curve"
        )
    };
    let is_known = |feature: &Feature, parameter: &Parameter| match parameter {
        Parameter::Number(v) => feature.category.is_none() && v.is_finite(),
        Parameter::Category(c) => features
            .iter()
            .any(|f| f.parameter == feature.parameter && f.category.as_ref() == Some(c)),
    };
    features
        .iter()
        .map(|feature| {
            let parameter = parameters
                .get(&feature.parameter)
                .filter(|p| is_known(feature, p))
                .ok_or_else(|| asked(feature))?;
            feature.value(parameter).ok_or_else(|| asked(feature))
        })
        .collect()
}

/// The case's parameters, its masses among them.
fn parameters(case: &Case) -> BTreeMap<String, Parameter> {
    let mut parameters = case.conditions.parameters.clone();
    parameters.insert(MASS.into(), Parameter::Number(case.conditions.masses.body_kg));
    if let Some(other) = case.conditions.masses.other_kg {
        parameters.insert(OTHER_MASS.into(), Parameter::Number(other));
    }
    parameters
}

/// The columns that distinguish the cases: parameters that all share are left out.
fn features(cases: &[&Case]) -> Result<Vec<Feature>, Error> {
    let of: Vec<(&str, BTreeMap<String, Parameter>)> =
        cases.iter().map(|c| (c.id.name.as_str(), parameters(c))).collect();
    let names: BTreeSet<&String> = of.iter().flat_map(|(_, p)| p.keys()).collect();
    let mut features = Vec::new();
    for name in names {
        let has = |p: &BTreeMap<String, Parameter>| p.contains_key(name);
        let with = of.iter().find(|(_, p)| has(p)).map_or("", |(case, _)| *case);
        if let Some((without, _)) = of.iter().find(|(_, p)| !has(p)) {
            return Err(error!(
                Dataset,
                "case \"{without}\" has no parameter \"{name}\", which case \"{with}\" has: give it to every run of the group"
            ));
        }
        let (mut number, mut category) = (None, None);
        let (mut values, mut categories) = (Vec::new(), BTreeSet::new());
        for (case, parameters) in &of {
            match &parameters[name] {
                Parameter::Number(value) => {
                    number = Some(*case);
                    values.push(*value);
                }
                Parameter::Category(value) => {
                    category = Some(*case);
                    categories.insert(value.clone());
                }
            }
        }
        if let (Some(number), Some(category)) = (number, category) {
            return Err(error!(
                Dataset,
                "parameter \"{name}\" is a number in case \"{number}\" and a category in case \"{category}\": give every run the same kind"
            ));
        }
        let feature = |category| Feature { parameter: name.clone(), category };
        let is_mass = [MASS, OTHER_MASS].contains(&&**name);
        let alike = if is_mass { SAME_MASS } else { SAME_NUMBER };
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
        if high - low > alike * high.abs().max(low.abs()) {
            features.push(feature(None));
        } else if categories.len() > 1 {
            features.extend(categories.into_iter().map(|category| feature(Some(category))));
        }
    }
    Ok(features)
}

/// Features, and the runs that have them.
type Runs<'a> = (Vec<f64>, Vec<&'a Case>);

/// The cases, with those together that differ in nothing that a model could see: their speeds are
/// within 0.1 %, so that a difference of their curves is scatter and not a matter of speed.
fn replicates<'a>(cases: &[&'a Case], features: &[Feature]) -> Result<Vec<Runs<'a>>, Error> {
    let mut cases = cases.to_vec();
    order::sort(&mut cases, |a, b| {
        a.conditions.speed.m_per_s.total_cmp(&b.conditions.speed.m_per_s)
    });
    let mut found: Vec<Runs<'a>> = Vec::new();
    for case in cases {
        let values = feature_values(features, &parameters(case))?;
        let same_value = |(of, runs): &&mut Runs<'a>| {
            *of == values
                && is_same_speed(case.conditions.speed.m_per_s, runs[0].conditions.speed.m_per_s)
        };
        match found.iter_mut().rev().find(same_value) {
            None => found.push((values, vec![case])),
            Some((_, runs)) if runs[0].is_measured_as(case) => runs.push(case),
            Some((_, runs)) => {
                let hint = ", or tell them apart by parameters = { … } in the study";
                let alone = features.is_empty();
                let (parameters, hint) = if alone { ("", hint) } else { (" and parameters", "") };
                return Err(error!(
                    Dataset,
                    "cases \"{first}\" and \"{second}\" have the same speed {speed}{parameters}, but different recipes, so that they are not replicates: keep one of them{hint}",
                    first = runs[0].id.name,
                    second = case.id.name,
                    speed = km_per_h(case.conditions.speed.m_per_s)
                ));
            }
        }
    }
    found.iter_mut().for_each(|(_, runs)| order::sort(runs, |a, b| a.id.name.cmp(&b.id.name)));
    Ok(found)
}

/// Which points of the cases make the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TableKind {
    /// The states at the common interval (reference method).
    Samples,
    /// An even deflection grid from the solver's rate, no coarser than 2 mm.
    Grid,
}

/// Coarsest deflection grid for training: at 20 m/s one state each 0.75 ms is 15 mm, a
/// third of the way to the first peak.
pub(crate) const GRID_M: f64 = 2e-3;

/// Speeds within this share of each other count as one.
pub(crate) const SAME_SPEED: f64 = 1e-3;

pub(crate) fn is_same_speed(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= SAME_SPEED
}

/// Speeds that nearly repeat one another lie within this share of the lowest, and of the intervals next to them.
const NEARLY_SAME: (f64, f64) = (0.05, 0.1);

/// The lowest and highest of the rising `speeds` that nearly repeat `v`, which is one of them: left out without the others it would be
/// predicted over an interval far shorter than those of the series. `(v, v)` if the others are further away.
pub(crate) fn nearly_same(speeds: &[f64], v: f64) -> (f64, f64) {
    let (of_speed, of_interval) = NEARLY_SAME;
    let mut low = speeds.partition_point(|&s| s < v && !is_same_speed(s, v));
    let mut high = speeds.partition_point(|&s| s <= v || is_same_speed(s, v)) - 1;
    let mut found = (v, v);
    loop {
        let below = low.checked_sub(1).map(|k| speeds[low] - speeds[k]);
        let above = speeds.get(high + 1).map(|next| next - speeds[high]);
        let interval = below.into_iter().chain(above).reduce(f64::min);
        let Some(interval) = interval else { return found };
        if speeds[high] - speeds[low] < of_interval * interval {
            found = (speeds[low], speeds[high]);
        }
        // The nearer of the two next.
        if above.is_none_or(|above| below.is_some_and(|below| below < above)) {
            low -= 1
        } else {
            high += 1
        }
        if speeds[high] > (1.0 + of_speed) * speeds[low] {
            return found;
        }
    }
}

/// The cases but for those that ended while loading, before a slower one of the same features stood: of the crush at their speed they
/// show nothing that others do not. `of` gives whether a case ended so, its speed, its end in m and its features but for masses.
pub(crate) fn show_their_crush<'a, C>(
    cases: &'a [C],
    of: impl Fn(&'a C) -> (bool, f64, f64, &'a [f64]),
) -> impl Iterator<Item = &'a C> {
    cases.iter().filter(move |case| {
        let (truncated, speed, end_m, features) = of(case);
        let mut slower = cases.iter().map(&of).filter(|other| other.1 < speed);
        !(truncated && slower.any(|(_, _, m, other)| m >= end_m && other == features))
    })
}

/// Whether a speed is in such a range.
pub(crate) fn is_within(speed: f64, (low, high): (f64, f64)) -> bool {
    (low <= speed || is_same_speed(low, speed)) && (speed <= high || is_same_speed(high, speed))
}

/// Cases near a speed that a forest learns from at least, if there are so many.
const FEWEST_NEAR: usize = 10;

/// Most steps of a grid: 40 m of [`GRID_M`], more than any vehicle crushes.
const MOST_STEPS: f64 = 20_000.0;

/// Even deflections from 0 to `end_m`, at least `fewest` steps and no coarser than [`GRID_M`]
/// up to 40 m.
pub(crate) fn grid(end_m: f64, fewest: usize) -> Vec<f64> {
    let steps = ((end_m / GRID_M).ceil().clamp(1.0, MOST_STEPS) as usize).max(fewest);
    (0..=steps).map(|i| end_m * i as f64 / steps as f64).collect()
}

/// Index of the speed nearest to `v`; of equally near ones the first.
pub(crate) fn nearest(speeds_m_per_s: impl Iterator<Item = f64>, v: f64) -> usize {
    least(speeds_m_per_s.map(|s| (s - v).abs()))
}

/// Index of the case nearest to `at` in speed and features, each relative to its range over the cases; of equally near ones the
/// first.
pub(crate) fn nearest_case<'a>(
    cases: impl Iterator<Item = (f64, &'a [f64])> + Clone,
    at: (f64, &[f64]),
) -> usize {
    let share = |value: &dyn Fn((f64, &'a [f64])) -> f64, asked: f64| -> Vec<f64> {
        let values = || cases.clone().map(value);
        let range =
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        values().map(|v| (v - asked) / if range > 0.0 { range } else { 1.0 }).collect()
    };
    // One feature: the plain distance, so that midpoints are where they are expected.
    if at.1.is_empty() {
        return nearest(cases.map(|(speed, _)| speed), at.0);
    }
    let mut squares: Vec<f64> = share(&|(speed, _)| speed, at.0).iter().map(|s| s * s).collect();
    for (k, &asked) in at.1.iter().enumerate() {
        let shares = share(&|(_, features)| features[k], asked);
        squares.iter_mut().zip(shares).for_each(|(sum, s)| *sum += s * s);
    }
    least(squares.into_iter())
}

/// Index of the smallest distance; of those that only rounding tells apart the first.
pub(crate) fn least(distances: impl Iterator<Item = f64>) -> usize {
    let closer = |best: (usize, f64), (i, distance): (usize, f64)| {
        if distance < best.1 * (1.0 - 1e-9) { (i, distance) } else { best }
    };
    distances.enumerate().fold((0, f64::INFINITY), closer).0
}

/// Whether all cases have one kind of speed and of force.
pub(crate) fn of_one_kind<'a>(cases: impl IntoIterator<Item = &'a Case>) -> Result<(), Error> {
    let mut cases = cases.into_iter();
    let Some(first) = cases.next() else { return Ok(()) };
    for other in cases {
        let what = match first.other_kind(other) {
            Some(("speed", ..)) => "wall and closing speeds",
            Some(_) => "contact and body forces",
            None => continue,
        };
        let (first, second) = (&first.id.name, &other.id.name);
        return Err(error!(
            Dataset,
            "cases \"{first}\" and \"{second}\" mix {what}: keep one kind per group"
        ));
    }
    Ok(())
}

impl TrainingSet {
    /// Checks the cases of a group.
    ///
    /// # Errors
    /// It names the cases that do not fit together.
    pub fn new<'a>(group: &str, cases: impl IntoIterator<Item = &'a Case>) -> Result<Self, Error> {
        let mut cases: Vec<&Case> = cases.into_iter().collect();
        let first = *cases.first().ok_or(error!(Dataset, "the group is empty: build it first"))?;
        of_one_kind(cases.iter().copied())?;
        cases.iter().try_for_each(|case| case.check())?;
        order::sort(&mut cases, |a, b| a.id.name.cmp(&b.id.name));
        let features = features(&cases)?;
        let training = parallel::map(replicates(&cases, &features)?, |(features, runs)| {
            TrainingCase::new(&runs, features)
        });
        let mut training = training.into_iter().collect::<Result<Vec<_>, _>>()?;
        // By values, so that names and the order of the cases change nothing.
        order::sort(&mut training, |a, b| a.key().partial_cmp(&b.key()).unwrap_or(Ordering::Equal));
        Ok(Self {
            group: group.into(),
            speed_kind: first.conditions.speed.kind,
            force_kind: first.curves.force_kind,
            masses: training[0].case.conditions.masses,
            units: first.units().filter(|u| cases.iter().all(|c| c.units() == Some(*u))),
            features,
            cases: training.into_iter().map(Arc::new).collect(),
        })
    }

    /// The cases of the group that stay when one of its speeds, in m/s, is left out with those that nearly repeat it.
    pub(crate) fn others(&self, cases: &[Case], speed_m_per_s: f64) -> Vec<Case> {
        let left_out = nearly_same(&self.speeds_m_per_s(), speed_m_per_s);
        let others = cases.iter().filter(|c| !is_within(c.conditions.speed.m_per_s, left_out));
        others.cloned().collect()
    }

    /// Hash over the fingerprints of the cases.
    pub(crate) fn hash(&self) -> String {
        let mut hash = blake3::Hasher::new();
        for case in &self.cases {
            hash.update(case.case.provenance.fingerprint.as_bytes());
        }
        hash.finalize().to_hex().to_string()
    }

    /// Those of its cases for which that holds.
    pub(crate) fn with(&self, mut keep: impl FnMut(&TrainingCase) -> bool) -> Self {
        let mut set = self.clone();
        set.cases.retain(|case| keep(case));
        set
    }

    pub(crate) fn speeds_m_per_s(&self) -> Vec<f64> {
        self.cases.iter().map(|c| c.speed_m_per_s).collect()
    }

    /// Of the cases that [`show_their_crush`].
    pub(crate) fn speeds_of_crush_m_per_s(&self) -> Vec<f64> {
        let alone = are_masses(&self.features);
        let showing = show_their_crush(&self.cases, |case| {
            let features = if alone { &[] } else { &case.features[..] };
            (case.truncated, case.speed_m_per_s, case.envelope.end_m(), features)
        });
        showing.map(|case| case.speed_m_per_s).collect()
    }

    /// The table {v in m/s, d in m, features} → F in N over the loading branches of all
    /// cases, of the declared force.
    pub fn table(&self, kind: TableKind) -> Dataset<f64, f64, ndarray::Ix1> {
        self.table_of(kind, self.force_kind, None)
    }

    /// The same table of the declared force or of the body's; with at most so many rows, those of the cases nearest to a speed in
    /// m/s, half of them on either side if there are so many; of [`FEWEST_NEAR`] cases with more rows, each is thinned. Where other
    /// features distinguish cases, all are thinned evenly.
    pub(crate) fn table_of(
        &self,
        kind: TableKind,
        force: ForceKind,
        most_rows: Option<(usize, f64)>,
    ) -> Dataset<f64, f64, ndarray::Ix1> {
        let columns = 2 + self.features.len();
        let mut records = Vec::new();
        let mut targets = Vec::new();
        let points: Vec<_> =
            self.cases.iter().map(|case| case.points(kind, force == self.force_kind)).collect();
        let mut chosen: Vec<usize> = (0..points.len()).collect();
        let mut step = 1;
        if let (Some((most, _)), false) = (most_rows, self.features.is_empty()) {
            let rows: usize = points.iter().map(|(d, _)| d.len()).sum();
            // Those from all over the range are worth less.
            step = rows.div_ceil(2 * most).max(1);
        } else if let Some((most, near)) = most_rows {
            let rows: Vec<usize> = points.iter().map(|(d, _)| d.len()).collect();
            let (range, thinned) = nearest_rows(&self.speeds_m_per_s(), &rows, near, most);
            (chosen, step) = (range.collect(), thinned);
        }
        for (case, (deflection_m, force_n)) in
            chosen.into_iter().map(|k| (&self.cases[k], &points[k]))
        {
            for (&d, &f) in deflection_m.iter().zip(force_n).step_by(step) {
                records.extend([case.speed_m_per_s, d]);
                records.extend(&case.features);
                targets.push(f);
            }
        }
        let records =
            Array2::from_shape_fn((targets.len(), columns), |(i, k)| records[columns * i + k]);
        let names = ["speed_m_per_s".to_string(), "deflection_m".into()];
        Dataset::new(records, Array1::from(targets)).with_feature_names(
            names.into_iter().chain(self.features.iter().map(Feature::name)).collect(),
        )
    }
}

/// The cases nearest to a speed whose rows are at most so many, but [`FEWEST_NEAR`] at least, and by how much each is thinned.
fn nearest_rows(speeds: &[f64], rows: &[usize], near: f64, most: usize) -> (Range<usize>, usize) {
    // The nearest of the side that has fewer rows, in turn.
    let faster = speeds.partition_point(|speed| *speed <= near);
    let (mut range, mut sides) = (faster..faster, [0, 0]);
    loop {
        let slower = (range.start > 0).then(|| (sides[0], 0, range.start - 1));
        let faster = (range.end < rows.len()).then(|| (sides[1], 1, range.end));
        let Some((_, side, k)) = slower.into_iter().chain(faster).min() else { break };
        sides[side] += rows[k];
        if sides[0] + sides[1] > most && range.len() >= FEWEST_NEAR {
            break;
        }
        range = range.start.min(k)..range.end.max(k + 1);
    }
    let found: usize = rows[range.clone()].iter().sum();
    (range, found.div_ceil(most).max(1))
}

impl TrainingCase {
    /// The mean of `runs`, of which there is one at least.
    fn new(runs: &[&Case], features: Vec<f64>) -> Result<Self, Error> {
        let no_motion = || {
            error!(
                Dataset,
                "case \"{name}\": its samples contain no loading branch: sample more states at a shorter interval",
                name = runs[0].id.name
            )
        };
        // A copied run does not count as a repetition.
        let mut known = HashSet::new();
        let of_own = |run: &&&Case| known.insert(key_of(&run.curves.original));
        let runs = runs.iter().filter(of_own).copied();
        // The mean would end where the first of its runs does.
        let (ended, whole): (Vec<_>, Vec<_>) = runs.partition(|run| run.is_truncated());
        let (runs, left_out) = if whole.is_empty() { (ended, whole) } else { (whole, ended) };
        let mut case = mean_of(runs[0], &runs[1..]).map_err(|_| no_motion())?;
        case.quality.warnings.extend(left_out.iter().map(|run| {
            format!("{}, of the same speed, ended while loading and is left out", run.id.name)
        }));
        let named = |source| {
            error!(Dataset, "case \"{name}\": {source}", name = case.id.name).caused_by(source)
        };
        let mut motion = body_motion(&case).ok_or_else(no_motion)?;
        if motion.rebound_speed_m_per_s.is_none() && runs.len() > 1 {
            // The mean reaches as far as the shortest record.
            let of_run = |run: &&Case| body_motion(run)?.rebound_speed_m_per_s;
            let known: Vec<f64> = runs.iter().filter_map(of_run).collect();
            let mean = known.iter().sum::<f64>() / known.len() as f64;
            motion.rebound_speed_m_per_s = (!known.is_empty()).then_some(mean);
        }
        Ok(Self {
            name: case.id.name.clone(),
            runs: runs.iter().map(|run| run.id.name.clone()).collect(),
            speed_m_per_s: case.conditions.speed.m_per_s,
            features,
            effective_mass_kg: case.conditions.masses.effective_kg(),
            motion,
            envelope: loading_branch(&case.curves.original).map_err(named)?.envelope,
            sampled: loading_branch(&case.curves.sampled).map_err(named)?.envelope,
            truncated: case.is_truncated(),
            unloading_stiffness_n_per_m: case.curves.unloading_stiffness_n_per_m,
            case: Arc::new(case),
        })
    }

    /// Wall-clock time of the solver for all of its runs, in s.
    pub(crate) fn solver_time_s(&self) -> Option<f64> {
        Some(self.case.provenance.solver_wall_time_s? * self.runs.len() as f64)
    }

    fn key(&self) -> (f64, &[f64]) {
        (self.speed_m_per_s, &self.features)
    }

    /// Deflections and forces of the table's rows, of the declared force or of the body's.
    fn points(&self, kind: TableKind, declared: bool) -> (Vec<f64>, Vec<f64>) {
        let columns = |e: &Envelope| (e.deflection_m().to_vec(), e.force_n().to_vec());
        match (kind, declared) {
            (TableKind::Samples, true) => columns(&self.sampled),
            (TableKind::Samples, false) => columns(&self.motion.force),
            (TableKind::Grid, _) => {
                let deflection_m = grid(self.envelope.end_m(), 1);
                let envelope = if declared { &self.envelope } else { &self.motion.force };
                let force_n = deflection_m.iter().map(|&d| envelope.force_at(d)).collect();
                (deflection_m, force_n)
            }
        }
    }
}

/// Masses of a pair that differ by no more are those of equal bodies, as a share.
const EVEN: f64 = 0.01;
/// Minimum number of steps of a run's curve: short crushes need more than one every 2 mm.
pub(crate) const STEPS: usize = 200;

impl TrainingSet {
    /// The mass that is stopped at each deflection, of a group whose runs differ in speed and mass alone and know a
    /// contact force on one body, or between two of the same mass. Its
    /// `is_known` says whether the runs agree on one. A motion that was made of its own force says nothing of it.
    pub(crate) fn stopped_mass(&self) -> Option<StoppedMass> {
        let is_even = |case: &Arc<TrainingCase>| {
            let Masses { body_kg, other_kg } = case.case.conditions.masses;
            other_kg.is_none_or(|m| (m / body_kg - 1.0).abs() <= EVEN)
        };
        let may_tell = self.force_kind == ForceKind::Contact
            && are_masses(&self.features)
            && self.cases.iter().all(is_even);
        if !may_tell {
            return None;
        }
        let fit = |cases: &[&Arc<TrainingCase>]| {
            let runs = parallel::map(cases, |case| loading_run(case));
            StoppedMass::fit(&runs.into_iter().collect::<Option<Vec<_>>>()?)
        };
        let moves = |case: &&Arc<TrainingCase>| !case.case.moves_by_its_force();
        let own: Vec<_> = self.cases.iter().filter(moves).collect();
        if own.len() < 2 {
            let all: Vec<_> = self.cases.iter().collect();
            return Some(fit(&all)?.without_any());
        }
        fit(&own)
    }
}

fn loading_run(case: &Arc<TrainingCase>) -> Option<LoadingRun> {
    let deflection_m = grid(case.envelope.end_m(), STEPS);
    let over = |of: &Envelope| {
        let values = deflection_m.iter().map(|&d| of.force_at(d)).collect();
        Envelope::new(deflection_m.clone(), values).ok()
    };
    Some(LoadingRun {
        mass_kg: case.effective_mass_kg,
        contact_n: over(&case.envelope)?,
        closing_m_per_s: over(&case.motion.closing_speed)?,
    })
}

#[cfg(test)]
mod tests {
    use super::{nearest_rows, nearly_same};

    #[test]
    fn rows_of_both_sides_are_taken_and_thinned_where_ten_cases_have_more() {
        let speeds: Vec<f64> = (0..40).map(f64::from).collect();
        let of = |rows: usize, near: f64| nearest_rows(&speeds, &vec![rows; 40], near, 4000);
        assert_eq!(of(50, 19.5), (0..40, 1));
        assert_eq!(of(200, 19.5), (10..30, 1));
        assert_eq!(of(1000, 19.5), (15..25, 3));
        assert_eq!(of(1000, -1.0), (0..10, 3));
        assert_eq!(of(1000, 38.5), (30..40, 3));
        // A few rows of one side, and many of the other.
        let rows: Vec<usize> = (0..40).map(|k| if k < 20 { 20 } else { 500 }).collect();
        assert_eq!(nearest_rows(&speeds, &rows, 19.5, 4000), (0..27, 1));
    }

    #[test]
    fn speeds_that_nearly_repeat_one_another_are_found() {
        #[rustfmt::skip]
        let cases: [(&[f64], f64, (f64, f64)); 9] = [
            (&[25.0, 36.0, 60.0], 36.0, (36.0, 36.0)),
            (&[25.0, 36.0, 36.3, 60.0], 36.0, (36.0, 36.3)),
            (&[25.0, 35.7, 36.0, 36.3, 60.0], 36.0, (35.7, 36.3)),
            (&[25.0, 35.7, 36.0, 36.3, 60.0], 25.0, (25.0, 25.0)),
            (&[25.0, 25.1, 36.0, 36.1, 60.0, 60.1], 60.1, (60.0, 60.1)),
            // A tenth of the next interval or more, and a fine series beside a speed far away.
            (&[25.0, 36.0, 38.0, 60.0], 36.0, (36.0, 36.0)),
            (&[10.0, 11.0, 12.0, 13.0, 100.0], 12.0, (12.0, 12.0)),
            // Runs of one speed are one.
            (&[25.0, 36.0, 36.0, 60.0], 36.0, (36.0, 36.0)),
            (&[36.0], 36.0, (36.0, 36.0)),
        ];
        for (speeds, v, expected) in cases {
            assert_eq!(nearly_same(speeds, v), expected, "{v} of {speeds:?}");
        }
    }
}
