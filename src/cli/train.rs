//! `crumple train`: from a group of the database to a model file.

use crate::words::counted;
use std::iter;
use std::path::PathBuf;

use crate::assess::choose::Purpose;
use crate::assess::validate::{self, Choice};
use crate::curve::StoppedMass;
use crate::database::Database;
use crate::forest::{RegressionForest, StopRule, Thresholds};
use crate::surrogate::forest::ForestOptions;
use crate::surrogate::{MODELS, ModelKind, WarningCode};
use crate::unit::{Shown, SpeedKind, km_per_h};
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::arguments::{FileKind, named, one_of};
use super::output::Bar;
use super::validate::print_validation;
use super::{CommandResult, Failure, GlobalOptions, keep_input, usage};

/// Fit a model to the curves of a group and save it
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple train curves.h5 -o lead.model                # of the only group
  crumple train curves.h5 --group lead-car-wall -o lead.model
  crumple train curves.h5 --group lead-car-wall --for train -o lead.model
  crumple train curves.h5 --group lead-car-wall --paper -o ddtcm.model
  crumple train curves.h5 --group lead-car-wall --model nearest -o fdrm.model
auto fits every model with each speed left out (crumple validate shows the table) and keeps to
crush-law, or rate, unless another is better by more than the differences scatter. The same seed gives the same bytes, on any number of threads.")]
pub(super) struct Args {
    /// Curve database
    database: PathBuf,
    /// Group to train on (default: the only one)
    #[arg(long)]
    group: Option<String>,
    /// Kind of model
    #[arg(long, value_parser = model_names(), default_value = AUTO)]
    model: String,
    /// What the model is for: interfaces of a train also close far below the speeds of the runs, so
    /// that auto counts the ends of the range and prefers a force that follows the closing speed
    #[arg(long = "for", value_name = "USE", value_parser = one_of(PURPOSES), default_value = "vehicle")]
    purpose: Purpose,
    /// Number of trees of a forest or of extra [default: 50]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trees: Option<u32>,
    /// Random seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Minimum samples per leaf
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    min_samples_leaf: u32,
    /// Split thresholds [default: midpoint for forest, random for extra]
    #[arg(long, value_parser = one_of(THRESHOLDS))]
    thresholds: Option<Thresholds>,
    /// When a node is no longer split
    #[arg(long, value_parser = one_of(STOP_RULES), default_value = "std-over-mean")]
    stop: StopRuleAt,
    /// Threshold of the stop rule: in N for var-over-mean, dimensionless for std-over-mean
    #[arg(long, default_value_t = 0.01)]
    stop_threshold: f64,
    /// The reference method's choices: forest of 50 trees on the states at the common
    /// interval, midpoints, Var/Mean
    #[arg(long, conflicts_with_all = ["model", "purpose", "trees", "min_samples_leaf", "thresholds", "stop", "stop_threshold"])]
    paper: bool,
    /// Model file to write
    #[arg(short, long, value_parser = named())]
    output: PathBuf,
}

/// The name that lets leave-one-speed-out choose.
const AUTO: &str = "auto";

/// Names and descriptions of the models, and of the choice among them.
fn model_names() -> PossibleValuesParser {
    let auto = PossibleValue::new(AUTO).help("The model that leave-one-speed-out chooses");
    let models = MODELS.iter().map(|entry| PossibleValue::new(entry.name).help(entry.about));
    PossibleValuesParser::new(iter::once(auto).chain(models))
}

/// Where a model will be used.
const PURPOSES: &[(&str, Purpose, &str)] = &[
    ("vehicle", Purpose::Vehicle, "One vehicle, between the speeds of the runs"),
    ("train", Purpose::Train, "Interfaces of a train, also beyond these speeds"),
];

/// How thresholds of splits are chosen.
const THRESHOLDS: &[(&str, Thresholds, &str)] = &[
    ("midpoint", Thresholds::Midpoint, "The best midpoint between consecutive values"),
    ("random", Thresholds::Random, "One random value per feature"),
];

/// A rule with the threshold that it is given.
type StopRuleAt = fn(f64) -> StopRule;

/// When a node is no longer split.
const STOP_RULES: &[(&str, StopRuleAt, &str)] = &[
    ("never", |_| StopRule::Unpruned, "Grow until leaves are pure"),
    ("var-over-mean", StopRule::VarOverMean, "Var/Mean, as printed in the reference"),
    ("std-over-mean", StopRule::StdOverMean, "sqrt(Var)/|Mean|"),
];

impl Args {
    fn choice(&self) -> Result<Choice, Failure> {
        let seed = self.seed;
        if self.paper {
            let options = ForestOptions { seed, ..ForestOptions::paper() };
            return Ok(Choice::Kind(ModelKind::forest(options)));
        }
        let kind = ModelKind::named(&self.model, seed);
        let has_forest = kind.is_some_and(|kind| kind.forest_options().is_some());
        if !has_forest && (self.thresholds.is_some() || kind.is_some() && self.trees.is_some()) {
            return usage("--trees and --thresholds need --model forest or --model extra");
        }
        let Some(kind) = kind else {
            return Ok(Choice::Auto {
                purpose: self.purpose,
                seed,
                trees: self.trees.map(|t| t as usize),
            });
        };
        Ok(Choice::Kind(kind.with_forest(|own| self.forest(own))))
    }

    /// A forest's own options with those that were requested.
    fn forest(&self, own: ForestOptions) -> ForestOptions {
        let ForestOptions { table, .. } = ForestOptions::default();
        ForestOptions {
            trees: self.trees.map_or(own.trees, |t| t as usize),
            thresholds: self.thresholds.unwrap_or(own.thresholds),
            stop: (self.stop)(self.stop_threshold),
            min_samples_leaf: self.min_samples_leaf as usize,
            table,
            ..own
        }
    }
}

/// Speeds that are listed one by one.
const MOST_LISTED: usize = 20;

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    if !(args.stop_threshold >= 0.0 && args.stop_threshold.is_finite()) {
        return usage(format!("--stop-threshold {} must be 0 or more", args.stop_threshold));
    }
    let choice = args.choice()?;
    keep_input(&args.database, &args.output)?;
    options.keep_others(&args.output, FileKind::Model)?;
    let database = Database::read(&args.database)?;
    let (group, cases) = database.group_or_only(&args.database, args.group.as_deref())?;
    let bar = Bar::new(options, "training");
    bar.step(&format!("training {group}, with every speed left out"));
    let model = validate::train(group, cases, choice)?;
    drop(bar);
    model.write(&args.output)?;
    let truncated: Vec<&str> =
        model.cases.iter().filter(|c| c.truncated).map(|c| c.name.as_str()).collect();
    let mut warnings = Vec::new();
    if !truncated.is_empty() {
        let names = truncated.join(", ");
        warnings.push(format!(
            "runs that ended while loading are left out of the maximum crush: {names}"
        ));
    }
    if model.cases.len() < 3 {
        let curves = counted(model.cases.len(), "curve");
        warnings.push(format!(
            "the group has {curves}: with fewer than 3, no speed can be left out to assess the model"
        ));
    } else if model.leave_one_out.as_ref().is_none_or(|of| of.rows.is_empty()) {
        let why = "no speed could be left out to assess the model: its curves have no band";
        warnings.push(why.into());
    }
    let of_cases = model.case_warnings().into_iter();
    warnings.extend(
        of_cases.filter(|w| w.code == WarningCode::CaseWarning).map(|warning| warning.message),
    );
    let outcome = options.warn_all(warnings);
    let out_of_bag = model.forest().and_then(RegressionForest::out_of_bag);
    let speeds: Vec<f64> = model.cases.iter().map(|c| c.speed_m_per_s).collect();
    let path = args.output.display();
    let document = document! {
        output: path.to_string(),
        group: group,
        model: model.name(),
        options: &model.kind,
        max_crush_rule: model.max_crush_rule,
        training_speeds_m_per_s: &speeds,
        training_hash: &model.training_hash,
        out_of_bag if_any: out_of_bag,
        crush_law: &model.crush_law,
        validation: &model.leave_one_out,
    };
    options.show(&document, |out| {
        let on = match &speeds[..] {
            [first, .., last] if speeds.len() > MOST_LISTED => {
                format!("{} cases from {} to {}", speeds.len(), km_per_h(*first), km_per_h(*last))
            }
            all => {
                let shown: Vec<String> = all.iter().map(|speed| km_per_h(*speed)).collect();
                let of = |same: &[String]| match same {
                    [one] => one.clone(),
                    _ => format!("{} ({} cases)", same[0], same.len()),
                };
                shown.chunk_by(|a, b| a == b).map(of).collect::<Vec<_>>().join(", ")
            }
        };
        writeln!(out, "{} on {on}", model.name())?;
        if let Some(oob) = out_of_bag {
            let r2 = oob.r2.map_or("-".into(), |r2| format!("{r2:.5}"));
            writeln!(out, "out-of-bag: rmse {}, r² {r2}", Shown::one_force(oob.rmse))?;
        }
        let stopped = model.crush_law.as_ref().map(|law| &law.stopped);
        if let Some(stopped) = stopped.filter(|stopped| stopped.is_known()) {
            writeln!(
                out,
                "{}",
                stopped_mass_line(stopped, model.speed_kind, model.masses().effective_kg())
            )?;
        }
        if let Some(validation) = &model.leave_one_out {
            print_validation(out, validation, options)?;
        }
        writeln!(out, "wrote {path}")
    })?;
    Ok(outcome)
}

/// How much of the crush zone stops before the body, over which deflection, and how well the runs agree.
pub(super) fn stopped_mass_line(stopped: &StoppedMass, kind: SpeedKind, moved_kg: f64) -> String {
    let (end_m, all_kg) = stopped.in_all();
    let of = match kind {
        SpeedKind::Wall => "of the crush zone",
        SpeedKind::Closing => "of reduced mass (half that of one of two equal ends)",
    };
    let scatter_kg = stopped.residual_kg;
    let share = all_kg / moved_kg;
    let unusual = match stopped.is_usual(moved_kg) {
        false => format!(
            "; {:.0} % of the moving mass is more than crush zones hold: part of it stands for what else lies between contact force and body, such as parts that turn or vibrate",
            share * 100.0
        ),
        true => String::new(),
    };
    format!(
        "crush law: {all_kg:.0} kg {of} come to rest within {end_m:.3} m of crush (scatter {scatter_kg:.0} kg RMS){unusual}"
    )
}
