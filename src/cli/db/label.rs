//! `crumple db tag` and `note`: users' tags and notes on cases.

use std::path::{Path, PathBuf};

use crate::curate::{self, Labels, Selection};
use crate::database::CasePath;
use crate::plural::counted;

use super::chosen::Chosen;
use super::{CommandResult, GlobalOptions, Outcome, usage};

/// Cases, and the tags that they get and lose.
#[derive(clap::Args)]
pub(super) struct TagArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Tag to add; repeated or separated by commas
    #[arg(long, value_name = "TAG", value_delimiter = ',')]
    add: Vec<String>,
    /// Tag to remove; repeated or separated by commas
    #[arg(long, value_name = "TAG", value_delimiter = ',')]
    remove: Vec<String>,
    /// Remove all tags that they have
    #[arg(long, conflicts_with = "remove")]
    clear: bool,
}

pub(super) fn tag(args: &TagArgs, options: GlobalOptions) -> CommandResult {
    let labels = Labels {
        add_tags: args.add.clone(),
        remove_tags: args.remove.clone(),
        clear_tags: args.clear,
        ..Labels::default()
    };
    run(&args.database, &args.chosen.some("tagged")?, &labels, options)
}

/// Cases, and the notes that they get and lose.
#[derive(clap::Args)]
pub(super) struct NoteArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Note to add; may be repeated
    #[arg(long, value_name = "TEXT")]
    add: Vec<String>,
    /// Note to remove, word for word; may be repeated
    #[arg(long, value_name = "TEXT")]
    remove: Vec<String>,
    /// Remove all notes that were added
    #[arg(long, conflicts_with = "remove")]
    clear: bool,
}

pub(super) fn note(args: &NoteArgs, options: GlobalOptions) -> CommandResult {
    let labels = Labels {
        add_notes: args.add.clone(),
        remove_notes: args.remove.clone(),
        clear_notes: args.clear,
        ..Labels::default()
    };
    run(&args.database, &args.chosen.some("noted on")?, &labels, options)
}

fn run(
    database: &Path,
    selection: &Selection,
    labels: &Labels,
    options: GlobalOptions,
) -> CommandResult {
    if *labels == Labels::default() {
        return usage("nothing to do: give --add, --remove or --clear");
    }
    let cases = curate::label(database, selection, labels)?;
    let database = database.display().to_string();
    let labelled = cases.iter().map(|case| {
        document! {
            group: &case.id.group,
            case: &case.id.name,
            tags: &case.provenance.tags,
            user_notes: &case.provenance.user_notes,
        }
    });
    let document = document! { database: &database, cases: labelled.collect::<Vec<_>>() };
    options.show(&document, |out| {
        for case in &cases {
            let tags = if case.provenance.tags.is_empty() {
                "no tags".into()
            } else {
                case.provenance.tags.join(", ")
            };
            writeln!(out, "{}: {tags}", CasePath::of(case))?;
            for note in &case.provenance.user_notes {
                writeln!(out, "  note: {note}")?;
            }
        }
        writeln!(out, "wrote {database} ({})", counted(cases.len(), "case"))
    })?;
    Ok(Outcome::Clean)
}
