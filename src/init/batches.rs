//! A source read in pieces, so that a file of thousands of nodes is never held as a whole.

use super::left_out::Reason;
use super::sources::Source;
use crate::solver::{SolverFile, WantedId};

/// Values that are held at once: 128 MB.
const MOST_VALUES: usize = 16_000_000;

/// A source's histories, a bounded number of entities at a time.
pub(super) struct HistoryBatches<'a> {
    source: &'a Source,
    components: Vec<&'a str>,
    /// Ids of each piece; one piece of `None` is the whole.
    ids: Vec<Option<Vec<WantedId>>>,
    /// The whole, where it is one piece: read once.
    held: Option<SolverFile>,
}

impl<'a> HistoryBatches<'a> {
    pub(super) fn new(source: &'a Source, components: Vec<&'a str>) -> Self {
        let values_of_one = (source.states * components.len()).max(1);
        let at_once = (MOST_VALUES / values_of_one).max(1);
        let mut all: Vec<i64> = source.entities.iter().map(|entity| entity.id.id).collect();
        all.sort_unstable();
        all.dedup();
        let ids = if all.len() <= at_once {
            vec![None]
        } else {
            all.chunks(at_once)
                .map(|ids| Some(ids.iter().map(|&id| WantedId { id, side: None }).collect()))
                .collect()
        };
        Self { source, components, ids, held: None }
    }

    /// Shows every piece to `look`, in the order of the ids.
    pub(super) fn each(&mut self, look: &mut dyn FnMut(&SolverFile)) -> Result<(), Reason> {
        if let Some(held) = &self.held {
            look(held);
            return Ok(());
        }
        for ids in &self.ids {
            let piece = self.source.read(ids.clone(), &self.components)?;
            look(&piece);
            if ids.is_none() {
                self.held = Some(piece);
            }
        }
        Ok(())
    }
}
