//! The runs of a study with their files, which a recipe names in a run's folder: text, or section of a binary file.

use std::fs::{self, DirEntry};
use std::path::{Path, PathBuf};

use super::{RunEntry, Study};
use crate::curve::recipe::ForceSource;
use crate::curve::source_hash;
use crate::error::{Error, ErrorCode, KeyPath, error};
use crate::file::{self, is_file};
use crate::guess;
use crate::solver::decks::{self, Search};
use crate::solver::lsdyna::deck::Deck;
use crate::solver::{self, Problem, ProblemCode, Selection};

/// A source file of a run before it is read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Located {
    /// As written in the recipe.
    pub file: String,
    pub path: PathBuf,
    /// Section of a binary file; `None` for a text file.
    pub section: Option<String>,
    /// A binary file next to the text file that has the same section.
    pub binary_beside: Option<(PathBuf, String)>,
    pub size_bytes: u64,
    pub blake3: String,
}

pub(super) fn force_file(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { file, .. } | ForceSource::Body { file, .. } => file,
    }
}

/// Finds the file a recipe names: the text file of that name, or the section of a binout
/// or of an OpenRadioss T01.
pub(super) fn locate_file(folder: &Path, name: &str) -> Result<Located, Error> {
    let names = file_names(folder)?;
    let text = named_text(folder, name, &names)?;
    let is_text = is_file(&text)?;
    let names_only = Selection { audit: false, ..Selection::nothing() };
    let (mut binout, mut damaged) = (None, None);
    let outputs = solver::runs::output_files(folder).map_err(|source| Error::io(folder, source))?;
    for path in outputs {
        let part = shown_name(&path);
        if !solver::is_named_like_binary(&part) {
            continue;
        }
        let sections = match solver::read_sections(&path, None, &names_only) {
            Ok(sections) => sections,
            // Only named like one; or broken, which matters where the text is missing.
            Err(error) if error.is_about("format") => continue,
            Err(error) if is_text && error.code() != ErrorCode::Io => continue,
            Err(error) => return Err(error.at(KeyPath::default())),
        };
        let has_states = sections.iter().any(|s| !s.time.is_empty());
        let cut = |p: &&Problem| !has_states || p.code == ProblemCode::CutRecord;
        if let Some(problem) = sections.iter().find_map(|s| s.problems.iter().find(cut))
            && damaged.is_none()
        {
            damaged = Some(format!("{part} is damaged ({problem})"));
        }
        if let Some(section) = sections.iter().find(|s| is_section_of(&s.section, name)) {
            binout = Some((path, section.section.clone()));
            break;
        }
    }
    let (path, section, binary_beside) = match (is_text, binout) {
        // A solver that was requested the binary file alone may leave the header of the text.
        (true, Some((path, section))) if is_without_states(&text) => (path, Some(section), None),
        (true, binout) => (text, None, binout),
        (false, Some((path, section))) => (path, Some(section), None),
        (false, None) => {
            let mut found = if names.is_empty() { "no files".into() } else { names.join(", ") };
            if let Some(damaged) = damaged {
                found = format!("{found}; {damaged}");
            }
            let hint = match names.iter().any(|there| there == name) {
                true => ", of which this one is not a regular file".into(),
                false => guess::hint(name, &found),
            };
            return Err(error!(
                Run,
                "the run's folder {} has no file \"{name}\": it has {found}{hint}",
                folder.display()
            )
            .at_key("file"));
        }
    };
    let parts = match section {
        Some(_) => solver::family(&path)?,
        None => vec![path.clone()],
    };
    Ok(Located { section, binary_beside, ..hashed_family(name, path, &parts)? })
}

/// The text file that a recipe calls `name`: the one of that name, or with a job id before it.
fn named_text(folder: &Path, name: &str, names: &[String]) -> Result<PathBuf, Error> {
    let exact = folder.join(name);
    let mut of_jobs = Vec::new();
    for name in names.iter().filter(|n| solver::without_job_id(n) == name) {
        if is_file(&folder.join(name))? {
            of_jobs.push(name);
        }
    }
    match of_jobs[..] {
        [first, second, ..] if !is_file(&exact)? => Err(error!(
            Run,
            "the run's folder {} has {first} and {second}: write in the recipe which one is meant, or give each run a folder of its own",
            folder.display()
        )
        .at_key("file")),
        [only] => Ok(folder.join(only)),
        _ => Ok(exact),
    }
}

/// A text file with at most this many bytes may be a header without states.
const LONGEST_HEADER_BYTES: u64 = 1 << 20;

/// Whether a text file holds a header only.
pub(crate) fn is_without_states(text: &Path) -> bool {
    let is_short = text.metadata().is_ok_and(|meta| meta.len() <= LONGEST_HEADER_BYTES);
    let names_only = Selection { audit: false, ..Selection::nothing() };
    is_short
        && solver::read_sections(text, None, &names_only)
            .is_ok_and(|sections| sections.iter().all(|section| section.time.is_empty()))
}

/// A file with the size and hash of all its parts.
pub(super) fn hashed_family(
    name: &str,
    path: PathBuf,
    parts: &[PathBuf],
) -> Result<Located, Error> {
    let (size_bytes, blake3) = content_hash(parts)?;
    Ok(Located { file: name.into(), size_bytes, blake3, path, section: None, binary_beside: None })
}

/// Size and BLAKE3 of files one after the other.
pub(crate) fn content_hash(parts: &[PathBuf]) -> Result<(u64, String), Error> {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        let io = |source| Error::io(part, source);
        let file = file::open(part).map_err(io)?;
        hasher.update_reader(file).map_err(io)?;
    }
    Ok((hasher.count(), hasher.finalize().to_hex().to_string()))
}

pub(crate) fn shown_name(path: &Path) -> String {
    path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned())
}

/// Whether a binout's section holds what the text file of that name holds.
pub(crate) fn is_section_of(section: &str, name: &str) -> bool {
    section == name || section.strip_prefix(name).is_some_and(|rest| rest == "/forces")
}

fn file_names(folder: &Path) -> Result<Vec<String>, Error> {
    let names = folder.read_dir().and_then(|entries| {
        let name = |e: DirEntry| e.file_name().to_string_lossy().into_owned();
        entries.take(1_000).map(|entry| entry.map(name)).collect()
    });
    let mut names: Vec<String> = names.map_err(|source| Error::io(folder, source))?;
    names.sort();
    Ok(names)
}

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
        let path = folder.display();
        let error = match there {
            Some(meta) if meta.is_dir() => None,
            Some(_) => Some(error!(Run, "{path} is a file: path is the folder of the run")),
            None => {
                Some(error!(Run, "the run's folder {path} does not exist: check path in the study"))
            }
        };
        if let Some(error) = error {
            return Err(error.at(self.run_key(entry).key("path")));
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
        // A case is made anew when a restart has written beside them, or that is moved away.
        for unread in files.iter().filter_map(|file| solver::unread_restart(&file.path)) {
            hash.update(unread.as_bytes());
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
            let case: serde_json::Value = text.parse().ok()?;
            case.get("engine_wall_time_s")?.as_f64().filter(|t| *t > 0.0 && t.is_finite())
        };
        Ok(text.map_err(|e| Error::io(&path, e))?.and_then(stated))
    }

    pub(super) fn file(&self, name: &str) -> &Located {
        // `locate` found every one.
        self.files.iter().find(|f| f.file == name).unwrap_or(&self.files[0])
    }
}
