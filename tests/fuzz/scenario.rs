//! Fuzz target of the scenario parser: any text gives a scenario or an error.
#![no_main]

use std::path::Path;

use crumple::scenario;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Err(error) = scenario::parse(Path::new("scenario.toml"), text) {
        assert!(error.to_string().starts_with("scenario.toml:"));
    }
});
