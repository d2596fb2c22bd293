//! Selections checked against the content of a file.
//!
//! Errors name a key that callers can handle: `format` if no reader knows the file, `deck` for a
//! keyword deck, `ids[k]` and `component` for what was selected and is missing.

use std::path::Path;

use super::detect::entity_word;
use super::{Entity, NoDataReason, Selection, SolverFile};
use crate::error::{Error, KeyPath, error};
use crate::guess;

/// Checks every selected id and component against the file.
pub(super) fn check_selection(
    path: &Path,
    file: &SolverFile,
    selection: &Selection,
) -> Result<(), Error> {
    let (path, format) = (path.display(), &file.section);
    for (k, wanted) in selection.ids.iter().flatten().enumerate() {
        if file.entities.iter().any(|e| wanted.matches(e.id)) {
            continue;
        }
        let single_surface = file
            .without_data
            .iter()
            .any(|w| w.id == wanted.id && w.reason == NoDataReason::SingleSurfaceContact);
        let (id, near) = (wanted.id, near_ids(file, wanted.id));
        let missing = if single_surface {
            error!(
                SolverFile,
                "{path}: interface {id} is a single-surface contact, for which LS-DYNA prints no resultants: ask for a two-sided contact or a force transducer ({near})"
            )
        } else {
            error!(SolverFile, "{path}: {format} has no {} {wanted}: {near}", entity_word(format))
        };
        return Err(missing.at(KeyPath::of("ids").item(k)));
    }
    for wanted in selection.components.iter().flatten() {
        if !file.components.iter().any(|c| **c == **wanted) {
            let known = if file.components.is_empty() {
                "none, because the file holds no complete state".into()
            } else {
                file.components.join(", ")
            };
            return Err(no_component(path, format, wanted, &known));
        }
    }
    Ok(())
}

/// The error of a component that a file does not have.
pub(crate) fn no_component(
    path: impl std::fmt::Display,
    format: &str,
    component: &str,
    known: &str,
) -> Error {
    let hint = guess::hint(component, known);
    error!(SolverFile at "component", "{path}: {format} has no component \"{component}\": it has {known}{hint}")
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
