//! Why a file gives no histories, or not those that were asked for.

use crate::guess;
use std::io;
use std::path::{Path, PathBuf};

use super::format::entity_word;
use super::{Entity, NoDataReason, Selection, SolverFile, WantedId};

crate::error::passes_on!(ReadError => SolverFile);

/// Why a file could not be read at all, or not what was asked of it.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// No reader knows the file.
    #[error("{path}: {looks_like}: the readers take {known}")]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What it looks like.
        looks_like: String,
        /// The formats that can be read, as a list.
        known: String,
    },
    /// The file is not of the format that was named.
    #[error("{path}: this is not a {format}: it looks like a {looks_like}, read it as that")]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// The format that was named.
        format: String,
        /// The format that it looks like.
        looks_like: &'static str,
    },
    /// The path is a folder.
    #[error("{path}: this is a folder: name a file in it{files}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Files in it that can be read, as words; empty if there are none.
        files: String,
    },
    /// The file is a keyword deck.
    #[error(
        "{path}: this is a keyword deck, which holds no histories; crumple inspect shows what it says of its run"
    )]
    Deck {
        /// The deck.
        path: PathBuf,
    },
    /// The file has several sections, and none was selected.
    #[error(
        "{path}: it has several sections: select one of {known} (with --section; in a recipe the section's name is the file's)"
    )]
    SeveralSections {
        /// The file.
        path: PathBuf,
        /// Its sections, as a list.
        known: String,
    },
    /// The file has no such section.
    #[error(
        "{path}: it has no section \"{section}\": it has {known}{}",
        guess::hint(section, known)
    )]
    NoSuchSection {
        /// The file.
        path: PathBuf,
        /// The section that was asked for.
        section: String,
        /// Its sections, as a list.
        known: String,
    },
    /// No reader has such a name.
    #[error("there is no format \"{name}\": the readers take {known}{}", guess::hint(name, known))]
    NoSuchFormat {
        /// The name that was given.
        name: String,
        /// The formats that can be read, as a list.
        known: String,
    },
    /// The file has no such node, wall, interface or other entity.
    #[error("{path}: {format} has no {what} {id}: {near}", what = entity_word(format))]
    NoSuchEntity {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: String,
        /// What was asked for.
        id: WantedId,
        /// What the file has instead, in words.
        near: String,
    },
    /// The contact is of a kind that LS-DYNA prints no forces for.
    #[error(
        "{path}: interface {id} is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer ({with_data})"
    )]
    SingleSurface {
        /// The file.
        path: PathBuf,
        /// Number of the interface.
        id: i64,
        /// Interfaces that have data, as a list.
        with_data: String,
    },
    /// The file has no such component.
    #[error(
        "{path}: {format} has no component \"{component}\": it has {known}{}",
        guess::hint(component, known)
    )]
    NoSuchComponent {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: String,
        /// The component that was asked for.
        component: String,
        /// Its components, as a list.
        known: String,
    },
}

/// Holds every selected id and component against what the file has.
pub(super) fn check_selection(
    path: &Path,
    file: &SolverFile,
    selection: &Selection,
) -> Result<(), ReadError> {
    for wanted in selection.ids.iter().flatten() {
        if file.entities.iter().any(|e| wanted.matches(e.id)) {
            continue;
        }
        let single_surface = file
            .without_data
            .iter()
            .any(|w| w.id == wanted.id && w.reason == NoDataReason::SingleSurfaceContact);
        if single_surface {
            return Err(ReadError::SingleSurface {
                path: path.into(),
                id: wanted.id,
                with_data: near_ids(file, wanted.id),
            });
        }
        return Err(ReadError::NoSuchEntity {
            path: path.into(),
            format: file.section.clone(),
            id: *wanted,
            near: near_ids(file, wanted.id),
        });
    }
    for wanted in selection.components.iter().flatten() {
        if !file.components.iter().any(|c| **c == **wanted) {
            return Err(ReadError::NoSuchComponent {
                path: path.into(),
                format: file.section.clone(),
                component: wanted.clone(),
                known: if file.components.is_empty() {
                    "none, because the file holds no complete state".into()
                } else {
                    file.components.join(", ")
                },
            });
        }
    }
    Ok(())
}

/// The ids nearest to one that is missing, with titles: what the user may have meant.
fn near_ids(file: &SolverFile, id: i64) -> String {
    const SHOWN: usize = 8;
    if file.entities.is_empty() && file.time.is_empty() {
        return "it holds no complete state".into();
    }
    if file.entities.is_empty() {
        return "it holds no ids".into();
    }
    let mut entities: Vec<&Entity> = file.entities.iter().collect();
    entities.sort_by_key(|e| (e.id.id.abs_diff(id), e.id));
    let shown: Vec<String> = entities
        .iter()
        .take(SHOWN)
        .map(|e| match &e.title {
            Some(title) => format!("{} \"{title}\"", e.id),
            None => e.id.to_string(),
        })
        .collect();
    let ids: Vec<String> = entities.iter().map(|e| e.id.to_string()).collect();
    let ids = ids.iter().map(String::as_str).filter(|known| *known != id.to_string());
    let guess = guess::nearest(&id.to_string(), ids);
    let guess = guess.map_or(String::new(), |guess| format!("; did you mean {guess}?"));
    let rest = file.entities.len().saturating_sub(SHOWN);
    if rest > 0 {
        format!("the nearest of its ids are {} and {rest} more{guess}", shown.join(", "))
    } else {
        format!("it has {}{guess}", shown.join(", "))
    }
}
