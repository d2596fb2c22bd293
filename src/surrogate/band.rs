//! Bands: deviation of FE curves from the model at speeds it was not trained on.
//!
//! The half width is Student's t times the root mean square of the left-out residuals, relative to the local level of
//! the force. (A pointwise quantile of two to five residuals would be their largest and promise more than they can.)
//! Neighbouring residuals of a curve belong to one fold and are one observation; its folds are several. So t has the
//! degrees of freedom of the stretches over which a curve's residuals are alike. The band that must hold a whole curve
//! has those of the curves, and so have bands outside the training speeds, where a whole curve drifts away. Each states on
//! how many curves it is based.
//!
//! Leaving out a speed opens a gap about twice as wide as a query encounters. So residuals are divided by the power 0.5
//! of their gap, and the band is the result times the same power of the query's gap: that between the two
//! training speeds around it; at a training speed, the wider of the two adjacent gaps. A left-out speed lies in the
//! middle of its gap, so it does not show how fast errors decrease towards the gap's ends.
//!
//! Gaps count by the roots of their speeds, as forces follow them in the models `rate` and `crush-law`: over as many m/s slow
//! runs differ more than fast ones. By the speeds themselves the bands of slow queries are too narrow, by their logarithms those of fast ones.
//!
//! If speeds have several runs, their scatter is a separate part: the deviation of a single run from the mean of its
//! kind does not depend on the gap. A left-out residual is that of interpolation plus the scatter of the runs it is measured
//! against (for n runs the n-th part), which is subtracted from its square; the half width is the root of the squares of both parts.
//!
//! The declared force and the body force each have a band, from their own residuals and scatter.
//!
//! Outside the training speeds, the band is based on left-out ends, in proportion to the distance by the roots of the speeds: those of
//! all speeds, and those that are left without the outermost one or two. Over as many m/s the runs below the range differ more
//! than those above it. Further outside than
//! a third of the range, a prediction needs `--extrapolate`. In multi-body runs this is only a warning: inside a train,
//! interfaces close far more slowly than any run by itself.

use serde::{Deserialize, Serialize};

use crate::dataset::is_same_speed;
use crate::order;

/// The level that bands are made for.
pub(crate) const LEVEL: f64 = 0.9;
/// Half width, as a share of the curve's end, over which the force's level is averaged.
const WINDOW: f64 = 0.05;
/// Between training speeds errors grow with this power of the gap, as the spread of a random walk does: a smooth change
/// alone would give 1 or more; folds peculiar to each run, 0. With it, in subsets of lead-car-wall, vehicle-pair and
/// staged-lead-wall, the bands of every model hold 86 to 94 % of FE's points over gaps narrower than the mean of those
/// left out (`crumple validate curves.h5 --group lead-car-wall --subsets`, and the other two).
pub(crate) const POWER_OF_GAP: f64 = 0.5;
/// Bands wider than this are damage, not measurement.
const WIDEST: f64 = 1e6;

/// The left-out speeds that a band rests on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum LeftOutSpeeds {
    /// Speeds between others: for queries between training speeds.
    #[default]
    Inner,
    /// Ends of the range, and of the range without its outermost speeds: for queries outside the training speeds.
    Ends,
}

impl LeftOutSpeeds {
    /// Those of a speed that lies between others, or does not.
    pub(crate) fn of(inner: bool) -> Self {
        if inner { Self::Inner } else { Self::Ends }
    }

    /// Power of the span with which errors grow.
    ///
    /// Between training speeds a curve twice as far apart from its neighbours is not twice as
    /// wrong, since part of what a fold does has nothing to do with the distance. Nothing holds a
    /// curve outside of them, so there the error grows in proportion.
    fn power(self) -> f64 {
        match self {
            Self::Inner => POWER_OF_GAP,
            Self::Ends => 1.0,
        }
    }
}

/// An empirical range around a predicted force, from the residuals of left-out speeds.
///
/// Residuals are taken relative to the local level of the force, and to the span over which each
/// was predicted: a left-out speed opens a wider gap than a query finds. With a handful of curves
/// no level can be guaranteed; the range is the one that a further residual of the same kind
/// would lie in: their root mean square times Student's t, for as many independent stretches as the
/// curves have; for a whole curve, and outside the training speeds, for as many curves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Band {
    /// Level that the range is stated for.
    pub level: f64,
    /// Left-out curves it rests on.
    pub curves: usize,
    /// Which speeds these were.
    #[serde(default)]
    pub(crate) left_out: LeftOutSpeeds,
    /// What the half widths below hold for. `inner`: distance of the two training speeds that a
    /// query lies between, and the widths scale with its power 0.5; `ends`: distance to the
    /// nearest training speed, and they are in proportion to it at the same `around_m_per_s`.
    pub span_m_per_s: f64,
    /// Middle of those two speeds; over equal distances the widths are in proportion to its power −0.25, for `ends` −0.5.
    /// 0 for `ends` of earlier versions, where only the distance counts.
    #[serde(default)]
    pub around_m_per_s: f64,
    /// Half width at any one deflection, as a share of the local level of the force.
    pub pointwise_share: f64,
    /// Half width that holds for the whole curve.
    pub simultaneous_share: f64,
    /// The part of both that comes from the scatter between repeated runs, whatever the span; the
    /// squares of it and of the error of interpolation add. Absent without such runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) scatter: Option<ScatterWidths>,
    /// Share of the left-out points inside the band that the other curves give over the same
    /// span; `None` with fewer than two curves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Share of the left-out curves that lie wholly inside `simultaneous_share` of the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole_curves: Option<f64>,
    /// Mean difference between coverage and level, over all levels from 0 to 1 (integrated absolute error): 0 is
    /// perfect, 0.5 the worst.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_error: Option<f64>,
}

/// Half widths that the scatter between repeated runs gives by itself: Student's t times its root mean
/// square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct ScatterWidths {
    /// As for [`Band::pointwise_share`].
    pub pointwise_share: f64,
    /// As for [`Band::simultaneous_share`].
    pub simultaneous_share: f64,
}

/// Scatter of one force between repeated runs, relative to its local level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceScatter {
    /// Runs at the speeds that have several, minus one for the mean of each.
    pub degrees_of_freedom: usize,
    /// Root mean square of the residuals.
    pub force_share: f64,
    /// Root mean square over the runs of their largest residuals.
    pub largest_force_share: f64,
}

impl ScatterWidths {
    fn of(scatter: ForceScatter) -> Option<Self> {
        let t = student_t(scatter.degrees_of_freedom)?;
        Some(Self {
            pointwise_share: t * scatter.force_share,
            simultaneous_share: t * scatter.largest_force_share,
        })
    }
}

/// What remains of a root of added squares without one of its parts.
fn without(whole: f64, part: f64) -> f64 {
    (whole * whole - part * part).max(0.0).sqrt()
}

/// Over which speeds a curve is predicted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gap {
    /// As for [`Band::span_m_per_s`].
    pub span_m_per_s: f64,
    /// As for [`Band::around_m_per_s`].
    pub around_m_per_s: f64,
}

impl Gap {
    fn between(low: f64, high: f64) -> Self {
        Self { span_m_per_s: high - low, around_m_per_s: 0.5 * (low + high) }
    }

    /// By how much the errors over it are larger than over another.
    fn over(self, other: Self, left_out: LeftOutSpeeds) -> f64 {
        let wider = self.span_m_per_s / other.span_m_per_s;
        let faster = self.around_m_per_s / other.around_m_per_s;
        match left_out {
            // √b − √a is about (b − a)/(2√middle).
            _ if faster > 0.0 && faster.is_finite() => {
                libm::pow(wider / faster.sqrt(), left_out.power())
            }
            // Ends of earlier versions state no middle.
            _ => libm::pow(wider, left_out.power()),
        }
    }
}

/// Residuals of one left-out curve relative to the local level of the prediction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Residuals {
    pub gap: Gap,
    pub ratios: Vec<f64>,
    /// How many runs the left-out curve is the mean of.
    pub runs: usize,
    /// Whether the group's cases differ in speed and mass alone: those of one speed, which are left out together, are one curve.
    pub is_of_masses: bool,
    /// How many stretches of it lie above or below the prediction by themselves.
    stretches: usize,
}

impl Residuals {
    pub(crate) fn new(gap: Gap, ratios: Vec<f64>, runs: usize) -> Self {
        Self { stretches: stretches(&ratios), gap, ratios, runs, is_of_masses: false }
    }

    /// Whether both are of one speed and differ in mass alone.
    fn is_with(&self, other: &Self) -> bool {
        self.is_of_masses && self.gap == other.gap
    }

    /// Share of the points within a half width.
    fn inside(&self, share: f64) -> f64 {
        let inside = self.ratios.iter().filter(|r| r.abs() <= share).count();
        inside as f64 / self.ratios.len().max(1) as f64
    }

    /// Share of the points within a band, over their own span.
    pub(crate) fn inside_of(&self, band: Band) -> Option<f64> {
        Some(self.inside(band.over(self.gap)?.share_of_mean(self.runs)))
    }

    /// Whether its gap is narrower than that of a band.
    pub(crate) fn is_over_less_than(&self, band: Band) -> bool {
        let Band { span_m_per_s, around_m_per_s, .. } = band;
        self.gap.over(Gap { span_m_per_s, around_m_per_s }, band.left_out) < 1.0
    }

    /// Of one point, so that every curve weighs the same.
    fn weight(&self) -> f64 {
        1.0 / self.ratios.len().max(1) as f64
    }
}

/// How many independent values residuals at even deflections are worth: their number over the integral
/// of their autocorrelation, to its first zero (Bartlett, Journal of the Royal Statistical Society 98,
/// 1935); 1 at least.
fn stretches(ratios: &[f64]) -> usize {
    let n = ratios.len();
    let correlated = |lag: usize| -> f64 {
        ratios[..n - lag].iter().zip(&ratios[lag..]).map(|(a, b)| a * b).sum::<f64>()
            / (n - lag) as f64
    };
    if n == 0 || correlated(0) <= 0.0 {
        return 1;
    }
    let ratio = |lag: usize| correlated(lag) / correlated(0);
    let length = 1.0 + 2.0 * (1..n).map(ratio).take_while(|r| *r > 0.0).sum::<f64>();
    ((n as f64 / length) as usize).max(1)
}

/// The ratios `(FE − prediction) / level` at even deflections.
pub(crate) fn ratios(reference_n: &[f64], predicted_n: &[f64]) -> Vec<f64> {
    let ratio = |((r, p), level): ((&f64, &f64), f64)| (r - p) / level;
    reference_n.iter().zip(predicted_n).zip(level(predicted_n)).map(ratio).collect()
}

/// The two neighbouring training speeds that `v` lies between, the outermost two outside of all; `None` for fewer than two
/// speeds. `speeds` do not fall.
///
/// At a training speed it is the wider of the gaps that end there: left-out speeds lie in the
/// middle of their gaps and do not show how fast the error decreases towards the ends of one.
pub(crate) fn gap(speeds: &[f64], v: f64) -> Option<Gap> {
    let mut speeds = speeds.to_vec();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    let gaps = || speeds.windows(2);
    let of = |gap: &[f64]| Gap::between(gap[0], gap[1]);
    let wider = |a: Gap, b: Gap| if b.over(a, LeftOutSpeeds::Inner) > 1.0 { b } else { a };
    let is_around = |gap: &&[f64]| {
        (gap[0] <= v || is_same_speed(gap[0], v)) && (v <= gap[1] || is_same_speed(gap[1], v))
    };
    let outermost = if v < *speeds.first()? { gaps().next() } else { gaps().next_back() };
    gaps().filter(is_around).map(of).reduce(wider).or(outermost.map(of))
}

/// How far `v` lies outside of training speeds, which do not fall; `None` between them.
pub(crate) fn outside(speeds: &[f64], v: f64) -> Option<Gap> {
    let (&low, &high) = speeds.first().zip(speeds.last())?;
    let span_m_per_s = (low - v).max(v - high);
    let is_outside = span_m_per_s > 0.0 && !is_same_speed(low, v) && !is_same_speed(high, v);
    let end = if v < low { low } else { high };
    is_outside.then_some(Gap { span_m_per_s, around_m_per_s: 0.5 * (end + v) })
}

/// Local level of a force at even deflections: its mean over ±5 % of the curve.
fn level(force_n: &[f64]) -> Vec<f64> {
    let n = force_n.len();
    let half = ((WINDOW * n as f64).round() as usize).max(1);
    let mean = force_n.iter().sum::<f64>() / n.max(1) as f64;
    let at = |i: usize| {
        let around = &force_n[i.saturating_sub(half)..(i + half + 1).min(n)];
        // A stretch without force is as uncertain as its neighbourhood, not certain.
        (around.iter().sum::<f64>() / around.len() as f64).max(0.1 * mean).max(f64::MIN_POSITIVE)
    };
    (0..n).map(at).collect()
}

impl Band {
    /// The band that left-out curves give; `None` without any.
    pub(crate) fn of(
        left_out: LeftOutSpeeds,
        curves: &[Residuals],
        scatter: Option<ForceScatter>,
    ) -> Option<Self> {
        let all: Vec<&Residuals> = curves.iter().collect();
        let mut band = Self::without_coverage(left_out, &all, scatter).filter(Self::is_sound)?;
        let own = |i: usize| Some((&curves[i], without_own(left_out, curves, i, scatter)?));
        let checked: Vec<(&Residuals, (Self, usize))> = (0..curves.len()).filter_map(own).collect();
        let mean = |of: &dyn Fn(&Residuals, Self, usize) -> f64| {
            let sum: f64 = checked.iter().map(|(own, (band, t))| of(own, *band, *t)).sum();
            (!checked.is_empty()).then(|| sum / checked.len() as f64)
        };
        band.coverage = mean(&|own, band, _| own.inside(band.share_of_mean(own.runs)));
        band.whole_curves =
            mean(&|own, band, _| f64::from(own.inside(band.simultaneous_share) == 1.0));
        band.calibration_error = (!checked.is_empty()).then(|| {
            let levels = checked.iter().flat_map(|(own, (band, degrees))| {
                let sigma = band.share_of_mean(own.runs) / student_t(*degrees).unwrap_or(1.0);
                let level = move |r: &f64| (inside_t(r.abs() / sigma, *degrees), own.weight());
                own.ratios.iter().map(level)
            });
            calibration_error(levels.collect())
        });
        Some(band)
    }

    fn without_coverage(
        left_out: LeftOutSpeeds,
        curves: &[&Residuals],
        scatter: Option<ForceScatter>,
    ) -> Option<Self> {
        let shares = shares(curves);
        let n = shares.iter().sum::<f64>();
        let t_of_curves = student_t(n.round() as usize)?;
        let t_of_points = student_t(degrees_of_freedom(left_out, curves))?;
        let sum = |of: &dyn Fn(&Residuals) -> f64| -> f64 {
            curves.iter().zip(&shares).map(|(r, share)| share * of(r)).sum()
        };
        let mean = |of: fn(&Gap) -> f64| sum(&|r| of(&r.gap)) / n;
        let gap = Gap {
            span_m_per_s: mean(|gap| gap.span_m_per_s),
            around_m_per_s: mean(|gap| gap.around_m_per_s),
        };
        let over_span = |of: &dyn Fn(&[f64]) -> f64, scatter: Option<f64>| {
            let of = |r: &Residuals| {
                let of_scatter = scatter.map_or(0.0, |s| s * s / r.runs as f64);
                (of(&r.ratios) - of_scatter) / r.gap.over(gap, left_out).powi(2)
            };
            (sum(&of) / n).max(0.0).sqrt()
        };
        let squares = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>() / r.len().max(1) as f64;
        let largest = |r: &[f64]| r.iter().fold(0.0_f64, |m, x| m.max(x.abs())).powi(2);
        let band = Self {
            level: LEVEL,
            curves: n.round() as usize,
            left_out,
            span_m_per_s: gap.span_m_per_s,
            around_m_per_s: gap.around_m_per_s,
            pointwise_share: t_of_points * over_span(&squares, scatter.map(|s| s.force_share)),
            simultaneous_share: t_of_curves
                * over_span(&largest, scatter.map(|s| s.largest_force_share)),
            scatter: None,
            coverage: None,
            whole_curves: None,
            calibration_error: None,
        };
        Some(band.and(scatter.and_then(ScatterWidths::of)))
    }

    /// A band of interpolation alone with a scatter added.
    fn and(self, scatter: Option<ScatterWidths>) -> Self {
        let Some(of) = scatter else { return self };
        Self {
            pointwise_share: libm::hypot(self.pointwise_share, of.pointwise_share),
            simultaneous_share: libm::hypot(self.simultaneous_share, of.simultaneous_share),
            scatter,
            ..self
        }
    }

    /// The band of interpolation alone.
    fn of_interpolation(self) -> Self {
        let Some(of) = self.scatter else { return self };
        Self {
            pointwise_share: without(self.pointwise_share, of.pointwise_share),
            simultaneous_share: without(self.simultaneous_share, of.simultaneous_share),
            scatter: None,
            ..self
        }
    }

    /// The part of the pointwise half width that comes from interpolation.
    pub fn interpolation_share(&self) -> f64 {
        self.of_interpolation().pointwise_share
    }

    /// Pointwise half width for the mean of so many runs.
    fn share_of_mean(&self, runs: usize) -> f64 {
        let mean = |of: ScatterWidths| ScatterWidths {
            pointwise_share: of.pointwise_share / (runs as f64).sqrt(),
            ..of
        };
        self.of_interpolation().and(self.scatter.map(mean)).pointwise_share
    }

    /// The same band over another gap; `None` if the scaled widths are not finite numbers.
    pub(crate) fn over(self, gap: Gap) -> Option<Self> {
        let Self { span_m_per_s, around_m_per_s, .. } = self;
        let factor = gap.over(Gap { span_m_per_s, around_m_per_s }, self.left_out);
        let interpolation = self.of_interpolation();
        let band = Self {
            span_m_per_s: gap.span_m_per_s,
            around_m_per_s: gap.around_m_per_s,
            pointwise_share: factor * interpolation.pointwise_share,
            simultaneous_share: factor * interpolation.simultaneous_share,
            ..interpolation
        };
        Some(band.and(self.scatter)).filter(Self::is_sound)
    }

    /// Whether its widths are numbers that a fit gives.
    pub(crate) fn is_sound(&self) -> bool {
        let sound = |share: f64| (0.0..=WIDEST).contains(&share);
        let of_scatter =
            self.scatter.map_or([0.0; 2], |s| [s.pointwise_share, s.simultaneous_share]);
        sound(self.pointwise_share)
            && sound(self.simultaneous_share)
            && of_scatter.into_iter().all(sound)
            && self.span_m_per_s > 0.0
            && self.span_m_per_s.is_finite()
            && (0.0..f64::INFINITY).contains(&self.around_m_per_s)
    }

    /// Lowest and highest force at each of a curve's even deflections, in N; never below 0.
    pub(crate) fn around(&self, force_n: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let widths = level(force_n).into_iter().map(|l| self.pointwise_share * l);
        force_n.iter().zip(widths).map(|(f, w)| ((f - w).max(0.0), f + w)).unzip()
    }
}

/// The band at speed `v` of a model of these training speeds, which do not fall.
///
/// Outside of them it follows the ends, growing with the distance, but never narrower than
/// just inside; `None` if nothing left out covers it.
pub(crate) fn at(inner: Option<Band>, ends: Option<Band>, speeds: &[f64], v: f64) -> Option<Band> {
    let inside = inner.zip(gap(speeds, v)).and_then(|(band, gap)| band.over(gap));
    let Some(distance) = outside(speeds, v) else { return inside };
    let outside = ends?.over(distance)?;
    Some(match inside {
        Some(inside) if inside.pointwise_share > outside.pointwise_share => inside,
        _ => outside,
    })
}

/// Degrees of freedom of the width at one deflection.
fn degrees_of_freedom(left_out: LeftOutSpeeds, curves: &[&Residuals]) -> usize {
    let of = |(r, share): (&&Residuals, f64)| match left_out {
        LeftOutSpeeds::Inner => share * r.stretches as f64,
        LeftOutSpeeds::Ends => share,
    };
    curves.iter().zip(shares(curves)).map(of).sum::<f64>().round() as usize
}

/// How much each curve counts: 1, or its share of those of one speed that differ in mass alone.
fn shares(curves: &[&Residuals]) -> Vec<f64> {
    let share = |r: &&Residuals| {
        let others = curves.iter().filter(|other| r.is_with(other)).count();
        1.0 / others.max(1) as f64
    };
    curves.iter().map(share).collect()
}

/// The band that the curves of other speeds than `i` give over its gap, with its degrees of freedom.
fn without_own(
    left_out: LeftOutSpeeds,
    curves: &[Residuals],
    i: usize,
    scatter: Option<ForceScatter>,
) -> Option<(Band, usize)> {
    let is_other = |&(k, r): &(usize, &Residuals)| k != i && !r.is_with(&curves[i]);
    let others: Vec<&Residuals> =
        curves.iter().enumerate().filter(is_other).map(|(_, r)| r).collect();
    let band = Band::without_coverage(left_out, &others, scatter)?.over(curves[i].gap)?;
    Some((band, degrees_of_freedom(left_out, &others)))
}

/// Share of curve `i`'s points inside the band that the other curves give over its span.
pub(crate) fn coverage(
    left_out: LeftOutSpeeds,
    curves: &[Residuals],
    i: usize,
    scatter: Option<ForceScatter>,
) -> Option<f64> {
    let (band, _) = without_own(left_out, curves, i, scatter)?;
    Some(curves[i].inside(band.share_of_mean(curves[i].runs)))
}

/// The integral over all levels of the difference between a level and the weight of the points that its band covers; each
/// point with the least level that covers it.
fn calibration_error(mut points: Vec<(f64, f64)>) -> f64 {
    order::sort(&mut points, |a, b| a.0.total_cmp(&b.0));
    let whole: f64 = points.iter().map(|(_, weight)| weight).sum();
    let (mut error, mut from, mut covered) = (0.0, 0.0, 0.0);
    // |level − covered| over an interval of levels in which nothing more is covered.
    let over = |from: f64, to: f64, covered: f64| {
        let area = |x: f64| 0.5 * (x - covered) * (x - covered).abs();
        area(to) - area(from)
    };
    for (level, weight) in points {
        error += over(from, level, covered);
        (from, covered) = (level, covered + weight / whole);
    }
    error + over(from, 1.0, covered)
}

/// Probability that Student's t with `n` degrees of freedom lies between −t and t (Abramowitz and Stegun 26.7.3 and
/// 26.7.4).
fn inside_t(t: f64, n: usize) -> f64 {
    let angle = libm::atan(t / (n as f64).sqrt());
    let (sine, cosine) = libm::sincos(angle);
    let odd = n % 2;
    let (mut term, mut sum) = (if odd == 1 { cosine } else { 1.0 }, 0.0);
    for k in 0..n / 2 {
        sum += term;
        let k = 2 * k + 1 + odd;
        term *= k as f64 / (k + 1) as f64 * cosine * cosine;
    }
    let inside =
        if odd == 1 { std::f64::consts::FRAC_2_PI * (angle + sine * sum) } else { sine * sum };
    // Not a number where no residual tells the width: nothing is inside.
    if inside.is_nan() { 1.0 } else { inside.clamp(0.0, 1.0) }
}

/// Two-sided 90 % quantile of Student's t with `n` degrees of freedom.
///
/// Tabulated to 8, then by the expansion of Cornish and Fisher (Abramowitz and Stegun
/// 26.7.5), good to 4 digits.
fn student_t(n: usize) -> Option<f64> {
    const T: [f64; 8] = [6.3138, 2.9200, 2.3534, 2.1318, 2.0150, 1.9432, 1.8946, 1.8595];
    let z: f64 = 1.644_854;
    match n {
        0 => None,
        1..=8 => Some(T[n - 1]),
        _ => {
            let n = n as f64;
            let first = (z.powi(3) + z) / 4.0;
            let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
            Some(z + first / n + second / (n * n) + third / (n * n * n))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::LeftOutSpeeds::{Ends, Inner};
    use super::*;

    /// A gap around 8 m/s.
    fn over(span_m_per_s: f64) -> Gap {
        Gap { span_m_per_s, around_m_per_s: 8.0 }
    }

    fn curve(span_m_per_s: f64, ratios: &[f64]) -> Residuals {
        Residuals::new(over(span_m_per_s), ratios.to_vec(), 1)
    }

    #[test]
    fn few_curves_give_wide_bands() {
        let one = curve(4.0, &[0.1; 4]);
        let band = |n: usize| Band::of(Inner, &vec![one.clone(); n], None).unwrap();
        assert!((band(1).pointwise_share - 0.63138).abs() < 1e-12);
        assert!((band(3).pointwise_share - 0.23534).abs() < 1e-12);
        assert_eq!(band(3).span_m_per_s, 4.0);
        assert_eq!(band(1).coverage, None);
        assert_eq!(band(2).coverage, Some(1.0));
        assert!(Band::of(Inner, &[], None).is_none());
    }

    /// A residual of one sign is one observation; waves of it are one for each of their arcs, nearly.
    #[test]
    fn stretches_of_one_sign_are_counted() {
        let wave = |waves: f64| -> Vec<f64> {
            (0..400).map(|i| (std::f64::consts::TAU * waves * f64::from(i) / 400.0).sin()).collect()
        };
        assert_eq!([stretches(&[]), stretches(&[0.0; 9]), stretches(&[0.2; 400])], [1; 3]);
        // The autocorrelation of a wave is a cosine, with an integral of 1/π of a wave to both sides.
        for waves in [5.0, 20.0] {
            let (counted, paper) = (stretches(&wave(waves)) as f64, std::f64::consts::PI * waves);
            assert!((counted / paper - 1.0).abs() < 0.1, "{counted} {paper}");
        }
        let curve = curve(4.0, &wave(5.0));
        let band = Band::of(Inner, std::slice::from_ref(&curve), None).unwrap();
        let t = student_t(curve.stretches).unwrap();
        assert!((band.pointwise_share - t * 0.5_f64.sqrt()).abs() < 1e-3);
        assert!((band.simultaneous_share - 6.3138).abs() < 1e-2, "a whole curve is one");
    }

    #[test]
    fn coverage_counts_points_outside() {
        let curves = [curve(4.0, &[0.01, 0.01]), curve(4.0, &[0.01, 0.5])];
        assert_eq!(coverage(Inner, &curves, 1, None), Some(0.5));
        assert_eq!(coverage(Inner, &curves, 0, None), Some(1.0));
    }

    /// Errors that follow the span are one error at one span, and each lies on the edge of what
    /// the other gives, divided by Student's t.
    #[test]
    fn residuals_are_compared_over_one_span() {
        let grown = 0.1 * 2.0_f64.powf(POWER_OF_GAP);
        let curves = [curve(3.0, &[0.1, 0.1]), curve(6.0, &[grown, grown])];
        let band = Band::of(Inner, &curves, None).unwrap();
        let share = |band: Band, span: f64| band.over(over(span)).unwrap().pointwise_share;
        assert!((share(band, 3.0) - 2.92 * 0.1).abs() < 1e-12);
        assert!((share(band, 6.0) - 2.92 * grown).abs() < 1e-12);
        assert!((share(band, 1.5) - 2.92 * 0.1 / 2.0_f64.powf(POWER_OF_GAP)).abs() < 1e-12);
        // 0.7 of a gap of 6 is within the band that 0.1 of a gap of 3 gives there (t of one: 6.3),
        // and outside of the one that it gives at 3.
        let wide = [curve(3.0, &[0.1, 0.1]), curve(6.0, &[0.7, 1.1])];
        assert_eq!(coverage(Inner, &wide, 1, None), Some(0.5));
        // Twice as fast: the roots of the speeds lie closer by the root of 2.
        let faster = Gap { span_m_per_s: 3.0, around_m_per_s: 16.0 };
        let there = band.over(faster).unwrap().pointwise_share;
        assert!((there / share(band, 3.0) - 2.0_f64.powf(-0.25)).abs() < 1e-12);
        // Outside in proportion.
        let ends = Band::of(Ends, &curves[..1], None).unwrap();
        assert!((share(ends, 9.0) - 3.0 * 6.3138 * 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_gap_is_that_of_the_neighbouring_training_speeds() {
        let speeds = [5.0, 8.0, 8.0, 12.0, 13.0];
        let gap = |v: f64| gap(&speeds, v).unwrap().span_m_per_s;
        assert_eq!([gap(5.0), gap(6.0), gap(7.9), gap(9.0), gap(12.5)], [3.0, 3.0, 3.0, 4.0, 1.0]);
        assert_eq!([gap(8.0), gap(8.0000001), gap(12.0)], [4.0; 3], "the wider at a speed itself");
        assert_eq!([gap(1.0), gap(13.0), gap(99.0)], [3.0, 1.0, 1.0], "outermost");
        assert_eq!(super::gap(&[5.0, 5.0], 5.0), None);
        let outside = |v: f64| outside(&speeds, v).map_or(0.0, |gap| gap.span_m_per_s);
        assert_eq!([outside(3.0), outside(5.0), outside(9.0), outside(15.0)], [2.0, 0.0, 0.0, 2.0]);
        assert_eq!(outside(13.000001), 0.0, "rounding is not extrapolation");
    }

    #[test]
    fn outside_the_band_grows_from_the_one_inside() {
        let inner = Band::of(Inner, &[curve(4.0, &[0.1; 2]), curve(4.0, &[0.1; 2])], None);
        let ends = Band::of(Ends, &[curve(2.0, &[0.2; 2]), curve(2.0, &[0.2; 2])], None);
        let speeds = [5.0, 7.0, 9.0];
        let share = |v: f64| at(inner, ends, &speeds, v).map(|b| (b.left_out, b.pointwise_share));
        let (kind, inside) = share(8.0).unwrap();
        assert!(kind == Inner && (inside - 0.292 * 0.5_f64.powf(POWER_OF_GAP)).abs() < 1e-12);
        assert_eq!(share(9.1), Some((Inner, inside)), "never narrower than inside");
        let (kind, outside) = share(12.0).unwrap();
        // 3 m/s from 9 on, by the roots of the speeds.
        let by_roots = 1.5 * (8.0 / 10.5_f64).sqrt();
        assert!(kind == Ends && (outside - 0.584 * by_roots).abs() < 1e-12);
        assert_eq!(at(inner, None, &speeds, 12.0), None);
        assert_eq!(at(None, ends, &speeds, 8.0), None);
    }

    #[test]
    fn levels_are_those_of_the_quantiles() {
        for n in 1..=40 {
            let inside = inside_t(student_t(n).unwrap(), n);
            assert!((inside - LEVEL).abs() < 2e-4, "{n}: {inside}");
        }
        assert_eq!([inside_t(0.0, 3), inside_t(f64::INFINITY, 4)], [0.0, 1.0]);
    }

    /// Levels that are spread evenly are covered as stated; one width for all of them is not.
    #[test]
    fn calibration_is_the_area_between_level_and_coverage() {
        let spread: Vec<(f64, f64)> =
            (0..1000).map(|i| ((f64::from(i) + 0.5) / 1000.0, 1.0)).collect();
        assert!(calibration_error(spread) < 1e-3);
        assert!((calibration_error(vec![(0.0, 1.0); 3]) - 0.5).abs() < 1e-12, "far too wide");
        assert!((calibration_error(vec![(1.0, 2.0)]) - 0.5).abs() < 1e-12, "far too narrow");
        let half = vec![(0.2, 1.0), (0.6, 1.0)];
        // 0 to 0.2 covers none, to 0.6 half, then all: 0.02 + 0.045 + 0.005 + 0.08.
        assert!((calibration_error(half) - 0.15).abs() < 1e-12);
    }

    #[test]
    fn tabulated_and_expanded_quantiles_meet() {
        assert!((student_t(9).unwrap() - 1.8331).abs() < 2e-4);
        assert!((student_t(30).unwrap() - 1.6973).abs() < 1e-4);
    }

    #[test]
    fn bands_follow_the_level_of_the_force() {
        let band = Band::of(Inner, &[curve(4.0, &[0.1; 4]), curve(4.0, &[0.1; 4])], None).unwrap();
        let force: Vec<f64> = (0..200).map(|i| if i < 100 { 1e6 } else { 2e6 }).collect();
        let (low, high) = band.around(&force);
        let width = |i: usize| high[i] - low[i];
        assert!((width(150) / width(50) - 2.0).abs() < 1e-12);
    }

    /// A residual's square is that of interpolation plus the scatter of the runs it was measured
    /// against; a wider gap widens the former alone, and the scatter is the floor.
    #[test]
    fn scatter_is_a_part_of_its_own() {
        let scatter =
            ForceScatter { degrees_of_freedom: 3, force_share: 0.03, largest_force_share: 0.06 };
        // Interpolation 0.04; a single run scatters by 0.03, the mean of nine by 0.01.
        let one = curve(4.0, &[0.05; 2]);
        let nine = Residuals { runs: 9, ..curve(4.0, &[(0.0016_f64 + 0.0001).sqrt(); 2]) };
        let band = Band::of(Inner, &[one, nine], Some(scatter)).unwrap();
        let (t2, t3) = (2.92, 2.3534);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        near(band.scatter.unwrap().pointwise_share, t3 * 0.03);
        near(band.scatter.unwrap().simultaneous_share, t3 * 0.06);
        near(band.interpolation_share(), t2 * 0.04);
        near(band.pointwise_share, (t2 * 0.04_f64).hypot(t3 * 0.03));
        near(band.share_of_mean(9), (t2 * 0.04_f64).hypot(t3 * 0.01));
        let wide = band.over(over(8.0)).unwrap();
        near(wide.interpolation_share(), t2 * 0.04 * 2.0_f64.powf(POWER_OF_GAP));
        assert_eq!(wide.scatter, band.scatter);
        near(band.over(over(1e-18)).unwrap().pointwise_share, t3 * 0.03);
        // Residuals below the scatter leave nothing to interpolation, and no scatter changes nothing.
        let small = [curve(4.0, &[0.01; 2]), curve(4.0, &[0.01; 2])];
        let band = Band::of(Inner, &small, Some(scatter)).unwrap();
        assert_eq!((band.interpolation_share(), band.coverage), (0.0, Some(1.0)));
        let none = ForceScatter { force_share: 0.0, largest_force_share: 0.0, ..scatter };
        let (with, alone) = (Band::of(Inner, &small, Some(none)), Band::of(Inner, &small, None));
        let (with, alone) =
            (with.unwrap().over(over(7.0)).unwrap(), alone.unwrap().over(over(7.0)).unwrap());
        assert_eq!(with.pointwise_share, alone.pointwise_share);
    }
}
