//! Target of the scenario parser: any text gives a scenario or an error.

use std::path::Path;

use crumple::scenario;

pub fn target(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = scenario::parse(Path::new("scenario.toml"), text) {
        assert!(error.to_string().starts_with("scenario.toml:"));
    }
}
