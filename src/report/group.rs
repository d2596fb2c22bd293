//! The report on a group: its runs, the accuracy of predictions, a prediction, the methods.

use std::collections::BTreeSet;

use super::figure::Figure;
use super::{
    Content, KeyFigure, MethodSpeeds, Part, ReportSettings, Section, ToDo, Verdict, metres, percent,
};
use crate::assess::choose::{Purpose, Selection, next_run};
use crate::assess::compare::{Comparison, case_named, compare, has_all, inner_cases, mean};
use crate::assess::left_out::query_of;
use crate::assess::validate::{Choice, acceptance, train_chosen, validate};
use crate::assess::{ComparisonSettings, Row};
use crate::charts;
use crate::curve::{Case, ForceKind, Parameter};
use crate::dataset::TrainingSet;
use crate::error::Error;
use crate::rating::acceptance::{ACCEPTANCE, Acceptance, STANDARD};
use crate::surrogate::leave_one_out::{LeftOut, Means, Validation};
use crate::surrogate::{Model, ModelKind, PredictedCurve, Query, predict};
use crate::table::{Cell, Table};
use crate::unit::{Shown, km_per_h};
use crate::words::counted;

/// Adds the section of a group under a title; gives the curve predicted for it.
pub(super) fn add(
    content: &mut Content,
    title: &str,
    group: &str,
    cases: &[Case],
    models: &[Model],
    settings: &ReportSettings,
) -> Result<Option<Design>, Error> {
    let number = content.sections.len() + 1;
    let own = cases.first().map_or(ForceKind::Contact, |case| case.curves.force_kind);
    let mut parts = vec![
        Part::Figure(Figure::new(
            format!("g{number}-curves"),
            charts::group_curves(group, cases, own),
        )),
        Part::table(format!("Runs of {group}"), runs(cases)),
    ];
    for (warning, names, is_one_text) in by_warning(cases) {
        let named = names[..names.len().min(MOST_NAMED)].join(", ");
        let more = if names.len() > MOST_NAMED { ", …" } else { "" };
        let of_first = if is_one_text { "" } else { "; the numbers are those of the first" };
        let runs = match &names[..] {
            [one] => (*one).to_string(),
            several => format!("{} runs ({named}{more}{of_first})", several.len()),
        };
        content.warn(ToDo::CheckRuns, &format!("{title}, {runs}"), warning.into());
    }
    let mut design = None;
    match known_or_new(group, cases, models, settings) {
        Ok(validation) => {
            let validated = Validated { title, group, cases, validation, number };
            validated.add_validation(content, &mut parts, settings);
            let curve = validated.add_prediction(content, &mut parts, settings)?;
            validated.add_methods(&mut parts, settings)?;
            design = curve.map(|curve| Design {
                title: title.into(),
                runs: cases.len(),
                chosen: validated.validation.chosen_means().cloned(),
                curve,
            });
        }
        Err(error) => {
            content.warn(ToDo::CheckRuns, title, format!("it cannot be validated: {error}"));
        }
    }
    let id = format!("group-{number}");
    content.sections.push(Section { id, title: title.into(), parts });
    Ok(design)
}

/// What of a group is compared with other groups.
pub(super) struct Design {
    pub title: String,
    pub runs: usize,
    /// Errors of the chosen model at left-out speeds.
    pub chosen: Option<Means>,
    pub curve: PredictedCurve,
}

/// Runs with a warning that are named. In groups of more runs warnings that differ in numbers alone are one.
const MOST_NAMED: usize = 10;

/// Each warning of the runs once, with the names of the runs that have it, and whether these have one text: of many runs, once for
/// all numbers.
fn by_warning(cases: &[Case]) -> Vec<(&str, Vec<&str>, bool)> {
    let mut all: Vec<(&str, Vec<&str>, bool)> = Vec::new();
    let words = |of: &str| of.replace(|c: char| c.is_ascii_digit() || c == '.', "");
    let are_many = cases.len() > MOST_NAMED;
    for case in cases {
        let name = &*case.id.name;
        for warning in &case.quality.warnings {
            // Two of one run are two.
            let is_same = |(known, names, _): &&mut (&str, Vec<&str>, bool)| {
                *known == warning
                    || are_many && names.last() != Some(&name) && words(known) == words(warning)
            };
            match all.iter_mut().find(is_same) {
                Some((known, names, is_one_text)) => {
                    *is_one_text &= *known == warning;
                    if names.last() != Some(&name) {
                        names.push(name);
                    }
                }
                None => all.push((warning, vec![name], true)),
            }
        }
    }
    all
}

/// The validation that a model of these cases carries, or a new one.
fn known_or_new(
    group: &str,
    cases: &[Case],
    models: &[Model],
    settings: &ReportSettings,
) -> Result<Validation, Error> {
    let hash = TrainingSet::new(group, cases)?.hash();
    let is_of_these = |model: &&Model| model.group == group && model.training_hash == hash;
    match models.iter().find(is_of_these).and_then(|model| model.leave_one_out.clone()) {
        Some(known) => Ok(known),
        None => validate(
            group,
            cases,
            &ModelKind::all(settings.seed),
            Selection::Best(Purpose::Vehicle),
        ),
    }
}

/// Speed, mass, parameters, peak, crush and audit of every run.
fn runs(cases: &[Case]) -> impl Into<Table> {
    let kind = cases.first().map_or("impact", |case| case.conditions.speed.kind.name());
    let parameters: BTreeSet<&String> =
        cases.iter().flat_map(|case| case.conditions.parameters.keys()).collect();
    let table = Table::of(cases)
        .column("run", |case| &case.id.name)
        .column(format!("{kind} speed"), |case| km_per_h(case.conditions.speed.m_per_s))
        .column("mass", |case| masses(case));
    let table = parameters.into_iter().fold(table, |table, name| {
        table.column(name.as_str(), move |case| {
            case.conditions.parameters.get(name).map_or("–".into(), Parameter::to_string)
        })
    });
    table
        .column("peak force", |case| Shown::one_force(case.peak_force_n()))
        .column("maximum crush", |case| {
            let truncated = if case.is_truncated() { " (truncated)" } else { "" };
            metres(case.max_deflection_m()) + truncated
        })
        .column("work", |case| Shown::one_energy(case.quality.audit.work_j))
        .column("work / energy", |case| format!("{:.3}", case.quality.audit.ratio()))
        .column("warnings", |case| {
            let warnings = &case.quality.warnings;
            let text = match warnings.len() {
                0 => "none".into(),
                count => count.to_string(),
            };
            Cell { text, title: warnings.join("; "), is_chosen: false }
        })
}

fn masses(case: &Case) -> String {
    let body = Shown::one_mass(case.conditions.masses.body_kg);
    match case.conditions.masses.other_kg {
        Some(other) => format!("{body} on {}", Shown::one_mass(other)),
        None => body,
    }
}

/// A group with the errors of its models at left-out speeds.
struct Validated<'a> {
    title: &'a str,
    group: &'a str,
    cases: &'a [Case],
    validation: Validation,
    number: usize,
}

impl Validated<'_> {
    fn id(&self, what: &str) -> String {
        format!("g{}-{what}", self.number)
    }

    /// The table of models, why one was chosen, and the left-out speed where it is worst.
    fn add_validation(
        &self,
        content: &mut Content,
        parts: &mut Vec<Part>,
        settings: &ReportSettings,
    ) {
        let Self { title, group, cases, validation, .. } = self;
        parts.push(Part::Heading("Accuracy of predictions".into()));
        if let Some(means) = validation.chosen_means() {
            let value = percent(means.velocity_l1);
            content.figures.push(KeyFigure { value, name: format!("velocity error, {title}") });
            content.verdict(Verdict::known(
                title,
                format!(
                    "errors of curves predicted by {}: {} in force, {} in velocity, {} in maximum crush ({})",
                    means.model,
                    percent(means.force_l1),
                    percent(means.velocity_l1),
                    percent(means.max_crush_error),
                    in_turn(&validation.inner_speeds(means))
                ),
            ));
        }
        if let Some(first) = validation.means.first() {
            let left_out = in_turn(&validation.inner_speeds(first));
            let caption = format!(
                "{group}: errors against FE, {left_out} (Σ|p − r|/Σ|r|; the body force drives one mass)"
            );
            parts.push(Part::table(caption, self.models()));
        }
        parts.push(Part::Text(format!("Chosen: {} ({}).", validation.chosen, validation.reason)));
        let rows = validation.rows.iter().filter(|r| r.inner && r.model == validation.chosen);
        let accepted: Vec<Acceptance> = rows.map(acceptance).collect();
        if !accepted.is_empty() {
            let passed = accepted.iter().filter(|of| of.passes).count();
            let worst = accepted.iter().map(Acceptance::worst).fold(0.0, f64::max);
            parts.push(Part::Text(format!(
                "Predictions against FE by the acceptance rule for numerical crash models ({STANDARD}): {ACCEPTANCE}, the whole crush as one stage. {passed} of {} predictions at left-out speeds pass; the largest of these errors is {}.",
                accepted.len(),
                percent(worst)
            )));
        }
        if let Some(scatter) = &validation.scatter {
            parts.push(Part::Text(format!(
                "Repeated runs differ by {} in force and {} in velocity: no model can remove this part of its errors.",
                percent(scatter.force_l1),
                percent(scatter.velocity_l1)
            )));
        }
        parts.extend(validation.unsuited.iter().map(|of| Part::Text(format!("Without {of}."))));
        for note in &validation.notes {
            content.warn(ToDo::AddRuns, title, note.clone());
        }
        let Some(worst) = self.worst() else { return };
        let mut kinds = ModelKind::all(settings.seed).into_iter();
        let Some(kind) = kinds.find(|kind| kind.name() == validation.chosen) else { return };
        let (speed, name) = (worst.speed_m_per_s, Some(&*worst.case));
        match charts::left_out_at(group, cases, (speed, name), Choice::Kind(kind)) {
            Ok(chart) => {
                parts.push(Part::Text(format!(
                    "Of the inner speeds, {} ({}) has the largest force error, {}. This is its prediction when left out:",
                    km_per_h(worst.speed_m_per_s),
                    worst.case,
                    percent(worst.force_l1)
                )));
                parts.push(Part::Figure(Figure::new(self.id("left-out"), chart)));
            }
            Err(error) => {
                let text = format!("no picture of a left-out speed: {error}");
                content.warn(ToDo::AddRuns, title, text);
            }
        }
    }

    /// The inner speed where the chosen model's force is farthest from FE.
    fn worst(&self) -> Option<&LeftOut> {
        let Validation { rows, chosen, .. } = &self.validation;
        let inner = rows.iter().filter(|row| row.inner && row.model == *chosen);
        inner.max_by(|a, b| a.force_l1.total_cmp(&b.force_l1))
    }

    fn models(&self) -> impl Into<Table> {
        Table::of(&self.validation.means)
            .column("model", |means| &means.model)
            .column("force", |means| percent(means.force_l1))
            .column("energy", |means| percent(means.energy_error))
            .column("maximum crush", |means| percent(means.max_crush_error))
            .column("velocity", |means| percent(means.velocity_l1))
            .column("acceleration (CFC 60)", |means| percent(means.acceleration_l1))
            .chosen(|means| means.model == self.validation.chosen)
    }

    /// The curve at the requested speed, or in the middle of the widest interval.
    fn add_prediction(
        &self,
        content: &mut Content,
        parts: &mut Vec<Part>,
        settings: &ReportSettings,
    ) -> Result<Option<PredictedCurve>, Error> {
        let Self { title, group, cases, validation, .. } = self;
        let model = train_chosen(group, cases, &ModelKind::all(settings.seed), validation.clone())?;
        let Some(speed) = settings.speed_m_per_s.or_else(|| middle_of_widest_gap(cases)) else {
            return Ok(None);
        };
        let mut predicted = None;
        parts.push(Part::Heading(format!("Predicted curve at {}", km_per_h(speed))));
        // Of a model that sees more than the speed, with the parameters of the run nearest in speed.
        let apart = |case: &&Case| (case.conditions.speed.m_per_s - speed).abs();
        let nearest = cases.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let of_run = nearest.filter(|_| !model.features.is_empty());
        let query = match of_run {
            Some(run) => {
                let text =
                    format!("With the parameters of {}, the run nearest in speed.", run.id.name);
                parts.push(Part::Text(text));
                Query { speed_m_per_s: speed, extrapolate: false, ..query_of(run, &model) }
            }
            None => Query::at(speed),
        };
        match predict(&model, &query) {
            Ok(curve) => {
                self.add_curve(parts, (&model, &query), &curve);
                for warning in &curve.warnings {
                    let about = format!("{title}, prediction at {}", km_per_h(speed));
                    content.warn(ToDo::AddRuns, &about, warning.to_string());
                }
                predicted = Some(curve);
            }
            Err(error) => {
                let text = format!("no curve at {}: {error}", km_per_h(speed));
                content.warn(ToDo::AddRuns, title, text);
            }
        }
        if let Ok(set) = TrainingSet::new(group, *cases)
            && let Some(next) = next_run(&set, validation)
        {
            let advice = format!("Next FE run: {}: {}.", km_per_h(next.speed_m_per_s), next.reason);
            parts.push(Part::Text(advice));
        }
        Ok(predicted)
    }

    fn add_curve(
        &self,
        parts: &mut Vec<Part>,
        (model, query): (&Model, &Query),
        curve: &PredictedCurve,
    ) {
        let chart = charts::prediction(curve, &query.runs_of(model));
        parts.push(Part::Figure(Figure::new(self.id("prediction"), chart)));
        let mut rows = vec![
            ("model".to_string(), curve.model.clone()),
            ("peak force".into(), Shown::one_force(curve.peak_force_n())),
            ("maximum crush".into(), metres(curve.max_deflection_m)),
            ("energy of the curve".into(), Shown::one_energy(curve.energy_j)),
            ("energy over kinetic energy".into(), percent(curve.provenance.energy_over_kinetic)),
            ("nearest FE run".into(), km_per_h(curve.provenance.nearest_training_speed_m_per_s)),
        ];
        for (force, band) in curve.provenance.bands() {
            rows.push((
                format!(
                    "band, empirical {:.0} % range from {}",
                    100.0 * band.level,
                    counted(band.curves, "curve")
                ),
                format!("±{} of the local {} force", percent(band.pointwise_share), force.name()),
            ));
            if let Some(scatter) = &band.scatter {
                let name = "part of it from scatter between repeated runs".to_string();
                rows.push((name, format!("±{}", percent(scatter.pointwise_share))));
            }
        }
        let table = Table::of(&rows)
            .column("quantity", |(name, _)| name)
            .column("value", |(_, value)| value);
        parts.push(Part::table("The curve", table));
    }

    /// FE, FDRM, NSDM, DDTCM and the best model at the inner speeds, left out in turn.
    fn add_methods(&self, parts: &mut Vec<Part>, settings: &ReportSettings) -> Result<(), Error> {
        let Self { group, cases, .. } = self;
        let compared = match (settings.methods, self.worst()) {
            (MethodSpeeds::Worst, Some(row)) => {
                case_named(group, cases, &row.case)?.into_iter().collect()
            }
            (MethodSpeeds::All, _) => {
                inner_cases(group, cases, None).map(|(inner, _)| inner).unwrap_or_default()
            }
            _ => Vec::new(),
        };
        let asked = ComparisonSettings {
            seed: settings.seed,
            nsdm_seeds: settings.nsdm_seeds,
            ..ComparisonSettings::default()
        };
        let comparisons = compared
            .into_iter()
            .map(|index| compare(group, cases, index, &asked))
            .collect::<Result<Vec<Comparison>, _>>()?;
        let Some(first) = comparisons.first() else { return Ok(()) };
        let rows = first.rows.iter().filter(|row| has_all(&comparisons, &row.method));
        let rows: Vec<&Row> = rows.collect();
        let mean = |row: &Row, of: fn(&Row) -> f64| mean(&comparisons, &row.method, of);
        let table = Table::of(&rows)
            .column("method", |row| &row.method)
            .column("driven by", |row| row.driven_by.map_or("spring and damper", ForceKind::name))
            .column("velocity", |row| percent(mean(row, |r| r.velocity_l1)))
            .column("acceleration (CFC 60)", |row| percent(mean(row, |r| r.acceleration_l1)))
            .column("maximum crush", |row| {
                percent(mean(row, |r| r.acceptance.displacement_error.map_or(f64::NAN, f64::abs)))
            })
            .column("within 10 %", |row| {
                let all = comparisons.iter().flat_map(|c| &c.rows);
                let passed = all.filter(|r| r.method == row.method && r.acceptance.passes).count();
                format!("{passed} of {}", comparisons.len())
            })
            .chosen(|row| row.method == "best");
        let left_out = left_out_cases(&comparisons);
        parts.push(Part::Heading("Methods".into()));
        parts.push(Part::table(
            format!("{group}: each method in one multi-body model against FE, {left_out}"),
            table,
        ));
        for of in &comparisons {
            let speed = km_per_h(of.speed_m_per_s);
            let missing = of.missing.iter();
            parts
                .extend(missing.map(|why| Part::Text(format!("At {speed} ({}): {why}.", of.case))));
        }
        parts.push(Part::Text(methods_explained(settings.nsdm_seeds)));
        Ok(())
    }
}

fn in_turn(left_out: &str) -> String {
    match left_out.starts_with("1 ") {
        true => format!("with {left_out} left out"),
        false => format!("means over {left_out}, each left out in turn"),
    }
}

fn left_out_cases(comparisons: &[Comparison]) -> String {
    match comparisons {
        [one] => format!("with {} left out ({})", km_per_h(one.speed_m_per_s), one.case),
        several => in_turn(&counted(several.len(), "inner case")),
    }
}

fn methods_explained(nsdm_seeds: u64) -> String {
    let nsdm = match nsdm_seeds {
        0 => {
            " nsdm, the spring and damper fitted by a genetic algorithm, was left out; --nsdm-seeds includes it."
        }
        _ => " nsdm: a spring and damper fitted by a genetic algorithm to that run.",
    };
    format!(
        "fe: FE's own force of the recipe at the left-out speed, the floor for predictions of it; fe_body: the force that FE's speeds imply, a check where the two forces differ. fdrm: FE's curve of the nearest other speed, its last force held beyond its data.{nsdm} ddtcm: the reference method's forest. best: the model chosen by leaving speeds out."
    )
}

/// Speed at which designs, groups of one name, can be compared: the middle of the first's widest interval, or what of all their
/// ranges is next to it. `None` for one design, and if no speed is within all ranges.
pub(super) fn common_speed<'a>(
    mut designs: impl Iterator<Item = &'a [Case]> + Clone,
) -> Option<f64> {
    let speeds = |cases: &'a [Case]| cases.iter().map(|case| case.conditions.speed.m_per_s);
    let low = designs.clone().map(|of| speeds(of).fold(f64::INFINITY, f64::min));
    let high = designs.clone().map(|of| speeds(of).fold(0.0, f64::max));
    let (low, high) = (low.fold(0.0, f64::max), high.fold(f64::INFINITY, f64::min));
    let middle = middle_of_widest_gap(designs.next()?)?;
    (designs.next().is_some() && low <= high).then(|| middle.clamp(low, high))
}

/// The middle between the two neighbouring speeds that lie farthest apart.
fn middle_of_widest_gap(cases: &[Case]) -> Option<f64> {
    let mut speeds: Vec<f64> = cases.iter().map(|case| case.conditions.speed.m_per_s).collect();
    speeds.sort_by(f64::total_cmp);
    let gaps = speeds.windows(2).map(|pair| (pair[1] - pair[0], 0.5 * (pair[0] + pair[1])));
    gaps.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|gap| gap.0 > 0.0).map(|gap| gap.1)
}

/// Characters of a hash that distinguish files at a glance; the whole stands where the pointer rests.
const HASH: usize = 12;

/// The section of files that the curves come from.
/// `cases`: each with the title of its group.
pub(super) fn add_sources<'a>(
    content: &mut Content,
    cases: impl Iterator<Item = (&'a str, &'a Case)>,
) {
    let sources = cases.flat_map(|(title, case)| {
        case.provenance.sources.iter().map(move |source| (title, &case.id.name, source))
    });
    let table = Table::of(sources)
        .column("run", |(title, name, _)| format!("{title}, {name}"))
        .column("file", |(.., source)| &source.path)
        .column("format", |(.., source)| &source.format)
        .column("solver", |(.., source)| {
            let solver = [&source.solver, &source.version].into_iter().flatten();
            solver.map(String::as_str).collect::<Vec<_>>().join(" ")
        })
        .column("size", |(.., source)| format!("{} kB", source.size_bytes.div_ceil(1000)))
        .column("BLAKE3", |(.., source)| Cell {
            text: source.blake3.chars().take(HASH).collect(),
            title: format!("BLAKE3 {}", source.blake3),
            is_chosen: false,
        });
    if !table.items().is_empty() {
        let parts = vec![Part::table("Files that the curves were made from", table)];
        content.sections.push(Section { id: "sources".into(), title: "Sources".into(), parts });
    }
}
