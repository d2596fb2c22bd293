//! The current date, for files that record when they were made.

use std::time::{SystemTime, UNIX_EPOCH};

/// Now, in UTC (ISO 8601): `2026-05-04T13:37:00Z`. If the environment's
/// `SOURCE_DATE_EPOCH` holds seconds since 1970 it is that time, so that the same inputs give the
/// same bytes (reproducible-builds.org/specs/source-date-epoch).
pub(crate) fn now_utc() -> String {
    let stated = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok());
    let clock = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    iso_8601(stated.filter(|&seconds| seconds <= LATEST).unwrap_or_else(clock))
}

/// The last second of the year 9999: years beyond it have more digits.
const LATEST: u64 = 253_402_300_799;
const DAY: u64 = 86_400;

/// The date and time so many seconds after the beginning of 1970, without leap seconds.
fn iso_8601(seconds: u64) -> String {
    let (days, rest) = (seconds / DAY, seconds % DAY);
    let (year, month, day) = date(days);
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day of the Gregorian calendar so many days after the beginning of 1970.
fn date(mut days: u64) -> (u64, usize, u64) {
    let mut year = 1970;
    let is_leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let february = 28 + u64::from(is_leap(year));
    let months = [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while days >= months[month] {
        days -= months[month];
        month += 1;
    }
    (year, month + 1, days + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates() {
        assert_eq!(iso_8601(0), "1970-01-01T00:00:00Z");
        assert_eq!(iso_8601(951_782_399), "2000-02-28T23:59:59Z");
        assert_eq!(iso_8601(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(iso_8601(1_000_000_000), "2001-09-09T01:46:40Z");
        assert_eq!(iso_8601(4_107_542_400), "2100-03-01T00:00:00Z");
        assert_eq!(iso_8601(LATEST), "9999-12-31T23:59:59Z");
    }
}
