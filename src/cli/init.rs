//! `crumple init`: a study from run folders, or a scenario from models.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::file::write_whole;
use crate::init::{self, GivenForce, Proposal, Proposed, ProposedRun, ScenarioProposal, UserHints};
use crate::study::StudyKind;
use crate::unit::{Shown, UnitSystem, km_per_h};
use serde::Serialize;

use super::arguments;
use super::output;
use super::{CommandResult, Failure, GlobalOptions, Outcome, is_stdout, progress};

/// Examine run folders and write a commented study; or write a scenario for models
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple init                                 # the run folders below this one
  crumple init runs/36kmh runs/48kmh -o study.toml
  crumple init runs --half-model               # one body of a pair, cut at the symmetry plane
  crumple init runs --node 900001 --force rcforc:3:surfa --mass 24t
  crumple init --scenario lead.model -o scenario.toml
Each value in the study says whether it was read, computed or guessed, and from what. Then run
crumple build to extract the curves.")]
pub(super) struct Args {
    /// Run folders, or folders above them; with --scenario model files
    #[arg(value_name = "RUN|MODEL")]
    inputs: Vec<PathBuf>,
    /// File to write, study.toml or scenario.toml if absent; "-" is standard output
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Write a scenario for models: the first between the noses or nose and wall, the second
    /// between the vehicles of a train
    #[arg(long)]
    scenario: bool,
    #[command(flatten)]
    given: GivenArgs,
}

/// What the user knows better than the files.
#[derive(clap::Args)]
#[group(id = "known", multiple = true, conflicts_with = "scenario")]
struct GivenArgs {
    /// Units of the solver files, such as mm-t-s
    #[arg(long, value_parser = |text: &str| UnitSystem::parse(text))]
    units: Option<UnitSystem>,
    /// Kind of impact
    #[arg(long, value_parser = arguments::one_of(KINDS))]
    kind: Option<StudyKind>,
    /// The runs model one body of a pair, cut at the symmetry plane
    #[arg(long, conflicts_with = "minus_node")]
    half_model: bool,
    /// Node of the body
    #[arg(long)]
    node: Option<i64>,
    /// Node of the other body of a pair
    #[arg(long, requires = "node")]
    minus_node: Option<i64>,
    /// Contact force as FILE:ID[:SIDE][:COMPONENT], such as rcforc:3:surfa
    #[arg(long)]
    force: Option<GivenForce>,
    /// Mass of the body, or of each body of a pair, such as 24t
    #[arg(long, value_parser = arguments::mass)]
    mass: Option<f64>,
    /// Mass of the other body of a pair
    #[arg(long, value_parser = arguments::mass, requires = "mass")]
    other_mass: Option<f64>,
    /// Group of the database; all runs then belong to it, whatever their folders
    #[arg(long)]
    group: Option<String>,
}

const KINDS: &[(&str, StudyKind, &str)] = &[
    ("wall", StudyKind::Wall, "A body against a rigid wall"),
    ("pair", StudyKind::Pair, "Two bodies"),
];

#[derive(Serialize)]
struct Document<'a> {
    /// The file that was written; null for standard output.
    study: Option<String>,
    /// Whether crumple build takes it as it is.
    complete: bool,
    /// What is left to fill in.
    fill_in: Vec<String>,
    #[serde(flatten)]
    proposal: &'a Proposal,
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let default = if args.scenario { "scenario.toml" } else { "study.toml" };
    let output = args.output.clone().unwrap_or_else(|| default.into());
    let to_stdout = is_stdout(&output);
    if to_stdout && options.json {
        let message = "-o - and --json both write to standard output: give one of them";
        return Err(Failure::Usage(message.into()));
    }
    if !to_stdout {
        init::refuse_existing(&output)?;
    }
    if args.scenario { scenario(args, &output, options) } else { study(args, &output, options) }
}

#[derive(Serialize)]
struct ScenarioDocument<'a> {
    scenario: String,
    #[serde(flatten)]
    proposal: &'a ScenarioProposal,
}

fn scenario(args: &Args, output: &Path, options: GlobalOptions) -> CommandResult {
    let place = if is_stdout(output) { Path::new("scenario.toml") } else { output };
    let proposal = init::propose_scenario(&args.inputs, place)?;
    let text = proposal.to_toml();
    for what in &proposal.missing {
        options.warn(&format!("fill in {what}"));
    }
    if is_stdout(output) {
        output::print_data(|out| out.write_all(text.as_bytes()))?;
    } else {
        write_whole(output, text.as_bytes())?;
        let scenario = output.display().to_string();
        if options.json {
            output::print_json(&ScenarioDocument { scenario, proposal: &proposal })?;
        } else {
            options.print(|out| {
                writeln!(
                    out,
                    "wrote {scenario}: put in your trains, then run crumple simulate {scenario}"
                )
            })?;
        }
    }
    Ok(if proposal.missing.is_empty() { Outcome::Clean } else { Outcome::Warned })
}

fn study(args: &Args, output: &Path, options: GlobalOptions) -> CommandResult {
    let known = &args.given;
    let folders =
        if args.inputs.is_empty() { vec![PathBuf::from(".")] } else { args.inputs.clone() };
    let place = if is_stdout(output) { Path::new("study.toml") } else { output };
    let hints = UserHints {
        units: known.units,
        kind: known.kind,
        half_model: known.half_model,
        node: known.node,
        minus_node: known.minus_node,
        force: known.force.clone(),
        mass_kg: known.mass,
        other_mass_kg: known.other_mass,
        group: known.group.clone(),
    };
    let bar = progress::Bar::new(options, "examining runs");
    let done = AtomicUsize::new(0);
    let proposal = init::propose(&folders, place, &hints, |name| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.step(&format!("{done} runs examined, last {name}"));
    });
    bar.end();
    let proposal = proposal?;
    let text = proposal.to_toml();
    if !is_stdout(output) {
        // Another may have come there while the runs were read.
        init::refuse_existing(output)?;
        write_whole(output, text.as_bytes())?;
    }
    let missing = proposal.missing();
    for warning in warnings(&proposal) {
        options.warn(&warning);
    }
    if is_stdout(output) {
        output::print_data(|out| out.write_all(text.as_bytes()))?;
    } else if options.json {
        output::print_json(&Document {
            study: Some(output.display().to_string()),
            complete: missing.is_empty(),
            fill_in: missing.clone(),
            proposal: &proposal,
        })?;
    } else {
        options.print(|out| print(out, &proposal, output))?;
    }
    let is_clean = warnings(&proposal).is_empty() && proposal.left_out.is_empty();
    Ok(if is_clean { Outcome::Clean } else { Outcome::Warned })
}

/// Everything that the user should look at.
fn warnings(proposal: &Proposal) -> Vec<String> {
    let mut all: Vec<String> = proposal.warnings.clone();
    for run in &proposal.runs {
        all.extend(run.notes.iter().map(|note| format!("run {}: {note}", run.name)));
    }
    all.extend(proposal.missing().iter().map(|what| format!("fill in {what}")));
    all
}

fn print(out: &mut dyn std::io::Write, proposal: &Proposal, output: &Path) -> std::io::Result<()> {
    for (key, value, from) in chosen(proposal) {
        writeln!(out, "{key:<11} {value} ({from})")?;
    }
    writeln!(out)?;
    let rows: Vec<Vec<String>> = proposal.runs.iter().map(row).collect();
    output::table(out, &["run", "speed", "mass", "max crush (m)", "states"], &rows)?;
    for note in &proposal.notes {
        writeln!(out, "note: {note}")?;
    }
    for left_out in &proposal.left_out {
        writeln!(out, "left out: {}: {}", left_out.path.display(), left_out.message)?;
    }
    let runs = output::counted(proposal.runs.len(), "run");
    let next = match proposal.missing().len() {
        0 => "check the guessed values, then run crumple build".into(),
        lines => format!(
            "incomplete, {} to fill in or to give as an option; then run crumple build",
            output::counted(lines, "line")
        ),
    };
    writeln!(out, "wrote {} ({runs}): {next}", output.display())
}

/// What the runs share: key, value, where it is from in a word.
fn chosen(proposal: &Proposal) -> Vec<(&'static str, String, &'static str)> {
    fn said<T>(proposed: &Proposed<T>, shown: impl Fn(&T) -> String) -> (String, &'static str) {
        match proposed {
            Proposed::Found { value, evidence, .. } => (shown(value), evidence.word()),
            Proposed::Missing { .. } => ("?".into(), "fill in"),
        }
    }
    let kind = |kind: &StudyKind| {
        if proposal.half_model {
            format!("{} (half model)", kind.name())
        } else {
            kind.name().to_string()
        }
    };
    let all = [
        ("group", said(&proposal.group, String::clone)),
        ("units", said(&proposal.units, ToString::to_string)),
        ("kind", said(&proposal.kind, kind)),
        ("deflection", said(&proposal.deflection, ToString::to_string)),
        ("force", said(&proposal.force, ToString::to_string)),
        ("filter", said(&proposal.filter, |filter| String::from(*filter))),
        ("sampling", said(&proposal.sampling, ToString::to_string)),
    ];
    all.into_iter().map(|(key, (value, from))| (key, value, from)).collect()
}

fn row(run: &ProposedRun) -> Vec<String> {
    let shown = |value: Option<String>| value.unwrap_or_else(|| "?".into());
    vec![
        run.name.clone(),
        shown(run.speed_m_per_s.value().map(|v| km_per_h(*v))),
        shown(run.mass_kg.value().map(|kg| Shown::one_mass(*kg))),
        shown(run.crush_m.map(|m| format!("{m:.3}"))),
        run.states.to_string(),
    ]
}
