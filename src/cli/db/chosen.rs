//! Options that choose cases of a database.

use crate::curate::{Selection, SpeedRange};

use super::{Failure, usage};

/// Which cases; every option narrows the choice.
#[derive(clap::Args)]
pub(super) struct Chosen {
    /// Group; may be repeated [default: all]
    #[arg(long, help_heading = "Which cases")]
    group: Vec<String>,
    /// Case of the group, or GROUP/CASE; may be repeated [default: all]
    #[arg(long, help_heading = "Which cases")]
    case: Vec<String>,
    /// Impact speeds: 20km/h..40km/h, ..40km/h, 20km/h.. or 36km/h
    #[arg(long, value_name = "RANGE", allow_hyphen_values = true, help_heading = "Which cases")]
    speed: Option<SpeedRange>,
    /// Tag that the cases have, or one of several; may be repeated
    #[arg(long, help_heading = "Which cases")]
    tag: Vec<String>,
}

impl Chosen {
    pub(super) fn selection(&self) -> Selection {
        Selection {
            groups: self.group.clone(),
            cases: self.case.clone(),
            speed: self.speed,
            tags: self.tag.clone(),
        }
    }

    /// The same, which may not be everything by mistake; `what` is what happens to the cases.
    pub(super) fn some(&self, what: &str) -> Result<Selection, Failure> {
        let selection = self.selection();
        if selection.is_all() {
            usage(format!("choose the cases to be {what} with --group, --case, --speed or --tag"))
        } else {
            Ok(selection)
        }
    }
}
