//! Checks of a scenario that a single key cannot show.

use super::{CurveTable, LawName, Scenario, VehicleTable};
use crate::unit::km_per_h;

/// Returns the speed of what the first train meets, in m/s.
pub(super) fn check(scenario: &Scenario) -> Result<f64, String> {
    let obstacle_speed = match (&scenario.wall, scenario.train.as_slice()) {
        (Some(_), [_]) => 0.0,
        (None, [_, second]) => second.speed.0,
        (Some(_), trains) => {
            return Err(format!("a [wall] needs exactly one [[train]], found {}", trains.len()));
        }
        (None, trains) => {
            return Err(format!(
                "expected two [[train]], or one and a [wall], found {} [[train]] and no [wall]",
                trains.len()
            ));
        }
    };
    if let Some(limits) = &scenario.limits
        && !(limits.mean_deceleration_g > 0.0 && limits.mean_deceleration_g.is_finite())
    {
        return Err(format!(
            "[limits] mean_deceleration_g = {}: expected more than 0",
            limits.mean_deceleration_g
        ));
    }
    if let [first, second] = scenario.train.as_slice()
        && first.name == second.name
    {
        return Err(format!("two trains are named \"{}\": give them different names", first.name));
    }
    let trains = scenario.limits.as_ref().and_then(|limits| limits.trains.as_ref());
    if trains.is_some_and(Vec::is_empty) {
        return Err("[limits] trains is empty: name one, or leave it away for all".into());
    }
    for name in trains.into_iter().flatten() {
        if !scenario.train.iter().any(|train| train.name == *name) {
            let known: Vec<&str> = scenario.train.iter().map(|t| t.name.as_str()).collect();
            return Err(format!(
                "[limits] trains: there is no train \"{name}\": the scenario has {}",
                known.join(", ")
            ));
        }
    }
    let mut names = std::collections::HashSet::new();
    let mut take = |name: String| match names.insert(name.clone()) {
        true => Ok(()),
        false => Err(format!(
            "two bodies are named \"{name}\": vehicles, their front and rear and the wall need different names"
        )),
    };
    if let Some(wall) = &scenario.wall {
        check_name(&wall.name)?;
        take(wall.name.clone())?;
    }
    for train in &scenario.train {
        let Some((last, others)) = train.vehicles.split_last() else {
            return Err(format!("train \"{}\" has no vehicles", train.name));
        };
        if others.iter().any(|v| v.behind.is_none()) && train.inner.is_none() {
            return Err(format!(
                "train \"{}\" has {} vehicles but no inner = \"…\" curve between them",
                train.name,
                train.vehicles.len()
            ));
        }
        if last.behind.is_some() {
            return Err(format!("there is nothing behind the last vehicle \"{}\"", last.name));
        }
        for vehicle in &train.vehicles {
            let name = &vehicle.name;
            check_name(name)?;
            take(name.clone())?;
            for (zone, end) in [(&vehicle.front, "front"), (&vehicle.rear, "rear")] {
                let Some(zone) = zone else { continue };
                take(format!("{name} {end}"))?;
                if scenario
                    .curves
                    .get(&zone.curve)
                    .is_some_and(|c| c.gap.is_some_and(|gap| gap.0 > 0.0))
                {
                    return Err(format!(
                        "curve \"{}\" has a gap, but {end} of vehicle \"{name}\" is joined to the body without one: give it a curve without gap",
                        zone.curve
                    ));
                }
            }
            let is_split = vehicle.front.is_some() || vehicle.rear.is_some();
            if is_split && body_mass_kg(vehicle) <= 0.0 {
                return Err(format!(
                    "the crush zones of vehicle \"{name}\" have all of its mass: nothing is left for the body"
                ));
            }
        }
    }
    for (name, table) in &scenario.curves {
        check_curve(name, table, scenario)?;
    }
    if scenario.train[0].speed.0 <= obstacle_speed {
        return Err(format!(
            "train \"{}\" at {} never meets what is in front of it: it must be faster",
            scenario.train[0].name,
            km_per_h(scenario.train[0].speed.0)
        ));
    }
    Ok(obstacle_speed)
}

/// Mass of a vehicle without its crush zones.
pub(super) fn body_mass_kg(vehicle: &VehicleTable) -> f64 {
    let zones = [&vehicle.front, &vehicle.rear].into_iter().flatten();
    vehicle.mass.0 - zones.map(|zone| zone.mass.0).sum::<f64>()
}

fn check_curve(name: &str, table: &CurveTable, scenario: &Scenario) -> Result<(), String> {
    let takes_nothing = |key: &str, of: &str| {
        Err(format!("curve \"{name}\": {key} belongs to {of}: leave it away"))
    };
    if table.stages.as_ref().is_some_and(Vec::is_empty) {
        return Err(format!("curve \"{name}\": stages is empty"));
    }
    if table.stages.is_some() && table.force.is_some() {
        return takes_nothing("force", "a model, predicted curve or case");
    }
    if table.database.is_none() && table.case.is_some() {
        return takes_nothing("case", "a database");
    }
    if table.model.is_none() && table.max_crush.is_some() {
        return takes_nothing("max_crush", "a model");
    }
    if table.model.is_none() && !table.parameters.is_empty() {
        return takes_nothing("parameters", "a model");
    }
    if table.law == LawName::Elastic && table.unloading.is_some() {
        return takes_nothing("unloading", "law = \"memory\"");
    }
    if let Some(tension) = &table.tension {
        let Some(other) = scenario.curves.get(tension) else {
            return Err(format!(
                "curve \"{name}\": its tension curve \"{tension}\" is not in [curves]"
            ));
        };
        if other.tension.is_some() || other.damping.is_some() {
            return Err(format!(
                "curve \"{tension}\" is the tension of \"{name}\": it can have no tension or damping of its own"
            ));
        }
        if other.model.is_some() {
            return Err(format!(
                "curve \"{tension}\" is the tension of \"{name}\": models know compression only; give a file or stages"
            ));
        }
    }
    Ok(())
}

/// Names stand in the columns of the result.
fn check_name(name: &str) -> Result<(), String> {
    let breaks = |c: char| c.is_control() || [',', '|', '[', ']', '"'].contains(&c);
    if name.is_empty() || name.contains(breaks) {
        return Err(format!(
            "the name \"{}\" may not be empty or contain , | [ ] or quotes",
            name.escape_debug()
        ));
    }
    Ok(())
}
