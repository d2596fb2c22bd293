//! Layout: the bodies of a scenario in their row, and the places between them.

use super::{CheckedScenario, TrainTable, VehicleTable};
use crate::multibody::{Body, Resistance};

/// Bodies from the back of the first train to its nose and on, and what lies between them.
pub(super) struct Layout<'a> {
    pub bodies: Vec<Body>,
    pub slots: Vec<Slot<'a>>,
    /// Bodies as the scenario lists them: vehicle, its front, its rear.
    pub order: Vec<usize>,
}

/// A place for an interface.
pub(super) struct Slot<'a> {
    /// `A1|A2`, the one nearer to the nose first.
    pub name: String,
    pub curve: &'a str,
    /// Free distance, if the curve's own does not hold.
    pub gap_m: Option<f64>,
    pub role: Role,
    /// Mass of the vehicle, or of each of two equal vehicles with the same reduced mass.
    pub mass_kg: f64,
    /// Whether a vehicle's crush zone at this place is a body of its own.
    pub split: bool,
}

/// What a slot lies between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Wall,
    Noses,
    /// Two vehicles of one train.
    Vehicles,
    /// Body and crush zone of one vehicle.
    Within,
}

/// The row of a scenario.
pub(super) fn layout<'a>(scenario: &'a CheckedScenario<'_>) -> Layout<'a> {
    let mut layout = Layout { bodies: Vec::new(), slots: Vec::new(), order: Vec::new() };
    let first = &scenario.train[0];
    let mut places = vec![[None; 3]; first.vehicles.len()];
    for (i, vehicle) in first.vehicles.iter().enumerate().rev() {
        places[i] = layout.vehicle(first, vehicle, true);
        if i > 0 {
            layout.between(first, i - 1);
        }
    }
    let nose = &first.vehicles[0];
    let contact = &scenario.contact;
    let (name, role, mass_kg, split) = match (&scenario.wall, scenario.train.get(1)) {
        (None, Some(second)) => {
            let other = &second.vehicles[0];
            let split = nose.front.is_some() || other.front.is_some();
            let name = format!("{}|{}", nose.name, other.name);
            (name, Role::Noses, equal_mass_kg(nose, other), split)
        }
        (wall, _) => {
            let wall = wall.as_ref().map_or("wall", |w| &w.name);
            let name = format!("{}|{wall}", nose.name);
            (name, Role::Wall, nose.mass.0, nose.front.is_some())
        }
    };
    let gap_m = contact.gap.map(|g| g.0);
    layout.slots.push(Slot { name, curve: &contact.curve, gap_m, role, mass_kg, split });
    if let Some(second) = scenario.train.get(1) {
        for (i, vehicle) in second.vehicles.iter().enumerate() {
            places.push(layout.vehicle(second, vehicle, false));
            if i + 1 < second.vehicles.len() {
                layout.between(second, i);
            }
        }
    }
    layout.order = places.into_iter().flatten().flatten().collect();
    layout
}

fn equal_mass_kg(a: &VehicleTable, b: &VehicleTable) -> f64 {
    2.0 * a.mass.0 * b.mass.0 / (a.mass.0 + b.mass.0)
}

impl<'a> Layout<'a> {
    /// Bodies of a vehicle, its rear first in the train that comes from behind; returns the
    /// places of body, front and rear.
    fn vehicle(
        &mut self,
        train: &TrainTable,
        vehicle: &'a VehicleTable,
        rear_first: bool,
    ) -> [Option<usize>; 3] {
        let mut places = [None; 3];
        let resistance = train.resistance.map_or(Resistance::default(), |r| Resistance {
            constant_m_per_s2: r.constant_m_per_s2,
            linear_per_s: r.linear_per_s,
            quadratic_per_m: r.quadratic_per_m,
            braking: r.braking,
        });
        let name = &vehicle.name;
        let front = vehicle.front.as_ref().map(|zone| (1, format!("{name} front"), zone));
        let rear = vehicle.rear.as_ref().map(|zone| (2, format!("{name} rear"), zone));
        let (before, after) = if rear_first { (rear, front) } else { (front, rear) };
        let within = |zone: &str, curve: &'a str| Slot {
            name: format!("{zone}|{name}"),
            curve,
            gap_m: Some(0.0),
            role: Role::Within,
            mass_kg: vehicle.mass.0,
            split: true,
        };
        let mut body = |place: usize, name: &str, mass_kg: f64| {
            places[place] = Some(self.bodies.len());
            let body = Body::new(name, mass_kg, train.speed.0);
            self.bodies.push(Body { resistance, ..body });
        };
        if let Some((place, zone_name, zone)) = before {
            body(place, &zone_name, zone.mass.0);
            self.slots.push(within(&zone_name, &zone.curve));
        }
        body(0, name, vehicle.body_mass_kg());
        if let Some((place, zone_name, zone)) = after {
            body(place, &zone_name, zone.mass.0);
            self.slots.push(within(&zone_name, &zone.curve));
        }
        places
    }

    /// The place behind vehicle `i` of a train.
    fn between(&mut self, train: &'a TrainTable, i: usize) {
        let (ahead, behind) = (&train.vehicles[i], &train.vehicles[i + 1]);
        self.slots.push(Slot {
            name: format!("{}|{}", ahead.name, behind.name),
            curve: ahead.behind.as_deref().or(train.inner.as_deref()).unwrap_or_default(),
            gap_m: None,
            role: Role::Vehicles,
            mass_kg: equal_mass_kg(ahead, behind),
            split: ahead.rear.is_some() || behind.front.is_some(),
        });
    }
}
