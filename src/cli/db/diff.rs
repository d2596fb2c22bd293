//! `crumple db diff`: what of a database a new one has added, removed and changed.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::super::{CommandResult, GlobalOptions, Outcome, output};
use crate::curate::{self, Difference};
use crate::curve::{Case, Parameter};
use crate::database::Database;
use crate::table::Table;
use crate::unit::km_per_h;
use crate::words::counted;

#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database before
    old: PathBuf,
    /// Curve database after
    new: PathBuf,
    /// Group to compare; may be repeated [default: all]
    #[arg(long)]
    group: Vec<String>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (old, new) = (Database::read(&args.old)?, Database::read(&args.new)?);
    for group in &args.group {
        // One of both may have gained or lost it.
        if old.cases(group).is_empty() {
            new.group(&args.new, group)?;
        }
    }
    let is_meant = |case: &&Case| args.group.is_empty() || args.group.contains(&case.id.group);
    let name = |case: &Case| format!("{}/{}", case.id.group, case.id.name);
    let lacks = |of: &Database, other: &Database| -> Vec<String> {
        of.all().filter(is_meant).filter(|case| find(other, case).is_none()).map(name).collect()
    };
    let (removed, added) = (lacks(&old, &new), lacks(&new, &old));
    let (mut changed, mut same): (Vec<(String, Difference)>, usize) = (Vec::new(), 0);
    for before in old.all().filter(is_meant) {
        let Some(after) = find(&new, before) else { continue };
        if before.conditions == after.conditions && before.curves == after.curves {
            same += 1;
        } else if let Some(mut compared) = curate::compare(&[before, after])? {
            changed.extend(compared.cases.pop().map(|difference| (name(before), difference)));
        }
    }
    // What may be all that has changed.
    let mut parameters = Vec::new();
    for before in old.all().filter(is_meant) {
        let Some(after) = find(&new, before) else { continue };
        let (was, is) = (&before.conditions.parameters, &after.conditions.parameters);
        let names: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
        let differ =
            names.into_iter().filter(|parameter| was.get(*parameter) != is.get(*parameter));
        parameters.extend(differ.map(|k| (name(before), k.as_str(), was.get(k), is.get(k))));
    }
    let differences: Vec<&Difference> = changed.iter().map(|(_, difference)| difference).collect();
    let of_parameters = parameters.iter().map(|(case, parameter, before, after)| {
        document! { case: case, parameter: parameter, before: before, after: after }
    });
    let document = document! {
        added: &added,
        removed: &removed,
        changed: &differences,
        parameters: of_parameters.collect::<Vec<_>>(),
        unchanged: same,
    };
    options.show(&document, |out| {
        for (what, names) in [("added", &added), ("removed", &removed)] {
            names.iter().try_for_each(|name| writeln!(out, "{what}: {name}"))?;
        }
        if !changed.is_empty() {
            let percent = |share: f64| format!("{:+.2} %", 100.0 * share);
            let table = Table::of(&changed)
                .column("changed", |(name, _)| name)
                .column("speed", |(_, of)| km_per_h(of.speed_m_per_s))
                .column("mass", |(_, of)| percent(of.mass_difference))
                .column("max crush", |(_, of)| percent(of.max_deflection_difference))
                .column("energy", |(_, of)| percent(of.work_difference))
                .column("peak force", |(_, of)| percent(of.peak_force_difference))
                .column("force L1", |(_, of)| {
                    of.force_l1.map_or("-".into(), |l1| format!("{:.2} %", 100.0 * l1))
                });
            output::table(out, table)?;
            for (name, parameter, was, is) in &parameters {
                writeln!(out, "{name}: {parameter} {} -> {}", shown(was), shown(is))?;
            }
        }
        writeln!(
            out,
            "{} added, {} removed, {} changed, {} unchanged",
            counted(added.len(), "case"),
            removed.len(),
            changed.len(),
            same
        )
    })?;
    Ok(Outcome::Clean)
}

/// A parameter's value; `-` where the case has none.
fn shown(value: &Option<&Parameter>) -> String {
    value.map_or("-".into(), Parameter::to_string)
}

/// The case of the same group and name.
fn find<'a>(database: &'a Database, case: &Case) -> Option<&'a Case> {
    database.cases(&case.id.group).iter().find(|other| other.id.name == case.id.name)
}
