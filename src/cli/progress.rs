//! Progress on standard error, on a terminal only.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::GlobalOptions;
use super::output::plain;

/// A spinner that names the step just done.
pub(super) struct Bar(Option<ProgressBar>);

impl Bar {
    pub(super) fn new(options: GlobalOptions, what: &'static str) -> Self {
        let visible = !options.quiet && std::io::stderr().is_terminal();
        Self(visible.then(|| {
            let bar = ProgressBar::new_spinner().with_message(what);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        }))
    }

    pub(super) fn step(&self, done: &str) {
        if let Some(bar) = &self.0 {
            bar.set_message(plain(done).into_owned());
        }
    }

    pub(super) fn end(self) {
        if let Some(bar) = self.0 {
            bar.finish_and_clear();
        }
    }
}

/// A bar over a known number of items, with the time that is left.
pub(super) struct Count(Option<ProgressBar>);

impl Count {
    pub(super) fn new(options: GlobalOptions, items: u64) -> Self {
        let visible = !options.quiet && std::io::stderr().is_terminal();
        Self(visible.then(|| {
            let bar = ProgressBar::new(items);
            let template = "{wide_bar} {human_pos}/{human_len}, {per_sec}, {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar
        }))
    }

    /// Sets where it begins; what was done before says nothing of the time left.
    pub(super) fn begin(&self, done: u64) {
        if let Some(bar) = &self.0 {
            bar.set_position(done);
            bar.reset_eta();
        }
    }

    pub(super) fn set(&self, done: u64) {
        if let Some(bar) = &self.0 {
            bar.set_position(done);
        }
    }

    pub(super) fn end(self) {
        if let Some(bar) = self.0 {
            bar.finish_and_clear();
        }
    }
}
