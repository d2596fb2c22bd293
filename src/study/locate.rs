//! The files of a run: found and hashed, so that only what changed is read again.

use std::fs;
use std::path::{Path, PathBuf};

use super::files::{Located, force_file, hashed_family, locate_file, shown_name};
use super::{RunEntry, Study};
use crate::curve::source_hash;
use crate::error::{Error, KeyPath, error};
use crate::file;
use crate::solver::decks::{self, Search};
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, Selection};

/// Part of every fingerprint: raise it when the extraction gives other numbers.
const EXTRACTION_VERSION: u32 = 4;

/// Maximum number of bytes of a run's case.json, which has some hundred.
const MAX_CASE_BYTES: u64 = 1 << 20;

pub(super) struct RunDeck {
    pub file: Located,
    pub deck: Deck,
}

/// A run whose files are found and hashed but not read.
pub(crate) struct LocatedRun<'a> {
    pub(super) study: &'a Study,
    pub(super) entry: &'a RunEntry,
    pub(super) files: Vec<Located>,
    pub(super) deck: Option<RunDeck>,
    /// Notes on the search for the deck.
    pub(super) deck_notes: Vec<String>,
    /// Everything of the manifest that decides the case's numbers, as JSON.
    pub(super) recipe: String,
    /// Hash over recipe, entry and files: equal hashes need no new extraction.
    pub fingerprint: String,
}

impl Study {
    pub(crate) fn locate<'a>(&'a self, entry: &'a RunEntry) -> Result<LocatedRun<'a>, Error> {
        let folder = self.folder.join(&entry.path);
        let there = file::if_there(fs::metadata(&folder)).map_err(|e| Error::io(&folder, e))?;
        if !there.is_some_and(|meta| meta.is_dir()) {
            let path = folder.display();
            return Err(error!(
                Run,
                "the run's folder {path} does not exist: check path in the manifest"
            )
            .at(self.run_key(entry).key("path")));
        }
        let recipe = &self.manifest.recipe;
        let forces = [("force", Some(&recipe.force)), ("contact", recipe.contact.as_ref())];
        let forces = forces.into_iter().filter_map(|(table, f)| Some((table, force_file(f?))));
        let mut names = vec![("deflection", recipe.deflection.file.as_str())];
        for (table, name) in forces {
            if names.iter().all(|(_, known)| *known != name) {
                names.push((table, name));
            }
        }
        let at = |error: Error, table: &str| {
            if error.is_about("file") {
                error.at(KeyPath::of("recipe").key(table).key("file"))
            } else {
                error
            }
        };
        let files = names
            .into_iter()
            .map(|(table, name)| locate_file(&folder, name).map_err(|error| at(error, table)))
            .collect::<Result<Vec<_>, _>>()?;
        let (deck, deck_notes) = self.locate_deck(entry, &folder)?;
        let recipe = self.recipe_json(entry);
        let mut hash = blake3::Hasher::new();
        hash.update(&EXTRACTION_VERSION.to_le_bytes());
        hash.update(recipe.as_bytes());
        for file in files.iter().chain(deck.iter().map(|deck| &deck.file)) {
            hash.update(file.blake3.as_bytes());
        }
        let fingerprint = hash.finalize().to_hex().to_string();
        Ok(LocatedRun { study: self, entry, files, deck, deck_notes, recipe, fingerprint })
    }

    /// The deck that the manifest names, or the only one of the run's folder.
    /// Notes say why none of several is used.
    fn locate_deck(
        &self,
        entry: &RunEntry,
        folder: &Path,
    ) -> Result<(Option<RunDeck>, Vec<String>), Error> {
        let mut notes = Vec::new();
        let path = match &entry.deck {
            Some(name) => Some(self.folder.join(name)),
            None => match decks::find(folder).map_err(|e| Error::io(folder, e))? {
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
        let at = |error: Error| match entry.deck {
            Some(_) => error.at(self.run_key(entry).key("deck")),
            None => error.at(KeyPath::default()),
        };
        let (deck, included) = decks::read_with_includes(&path).map_err(at)?;
        // Size and hash are those of the deck with all that it includes.
        let parts: Vec<PathBuf> = [path.clone()].into_iter().chain(included).collect();
        let file = hashed_family("deck", path, &parts).map_err(at)?;
        Ok((Some(RunDeck { file, deck }), notes))
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
                "sign": entry.sign,
                "accept_energy": self.accepts_energy(entry),
            },
        })
        .to_string()
    }
}

impl LocatedRun<'_> {
    /// What its case is made of, whatever it is called.
    pub(crate) fn source_hash(&self) -> Option<String> {
        let files = self.files.iter().chain(self.deck.iter().map(|deck| &deck.file));
        source_hash(&self.recipe, files.map(|file| file.blake3.as_str()))
    }

    /// The problems of the run's files, found by reading all of them, each with its file's name.
    pub(crate) fn problems(&self) -> Vec<String> {
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
    pub(super) fn solver_wall_time_s(&self) -> Result<Option<f64>, Error> {
        let path = self.study.folder.join(&self.entry.path).join("case.json");
        let text = file::if_there(file::read_text(&path, MAX_CASE_BYTES));
        let stated = |text: String| {
            let case: serde_json::Value = serde_json::from_str(&text).ok()?;
            case.get("engine_wall_time_s")?.as_f64().filter(|t| *t > 0.0 && t.is_finite())
        };
        Ok(text.map_err(|e| Error::io(&path, e))?.and_then(stated))
    }

    pub(super) fn file(&self, name: &str) -> &Located {
        // `locate` found every one.
        self.files.iter().find(|f| f.file == name).unwrap_or(&self.files[0])
    }
}
