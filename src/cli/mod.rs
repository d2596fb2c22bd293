//! The commands: one file each, with its arguments and a `run` that calls the library.

// `document!` calls the type of a field as the field.
#![allow(non_camel_case_types)]

mod arguments;
mod build;
mod compare;
mod db;
mod demo;
mod export;
mod export_input;
mod histories;
mod init;
mod inspect;
mod output;
mod plot;
mod predict;
mod rate;
mod report;
mod shell;
mod simulate;
mod sweep;
mod train;
mod validate;

use std::cell::Cell;
use std::error::Error;
use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;

use crate::error::ErrorCode;
use crate::failure::{self, DONE, DONE_WITH_WARNINGS, ErrorDocument, FAILED, USAGE};
use crate::file::{self, is_same};
use crate::order;
use crate::{database, os, solver};
use arguments::{FileKind, is_others_deck};
use clap::{FromArgMatches, Parser, Subcommand};
use serde::Serialize;

#[derive(Parser)]
#[command(name = "crumple", version, about, propagate_version = true)]
struct Cli {
    #[command(flatten)]
    options: GlobalOptions,
    #[command(subcommand)]
    command: Command,
}

/// Heading in the help.
const GLOBAL: &str = "Global options";

/// Options that every command takes.
#[derive(clap::Args, Clone, Copy)]
pub(crate) struct GlobalOptions {
    /// Print one JSON document on standard output instead of text
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub json: bool,
    /// Print errors only, and what --json or -o - writes to standard output
    #[arg(short, long, global = true, help_heading = GLOBAL)]
    pub quiet: bool,
    /// Print every table and line of a result, and every warning
    #[arg(short, long, global = true, help_heading = GLOBAL, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Exit with code 3 if there was damage or a warning
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub strict: bool,
    /// Accept databases, models and unfinished sweeps that were changed after they were written
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub accept_changed: bool,
    /// Replace an output that exists and is of another kind (a database, a model, a study, a solver file, another tool's input), or the study of init
    /// (build, db add and db copy add to a database, and replace no other file)
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub overwrite: bool,
}

#[derive(Subcommand)]
enum Command {
    Init(init::Args),
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
    Export(Box<export::Args>),
    Plot(Box<plot::Args>),
    Report(report::Args),
    Demo(demo::Args),
    Completions(shell::Completions),
    Man(shell::Man),
}

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    Clean,
    /// Done, with damage in the input or warnings about the result.
    Warned,
    /// Part of the work could not be done; what could be done was.
    Partly,
}

/// Warnings that are printed at once without --verbose; a single further one is printed as well.
const SHOWN_WARNINGS: usize = 20;

/// Where many cases have warnings, the first of them, and how many more there are.
fn shown_of(mut warnings: Vec<String>) -> Vec<String> {
    if warnings.len() > SHOWN_WARNINGS + 1 {
        let further = warnings.split_off(SHOWN_WARNINGS).len();
        warnings.push(format!("{further} further warnings: --verbose prints them"));
    }
    warnings
}

impl Outcome {
    fn warned_if(is_warned: bool) -> Self {
        if is_warned { Self::Warned } else { Self::Clean }
    }
}

/// Why a command did not do its work.
pub(crate) type Failure = Box<dyn Error>;

pub(crate) type CommandResult = Result<Outcome, Failure>;

/// Refuses to write over what is read.
fn keep_input(input: &Path, output: &Path) -> Result<(), Failure> {
    if is_same(input, output) {
        usage(format!("-o {} names the input itself: name another file", output.display()))
    } else {
        Ok(())
    }
}

impl GlobalOptions {
    /// Refuses to write over a file of a kind that cannot be made again by the same command: what is
    /// worth keeping may stand under a name that was mistyped. `own` is the kind that the command writes.
    fn keep_others(self, output: &Path, own: FileKind) -> Result<(), Failure> {
        let there = file::if_there(std::fs::metadata(output));
        let there = there.map_err(|source| crate::error::Error::io(output, source))?;
        let is_there = there.is_some_and(|m| m.is_file() && m.len() > 0);
        if self.overwrite || is_stdout(output) || !is_there {
            return Ok(());
        }
        let kind = FileKind::of(output)?;
        let what = match kind {
            FileKind::Scenario => "a study or scenario",
            FileKind::Solver if solver::is_output(output) => "a solver's file",
            FileKind::Solver if is_others_deck(output)? => "an input that crumple did not write",
            FileKind::Database => "an HDF5 file",
            FileKind::Model => "a model",
            FileKind::Sweep => "a sweep's result",
            _ if own == FileKind::Model => "a file of another kind",
            FileKind::Solver | FileKind::Curve | FileKind::Result => return Ok(()),
        };
        if kind == own && !(kind == FileKind::Database && database::is_database(output)) {
            return Ok(());
        }
        usage(format!(
            "-o {} exists and is {what}: name another file, or replace it with --overwrite",
            output.display()
        ))
    }
}

/// Refuses to write over a scenario or a file that it names.
fn keep_inputs(scenario: &Path, output: &Path) -> Result<(), Failure> {
    keep_input(scenario, output)?;
    // A scenario that cannot be read is reported when it is run.
    let Ok(read) = crate::scenario::read(scenario) else { return Ok(()) };
    for file in read.files(scenario) {
        keep_input(&file, output)?;
    }
    Ok(())
}

/// Whether an output argument means standard output.
fn is_stdout(output: &Path) -> bool {
    output == Path::new("-")
}

/// A wrong use of the command line.
fn usage_error(message: impl Display) -> Failure {
    crate::error::error!(Usage, "{message}").into()
}

fn usage<T>(message: impl Display) -> Result<T, Failure> {
    Err(usage_error(message))
}

/// A failure with a message of the command's own.
fn failed(message: impl Into<String>) -> Failure {
    message.into().into()
}

/// A failure about a file.
fn failed_at(path: &Path, error: impl Display) -> Failure {
    failed(format!("{}: {error}", path.display()))
}

impl GlobalOptions {
    /// Whether one of the outputs is standard output, which takes one thing only.
    fn on_stdout<'a>(
        self,
        outputs: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<bool, Failure> {
        match outputs.into_iter().filter(|path| is_stdout(path)).count() {
            1.. if self.json => {
                usage("-o - and --json both write to standard output: give one of them")
            }
            2.. => usage("standard output can take only one of them: one \"-o -\", or --json"),
            count => Ok(count == 1),
        }
    }

    /// A result on standard output: as one JSON document, or as text.
    fn show(
        self,
        document: &impl Serialize,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> CommandResult {
        if self.json { output::print_json(document) } else { self.print(text) }?;
        Ok(Outcome::Clean)
    }

    /// The text of a result on standard output.
    fn print(self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
        if self.quiet { Ok(()) } else { output::print(write) }
    }

    /// A warning on standard error.
    pub(crate) fn warn(self, text: &str) {
        WARNED.set(true);
        if !self.quiet {
            output::eprint_line(&format!("warning: {text}"));
        }
    }

    /// Warnings on standard error, and the outcome of what has them; a document's reader gets them all.
    fn warn_all<W: Display>(self, warnings: impl IntoIterator<Item = W>) -> Outcome {
        let mut warnings: Vec<String> = warnings.into_iter().map(|w| w.to_string()).collect();
        if !self.verbose && !self.json {
            warnings = shown_of(warnings);
        }
        warnings.iter().for_each(|warning| self.warn(warning));
        Outcome::warned_if(!warnings.is_empty())
    }

    /// Warnings about a file.
    fn warn_of<W: Display>(self, path: &Path, warnings: &[W]) -> Outcome {
        self.warn_all(warnings.iter().map(|warning| format!("{}: {warning}", path.display())))
    }

    /// Notes of an export on standard error; a document has them itself.
    fn say_notes(self, notes: &[String]) {
        if !self.quiet && !self.json {
            notes.iter().for_each(|note| output::eprint_line(&format!("note: {note}")));
        }
    }
}

thread_local! {
    /// Whether the command has warned.
    static WARNED: Cell<bool> = const { Cell::new(false) };
}

/// The command line that was given, for what repeats it.
static GIVEN: OnceLock<Vec<OsString>> = OnceLock::new();

/// The command line; a wrong one, and what `--help` and `--version` ask for, ends the program here, with its exit code.
fn parsed(arguments: Vec<OsString>) -> Result<Cli, u8> {
    let _ = GIVEN.set(arguments.clone());
    if arguments.len() < 2 {
        output::eprint_line(&shell::short_help());
        return Err(USAGE);
    }
    let wants_json =
        arguments.iter().take_while(|word| *word != "--").any(|word| *word == "--json");
    let matches = shell::command().try_get_matches_from(flags_first(arguments));
    matches.and_then(|matches| Cli::from_arg_matches(&matches)).map_err(|error| {
        if wants_json && error.use_stderr() {
            // Without the word before it, and without the usage and the way to the help after it.
            let text = error.render().to_string();
            let said = text.split("\n\nUsage:").next().unwrap_or_default();
            let said = said.split("\n\nFor more information").next().unwrap_or_default();
            let said = said.trim().trim_start_matches("error: ");
            print_document(&ErrorDocument::new(&*usage_error(shell::one_line(said))));
        } else {
            // With standard error closed nobody would read it.
            let _ = error.print();
        }
        if error.use_stderr() { USAGE } else { DONE }
    })
}

/// Global flags between `sweep` and its `merge` go before both: clap takes them for those of a sweep.
fn flags_first(mut arguments: Vec<OsString>) -> Vec<OsString> {
    const FLAGS: [&str; 8] = [
        "--json",
        "-q",
        "--quiet",
        "-v",
        "--verbose",
        "--strict",
        "--accept-changed",
        "--overwrite",
    ];
    let is_flag = |word: &OsString| FLAGS.iter().any(|flag| *word == **flag);
    let mut words = (1..arguments.len()).filter(|&k| !is_flag(&arguments[k]));
    if let (Some(first), Some(second)) = (words.next(), words.next())
        && (arguments[first] == "sweep" && arguments[second] == "merge")
    {
        order::sort_by_key(&mut arguments[first..second], |word| !is_flag(word));
    }
    arguments
}

/// The document of an error; without standard output its message.
fn print_document(document: &ErrorDocument) {
    if output::print_json(document).is_err() {
        output::eprint_line(&format!("error: {}", document.error.message));
    }
}

pub fn main() -> ExitCode {
    ExitCode::from(run_program(std::env::args_os().collect()))
}

/// The program with these arguments, the first its own name; its exit code.
pub fn run_program(arguments: Vec<OsString>) -> u8 {
    os::survive_file_size_limit();
    let cli = match parsed(arguments) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let options = cli.options;
    file::accept_changed(options.accept_changed);
    WARNED.set(false);
    match run(cli.command, options).map(|outcome| outcome.max(Outcome::warned_if(WARNED.get()))) {
        Ok(Outcome::Warned) if options.strict => DONE_WITH_WARNINGS,
        Ok(Outcome::Clean | Outcome::Warned) => DONE,
        Ok(Outcome::Partly) => FAILED,
        Err(error) if output::is_closed_pipe(&*error) => DONE,
        Err(error) => {
            if options.json {
                print_document(&ErrorDocument::new(&*error));
            } else {
                print_error(&*error);
            }
            if failure::code(&*error) == ErrorCode::Usage { USAGE } else { FAILED }
        }
    }
}

fn run(command: Command, options: GlobalOptions) -> CommandResult {
    match command {
        Command::Init(args) => init::run(&args, options),
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
        Command::Plot(args) => plot::run(&args, options),
        Command::Report(args) => report::run(&args, options),
        Command::Demo(args) => demo::run(&args, options),
        Command::Completions(args) => shell::completions(&args, options),
        Command::Man(args) => shell::man(&args, options),
    }
}

/// The error with the line of the file that it is about, then its causes.
fn print_error(error: &(dyn Error + 'static)) {
    output::eprint_line(&format!("error: {error}"));
    output::eprint_excerpt(failure::place(error));
    for cause in failure::causes(error) {
        output::eprint_line(&format!("  because: {cause}"));
    }
}

#[cfg(test)]
mod tests {
    use schemars::schema_for;

    /// To write them again: CRUMPLE_WRITE_SCHEMAS=1 cargo test --lib schemas
    #[test]
    fn schemas_are_those_of_the_types() {
        for (name, schema) in [
            ("study", schema_for!(crate::study::Manifest)),
            ("scenario", schema_for!(crate::scenario::Scenario)),
            ("plan", schema_for!(crate::plan::PlanFile)),
            ("predicted_curve", schema_for!(crate::surrogate::PredictedCurve)),
            ("validation", schema_for!(crate::assess::Report)),
            ("rating", schema_for!(crate::rating::Rating)),
            ("acceptance", schema_for!(crate::rating::acceptance::RunAcceptance)),
            ("error", schema_for!(super::ErrorDocument)),
        ] {
            let path = format!("{}/schemas/{name}.schema.json", env!("CARGO_MANIFEST_DIR"));
            let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
            if std::env::var_os("CRUMPLE_WRITE_SCHEMAS").is_some() {
                std::fs::write(&path, &text).unwrap();
            }
            let committed = std::fs::read_to_string(&path).unwrap_or_default();
            assert!(committed == text, "{name} is not what the types say: see above");
        }
    }
}
