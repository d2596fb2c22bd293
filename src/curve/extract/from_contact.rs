//! The record from contact on: time and deflection count from it.

use super::error::ExtractError;
use super::record::Record;
use super::remarks::Notes;
use crate::curve::Curve;

/// The record from contact on.
pub(super) struct FromContact {
    pub curve: Curve,
    pub closing_m_per_s: Vec<f64>,
    pub time_s: f64,
    /// The last state that contact has not changed.
    pub before: usize,
}

impl FromContact {
    /// Time and deflection counted from contact, between two states where it lies there.
    pub(crate) fn of(
        record: &Record,
        contact_s: f64,
        offset_m: f64,
    ) -> Result<(Self, Notes), ExtractError> {
        let mut remarks = Notes::default();
        let contact_m = record.at(&record.deflection_m, contact_s)?;
        // A rebound can travel further than the crush: what the impact does first counts.
        let direction = if record.at(&record.rate_m_per_s, contact_s)? < 0.0 { -1.0 } else { 1.0 };
        let travel = |i: usize| direction * (record.deflection_m[i] - contact_m);
        let next = record.time_s.partition_point(|&t| t <= contact_s);
        let most_m = (next..record.time_s.len()).map(travel).fold(0.0, f64::max);
        if most_m <= 0.0 {
            return Err(ExtractError::NoDeflection);
        }
        if direction < 0.0 {
            remarks.note("deflection: sign flipped, positive in compression");
        }
        let start_s = if offset_m >= 0.0 {
            contact_s
        } else {
            closed_s(record, contact_s, -offset_m, most_m, travel)?
        };
        if offset_m != 0.0 {
            remarks.note(format!("offset: the deflection at contact is {} mm", offset_m * 1e3));
        }
        let next = record.time_s.partition_point(|&t| t <= start_s);
        let (mut time_s, mut deflection_m) = (vec![0.0], vec![offset_m.max(0.0)]);
        let mut force_n = vec![record.at(&record.force_n, start_s)?];
        let mut closing_m_per_s = vec![direction * record.at(&record.rate_m_per_s, start_s)?];
        for i in next..record.time_s.len() {
            time_s.push(record.time_s[i] - start_s);
            deflection_m.push(travel(i) + offset_m);
            force_n.push(record.force_n[i]);
            closing_m_per_s.push(direction * record.rate_m_per_s[i]);
        }
        let contact = Self {
            curve: Curve::new(time_s, deflection_m, force_n)?,
            closing_m_per_s,
            time_s: start_s,
            before: record.time_s.partition_point(|&t| t <= contact_s).saturating_sub(1),
        };
        Ok((contact, remarks))
    }
}

/// When the bodies have moved by `slack_m` after contact: where the surfaces meet later than
/// found, the curve begins where they do.
fn closed_s(
    record: &Record,
    contact_s: f64,
    slack_m: f64,
    most_m: f64,
    travel: impl Fn(usize) -> f64,
) -> Result<f64, ExtractError> {
    let next = record.time_s.partition_point(|&t| t <= contact_s);
    let i = (next..record.time_s.len())
        .find(|&i| travel(i) >= slack_m)
        .ok_or(ExtractError::OffsetTooLarge { offset_m: -slack_m, most_m })?;
    let (from_s, from_m) =
        if i == next { (contact_s, 0.0) } else { (record.time_s[i - 1], travel(i - 1)) };
    let share = (slack_m - from_m) / (travel(i) - from_m);
    Ok(from_s + share * (record.time_s[i] - from_s))
}
