//! `gp`: principal scores of registered curves, each a Gaussian process over the features.

use egobox_gp::GaussianProcess;
use egobox_gp::correlation_models::SquaredExponentialCorr;
use egobox_gp::mean_models::{ConstantMean, LinearMean};
use linfa::Dataset;
use linfa::traits::Fit;
use linfa_linalg::eigh::EighInto;
use ndarray::{Array1, Array2, Axis};

use super::landmarks::{Landmarks, Warp};
use super::{At, CaseCurve, Surrogate};

/// Curves are warped onto the landmarks of the middle speed (with one feature; several
/// cannot be followed) and reduced to their principal components; each score is a Gaussian
/// process in speed and the further features. A curve that ends goes on as the next faster.
///
/// The processes are fitted when they are asked: a handful of cases takes milliseconds, and
/// the model file then holds the curves and nothing that could disagree with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gp;

/// Points of the common abscissa.
const POINTS: usize = 400;
/// Components that carry less than this share of the largest one's variance are left out.
const LEAST_VARIANCE: f64 = 1e-6;
/// Points per unknown of the trend at which it is a plane and not a constant.
const SAMPLES_PER_UNKNOWN: usize = 2;

impl Surrogate for Gp {
    fn force_n(&self, cases: &[CaseCurve], at: &At<'_>, deflection_m: &[f64]) -> Vec<f64> {
        predict(cases, at, deflection_m).unwrap_or_else(|| vec![f64::NAN; deflection_m.len()])
    }
}

fn predict(cases: &[CaseCurve], at: &At<'_>, deflection_m: &[f64]) -> Option<Vec<f64>> {
    let landmarks = match at.features.is_empty() {
        true => Landmarks::of(cases),
        false => Landmarks::default(),
    };
    let middle = cases.get(cases.len() / 2)?.speed_m_per_s;
    let common = landmarks.at(cases, middle);
    let to_common = |(k, d): &(usize, f64)| {
        let to = common.iter().find(|(other, _)| other == k)?.1;
        Some((*d, to))
    };
    let reach = cases.iter().map(CaseCurve::end_m).fold(0.0, f64::max);
    let rows: Vec<Vec<f64>> = (0..cases.len())
        .map(|i| {
            let pairs = common.iter().filter_map(|&(k, d)| Some((d, landmarks.position(k, i)?)));
            let warp = Warp::new(pairs);
            (0..=POINTS).map(|p| warp.at(reach * p as f64 / POINTS as f64)).collect()
        })
        .collect();
    let curves = filled(cases, &rows);
    let force = at_query(cases, &curves, at)?;
    let warp = Warp::new(landmarks.at(cases, at.speed_m_per_s).iter().filter_map(to_common));
    let value = |d: f64| {
        let x = (warp.at(d) / reach * POINTS as f64).clamp(0.0, POINTS as f64);
        let i = (x as usize).min(POINTS - 1);
        let share = x - i as f64;
        ((1.0 - share) * force[i] + share * force[i + 1]).max(0.0)
    };
    Some(deflection_m.iter().map(|&d| value(d)).collect())
}

/// Forces at the warped deflections, cases × points; beyond its end a case has the force
/// of the next faster one that goes so far, or holds its own.
fn filled(cases: &[CaseCurve], deflections: &[Vec<f64>]) -> Array2<f64> {
    let mut curves = Array2::zeros((cases.len(), POINTS + 1));
    for i in (0..cases.len()).rev() {
        for (p, &d) in deflections[i].iter().enumerate() {
            curves[[i, p]] = match cases[i].reaches(d) || i + 1 == cases.len() {
                true => cases[i].force_at(d),
                false => curves[[i + 1, p]],
            };
        }
    }
    curves
}

/// The curve at the query from the scores' processes.
fn at_query(cases: &[CaseCurve], curves: &Array2<f64>, at: &At<'_>) -> Option<Array1<f64>> {
    let mean = curves.mean_axis(Axis(0))?;
    let centred = curves - &mean;
    // Few cases, many points: the components of the small Gram matrix are the same.
    let (variances, vectors) = centred.dot(&centred.t()).eigh_into().ok()?;
    let largest = variances.iter().copied().fold(0.0, f64::max);
    let inputs = standardised(cases, at);
    if !inputs.0.iter().chain(&inputs.1).all(|x| x.is_finite()) {
        return None;
    }
    let mut force = mean;
    for (variance, vector) in variances.iter().zip(vectors.axis_iter(Axis(1))) {
        if *variance <= LEAST_VARIANCE * largest || largest <= 0.0 {
            continue;
        }
        // The scores are vector √variance, the component is centredᵀ vector / √variance.
        let score = process(&inputs.0, &vector.to_owned(), &inputs.1)?;
        force = force + centred.t().dot(&vector) * score;
    }
    Some(force)
}

/// Speeds and features, each centred and in ratio to its spread: of the cases, of the query.
fn standardised(cases: &[CaseCurve], at: &At<'_>) -> (Array2<f64>, Array2<f64>) {
    let columns = 1 + at.features.len();
    let of = |case: &CaseCurve, k: usize| match k {
        0 => case.speed_m_per_s,
        _ => case.features[k - 1],
    };
    let mut inputs = Array2::from_shape_fn((cases.len(), columns), |(i, k)| of(&cases[i], k));
    let mut query = Array2::from_shape_fn((1, columns), |(_, k)| match k {
        0 => at.speed_m_per_s,
        _ => at.features[k - 1],
    });
    for k in 0..columns {
        let column = inputs.column(k);
        let mean = column.mean().unwrap_or(0.0);
        let spread = column.std(0.0);
        let scale = if spread > 0.0 { spread } else { 1.0 };
        inputs.column_mut(k).mapv_inplace(|x| (x - mean) / scale);
        query.column_mut(k).mapv_inplace(|x| (x - mean) / scale);
    }
    (inputs, query)
}

/// Prediction of one score. Its trend is a plane where the cases can carry one, else a
/// constant: the columns of categories add up to one and leave no plane to determine.
fn process(inputs: &Array2<f64>, scores: &Array1<f64>, query: &Array2<f64>) -> Option<f64> {
    let data = Dataset::new(inputs.clone(), scores.clone());
    let correlation = SquaredExponentialCorr::default;
    let first = |values: Array1<f64>| values.first().copied().filter(|s| s.is_finite());
    let plane = || {
        let mean = LinearMean::default();
        let process =
            GaussianProcess::<f64, LinearMean, SquaredExponentialCorr>::params(mean, correlation());
        first(process.fit(&data).ok()?.predict(query).ok()?)
    };
    let constant = || {
        let mean = ConstantMean::default();
        let process = GaussianProcess::<f64, ConstantMean, SquaredExponentialCorr>::params(
            mean,
            correlation(),
        );
        first(process.fit(&data).ok()?.predict(query).ok()?)
    };
    if inputs.nrows() >= SAMPLES_PER_UNKNOWN * (inputs.ncols() + 1) {
        plane().or_else(constant)
    } else {
        constant()
    }
}
