//! Which files of a run hold which histories: the one that a build takes, and the others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::folders::{Reason, unread_beside};
use crate::curve::recipe::DisplacementComponent;
use crate::history::{EntityId, History};
use crate::order;
use crate::signal::{derivative, integral, interpolate};
use crate::solver::decks::{self, Search};
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, Selection, SolverFile, is_named_like_binary, without_job_id};
use crate::study::files::{content_hash, is_section_of, is_without_states, shown_name};

/// Histories of nodes, named as a recipe's file is.
pub(super) const MOTION: &str = "nodout";
/// Forces that a recipe can name, what acts between bodies before what acts within one.
pub(super) const FORCES: [&str; 5] = ["rwforc", "rcforc", "secforc", "rbdout", "spcforc"];
/// Of the model, else of its parts.
pub(super) const ENERGIES: [&str; 2] = ["glstat", "matsum"];

/// A file, or a section of one, with histories that a recipe can name.
#[derive(Clone, Debug)]
pub(super) struct Source {
    /// As a recipe names it.
    pub name: &'static str,
    pub path: PathBuf,
    /// Section of a binary file; `None` for a text file.
    pub section: Option<String>,
    pub titles: BTreeMap<EntityId, Option<String>>,
    pub components: Vec<Arc<str>>,
    pub states: usize,
    /// Why its forces are means over their output intervals, if they are.
    pub means: Option<String>,
    /// Further files of the folder that hold the same section.
    pub others: Vec<String>,
    pub damage: Option<String>,
}

/// The files of a run that matter to a proposal.
#[derive(Clone, Debug)]
pub(super) struct Sources {
    pub motion: Source,
    pub forces: Vec<Source>,
    pub energy: Option<Source>,
    pub deck: Option<(PathBuf, Box<Deck>)>,
    /// Files that could not be read, each with the reason.
    pub unread: Vec<String>,
    /// BLAKE3 over the files of motion and forces, for runs that are there twice.
    pub hash: String,
}

impl Sources {
    pub(super) fn of(folder: &Path) -> Result<Self, Reason> {
        let unreadable = |error: &dyn ToString| Reason::Unreadable { why: error.to_string() };
        let files = solver::runs::output_files(folder).map_err(|error| unreadable(&error))?;
        let (mut listed, mut unread) = (Vec::new(), Vec::new());
        let names_only = Selection { audit: false, ..Selection::nothing() };
        let is = |path: &Path, name: &str| without_job_id(&shown_name(path)) == name;
        // As large as a file of forces: read only where it is needed.
        let has_energy = files.iter().any(|path| is(path, ENERGIES[0]));
        let is_needed = |path: &&PathBuf| !(has_energy && is(path, ENERGIES[1]));
        for path in files.iter().filter(|path| is_looked_at(path)).filter(is_needed) {
            match solver::read_sections(path, None, &names_only) {
                Ok(sections) => listed.push((path.clone(), sections)),
                Err(error) => unread.push(error.to_string()),
            }
        }
        let deck = deck_of(folder);
        if let Some((_, deck)) = &deck {
            for section in listed.iter_mut().flat_map(|(_, sections)| sections) {
                decks::fill_titles(section, deck);
            }
        }
        // Of forces and energies one is enough.
        let is_read = |kind: &str| {
            let same = [&FORCES[..], &ENERGIES[..]].into_iter().find(|kinds| kinds.contains(&kind));
            same.unwrap_or(&[MOTION]).iter().any(|name| {
                Source::choose(folder, name, &listed).is_some_and(|source| source.states > 0)
            })
        };
        unread.extend(unread_beside(folder, is_read));
        let motion = Source::choose(folder, MOTION, &listed).ok_or_else(|| {
            let found: Vec<String> = files.iter().map(|path| shown_name(path)).collect();
            let of_motion = unread.iter().find(|why| why.to_lowercase().contains(MOTION));
            let why = of_motion.or(unread.first()).map(|why| format!(" ({why})"));
            Reason::NoMotion { found: found.join(", ") + &why.unwrap_or_default() }
        })?;
        let chosen = FORCES.iter().filter_map(|name| Source::choose(folder, name, &listed));
        // LS-DYNA's rigid bodies have motions, those of OpenRadioss forces.
        let forces: Vec<Source> = chosen
            .filter(|source| {
                let components = &source.components;
                components.is_empty() || components.iter().any(|name| name.ends_with("_force"))
            })
            .collect();
        if forces.iter().all(|source| source.states == 0) {
            let empty = forces.iter().map(|source| source.path.display());
            unread.extend(empty.map(|path| format!("{path}: there is no complete state in it")));
        }
        let mut parts = motion.parts();
        for part in forces.iter().flat_map(Source::parts) {
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        let (_, hash) = content_hash(&parts).map_err(|error| unreadable(&error))?;
        let energy = ENERGIES.iter().find_map(|name| Source::choose(folder, name, &listed));
        Ok(Self { motion, forces, energy, deck, unread, hash })
    }

    pub(super) fn force(&self, name: &str) -> Option<&Source> {
        self.forces.iter().find(|source| source.name == name)
    }
}

impl Source {
    /// The file that a build takes for `name`: the text, else the first binary file that has it.
    fn choose(
        folder: &Path,
        name: &'static str,
        listed: &[(PathBuf, Vec<SolverFile>)],
    ) -> Option<Self> {
        let is_text = |path: &Path| without_job_id(&shown_name(path)) == name;
        let mut holders: Vec<(&PathBuf, &SolverFile)> = listed
            .iter()
            .filter_map(|(path, sections)| {
                let is_wanted = |s: &&SolverFile| is_text(path) || is_section_of(&s.section, name);
                Some((path, sections.iter().find(is_wanted)?))
            })
            .collect();
        order::sort_by_key(&mut holders, |(path, _)| (!is_text(path), **path != folder.join(name)));
        if holders.len() > 1 && is_text(holders[0].0) && is_without_states(holders[0].0) {
            holders.remove(0);
        }
        let (&(path, section), others) = holders.split_first()?;
        let entities = section.entities.iter();
        Some(Self {
            name,
            path: path.clone(),
            section: (!is_text(path)).then(|| section.section.clone()),
            titles: entities.map(|entity| (entity.id, entity.title.clone())).collect(),
            components: section.components.clone(),
            states: section.time.len(),
            means: means(section, is_text(path)),
            others: others.iter().map(|(path, _)| shown_name(path)).collect(),
            damage: section.problems.first().map(ToString::to_string),
        })
    }

    /// As it is called in messages: `nodout`, or `rwforc of crashT01`.
    pub(super) fn shown(&self) -> String {
        match &self.section {
            Some(_) => format!("{} of {}", self.name, shown_name(&self.path)),
            None => self.name.into(),
        }
    }

    pub(super) fn has(&self, component: &str) -> bool {
        self.components.iter().any(|c| **c == *component)
    }

    /// Reads some of its histories; `ids` of `None` are all.
    pub(super) fn read(
        &self,
        ids: Option<Vec<solver::WantedId>>,
        components: &[&str],
    ) -> Result<SolverFile, Reason> {
        let components = components.iter().filter(|component| self.has(component));
        let selection = Selection {
            ids,
            components: Some(components.map(ToString::to_string).collect()),
            section: self.section.clone(),
            ..Selection::all()
        };
        let read = solver::read_sections(&self.path, None, &selection);
        let unreadable = |why: String| Reason::Unreadable { why };
        let mut sections = read.map_err(|e| unreadable(e.to_string()))?;
        sections.pop().ok_or_else(|| unreadable(format!("{} holds nothing", self.shown())))
    }

    fn parts(&self) -> Vec<PathBuf> {
        match self.section {
            Some(_) => solver::family(&self.path).unwrap_or_else(|_| vec![self.path.clone()]),
            None => vec![self.path.clone()],
        }
    }
}

/// Whether a file may hold what a proposal looks at: large files of other kinds are not opened.
fn is_looked_at(path: &Path) -> bool {
    let name = shown_name(path);
    let own = without_job_id(&name);
    is_named_like_binary(&name) || FORCES.contains(&own) || own == MOTION || ENERGIES.contains(&own)
}

/// Why the forces of a section are means over their output intervals, if they are.
fn means(file: &SolverFile, is_text: bool) -> Option<String> {
    if file.format == "t01" {
        return Some("a T01 holds impulses, so each force is a mean over two intervals".into());
    }
    file.differentiates_impulses().then(|| {
        let version = file.version.as_deref().unwrap_or_default();
        let says = if is_text { "its second line reads" } else { "its version is" };
        format!("{says} \"{version}\": a mean over two intervals of a T01's impulse")
    })
}

/// The deck of a run: in its folder, or else in the one above, which a group of runs may share.
fn deck_of(folder: &Path) -> Option<(PathBuf, Box<Deck>)> {
    let above = std::fs::canonicalize(folder).ok().and_then(|path| Some(path.parent()?.into()));
    let folders = [Some(PathBuf::from(folder)), above];
    let found = folders.into_iter().flatten().find_map(|folder| match decks::find(&folder) {
        Ok(Search::One(path)) => Some(path),
        _ => None,
    })?;
    let deck = decks::read_deck(&found).ok()?;
    Some((found, Box::new(deck)))
}

/// The states whose time is later than all before: printed times may repeat, restarts go back.
pub(super) fn rising(time: &[f64]) -> Vec<usize> {
    let mut last = f64::NEG_INFINITY;
    let later = |i: &usize| {
        let is_later = time[*i].is_finite() && time[*i] > last;
        if is_later {
            last = time[*i];
        }
        is_later
    };
    (0..time.len()).filter(later).collect()
}

pub(super) fn picked(values: &[f64], states: &[usize]) -> Vec<f64> {
    states.iter().map(|&i| values[i]).collect()
}

pub(super) fn by_entity(histories: &[History]) -> impl Iterator<Item = &[History]> {
    histories.chunk_by(|a, b| a.entity == b.entity)
}

pub(super) fn component<'a>(of: &'a [History], name: &str) -> Option<&'a History> {
    of.iter().find(|history| &*history.component == name)
}

/// Velocity of a node at the rising states: the file's, else the rate of its displacement.
pub(super) fn velocity(
    node: &[History],
    direction: DisplacementComponent,
    states: &[usize],
) -> Option<Vec<f64>> {
    if let Some(velocity) = component(node, direction.velocity()) {
        return Some(picked(&velocity.values, states));
    }
    let displacement = component(node, direction.name())?;
    let time = picked(&displacement.time, states);
    (time.len() > 1).then(|| derivative(&time, &picked(&displacement.values, states)))
}

/// Impulse of a force at other times, from the first of them on; held before its first and after its last.
///
/// `None` if the force holds a value that is not a number, or has fewer than two states.
pub(super) fn impulse(force: &History, times: &[f64]) -> Option<Vec<f64>> {
    let states = rising(&force.time);
    let (time, values) = (picked(&force.time, &states), picked(&force.values, &states));
    if time.len() < 2 || values.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let (first, last) = (time[0], time[time.len() - 1]);
    let within: Vec<f64> = times.iter().map(|t| t.clamp(first, last)).collect();
    let mut impulse = interpolate(&time, &integral(&time, &values), &within).ok()?;
    let before = impulse.first().copied().unwrap_or_default();
    impulse.iter_mut().for_each(|impulse| *impulse -= before);
    Some(impulse)
}

/// Position of the value that is largest in magnitude; 0 without any.
pub(super) fn largest(values: &[f64]) -> usize {
    let magnitudes = values.iter().map(|v| v.abs()).enumerate();
    magnitudes.fold((0, 0.0), |best, (i, v)| if v > best.1 { (i, v) } else { best }).0
}

/// How well `impulse = mass × change` holds, in the least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    /// In the file's units; its sign is that of the force against the velocity.
    pub mass: f64,
    /// What is left of the impulse, as a share of it; 1 if the node does not follow it at all.
    pub residual: f64,
}

impl Fit {
    /// Of the impulse and a change of velocity, as many states of each.
    pub(super) fn of(impulse: &[f64], change: &[f64]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (own, of_change) = (dot(impulse, impulse), dot(change, change));
        if !(own > 0.0 && of_change > 0.0) {
            return Self { mass: 0.0, residual: 1.0 };
        }
        let mass = dot(impulse, change) / of_change;
        let left: f64 = impulse.iter().zip(change).map(|(j, v)| (j - mass * v).powi(2)).sum();
        let residual = (left / own).sqrt();
        Self { mass, residual: if residual.is_finite() { residual } else { 1.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_follows_the_impulse_that_stops_it() {
        let change = [0.0, -1.0, -3.0, -4.0];
        let impulse: Vec<f64> = change.iter().map(|v| -24.0 * v).collect();
        assert_eq!(Fit::of(&impulse, &change), Fit { mass: -24.0, residual: 0.0 });
        assert_eq!(Fit::of(&impulse, &[0.0; 4]).residual, 1.0, "it stands");
        assert_eq!(Fit::of(&impulse, &[f64::NAN; 4]).residual, 1.0);
    }

    #[test]
    fn times_that_do_not_rise_are_passed_over() {
        assert_eq!(rising(&[0.0, 1.0, 1.0, 0.5, f64::NAN, 2.0]), [0, 1, 5]);
        assert_eq!(rising(&[]), [0; 0]);
    }
}
