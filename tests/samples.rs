//! Every value of the real LS-DYNA samples, compared with an independent reading.
//!
//! The program reads fixed columns; the reading here knows no columns: it finds numbers by
//! their grammar, so that the two cannot share a mistake about layout.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::{
    crumple_fails, crumple_in, crumple_ok, fixture, is_with_shared, samples, samples_by_kind, says,
    shared,
};

/// Columns of a CSV by name, and the times.
type Table = BTreeMap<String, Vec<f64>>;

/// What the program prints for a file.
fn histories(path: &Path) -> Table {
    let text = crumple_ok(Path::new("."), &["histories", path.to_str().unwrap()]);
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut table: Table = names.iter().map(|n| (n.to_string(), Vec::new())).collect();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            table.get_mut(*name).unwrap().push(value.parse().unwrap());
        }
    }
    table
}

/// Numbers of Fortran's E format in a text, found by their grammar: sign, digits, point,
/// digits, then `E` with sign and two digits, or sign and two or three digits without `E`.
fn numbers(text: &str) -> Vec<f64> {
    let bytes = text.as_bytes();
    let digits = |mut i: usize| {
        while i < bytes.len() && bytes[i].is_ascii_digit() {
            i += 1;
        }
        i
    };
    let mut found = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let start = i;
        if bytes[i] == b'-' {
            i += 1;
        }
        let point = digits(i);
        if point == i || bytes.get(point) != Some(&b'.') {
            i = start.max(point) + usize::from(point <= start);
            continue;
        }
        let mantissa = digits(point + 1);
        let exponent = if bytes.get(mantissa) == Some(&b'E') { mantissa + 1 } else { mantissa };
        let end = digits(exponent + 1);
        let text = format!("{}E{}", &text[start..mantissa], &text[exponent..end]);
        found.push(text.parse().unwrap());
        i = end;
    }
    found
}

fn same(ours: &Table, theirs: &Table, path: &Path) {
    let names = |t: &Table| t.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(ours), names(theirs), "columns of {}", path.display());
    for (name, values) in theirs {
        // Bit by bit, so that a lost sign of zero counts.
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&ours[name]), bits(values), "{name} of {}", path.display());
    }
}

fn push(table: &mut Table, name: String, value: f64) {
    table.entry(name).or_default().push(value);
}

const AXES: [&str; 3] = ["x", "y", "z"];

#[test]
fn nodout_values_are_the_files() {
    // Those of others that may be passed on hold no state: ours has.
    let ours = fixture("fe/lead-car-pair/36kmh/nodout");
    let files = samples("nodout").into_iter().chain([ours]);
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        let mut prefix = "";
        let mut last_state = String::new();
        for line in text.lines() {
            if line.contains("n o d a l") {
                if line != last_state {
                    let at = line.find("( at time").unwrap();
                    push(&mut theirs, "time".into(), numbers(&line[at..])[0]);
                }
                last_state = line.to_string();
            } else if line.contains("nodal point") {
                prefix = if line.contains("x-rot") { "r" } else { "" };
            } else if line.contains("E+") || line.contains("E-") {
                let id: i64 = line[..9].trim().parse().unwrap();
                let values = numbers(&line[9..]);
                let kinds = ["displacement", "velocity", "acceleration", "coordinate"];
                assert_eq!(values.len(), if prefix == "r" { 9 } else { 12 }, "{line}");
                for (k, value) in values.into_iter().enumerate() {
                    let name = format!("{prefix}{}_{}[{id}]", AXES[k % 3], kinds[k / 3]);
                    push(&mut theirs, name, value);
                }
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
fn rcforc_values_are_the_files() {
    let files = samples("rcforc");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        let mut first = None;
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let side = match words.first().map(|w| w.to_ascii_lowercase()).as_deref() {
                Some("slave" | "surfa") => "surfa",
                Some("master" | "surfb") => "surfb",
                _ => continue,
            };
            let key = (side, words[1]);
            let values = numbers(line);
            // Titles of the legend begin like rows, but hold no numbers.
            if values.len() != 8 {
                continue;
            }
            if *first.get_or_insert((side, words[1].to_string())) == (key.0, key.1.to_string()) {
                push(&mut theirs, "time".into(), values[0]);
            }
            let names =
                ["x_force", "y_force", "z_force", "mass", "x_moment", "y_moment", "z_moment"];
            for (name, value) in names.iter().zip(&values[1..]) {
                push(&mut theirs, format!("{name}[{}:{side}]", words[1]), *value);
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
fn rwforc_values_are_the_files() {
    let files = samples("rwforc");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::new();
        for line in text.lines().filter(|l| numbers(l).len() == 5) {
            let wall = line.split_whitespace().nth(1).unwrap().to_string();
            let values = numbers(line);
            push(&mut theirs, "time".into(), values[0]);
            let names = ["normal_force", "x_force", "y_force", "z_force"];
            for (name, value) in names.iter().zip(&values[1..]) {
                push(&mut theirs, format!("{name}[{wall}]"), *value);
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
fn glstat_values_are_the_files() {
    let files = samples("glstat");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::new();
        for line in
            text.lines().filter(|l| l.contains("...") || l.contains("..  ") || l.contains(".   "))
        {
            let (label, value) = line.split_at(32);
            let label = label.trim_end_matches('.').trim();
            let name = match label {
                "total energy / initial energy" => "energy_ratio".to_string(),
                "energy ratio w/o eroded energy" => "energy_ratio_wo_eroded".to_string(),
                "time per zone cycle.(nanosec)" => "nzc".to_string(),
                _ => label.replace(' ', "_"),
            };
            push(&mut theirs, name, value.trim().parse().unwrap());
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn secforc_values_are_the_files() {
    let files = samples("secforc");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        let kinds = [
            ["x_force", "y_force", "z_force", "total_force"],
            ["x_moment", "y_moment", "z_moment", "total_moment"],
            ["x_centroid", "y_centroid", "z_centroid", "area"],
        ];
        let mut kind = 0;
        let mut section = String::new();
        for line in text.lines().skip(2).filter(|l| numbers(l).len() >= 4) {
            let mut values = numbers(line);
            if values.len() == 5 {
                section = line.split_whitespace().next().unwrap().to_string();
                push(&mut theirs, "time".into(), values.remove(0));
                kind = 0;
            }
            for (name, value) in kinds[kind].iter().zip(values) {
                push(&mut theirs, format!("{name}[{section}]"), value);
            }
            kind += 1;
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
fn matsum_values_are_the_files() {
    let files = samples("matsum");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        let mut part = String::new();
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if words.first() == Some(&"time") {
                push(&mut theirs, "time".into(), numbers(line)[0]);
            }
            if words.first() == Some(&"mat.#=") {
                part = words[1].to_string();
            }
            for pair in words.windows(2).filter(|w| w[0].ends_with('=') && w[1].contains('.')) {
                let name = match pair[0] {
                    "inten=" => "internal_energy",
                    "kinen=" => "kinetic_energy",
                    "eroded_ie=" => "eroded_internal_energy",
                    "eroded_ke=" => "eroded_kinetic_energy",
                    "hgeng=" => "hourglass_energy",
                    "+mass=" => "added_mass",
                    "eroded_he=" => "eroded_hourglass_energy",
                    "x-mom=" => "x_momentum",
                    "y-mom=" => "y_momentum",
                    "z-mom=" => "z_momentum",
                    "x-rbv=" => "x_rbvelocity",
                    "y-rbv=" => "y_rbvelocity",
                    "z-rbv=" => "z_rbvelocity",
                    _ => continue,
                };
                push(&mut theirs, format!("{name}[{part}]"), pair[1].parse().unwrap());
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

/// The number behind a label.
fn behind(line: &str, label: &str) -> f64 {
    numbers(&line[line.find(label).unwrap()..])[0]
}

fn push_all(table: &mut Table, names: &[&str], id: &str, values: &[f64]) {
    for (name, value) in names.iter().zip(values) {
        push(table, format!("{name}[{id}]"), *value);
    }
}

/// A time, unless the state above has it: blocks of one state repeat it.
fn push_time(table: &mut Table, time: f64) {
    let times = table.entry("time".into()).or_default();
    if times.last() != Some(&time) {
        times.push(time);
    }
}

#[test]
fn spcforc_values_are_the_files() {
    let files = samples("spcforc");
    for path in files {
        let mut theirs = Table::new();
        for line in std::fs::read_to_string(&path).unwrap().lines() {
            if line.contains("output at time") {
                push(&mut theirs, "time".into(), numbers(line)[0]);
            } else if line.contains("node=") {
                let id = line[6..].split_whitespace().next().unwrap();
                let kind = if line.contains("moments") { "moment" } else { "force" };
                for (axis, value) in AXES.iter().zip(numbers(line)) {
                    push(&mut theirs, format!("{axis}_{kind}[{id}]"), value);
                }
            } else if line.contains("resultants") {
                for (axis, value) in AXES.iter().zip(numbers(line)) {
                    push(&mut theirs, format!("{axis}_resultant"), value);
                }
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn bndout_values_are_the_files() {
    let files = samples("bndout");
    let row = ["x_force", "y_force", "z_force", "energy", "xmoment", "ymoment", "zmoment"];
    for path in files {
        let mut theirs = Table::new();
        for line in std::fs::read_to_string(&path).unwrap().lines() {
            if line.contains("o u t p u t") {
                push(&mut theirs, "time".into(), behind(line, "t="));
            } else if line.contains("nd#") {
                let id = line.split('#').nth(1).unwrap().split_whitespace().next().unwrap();
                push_all(&mut theirs, &row, id, &numbers(line));
            } else if line.contains("xtotal") {
                let names = ["x_total", "y_total", "z_total", "etotal"];
                for (name, value) in names.iter().zip(numbers(line)) {
                    push(&mut theirs, name.to_string(), value);
                }
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn sleout_values_are_the_files() {
    let files = samples("sleout");
    for path in files {
        let mut theirs = Table::new();
        for line in std::fs::read_to_string(&path).unwrap().lines().skip(2) {
            let sums = [
                ("total s", "total_slave"),
                ("total surfa", "total_slave"),
                ("total m", "total_master"),
                ("total surfb", "total_master"),
                ("total energy", "total_energy"),
                ("friction energy", "total_friction"),
            ];
            let sum = sums.iter().rev().find(|(label, _)| line.contains(label));
            if line.contains("energy file") {
                push(&mut theirs, "time".into(), numbers(line)[0]);
            } else if let Some((_, name)) = sum {
                push(&mut theirs, name.to_string(), numbers(line)[0]);
            } else if numbers(line).len() == 3 {
                let id = line.split_whitespace().next().unwrap();
                let names = ["slave", "master", "friction_energy"];
                push_all(&mut theirs, &names, id, &numbers(line));
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn swforc_values_are_the_files() {
    let files = samples("swforc");
    for path in files {
        let mut theirs = Table::new();
        for line in std::fs::read_to_string(&path).unwrap().lines() {
            let Some((left, right)) = line.split_once(" ID ") else { continue };
            let left: Vec<&str> = left.split_whitespace().collect();
            let mut right = right.split_whitespace();
            let id = right.next().unwrap();
            push_time(&mut theirs, numbers(left[3])[0]);
            let failure =
                if left[4].contains('+') { numbers(left[4])[0] } else { left[4].parse().unwrap() };
            let first = [numbers(left[1])[0], numbers(left[2])[0], failure];
            push_all(&mut theirs, &["axial", "shear", "failure"], id, &first);
            let rest: Vec<f64> = right.map(|word| numbers(word)[0]).collect();
            push_all(&mut theirs, &["length", "resultant_moment", "torsion"], id, &rest);
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn abstat_values_are_the_files() {
    let files = samples("abstat");
    let names = "volume pressure internal_energy dm_dt_in density dm_dt_out total_mass gas_temp surface_area reaction dm_dt_outp dm_dt_outv";
    let names: Vec<&str> = names.split(' ').collect();
    for path in files {
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        for line in std::fs::read_to_string(&path).unwrap().lines().skip(2) {
            let values = numbers(line);
            if values.len() == 13 {
                push(&mut theirs, "time".into(), values[0]);
                push_all(&mut theirs, &names, "1", &values[1..]);
            } else if line.contains("Material I.D.") {
                let material = line.split('=').nth(1).unwrap().split_whitespace().next().unwrap();
                for (name, value) in
                    ["unblocked_area", "blocked_area", "leakage"].iter().zip(values)
                {
                    push(&mut theirs, format!("{name}_mat{material}[1]"), value);
                }
            }
        }
        same(&histories(&path), &theirs, &path);
    }
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn elout_and_eloutdet_values_are_the_files() {
    let tensor = ["xx", "yy", "zz", "xy", "yz", "zx"];
    let files = samples("elout").into_iter().chain(samples("eloutdet"));
    for path in files {
        let mut theirs = Table::from([("time".to_string(), Vec::new())]);
        let (mut id, mut quantity) = (String::new(), "");
        for line in std::fs::read_to_string(&path).unwrap().lines().skip(2) {
            let words: Vec<&str> = line.split_whitespace().collect();
            if let Some(at) = line.find("( at time") {
                push_time(&mut theirs, numbers(&line[at..])[0]);
                quantity = if line.contains("s t r a i n") { "eps" } else { "sig" };
            } else if line.contains("beam/truss") {
                id = words[3].into();
            } else if words.first().is_some_and(|w| w.ends_with('-')) {
                id = words[0].trim_end_matches('-').into();
            }
            let values = numbers(line);
            let names: Vec<String> = match values.len() {
                7 if words[0] == "mid." => tensor
                    .iter()
                    .map(|axes| format!("lower_sig_{axes}"))
                    .chain(["lower_yield".to_string()])
                    .collect(),
                6 if words[0] == "mid." => {
                    tensor.iter().map(|axes| format!("lower_eps_{axes}")).collect()
                }
                7 => ["axial", "shear_s", "shear_t", "moment_s", "moment_t", "torsion", "pl_eps"]
                    .map(str::to_string)
                    .to_vec(),
                4 => {
                    let point =
                        if words[0] == "1" { String::new() } else { format!("_ip{}", words[0]) };
                    ["sigma_11", "sigma_12", "sigma_31", "plastic_eps"]
                        .map(|name| format!("{name}{point}"))
                        .to_vec()
                }
                6 | 8 => tensor
                    .iter()
                    .map(|axes| format!("{quantity}_{axes}"))
                    .chain(["effsg".to_string(), "yield".to_string()])
                    .take(values.len())
                    .collect(),
                _ => continue,
            };
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            push_all(&mut theirs, &names, &id, &values);
        }
        same(&histories(&path), &theirs, &path);
    }
}

/// Every sample is read, or refused with the right reason.
#[test]
fn every_sample_is_read_or_refused() {
    let mut read = 0;
    for (name, files) in samples_by_kind() {
        for path in files.into_values() {
            let output = crumple_in(Path::new("."), &["inspect", "--json", path.to_str().unwrap()]);
            let error = crate::common::said(&output);
            let shown = path.display().to_string();
            let reason = match name.as_str() {
                _ if shown.contains("not_binout") => "it has no section of a binout",
                "ncforc" => "an LS-DYNA text file of a kind that is not read",
                "d3plot" => {
                    assert!(path.is_dir());
                    "none of its folders holds solver files"
                }
                _ => {
                    assert_eq!(output.status.code(), Some(0), "{shown}: {error}");
                    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
                    assert_eq!(report["files"][0]["format"], *name, "{shown}");
                    let problems = report["files"][0]["problems"].as_array().unwrap();
                    assert!(problems.is_empty() || name == "keyword", "{shown}: {problems:?}");
                    read += 1;
                    continue;
                }
            };
            assert_eq!(output.status.code(), Some(1), "{shown}");
            assert!(error.contains(reason), "{shown}: {error}");
        }
    }
    let least = if is_with_shared() { 56 } else { 19 };
    assert!(read >= least, "{read} samples were read");
}

/// States, first and last time, ids of every sample, counted by hand (`grep -c` and `head`).
#[test]
fn inspect_says_states_times_and_ids() {
    let cases: [(&str, usize, Option<[f64; 2]>, usize); 33] = [
        ("nodout/l2a_scheckmate_root_r10.1_smp_s_norot", 101, Some([0.0, 9.9999873]), 1),
        ("nodout/lstoolbox_r13.1_smp_d_header_only_crlf", 0, None, 0),
        ("nodout/mlp6_113151_smp_d_1000nodes", 3, Some([0.0, 1.9962452e-4]), 1000),
        ("nodout/mlp6_78769_smp_d_handedited_1state", 1, Some([0.0, 0.0]), 3),
        ("nodout/mlp6_78769_smp_d_handedited_exp345", 3, Some([0.0, 0.3]), 3),
        ("nodout/node997_r14_smp_d_header_only", 0, None, 0),
        ("nodout/pillars_r13.1.1_smp_d_rot_legend", 1001, Some([0.0, 4.9998876]), 2),
        ("nodout/rowan_r14.1.1_smp_d_run0001", 8, Some([0.0, 11.597012]), 116),
        ("nodout/rowan_r14.1.1_smp_d_run0010_5", 2, Some([0.0, 2.5]), 214),
        ("rcforc/crimping_r16.1_smp_d_excerpt_4states", 4, Some([0.0, 0.1296]), 10),
        ("rcforc/l2a_lasso_r12_empty", 0, None, 0),
        ("rcforc/l2a_node997_r14_slave_master_1state", 1, Some([0.0, 0.0]), 8),
        ("rcforc/node997_r14_smp_d_surfa_surfb_1state", 1, Some([0.0, 0.0]), 8),
        ("rcforc/pillars_r13.1.1_smp_d_slave_master", 1001, Some([0.0, 4.99989]), 2),
        ("rwforc/l2a_lasso_r12_smp_s", 88, Some([0.0, 0.0347576]), 1),
        ("rwforc/l2a_lasso_r7.1.2_smp_s_nolegend", 88, Some([0.0, 0.0347804]), 1),
        ("glstat/amoudes_148931_mpp_d_massprops_first50", 50, Some([0.0, 4.89068e-7]), 0),
        ("glstat/mlp6_78769_smp_s", 21, Some([0.0, 9.99997e-3]), 0),
        ("glstat/pillars_r13.1.1_smp_d", 1001, Some([0.0, 4.99989]), 0),
        ("abstat/pillars_r13.1.1_airbag_open", 41, Some([1.1e-7, 20.0]), 1),
        ("bndout/pillars_r13.1.1_first300", 300, Some([2.1187e-4, 1.49517]), 17),
        ("bndout/rowan_r14.1.1_run0010_5", 2, Some([0.0, 2.5]), 135),
        ("curvout/l2a_scheckmate_root_r10.1_smp_s", 101, Some([0.0, 9.99999]), 0),
        ("elout/l2a_scheckmate_root_r10.1_solid_strain_first50", 50, Some([0.0, 0.489972]), 1),
        ("elout/pillars_r13.1.1_beam", 1001, Some([0.0, 4.99989]), 1),
        ("elout/rowan_r14.1.1_solid_run0010_5", 2, Some([0.0, 2.5]), 7),
        ("eloutdet/rowan_r14.1.1_run0010_5", 2, Some([0.0, 2.5]), 52),
        ("eloutdet/rowan_r14.1.1_run0013_1", 9, Some([0.0, 20.0866]), 0),
        ("sleout/pillars_r13.1.1_smp_d", 1001, Some([0.0, 4.999888]), 3),
        ("spcforc/node997_r14_smp_d", 2, Some([0.0, 0.1]), 32),
        ("spcforc/rowan_r14.1.1_run0010_5_moments", 2, Some([0.0, 2.5]), 1306),
        ("swforc/l2a_qd_r6.1.2_mpp_d_first20", 20, Some([0.0, 1.89984]), 26),
        ("swforc/pillars_r13.1.1_smp_d_beamweld", 1001, Some([0.0, 4.99989]), 1),
    ];
    let samples = samples_by_kind();
    let mut seen = 0;
    for (name, states, time, entities) in cases {
        let (kind, file) = name.split_once('/').unwrap();
        let path = samples.get(kind).and_then(|files| files.get(file));
        let Some(path) = path else { continue };
        seen += 1;
        // --strict: exit code 0 says that no sample counts as damaged.
        let text =
            crumple_ok(Path::new("."), &["inspect", "--json", "--strict", path.to_str().unwrap()]);
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let file = &report["files"][0];
        assert_eq!(file["format"], kind, "{name}");
        assert_eq!(file["states"], states, "{name}");
        assert_eq!(file["entities"].as_array().unwrap().len(), entities, "{name}");
        let found: Option<[f64; 2]> = serde_json::from_value(file["time"].clone()).unwrap();
        assert_eq!(found, time, "{name}");
    }
    assert_eq!(seen, if is_with_shared() { cases.len() } else { 8 });
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn single_surface_contacts_are_named_and_have_no_histories() {
    let folder = shared("samples/lsdyna");
    let path = folder.join("rcforc/pillars_r13.1.1_smp_d_slave_master");
    let path = path.to_str().unwrap();
    let report: serde_json::Value =
        serde_json::from_str(&crumple_ok(Path::new("."), &["inspect", "--json", path])).unwrap();
    let without: Vec<i64> = report["files"][0]["without_data"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w["id"].as_i64().unwrap())
        .collect();
    assert_eq!(without, [10001, 10013]);
    let error = crumple_fails(Path::new("."), 1, &["histories", path, "--id", "10001"]);
    says(&error, "interface 10001 is a single-surface contact");
    says(&error, "2:surfa \"Contact Force Between Sheets\"");
}
