//! `crumple completions` and `crumple man`: made from the command line's own definition.

use clap::CommandFactory;
use serde::Serialize;

use super::output;
use super::{Cli, CommandResult, GlobalOptions, Outcome};

/// Print a completion script for a shell
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple completions bash > /etc/bash_completion.d/crumple
  crumple completions zsh > ~/.zfunc/_crumple")]
pub struct Completions {
    /// Shell to complete in
    shell: clap_complete::Shell,
}

/// Print the manual page
#[derive(clap::Args)]
#[command(after_help = "Examples:
  crumple man > crumple.1
  crumple man | man -l -")]
pub struct Man {}

pub fn completions(args: &Completions, options: GlobalOptions) -> CommandResult {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "crumple", &mut script);
    print(&script, options)
}

pub fn man(_: &Man, options: GlobalOptions) -> CommandResult {
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page)?;
    print(&page, options)
}

#[derive(Serialize)]
struct Text {
    text: String,
}

fn print(bytes: &[u8], options: GlobalOptions) -> CommandResult {
    if options.json {
        output::print_json(&Text { text: String::from_utf8_lossy(bytes).into_owned() })?;
    } else {
        output::print_data(|out| out.write_all(bytes))?;
    }
    Ok(Outcome::Clean)
}
