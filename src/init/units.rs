//! The unit system of a run: what its deck states, or the one in which its impact is possible.
//!
//! Momentum and energy balance in every consistent system, so only magnitudes help: an impact
//! has a speed, a crush, a time to the maximum crush, a mean deceleration and a mass that vehicles
//! have.

use super::write::Evidence::{self, Computed, Given, Guessed, Read};
use super::write::Proposed;
use crate::unit::{UnitSystem, km_per_h};

/// What of an impact depends on the units, in the file's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Magnitudes {
    pub speed: f64,
    pub crush: f64,
    pub loading_time: f64,
    pub mass: Option<f64>,
}

/// A quantity of an impact in SI: what is possible, and what is usual.
struct Range {
    low: f64,
    high: f64,
    usual: f64,
    /// A factor from the usual value that is still quite usual.
    spread: f64,
}

/// From a shunting impact against a symmetry plane to beyond the fastest train.
const SPEED_M_PER_S: Range = Range { low: 0.05, high: 200.0, usual: 10.0, spread: 3.0 };
const CRUSH_M: Range = Range { low: 3e-4, high: 30.0, usual: 0.3, spread: 4.0 };
const LOADING_S: Range = Range { low: 5e-4, high: 5.0, usual: 0.08, spread: 3.0 };
/// First closing speed over the time to the maximum crush: from a train against soft buffers to
/// some hundred g. Speed and time may each be possible and what they make together not: the mean
/// force is mass times deceleration, and no crush zone stops its own vehicle with hundreds of its
/// weights. A shunting impact at 0.5 km/h, recorded in mm and s, is not an impact at 139 m/s that
/// ends within the same 20 ms, for that would be 700 g. The spread is wide, because what is hit may
/// be a buffer or a rock.
const DECELERATION_M_PER_S2: Range = Range { low: 0.2, high: 5e3, usual: 100.0, spread: 5.0 };
/// From a test body to a train.
const MASS_KG: Range = Range { low: 1.0, high: 5e6, usual: 15e3, spread: 8.0 };

impl Range {
    fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// How unusual a value is: 1 at `spread` times the usual one.
    fn unusual(&self, value: f64) -> f64 {
        ((value / self.usual).ln() / self.spread.ln()).powi(2)
    }
}

impl Magnitudes {
    /// The quantities in SI, each with its range and its text.
    fn in_si(&self, units: &UnitSystem) -> Vec<(f64, &'static Range, String)> {
        let speed = self.speed * units.speed();
        let crush = self.crush * units.length_m;
        let time = self.loading_time * units.time_s;
        let mean = speed / time;
        let mut all = vec![
            (time, &LOADING_S, format!("a crush that takes {}", seconds(time))),
            (speed, &SPEED_M_PER_S, format!("an impact at {}", shown_speed(speed))),
            (crush, &CRUSH_M, format!("a crush of {} m", digits(crush))),
            (mean, &DECELERATION_M_PER_S2, format!("a mean deceleration of {} m/s²", digits(mean))),
        ];
        if let Some(mass) = self.mass.map(|mass| mass * units.mass_kg) {
            all.push((mass, &MASS_KG, format!("a body of {}", shown_mass(mass))));
        }
        all
    }

    /// Why the units are impossible, if they are.
    pub(super) fn impossible(&self, units: &UnitSystem) -> Option<String> {
        let all = self.in_si(units);
        all.into_iter().find(|(value, range, _)| !range.holds(*value)).map(|(.., said)| said)
    }

    /// The quantity that is least usual, and how unusual all are together.
    fn unusual(&self, units: &UnitSystem) -> (f64, String) {
        let all = self.in_si(units);
        let sum = all.iter().map(|(value, range, _)| range.unusual(*value)).sum();
        let of = |(value, range, _): &(f64, &Range, String)| range.unusual(*value);
        let most = all.into_iter().max_by(|a, b| of(a).total_cmp(&of(b)));
        (sum, most.map_or(String::new(), |(.., said)| said))
    }
}

/// The units of all runs, as far as they can be determined.
///
/// `stated`: what a deck says, with its place.
pub(super) fn choose(
    runs: &[Magnitudes],
    given: Option<UnitSystem>,
    stated: Option<(UnitSystem, String)>,
    warnings: &mut Vec<String>,
) -> Proposed<UnitSystem> {
    let refused = |units: &UnitSystem| runs.iter().find_map(|run| run.impossible(units));
    if let Some(units) = given {
        if let Some(why) = refused(&units) {
            let better = match guessed(runs) {
                Some((guess, ..)) => format!("{guess} would fit"),
                None => "no usual system fits better".into(),
            };
            warnings.push(format!(
                "units: {units} as given would make {why}, which is not a crash; {better}"
            ));
        }
        return Proposed::found(units, Given, "by --units");
    }
    if let Some((units, place)) = stated {
        let Some(why) = refused(&units) else {
            let from = match guessed(runs) {
                Some((guess, _, from)) if guess == units => format!("{place}; and {from}"),
                _ => place,
            };
            return Proposed::found(units, Read, from);
        };
        warnings
            .push(format!("units: {place} states {units}, which would make {why}; it is not used"));
    }
    match (guessed(runs), runs.first()) {
        (Some((units, evidence, from)), _) => Proposed::found(units, evidence, from),
        (None, Some(first)) => Proposed::missing(format!(
            "in none of the usual systems ({}) is this an impact: speed {}, crush {}, time to it {} in the file's units",
            UnitSystem::USUAL.join(", "),
            digits(first.speed),
            digits(first.crush),
            digits(first.loading_time)
        )),
        (None, None) => Proposed::missing("no run determines them"),
    }
}

fn usual_systems() -> impl Iterator<Item = UnitSystem> {
    UnitSystem::USUAL.into_iter().filter_map(|name| UnitSystem::parse(name).ok())
}

/// For each run whether it is possible in the usual system in which most runs are.
pub(super) fn most_agree(runs: &[Magnitudes]) -> Vec<bool> {
    let agreeing = usual_systems().map(|units| {
        let agree: Vec<bool> = runs.iter().map(|run| run.impossible(&units).is_none()).collect();
        let agreeing = runs.iter().zip(&agree).filter(|(_, agrees)| **agrees);
        let unusual: Vec<f64> = agreeing.map(|(run, _)| run.unusual(&units).0).collect();
        (unusual.len(), unusual.iter().sum::<f64>(), agree)
    });
    let best =
        agreeing.reduce(|a, b| if b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)).is_gt() { b } else { a });
    match best {
        Some((count, _, agree)) if count > 0 => agree,
        _ => vec![true; runs.len()],
    }
}

/// The usual system in which all runs are possible, and why it is that one; of several the most
/// usual one.
fn guessed(runs: &[Magnitudes]) -> Option<(UnitSystem, Evidence, String)> {
    let first = runs.first()?;
    let (mut possible, mut others) = (Vec::new(), Vec::new());
    for units in usual_systems() {
        match runs.iter().find_map(|run| run.impossible(&units)) {
            Some(why) => others.push(format!("{units} would make {why}")),
            None => {
                let unusual = runs.iter().map(|run| run.unusual(&units).0).sum::<f64>();
                possible.push((unusual, units));
            }
        }
    }
    possible.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ((_, units), less) = possible.split_first()?;
    let others = others.join(", ");
    if less.is_empty() {
        let from = format!("the only usual system in which these impacts are possible: {others}");
        return Some((*units, Computed, from));
    }
    let less = less.iter().map(|(_, units)| format!("{units} ({})", first.unusual(units).1));
    let from = format!(
        "the impacts are the most usual ones in it; also possible, but less usual: {}; impossible: {others}",
        less.collect::<Vec<_>>().join(", ")
    );
    Some((*units, Guessed, from))
}

fn shown_speed(m_per_s: f64) -> String {
    if (0.3..SPEED_M_PER_S.high).contains(&m_per_s) {
        km_per_h(m_per_s)
    } else {
        format!("{} m/s", digits(m_per_s))
    }
}

pub(super) fn shown_mass(kg: f64) -> String {
    if kg >= 1e3 { format!("{} t", digits(kg / 1e3)) } else { format!("{} kg", digits(kg)) }
}

fn seconds(s: f64) -> String {
    match s {
        s if s >= 1.0 => format!("{} s", digits(s)),
        s if s >= 1e-4 => format!("{} ms", digits(s * 1e3)),
        s => format!("{} µs", digits(s * 1e6)),
    }
}

/// Three significant digits, for messages.
pub(super) fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let places = 2 - value.abs().log10().floor() as i32;
    match places {
        0..=9 => trimmed(&format!("{value:.*}", places as usize)),
        -6..=-1 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

/// A decimal number without zeros at its end.
pub(super) fn trimmed(number: &str) -> String {
    if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        number.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A car of 1.2 t at 50 km/h in some units.
    fn car(units: &UnitSystem) -> Magnitudes {
        Magnitudes {
            speed: 13.9 / units.speed(),
            crush: 0.55 / units.length_m,
            loading_time: 0.06 / units.time_s,
            mass: Some(1200.0 / units.mass_kg),
        }
    }

    #[test]
    fn units_are_told_by_what_is_possible() {
        for name in UnitSystem::USUAL {
            let units = UnitSystem::parse(name).unwrap();
            let found = choose(&[car(&units)], None, None, &mut Vec::new());
            assert_eq!(found.value(), Some(&units), "{found}");
        }
    }

    /// A shunting impact in mm and s has numbers that a fast one in SI could have, were it not for
    /// how soon it is over. Of its mass nothing is known.
    #[test]
    fn a_slow_impact_in_millimetres_is_no_fast_one_in_metres() {
        let shunting = |km_per_h: f64| Magnitudes {
            speed: km_per_h / 3.6 * 1e3,
            crush: 0.6 * km_per_h / 3.6 * 0.02 * 1e3,
            loading_time: 0.02,
            mass: None,
        };
        let in_si = shunting(0.5).in_si(&UnitSystem::SI);
        let others = in_si.iter().filter(|(_, range, _)| range.high != DECELERATION_M_PER_S2.high);
        assert!(others.clone().all(|(value, range, _)| range.holds(*value)), "each alone may be");
        assert_eq!(others.count(), 3);
        for km_per_h in [0.4, 0.5, 0.7, 3.0] {
            let found = choose(&[shunting(km_per_h)], None, None, &mut Vec::new());
            let units = found.value().map(ToString::to_string);
            assert_eq!(units.as_deref(), Some("mm-t-s"), "{km_per_h} km/h: {found}");
            assert!(found.to_string().starts_with("computed: "), "{found}");
        }
        let found = choose(&[shunting(0.5)], None, None, &mut Vec::new()).to_string();
        assert!(found.contains("SI would make a mean deceleration of 6944 m/s²"), "{found}");
    }

    #[test]
    fn a_light_body_in_kilogrammes_may_be_a_heavy_one_in_grammes() {
        let units = UnitSystem::parse("mm-kg-ms").unwrap();
        let train = Magnitudes { mass: Some(24e3), ..car(&units) };
        let found = choose(&[train], None, None, &mut Vec::new());
        assert_eq!(found.value(), Some(&units));
        assert!(found.to_string().starts_with("guessed: "), "{found}");
        assert!(found.to_string().contains("mm-g-ms (a body of 24 kg)"), "{found}");
    }

    #[test]
    fn a_deck_that_cannot_be_is_not_believed() {
        let units = UnitSystem::parse("mm-t-s").unwrap();
        let mut warnings = Vec::new();
        let stated = Some((UnitSystem::SI, "main.k, line 3".to_string()));
        let found = choose(&[car(&units)], None, stated.clone(), &mut warnings);
        assert_eq!(found.value(), Some(&units));
        assert_eq!(
            warnings,
            [
                "units: main.k, line 3 states SI, which would make an impact at 13900 m/s; it is not used"
            ]
        );
        let found = choose(&[car(&UnitSystem::SI)], None, stated, &mut Vec::new());
        let said = found.to_string();
        assert!(said.starts_with("read: main.k, line 3; and the only usual system"), "{said}");
    }

    #[test]
    fn what_is_no_impact_has_no_units() {
        let slow = Magnitudes { speed: 1e-9, crush: 1e-9, loading_time: 1e-9, mass: None };
        let found = choose(&[slow], None, None, &mut Vec::new());
        assert!(found.value().is_none());
        assert!(found.to_string().starts_with("fill in: in none of the usual systems"), "{found}");
    }

    #[test]
    fn numbers_are_shown_with_three_digits() {
        let shown = [24.0, 0.123456, 10000.0, 1.5e-9, 123456.0].map(digits);
        assert_eq!(shown, ["24", "0.123", "10000", "1.50e-9", "123456"]);
    }
}
