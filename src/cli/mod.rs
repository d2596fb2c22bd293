//! The commands: one file each, with its arguments and a `run` that calls the library.

mod arguments;
mod build;
mod compare;
mod db;
mod db_add;
mod deck_report;
mod demo;
mod export;
mod export_input;
mod export_output;
mod histories;
mod inspect;
mod output;
mod plot;
mod predict;
mod progress;
mod rate;
mod run_channels;
mod shell;
mod simulate;
mod sweep;
mod train;
mod validate;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
#[cfg(unix)]
use std::sync::Arc;

use clap::{Parser, Subcommand};
use crumple::file::is_same;

/// Everything went well.
const DONE: u8 = 0;
/// The command could not do its work.
const FAILED: u8 = 1;
/// The command line makes no sense. clap uses the same code.
const USAGE: u8 = 2;
/// Done, but with damage or warnings, and `--strict` was given.
const DONE_WITH_WARNINGS: u8 = 3;

#[derive(Parser)]
#[command(name = "crumple", version, about, propagate_version = true)]
struct Cli {
    #[command(flatten)]
    options: GlobalOptions,
    #[command(subcommand)]
    command: Command,
}

/// Options that every command takes.
#[derive(clap::Args, Clone, Copy)]
pub struct GlobalOptions {
    /// Print one JSON document on standard output instead of text
    #[arg(long, global = true)]
    pub json: bool,
    /// Print no progress and no warnings
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Exit with code 3 if there was damage or a warning
    #[arg(long, global = true)]
    pub strict: bool,
}

#[derive(Subcommand)]
enum Command {
    Inspect(inspect::Args),
    Histories(histories::Args),
    Build(build::Args),
    Db(db::Args),
    Validate(validate::Args),
    Train(train::Args),
    Predict(predict::Args),
    Simulate(simulate::Args),
    Sweep(sweep::Args),
    Compare(compare::Args),
    Rate(Box<rate::Args>),
    Export(export::Args),
    Demo(demo::Args),
    Completions(shell::Completions),
    Man(shell::Man),
}

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    Clean,
    /// Done, with damage in the input or warnings about the result.
    Warned,
    /// Part of the work could not be done; what could be done was.
    Partly,
}

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// The arguments do not fit together.
    Usage(String),
    Failed(Box<dyn Error>),
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error))
    }
}

pub type CommandResult = Result<Outcome, Failure>;

/// Refuses to write over what is read.
fn keep_input(input: &Path, output: &Path) -> Result<(), Failure> {
    match is_same(input, output) {
        true => Err(Failure::Usage(format!(
            "-o {} names the input itself: name another file",
            output.display()
        ))),
        false => Ok(()),
    }
}

/// Refuses to write over a scenario or a file that it names.
fn keep_inputs(scenario: &Path, output: &Path) -> Result<(), Failure> {
    keep_input(scenario, output)?;
    // A scenario that cannot be read is reported by whoever runs it.
    let Ok(read) = crumple::scenario::read(scenario) else { return Ok(()) };
    for file in read.files(scenario) {
        keep_input(&file, output)?;
    }
    Ok(())
}

/// Whether an output argument means standard output.
fn is_stdout(output: &Path) -> bool {
    output == Path::new("-")
}

impl GlobalOptions {
    /// A warning on standard error.
    pub fn warn(self, text: &str) {
        if !self.quiet {
            output::say(&format!("warning: {text}"));
        }
    }
}

/// Lets a write beyond the limit on the size of files (`ulimit -f`) fail, with a message that
/// names the file, where the signal's default would end the process without one.
#[cfg(unix)]
fn survive_file_size_limit() {
    // Without the handler the process ends, and the old file is there all the same.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

#[cfg(not(unix))]
fn survive_file_size_limit() {}

pub fn main() -> ExitCode {
    survive_file_size_limit();
    let cli = Cli::parse();
    let options = cli.options;
    let result = match cli.command {
        Command::Inspect(args) => inspect::run(&args, options),
        Command::Histories(args) => histories::run(&args, options),
        Command::Build(args) => build::run(&args, options),
        Command::Db(args) => db::run(&args, options),
        Command::Validate(args) => validate::run(&args, options),
        Command::Train(args) => train::run(&args, options),
        Command::Predict(args) => predict::run(&args, options),
        Command::Simulate(args) => simulate::run(&args, options),
        Command::Sweep(args) => sweep::run(&args, options),
        Command::Compare(args) => compare::run(&args, options),
        Command::Rate(args) => rate::run(&args, options),
        Command::Export(args) => export::run(&args, options),
        Command::Demo(args) => demo::run(&args, options),
        Command::Completions(args) => shell::completions(&args, options),
        Command::Man(args) => shell::man(&args, options),
    };
    ExitCode::from(match result {
        Ok(Outcome::Clean) => DONE,
        Ok(Outcome::Warned) if options.strict => DONE_WITH_WARNINGS,
        Ok(Outcome::Warned) => DONE,
        Ok(Outcome::Partly) => FAILED,
        Err(Failure::Usage(message)) => {
            output::say(&format!("error: {message}"));
            USAGE
        }
        Err(Failure::Failed(error)) if output::is_closed_pipe(&*error) => DONE,
        Err(Failure::Failed(error)) => {
            print_chain(&*error);
            FAILED
        }
    })
}

/// The error, then its causes; causes that the message already contains are left out.
fn print_chain(error: &dyn Error) {
    let mut shown = error.to_string();
    output::say(&format!("error: {shown}"));
    let mut source = error.source();
    while let Some(cause) = source {
        let text = cause.to_string();
        if !shown.contains(&text) {
            output::say(&format!("  because: {text}"));
        }
        shown = text;
        source = cause.source();
    }
}
