//! The unit system of a run: what its deck states, or the one in which its impact is possible.
//!
//! Momentum and energy balance in every consistent system, so only magnitudes help: an impact
//! has a speed, a crush, a time to the maximum crush, a mean deceleration and a mass that vehicles
//! have.

use super::measure::is_near;
use super::write::Evidence::{self, Computed, Given, Guessed, Read};
use super::write::Proposed;
use crate::order;
use crate::unit::{UnitSystem, km_per_h};

/// What of an impact depends on the units, in the file's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Magnitudes {
    pub speed: f64,
    pub crush: f64,
    pub loading_time: f64,
    pub mass: Option<f64>,
    /// Speed that the folder's name states, in m/s.
    pub named_m_per_s: Option<f64>,
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

/// In [`UnitSystem::CUSTOMARY`] the numbers of a usual impact are those of a slow one in millimetres or metres. By so much
/// more usual an impact has to be in each of these to put the metric system in doubt: a foot is not far from a metre.
const DOUBT: [f64; 2] = [5.0, 2.0];
/// Differs from SI by masses and forces alone; rare, so that a mass has to be by so much more usual in it.
const TONNES: &str = "m-t-s";
const DOUBT_OF_KG: f64 = 5.0;
/// A name may round a speed to this share of it.
const NAMED: f64 = 0.1;

impl Range {
    fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// How unusual a value is: 1 at `spread` times the usual one.
    fn unusual(&self, value: f64) -> f64 {
        (libm::log(value / self.usual) / libm::log(self.spread)).powi(2)
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

    /// Why the speed in the folder's name is not that of the record, if it is far from it, from twice it (half a model) and
    /// from half of it (each body of a pair).
    fn is_not_as_named(&self, units: &UnitSystem) -> Option<String> {
        let (named, speed) = (self.named_m_per_s?, self.speed * units.speed());
        let is_as_named = [0.5, 1.0, 2.0].iter().any(|times| is_near(named, times * speed, NAMED));
        (!is_as_named).then(|| {
            let (speed, named) = (shown_speed(speed), shown_speed(named));
            format!("an impact at {speed} where the folder's name states {named}")
        })
    }

    /// Whether units of inches or feet are possible: they are rare, so the folder's name must not contradict them.
    fn may_be_customary(&self, units: &UnitSystem) -> bool {
        self.impossible(units).is_none() && self.is_not_as_named(units).is_none()
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
/// `stated`: what a deck says, with its place; `metals`: in which units its materials are metals, likewise. The solver
/// computes with the materials, so they count more.
pub(super) fn choose(
    runs: &[Magnitudes],
    given: Option<UnitSystem>,
    stated: Option<(UnitSystem, String)>,
    metals: Option<(UnitSystem, String)>,
    warnings: &mut Vec<String>,
) -> Proposed<UnitSystem> {
    let refused = |units: &UnitSystem| runs.iter().find_map(|run| run.impossible(units));
    if let Some(units) = given {
        if let Some(why) = refused(&units) {
            let better = match guessed(runs, &mut Vec::new()) {
                Some((guess, ..)) => format!("{guess} would fit"),
                None => "no usual system fits better".into(),
            };
            warnings.push(format!(
                "units: {units} as given would imply {why}, which is not a crash; {better}"
            ));
        } else if let Some((_, said)) = metals.filter(|(metals, _)| *metals != units) {
            warnings.push(format!("units: {units} as given, but {said}"));
        }
        return Proposed::found(units, Given, "by --units");
    }
    let impossible = |(units, said): &(UnitSystem, String)| {
        Some(format!("units: {said}, which would give {}; it is not used", refused(units)?))
    };
    warnings.extend(metals.as_ref().and_then(impossible));
    if let Some((units, said)) = metals.filter(|(units, _)| refused(units).is_none())
        && stated.as_ref().is_none_or(|(stated, _)| *stated != units)
    {
        if let Some((stated, by)) = stated {
            warnings.push(format!("units: {by} states {stated}, but {said}, which is taken"));
        }
        return Proposed::found(units, Computed, said);
    }
    if let Some((units, place)) = stated {
        let Some(why) = refused(&units) else {
            let from = match guessed(runs, &mut Vec::new()) {
                Some((guess, _, from)) if guess == units => format!("{place}; and {from}"),
                _ => place,
            };
            return Proposed::found(units, Read, from);
        };
        warnings
            .push(format!("units: {place} states {units}, which would give {why}; it is not used"));
    }
    match (guessed(runs, warnings), runs.first()) {
        (Some((units, evidence, from)), _) => Proposed::found(units, evidence, from),
        (None, Some(first)) => Proposed::missing(format!(
            "this is not an impact in any of the usual systems ({}): speed {}, crush {}, time to it {} in the file's units",
            UnitSystem::USUAL.join(", "),
            digits(first.speed),
            digits(first.crush),
            digits(first.loading_time)
        )),
        (None, None) => Proposed::missing("no run determines them"),
    }
}

/// The systems of some names.
fn systems(names: &[&str]) -> Vec<UnitSystem> {
    names.iter().filter_map(|name| UnitSystem::parse(name).ok()).collect()
}

/// For each run whether it is possible in the usual system in which most runs are.
pub(super) fn most_agree(runs: &[Magnitudes]) -> Vec<bool> {
    let best = |names: &[&str], is_possible: fn(&Magnitudes, &UnitSystem) -> bool| {
        let agreeing = systems(names).into_iter().map(|units| {
            let agree: Vec<bool> = runs.iter().map(|run| is_possible(run, &units)).collect();
            let agreeing = runs.iter().zip(&agree).filter(|(_, agrees)| **agrees);
            let unusual: Vec<f64> = agreeing.map(|(run, _)| run.unusual(&units).0).collect();
            (unusual.len(), unusual.iter().sum::<f64>(), agree)
        });
        let most = agreeing
            .reduce(|a, b| if b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)).is_gt() { b } else { a });
        most.filter(|(count, ..)| *count > 0).map(|(.., agree)| agree)
    };
    let best = best(&UnitSystem::USUAL, |run, units| run.impossible(units).is_none())
        .or_else(|| best(&UnitSystem::CUSTOMARY, Magnitudes::may_be_customary));
    best.unwrap_or_else(|| vec![true; runs.len()])
}

/// The usual system in which all runs are possible and have the speeds of their folders' names, and why it is that one; of
/// several the most usual one, of inches and feet only where no metric one is possible. Warns where they are as likely.
fn guessed(
    runs: &[Magnitudes],
    warnings: &mut Vec<String>,
) -> Option<(UnitSystem, Evidence, String)> {
    let first = runs.first()?;
    let refused = |units: &UnitSystem, why: &dyn Fn(&Magnitudes) -> Option<String>| {
        runs.iter().find_map(why).map(|why| format!("{units} would give {why}"))
    };
    let unusual = |units: &UnitSystem| runs.iter().map(|run| run.unusual(units).0).sum::<f64>();
    let (mut possible, mut others): (Vec<UnitSystem>, Vec<String>) = Default::default();
    for units in systems(&UnitSystem::USUAL) {
        match refused(&units, &|run| run.impossible(&units)) {
            Some(why) => others.push(why),
            None => possible.push(units),
        }
    }
    let mut customary = systems(&UnitSystem::CUSTOMARY);
    customary.retain(|units| runs.iter().all(|run| run.may_be_customary(units)));
    let misnamed = |units: &UnitSystem| refused(units, &|run| run.is_not_as_named(units));
    let is_named = runs.iter().any(|run| run.named_m_per_s.is_some());
    if is_named && possible.iter().chain(&customary).any(|units| misnamed(units).is_none()) {
        others.extend(possible.iter().filter_map(misnamed));
        possible.retain(|units| misnamed(units).is_none());
        customary.retain(|units| misnamed(units).is_none());
    }
    if possible.is_empty() {
        possible = std::mem::take(&mut customary);
    }
    order::sort(&mut possible, |a, b| unusual(a).total_cmp(&unusual(b)));
    let (units, less) = possible.split_first()?;
    let doubt = |other: &UnitSystem| {
        let feet = usize::from(UnitSystem::CUSTOMARY[0] != other.to_string());
        DOUBT[feet] * runs.len() as f64
    };
    customary.retain(|other| unusual(other) + doubt(other) < unusual(units));
    if let Some(other) = customary.first() {
        let speed = |units: &UnitSystem| shown_speed(first.speed * units.speed());
        warnings.push(format!(
            "units: {units} is assumed, which gives an impact at {}; if the model is in inches or feet, such as {other} with {}, use --units",
            speed(units),
            speed(other)
        ));
    }
    let in_tonnes = systems(&[TONNES]).into_iter().find(|tonnes| {
        *units == UnitSystem::SI
            && runs.iter().all(|run| run.impossible(tonnes).is_none())
            && unusual(tonnes) + DOUBT_OF_KG * (runs.len() as f64) < unusual(units)
    });
    if let (Some(_), Some(mass)) = (in_tonnes, first.mass) {
        warnings.push(format!(
            "units: {units} is assumed, which gives a body of {}; if the model is in {TONNES} (forces in kN), which gives {}, use --units {TONNES}",
            shown_mass(mass),
            shown_mass(1e3 * mass)
        ));
    }
    let others = others.join(", ");
    if less.is_empty() && customary.is_empty() && in_tonnes.is_none() {
        let from = format!("the only usual system in which these impacts are possible: {others}");
        return Some((*units, Computed, from));
    }
    let less = less.iter().chain(&customary);
    let less = less.map(|units| format!("{units} ({})", first.unusual(units).1));
    let mass = first.mass.map_or(String::new(), |mass| shown_mass(1e3 * mass));
    let less = less.chain(in_tonnes.map(|units| format!("{units} (a body of {mass})")));
    let from = format!(
        "of the usual systems the impacts are the most usual ones in it; also possible, but less usual or in rarer units: {}; impossible: {others}",
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
    let places = 2 - libm::log10(value.abs()).floor() as i32;
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
            named_m_per_s: None,
        }
    }

    #[test]
    fn units_are_told_by_what_is_possible() {
        for name in UnitSystem::USUAL {
            let units = UnitSystem::parse(name).unwrap();
            let found = choose(&[car(&units)], None, None, None, &mut Vec::new());
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
            named_m_per_s: None,
        };
        let in_si = shunting(0.5).in_si(&UnitSystem::SI);
        let others = in_si.iter().filter(|(_, range, _)| range.high != DECELERATION_M_PER_S2.high);
        assert!(others.clone().all(|(value, range, _)| range.holds(*value)), "each alone may be");
        assert_eq!(others.count(), 3);
        for km_per_h in [0.4, 0.5, 0.7, 3.0] {
            let named = Magnitudes { named_m_per_s: Some(km_per_h / 3.6), ..shunting(km_per_h) };
            for (run, evidence, warned) in
                [(shunting(km_per_h), "guessed: ", 1), (named, "computed: ", 0)]
            {
                let mut warnings = Vec::new();
                let found = choose(&[run], None, None, None, &mut warnings);
                let units = found.value().map(ToString::to_string);
                assert_eq!(units.as_deref(), Some("mm-t-s"), "{km_per_h} km/h: {found}");
                assert!(found.to_string().starts_with(evidence), "{found}");
                assert_eq!(warnings.len(), warned, "{warnings:?}");
            }
        }
        let found = choose(&[shunting(0.5)], None, None, None, &mut Vec::new()).to_string();
        assert!(found.contains("SI would give a mean deceleration of 6944 m/s²"), "{found}");
    }

    /// A car in inches has the numbers of a slow one in millimetres: the folder's name decides, else the user is asked.
    #[test]
    fn inches_are_not_millimetres() {
        let inches = UnitSystem::parse("in-slinch-s").unwrap();
        let run = car(&inches);
        let mut warnings = Vec::new();
        let found = choose(&[run], None, None, None, &mut warnings);
        assert_eq!(found.value().unwrap().to_string(), "mm-t-s");
        assert!(found.to_string().starts_with("guessed: "), "{found}");
        let warned = "units: mm-t-s is assumed, which gives an impact at 1.97 km/h; if the model is in inches or feet, such as in-slinch-s with 50.04 km/h, use --units";
        assert_eq!(warnings, [warned]);
        for half in [1.0, 2.0] {
            let named = Magnitudes { named_m_per_s: Some(half * 13.9), ..run };
            let mut warnings = Vec::new();
            let found = choose(&[named], None, None, None, &mut warnings);
            assert_eq!(found.value(), Some(&inches), "{found}");
            assert!(found.to_string().starts_with("computed: "), "{found}");
            assert!(warnings.is_empty(), "{warnings:?}");
        }
        // A name that fits nothing decides nothing.
        let named = Magnitudes { named_m_per_s: Some(3.0), ..car(&UnitSystem::SI) };
        let found = choose(&[named], None, None, None, &mut Vec::new());
        assert_eq!(found.value(), Some(&UnitSystem::SI), "{found}");
    }

    #[test]
    fn a_light_body_in_kilogrammes_may_be_a_heavy_one_in_grammes() {
        let units = UnitSystem::parse("mm-kg-ms").unwrap();
        let train = Magnitudes { mass: Some(24e3), ..car(&units) };
        let found = choose(&[train], None, None, None, &mut Vec::new());
        assert_eq!(found.value(), Some(&units));
        assert!(found.to_string().starts_with("guessed: "), "{found}");
        assert!(found.to_string().contains("mm-g-ms (a body of 24 kg)"), "{found}");
    }

    #[test]
    fn a_deck_that_cannot_be_is_not_believed() {
        let units = UnitSystem::parse("mm-t-s").unwrap();
        let mut warnings = Vec::new();
        let stated = Some((UnitSystem::SI, "main.k, line 3".to_string()));
        let found = choose(&[car(&units)], None, stated.clone(), None, &mut warnings);
        assert_eq!(found.value(), Some(&units));
        assert_eq!(
            warnings,
            [
                "units: main.k, line 3 states SI, which would give an impact at 13900 m/s; it is not used"
            ]
        );
        let found = choose(&[car(&UnitSystem::SI)], None, stated, None, &mut Vec::new());
        let said = found.to_string();
        assert!(said.starts_with("read: main.k, line 3; and the only usual system"), "{said}");
    }

    /// What the materials are in counts more than what is written above them, unless the impact is impossible in it.
    #[test]
    fn the_solver_computes_with_the_materials() {
        let [mm, si] = ["mm-t-s", "SI"].map(|name| UnitSystem::parse(name).unwrap());
        let said = |units: UnitSystem, what: &str| Some((units, what.to_string()));
        let t =
            |runs: UnitSystem, stated, metals, units: UnitSystem, evidence: &str, warned: usize| {
                let mut warnings = Vec::new();
                let found = choose(&[car(&runs)], None, stated, metals, &mut warnings);
                assert_eq!(found.value(), Some(&units), "{found}");
                assert!(found.to_string().starts_with(evidence), "{found}");
                assert_eq!(warnings.len(), warned, "{warnings:?}");
            };
        t(mm, None, said(mm, "steel"), mm, "computed: steel", 0);
        t(mm, said(mm, "line 1"), said(mm, "steel"), mm, "read: line 1", 0);
        t(mm, said(si, "line 1"), said(mm, "steel"), mm, "computed: steel", 1);
        t(mm, said(mm, "line 1"), said(si, "steel"), mm, "read: line 1", 1);
        t(mm, None, said(si, "steel"), mm, "computed: the only usual", 1);
    }

    #[test]
    fn what_is_no_impact_has_no_units() {
        let slow = Magnitudes {
            speed: 1e-9,
            crush: 1e-9,
            loading_time: 1e-9,
            mass: None,
            named_m_per_s: None,
        };
        let found = choose(&[slow], None, None, None, &mut Vec::new());
        assert!(found.value().is_none());
        let said = "fill in: this is not an impact in any of the usual systems";
        assert!(found.to_string().starts_with(said), "{found}");
    }

    #[test]
    fn numbers_are_shown_with_three_digits() {
        let shown = [24.0, 0.123456, 10000.0, 1.5e-9, 123456.0].map(digits);
        assert_eq!(shown, ["24", "0.123", "10000", "1.50e-9", "123456"]);
    }
}
