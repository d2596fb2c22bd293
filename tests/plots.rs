//! Pictures: no text leaves one or overlaps another, series can be distinguished, the bytes are always the same.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crumple::assess::Choice;
use crumple::assess::ComparisonSettings;
use crumple::assess::compare_train;
use crumple::charts::{self, Motion, Quantity};
use crumple::curve::ForceKind;
use crumple::database::Database;
use crumple::multibody::simulate;
use crumple::plot::{Axis, Band, Chart, Drawing, Mark, Panel, Series};
use crumple::scenario;
use crumple::solver::{self, Selection};
use crumple::surrogate::{Model, Query, predict};
use crumple::unit::UnitSystem;

use crate::common::{crumple_fails, crumple_ok, demo_folder, entries, root, says};

/// Every text lies within the picture, and no two texts touch.
fn assert_texts_are_free(drawing: &Drawing, what: &str) {
    let boxes = drawing.text_boxes();
    for (k, &(one, place)) in boxes.iter().enumerate() {
        let [left, top, right, bottom] = place;
        assert!(
            left >= 0.0 && top >= 0.0 && right <= drawing.width && bottom <= drawing.height,
            "{what}: \"{one}\" leaves the picture: {place:?} of {} × {}",
            drawing.width,
            drawing.height
        );
        for (other, [l, t, r, b]) in &boxes[..k] {
            let is_apart = right <= *l || *r <= left || bottom <= *t || *b <= top;
            assert!(is_apart, "{what}: \"{one}\" and \"{other}\" overlap");
        }
    }
}

fn check(chart: &Chart, what: &str) {
    for (width, height) in [(780.0, 320.0), (320.0, 80.0), (1600.0, 700.0), (420.0, 320.0)] {
        let drawing = Chart { width, height, ..chart.clone() }.drawing();
        let what = format!("{what} at {width} × {height}");
        assert_texts_are_free(&drawing, &what);
    }
    // No two looks are alike: a test of them.
    for panel in &chart.panels {
        let looks: BTreeSet<_> =
            panel.series.iter().map(|s| (s.look, format!("{:?}", s.shown))).collect();
        assert_eq!(looks.len(), panel.series.len(), "{what}: series of one look");
    }
    for axis in chart.panels.iter().flat_map(|panel| [&panel.x, &panel.y]) {
        assert!(!axis.unit.is_empty(), "{what}: {} has no unit", axis.quantity);
    }
}

#[test]
fn texts_of_all_charts_are_free() {
    let folder = demo_folder();
    let folder = folder.path();
    let database = Database::read(&folder.join("curves.h5")).unwrap();
    for group in database.groups() {
        let cases = database.cases(group);
        for force in [ForceKind::Contact, ForceKind::Body] {
            check(&charts::group_curves(group, cases, force), group);
        }
    }
    // Of several kinds of speed each curve says its own.
    let both = [database.cases("lead-car-wall"), database.cases("vehicle-pair")].concat();
    let chart = charts::group_curves("both", &both, ForceKind::Contact);
    check(&chart, "both");
    assert_eq!(chart.title, "both: contact force by speed");
    let names: Vec<&str> = chart.panels[0].series.iter().map(|series| &*series.name).collect();
    assert!(names.contains(&"FE at 18 km/h (wall)"), "{names:?}");
    assert!(names.contains(&"FE at 9 km/h (closing)"), "{names:?}");
    let cases = database.cases("lead-car-wall");
    let chosen = Choice::Kind(crumple::surrogate::ModelKind::linear());
    check(
        &charts::left_out_at("lead-car-wall", cases, (48.0 / 3.6, None), chosen).unwrap(),
        "left out",
    );
    let model = Model::read(&folder.join("lead.model")).unwrap();
    for speed in [12.0, 50.0, 71.0, 80.0] {
        let curve =
            predict(&model, &Query { extrapolate: true, ..Query::at(speed / 3.6) }).unwrap();
        check(&charts::prediction(&curve, &model.cases), "prediction");
    }
    for name in ["scenario.toml", "eight-on-eight.toml", "en15227-identical-units.toml"] {
        let prepared = scenario::load(&folder.join(name)).unwrap();
        let run = simulate(&prepared.chain, &prepared.settings).unwrap();
        let motion = Motion::of_run(&prepared, &run, vec!["a note".into()]);
        use Quantity::{Acceleration, Crush, Energy, Force, Velocity};
        for quantity in [Velocity, Acceleration, Force, Crush, Energy] {
            for runs in [vec!["one"], vec!["one", "other"]] {
                let runs: Vec<(String, Motion)> =
                    runs.into_iter().map(|name| (name.into(), motion.clone())).collect();
                check(&charts::motion(name, &runs, quantity, &[], 60).unwrap(), name);
            }
        }
    }
    let path = folder.join("train-set.toml");
    let settings = ComparisonSettings { nsdm_seeds: 0, ..ComparisonSettings::default() };
    let comparison = compare_train(&path, &scenario::read(&path).unwrap(), &settings).unwrap();
    check(&charts::train_speeds("train", &comparison), "train");
    for file in ["nodout", "rwforc"] {
        let path = folder.join("fe/lead-car-wall/36kmh").join(file);
        let read = solver::read(&path, None, &Selection::all()).unwrap();
        let histories: Vec<_> = read.histories.iter().take(20).collect();
        let units = Some(UnitSystem::parse("mm-t-s").unwrap());
        for (units, class) in [(units, Some(60)), (None, None)] {
            check(&charts::histories(file, &histories, units, class).unwrap(), file);
        }
    }
}

/// Names that users give: long, with signs and in other letters, or none.
const NAMES: [&str; 6] = [
    "a title that is much longer than any picture is wide, as it comes out of decks in which somebody has described the whole vehicle, the date and the weather, and then some more",
    "</svg><b>&\"'",
    "Stoß gegen eine Wand, Δv = 36 km/h, Ω ≥ 3",
    "列車の衝突",
    "oneverylongwordwithoutanyblankinitthatcannotbebrokenanywhereatallandgoesonandonandonandonandon",
    "",
];

#[test]
fn names_of_any_length_have_their_place() {
    let mut chart = Chart::row("", Vec::new());
    check(&chart, "nothing");
    for (k, name) in NAMES.into_iter().enumerate() {
        chart.title = name.into();
        let mut panel = Panel::new(Axis::new(name, "m", 1.0), Axis::new(name, "MN", 1e-6));
        panel.title = name.into();
        for (look, other) in NAMES.into_iter().enumerate() {
            let x: Vec<f64> = (0..50).map(|i| 0.02 * f64::from(i)).collect();
            let y: Vec<f64> = x.iter().map(|x| 1e6 * (x + look as f64)).collect();
            panel.series.push(Series::line(other, look, x, y));
        }
        panel.bands.push(Band {
            name: name.into(),
            look: 1,
            x: vec![0.0, 1.0],
            low: vec![-1e300, f64::NAN],
            high: vec![1e300, f64::INFINITY],
            is_stacked: k % 2 == 0,
        });
        for i in 0..30 {
            panel.marks.push(Mark { name: name.into(), x: 0.03 * f64::from(i) });
        }
        chart.panels.push(panel);
        chart.notes.push(name.into());
        check(&chart, &format!("{} panels", k + 1));
    }
}

/// Values at the ends of what numbers can be make a picture all the same.
#[test]
fn extreme_values_are_drawn() {
    let extremes = [0.0, -0.0, 1e-300, -1e300, 1e300, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY];
    for a in extremes {
        for b in extremes {
            let series = Series::line("line", 0, vec![a, b, 1.0], vec![b, a, 1.0]);
            let empty = Panel::new(Axis::new("x", "m", 1.0), Axis::new("y", "N", 1.0));
            let chart = Chart::of("extremes", Panel { series: vec![series], ..empty });
            let drawing = chart.drawing();
            assert_texts_are_free(&drawing, &format!("{a} and {b}"));
            assert!(
                !drawing.svg().contains("NaN") && !drawing.svg().contains("inf"),
                "{a} and {b}"
            );
            drawing.png(1.0).unwrap();
        }
    }
    let chart = Chart::of("large", Panel::new(Axis::new("x", "m", 1.0), Axis::new("y", "N", 1.0)));
    assert!(chart.drawing().png(1e4).unwrap_err().to_string().contains("cannot be drawn"));
}

/// The commands that the help shows, their titles, and names of the legend.
#[test]
fn every_kind_of_file_is_drawn() {
    let folder = demo_folder();
    let folder = folder.path();
    crumple_ok(folder, "simulate scenario.toml -o result.csv");
    let slower =
        fs::read_to_string(folder.join("scenario.toml")).unwrap().replace("54km/h", "40km/h");
    fs::write(folder.join("slower.toml"), slower).unwrap();
    crumple_ok(folder, "simulate slower.toml -o slower.csv");
    let speed =
        "{ what = \"speed\", train = \"A\", from = \"30km/h\", to = \"60km/h\", steps = 3 }";
    for (name, samples, force) in [
        ("sweep", "", ""),
        ("grid", "", ", { what = \"force\", curve = \"nose\", from = 0.9, to = 1.1, steps = 2 }"),
        (
            "drawn",
            "samples = 20\n",
            ", { what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 0.1 }",
        ),
    ] {
        let plan = format!("[sweep]\n{samples}vary = [{speed}{force}]\n");
        fs::write(folder.join(format!("{name}.plan.toml")), plan).unwrap();
        crumple_ok(folder, &format!("sweep scenario.toml --plan {name}.plan.toml -o {name}.csv"));
    }
    #[rustfmt::skip]
    let cases = [
        ("curves.h5 --group lead-car-wall", &["FE at 72 km/h", "deflection [m]", "force [MN]"][..]),
        ("curves.h5 --group lead-car-wall --force body", &["lead-car-wall: body force (not filtered) by wall speed"]),
        ("curves.h5 --group lead-car-pair --left-out 48km/h", &["FE at 48 km/h", "closing speed [m/s]"]),
        ("lead.model --speed 50km/h", &["FE at 48 km/h", "FE at 60 km/h", "maximum crush", "empirical 90 % range from 5 curves left out at inner speeds"]),
        ("lead50.json", &["lead-car-wall at 50 km/h: contact force by the model crush-law"]),
        ("lead50.json --force body", &["lead-car-wall at 50 km/h: body force by the model crush-law"]),
        ("scenario.toml --quantity energy", &["kinetic", "A1|wall", "energy [MJ]", "time [ms]"]),
        ("scenario.toml --quantity acceleration", &["scenario: acceleration, CFC 60", "acceleration [g]", "Curve nose: lead.model: crush-law of lead-car-wall, 7 FE runs, 12 km/h to 72 km/h."]),
        ("result.csv --quantity crush", &["A1|wall", "deflection [m]"]),
        ("result.csv slower.csv", &["A1, result", "A1, slower", "speed [m/s]"]),
        // Small multiples beyond six, and what is chosen in one panel.
        ("two-sets.toml two-sets.toml", &["B4", "two-sets.toml"]),
        ("two-sets.toml --body A1 --body B1", &["A1", "B1"]),
        ("two-sets.toml --quantity crush --interface A1|B1 --interface A1|A2", &["A1|A2", "force [MN]"]),
        ("train-set.toml --quantity crush", &["beyond the data of the curve"]),
        ("sweep.csv", &["max deflection [m]", "speed A [km/h]"]),
        ("grid.csv --result final_v --result max_deflection_m[A1|wall]", &["final v A1 [m/s]", "force factor nose"]),
        ("drawn.csv --over force_factor --result peak_force", &["median", "5 to 95 % of the runs", "Also varied: speed_m_per_s[A]."]),
        ("train-set.toml --train", &["A1", "A3", "FE", "best_local", "speed [m/s]"]),
        ("fe/lead-car-wall/36kmh/nodout --id 900001 --component x_velocity --units mm-t-s --cfc 60", &["900001, CFC 60", "x_velocity [m/s]"]),
        ("fe/lead-car-wall/36kmh/crashT01 --section rwforc --component normal_force", &["normal_force [unit of the file]"]),
    ];
    for (arguments, texts) in cases {
        let mut all = vec!["plot"];
        all.extend(arguments.split(' '));
        all.extend(["-o", "a.svg", "-o", "a.png"]);
        if arguments.contains("crashT01")
            && !folder.join("fe/lead-car-wall/36kmh/crashT01").exists()
        {
            continue;
        }
        crumple_ok(folder, &all);
        let svg = fs::read_to_string(folder.join("a.svg")).unwrap();
        for text in texts {
            assert!(svg.contains(&format!("aria-label=\"{text}\"")), "{arguments}: no \"{text}\"");
        }
        assert!(!svg.contains("<text") && !svg.contains("font-family"), "texts are outlines");
        let png = fs::read(folder.join("a.png")).unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
        let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
        assert_eq!(width, 1560, "two pixels for one");
        // The same again has the same bytes.
        crumple_ok(folder, &all);
        assert_eq!(fs::read_to_string(folder.join("a.svg")).unwrap(), svg);
        assert_eq!(fs::read(folder.join("a.png")).unwrap(), png);
    }
    // What a damper takes is its interface's, as in the table; the reference method knows the sum alone.
    let scenario = fs::read_to_string(folder.join("scenario.toml")).unwrap();
    let damper = "model = \"lead.model\", damping = { coefficient_N_s_per_m = [1e5] }";
    let damped = scenario.replace("model = \"lead.model\"", damper);
    for (text, apart) in [
        (damped.clone(), false),
        (damped.replacen("[run]", "[run]\nmethod = \"reference\"", 1), true),
    ] {
        fs::write(folder.join("damped.toml"), text).unwrap();
        crumple_ok(folder, "plot damped.toml --quantity energy -o a.svg");
        let svg = fs::read_to_string(folder.join("a.svg")).unwrap();
        assert!(svg.contains("aria-label=\"A1|wall\""));
        assert_eq!(svg.contains("rate, stopped mass, dampers, resistance"), apart);
        assert!(!svg.contains("error of the method") && !svg.contains("aria-label=\"resistance"));
    }
}

/// What an end stops is no longer the vehicle's: all energy of the start is in the picture at all times. Of two runs an interface has
/// one colour, which nothing else has.
#[test]
fn energies_of_ends_and_of_two_runs() {
    let folder = demo_folder();
    let folder = folder.path();
    crumple_ok(folder, "plot split-ends.toml --quantity energy -o a.svg");
    let svg = fs::read_to_string(folder.join("a.svg")).unwrap();
    assert!(!svg.contains("error of the method") && svg.contains("aria-label=\"kinetic"));
    let scenario = fs::read_to_string(folder.join("scenario.toml")).unwrap();
    let braked = "speed = \"50km/h\"\nresistance = { braking = 0.15 }";
    let scenario = scenario.replace("speed = \"50km/h\"", braked);
    fs::write(folder.join("braked.toml"), scenario).unwrap();
    crumple_ok(folder, "plot scenario.toml braked.toml --quantity energy -o a.svg");
    let svg = fs::read_to_string(folder.join("a.svg")).unwrap();
    for name in ["kinetic", "A1|wall", "resistance"] {
        assert_eq!(svg.matches(&format!("aria-label=\"{name}\"")).count(), 1, "{name}: {svg}");
    }
}

/// A sweep is drawn alike from both files that it can be written to, also a sample of its rows.
#[test]
fn sweeps_are_drawn_from_csv_and_hdf5() {
    let folder = demo_folder();
    let folder = folder.path();
    for (samples, over, has_range) in [
        (20, "speed_m_per_s[A]", false),
        (50, "speed_m_per_s[A]", true),
        (111, "speed_m_per_s[A]", true),
        (21_000, "force_factor[nose]", true),
    ] {
        let plan = format!(
            "[sweep]\nsamples = {samples}\nvary = [ {{ what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"30km/h\", to = \"40km/h\" }}, {{ what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 0.1 }} ]\n"
        );
        fs::write(folder.join("plan.toml"), plan).unwrap();
        let scenario = fs::read_to_string(folder.join("scenario.toml")).unwrap();
        let own = scenario.split("[sweep]").next().unwrap().replace("300ms", "5ms");
        fs::write(folder.join("own.toml"), own).unwrap();
        crumple_ok(folder, "sweep own.toml --plan plan.toml -o same.csv --restart -q");
        crumple_ok(folder, "sweep merge same.csv -o same.h5 -q");
        for (file, picture) in [("same.csv", "a.svg"), ("same.h5", "b.svg")] {
            crumple_ok(
                folder,
                &format!("plot {file} --over {over} --result peak_force -o {picture}"),
            );
        }
        let [a, b] = ["a.svg", "b.svg"].map(|name| fs::read_to_string(folder.join(name)).unwrap());
        assert!(a == b && a.contains("peak force"));
        let rows = fs::read_to_string(folder.join("same.csv")).unwrap();
        let mut rows = rows.lines().filter(|line| !line.starts_with('#'));
        let name = |column: &str| column.starts_with("peak_force");
        let column = rows.next().unwrap().split(',').position(name).unwrap();
        let forces: BTreeSet<&str> = rows.map(|row| row.split(',').nth(column).unwrap()).collect();
        assert!(forces.len() > samples / 2, "{} different forces", forces.len());
        assert_eq!(a.contains("median") && a.contains("5 to 95 % of the runs"), has_range);
    }
    // What is yes or no is drawn as a share, with its interval.
    let limits =
        "[limits]\nstandard = \"own\"\nedition = \"1\"\nmean_deceleration_g = 12.0\n\n[curves]";
    let own = fs::read_to_string(folder.join("own.toml")).unwrap();
    let judged = own.replace("\"5ms\"", "\"300ms\"").replacen("[curves]", limits, 1);
    fs::write(folder.join("judged.toml"), judged).unwrap();
    let plan = "[sweep]\nsamples = 200\nresults = [\"over_limits\"]\nvary = [ { what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"30km/h\", to = \"40km/h\" }, { what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1, sd = 0.1 } ]\n";
    fs::write(folder.join("plan.toml"), plan).unwrap();
    crumple_ok(folder, "sweep judged.toml --plan plan.toml -o judged.csv -q");
    crumple_ok(folder, "plot judged.csv --result over_limits -o c.svg");
    let picture = fs::read_to_string(folder.join("c.svg")).unwrap();
    says(&picture, "share of runs over a limit");
    says(&picture, "95 % confidence interval");
    assert!(!picture.contains("median"));
    // Over two quantities, runs without a verdict may be either.
    let vary = "{ what = \"speed\", train = \"A\", values = [\"50km/h\", \"75km/h\"] }, { what = \"mass\", vehicle = \"A1\", values = [\"24t\", \"28t\"] }, { what = \"band\", curve = \"nose\", values = [-1, 0, 1] }";
    let plan = format!("[sweep]\nresults = [\"over_limits\"]\nvary = [ {vary} ]\n");
    fs::write(folder.join("plan.toml"), plan).unwrap();
    let mild = fs::read_to_string(folder.join("judged.toml")).unwrap().replace("12.0", "40.0");
    fs::write(folder.join("judged.toml"), mild).unwrap();
    crumple_ok(folder, "sweep judged.toml --plan plan.toml -o judged.csv -q --restart");
    let over = "--over speed_m_per_s[A] --over mass_kg[A1]";
    crumple_ok(folder, &format!("plot judged.csv {over} --result over_limits -o c.svg"));
    let picture = fs::read_to_string(folder.join("c.svg")).unwrap();
    says(&picture, "without a verdict may be either");
    says(&picture, "aria-label=\"0.00 to 0.667\"");
    // A choice of curves varies as well: rows of different curves have no common line, and the plan's names are known.
    let plan = "[sweep]\nvary = [ { what = \"curve\", curve = \"nose\", values = [\"nose\", \"soft\"] }, { what = \"speed\", train = \"A\", values = [\"30km/h\", \"40km/h\"] } ]\nresults = [\"max_deflection\", \"final_speed\"]\n";
    fs::write(folder.join("plan.toml"), plan).unwrap();
    let own = fs::read_to_string(folder.join("own.toml")).unwrap();
    let soft = "[curves]\nsoft = { stages = [ { stroke = \"1m\", from = \"1MN\" } ], unloading = \"80MN/m\" }";
    fs::write(folder.join("own.toml"), own.replacen("[curves]", soft, 1)).unwrap();
    crumple_ok(folder, "sweep own.toml --plan plan.toml -o curves.csv --restart -q");
    crumple_ok(folder, "plot curves.csv --result final_speed -o c.svg");
    crumple_ok(folder, "plot curves.csv -o c.svg");
    let picture = fs::read_to_string(folder.join("c.svg")).unwrap();
    says(&picture, "aria-label=\"Also varied: curve[nose].\"");
    // By its content, whatever its name; an item or a status that is none is found, and so are values without bytes.
    fs::copy(folder.join("same.h5"), folder.join("same.data")).unwrap();
    crumple_ok(folder, "plot same.data --result peak_force -o c.svg");
    says(
        &crumple_fails(folder, 2, "export same.h5 --to csv"),
        "is the result of a sweep and holds no curve",
    );
    let whole = fs::read(folder.join("same.h5")).unwrap();
    let spoil = |from: &[u8], to: &[u8]| {
        let at = whole.windows(from.len()).position(|bytes| bytes == from).unwrap();
        let mut bytes = whole.clone();
        bytes[at..at + to.len()].copy_from_slice(to);
        fs::write(folder.join("bad.h5"), bytes).unwrap();
        crumple_fails(folder, 1, "plot bad.h5 --result peak_force -o c.svg")
    };
    let items = [7u64.to_le_bytes(), 8u64.to_le_bytes(), 9u64.to_le_bytes()].concat();
    says(&spoil(&items, &[0; 8]), "the row of item 7 is missing or damaged");
    let states = [&b"okokok"[..], b"warnedwarned"];
    let state = states.into_iter().find(|of| whole.windows(of.len()).any(|bytes| bytes == *of));
    says(&spoil(state.unwrap(), b"xx"), "is missing or damaged");
    fs::write(folder.join("cut.h5"), &whole[..whole.len() / 2]).unwrap();
    crumple_fails(folder, 1, "plot cut.h5 -o c.svg");
}

#[test]
fn wrong_wishes_are_refused() {
    let folder = demo_folder();
    let folder = folder.path();
    fs::write(folder.join("bad.csv"), "time_s,v_m_per_s[A1]\n0,1\n1,x\n").unwrap();
    fs::write(folder.join("cut.csv"), "# crumple sweep, layout 1\n# written").unwrap();
    fs::write(folder.join("other.csv"), "time_s,b\n0,1\n").unwrap();
    fs::write(folder.join("part.csv"), "time_s,v_m_per_s[A1]\n0,1\n1,2\n").unwrap();
    fs::write(folder.join("forces.csv"), "time_s,force_N[A1|wall]\n0,1\n1,2\n").unwrap();
    fs::write(folder.join("back.csv"), "time_s,v_m_per_s[A1]\n0,1\n1,2\n0.5,3\n").unwrap();
    let before = entries(folder);
    #[rustfmt::skip]
    let cases = [
        (1, "forces.csv --quantity acceleration -o a.svg", "forces has no speeds of bodies: expected columns such as v_m_per_s[A1]"),
        (1, "part.csv --quantity force -o a.svg", "part has no forces of interfaces"),
        (1, "part.csv --quantity crush -o a.svg", "part has no deflections"),
        (1, "back.csv -o a.svg", "line 4, column 1: expected a time after 1 s, found 0.5"),
        (1, "curves.h5 -o a.svg", "has several groups: choose one with --group"),
        (1, "curves.h5 --group nothing -o a.svg", "nothing"),
        (2, "curves.h5 --group lead-car-wall -o a.jpg", "pictures are written as .svg or .png"),
        (1, "curves.h5 --group lead-car-wall --left-out 50km/h -o a.svg", "has no run at 50 km/h: its speeds are 12 km/h"),
        (2, "lead.model -o a.svg", "name the speed of the model's curve with --speed"),
        (2, "lead50.json --speed 50km/h -o a.svg", "--speed is for a model: lead50.json is a predicted curve"),
        (2, "lead.model --speed 50km/h --id 3 -o a.svg", "--id is for a solver file"),
        (1, "bad.csv -o a.svg", "bad.csv: line 3, column 2: expected a number, found \"x\""),
        (2, "two-sets.toml lead.model -o a.svg", "lead.model is a model"),
        (1, "two-sets.toml --body A9 -o a.svg", "there is no body \"A9\": expected one of A1, A2"),
        (2, "two-sets.toml --interface A1|A2 -o a.svg", "this quantity is chosen with --body"),
        (2, "lead.model --speed 50km/h --over speed -o a.svg", "--over is for a sweep"),
        (1, "cut.csv -o a.svg", "cut.csv: expected \"# crumple sweep\" in the first line and a complete header"),
        (1, "other.csv -o a.svg", "expected the columns of crumple simulate -o"),
        (1, "nothing.csv -o a.svg", "nothing.csv"),
        (2, "lead.model --speed 50km/h -o lead.model", "pictures are written"),
        (2, "fe/lead-car-wall/36kmh/nodout --cfc 60 -o a.svg", "--units"),
        (2, "lead50.json -o a.svg --width 10", "expected a number from 80 to 5000"),
        (2, "curves.h5 --group lead-car-wall --quantity energy -o a.svg", "--quantity is for a scenario or result"),
        (2, "train-set.toml --train --body A1 -o a.svg", "--train draws the speeds of all vehicles: remove --quantity, --body"),
        (2, "scenario.toml --cfc 180 -o a.svg", "--cfc is for accelerations: add --quantity acceleration"),
    ];
    for (code, arguments, says) in cases {
        let mut all = vec!["plot"];
        all.extend(arguments.split(' '));
        let error = crumple_fails(folder, code, &all);
        assert!(error.contains(says), "{arguments}:\n{error}");
    }
    assert_eq!(entries(folder), before, "nothing was written");
}

/// Pictures of the repository are those that the program draws today, on this machine as on others.
#[test]
fn committed_pictures_are_drawn_again() {
    let folder = demo_folder();
    for (arguments, file) in [
        ("curves.h5 --group vehicle-pair", "curves.png"),
        ("lead.model --speed 50km/h", "prediction.png"),
    ] {
        let drawn = tempfile::tempdir().unwrap();
        let path = drawn.path().join(file);
        let mut all = vec!["plot"];
        all.extend(arguments.split(' '));
        all.extend(["--scale", "1", "-o", path.to_str().unwrap()]);
        crumple_ok(folder.path(), &all);
        let committed = root().join("docs/pictures").join(file);
        if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
            fs::create_dir_all(committed.parent().unwrap()).unwrap();
            fs::copy(&path, &committed).unwrap();
        }
        assert!(
            same_bytes(&path, &committed),
            "{} differs: write it anew with CRUMPLE_WRITE_DOCS=1 and look at it",
            committed.display()
        );
    }
}

fn same_bytes(a: &Path, b: &Path) -> bool {
    fs::read(a).unwrap() == fs::read(b).unwrap_or_default()
}

/// Curve files of every format that is read are drawn; what is neither is named as both.
#[test]
fn curve_files_are_drawn() {
    let folder = demo_folder();
    let here = folder.path();
    for (to, file, units) in [("lsdyna", "c.k", &["--units", "mm-t-s"][..]), ("csv", "c.csv", &[])]
    {
        let export = ["export", "lead50.json", "--to", to, "-o", file];
        crumple_ok(here, &[&export[..], units].concat());
        crumple_ok(here, &[&["plot", file, "-o", "c.svg"][..], units].concat());
        let picture = std::fs::read_to_string(here.join("c.svg")).unwrap();
        assert!(picture.contains("deflection") && picture.contains("<path"), "{file}");
    }
    std::fs::write(here.join("notes"), "no\nnumbers\n").unwrap();
    let error = crumple_fails(here, 1, "plot notes -o n.svg");
    says(&error, "no solver output is recognised");
    says(&error, "as a curve: notes: the format of this file");
}
