//! Histories of a solver's file over time, raw and filtered.

use crate::error::{Error, error};
use crate::history::History;
use crate::plot::{Axis, Chart, Panel, Series, Shown};
use crate::signal::cfc;
use crate::unit::UnitSystem;

/// Maximum number of lines of a chart.
const MOST: usize = 24;

/// Histories over time; quantities of different components are in panels side by side. Without
/// `units`, numbers stand as in the file; a channel frequency class of SAE J211-1, such as 60, adds
/// filtered lines.
///
/// # Errors
/// For none or more than 24 histories, or samples that the filter does not take.
pub fn histories(
    title: &str,
    histories: &[&History],
    units: Option<UnitSystem>,
    filter_class: Option<u32>,
) -> Result<Chart, Error> {
    if histories.is_empty() {
        return Err(error!(
            Plot,
            "there is no history: give other ids or components, if the file holds complete states (crumple inspect)"
        ));
    }
    if histories.len() > MOST {
        return Err(error!(
            Plot,
            "{found} histories are too many for one picture, {MOST} at most: choose with --id and --component",
            found = histories.len()
        ));
    }
    if filter_class.is_some() && units.is_none() {
        return Err(error!(Plot, "a CFC filter needs the unit of time: give the file's units"));
    }
    let mut components: Vec<&str> = Vec::new();
    for history in histories {
        if !components.contains(&&*history.component) {
            components.push(&history.component);
        }
    }
    let mut panels = Vec::new();
    for component in components {
        let of_component = || histories.iter().filter(|h| &*h.component == component);
        let (time, value) = axes(component, units, of_component().flat_map(|h| &h.values));
        let mut panel = Panel::new(time, value);
        for history in of_component() {
            add(&mut panel, history, filter_class.zip(units))?;
        }
        panels.push(panel);
    }
    Ok(Chart::row(title, panels))
}

/// What a component is measured in: its SI unit, and that unit in the file's.
fn unit(component: &str, units: &UnitSystem) -> Option<(&'static str, f64)> {
    let is_rotation =
        component.starts_with('r') && component.get(1..3).is_some_and(|c| c.ends_with('_'));
    let ends = |end: &str| component.ends_with(end);
    let per_s = 1.0 / units.time_s;
    Some(match () {
        () if ends("displacement") && is_rotation => ("rad", 1.0),
        () if ends("velocity") && is_rotation => ("rad/s", per_s),
        () if ends("acceleration") && is_rotation => ("rad/s²", per_s * per_s),
        () if ends("displacement") || ends("coordinate") => ("m", units.length_m),
        () if ends("velocity") => ("m/s", units.speed()),
        () if ends("acceleration") => ("m/s²", units.acceleration()),
        () if ends("force") => ("N", units.force()),
        () if ends("moment") => ("N·m", units.force() * units.length_m),
        () if ends("energy") || ends("work") => ("J", units.force() * units.length_m),
        () if ends("mass") => ("kg", units.mass_kg),
        () if ends("momentum") => ("kg·m/s", units.mass_kg * units.speed()),
        () => return None,
    })
}

/// Axes of time and of a component, whose values are in the file's units.
fn axes<'a>(
    component: &str,
    units: Option<UnitSystem>,
    values: impl Iterator<Item = &'a f64>,
) -> (Axis, Axis) {
    let as_in_file = |quantity: &str| Axis::new(quantity, "unit of the file", 1.0);
    let Some(units) = units else { return (as_in_file("time"), as_in_file(component)) };
    let time = Axis::new("time", "ms", 1e3 * units.time_s);
    let Some((unit, si)) = unit(component, &units) else { return (time, as_in_file(component)) };
    let largest = values.copied().filter(|v| v.is_finite()).fold(0.0, |l: f64, v| l.max(v.abs()));
    let value = match unit {
        "N" | "J" | "N·m" => Axis::prefixed(component, unit, si * largest),
        _ => Axis::new(component, unit, 1.0),
    };
    (time, Axis { scale: value.scale * si, ..value })
}

fn add(
    panel: &mut Panel,
    history: &History,
    filter: Option<(u32, UnitSystem)>,
) -> Result<(), Error> {
    let entity = history.entity.map_or_else(|| "whole model".to_string(), |e| e.to_string());
    let time = history.time.to_vec();
    let look = panel.series.len();
    panel.series.push(Series::line(&entity, look, time.clone(), history.values.clone()));
    let Some((class, units)) = filter else { return Ok(()) };
    let time_s: Vec<f64> = time.iter().map(|t| t * units.time_s).collect();
    let filtered = cfc::filter(class, &time_s, &history.values)
        .map_err(|source| error!(Plot, "{entity}: {source}").caused_by(source))?;
    let name = format!("{entity}, CFC {class}");
    let line = Series::line(&name, look + 1, time, filtered.values);
    panel.series.push(line.shown(Shown::Emphasis));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_lines_are_refused() {
        let history = History {
            entity: None,
            component: "kinetic_energy".into(),
            time: [0.0, 1.0].into(),
            values: vec![0.0, 1.0],
        };
        let all: Vec<&History> = std::iter::repeat_n(&history, MOST + 1).collect();
        let most = error!(
            Plot,
            "{found} histories are too many for one picture, {MOST} at most: choose with --id and --component",
            found = MOST + 1
        );
        assert_eq!(histories("", &all, None, None), Err(most));
        assert!(histories("", &all[1..], None, None).is_ok());
        assert_eq!(
            histories("", &[], None, None),
            Err(error!(
                Plot,
                "there is no history: give other ids or components, if the file holds complete states (crumple inspect)"
            ))
        );
    }
}
