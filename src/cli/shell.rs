//! `crumple completions`, `crumple man` and the help, generated from the definition of the command line.

use std::path::{Path, PathBuf};

use crate::file::write_whole;
use clap::{Command, CommandFactory};

use super::arguments::named;
use super::{Cli, CommandResult, GLOBAL, GlobalOptions, Outcome, output};

/// Print a completion script for a shell
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple completions bash > /etc/bash_completion.d/crumple
  crumple completions zsh > ~/.zfunc/_crumple")]
pub(super) struct Completions {
    /// Shell to complete in
    shell: clap_complete::Shell,
}

/// Print the manual page, or write those of all commands
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple man | man -l -
  crumple man -o ~/.local/share/man/man1      # then: man crumple-build")]
pub(super) struct Man {
    /// Folder for crumple.1 and a page of every command, such as crumple-build.1; created if it does
    /// not exist
    #[arg(short, long, value_name = "DIR", value_parser = named())]
    output: Option<PathBuf>,
}

/// The command line's definition, with the options that every command takes under one heading.
pub(super) fn command() -> Command {
    let mut command = Cli::command();
    // Makes the commands' own help and version options, which otherwise come too late.
    command.build();
    under_one_heading(command)
}

fn under_one_heading(command: Command) -> Command {
    let global = |id: &str| ["help", "version"].contains(&id);
    let command = command.mut_args(|arg| {
        if global(arg.get_id().as_str()) {
            arg.help_heading(GLOBAL).display_order(1000)
        } else {
            arg
        }
    });
    command.mut_subcommands(under_one_heading)
}

/// The usual order of work.
const ORDER: [(&str, &str); 9] = [
    ("inspect RUNS", "what the run folders hold"),
    ("init RUNS", "a study of them, in study.toml"),
    ("build", "their curves, in curves.h5"),
    ("validate curves.h5", "which model predicts best"),
    ("train curves.h5 -o M", "fit it"),
    ("predict M --speed 50km/h", "the curve at a speed never run"),
    ("init --scenario M", "a crash with it, in scenario.toml"),
    ("simulate scenario.toml", "a train, vehicle by vehicle"),
    ("report curves.h5 -o report.html", "all of it on one page"),
];

/// What `crumple` says without arguments, for a terminal of at least 60 columns.
pub(super) fn short_help() -> String {
    let about = Cli::command().get_about().map(ToString::to_string).unwrap_or_default();
    let is_narrow = output::error_width().is_some_and(|width| width < 80);
    let about = if is_narrow { about.replacen(" from ", "\nfrom ", 1) } else { about };
    let mut text =
        format!("{about}\n\nUsage: crumple COMMAND [OPTIONS]\n\nThe usual order of work:\n");
    for (command, what) in ORDER {
        text += &if is_narrow {
            format!("  crumple {command}\n      {what}\n")
        } else {
            format!("  crumple {command:<34}{what}\n")
        };
    }
    text + "\ncrumple demo shows all of it on bundled runs;\n\
        crumple --help lists every command,\n\
        crumple COMMAND --help its options."
}

/// A text of several lines as one.
pub(super) fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}

pub(super) fn completions(args: &Completions, options: GlobalOptions) -> CommandResult {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "crumple", &mut script);
    print(&script, options)
}

pub(super) fn man(args: &Man, options: GlobalOptions) -> CommandResult {
    if let Some(folder) = &args.output {
        return write_pages(folder, options);
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page)?;
    print(&page, options)
}

/// Writes a page of every command and of each of its own commands.
fn write_pages(folder: &Path, options: GlobalOptions) -> CommandResult {
    std::fs::create_dir_all(folder).map_err(|source| {
        let message = format!("cannot create {}: {source}", folder.display());
        std::io::Error::new(source.kind(), message)
    })?;
    let mut command = Cli::command();
    command.build();
    let mut written = Vec::new();
    pages(&command, "crumple", folder, &mut written)?;
    options.show(&document! { written: &written }, |out| {
        written.iter().try_for_each(|path| writeln!(out, "wrote {}", path.display()))
    })
}

fn pages(
    command: &Command,
    name: &str,
    folder: &Path,
    written: &mut Vec<PathBuf>,
) -> Result<(), super::Failure> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    let path = folder.join(format!("{name}.1"));
    write_whole(&path, &page)?;
    written.push(path);
    for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help") {
        pages(sub, &format!("{name}-{}", sub.get_name()), folder, written)?;
    }
    Ok(())
}

fn print(bytes: &[u8], options: GlobalOptions) -> CommandResult {
    if options.json {
        output::print_json(&document! { text: String::from_utf8_lossy(bytes) })?;
    } else {
        output::print_data(|out| out.write_all(bytes))?;
    }
    Ok(Outcome::Clean)
}
