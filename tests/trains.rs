//! Trains as users write them: shipped scenarios, split vehicles, couplers, dampers, forces that
//! may drive an interface, speeds of the interfaces, the comparison with FE's run of a train.

use crate::common::crash::{History, Layout, MM_T_S, Motions, Node};
use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, demo_folder, json as parsed, read_json,
    root, says,
};
use serde_json::{Value, json};

/// Runs a scenario text in a folder of its own.
fn run(text: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    parsed(&crumple_ok(folder.path(), "simulate s.toml --json -q"))
}

fn fails(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    crumple_fails(folder.path(), 1, "simulate s.toml")
}

fn column(run: &Value, name: &str) -> Vec<f64> {
    let values = run[name].as_array().unwrap_or_else(|| panic!("no column {name}"));
    values.iter().map(|v| v.as_f64().unwrap()).collect()
}

const STAGES: &str = "stages = [ { stroke = \"100mm\", from = \"0kN\", to = \"600kN\" }, \
    { stroke = \"300mm\", from = \"1.5MN\" }, { stroke = \"900mm\", from = \"2.2MN\", to = \"3MN\" } ]";

fn scenario(curves: &str, first: &str, rest: &str) -> String {
    format!(
        "[run]\nduration = \"300ms\"\noutput_interval = \"0.75ms\"\n[curves]\n{curves}\n\
         [[train]]\nname = \"A\"\nspeed = \"36km/h\"\n{first}\n{rest}\n[contact]\ncurve = \"nose\"\n"
    )
}

/// Every shipped scenario runs; energy and momentum balance.
#[test]
fn shipped_scenarios_run() {
    let demo = demo_folder();
    let demo = demo.path();
    let mut run = 0;
    for entry in root().join("examples/trains").read_dir().unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let result = parsed(&crumple_ok(demo, &["simulate", &name, "--json", "-q"]));
        let ledger = &result["ledger"];
        assert!(ledger["max_energy_error"].as_f64().unwrap() < 1e-3, "{name}: {ledger}");
        assert!(ledger["max_momentum_error"].as_f64().unwrap() < 1e-10, "{name}: {ledger}");
        if name.starts_with("en15227") {
            let statement = result["summary"]["limits"]["statement"].as_str().unwrap();
            assert!(statement.contains("not evidence of conformity with EN 15227:2020+A1:2024"));
            let over = result["summary"]["limits"]["over"].as_array().unwrap();
            assert!(over.iter().all(|name| name != "O1" && name != "W1"), "{name}: {over:?}");
            let warnings = result["warnings"].to_string();
            assert!(!warnings.contains("beyond the end of its curve's data"), "{name}: {warnings}");
        }
        run += 1;
    }
    assert!(run >= 7, "{run} scenarios");
}

/// Interior interfaces get curves for their own speeds, far below the trains'; all get the
/// trains' speed if that is requested.
#[test]
fn interfaces_have_their_own_speeds() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = std::fs::read_to_string(demo.join("eight-on-eight.toml")).unwrap();
    let speeds = |text: &str| -> Vec<f64> {
        std::fs::write(demo.join("local.toml"), text).unwrap();
        let result = parsed(&crumple_ok(demo, "simulate local.toml --json -q"));
        let interfaces = result["summary"]["interfaces"].as_array().unwrap().clone();
        interfaces.iter().map(|i| i["curve_speed_m_per_s"].as_f64().unwrap()).collect()
    };
    let local = speeds(&text);
    assert_eq!(local.len(), 15);
    assert!((local[7] - 10.0).abs() < 1e-12, "the noses: {local:?}");
    for (k, speed) in local.iter().enumerate().filter(|(k, _)| *k != 7) {
        assert!((1.0..5.0).contains(speed), "interface {k}: {speed}");
        assert!((speed - local[14 - k]).abs() < 0.1, "both trains are alike: {local:?}");
    }
    let train = speeds(&text.replace("\"local\"", "\"train\""));
    assert!(train.iter().all(|v| (v - 10.0).abs() < 1e-12), "{train:?}");
}

/// A crush zone on a very stiff link moves with its body as one vehicle would.
#[test]
fn a_stiff_link_makes_a_split_vehicle_one() {
    let nose = format!("nose = {{ {STAGES}, unloading = \"100MN/m\" }}\n");
    let link = "link = { stages = [ { stroke = \"1m\", from = \"0kN\", to = \"900MN\" } ], law = \"elastic\", tension = \"pull\" }\n\
                pull = { stages = [ { stroke = \"1m\", from = \"0kN\", to = \"900MN\" } ], law = \"elastic\" }";
    let wall = "[wall]";
    let one = run(&scenario(&nose, "vehicles = [ { name = \"A1\", mass = \"24t\" } ]", wall));
    let split = run(&scenario(
        &format!("{nose}{link}"),
        "vehicles = [ { name = \"A1\", mass = \"24t\", front = { mass = \"0.5t\", curve = \"link\" } } ]",
        wall,
    ));
    let (a, b) = (column(&one, "v_m_per_s[A1]"), column(&split, "v_m_per_s[A1]"));
    // The light mass m on its stiff link k swings around the common motion: each step ΔF of the
    // nose, of 0.9 and 0.7 MN, moves the body of mass M by up to 2 ΔF/(M √(k/m)).
    let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let bound = 2.0 * (0.9e6 + 0.7e6) / (24e3 * (900e6_f64 / 0.5e3).sqrt());
    assert!(worst < bound, "{worst} of {bound} m/s");
    assert_eq!(column(&split, "v_m_per_s[A1 front]").len(), a.len());
    assert!(split["force_N[A1|wall]"].is_array() && split["force_N[A1 front|A1]"].is_array());
    assert!(split["ledger"]["max_energy_error"].as_f64().unwrap() < 1e-3);
}

/// Coupled vehicles pull each other back; without a coupling they part.
#[test]
fn couplings_pull() {
    let vehicles = "inner = \"inner\"\nvehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]";
    let nose = format!("nose = {{ {STAGES}, unloading = \"40MN/m\" }}\n");
    let inner = |more: &str| {
        format!(
            "{nose}inner = {{ stages = [ {{ stroke = \"500mm\", from = \"0kN\", to = \"5MN\" }} ], law = \"elastic\"{more} }}\n"
        )
    };
    // They rebound from the wall at first.
    let long = |text: String| run(&text.replace("300ms", "600ms"));
    let free = long(scenario(&inner(""), vehicles, "[wall]"));
    let pull = "pull = { stages = [ { stroke = \"500mm\", from = \"0kN\", to = \"5MN\" } ], law = \"elastic\", gap = \"10mm\" }";
    let coupled =
        long(scenario(&format!("{}{pull}", inner(", tension = \"pull\"")), vehicles, "[wall]"));
    let least = |run: &Value| column(run, "force_N[A1|A2]").into_iter().fold(0.0, f64::min);
    assert_eq!(least(&free), 0.0);
    assert!(least(&coupled) < -1e4, "{}", least(&coupled));
    let pulls = |run: &Value| run["summary"]["sequence"].to_string().contains("\"pull\"");
    let slack = format!("{}{pull}", inner(", tension = \"pull\"")).replace("10mm", "60mm");
    let slack = long(scenario(&slack, vehicles, "[wall]"));
    assert!(pulls(&slack) && !pulls(&free), "{}", slack["summary"]["sequence"]);
    // Also where the slack of 10 mm takes less time than a rattle.
    assert!(pulls(&coupled), "{}", coupled["summary"]["sequence"]);
    // Pulled beyond its data, a coupling leaves no limit known either.
    let short = pull.replace("500mm", "1mm").replace("5MN", "5kN");
    let short = format!(
        "{}{short}\n[limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = 5.0",
        inner(", tension = \"pull\"")
    );
    let limits = &long(scenario(&short, vehicles, "[wall]"))["summary"]["limits"];
    assert_eq!(limits["beyond_data"], json!(["A1|A2"]), "{limits}");
    assert!(!limits["unknown"].as_array().unwrap().is_empty(), "{limits}");
    // The error of a tension curve that ends names that curve, and not the one that it belongs to.
    let short = "pull = { stages = [ { stroke = \"1mm\", from = \"0kN\", to = \"5kN\" } ], law = \"elastic\", gap = \"10mm\", end = \"error\" }";
    let text = scenario(
        &format!("{}{short}", inner(", end = \"hold\", tension = \"pull\"")),
        vehicles,
        "[wall]",
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), text.replace("300ms", "600ms")).unwrap();
    let error = crumple_fails(folder.path(), 1, "simulate s.toml");
    says(
        &error,
        "s, beyond the end of its tension curve's data (0.0010 m): give a longer tension curve (a model: train it with faster runs), or end = \"hold\" in that",
    );
    let marked = error.lines().find(|line| line.contains("tension = \"pull\"")).unwrap();
    let place = marked.find("tension = \"pull\"").unwrap() + "tension = ".len();
    let caret = error.lines().find(|line| line.trim_start_matches(['|', ' ']).starts_with('^'));
    assert_eq!(caret.unwrap().find('^'), Some(place), "{error}");
    let apart = |run: &Value| {
        let last = |name: &str| *column(run, name).last().unwrap();
        last("x_m[A1]") - last("x_m[A2]")
    };
    let (coupled_m, free_m) = (apart(&coupled), apart(&free));
    assert!(coupled_m.abs() < free_m.abs(), "{coupled_m} m coupled, {free_m} m free");
    assert!(coupled["ledger"]["max_energy_error"].as_f64().unwrap() < 1e-3);
}

/// Stages are in series on one stroke, with steps between them.
#[test]
fn stages_are_followed() {
    let text = scenario(
        &format!("nose = {{ {STAGES}, unloading = \"100MN/m\" }}"),
        "vehicles = [ { name = \"A1\", mass = \"24t\" } ]",
        "[wall]",
    );
    let result = run(&text);
    let (d, f) = (column(&result, "deflection_m[A1|wall]"), column(&result, "force_N[A1|wall]"));
    let at = |low: f64, high: f64| {
        let inside = d.iter().zip(&f).take_while(|(d, _)| **d < 0.5);
        inside.filter(|(d, _)| (low..high).contains(*d)).map(|(_, f)| *f).collect::<Vec<_>>()
    };
    assert!(at(0.11, 0.39).iter().all(|f| *f == 1.5e6), "a tube at constant force");
    assert!(at(0.0, 0.099).windows(2).all(|w| w[1] >= w[0]));
    // 1.2 MJ: 0.03 + 0.45 MJ in the first two stages, the rest on 2.2 MN and rising.
    let rest: f64 = 1.2e6 - 0.03e6 - 0.45e6;
    let slope = 0.8e6 / 0.9;
    let expected = 0.4 + ((2.2e6_f64.powi(2) + 2.0 * slope * rest).sqrt() - 2.2e6) / slope;
    let crush = result["summary"]["interfaces"][0]["max_deflection_m"].as_f64().unwrap();
    // The steps take 0.1 mm.
    assert!((crush - expected).abs() < 2e-4, "{crush} for {expected}");
}

/// Head-on: the second train's speed is below 0.
#[test]
fn trains_meet_head_on() {
    let curves = format!("nose = {{ {STAGES}, unloading = \"100MN/m\" }}");
    let vehicles = |name: &str| format!("vehicles = [ {{ name = \"{name}\", mass = \"24t\" }} ]");
    let second =
        |speed: &str| format!("[[train]]\nname = \"B\"\nspeed = \"{speed}\"\n{}", vehicles("B1"));
    let head_on = run(&scenario(&curves, &vehicles("A1"), &second("-36km/h")));
    assert!(column(&head_on, "v_m_per_s[B1]")[0] == -10.0);
    let sum: f64 = ["A1", "B1"]
        .iter()
        .map(|n| column(&head_on, &format!("v_m_per_s[{n}]")).last().unwrap().to_owned())
        .sum();
    assert!(sum.abs() < 1e-9, "equal trains keep no momentum: {sum}");
}

/// Braking takes energy and momentum, and the ledger says so.
#[test]
fn resistance_is_in_the_ledger() {
    let text = scenario(
        &format!("nose = {{ {STAGES}, unloading = \"100MN/m\" }}"),
        "resistance = { braking = 0.15, constant_m_per_s2 = 0.01 }\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]",
        "[wall]",
    );
    let result = run(&text);
    assert!(result["ledger"]["resisted_J"].as_f64().unwrap() > 1e3);
    assert!(result["ledger"]["max_energy_error"].as_f64().unwrap() < 1e-3);
    assert!(result["ledger"]["max_momentum_error"].as_f64().unwrap() < 1e-10);
    let fourth = text.replace("[curves]", "method = \"fourth_order\"\n[curves]");
    let error = fails(&fourth);
    assert!(error.contains("resistance") && error.contains("method = \"verlet\""), "{error}");
}

/// What the curve's kind may not drive is refused, and the reason says what to do.
#[test]
fn the_force_must_suit_the_vehicles() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = |vehicle: &str| {
        format!(
            "[run]\nduration = \"100ms\"\n[curves]\nnose = {{ model = \"lead.model\", force = \"body\" }}\n\
             link = {{ {STAGES}, unloading = \"100MN/m\" }}\n[[train]]\nname = \"A\"\nspeed = \"50km/h\"\n\
             vehicles = [ {vehicle} ]\n[wall]\n[contact]\ncurve = \"nose\"\n"
        )
    };
    let split = "{ name = \"A1\", mass = \"24t\", front = { mass = \"2t\", curve = \"link\" } }";
    std::fs::write(demo.join("force.toml"), text(split)).unwrap();
    let error = crumple_fails(demo, 1, "simulate force.toml");
    says(&error, "curve \"nose\": interface A1|wall has a vehicle with a crush zone");
    let free = text(split).replace(", force = \"body\"", "");
    std::fs::write(demo.join("force.toml"), &free).unwrap();
    let result = parsed(&crumple_ok(demo, "simulate force.toml --json -q"));
    let force = |r: &Value, k: usize| r["summary"]["interfaces"][k]["curve_force"].clone();
    assert_eq!(force(&result, 1), "contact", "the split vehicle takes the contact force");
    let one = free.replace(", front = { mass = \"2t\", curve = \"link\" }", "");
    std::fs::write(demo.join("force.toml"), one).unwrap();
    let result = parsed(&crumple_ok(demo, "simulate force.toml --json -q"));
    assert_eq!(force(&result, 0), "body", "one mass takes the body force");
}

#[test]
fn wrong_trains_are_explained() {
    let nose = format!("nose = {{ {STAGES}, unloading = \"100MN/m\" }}");
    let one = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]";
    let t = |curves: &str, first: &str, expected: &str| {
        let error = fails(&scenario(curves, first, "[wall]"));
        assert!(error.contains("s.toml") && error.contains(expected), "{error}");
    };
    let no_unloading = nose.replace(", unloading = \"100MN/m\"", "");
    t(&no_unloading, one, "it has stages, which do not say how they unload");
    let flat = nose.replace("stroke = \"300mm\"", "stroke = \"0.1mm\"");
    t(&flat, one, "stage 2 has a stroke of 0.1 mm: expected more than 0.2 mm");
    let tension = nose.replace("unloading", "tension = \"pull\", unloading");
    t(&tension, one, "its tension curve \"pull\" is not in [curves]");
    let damper =
        nose.replace("unloading", "damping = { coefficient_N_s_per_m = [-1.0] }, unloading");
    t(&damper, one, "coefficients of 0 or more");
    let all = "vehicles = [ { name = \"A1\", mass = \"2t\", front = { mass = \"2t\", curve = \"nose\" } } ]";
    t(&nose, all, "nothing is left for the body");
    let behind = "vehicles = [ { name = \"A1\", mass = \"2t\", behind = \"nose\" } ]";
    t(&nose, behind, "there is nothing behind the last vehicle \"A1\"");
    let both = nose.replace("unloading", "file = \"a.csv\", unloading");
    t(&both, one, "needs exactly one of model, file, database and stages");
    let limits =
        format!("{nose}\n[limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = -1.0");
    t(&limits, one, "mean_deceleration_g = -1: expected more than 0");
    let limits = limits.replace("= -1.0", "= 5.0\ntrains = [\"Z\"]");
    t(&limits, one, "[limits] trains: there is no train \"Z\": the scenario has A");
    let none = limits.replace("[\"Z\"]", "[]");
    t(&none, one, "[limits] trains is empty");
    let gap = nose.replace("unloading", "gap = \"1mm\", unloading");
    let zone = "vehicles = [ { name = \"A1\", mass = \"9t\", front = { mass = \"2t\", curve = \"nose\" } } ]";
    t(&gap, zone, "front of vehicle \"A1\" is joined to the body without one");
    let second = "[[train]]\nname = \"A\"\nspeed = \"0m/s\"\nvehicles = [ { name = \"B1\", mass = \"9t\" } ]";
    says(&fails(&scenario(&nose, one, second)), "two trains are named \"A\"");
}

/// Velocities of every vehicle against FE's run of the train, by every method.
#[test]
fn the_train_set_is_compared_with_fe() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = crumple_ok(demo, "compare --train train-set.toml --nsdm-seeds 1 --json -q");
    let result = parsed(&text);
    assert!((result["until_s"].as_f64().unwrap() - 0.135).abs() < 1e-3);
    let rows = result["rows"].as_array().unwrap();
    let methods: Vec<&str> = rows.iter().map(|r| r["method"].as_str().unwrap()).collect();
    let of_curves = ["fe_body", "fdrm", "nsdm", "ddtcm", "best_train", "best_local"];
    let of_crush_laws = ["rate_only", "rate_live", "split_ends"];
    assert_eq!(methods, [&of_curves[..], &of_crush_laws].concat());
    for row in rows {
        let vehicles = row["vehicles"].as_array().unwrap();
        assert_eq!(vehicles.len(), 3);
        assert!(vehicles.iter().all(|v| v["velocity_l1"].as_f64().unwrap().is_finite()));
    }
    let speed = |row: &Value, name: &str| row["interface_speeds_m_per_s"][name].as_f64().unwrap();
    assert!((speed(&rows[4], "A2|A3") - 5.0).abs() < 1e-9);
    // The closing speeds that the interfaces have reached, in km/h, against those with states of 0.05 ms that were iterated
    // until none changed by 1 mm/s: 7.78 and 9.89.
    assert!((speed(&rows[5], "A2|A3") * 3.6 - 7.78).abs() < 0.08);
    assert!((speed(&rows[5], "A1|A2") * 3.6 - 9.89).abs() < 0.08);
    // FE's first vehicle is at 5 m/s forwards, whichever way it went in the solver.
    assert!((result["fe"]["A1"][0].as_f64().unwrap() - 5.0).abs() < 1e-9);
    let error = crumple_fails(demo, 1, "compare --train scenario.toml");
    says(&error, "the scenario has no [reference]");
}

/// Two faster trains in FE, to which nothing was tuned, by the ends of the vehicles, which a train has if its models know them.
#[test]
fn faster_trains_follow_fe() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = std::fs::read_to_string(demo.join("train-set.toml")).unwrap();
    for (v, speed, least) in [(48, "24km/h", 0.010), (60, "30km/h", 0.0045)] {
        let text = text.replace("18km/h\"   #", &format!("{speed}\"   #"));
        let text = text.replace("36kmh/nodout", &format!("{v}kmh/crashT01"));
        std::fs::write(demo.join("fast.toml"), text).unwrap();
        let result =
            parsed(&crumple_ok(demo, "compare --train fast.toml --nsdm-seeds 0 --json -q"));
        let row = result["rows"].as_array().unwrap().iter().find(|r| r["method"] == "split_ends");
        let error = row.unwrap()["mean_velocity_l1"].as_f64().unwrap();
        assert!(error <= least, "{v} km/h: {error}");
        assert!(!result["warnings"].to_string().contains("FE's record ends"), "{result}");
    }
}

/// FE's trains may go either way, reach the contact between two states, and have a gap before it or crush zones of their own: what is
/// written of a run of crumple is that run.
#[test]
fn a_run_is_its_own_reference() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = |contact: &str, front: &str, reference: &str| {
        format!(
            "[run]\nduration = \"200ms\"\noutput_interval = \"0.75ms\"\n[curves]\n\
             nose = {{ database = \"curves.h5\", case = \"lead-car-pair/36kmh\" }}\n\
             inner = {{ database = \"curves.h5\", case = \"vehicle-pair/25kmh\", gap = \"32mm\" }}\n\
             [[train]]\nname = \"A\"\nspeed = \"5m/s\"\ninner = \"inner\"\n\
             vehicles = [ {{ name = \"A1\", mass = \"24t\"{front} }}, {{ name = \"A2\", mass = \"40t\" }} ]\n\
             [[train]]\nname = \"B\"\nspeed = \"-10m/s\"\ninner = \"inner\"\n\
             vehicles = [ {{ name = \"B1\", mass = \"24t\" }}, {{ name = \"B2\", mass = \"33t\" }} ]\n\
             [contact]\ncurve = \"nose\"\n{contact}\n\
             [reference]\nfile = \"fe/nodout\"\nunits = \"mm-t-s\"\n{reference}\n"
        )
    };
    const NODES: &str = "nodes = { A1 = 1, A2 = 2, B1 = 3, B2 = 4 }";
    std::fs::write(demo.join("own.toml"), text("", "", NODES)).unwrap();
    let own = parsed(&crumple_ok(demo, "simulate own.toml --json -q"));
    let interfaces = own["summary"]["interfaces"].as_array().unwrap();
    let nose = interfaces.iter().find(|of| of["name"] == "A1|B1").unwrap();
    let crush_m = nose["max_deflection_m"].as_f64().unwrap();
    let vehicles = ["A1", "A2", "B1", "B2"];
    // Every state, or every fourth one, the first of them 1.5 ms before the contact and the next 1.5 ms after it.
    let write = |sign: f64, coarse: bool| {
        let mut history = History::default();
        let of = |name: &str, before: fn(&[f64]) -> f64| -> Vec<f64> {
            let all = column(&own, name);
            match coarse {
                true => std::iter::once(before(&all))
                    .chain(all.into_iter().skip(2).step_by(4))
                    .collect(),
                false => all,
            }
        };
        history.time_s = of("time_s", |_| -1.5e-3);
        let first_s = history.time_s[0];
        history.time_s.iter_mut().for_each(|t| *t -= first_s);
        for name in vehicles {
            let mut body = Motions::default();
            body.velocity_m_per_s[4] = of(&format!("v_m_per_s[{name}]"), |v| v[0]);
            body.displacement_m[4] = vec![0.0; history.time_s.len()];
            history.bodies.push(body);
        }
        let nodes: Vec<Node> = (0..4)
            .map(|k| Node { id: k as i64 + 1, title: "", on: Some((k, 4)), shakes: 0.0 })
            .collect();
        Layout { units: MM_T_S, axis: 0, sign }.nodout(&demo.join("fe"), &history, &nodes);
    };
    let compared = |text: &str| {
        std::fs::write(demo.join("own.toml"), text).unwrap();
        parsed(&crumple_ok(demo, "compare --train own.toml --nsdm-seeds 0 --json -q"))
    };
    let check = |result: &Value, most: f64| {
        let row = &result["rows"][0];
        let error = row["mean_velocity_l1"].as_f64().unwrap();
        assert!(error < most, "{error}");
        let all = row["interfaces"].as_array().unwrap();
        let of = all.iter().find(|of| of["interface"] == "A1|B1").unwrap();
        let fe_m = of["fe_crush_m"].as_f64().unwrap();
        assert!((fe_m / crush_m - 1.0).abs() < 2e-3, "{fe_m} for {crush_m}");
    };
    // The gap before the first contact is closed where the comparison begins.
    for (sign, gap) in [(1.0, "gap = \"50mm\""), (-1.0, "")] {
        write(sign, false);
        check(&compared(&text(gap, "", NODES)), 1e-3);
    }
    let late = compared(&text("", "", &format!("{NODES}\nuntil = \"900ms\"")));
    says(&late["warnings"].to_string(), "FE's record ends at 199.5 ms, before until");
    // Work does not depend on the scenario's outputs.
    let work = |result: &Value| result["rows"][0]["interfaces"][0]["work_J"].as_f64().unwrap();
    let coarse = compared(&text("", "", NODES).replace("0.75ms", "6ms"));
    check(&coarse, 1e-3);
    assert!((work(&coarse) / work(&late) - 1.0).abs() < 1e-3);
    // A crush zone of the scenario's own is kept, and takes the place of an end.
    let front = ", front = { mass = \"0.8t\", curve = \"nose\" }";
    std::fs::write(demo.join("own.toml"), text("", front, NODES)).unwrap();
    let printed = crumple_ok(demo, "compare --train own.toml --nsdm-seeds 0");
    assert!(printed.contains("A1 front|A1") && !printed.contains("split_ends"), "{printed}");
    write(1.0, true);
    let result = compared(&text("", "", &format!("{NODES}\ncontact = \"1.5ms\"")));
    check(&result, 2e-3);
    says(&result["warnings"].to_string(), "too coarse for CFC 60");
    // A file that is cut says so here, too.
    let file = demo.join("fe/nodout");
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() - 100]).unwrap();
    let result = compared(&text("", "", &format!("{NODES}\ncontact = \"1.5ms\"")));
    says(&result["warnings"].to_string(), "the file ends within this line");
    std::fs::write(demo.join("own.toml"), text("", "", &NODES.replace("A2 = 2", "A2 = 1")))
        .unwrap();
    let error = crumple_fails(demo, 1, "compare --train own.toml");
    says(&error, "own.toml:23:24");
    says(&error, "node 1 is named for A1 already");
}

/// A gap in another unit, a coupler that leaves the crush out, a contact that repeats, and a reference
/// whose nodes or times are others.
#[test]
fn what_does_not_fit_in_a_train_is_said() {
    let said = |run: &Value| run["warnings"].to_string();
    let vehicles = "inner = \"inner\"\nvehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]";
    let curves = |inner: &str| {
        format!(
            "nose = {{ {STAGES}, unloading = \"40MN/m\" }}\ninner = {{ {STAGES}, unloading = \"40MN/m\", {inner} }}\n\
             pull = {{ stages = [ {{ stroke = \"500mm\", from = \"0kN\", to = \"5MN\" }} ], law = \"elastic\", gap = \"10mm\" }}"
        )
    };
    let of =
        |inner: &str| run(&scenario(&curves(inner), vehicles, "[wall]").replace("300ms", "900ms"));
    says(&said(&of("gap = \"32m\"")), "interface A1|A2 never touches: its gap of 32 m stays open");
    let near = of("gap = \"32mm\"");
    assert!(!said(&near).contains("never touches"), "{}", said(&near));
    let coupled = of("gap = \"1mm\", tension = \"pull\"");
    let travel = said(&coupled);
    says(&travel, "interface A1|A2: after a crush of 0.");
    says(&travel, "of free travel");
    for run in [&near, &coupled] {
        for interface in run["summary"]["interfaces"].as_array().unwrap() {
            assert!(interface["restitution"].as_f64().is_none_or(|e| e <= 1.0), "{interface}");
        }
    }
    let demo = demo_folder();
    let demo = demo.path();
    let text = std::fs::read_to_string(demo.join("train-set.toml")).unwrap();
    let compared = |text: &str| {
        std::fs::write(demo.join("changed.toml"), text).unwrap();
        let arguments = ["compare", "--train", "changed.toml", "--nsdm-seeds", "0", "--json", "-q"];
        parsed(&crumple_ok(demo, &arguments))["warnings"].to_string()
    };
    assert_eq!(compared(&text), "null");
    let swapped = text.replace("A2 = 900002, A3 = 900003", "A2 = 900003, A3 = 900002");
    says(&compared(&swapped), "FE's record of A2 matches A3 in the run");
    let late = compared(&text.replace("until =", "contact = \"8ms\"\nuntil ="));
    assert!(late.contains("fits better by") && late.contains("when it is shifted by +"), "{late}");
}

/// The mean deceleration of the summary is that of the histories: from the contact to where the
/// contact force has ended or changed its sign.
#[test]
fn mean_decelerations_are_those_of_the_histories() {
    let demo = demo_folder();
    let demo = demo.path();
    for name in ["scenario.toml", "two-sets.toml", "en15227-wagon.toml"] {
        let result = parsed(&crumple_ok(demo, &["simulate", name, "--json", "-q"]));
        let times = column(&result, "time_s");
        for body in result["summary"]["bodies"].as_array().unwrap() {
            let vehicle = body["name"].as_str().unwrap();
            let v = column(&result, &format!("v_m_per_s[{vehicle}]"));
            let a = column(&result, &format!("a_m_per_s2[{vehicle}]"));
            let most = a.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
            let first = a.iter().position(|a| a.abs() > 0.001 * most).unwrap();
            let end = (first..a.len() - 1).find(|&i| a[i] * a[first] < 0.0).unwrap_or(a.len() - 1);
            // Where it opens for good before that, the rest has no force.
            let end = (first..=end).rev().find(|&i| a[i] * a[first] > 0.0).unwrap() + 1;
            let end = end.min(a.len() - 1);
            let begin = first.saturating_sub(1);
            let mean = (v[begin] - v[end]) / (times[end] - times[begin]);
            let summary = body["mean_deceleration_m_per_s2"].as_f64().unwrap();
            let ratio = summary / mean;
            // Begin and end fall between two outputs, so the histories' time is longer by up to two, and by a
            // step, since the run's own begin and end are those of steps.
            let (lasts_s, output_s) = (times[end] - times[begin], times[1] - times[0]);
            let step_s = result["summary"]["step_s"].as_f64().unwrap();
            let longer = lasts_s / (lasts_s - 2.0 * output_s - step_s);
            if ["A4", "B4", "W1"].contains(&vehicle) {
                // The contact ends and begins again, which makes the mean of the histories longer.
                let held = longer < ratio && summary < most;
                assert!(held, "{name} {vehicle}: {summary} for {mean}, {most} at most");
            } else {
                let held = 0.999 < ratio && ratio < longer;
                assert!(held, "{name} {vehicle}: {summary} for {mean}, {lasts_s} s");
            }
        }
    }
    let wall = parsed(&crumple_ok(demo, "simulate scenario.toml --json -q"));
    let g = wall["summary"]["bodies"][0]["mean_deceleration_g"].as_f64().unwrap();
    assert!((g - 10.67).abs() < 0.01, "{g} g from 50 km/h");
}

/// What interfaces have taken is all that the ledger has besides motion and resistance; and what occupants meet, found
/// again step by step from the histories.
#[test]
fn energies_of_interfaces_and_loads_of_occupants() {
    let demo = demo_folder();
    let demo = demo.path();
    let mut met = 0;
    for name in ["scenario.toml", "train-set.toml", "split-ends.toml", "en15227-wagon.toml"] {
        let result = parsed(&crumple_ok(demo, &["simulate", name, "--json", "-q"]));
        let ledger = |key: &str| result["ledger"][key].as_f64().unwrap();
        let sum = |key: &str| -> f64 {
            let of = result["summary"]["interfaces"].as_array().unwrap().iter();
            of.map(|interface| interface[key].as_f64().unwrap()).sum()
        };
        let all = ledger("initial_kinetic_J");
        for (part, whole) in [
            ("stored_at_end_J", ledger("stored_J")),
            ("dissipated_at_end_J", ledger("dissipated_J")),
            ("damped_J", ledger("damped_J")),
            ("energy_J", all - ledger("kinetic_J") - ledger("resisted_J")),
        ] {
            assert!((sum(part) - whole).abs() < 1e-5 * all, "{name} {part}: {} {whole}", sum(part));
        }
        assert!((sum("energy_share") - 1.0).abs() < 1e-9, "{name}");
        let dt = column(&result, "time_s")[1];
        for body in result["summary"]["bodies"].as_array().unwrap() {
            let vehicle = body["name"].as_str().unwrap();
            if body["is_crush_zone"] == true {
                assert!(body["secondary_impact_m_per_s"].is_null(), "{name} {vehicle}");
                continue;
            }
            // An occupant in small steps, in free flight for 65 mm and then braked by what stops it within 235 mm.
            let v = column(&result, &format!("v_m_per_s[{vehicle}]"));
            const PARTS: usize = 200;
            let speeds: Vec<f64> = (0..(v.len() - 1) * PARTS)
                .map(|k| {
                    let (k, share) = (k / PARTS, (k % PARTS) as f64 / PARTS as f64);
                    v[0] - v[k] - share * (v[k + 1] - v[k])
                })
                .collect();
            let step = dt / PARTS as f64;
            let path = |speeds: &[f64]| {
                let mut path = 0.0;
                speeds.iter().map(|v| (path += v * step, path).1).collect::<Vec<f64>>()
            };
            let free = path(&speeds);
            let impact = free.iter().position(|d| d.abs() >= 0.6).map(|k| speeds[k]);
            let found = body["secondary_impact_m_per_s"].as_f64();
            assert_eq!(found.is_some(), impact.is_some(), "{name} {vehicle}");
            for (found, impact) in found.into_iter().zip(impact) {
                assert!((found - impact).abs() < 0.01, "{name} {vehicle}: {found} for {impact}");
            }
            let Some(load) = body["occupant_load_g"].as_f64().map(|g| g * 9.80665) else {
                continue;
            };
            met += 1;
            let begin = free.iter().position(|d| d.abs() >= 0.065).unwrap();
            let restrained: Vec<f64> = speeds[begin..]
                .iter()
                .enumerate()
                .map(|(k, v)| v - load * k as f64 * step)
                .collect();
            let end = restrained.iter().position(|v| v * load <= 0.0).unwrap();
            let stopped = path(&restrained[..end]).last().unwrap().abs();
            assert!(
                (stopped - 0.235).abs() < 0.003,
                "{name} {vehicle}: stopped within {stopped} m"
            );
        }
    }
    assert!(met > 5, "{met} occupants were restrained");
}

/// The speed of separation is that at the release, not that at the end of a step: long steps give the same.
#[test]
fn restitution_does_not_depend_on_the_step() {
    let demo = demo_folder();
    let demo = demo.path();
    let text = std::fs::read_to_string(demo.join("eight-on-eight.toml")).unwrap();
    let text: String =
        text.lines().filter(|l| !l.starts_with("method")).map(|l| l.to_string() + "\n").collect();
    let of = |method: &str| {
        let text = text.replacen("[run]", &format!("[run]\nmethod = \"{method}\""), 1);
        std::fs::write(demo.join("own.toml"), text).unwrap();
        let result = parsed(&crumple_ok(demo, "simulate own.toml --json -q"));
        result["summary"]["interfaces"].as_array().unwrap().clone()
    };
    let mut compared = 0;
    for (a, b) in of("verlet").iter().zip(of("fourth_order")) {
        if let (Some(a), Some(b)) = (a["restitution"].as_f64(), b["restitution"].as_f64()) {
            assert!((a / b - 1.0).abs() < 0.01, "{a} and {b}");
            compared += 1;
        }
    }
    assert!(compared > 4, "{compared}");
}

/// What happens when: contacts, stages, largest crush, mean decelerations and their spans, peaks by CFC 60 and the common
/// speed, all by a second route from the histories.
#[test]
fn the_sequence_of_a_run() {
    let demo = demo_folder();
    let demo = demo.path();
    let result = parsed(&crumple_ok(demo, &["simulate", "en15227-wagon.toml", "--json", "-q"]));
    let times = column(&result, "time_s");
    let dt = times[1];
    let summary = &result["summary"];
    let events: Vec<(f64, String)> = summary["sequence"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| {
            let name = e["name"].as_str().map_or(String::new(), |name| format!(" {name}"));
            let of = |key: &str| e[key].as_str().unwrap().to_string();
            (e["time_s"].as_f64().unwrap(), format!("{} {}{name}", of("interface"), of("event")))
        })
        .collect();
    assert!(events.is_sorted_by(|a, b| a.0 <= b.0));
    let at = |what: &str| {
        events
            .iter()
            .find(|(_, event)| event == what)
            .unwrap_or_else(|| panic!("{what}: {events:?}"))
            .0
    };
    // Stages begin where those before them end: 105, 405 and 455 mm.
    let nose = column(&result, "deflection_m[A1|W1]");
    for (what, begin_m) in
        [("deformation tube", 0.105), ("shear-off", 0.405), ("anti-climber and absorber", 0.455)]
    {
        let k = nose.iter().position(|d| *d > begin_m).unwrap();
        let found = at(&format!("A1|W1 stage {what}"));
        assert!(times[k - 1] <= found && found <= times[k], "{what}: {found}");
    }
    assert!(!events.iter().any(|(_, event)| event.contains("car body")), "it is not reached");
    for interface in summary["interfaces"].as_array().unwrap() {
        let name = interface["name"].as_str().unwrap();
        assert_eq!(
            at(&format!("{name} largest_crush")),
            interface["max_deflection_time_s"].as_f64().unwrap()
        );
        let d = column(&result, &format!("deflection_m[{name}]"));
        let first = d.iter().position(|d| *d > 1e-6).unwrap();
        let contact = at(&format!("{name} contact"));
        assert!(times[first.saturating_sub(1)] <= contact && contact <= times[first], "{name}");
        // It opens where the force ends for long, and not while it acts.
        let force = column(&result, &format!("force_N[{name}]"));
        let opened = (at(&format!("{name} opened")) / dt - 1e-9).ceil() as usize;
        assert!(force[opened] == 0.0 && force[opened - 1] != 0.0, "{name} opens at {opened}");
    }
    for body in summary["bodies"].as_array().unwrap() {
        let name = body["name"].as_str().unwrap();
        let v = column(&result, &format!("v_m_per_s[{name}]"));
        let span = body["mean_deceleration_span_s"].as_array().unwrap();
        let [from, to] = [0, 1].map(|k| span[k].as_f64().unwrap());
        let speed = |t: f64| {
            let k = ((t / dt) as usize).min(v.len() - 2);
            v[k] + (t / dt - k as f64) * (v[k + 1] - v[k])
        };
        let mean = (speed(from) - speed(to)) / (to - from) / 9.80665;
        let found = body["mean_deceleration_g"].as_f64().unwrap();
        assert!(
            (mean / found - 1.0).abs() < 0.01,
            "{name}: {found} and {mean} from {from} to {to}"
        );
        // The filter takes nothing from a pulse of 40 ms; the raw peak bounds it within its overshoot.
        let a = column(&result, &format!("a_m_per_s2[{name}]"));
        let raw = a.iter().fold(0.0_f64, |most, a| most.max(a.abs())) / 9.80665;
        let peak = body["peak_deceleration_g"].as_f64().unwrap().abs();
        assert!(peak <= 1.05 * raw && peak >= 0.6 * raw, "{name}: {peak} of {raw}");
    }
    let masses = [24.0, 20.24, 20.24, 20.24];
    let speeds: Vec<Vec<f64>> = ["A1", "A2", "A3", "A4", "W1"]
        .iter()
        .map(|n| column(&result, &format!("v_m_per_s[{n}]")))
        .collect();
    let closing = |k: usize| {
        let sum: f64 = masses.iter().zip(&speeds).map(|(m, v)| m * v[k]).sum();
        sum / masses.iter().sum::<f64>() - speeds[4][k]
    };
    let k = (0..times.len()).find(|k| closing(*k) < 0.0).unwrap();
    let common = summary["common_speed_time_s"].as_f64().unwrap();
    assert!(times[k - 1] <= common && common <= times[k], "{common}");
    // Against a wall: when the train as a whole stands.
    let result = parsed(&crumple_ok(demo, &["simulate", "scenario.toml", "--json", "-q"]));
    let v = column(&result, "v_m_per_s[A1]");
    let k = v.iter().position(|v| *v < 0.0).unwrap();
    let stands = result["summary"]["common_speed_time_s"].as_f64().unwrap();
    let times = column(&result, "time_s");
    assert!(times[k - 1] <= stands && stands <= times[k], "{stands}");
}

/// Limits on what occupants meet name the vehicles that are over them, and those that are not known.
#[test]
fn limits_on_occupants_are_judged() {
    let folder = demo_folder();
    let here = folder.path();
    let judged = |limits: &str, duration: &str| {
        let text = std::fs::read_to_string(here.join("train-set.toml")).unwrap();
        let head = "\n[limits]\nstandard = \"own\"\nedition = \"1\"\nmean_deceleration_g = 50.0\n";
        let text = text
            .replace("\"150ms\"", &format!("\"{duration}\""))
            // Those of slow runs end before the crush does.
            .replace(
                "database = \"curves.h5\", case = \"lead-car-wall/18kmh\"",
                "model = \"lead.model\"",
            )
            .replace(
                "database = \"curves.h5\", case = \"vehicle-pair/25kmh\"",
                "model = \"vehicle.model\"",
            );
        std::fs::write(here.join("limits.toml"), format!("{text}{head}{limits}\n")).unwrap();
        let result = parsed(&crumple_ok(here, "simulate limits.toml --json -q"));
        (crumple_ok(here, "simulate limits.toml"), result["summary"].clone())
    };
    let (_, summary) = judged("", "450ms");
    assert_eq!(summary["limits"]["occupants"], serde_json::json!([]));
    let met: Vec<f64> = (0..3)
        .map(|k| summary["bodies"][k]["occupant_load_g"].as_f64().unwrap_or(f64::NAN).abs())
        .collect();
    let most = met.iter().copied().fold(0.0, f64::max);
    let limit = 0.99 * most;
    let limits = format!("occupant_load_g = {limit}\nsecondary_impact = \"0.1m/s\"");
    let (text, summary) = judged(&limits, "450ms");
    let of = &summary["limits"]["occupants"];
    assert_eq!(
        (&of[0]["what"], &of[1]["what"]),
        (&"secondary_impact_m_per_s".into(), &"occupant_load_g".into())
    );
    let over: Vec<&str> =
        (0..3).filter(|&k| met[k] > limit).map(|k| ["A1", "A2", "A3"][k]).collect();
    assert_eq!(of[1]["over"], serde_json::json!(over));
    says(&text, &format!("occupant load above {limit} g: {}", over.join(", ")));
    let (text, _) = judged(&limits, "15ms");
    says(
        &text,
        "secondary impact above 0.1 m/s: no vehicle for which it is known; the run ended before it was known for A1, A2, A3",
    );
    let text = std::fs::read_to_string(here.join("limits.toml")).unwrap();
    let coarse = text.replace("output_interval = \"0.75ms\"", "output_interval = \"7.5ms\"");
    assert_ne!(coarse, text);
    std::fs::write(here.join("coarse.toml"), coarse).unwrap();
    let said = crumple_fails(here, 1, "simulate coarse.toml");
    says(&said, "[limits] on occupants need outputs at most 5 ms apart: shorten output_interval");
    for (limits, expected) in [
        ("occupant_load_g = 0.0", "[limits] occupant_load_g = 0: expected more than 0"),
        ("secondary_impact = \"8\"", "secondary_impact"),
    ] {
        let text = std::fs::read_to_string(here.join("limits.toml")).unwrap();
        let text = text.split("occupant_load_g").next().unwrap().to_string() + limits + "\n";
        std::fs::write(here.join("wrong.toml"), text).unwrap();
        says(&crumple_fails(here, 1, "simulate wrong.toml"), expected);
    }
}

/// What no contact has reached by the end of a run is not within a limit: a contact may come yet.
#[test]
fn a_vehicle_that_is_still_to_be_hit_is_not_judged() {
    let laws = ["nose", "hard"].map(|name| {
        let from = if name == "nose" { "6MN" } else { "8MN" };
        format!("{name} = {{ stages = [ {{ stroke = \"1m\", from = \"{from}\" }} ], unloading = \"80MN/m\" }}\n")
    });
    let train = "inner = \"hard\"\ngap = \"3m\"\nvehicles = [ { name = \"A1\", mass = \"50t\" }, { name = \"A2\", mass = \"10t\" } ]\n[wall]";
    let limits = "[limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = 13.0\n";
    let text = scenario(&laws.concat(), train, limits);
    // It runs on at 10 m/s towards A1, which comes back at 1.1 m/s after 91 ms: 3 m are closed after 284 ms.
    for (duration, over, unknown) in
        [("250ms", "", "A1,A2"), ("284ms", "", "A1,A2"), ("400ms", "A2", "")]
    {
        let result = run(&text.replace("300ms", duration));
        let of = |what: &str| -> String {
            let names = result["summary"]["limits"][what].as_array().unwrap().iter();
            names.map(|name| name.as_str().unwrap()).collect::<Vec<_>>().join(",")
        };
        assert_eq!((&*of("over"), &*of("unknown")), (over, unknown), "{duration}");
    }
}

/// A second contact that may become the larger one leaves the verdict open, before and while it acts.
#[test]
fn a_vehicle_that_is_being_hit_again_is_not_judged() {
    let laws = "nose = { stages = [ { stroke = \"3m\", from = \"0N\", to = \"15MN\" } ], law = \"elastic\" }\n\
        in = { stages = [ { stroke = \"2m\", from = \"0N\", to = \"200MN\" } ], law = \"elastic\", gap = \"1500mm\" }\n";
    let text = |duration: &str| {
        format!(
            "[run]\nduration = \"{duration}\"\n[curves]\n{laws}\
             [[train]]\nname = \"A\"\nspeed = \"3m/s\"\nvehicles = [ {{ name = \"A1\", mass = \"24t\" }} ]\n\
             [[train]]\nname = \"B\"\nspeed = \"-5m/s\"\ninner = \"in\"\n\
             vehicles = [ {{ name = \"B1\", mass = \"12t\" }}, {{ name = \"B2\", mass = \"900t\" }} ]\n\
             [contact]\ncurve = \"nose\"\n\
             [limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = 5.5\ntrains = [ \"A\" ]\n"
        )
    };
    // Contacts of A1 from 0 to 126 ms, 4.3 g, and from 279 to 404 ms, 7.1 g.
    for (duration, over, unknown) in [
        ("260ms", json!([]), json!(["A1"])),
        ("300ms", json!([]), json!(["A1"])),
        ("340ms", json!([]), json!(["A1"])),
        ("400ms", json!([]), json!(["A1"])),
        ("450ms", json!(["A1"]), json!([])),
        ("900ms", json!(["A1"]), json!([])),
    ] {
        let limits = &run(&text(duration))["summary"]["limits"];
        assert_eq!((&limits["over"], &limits["unknown"]), (&over, &unknown), "{duration}");
    }
}

/// A structure is fully crushed at 1.5 times the largest crush of its runs, however much energy the curve was asked for.
#[test]
fn a_heavy_vehicle_bottoms_where_a_light_one_does() {
    let folder = demo_folder();
    let here = folder.path();
    let crush_m = 1.5 * 1.62632;
    for (mass, speed) in [("60t", "72km/h"), ("24t", "110km/h")] {
        let text = format!(
            "[run]\nduration = \"600ms\"\n[curves]\nnose = {{ model = \"lead.model\" }}\n\
             [[train]]\nname = \"A\"\nspeed = \"{speed}\"\nvehicles = [ {{ name = \"A1\", mass = \"{mass}\" }} ]\n\
             [wall]\n[contact]\ncurve = \"nose\"\n"
        );
        std::fs::write(here.join("s.toml"), text).unwrap();
        let found = parsed(&crumple_ok(here, "simulate s.toml --json -q"));
        let interface = &found["summary"]["interfaces"][0];
        let number = |key: &str| interface[key].as_f64().unwrap();
        let further = number("max_deflection_m") / crush_m - 1.0;
        assert!((0.02..0.15).contains(&further), "{mass}: {interface}");
        assert!(number("peak_force_N") > 15e6, "{mass}: {interface}");
    }
    // The table of a curve that reaches so far by itself rises there, too.
    crumple_ok(here, "predict lead.model --speed 100km/h --extrapolate -o far.json");
    let table = crumple_ok(here, "export far.json --to csv -q");
    let mut rows = table.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    let last: Vec<f64> =
        rows.next_back().unwrap().split(',').map(|field| field.parse().unwrap()).collect();
    assert!((1.02..1.15).contains(&(last[0] / crush_m)) && last[1] > 15e6, "{last:?}");
    // One whose own maximum crush lies beyond goes to that at least, and says so.
    crumple_ok(here, "predict lead.model --speed 140km/h --extrapolate -o far.json --overwrite");
    let table = crumple_ok(here, "export far.json --to csv -q");
    says(&table, "# tail: from max_deflection_m on, which is beyond 1.5 times data_end_m");
}

/// A limit is held against the contact that changes the speed most, too, whatever small one comes first.
#[test]
fn a_first_small_pulse_hides_no_other() {
    let stages = [("200mm", "1MN"), ("50mm", "0N"), ("3m", "4MN")]
        .map(|(stroke, from)| format!("{{ stroke = \"{stroke}\", from = \"{from}\" }}"));
    let nose = format!("nose = {{ stages = [ {} ], unloading = \"80MN/m\" }}", stages.join(", "));
    let cars = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]\n[wall]";
    let limits = "[limits]\nstandard = \"EN 15227\"\nedition = \"2020+A1:2024\"\nmean_deceleration_g = 5.0\n";
    for (more, expected) in [("", "A1"), ("mean_deceleration_g = 18.0", "")] {
        let limits = match more {
            "" => limits.to_string(),
            more => limits.replace("mean_deceleration_g = 5.0", more),
        };
        let result = run(&scenario(&nose, cars, &limits));
        let body = &result["summary"]["bodies"][0];
        let g = |of: f64| of / 24e3 / 9.80665;
        let is_near = |name: &str, expected: f64| {
            let found = body[name].as_f64().unwrap();
            assert!((found / expected - 1.0).abs() < 0.01, "{name}: {found}, not {expected}");
        };
        is_near("mean_deceleration_g", g(1e6));
        // What speed is left is lost at 4 MN; then a quarter of an oscillation unloads, which gives a speed back.
        let (left, back) =
            ((100.0 - 2.0 * 1e6 * 0.2 / 24e3_f64).sqrt(), 4e6 / (80e6 * 24e3_f64).sqrt());
        let time_s = left * 24e3 / 4e6 + 0.5 * std::f64::consts::PI * (24e3_f64 / 80e6).sqrt();
        is_near("main_mean_deceleration_g", g(24e3 * (left + back) / time_s));
        let over = result["summary"]["limits"]["over"].as_array().unwrap();
        let over: Vec<&str> = over.iter().filter_map(Value::as_str).collect();
        assert_eq!(over.join(","), expected);
    }
}

/// An interface that is crushed on, slowly, when the vehicles' main contacts are over.
#[test]
fn a_crush_that_goes_on_after_the_end_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A draft gear, a tube and what shears off.
    let write = |name: &str, rows: &str| {
        let rows = rows.replace(' ', "\n");
        std::fs::write(here.join(name), format!("# force_kind: body\nd_m,force_MN\n{rows}\n"))
            .unwrap();
    };
    write("nose.csv", "0,0 0.02,3.0 0.05,1.6 0.30,1.7 0.60,1.9 0.65,3.2 0.80,2.6 1.60,3.4");
    write("inner.csv", "0,0 0.05,0.6 0.06,1.2 0.40,1.2 0.41,0.3 0.50,0.3 0.55,4.0 0.90,5.0");
    let laws = "nose = { file = \"nose.csv\", unloading = \"200MN/m\" }\ninner = { file = \"inner.csv\", unloading = \"120MN/m\", gap = \"13.6mm\", scale = 0.9 }";
    let of = |train: &str| -> String {
        let vehicle = |k: usize| {
            let mass = if k == 1 { "29.42t" } else { "24.52t" };
            format!("{{ name = \"{train}{k}\", mass = \"{mass}\" }}")
        };
        format!("inner = \"inner\"\nvehicles = [ {} ]\n", [1, 2, 3].map(vehicle).join(", "))
    };
    let other = format!("[[train]]\nname = \"B\"\nspeed = \"0km/h\"\n{}", of("B"));
    let at = |duration: &str| {
        let text = scenario(laws, &of("A"), &other).replace("300ms", duration);
        std::fs::write(here.join("s.toml"), text).unwrap();
        parsed(&crumple_ok(here, "simulate s.toml --json -q"))
    };
    let (short, long) = (at("199.5ms"), at("900ms"));
    let crush = |of: &Value| {
        let all = of["summary"]["interfaces"].as_array().unwrap().iter();
        let one = all.clone().find(|i| i["name"] == "A1|A2").unwrap();
        one["max_deflection_m"].as_f64().unwrap()
    };
    assert!(crush(&long) > 1.2 * crush(&short));
    let said =
        "these are still being crushed, so crush and energy are not final: A1|A2, B1|B2; lengthen";
    assert!(short["warnings"].to_string().contains(said), "{}", short["warnings"]);
    assert_eq!(long["warnings"], json!([]));
}

/// Of shipped trains that end every 30 ms, what is named as still being crushed grows by more than 1 %.
#[test]
fn what_is_named_as_still_being_crushed_grows() {
    let folder = demo_folder();
    let here = folder.path();
    let mut named = 0;
    for scenario in ["train-set", "two-sets", "eight-on-eight"] {
        let text = std::fs::read_to_string(here.join(format!("{scenario}.toml"))).unwrap();
        let (head, rest) = text.split_once("duration = \"").unwrap();
        let (_, rest) = rest.split_once('"').unwrap();
        let at = |ms: u32| {
            let text = format!("{head}duration = \"{ms}ms\"{rest}");
            std::fs::write(here.join("s.toml"), text).unwrap();
            parsed(&crumple_ok(here, "simulate s.toml --json -q"))
        };
        let crush = |of: &Value, name: &str| {
            let mut all = of["summary"]["interfaces"].as_array().unwrap().iter();
            all.find(|i| i["name"] == name).unwrap()["max_deflection_m"].as_f64().unwrap()
        };
        let long = at(2000);
        assert!(!long["warnings"].to_string().contains("still being crushed"), "{scenario}");
        for ms in (30..=600).step_by(30) {
            let short = at(ms);
            let warnings = short["warnings"].as_array().unwrap().iter();
            for warning in warnings.filter_map(|w| w.as_str()) {
                let Some((_, names)) = warning.split_once("energy are not final: ") else {
                    continue;
                };
                let (names, _) = names.split_once("; lengthen").unwrap();
                for name in names.split(", ") {
                    let grows = crush(&long, name) / crush(&short, name) - 1.0;
                    assert!(grows > 0.01, "{scenario} at {ms} ms: {name} by {grows}");
                    named += 1;
                }
            }
        }
    }
    assert!(named > 20, "{named}");
}

/// A run that is too short for its mean deceleration says so, by every method.
#[test]
fn a_run_that_ends_while_loading_is_said() {
    let nose =
        "nose = { stages = [ { stroke = \"2m\", from = \"1MN\" } ], unloading = \"80MN/m\" }";
    let cars = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]\n[wall]";
    for method in ["verlet", "fourth_order", "reference"] {
        let at = |duration: &str| {
            let text = scenario(nose, cars, "").replace("300ms", duration);
            run(&text.replace("[curves]", &format!("method = \"{method}\"\n[curves]")))
        };
        // 10 m/s end after 240 ms at 1 MN, and 3 ms more of unloading.
        for (duration, is_cut) in [("30ms", true), ("239.25ms", true), ("300ms", false)] {
            let result = at(duration);
            let body = &result["summary"]["bodies"][0];
            assert_eq!(body["still_loaded_at_end"], is_cut, "{method} {duration}: {body}");
            let said = format!(
                "the run ends at {} s while the contact still loads A1",
                duration.trim_end_matches("ms").parse::<f64>().unwrap() / 1e3
            );
            let warnings = result["warnings"].as_array().unwrap();
            let is_said = warnings.iter().any(|w| w.as_str().unwrap().starts_with(&said));
            assert_eq!(is_said, is_cut, "{method} {duration}: {warnings:?}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let text = scenario(nose, cars, "").replace("300ms", "30ms");
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    crumple_fails(folder.path(), 3, "simulate s.toml --strict");
    says(&crumple_ok(folder.path(), "simulate s.toml"), " g so far");
}

/// A mean that may still fall below a limit decides nothing, nor does one that may rise above it.
#[test]
fn a_limit_is_not_judged_while_the_contact_loads() {
    let nose = "nose = { stages = [ { stroke = \"100mm\", from = \"3MN\" }, { stroke = \"3m\", from = \"0.4MN\" } ], unloading = \"80MN/m\" }";
    let cars = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]\n[wall]";
    let limits = "[limits]\nstandard = \"S\"\nedition = \"1\"\nmean_deceleration_g = 5.0\n";
    let judged = |duration: &str| {
        let text = scenario(nose, cars, limits).replace("36km/h", "25km/h");
        let result = run(&text.replace("300ms", duration));
        let mean_g = result["summary"]["bodies"][0]["mean_deceleration_g"].as_f64().unwrap();
        (mean_g, result["summary"]["limits"].clone())
    };
    let (mean_g, limits) = judged("30ms");
    assert!(mean_g > 5.0, "{mean_g}");
    assert_eq!(
        (&limits["over"], &limits["unknown"]),
        (&Value::from([(); 0].to_vec()), &Value::from(vec!["A1"]))
    );
    let (mean_g, limits) = judged("900ms");
    assert!(mean_g < 5.0, "{mean_g}");
    assert_eq!(
        (limits["over"].as_array().unwrap().len(), limits["unknown"].as_array().unwrap().len()),
        (0, 0)
    );
}

/// A body that the curve of its own FE run stops rebounds as that run did, however the curve goes on beyond.
#[test]
fn the_rebound_is_fes_whatever_lies_beyond_the_curve() {
    let folder = demo_folder();
    for speed in [12, 18, 25, 36, 48, 60, 72] {
        let case = format!("lead-car-wall/{speed}kmh");
        let restitution = |end: &str| {
            let nose = format!("nose = {{ database = \"curves.h5\", case = \"{case}\"{end} }}");
            let cars = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]\n[wall]";
            let text = scenario(&nose, cars, "").replace("36km/h", &format!("{speed}km/h"));
            std::fs::write(folder.path().join("own.toml"), text).unwrap();
            let result = parsed(&crumple_ok(folder.path(), "simulate own.toml --json -q"));
            result["summary"]["interfaces"][0]["restitution"].as_f64().unwrap()
        };
        let usual = restitution("");
        for end in ["bottom", "hold", "slope"] {
            let other = restitution(&format!(", end = \"{end}\""));
            assert!((other / usual - 1.0).abs() < 0.01, "{case} {end}: {other} and {usual}");
        }
        let database = crumple::database::Database::read(&folder.path().join("curves.h5")).unwrap();
        let (group, name) = case.split_once('/').unwrap();
        let fe = database.case(folder.path(), group, name).unwrap();
        let speeds = &fe.curves.closing_speed_m_per_s;
        let rebound = speeds.iter().copied().fold(0.0, f64::min).abs() / speeds[0];
        assert!((usual / rebound - 1.0).abs() < 0.05, "{case}: {usual}, FE {rebound}");
    }
}

/// What lies behind the last vehicle is not asked for in silence.
#[test]
fn keys_without_use_are_said() {
    let alone = "inner = \"nose\"\ngap = \"10mm\"\nvehicles = [ { name = \"A1\", mass = \"24t\", gap = \"20mm\" } ]\n[wall]";
    let nose = format!("nose = {{ {STAGES}, unloading = \"80MN/m\" }}");
    let text = scenario(&nose, alone, "");
    let warnings = run(&text)["warnings"].to_string();
    says(
        &warnings,
        "inner and gap and the gap of its last vehicle are not used, because nothing is behind",
    );
    let error = fails(&text.replace("inner = \"nose\"", "inner = \"none\""));
    says(&error, "there is no curve \"none\" in [curves]");
    // The time of common speed needs outputs that follow the speeds.
    let common = |interval: &str| {
        let text = text
            .replace("output_interval = \"0.75ms\"", &format!("output_interval = \"{interval}\""));
        run(&text)["summary"]["common_speed_time_s"].as_f64()
    };
    assert!(common("20ms").is_some() && common("25ms").is_none());
    // A percentage for a coefficient of friction.
    let braked = text.replace("inner = \"nose\"", "resistance = { braking = 15 }");
    says(&run(&braked)["warnings"].to_string(), "for 15 % write 0.15");
    let braked = text.replace("inner = \"nose\"", "resistance = { braking = 0.3 }");
    assert!(!run(&braked)["warnings"].to_string().contains("friction"));
}

/// No command writes over what its scenario reads.
#[test]
fn inputs_of_a_scenario_are_kept() {
    let demo = demo_folder();
    let demo = demo.path();
    let before = std::fs::read(demo.join("pair.model")).unwrap();
    for command in [
        ["simulate", "two-sets.toml", "-o", "pair.model"],
        ["simulate", "train-set.toml", "-o", "curves.h5"],
        ["sweep", "scenario.toml", "-o", "lead.model"],
    ] {
        says(&crumple_fails(demo, 2, &command), "names the input itself");
    }
    assert_eq!(std::fs::read(demo.join("pair.model")).unwrap(), before);
    says(&crumple_fails(demo, 2, "simulate two-sets.toml -o out.h5"), "a run is written as CSV");
}

/// Rows of a sweep are what single runs give, wherever the varied curve stands.
#[test]
fn sweeps_reach_every_place_of_a_curve() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "[run]\nduration = \"400ms\"\noutput_interval = \"1ms\"\n[curves]\nnose = {{ {STAGES}, unloading = \"100MN/m\" }}\n\
         soft = {{ stages = [ {{ stroke = \"1m\", from = \"0kN\", to = \"2MN\" }} ], unloading = \"20MN/m\", tension = \"pull\" }}\n\
         hard = {{ stages = [ {{ stroke = \"1m\", from = \"0kN\", to = \"9MN\" }} ], unloading = \"20MN/m\", tension = \"pull\" }}\n\
         pull = {{ stages = [ {{ stroke = \"1m\", from = \"0kN\", to = \"2MN\" }} ], law = \"elastic\", gap = \"5mm\" }}\n\
         [[train]]\nname = \"A\"\nspeed = \"36km/h\"\ninner = \"soft\"\n\
         vehicles = [ {{ name = \"A1\", mass = \"24t\", behind = \"soft\" }}, {{ name = \"A2\", mass = \"20t\" }}, {{ name = \"A3\", mass = \"20t\" }} ]\n\
         [wall]\n[contact]\ncurve = \"nose\"\n"
    );
    let vary = "[sweep]\nvary = [ { what = \"curve\", curve = \"soft\", values = [\"soft\", \"hard\"] },\n\
                { what = \"gap\", curve = \"pull\", values = [\"5mm\", \"200mm\"] } ]\n";
    std::fs::write(folder.path().join("s.toml"), format!("{text}{vary}")).unwrap();
    crumple_ok(folder.path(), "sweep s.toml -o s.csv -q");
    let csv = std::fs::read_to_string(folder.path().join("s.csv")).unwrap();
    let mut lines = csv.lines().filter(|l| !l.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), 4);
    let place = |name: &str| header.iter().position(|h| *h == name).unwrap();
    for (k, row) in rows.iter().enumerate() {
        let mut single = text.clone();
        if k / 2 == 1 {
            single = single.replace("inner = \"soft\"", "inner = \"hard\"");
            single = single.replace("behind = \"soft\"", "behind = \"hard\"");
        }
        if k % 2 == 1 {
            single = single.replace("5mm", "200mm");
        }
        let result = run(&single);
        for (body, name) in
            result["summary"]["bodies"].as_array().unwrap().iter().zip(["A1", "A2", "A3"])
        {
            let ours: f64 = row[place(&format!("final_v_m_per_s[{name}]"))].parse().unwrap();
            assert_eq!(ours, body["final_v_m_per_s"].as_f64().unwrap(), "row {k}, {name}");
        }
    }
}

/// A curve file of any format that `db add` reads drives an interface, as its CSV does.
#[test]
fn a_curve_file_of_any_format_drives_an_interface() {
    let folder = demo_folder();
    let here = folder.path();
    let crush = |file: &str, more: &str| -> (f64, String) {
        let curve = format!("nose = {{ file = '{file}', unloading = \"90MN/m\"{more} }}");
        let vehicles = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]";
        std::fs::write(here.join("any.toml"), scenario(&curve, vehicles, "[wall]")).unwrap();
        let run = parsed(&crumple_ok(here, "simulate any.toml --json -q"));
        let crush = run["summary"]["interfaces"][0]["max_deflection_m"].as_f64().unwrap();
        (crush, run["warnings"].to_string())
    };
    let export = |to: &str, file: &str, more: &[&str]| {
        let words = ["export", "lead50.json", "--tail", "none", "--to", to, "-o", file];
        crumple_ok(here, &[&words[..], more].concat());
    };
    export("csv", "c.csv", &[]);
    let (expected, _) = crush("c.csv", "");
    assert!(expected > 0.3, "{expected}");
    let units = ["--units", "mm-t-s"];
    for (to, file, options, more) in [
        ("lsdyna", "c.k", &units[..], ", units = \"mm-t-s\""),
        ("radioss", "c.rad", &units, ", units = \"mm-t-s\""),
        ("modelica", "c.mo", &[], ""),
        ("mat", "c.mat", &[], ", units = \"SI\""),
    ] {
        export(to, file, options);
        let (found, _) = crush(file, more);
        assert!((found / expected - 1.0).abs() < 1e-4, "{file}: {found} m, c.csv {expected} m");
    }
    // A spreadsheet's way: titles above, semicolons, a unit row; and columns that are turned.
    let rows: String = (0..=20).rev().map(|i| format!("-{}\t;-{}\n", 50 * i, 100 * i)).collect();
    std::fs::write(here.join("x.csv"), format!("Test 12\n\ndeflection;force\nmm;kN\n{rows}"))
        .unwrap();
    let (found, warnings) = crush("x.csv", "");
    assert!(found > 0.5 && warnings.contains("third quadrant"), "{found} {warnings}");
    // Units beside those that the header states change nothing.
    std::fs::write(here.join("few.csv"), "d_mm,F_kN\n0,0\n10,1000\n900,1500\n").unwrap();
    assert_eq!(crush("few.csv", "").0, crush("few.csv", ", units = \"SI\"").0);
    // A record over time drives from its contact on.
    let rows: String = (0..=200)
        .map(|i| {
            let d = 20.0 + f64::from(i) * 5.0;
            format!("{},{d},{}\n", f64::from(i) * 0.5, (d - 120.0).max(0.0) * 3.0)
        })
        .collect();
    std::fs::write(here.join("t.csv"), format!("time_ms,d_mm,force_kN\n{rows}")).unwrap();
    let (found, warnings) = crush("t.csv", "");
    assert!(found > 0.5 && warnings.contains("record over time"), "{found} {warnings}");
    // Its body may fly back by more than it was crushed: half a sine of 120 ms, 0.3 m and 2.4 MN.
    std::fs::write(here.join("line.csv"), "d_mm,F_kN\n0,0\n150,1200\n200,1600\n300,2400\n")
        .unwrap();
    let (expected, _) = crush("line.csv", "");
    for sign in [1.0, -1.0] {
        let row = |i: u32| {
            let ms = f64::from(i) * 0.5;
            let flown = -7.853_98 * (ms - 120.0);
            let crushed = 300.0 * (std::f64::consts::PI * ms / 120.0).sin();
            let d = if ms > 120.0 { flown } else { crushed };
            // With the offset of a load cell.
            format!("{ms},{},{}\n", sign * d, sign * (8.0 * d).max(5.0))
        };
        // A touch of one state goes before.
        let touch = format!("0.0,0,{}\n0.1,{},0\n", sign * 900.0, sign * 0.78);
        let touched: String = (1..=360).map(row).collect();
        std::fs::write(here.join("touch.csv"), format!("time_ms,d_mm,force_kN\n{touch}{touched}"))
            .unwrap();
        let (found, _) = crush("touch.csv", "");
        assert!((found / expected - 1.0).abs() < 0.05, "{found} m for {expected} m");
        let rows: String = (0..=360).map(row).collect();
        std::fs::write(here.join("back.csv"), format!("time_ms,d_mm,force_kN\n{rows}")).unwrap();
        let (found, _) = crush("back.csv", "");
        assert!((found / expected - 1.0).abs() < 0.01, "{found} m for {expected} m");
    }
}

/// A train crushes its noses further than any FE run: the moment an interface leaves the data of its
/// curve is a warning, `end = "error"` stops there, and limits are not judged.
#[test]
fn leaving_the_data_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let case = ["--group", "lead-car-wall", "--case", "48kmh", "--tail", "bottom"];
    crumple_ok(here, &[&["export", "curves.h5", "-o", "tail.csv"], &case[..]].concat());
    let largest = {
        let model = read_json(&here.join("lead.model"));
        let cases = model["cases"].as_array().unwrap().clone();
        cases.iter().map(|c| c["max_deflection_m"].as_f64().unwrap()).fold(0.0, f64::max)
    };
    let table = std::fs::read_to_string(here.join("tail.csv")).unwrap();
    let crush_m = table.lines().find_map(|l| l.strip_prefix("# max_deflection_m: ")).unwrap();
    let crush_m: f64 = crush_m.parse().unwrap();
    let limits = "[limits]\nstandard = \"EN 15227\"\nedition = \"2020+A1:2024\"\nmean_deceleration_g = 5.0\noccupant_load_g = 0.001";
    let text = |curve: &str, mass: &str| {
        let vehicles = format!("vehicles = [ {{ name = \"A1\", mass = \"{mass}\" }} ]");
        scenario(&format!("nose = {{ {curve} }}"), &vehicles, &format!("[wall]\n{limits}"))
    };
    let simulate = |curve: &str, mass: &str| -> Value {
        std::fs::write(here.join("far.toml"), text(curve, mass)).unwrap();
        parsed(&crumple_ok(here, "simulate far.toml --json -q"))
    };
    for (curve, end_m) in
        [("model = \"lead.model\"", largest), ("file = \"tail.csv\", force = \"body\"", crush_m)]
    {
        let run = simulate(curve, "200t");
        let nose = &run["summary"]["interfaces"][0];
        assert!((nose["data_end_m"].as_f64().unwrap() / end_m - 1.0).abs() < 1e-6, "{nose}");
        assert!(nose["max_deflection_m"].as_f64().unwrap() > end_m, "{nose}");
        let said = format!("beyond the end of its curve's data at {end_m:.4} m");
        assert!(run["warnings"].to_string().contains(&said), "{}", run["warnings"]);
        assert_eq!(run["summary"]["limits"]["beyond_data"], serde_json::json!(["A1|wall"]));
        let printed = crumple_ok(here, "simulate far.toml");
        let unknown = "unknown: A1|wall went beyond the data of its curve";
        says(&printed, &format!("(EN 15227:2020+A1:2024): {unknown}"));
        says(&printed, &format!("occupant load above 0.001 g: {unknown}"));
        let limits = &run["summary"]["limits"];
        for of in [limits, &limits["occupants"][0]] {
            assert_eq!((&of["over"], &of["unknown"]), (&json!([]), &json!(["A1"])), "{of}");
        }
        let stops = text(&format!("{curve}, end = \"error\""), "200t");
        std::fs::write(here.join("far.toml"), stops).unwrap();
        let error = crumple_fails(here, 1, "simulate far.toml");
        assert!(error.contains("end = \"hold\"") && error.contains(&format!("({end_m:.4} m)")));
    }
    // At the fastest run's own speed the crush ends within a hair of the data.
    for (mass, speed) in [("20t", "36km/h"), ("24t", "72km/h")] {
        let within = text("model = \"lead.model\"", mass).replace("36km/h", speed);
        std::fs::write(here.join("within.toml"), within).unwrap();
        let run: Value = parsed(&crumple_ok(here, "simulate within.toml --json -q"));
        assert!(!run["warnings"].to_string().contains("beyond the end"), "{}", run["warnings"]);
        assert!(!run["summary"]["sequence"].to_string().contains("beyond"), "{}", run["summary"]);
        assert_eq!(run["summary"]["limits"]["beyond_data"], serde_json::json!([]));
    }
}

/// A model, its predicted curve and what is exported of that go on alike beyond the maximum crush and
/// the data: a heavy vehicle behind pushes the nose to where it bottoms.
#[test]
fn curves_of_one_model_go_on_alike() {
    let folder = demo_folder();
    let here = folder.path();
    let push = |curve: &str| -> (f64, f64, f64) {
        let curves = format!(
            "nose = {{ {curve} }}\ninner = {{ stages = [ {{ stroke = \"500mm\", from = \"5MN\", to = \"9MN\" }} ], law = \"elastic\" }}"
        );
        let vehicles = "inner = \"inner\"\nvehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"150t\" } ]";
        let text = scenario(&curves, vehicles, "[wall]")
            .replace("36km/h", "50km/h")
            .replace("300ms", "600ms");
        std::fs::write(here.join("push.toml"), text).unwrap();
        let run = parsed(&crumple_ok(here, "simulate push.toml --json -q"));
        let interfaces = run["summary"]["interfaces"].as_array().unwrap().clone();
        let nose = interfaces.iter().find(|i| i["name"] == "A1|wall").unwrap();
        let number = |key: &str| nose[key].as_f64().unwrap();
        (number("max_deflection_m"), number("peak_force_N"), number("data_end_m"))
    };
    let (crush_m, force_n, data_end_m) = push("model = \"lead.model\", force = \"body\"");
    assert!(crush_m > 1.5 * data_end_m && force_n > 10e6, "{crush_m} m, {force_n} N");
    // A last digit of a force is one of 1e-5 in the crush: the nose strikes and parts many times.
    let alike = |curve: &str, (d, f, end): (f64, f64, f64)| {
        let (crush_m, force_n, data_end_m) = push(curve);
        for (found, expected) in [(crush_m, d), (force_n, f), (data_end_m, end)] {
            assert!((found / expected - 1.0).abs() < 3e-4, "{curve}: {found}, {expected}");
        }
    };
    let of_model = (crush_m, force_n, data_end_m);
    alike("file = \"lead50.json\", force = \"body\"", of_model);
    for file in ["far.csv", "far.k", "far.mo", "far.mat", "far.rad", "far.txt"] {
        let to: &[&str] = if file == "far.txt" { &["--to", "modelica"] } else { &[] };
        crumple_ok(here, &[&["export", "lead50.json", "-o", file, "-q"], to].concat());
        alike(&format!("file = \"{file}\", force = \"body\""), of_model);
    }
    let held = push("model = \"lead.model\", force = \"body\", end = \"hold\"");
    assert!(held.0 > 1.5 * crush_m && held.1 < 0.5 * force_n, "{held:?}");
    crumple_ok(here, "export lead50.json --tail hold -o held.csv -q");
    alike("file = \"held.csv\"", held);
    alike("file = \"lead50.json\", force = \"body\", end = \"hold\"", held);
    // An edge of the band goes on as its curve does.
    let edge = push("model = \"lead.model\", force = \"body\", band = 1.0");
    assert!(edge.0 > data_end_m && edge.1 != force_n, "{edge:?}");
    alike("file = \"lead50.json\", force = \"body\", band = 1.0", edge);
    // A continuation that does not belong to its curve is refused.
    let whole = read_json(&here.join("lead50.json"));
    for (key, value, said) in [
        ("data_end_m", Value::from(-1.0), "beyond.data_end_m is -1"),
        ("body_force_N", Value::Null, "and 0 of body_force_N"),
        ("force_N", serde_json::json!([1e6]), "1 values of force_N"),
    ] {
        let mut curve = whole.clone();
        curve["beyond"][key] = value;
        std::fs::write(here.join("odd.json"), curve.to_string()).unwrap();
        says(&crumple_fails(here, 1, "export odd.json -o odd.csv"), said);
    }
    // Plots say from where on the runs' data have ended.
    let fast = ["predict", "lead.model", "--speed", "76km/h", "--extrapolate", "-o", "fast.json"];
    crumple_ok(here, &fast);
    crumple_ok(here, "plot fast.json -o fast.svg");
    let beyond = "beyond the runs&#39; crush";
    let drawn = |name: &str| std::fs::read_to_string(here.join(name)).unwrap();
    assert!(drawn("fast.svg").contains(beyond));
    crumple_ok(here, "plot lead.model --speed 50km/h -o usual.svg");
    assert!(!drawn("usual.svg").contains(beyond));
}

/// What a scenario names is bounded before it is read.
#[test]
fn curves_of_a_scenario_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let vehicles = "vehicles = [ { name = \"A1\", mass = \"24t\" } ]";
    let fails = |curves: &str| {
        std::fs::write(here.join("many.toml"), scenario(curves, vehicles, "[wall]")).unwrap();
        crumple_fails(here, 1, "simulate many.toml")
    };
    let many: Vec<String> =
        (0..1_001).map(|k| format!("nose{k} = {{ file = \"a.csv\" }}")).collect();
    let said = fails(&many.join("\n").replace("nose0 ", "nose "));
    says(&said, "[curves] has 1001 curves: expected at most 1000");
    std::fs::File::create(here.join("a.csv")).unwrap().set_len(60 << 20).unwrap();
    let said = fails(&many[..40].join("\n").replace("nose0 ", "nose "));
    let expected = "the files of [curves] total 2400 MB: expected at most 2048";
    says(&said, expected);
}

/// A recorded curve that drives an impact of another speed or mass is warned of, as a model out of its
/// range is.
#[test]
fn a_curve_of_another_impact_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    crumple_ok(here, "export lead50.json --to csv -o lead50.csv");
    let warnings = |curve: &str, speed: &str, mass: &str| -> String {
        let vehicles = format!("vehicles = [ {{ name = \"A1\", mass = \"{mass}\" }} ]");
        let text = scenario(&format!("nose = {{ {curve} }}"), &vehicles, "[wall]");
        std::fs::write(here.join("other.toml"), text.replace("36km/h", speed)).unwrap();
        parsed(&crumple_ok(here, "simulate other.toml --json -q"))["warnings"].to_string()
    };
    let case = "database = \"curves.h5\", case = \"lead-car-wall/48kmh\"";
    for (curve, own) in [
        ("file = \"lead50.csv\"", "50km/h"),
        ("file = \"lead50.json\"", "50km/h"),
        (case, "48km/h"),
    ] {
        let shown = own.replace("km/h", " km/h");
        let said = format!("it is for {shown}, but A1|wall closes at 36 km/h");
        assert!(warnings(curve, "36km/h", "24t").contains(&said), "{curve}");
        assert!(!warnings(curve, own, "24t").contains("it is for "), "{curve}");
        if !curve.contains(".csv") {
            says(&warnings(curve, own, "30t"), "it is for 24.00 t, but A1|wall moves 30.00 t");
        }
    }
}

/// So is one that drives an interface inside a train, which closes more slowly than the trains; a model is not.
#[test]
fn a_curve_of_another_speed_inside_a_train_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let warnings = |inner: &str, interval: &str| -> String {
        let curves =
            format!("nose = {{ model = \"lead.model\" }}\ninner = {{ {inner}, gap = \"32mm\" }}");
        let vehicle = |name, mass| format!("{{ name = \"{name}\", mass = \"{mass}t\" }}");
        let vehicles = [vehicle("A1", "24"), vehicle("A2", "20.24"), vehicle("A3", "20.24")];
        let vehicles = format!("inner = \"inner\"\nvehicles = [ {} ]", vehicles.join(", "));
        let text = scenario(&curves, &vehicles, "[wall]");
        std::fs::write(here.join("inner.toml"), text.replace("0.75ms", interval)).unwrap();
        parsed(&crumple_ok(here, "simulate inner.toml --json -q"))["warnings"].to_string()
    };
    let case = |speed: &str| format!("database = \"curves.h5\", case = \"vehicle-pair/{speed}\"");
    let fast = warnings(&case("72kmh"), "0.75ms");
    says(&fast, "\\\"inner\\\": it is for 72 km/h, but what it drives closes at other speeds (A");
    says(&fast, "A1|A2 at ");
    let said = "closes at other speeds";
    assert!(!warnings(&case("12kmh"), "0.75ms").contains(said));
    assert!(!warnings("model = \"vehicle.model\"", "0.75ms").contains(said));
    // Where trains meet it is said of a curve that is also within them.
    let both = format!(
        "{}\n[[train]]\nname = \"B\"\nspeed = \"0km/h\"\nvehicles = [ {{ name = \"B1\", mass = \"24t\" }} ]\n[contact]\ncurve = \"nose\"\n",
        scenario(
            &format!("nose = {{ {} }}", case("72kmh")),
            "inner = \"nose\"\nvehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"24t\" } ]",
            "",
        )
        .split("\n[contact]")
        .next()
        .unwrap()
    );
    std::fs::write(here.join("both.toml"), both).unwrap();
    let both = parsed(&crumple_ok(here, "simulate both.toml --json -q"))["warnings"].to_string();
    says(&both, "it is for 72 km/h, but A1|B1 closes at 36 km/h");
    // Outputs that do not show how an interface begins to close say nothing.
    assert!(!warnings(&case("72kmh"), "10ms").contains(said));
    // A sweep says it once, of the scenario as it stands.
    warnings(&case("72kmh"), "0.75ms");
    let plan = "[sweep]\nresults = [\"peak_force\"]\nvary = [ { what = \"mass\", vehicle = \"A1\", values = [\"24t\", \"25t\"] } ]\n";
    std::fs::write(here.join("plan.toml"), plan).unwrap();
    let swept = crumple_in(here, "sweep inner.toml --plan plan.toml -o s.csv").stderr;
    let swept = String::from_utf8(swept).unwrap();
    assert_eq!(swept.matches(said).count(), 1, "{swept}");
    assert!(!std::fs::read_to_string(here.join("s.csv")).unwrap().contains(said));
}

/// A1 is braked by 2 MN, A2 is not: their gap of 30 mm closes after √(2 · 0.03 m · 24 t / 2 MN), whatever the outputs.
#[test]
fn a_contact_has_its_own_time() {
    let folder = tempfile::tempdir().unwrap();
    for output in ["0.75ms", "10ms", "0.01ms"] {
        let text = format!(
            "[run]\nduration = \"60ms\"\noutput_interval = \"{output}\"\n[curves]\n\
             nose = {{ stages = [ {{ stroke = \"1m\", from = \"2MN\" }} ], unloading = \"80MN/m\" }}\n\
             [[train]]\nname = \"A\"\nspeed = \"10m/s\"\ninner = \"nose\"\ngap = \"30mm\"\n\
             vehicles = [ {{ name = \"A1\", mass = \"24t\" }}, {{ name = \"A2\", mass = \"20t\" }} ]\n\
             [wall]\n[contact]\ncurve = \"nose\"\n"
        );
        std::fs::write(folder.path().join("gap.toml"), text).unwrap();
        let result = parsed(&crumple_ok(folder.path(), "simulate gap.toml --json -q"));
        let events = result["summary"]["sequence"].as_array().unwrap();
        let is_meant = |e: &&Value| e["event"] == "contact" && e["interface"] == "A1|A2";
        let time_s = events.iter().find(is_meant).unwrap()["time_s"].as_f64().unwrap();
        let expected_s = (2.0 * 0.03 * 24e3 / 2e6_f64).sqrt();
        assert!((time_s - expected_s).abs() < 2e-6, "{output}: {time_s} for {expected_s}");
    }
}

/// A curve that bottoms does so from 1.5 times its end with the unloading stiffness that the scenario gives: by hand from
/// the energies of its straight lines. Stages without a slope do, too.
#[test]
fn the_unloading_stiffness_bottoms() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let rows = "# force_kind: body\nd_mm,F_kN\n0,0\n50,500\n200,1000\n300,1200\n";
    std::fs::write(here.join("lin.csv"), rows).unwrap();
    let crush_m = |curve: &str, v: f64| {
        let text = format!(
            "[run]\nduration = \"200ms\"\noutput_interval = \"0.75ms\"\n[curves]\nn = {{ {curve}, end = \"bottom\" }}\n[[train]]\nname = \"A\"\nspeed = \"{v}m/s\"\nvehicles = [ {{ name = \"A1\", mass = \"30t\" }} ]\n[wall]\n[contact]\ncurve = \"n\"\n"
        );
        std::fs::write(here.join("s.toml"), text).unwrap();
        let run = parsed(&crumple_ok(here, "simulate s.toml --json -q"));
        run["summary"]["interfaces"][0]["max_deflection_m"].as_f64().unwrap()
    };
    // Beyond a level `f` held to `d`, the rest of the energy goes into f x + k x²/2.
    let by_hand = |work_j: f64, f: f64, d: f64, v: f64| {
        let (k, left_j) = (80e6, 0.5 * 30e3 * v * v - work_j);
        d + (-f + (f * f + 2.0 * k * left_j).sqrt()) / k
    };
    let file = crush_m("file = \"lin.csv\", unloading = \"80MN/m\"", 8.0);
    let to_300_mm = 0.05 * 0.25e6 + 0.15 * 0.75e6 + 0.1 * 1.1e6;
    let expected = by_hand(to_300_mm + 0.15 * 1.2e6, 1.2e6, 0.45, 8.0);
    assert!((file - expected).abs() < 1e-3, "{file} m for {expected} m");
    let stages = "stages = [ { stroke = \"0.3m\", from = \"1.2MN\" } ]";
    let found = crush_m(&format!("{stages}, unloading = \"80MN/m\""), 8.0);
    let expected = by_hand(0.45 * 1.2e6, 1.2e6, 0.45, 8.0);
    assert!((found - expected).abs() < 1e-3, "{found} m for {expected} m");
    let text = std::fs::read_to_string(here.join("s.toml")).unwrap();
    let without = text.replace("unloading = \"80MN/m\"", "law = \"elastic\"");
    std::fs::write(here.join("s.toml"), without).unwrap();
    says(
        &crumple_fails(here, 1, "simulate s.toml"),
        "it never rises, so it cannot bottom: write end = \"hold\"",
    );
    let held = std::fs::read_to_string(here.join("s.toml")).unwrap().replace("bottom", "hold");
    std::fs::write(here.join("s.toml"), held).unwrap();
    crumple_ok(here, "simulate s.toml -q");
    // A model's curve bottoms with what is asked for, and nothing is softer than that.
    let demo = demo_folder();
    for stiffness in ["150MN/m", "200MN/m", "311.7MN/m"] {
        let text = format!(
            "[run]\nduration = \"200ms\"\noutput_interval = \"0.75ms\"\n[curves]\nn = {{ model = \"lead.model\", force = \"body\", unloading = \"{stiffness}\" }}\n[[train]]\nname = \"A\"\nspeed = \"48km/h\"\nvehicles = [ {{ name = \"A1\", mass = \"24t\" }} ]\n[wall]\n[contact]\ncurve = \"n\"\n"
        );
        std::fs::write(demo.path().join("s.toml"), text).unwrap();
        crumple_ok(demo.path(), "simulate s.toml -q --strict");
    }
}

/// A body between a constant force and a lighter one chatters: its contact opens and closes all the time, and is one.
#[test]
fn a_contact_that_chatters_has_a_mean_deceleration() {
    let text = "[run]\nduration = \"400ms\"\noutput_interval = \"0.75ms\"\n[curves]\n\
        n = { stages = [ { stroke = \"0.5m\", from = \"1MN\" } ], unloading = \"80MN/m\" }\n\
        [[train]]\nname = \"A\"\nspeed = \"36km/h\"\ninner = \"n\"\ngap = \"10mm\"\n\
        vehicles = [ { name = \"A1\", mass = \"30t\" }, { name = \"A2\", mass = \"30t\" } ]\n\
        [[train]]\nname = \"B\"\nspeed = \"5m/s\"\ninner = \"n\"\ngap = \"0mm\"\n\
        vehicles = [ { name = \"B1\", mass = \"60t\" }, { name = \"B2\", mass = \"10t\" } ]\n\
        [contact]\ncurve = \"n\"\n[limits]\nstandard = \"EN 15227\"\nedition = \"2020\"\nmean_deceleration_g = 1.2\n";
    let run = run(text);
    let bodies = run["summary"]["bodies"].as_array().unwrap();
    let mean = |k: usize| bodies[k]["mean_deceleration_m_per_s2"].as_f64().unwrap();
    let end = |name: &str| *column(&run, &format!("v_m_per_s[{name}]")).last().unwrap();
    assert!((end("B1") - end("B2")).abs() < 0.01);
    assert!((mean(3) / mean(2) - 1.0).abs() < 0.02, "{} and {}", mean(3), mean(2));
    let over = run["summary"]["limits"].to_string();
    assert!(over.contains("B2"), "{over}");
}

/// Three vehicles that are pushed as one, behind forces that begin at 1 MN: 1.43 g over 120 ms, whatever the step, and peaks
/// (CFC 60) of 2.1 g, as 0.747 MN give to 36 t, whatever the outputs.
#[test]
fn vehicles_that_rattle_are_over_no_limit() {
    let text = |settings: &str| {
        format!(
            "[run]\nduration = \"400ms\"\n{settings}\n[curves]\n\
             nose = {{ stages = [ {{ stroke = \"115mm\", to = \"1.34MN\" }} ], unloading = \"20MN/m\" }}\n\
             inner = {{ stages = [ {{ stroke = \"66mm\", from = \"1MN\" }}, {{ stroke = \"481mm\", from = \"1.7MN\" }} ], unloading = \"40MN/m\" }}\n\
             [[train]]\nname = \"A\"\nspeed = \"5km/h\"\nvehicles = [ {{ name = \"A1\", mass = \"80t\" }} ]\n\
             [[train]]\nname = \"B\"\nspeed = \"0km/h\"\ninner = \"inner\"\n\
             vehicles = [ {{ name = \"B1\", mass = \"12t\" }}, {{ name = \"B2\", mass = \"12t\" }}, {{ name = \"B3\", mass = \"12t\" }} ]\n\
             [contact]\ncurve = \"nose\"\n[limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = 3.2\n"
        )
    };
    for settings in [
        "output_interval = \"0.1ms\"",
        "output_interval = \"1ms\"",
        "output_interval = \"0.75ms\"\nstep = \"0.02ms\"",
        "output_interval = \"0.75ms\"\nstep = \"0.005ms\"",
        "output_interval = \"0.75ms\"\nmethod = \"fourth_order\"",
    ] {
        let summary = &run(&text(settings))["summary"];
        assert_eq!(summary["limits"]["over"], json!([]), "{settings}");
        for body in &summary["bodies"].as_array().unwrap()[1..] {
            let in_g = |key: &str| body[key].as_f64().unwrap();
            let (mean, peak) = (in_g("moving_mean_deceleration_g"), in_g("peak_deceleration_g"));
            assert!((mean + 1.43).abs() < 0.02, "{settings}: {body}");
            assert!((peak + 2.11).abs() < 0.12, "{settings}: {body}");
        }
    }
}

/// A neighbour that has flown away meets a heavy vehicle and comes back: 2.3 g until 89 ms, 4.6 g from 187 to 278 ms.
#[test]
fn a_vehicle_whose_neighbour_comes_back_is_not_judged() {
    let text = "[run]\nduration = \"100ms\"\n[curves]\n\
        nose = { stages = [ { stroke = \"600mm\", to = \"12MN\" } ], law = \"elastic\" }\n\
        [[train]]\nname = \"A\"\nspeed = \"18km/h\"\nvehicles = [ { name = \"A1\", mass = \"80t\" } ]\n\
        [[train]]\nname = \"B\"\nspeed = \"0km/h\"\ninner = \"nose\"\ngap = \"500mm\"\n\
        vehicles = [ { name = \"B1\", mass = \"20t\" }, { name = \"B2\", mass = \"400t\" } ]\n\
        [contact]\ncurve = \"nose\"\n\
        [limits]\nstandard = \"X\"\nedition = \"1\"\nmean_deceleration_g = 4.0\ntrains = [ \"A\" ]\n";
    for (duration, over, unknown) in
        [("100ms", json!([]), json!(["A1"])), ("600ms", json!(["A1"]), json!([]))]
    {
        let limits = &run(&text.replace("100ms", duration))["summary"]["limits"];
        assert_eq!((&limits["over"], &limits["unknown"]), (&over, &unknown), "{duration}");
    }
}

/// Brakes slow a body that the force of its neighbour pushes forwards for some milliseconds: the pulse before and the one after are two.
/// (21 and 140 ms by an integration of our own, 3.86 and 7.56 g.)
#[test]
fn brakes_do_not_join_pulses() {
    let text = "[run]\nduration = \"900ms\"\n[curves]\n\
        nose = { stages = [ { stroke = \"200mm\", from = \"1MN\" }, { stroke = \"50mm\", from = \"0.1MN\" }, { stroke = \"1m\", from = \"2MN\" } ], unloading = \"100MN/m\" }\n\
        inner = { stages = [ { stroke = \"3m\", from = \"0.12MN\" } ], unloading = \"40MN/m\" }\n\
        [[train]]\nname = \"A\"\nspeed = \"36km/h\"\ninner = \"inner\"\nresistance = { braking = 0.15 }\n\
        vehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"6t\" } ]\n\
        [wall]\n[contact]\ncurve = \"nose\"\n[limits]\nstandard = \"EN 15227\"\nedition = \"x\"\nmean_deceleration_g = 7.0\n";
    let summary = &run(text)["summary"];
    let body = &summary["bodies"][0];
    let in_g = |key: &str| body[key].as_f64().unwrap();
    assert!((in_g("mean_deceleration_g") - 3.86).abs() < 0.02, "{body}");
    assert!((in_g("main_mean_deceleration_g") - 7.56).abs() < 0.02, "{body}");
    assert_eq!(summary["limits"]["over"], json!(["A1"]));
}

/// An occupant who does not move in a vehicle that nothing reaches any more meets nothing: that is known.
#[test]
fn occupants_of_vehicles_at_rest_meet_nothing() {
    let text = "[run]\nduration = \"2s\"\n[curves]\n\
        nose = { stages = [ { stroke = \"1m\", from = \"0.5MN\", to = \"3MN\" } ], unloading = \"60MN/m\" }\n\
        inner = { stages = [ { stroke = \"0.3m\", from = \"1MN\" } ], unloading = \"80MN/m\" }\n\
        [[train]]\nname = \"A\"\nspeed = \"20km/h\"\nvehicles = [ { name = \"A1\", mass = \"24t\" } ]\n\
        [[train]]\nname = \"B\"\nspeed = \"0km/h\"\ninner = \"inner\"\ngap = \"9m\"\nresistance = { braking = 0.25 }\n\
        vehicles = [ { name = \"B1\", mass = \"90t\" }, { name = \"B2\", mass = \"20t\" } ]\n\
        [contact]\ncurve = \"nose\"\n[limits]\nstandard = \"EN 15227\"\nedition = \"x\"\nmean_deceleration_g = 7.5\n\
        secondary_impact = \"8m/s\"\noccupant_load_g = 20\n";
    let unknown = |text: &str| {
        let run = run(text);
        let of = |k: usize| run["summary"]["limits"]["occupants"][k]["unknown"].clone();
        [of(0), of(1)]
    };
    assert_eq!(unknown(text), [json!([]), json!([])]);
    // While the vehicles still move, occupants may meet something.
    let short = unknown(&text.replace("\"2s\"", "\"200ms\""));
    assert!(short[0].to_string().contains("B1"), "{short:?}");
}

/// What multi-body.md says of two noses that meet, against one at the wall, at the same crush of each.
#[test]
fn facing_noses_push_otherwise_than_one_at_the_wall() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let points = |group: &str, run: &str, noses: f64| -> Vec<(f64, f64)> {
        build_fixture(here, group);
        let case = format!("curves.h5 --case {group}/{run} --force contact --to csv -o c.csv");
        crumple_ok(here, &format!("export -q --overwrite {case}"));
        let text = std::fs::read_to_string(here.join("c.csv")).unwrap();
        let rows = text.lines().filter_map(|line| line.split_once(','));
        let number = |text: &str| text.split(',').next()?.parse::<f64>().ok();
        rows.filter_map(|(d, f)| Some((number(d)? / noses, number(f)?))).collect()
    };
    let wall = points("lead-car-wall", "36kmh", 1.0);
    let pair = points("lead-car-pair", "72kmh", 2.0);
    let groups = parsed(&crumple_ok(here, "db ls curves.h5 --json"));
    let largest = |group: &str, run: &str| -> f64 {
        let cases = groups["groups"][group].as_array().unwrap();
        let case = cases.iter().find(|case| case["name"] == run).unwrap();
        case["max_deflection_m"].as_f64().unwrap()
    };
    let (of_pair, of_wall) = (largest("lead-car-pair", "72kmh"), largest("lead-car-wall", "36kmh"));
    assert!((0.5 * of_pair / of_wall - 1.0).abs() < 0.04);
    let work = |curve: &[(f64, f64)], from: f64, to: f64| -> f64 {
        let inside = |p: &&(f64, f64)| (from..=to).contains(&p.0);
        let points: Vec<&(f64, f64)> = curve.iter().filter(inside).collect();
        let mean: f64 =
            points.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum();
        mean / (points[points.len() - 1].0 - points[0].0)
    };
    let ranges = [(0.05, 0.2, 0.95, 1.05), (0.25, 0.42, 0.82, 0.86), (0.42, 0.54, 0.95, 1.05)];
    for (from, to, least, most) in ranges {
        let ratio = work(&pair, from, to) / work(&wall, from, to);
        assert!((least..=most).contains(&ratio), "{from} to {to} m: {ratio}");
    }
}
