//! From run folders to a proposed study.
//!
//! Each run is examined separately; then the runs agree on a recipe, and each is evaluated with it.
//! Runs that do not fit are left out with the reason. A complete study is tried before it is
//! returned: runs that a build would refuse are left out as well.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::describe::{Facts, sort, units_of_decks};
use super::folders::{Folders, LeftOut, Reason, names, no_usable_run, seen_from};
use super::measure::{Impact, SAME_MASS, is_near};
use super::recipe::{CommonRecipe, sum_of_forces};
use super::record::{Record, Run};
use super::sources::Sources;
use super::survey::{ForceCandidate, Named, Survey};
use super::write::{Proposal, Proposed};
use super::{GivenForce, UserHints, units};
use crate::error::{Error, error};
use crate::file::folder_of;
use crate::parallel;
use crate::study::extract::is_alike;
use crate::study::{self, StudyKind};
use crate::unit::UnitSystem;

/// Proposes a study, which will stand at `study`, for run folders, or folders above them.
///
/// `progress` is called with the name of each run when it was examined, from any thread.
///
/// # Errors
/// If there is no run, none can be used, or they are several groups.
pub(crate) fn propose(
    folders: &[PathBuf],
    study: &Path,
    hints: &UserHints,
    progress: impl Fn(&str) + Sync,
) -> Result<Proposal, Error> {
    let folders = Folders::find(folders)?;
    if hints.group.is_none() {
        folders.refuse_groups()?;
    }
    let group = folders.group();
    let mut left_out = folders.left_out;
    let mut runs = survey(&folders.runs, hints, &mut left_out, &progress);
    if hints.force.is_none() {
        let sums = parallel::map(&runs, |run| sum_of_forces(&run.survey));
        let mut sums: Vec<Named> = sums.into_iter().flatten().collect();
        sums.sort();
        sums.dedup();
        if !sums.is_empty() {
            // What succeeded once succeeds again.
            parallel::map(&mut runs, |Run { sources, survey, .. }| {
                *survey = Survey::of(sources, &sums).unwrap_or_else(|_| survey.clone());
            });
        }
    }
    let surveys: Vec<&Survey> = runs.iter().map(|run| &run.survey).collect();
    let Some(recipe) = CommonRecipe::of(&surveys, hints) else {
        return Err(no_usable_run(&left_out, &[]));
    };
    refuse_hints(&recipe, &surveys, hints)?;
    let records = record(runs, &recipe, &mut left_out);
    let records = without_duplicates(records, &mut left_out);
    let (records, ended): (Vec<Record>, Vec<Record>) =
        records.into_iter().partition(|record| record.loading_end().is_ok());
    let (units, records, warnings) = agree_on_units(records, hints, &mut left_out);
    let (recipe, records) = adding_shares(recipe, records, units.value(), hints, &mut left_out);
    let folder = folder_of(study);
    let (mut records, unnamed): (Vec<Record>, Vec<Record>) =
        records.into_iter().partition(|record| seen_from(folder, &record.run.path).is_some());
    left_out.extend(unnamed.into_iter().map(|record| {
        let why = "its path is not UTF-8, so no study can name it: rename the folder".into();
        LeftOut::new(record.run.path, Reason::Unusable { why })
    }));
    if records.is_empty() {
        left_out.extend(ended.into_iter().map(|record| ends_while_loading(record, units.value())));
        return Err(no_usable_run(&left_out, &warnings));
    }
    if let Some(units) = units.value() {
        parallel::map(&mut records, |record| {
            record.impact = Some(Impact::of(record, *units, hints.half_model));
        });
    }
    let facts = Facts { recipe: &recipe, records: &records, units, hints, folder };
    let mut proposal = facts.proposal(group, warnings);
    // They have no say in the recipe: what the others have must fit them.
    for record in ended {
        let path = record.run.path.clone();
        match Record::read(record.run, &recipe) {
            Ok(record) => match facts.cut_run(&record, &proposal) {
                Some(run) => proposal.runs.push(run),
                None => left_out.push(ends_while_loading(record, facts.units.value())),
            },
            Err(reason) => left_out.push(LeftOut::new(path, reason)),
        }
    }
    sort(&mut proposal.runs);
    proposal.left_out = left_out;
    leave_out_refused(&mut proposal, study)?;
    for out in &mut proposal.left_out {
        out.entry = match out.reason {
            Reason::Empty | Reason::NoSolverFiles | Reason::OnlyDeck => None,
            _ => seen_from(folder, &out.path),
        };
    }
    Ok(proposal)
}

/// Looks over every run; what cannot be used, or is there twice, is left out.
fn survey(
    folders: &[PathBuf],
    hints: &UserHints,
    left_out: &mut Vec<LeftOut>,
    progress: &(impl Fn(&str) + Sync),
) -> Vec<Run> {
    let sources = parallel::map(folders, |folder| Sources::of(folder));
    let mut first: BTreeMap<String, &PathBuf> = BTreeMap::new();
    let mut unique = Vec::new();
    for ((path, name), sources) in folders.iter().zip(names(folders)).zip(sources) {
        let sources = sources.and_then(|sources| match first.get(&sources.hash) {
            Some(&of) => Err(Reason::SameBytes { of: of.clone() }),
            None => Ok(sources),
        });
        match sources {
            Err(reason) => left_out.push(LeftOut::new(path.clone(), reason)),
            Ok(sources) => {
                first.insert(sources.hash.clone(), path);
                unique.push((path.clone(), name, sources));
            }
        }
    }
    let named: Vec<Named> =
        hints.force.iter().map(|force| (force.file.clone(), force.ids.clone())).collect();
    let surveyed = parallel::map(unique, |(path, name, sources)| {
        let survey = Survey::of(&sources, &named);
        progress(&name);
        (path.clone(), survey.map(|survey| Run { path, name, sources, survey }))
    });
    usable(surveyed, left_out)
}

/// Holds what the caller says of bodies and force against what there is.
fn refuse_hints(
    recipe: &CommonRecipe,
    surveys: &[&Survey],
    hints: &UserHints,
) -> Result<(), Error> {
    if let Some(GivenForce { file, ids, .. }) = &hints.force
        && recipe.force.is_none()
    {
        let forces = surveys.iter().flat_map(|survey| &survey.forces);
        let known: BTreeSet<String> = forces.map(ForceCandidate::label).collect();
        let ids = ids.iter().map(i64::to_string).collect::<Vec<_>>().join(" + ");
        if known.contains(&format!("{file} {ids}")) {
            return Err(error!(
                Study,
                "{file} {ids} does not drive two bodies of a run apart, as a pair needs (nodes that start with one velocity count as one body): use --kind wall with the node of one of them"
            ));
        }
        let known = match known.len() {
            0 => "none".into(),
            _ => known.into_iter().collect::<Vec<_>>().join(", "),
        };
        return Err(error!(
            Study,
            "no run has a force {file} {ids} along the motion: there are {known}"
        ));
    }
    if hints.half_model {
        let alone = UserHints { half_model: false, kind: None, ..hints.clone() };
        let found = CommonRecipe::of(surveys, &alone);
        if found.is_some_and(|found| found.kind == StudyKind::Pair) {
            return Err(error!(
                Study,
                "two bodies move in these runs, but a half model has only one: remove --half-model"
            ));
        }
    } else if (hints.kind == Some(StudyKind::Pair) || hints.minus_node.is_some())
        && recipe.kind != StudyKind::Pair
    {
        return Err(error!(
            Study,
            "only one body moves in these runs: if it represents a pair, cut at its symmetry plane, use --half-model; if it hits a wall, remove --kind pair and --minus-node"
        ));
    }
    Ok(())
}

/// Reads the histories of the recipe of every run that can take it.
fn record(runs: Vec<Run>, recipe: &CommonRecipe, left_out: &mut Vec<LeftOut>) -> Vec<Record> {
    let records = parallel::map(runs.into_iter().zip(&recipe.members), |(run, member)| {
        let path = run.path.clone();
        let other = |why: &String| Reason::OtherRecipe { why: why.clone() };
        (path, member.as_ref().map_err(other).and_then(|()| Record::read(run, recipe)))
    });
    usable(records, left_out)
}

/// The usable ones; the others are left out.
fn usable<T>(all: Vec<(PathBuf, Result<T, Reason>)>, left_out: &mut Vec<LeftOut>) -> Vec<T> {
    let one = |(path, one): (PathBuf, Result<T, Reason>)| {
        one.map_err(|reason| left_out.push(LeftOut::new(path, reason))).ok()
    };
    all.into_iter().filter_map(one).collect()
}

/// Where the bodies have the mass that several forces give them together, by their kinetic energy or by the caller, these
/// are added.
fn adding_shares(
    mut recipe: CommonRecipe,
    records: Vec<Record>,
    units: Option<&UnitSystem>,
    hints: &UserHints,
    left_out: &mut Vec<LeftOut>,
) -> (CommonRecipe, Vec<Record>) {
    let whole = recipe.beside.whole;
    let given = hints.mass_kg.zip(units).map(|(kg, units)| kg / units.mass_kg);
    let ratios = || records.iter().filter_map(|record| record.over_momentum(given));
    let all_agree = ratios().count() > 0 && ratios().all(|r| is_near(r, whole, SAME_MASS));
    let may_share = hints.force.is_none() && !recipe.beside.ids.is_empty() && all_agree;
    let Some(force) = recipe.force.as_mut().filter(|_| may_share) else {
        return (recipe, records);
    };
    force.ids.extend(&recipe.beside.ids);
    let runs = records.into_iter().map(|record| record.run).collect();
    recipe.members = recipe.members.into_iter().filter(Result::is_ok).collect();
    let records = record(runs, &recipe, left_out);
    (recipe, records)
}

/// Leaves out runs whose histories are those of another.
fn without_duplicates(records: Vec<Record>, left_out: &mut Vec<LeftOut>) -> Vec<Record> {
    let is_same = |a: &Record, b: &Record| {
        is_alike(&a.time, &b.time)
            && is_alike(&a.travel, &b.travel)
            && a.velocities.iter().zip(&b.velocities).all(|(a, b)| is_alike(a, b))
            && is_alike(&a.force, &b.force)
    };
    let mut unique: Vec<Record> = Vec::new();
    for record in records {
        match unique.iter().find(|known| is_same(known, &record)) {
            Some(known) => {
                let reason = Reason::SameHistories { of: known.run.path.clone() };
                left_out.push(LeftOut::new(record.run.path, reason));
            }
            None => unique.push(record),
        }
    }
    unique
}

/// A run whose crash the record does not hold.
fn ends_while_loading(record: Record, units: Option<&UnitSystem>) -> LeftOut {
    let (end, share) = record.end_while_loading(units);
    let damage = record.damage() + &record.other_files();
    LeftOut::new(record.run.path, Reason::EndsWhileLoading { end, share, damage })
}

/// The units of the runs, without those that are possible in other units only.
fn agree_on_units(
    whole: Vec<Record>,
    hints: &UserHints,
    left_out: &mut Vec<LeftOut>,
) -> (Proposed<UnitSystem>, Vec<Record>, Vec<String>) {
    let mut warnings = Vec::new();
    let of: Vec<units::Magnitudes> = whole.iter().map(Record::magnitudes).collect();
    let [stated, metals] = units_of_decks(&whole, &mut warnings);
    let most = units::most_agree(&of);
    let agreeing: Vec<units::Magnitudes> =
        of.iter().zip(&most).filter(|(_, agrees)| **agrees).map(|(m, _)| *m).collect();
    let units = units::choose(&agreeing, hints.units, stated, metals, &mut warnings);
    let mut kept = Vec::new();
    for ((record, magnitudes), agrees) in whole.into_iter().zip(of).zip(most) {
        let refused = units.value().and_then(|units| magnitudes.impossible(units));
        match refused.filter(|_| !agrees && hints.units.is_none()) {
            Some(why) => {
                let why = format!("in the others' units it would be {why}");
                left_out.push(LeftOut::new(record.run.path, Reason::OtherModel { why }));
            }
            None => kept.push(record),
        }
    }
    (units, kept, warnings)
}

/// Extracts every run of a complete proposal, and leaves out those that give no curve.
fn leave_out_refused(proposal: &mut Proposal, path: &Path) -> Result<(), Error> {
    if !proposal.missing().is_empty() {
        return Ok(());
    }
    let study = study::parse(path, &proposal.to_toml())?;
    let extracted = parallel::map(study.runs(), |entry| -> Result<f64, Error> {
        Ok(study.locate(entry)?.extract()?.max_deflection_m())
    });
    for (mut run, extracted) in std::mem::take(&mut proposal.runs).into_iter().zip(extracted) {
        match extracted {
            Ok(crush_m) => {
                run.crush_m = run.crush_m.or(Some(crush_m));
                proposal.runs.push(run);
            }
            Err(error) => {
                let reason = Reason::Refused { why: error.to_string() };
                proposal.left_out.push(LeftOut::new(run.folder, reason));
            }
        }
    }
    if proposal.runs.is_empty() {
        return Err(no_usable_run(&proposal.left_out, &proposal.warnings));
    }
    Ok(())
}
