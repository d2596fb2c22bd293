//! `crumple train`: from a group of the database to a model file.

use std::path::PathBuf;

use crumple::database::Database;
use crumple::forest::{StopRule, Thresholds};
use crumple::surrogate::forest::ForestOptions;
use crumple::surrogate::leave_one_out::Validation;
use crumple::surrogate::max_crush::MaxCrushRule;
use crumple::surrogate::{Fitted, Options};
use crumple::unit::km_per_h;
use crumple::validate::{self, Choice};
use serde::Serialize;

use super::output;
use super::progress::Bar;
use super::{CommandResult, Failure, Manners, Outcome, keep_input};

/// Fit a model to the curves of a group and save it
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple train curves.h5 -o lead.model                # of the only group
  crumple train curves.h5 --group lead-car-wall -o lead.model
  crumple train curves.h5 --group lead-car-wall --paper -o ddtcm.model
  crumple train curves.h5 --group lead-car-wall --model nearest -o fdrm.model
auto fits every model with each speed left out (crumple validate shows the table) and takes the
simplest of the best. The same seed gives the same bytes, on any number of threads.")]
pub struct Args {
    /// Curve database
    database: PathBuf,
    /// Group to train on (default: the only one)
    #[arg(long)]
    group: Option<String>,
    /// Kind of model
    #[arg(long, value_enum, default_value_t = Kind::Auto)]
    model: Kind,
    /// Number of trees [default: 50 of a forest, 500 of extra]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trees: Option<u32>,
    /// Seed of all random draws
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Fewest samples of a leaf
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    min_samples_leaf: u32,
    /// Thresholds of splits [default: midpoint of a forest, random of extra]
    #[arg(long, value_enum)]
    thresholds: Option<ThresholdKind>,
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
    /// The model that leave-one-speed-out chooses
    Auto,
    /// Random forest on speed and deflection (DDTCM)
    Forest,
    /// Extremely randomised trees
    Extra,
    /// Linear in speed at equal deflection
    Linear,
    /// Linear in speed, with the force following the speed at each deflection
    Rate,
    /// Peaks matched and warped onto each other before blending
    Registered,
    /// Principal scores of registered curves, each a Gaussian process
    Gp,
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
    max_crush_rule: MaxCrushRule,
    training_speeds_m_per_s: Vec<f64>,
    training_hash: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    out_of_bag: Option<crumple::forest::OutOfBag>,
    validation: &'a Option<Validation>,
}

impl Args {
    fn choice(&self) -> Result<Choice, Failure> {
        let seed = self.seed;
        if self.paper {
            let options = ForestOptions { seed, ..ForestOptions::paper() };
            return Ok(Choice::Options(Options::Forest(options)));
        }
        let is_forest = matches!(self.model, Kind::Forest | Kind::Extra);
        let is_auto = matches!(self.model, Kind::Auto);
        if !is_forest && (self.thresholds.is_some() || !is_auto && self.trees.is_some()) {
            return Err(Failure::Usage(
                "--trees and --thresholds need --model forest or --model extra".into(),
            ));
        }
        let forest = |options: ForestOptions| ForestOptions {
            trees: self.trees.map_or(options.trees, |t| t as usize),
            seed,
            thresholds: match self.thresholds {
                Some(ThresholdKind::Midpoint) => Thresholds::Midpoint,
                Some(ThresholdKind::Random) => Thresholds::Random,
                None => options.thresholds,
            },
            stop: match self.stop {
                StopKind::Never => StopRule::Unpruned,
                StopKind::VarOverMean => StopRule::VarOverMean(self.stop_threshold),
                StopKind::StdOverMean => StopRule::StdOverMean(self.stop_threshold),
            },
            min_samples_leaf: self.min_samples_leaf as usize,
            ..options
        };
        Ok(Choice::Options(match self.model {
            Kind::Auto => {
                return Ok(Choice::Auto { seed, trees: self.trees.map(|t| t as usize) });
            }
            Kind::Forest => Options::Forest(forest(ForestOptions::default())),
            Kind::Extra => Options::Extra(forest(ForestOptions::extra())),
            Kind::Linear => Options::Linear,
            Kind::Rate => Options::Rate,
            Kind::Registered => Options::Registered,
            Kind::Gp => Options::Gp,
            Kind::Nearest => Options::Nearest,
        }))
    }
}

pub fn run(args: &Args, manners: Manners) -> CommandResult {
    if !(args.stop_threshold >= 0.0 && args.stop_threshold.is_finite()) {
        return Err(Failure::Usage(format!(
            "--stop-threshold {} must be 0 or more",
            args.stop_threshold
        )));
    }
    let choice = args.choice()?;
    keep_input(&args.database, &args.output)?;
    let database = Database::read(&args.database)?;
    let (group, cases) = database.group_or_only(&args.database, args.group.as_deref())?;
    let bar = Bar::new(manners, "training");
    bar.step(&format!("training {group}, with every speed left out"));
    let model = validate::train(group, cases, choice)?;
    bar.end();
    model.write(&args.output)?;
    let truncated: Vec<&str> =
        model.cases.iter().filter(|c| c.truncated).map(|c| c.name.as_str()).collect();
    if !truncated.is_empty() {
        manners.warn(&format!(
            "runs that ended while loading are left out of the maximal crush: {}",
            truncated.join(", ")
        ));
    }
    if model.cases.len() < 3 {
        manners.warn(&format!(
            "the group has {} curves: with fewer than 3 no speed can be left out to see how good the model is",
            model.cases.len()
        ));
    }
    let warned = !truncated.is_empty() || model.cases.len() < 3;
    let out_of_bag = match model.fitted() {
        Fitted::Forest(forest) => forest.forest().out_of_bag(),
        _ => None,
    };
    let speeds = || model.cases.iter().map(|c| c.speed_m_per_s);
    if manners.json {
        output::print_json(&Document {
            output: args.output.display().to_string(),
            group,
            model: model.options.name(),
            options: &model.options,
            max_crush_rule: model.max_crush_rule,
            training_speeds_m_per_s: speeds().collect(),
            training_hash: &model.training_hash,
            out_of_bag,
            validation: &model.leave_one_out,
        })?;
    } else {
        output::print(|out| {
            let speeds: Vec<String> = speeds().map(km_per_h).collect();
            writeln!(out, "{} on {}", model.options.name(), speeds.join(", "))?;
            if let Some(oob) = out_of_bag {
                let r2 = oob.r2.map_or("-".into(), |r2| format!("{r2:.5}"));
                writeln!(out, "out-of-bag: rmse {:.1} kN, r² {r2}", oob.rmse / 1e3)?;
            }
            if let Some(validation) = &model.leave_one_out {
                super::validate::print_means(out, validation)?;
            }
            writeln!(out, "wrote {}", args.output.display())
        })?;
    }
    Ok(if warned { Outcome::Warned } else { Outcome::Clean })
}
