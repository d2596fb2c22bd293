//! Separated values: what separates the columns of a table that somebody else has written.

/// What separates the columns of the first line of `text` that is no comment (`#`): a comma, a
/// semicolon or a tab.
pub fn separator(text: &[u8]) -> u8 {
    let lines = text.split(|&byte| byte == b'\n');
    let header = lines.into_iter().find(|line| !line.is_empty() && line[0] != b'#');
    let has = |byte: u8| header.is_some_and(|line| line.contains(&byte));
    [b',', b';', b'\t'].into_iter().find(|&byte| has(byte)).unwrap_or(b',')
}
