//! Force over deflection: the runs of a group, predictions, and a left-out speed.

use crate::assess::left_out::query_of;
use crate::assess::reference::Reference;
use crate::assess::validate::{Choice, train};
use crate::curve::{Case, CurveUnloading, ForceCurve, ForceKind};
use crate::dataset::{TrainingCase, TrainingSet, is_same_speed};
use crate::error::{Error, error};
use crate::order;
use crate::plot::{self, Axis, Chart, Mark, Panel, Series, Shown};
use crate::surrogate::band::{Band, LeftOutSpeeds};
use crate::surrogate::{ModelCase, PredictedCurve, predict};
use crate::unit::{SpeedKind, km_per_h};
use crate::words::counted;

/// Axes of force over deflection.
fn axes(largest_n: f64) -> Panel {
    Panel::new(Axis::new("deflection", "m", 1.0), Axis::prefixed("force", "N", largest_n))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Loading and unloading of a case: deflections in m and forces in N, until the bodies part.
///
/// The body's force is that of its recorded speeds; `None` if the case has no such force.
fn both_ways(case: &Case, force: ForceKind) -> Option<(Vec<f64>, Vec<f64>)> {
    if force == case.curves.force_kind {
        let curve = &case.curves.sampled;
        let turn = (0..curve.force_n().len())
            .max_by(|&a, &b| curve.deflection_m()[a].total_cmp(&curve.deflection_m()[b]))?;
        // Where the force is gone, the bodies have parted.
        let behind = curve.force_n()[turn..].iter().position(|f| *f <= 0.0);
        let end = behind.map_or(curve.force_n().len(), |parted| turn + parted.max(1));
        return Some((curve.deflection_m()[..end].to_vec(), curve.force_n()[..end].to_vec()));
    }
    if force == ForceKind::Contact {
        return None;
    }
    let driving = ForceCurve::recorded(case)?;
    let (mut d, mut f) =
        (driving.loading.deflection_m().to_vec(), driving.loading.force_n().to_vec());
    if let CurveUnloading::Recorded { deflection_m, force_n, .. } = &driving.unloading {
        d.extend(deflection_m);
        f.extend(force_n);
    }
    Some((d, f))
}

/// How runs of a group are called: by speed, and by name where speeds repeat.
fn names(cases: &[Case]) -> Vec<String> {
    let speeds: Vec<String> =
        cases.iter().map(|case| km_per_h(case.conditions.speed.m_per_s)).collect();
    let is_alone = |k: usize| speeds.iter().filter(|s| **s == speeds[k]).count() == 1;
    let name = |k: usize| {
        let of = cases[k].origin();
        if is_alone(k) {
            format!("{of} at {}", speeds[k])
        } else {
            format!("{of} at {} ({})", speeds[k], cases[k].id.name)
        }
    };
    (0..cases.len()).map(name).collect()
}

/// Curves of one group that a picture has; more cannot be distinguished.
const MOST_CURVES: usize = 20;

/// Force over deflection of the runs of a group, loading and unloading: of many, some spread over their speeds.
///
/// `force` is the recipe's force, or the body force; runs without that force are named in a note.
pub fn group_curves(group: &str, cases: &[Case], force: ForceKind) -> Chart {
    let mut series = Vec::new();
    let mut missing = Vec::new();
    let mut top = 0.0;
    let speed_of = |k: &usize| cases[*k].conditions.speed.m_per_s;
    let mut drawn: Vec<usize> = (0..cases.len()).collect();
    if cases.len() > MOST_CURVES {
        order::sort(&mut drawn, |a, b| speed_of(a).total_cmp(&speed_of(b)));
        let step = |k: usize| drawn[k * (cases.len() - 1) / (MOST_CURVES - 1)];
        drawn = (0..MOST_CURVES).map(step).collect();
    }
    let mut names = names(cases);
    let kind = |case: &Case| case.conditions.speed.kind;
    let is_mixed = cases.windows(2).any(|pair| kind(&pair[0]) != kind(&pair[1]));
    if is_mixed {
        let of = names.iter_mut().zip(cases);
        of.for_each(|(name, case)| *name += &format!(" ({})", kind(case).name()));
    }
    for (k, (case, name)) in drawn.iter().map(|&k| (&cases[k], names[k].clone())).enumerate() {
        match both_ways(case, force) {
            Some((d, f)) => {
                top = largest(&f).max(top);
                series.push(Series::line(&name, k, d, f));
            }
            None => missing.push(name),
        }
    }
    let panel = Panel { series, ..axes(top) };
    let kind = match cases.first() {
        Some(case) if !is_mixed => format!("{} speed", kind(case).name()),
        _ => "speed".into(),
    };
    // From the motion it is drawn as a run on it has it; models and the database have it filtered.
    let of_motion = |case: &Case| force == ForceKind::Body && case.curves.force_kind != force;
    let unfiltered = if cases.iter().any(of_motion) { " (not filtered)" } else { "" };
    let title = format!("{group}: {} force{unfiltered} by {kind}", force.name());
    let mut chart = Chart::of(&title, panel);
    if !missing.is_empty() {
        chart.notes.push(format!("Without a {} force: {}.", force.name(), missing.join(", ")));
    }
    if drawn.len() < cases.len() {
        let [drawn, all] = [drawn.len(), cases.len()];
        chart.notes.push(format!("{drawn} of {all} runs, taken evenly in order of speed."));
    }
    chart
}

/// Force over deflection of one curve, in m and N.
pub(crate) fn file_curve(title: &str, name: &str, deflection_m: &[f64], force_n: &[f64]) -> Chart {
    let mut panel = axes(largest(force_n));
    panel.series.push(Series::line(name, 0, deflection_m.to_vec(), force_n.to_vec()));
    Chart::of(title, panel)
}

/// A predicted curve with its band, over the training curves next to its speed.
///
/// `neighbours` are cases of its parameters; the nearest below and above are drawn, or the two nearest outside of all.
pub fn prediction(curve: &PredictedCurve, neighbours: &[ModelCase]) -> Chart {
    let v = curve.speed_m_per_s;
    let mut panel = axes(largest(&curve.force_n));
    for (k, case) in beside(neighbours, v).into_iter().enumerate() {
        let is_body =
            curve.provenance.force_kind == ForceKind::Body && !case.body_force_n.is_empty();
        let force_n = if is_body { &case.body_force_n } else { &case.force_n };
        let name = format!("FE at {}", km_per_h(case.speed_m_per_s));
        let look = [0, 2][k];
        panel.series.push(Series::line(&name, look, case.deflection_m.clone(), force_n.clone()));
    }
    add_prediction(&mut panel, curve);
    panel.marks.push(Mark { name: "maximum crush".into(), x: curve.max_deflection_m });
    let title = format!(
        "{} at {}: {} force by the model {}",
        curve.provenance.group,
        km_per_h(v),
        curve.provenance.force_kind.name(),
        curve.model
    );
    let mut chart = Chart::of(&title, panel);
    chart.notes.extend(curve.warnings.iter().map(|warning| format!("Warning: {warning}.")));
    chart
}

/// Several predicted curves over one another, by name, without their bands.
pub(crate) fn predictions<'a>(
    title: &str,
    curves: impl Iterator<Item = (&'a str, &'a PredictedCurve)>,
) -> Chart {
    let curves: Vec<(&str, &PredictedCurve)> = curves.collect();
    let top = curves.iter().map(|(_, curve)| largest(&curve.force_n)).fold(0.0, f64::max);
    let mut panel = axes(top);
    for (k, (name, curve)) in curves.into_iter().enumerate() {
        let name = format!("{name}, {}", km_per_h(curve.speed_m_per_s));
        let (d, f) = (curve.deflection_m.clone(), curve.force_n.clone());
        panel.series.push(Series::line(&name, k, d, f));
    }
    Chart::of(title, panel)
}

/// The cases below and above a speed; at an end the two nearest.
fn beside(cases: &[ModelCase], v: f64) -> Vec<&ModelCase> {
    let mut sorted: Vec<&ModelCase> = cases.iter().collect();
    order::sort(&mut sorted, |a, b| a.speed_m_per_s.total_cmp(&b.speed_m_per_s));
    let above = sorted.iter().position(|case| case.speed_m_per_s >= v).unwrap_or(sorted.len());
    let from = above.saturating_sub(1).min(sorted.len().saturating_sub(2));
    sorted.into_iter().skip(from).take(2).collect()
}

/// A maximum crush is within those of the runs up to this share above the largest.
const SAME_CRUSH: f64 = 0.01;

/// The look of predictions.
const PREDICTED: usize = 1;

/// The predicted line, its band below it, and the body force beside it, whose own band would
/// cover that of the line: it is drawn with that force alone.
fn add_prediction(panel: &mut Panel, curve: &PredictedCurve) {
    // A band is known, and a line is whole, as far as the runs were crushed, within the line's own scatter.
    let end_m = curve.data_end_m() * (1.0 + SAME_CRUSH);
    let known = curve.deflection_m.partition_point(|d| *d <= end_m);
    let to_end = |values: &[f64]| values.iter().copied().take(known).collect::<Vec<_>>();
    let d = &curve.deflection_m;
    if let (Some(low), Some(high)) = (&curve.force_low_n, &curve.force_high_n) {
        let (low, high) = (to_end(low), to_end(high));
        let name = band_name(curve);
        panel.bands.push(plot::Band {
            name,
            look: PREDICTED,
            x: to_end(d),
            low,
            high,
            is_stacked: false,
        });
    }
    let name = format!("{} at {}", curve.model, km_per_h(curve.speed_m_per_s));
    let mut add = |name: &str, look, force_n: &[f64], shown| {
        let line = Series::line(name, look, to_end(d), to_end(force_n));
        panel.series.push(line.shown(shown));
        if known < d.len() {
            let from = known.saturating_sub(1);
            let (d, force_n) = (d[from..].to_vec(), force_n[from..].to_vec());
            let further =
                Series::line(&format!("{name}, beyond the runs' crush"), look, d, force_n);
            panel.series.push(further.shown(Shown::Assumed));
        }
    };
    add(&name, PREDICTED, &curve.force_n, Shown::Emphasis);
    if let Some(body_n) = &curve.body_force_n {
        add("its body force", 3, body_n, Shown::Line);
    }
}

/// Which band, its level, and from how many curves.
fn band_name(curve: &PredictedCurve) -> String {
    match &curve.provenance.band {
        Some(band) => {
            let which = match band.left_out {
                LeftOutSpeeds::Inner => "inner speeds",
                LeftOutSpeeds::Ends => "the ends",
            };
            let Band { level, curves, .. } = band;
            let curves = counted(*curves, "curve");
            format!("empirical {:.0} % range from {curves} left out at {which}", 100.0 * level)
        }
        None => "band of the curve's file".into(),
    }
}

/// A curve predicted without the run shown with it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LeftOutPrediction<'a> {
    /// The run that was left out.
    pub case: &'a Case,
    /// What distinguishes it from others of its speed, after a blank; empty if nothing does.
    pub which: &'a str,
    /// What the others predict for its speed.
    pub curve: &'a PredictedCurve,
    /// Times in s and closing speeds in m/s of one mass that the predicted curve stops.
    pub motion: Option<(&'a [f64], &'a [f64])>,
}

/// A left-out run with its prediction: force over deflection, and the speed over time.
pub(crate) fn left_out(of: LeftOutPrediction) -> Chart {
    let LeftOutPrediction { case, which, curve, motion } = of;
    let kind = curve.provenance.force_kind;
    let mut forces = axes(largest(&curve.force_n).max(case.peak_force_n()));
    forces.title = format!("{} force", kind.name());
    let fe = format!("{} at {}{which}", case.origin(), km_per_h(case.conditions.speed.m_per_s));
    if let Some((d, f)) = both_ways(case, kind) {
        forces.series.push(Series::line(&fe, 0, d, f));
    }
    add_prediction(&mut forces, curve);
    let mut panels = vec![forces];
    if let Some((time_s, v_m_per_s)) = motion {
        let mut speeds =
            Panel::new(Axis::new("time", "ms", 1e3), Axis::new("closing speed", "m/s", 1.0));
        speeds.title = match case.conditions.speed.kind {
            SpeedKind::Wall => "one mass against a wall".into(),
            SpeedKind::Closing => "the pair as one reduced mass".into(),
        };
        let end = time_s.last().copied().unwrap_or_default();
        let states = case.curves.sampled.time_s().iter().take_while(|t| **t <= end).count();
        let fe_time = case.curves.sampled.time_s()[..states].to_vec();
        speeds.series.push(Series::line(
            &fe,
            0,
            fe_time,
            case.curves.closing_speed_m_per_s[..states].to_vec(),
        ));
        let name = format!("{} at {}", curve.model, km_per_h(curve.speed_m_per_s));
        let ours = Series::line(&name, PREDICTED, time_s.to_vec(), v_m_per_s.to_vec());
        speeds.series.push(ours.shown(Shown::Emphasis));
        panels.push(speeds);
    }
    let title = format!(
        "{}: {}{which} left out and predicted by {}",
        case.id.group,
        km_per_h(case.conditions.speed.m_per_s),
        curve.model
    );
    Chart::row(&title, panels)
}

/// Trains the model of `choice` on the runs at other speeds, predicts the curve at a speed in m/s, lets its body force (or its
/// only force) stop one mass, and draws both with the run: that of the name, or the first one at the speed.
///
/// # Errors
/// If there is no such run, or the others are too few.
pub fn left_out_at(
    group: &str,
    cases: &[Case],
    (speed_m_per_s, name): (f64, Option<&str>),
    choice: Choice,
) -> Result<Chart, Error> {
    let is_that = |case: &&Case| is_same_speed(case.conditions.speed.m_per_s, speed_m_per_s);
    let set = TrainingSet::new(group, cases)?;
    // Several runs of that speed are one case, their mean.
    let own: Vec<&TrainingCase> =
        set.cases.iter().map(|own| &**own).filter(|own| is_that(&&*own.case)).collect();
    let named = own.iter().find(|own| Some(&*own.name) == name).or(own.first());
    let Some(TrainingCase { case, runs, name, .. }) = named.copied() else {
        let speeds: Vec<String> =
            cases.iter().map(|c| km_per_h(c.conditions.speed.m_per_s)).collect();
        let known = speeds.join(", ");
        return Err(error!(
            Plot,
            "{group} has no run at {}: its speeds are {known}",
            km_per_h(speed_m_per_s)
        ));
    };
    let others = set.others(cases, case.conditions.speed.m_per_s);
    let model = train(group, &others, choice)?;
    let curve = predict(&model, &query_of(case, &model))?;
    let run = Reference::of(case)?.run(&curve.driving(moving_force(&curve))?)?;
    let motion = Some((&run.time_s[..], &run.bodies[0].v_m_per_s[..]));
    let which = match (runs.len(), own.len()) {
        (1, 1) => String::new(),
        (1, _) => format!(" ({name})"),
        (runs, 1) => format!(" (mean of {runs})"),
        (runs, _) => format!(" ({name}, mean of {runs})"),
    };
    Ok(left_out(LeftOutPrediction { case, which: &which, curve: &curve, motion }))
}

/// The force that moves one mass, or the only one there is.
fn moving_force(curve: &PredictedCurve) -> ForceKind {
    match curve.body_force_n {
        Some(_) => ForceKind::Body,
        None => curve.provenance.force_kind,
    }
}
