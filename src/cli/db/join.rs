//! `crumple db merge` and `copy`: databases joined, cases copied between groups and databases.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::curate::{self, Joined, JoinedCase, OnConflict};
use crate::words::counted;

use super::super::arguments::named;
use super::{Chosen, CommandResult, GlobalOptions, usage};

/// What happens to a case whose name another curve has, and whether anything is written.
#[derive(clap::Args)]
struct JoinOptions {
    /// Rename a new case whose name is taken by a different curve, such as 36kmh_2
    #[arg(long, conflicts_with = "replace")]
    rename: bool,
    /// Replace a different curve of the same name with the new case
    #[arg(long)]
    replace: bool,
    /// Only show what would be done
    #[arg(long)]
    dry_run: bool,
}

impl JoinOptions {
    fn on_conflict(&self) -> OnConflict {
        match (self.rename, self.replace) {
            (true, _) => OnConflict::Rename,
            (_, true) => OnConflict::Replace,
            _ => OnConflict::Refuse,
        }
    }
}

/// Databases, and where they are joined.
#[derive(clap::Args)]
pub(super) struct MergeArgs {
    /// Curve databases; later ones are joined to earlier ones, and all to -o if that is one of them
    #[arg(required = true, num_args = 2..)]
    databases: Vec<PathBuf>,
    /// Database to write: a new file, or one of those that are joined
    #[arg(short, long, value_parser = named())]
    output: PathBuf,
    #[command(flatten)]
    how: JoinOptions,
}

pub(super) fn merge(args: &MergeArgs, options: GlobalOptions) -> CommandResult {
    let joined =
        curate::merge(&args.databases, &args.output, args.how.on_conflict(), args.how.dry_run)?;
    report(&joined, &args.output, args.how.dry_run, options)
}

/// Cases, and where they are copied.
#[derive(clap::Args)]
pub(super) struct CopyArgs {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Database to copy to; created if it does not exist [default: the same]
    #[arg(long, value_name = "DATABASE", value_parser = named())]
    to: Option<PathBuf>,
    /// Group to copy to [default: the case's own]
    #[arg(long, value_name = "GROUP")]
    to_group: Option<String>,
    #[command(flatten)]
    how: JoinOptions,
}

pub(super) fn copy(args: &CopyArgs, options: GlobalOptions) -> CommandResult {
    if args.to.is_none() && args.to_group.is_none() {
        return usage("name the destination with --to-group, --to (another database) or both");
    }
    let selection = args.chosen.some("copied")?;
    let target = (args.to.as_deref(), args.to_group.as_deref());
    let (on_conflict, dry_run) = (args.how.on_conflict(), args.how.dry_run);
    let joined = curate::copy(&args.database, &selection, target, on_conflict, dry_run)?;
    let output = args.to.as_deref().unwrap_or(&args.database);
    report(&joined, output, args.how.dry_run, options)
}

fn report(joined: &Joined, path: &Path, dry_run: bool, options: GlobalOptions) -> CommandResult {
    let outcome = options.warn_all(joined.not_taken.iter().map(|(from, items)| {
        let from = from.display();
        format!("{from} holds objects that crumple did not write and does not copy: {items}")
    }));
    let database = path.display().to_string();
    let Joined { added, equal, renamed, replaced, .. } = joined;
    let document =
        document! { database: &database, #[serde(flatten)] joined: joined, dry_run: dry_run };
    options.show(&document, |out| {
        print_together(out, "added", added)?;
        let (same, other): (Vec<&JoinedCase>, Vec<&JoinedCase>) =
            equal.iter().partition(|case| case.now.as_ref() == Some(&case.case));
        print_together(out, "already present:", same)?;
        for (what, cases) in [
            ("already present:", other),
            ("renamed", renamed.iter().collect()),
            ("replaced", replaced.iter().collect()),
        ] {
            for JoinedCase { from, case, now } in cases {
                let now = now.as_ref().map_or(String::new(), |now| format!(" as {now}"));
                writeln!(out, "{what} {case}{now} (of {from})")?;
            }
        }
        for edited in &joined.edited {
            let edited = edited.display();
            writeln!(out, "note: another program has edited {edited}: soft and external links in it, if any, are not copied")?;
        }
        writeln!(
            out,
            "{} {database}: {} added, {} replaced, {} already present",
            if dry_run { "would write" } else { "wrote" },
            counted(added.len() + renamed.len(), "case"),
            replaced.len(),
            equal.len()
        )
    })?;
    Ok(outcome)
}

/// A line for the cases of each group of each database.
fn print_together<'a>(
    out: &mut dyn Write,
    what: &str,
    cases: impl IntoIterator<Item = &'a JoinedCase>,
) -> io::Result<()> {
    let mut groups: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for JoinedCase { from, case, .. } in cases {
        let group = case.split('/').next().unwrap_or_default();
        *groups.entry((from, group)).or_default() += 1;
    }
    for ((from, group), count) in groups {
        writeln!(out, "{what} {} of group {group} (of {from})", counted(count, "case"))?;
    }
    Ok(())
}
