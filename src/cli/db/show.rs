//! `crumple db show`: cases with their curves, or side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;

use crate::curate::{self, Difference, Selection};
use crate::curve::{Case, Parameter};
use crate::database::Database;
use crate::table::Table;
use crate::unit::{Shown, km_per_h};

use super::super::predict::draw_curve;
use super::list::{full_case, print_group};
use super::{Chosen, CommandResult, Failure, GlobalOptions, Outcome, output, usage};

/// A database, and which of its cases are shown how.
#[derive(clap::Args)]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    #[command(flatten)]
    chosen: Chosen,
    /// Compare the cases with the first of them, in the order of --case
    #[arg(long)]
    compare: bool,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let selection = args.chosen.selection();
    if let Some((group, name)) = selection.only().filter(|_| !args.compare) {
        let case = Database::read_case(&args.database, group, name)?;
        return show(&[&case], options);
    }
    let database = Database::read(&args.database)?;
    if args.compare {
        return compare(&args.in_order(&selection, &database)?, options);
    }
    let cases: Vec<&Case> = if selection.is_all() {
        database.all().collect()
    } else {
        selection.find(&args.database, &database)?
    };
    show(&cases, options)
}

impl Args {
    /// The chosen cases, those that are named in the order of their names.
    fn in_order<'a>(
        &self,
        selection: &Selection,
        database: &'a Database,
    ) -> Result<Vec<&'a Case>, Failure> {
        if selection.cases.is_empty() {
            return Ok(selection.find(&self.database, database)?);
        }
        let mut cases: Vec<&Case> = Vec::new();
        for name in &selection.cases {
            let one = Selection { cases: vec![name.clone()], ..selection.clone() };
            cases.extend(one.find(&self.database, database)?);
        }
        Ok(cases)
    }
}

fn show(cases: &[&Case], options: GlobalOptions) -> CommandResult {
    if options.json {
        let mut groups: BTreeMap<&str, Vec<_>> = BTreeMap::new();
        for case in cases {
            groups.entry(&case.id.group).or_default().push(full_case(case)?);
        }
        output::print_json(&document! { groups: groups })?;
    } else {
        options.print(|out| cases.iter().try_for_each(|case| print_case(out, case)))?;
    }
    Ok(Outcome::warned_if(cases.iter().any(|case| !case.quality.warnings.is_empty())))
}

fn print_case(out: &mut dyn Write, case: &Case) -> io::Result<()> {
    print_group(out, &case.id.group, &[case])?;
    writeln!(out)?;
    if let Some(built) = &case.provenance.built_utc {
        writeln!(out, "built {built}")?;
    }
    for source in &case.provenance.sources {
        writeln!(
            out,
            "from {} ({} bytes, blake3 {}…{})",
            source.absolute_path.as_ref().unwrap_or(&source.path),
            source.size_bytes,
            &source.blake3.get(..12).unwrap_or(&source.blake3),
            source.solver.as_deref().map_or(String::new(), |solver| {
                format!(", {solver} {}", source.version.as_deref().unwrap_or("of unknown version"))
            })
        )?;
    }
    for (name, value) in &case.conditions.parameters {
        let value: &dyn Display = match value {
            Parameter::Number(value) => value,
            Parameter::Category(value) => value,
        };
        writeln!(out, "parameter: {name} = {value}")?;
    }
    for note in &case.quality.notes {
        writeln!(out, "note: {note}")?;
    }
    for warning in &case.quality.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    for note in &case.provenance.user_notes {
        writeln!(out, "user's note: {note}")?;
    }
    writeln!(out, "\nforce [MN] over deflection [m]")?;
    let (d, f) = (case.curves.original.deflection_m(), case.curves.original.force_n());
    draw_curve(out, d, f)?;
    writeln!(out)
}

fn compare(cases: &[&Case], options: GlobalOptions) -> CommandResult {
    if cases.len() < 2 {
        return usage(
            "--compare needs at least two cases: name each with --case, or choose them with --group, --speed or --tag",
        );
    }
    let Some(comparison) = curate::compare(cases)? else { return Ok(Outcome::Clean) };
    let is_one_group = cases.iter().all(|case| case.id.group == cases[0].id.group);
    let name = |case: &Difference| {
        if is_one_group { case.case.clone() } else { format!("{}/{}", case.group, case.case) }
    };
    let corner = if is_one_group { &cases[0].id.group } else { "" };
    let parameters: BTreeSet<&str> =
        comparison.cases.iter().flat_map(|case| case.parameters.keys()).map(|k| &**k).collect();
    let rows = QUANTITIES.map(Ok).into_iter().chain(parameters.into_iter().map(Err));
    let names =
        Table::of(rows).column(corner, |row| row.map_or_else(|name| name, |(name, _)| name));
    let table = comparison.cases.iter().enumerate().fold(names, |table, (k, case)| {
        table.column(name(case), |row| match row {
            Ok((_, cell)) => cell(case, k == 0),
            Err(name) => case.parameters.get(*name).map_or("-".into(), ToString::to_string),
        })
    });
    options.show(&comparison, |out| output::table(out, table))
}

/// A quantity's name, and its cell for a case; the reference has no difference.
type Quantity = (&'static str, fn(&Difference, bool) -> String);

const QUANTITIES: [Quantity; 7] = [
    ("speed", |c, first| {
        let speed = format!("{} ({})", km_per_h(c.speed_m_per_s), c.speed_kind.name());
        with_difference(speed, c.speed_difference, first)
    }),
    ("mass", |c, first| with_difference(Shown::one_mass(c.mass_kg), c.mass_difference, first)),
    ("max crush", |c, first| {
        let crush = format!("{:.4} m", c.max_deflection_m);
        with_difference(crush, c.max_deflection_difference, first)
    }),
    ("energy", |c, first| with_difference(Shown::one_energy(c.work_j), c.work_difference, first)),
    ("peak force", |c, first| {
        with_difference(Shown::one_force(c.peak_force_n), c.peak_force_difference, first)
    }),
    ("force L1", |c, first| match c.force_l1.filter(|_| !first) {
        Some(l1) => format!("{:.1} %", l1 * 100.0),
        None => "-".into(),
    }),
    (
        "up to",
        |c, first| if first { "-".into() } else { format!("{:.4} m", c.common_deflection_m) },
    ),
];

fn with_difference(value: String, difference: f64, is_reference: bool) -> String {
    if is_reference { value } else { format!("{value} {:>+7.1} %", difference * 100.0) }
}
