//! `crumple train`: from a group of the database to a model file.

use std::path::PathBuf;

use crumple::database::Database;
use crumple::dataset::TrainingSet;
use crumple::forest::{StopRule, Thresholds};
use crumple::surrogate::forest::ForestOptions;
use crumple::surrogate::leave_one_out::LeftOut;
use crumple::surrogate::{Fitted, Model, Options};
use crumple::unit::km_per_h;
use serde::Serialize;

use super::output;
use super::{CommandResult, Failure, Manners, Outcome, keep_input};

/// Fit a model to the curves of a group and save it
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple train curves.h5 --group lead-car-wall -o lead.model
  crumple train curves.h5 --group lead-car-wall --paper -o ddtcm.model
  crumple train curves.h5 --group lead-car-wall --model nearest -o fdrm.model
The same seed gives the same bytes, on any number of threads.")]
pub struct Args {
    /// Curve database
    database: PathBuf,
    /// Group to train on
    #[arg(long)]
    group: String,
    /// Kind of model
    #[arg(long, value_enum, default_value_t = Kind::Forest)]
    model: Kind,
    /// Number of trees
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trees: u32,
    /// Seed of all random draws
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Fewest samples of a leaf
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    min_samples_leaf: u32,
    /// Thresholds of splits
    #[arg(long, value_enum, default_value_t = ThresholdKind::Midpoint)]
    thresholds: ThresholdKind,
    /// When a node is not split any more
    #[arg(long, value_enum, default_value_t = StopKind::StdOverMean)]
    stop: StopKind,
    /// Threshold of the stop rule: in N for var-over-mean, dimensionless for std-over-mean
    #[arg(long, default_value_t = 0.01)]
    stop_threshold: f64,
    /// The reference method's choices: forest of 50 trees on the states at the common
    /// interval, midpoints, Var/Mean
    #[arg(long, conflicts_with_all = ["model", "trees", "min_samples_leaf", "thresholds", "stop", "stop_threshold"])]
    paper: bool,
    /// Model file to write
    #[arg(short, long)]
    output: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// Random forest on speed and deflection (DDTCM)
    Forest,
    /// The FE curve of the nearest speed (FDRM)
    Nearest,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum ThresholdKind {
    Midpoint,
    Random,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum StopKind {
    /// Grow until leaves are pure
    Never,
    /// Var/Mean, as printed in the reference
    VarOverMean,
    /// sqrt(Var)/|Mean|
    StdOverMean,
}

#[derive(Serialize)]
struct Document<'a> {
    output: String,
    group: &'a str,
    model: &'a str,
    options: &'a Options,
    training_speeds_m_per_s: Vec<f64>,
    training_hash: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    out_of_bag: Option<crumple::forest::OutOfBag>,
    validation: &'a [LeftOut],
}

impl Args {
    fn options(&self) -> Options {
        if self.paper {
            return Options::Forest(ForestOptions { seed: self.seed, ..ForestOptions::paper() });
        }
        match self.model {
            Kind::Nearest => Options::Nearest,
            Kind::Forest => Options::Forest(ForestOptions {
                trees: self.trees as usize,
                seed: self.seed,
                thresholds: match self.thresholds {
                    ThresholdKind::Midpoint => Thresholds::Midpoint,
                    ThresholdKind::Random => Thresholds::Random,
                },
                stop: match self.stop {
                    StopKind::Never => StopRule::Unpruned,
                    StopKind::VarOverMean => StopRule::VarOverMean(self.stop_threshold),
                    StopKind::StdOverMean => StopRule::StdOverMean(self.stop_threshold),
                },
                min_samples_leaf: self.min_samples_leaf as usize,
                ..ForestOptions::default()
            }),
        }
    }
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    if !(args.stop_threshold >= 0.0 && args.stop_threshold.is_finite()) {
        return Err(Failure::Usage(format!(
            "--stop-threshold {} must be 0 or more",
            args.stop_threshold
        )));
    }
    keep_input(&args.database, &args.output)?;
    let database = Database::read(&args.database)?;
    let cases = database.group(&args.database, &args.group)?;
    let set = TrainingSet::new(&args.group, cases)?;
    let model = Model::fit(&set, args.options())?;
    model.write(&args.output)?;
    let truncated: Vec<&str> =
        set.cases.iter().filter(|c| c.truncated).map(|c| c.name.as_str()).collect();
    if !truncated.is_empty() {
        manners.warn(&format!(
            "runs that ended while loading are left out of the maximal crush: {}",
            truncated.join(", ")
        ));
    }
    if !set.equal_masses {
        manners.warn("the cases have different masses, which the model does not see");
    }
    let warned = !truncated.is_empty() || !set.equal_masses;
    let out_of_bag = match model.fitted() {
        Fitted::Forest(forest) => forest.forest().out_of_bag(),
        Fitted::Nearest(_) => None,
    };
    if manners.json {
        output::print_json(&Document {
            output: args.output.display().to_string(),
            group: &args.group,
            model: model.options.name(),
            options: &model.options,
            training_speeds_m_per_s: set.speeds_m_per_s(),
            training_hash: &model.training_hash,
            out_of_bag,
            validation: &model.validation,
        })?;
    } else {
        output::print(|out| {
            let speeds: Vec<String> = set.speeds_m_per_s().iter().map(|&v| km_per_h(v)).collect();
            writeln!(out, "{} on {}", model.options.name(), speeds.join(", "))?;
            if let Some(oob) = out_of_bag {
                let r2 = oob.r2.map_or("-".into(), |r2| format!("{r2:.5}"));
                writeln!(out, "out-of-bag: rmse {:.1} kN, r² {r2}", oob.rmse / 1e3)?;
            }
            if !model.validation.is_empty() {
                let heading = ["left out", "force error", "energy", "max crush"];
                let rows: Vec<Vec<String>> = model.validation.iter().map(validation_row).collect();
                output::table(out, &heading, &rows)?;
            }
            writeln!(out, "wrote {}", args.output.display())
        })?;
    }
    Ok(if warned { Outcome::Warned } else { Outcome::Clean })
}

fn validation_row(left_out: &LeftOut) -> Vec<String> {
    vec![
        km_per_h(left_out.speed_m_per_s),
        format!("{:.2} %", left_out.force_l1 * 100.0),
        format!("{:+.2} %", left_out.energy_error * 100.0),
        format!("{:+.2} %", left_out.max_crush_error * 100.0),
    ]
}
