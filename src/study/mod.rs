//! Study manifest: which runs there are, and how each becomes a case.

mod located;

use std::collections::{BTreeMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::curve::extract::{
    DeckSpeed, ExtractError, Measured, MeasuredForce, Setup, Stated, StatedContact, extract,
};
use crate::curve::recipe::{DeflectionSource, ForceSource, Recipe};
use crate::curve::{Case, ForceKind, Masses, Parameter, Source};
use crate::file;
use crate::history::{EntityId, History, Side};
use crate::manifest::{self, ManifestError};
use crate::solver::decks::{self, Search};
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, ReadError, Selection, SolverFile, WantedId};
use crate::unit::{
    ImpactSpeedText, InstantText, LengthText, MassText, SignedLengthText, SpeedKind, UnitSystem,
};
use located::{Located, compare_twin, hashed_family, locate_file, shown_name};

/// Part of every fingerprint: raise it when the extraction gives other numbers.
const EXTRACTION_VERSION: u32 = 3;

/// A study manifest as written (TOML).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    pub study: Head,
    pub recipe: Recipe,
    /// One entry per FE run.
    pub run: Vec<RunEntry>,
}

/// What all runs of a study share.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Head {
    pub name: String,
    /// Units of the solver's files: "SI", "mm-t-s", "kg-mm-ms", …; taken from the runs' decks
    /// if absent.
    #[schemars(with = "Option<String>")]
    pub units: Option<UnitSystem>,
    /// Group of the curve database.
    pub group: String,
    pub kind: StudyKind,
    /// The pair is modelled as one body against its symmetry plane: closing speed and
    /// deflection are twice the run's.
    #[serde(default)]
    pub half_model: bool,
    /// Take runs whose energy or impulse cannot be an impact's (0.67 to 1.5 of what mass and
    /// speed ask for).
    #[serde(default)]
    pub accept_energy: bool,
}

/// What hits what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyKind {
    /// A body against a rigid wall; speeds are wall speeds.
    Wall,
    /// Two bodies; speeds are closing speeds.
    Pair,
}

/// One FE run.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunEntry {
    /// Folder with the solver's files, relative to the manifest.
    pub path: String,
    /// Name of the case; the path if absent.
    pub name: Option<String>,
    /// Impact speed; taken from the deck or the first state if absent.
    pub speed: Option<ImpactSpeedText>,
    /// Keyword deck of the run, relative to the manifest; looked for in the run's folder if
    /// absent.
    pub deck: Option<String>,
    /// Mass of the body, or of each body of a pair.
    pub mass: MassText,
    /// Mass of the other body, if the bodies of a pair differ.
    pub other_mass: Option<MassText>,
    /// Solver's time at which contact begins; found in the force if absent.
    pub contact_time: Option<InstantText>,
    /// Contact begins when the bodies have moved this far towards each other from the first
    /// state: the clear distance between their surfaces (between mid-surfaces of shells less
    /// half of each thickness).
    pub gap: Option<LengthText>,
    /// Deflection at contact: above 0 for a record that begins crushed, below 0 for slack that
    /// is no crush.
    pub offset: Option<SignedLengthText>,
    /// Solver's time behind which the record is not used.
    pub truncate: Option<InstantText>,
    /// 1 or -1: the factor that makes the file's force positive in compression; found from its
    /// impulse if absent.
    pub sign: Option<Sign>,
    /// As in the study's head, for this run.
    pub accept_energy: Option<bool>,
    /// Further parameters of the case, the same names in every run: numbers whose names carry
    /// their units (`angle_deg = 10`), or categories (`obstacle = "pole"`).
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
}

/// A factor of 1 or −1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "i64")]
#[schemars(with = "i64", extend("enum" = [1, -1]))]
pub struct Sign(i64);

impl TryFrom<i64> for Sign {
    type Error = String;

    fn try_from(sign: i64) -> Result<Self, String> {
        match sign {
            1 | -1 => Ok(Self(sign)),
            _ => Err(format!("sign = {sign}: expected 1 or -1")),
        }
    }
}

/// A manifest that makes sense, and where it stands.
#[derive(Clone, Debug)]
pub struct Study {
    manifest: Manifest,
    folder: PathBuf,
}

/// Why one run gives no case.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("the run's folder {path} does not exist: check path in the manifest")]
    NoFolder { path: PathBuf },
    #[error("the run's folder {folder} has no file \"{file}\": it has {found}")]
    NoFile { folder: PathBuf, file: String, found: String },
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{path}: {source}")]
    Extract { path: PathBuf, source: ExtractError },
    #[error(
        "the manifest gives no units and {why}: add units = \"mm-t-s\" (or what they are) to [study]"
    )]
    NoUnits { why: String },
}

/// The deck of a run, if there is one to use, and notes about its choice.
type FoundDeck = (Option<(Located, Deck)>, Vec<String>);

/// A run whose files are found and hashed but not read.
pub struct LocatedRun<'a> {
    study: &'a Study,
    entry: &'a RunEntry,
    files: Vec<Located>,
    /// The run's keyword deck, and what is to be said of the search for it.
    deck: Option<(Located, Deck)>,
    deck_notes: Vec<String>,
    recipe: String,
    pub fingerprint: String,
}

/// Loads and checks a study manifest.
///
/// # Errors
/// [`ManifestError`] with line and columns for what TOML or a single value breaks, and
/// without for what only the whole shows.
pub fn load(path: &Path) -> Result<Study, ManifestError> {
    checked(path, manifest::load(path)?)
}

/// Parses and checks the text of a study manifest; `path` is for messages.
///
/// # Errors
/// [`ManifestError`] as of [`load`].
pub fn parse(path: &Path, text: &str) -> Result<Study, ManifestError> {
    checked(path, manifest::parse(path, text)?)
}

fn checked(path: &Path, manifest: Manifest) -> Result<Study, ManifestError> {
    check(&manifest).map_err(|message| ManifestError::Invalid { path: path.into(), message })?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok(Study { manifest, folder })
}

fn check(manifest: &Manifest) -> Result<(), String> {
    let Head { name, group, kind, half_model, .. } = &manifest.study;
    check_name("study.name", name, true)?;
    check_name("study.group", group, false)?;
    let minus_node = manifest.recipe.deflection.minus_node.is_some();
    match (kind, half_model, minus_node) {
        (StudyKind::Pair, false, false) => {
            return Err("a pair needs the other body: deflection.minus_node = …, or half_model = true in [study] for one body against its symmetry plane".into());
        }
        (StudyKind::Pair, true, true) => {
            return Err("half_model = true doubles the deflection, which a minus_node already makes whole: keep one of them".into());
        }
        _ => {}
    }
    if *kind == StudyKind::Wall && *half_model {
        return Err(
            "half_model = true needs kind = \"pair\": a wall is no symmetry plane of a pair".into(),
        );
    }
    if manifest.run.is_empty() {
        return Err("there is no [[run]]".into());
    }
    check_contact(&manifest.recipe)?;
    let mut names = HashSet::new();
    for run in &manifest.run {
        check_parameters(run)?;
        if run.contact_time.is_some() && run.gap.is_some() {
            return Err(format!(
                "run \"{}\": contact_time and gap both say when contact begins: keep one of them",
                run.path
            ));
        }
        if run.path.trim().is_empty() {
            return Err("a [[run]] has an empty path".into());
        }
        if *kind == StudyKind::Wall && run.other_mass.is_some() {
            return Err(format!("run \"{}\": other_mass needs kind = \"pair\"", run.path));
        }
        if check_name("run.name", &run.case_name(), false).is_err() {
            return Err(format!(
                "run \"{}\" gives no name for its case: add name = \"…\" to it",
                run.path.escape_debug()
            ));
        }
        if !names.insert(run.case_name()) {
            return Err(format!(
                "two runs are named \"{}\": give one of them a name = …",
                run.case_name()
            ));
        }
    }
    Ok(())
}

fn check_contact(recipe: &Recipe) -> Result<(), String> {
    match (&recipe.contact, &recipe.force) {
        (Some(ForceSource::Body { .. }), _) => Err(
            "recipe.contact must be a contact force (id = … of a wall or contact): a body slows down after the first touch".into(),
        ),
        (Some(_), ForceSource::Contact { .. }) => Err(
            "recipe.contact is for a body force: contact is found in recipe.force itself".into(),
        ),
        _ => Ok(()),
    }
}

/// Names that the models use themselves.
const TAKEN: [&str; 4] = ["speed_m_per_s", "deflection_m", "mass_kg", "other_mass_kg"];

fn check_parameters(run: &RunEntry) -> Result<(), String> {
    for (name, value) in &run.parameters {
        let shown = name.escape_debug();
        if name.trim().is_empty() || name.contains(|c: char| c.is_control() || c == '=') {
            return Err(format!("run \"{}\": parameter \"{shown}\" is no name", run.path));
        }
        if TAKEN.contains(&name.as_str()) {
            return Err(format!(
                "run \"{}\": parameter \"{shown}\" has a key of its own: use speed or mass",
                run.path
            ));
        }
        if matches!(value, Parameter::Number(v) if !v.is_finite()) {
            return Err(format!("run \"{}\": parameter \"{shown}\" is not finite", run.path));
        }
    }
    Ok(())
}

/// Names stand in files, tables and HDF5 paths.
fn check_name(key: &str, name: &str, slash: bool) -> Result<(), String> {
    let shown = name.escape_debug();
    if name.trim().is_empty() || name == "." || name == ".." {
        return Err(format!("{key} = \"{shown}\" is no name"));
    }
    if name.contains(|c: char| c.is_control() || (c == '/' && !slash)) {
        return Err(format!("{key} = \"{shown}\" may not contain \"/\" or control characters"));
    }
    Ok(())
}

impl RunEntry {
    /// Name of the run's case in the database.
    pub fn case_name(&self) -> String {
        let name = self.name.as_deref().unwrap_or(&self.path);
        name.trim_start_matches("./").trim_matches('/').replace('/', "_")
    }
}

impl Study {
    pub fn name(&self) -> &str {
        &self.manifest.study.name
    }

    pub fn group(&self) -> &str {
        &self.manifest.study.group
    }

    pub fn runs(&self) -> &[RunEntry] {
        &self.manifest.run
    }

    /// Finds and hashes the files of a run.
    ///
    /// # Errors
    /// [`RunError`] if the folder or a file is missing or unreadable.
    pub fn locate<'a>(&'a self, entry: &'a RunEntry) -> Result<LocatedRun<'a>, RunError> {
        let folder = self.folder.join(&entry.path);
        if !folder.is_dir() {
            return Err(RunError::NoFolder { path: folder });
        }
        let recipe = &self.manifest.recipe;
        let mut names = vec![recipe.deflection.file.as_str()];
        for force in [Some(&recipe.force), recipe.contact.as_ref()].into_iter().flatten() {
            if !names.contains(&force_file(force)) {
                names.push(force_file(force));
            }
        }
        let files = names
            .into_iter()
            .map(|name| locate_file(&folder, name))
            .collect::<Result<Vec<_>, _>>()?;
        let (deck, deck_notes) = self.locate_deck(entry, &folder)?;
        let recipe = self.recipe_json(entry);
        let mut hash = blake3::Hasher::new();
        hash.update(&EXTRACTION_VERSION.to_le_bytes());
        hash.update(recipe.as_bytes());
        for file in files.iter().chain(deck.iter().map(|(located, _)| located)) {
            hash.update(file.blake3.as_bytes());
        }
        let fingerprint = hash.finalize().to_hex().to_string();
        Ok(LocatedRun { study: self, entry, files, deck, deck_notes, recipe, fingerprint })
    }

    /// The deck that the manifest names, or the only one of the run's folder.
    fn locate_deck(&self, entry: &RunEntry, folder: &Path) -> Result<FoundDeck, RunError> {
        let mut notes = Vec::new();
        let path = match &entry.deck {
            Some(name) => Some(self.folder.join(name)),
            None => match decks::find(folder) {
                Search::None => None,
                Search::One(path) => Some(path),
                Search::Several(found) => {
                    notes.push(format!(
                        "deck: the folder has {} that do not include each other; none is used (name one with deck = …)",
                        found.len()
                    ));
                    None
                }
            },
        };
        let Some(path) = path else { return Ok((None, notes)) };
        let (deck, included) = decks::read_with_includes(&path)?;
        // Size and hash are those of the deck with all that it includes.
        let parts: Vec<PathBuf> = [path.clone()].into_iter().chain(included).collect();
        Ok((Some((hashed_family("deck", path, &parts)?, deck)), notes))
    }

    /// Everything of the manifest that decides the case's numbers.
    fn recipe_json(&self, entry: &RunEntry) -> String {
        let head = &self.manifest.study;
        serde_json::json!({
            "study": head.name,
            "units": head.units,
            "kind": self.speed_kind(),
            "half_model": head.half_model,
            "recipe": self.manifest.recipe,
            "run": {
                "path": entry.path,
                "deck": entry.deck,
                "speed_m_per_s": entry.speed.map(|s| s.0),
                "mass_kg": entry.mass.0,
                "other_mass_kg": entry.other_mass.map(|m| m.0),
                "parameters": entry.parameters,
                "contact_time_s": entry.contact_time.map(|t| t.0),
                "gap_m": entry.gap.map(|g| g.0),
                "offset_m": entry.offset.map(|o| o.0),
                "truncate_s": entry.truncate.map(|t| t.0),
                "sign": entry.sign.map(|s| s.0),
                "accept_energy": self.accepts_energy(entry),
            },
        })
        .to_string()
    }

    fn speed_kind(&self) -> SpeedKind {
        match self.manifest.study.kind {
            StudyKind::Wall => SpeedKind::Wall,
            StudyKind::Pair => SpeedKind::Closing,
        }
    }

    fn accepts_energy(&self, entry: &RunEntry) -> bool {
        entry.accept_energy.unwrap_or(self.manifest.study.accept_energy)
    }

    /// What the run's entry states of its record.
    fn stated(&self, entry: &RunEntry) -> Stated {
        let time = entry.contact_time.map(|t| StatedContact::Time { s: t.0 });
        Stated {
            contact: time.or(entry.gap.map(|g| StatedContact::Gap { m: g.0 })),
            offset_m: entry.offset.map_or(0.0, |o| o.0),
            truncate_s: entry.truncate.map(|t| t.0),
            force_sign: entry.sign.map(|s| s.0 as f64),
            accept_energy: self.accepts_energy(entry),
        }
    }

    fn masses(&self, entry: &RunEntry) -> Masses {
        let body_kg = entry.mass.0;
        let other_kg = match self.manifest.study.kind {
            StudyKind::Wall => None,
            StudyKind::Pair => Some(entry.other_mass.map_or(body_kg, |m| m.0)),
        };
        Masses { body_kg, other_kg }
    }
}

impl LocatedRun<'_> {
    /// Reads the selected histories and extracts the case.
    ///
    /// # Errors
    /// [`RunError`] names the file and what to change.
    pub fn extract(&self) -> Result<Case, RunError> {
        let study = self.study;
        let head = &study.manifest.study;
        let recipe = &study.manifest.recipe;
        let mut notes = self.deck_notes.clone();
        let mut warnings = Vec::new();
        let deck = self.deck.as_ref();
        let units = self.units(deck, &mut notes, &mut warnings)?;
        let motion_file = self.file(&recipe.deflection.file);
        let motion = read_motion(motion_file, &recipe.deflection)?;
        let force_file = self.file(force_file(&recipe.force));
        let force = read_force(force_file, &recipe.force)?;
        let at = |file: &SolverFile, node: i64, component: &str| {
            file.history(Some(EntityId::new(node)), component).cloned()
        };
        let DeflectionSource { node, minus_node, component, .. } = recipe.deflection;
        let displacement = at(&motion, node, component.name())
            .ok_or_else(|| lacking(&motion_file.path, component.name(), &motion))?;
        let minus_displacement = minus_node.and_then(|n| at(&motion, n, component.name()));
        let velocity = at(&motion, node, component.velocity());
        let minus_velocity = minus_node.and_then(|n| at(&motion, n, component.velocity()));
        let (force_history, force_kind) = match &recipe.force {
            ForceSource::Contact { id, side, component, .. } => {
                (contact_history(&force, *id, *side, component), ForceKind::Contact)
            }
            ForceSource::Body { node, component, .. } => {
                (at(&force, *node, component), ForceKind::Body)
            }
        };
        let force_history = force_history
            .ok_or_else(|| lacking(&force_file.path, force_component(&recipe.force), &force))?;
        let contact = recipe.contact.as_ref().map(|source| self.contact(source)).transpose()?;
        let measured = Measured {
            units,
            contact: contact.as_ref().map(|c| &c.history),
            displacement: &displacement,
            minus_displacement: minus_displacement.as_ref(),
            velocity: velocity.as_ref(),
            minus_velocity: minus_velocity.as_ref(),
            force: match recipe.force {
                ForceSource::Contact { .. } => MeasuredForce::Contact(&force_history),
                ForceSource::Body { motion, .. } => MeasuredForce::Body(&force_history, motion),
            },
        };
        let masses = study.masses(self.entry);
        let others: Vec<(String, f64)> = study
            .runs()
            .iter()
            .filter(|run| run.case_name() != self.entry.case_name())
            .filter_map(|run| Some((run.case_name(), run.speed?.0)))
            .collect();
        let setup = Setup {
            recipe,
            kind: study.speed_kind(),
            half_model: head.half_model,
            masses,
            manifest_speed_m_per_s: self.entry.speed.map(|s| s.0),
            deck_speed: self.deck_speed(deck, units),
            stated: study.stated(self.entry),
            others: &others,
        };
        let extracted = extract(&measured, &setup).map_err(|source| {
            let file = if source.is_of_force() { force_file } else { motion_file };
            RunError::Extract { path: file.path.clone(), source }
        })?;
        if let Some((located, deck)) =
            deck.filter(|_| head.units.is_none() || extracted.speed_is_decks)
        {
            // What could not be read of it may have changed what was taken from it.
            let name = shown_name(&located.path);
            warnings.extend(deck.problems.iter().map(|p| format!("deck {name}: {p}")));
        }
        notes.extend(extracted.notes);
        warnings.extend(extracted.warnings);
        if let ForceSource::Contact { id, side: None, .. } = recipe.force
            && let Some(side) = force_history.entity.and_then(|e| e.side)
        {
            notes.push(format!(
                "force: side {} of interface {id} is used, the recipe names none",
                side.name()
            ));
        }
        compare_twin(motion_file, &motion, &mut notes, &mut warnings);
        if self.files.len() > 1 {
            compare_twin(force_file, &force, &mut notes, &mut warnings);
        }
        let mut read: Vec<(&Located, &SolverFile)> = vec![(motion_file, &motion)];
        let forces = [(force_file, &force)].into_iter();
        for (located, file) in forces.chain(contact.iter().map(|c| (c.located, &c.file))) {
            if read.iter().all(|(known, _)| known.file != located.file) {
                read.push((located, file));
            }
        }
        for (located, file) in &read {
            notes.extend(file.notes.iter().map(|n| format!("{}: {n}", located.file)));
            warnings.extend(file.problems.iter().map(|p| format!("{}: {p}", located.file)));
        }
        Ok(Case {
            study: head.name.clone(),
            group: head.group.clone(),
            name: self.entry.case_name(),
            speed: extracted.speed,
            masses,
            parameters: self.entry.parameters.clone(),
            force_kind,
            sampled: extracted.sampled,
            closing_speed_m_per_s: extracted.closing_speed_m_per_s,
            original: extracted.original,
            contact_time_s: extracted.contact_time_s,
            solver_wall_time_s: self.solver_wall_time_s(),
            unloading_stiffness_n_per_m: extracted.unloading_stiffness_n_per_m,
            audit: extracted.audit,
            recipe: self.recipe_in(units),
            fingerprint: self.fingerprint.clone(),
            sources: read
                .iter()
                .map(|(l, f)| self.source(l, f))
                .chain(deck.iter().map(|(l, d)| self.deck_source(l, d)))
                .collect(),
            notes,
            warnings,
        })
    }

    /// The recipe with the units that were found for it.
    fn recipe_in(&self, units: UnitSystem) -> String {
        let Ok(mut recipe) = serde_json::from_str::<serde_json::Value>(&self.recipe) else {
            return self.recipe.clone();
        };
        recipe["units"] = units.to_string().into();
        recipe.to_string()
    }

    /// The contact force beside a body force.
    fn contact(&self, source: &ForceSource) -> Result<ContactForce<'_>, RunError> {
        let located = self.file(force_file(source));
        let file = read_force(located, source)?;
        let history = match source {
            ForceSource::Contact { id, side, component, .. } => {
                contact_history(&file, *id, *side, component)
            }
            ForceSource::Body { .. } => None,
        };
        let history =
            history.ok_or_else(|| lacking(&located.path, force_component(source), &file))?;
        Ok(ContactForce { located, file, history })
    }

    /// The problems of the run's files, found by reading all of them, each with its file's name.
    pub fn problems(&self) -> Vec<String> {
        let mut found = Vec::new();
        for file in &self.files {
            let everything = Selection { section: file.section.clone(), ..Selection::nothing() };
            let Ok(sections) = solver::read_sections(&file.path, None, &everything) else {
                continue;
            };
            let problems = sections.iter().flat_map(|section| &section.problems);
            let name = shown_name(&file.path);
            found.extend(problems.map(|problem| format!("{name}: {problem}")));
        }
        found
    }

    /// `engine_wall_time_s` of the case.json in the run's folder, if there is one.
    fn solver_wall_time_s(&self) -> Option<f64> {
        let path = self.study.folder.join(&self.entry.path).join("case.json");
        let text = file::read_text(&path, MAX_CASE_BYTES).ok()?;
        let case: serde_json::Value = serde_json::from_str(&text).ok()?;
        case.get("engine_wall_time_s")?.as_f64().filter(|t| *t > 0.0 && t.is_finite())
    }

    /// The manifest's units, or those that the deck states.
    fn units(
        &self,
        deck: Option<&(Located, Deck)>,
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> Result<UnitSystem, RunError> {
        let stated = deck.and_then(|(located, deck)| {
            let units = deck.units.as_ref()?;
            Some((shown_name(&located.path), units, units.system?))
        });
        match (self.study.manifest.study.units, stated) {
            (Some(units), Some((name, stated, system))) if system != units => {
                warnings.push(format!(
                    "units: the deck {name} states \"{}\", the manifest has others; the manifest's are used",
                    stated.text.trim()
                ));
                Ok(units)
            }
            (Some(units), _) => Ok(units),
            (None, Some((name, stated, system))) => {
                notes.push(format!(
                    "units: \"{}\" taken from the deck {name}, line {}",
                    stated.text.trim(),
                    stated.at.line
                ));
                Ok(system)
            }
            (None, None) => Err(RunError::NoUnits {
                why: match deck {
                    Some((located, _)) => {
                        format!("the deck {} states none", located.path.display())
                    }
                    None => "the run has no deck that could".into(),
                },
            }),
        }
    }

    /// The deck's speed; for half a model the closing speed.
    fn deck_speed(&self, deck: Option<&(Located, Deck)>, units: UnitSystem) -> Option<DeckSpeed> {
        let bodies = if self.study.manifest.study.half_model { 2.0 } else { 1.0 };
        let (located, deck) = deck?;
        let found = deck.impact_speed()?;
        Some(DeckSpeed {
            m_per_s: bodies * found.speed * units.speed(),
            place: format!("{}, line {}", shown_name(&located.path), found.at.line),
        })
    }

    fn deck_source(&self, located: &Located, deck: &Deck) -> Source {
        Source {
            path: located
                .path
                .strip_prefix(&self.study.folder)
                .unwrap_or(&located.path)
                .display()
                .to_string(),
            size_bytes: located.size_bytes,
            blake3: located.blake3.clone(),
            format: "keyword".into(),
            solver: Some("LS-DYNA".into()),
            version: None,
            title: deck.title.clone(),
            problems: deck.problems.len(),
        }
    }

    /// The located file of a recipe's file name; `locate` found every one.
    fn file(&self, name: &str) -> &Located {
        self.files.iter().find(|f| f.file == name).unwrap_or(&self.files[0])
    }

    fn source(&self, located: &Located, file: &SolverFile) -> Source {
        Source {
            path: format!(
                "{}/{}",
                self.entry.path,
                located
                    .path
                    .file_name()
                    .map_or(String::new(), |n| n.to_string_lossy().into_owned())
            ),
            size_bytes: located.size_bytes,
            blake3: located.blake3.clone(),
            format: file.format.into(),
            solver: file.solver.clone(),
            version: file.version.clone(),
            title: file.title.clone(),
            problems: file.problems.len(),
        }
    }
}

/// The force that tells when contact begins, and where it was read.
struct ContactForce<'a> {
    located: &'a Located,
    file: SolverFile,
    history: History,
}

fn lacking(path: &Path, component: &str, file: &SolverFile) -> ReadError {
    ReadError::NoSuchComponent {
        path: path.into(),
        format: file.section.clone(),
        component: component.into(),
        known: file.components.join(", "),
    }
}

fn force_file(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { file, .. } | ForceSource::Body { file, .. } => file,
    }
}

fn force_component(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { component, .. } | ForceSource::Body { component, .. } => component,
    }
}

/// Most bytes of a run's case.json, which has some hundred.
const MAX_CASE_BYTES: u64 = 1 << 20;

/// Displacements and, where the file has them, velocities of the recipe's nodes.
fn read_motion(file: &Located, source: &DeflectionSource) -> Result<SolverFile, ReadError> {
    let wanted = |id| WantedId { id, side: None };
    let ids: Vec<WantedId> =
        [Some(source.node), source.minus_node].into_iter().flatten().map(wanted).collect();
    let component = source.component;
    let select = |components: Vec<String>| Selection {
        ids: Some(ids.clone()),
        components: Some(components),
        section: file.section.clone(),
        ..Selection::all()
    };
    let both = select(vec![component.name().into(), component.velocity().into()]);
    match solver::read(&file.path, None, &both) {
        Err(ReadError::NoSuchComponent { component: c, .. }) if c == component.velocity() => {
            solver::read(&file.path, None, &select(vec![component.name().into()]))
        }
        result => result,
    }
}

fn read_force(file: &Located, source: &ForceSource) -> Result<SolverFile, ReadError> {
    let id = match *source {
        ForceSource::Contact { id, side, .. } => WantedId { id, side },
        ForceSource::Body { node, .. } => WantedId { id: node, side: None },
    };
    let component = force_component(source).to_string();
    let selection = Selection {
        ids: Some(vec![id]),
        components: Some(vec![component]),
        section: file.section.clone(),
        ..Selection::all()
    };
    solver::read(&file.path, None, &selection)
}

/// The history of a wall or of one side of an interface; without a side named, SURFA's.
fn contact_history(
    file: &SolverFile,
    id: i64,
    side: Option<Side>,
    component: &str,
) -> Option<History> {
    let bare = file.history(Some(EntityId::new(id)), component);
    let of_side = |side| file.history(Some(EntityId { id, side: Some(side) }), component);
    match side {
        Some(side) => of_side(side).or(bare),
        None => bare.or_else(|| of_side(Side::SurfA)),
    }
    .cloned()
}
