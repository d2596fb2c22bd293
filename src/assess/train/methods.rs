//! The methods in a train: scenario and sources of each.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use crate::assess::choose::Purpose;
use crate::assess::methods::{ComparisonSettings, ddtcm_model, fit_nsdm};
use crate::assess::validate::{self, Choice};
use crate::curve::{Case, ForceCurve};
use crate::database::Database;
use crate::dataset::TrainingSet;
use crate::error::{Error, KeyPath, error};
use crate::multibody::EnvelopeEnd;
use crate::scenario::{
    CrushZoneTable, CurveSource, CurveTable, DampingTable, InterfaceSpeed, LawName, Scenario,
    Sources,
};
use crate::surrogate::Model;

/// A method: what it makes of the scenario and its sources.
pub(super) struct Method {
    pub name: &'static str,
    pub driven_by: &'static str,
    pub scenario: Scenario,
    pub sources: Sources,
    pub fit_time_s: f64,
}

/// The case that each curve names and the group around it.
fn groups(path: &Path, scenario: &Scenario) -> Result<BTreeMap<String, (Case, Vec<Case>)>, Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut groups = BTreeMap::new();
    for (name, table) in &scenario.curves {
        let not_a_case = || {
            error!(Comparison, "curve \"{curve}\" is not a case of a database: to compare methods, write database = \"…\" and case = \"group/case\"", curve = name).at(KeyPath::of("curves").key(name))
        };
        let file = folder.join(table.database.as_ref().ok_or_else(not_a_case)?);
        let case = table.case.as_deref().and_then(|c| c.split_once('/'));
        let (group, case) = case.ok_or_else(not_a_case)?;
        let database = Database::read(&file)?;
        let cases = database.group(&file, group)?;
        let case = database.case(&file, group, case)?;
        groups.insert(name.clone(), (case.clone(), cases.to_vec()));
    }
    Ok(groups)
}

/// Every method in the scenario, in the order of the table.
pub(super) fn methods(
    path: &Path,
    scenario: &Scenario,
    sources: &Sources,
    settings: &ComparisonSettings,
) -> Result<Vec<Method>, Error> {
    let groups = groups(path, scenario)?;
    // Every curve with the body force, or with the recipe's.
    let with_body = || {
        let mut scenario = scenario.clone();
        scenario.curves.values_mut().for_each(|table| table.force = None);
        scenario
    };
    let with_declared = || {
        let mut scenario = scenario.clone();
        for (name, table) in &mut scenario.curves {
            table.force = groups.get(name).map(|(case, _)| case.curves.force_kind);
        }
        scenario
    };
    let mut methods = Vec::new();
    let mut add = |name, driven_by, scenario, sources, fit_time_s| {
        methods.push(Method { name, driven_by, scenario, sources, fit_time_s });
    };
    add("fe_body", "body force", with_body(), sources.clone(), 0.0);
    add("fdrm", "recipe's force", with_declared(), sources.clone(), 0.0);

    if settings.nsdm_seeds > 0 {
        let start = Instant::now();
        let (scenario, springs) = with_nsdm(scenario, sources, &groups, settings)?;
        add("nsdm", "spring and damper", scenario, springs, start.elapsed().as_secs_f64());
    }

    let start = Instant::now();
    let forests = with_models(sources, &groups, |group, cases| {
        // Beyond the paper's speeds and masses the maximum crush follows from the motion.
        ddtcm_model(&TrainingSet::new(group, cases)?, settings.seed)
    })?;
    let mut paper = with_declared();
    paper.run.interface_speed = InterfaceSpeed::Train;
    add("ddtcm", "recipe's force", paper, forests, start.elapsed().as_secs_f64());

    let start = Instant::now();
    let best = with_models(sources, &groups, |group, cases| {
        let choice = Choice::Auto { purpose: Purpose::Train, seed: settings.seed, trees: None };
        validate::train(group, cases, choice)
    })?;
    let fit_s = start.elapsed().as_secs_f64();
    for (name, speed) in
        [("best_train", InterfaceSpeed::Train), ("best_local", InterfaceSpeed::Local)]
    {
        let mut changed = with_body();
        changed.run.interface_speed = speed;
        add(name, "body force", changed, best.clone(), fit_s);
    }
    methods.extend(crush_methods(scenario, &groups, best, fit_s));
    Ok(methods)
}

/// The methods of the models' crush laws, where every model has one: from the rate alone to two ends
/// at each vehicle.
fn crush_methods(
    scenario: &Scenario,
    groups: &BTreeMap<String, (Case, Vec<Case>)>,
    models: Sources,
    fit_time_s: f64,
) -> Vec<Method> {
    let has_law = |name| models.model(name).is_some_and(|model| model.crush_law.is_some());
    if !groups.keys().all(|name| has_law(name)) {
        return Vec::new();
    }
    let mut without = models.clone();
    groups.keys().for_each(|name| without.without_stopped_mass(name));
    let rates = with_rates(scenario, groups);
    // Crush zones of the scenario's own stay as they are.
    let has_ends = scenario
        .train
        .iter()
        .flat_map(|t| &t.vehicles)
        .any(|v| v.front.is_some() || v.rear.is_some());
    let of = [
        ("rate_only", rates.clone(), without),
        ("rate_live", rates, models.clone()),
        ("split_ends", with_ends(scenario), models),
    ];
    let method = |(name, scenario, sources)| Method {
        name,
        driven_by: "crush force",
        scenario,
        sources,
        fit_time_s,
    };
    let of = of.into_iter().filter(|(name, ..)| *name != "split_ends" || !has_ends);
    of.map(method).collect()
}

/// The scenario with forces that follow the speeds of its run.
fn with_rates(scenario: &Scenario, groups: &BTreeMap<String, (Case, Vec<Case>)>) -> Scenario {
    let mut changed = scenario.clone();
    changed.run.interface_speed = InterfaceSpeed::Local;
    for name in groups.keys() {
        let Some(table) = changed.curves.get_mut(name) else { continue };
        of_model(name, table);
        table.law = LawName::Rate;
    }
    changed
}

/// The scenario with two ends at each vehicle, in place of the curves between them.
fn with_ends(scenario: &Scenario) -> Scenario {
    let mut changed = scenario.clone();
    changed.run.interface_speed = InterfaceSpeed::Local;
    let gap = |curve: &Option<String>| scenario.curves.get(curve.as_deref()?)?.gap;
    let end = |curve: &Option<String>| {
        let curve = curve.clone()?;
        Some(CrushZoneTable { mass: None, curve })
    };
    let nose = changed.contact.curve.take();
    changed.contact.gap = changed.contact.gap.or(gap(&nose));
    for train in &mut changed.train {
        let inner = train.inner.take();
        let mut ahead = nose.clone();
        let last = train.vehicles.len() - 1;
        for (k, vehicle) in train.vehicles.iter_mut().enumerate() {
            let behind = vehicle.behind.take().or(inner.clone());
            (vehicle.front, vehicle.rear) = (end(&ahead), end(&behind));
            // Nothing is behind the last one.
            if k < last {
                vehicle.gap = vehicle.gap.or(train.gap).or(gap(&behind));
            }
            ahead = behind;
        }
    }
    for (name, table) in &mut changed.curves {
        of_model(name, table);
        // Ends are joined to their bodies.
        table.gap = None;
    }
    changed
}

/// The table of a curve whose source is a model, as the checks of a scenario expect it.
fn of_model(name: &str, table: &mut CurveTable) {
    (table.model, table.database, table.case) = (Some(name.into()), None, None);
    table.force = None;
}

/// The sources with a model in place of every case, which `fit` makes of the case's group.
fn with_models(
    sources: &Sources,
    groups: &BTreeMap<String, (Case, Vec<Case>)>,
    fit: impl Fn(&str, &[Case]) -> Result<Model, Error>,
) -> Result<Sources, Error> {
    let mut models = sources.clone();
    for (name, (case, cases)) in groups {
        models.replace(name, CurveSource::Model(Box::new(fit(&case.id.group, cases)?)));
    }
    Ok(models)
}

/// The scenario and its curves with a spring and damper fitted to each case.
fn with_nsdm(
    scenario: &Scenario,
    sources: &Sources,
    groups: &BTreeMap<String, (Case, Vec<Case>)>,
    settings: &ComparisonSettings,
) -> Result<(Scenario, Sources), Error> {
    let (mut changed, mut springs) = (scenario.clone(), sources.clone());
    for (name, (case, _)) in groups {
        let fitted = fit_nsdm(case, settings)?;
        let fit = fitted.best();
        let Some(table) = changed.curves.get_mut(name) else { continue };
        table.law = LawName::Elastic;
        table.end = Some(EnvelopeEnd::Slope);
        table.damping = Some(DampingTable {
            speed_m_per_s: fit.model.damping.nodes().to_vec(),
            coefficient_n_s_per_m: fit.model.damping.values().to_vec(),
        });
        let curve = ForceCurve::of_body(fit.model.envelope()?);
        springs.replace(name, CurveSource::Curve(Box::new(curve), Vec::new()));
    }
    Ok((changed, springs))
}
