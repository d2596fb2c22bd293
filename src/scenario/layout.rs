//! Layout: the bodies of a scenario in their row, and the places between them.

use super::{CheckedScenario, CrushZone, TrainTable, VehicleTable};
use crate::curve::Masses;
use crate::multibody::Body;

/// Bodies from the back of the first train to its nose and on, and what lies between them.
#[derive(Default)]
pub(super) struct Layout<'a> {
    pub bodies: Vec<Body>,
    pub slots: Vec<Connection<'a>>,
    /// Bodies as the scenario lists them: vehicle, its front, its rear.
    pub order: Vec<usize>,
    /// The body of each vehicle, as the scenario lists them.
    pub vehicles: Vec<usize>,
}

/// A place for an interface.
pub(super) struct Connection<'a> {
    /// `A1|A2`, the one nearer to the nose first.
    pub name: String,
    pub joint: ConnectionKind<'a>,
    /// Free distance, if the curve's own does not hold.
    pub gap_m: Option<f64>,
    pub role: Role,
    /// Mass of the vehicle, or those of two.
    pub masses: Masses,
    /// Whether a vehicle's crush zone at this place is a body of its own.
    pub split: bool,
}

/// What acts at a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ConnectionKind<'a> {
    Curve(&'a str),
    /// The crush law of a model, between body and crush zone.
    End(End<'a>),
    /// The plates of two such ends, or of one and the wall.
    Plates,
}

/// The end of a vehicle that comes from a model, by its bodies in the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End<'a> {
    pub curve: &'a str,
    pub body: usize,
    pub zone: usize,
    /// The vehicle behind the interface at which the end is crushed, and that ahead of it: `None`
    /// for the wall.
    pub behind: usize,
    pub ahead: Option<usize>,
    /// What that interface lies between.
    pub at: Role,
}

impl<'a> ConnectionKind<'a> {
    /// The curve of the scenario that it needs.
    pub(super) fn curve(&self) -> Option<&'a str> {
        match self {
            Self::Curve(curve) | Self::End(End { curve, .. }) => Some(curve),
            Self::Plates => None,
        }
    }
}

/// Share of a vehicle's mass that the plate of an end has at first, until more is stopped.
const PLATE: f64 = 0.002;

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
    let mut layout = Layout::default();
    let first = &scenario.train[0];
    let mut places = vec![[None; 3]; first.vehicles.len()];
    for (i, vehicle) in first.vehicles.iter().enumerate().rev() {
        let is_last = i + 1 == first.vehicles.len();
        places[i] = layout.vehicle(first, vehicle, true, is_last);
        if i > 0 {
            layout.between(first, i - 1);
        }
    }
    let nose = &first.vehicles[0];
    let contact = &scenario.contact;
    let (name, role, masses, split) = match (&scenario.wall, scenario.train.get(1)) {
        (None, Some(second)) => {
            let other = &second.vehicles[0];
            let split = nose.front_zone().or(other.front_zone()).is_some();
            let name = format!("{}|{}", nose.name, other.name);
            (name, Role::Noses, masses(nose, Some(other)), split)
        }
        (wall, _) => {
            let wall = wall.as_ref().map_or("wall", |w| &w.name);
            let name = format!("{}|{wall}", nose.name);
            (name, Role::Wall, masses(nose, None), nose.front_zone().is_some())
        }
    };
    let gap_m = contact.gap.map(|g| g.0);
    let joint = joint(nose.front_zone(), contact.curve.as_deref());
    layout.slots.push(Connection { name, joint, gap_m, role, masses, split });
    if let Some(second) = scenario.train.get(1) {
        for (i, vehicle) in second.vehicles.iter().enumerate() {
            let is_last = i + 1 == second.vehicles.len();
            places.push(layout.vehicle(second, vehicle, false, is_last));
            if i + 1 < second.vehicles.len() {
                layout.between(second, i);
            }
        }
    }
    layout.vehicles = places.iter().filter_map(|place| place[0]).collect();
    layout.order = places.into_iter().flatten().flatten().collect();
    layout.join_ends();
    layout
}

/// What acts between two ends, or an end and the wall: plates if `end` comes from a model, as the
/// other one then does.
fn joint<'a>(end: Option<CrushZone<'a>>, curve: Option<&'a str>) -> ConnectionKind<'a> {
    if end.is_some_and(|end| end.is_of_model()) {
        ConnectionKind::Plates
    } else {
        ConnectionKind::Curve(curve.unwrap_or_default())
    }
}

fn masses(a: &VehicleTable, b: Option<&VehicleTable>) -> Masses {
    Masses { body_kg: a.mass.0, other_kg: b.map(|b| b.mass.0) }
}

impl<'a> Layout<'a> {
    /// Bodies of a vehicle, its rear first in the train that comes from behind; returns the
    /// places of body, front and rear.
    fn vehicle(
        &mut self,
        train: &TrainTable,
        vehicle: &'a VehicleTable,
        rear_first: bool,
        is_last: bool,
    ) -> [Option<usize>; 3] {
        let mut places = [None; 3];
        let resistance = train.resistance.unwrap_or_default();
        let name = &vehicle.name;
        // Nothing meets the last end of a train: a model's stays part of its body.
        let free = |zone: &CrushZone<'_>| is_last && zone.is_of_model();
        let (front, rear) = (vehicle.front_zone(), vehicle.rear_zone().filter(|z| !free(z)));
        let front = front.map(|zone| (1, format!("{name} front"), zone));
        let rear = rear.map(|zone| (2, format!("{name} rear"), zone));
        let (before, after) = if rear_first { (rear, front) } else { (front, rear) };
        let plate_kg = PLATE * vehicle.mass.0;
        let plates = [&before, &after].into_iter().flatten().filter(|z| z.2.is_of_model());
        let plates_kg = plate_kg * plates.count() as f64;
        let within =
            |zone_name: &str, zone: &CrushZone<'a>, body: usize, zone_body: usize| Connection {
                name: format!("{zone_name}|{name}"),
                joint: if !zone.is_of_model() {
                    ConnectionKind::Curve(zone.curve)
                } else {
                    ConnectionKind::End(End {
                        curve: zone.curve,
                        body,
                        zone: zone_body,
                        behind: body,
                        ahead: None,
                        at: Role::Wall,
                    })
                },
                gap_m: Some(0.0),
                role: Role::Within,
                masses: masses(vehicle, None),
                split: true,
            };
        let mut body = |place: usize, name: &str, mass_kg: f64| {
            places[place] = Some(self.bodies.len());
            let body = Body::new(name, mass_kg, train.speed.0);
            self.bodies.push(Body { resistance, ..body });
            self.bodies.len() - 1
        };
        if let Some((place, zone_name, zone)) = before {
            let at = body(place, &zone_name, zone.mass_kg.unwrap_or(plate_kg));
            self.slots.push(within(&zone_name, &zone, at + 1, at));
        }
        let at = body(0, name, vehicle.body_mass_kg() - plates_kg);
        if let Some((place, zone_name, zone)) = after {
            body(place, &zone_name, zone.mass_kg.unwrap_or(plate_kg));
            self.slots.push(within(&zone_name, &zone, at, at + 1));
        }
        places
    }

    /// The place behind vehicle `i` of a train.
    fn between(&mut self, train: &'a TrainTable, i: usize) {
        let (ahead, behind) = (&train.vehicles[i], &train.vehicles[i + 1]);
        let curve = ahead.behind.as_deref().or(train.inner.as_deref());
        let joint = joint(ahead.rear_zone(), curve);
        self.slots.push(Connection {
            name: format!("{}|{}", ahead.name, behind.name),
            gap_m: ahead.gap.or(train.gap).map(|gap| gap.0),
            joint,
            role: Role::Vehicles,
            masses: masses(ahead, Some(behind)),
            split: ahead.rear_zone().or(behind.front_zone()).is_some(),
        });
    }

    /// Notes at every end of a model which vehicles meet at its plates. Slot `k` lies between the
    /// bodies `k` and `k + 1`.
    fn join_ends(&mut self) {
        for k in 0..self.slots.len() {
            if self.slots[k].joint != ConnectionKind::Plates {
                continue;
            }
            // The plates are bodies k and k + 1, their vehicles one further.
            let at = self.slots[k].role;
            let behind = k.saturating_sub(1);
            let ahead = (at != Role::Wall).then_some(k + 2);
            for end in [k.checked_sub(1), Some(k + 1)].into_iter().flatten() {
                if let Some(ConnectionKind::End(end)) =
                    self.slots.get_mut(end).map(|slot| &mut slot.joint)
                {
                    (end.behind, end.ahead, end.at) = (behind, ahead, at);
                }
            }
        }
    }
}
