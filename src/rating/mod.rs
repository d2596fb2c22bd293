//! Rating: all measures of the difference between a prediction and its reference.
//!
//! Two signals over time are filtered on request, brought to common times at 10 kHz, and rated by
//! all measures at once. Whatever the unit of the values, both have the same.
//!
//! The rate of 10 kHz is that of ISO/TS 18571, so that all measures see the same samples. The basic measures (`l1_ratio`,
//! matched peaks) stay in `signal`, where surrogates and validation use them. ISO/TS 18571 and CORA search a shift and
//! (ISO) a warping path, both with the square of the length: they take up to 20 000 samples, for 80 MB and seconds.
//!
//! objective-rating-metrics 1.3 gives the same scores to 1e-9, with two exceptions. Straight lines correlate equally at
//! every shift, so rounding chooses its shift (0.1 i against 0.2 i + 0.3: one sample, and E_P = 0.95), while correlations
//! within 1e-12 are equal here. Of a reference of zeros it gives NaN. No public program computes CORA (pyisomme 1.1 has ISO/TS
//! 18571 only, through the same package); the tests compute it a second way.

pub(crate) mod acceptance;
pub(crate) mod differences;
pub(crate) mod iso18571;
mod signal;

use serde::Serialize;

use crate::error::Error;
use crate::signal::l1_ratio;
use crate::signal::peaks::{MatchedPeak, matched_peaks};
use crate::words::counted;
pub(crate) use differences::{Cora, Deceleration, MagnitudePhase, MaxAbs, Pointwise};
use differences::{
    cora, integral_error, max_abs, peak_norm, pointwise, rms_ratio, russell, sprague_geers,
};
pub(crate) use iso18571::Iso18571;
use iso18571::iso18571;
use signal::LEAST_SAMPLES;
pub(crate) use signal::{INTERVAL_S, Pair, Signal};

/// What two signals are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Quantity {
    /// Means of the deceleration are rated as well.
    Acceleration,
    /// Anything else.
    #[default]
    Other,
}

impl Quantity {
    /// Tells an acceleration by a column's name or unit: `x_acceleration[900001]`, `a_m_per_s2[A1]`, `head [g]`.
    pub(crate) fn named(column: &str) -> Self {
        let column = column.to_ascii_lowercase();
        let units = ["m/s^2", "m/s2", "m/s²", "m/s**2", "[g]", "(g)"];
        let is_acceleration = column.contains("acceleration")
            || column.contains("m_per_s2")
            || units.iter().any(|unit| column.contains(unit));
        if is_acceleration { Self::Acceleration } else { Self::Other }
    }
}

/// How two signals are rated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RatingSettings {
    /// What the signals are.
    pub quantity: Quantity,
    /// Class of a CFC filter for both, such as 60.
    pub cfc: Option<u32>,
    /// Begin and end of what is rated, in s; without them all common times.
    pub from_s: Option<f64>,
    pub to_s: Option<f64>,
}

/// A prediction rated against its reference by every measure.
///
/// `r` is the reference, `p` the prediction, at the same times. Errors are 0 and scores 1 where
/// they agree. What has no meaning, such as a ratio to zeros, is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Rating {
    /// The signal that is taken as correct.
    pub(crate) reference: Rated,
    /// The signal that is rated.
    pub(crate) prediction: Rated,
    /// What the signals are.
    pub quantity: Quantity,
    /// Class of the filter on both signals, run over all their samples; null without one.
    pub cfc: Option<u32>,
    /// The common times: both signals are interpolated linearly at these.
    pub from_s: f64,
    /// End of the common times, in s.
    pub to_s: f64,
    /// Time between two of them, in s.
    pub interval_s: f64,
    /// Number of common times.
    pub samples: usize,
    /// `Σ|p − r|/Σ|r|`, the headline.
    pub l1_ratio: Option<f64>,
    /// `‖p − r‖₂/‖r‖₂`.
    pub rms_ratio: Option<f64>,
    /// Mean of `|p − r|` over the largest `|r|`.
    pub peak_norm: Option<f64>,
    /// Relative differences sample by sample.
    pub(crate) pointwise: Option<Pointwise>,
    /// The largest difference and its time.
    pub(crate) max_abs: MaxAbs,
    /// The first two peaks of the reference, upwards or, where its largest magnitude is negative,
    /// downwards; they stand out by at least a tenth of the largest.
    pub(crate) peaks: Vec<Peak>,
    /// `∫p/∫r − 1` over time: of a force the error of its impulse, of an acceleration that of the
    /// change of speed; null where the reference's positive and negative parts nearly cancel.
    pub integral_error: Option<f64>,
    /// Measure of Sprague and Geers.
    pub(crate) sprague_geers: Option<MagnitudePhase>,
    /// Measure of Russell.
    pub(crate) russell: Option<MagnitudePhase>,
    /// Null over more than 2 s.
    pub(crate) iso18571: Option<Iso18571>,
    /// Null over more than 2 s.
    pub(crate) cora: Option<Cora>,
    /// Of accelerations: positive where the body is slowed down, so −a.
    pub(crate) deceleration: Option<Decelerations>,
    /// What a reader of these numbers should know.
    pub warnings: Vec<String>,
}

/// A signal that was rated.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Rated {
    /// Name of its column.
    pub name: String,
    /// Its own samples, before anything is done to it.
    pub samples: usize,
    /// Time of its first sample, in s.
    pub first_s: f64,
    /// Time of its last sample, in s.
    pub last_s: f64,
}

impl Rated {
    fn of(signal: &Signal) -> Self {
        let (first_s, last_s) = signal.range_s();
        Self { name: signal.name().into(), samples: signal.values().len(), first_s, last_s }
    }
}

/// A peak of the reference and the peak of the prediction that is nearest to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Peak {
    /// Time of the reference's peak, in s.
    pub time_s: f64,
    /// Value of the reference, in the unit of the signals.
    pub value: f64,
    /// Prediction over reference, minus 1; null if the prediction has no peak within a tenth of the
    /// common times: it is missing.
    pub error: Option<f64>,
    /// By how much the prediction's peak is later, in s.
    pub shift_s: Option<f64>,
}

/// Decelerations of both signals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Decelerations {
    /// Of the reference.
    pub reference: Deceleration,
    /// Of the prediction.
    pub prediction: Deceleration,
}

/// Rates `prediction` against `reference`.
///
/// Signals of other lengths and times are brought to common times, 0.1 ms apart as
/// ISO/TS 18571 wants it, by linear interpolation where both have values; a filter comes before
/// that. Over more than 20 000 samples ISO/TS 18571 and CORA are left out,
/// with a warning, as their time and memory grow with the square.
///
/// # Errors
/// If they have no or too few common times, or cannot be filtered.
pub(crate) fn rate(
    reference: &Signal,
    prediction: &Signal,
    settings: &RatingSettings,
) -> Result<Rating, Error> {
    let filtered = |signal: &Signal| match settings.cfc {
        Some(class) => signal.filtered(class),
        None => Ok(signal.clone()),
    };
    let window = (settings.from_s, settings.to_s);
    let least = iso18571::LEAST_SAMPLES;
    let pair = Pair::new(&filtered(reference)?, &filtered(prediction)?, window, least)?;
    let Pair { time_s, reference: r, prediction: p } = &pair;
    let is_acceleration = settings.quantity == Quantity::Acceleration;
    let mut rating = Rating {
        reference: Rated::of(reference),
        prediction: Rated::of(prediction),
        quantity: settings.quantity,
        cfc: settings.cfc,
        from_s: time_s[0],
        to_s: time_s[time_s.len() - 1],
        interval_s: INTERVAL_S,
        samples: time_s.len(),
        l1_ratio: Some(l1_ratio(r, p)).filter(|ratio| ratio.is_finite()),
        rms_ratio: rms_ratio(r, p),
        peak_norm: peak_norm(r, p),
        pointwise: pointwise(r, p),
        max_abs: max_abs(time_s, r, p),
        peaks: first_peaks(&pair),
        integral_error: integral_error(time_s, r, p),
        sprague_geers: sprague_geers(r, p),
        russell: russell(r, p),
        iso18571: iso18571(r, p, INTERVAL_S),
        cora: cora(r, p, INTERVAL_S),
        deceleration: is_acceleration.then(|| Decelerations {
            reference: Deceleration::of(time_s, r),
            prediction: Deceleration::of(time_s, p),
        }),
        warnings: Vec::new(),
    };
    rating.warnings = warnings(&rating, [r, p], settings);
    for (who, signal) in [("reference", reference), ("prediction", prediction)] {
        let within = signal.samples_within(rating.from_s, rating.to_s);
        if within < LEAST_SAMPLES {
            rating.warnings.push(format!(
                "the {who} has {within} samples from {} s to {} s, so lines between them are rated: check the interval, and the units of its times (,time=ms after the file's name)",
                rating.from_s, rating.to_s
            ));
        }
    }
    Ok(rating)
}

/// Peaks in the direction in which the reference is largest.
fn first_peaks(pair: &Pair) -> Vec<Peak> {
    let extreme =
        pair.reference.iter().fold(0.0, |m: f64, &v| if v.abs() > m.abs() { v } else { m });
    let sign = 1.0_f64.copysign(extreme);
    let turned = |values: &[f64]| -> Vec<f64> { values.iter().map(|v| sign * v).collect() };
    let peak = |MatchedPeak { reference: (time_s, value), prediction }: MatchedPeak| Peak {
        time_s,
        value: sign * value,
        error: prediction.map(|(_, found)| found / value - 1.0),
        shift_s: prediction.map(|(at, _)| at - time_s),
    };
    let matched = matched_peaks(&pair.time_s, &turned(&pair.reference), &turned(&pair.prediction));
    // A peak below zero, between two valleys, has no relative error.
    matched.into_iter().filter(|peak| peak.reference.1 > 0.0).map(peak).collect()
}

/// A part of the reference up to this share may be left out unsaid.
const UNRATED: f64 = 0.05;

/// A contact that fades takes less.
const TAIL_S: f64 = 0.020;
/// A mean deceleration over less than this share of the change of speed is not that of the impact.
const MOST_OF_CHANGE: f64 = 0.5;
/// More pulses than those of the contacts of a train are an oscillation, and so is a shorter one.
const MOST_PULSES: usize = 4;
const SHORTEST_S: f64 = 0.005;

fn warnings(rating: &Rating, both: [&[f64]; 2], settings: &RatingSettings) -> Vec<String> {
    let mut warnings = Vec::new();
    let (from_s, to_s) =
        (settings.from_s.unwrap_or(rating.from_s), settings.to_s.unwrap_or(rating.to_s));
    if from_s < rating.from_s - INTERVAL_S || to_s > rating.to_s + INTERVAL_S {
        warnings.push(format!(
            "{from_s} s to {to_s} s was requested, but the signals have only {} s to {} s in common",
            rating.from_s, rating.to_s
        ));
    }
    let whole = &rating.reference;
    let [first_s, last_s] = [
        whole.first_s.max(settings.from_s.unwrap_or(f64::NEG_INFINITY)),
        whole.last_s.min(settings.to_s.unwrap_or(f64::INFINITY)),
    ];
    let unrated = 1.0 - (rating.to_s - rating.from_s) / (last_s - first_s);
    if unrated > UNRATED {
        warnings.push(format!(
            "the prediction goes from {} s to {} s: {:.0} % of the reference, which goes from {first_s} s to {last_s} s, is not rated",
            rating.prediction.first_s,
            rating.prediction.last_s,
            100.0 * unrated
        ));
    }
    let is_zero = both.map(|signal| signal.iter().all(|&value| value == 0.0));
    if is_zero[0] {
        warnings.push("the reference is zero throughout: relative measures are undefined".into());
    } else if is_zero[1] {
        warnings.push("the prediction is zero throughout: check which column was named".into());
    }
    if rating.iso18571.is_none() {
        warnings.push(format!(
            "{} samples at 10 kHz are too many for ISO/TS 18571 and CORA, which take up to {}: choose a shorter interval, or check the units of time",
            rating.samples,
            iso18571::MOST_SAMPLES
        ));
    }
    for (who, of) in rating
        .deceleration
        .iter()
        .flat_map(|d| [("reference", d.reference), ("prediction", d.prediction)])
    {
        if of.mean.is_none() && !(who == "prediction" && is_zero[1]) {
            warnings.push(format!(
                "the {who} is never decelerated: an acceleration is negative while the body is slowed down, so scale it by -1 if it has the opposite sign"
            ));
        }
        if let (Some(above_to_s), Some(to_s)) = (of.above_to_s, of.to_s)
            && to_s - above_to_s > TAIL_S
        {
            warnings.push(format!(
                "the {who} is decelerated by less than 5 % of its largest value from {:.1} to {:.1} ms, which is in its mean deceleration: if that is braking or friction, end the interval before (--to)",
                1e3 * above_to_s,
                1e3 * to_s
            ));
        }
        if let (Some(share), Some(from_s), Some(to_s)) = (of.share_of_change, of.from_s, of.to_s)
            && share < MOST_OF_CHANGE
        {
            let remedy = match of.pulses > MOST_PULSES || to_s - from_s < SHORTEST_S {
                true => {
                    "it swings about zero: check its sign (scale=-1), filter it (--cfc 60), or choose a pulse by --from and --to"
                }
                false => "another one is chosen by --from and --to",
            };
            warnings.push(format!(
                "the mean deceleration of the {who} is that of the first of {}, from {:.1} to {:.1} ms, with {:.1} % of the change of speed: {remedy}",
                counted(of.pulses, "pulse"),
                1e3 * from_s,
                1e3 * to_s,
                100.0 * share
            ));
        }
        if of.is_cut {
            warnings.push(format!(
                "the {who} is still decelerated at {:.1} ms, where the interval ends: its mean deceleration covers the time up to then",
                1e3 * rating.to_s
            ));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn signal(values: Vec<f64>) -> Signal {
        let time_s = (0..values.len()).map(|i| i as f64 * 1e-3).collect();
        Signal::new("a", time_s, values).unwrap()
    }

    fn plain(reference: &Signal, prediction: &Signal) -> Rating {
        rate(reference, prediction, &RatingSettings::default()).unwrap()
    }

    /// 100 m/s² for 50 ms; then nothing, or brakes of 1 m/s², whose deceleration does not end.
    #[test]
    fn braking_after_the_contact_is_said() {
        let pulse =
            |after: f64| signal((0..200).map(|i| if i < 50 { -100.0 } else { -after }).collect());
        let settings =
            RatingSettings { quantity: Quantity::Acceleration, ..RatingSettings::default() };
        let of = |after: f64| rate(&pulse(0.0), &pulse(after), &settings).unwrap();
        assert_eq!(of(0.0).warnings, [""; 0]);
        let braking = of(1.0);
        assert!(braking.deceleration.unwrap().prediction.mean.unwrap() < 30.0);
        assert_eq!(
            braking.warnings,
            [
                "the prediction is decelerated by less than 5 % of its largest value from 49.9 to 199.0 ms, which is in its mean deceleration: if that is braking or friction, end the interval before (--to)"
            ]
        );
    }

    #[test]
    fn an_interval_of_few_samples_is_said() {
        let coarse = Signal::new("a", (0..40).map(|i| 0.1 * f64::from(i)).collect(), vec![1.0; 40]);
        let coarse = coarse.unwrap();
        let settings = RatingSettings { to_s: Some(0.1), ..RatingSettings::default() };
        let warnings = rate(&coarse, &coarse, &settings).unwrap().warnings;
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(
            warnings[1].starts_with("the prediction has 2 samples from 0 s to 0.1 s"),
            "{warnings:?}"
        );
        let settings = RatingSettings { to_s: Some(0.4), ..settings };
        assert_eq!(rate(&coarse, &coarse, &settings).unwrap().warnings, [""; 0]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(50))]

        #[test]
        fn a_signal_agrees_with_itself(values in prop::collection::vec(-1e6..1e6_f64, 5..60)) {
            let a = signal(values);
            let of = plain(&a, &a);
            prop_assert_eq!(of.l1_ratio, Some(0.0));
            prop_assert_eq!(of.rms_ratio, Some(0.0));
            prop_assert_eq!(of.peak_norm, Some(0.0));
            prop_assert_eq!(of.pointwise.unwrap().mean, 0.0);
            prop_assert_eq!(of.max_abs.value, 0.0);
            prop_assert!(of.integral_error.is_none_or(|e| e == 0.0));
            prop_assert!(of.peaks.iter().all(|p| p.error == Some(0.0) && p.shift_s == Some(0.0)));
            prop_assert_eq!(of.sprague_geers.unwrap().combined, 0.0);
            prop_assert_eq!(of.russell.unwrap().combined, 0.0);
            let iso = of.iso18571.unwrap();
            prop_assert!(iso.rating > 1.0 - 1e-12 && iso.grade.name() == "excellent");
            prop_assert!(of.cora.unwrap().rating > 1.0 - 1e-12);
        }

        /// The unit of both signals cannot matter.
        #[test]
        fn ratings_do_not_depend_on_the_unit(
            r in prop::collection::vec(-10.0..10.0_f64, 30),
            p in prop::collection::vec(-10.0..10.0_f64, 30),
            // Powers of two scale without rounding.
            power in -20..20_i32,
        ) {
            let unit = 2.0_f64.powi(power);
            let scaled = |v: &[f64]| signal(v.iter().map(|v| v * unit).collect());
            let (one, other) = (plain(&signal(r.clone()), &signal(p.clone())), plain(&scaled(&r), &scaled(&p)));
            prop_assert_eq!(one.l1_ratio, other.l1_ratio);
            prop_assert_eq!(one.iso18571, other.iso18571);
            prop_assert_eq!(one.cora, other.cora);
            prop_assert_eq!(one.russell, other.russell);
            prop_assert_eq!(one.pointwise, other.pointwise);
            prop_assert_eq!(one.max_abs.value * unit, other.max_abs.value);
        }

        #[test]
        fn scores_lie_between_0_and_1(
            r in prop::collection::vec(-10.0..10.0_f64, 30),
            p in prop::collection::vec(-10.0..10.0_f64, 30),
        ) {
            let of = plain(&signal(r), &signal(p));
            let (iso, cora) = (of.iso18571.unwrap(), of.cora.unwrap());
            for score in [
                iso.corridor, iso.phase, iso.magnitude, iso.slope, iso.rating,
                cora.corridor, cora.progression, cora.size, cora.phase, cora.rating,
            ] {
                prop_assert!((0.0..=1.0).contains(&score), "{:?} {:?}", iso, cora);
            }
        }
    }

    #[test]
    fn peaks_of_a_negative_pulse_point_down() {
        let pulse = |late: i32, scale: f64| {
            let bump = |i: i32| -scale * (-(f64::from(i - 50 - late) / 8.0).powi(2)).exp();
            signal((0..200).map(bump).collect())
        };
        let of = plain(&pulse(0, 10.0), &pulse(5, 12.0));
        assert_eq!(of.peaks.len(), 1);
        let peak = of.peaks[0];
        assert!((peak.time_s - 0.05).abs() < 1e-12 && peak.value == -10.0);
        assert!((peak.error.unwrap() - 0.2).abs() < 1e-12);
        assert!((peak.shift_s.unwrap() - 0.005).abs() < 1e-12);
        assert_eq!(plain(&pulse(0, 10.0), &pulse(40, 12.0)).peaks[0].error, None, "missing");
    }

    #[test]
    fn a_filter_comes_before_the_cut() {
        let step = signal((0..200).map(|i| f64::from(i >= 50)).collect());
        let beyond = RatingSettings { to_s: Some(5.0), ..RatingSettings::default() };
        let beyond = rate(&step, &step, &beyond).unwrap().warnings;
        assert!(beyond.iter().any(|w| w.contains("to 5 s was requested")), "{beyond:?}");
        let window =
            RatingSettings { from_s: Some(0.052), cfc: Some(60), ..RatingSettings::default() };
        let whole = RatingSettings { from_s: None, ..window };
        let zero = signal(vec![0.0; 200]);
        let cut = rate(&zero, &step, &window).unwrap();
        assert_eq!(cut.from_s, 0.052);
        // The filter's overshoot after the step is the largest value either way.
        assert_eq!(cut.max_abs.value, rate(&zero, &step, &whole).unwrap().max_abs.value);
        assert!(cut.max_abs.value > 1.01);
    }

    #[test]
    fn the_longest_that_is_rated_by_all_takes_seconds() {
        let noise: Vec<f64> = (0..2000).map(|i| f64::from(i * 7919 % 1000)).collect();
        let a = signal(noise.clone());
        let b = signal(noise.into_iter().rev().collect());
        assert_eq!(plain(&a, &b).samples, 19_991);
        assert!(plain(&a, &b).iso18571.is_some());
    }

    #[test]
    fn accelerations_are_known_by_name_and_unit() {
        for name in ["x_acceleration[900001]", "a_m_per_s2[A1]", "a A1 [m/s^2]", "Head X [g]"] {
            assert_eq!(Quantity::named(name), Quantity::Acceleration, "{name}");
        }
        for name in ["x_velocity[1]", "force_N[A|B]", "a"] {
            assert_eq!(Quantity::named(name), Quantity::Other, "{name}");
        }
    }
}
