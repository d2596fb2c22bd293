//! From run folders to a proposed study.
//!
//! Each run is examined separately; then the runs agree on a recipe, and each is evaluated with it.
//! Runs that do not fit are left out with the reason. A complete study is tried before it is
//! returned: runs that a build would refuse are left out as well.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::agree::Agreed;
use super::folders::{Folders, LeftOut, Reason, names, no_usable_run, seen_from};
use super::measure::{Measured, SiRun};
use super::proposal::Proposal;
use super::record::{Record, Recorded, Surveyed};
use super::sources::Sources;
use super::survey::Survey;
use super::{GivenForce, UserHints, describe, units};
use crate::curve::contact::milliseconds;
use crate::error::{Error, error};
use crate::study::extract::is_alike;
use crate::study::{self, StudyKind};
use crate::unit::UnitSystem;

/// What a study is to be proposed for.
#[derive(Clone, Debug)]
pub struct Request {
    /// Run folders, or folders above them.
    pub folders: Vec<PathBuf>,
    /// Where the study will stand: paths in it begin there.
    pub study: PathBuf,
    /// What is known already.
    pub given: UserHints,
}

/// Proposes a study for run folders.
///
/// `progress` is called with the name of each run when it was examined, from any thread.
///
/// # Errors
/// If there is no run, none can be used, or they are several groups.
pub fn propose(request: &Request, progress: impl Fn(&str) + Sync) -> Result<Proposal, Error> {
    let given = &request.given;
    let folders = Folders::find(&request.folders)?;
    if given.group.is_none() {
        folders.refuse_groups()?;
    }
    let group = folders.group();
    let mut left_out = folders.left_out;
    let surveyed = survey(&folders.runs, given, &mut left_out, &progress);
    let surveys: Vec<&Survey> = surveyed.iter().map(|run| &run.survey).collect();
    let Some(agreed) = Agreed::of(&surveys, given) else {
        return Err(no_usable_run(&left_out, &[]));
    };
    refuse_given(&agreed, &surveys, given)?;
    let recorded = record(surveyed, &agreed, &mut left_out);
    let recorded = without_duplicates(recorded, &mut left_out);
    let (units, recorded, mut warnings) = agree_on_units(recorded, given, &mut left_out);
    let study = match request.study.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let seen = |path: &PathBuf| seen_from(&study, path);
    let recorded = with_paths(recorded, &seen, &mut left_out);
    if recorded.is_empty() {
        return Err(no_usable_run(&left_out, &warnings));
    }
    let runs: Vec<SiRun<'_>> = match units.value() {
        Some(units) => recorded.iter().map(|run| SiRun::of(run, *units, given)).collect(),
        None => Vec::new(),
    };
    let measured = Measured { agreed: &agreed, recorded: &recorded, runs: &runs, units: &units };
    let mut proposal = describe::proposal(&measured, given, group, &seen, &mut warnings);
    proposal.warnings = warnings;
    proposal.left_out = left_out;
    describe::entries_of_left_out(&mut proposal, &seen);
    leave_out_refused(&mut proposal, &request.study)?;
    Ok(proposal)
}

/// Looks over every run; what cannot be used, or is there twice, is left out.
fn survey(
    folders: &[PathBuf],
    given: &UserHints,
    left_out: &mut Vec<LeftOut>,
    progress: &(impl Fn(&str) + Sync),
) -> Vec<Surveyed> {
    let names = names(folders);
    let sources: Vec<Result<Sources, Reason>> =
        folders.par_iter().map(|folder| Sources::of(folder)).collect();
    let mut first: BTreeMap<String, PathBuf> = BTreeMap::new();
    let mut unique = Vec::new();
    for ((path, name), sources) in folders.iter().zip(names).zip(sources) {
        match sources {
            Err(reason) => left_out.push(LeftOut::new(path.clone(), reason)),
            Ok(sources) => match first.get(&sources.hash) {
                Some(of) => {
                    let reason = Reason::SameBytes { of: of.clone() };
                    left_out.push(LeftOut::new(path.clone(), reason));
                }
                None => {
                    first.insert(sources.hash.clone(), path.clone());
                    unique.push((path.clone(), name, sources));
                }
            },
        }
    }
    let named = given.force.as_ref().map(|force| (&*force.file, force.id));
    let looked: Vec<Result<Surveyed, Box<LeftOut>>> = unique
        .into_par_iter()
        .map(|(path, name, sources)| {
            let survey = Survey::of(&sources, named);
            progress(&name);
            match survey {
                Ok(survey) => Ok(Surveyed { path, name, sources, survey }),
                Err(reason) => Err(Box::new(LeftOut::new(path, reason))),
            }
        })
        .collect();
    usable(looked, left_out)
}

/// What is usable; the others join those that are left out.
fn usable<T>(runs: Vec<Result<T, Box<LeftOut>>>, left_out: &mut Vec<LeftOut>) -> Vec<T> {
    let mut usable = Vec::new();
    for run in runs {
        match run {
            Ok(run) => usable.push(run),
            Err(out) => left_out.push(*out),
        }
    }
    usable
}

/// Holds what the caller says of bodies and force against what there is.
fn refuse_given(agreed: &Agreed, surveys: &[&Survey], given: &UserHints) -> Result<(), Error> {
    if let Some(GivenForce { file, id, .. }) = &given.force
        && agreed.force.is_none()
    {
        let forces = surveys.iter().flat_map(|survey| &survey.forces);
        let known: BTreeSet<String> =
            forces.map(|force| format!("{} {}", force.file, force.id)).collect();
        let known = match known.len() {
            0 => "none".into(),
            _ => known.into_iter().collect::<Vec<_>>().join(", "),
        };
        return Err(error!(
            Study,
            "no run has a force {file} {id} along the motion: there are {known}",
            id = *id
        ));
    }
    if given.half_model {
        let alone = UserHints { half_model: false, kind: None, ..given.clone() };
        let found = Agreed::of(surveys, &alone);
        if found.is_some_and(|found| found.kind == StudyKind::Pair) {
            return Err(error!(
                Study,
                "two bodies move in these runs, and a half model has one: leave out --half-model"
            ));
        }
    } else if (given.kind == Some(StudyKind::Pair) || given.minus_node.is_some())
        && agreed.kind != StudyKind::Pair
    {
        return Err(error!(
            Study,
            "only one body moves in these runs: if it stands for a pair, cut at its symmetry plane, say --half-model; if it meets a wall, leave out --kind pair and --minus-node"
        ));
    }
    Ok(())
}

/// Reads the histories of the recipe of every run that can take it and reaches the crash's end.
fn record(surveyed: Vec<Surveyed>, agreed: &Agreed, left_out: &mut Vec<LeftOut>) -> Vec<Recorded> {
    let read: Vec<Result<Recorded, Box<LeftOut>>> = surveyed
        .into_par_iter()
        .zip(agreed.members.par_iter())
        .map(|(run, member)| {
            let record = member.clone().and_then(|()| Record::read(&run.sources, agreed));
            match record {
                Ok(record) => Ok(Recorded { run, record }),
                Err(reason) => Err(Box::new(LeftOut::new(run.path, reason))),
            }
        })
        .collect();
    usable(read, left_out)
}

/// Leaves out runs whose histories are those of another.
fn without_duplicates(recorded: Vec<Recorded>, left_out: &mut Vec<LeftOut>) -> Vec<Recorded> {
    let mut unique: Vec<Recorded> = Vec::new();
    for run in recorded {
        match unique.iter().find(|known| is_twin(&known.record, &run.record)) {
            Some(known) => {
                let reason = Reason::SameHistories { of: known.run.path.clone() };
                left_out.push(LeftOut::new(run.run.path, reason));
            }
            None => unique.push(run),
        }
    }
    unique
}

fn is_twin(a: &Record, b: &Record) -> bool {
    let force = |r: &Record| r.force.as_ref().map_or(Vec::new(), |(_, force)| force.clone());
    is_alike(&a.time, &b.time)
        && is_alike(&a.travel, &b.travel)
        && a.velocities.iter().zip(&b.velocities).all(|(a, b)| is_alike(a, b))
        && is_alike(&force(a), &force(b))
}

/// Runs whose paths can be in a study.
fn with_paths(
    recorded: Vec<Recorded>,
    seen: &dyn Fn(&PathBuf) -> Option<String>,
    left_out: &mut Vec<LeftOut>,
) -> Vec<Recorded> {
    let (kept, others): (Vec<_>, Vec<_>) =
        recorded.into_iter().partition(|run| seen(&run.run.path).is_some());
    left_out.extend(others.into_iter().map(|run| {
        let why = "its path is not UTF-8, which no study can hold: rename the folder".into();
        LeftOut::new(run.run.path, Reason::Unusable { why })
    }));
    kept
}

/// The units of the runs, without those that are possible in other units only and those whose
/// crash the record does not hold.
fn agree_on_units(
    recorded: Vec<Recorded>,
    given: &UserHints,
    left_out: &mut Vec<LeftOut>,
) -> (super::Proposed<UnitSystem>, Vec<Recorded>, Vec<String>) {
    let mut warnings = Vec::new();
    let (mut whole, mut ended) = (Vec::new(), Vec::new());
    for run in recorded {
        match run.record.loading_end() {
            Ok(_) => whole.push(run),
            Err(share) => ended.push((run, share)),
        }
    }
    let of: Vec<units::Magnitudes> = whole.iter().map(|run| run.record.magnitudes()).collect();
    let stated = describe::stated_units(&whole, &mut warnings);
    let most = units::most_agree(&of);
    let agreeing: Vec<units::Magnitudes> =
        of.iter().zip(&most).filter(|(_, agrees)| **agrees).map(|(m, _)| *m).collect();
    let units = units::choose(&agreeing, given.units, stated, &mut warnings);
    let mut kept = Vec::new();
    for ((run, magnitudes), agrees) in whole.into_iter().zip(of).zip(most) {
        let refused = units.value().and_then(|units| magnitudes.impossible(units));
        match refused.filter(|_| !agrees && given.units.is_none()) {
            Some(why) => {
                let why = format!("in the others' units it would be {why}");
                left_out.push(LeftOut::new(run.run.path, Reason::OtherModel { why }));
            }
            None => kept.push(run),
        }
    }
    for (run, share) in ended {
        let end = run.record.time.last().copied().unwrap_or_default();
        let reason = Reason::EndsWhileLoading {
            end: match units.value() {
                Some(units) => milliseconds(end * units.time_s),
                None => format!("{end} in the file's unit of time"),
            },
            share,
            damage: run.record.damage() + &also_held(&run.run.sources),
        };
        left_out.push(LeftOut::new(run.run.path, reason));
    }
    (units, kept, warnings)
}

/// What else holds the motion of a run whose record is too short: its solver may have written more
/// of one file than of the other.
fn also_held(sources: &Sources) -> String {
    match &sources.motion.others[..] {
        [] => String::new(),
        others => format!(
            "; {} holds it too, and is read where there is no {}",
            others.join(" and "),
            sources.motion.shown()
        ),
    }
}

/// Extracts every run of a complete proposal, and leaves out those that give no curve.
pub(super) fn leave_out_refused(proposal: &mut Proposal, path: &Path) -> Result<(), Error> {
    if !proposal.missing().is_empty() {
        return Ok(());
    }
    let study = study::parse(path, &proposal.to_toml())?;
    let refused: Vec<Option<Error>> = study
        .runs()
        .par_iter()
        .map(|entry| study.locate(entry).and_then(|run| run.extract()).err())
        .collect();
    let runs = std::mem::take(&mut proposal.runs);
    for (run, refused) in runs.into_iter().zip(refused) {
        match refused {
            None => proposal.runs.push(run),
            Some(error) => {
                let reason = Reason::Refused { why: error.to_string() };
                let mut out = LeftOut::new(run.folder, reason);
                out.entry = Some(run.path);
                proposal.left_out.push(out);
            }
        }
    }
    if proposal.runs.is_empty() {
        Err(no_usable_run(&proposal.left_out, &proposal.warnings))
    } else {
        Ok(())
    }
}
