//! Extraction of a run's case: units, the histories that its recipe names, curve, notes and warnings.

use super::files::{Located, LocatedRun, RunDeck, force_file, shown_name};
use crate::curve::contact::THRESHOLD;
use crate::curve::extract::{
    ExtractError, Extracted, Measured, MeasuredForce, Notes, Setup, of_run,
};
use crate::curve::recipe::{DeflectionSource, ForceSource, Recipe};
use crate::curve::{Case, CaseId, Conditions, Origin, Provenance, Quality, SourceFile};
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::file::{absolute, is_file};
use crate::history::{EntityId, History, Side};
use crate::solver::{self, Selection, SolverFile, WantedId};
use crate::unit::{Shown, SpeedKind, UnitSystem};

impl LocatedRun<'_> {
    pub(crate) fn extract(&self) -> Result<Case, Error> {
        let mut remarks = Notes { notes: self.deck_notes.clone(), ..Notes::default() };
        let units = self.units(&mut remarks)?;
        let files = RunFiles::read(self, &self.study.manifest.recipe)?;
        let extracted = self.curve(&files, units)?;
        if self.study.manifest.study.units.is_none() || extracted.speed_is_decks {
            // What could not be read of it may have changed what was taken from it.
            if let Some(RunDeck { file, deck }) = &self.deck {
                let name = shown_name(&file.path);
                remarks.warnings.extend(deck.problems.iter().map(|p| format!("deck {name}: {p}")));
            }
        }
        remarks.notes.extend_from_slice(&extracted.quality.notes);
        remarks.warnings.extend_from_slice(&extracted.quality.warnings);
        self.remark_on_files(&files, &mut remarks)?;
        remarks.warnings.extend(self.mass_by_energy(&files, units)?);
        self.case(&files, units, extracted, remarks)
    }

    /// The manifest's units, or those that the deck states.
    fn units(&self, remarks: &mut Notes) -> Result<UnitSystem, Error> {
        let stated = self.deck.as_ref().and_then(|deck| {
            let units = deck.deck.units.as_ref()?;
            Some((shown_name(&deck.file.path), units, units.system?))
        });
        let metals = self
            .deck
            .as_ref()
            .and_then(|RunDeck { file, deck }| deck.units_of_metals(&shown_name(&file.path)));
        if let Some(units) = self.study.manifest.study.units {
            if let Some((name, stated, _)) = stated.filter(|(.., system)| *system != units) {
                remarks.warn(format!(
                    "units: the deck {name} states \"{}\", the study states others; those of the study are used",
                    stated.text.trim()
                ));
            }
            if let Some((_, said)) = metals.filter(|(metals, _)| *metals != units) {
                remarks.warn(format!("units: the study states {units}, but {said}"));
            }
            return Ok(units);
        }
        let others = metals.filter(|(metals, _)| stated.as_ref().is_none_or(|s| s.2 != *metals));
        if let Some((units, said)) = others {
            match stated {
                Some((name, stated, _)) => remarks.warn(format!(
                    "units: the deck {name} states \"{}\", but {said}, which is taken",
                    stated.text.trim()
                )),
                None => remarks.note(format!("units: {said}, which is taken")),
            }
            return Ok(units);
        }
        if let Some((name, stated, system)) = stated {
            remarks.note(format!(
                "units: \"{}\" taken from the deck {name}, line {}",
                stated.text.trim(),
                stated.at.line
            ));
            return Ok(system);
        }
        let deck = match &self.deck {
            Some(deck) => format!("the deck {} states none", deck.file.path.display()),
            None => "the run has no deck that could state them".into(),
        };
        Err(error!(
            Run,
            "the study gives no units and {deck}: add units = \"mm-t-s\" (or the actual ones) to [study]"
        )
        .at(KeyPath::of("study")))
    }

    fn curve(&self, files: &RunFiles<'_>, units: UnitSystem) -> Result<Extracted, Error> {
        let (study, entry) = (self.study, self.entry);
        let others = || -> Vec<(String, f64)> {
            let others = study.runs().iter().filter(|run| run.case_name() != entry.case_name());
            others.filter_map(|run| Some((run.case_name(), run.speed?.0))).collect()
        };
        let setup = Setup {
            filter: study.manifest.recipe.filter,
            sampling: study.manifest.recipe.sampling,
            kind: study.speed_kind(),
            half_model: study.manifest.study.half_model,
            masses: study.masses(entry),
            manifest_speed_m_per_s: entry.speed.map(|s| s.0),
            deck_speed: self.deck_speed(units),
            contact_threshold: study.manifest.recipe.contact_threshold.unwrap_or(THRESHOLD),
            of_impulse: files.contact_force().is_some_and(SolverFile::differentiates_impulses),
            stated: study.stated(entry),
            others: &others,
        };
        of_run(&files.measured(units)?, &setup).map_err(|source| {
            if let ExtractError::Curve(error) = &source
                && error.is_about("sampling")
            {
                return error.clone().at(KeyPath::of("recipe").key("sampling"));
            }
            let read = if source.is_of_force() { &files.force } else { &files.motion };
            let key = match &source {
                ExtractError::ImpossibleRun(run) if run.is_of_speed() && entry.speed.is_some() => {
                    "speed"
                }
                ExtractError::ImpossibleRun(run) if run.is_of_mass() => "mass",
                _ => "path",
            };
            Error::below(ErrorCode::Run, source)
                .of(read.located.path.display())
                .at(study.run_key(entry).key(key))
        })
    }

    /// That the kinetic energy at the start, in a glstat next to the run, asks for another mass: a
    /// body force is in balance with every mass.
    fn mass_by_energy(
        &self,
        files: &RunFiles<'_>,
        units: UnitSystem,
    ) -> Result<Option<String>, Error> {
        let path = self.study.folder.join(&self.entry.path).join("glstat");
        if !self.study.manifest.recipe.force_is_body() || !is_file(&path)? {
            return Ok(None);
        }
        let wanted = Selection {
            ids: None,
            components: Some(vec!["kinetic_energy".into()]),
            ..Selection::all()
        };
        match solver::read(&path, None, &wanted) {
            Err(fault) if fault.code() == ErrorCode::Io => Err(fault),
            energy => Ok(energy.ok().and_then(|energy| self.other_mass(&energy, files, units))),
        }
    }

    fn other_mass(
        &self,
        energy: &SolverFile,
        files: &RunFiles<'_>,
        units: UnitSystem,
    ) -> Option<String> {
        let measured = files.measured(units).ok()?;
        let first = |history: &History| history.values.first().map(|v| v * units.speed());
        let moves = [measured.velocity, measured.minus_velocity].map(|v| v.and_then(first));
        let masses = self.study.masses(self.entry);
        let other = masses.other_kg.unwrap_or(0.0) * moves[1].unwrap_or(0.0).powi(2);
        let stated_j = 0.5 * (masses.body_kg * moves[0]?.powi(2) + other);
        let found_j = units.force()
            * units.length_m
            * energy.history(None, "kinetic_energy")?.values.first()?;
        let ratio = found_j / stated_j;
        ((ratio - 1.0).abs() > SAME_ENERGY).then(|| {
            format!(
                "mass: glstat has {} at the start, the masses of the study give {}: the mass of the run is wrong ({} would agree), or more than its bodies is moving",
                Shown::one_energy(found_j),
                Shown::one_energy(stated_j),
                Shown::one_mass(ratio * masses.body_kg)
            )
        })
    }

    /// Ids of the walls whose force the recipe takes.
    fn wall_ids(&self) -> Vec<i64> {
        match &self.study.manifest.recipe.force {
            ForceSource::Contact { file, id, also, .. } if file == "rwforc" => {
                also.iter().chain([id]).copied().collect()
            }
            _ => Vec::new(),
        }
    }

    /// Notes on the files: the side that was chosen, binary files beside texts, and damage.
    fn remark_on_files(&self, files: &RunFiles<'_>, remarks: &mut Notes) -> Result<(), Error> {
        if let ForceSource::Contact { id, side: None, .. } = self.study.manifest.recipe.force
            && let Some(side) = files.force_history()?.entity.and_then(|e| e.side)
        {
            remarks.note(format!(
                "force: side {} of interface {id} is used, since the recipe names none",
                side.name()
            ));
        }
        if self.study.speed_kind() == SpeedKind::Wall
            && let Some(RunDeck { file, deck }) = &self.deck
            && let Some(wall) = deck.moving_wall(&self.wall_ids())
        {
            remarks.warn(format!(
                "the wall of the deck {}, {}, moves: speed, deflection and energy are the body's own, and not those of the impact",
                shown_name(&file.path),
                deck.line(wall.at)
            ));
        }
        compare_text_with_binary(&files.motion, remarks)?;
        if self.files.len() > 1 {
            compare_text_with_binary(&files.force, remarks)?;
        }
        for ReadFile { located, file, .. } in files.each() {
            remarks.notes.extend(file.notes.iter().map(|n| format!("{}: {n}", located.file)));
            remarks.warnings.extend(file.problems.iter().map(|p| format!("{}: {p}", located.file)));
        }
        Ok(())
    }

    fn case(
        &self,
        files: &RunFiles<'_>,
        units: UnitSystem,
        extracted: Extracted,
        remarks: Notes,
    ) -> Result<Case, Error> {
        let head = &self.study.manifest.study;
        let read = files.each().into_iter().map(|read| self.source(read));
        Ok(Case {
            id: CaseId {
                study: head.name.clone(),
                group: head.group.clone(),
                name: self.entry.case_name(),
            },
            conditions: Conditions {
                speed: extracted.speed,
                masses: self.study.masses(self.entry),
                parameters: self.entry.parameters.clone(),
            },
            curves: extracted.curves,
            quality: Quality {
                audit: extracted.quality.audit,
                notes: remarks.notes,
                warnings: remarks.warnings,
            },
            provenance: Provenance {
                recipe: self.recipe_in(units),
                fingerprint: self.fingerprint.clone(),
                sources: read
                    .chain(self.deck.iter().map(|deck| self.source_of_deck(deck)))
                    .collect(),
                solver_wall_time_s: self.solver_wall_time_s()?,
                origin: Some(Origin {
                    manifest: self.study.path(),
                    group: head.group.clone(),
                    run: self.entry.case_name(),
                }),
                ..Provenance::default()
            },
        })
    }

    fn recipe_in(&self, units: UnitSystem) -> String {
        let Ok(mut recipe) = self.recipe.parse::<serde_json::Value>() else {
            return self.recipe.clone();
        };
        recipe["units"] = units.to_string().into();
        recipe.to_string()
    }

    /// The deck's speed; for half a model the closing speed.
    fn deck_speed(&self, units: UnitSystem) -> Option<(f64, String)> {
        let bodies = if self.study.manifest.study.half_model { 2.0 } else { 1.0 };
        let RunDeck { file, deck } = self.deck.as_ref()?;
        let (speed, at) = deck.impact_speed()?;
        let place = format!("{}, line {}", shown_name(&file.path), at.line);
        Some((bodies * speed * units.speed(), place))
    }

    fn source_of_deck(&self, RunDeck { file, deck }: &RunDeck) -> SourceFile {
        let path = &file.path;
        let below = path.strip_prefix(&self.study.folder).unwrap_or(path);
        SourceFile {
            path: below.display().to_string(),
            absolute_path: Some(absolute(path)),
            size_bytes: file.size_bytes,
            blake3: file.blake3.clone(),
            format: "keyword".into(),
            solver: Some("LS-DYNA".into()),
            version: None,
            title: deck.title.clone(),
            problems: deck.problems.len(),
        }
    }

    fn source(&self, ReadFile { located, file, .. }: &ReadFile<'_>) -> SourceFile {
        SourceFile {
            path: format!("{}/{}", self.entry.path, shown_name(&located.path)),
            absolute_path: Some(absolute(&located.path)),
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

/// Kinetic energies of a run and of its masses that differ by less are one.
const SAME_ENERGY: f64 = 0.05;

/// Text and binary of one run agree up to the text's digits.
const SAME_VALUE: f64 = 1e-5;

/// Which of text file and binary file was read, and whether they differ.
fn compare_text_with_binary(read: &ReadFile<'_>, remarks: &mut Notes) -> Result<(), Error> {
    let ReadFile { located, file, .. } = read;
    let name = &located.file;
    if let Some(section) = &located.section {
        let path = shown_name(&located.path);
        remarks.note(format!("{name}: read from section {section} of {path}"));
    }
    let Some((path, section)) = &located.binary_beside else { return Ok(()) };
    let ids = file.histories.iter().filter_map(|h| h.entity);
    let selection = Selection {
        ids: Some(ids.map(|e| WantedId { id: e.id, side: e.side }).collect()),
        components: Some(file.histories.iter().map(|h| h.component.to_string()).collect()),
        section: Some(section.clone()),
        ..Selection::all()
    };
    let shown = shown_name(path);
    match solver::read(path, None, &selection) {
        Ok(binary) if is_same(file, &binary) => {
            remarks.note(format!("{name}: section {section} of {shown} agrees with it"));
        }
        Ok(_) => remarks.warn(format!(
            "{name} and section {section} of {shown} differ; the text file was used"
        )),
        Err(fault) if fault.code() == ErrorCode::Io => return Err(fault),
        Err(error) => {
            remarks.warn(format!("{name}: the binary file beside it cannot be compared: {error}"));
        }
    }
    Ok(())
}

fn is_same(text: &SolverFile, binary: &SolverFile) -> bool {
    let has = |a: &History| {
        binary.history(a.entity, &a.component).is_some_and(|b| is_alike(&a.values, &b.values))
    };
    is_alike(&text.time, &binary.time) && text.histories.iter().all(has)
}

/// Whether two columns are the same up to the digits of text files.
pub(crate) fn is_alike(a: &[f64], b: &[f64]) -> bool {
    let finite = a.iter().filter(|v| v.is_finite());
    let largest = finite.fold(0.0, |m: f64, v| m.max(v.abs()));
    // A number that is missing must not be there in the other either.
    let differ =
        |a: f64, b: f64| (a - b).abs() > SAME_VALUE * largest || a.is_finite() != b.is_finite();
    a.len() == b.len() && !a.iter().zip(b).any(|(a, b)| differ(*a, *b))
}

/// A located file with the histories that were selected of it.
pub(super) struct ReadFile<'a> {
    pub located: &'a Located,
    pub file: SolverFile,
    /// Of the forces that the recipe adds.
    sum: Option<History>,
}

/// The files of a run with the histories that its recipe names.
pub(super) struct RunFiles<'a> {
    recipe: &'a Recipe,
    pub motion: ReadFile<'a>,
    pub force: ReadFile<'a>,
    /// The contact force where the force is a body force.
    pub contact: Option<ReadFile<'a>>,
}

impl<'a> RunFiles<'a> {
    pub(crate) fn read(run: &'a LocatedRun<'_>, recipe: &'a Recipe) -> Result<Self, Error> {
        let read_force = |table: &str, source: &ForceSource| {
            let located = run.file(force_file(source));
            let ids = match source {
                ForceSource::Contact { also, .. } => vec!["id"; 1 + also.len()],
                ForceSource::Body { .. } => vec!["node"],
            };
            let (file, sum) = read_force(located, source).map_err(|e| in_recipe(e, table, &ids))?;
            Ok::<_, Error>(ReadFile { located, file, sum })
        };
        let located = run.file(&recipe.deflection.file);
        let file = read_motion(located, &recipe.deflection)
            .map_err(|e| in_recipe(e, "deflection", &["node", "minus_node"]))?;
        Ok(Self {
            recipe,
            motion: ReadFile { located, file, sum: None },
            force: read_force("force", &recipe.force)?,
            contact: recipe.contact.as_ref().map(|c| read_force("contact", c)).transpose()?,
        })
    }

    pub(crate) fn measured(&self, units: UnitSystem) -> Result<Measured<'_>, Error> {
        let DeflectionSource { node, minus_node, component, .. } = self.recipe.deflection;
        let motion =
            |node: i64, name: &str| self.motion.file.history(Some(EntityId::new(node)), name);
        let displacement = motion(node, component.name())
            .ok_or_else(|| in_recipe(self.motion.lacks(component.name()), "deflection", &[]))?;
        let force = self.force_history()?;
        Ok(Measured {
            units,
            displacement,
            minus_displacement: minus_node.and_then(|n| motion(n, component.name())),
            velocity: motion(node, component.velocity()),
            minus_velocity: minus_node.and_then(|n| motion(n, component.velocity())),
            force: match self.recipe.force {
                ForceSource::Contact { .. } => MeasuredForce::Contact(force),
                ForceSource::Body { motion, .. } => MeasuredForce::Body(force, motion),
            },
            contact: match self.recipe.contact.as_ref().zip(self.contact.as_ref()) {
                Some((source, read)) => {
                    Some(read.force_history(source).map_err(|e| in_recipe(e, "contact", &[]))?)
                }
                None => None,
            },
        })
    }

    /// The file of the contact force, if there is one.
    fn contact_force(&self) -> Option<&SolverFile> {
        let is_contact = matches!(self.recipe.force, ForceSource::Contact { .. });
        let own = is_contact.then_some(&self.force);
        self.contact.as_ref().or(own).map(|read| &read.file)
    }

    /// The history that the force is, or is made of.
    pub(crate) fn force_history(&self) -> Result<&History, Error> {
        self.force.force_history(&self.recipe.force).map_err(|e| in_recipe(e, "force", &[]))
    }

    /// Each file once.
    pub(crate) fn each(&self) -> Vec<&ReadFile<'a>> {
        let mut each = vec![&self.motion];
        for read in [&self.force].into_iter().chain(&self.contact) {
            if each.iter().all(|known| known.located.file != read.located.file) {
                each.push(read);
            }
        }
        each
    }
}

impl ReadFile<'_> {
    fn force_history(&self, source: &ForceSource) -> Result<&History, Error> {
        if let Some(sum) = &self.sum {
            return Ok(sum);
        }
        let history = match source {
            ForceSource::Contact { id, side, component, .. } => {
                contact_history(&self.file, *id, *side, component)
            }
            ForceSource::Body { node, component, .. } => {
                self.file.history(Some(EntityId::new(*node)), component)
            }
        };
        history.ok_or_else(|| self.lacks(force_component(source)))
    }

    fn lacks(&self, component: &str) -> Error {
        let (path, known) = (self.located.path.display(), self.file.components.join(", "));
        solver::no_component(path, &self.file.section, component, &known)
    }
}

/// An error of a file's selection at the key of the recipe's table that selects it; `ids` are the keys of
/// the ids, in their order.
fn in_recipe(error: Error, table: &str, ids: &[&str]) -> Error {
    let table = KeyPath::of("recipe").key(table);
    let mut ids = ids.iter().enumerate();
    let id = ids.find(|(k, _)| *error.key() == KeyPath::of("ids").item(*k));
    let key = match id {
        Some((_, id)) => table.key(id),
        None if error.is_about("component") => table.key("component"),
        None => KeyPath::default(),
    };
    error.at(key)
}

fn force_component(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { component, .. } | ForceSource::Body { component, .. } => component,
    }
}

fn read_file(file: &Located, ids: Vec<WantedId>, components: &[&str]) -> Result<SolverFile, Error> {
    let selection = Selection {
        ids: Some(ids),
        components: Some(components.iter().map(ToString::to_string).collect()),
        section: file.section.clone(),
        ..Selection::all()
    };
    solver::read(&file.path, None, &selection)
}

/// Displacements and, where the file has them, velocities of the recipe's nodes.
fn read_motion(file: &Located, source: &DeflectionSource) -> Result<SolverFile, Error> {
    let ids: Vec<WantedId> = [Some(source.node), source.minus_node]
        .into_iter()
        .flatten()
        .map(|id| WantedId { id, side: None })
        .collect();
    let component = source.component;
    match read_file(file, ids.clone(), &[component.name(), component.velocity()]) {
        // Without velocities, displacements alone; if these are missing, the error is about them.
        Err(error) if error.is_about("component") => read_file(file, ids, &[component.name()]),
        result => result,
    }
}

/// The file, and the sum where the recipe adds forces.
fn read_force(
    file: &Located,
    source: &ForceSource,
) -> Result<(SolverFile, Option<History>), Error> {
    let (ids, side) = match source {
        ForceSource::Contact { id, also, side, .. } => ([&[*id], &also[..]].concat(), *side),
        ForceSource::Body { node, .. } => (vec![*node], None),
    };
    let wanted = ids.iter().map(|&id| WantedId { id, side }).collect();
    let component = force_component(source);
    let read = read_file(file, wanted, &[component])?;
    let sum = match ids.len() {
        1 => None,
        _ => {
            let of = ids.iter().map(|&id| contact_history(&read, id, side, component));
            let sum = of.collect::<Option<Vec<_>>>().and_then(|of| History::sum(&of));
            Some(sum.ok_or_else(|| {
                let path = file.path.display();
                error!(
                    Run,
                    "{path} does not hold {component} of {ids:?} at the same times: only forces at common times can be added"
                )
            })?)
        }
    };
    Ok((read, sum))
}

/// The history of a wall or of one side of an interface; without a side named, SURFA's.
fn contact_history<'a>(
    file: &'a SolverFile,
    id: i64,
    side: Option<Side>,
    component: &str,
) -> Option<&'a History> {
    let bare = file.history(Some(EntityId::new(id)), component);
    let of_side = |side| file.history(Some(EntityId { id, side: Some(side) }), component);
    match side {
        Some(side) => of_side(side).or(bare),
        None => bare.or_else(|| of_side(Side::SurfA)),
    }
}
