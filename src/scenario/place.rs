//! Which key of the scenario an error is about.

use std::path::{Path, PathBuf};

use super::layout::Layout;
use super::{CheckedScenario, Prepared, Scenario, TrainTable, VehicleTable};
use crate::error::{Document, KeyPath, Place};

impl CheckedScenario<'_> {
    /// The place of a key; of a scenario that is not as in its file only the file, at `path`.
    pub(crate) fn place(&self, path: &Path, key: &KeyPath) -> Place {
        match self.document() {
            Some(document) => document.place(key),
            None => Place::of_file(path),
        }
    }
}

/// Where a chain comes from, for the places of what only its run shows.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    path: PathBuf,
    document: Option<Document>,
}

impl Origin {
    pub(super) fn new(path: &Path, scenario: &CheckedScenario<'_>) -> Self {
        Self { path: path.into(), document: scenario.document().cloned() }
    }
}

impl Prepared {
    /// The place of a key of the scenario or of the chain made of it.
    pub(super) fn place(&self, key: &KeyPath) -> Place {
        let Some(document) = &self.origin.document else {
            return Place::of_file(&self.origin.path);
        };
        match key.item_of("interfaces") {
            Some(k) => {
                let last = if key.ends_with("tension") { "tension" } else { "end" };
                document.place(&curve(&self.used[k].curve).key(last))
            }
            None => document.place(key),
        }
    }
}

/// The table of a curve.
pub(super) fn curve(name: &str) -> KeyPath {
    KeyPath::of("curves").key(name)
}

pub(super) fn train(at: usize) -> KeyPath {
    KeyPath::of("train").item(at)
}

impl Scenario {
    pub(super) fn train_named(&self, name: &str) -> KeyPath {
        train(self.train.iter().position(|t| t.name == name).unwrap_or(0))
    }

    fn vehicles(&self) -> impl Iterator<Item = (KeyPath, &VehicleTable)> {
        self.train.iter().enumerate().flat_map(|(t, table)| {
            let vehicles = table.vehicles.iter().enumerate();
            vehicles.map(move |(v, vehicle)| (train(t).key("vehicles").item(v), vehicle))
        })
    }

    pub(super) fn vehicle(&self, name: &str) -> KeyPath {
        let found = self.vehicles().find(|(_, vehicle)| vehicle.name == name);
        found.map_or(KeyPath::of("train"), |(path, _)| path)
    }

    /// Where a vehicle says what its end is: the curve of `front` or `rear`, or `ends`.
    pub(super) fn end_of(&self, vehicle: &str, end: &str) -> KeyPath {
        let has_own = self.vehicles().any(|(_, table)| {
            let own = if end == "front" { &table.front } else { &table.rear };
            table.name == vehicle && own.is_some()
        });
        if has_own {
            self.vehicle(vehicle).key(end).key("curve")
        } else {
            self.vehicle(vehicle).key("ends")
        }
    }

    /// The second body of that name, in the order in which names are checked.
    pub(super) fn body_twice(&self, name: &str) -> KeyPath {
        let bodies = self.vehicles().flat_map(|(path, vehicle)| {
            let body = (path.clone().key("name"), vehicle.name.clone());
            let zones: Vec<(KeyPath, String)> = vehicle
                .zones()
                .map(|zone| {
                    let key = self.end_of(&vehicle.name, zone.end);
                    (key.itself(), format!("{} {}", vehicle.name, zone.end))
                })
                .collect();
            [body].into_iter().chain(zones)
        });
        let wall = self.wall.iter().map(|wall| (KeyPath::of("wall.name"), wall.name.clone()));
        let mut same = wall.chain(bodies).filter(|(_, body)| body == name);
        same.nth(1).map_or(KeyPath::of("train"), |(path, _)| path)
    }

    /// The first place that names a curve.
    pub(super) fn use_of(&self, curve: &str) -> KeyPath {
        let contact = self.contact.curve.iter();
        let contact = contact.map(|name| (KeyPath::of("contact.curve"), name.as_str()));
        let trains = self.train.iter().enumerate();
        let inner =
            trains.filter_map(|(t, table)| Some((train(t).key("inner"), table.inner.as_deref()?)));
        let within = self.vehicles().flat_map(|(path, vehicle)| {
            let behind =
                vehicle.behind.iter().map(|name| (path.clone().key("behind"), name.as_str()));
            let zones =
                vehicle.zones().map(|zone| (self.end_of(&vehicle.name, zone.end), zone.curve));
            behind.chain(zones).collect::<Vec<_>>()
        });
        let mut uses = contact.chain(inner).chain(within);
        uses.find(|(_, name)| *name == curve).map_or(KeyPath::of("curves"), |(path, _)| path)
    }

    /// The key of the scenario for a key of the chain that `layout` describes.
    pub(super) fn chain_key(&self, key: &KeyPath, layout: &Layout<'_>) -> KeyPath {
        if let Some(i) = key.item_of("bodies") {
            let body = &layout.bodies[i];
            return match body.resistance.wrong_term() {
                Some(_) => {
                    let is_wrong = |train: &TrainTable| {
                        train.resistance.is_some_and(|r| r.wrong_term().is_some())
                    };
                    train(self.train.iter().position(is_wrong).unwrap_or(0)).key("resistance")
                }
                None => self.vehicle_of(&body.name).key("mass"),
            };
        }
        let Some(k) = key.item_of("interfaces") else { return key.clone() };
        let mut bodies = layout.slots[k].name.split('|');
        let vehicle = bodies.find_map(|body| body.rsplit_once(' ').map(|b| b.0));
        self.vehicle(vehicle.unwrap_or_default())
    }

    /// The vehicle that a body is, or is a crush zone of.
    fn vehicle_of(&self, body: &str) -> KeyPath {
        let is_of = |vehicle: &VehicleTable| {
            let rest = body.strip_prefix(vehicle.name.as_str());
            rest.is_some_and(|rest| ["", " front", " rear"].contains(&rest))
        };
        let found = self.vehicles().find(|(_, vehicle)| is_of(vehicle));
        found.map_or(KeyPath::of("train"), |(path, _)| path)
    }
}
