//! A multi-body run as an ISO-MME folder: a channel per history of every body and interface.

use std::path::{Path, PathBuf};

use crate::file::{not_written, write_all_whole};
use crate::formats::iso_mme::{Channel, Test, folder, interval_s, object};
use crate::multibody::Run;
use crate::scenario::Prepared;

use super::{Failure, usage};

/// Writes the run into the folder at `path`, whose name without its extension names the files.
pub(super) fn write(path: &Path, prepared: &Prepared, run: &Run) -> Result<(), Failure> {
    let name = path.file_stem().and_then(|s| s.to_str()).unwrap_or("run");
    let bodies = prepared.chain.bodies();
    if bodies.len() > OBJECTS {
        return usage(format!(
            "-o {}: ISO-MME names at most {OBJECTS} test objects, the chain has {} bodies: write a .csv file",
            path.display(),
            bodies.len()
        ));
    }
    let of = |k: usize| object(k).unwrap_or('?');
    let mut channels = Vec::new();
    for (k, &i) in prepared.order.iter().enumerate() {
        let (history, body) = (&run.bodies[i], &bodies[i].name);
        for (dimension, what, unit, values) in [
            ("DS", "position", "m", &history.x_m),
            ("VE", "speed", "m/s", &history.v_m_per_s),
            ("AC", "acceleration", "m/s2", &history.a_m_per_s2),
        ] {
            channels.push(Channel {
                code: format!("{}1VEHCCG0000{dimension}XP", of(k)),
                name: format!("{what} of {body}"),
                unit,
                values: values.clone(),
            });
        }
    }
    for (k, (interface, history)) in
        prepared.chain.interfaces().iter().zip(&run.interfaces).enumerate()
    {
        for (dimension, what, unit, values) in [
            ("DS", "deflection", "m", &history.deflection_m),
            ("FO", "force", "N", &history.force_n),
        ] {
            channels.push(Channel {
                code: format!("{}1VEHC000000{dimension}XP", of(k)),
                name: format!("{what} at {}", interface.name),
                unit,
                values: values.clone(),
            });
        }
    }
    let test = Test {
        name,
        title: "multi-body run of crumple",
        bodies: prepared.order.iter().map(|&i| (bodies[i].mass_kg, bodies[i].speed_m_per_s)).collect(),
        start_s: run.time_s.first().copied().unwrap_or_default(),
        interval_s: interval_s(&run.time_s)?,
        remarks: vec![
            "x positive in the direction in which the first train moves; time 0 is the first contact; the first character of a code is the body's, or the interface's, in the chain".into(),
        ],
    };
    let exported = folder(&test, &channels)?;
    let inside = path.join("Channel");
    std::fs::create_dir_all(&inside).map_err(|e| not_written(&inside, e))?;
    let files: Vec<(PathBuf, &[u8])> =
        exported.files.iter().map(|(name, bytes)| (path.join(name), &**bytes)).collect();
    let files: Vec<(&Path, &[u8])> = files.iter().map(|(path, bytes)| (&**path, *bytes)).collect();
    Ok(write_all_whole(&files)?)
}

/// Test objects that ISO-MME's codes distinguish.
const OBJECTS: usize = 35;
