//! `crumple demo`: the whole flow on the bundled FE runs.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use crumple::build::{self, RunOutcome};
use crumple::compare::{self, Comparison};
use crumple::curve::Case;
use crumple::database::Database;
use crumple::dataset::TrainingSet;
use crumple::export;
use crumple::file::write_whole;
use crumple::multibody::{Run, simulate};
use crumple::scenario;
use crumple::surrogate::forest::ForestOptions;
use crumple::surrogate::max_crush::MaxCrushRule;
use crumple::surrogate::{Model, Options, PredictedCurve, Query, predict};
use crumple::unit::{M_PER_S_PER_KM_PER_H, km_per_h};
use include_dir::{Dir, include_dir};
use serde::Serialize;

use super::output;
use super::{CommandResult, Failure, Manners, Outcome, progress};

/// Run the whole flow on bundled FE runs: database, forest, prediction, MB run, exports
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple demo
  crumple demo -o somewhere")]
pub struct Args {
    /// Folder to write to
    #[arg(short, long, default_value = "crumple-demo")]
    output: PathBuf,
}

/// The FE runs, part of the program so that the demo needs no other file.
static FE_RUNS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/fixtures/fe");

/// The group that is trained, and a speed between its FE runs.
const GROUP: &str = "lead-car-wall";
const SPEED_M_PER_S: f64 = 50.0 * M_PER_S_PER_KM_PER_H;

const SCENARIO: &str = r#"# A lead car against a rigid wall at a speed for which there is no FE run.
[run]
duration = "300ms"
output_interval = "0.75ms"

[curves]
nose = { model = "lead.model" }

[[train]]
name = "A"
speed = "50km/h"
vehicles = [ { name = "A1", mass = "24t" } ]

[wall]

[contact]
curve = "nose"
"#;

#[derive(Serialize)]
struct Document {
    cases: Vec<CaseLine>,
    comparisons: Vec<Comparison>,
    prediction: Prediction,
    files: Vec<String>,
    seconds: f64,
}

#[derive(Serialize)]
struct CaseLine {
    group: String,
    speed_m_per_s: f64,
    #[serde(rename = "peak_force_N")]
    peak_force_n: f64,
    max_deflection_m: f64,
    work_over_energy: f64,
}

#[derive(Serialize)]
struct Prediction {
    speed_m_per_s: f64,
    #[serde(rename = "peak_force_N")]
    peak_force_n: f64,
    max_deflection_m: f64,
    energy_over_kinetic: f64,
    simulated_max_crush_m: f64,
    simulated_energy_error: f64,
}

/// What the flow makes on its way.
struct Flow<'a> {
    folder: &'a Path,
    bar: progress::Bar,
    files: Vec<PathBuf>,
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    let start = Instant::now();
    let mut flow = Flow {
        folder: &args.output,
        bar: progress::Bar::new(manners, "writing the FE runs"),
        files: Vec::new(),
    };
    flow.unpack()?;
    let database = flow.build()?;
    let comparisons = flow.compare(&database)?;
    let model = flow.train(&database)?;
    let curve = flow.predict(&model)?;
    let run = flow.simulate()?;
    let Flow { bar, files, .. } = flow;
    bar.end();
    let document = Document {
        cases: cases(&database).map(|(group, case)| case_line(group, case)).collect(),
        comparisons,
        prediction: Prediction {
            speed_m_per_s: curve.speed_m_per_s,
            peak_force_n: curve.force_n.iter().copied().fold(0.0, f64::max),
            max_deflection_m: curve.max_deflection_m,
            energy_over_kinetic: curve.provenance.energy_over_kinetic,
            simulated_max_crush_m: run.interfaces[0].max_deflection_m,
            simulated_energy_error: run.ledger.max_energy_error,
        },
        files: files.iter().map(|p| p.display().to_string()).collect(),
        seconds: start.elapsed().as_secs_f64(),
    };
    for warning in &curve.warnings {
        manners.warn(&warning.message);
    }
    if manners.json {
        output::print_json(&document)?;
    } else {
        output::print(|out| print(out, &document))?;
    }
    Ok(if curve.warnings.is_empty() { Outcome::Clean } else { Outcome::Warned })
}

impl Flow<'_> {
    fn path(&mut self, name: &str) -> PathBuf {
        let path = self.folder.join(name);
        if !self.files.contains(&path) {
            self.files.push(path.clone());
        }
        path
    }

    fn unpack(&mut self) -> Result<(), Failure> {
        let target = self.folder.join("fe");
        std::fs::create_dir_all(&target)?;
        FE_RUNS.extract(&target)?;
        Ok(())
    }

    fn build(&mut self) -> Result<Database, Failure> {
        let path = self.path("curves.h5");
        let mut database = Database::default();
        for group in FE_RUNS.dirs() {
            let manifest = self.folder.join("fe").join(group.path()).join("study.toml");
            let report = build::build(&manifest, &path, |run| self.bar.step(run))?;
            for (_, outcome) in report.runs {
                if let RunOutcome::Failed { reason, .. } = outcome {
                    return Err(reason.into());
                }
            }
            database = report.database;
        }
        Ok(database)
    }

    /// Leaves out every inner speed of every group.
    fn compare(&self, database: &Database) -> Result<Vec<Comparison>, Failure> {
        let mut comparisons = Vec::new();
        for group in database.groups() {
            let cases = database.cases(group);
            for case in &cases[1..cases.len() - 1] {
                self.bar.step(&format!("{group} without {}", case.name));
                comparisons.push(compare::compare(group, cases, case.speed.m_per_s, 0)?);
            }
        }
        Ok(comparisons)
    }

    fn train(&mut self, database: &Database) -> Result<Model, Failure> {
        self.bar.step("training the forest");
        let set = TrainingSet::new(GROUP, database.cases(GROUP))?;
        let model = Model::fit(&set, Options::Forest(ForestOptions::default()))?;
        model.write(&self.path("lead.model"))?;
        Ok(model)
    }

    fn predict(&mut self, model: &Model) -> Result<PredictedCurve, Failure> {
        let query =
            Query { speed_m_per_s: SPEED_M_PER_S, mass_kg: None, rule: MaxCrushRule::Monotone };
        let curve = predict(model, &query)?;
        for name in ["lead50.json", "lead50.csv", "lead50.k"] {
            let path = self.path(name);
            let bytes = export::by_extension(&path)?.encode(&curve, &export::Options::default())?;
            write_whole(&path, &bytes)?;
        }
        Ok(curve)
    }

    fn simulate(&mut self) -> Result<Run, Failure> {
        let path = self.path("scenario.toml");
        write_whole(&path, SCENARIO.as_bytes())?;
        let prepared = scenario::load(&path)?;
        Ok(simulate(&prepared.chain, &prepared.settings)?)
    }
}

fn cases(database: &Database) -> impl Iterator<Item = (&str, &Case)> {
    database.groups().flat_map(|g| database.cases(g).iter().map(move |c| (g, c)))
}

fn case_line(group: &str, case: &Case) -> CaseLine {
    CaseLine {
        group: group.into(),
        speed_m_per_s: case.speed.m_per_s,
        peak_force_n: case.peak_force_n(),
        max_deflection_m: case.max_deflection_m(),
        work_over_energy: case.audit.ratio(),
    }
}

fn print(out: &mut dyn Write, document: &Document) -> io::Result<()> {
    let rows: Vec<Vec<String>> = document
        .cases
        .iter()
        .map(|case| {
            vec![
                case.group.clone(),
                km_per_h(case.speed_m_per_s),
                format!("{:.3} MN", case.peak_force_n / 1e6),
                format!("{:.4} m", case.max_deflection_m),
                format!("{:.4}", case.work_over_energy),
            ]
        })
        .collect();
    output::table(out, &["FE run", "speed", "peak force", "max crush", "W/E"], &rows)?;
    writeln!(out)?;
    let percent = |error: f64| format!("{:.1} %", error * 100.0);
    let rows: Vec<Vec<String>> = document
        .comparisons
        .iter()
        .map(|c| {
            let errors = c.rows.iter().flat_map(|r| [r.velocity_l1, r.acceleration_l1]);
            let label = [c.group.clone(), km_per_h(c.speed_m_per_s)];
            label.into_iter().chain(errors.map(percent)).collect()
        })
        .collect();
    let heading = ["left out", "speed", "FE curve v", "a", "FDRM v", "a", "forest v", "a"];
    output::table(out, &heading, &rows)?;
    let p = &document.prediction;
    writeln!(
        out,
        "\nerrors of velocity v and acceleration a in one multi-body model: sum|p-r|/sum|r| to 30 ms after max crush\n\
         {GROUP} at {} by the forest: peak force {:.3} MN, max crush {:.4} m, energy {:.2} %; multi-body run: crush {:.4} m, energy off by {:.0e}\n",
        km_per_h(p.speed_m_per_s),
        p.peak_force_n / 1e6,
        p.max_deflection_m,
        p.energy_over_kinetic * 100.0,
        p.simulated_max_crush_m,
        p.simulated_energy_error,
    )?;
    for file in &document.files {
        writeln!(out, "wrote {file}")?;
    }
    writeln!(out, "in {:.2} s", document.seconds)
}
