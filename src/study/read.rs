//! The histories of a run that its recipe names.

use super::files::{Located, force_file};
use super::locate::LocatedRun;
use crate::curve::extract::{Measured, MeasuredForce};
use crate::curve::recipe::{DeflectionSource, ForceSource, Recipe};
use crate::error::{Error, KeyPath};
use crate::history::{EntityId, History, Side};
use crate::solver::{self, Selection, SolverFile, WantedId};
use crate::unit::UnitSystem;

/// A located file with the histories that were selected of it.
pub(super) struct ReadFile<'a> {
    pub located: &'a Located,
    pub file: SolverFile,
}

/// The files of a run with the histories that its recipe names.
pub(super) struct RunFiles<'a> {
    recipe: &'a Recipe,
    pub motion: ReadFile<'a>,
    pub force: ReadFile<'a>,
    /// The contact force where the force is a body force.
    pub contact: Option<ReadFile<'a>>,
}

impl<'a> RunFiles<'a> {
    pub(crate) fn read(run: &'a LocatedRun<'_>, recipe: &'a Recipe) -> Result<Self, Error> {
        let read_force = |table: &str, source: &ForceSource| {
            let located = run.file(force_file(source));
            let id = match source {
                ForceSource::Contact { .. } => "id",
                ForceSource::Body { .. } => "node",
            };
            let file = read_force(located, source).map_err(|e| in_recipe(e, table, &[id]))?;
            Ok::<_, Error>(ReadFile { located, file })
        };
        let located = run.file(&recipe.deflection.file);
        let file = read_motion(located, &recipe.deflection)
            .map_err(|e| in_recipe(e, "deflection", &["node", "minus_node"]))?;
        Ok(Self {
            recipe,
            motion: ReadFile { located, file },
            force: read_force("force", &recipe.force)?,
            contact: recipe.contact.as_ref().map(|c| read_force("contact", c)).transpose()?,
        })
    }

    pub(crate) fn measured(&self, units: UnitSystem) -> Result<Measured<'_>, Error> {
        let DeflectionSource { node, minus_node, component, .. } = self.recipe.deflection;
        let motion =
            |node: i64, name: &str| self.motion.file.history(Some(EntityId::new(node)), name);
        let displacement = motion(node, component.name())
            .ok_or_else(|| in_recipe(self.motion.lacks(component.name()), "deflection", &[]))?;
        let force = self.force_history()?;
        Ok(Measured {
            units,
            displacement,
            minus_displacement: minus_node.and_then(|n| motion(n, component.name())),
            velocity: motion(node, component.velocity()),
            minus_velocity: minus_node.and_then(|n| motion(n, component.velocity())),
            force: match self.recipe.force {
                ForceSource::Contact { .. } => MeasuredForce::Contact(force),
                ForceSource::Body { motion, .. } => MeasuredForce::Body(force, motion),
            },
            contact: match self.recipe.contact.as_ref().zip(self.contact.as_ref()) {
                Some((source, read)) => {
                    Some(read.force_history(source).map_err(|e| in_recipe(e, "contact", &[]))?)
                }
                None => None,
            },
        })
    }

    /// The history that the force is, or is made of.
    pub(crate) fn force_history(&self) -> Result<&History, Error> {
        self.force.force_history(&self.recipe.force).map_err(|e| in_recipe(e, "force", &[]))
    }

    /// Each file once.
    pub(crate) fn each(&self) -> Vec<&ReadFile<'a>> {
        let mut each = vec![&self.motion];
        for read in [&self.force].into_iter().chain(&self.contact) {
            if each.iter().all(|known| known.located.file != read.located.file) {
                each.push(read);
            }
        }
        each
    }
}

impl ReadFile<'_> {
    fn force_history(&self, source: &ForceSource) -> Result<&History, Error> {
        let history = match source {
            ForceSource::Contact { id, side, component, .. } => {
                contact_history(&self.file, *id, *side, component)
            }
            ForceSource::Body { node, component, .. } => {
                self.file.history(Some(EntityId::new(*node)), component)
            }
        };
        history.ok_or_else(|| self.lacks(force_component(source)))
    }

    fn lacks(&self, component: &str) -> Error {
        let (path, known) = (self.located.path.display(), self.file.components.join(", "));
        solver::no_component(path, &self.file.section, component, &known)
    }
}

/// An error of a file's selection at the key of the recipe's table that selects it; `ids` are the keys of
/// the ids, in their order.
fn in_recipe(error: Error, table: &str, ids: &[&str]) -> Error {
    let table = KeyPath::of("recipe").key(table);
    let mut ids = ids.iter().enumerate();
    let id = ids.find(|(k, _)| *error.key() == KeyPath::of("ids").item(*k));
    let key = match id {
        Some((_, id)) => table.key(id),
        None if error.is_about("component") => table.key("component"),
        None => KeyPath::default(),
    };
    error.at(key)
}

fn force_component(force: &ForceSource) -> &str {
    match force {
        ForceSource::Contact { component, .. } | ForceSource::Body { component, .. } => component,
    }
}

fn read(file: &Located, ids: Vec<WantedId>, components: &[&str]) -> Result<SolverFile, Error> {
    let selection = Selection {
        ids: Some(ids),
        components: Some(components.iter().map(ToString::to_string).collect()),
        section: file.section.clone(),
        ..Selection::all()
    };
    solver::read(&file.path, None, &selection)
}

/// Displacements and, where the file has them, velocities of the recipe's nodes.
fn read_motion(file: &Located, source: &DeflectionSource) -> Result<SolverFile, Error> {
    let ids: Vec<WantedId> = [Some(source.node), source.minus_node]
        .into_iter()
        .flatten()
        .map(|id| WantedId { id, side: None })
        .collect();
    let component = source.component;
    match read(file, ids.clone(), &[component.name(), component.velocity()]) {
        // Without velocities, displacements alone; if these are missing, the error is about them.
        Err(error) if error.is_about("component") => read(file, ids, &[component.name()]),
        result => result,
    }
}

fn read_force(file: &Located, source: &ForceSource) -> Result<SolverFile, Error> {
    let id = match *source {
        ForceSource::Contact { id, side, .. } => WantedId { id, side },
        ForceSource::Body { node, .. } => WantedId { id: node, side: None },
    };
    read(file, vec![id], &[force_component(source)])
}

/// The history of a wall or of one side of an interface; without a side named, SURFA's.
fn contact_history<'a>(
    file: &'a SolverFile,
    id: i64,
    side: Option<Side>,
    component: &str,
) -> Option<&'a History> {
    let bare = file.history(Some(EntityId::new(id)), component);
    let of_side = |side| file.history(Some(EntityId { id, side: Some(side) }), component);
    match side {
        Some(side) => of_side(side).or(bare),
        None => bare.or_else(|| of_side(Side::SurfA)),
    }
}
