//! Validation: every model at every left-out speed, and the chosen model.
//!
//! Each speed is left out and predicted by every model with every rule for the maximum crush, and each prediction drives
//! the multi-body model of one mass. Accelerations are compared after CFC 60 on both sides, the class of SAE J211 for
//! comparing structures of vehicles, and also unfiltered: above 100 Hz FE's body oscillates on its crush zone, which
//! no curve over deflection can hold. FE's own curves in the same model are listed with them.

use std::collections::BTreeMap;

use serde::Serialize;

use super::against::Against;
use super::choose::{NextRun, Purpose, Selection, choose, physical, scores};
use super::left_out::{Answers, LeftOutCase, LeftOutRun, Score, query_of};
use super::scatter::scatter;
use super::subsets::OverSubsets;
use crate::curve::{Case, ForceKind, group};
use crate::dataset::{TrainingSet, is_same_speed, is_within, nearly_same};
use crate::error::Error;
use crate::order;
use crate::parallel;
use crate::rating::acceptance::Acceptance;
use crate::surrogate::band::{self, Band, ForceScatter, LeftOutSpeeds, Residuals};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::leave_one_out::{Floor, LeftOut, Means, Validation};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{MODELS, Model, ModelKind, predict};
use crate::words::counted;

/// Most speeds that are left out: each costs what all others share.
pub(crate) const MOST_SPEEDS: usize = 20;

/// Ends on either side, besides the outermost, that a band outside the speeds rests on.
const FURTHER_ENDS: usize = 2;

/// What `crumple validate --json` prints.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Report {
    /// In the order of the database.
    pub(crate) groups: Vec<GroupReport>,
}

/// One group: its table, or why there is none.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(crate) enum GroupReport {
    /// The table of a group.
    Validated {
        /// Every model at every speed that was left out.
        #[serde(flatten)]
        validation: Box<Validation>,
        /// The chosen model at each inner speed by the acceptance rule for numerical crash models.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        acceptance: Vec<Accepted>,
        /// Absent if it was not asked for, or if there is no gap to run in.
        #[serde(skip_serializing_if = "Option::is_none")]
        next_run: Option<NextRun>,
        /// The choice and each model with fewer speeds; empty if that was not asked for.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        subsets: Vec<OverSubsets>,
        /// What has changed since an earlier validation; absent if none was given, or it lacks the group.
        #[serde(skip_serializing_if = "Option::is_none")]
        against: Option<Box<Against>>,
    },
    /// There is no table.
    Failed {
        /// Name of the group.
        group: String,
        /// Why, in a sentence.
        error: String,
    },
}

/// The prediction of a left-out speed by the acceptance rule.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Accepted {
    /// Name of the case.
    pub case: String,
    /// Its speed, in m/s.
    pub speed_m_per_s: f64,
    #[serde(flatten)]
    pub rule: Acceptance,
}

/// The chosen model at the inner speeds by the acceptance rule.
pub(crate) fn accepted(validation: &Validation) -> Vec<Accepted> {
    let rows = validation.rows.iter().filter(|row| row.inner && row.model == validation.chosen);
    let of = |row: &LeftOut| Accepted {
        case: row.case.clone(),
        speed_m_per_s: row.speed_m_per_s,
        rule: acceptance(row),
    };
    rows.map(of).collect()
}

/// A prediction of a left-out speed by the acceptance rule, the whole crush as one stage; FE's own work stands for the
/// initial energy, of which the rebound is a few per cent.
pub(crate) fn acceptance(row: &LeftOut) -> Acceptance {
    let mean_force_error = (1.0 + row.energy_error) / (1.0 + row.max_crush_error) - 1.0;
    Acceptance::of(row.energy_error, row.max_crush_error, mean_force_error)
}

/// Which model to train.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The one that leave-one-speed-out chooses; seed of the forests, and their number of trees
    /// if not their own.
    Auto {
        /// Where the model will be used.
        purpose: Purpose,
        /// Of all random draws.
        seed: u64,
        /// Of each forest.
        trees: Option<usize>,
    },
    /// This one; it is validated with `nearest` and `linear`.
    Kind(ModelKind),
}

/// Fits the chosen model to a group, with its validation.
///
/// # Errors
/// If the cases are not a training set, or too few for the model.
pub fn train(group: &str, cases: &[Case], choice: Choice) -> Result<Model, Error> {
    match choice {
        Choice::Auto { purpose, seed, trees } => {
            let asked = |kind: ModelKind| {
                kind.with_forest(|f| ForestOptions { trees: trees.unwrap_or(f.trees), ..f })
            };
            let candidates: Vec<ModelKind> = ModelKind::all(seed).into_iter().map(asked).collect();
            let validation = validate(group, cases, &candidates, Selection::Best(purpose))?;
            train_chosen(group, cases, &candidates, validation)
        }
        Choice::Kind(kind) => {
            // Errors of the model itself come before the validation.
            Model::check_fits(&TrainingSet::new(group, cases)?, kind)?;
            let mut candidates = vec![ModelKind::nearest(), ModelKind::linear()];
            candidates.retain(|baseline| baseline.name() != kind.name());
            candidates.push(kind);
            order::sort_by_key(&mut candidates, |kind| {
                MODELS.iter().position(|e| e.name == kind.name())
            });
            let named = Selection::Named(kind.name());
            let validation = validate(group, cases, &candidates, named)?;
            train_chosen(group, cases, &[kind], validation)
        }
    }
}

/// The model that `auto` chooses for a vehicle, by what it is chosen by and no more: there is no validation in
/// it, hence no band, and ends of the range are not left out.
pub(super) fn choose_and_fit(group: &str, cases: &[Case], seed: u64) -> Result<Model, Error> {
    let set = TrainingSet::new(group, cases)?;
    let (mut fitting, _) = fittable(&set, &ModelKind::all(seed));
    if set.cases.len() > MOST_SPEEDS {
        fitting = fitting.into_iter().map(ModelKind::judged).collect();
    }
    let (mut left_out, _) = left_out_cases(&set, MOST_SPEEDS).unwrap_or_default();
    left_out.retain(|case| case.inner);
    let trials = trials(&fitting, &left_out);
    let tables = Tables::of(&fitting, &trials, left_out.len(), (set.force_kind, None));
    let physical = physical(&set);
    let chosen = tables.chosen(Purpose::Vehicle, &physical);
    let (chosen, _) = chosen.unwrap_or_else(|| without_validation(&fitting, &physical));
    let all = ModelKind::all(seed);
    let kind = all.into_iter().find(|kind| kind.name() == chosen).expect("it is among all");
    let mut model = Model::fit(&set, kind)?;
    if let Some(means) = tables.means.iter().find(|m| m.model == chosen) {
        model.max_crush_rule = means.max_crush_rule;
    }
    Ok(model)
}

/// Fits the model of `kept` that a validation of these cases chose.
pub(crate) fn train_chosen(
    group: &str,
    cases: &[Case],
    kept: &[ModelKind],
    validation: Validation,
) -> Result<Model, Error> {
    let set = TrainingSet::new(group, cases)?;
    let chosen = kept.iter().find(|kind| kind.name() == validation.chosen);
    // Only the model that is kept needs the members of its leaves.
    let kind = chosen
        .copied()
        .unwrap_or(ModelKind::nearest())
        .with_forest(|forest| ForestOptions { quantiles: forest.bootstrap, ..forest });
    let mut model = Model::fit(&set, kind)?;
    if let Some(means) = validation.means.iter().find(|m| m.model == kind.name()) {
        model.max_crush_rule = means.max_crush_rule;
    }
    for (name, _, words) in group::remarks(cases) {
        // Of several runs at one speed, the case is their mean.
        let of = set.cases.iter().position(|case| case.runs.contains(&name));
        if let Some(case) = of.and_then(|k| model.cases.get_mut(k)) {
            case.warnings.push(words);
        }
    }
    model.leave_one_out = Some(validation);
    Ok(model)
}

/// Leaves every speed out in turn, of more than 20 cases so many that are spread over the range, and predicts it by every candidate.
///
/// A model that cannot be fitted to the group, or has no answer at a speed, is noted with the
/// reason; one without an answer at every inner speed has no means and cannot be chosen, nor for a
/// train one without an answer at an end.
///
/// # Errors
/// If the cases are not a training set.
pub fn validate(
    group: &str,
    cases: &[Case],
    candidates: &[ModelKind],
    selection: Selection<'_>,
) -> Result<Validation, Error> {
    validate_speeds(group, cases, candidates, selection, MOST_SPEEDS)
}

/// The same with at most so many speeds left out.
pub(crate) fn validate_speeds(
    group: &str,
    cases: &[Case],
    candidates: &[ModelKind],
    selection: Selection<'_>,
    most_speeds: usize,
) -> Result<Validation, Error> {
    let set = TrainingSet::new(group, cases)?;
    let (mut fitting, unsuited) = fittable(&set, candidates);
    let (left_out, mut notes) =
        left_out_cases(&set, most_speeds).unwrap_or_else(|too_few| (Vec::new(), vec![too_few]));
    if set.cases.len() > most_speeds {
        fitting = fitting.into_iter().map(ModelKind::judged).collect();
    }
    if set.cases.len() > most_speeds && !left_out.is_empty() {
        let rows = match set.features.is_empty() {
            true => "4 000 rows, the nearest in speed",
            false => "8 000 rows",
        };
        notes.push(format!(
            "{most_speeds} of {} cases, spread over the range, are left out in turn, and forests judged with at most 50 trees and {rows}: crumple validate --thorough leaves out every speed",
            set.cases.len()
        ));
    }
    let scatter = scatter(&set, cases);
    let declared = set.force_kind;
    let scatter_of = |force| scatter.as_ref()?.of_force(force, declared);
    let (floors, without_floors) = floors_of(&left_out);
    notes.extend(without_floors);
    let trials = trials(&fitting, &left_out);
    let inner_speeds = left_out.iter().filter(|case| case.inner).count();
    let mut tables = Tables::of(&fitting, &trials, inner_speeds, (declared, scatter_of(declared)));
    let (chosen, reason) = match selection {
        Selection::Named(model) => (model.to_string(), "asked for".into()),
        Selection::Best(purpose) => {
            let physical = physical(&set);
            let chosen = tables.chosen(purpose, &physical);
            chosen.unwrap_or_else(|| without_validation(&fitting, &physical))
        }
    };
    if let Some(kind) = fitting.iter().find(|kind| kind.name() == chosen) {
        tables.add_further_ends(kind, &set, scatter_of(declared));
    }
    let [band, band_outside] = tables.bands(&chosen, declared, scatter_of(declared));
    let [body_band, body_band_outside] = match declared {
        ForceKind::Contact => tables.bands(&chosen, ForceKind::Body, scatter_of(ForceKind::Body)),
        ForceKind::Body => [None; 2],
    };
    notes.extend(tables.notes);
    let (rows, means) = (tables.rows, tables.means);
    let group = group.into();
    Ok(Validation {
        group,
        chosen,
        reason,
        rows,
        means,
        floors,
        scatter,
        band,
        band_outside,
        body_band,
        body_band_outside,
        unsuited,
        notes,
    })
}

/// FE's own curves at the speeds that are left out, and why some have none.
fn floors_of(left_out: &[LeftOutCase<'_>]) -> (Vec<Floor>, Vec<String>) {
    let (mut floors, mut notes) = (Vec::new(), Vec::new());
    let (made, recorded): (Vec<_>, Vec<_>) =
        left_out.iter().partition(|left_out| left_out.case.moves_by_its_force());
    if !made.is_empty() {
        notes.push(format!(
            "curves without times, {} of {}: their motion is made of their force, and errors of velocity and acceleration are against that motion",
            made.len(),
            left_out.len()
        ));
    }
    for case in recorded {
        match case.floors() {
            Ok(own) => floors.extend(own),
            Err(error) => notes.push(format!("FE's own curves of \"{}\": {error}", case.own.name)),
        }
    }
    (floors, notes)
}

/// The candidates that can be fitted to the set, and why the others cannot.
pub(super) fn fittable(
    set: &TrainingSet,
    candidates: &[ModelKind],
) -> (Vec<ModelKind>, Vec<String>) {
    let (mut fitting, mut unsuited) = (Vec::new(), Vec::new());
    for &kind in candidates {
        match Model::check_fits(set, kind) {
            Ok(()) => fitting.push(kind),
            Err(error) => unsuited.push(format!("{}: {error}", kind.name())),
        }
    }
    (fitting, unsuited)
}

/// Every case left out in turn, or so many that are spread over the range, with notes on those that cannot be.
pub(super) fn left_out_cases(
    set: &TrainingSet,
    most_speeds: usize,
) -> Result<(Vec<LeftOutCase<'_>>, Vec<String>), String> {
    let mut speeds = set.speeds_m_per_s();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    let found = speeds.len();
    if found < 3 {
        let speeds = counted(found, "speed");
        return Err(format!("the group has {speeds}: leaving one out needs at least 3"));
    }
    let (mut left_out, mut notes) = (Vec::new(), Vec::new());
    let (judged, repeated) = without_repeated(set);
    notes.extend(repeated);
    let all = judged.len();
    let chosen: Vec<usize> = if all > most_speeds {
        (0..most_speeds).map(|k| judged[k * (all - 1) / (most_speeds - 1)]).collect()
    } else {
        judged
    };
    for index in chosen {
        match LeftOutCase::new(set, index) {
            Ok(case) => left_out.push(case),
            Err(error) => notes.push(error.to_string()),
        }
    }
    Ok((left_out, notes))
}

/// The cases that are judged, of those that nearly repeat each other one: as several they would count as evidence several times. And
/// a note on the others.
pub(super) fn without_repeated(set: &TrainingSet) -> (Vec<usize>, Option<String>) {
    let speeds = set.speeds_m_per_s();
    let (mut judged, mut others): (Vec<usize>, Vec<String>) = (Vec::new(), Vec::new());
    for (k, case) in set.cases.iter().enumerate() {
        let left_out = nearly_same(&speeds, case.speed_m_per_s);
        let repeats = judged.iter().map(|&j| &set.cases[j]).find(|other| {
            !other.truncated
                && is_within(other.speed_m_per_s, left_out)
                && !is_same_speed(other.speed_m_per_s, case.speed_m_per_s)
                && other.case.conditions.parameters == case.case.conditions.parameters
        });
        match repeats {
            Some(other) => others.push(format!("{} with {}", case.name, other.name)),
            None => judged.push(k),
        }
    }
    let note = (!others.is_empty()).then(|| {
        format!(
            "speeds that nearly repeat another are left out together with it: {}",
            others.join(", ")
        )
    });
    (judged, note)
}

/// Every model at every case, in this order.
pub(super) fn trials<'a>(
    kinds: &[ModelKind],
    left_out: &'a [LeftOutCase<'a>],
) -> Vec<LeftOutRun<'a>> {
    parallel::map(left_out, |case| case.trials(kinds)).into_iter().flatten().collect()
}

/// Results of the left-out speeds for all models.
#[derive(Default)]
pub(super) struct Tables {
    pub(super) rows: Vec<LeftOut>,
    pub(super) means: Vec<Means>,
    residuals: BTreeMap<&'static str, ResidualsOf>,
    notes: Vec<String>,
}

impl Tables {
    /// With the declared force and its scatter.
    pub(super) fn of(
        fitting: &[ModelKind],
        trials: &[LeftOutRun<'_>],
        inner_speeds: usize,
        declared: (ForceKind, Option<ForceScatter>),
    ) -> Self {
        let mut all = Self::default();
        for kind in fitting {
            let own: Vec<&LeftOutRun<'_>> =
                trials.iter().filter(|t| t.model == kind.name()).collect();
            let Some(table) = ModelTable::of(kind, &own, declared) else { continue };
            all.notes.extend(table.failures);
            match mean(kind.name(), table.rule, &table.rows) {
                Some(of) if of.speeds < inner_speeds => all.notes.push(without_means(kind.name())),
                of => all.means.extend(of),
            }
            all.residuals.insert(kind.name(), table.residuals);
            all.rows.extend(table.rows);
        }
        all
    }

    /// The model chosen for a purpose, and why.
    pub(super) fn chosen(&self, purpose: Purpose, physical: &[&str]) -> Option<(String, String)> {
        // Where cases differ in more than speed, a speed may have several of them.
        let is_repeated = |rows: &[LeftOut]| {
            let [a, b] = rows else { return false };
            a.model == b.model && is_same_speed(a.speed_m_per_s, b.speed_m_per_s)
        };
        let what = if self.rows.windows(2).any(is_repeated) { "case" } else { "speed" };
        choose(&scores(&self.means, &self.rows, purpose), purpose, physical, what)
    }

    /// Adds residuals at ends of the set without its outermost one and two speeds on either side: two ends would be little evidence.
    /// The rows of the ends then state what the band of all these holds of them.
    fn add_further_ends(
        &mut self,
        kind: &ModelKind,
        set: &TrainingSet,
        scatter: Option<ForceScatter>,
    ) {
        let Some(means) = self.means.iter().find(|m| m.model == kind.name()) else { return };
        if !set.features.is_empty() {
            return;
        }
        let (rule, all) = (means.max_crush_rule, set.speeds_m_per_s());
        let mut speeds = all.clone();
        speeds.dedup_by(|v, before| is_within(*v, nearly_same(&all, *before)));
        let last = speeds.len() - 1;
        // Three speeds remain besides the end.
        let further = (1..=FURTHER_ENDS).take_while(|k| k + 3 <= last);
        let ends = further.flat_map(|k| [(true, speeds[k]), (false, speeds[last - k])]);
        let of_end = |(is_low, end): (bool, f64)| {
            let end = nearly_same(&all, end);
            let set = set.with(|case| {
                let v = case.speed_m_per_s;
                is_within(v, end) || if is_low { v > end.0 } else { v < end.0 }
            });
            let case = LeftOutCase::new(&set, if is_low { 0 } else { set.cases.len() - 1 }).ok()?;
            let trial = case.trial_of(*kind, &case.fit(*kind, &case.material()), &[rule]);
            trial.judged(rule).ok().map(|score| score.residuals)
        };
        let residuals = parallel::map(ends, of_end);
        let own = self.residuals.entry(kind.name()).or_default();
        for (force, of) in residuals.into_iter().flatten().flatten() {
            own.entry((force, LeftOutSpeeds::Ends)).or_default().push(of);
        }
        let Some(ends) = own.get(&(set.force_kind, LeftOutSpeeds::Ends)) else { return };
        let rows = self.rows.iter_mut().filter(|row| !row.inner && row.model == kind.name());
        for (i, row) in rows.enumerate() {
            row.coverage = band::coverage(LeftOutSpeeds::Ends, ends, i, scatter);
        }
    }

    /// The bands of one force of a model: between training speeds, and outside of them.
    pub(super) fn bands(
        &self,
        model: &str,
        force: ForceKind,
        scatter: Option<ForceScatter>,
    ) -> [Option<Band>; 2] {
        [LeftOutSpeeds::Inner, LeftOutSpeeds::Ends].map(|left_out| {
            let residuals = self.residuals.get(model)?.get(&(force, left_out))?;
            Band::of(left_out, residuals, scatter)
        })
    }
}

/// Residuals of each force at the inner speeds, and at the ends.
type ResidualsOf = BTreeMap<(ForceKind, LeftOutSpeeds), Vec<Residuals>>;

/// The rows of one model, by its rule for the maximum crush.
struct ModelTable {
    rule: MaxCrushRule,
    rows: Vec<LeftOut>,
    residuals: ResidualsOf,
    /// Why a trial has no row.
    failures: Vec<String>,
}

impl ModelTable {
    /// With the declared force and its scatter; `None` without any trial.
    fn of(
        kind: &ModelKind,
        trials: &[&LeftOutRun<'_>],
        (declared, scatter): (ForceKind, Option<ForceScatter>),
    ) -> Option<Self> {
        let rule = best_rule(kind, trials)?;
        let mut rows = Vec::new();
        let mut residuals = ResidualsOf::new();
        let mut failures = Vec::new();
        let judged = parallel::map(trials, |trial| trial.judged(rule));
        for judged in judged {
            match judged {
                Ok(Score { row, residuals: of }) => {
                    for (force, of) in of {
                        let left_out = LeftOutSpeeds::of(row.inner);
                        residuals.entry((force, left_out)).or_default().push(of);
                    }
                    rows.push(row);
                }
                Err(error) => failures.push(error),
            }
        }
        let mut index: BTreeMap<LeftOutSpeeds, usize> = BTreeMap::new();
        for row in &mut rows {
            let left_out = LeftOutSpeeds::of(row.inner);
            let i = index.entry(left_out).or_default();
            row.coverage = band::coverage(left_out, &residuals[&(declared, left_out)], *i, scatter);
            *i += 1;
        }
        Some(Self { rule, rows, residuals, failures })
    }
}

/// Adds the rows and means of `auto` itself: with every inner speed left out, model and rule
/// are chosen again by leaving out speeds of what remains.
///
/// The errors of the chosen model are those that it was chosen by, and so a little too good;
/// these are not. Speeds that leave fewer than three others, or fail otherwise, have no row but a
/// note.
pub(crate) fn add_nested(
    validation: &mut Validation,
    cases: &[Case],
    seed: u64,
) -> Result<(), Error> {
    let group = validation.group.clone();
    let set = TrainingSet::new(&group, cases)?;
    let mut speeds = set.speeds_m_per_s();
    speeds.dedup_by(|a, b| is_same_speed(*a, *b));
    if speeds.len() < 4 {
        validation.notes.push(format!(
            "auto has no errors of its own: choosing again without one speed needs at least 4, the group has {}",
            speeds.len()
        ));
        return Ok(());
    }
    // Cases that cannot be left out have been noted.
    let (mut left_out, _) = left_out_cases(&set, MOST_SPEEDS).unwrap_or_default();
    left_out.retain(|case| case.inner);
    let trials = parallel::map(&left_out, |held| {
        let left_out = nearly_same(&set.speeds_m_per_s(), held.own.speed_m_per_s);
        let others: Vec<Case> = cases
            .iter()
            .filter(|c| !is_within(c.conditions.speed.m_per_s, left_out))
            .cloned()
            .collect();
        let predicted = choose_and_fit(&group, &others, seed).and_then(|model| {
            let curve = predict(&model, &query_of(held.case, &model))?;
            let rule = curve.provenance.max_crush_rule;
            let rule = rule.expect("a prediction says its rule");
            Ok((rule, held.answer(curve)?))
        });
        let answer = predicted.map_or_else(
            |error| (MaxCrushRule::Motion, Err(error.to_string())),
            |(rule, answer)| (rule, Ok(answer)),
        );
        LeftOutRun { model: "auto", held, answers: Answers::from([answer]) }
    });
    // Each has one rule.
    let of = |trial: &LeftOutRun<'_>| trial.answers.keys().next().copied();
    let (mut rows, mut failures) = (Vec::new(), Vec::new());
    for trial in &trials {
        match trial.judged(of(trial).expect("it has one")) {
            Ok(judged) => rows.push(judged.row),
            Err(error) => failures.push(error),
        }
    }
    validation.notes.extend(failures);
    let rule = trials.first().and_then(of).unwrap_or(MaxCrushRule::Motion);
    match mean("auto", rule, &rows) {
        Some(of) if of.speeds < left_out.len() => validation.notes.push(without_means("auto")),
        of => validation.means.extend(of),
    }
    validation.rows.extend(rows);
    Ok(())
}

/// Why a model is not among the means.
fn without_means(model: &str) -> String {
    format!("{model} has no means and cannot be chosen: it cannot predict every inner speed")
}

/// With too few speeds to leave one out: the default, or of cases that differ in more than speed a forest, which blends them.
fn without_validation(fitting: &[ModelKind], physical: &[&str]) -> (String, String) {
    let fits = |name: &&&str| fitting.iter().any(|kind| kind.name() == **name);
    let default = physical.iter().chain(&["extra"]).find(fits).unwrap_or(&"nearest");
    ((*default).into(), "too few speeds to leave one out".into())
}

/// The rule for the maximum crush: the body's motion, unless another has answers at more of the speeds; the reference method keeps its
/// spline. `None` without any trial.
fn best_rule(kind: &ModelKind, trials: &[&LeftOutRun<'_>]) -> Option<MaxCrushRule> {
    let missing = |rule: &MaxCrushRule| {
        let of = |inner| trials.iter().filter(move |t| t.held.inner == inner);
        let lacks = |t: &&&LeftOutRun<'_>| t.answer(*rule).is_none();
        (of(true).filter(lacks).count(), of(false).filter(lacks).count())
    };
    // The spline is not monotone by construction: it is used only on request.
    let rules = [MaxCrushRule::Motion, MaxCrushRule::Energy, MaxCrushRule::Monotone];
    let best = (!trials.is_empty()).then_some(rules)?.into_iter().min_by_key(missing)?;
    if kind.is_reference_method() && missing(&MaxCrushRule::Spline).0 <= missing(&best).0 {
        Some(MaxCrushRule::Spline)
    } else {
        Some(best)
    }
}

/// Means over the inner speeds; `None` without any.
pub(super) fn mean(model: &str, rule: MaxCrushRule, rows: &[LeftOut]) -> Option<Means> {
    mean_over(model, rule, rows.iter().filter(|r| r.inner).collect())
}

/// Means over these rows of one model; `None` without any.
fn mean_over(model: &str, rule: MaxCrushRule, rows: Vec<&LeftOut>) -> Option<Means> {
    let over =
        |of: fn(&LeftOut) -> f64| rows.iter().map(|r| of(r).abs()).sum::<f64>() / rows.len() as f64;
    let over_known = |of: fn(&LeftOut) -> Option<f64>| {
        let sum: Option<f64> = rows.iter().map(|r| Some(of(r)?.abs())).sum();
        sum.map(|sum| sum / rows.len() as f64)
    };
    (!rows.is_empty()).then(|| Means {
        model: model.into(),
        speeds: rows.len(),
        force_l1: over(|r| r.force_l1),
        energy_error: over(|r| r.energy_error),
        max_crush_error: over(|r| r.max_crush_error),
        max_crush_rule: rule,
        max_crush_errors: MaxCrushRule::ALL
            .into_iter()
            .filter_map(|rule| {
                let errors: Option<Vec<f64>> =
                    rows.iter().map(|r| Some(r.max_crush_errors.get(&rule)?.abs())).collect();
                Some((rule, errors?.iter().sum::<f64>() / rows.len() as f64))
            })
            .collect(),
        peak_force_error: over_known(|r| r.peak_force_error),
        rebound_error: over_known(|r| r.rebound_error),
        velocity_l1: over(|r| r.velocity_l1),
        acceleration_l1: over(|r| r.acceleration_l1),
        acceleration_unfiltered_l1: over(|r| r.acceleration_unfiltered_l1),
    })
}
