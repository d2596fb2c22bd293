//! Fuzz target of the study parser: any text gives a study or an error.
#![no_main]

use std::path::Path;

use crumple::study;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Err(error) = study::parse(Path::new("study.toml"), text) {
        assert!(error.to_string().starts_with("study.toml:"));
    }
});
