//! `crumple compare`: FE against the methods at a left-out speed.

use std::io::{self, Write};
use std::path::PathBuf;

use crumple::compare::{self, Comparison};
use crumple::database::Database;
use crumple::unit::km_per_h;

use super::arguments;
use super::output;
use super::{CommandResult, Manners, Outcome};

/// Compare FE with FDRM and DDTCM at a left-out speed, each in the same multi-body model
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple compare curves.h5 --group lead-car-wall --speed 48km/h
  crumple compare curves.h5 --group lead-car-wall --speed 48km/h --json
Rows: fe and fe_body are FE's own curves in the one-mass model, the floors for contact forces and
for body forces; fdrm is the FE curve of the nearest other speed; ddtcm the reference method's
forest and spline; best the model that leaving speeds out chooses among the others, by its body
force. Errors are sum|p-r|/sum|r| from contact to 30 ms after FE's largest crush; accelerations
are filtered with CFC 60, in brackets not.")]
pub struct Args {
    /// Curve database
    database: PathBuf,
    /// Group to compare in
    #[arg(long)]
    group: String,
    /// Speed to leave out, with its unit
    #[arg(long, value_parser = arguments::speed, allow_hyphen_values = true)]
    speed: f64,
    /// Seed of the forest
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    let database = Database::read(&args.database)?;
    let cases = database.group(&args.database, &args.group)?;
    let comparison = compare::compare(&args.group, cases, args.speed, args.seed)?;
    if !comparison.inner {
        manners.warn("the left-out speed is an end of the range: the forest extrapolates");
    }
    if manners.json {
        output::print_json(&comparison)?;
    } else {
        output::print(|out| print(out, &comparison))?;
    }
    Ok(if comparison.inner { Outcome::Clean } else { Outcome::Warned })
}

fn print(out: &mut dyn Write, comparison: &Comparison) -> io::Result<()> {
    writeln!(
        out,
        "{} at {} ({}), left out; FE: peak force {:.3} MN, max crush {:.4} m",
        comparison.group,
        km_per_h(comparison.speed_m_per_s),
        comparison.speed_kind.name(),
        comparison.reference_peak_force_n / 1e6,
        comparison.reference_max_crush_m
    )?;
    let percent = |error: f64| format!("{:.2} %", error * 100.0);
    let rows: Vec<Vec<String>> = comparison
        .rows
        .iter()
        .map(|row| {
            vec![
                row.method.to_string(),
                row.curve.clone(),
                percent(row.velocity_l1),
                format!(
                    "{} ({:.2})",
                    percent(row.acceleration_l1),
                    row.acceleration_unfiltered_l1 * 100.0
                ),
                percent(row.force_l1),
                format!("{:.3} MN", row.peak_force_n / 1e6),
                format!("{:.4} m", row.max_crush_m),
                format!("{:.2} ms", row.curve_time_s * 1e3),
                format!("{:.2} ms", row.simulation_time_s * 1e3),
            ]
        })
        .collect();
    let heading = [
        "method",
        "curve",
        "velocity",
        "acceleration",
        "force",
        "peak force",
        "max crush",
        "fit+predict",
        "simulation",
    ];
    output::table(out, &heading, &rows)
}
