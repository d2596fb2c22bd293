//! `crumple db rm`, `rename`, `tag` and `note`: cases removed, cases and groups renamed, tags and notes on cases.

use std::path::{Path, PathBuf};

use super::list::{case_row, print_group};
use super::{Chosen, CommandResult, GlobalOptions, usage};
use crate::curate::{self, Labels, Selection};
use crate::database::CasePath;
use crate::words::counted;

/// A database, and which of its cases are removed.
#[derive(clap::Args)]
pub(super) struct RemoveArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Only show what would be removed
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn remove(args: &RemoveArgs, options: GlobalOptions) -> CommandResult {
    let selection = args.chosen.some("removed")?;
    let cases = curate::remove(&args.database, &selection, args.dry_run)?;
    let database = args.database.display().to_string();
    let removed = cases.iter().map(|case| {
        document! { group: &case.id.group, #[serde(flatten)] row: case_row(case) }
    });
    let document = document! {
        database: &database,
        removed: removed.collect::<Vec<_>>(),
        dry_run: args.dry_run,
    };
    options.show(&document, |out| {
        for cases in cases.chunk_by(|a, b| a.id.group == b.id.group) {
            print_group(out, &cases[0].id.group, &cases.iter().collect::<Vec<_>>())?;
        }
        let did = if args.dry_run { "would remove" } else { "removed" };
        writeln!(out, "{did} {} from {database}", counted(cases.len(), "case"))
    })
}

/// A database, and what of it is called how.
#[derive(clap::Args)]
pub(super) struct RenameArgs {
    /// Curve database
    database: PathBuf,
    /// Group that is renamed, or the group of the case
    #[arg(long, required_unless_present = "case")]
    group: Option<String>,
    /// Case that is renamed, or GROUP/CASE
    #[arg(long)]
    case: Option<String>,
    /// New name
    #[arg(long, value_name = "NAME")]
    to: String,
}

pub(super) fn rename(args: &RenameArgs, options: GlobalOptions) -> CommandResult {
    let database = args.database.display().to_string();
    let (from, to, cases) = match (&args.case, &args.group) {
        (Some(case), group) => {
            let group = group.as_deref();
            let (from, to) = curate::rename_case(&args.database, group, case, &args.to)?;
            (from.to_string(), to.to_string(), vec![to.to_string()])
        }
        (None, group) => {
            let group = group.clone().unwrap_or_default();
            let cases = curate::rename_group(&args.database, &group, &args.to)?;
            (group, args.to.clone(), cases.iter().map(ToString::to_string).collect())
        }
    };
    let document = document! { database: &database, from: &from, to: &to, cases: &cases };
    let count = counted(cases.len(), "case");
    options.show(&document, |out| writeln!(out, "renamed {from} to {to} in {database} ({count})"))
}

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
    })
}
