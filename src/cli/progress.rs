//! Progress on standard error, on a terminal only.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::GlobalOptions;
use super::output::plain;

/// A spinner that names the step just done, or a bar over a known number of items; gone when it is dropped.
pub(super) struct Bar(Option<ProgressBar>);

impl Bar {
    pub(super) fn new(options: GlobalOptions, what: &'static str) -> Self {
        Self::visible(options, || {
            let bar = ProgressBar::new_spinner().with_message(what);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        })
    }

    /// With the time that is left.
    pub(super) fn over(options: GlobalOptions, items: u64) -> Self {
        Self::visible(options, || {
            let bar = ProgressBar::new(items);
            let template = "{wide_bar} {human_pos}/{human_len}, {per_sec}, {eta} left";
            match ProgressStyle::with_template(template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        })
    }

    fn visible(options: GlobalOptions, make: impl FnOnce() -> ProgressBar) -> Self {
        Self((!options.quiet && std::io::stderr().is_terminal()).then(make))
    }

    pub(super) fn step(&self, done: &str) {
        if let Some(bar) = &self.0 {
            bar.set_message(plain(done).into_owned());
        }
    }

    /// Sets how many items are done; what was done before the first call says nothing of the time left.
    pub(super) fn set(&self, done: u64, is_first: bool) {
        if let Some(bar) = &self.0 {
            bar.set_position(done);
            if is_first {
                bar.reset_eta();
            }
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
