//! The deck of a run: found next to its files, read with its includes, compared with them.

use std::collections::HashMap;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use super::lsdyna::deck::{self, Deck};
use super::lsdyna::line::Lines;
use super::openradioss::starter;
use super::{Entity, SolverFile, source};
use crate::error::Error;
use crate::file;

/// Endings of keyword decks, and of OpenRadioss' starter decks.
const ENDINGS: [&str; 6] = ["k", "key", "dyn", "dyna", "kwd", STARTER];
const STARTER: &str = "rad";
/// Names of a folder that are examined, and decks among them that are read.
const MAX_NAMES: usize = 10_000;
const MAX_DECKS: usize = 20;
/// Bytes by which text that is not plain is known.
const HEAD: usize = 16;
/// Lines examined for the first keyword.
const HEAD_LINES: usize = 1_000;

/// The decks of a folder.
pub(crate) enum Search {
    None,
    /// The only deck, or the one that includes the others.
    One(PathBuf),
    /// Several that do not include each other.
    Several(Vec<PathBuf>),
}

/// Reads a deck; included files are looked for next to it.
///
/// # Errors
/// If the deck itself cannot be read.
pub fn read_deck(path: &Path) -> Result<Deck, Error> {
    Ok(read_with_includes(path)?.0)
}

/// The same, with the included files that were read.
pub(crate) fn read_with_includes(path: &Path) -> Result<(Deck, Vec<PathBuf>), Error> {
    let io = |source| Error::io(path, source);
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut included, mut fault) = (Vec::new(), None);
    let mut open = |name: &str| -> Option<Box<dyn BufRead>> {
        // Names are often written on Windows.
        let path = folder.join(name.replace('\\', "/"));
        match file::if_there(file::open(&path)) {
            Ok(file) => {
                let file = file?;
                included.push(path);
                Some(Box::new(BufReader::new(file)))
            }
            Err(source) => {
                fault = Some(Error::io(&path, source));
                None
            }
        }
    };
    let mut file = BufReader::new(file::open(path).map_err(io)?);
    let head = file.fill_buf().map_err(io)?;
    if let Some(what) = source::encoded(&head[..head.len().min(HEAD)]) {
        return Err(io(std::io::Error::other(what)));
    }
    let is_starter = head.split(|b| *b == b'\n').any(starter::signature);
    let deck = match is_starter {
        true => starter::read(&mut file),
        false => deck::parse_deck(&mut file, &mut open),
    };
    let deck = deck.map_err(io)?;
    fault.map_or(Ok((deck, included)), Err)
}

/// The files that a deck itself includes.
fn includes(path: &Path) -> io::Result<Vec<deck::DeckInclude>> {
    let mut file = BufReader::new(file::open(path)?);
    let deck = file::if_there(deck::parse_deck(&mut file, &mut |_| None))?;
    Ok(deck.map(|deck| deck.includes).unwrap_or_default())
}

/// Looks for the main deck in a folder: the one that no other of the folder includes.
pub(crate) fn find(folder: &Path) -> io::Result<Search> {
    let of = |path: &Path| {
        let path = path.to_path_buf();
        move |source| io::Error::other(Error::io(&path, source))
    };
    let mut candidates = Vec::new();
    for entry in folder.read_dir()?.take(MAX_NAMES) {
        let path = entry?.path();
        if has_ending_of(&path, &ENDINGS) && is_deck(&path).map_err(of(&path))? {
            candidates.push(path);
        }
    }
    // OpenRadioss reads keyword decks as well.
    if candidates.iter().any(|path| !has_ending_of(path, &[STARTER])) {
        candidates.retain(|path| !has_ending_of(path, &[STARTER]));
    }
    candidates.sort();
    if candidates.len() > 1 && candidates.len() <= MAX_DECKS {
        let mut included = Vec::new();
        for path in &candidates {
            let named = includes(path).map_err(of(path))?;
            included.extend(named.into_iter().map(|include| include.name.replace('\\', "/")));
        }
        candidates.retain(|path| {
            let name = path.file_name().map(|n| n.to_string_lossy());
            !included.iter().any(|i| Path::new(i).file_name().map(|n| n.to_string_lossy()) == name)
        });
    }
    Ok(match candidates.len() {
        0 => Search::None,
        1 => candidates.pop().map_or(Search::None, Search::One),
        _ => Search::Several(candidates),
    })
}

/// The only deck next to the file at `path`, or the one that includes the others, if it can be read.
pub(crate) fn deck_next_to(path: &Path) -> Option<(PathBuf, Deck)> {
    let folder = crate::file::folder_of(path);
    match find(folder) {
        Ok(Search::One(path)) => read_deck(&path).ok().map(|deck| (path, deck)),
        _ => None,
    }
}

fn has_ending_of(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    ending.is_some_and(|ending| endings.contains(&ending.as_str()))
}

/// Whether the first keyword of a file is one of a deck.
fn is_deck(path: &Path) -> io::Result<bool> {
    let Some(file) = file::if_there(file::open(path))? else { return Ok(false) };
    let mut lines = Lines::new(BufReader::new(file));
    for _ in 0..HEAD_LINES {
        match file::if_there(lines.next_line())?.flatten() {
            Some(line) if line.text.starts_with(b"*") => return Ok(deck::signature(line.text)),
            Some(line) if starter::signature(line.text) => return Ok(true),
            Some(_) => {}
            None => break,
        }
    }
    Ok(false)
}

/// Fills titles that a file does not give itself from the deck; how many.
pub(crate) fn fill_titles(file: &mut SolverFile, deck: &Deck) -> usize {
    fill_entity_titles(&file.section, &mut file.entities, deck)
}

/// The same for the entities of a section.
pub(crate) fn fill_entity_titles(section: &str, entities: &mut [Entity], deck: &Deck) -> usize {
    let list = match section.split('/').next().unwrap_or_default() {
        "nodout" => &deck.history_nodes,
        "matsum" => &deck.parts,
        "rcforc" | "sleout" => &deck.contacts,
        "rwforc" => &deck.rigid_walls,
        _ => return 0,
    };
    let titles: HashMap<i64, &String> =
        list.iter().rev().filter_map(|of| Some((of.id?, of.title.as_ref()?))).collect();
    let mut filled = 0;
    for Entity { id, title } in entities.iter_mut().filter(|e| e.title.is_none()) {
        if let Some(found) = titles.get(&id.id) {
            *title = Some((*found).clone());
            filled += 1;
        }
    }
    filled
}
