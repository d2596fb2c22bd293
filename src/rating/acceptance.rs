//! The acceptance rule for numerical crash models that rail practice quotes from EN 15227: the same sequence, dissipated
//! energy within 10 % of the initial energy, displacement and mean force of each stage within 10 %.

use serde::Serialize;

use crate::order;
use crate::signal::integral;

/// The edition in force; its text is not public, so the rule is stated here as practice quotes it.
pub(crate) const STANDARD: &str = "EN 15227:2020+A1:2024, as rail practice quotes it";
/// What it asks of a prediction of one stage.
pub(crate) const ACCEPTANCE: &str =
    "dissipated energy within 10 % of the initial energy, displacement and mean force within 10 %";
/// Largest error that passes.
pub(crate) const LIMIT: f64 = 0.1;

/// A prediction's errors by the rule. Errors are prediction over reference minus 1, but for the energy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Acceptance {
    /// Difference of the dissipated energies over the initial energy.
    pub energy_error: f64,
    /// Of the largest displacement; null where the reference has none.
    pub displacement_error: Option<f64>,
    /// Of the mean force until there; null where the reference has none.
    pub mean_force_error: Option<f64>,
    /// Whether all three are within 10 %.
    pub passes: bool,
}

impl Acceptance {
    pub(crate) fn of(energy_error: f64, displacement_error: f64, mean_force_error: f64) -> Self {
        let known = |error: f64| Some(error).filter(|error| error.is_finite());
        let errors = [energy_error, displacement_error, mean_force_error];
        let passes = errors.iter().all(|error| error.abs() <= LIMIT);
        let [displacement_error, mean_force_error] =
            [displacement_error, mean_force_error].map(known);
        Self { energy_error, displacement_error, mean_force_error, passes }
    }

    /// The error that is largest in magnitude.
    pub(crate) fn worst(&self) -> f64 {
        let errors = [Some(self.energy_error), self.displacement_error, self.mean_force_error];
        errors.into_iter().flatten().fold(0.0, |worst, error| worst.max(error.abs()))
    }
}

/// Force over deflection at one place of a run, over time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StageRecord<'a> {
    pub name: &'a str,
    pub time_s: &'a [f64],
    pub deflection_m: &'a [f64],
    pub force_n: &'a [f64],
}

/// What a stage came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct StageResult {
    /// Until the end of the record: what came back is not in it.
    #[serde(rename = "dissipated_J")]
    pub dissipated_j: f64,
    pub displacement_m: f64,
    /// Until the largest displacement.
    #[serde(rename = "mean_force_N")]
    pub mean_force_n: f64,
    /// When it first had a force.
    pub begin_s: Option<f64>,
    /// Whether the record ends while the displacement grows: neither it nor the energy is final.
    pub is_cut: bool,
}

impl StageResult {
    /// Energy taken until the largest displacement, or what it dissipates in all, in pulls and in strokes after the largest one, in J.
    fn most_j(&self) -> f64 {
        (self.mean_force_n * self.displacement_m).max(self.dissipated_j)
    }
}

impl StageRecord<'_> {
    /// What has been taken until each time. Below 0 a gap is open, and the force is 0 there.
    fn work_j(&self) -> Vec<f64> {
        let states = self.deflection_m.len().min(self.force_n.len());
        integral(&self.deflection_m[..states], &self.force_n[..states])
    }

    fn result(&self) -> StageResult {
        let (d, f) = (self.deflection_m, self.force_n);
        let last = d.len().min(f.len()).saturating_sub(1);
        let top = (0..=last).filter(|k| *k < d.len()).max_by(|a, b| d[*a].total_cmp(&d[*b]));
        let top = top.unwrap_or_default();
        let work_j = self.work_j();
        let work = |to: usize| work_j.get(to).copied().unwrap_or_default();
        let displacement_m = d.get(top).copied().unwrap_or_default().max(0.0);
        let until_top = work(top);
        let begin = f.iter().position(|force| *force != 0.0);
        let begin_s = begin.and_then(|k| self.time_s.get(k.saturating_sub(1))).copied();
        let speed = |from_s: f64, from_m: f64, to: usize| {
            (d[to] - from_m).max(0.0) / (self.time_s[to] - from_s)
        };
        let is_cut = top > 0 && top == last && {
            let last_m_per_s = speed(self.time_s[top - 1], d[top - 1].max(0.0), top);
            begin_s.is_some_and(|from_s| last_m_per_s > STILL * speed(from_s, 0.0, top))
        };
        StageResult {
            is_cut,
            dissipated_j: work(last),
            displacement_m,
            mean_force_n: if displacement_m > 0.0 { until_top / displacement_m } else { 0.0 },
            begin_s,
        }
    }
}

/// Prediction over reference, minus 1; 0 where they are equal, as where both only pull.
fn relative(prediction: f64, reference: f64) -> f64 {
    if prediction == reference { 0.0 } else { prediction / reference - 1.0 }
}

/// One stage of both runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct StageAcceptance {
    pub stage: String,
    pub reference: StageResult,
    pub prediction: StageResult,
    #[serde(flatten)]
    pub acceptance: Acceptance,
    /// Whether it counts: in one of the runs it takes at least 1 % of the reference's energy.
    pub counts: bool,
}

/// Two runs by the rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct RunAcceptance {
    pub standard: &'static str,
    pub limit: f64,
    /// What energies are compared with.
    #[serde(rename = "initial_energy_J")]
    pub initial_energy_j: f64,
    /// Difference of the energies of all stages over the initial energy.
    pub energy_error: f64,
    pub stages: Vec<StageAcceptance>,
    /// Stages that count and that only one of the runs has.
    pub missing: Vec<String>,
    /// Stages that count, in the order in which they begin in the reference and in the prediction.
    pub sequences: [Vec<String>; 2],
    pub same_sequence: bool,
    pub passes: bool,
}

/// A displacement that grows by less than this share of its mean speed has come to its end.
const STILL: f64 = 0.01;
/// Share of the reference's energy below which a stage does not count.
const LEAST_SHARE: f64 = 0.01;

/// Rates the stages of two runs by their names. Energies are compared with what the reference's stages have taken together, at the
/// time when that is most, which is less than the initial energy and so stricter. `None` if they have no stage in common.
///
/// The stages of a run have the same times. Those that begin within `tie_s` of each other have no order.
pub(crate) fn accept(
    reference: &[StageRecord<'_>],
    prediction: &[StageRecord<'_>],
    tie_s: f64,
) -> Option<RunAcceptance> {
    let pairs: Vec<(&str, StageResult, StageResult)> = reference
        .iter()
        .filter_map(|r| {
            let p = prediction.iter().find(|p| p.name == r.name)?;
            Some((r.name, r.result(), p.result()))
        })
        .collect();
    let most_j = |stages: &[StageRecord<'_>]| -> f64 {
        let of: Vec<Vec<f64>> = stages.iter().map(StageRecord::work_j).collect();
        let at = |k: usize| -> f64 { of.iter().filter_map(|of| of.get(k).or(of.last())).sum() };
        let states = of.iter().map(Vec::len).max().unwrap_or_default();
        (0..states).map(at).fold(0.0, f64::max)
    };
    let lacks = |of: &[StageRecord<'_>], other: &[StageRecord<'_>]| -> Vec<String> {
        let least_j = LEAST_SHARE * most_j(of);
        let alone = of.iter().filter(|stage| other.iter().all(|o| o.name != stage.name));
        let counting = alone.filter(|stage| stage.result().most_j() >= least_j);
        counting.map(|stage| stage.name.to_string()).collect()
    };
    let missing = [lacks(reference, prediction), lacks(prediction, reference)].concat();
    let initial_energy_j = most_j(reference);
    if pairs.is_empty() || initial_energy_j <= 0.0 {
        return None;
    }
    let stages: Vec<StageAcceptance> = pairs
        .iter()
        .map(|(name, r, p)| StageAcceptance {
            stage: (*name).into(),
            reference: *r,
            prediction: *p,
            acceptance: Acceptance::of(
                (p.dissipated_j - r.dissipated_j) / initial_energy_j,
                relative(p.displacement_m, r.displacement_m),
                relative(p.mean_force_n, r.mean_force_n),
            ),
            counts: r.most_j().max(p.most_j()) >= LEAST_SHARE * initial_energy_j,
        })
        .collect();
    let all_j = |stages: &[StageRecord<'_>]| -> f64 {
        stages.iter().map(|stage| stage.result().dissipated_j).sum()
    };
    let energy_error = (all_j(prediction) - all_j(reference)) / initial_energy_j;
    let counting: Vec<&StageAcceptance> = stages.iter().filter(|stage| stage.counts).collect();
    let same_sequence = counting.iter().all(|a| {
        counting.iter().all(|b| {
            let before = |of: fn(&StageAcceptance) -> Option<f64>| {
                Some(of(b)? - of(a)?).filter(|gap| gap.abs() > tie_s).map(|gap| gap > 0.0)
            };
            let (r, p) = (before(|s| s.reference.begin_s), before(|s| s.prediction.begin_s));
            r.is_none() || p.is_none() || r == p
        })
    }) && counting
        .iter()
        .all(|stage| stage.reference.begin_s.is_some() == stage.prediction.begin_s.is_some());
    let order = |begin: fn(&StageAcceptance) -> Option<f64>| {
        let mut order = counting.clone();
        order.retain(|stage| begin(stage).is_some());
        let time = |stage: &StageAcceptance| begin(stage).unwrap_or(f64::INFINITY);
        order::sort(&mut order, |a, b| time(a).total_cmp(&time(b)));
        order.into_iter().map(|stage| stage.stage.clone()).collect::<Vec<String>>()
    };
    let sequences = [order(|s| s.reference.begin_s), order(|s| s.prediction.begin_s)];
    let passes = same_sequence
        && !counting.is_empty()
        && missing.is_empty()
        && energy_error.abs() <= LIMIT
        && counting.iter().all(|stage| {
            stage.acceptance.passes && !stage.reference.is_cut && !stage.prediction.is_cut
        });
    Some(RunAcceptance {
        standard: STANDARD,
        limit: LIMIT,
        initial_energy_j,
        energy_error,
        sequences,
        same_sequence,
        passes,
        missing,
        stages,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 5] = [0.0, 0.1, 0.2, 0.3, 0.4];

    fn stage<'a>(name: &'a str, d: &'a [f64], f: &'a [f64]) -> StageRecord<'a> {
        StageRecord { name, time_s: &TIMES, deflection_m: d, force_n: f }
    }

    /// By hand: a triangle up to 1 m and 2 N, elastic back to half of it.
    #[test]
    fn energies_displacements_and_sequences() {
        let (d, f) = ([-0.5, 0.0, 1.0, 0.5, 0.5], [0.0, 0.0, 2.0, 0.0, 0.0]);
        let one = stage("a", &d, &f).result();
        assert_eq!((one.dissipated_j, one.displacement_m, one.mean_force_n), (0.5, 1.0, 1.0));
        assert_eq!(one.begin_s, Some(0.1));
        // 8 % further, 8 % weaker: the energies until there are nearly the same.
        let (d2, f2) = ([-0.5, 0.0, 1.08, 0.54, 0.54], [0.0, 0.0, 1.84, 0.0, 0.0]);
        let later = ([0.0, 0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0, 1.0]);
        let first = ([0.0, 1.0, 1.0, 1.0, 1.0], [0.5, 1.0, 1.0, 1.0, 1.0]);
        let reference = [stage("a", &d, &f), stage("b", &later.0, &later.1)];
        let close = [stage("a", &d2, &f2), stage("b", &later.0, &later.1)];
        let found = accept(&reference, &close, 0.01).unwrap();
        assert!(found.passes && found.same_sequence, "{found:?}");
        // All of the first, or what it keeps and the other.
        assert_eq!(found.initial_energy_j, 1.0);
        assert!((found.stages[0].acceptance.displacement_error.unwrap() - 0.08).abs() < 1e-12);
        assert!((found.stages[0].acceptance.mean_force_error.unwrap() + 0.08).abs() < 1e-12);
        let turned = [stage("b", &first.0, &first.1), stage("a", &d2, &f2)];
        let found = accept(&reference, &turned, 0.01).unwrap();
        assert!(!found.same_sequence && !found.passes);
        assert_eq!(found.sequences[1], ["b", "a"]);
        let found = accept(&reference, &close[..1], 0.01).unwrap();
        assert!(!found.passes && found.missing == ["b"], "{found:?}");
        assert!(accept(&reference, &[], 0.01).is_none());
        // Cut while the last stage grows, in one of the runs.
        let cut = StageRecord { deflection_m: &later.0[..4], force_n: &later.1[..4], ..close[1] };
        let found = accept(&reference, &[close[0], cut], 0.01).unwrap();
        assert!(!found.passes && found.stages[1].prediction.is_cut, "{found:?}");
        assert!(found.stages[1].acceptance.passes && !found.stages[0].prediction.is_cut);
        // What gives its energy back counts by what it took; so does what only the prediction crushes.
        let elastic = ([0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0, 0.0]);
        let half = ([0.0, 0.5, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0, 0.0]);
        let [one, other] = [&elastic, &half].map(|(d, f)| [stage("a", d, f)]);
        let found = accept(&one, &other, 0.01).unwrap();
        assert!(!found.passes && found.stages[0].counts, "{found:?}");
        assert!(accept(&one, &one, 0.01).unwrap().passes);
        let untouched = stage("b", &[0.0; 5], &[0.0; 5]);
        let found = accept(&[one[0], untouched], &[one[0], stage("b", &d, &f)], 0.01).unwrap();
        assert!(!found.passes && !found.same_sequence && found.stages[1].counts, "{found:?}");
        assert_eq!(found.sequences, [vec!["a"], vec!["a", "b"]]);
        assert_eq!(found.stages[1].acceptance.displacement_error, None);
        // A coupler that only pulls is rated by its energy, however little is crushed.
        let pull = [0.0, -0.5, -1.0, -1.0, -1.0];
        let (strong, weak) = ([0.0, -1.0, -1.0, 0.0, 0.0], [0.0, -0.5, -0.5, 0.0, 0.0]);
        let [strong, weak] = [&strong, &weak].map(|f| [one[0], stage("b", &pull, f)]);
        assert!(accept(&strong, &strong, 0.01).unwrap().passes);
        let found = accept(&strong, &weak, 0.01).unwrap();
        assert!(found.stages[1].counts && !found.passes, "{found:?}");
        // At the bound, and beyond.
        assert!(Acceptance::of(0.1, -0.1, 0.1).passes && !Acceptance::of(0.0, 0.0, 0.1001).passes);
    }
}
