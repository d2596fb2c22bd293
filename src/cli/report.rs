//! `crumple report`: one HTML page about a database and its runs.

use std::path::PathBuf;

use crate::clock::now_utc;
use crate::database::Database;
use crate::file::{is_same, write_whole};
use crate::report::{MethodSpeeds, ReportSettings, report};
use crate::unit::speed_m_per_s;

use super::arguments::{FileKind, one_of};
use super::output::{self, Bar};
use super::{
    CommandResult, Failure, GIVEN, GlobalOptions, Outcome, keep_input, keep_inputs, usage,
};

/// Write one self-contained HTML page: verdicts, curves, validation, predictions, methods, train results
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple report curves.h5 -o report.html
  crumple report curves.h5 scenario.toml train-set.toml -o report.html
  crumple report curves.h5 --group lead-car-wall --speed 50km/h --nsdm-seeds 3 -o report.html
  crumple report old.h5 new.h5 -o designs.html              # two designs side by side
  crumple report one.toml other.toml --author 'A. Engineer' -o trains.html
The page needs no network and no other file. Scenarios are run; one with a [reference] is compared with FE.")]
pub(super) struct Args {
    /// Curve databases, and scenarios (TOML) whose runs are shown; several of a kind are compared
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Page to write; "-" is standard output
    #[arg(short, long)]
    output: PathBuf,
    /// Group to show; may be repeated (default: all)
    #[arg(long)]
    group: Vec<String>,
    /// Speed of the predicted curves (default: the middle of each group's widest speed interval)
    #[arg(long, value_parser = speed_m_per_s)]
    speed: Option<f64>,
    /// Title of the page (default: the first file's name)
    #[arg(long)]
    title: Option<String>,
    /// Person responsible for the page
    #[arg(long)]
    author: Option<String>,
    /// Left-out speeds at which the methods are compared, half a second each
    #[arg(long, value_parser = one_of(METHODS), default_value = "worst")]
    methods: MethodSpeeds,
    /// Fits of the spring and damper (NSDM) for the table of methods, half a second each
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1000))]
    nsdm_seeds: u64,
    /// Seed of the forests
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

const METHODS: &[(&str, MethodSpeeds, &str)] = &[
    ("none", MethodSpeeds::None, "Methods are not compared"),
    ("worst", MethodSpeeds::Worst, "Where the chosen model has its largest error"),
    ("all", MethodSpeeds::All, "Every inner speed"),
];

/// The command as a shell takes it.
fn command() -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+%@".contains(c);
    let quoted = |argument: String| match argument.chars().all(is_plain) && !argument.is_empty() {
        true => argument,
        false => format!("'{}'", argument.replace('\'', r"'\''")),
    };
    let given = GIVEN.get().into_iter().flatten().skip(1);
    let arguments = given.map(|a| quoted(a.to_string_lossy().into_owned()));
    std::iter::once("crumple".to_string()).chain(arguments).collect::<Vec<_>>().join(" ")
}

pub(super) fn run(args: &Args, options: GlobalOptions) -> CommandResult {
    let (mut databases, mut scenarios) = (Vec::new(), Vec::new());
    for (k, file) in args.files.iter().enumerate() {
        if args.files[..k].iter().any(|other| is_same(other, file)) {
            return usage(format!("{} is named twice", file.display()));
        }
        match FileKind::of(file)? {
            FileKind::Database => {
                keep_input(file, &args.output)?;
                databases.push(file);
            }
            FileKind::Scenario => {
                keep_inputs(file, &args.output)?;
                scenarios.push(file.clone());
            }
            kind => {
                return usage(format!(
                    "{} is {}: a report is made of databases and scenarios",
                    file.display(),
                    kind.name()
                ));
            }
        }
    }
    options.keep_others(&args.output, FileKind::Curve)?;
    const OTHERS: [&str; 7] = ["pdf", "docx", "odt", "md", "txt", "svg", "png"];
    let extension = args.output.extension().map(|of| of.to_ascii_lowercase());
    if extension.is_some_and(|of| OTHERS.iter().any(|other| of == *other)) {
        return usage(format!("-o {}: a report is written as .html", args.output.display()));
    }
    let to_stdout = options.on_stdout([&args.output])?;
    let read = |path: &PathBuf| {
        let database = Database::read(path)?;
        database.all_groups(path)?;
        Ok((path.clone(), database))
    };
    let databases = databases.into_iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
    let settings = ReportSettings {
        title: args.title.clone(),
        author: args.author.clone(),
        made_at: now_utc(),
        command: command(),
        groups: args.group.clone(),
        speed_m_per_s: args.speed,
        methods: args.methods,
        nsdm_seeds: args.nsdm_seeds,
        seed: args.seed,
    };
    let bar = Bar::new(options, "reporting");
    let (page, warnings) = report(&databases, &scenarios, &[], &settings, |step| bar.step(step))?;
    drop(bar);
    let outcome = Outcome::warned_if(warnings > 0);
    if to_stdout {
        output::print_data(|out| out.write_all(page.as_bytes()))?;
        return Ok(outcome);
    }
    write_whole(&args.output, page.as_bytes())?;
    let document = document! { file: &args.output, bytes: page.len(), warnings: warnings };
    options.show(&document, |out| {
        let (file, kilobytes) = (args.output.display(), page.len().div_ceil(1000));
        writeln!(out, "wrote {file} ({kilobytes} kB); warnings in it: {warnings}")
    })?;
    Ok(outcome)
}
