//! CPU time and error of one run of 8 vehicles on 8 at 36 km/h, beside a plain compiled loop
//! and scipy's RK45, as ratios from one run of this program.
//!
//!     CRUMPLE_PYTHON=target/venv/bin/python cargo bench --bench trains
//!
//! (`tests/run` installs that Python; without it scipy's row is left out.) 16 masses, curves of
//! 200 points from the bundled FE runs, memory, 300 ms, 401 outputs. The error is the largest
//! difference of any velocity at any output from the reference method's.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use cpu_time::ProcessTime;
use crumple::build::build;
use crumple::curve::Envelope;
use crumple::dataset::TrainingSet;
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, Method, Record, RunSettings, Unloading, simulate,
};
use crumple::scenario::{self, Prepared};
use crumple::surrogate::{Model, ModelKind};
use rayon::prelude::*;

const POINTS: usize = 200;
const DURATION_S: f64 = 0.3;
const INTERVAL_S: f64 = 0.75e-3;
const UNLOADING_N_PER_M: f64 = 80e6;

/// The same chain for scipy: positions and speeds, memory advanced at each accepted step.
const SCRIPT: &str = "
import json, sys, time
import numpy as np
from scipy.integrate import RK45
c = json.load(open(sys.argv[1]))
m, k_u = np.array(c['masses']), c['unloading']
tables = [tuple(map(np.array, t)) for t in c['tables']]
n = len(m)
def run(rtol):
    largest = np.zeros(n - 1)
    def rates(t, y):
        x, v = y[:n], y[n:]
        d = x[:-1] - x[1:] - np.array(c['gaps'])
        top = np.maximum(largest, d)
        f = np.array([np.interp(t, *e) for t, e in zip(top, tables)]) - k_u * (top - d)
        f = np.where(d > 0, np.maximum(f, 0), 0)
        a = np.zeros(n)
        a[:-1] -= f
        a[1:] += f
        return np.concatenate([v, a / m])
    y0 = np.concatenate([np.array(c['start']), np.array(c['speeds'])])
    times = np.array(c['times'])
    out, filled = np.zeros((len(times), n)), 0
    solver = RK45(rates, 0.0, y0, times[-1], rtol=rtol, atol=rtol, max_step=0.75e-3)
    while solver.status == 'running':
        solver.step()
        dense = solver.dense_output()
        while filled < len(times) and times[filled] <= solver.t:
            out[filled] = dense(times[filled])[n:]
            filled += 1
        d = solver.y[:n - 1] - solver.y[1:n] - np.array(c['gaps'])
        largest = np.maximum(largest, d)
    return out
exact = np.array(c['exact'])
for rtol in [1e-5, 1e-6, 1e-7, 1e-8]:
    begin = time.process_time()
    error = np.abs(run(rtol) - exact).max()
    seconds = time.process_time() - begin
    if error <= 1e-5:
        break
print(seconds, error, rtol)
";

fn main() -> Result<(), Box<dyn Error>> {
    let (chain, tables) = chain()?;
    let base = RunSettings::new(DURATION_S, INTERVAL_S);
    let exact = simulate(&chain, &base.with_method(Method::Reference))?;
    let error_of = |velocities: &[Vec<f64>]| {
        let pairs = velocities.iter().zip(&exact.bodies);
        pairs
            .flat_map(|(ours, b)| ours.iter().zip(&b.v_m_per_s))
            .fold(0.0_f64, |e, (a, b)| e.max((a - b).abs()))
    };
    let of = |settings: RunSettings| -> Result<f64, Box<dyn Error>> {
        // At all outputs, whatever the bench keeps.
        let settings = RunSettings { output_interval_s: INTERVAL_S, ..settings };
        let run = simulate(&chain, &settings)?;
        Ok(error_of(&run.bodies.into_iter().map(|b| b.v_m_per_s).collect::<Vec<_>>()))
    };
    println!("{:<44} {:>10} {:>12} {:>8}", "16 masses, 300 ms", "step", "CPU time", "error");
    let line = |name: &str, step_s: f64, seconds: f64, error: f64, per: f64| {
        println!(
            "{name:<44} {:>7.1} µs {:>9.4} ms {error:>9.1e} m/s  {:>8.3}",
            step_s * 1e6,
            seconds * 1e3,
            seconds / per
        );
    };
    let (mut step, mut plain_error) = (2e-5, f64::INFINITY);
    while plain_error > 1e-5 && step > 1e-7 {
        step /= 2.0;
        plain_error = error_of(&plain(&chain, &tables, step));
    }
    let plain_s = seconds(|| plain(&chain, &tables, step).len());
    line("plain compiled loop, Verlet, to 1e-5 m/s", step, plain_s, plain_error, plain_s);
    let summary = |settings: RunSettings| RunSettings { record: Record::Summary, ..settings };
    let fourth = base.with_method(Method::FourthOrder);
    let coarse = RunSettings { output_interval_s: 3e-3, ..summary(fourth) };
    for (name, settings) in [
        ("fourth order", fourth),
        ("fourth order, 0.375 ms", fourth.with_step(3.75e-4)),
        ("fourth order, half the step", fourth.with_step(0.5 * fourth.step_s)),
        ("fourth order, summary only", summary(fourth)),
        ("fourth order, summary, outputs each 3 ms", coarse),
        ("velocity Verlet", base),
        ("velocity Verlet, 0.05 ms", base.with_step(5e-5)),
        ("velocity Verlet, 0.05 ms, summary only", summary(base.with_step(5e-5))),
    ] {
        let error = of(RunSettings { record: Record::Histories, ..settings })?;
        let run_s = seconds(|| simulate(&chain, &settings).map(|r| r.bodies.len()));
        let used = simulate(&chain, &settings)?.step_s;
        line(name, used, run_s, error, plain_s);
    }
    let ends = split_ends()?;
    for (name, prepared) in
        ["one mass a vehicle, Verlet", "two ends a vehicle, Verlet"].iter().zip(ends)
    {
        let settings = RunSettings { record: Record::Histories, ..base };
        let exact = simulate(&prepared.chain, &base.with_method(Method::Reference))?;
        let run = simulate(&prepared.chain, &settings)?;
        let pairs = prepared.order.iter().map(|&i| (&run.bodies[i], &exact.bodies[i]));
        let error = pairs
            .flat_map(|(ours, exact)| ours.v_m_per_s.iter().zip(&exact.v_m_per_s))
            .fold(0.0_f64, |e, (a, b)| e.max((a - b).abs()));
        let run_s = seconds(|| simulate(&prepared.chain, &settings).map(|r| r.bodies.len()));
        line(name, run.step_s, run_s, error, plain_s);
    }
    let wall = std::time::Instant::now();
    let runs = 100_000;
    let energy: f64 = (0..runs)
        .into_par_iter()
        .map(|_| simulate(&chain, &coarse).map_or(f64::NAN, |r| r.ledger.max_energy_error))
        .reduce(|| 0.0, f64::max);
    println!(
        "{runs} runs on {} threads, summaries, outputs each 3 ms: {:.2} s by the clock; energy within {energy:.0e}",
        rayon::current_num_threads(),
        wall.elapsed().as_secs_f64()
    );
    if let Some(python) = std::env::var_os("CRUMPLE_PYTHON") {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("chain.json");
        let column = |t: usize| exact.bodies.iter().map(|b| b.v_m_per_s[t]).collect::<Vec<f64>>();
        let document = serde_json::json!({
            "masses": chain.bodies().iter().map(|b| b.mass_kg).collect::<Vec<_>>(),
            "speeds": chain.bodies().iter().map(|b| b.speed_m_per_s).collect::<Vec<_>>(),
            "start": exact.bodies.iter().map(|b| b.x_m[0]).collect::<Vec<_>>(),
            "gaps": chain.interfaces().iter().map(|i| i.gap_m).collect::<Vec<_>>(),
            "tables": tables.iter().map(|e| (e.deflection_m(), e.force_n())).collect::<Vec<_>>(),
            "unloading": tables.iter().map(unloading).fold(0.0, f64::max),
            "times": exact.time_s,
            "exact": (0..exact.time_s.len()).map(column).collect::<Vec<_>>(),
        });
        std::fs::write(&path, document.to_string())?;
        let output = Command::new(python).args(["-c", SCRIPT]).arg(&path).output()?;
        let answer = String::from_utf8(output.stdout)?;
        let numbers: Vec<f64> = answer.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let [scipy_s, error, rtol] = numbers[..] else {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        };
        let mut name = String::from("scipy RK45");
        write!(name, ", rtol {rtol:e}")?;
        line(&name, 0.0, scipy_s, error, plain_s);
    } else {
        println!("CRUMPLE_PYTHON is not set: no row of scipy's");
    }
    Ok(())
}

/// CPU seconds of one call: the least of several rounds of calls.
fn seconds<T>(mut call: impl FnMut() -> T) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let begin = ProcessTime::now();
        let calls = 40;
        for _ in 0..calls {
            std::hint::black_box(call());
        }
        best = best.min(begin.elapsed().as_secs_f64() / f64::from(calls));
    }
    best
}

fn unloading(envelope: &Envelope) -> f64 {
    envelope.max_slope().max(UNLOADING_N_PER_M)
}

/// Two trains of a 24 t lead car and seven 20.24 t vehicles, 40 mm between vehicles.
fn chain() -> Result<(Chain, Vec<Envelope>), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let curve = |group: &str| -> Result<Envelope, Box<dyn Error>> {
        let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe").join(group);
        let report = build(&study.join("study.toml"), &folder.path().join("c.h5"), |_| {})?;
        let cases = report.database.cases(group);
        let case = cases.iter().find(|c| c.id.name == "36kmh").ok_or("a case at 36 km/h")?;
        let fine = case.loading()?.envelope;
        let d: Vec<f64> =
            (0..POINTS).map(|i| fine.end_m() * i as f64 / (POINTS - 1) as f64).collect();
        let mut f: Vec<f64> = d.iter().map(|&d| fine.force_at(d)).collect();
        f[0] = 0.0;
        Ok(Envelope::new(d, f)?)
    };
    let (nose, inner) = (curve("lead-car-pair")?, curve("vehicle-pair")?);
    let tables: Vec<Envelope> =
        (0..15).map(|k| if k == 7 { nose.clone() } else { inner.clone() }).collect();
    // One stiffness for all: scipy's script knows the plain law only.
    let stiffness_n_per_m = tables.iter().map(unloading).fold(0.0, f64::max);
    let bodies = (0..16).map(|i| {
        let mass_kg = if i == 7 || i == 8 { 24e3 } else { 20.24e3 };
        Body::new(format!("B{i}"), mass_kg, if i < 8 { 10.0 } else { 0.0 })
    });
    let interfaces = tables.iter().enumerate().map(|(k, envelope)| {
        let unloading = Unloading::Memory { stiffness_n_per_m };
        let law = ForceLaw::new(envelope.clone(), unloading, EnvelopeEnd::Hold);
        Interface::new(format!("I{k}"), law, if k == 7 { 0.0 } else { 0.04 })
    });
    Ok((Chain::new(bodies.collect(), interfaces.collect())?, tables))
}

/// The same trains by models: one mass a vehicle, then two ends each.
fn split_ends() -> Result<[Prepared; 2], Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    for (group, file) in [("lead-car-pair", "pair.model"), ("vehicle-pair", "vehicle.model")] {
        let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe").join(group);
        let report = build(&study.join("study.toml"), &folder.path().join("c.h5"), |_| {})?;
        let set = TrainingSet::new(group, report.database.cases(group))?;
        Model::fit(&set, ModelKind::rate())?.write(&folder.path().join(file))?;
    }
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/trains/eight-on-eight.toml");
    let one = std::fs::read_to_string(shipped)?.replace("method = \"fourth_order\"\n", "");
    let two = one
        .replace(", gap = \"32mm\" }", " }")
        .replace("inner = \"inner\"", "gap = \"32mm\"")
        .replace(
            "mass = \"24.00t\" }",
            "mass = \"24.00t\", front = { curve = \"nose\" }, ends = \"inner\" }",
        )
        .replace("mass = \"20.24t\" }", "mass = \"20.24t\", ends = \"inner\" }")
        .replace("[contact]\ncurve = \"nose\"", "[contact]");
    let load = |name: &str, text: &str| -> Result<Prepared, Box<dyn Error>> {
        let path = folder.path().join(name);
        std::fs::write(&path, text)?;
        Ok(scenario::load(&path)?)
    };
    Ok([load("one.toml", &one)?, load("two.toml", &two)?])
}

/// What one would write first: velocity Verlet, a search in the table for every force.
fn plain(chain: &Chain, tables: &[Envelope], step_s: f64) -> Vec<Vec<f64>> {
    let n = chain.bodies().len();
    let stiffness = tables.iter().map(unloading).fold(0.0, f64::max);
    let (mut x, mut a) = (vec![0.0; n], vec![0.0; n]);
    let mut v: Vec<f64> = chain.bodies().iter().map(|b| b.speed_m_per_s).collect();
    let mut largest = vec![0.0_f64; n - 1];
    let per_output = (INTERVAL_S / step_s).ceil() as usize;
    let h = INTERVAL_S / per_output as f64;
    let mut out: Vec<Vec<f64>> = v.iter().map(|&v| vec![v]).collect();
    for _ in 0..(DURATION_S / INTERVAL_S).round() as usize {
        for _ in 0..per_output {
            for i in 0..n {
                v[i] += 0.5 * h * a[i];
                x[i] += h * v[i];
                a[i] = 0.0;
            }
            for k in 0..n - 1 {
                let d = x[k] - x[k + 1] - chain.interfaces()[k].gap_m;
                if d > 0.0 {
                    largest[k] = largest[k].max(d);
                    let top = tables[k].force_at(largest[k]);
                    let force = (top - stiffness * (largest[k] - d)).max(0.0);
                    a[k] -= force / chain.bodies()[k].mass_kg;
                    a[k + 1] += force / chain.bodies()[k + 1].mass_kg;
                }
            }
            for i in 0..n {
                v[i] += 0.5 * h * a[i];
            }
        }
        for (out, &v) in out.iter_mut().zip(&v) {
            out.push(v);
        }
    }
    out
}
