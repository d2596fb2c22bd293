//! The impact speed of a run.

use super::error::ExtractError;
use super::input::Setup;
use super::record::Record;
use super::remarks::Notes;
use crate::unit::{Speed, km_per_h};

/// Two speeds of one impact may differ by this share before it is reported.
const SAME_SPEED: f64 = 0.01;

/// Source of the impact speed.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum SpeedBy {
    Manifest,
    Record,
    Deck,
}

pub(super) struct ImpactSpeed {
    pub speed: Speed,
    pub by: SpeedBy,
    /// What the record shows before contact, or in its first state; `None` where the file has
    /// no velocities.
    pub recorded_m_per_s: Option<f64>,
}

impl ImpactSpeed {
    /// The manifest's speed, else the record's, else the deck's. Where two of them differ, both
    /// are reported. `before`: the last state that contact has not changed.
    pub(crate) fn of(
        setup: &Setup<'_>,
        record: &Record,
        before: usize,
    ) -> Result<(Self, Notes), ExtractError> {
        let mut remarks = Notes::default();
        let differ = |a: f64, b: f64| (a - b).abs() > SAME_SPEED * a.max(b);
        let first = record.first_rate_m_per_s.abs();
        let recorded = record.missing_velocity.is_none().then(|| record.rate_m_per_s[before].abs());
        if let Some(recorded) = recorded
            && differ(first, recorded)
        {
            remarks.warn(format!(
                "speed: the first state moves at {}, the last before contact at {}; the latter is used",
                km_per_h(first),
                km_per_h(recorded)
            ));
        }
        let (m_per_s, by, name) = match (setup.manifest_speed_m_per_s, recorded) {
            (Some(speed), _) => (speed, SpeedBy::Manifest, "manifest's"),
            (None, Some(speed)) => (speed, SpeedBy::Record, "record's"),
            (None, None) => match &setup.deck_speed {
                Some(deck) => (deck.m_per_s, SpeedBy::Deck, "deck's"),
                None => {
                    let component = record.missing_velocity.clone().unwrap_or_default();
                    return Err(ExtractError::NoSpeed { component });
                }
            },
        };
        let deck = setup.deck_speed.as_ref();
        let of_record = recorded.map(|v| ("the record".to_string(), v));
        let of_deck = deck.map(|d| (format!("the deck {}", d.place), d.m_per_s));
        for (who, other) in of_record.into_iter().chain(of_deck) {
            if differ(m_per_s, other) {
                remarks.warn(format!(
                    "speed: {who} states {}; the {name} {} is used",
                    km_per_h(other),
                    km_per_h(m_per_s)
                ));
            }
        }
        match (by, deck) {
            (SpeedBy::Record, _) => {
                remarks.note(format!("speed: {} taken from the record", km_per_h(m_per_s)));
            }
            (SpeedBy::Deck, Some(deck)) => remarks.note(format!(
                "speed: {} taken from the deck {}",
                km_per_h(m_per_s),
                deck.place
            )),
            _ => {}
        }
        if m_per_s > 0.0 {
            let speed = Speed { m_per_s, kind: setup.kind };
            Ok((Self { speed, by, recorded_m_per_s: recorded }, remarks))
        } else {
            Err(ExtractError::Standing)
        }
    }
}
