//! The terminal's width, for what is fitted to it. What goes into a pipe or file is fitted to nothing.

use std::io::{self, IsTerminal};

use terminal_size::{Width, terminal_size_of};

/// Narrower is taken as this.
const LEAST: usize = 40;

/// Characters in a line of the terminal that standard output is; `None` if it is none.
pub(super) fn width() -> Option<usize> {
    let out = io::stdout();
    out.is_terminal().then(|| stated().or_else(|| size(&out)).unwrap_or(80).max(LEAST))
}

/// The same of standard error.
pub(super) fn error_width() -> Option<usize> {
    let err = io::stderr();
    err.is_terminal().then(|| stated().or_else(|| size(&err)).unwrap_or(80).max(LEAST))
}

/// What the user asks for, whatever the terminal has.
fn stated() -> Option<usize> {
    std::env::var("COLUMNS").ok()?.parse().ok().filter(|width| *width > 0)
}

#[cfg(unix)]
fn size(stream: &impl std::os::fd::AsFd) -> Option<usize> {
    terminal_size_of(stream).map(|(Width(width), _)| width.into()).filter(|width| *width > 0)
}

#[cfg(windows)]
fn size(stream: &impl std::os::windows::io::AsHandle) -> Option<usize> {
    terminal_size_of(stream).map(|(Width(width), _)| width.into()).filter(|width| *width > 0)
}
