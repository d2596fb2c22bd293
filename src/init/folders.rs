//! The folders of a proposal: which contain runs, their names, and their paths relative to the
//! study.

use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use serde::Serialize;

use super::sources::{ENERGIES, FORCES, MOTION};
use crate::error::{Error, error};
use crate::file::folder_of;
use crate::guess;
use crate::solver::decks::{self, Search};
use crate::solver::runs::{output_files, renamed_files, run_folders};
use crate::solver::{is_named_like_binary, without_job_id};
use crate::study::files::shown_name;
use crate::unit::M_PER_S_PER_MPH;

/// Folders of runs, and those that are none.
pub(super) struct Folders {
    pub runs: Vec<PathBuf>,
    pub left_out: Vec<LeftOut>,
}

impl Folders {
    /// All at or below the given ones, each once.
    pub(super) fn find(given: &[PathBuf]) -> Result<Self, Error> {
        let mut found = Self { runs: Vec::new(), left_out: Vec::new() };
        let mut seen = HashSet::new();
        let mut is_new = |path: &PathBuf| seen.insert(real(path));
        for root in given {
            let below = run_folders(root).map_err(|source| {
                let guess = is_there_instead(root).filter(|_| !root.exists());
                let guess = guess.map(|guess| format!("; did you mean {}?", guess.display()));
                let (path, guess) = (root.display(), guess.unwrap_or_default());
                error!(Study, "{path}: {source}{guess}").caused_by(source)
            })?;
            let shown = |path: PathBuf| match path.strip_prefix(".") {
                Ok(below) if !below.as_os_str().is_empty() => below.to_path_buf(),
                _ => path,
            };
            let runs = below.runs.into_iter().map(shown);
            found.runs.extend(runs.filter(|path| is_new(path)));
            let without = below.without_files.into_iter().map(shown);
            for path in without.filter(|path| is_new(path)) {
                let reason = without_files(&path);
                found.left_out.push(LeftOut::new(path, reason));
            }
            for (path, why) in below.unreadable {
                found.left_out.push(LeftOut::new(path, Reason::Unreadable { why }));
            }
        }
        if found.runs.is_empty() {
            let searched: Vec<String> = given.iter().map(|p| p.display().to_string()).collect();
            let searched = searched.join(", ");
            let left_out = match &found.left_out[..] {
                [] => String::new(),
                left_out => format!("\n{}", listed(left_out)),
            };
            return Err(error!(
                Study,
                "no folder in {searched} holds solver files (nodout, rwforc, rcforc, binout, …T01): give the runs' folders, or one above them{left_out}"
            ));
        }
        Ok(found)
    }

    /// Refuses folders that hold several runs each: they are groups of their own.
    pub(super) fn refuse_groups(&self) -> Result<(), Error> {
        let mut groups: BTreeMap<PathBuf, usize> = BTreeMap::new();
        for run in &self.runs {
            *groups.entry(folder_of(run).into()).or_default() += 1;
        }
        groups.retain(|_, runs| *runs > 1);
        let Some(first) = groups.keys().next().filter(|_| groups.len() > 1) else { return Ok(()) };
        let listed: Vec<String> =
            groups.iter().map(|(path, runs)| format!("{} ({runs} runs)", path.display())).collect();
        Err(error!(
            Study,
            "the runs are in {count} folders of several runs each, which look like different groups: {listed}. Give one of them (crumple init {first}), or use --group NAME if all belong to one group",
            count = groups.len(),
            listed = listed.join(", "),
            first = first.display()
        ))
    }

    /// Name of the folder that holds all runs: their group, if nobody names it.
    pub(super) fn group(&self) -> String {
        let mut common: Option<PathBuf> = None;
        for run in &self.runs {
            let parent = real(run).parent().map(Path::to_path_buf).unwrap_or_default();
            common = Some(match common {
                None => parent,
                Some(common) => common
                    .ancestors()
                    .find(|above| parent.starts_with(above))
                    .map(Path::to_path_buf)
                    .unwrap_or_default(),
            });
        }
        let name = common.and_then(|path| Some(clean(&path.file_name()?.to_string_lossy())));
        name.filter(|name| !name.trim().is_empty()).unwrap_or_else(|| "runs".into())
    }
}

/// The folder next to a missing one whose name is most like its name.
fn is_there_instead(missing: &Path) -> Option<PathBuf> {
    let parent = missing.parent().filter(|p| !p.as_os_str().is_empty());
    let entries = folder_of(missing).read_dir().ok()?;
    let folders = entries.filter_map(Result::ok).filter(|entry| entry.path().is_dir());
    let mut names: Vec<String> =
        folders.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    let name = missing.file_name()?.to_str()?;
    let nearest = guess::nearest(name, names.iter().map(String::as_str))?;
    Some(parent.map_or(nearest.into(), |parent| parent.join(nearest)))
}

/// Why a folder holds no run.
fn without_files(folder: &Path) -> Reason {
    let is_empty = folder.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    let renamed = renamed_files(folder);
    if !renamed.is_empty() {
        let files = renamed.iter().map(|(file, format)| (shown_name(file), (*format).into()));
        return Reason::Renamed { files: files.collect() };
    }
    match decks::find(folder) {
        _ if is_empty => Reason::Empty,
        Ok(Search::One(_) | Search::Several(_)) => Reason::OnlyDeck,
        Ok(Search::None) | Err(_) => Reason::NoSolverFiles,
    }
}

/// Ends of the names of packed files, of those that were put aside, and of those that hold pictures, tables, decks and the like.
const PACKED: [&str; 7] = ["gz", "bz2", "xz", "zst", "zip", "7z", "z"];
const ASIDE: [&str; 6] = ["bak", "old", "orig", "txt", "out", "dat"];
const OTHERS: [&str; 18] = [
    "png", "jpg", "svg", "pdf", "csv", "h5", "html", "toml", "json", "py", "k", "key", "inc",
    "dyn", "rad", "gp", "log", "xlsx",
];

/// Whether a file has nearly the name of another, `rwforc`: `rwforc.gz`, `RWFORC`, `rwforc_1`, or with a job id `car.rwforc.bak`.
fn is_named_nearly(name: &str, kind: &str) -> bool {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    let is_end = |word: &&str| PACKED.contains(word) || ASIDE.contains(word);
    match words.iter().position(|word| *word == kind) {
        Some(0) => !OTHERS.contains(&words[words.len() - 1]),
        Some(at) => words[at + 1..].iter().all(is_end),
        None => false,
    }
}

/// Files that are not read and may hold what a run lacks: those with nearly the name of a file that is not there, such as `rwforc.gz`
/// and `RWFORC`, unless a binary file has its histories; each with what to do.
pub(super) fn unread_beside(folder: &Path, is_read: impl Fn(&str) -> bool) -> Vec<String> {
    let entries = folder.read_dir().into_iter().flatten().filter_map(Result::ok);
    let paths = entries.map(|entry| entry.path()).filter(|path| path.is_file());
    let mut names: Vec<String> = paths.map(|path| shown_name(&path)).collect();
    names.sort();
    let mut found = Vec::new();
    for kind in [MOTION].into_iter().chain(FORCES).chain(ENERGIES) {
        let is_read = names.iter().any(|name| without_job_id(name) == kind) || is_read(kind);
        for name in &names {
            let end = name.rsplit('.').next().unwrap_or_default().to_lowercase();
            let what = match PACKED.contains(&&*end) {
                _ if is_read || !is_named_nearly(name, kind) => continue,
                true => format!("if it is the {kind}, unpack it and name it {kind}"),
                false => format!("if it is the {kind}, rename it accordingly"),
            };
            found.push(format!("{}: {what}", folder.join(name).display()));
        }
    }
    found
}

fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.into())
}

/// A name that can be in a study: without control characters.
fn clean(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '_' } else { c }).collect()
}

/// Names of the runs: that of the folder, with as many of the folders above as distinguish them.
pub(super) fn names(runs: &[PathBuf]) -> Vec<String> {
    let parts: Vec<Vec<String>> = runs
        .iter()
        .map(|run| {
            let normal = |part| match part {
                Component::Normal(name) => Some(clean(&name.to_string_lossy())),
                _ => None,
            };
            real(run).components().filter_map(normal).collect()
        })
        .collect();
    let name = |of: &[String], count: usize| of[of.len().saturating_sub(count)..].join("_");
    let deepest = parts.iter().map(Vec::len).max().unwrap_or(1);
    let all = |count: usize| parts.iter().map(|of| name(of, count)).collect::<Vec<_>>();
    let is_unique = |names: &Vec<String>| names.iter().collect::<HashSet<_>>().len() == names.len();
    (1..=deepest).map(all).find(is_unique).unwrap_or_else(|| all(deepest))
}

/// How a path is written in a file of `folder`: from there on if one leads to the other.
///
/// `None` if it is not UTF-8, which no TOML file can hold.
pub(super) fn seen_from(folder: &Path, path: &Path) -> Option<String> {
    let (from, to) = (real(folder), real(path));
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let mut way: PathBuf = from.components().skip(shared).map(|_| "..").collect();
    way.extend(to.components().skip(shared));
    // Far from each other only the root is shared: the whole path says it better.
    let way = if shared <= 1 && to.is_absolute() { to } else { way };
    let text = way.to_str()?;
    Some(if text.is_empty() { ".".into() } else { text.into() })
}

/// A speed in m/s that a folder's name carries with its unit: `36kmh`, `v_48_km_h`, `30mph`.
pub(super) fn speed_in(name: &str) -> Option<f64> {
    let name = name.to_ascii_lowercase();
    for (at, _) in name.match_indices(|c: char| c.is_ascii_digit()) {
        let before = name[..at].chars().next_back();
        if before.is_some_and(|c| c.is_ascii_digit() || c == '.') {
            continue;
        }
        // In "case1,48kmh" a comma separates.
        let has_comma = before.is_none_or(|c| !c.is_alphabetic());
        let is_of_number = |c: char| c.is_ascii_digit() || c == '.' || (c == ',' && has_comma);
        let end = name[at..].find(|c: char| !is_of_number(c));
        let (number, unit) = name[at..].split_at(end.unwrap_or(name.len() - at));
        // "45_5kmh" may be 45.5 km/h, or 5 km/h of run 45.
        let mut ahead = name[..at].chars().rev();
        let joins = ahead.next().is_some_and(|c| matches!(c, '_' | '-' | 'p' | ','));
        if number.len() == 1 && joins && ahead.next().is_some_and(|c| c.is_ascii_digit()) {
            continue;
        }
        let unit: String = unit.chars().filter(|c| !matches!(c, '_' | '-' | ' ' | '/')).collect();
        let km_per_h = ["kmh", "kmph", "kph"].iter().any(|known| unit.starts_with(known));
        let factor = match () {
            () if km_per_h => 1.0 / 3.6,
            () if unit.starts_with("mph") => M_PER_S_PER_MPH,
            () => continue,
        };
        return number
            .replace(',', ".")
            .parse::<f64>()
            .ok()
            .filter(|v| *v > 0.0)
            .map(|v| v * factor);
    }
    None
}

/// A folder that a proposed study leaves out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct LeftOut {
    /// The folder, as it was found.
    pub path: PathBuf,
    #[serde(flatten)]
    pub(crate) reason: Reason,
    /// The reason in words.
    pub message: String,
    /// Its entry in the study, commented out there, where one can be written.
    #[serde(skip)]
    pub(super) entry: Option<String>,
}

impl LeftOut {
    pub(super) fn new(path: PathBuf, reason: Reason) -> Self {
        let mut message = reason.to_string();
        // What the record lacks may stand beside it.
        if !matches!(reason, Reason::NoMotion { .. } | Reason::Renamed { .. }) {
            let files = output_files(&path).unwrap_or_default();
            let has_binary = files.iter().any(|file| is_named_like_binary(&shown_name(file)));
            for why in unread_beside(&path, |_| has_binary) {
                message.push_str(&format!(" (not read: {why})"));
            }
            for file in FORCES.map(|force| path.join(force)) {
                if file.metadata().is_ok_and(|file| file.len() == 0) {
                    message.push_str(&format!(" ({} is empty)", file.display()));
                }
            }
        }
        Self { path, message, reason, entry: None }
    }
}

/// Bodies that close more slowly than this share of their first speed at a record's end may go on together.
const MOVES_ON: f64 = 0.7;

/// Bodies whose speed has changed by less than this share may be driven.
const DRIVEN: f64 = 1e-4;

/// Why a run is left out.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub(crate) enum Reason {
    #[error("the folder is empty")]
    Empty,
    #[error("it holds no solver files")]
    NoSolverFiles,
    /// Solver files have other names than the solver gave them; these, and which files they are.
    #[error(
        "it holds no file with a solver's name, but by their contents {}: rename them accordingly",
        files.iter().map(|(file, format)| format!("{file} is the {format}")).collect::<Vec<_>>().join(", ")
    )]
    Renamed { files: Vec<(String, String)> },
    #[error("it holds a deck but no solver output: it has not been run")]
    OnlyDeck,
    #[error("{why}")]
    Unreadable { why: String },
    #[error("it has no histories of nodes (a nodout, or a binout or T01 with one): it has {found}")]
    NoMotion { found: String },
    /// The record has hardly begun.
    #[error("it terminated early{}: {file} holds {states} complete {}{damage}", if *.states == 0 { ", or is laid out in another way" } else { "" }, if *.states == 1 { "state" } else { "states" })]
    FewStates {
        file: String,
        states: usize,
        /// What is damaged, in brackets; empty if nothing is.
        damage: String,
    },
    #[error(
        "it terminated early: the record ends at {end}, while the bodies still close at {} % of their first speed{}{damage}", (share * 100.0).round(), if *.share < MOVES_ON { " (an obstacle that keeps moving needs --kind pair --minus-node ID, and its node among the histories)" } else if (*.share - 1.0).abs() < DRIVEN { " (if their motion is prescribed, write a table of deflection and force, which crumple histories gives, and add it with crumple db add)" } else { "" }
    )]
    EndsWhileLoading {
        /// Last time that motion and force share, with its unit if that is known.
        end: String,
        /// Closing speed there over that at the start.
        share: f64,
        /// What is damaged, in brackets; empty if nothing is.
        damage: String,
    },
    #[error(
        "nothing moves in its first state, so there is no impact speed to read: if a moving wall hits the body, write a table of deflection (the wall's way less the body's) and force, which crumple histories gives, and add it with crumple db add"
    )]
    Stands,
    /// The chosen histories cannot be used.
    #[error("{why}")]
    Unusable { why: String },
    #[error("its files are identical to those of {of}")]
    SameBytes { of: PathBuf },
    /// Its histories are those of another run, in other files.
    #[error("its histories are identical to those of {of}")]
    SameHistories { of: PathBuf },
    #[error("it does not fit the other runs' recipe: {why}")]
    OtherRecipe { why: String },
    #[error("it seems to be a different model: {why}")]
    OtherModel { why: String },
    #[error("crumple build would refuse it: {why}")]
    Refused { why: String },
}

/// The error of folders without a usable run, and what may be the cause.
pub(super) fn no_usable_run(left_out: &[LeftOut], doubts: &[String]) -> Error {
    let doubts: String = doubts.iter().map(|d| format!("  {d}\n")).collect();
    error!(Study, "no run can be used:\n{doubts}{}", listed(left_out))
}

/// Folders with their reasons, a line each.
pub(super) fn listed(left_out: &[LeftOut]) -> String {
    const SHOWN: usize = 20;
    let lines = left_out.iter().map(|l| format!("  {}: {}", l.path.display(), l.message));
    let mut shown: Vec<String> = lines.take(SHOWN).collect();
    if left_out.len() > SHOWN {
        shown.push(format!("  and {} more", left_out.len() - SHOWN));
    }
    shown.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_runs_apart() {
        let paths = |list: &[&str]| list.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(names(&paths(&["/no/a/25", "/no/a/36"])), ["25", "36"]);
        assert_eq!(names(&paths(&["/no/v25/job", "/no/v36/job"])), ["v25_job", "v36_job"]);
    }

    #[test]
    fn speeds_stand_in_names() {
        fn t(name: &str, km_per_h: Option<f64>) {
            let found = speed_in(name).map(|v| (v * 3.6 * 1e6).round() / 1e6);
            assert_eq!(found, km_per_h, "{name}");
        }
        t("36kmh", Some(36.0));
        t("run2_v_48.5_km_h_b", Some(48.5));
        t("60 KPH", Some(60.0));
        t("100mph", Some(160.9344));
        t("48thick", None);
        t("run_0010", None);
        t("25ms", None);
        t("36,5 km_h", Some(36.5));
        t("run2_48kmh", Some(48.0));
        t("45_5kmh", None);
        t("case1,48kmh", Some(48.0));
        t("crash,25kmh", Some(25.0));
        t("v36,5kmh", None);
    }

    #[test]
    fn paths_lead_from_the_study_to_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir_all(root.join("a/36")).unwrap();
        fs::create_dir_all(root.join("b")).unwrap();
        let seen = |from: &str, to: &str| seen_from(&root.join(from), &root.join(to)).unwrap();
        assert_eq!(seen("a", "a/36"), "36");
        assert_eq!(seen("b", "a/36"), "../a/36");
        assert_eq!(seen("a/36", "a/36"), ".");
    }
}
