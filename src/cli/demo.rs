//! `crumple demo`: the whole workflow on the bundled FE runs.

use crate::error::Error;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::assess::choose::{Purpose, Selection};
use crate::assess::validate::{train_chosen, validate};
use crate::build::{self, BuiltRun, RunOutcome};
use crate::clock::now_utc;
use crate::curve::Case;
use crate::database::Database;
use crate::file::{self, not_written, write_at, write_whole};
use crate::multibody::Run;
use crate::report::{MethodSpeeds, ReportSettings, report};
use crate::surrogate::leave_one_out::Validation;
use crate::surrogate::{Model, ModelKind, PredictedCurve, Query, predict};
use crate::table::Table;
use crate::unit::{M_PER_S_PER_KM_PER_H, Shown, km_per_h};
use crate::{formats, scenario};
use include_dir::{Dir, include_dir};

use super::arguments::named;
use super::output::{self, Bar};
use super::validate::print_validation;
use super::{CommandResult, Failure, GlobalOptions, usage};

/// Run the whole workflow on bundled FE runs: database, models, prediction, multi-body run, exports
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple demo
  crumple demo -o somewhere")]
pub(super) struct Args {
    /// Folder to write to
    #[arg(short, long, default_value = "crumple-demo", value_parser = named())]
    output: PathBuf,
}

/// The FE runs, part of the program so that the demo needs no other file.
static FE_RUNS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/fixtures/fe");

/// The group that is trained, and a speed between its FE runs.
const GROUP: &str = "lead-car-wall";
const SPEED_M_PER_S: f64 = 50.0 * M_PER_S_PER_KM_PER_H;

const SEED: u64 = 0;

/// FE's run of a whole train, for the comparison of methods.
static TRAIN_SET: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/fixtures/train-set");

/// Scenarios, written next to the models that they name.
static SCENARIOS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/examples/trains");
/// The one that the demo runs.
const SCENARIO: &str = "scenario.toml";
const REPORTED: [&str; 2] = [SCENARIO, "en15227-identical-units.toml"];

/// Groups and the model files of their curves.
const MODELS: [(&str, &str); 3] =
    [(GROUP, "lead.model"), ("lead-car-pair", "pair.model"), ("vehicle-pair", "vehicle.model")];

/// What the flow makes on its way.
struct Flow<'a> {
    folder: &'a Path,
    bar: Bar,
    files: Vec<PathBuf>,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let start = Instant::now();
    if let Some(edited) = edited_scenario(&args.output).filter(|_| !options.overwrite) {
        return usage(format!(
            "{} exists and differs from what the demo writes: name another folder with -o, or replace it with --overwrite",
            edited.display()
        ));
    }
    let mut flow = Flow {
        folder: &args.output,
        bar: Bar::new(options, "writing the FE runs"),
        files: Vec::new(),
    };
    flow.unpack()?;
    let database = flow.build()?;
    let validations = flow.validate(&database)?;
    let models = flow.train(&database, &validations)?;
    let model = models.iter().find(|model| model.group == GROUP).expect("it is one of the list");
    let curve = flow.predict(model)?;
    let run = flow.simulate()?;
    flow.report(&database, &models)?;
    let files = flow.files;
    drop(flow.bar);
    let seconds = start.elapsed().as_secs_f64();
    let (peak_n, crush_m) = (curve.peak_force_n(), run.interfaces[0].max_deflection_m);
    let runs = cases(&database).map(|(group, case)| {
        document! {
            group: group,
            speed_m_per_s: case.conditions.speed.m_per_s,
            peak_force_N: case.peak_force_n(),
            max_deflection_m: case.max_deflection_m(),
            work_over_energy: case.quality.audit.ratio(),
        }
    });
    let document = document! {
        cases: runs.collect::<Vec<_>>(),
        validations: &validations,
        prediction: document! {
            model: &curve.model,
            speed_m_per_s: curve.speed_m_per_s,
            peak_force_N: peak_n,
            max_deflection_m: curve.max_deflection_m,
            energy_over_kinetic: curve.provenance.energy_over_kinetic,
            simulated_max_crush_m: crush_m,
            simulated_energy_error: run.ledger.max_energy_error,
        },
        files: files.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        seconds: seconds,
    };
    let outcome = options.warn_all(&curve.warnings);
    options.show(&document, |out| {
        print_runs(out, &database)?;
        writeln!(out)?;
        for validation in &validations {
            print_validation(out, validation, options)?;
            writeln!(out)?;
        }
        writeln!(
            out,
            "{GROUP} at {} by the model {}: peak force {}, max crush {:.4} m, energy {:.1} %; crush in the multi-body run {crush_m:.4} m\n",
            km_per_h(curve.speed_m_per_s),
            curve.model,
            Shown::one_force(peak_n),
            curve.max_deflection_m,
            curve.provenance.energy_over_kinetic * 100.0,
        )?;
        if options.verbose {
            files.iter().try_for_each(|file| writeln!(out, "wrote {}", file.display()))?;
        }
        let (files, folder) = (files.len(), args.output.display());
        writeln!(
            out,
            "wrote {files} files into {folder} in {seconds:.1} s; open {folder}/report.html"
        )
    })?;
    Ok(outcome)
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
        extract(&FE_RUNS, &target)?;
        Ok(extract(&TRAIN_SET, &target.join("train-set"))?)
    }

    fn build(&mut self) -> Result<Database, Failure> {
        let path = self.path("curves.h5");
        let mut database = Database::default();
        let is_trained =
            |dir: &&Dir<'_>| MODELS.iter().any(|(group, _)| dir.path() == Path::new(group));
        for group in FE_RUNS.dirs().filter(is_trained) {
            let manifest = self.folder.join("fe").join(group.path()).join("study.toml");
            let report = build::build(&manifest, &path, |run| self.bar.step(run))?;
            for BuiltRun { outcome, .. } in report.runs {
                if let RunOutcome::Failed { reason, .. } = outcome {
                    return Err(reason.into());
                }
            }
            database = report.database;
        }
        Ok(database)
    }

    /// Leaves out every speed of every group.
    fn validate(&self, database: &Database) -> Result<Vec<Validation>, Failure> {
        let mut validations = Vec::new();
        for group in database.groups() {
            self.bar.step(&format!("validating {group}"));
            validations.push(validate(
                group,
                database.cases(group),
                &ModelKind::all(SEED),
                Selection::Best(Purpose::Vehicle),
            )?);
        }
        Ok(validations)
    }

    /// Trains the model of every group that its validation chose.
    fn train(
        &mut self,
        database: &Database,
        validations: &[Validation],
    ) -> Result<Vec<Model>, Failure> {
        let mut models = Vec::new();
        for (group, file) in MODELS {
            self.bar.step(&format!("training {file}"));
            let validation = validations.iter().find(|v| v.group == group);
            let validation = validation.expect("every group was validated").clone();
            let cases = database.cases(group);
            let model = train_chosen(group, cases, &ModelKind::all(SEED), validation)?;
            model.write(&self.path(file))?;
            models.push(model);
        }
        Ok(models)
    }

    fn predict(&mut self, model: &Model) -> Result<PredictedCurve, Failure> {
        let curve = [predict(model, &Query::at(SPEED_M_PER_S))?];
        for name in ["lead50.json", "lead50.csv", "lead50.k", "lead50.mo", "lead50.fmu"] {
            let path = self.path(name);
            let format = formats::by_extension(&path)?;
            for (_, bytes) in format.export(&curve, &formats::Options::default())?.files {
                write_whole(&path, &bytes)?;
            }
        }
        let [curve] = curve;
        Ok(curve)
    }

    fn simulate(&mut self) -> Result<Run, Failure> {
        for file in SCENARIOS.files() {
            let path = self.path(&file.path().display().to_string());
            write_whole(&path, file.contents())?;
        }
        let path = self.folder.join(SCENARIO);
        let prepared = scenario::load(&path)?;
        Ok(prepared.run()?)
    }

    /// The page about all of it; the models spare a second validation.
    fn report(&mut self, database: &Database, models: &[Model]) -> Result<(), Failure> {
        let settings = ReportSettings {
            title: Some("crumple demo".into()),
            author: None,
            made_at: now_utc(),
            command: "crumple demo".into(),
            groups: Vec::new(),
            speed_m_per_s: None,
            methods: MethodSpeeds::Worst,
            nsdm_seeds: 0,
            seed: SEED,
        };
        let scenarios = REPORTED.map(|name| self.folder.join(name));
        let path = self.path("report.html");
        let databases = [(self.folder.join("curves.h5"), database.clone())];
        let (page, _) =
            report(&databases, &scenarios, models, &settings, |step| self.bar.step(step))?;
        Ok(write_whole(&path, page.as_bytes())?)
    }
}

/// Maximum number of bytes of a scenario that is compared with the bundled one.
const MAX_SCENARIO: u64 = 1 << 20;

/// A scenario of an earlier demo in `folder` that is not as it was written.
fn edited_scenario(folder: &Path) -> Option<PathBuf> {
    let paths = SCENARIOS.files().map(|file| (folder.join(file.path()), file.contents()));
    let mut there =
        paths.filter_map(|(path, own)| Some((file::read(&path, MAX_SCENARIO).ok()?, path, own)));
    there.find(|(found, _, own)| found != own).map(|(_, path, _)| path)
}

/// Writes the bundled files of a folder and all below it.
fn extract(bundled: &Dir, target: &Path) -> Result<(), Error> {
    let folder = target.join(bundled.path());
    std::fs::create_dir_all(&folder).map_err(|e| not_written(&folder, e))?;
    for file in bundled.files() {
        write_at(&target.join(file.path()), |mut out| out.write_all(file.contents()).map(Some))?;
    }
    bundled.dirs().try_for_each(|inner| extract(inner, target))
}

fn cases(database: &Database) -> impl Iterator<Item = (&str, &Case)> {
    database.groups().flat_map(|g| database.cases(g).iter().map(move |c| (g, c)))
}

fn print_runs(out: &mut dyn Write, database: &Database) -> io::Result<()> {
    let largest_n = cases(database).map(|(_, case)| case.peak_force_n()).fold(0.0, f64::max);
    let force = Shown::force(largest_n);
    let runs = Table::of(cases(database))
        .column("FE run", |(group, _)| *group)
        .column("speed", |(_, case)| km_per_h(case.conditions.speed.m_per_s))
        .column("peak force", |(_, case)| force.text(case.peak_force_n()))
        .column("max crush", |(_, case)| format!("{:.4} m", case.max_deflection_m()))
        .column("W/E", |(_, case)| format!("{:.3}", case.quality.audit.ratio()));
    output::table(out, runs)
}
