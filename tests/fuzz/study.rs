//! Target of the study parser: any text gives a study or an error.

use std::path::Path;

use crumple::study;

pub fn target(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = study::parse(Path::new("study.toml"), text) {
        assert!(error.to_string().starts_with("study.toml:"));
    }
}
