//! Comparison of the methods at a left-out speed: the curve of each in the same multi-body
//! model, against FE.

use serde::Serialize;

use super::left_out::{LeftOutCase, NotLeftOut};
use super::methods::{self, ComparisonSettings, Method};
use super::reference::Reference;
use super::row::{Row, RowBuilder};
use super::validate::without_repeated;
use crate::curve::Case;
use crate::dataset::{
    TrainingCase, TrainingSet, is_same_speed, is_within, nearest_case, nearly_same,
};
use crate::error::{Error, ErrorCode, error};
use crate::nsdm::{self, Identifiability, Nsdm, Start};
use crate::unit::{SpeedKind, km_per_h};
use crate::words::counted;

/// Errors of every method at one left-out speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Comparison {
    /// Name of the group.
    pub group: String,
    /// Name of the case that is left out.
    pub case: String,
    /// Its speed, in m/s.
    pub speed_m_per_s: f64,
    /// What that speed is measured against.
    pub speed_kind: SpeedKind,
    /// Whether the other cases lie on both sides of the speed.
    pub inner: bool,
    /// Mass of the one-mass model: the body's, or the reduced mass of a pair.
    pub mass_kg: f64,
    /// From contact to 30 ms after FE's maximum deflection, as far as the record reaches.
    pub window_s: f64,
    /// Whether the record ends before that.
    pub window_is_cut: bool,
    /// Peak force of FE's record, in N.
    #[serde(rename = "reference_peak_force_N")]
    pub reference_peak_force_n: f64,
    /// Maximum deflection of FE's record, in m.
    pub reference_max_crush_m: f64,
    /// Wall-clock time of FE for this run, in s; null where its case file is missing.
    pub fe_time_s: Option<f64>,
    /// The same for the runs that the curves were made from.
    pub training_time_s: Option<f64>,
    /// One row per method.
    pub rows: Vec<Row>,
    /// Methods without a row, with the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// What the fits of the spring and damper are worth; null if none was made.
    pub nsdm: Option<NsdmReport>,
}

/// What the fits of the spring and damper are worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct NsdmReport {
    /// Name of the case that they are fitted to.
    pub fitted_to: String,
    /// Its speed, in m/s.
    pub fitted_at_m_per_s: f64,
    /// What the search begins with.
    pub start: String,
    /// Of each seed: errors at the speed it was fitted at, and here.
    pub fits: Vec<NsdmFit>,
    /// How far the fits differ; null for fewer than three.
    #[cfg_attr(test, schemars(with = "Option<serde_json::Value>"))]
    pub identifiability: Option<Identifiability>,
}

/// One fit of the spring and damper.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct NsdmFit {
    /// Seed of its random draws.
    pub seed: u64,
    /// Ratio of the errors of the velocity at the speed it was fitted at.
    pub own_velocity_l1: f64,
    /// The same for the acceleration.
    pub own_acceleration_l1: f64,
    /// Ratio of the errors of the velocity at the speed that is left out.
    pub velocity_l1: f64,
    /// The same for the acceleration.
    pub acceleration_l1: f64,
    /// Time the fit took, in s.
    pub fit_time_s: f64,
    /// Secant stiffness over the deflection and damping over the speed, linear between the points and held beyond:
    /// `deflection_m`, `stiffness_N_per_m`, `speed_m_per_s`, `damping_N_s_per_m`; the force is `k(x) x + c(|x'|) x'`.
    #[cfg_attr(test, schemars(with = "serde_json::Value"))]
    pub law: Nsdm,
}

/// Which cases a comparison leaves out: indices among those of a group's training set; and why others are not compared.
pub(crate) type Compared = (Vec<usize>, Vec<String>);

/// The cases of a group whose speeds lie between others. The speed of a fixed curve, in m/s, is not one of them.
pub(crate) fn inner_cases(
    group: &str,
    cases: &[Case],
    fixed_m_per_s: Option<f64>,
) -> Result<Compared, Error> {
    let set = TrainingSet::new(group, cases)?;
    let all = set.speeds_m_per_s();
    let mut speeds = all.clone();
    speeds.dedup_by(|v, before| is_within(*v, nearly_same(&all, *before)));
    if speeds.len() < 3 {
        return Err(too_few(speeds.len()));
    }
    let ends = [all[0], all[all.len() - 1]];
    let is_inner = |v: f64| {
        let left_out = nearly_same(&all, v);
        ends.iter().chain(&fixed_m_per_s).all(|s| !is_within(*s, left_out))
    };
    let (judged, repeated) = without_repeated(&set);
    let inner = judged.into_iter().filter(|&k| is_inner(set.cases[k].speed_m_per_s));
    let (cut, whole): (Vec<usize>, Vec<usize>) = inner.partition(|&k| set.cases[k].truncated);
    let cut: Vec<String> = cut.into_iter().map(|k| set.cases[k].name.clone()).collect();
    if whole.is_empty() && cut.is_empty() {
        return Err(error!(
            Comparison,
            "the fixed curve is that of the only inner speed: choose another one"
        ));
    }
    if whole.is_empty() {
        return Err(error!(
            Comparison,
            "all cases of inner speeds ended while loading ({}): none can serve as the reference",
            cut.join(", ")
        ));
    }
    Ok((whole, cut.into_iter().map(not_compared).chain(repeated).collect()))
}

fn not_compared(case: String) -> String {
    format!("case \"{case}\" ended while loading and cannot serve as the reference: not compared")
}

/// The cases of a group at a speed in m/s.
pub(crate) fn cases_at(group: &str, cases: &[Case], speed_m_per_s: f64) -> Result<Compared, Error> {
    let set = TrainingSet::new(group, cases)?;
    let is_there = |&k: &usize| is_same_speed(set.cases[k].speed_m_per_s, speed_m_per_s);
    let there = (0..set.cases.len()).filter(is_there);
    let (cut, whole): (Vec<usize>, Vec<usize>) = there.partition(|&k| set.cases[k].truncated);
    match (whole.is_empty(), cut.is_empty()) {
        (true, true) => Err(no_case(group, speed_m_per_s, &set)),
        // The comparison says why there is none.
        (true, false) => Ok((cut, Vec::new())),
        _ => {
            Ok((whole, cut.into_iter().map(|k| not_compared(set.cases[k].name.clone())).collect()))
        }
    }
}

/// The case of a name.
pub(crate) fn case_named(group: &str, cases: &[Case], name: &str) -> Result<Option<usize>, Error> {
    let set = TrainingSet::new(group, cases)?;
    Ok(set.cases.iter().position(|case| case.name == name))
}

/// Compares the methods by the training set's case `index`, with the cases of its speed left out of training.
///
/// The model is one body against a wall, with the effective mass of the case; the
/// reference is FE's rate of deflection. Accelerations are central differences over the
/// sampled times of both, as FE's contact forces are means over two output intervals.
pub(crate) fn compare(
    group: &str,
    cases: &[Case],
    index: usize,
    settings: &ComparisonSettings,
) -> Result<Comparison, Error> {
    let set = TrainingSet::new(group, cases)?;
    let left_out = left_out(index, &set)?;
    let LeftOutCase { case, rest, reference, .. } = &left_out;
    let speed = case.conditions.speed.m_per_s;
    if let Some(asked) = settings.fixed_speed_m_per_s
        && is_within(asked, nearly_same(&set.speeds_m_per_s(), left_out.own.speed_m_per_s))
    {
        let own = left_out.own.speed_m_per_s;
        let which = match is_same_speed(asked, own) {
            true => "the speed that is left out".into(),
            false => {
                format!("which is left out with {}, since it nearly repeats it", km_per_h(own))
            }
        };
        return Err(error!(
            Comparison,
            "the fixed curve is that of {asked}, {which}: choose another one",
            asked = km_per_h(asked)
        ));
    }
    let fixed = fixed_case(group, &left_out, settings)?;
    let fixed_case: &Case = &fixed.case;
    let times = rest.cases.iter().map(|case| case.solver_time_s());
    let training_time_s: Option<f64> =
        times.collect::<Option<Vec<f64>>>().map(|times| times.iter().sum());
    let rows = RowBuilder {
        reference,
        max_crush_m: case.max_deflection_m(),
        fe_time_s: case.provenance.solver_wall_time_s,
        fe_rebound_m_per_s: left_out.own.motion.rebound_speed_m_per_s,
        training_time_s,
    };

    let mut compared = Vec::new();
    for method in methods::of_fe(&left_out) {
        compared.push(rows.row(method)?);
    }
    compared.push(rows.row(methods::fdrm(&left_out, fixed, fixed_case))?);
    let mut report = None;
    if settings.nsdm_seeds > 0 {
        let mut fitted = methods::fit_nsdm(fixed_case, settings)?;
        fitted.training_s = fixed.solver_time_s();
        compared.push(rows.of_nsdm(&fitted)?);
        report = Some(nsdm_report(&fitted, fixed_case, reference, settings)?);
    }
    let mut missing = Vec::new();
    let mut add =
        |name: &str, predict: &dyn Fn() -> Result<Method, Error>, rows_of: &mut Vec<Row>| {
            match predict() {
                Ok(method) => rows_of.push(rows.row(method)?),
                Err(error) => missing.push(format!("{name} has no row: {error}")),
            }
            Ok::<(), Error>(())
        };
    add("ddtcm", &|| methods::ddtcm(&left_out, settings.seed), &mut compared)?;
    let best = || methods::best(&left_out, group, &set.others(cases, speed), settings.seed);
    add("best", &best, &mut compared)?;
    if case.moves_by_its_force() {
        missing.push("fe has no row: the curve has no times, and the errors are against a motion that is made of its own force".into());
    }

    Ok(Comparison {
        group: group.into(),
        case: case.id.name.clone(),
        speed_m_per_s: speed,
        speed_kind: case.conditions.speed.kind,
        inner: left_out.inner,
        mass_kg: case.conditions.masses.effective_kg(),
        window_s: reference.window_s(),
        window_is_cut: reference.is_cut,
        reference_peak_force_n: case.peak_force_n(),
        reference_max_crush_m: case.max_deflection_m(),
        fe_time_s: case.provenance.solver_wall_time_s,
        training_time_s,
        rows: compared,
        missing,
        nsdm: report,
    })
}

/// Whether a method has a row in each of the comparisons, so that its means are those of the others.
pub(crate) fn has_all(comparisons: &[Comparison], method: &str) -> bool {
    comparisons.iter().all(|c| c.rows.iter().any(|row| row.method == method))
}

/// Mean of a method's rows over the comparisons.
pub(crate) fn mean(comparisons: &[Comparison], method: &str, of: impl Fn(&Row) -> f64) -> f64 {
    let rows = || comparisons.iter().flat_map(|c| &c.rows).filter(|row| row.method == method);
    rows().map(of).sum::<f64>() / rows().count() as f64
}

/// The case `index`, left out of the group; at least two others must remain.
fn left_out(index: usize, set: &TrainingSet) -> Result<LeftOutCase<'_>, Error> {
    let too_few = || too_few(set.cases.len());
    if set.cases.len() < 3 {
        return Err(too_few());
    }
    match LeftOutCase::new(set, index) {
        Ok(left_out) if left_out.rest.cases.len() < 2 => Err(too_few()),
        Ok(left_out) => Ok(left_out),
        Err(NotLeftOut::Truncated { case }) => Err(error!(
            Comparison,
            "case \"{case}\" ended while loading and cannot serve as the reference: compare at another speed"
        )),
        Err(NotLeftOut::Motion(error)) => Err(error),
        Err(NotLeftOut::TooFew { .. }) => Err(too_few()),
        Err(error) => Err(Error::below(ErrorCode::Comparison, error)),
    }
}

fn too_few(cases: usize) -> Error {
    let cases = counted(cases, "case");
    error!(Comparison, "leaving out one of {cases} leaves too few: a comparison needs at least 3")
}

fn no_case(group: &str, asked_m_per_s: f64, set: &TrainingSet) -> Error {
    let mut known: Vec<String> = set.speeds_m_per_s().into_iter().map(km_per_h).collect();
    known.dedup();
    error!(
        Comparison,
        "group \"{group}\" has no case at {asked}: it has {known}",
        asked = km_per_h(asked_m_per_s),
        known = known.join(", ")
    )
}

/// The one case that FDRM and NSDM use: of the speed that was requested, else the nearest; of several, that whose parameters are nearest
/// to those of the case that is left out.
fn fixed_case<'a>(
    group: &str,
    left_out: &'a LeftOutCase<'_>,
    settings: &ComparisonSettings,
) -> Result<&'a TrainingCase, Error> {
    let (own, rest) = (left_out.own, &left_out.rest);
    let may_serve = |c: &&TrainingCase| match settings.fixed_speed_m_per_s {
        Some(asked) => is_same_speed(c.speed_m_per_s, asked),
        // A run that ended while loading does not show a whole impact.
        None => !c.truncated,
    };
    let all = || rest.cases.iter().map(|c| &**c);
    let mut from: Vec<&TrainingCase> = all().filter(may_serve).collect();
    match settings.fixed_speed_m_per_s {
        Some(asked) if from.is_empty() => return Err(no_case(group, asked, rest)),
        None if from.is_empty() => from = all().collect(),
        _ => {}
    }
    let points = from.iter().map(|c| (c.speed_m_per_s, &c.features[..]));
    Ok(from[nearest_case(points, (own.speed_m_per_s, &own.features))])
}

/// Errors of every seed's fit, at the speed it was fitted at and here.
fn nsdm_report(
    fitted: &methods::FittedNsdm,
    fixed: &Case,
    reference: &Reference,
    settings: &ComparisonSettings,
) -> Result<NsdmReport, Error> {
    let errors_at = |fit: &nsdm::Fit, at: &Reference| -> Result<_, Error> {
        let motion = fit.model.run(at.mass_kg, at.speed_m_per_s, &at.time_s)?;
        Ok(at.errors_of(&motion.v_m_per_s))
    };
    let mut fits = Vec::new();
    for (fit, fit_time_s) in &fitted.fits {
        let (own, here) = (errors_at(fit, &fitted.reference)?, errors_at(fit, reference)?);
        fits.push(NsdmFit {
            seed: fit.seed,
            own_velocity_l1: own.velocity_l1,
            own_acceleration_l1: own.acceleration_l1,
            velocity_l1: here.velocity_l1,
            acceleration_l1: here.acceleration_l1,
            fit_time_s: *fit_time_s,
            law: fit.model.clone(),
        });
    }
    let all: Vec<nsdm::Fit> = fitted.fits.iter().map(|(fit, _)| fit.clone()).collect();
    Ok(NsdmReport {
        fitted_to: fixed.id.name.clone(),
        fitted_at_m_per_s: fixed.conditions.speed.m_per_s,
        start: match settings.nsdm_start {
            Start::Random => "random".into(),
            Start::LeastSquares => "least squares".into(),
        },
        fits,
        identifiability: Identifiability::of(&all).ok(),
    })
}
