//! `crumple init`: a study from run folders, or a scenario from models.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::database::check_name;
use crate::file::write_whole;
use crate::init::{self, GivenForce, Proposal, Proposed, UserHints};
use crate::study::StudyKind;
use crate::table::Table;
use crate::unit::{Shown, UnitSystem, km_per_h, mass_kg};
use crate::words::counted;

use super::output::{self, Bar};
use super::{CommandResult, Failure, GlobalOptions, Outcome, arguments, is_stdout, usage};

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

    /// Write single-mass vehicles, which run faster, even where the models know their ends
    #[arg(long, requires = "scenario")]
    one_mass: bool,
    #[command(flatten)]
    given: GivenArgs,
}

/// What the user knows better than the files.
#[derive(clap::Args)]
#[group(id = "known", multiple = true, conflicts_with = "scenario")]
struct GivenArgs {
    /// Units of the solver files, such as mm-t-s
    #[arg(long, value_parser = UnitSystem::parse)]
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
    /// Contact force as FILE:ID[:SIDE][:COMPONENT], such as rcforc:3:surfa; the sum of several as FILE:ID+ID
    #[arg(long)]
    force: Option<GivenForce>,
    /// Mass of the body, or of each body of a pair, such as 24t
    #[arg(long, value_parser = mass_kg)]
    mass: Option<f64>,
    /// Mass of the other body of a pair
    #[arg(long, value_parser = mass_kg, requires = "mass")]
    other_mass: Option<f64>,
    /// Group of the database; all runs then belong to it, whatever their folders
    #[arg(long)]
    group: Option<String>,
}

impl GivenArgs {
    /// Refuses what no study can hold.
    fn check(&self) -> Result<(), Failure> {
        let is_wall = self.kind == Some(StudyKind::Wall);
        match () {
            () if self.half_model && is_wall => usage(
                "--half-model: the other body is this one's mirror image, which makes a pair: leave out --kind wall",
            ),
            () if self.half_model && self.other_mass.is_some() => usage(
                "--half-model: the other body is this one's mirror image, and as heavy: leave out --other-mass",
            ),
            () if is_wall && self.other_mass.is_some() => {
                usage("--kind wall: a wall has no mass: leave out --other-mass")
            }
            () => match self.group.as_deref().map(|group| (group, check_name(group))) {
                Some((group, Err(why))) => usage(format!("--group {group:?}: {why}")),
                _ => Ok(()),
            },
        }
    }
}

const KINDS: &[(&str, StudyKind, &str)] = &[
    ("wall", StudyKind::Wall, "A body against a rigid wall"),
    ("pair", StudyKind::Pair, "Two bodies"),
];

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let default = if args.scenario { "scenario.toml" } else { "study.toml" };
    let output = args.output.clone().unwrap_or_else(|| default.into());
    if !options.on_stdout([&output])? {
        init::refuse_existing(&output, options.overwrite, args.scenario)?;
    }
    if args.scenario { scenario(args, &output, options) } else { study(args, &output, options) }
}

fn scenario(args: &Args, output: &Path, options: GlobalOptions) -> CommandResult {
    let place = if is_stdout(output) { Path::new("scenario.toml") } else { output };
    let proposal = init::propose_scenario(&args.inputs, place, args.one_mass)?;
    let text = proposal.to_toml();
    let outcome = options.warn_all(proposal.missing.iter().map(|what| format!("fill in {what}")));
    if is_stdout(output) {
        output::print_data(|out| out.write_all(text.as_bytes()))?;
        return Ok(outcome);
    }
    write_whole(output, text.as_bytes())?;
    let scenario = output.display().to_string();
    let document = document! { scenario: &scenario, #[serde(flatten)] proposal: &proposal };
    options.show(&document, |out| {
        writeln!(out, "wrote {scenario}: put in your trains, then run crumple simulate {scenario}")
    })?;
    Ok(outcome)
}

fn study(args: &Args, output: &Path, options: GlobalOptions) -> CommandResult {
    let known = &args.given;
    known.check()?;
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
    let bar = Bar::new(options, "examining runs");
    let done = AtomicUsize::new(0);
    let proposal = init::propose(&folders, place, &hints, |name| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        bar.step(&format!("{done} runs examined, last {name}"));
    })?;
    drop(bar);
    let text = proposal.to_toml();
    if !is_stdout(output) {
        // Another may have come there while the runs were read.
        init::refuse_existing(output, options.overwrite, false)?;
        write_whole(output, text.as_bytes())?;
    }
    let outcome = options
        .warn_all(warnings(&proposal))
        .max(Outcome::warned_if(!proposal.left_out.is_empty()));
    if is_stdout(output) {
        output::print_data(|out| out.write_all(text.as_bytes()))?;
        return Ok(outcome);
    }
    let missing = proposal.missing();
    let document = document! {
        study: output.display().to_string(),
        // Whether crumple build takes it as it is, and what is left to fill in.
        complete: missing.is_empty(),
        fill_in: missing,
        #[serde(flatten)]
        proposal: &proposal,
    };
    options.show(&document, |out| print(out, &proposal, output))?;
    Ok(outcome)
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
    let known = |value: Option<String>| value.unwrap_or_else(|| "?".into());
    let runs = Table::of(&proposal.runs)
        .column("run", |run| &run.name)
        .column("speed", |run| known(run.speed_m_per_s.value().map(|v| km_per_h(*v))))
        .column("mass", |run| {
            let mass = |of: Option<&f64>| known(of.map(|kg| Shown::one_mass(*kg)));
            let other = run.other_mass_kg.as_ref().map(|other| mass(other.value()));
            // Two of one mass are shown once.
            let own = mass(run.mass_kg.value());
            match other.filter(|other| *other != own) {
                Some(other) => format!("{own} on {other}"),
                None => own,
            }
        })
        .column("max crush (m)", |run| {
            let more = if run.truncated { "> " } else { "" };
            known(run.crush_m.map(|m| format!("{more}{m:.3}")))
        })
        .column("states", |run| run.states.to_string());
    output::table(out, runs)?;
    for note in &proposal.notes {
        writeln!(out, "note: {note}")?;
    }
    for left_out in &proposal.left_out {
        writeln!(out, "left out: {}: {}", left_out.path.display(), left_out.message)?;
    }
    let runs = counted(proposal.runs.len(), "run");
    let next = match proposal.missing().len() {
        0 => "check the guessed values, then run crumple build".into(),
        lines => format!(
            "incomplete, {} to fill in or to give as an option; then run crumple build",
            counted(lines, "line")
        ),
    };
    writeln!(out, "wrote {} ({runs}): {next}", output.display())
}

/// What the runs share: key, value, where it is from in a word.
fn chosen(proposal: &Proposal) -> [(&'static str, String, &'static str); 7] {
    fn described<T>(
        key: &'static str,
        proposed: &Proposed<T>,
        shown: impl Fn(&T) -> String,
    ) -> (&'static str, String, &'static str) {
        match proposed {
            Proposed::Found { value, evidence, .. } => (key, shown(value), evidence.word()),
            Proposed::Missing { .. } => (key, "?".into(), "fill in"),
        }
    }
    let half = if proposal.half_model { " (half model)" } else { "" };
    [
        described("group", &proposal.group, String::clone),
        described("units", &proposal.units, ToString::to_string),
        described("kind", &proposal.kind, |kind| format!("{}{half}", kind.name())),
        described("deflection", &proposal.deflection, ToString::to_string),
        described("force", &proposal.force, ToString::to_string),
        described("filter", &proposal.filter, |filter| String::from(*filter)),
        described("sampling", &proposal.sampling, ToString::to_string),
    ]
}
