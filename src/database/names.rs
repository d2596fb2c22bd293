//! Names of groups and cases: they appear in files, tables and HDF5 paths.

/// Longest name of a case or group, in bytes.
const MAX_NAME: usize = 200;

/// Why a text is not a name of a group or case, as a message says it of "it".
pub(crate) fn check(name: &str) -> Result<(), &'static str> {
    if name.trim().is_empty() || name == "." || name == ".." {
        Err("it is blank")
    } else if name.contains(|c: char| c.is_control() || c == '/') {
        Err("it may not contain \"/\" or control characters")
    } else if name.len() > MAX_NAME {
        Err("it has more than 200 bytes")
    } else {
        Ok(())
    }
}

/// The name as a message shows it.
pub(crate) fn shown(name: &str) -> String {
    name.chars().take(MAX_NAME).collect()
}
