//! The choice of a model, judged by smaller groups: every subset of the speeds chooses, and predicts the inner speeds that it
//! lacks.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use serde::Serialize;

use super::choose::{Purpose, physical, scores};
use super::left_out::LeftOutCase;
use super::scatter::scatter;
use super::validate::{
    MOST_SPEEDS as MOST_LEFT_OUT, Tables, fittable, left_out_cases, mean, trials, without_repeated,
};
use crate::curve::Case;
use crate::dataset::{TrainingSet, is_within, nearly_same};
use crate::error::Error;
use crate::parallel;
use crate::surrogate::ModelKind;
use crate::surrogate::leave_one_out::{LeftOut, Means, Scatter};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::words::counted;

/// Numbers of speeds that a subset keeps.
const SIZES: [u32; 2] = [4, 5];
/// Speeds of a group whose subsets are tried: of fewer none lacks an inner speed, and of 12 there are 1 287.
const SPEEDS: RangeInclusive<usize> = 5..=12;

/// A model, or the choice among all, over the subsets of a group.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct OverSubsets {
    /// Name of the model, or `auto`.
    pub model: String,
    /// In how many subsets of 4 and 5 speeds it predicts every inner speed that these lack.
    pub subsets: usize,
    /// Mean over the subsets of the mean error of the declared force at these speeds.
    pub force_l1: f64,
    /// Of the maximum crush.
    pub max_crush_error: f64,
    /// Of the velocity.
    pub velocity_l1: f64,
    /// Of accelerations filtered with CFC 60.
    pub acceleration_l1: f64,
    /// By how much its errors, as the choice sums them up, are larger than those of the model that turns out best for a subset;
    /// mean over the subsets.
    pub mean_regret: f64,
    /// The same for the subset where it is largest.
    pub worst_regret: f64,
    /// Share of FE's points, of both forces, inside the band of the model that the subset gives; mean over the curves whose
    /// interval is narrower than the mean of those left out, as a prediction's is.
    pub coverage: Option<f64>,
}

/// What one model does at the speeds that a subset lacks.
struct Trial {
    model: String,
    means: Means,
    regret: f64,
    /// Share of the points of each force and run that are inside the band.
    inside: Vec<f64>,
}

/// Each model, and the choice first, over all subsets of 4 and 5 speeds that lack a speed inside their range; or why there are none.
///
/// # Errors
/// If the cases are not a training set.
pub(crate) fn subsets(
    group: &str,
    cases: &[Case],
    candidates: &[ModelKind],
) -> Result<Result<Vec<OverSubsets>, String>, Error> {
    let set = TrainingSet::new(group, cases)?;
    // Speeds that nearly repeat one another are kept or left out together.
    let all = set.speeds_m_per_s();
    let mut speeds: Vec<(f64, f64)> = all.iter().map(|v| nearly_same(&all, *v)).collect();
    speeds.dedup_by(|next, before| is_within(next.0, *before));
    if !SPEEDS.contains(&speeds.len()) {
        let (least, most) = SPEEDS.into_inner();
        let found = counted(speeds.len(), "speed");
        return Ok(Err(format!(
            "--subsets needs {least} to {most} speeds, and there are {found}: it is left out"
        )));
    }
    let of_size = |bits: &u32| SIZES.contains(&bits.count_ones());
    let all: Vec<u32> = (0..1_u32 << speeds.len()).filter(of_size).collect();
    let scatter = scatter(&set, cases);
    let of = |&bits: &u32| {
        let kept = speeds.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, v)| *v);
        subset(&set, &kept.collect::<Vec<_>>(), candidates, scatter.as_ref())
    };
    let trials: Vec<Trial> = parallel::map(&all, of).into_iter().flatten().flatten().collect();
    let names = candidates.iter().map(ModelKind::name);
    let all: Vec<OverSubsets> =
        std::iter::once("auto").chain(names).filter_map(|name| over(name, &trials)).collect();
    let none = "--subsets: no subset of the speeds has a model for each speed that it lacks";
    Ok(if all.is_empty() { Err(none.into()) } else { Ok(all) })
}

/// The choice and every model by one subset; `None` if it lacks no speed inside its range, or one of the models cannot predict that.
fn subset(
    set: &TrainingSet,
    speeds: &[(f64, f64)],
    candidates: &[ModelKind],
    scatter: Option<&Scatter>,
) -> Option<Vec<Trial>> {
    let has = |v: f64| speeds.iter().any(|kept| is_within(v, *kept));
    let kept = set.with(|case| has(case.speed_m_per_s));
    let (judged, _) = without_repeated(set);
    let lacking = judged.into_iter().map(|k| &set.cases[k]);
    let lacking = lacking.filter(|case| !has(case.speed_m_per_s));
    let lacking = lacking.filter_map(|case| LeftOutCase::of(case, kept.clone()).ok());
    let lacking: Vec<LeftOutCase<'_>> = lacking.filter(|case| case.inner).collect();
    if lacking.is_empty() {
        return None;
    }
    let (fitting, _) = fittable(&kept, candidates);
    let (mut left_out, _) = left_out_cases(&kept, MOST_LEFT_OUT).ok()?;
    left_out.retain(|case| case.inner);
    let own = trials(&fitting, &left_out);
    let tables = Tables::of(&fitting, &own, left_out.len(), (set.force_kind, None));
    let (chosen, _) = tables.chosen(Purpose::Vehicle, &physical(&kept))?;
    let mut rows: Vec<LeftOut> = Vec::new();
    let mut means = Vec::new();
    let mut inside: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let material = lacking[0].material();
    for of in &tables.means {
        let kind = fitting.iter().find(|kind| kind.name() == of.model)?;
        let model = lacking[0].fit(*kind, &material);
        let rule = of.max_crush_rule;
        // The models are compared by the crush of the motion.
        let rules = [rule, MaxCrushRule::Motion];
        let rules = if rule == MaxCrushRule::Motion { &rules[..1] } else { &rules[..] };
        let judged = lacking.iter().map(|case| case.trial_of(*kind, &model, rules).judged(rule));
        // The models are compared over the same subsets.
        let judged = judged.collect::<Result<Vec<_>, _>>().ok()?;
        for (kind, residuals) in judged.iter().flat_map(|score| &score.residuals) {
            let scatter = scatter.and_then(|s| s.of_force(*kind, set.force_kind));
            let [band, _] = tables.bands(&of.model, *kind, scatter);
            let band = band.filter(|band| residuals.is_over_less_than(*band));
            let share = band.and_then(|band| residuals.inside_of(band));
            inside.entry(of.model.clone()).or_default().extend(share);
        }
        let own: Vec<LeftOut> = judged.into_iter().map(|score| score.row).collect();
        means.extend(mean(&of.model, of.max_crush_rule, &own));
        rows.extend(own);
    }
    let scores = scores(&means, &rows, Purpose::Vehicle);
    let sums: Vec<(&str, f64)> = scores.iter().map(|(m, of)| (*m, of.iter().sum())).collect();
    let best = sums.iter().map(|(_, sum)| *sum).fold(f64::INFINITY, f64::min);
    let trial = |name: &str, model: &str| {
        let (_, sum) = sums.iter().find(|(m, _)| *m == model)?;
        let means = means.iter().find(|m| m.model == model)?.clone();
        let inside = inside.get(model).cloned().unwrap_or_default();
        Some(Trial { model: name.into(), means, regret: sum / best - 1.0, inside })
    };
    let auto = std::iter::once(("auto", &*chosen));
    let each = sums.iter().map(|(model, _)| (*model, *model));
    Some(auto.chain(each).filter_map(|(name, model)| trial(name, model)).collect())
}

/// Means of a model over its subsets.
fn over(name: &str, trials: &[Trial]) -> Option<OverSubsets> {
    let own: Vec<&Trial> = trials.iter().filter(|trial| trial.model == name).collect();
    let mean = |of: fn(&Trial) -> f64| own.iter().map(|t| of(t)).sum::<f64>() / own.len() as f64;
    let inside: Vec<f64> = own.iter().flat_map(|t| t.inside.iter().copied()).collect();
    (!own.is_empty()).then(|| OverSubsets {
        model: name.into(),
        subsets: own.len(),
        force_l1: mean(|t| t.means.force_l1),
        max_crush_error: mean(|t| t.means.max_crush_error),
        velocity_l1: mean(|t| t.means.velocity_l1),
        acceleration_l1: mean(|t| t.means.acceleration_l1),
        mean_regret: mean(|t| t.regret),
        worst_regret: own.iter().map(|t| t.regret).fold(0.0, f64::max),
        coverage: (!inside.is_empty()).then(|| inside.iter().sum::<f64>() / inside.len() as f64),
    })
}
