//! Progress on standard error, on a terminal only.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::ProgressBar;

use super::Manners;

/// A spinner that names the step just done.
pub struct Bar(Option<ProgressBar>);

impl Bar {
    pub fn new(manners: Manners, what: &'static str) -> Self {
        let visible = !manners.quiet && std::io::stderr().is_terminal();
        Self(visible.then(|| {
            let bar = ProgressBar::new_spinner().with_message(what);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        }))
    }

    pub fn step(&self, done: &str) {
        if let Some(bar) = &self.0 {
            bar.set_message(done.to_string());
        }
    }

    pub fn end(self) {
        if let Some(bar) = self.0 {
            bar.finish_and_clear();
        }
    }
}
