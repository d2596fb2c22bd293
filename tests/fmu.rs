//! FMUs: archives without clients; with them, that the C law is ours bit by bit, that importers take
//! the FMU and step it, and that a mass on it moves as in our own runs.
//!
//! CRUMPLE_PYTHON_FMU names a Python with tests/python/requirements-fmu.txt, as tests/run sets it.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{build_fixture, python_of, root, says};
use crumple::curve::{CurveUnloading, Envelope, ForceCurve, ForceKind};
use crumple::database::Database;
use crumple::dataset::TrainingSet;
use crumple::formats::{FmiVersion, Spring, archive, binaries};
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, Method, Run, RunSettings, Unloading, simulate,
};
use crumple::surrogate::ForestOptions;
use crumple::surrogate::{Model, ModelKind, Query, predict};
use flate2::bufread::DeflateDecoder;
use serde_json::{Value, json};

const VERSIONS: [(&str, FmiVersion); 2] = [("2", FmiVersion::Fmi2), ("3", FmiVersion::Fmi3)];
/// Of the lead car at 48 km/h.
const MASS_KG: f64 = 24.0e3;
const SPEED_M_PER_S: f64 = 48.0 / 3.6;
const DURATION_S: f64 = 0.3;

/// What inputs cost that are held over a step of co-simulation, as docs/feeding/fmi.md says it: the step
/// in ms; crush and rebound beyond those of the reference in per cent, side by side; both again with the
/// spring stepped first. Of the predicted curve.
const HELD: [(f64, [f64; 4]); 3] = [
    (0.05, [0.112, 0.837, 0.0373, 0.278]),
    (0.1, [0.224, 1.58, 0.0748, 0.557]),
    (1.0, [2.25, 11.6, 0.76, 4.07]),
];
/// Restitution of the same run by the law itself.
const RESTITUTION: f64 = 0.0945;

/// Largest errors of plain Verlet, of motion and force: at 0.05 ms on predicted curves, and at 0.025 ms on a
/// recorded one; as docs/feeding/fmi.md says.
const PLAIN_ON_PREDICTED: [f64; 2] = [1e-6, 1e-5];
const PLAIN_ON_RECORDED: [f64; 2] = [1e-6, 1e-4];
/// Largest error of the rebound by Runge-Kutta at 0.75 ms without events on the curve of `crush-law`, and on
/// that of the forest.
const RK4: f64 = 4e-4;
const RK4_ON_FOREST: f64 = 1.1e-3;

fn run_python(script: &str, arguments: &[&str]) -> Value {
    crate::common::run_python(python_of("CRUMPLE_PYTHON_FMU"), script, arguments)
}

fn envelope() -> Envelope {
    let d = vec![0.0, 0.01, 0.02, 0.2, 0.35, 0.5];
    Envelope::new(d, vec![0.0, 3e6, 1e6, 1.8e6, 0.7e6, 2e6]).unwrap()
}

fn recorded() -> ForceLaw {
    recorded_at(1.0).0
}

/// The recorded curve of a lead car, with its own unloading branch and so many times its own stiffness, in N/m.
fn recorded_at(factor: f64) -> (ForceLaw, f64) {
    let folder = tempfile::tempdir().unwrap();
    let database = Database::read(&build_fixture(folder.path(), "lead-car-wall")).unwrap();
    let cases = database.cases("lead-car-wall");
    let case =
        cases.iter().find(|c| (c.conditions.speed.m_per_s - SPEED_M_PER_S).abs() < 0.1).unwrap();
    let mut curve = ForceCurve::recorded(case).unwrap();
    let CurveUnloading::Recorded { stiffness_n_per_m, .. } = &mut curve.unloading else { panic!() };
    *stiffness_n_per_m *= factor;
    let stiffness_n_per_m = *stiffness_n_per_m;
    (ForceLaw::of_curve(&curve, None, EnvelopeEnd::Hold), stiffness_n_per_m)
}

/// The curve that a model of the lead car predicts at 50 km/h, with 401 points.
fn predicted(kind: ModelKind) -> ForceLaw {
    let folder = tempfile::tempdir().unwrap();
    let database = Database::read(&build_fixture(folder.path(), "lead-car-wall")).unwrap();
    let set = TrainingSet::new("lead-car-wall", database.cases("lead-car-wall")).unwrap();
    let model = Model::fit(&set, kind).unwrap();
    let curve = predict(&model, &Query::at(50.0 / 3.6)).unwrap();
    let curve = curve.driving(ForceKind::Body).unwrap();
    ForceLaw::of_curve(&curve, None, EnvelopeEnd::Hold)
}

fn laws() -> Vec<(&'static str, ForceLaw)> {
    laws_at(1.0).into_iter().map(|(name, law, _)| (name, law)).collect()
}

/// One of each kind, with so many times its unloading stiffness, in N/m.
fn laws_at(factor: f64) -> Vec<(&'static str, ForceLaw, Option<f64>)> {
    let line = |stiffness_n_per_m: f64, end| {
        let stiffness_n_per_m = factor * stiffness_n_per_m;
        let unloading = Unloading::Memory { stiffness_n_per_m };
        (ForceLaw::new(envelope(), unloading, end), stiffness_n_per_m)
    };
    let of = |name, (law, stiffness)| (name, law, Some(stiffness));
    vec![
        of("line", line(40e6, EnvelopeEnd::Slope)),
        of("stiff", line(400e6, EnvelopeEnd::Error)),
        of("recorded", recorded_at(factor)),
        ("elastic", ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Slope), None),
    ]
}

fn fmu(name: &str, law: &ForceLaw, version: FmiVersion) -> Vec<u8> {
    let facts = [("speed", "48 km/h".to_string()), ("odd <&>", "\"quotes\"".to_string())];
    let spring = Spring { name, description: "spring of a test", law, facts: &facts };
    archive(&spring, version).unwrap()
}

/// Writes an FMU and returns its path.
fn write(folder: &Path, name: &str, law: &ForceLaw, version: FmiVersion) -> PathBuf {
    let path = folder.join(format!("{name}-{version:?}.fmu"));
    std::fs::write(&path, fmu(name, law, version)).unwrap();
    path
}

fn files(fmu: Vec<u8>) -> BTreeMap<String, Vec<u8>> {
    let archive = rawzip::ZipArchive::from_slice(&fmu).unwrap();
    let mut files = BTreeMap::new();
    let mut entries = archive.entries();
    while let Some(entry) = entries.next_entry().unwrap() {
        let name = entry.file_path().try_normalize().unwrap().as_ref().to_string();
        let packed = archive.get_entry(entry.wayfinder()).unwrap();
        let mut bytes = Vec::new();
        // Its size and checksum are verified as it is read.
        packed
            .verifying_reader(DeflateDecoder::new(packed.data()))
            .read_to_end(&mut bytes)
            .unwrap();
        files.insert(name, bytes);
    }
    files
}

/// Numbers as text of their bits: JSON would round them.
fn bits(values: impl IntoIterator<Item = f64>) -> Vec<String> {
    values.into_iter().map(|value| format!("{:016x}", value.to_bits())).collect()
}

#[test]
fn the_same_input_gives_the_same_archive() {
    let law = &laws()[0].1;
    for (_, version) in VERSIONS {
        assert_eq!(fmu("a", law, version), fmu("a", law, version));
        assert_ne!(fmu("a", law, version), fmu("b", law, version));
    }
}

#[test]
fn binaries_lie_where_each_version_looks_for_them() {
    let law = &laws()[0].1;
    assert_eq!(binaries().collect::<Vec<_>>(), ["linux64", "win64"]);
    let folders = [("linux64", "x86_64-linux", "so"), ("win64", "x86_64-windows", "dll")];
    for (fmi2, fmi3, extension) in folders {
        for (folder, (_, version)) in [fmi2, fmi3].into_iter().zip(VERSIONS) {
            let files = files(fmu("my spring", law, version));
            let library = &files[&format!("binaries/{folder}/my_spring.{extension}")];
            if extension == "so" {
                // Importers on old systems load it too.
                let text = String::from_utf8_lossy(library);
                let versions: Vec<&str> = text.split("GLIBC_").skip(1).collect();
                assert!(!versions.is_empty() && versions.iter().all(|v| v.starts_with("2.2.5\0")));
            }
            let has_build = files.contains_key("sources/buildDescription.xml");
            assert_eq!(has_build, version == FmiVersion::Fmi3);
        }
    }
}

/// A C compiler for LINUX or WINDOWS that gives the same bytes on any platform: zig's clang.
fn zig(target: &str) -> Command {
    let mut command = crate::common::python_of("CRUMPLE_PYTHON_FMU");
    // The same sums as Rust's, which never contracts a·b + c.
    command.args(["-m", "ziglang", "cc", "-std=c99", "-Wall", "-Wextra", "-ffp-contract=off"]);
    command.args(["-target", target]);
    if target == WINDOWS {
        // Without a C runtime of its own, which zig would have to compile first, and that takes minutes. That also drops
        // zig's paths to the headers, which are given here.
        let mut package = crate::common::python_of("CRUMPLE_PYTHON_FMU");
        package.args(["-c", "import ziglang; print(ziglang.__path__[0], end='')"]);
        let package = String::from_utf8(package.output().unwrap().stdout).unwrap();
        command.arg("-nostdlib").arg("-isystem");
        command.arg(Path::new(&package).join("lib/libc/include/any-windows-any"));
        command.args(["-lkernel32", "-lapi-ms-win-crt-heap-l1-1-0"]);
    }
    command
}

/// glibc of 2012, and the C library of Windows 10.
const LINUX: &str = "x86_64-linux-gnu.2.17";
const WINDOWS: &str = "x86_64-windows-gnu";

/// The committed libraries are the bytes that their sources give. To write them after a change of the sources:
/// `CRUMPLE_WRITE_LIBRARIES=1 tests/run --test all the_libraries`, then build again.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn the_libraries_are_compiled_from_the_sources() {
    let folder = tempfile::tempdir().unwrap();
    let component = root().join("src/formats/fmu");
    let mut sources: Vec<_> = std::fs::read_dir(component.join("c"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "c"))
        .map(|path| path.file_name().unwrap().to_owned())
        .collect();
    sources.sort();
    let linux: &[&str] = &["-fPIC", "-fvisibility=hidden", "-Wl,--build-id=none"];
    for (name, target, flags) in
        [("linux64.so", LINUX, linux), ("win64.dll", WINDOWS, &["../lib/entry.c"])]
    {
        let mut command = zig(target);
        command.args(["-O2", "-fno-builtin", "-fno-sanitize=undefined"]);
        command.args(["-fno-stack-protector", "-ffile-prefix-map=.=crumple", "-shared", "-s"]);
        command.args(flags).arg("-o").arg(folder.path().join(name));
        let output = command.args(&sources).current_dir(component.join("c")).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let compiled = std::fs::read(folder.path().join(name)).unwrap();
        let committed = component.join("lib").join(name);
        if std::env::var_os("CRUMPLE_WRITE_LIBRARIES").is_some() {
            std::fs::write(&committed, &compiled).unwrap();
        }
        let is_same = std::fs::read(committed).is_ok_and(|bytes| bytes == compiled);
        assert!(is_same, "{name} is not what its sources give: see this test on writing it");
    }
}

/// Odd names end up escaped in texts, and as plain identifiers where importers make paths of them.
#[test]
fn odd_names_make_sound_archives() {
    let law = &laws()[0].1;
    let long = "ä ".repeat(100) + &"b".repeat(200);
    for name in ["", "Stoß vorn <&> \"hinten\"", "../../etc/passwd", "7", &long] {
        for (_, version) in VERSIONS {
            let files = files(fmu(name, law, version));
            let xml = String::from_utf8(files["modelDescription.xml"].clone()).unwrap();
            let model = xml.split("modelName=\"").nth(1).unwrap().split('"').next().unwrap();
            assert!(model.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'), "{model}");
            assert!((3..=60).contains(&model.len()), "{model}");
            assert!(files.keys().all(|path| !path.contains("..")));
            let facts: Value = serde_json::from_slice(&files["extra/crumple/facts.json"]).unwrap();
            assert_eq!(facts["name"], name);
            let page = String::from_utf8(files["documentation/index.html"].clone()).unwrap();
            says(&page, "<tr><th>odd &lt;&amp;&gt;</th><td>&quot;quotes&quot;</td></tr>");
        }
    }
}

/// 10 000 pairs of deflection and maximum deflection for each law: the same bits, also where the importer
/// has set its unloading stiffness.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn the_c_law_is_ours_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    for ((name, law, stiffness), (_, stiffer, _)) in laws_at(1.0).into_iter().zip(laws_at(3.0)) {
        // Any fixed sequence does; half the pairs lie on the envelope or beyond its end.
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let end = law.envelope().end_m();
        let pairs: Vec<(f64, f64)> = (0..10_000)
            .map(|i| {
                let largest = 1.2 * end * random();
                let share = if i % 4 == 0 { 1.0 } else { 1.05 * random() - 0.05 };
                (share * largest, largest)
            })
            .collect();
        let energies = |pick: fn((f64, f64)) -> f64| {
            bits(pairs.iter().map(|&(d, largest)| pick(law.energies_j(d, largest))))
        };
        let asked = json!({
            "deflection": bits(pairs.iter().map(|p| p.0)),
            "largest": bits(pairs.iter().map(|p| p.1)),
            "force": bits(pairs.iter().map(|p| law.force_n(p.0, p.1))),
            "stored_energy": energies(|e| e.0),
            "dissipated_energy": energies(|e| e.1),
        });
        let file = folder.path().join("pairs.json");
        std::fs::write(&file, asked.to_string()).unwrap();
        let set = stiffness.map(|stiffness| (&stiffer, format!("{stiffness:?}")));
        let of_versions = VERSIONS.map(|(_, version)| (version, (&law, String::new())));
        for (version, (law, set)) in
            of_versions.into_iter().chain(set.map(|set| (FmiVersion::Fmi3, set)))
        {
            let fmu = write(folder.path(), name, law, version);
            let mut arguments = vec![fmu.to_str().unwrap(), file.to_str().unwrap()];
            arguments.extend((!set.is_empty()).then_some(&*set));
            let found = run_python("fmu_law.py", &arguments);
            println!("{name}, {version:?}, {set}: {found}");
            assert_eq!(found["pairs"], 10_000);
            assert_eq!(found["different"], 0, "{name}, {version:?}: {found}");
            // Between two knots the force is a straight line.
            assert!(found["bent"].as_f64().unwrap() < 1e-12, "{name}, {version:?}: {found}");
            assert!(found["pieces"].as_u64().unwrap() > 500, "{name}, {version:?}: {found}");
            // Central differences of what is smooth there.
            assert!(found["derivative"].as_f64().unwrap() < 1e-4, "{name}, {version:?}: {found}");
        }
    }
}

/// Wrong order, unknown variables, numbers that are none: errors with a message, and nothing changes.
/// States continue bit by bit; instances do not meet.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn wrong_calls_are_refused_and_states_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let other = write(folder.path(), "other", &laws()[0].1, FmiVersion::Fmi2);
    for (_, version) in VERSIONS {
        let fmu = write(folder.path(), "recorded", &recorded(), version);
        let fmus = [fmu.to_str().unwrap(), other.to_str().unwrap()];
        let found = run_python("fmu_calls.py", &fmus);
        println!("{version:?}: {found}");
        assert_eq!(found["failed"], json!([]), "{version:?}");
    }
}

/// FMPy validates, simulates both ways and compiles the sources; fmutool checks; libcosim and Ecos
/// step it.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn importers_take_the_fmu() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["recorded", "Stoß vorn <&> \"hinten\" 48 km/h"] {
        for (number, version) in VERSIONS {
            let path = folder.path().join(format!("fmu{number}.fmu"));
            std::fs::write(&path, fmu(name, &recorded(), version)).unwrap();
            let found = run_python("fmu_importers.py", &[path.to_str().unwrap()]);
            println!("{version:?}: {found}");
            assert_eq!(found["failed"], json!([]), "{version:?}");
        }
    }
}

#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn declarations_are_those_of_the_standards_headers() {
    let sources = root().join("src/formats/fmu/c");
    let found = run_python("fmu_headers.py", &[sources.to_str().unwrap()]);
    assert_eq!(found["lacking"], json!([]));
    assert_eq!(found["more"], json!([]));
    assert!(found["both"].as_array().unwrap().len() > 110);
}

/// One mass against a wall through a law, at every 0.05 ms.
fn one_mass(law: &ForceLaw, method: Method, step_s: f64) -> Run {
    let interface = Interface::new("A1|wall", law.clone(), 0.0);
    let bodies = vec![Body::new("A1", MASS_KG, SPEED_M_PER_S)];
    let chain = Chain::new(bodies, vec![interface]).unwrap();
    let settings = RunSettings::new(DURATION_S, 5e-5).with_method(method).with_step(step_s);
    let run = simulate(&chain, &settings).unwrap();
    assert_eq!(run.step_s, step_s, "{method:?}");
    run
}

/// The textbook's velocity Verlet on a law of ours: x, v and force at every 0.05 ms.
fn plain_verlet(law: &ForceLaw, step_s: f64) -> Value {
    let (mut x, mut v, mut largest, mut force) = (0.0, SPEED_M_PER_S, 0.0_f64, 0.0);
    let (mut xs, mut vs, mut forces) = (vec![x], vec![v], vec![force]);
    let every = (5e-5 / step_s).round() as usize;
    for n in 1..=(DURATION_S / step_s).round() as usize {
        v -= 0.5 * step_s * force / MASS_KG;
        x += step_s * v;
        largest = largest.max(x);
        force = law.force_n(x, largest);
        v -= 0.5 * step_s * force / MASS_KG;
        if n % every == 0 {
            xs.push(x);
            vs.push(v);
            forces.push(force);
        }
    }
    json!({ "x": xs, "v": vs, "force": forces })
}

/// Masters in Python move one mass against a wall through the FMU: to the bit as the same scheme on
/// our law, and as our runs do.
///
/// Our Verlet knows the work within a step. A master knows it too if it takes the mean force of a step
/// from the energies, or stops at the knots; one that does neither is off on many kinks by what its step
/// costs. On the recorded curve our runs take half the step, because its unloading branch is steep.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn one_mass_moves_as_in_our_own_runs() {
    let folder = tempfile::tempdir().unwrap();
    let forest = predicted(ModelKind::forest(ForestOptions::default()));
    let crush_law = predicted(ModelKind::named("crush-law", 0).unwrap());
    // With the largest errors of plain Verlet, of motion and force.
    let laws = [
        ("predicted", forest, 5e-5, PLAIN_ON_PREDICTED),
        ("crush-law", crush_law, 5e-5, PLAIN_ON_PREDICTED),
        ("recorded", recorded(), 2.5e-5, PLAIN_ON_RECORDED),
    ];
    for (name, law, step_s, plain) in laws {
        let history = |run: &Run| {
            json!({
                "x": run.bodies[0].x_m,
                "v": run.bodies[0].v_m_per_s,
                "force": run.interfaces[0].force_n,
            })
        };
        let verlet = one_mass(&law, Method::Verlet, step_s);
        let reference = one_mass(&law, Method::Reference, 1e-5);
        let asked = json!({
            "mass": MASS_KG,
            "speed": SPEED_M_PER_S,
            "duration": DURATION_S,
            "step": step_s,
            "verlet": history(&verlet),
            "plain": plain_verlet(&law, step_s),
            "reference": history(&reference),
            "crush": reference.interfaces[0].max_deflection_m,
        });
        let file = folder.path().join("runs.json");
        std::fs::write(&file, asked.to_string()).unwrap();
        for (_, version) in VERSIONS {
            let fmu = write(folder.path(), name, &law, version);
            let arguments = [fmu.to_str().unwrap(), file.to_str().unwrap()];
            let found = run_python("fmu_masters.py", &arguments);
            println!("{name}, {version:?}: {found:#}");
            let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap();
            for (quantity, i, most, reference) in
                [("x", 0, 1e-6, 1e-6), ("v", 0, 1e-6, 1e-6), ("force", 1, 1e-5, 1e-4)]
            {
                for kind in ["cs", "me"] {
                    let off = |run: &str| number(&format!("/{run}/{kind}/{quantity}"));
                    assert_eq!(off("plain"), 0.0, "{name}, {kind}, {quantity}");
                    assert!(off("verlet") < plain[i], "{name}, {kind}, {quantity}");
                    assert!(off("mean_force") < most, "{name}, {kind}, {quantity}");
                    assert!(off("reference") < reference, "{name}, {kind}, {quantity}");
                }
                assert!(number(&format!("/events/verlet/{quantity}")) < most, "{name}, {quantity}");
            }
            assert!(number("/rk4/of_law").abs() < 1e-3, "{name}");
            assert!(number("/events/rk4").abs() < 4e-4, "{name}");
            assert!((340.0..380.0).contains(&number("/events/count")), "{name}");
            match name {
                "predicted" => costs_are_those_of_the_document(&found, version),
                "crush-law" => assert!(number("/rk4/of_reference").abs() < RK4, "{found}"),
                _ => {}
            }
        }
    }
}

/// Each number of the document within 3 % of itself; the input's derivative does what the other order does.
fn costs_are_those_of_the_document(found: &Value, version: FmiVersion) {
    let is_said = |found: f64, said: f64| (found / said - 1.0).abs() < 0.03;
    let held = |order: &str, step_ms: f64, what: &str| {
        100.0 * found["held"][format!("{order}, {step_ms} ms")][what].as_f64().unwrap()
    };
    for (step_ms, [crush, rebound, crush_first, rebound_first]) in HELD {
        let mut orders = vec![("side_by_side", crush, rebound)];
        orders.push(("spring_first", crush_first, rebound_first));
        if version == FmiVersion::Fmi2 {
            orders.push(("extrapolated", crush_first, rebound_first));
        }
        for (order, crush, rebound) in orders {
            let seen = (held(order, step_ms, "crush"), held(order, step_ms, "rebound"));
            assert!(is_said(seen.0, crush), "{order}, {step_ms} ms: {seen:?}");
            assert!(is_said(seen.1, rebound), "{order}, {step_ms} ms: {seen:?}");
        }
    }
    assert!(is_said(found["restitution"].as_f64().unwrap(), RESTITUTION));
    assert!(found["rk4"]["of_reference"].as_f64().unwrap().abs() < RK4_ON_FOREST, "{found}");
}

/// The document has the numbers that the test of the masters holds.
#[test]
fn the_document_says_what_held_inputs_cost() {
    let text = std::fs::read_to_string(root().join("docs/feeding/fmi.md")).unwrap();
    for (step_ms, [crush, rebound, crush_first, rebound_first]) in HELD {
        let row = format!(
            "| {step_ms} ms | +{crush} % | +{rebound} % | +{crush_first} % | +{rebound_first} % |"
        );
        assert!(text.contains(&row), "docs/feeding/fmi.md has no row {row}");
    }
    assert!(text.contains(&format!("restitution of {RESTITUTION}")));
    let [motion, force] = PLAIN_ON_RECORDED.map(|share| 100.0 * share);
    for said in [
        format!(
            "at 0.025 ms within {motion:.4} % of position and speed, but {force:.2} % of the force"
        ),
        format!("within {:.2} % of the rebound on the forest's", 100.0 * RK4_ON_FOREST),
        format!("within {:.2} % on that of `crush-law`", 100.0 * RK4),
    ] {
        assert!(text.contains(&said), "docs/feeding/fmi.md does not say {said}");
    }
}

/// The .dll under wine gives the bits of the .so.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn the_windows_library_gives_the_same_bits() {
    let has = |program: &str| Command::new(program).arg("--version").output().is_ok();
    let wine = ["wine64", "/usr/lib/wine/wine64"].into_iter().find(|wine| has(wine));
    let Some(wine) = wine else {
        assert!(std::env::var_os("CRUMPLE_REQUIRE_ALL").is_none(), "wine64 is absent");
        println!("left out: wine64 is absent");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let law = recorded();
    for (name, bytes) in files(fmu("spring 1", &law, FmiVersion::Fmi2)) {
        if name.starts_with("binaries/") || name == "modelDescription.xml" {
            std::fs::write(here.join(name.rsplit('/').next().unwrap()), bytes).unwrap();
        }
    }
    let xml = std::fs::read_to_string(here.join("modelDescription.xml")).unwrap();
    let guid = xml.split("guid=\"").nth(1).unwrap().split('"').next().unwrap();
    let source = root().join("tests/fmu_steps.c");
    let programs = [("steps", "./spring_1.so", LINUX), ("steps.exe", "spring_1.dll", WINDOWS)];
    for (program, library, target) in programs {
        let mut command = zig(target);
        command.arg(format!("-DLIBRARY=\"{library}\"")).arg(format!("-DIDENTIFIER=\"{guid}\""));
        command.args(["-O1", "-fno-sanitize=undefined"]).arg(&source);
        command.args((target == WINDOWS).then_some("-Wl,-e,mainCRTStartup"));
        command.arg("-o").arg(here.join(program));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let printed = |command: &mut Command| {
        let command = command.current_dir(here).env("WINEPREFIX", here.join("wine"));
        // Without what wine installs for browsers and .NET in a new prefix.
        let command = command.env("WINEDEBUG", "-all").env("WINEDLLOVERRIDES", "mscoree,mshtml=");
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().replace('\r', "")
    };
    let ours = printed(&mut Command::new(here.join("steps")));
    let theirs = printed(Command::new(wine).arg("steps.exe"));
    assert!(ours.lines().count() > 1000, "{ours}");
    let differs = ours.lines().zip(theirs.lines()).position(|(a, b)| a != b);
    assert_eq!((differs, ours.len()), (None, theirs.len()), "the first line that differs");
}
