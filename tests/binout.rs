//! binout against the text files of the same runs, and damaged containers.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::containers::{Written, binout_of};
use crate::common::{
    crumple_fails, crumple_in, crumple_ok, fixture, python, run_python, samples, says, shared,
};
use crumple::history::EntityId;
use crumple::solver::{ProblemCode, Selection, SolverFile, read, read_sections};

fn section(path: &Path, name: &str) -> SolverFile {
    read(path, None, &Selection { section: Some(name.into()), ..Selection::all() }).unwrap()
}

/// Equal to the digits that the text prints.
fn agrees(text: &SolverFile, binary: &SolverFile, digits: i32) -> usize {
    assert_eq!(text.time.len(), binary.time.len());
    let mut compared = 0;
    for history in &text.histories {
        let other = binary.history(history.entity, &history.component).unwrap();
        for (a, b) in history.values.iter().zip(&other.values) {
            // Half a unit of the last printed digit.
            let unit = 10f64.powf(b.abs().log10().floor() - f64::from(digits) + 1.0);
            assert!(
                a == b || (a - b).abs() <= 0.5000001 * unit,
                "{}: {a} and {b}",
                history.label()
            );
            compared += 1;
        }
    }
    compared
}

/// A binout of the fixtures' samples, and the text that l2a printed from it.
const WALL: &str = "samples/lasso-python/binout/lasso_r12_smp_s_sph_rwforc";

#[test]
fn a_binout_agrees_with_what_l2a_printed_from_it() {
    let l2a = |kind: &str| {
        let path = fixture(&format!("samples/lasso-python/{kind}/l2a_lasso_r12_smp_s"));
        read(&path, None, &Selection::all()).unwrap()
    };
    // Seven digits of its float32 values.
    let walls = section(&fixture(WALL), "rwforc/forces");
    assert_eq!(agrees(&l2a("rwforc"), &walls, 7), 88 * 4);
    let parts = section(&fixture(WALL), "matsum");
    // Two parts of eleven components.
    assert_eq!(agrees(&l2a("matsum"), &parts, 5), 88 * 2 * 11);
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn text_and_binary_of_one_run_agree() {
    let folder = shared("samples/lsdyna");
    for run in ["run0001", "run0010_5"] {
        let text = folder.join(format!("nodout/rowan_r14.1.1_smp_d_{run}"));
        let text = read(&text, None, &Selection::all()).unwrap();
        let binary = folder.join(format!("binout/rowan_r14.1.1_smp_d_{run}"));
        assert!(agrees(&text, &section(&binary, "nodout"), 6) > 5_000);
        if run == "run0010_5" {
            let matsum = folder.join("matsum/rowan_r14.1.1_run0010_5_no_hgeng");
            let matsum = read(&matsum, None, &Selection::all()).unwrap();
            assert_eq!(agrees(&matsum, &section(&binary, "matsum"), 5), 2 * 10);
            // Every other text of this run, in the digits that it prints.
            for (file, name, values) in [
                ("spcforc/rowan_r14.1.1_run0010_5_moments", "spcforc", 2 * (1306 * 6 + 3)),
                ("bndout/rowan_r14.1.1_run0010_5", "bndout/velocity/nodes", 2 * (135 * 7 + 4)),
                ("elout/rowan_r14.1.1_solid_run0010_5", "elout/solid", 2 * 7 * 14),
                ("eloutdet/rowan_r14.1.1_run0010_5", "eloutdet/nodavg", 2 * 52 * 13),
            ] {
                let text = read(&folder.join(file), None, &Selection::all()).unwrap();
                assert_eq!(agrees(&text, &section(&binary, name), 5), values, "{file}");
            }
        }
    }
}

/// Every value of every section that lasso-python reads, of every sample.
#[test]
#[ignore = "needs ../shared and the Python clients"]
fn lasso_reads_the_same() {
    let files = samples("binout");
    let files = files.iter().map(|path| path.to_str().unwrap());
    let files = files.filter(|path| !path.contains("not_binout"));
    let arguments: Vec<&str> = [env!("CARGO_BIN_EXE_crumple")].into_iter().chain(files).collect();
    assert_eq!(run_python(python(), "binout.py", &arguments), 136_791, "values compared");
}

/// Whether a file has a section with so many states.
fn has(path: &Path, section: &str, count: usize) {
    let sections = read_sections(path, None, &Selection::nothing()).unwrap();
    let found: Vec<(&str, usize)> =
        sections.iter().map(|s| (s.section.as_str(), s.time.len())).collect();
    assert!(found.contains(&(section, count)), "{}: {found:?}", path.display());
}

#[test]
fn sections_without_states_and_with_them() {
    let path = fixture("samples/lasso-python/binout/lasso_r7.1.2_smp_s_sph_rwforc");
    has(&path, "rcforc", 0);
    has(&path, "glstat", 88);
}

/// What is read state by state, or as a whole, such as a section without states or with times alone.
#[test]
fn every_section_is_written_as_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut without = 0;
    for name in ["lasso_r12_smp_s_sph_rwforc", "lasso_r7.1.2_smp_s_sph_rwforc"] {
        let path = fixture("samples/lasso-python/binout").join(name);
        for file in read_sections(&path, None, &Selection::all()).unwrap() {
            let of = format!("{name} {}", file.section);
            let arguments = ["histories", path.to_str().unwrap(), "--section", &file.section, "-q"];
            let text = crumple_ok(here, &arguments);
            let mut lines = text.lines();
            let labels: Vec<String> = file.histories.iter().map(|h| h.label()).collect();
            let head = [&["time".to_string()][..], &labels].concat().join(",");
            assert_eq!(lines.next(), Some(&*head), "{of}");
            for (k, line) in lines.clone().enumerate() {
                let values = file.histories.iter().map(|h| h.values[k]);
                let found: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
                let equal = |(a, b): (&f64, f64)| *a == b || a.is_nan() && b.is_nan();
                assert!(found[1..].iter().zip(values).all(equal), "{of}: {line}");
            }
            assert_eq!(lines.count(), file.time.len(), "{of}");
            for output in ["out.csv", "out.h5"] {
                crumple_ok(here, &[&arguments[..], &["-o", output]].concat());
            }
            assert!(fs::read_to_string(here.join("out.csv")).unwrap() == text, "{of}");
            without += usize::from(file.histories.is_empty());
        }
    }
    assert_eq!(without, 4, "sections without histories");
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn sections_states_and_ids_of_every_sample() {
    let folder = shared("samples/lsdyna/binout");
    let has = |name: &str, section: &str, count: usize| has(&folder.join(name), section, count);
    let mpp = "dynareadout_r11.1_mpp_s_nodout_rcforc";
    has(mpp, "nodout", 601);
    has(mpp, "rcforc", 601);
    for (section, count) in [
        ("spcforc", 10),
        ("nodout", 8),
        ("elout/solid", 10),
        ("matsum", 10),
        ("bndout/velocity/nodes", 10),
    ] {
        has("rowan_r14.1.1_smp_d_run0001", section, count);
    }
    has("rowan_r14.1.1_smp_d_run0010_5", "eloutdet/nodavg", 2);
    let rcforc = section(&folder.join(mpp), "rcforc");
    assert_eq!(rcforc.entities.len(), 8);
    assert!(rcforc.entities.iter().all(|e| e.id.side.is_some()));
    let error = read_sections(
        &folder.join("pillars_r13_dyna.lsda_not_binout"),
        None,
        &Selection::nothing(),
    );
    assert!(error.unwrap_err().to_string().contains(": the readers take "));
}

#[test]
fn histories_needs_a_section_and_selects() {
    let path = fixture(WALL);
    let path = path.to_str().unwrap();
    let here = Path::new(".");
    let error = crumple_fails(here, 1, &["histories", path]);
    says(&error, "it has several sections: select one of rwforc/forces, glstat, matsum");
    let error = crumple_fails(here, 1, &["histories", path, "--section", "secforc"]);
    says(&error, "it has no section \"secforc\": it has rwforc/forces");
    let csv = crumple_ok(
        here,
        &format!("histories {path} --section matsum --id 101 --component z_momentum"),
    );
    assert_eq!(csv.lines().next(), Some("time,z_momentum[101]"));
    assert_eq!(csv.lines().count(), 1 + 88);
}

/// Processes of one run write sections of their own; a large file continues in another.
#[test]
fn a_family_is_one_tree() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, section: &str, id: i64, states: std::ops::Range<u32>, first: bool| {
        let mut out = Written::new();
        if first {
            out.ids(section, &[id]);
        }
        for state in states {
            out.cd(&format!("/{section}/d{state:06}"));
            out.reals("time", &[f64::from(state)]);
            out.reals("x_force", &[f64::from(state) * 10.0]);
        }
        fs::write(folder.path().join(name), out.bytes).unwrap();
    };
    file("binout0000", "nodout", 7, 1..4, true);
    file("binout0000%001", "nodout", 7, 4..6, false);
    file("binout0005", "rwforc/forces", 1, 1..4, true);
    file("binout0005%001", "rwforc/forces", 1, 4..5, false);
    file("binout0007", "nodout", 7, 5..8, false); // a restart: state 5 again
    let path = folder.path().join("binout0000");
    let nodout = section(&path, "nodout");
    assert_eq!(&nodout.time[..], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!(nodout.histories[0].values[4..], [50.0, 60.0, 70.0]);
    assert_eq!(&section(&path, "rwforc/forces").time[..], [1.0, 2.0, 3.0, 4.0]);
    // Any other than the first is read alone, with its continuation.
    let alone = folder.path().join("binout0005");
    let sections = read_sections(&alone, None, &Selection::nothing()).unwrap();
    assert_eq!(sections.len(), 1);
    assert_eq!(sections[0].time.len(), 4);
    fs::remove_file(folder.path().join("binout0000%001")).unwrap();
    assert_eq!(&section(&path, "nodout").time[..], [1.0, 2.0, 3.0, 5.0, 6.0, 7.0]);
}

/// A record without sense: the walk continues at the next directory, one state is lost.
#[test]
fn damage_in_the_middle_costs_one_state() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    let bytes = binout_of(&fixture("fe/lead-car-wall/25kmh"));
    fs::write(&path, &bytes).unwrap();
    let whole = section(&path, "nodout");
    let state = b"/nodout/d000200";
    let at = bytes.windows(state.len()).position(|w| w == state).unwrap();
    let mut damaged = bytes;
    damaged[at + state.len() + 40..at + state.len() + 90].fill(0);
    fs::write(&path, &damaged).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.time.len(), 399);
    let kept: Vec<f64> =
        whole.time.iter().copied().enumerate().filter(|(k, _)| *k != 199).map(|(_, t)| t).collect();
    assert_eq!(file.time[..], kept);
    let messages: Vec<String> = file.problems.iter().map(ToString::to_string).collect();
    assert!(messages[0].contains("damaged record"), "{messages:?}");
    assert!(messages[0].contains("reading continues at byte"), "{messages:?}");
    assert!(
        messages[1].contains("state d200 is left out: a record of it is damaged"),
        "{messages:?}"
    );
}

/// "Widths must be taken from the header (older files can use 4)", and the byte order too.
#[test]
fn other_widths_and_the_other_byte_order() {
    let mut bytes = vec![8, 4, 4, 1, 1, 0, 0, 0];
    let mut record = |command: u8, payload: &[u8]| {
        bytes.extend((payload.len() as u32 + 5).to_be_bytes());
        bytes.push(command);
        bytes.extend(payload);
    };
    let data = |name: &str, kind: u8, values: &[u8]| {
        [&[kind, name.len() as u8], name.as_bytes(), values].concat()
    };
    record(2, b"/nodout/metadata");
    record(3, &data("ids", 3, &7i32.to_be_bytes()));
    for state in 1..=2 {
        record(2, format!("../d{state:06}").as_bytes());
        record(3, &data("time", 10, &f64::from(state).to_be_bytes()));
        record(3, &data("x_displacement", 9, &1.5f32.to_be_bytes()));
        record(3, &data("nip", 2, &(-3i16).to_be_bytes()));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    fs::write(&path, bytes).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.problems, []);
    assert_eq!(&file.time[..], [1.0, 2.0]);
    let of =
        |component: &str| file.history(Some(EntityId::new(7)), component).unwrap().values.clone();
    assert_eq!(of("x_displacement"), [1.5, 1.5]);
    assert_eq!(of("nip"), [-3.0, -3.0]);
}

/// A large section is written state by state; what needs a look at the whole is found, and said.
#[test]
fn states_are_written_one_by_one_or_from_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    let (nodes, states) = (300, 600);
    // y of some nodes is always zero, and that of others until a wave reaches them.
    let value = |state: usize, node: usize, component: usize| match (component, node) {
        (1, 10..20) => 0.0,
        (1, 50..90) if state < node => 0.0,
        _ => (state + node * 17 + component * 6000) as f64 / 7.0 + 0.25,
    };
    type Change<'a> = &'a dyn Fn(usize, usize, &mut Vec<f64>);
    let written = |change: Change<'_>| {
        let mut out = Written::new();
        out.ids("nodout", &(1..=nodes).map(|id| id as i64).collect::<Vec<_>>());
        for state in 0..states {
            out.cd(&format!("/nodout/d{:06}", state + 1));
            out.reals("time", &[state as f64 * 0.5]);
            for (k, name) in ["x_displacement", "y_displacement", "x_velocity"].iter().enumerate() {
                let mut values = (0..nodes).map(|node| value(state, node, k)).collect();
                change(state, k, &mut values);
                out.reals(name, &values);
            }
        }
        out.bytes
    };
    let cases: [(&str, Change<'_>); 5] = [
        ("", &|_, _, _| {}),
        ("are zero, but not in the states around it", &|state, k, values| {
            if (state, k) == (300, 2) {
                values[100..140].fill(0.0);
            }
        }),
        // Around those that are always zero.
        ("are zero, but not in the states around it", &|state, k, values| {
            if (state, k) == (599, 1) {
                values[5..27].fill(0.0);
            }
        }),
        ("not finite", &|state, k, values| {
            if (state, k) == (7, 0) {
                values[299] = f64::NAN;
            }
        }),
        ("has another number of values", &|state, k, values| {
            if (state, k) == (7, 0) {
                values.truncate(299);
            }
        }),
    ];
    for (said, change) in cases {
        fs::write(&path, written(change)).unwrap();
        let whole = section(&path, "nodout");
        assert_eq!(whole.problems.is_empty(), said.is_empty(), "{:?}", whole.problems);
        for storage in ["", " --f32", " --chunk", " --f32 --chunk"] {
            let line = format!("histories binout -o a.h5{storage}");
            let output = crumple_in(folder.path(), &line.split(' ').collect::<Vec<_>>());
            says(&String::from_utf8(output.stderr).unwrap(), said);
            let file = hdf5_pure::File::open(folder.path().join("a.h5")).unwrap();
            for (k, name) in ["x_displacement", "y_displacement", "x_velocity"].iter().enumerate() {
                let values = file.dataset(name).unwrap().read_f64().unwrap();
                assert_eq!(values.len(), nodes * states, "{said} {k}");
                for (at, &value) in values.iter().enumerate() {
                    let id = EntityId::new((at % nodes) as i64 + 1);
                    let expected = whole.history(Some(id), name).unwrap().values[at / nodes];
                    let expected = if !storage.contains("f32") {
                        expected
                    } else {
                        f64::from(expected as f32)
                    };
                    assert_eq!(value.to_bits(), expected.to_bits(), "{said} {name} {at}");
                }
            }
        }
        let columns = whole.histories.iter().map(|h| (h.label(), &h.values));
        let columns: Vec<(String, &Vec<f64>)> = columns.collect();
        let mut csv =
            format!("time,{}\n", columns.iter().map(|c| &*c.0).collect::<Vec<_>>().join(","));
        for state in 0..states {
            let values = columns.iter().map(|(_, values)| values[state]);
            let row: Vec<String> = [whole.time[state]]
                .into_iter()
                .chain(values)
                .map(|v| zmij::Buffer::new().format(v).to_string())
                .collect();
            csv += &(row.join(",") + "\n");
        }
        let printed = crumple_in(folder.path(), &["histories", "binout"]).stdout;
        assert!(String::from_utf8(printed).unwrap() == csv, "{said}");
        crumple_ok(folder.path(), "histories binout -o a.csv");
        assert!(fs::read_to_string(folder.path().join("a.csv")).unwrap() == csv, "{said}");
    }
}

/// Ids that are all the same, by damage or malice: what is there more than once is named, and
/// the work grows with the file and not with its square.
#[test]
fn equal_ids_are_named_and_take_no_square_of_time() {
    let folder = tempfile::tempdir().unwrap();
    let converted = |count: usize| {
        let mut out = Written::new();
        out.ids("nodout", &vec![7; count]);
        for state in 1..=2 {
            out.cd(&format!("/nodout/d{state:06}"));
            out.reals("time", &[f64::from(state)]);
            out.reals("x_displacement", &vec![1.0; count]);
        }
        let path = folder.path().join("binout");
        fs::write(&path, out.bytes).unwrap();
        let output = folder.path().join("x.h5");
        let start = std::time::Instant::now();
        let arguments = ["histories", path.to_str().unwrap(), "-o", output.to_str().unwrap()];
        let error = String::from_utf8(crumple_in(folder.path(), &arguments).stderr).unwrap();
        let expected = "nodout: 1 ids, the first 7, occur more than once in one state; their further rows are components whose names end with _2, _3, …";
        says(&error, expected);
        start.elapsed()
    };
    converted(1_000);
    // Where every id was a component of its own, this took minutes.
    let time = converted(200_000);
    assert!(time.as_secs() < 5, "{time:?}");
}

/// A list of ids that no model has is left out, and said.
#[test]
fn a_list_of_ids_is_bounded() {
    let mut out = Written::new();
    let count = 4_000_001;
    out.ids("nodout", &(1..=count).collect::<Vec<i64>>());
    out.cd("/nodout/d000001");
    out.reals("time", &[1.0]);
    out.data("x_displacement", 9, &vec![0x3f; 4 * count as usize]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    fs::write(&path, out.bytes).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.histories.len(), 0);
    let said = file.problems[0].to_string();
    says(&said, "has 4000001 values per state but a different number of ids");
}

/// Elements that erode, with two integration points each.
#[test]
fn ids_that_change_between_states() {
    let mut out = Written::new();
    out.cd("/elout/shell/metadata");
    let integers =
        |values: &[i32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    for (state, ids) in [(1, vec![4, 5]), (2, vec![5]), (3, vec![6, 5])] {
        out.cd(&format!("/elout/shell/d{state}"));
        out.reals("time", &[f64::from(state)]);
        out.data("ids", 3, &integers(&ids));
        out.data("nip", 3, &integers(&vec![2; ids.len()]));
        let values: Vec<f64> =
            ids.iter().flat_map(|id| [f64::from(*id), f64::from(*id) + 0.5]).collect();
        out.reals("sig_xx", &values);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    fs::write(&path, out.bytes).unwrap();
    let file = section(&path, "elout/shell");
    let of = |id: i64, component: &str| {
        file.history(Some(EntityId::new(id)), component).unwrap().values.clone()
    };
    assert_eq!(of(5, "sig_xx"), [5.0; 3]);
    assert_eq!(of(5, "sig_xx_ip2"), [5.5; 3]);
    let gone = of(4, "sig_xx_ip2");
    assert!(gone[0] == 4.5 && gone[1].is_nan() && gone[2].is_nan());
    assert_eq!(of(6, "sig_xx")[2], 6.0);
    assert!(
        file.problems.iter().any(|p| p.code == ProblemCode::AbsentEntity),
        "{:?}",
        file.problems
    );
}

/// Ids hold for the states written after them, whatever the states' names.
#[test]
fn ids_hold_until_others_are_written() {
    let mut out = Written::new();
    for (ids, states) in [([7, 8], 1..3), ([8, 7], 3..5)] {
        out.ids("nodout", &ids);
        for state in states {
            out.cd(&format!("/nodout/d{state:06}"));
            out.reals("time", &[f64::from(state)]);
            out.reals("x_displacement", &ids.map(|id| id as f64));
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    fs::write(&path, out.bytes).unwrap();
    let file = section(&path, "nodout");
    assert_eq!(file.time.len(), 4);
    for id in [7, 8] {
        let history = file.history(Some(EntityId::new(id)), "x_displacement").unwrap();
        assert_eq!(history.values, [id as f64; 4]);
    }
}

/// A node in two sets of constraints has two rows in a state.
#[test]
fn constraints_of_a_node_in_two_sets() {
    let mut out = Written::new();
    out.ids("spcforc", &[1, 2, 1]);
    for state in 1..=2 {
        out.cd(&format!("/spcforc/d{state:06}"));
        out.reals("time", &[f64::from(state)]);
        out.reals("x_force", &[1.0, 2.0, 3.0]);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    fs::write(&path, out.bytes).unwrap();
    let file = section(&path, "spcforc");
    assert_eq!(file.problems, []);
    let of = |id: i64, component: &str| {
        file.history(Some(EntityId::new(id)), component).map(|h| h.values.clone())
    };
    assert_eq!(of(1, "x_force"), Some(vec![1.0; 2]));
    assert_eq!(of(1, "x_force_2"), Some(vec![3.0; 2]));
    assert_eq!(of(2, "x_force"), Some(vec![2.0; 2]));
    assert_eq!(of(2, "x_force_2"), None);
    let selection = Selection {
        components: Some(vec!["x_force_2".into()]),
        section: Some("spcforc".into()),
        ..Selection::all()
    };
    assert_eq!(read(&path, None, &selection).unwrap().histories.len(), 1);
}

/// A study of one bundled run, with the given files in its folder.
fn study(folder: &Path, files: &[(&str, Vec<u8>)]) -> PathBuf {
    let text = fs::read_to_string(fixture("fe/lead-car-wall/study.toml")).unwrap();
    let one: Vec<&str> = text.splitn(3, "[[run]]").take(2).collect();
    let manifest = folder.join("study.toml");
    fs::write(&manifest, one.join("[[run]]")).unwrap();
    fs::create_dir_all(folder.join("12kmh")).unwrap();
    for (name, bytes) in files {
        fs::write(folder.join("12kmh").join(name), bytes).unwrap();
    }
    manifest
}

/// One recipe works with either, says which, and says if both are there and differ.
#[test]
fn a_recipe_finds_text_or_binout() {
    let run = fixture("fe/lead-car-wall/12kmh");
    let binout = binout_of(&run);
    let text = |name: &str| fs::read(run.join(name)).unwrap();
    let build = |files: &[(&str, Vec<u8>)]| -> serde_json::Value {
        let folder = tempfile::tempdir().unwrap();
        study(folder.path(), files);
        let report = crumple_ok(folder.path(), "build study.toml -o c.h5 --json");
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        report["runs"][0]["case"].clone()
    };
    let from_text = build(&[("nodout", text("nodout")), ("rwforc", text("rwforc"))]);
    let from_binout = build(&[("binout0000", binout.clone())]);
    for key in ["work_J", "max_deflection_m", "peak_force_N", "speed_m_per_s"] {
        assert_eq!(from_text[key], from_binout[key], "{key}");
    }
    let notes = from_binout["notes"].to_string();
    says(&notes, "rwforc: read from section rwforc/forces of binout0000");
    let both = build(&[
        ("nodout", text("nodout")),
        ("rwforc", text("rwforc")),
        ("binout", binout.clone()),
    ]);
    assert!(both["notes"].to_string().contains("section nodout of binout agrees with it"));
    // Files that are only named like a binout or T01 do not spoil the run.
    let strangers =
        [("binout.txt", b"notes".to_vec()), ("runT01", Vec::new()), ("binout9", vec![8; 3])];
    let mut files = vec![("nodout", text("nodout")), ("rwforc", text("rwforc"))];
    files.extend(strangers.clone());
    assert_eq!(build(&files)["work_J"], from_text["work_J"]);
    let mut files = vec![("binout0000", binout.clone())];
    files.extend(strangers);
    assert_eq!(build(&files)["work_J"], from_text["work_J"]);
    // The container was cut before the section.
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), &[("binout0000", binout[..binout.len() / 4].to_vec())]);
    let error = crumple_fails(folder.path(), 1, "build study.toml -o c.h5");
    says(&error, "has no file \"rwforc\": it has binout0000; binout0000 is damaged (byte ");
    // Another rwforc beside the binout.
    let other =
        fs::read_to_string(run.join("rwforc")).unwrap().replace("1.735271E+06", "1.835271E+06");
    let both =
        build(&[("nodout", text("nodout")), ("rwforc", other.into_bytes()), ("binout", binout)]);
    let warnings = both["warnings"].to_string();
    says(&warnings, "rwforc and section rwforc/forces of binout differ; the text file was used");
}

/// A container over two files, and one that ends within a record.
#[test]
fn continuations_and_cuts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout0000");
    let mut first = Written::new();
    first.ids("nodout", &[7, 8]);
    let mut second = Written::new();
    for state in 1..=6u32 {
        let part = if state <= 3 { &mut first } else { &mut second };
        part.cd(&format!("/nodout/d{state:06}"));
        part.reals("time", &[f64::from(state)]);
        part.reals("x_displacement", &[f64::from(state), -f64::from(state)]);
    }
    fs::write(&path, &first.bytes).unwrap();
    fs::write(folder.path().join("binout0000%001"), &second.bytes).unwrap();
    let whole = section(&path, "nodout");
    assert_eq!(&whole.time[..], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(whole.history(Some(EntityId::new(8)), "x_displacement").unwrap().values[5], -6.0);
    assert_eq!(whole.problems, []);
    for cut in 9..second.bytes.len() {
        fs::write(folder.path().join("binout0000%001"), &second.bytes[..cut]).unwrap();
        let file = section(&path, "nodout");
        let kept = file.time.len();
        assert!((3..=6).contains(&kept));
        for (a, b) in file.histories.iter().zip(&whole.histories) {
            assert_eq!(a.values, b.values[..kept], "cut at {cut}");
        }
        // A cut between two records of a state is seen by what the state lacks.
        assert!(kept == file.time.len() && (kept < 6 || file.problems.is_empty()));
    }
}

/// Flipped bits, zeroed ranges and cuts: a result or an error, never a panic.
fn damage(seed: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout");
    let mut state = 7u64;
    let mut random = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..300 {
        let mut bytes = seed.to_vec();
        for _ in 0..3 {
            let at = random(bytes.len());
            bytes[at] ^= 1 << random(8);
        }
        let from = random(bytes.len());
        let to = (from + random(64)).min(bytes.len());
        bytes[from..to].fill(0);
        bytes.truncate(random(bytes.len()) + 1);
        fs::write(&path, &bytes).unwrap();
        for selection in [Selection::all(), Selection::nothing()] {
            for file in read_sections(&path, Some("binout"), &selection).into_iter().flatten() {
                assert!(file.histories.iter().all(|h| h.values.len() == file.time.len()));
            }
        }
    }
    let output = crumple_in(folder.path(), "inspect binout");
    assert!(output.status.code().is_some_and(|c| c < 4));
}

#[test]
fn damaged_containers_never_panic() {
    damage(&binout_of(&fixture("fe/lead-car-wall/25kmh"))[..20_000]);
}

#[test]
fn damaged_samples_never_panic() {
    for path in samples("binout") {
        let bytes = fs::read(path).unwrap();
        damage(&bytes[..bytes.len().min(60_000)]);
    }
}

/// A component that incomplete states alone have is judged by its first record, each time.
#[test]
fn a_component_of_incomplete_states_gives_the_same_each_time() {
    let mut out = Written::new();
    out.ids("gceout", &[4, 5]);
    for state in 1..9 {
        out.cd(&format!("/gceout/d{state:06}"));
        out.reals("x_force", &[1.0, 2.0, 3.0][..2 + state % 2]);
    }
    out.cd("/gceout/d000009");
    out.reals("time", &[1.0]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binout0000");
    fs::write(&path, &out.bytes).unwrap();
    let problems = || {
        let problems = section(&path, "gceout").problems;
        problems.iter().map(|p| p.to_string()).collect::<Vec<_>>()
    };
    let first = problems();
    says(&first.concat(), "x_force has 3 values per state but a different number of ids");
    assert!((0..20).all(|_| problems() == first));
}

/// A section is read whatever its name; what has no states is named.
#[test]
fn any_section_with_states_is_read() {
    let integers =
        |values: &[i64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let mut out = Written::new();
    out.ids("gceout", &[4]);
    out.cd("/icvout/metadata");
    out.data("ICV_ID.", 4, &integers(&[11]));
    out.data("ICVI_ID.", 4, &integers(&[21]));
    out.cd("/odd/values");
    out.reals("time", &[0.0, 1.0, 2.0]);
    for state in 1..4 {
        let value = f64::from(state);
        out.cd(&format!("/gceout/d{state:06}"));
        out.reals("time", &[value]);
        out.reals("x_force", &[value]);
        out.cd(&format!("/icvout/d{state:06}"));
        out.reals("time", &[value]);
        out.reals("ICV_Volume", &[value]);
        out.reals("ICVI_Area", &[10.0 * value]);
        out.cd(&format!("/icvout/d{state:06}/misc"));
        out.reals("further", &[value]);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("HAT.binout0000");
    fs::write(&path, &out.bytes).unwrap();
    let value = |name: &str, id: i64, component: &str| {
        section(&path, name).history(Some(EntityId::new(id)), component).unwrap().values[2]
    };
    assert_eq!(value("gceout", 4, "x_force"), 3.0);
    assert_eq!(value("icvout", 11, "ICV_Volume"), 3.0);
    assert_eq!(value("icvout", 21, "ICVI_Area"), 30.0);
    let sections = read_sections(&path, None, &Selection::nothing()).unwrap();
    let names: Vec<&str> = sections.iter().map(|s| s.section.as_str()).collect();
    assert_eq!(names, ["gceout", "icvout", "odd/values"]);
    assert_eq!(
        sections[2].problems[0].to_string(),
        "odd/values: 1 record not read: they are not in states (d000001, d000002, …) with times"
    );
}

#[test]
#[ignore = "needs ../shared (the real files)"]
fn control_volumes_of_a_real_binout() {
    let path = shared("samples/more").join("binout_pyansys_heart_r16_smp_d_icvout");
    let file = section(&path, "icvout");
    assert_eq!((file.time.len(), file.problems.len()), (161, 0));
    let volume = file.history(Some(EntityId::new(1)), "ICV_Volume").unwrap();
    assert!(volume.values.iter().all(|v| *v > 0.0));
}

/// LS-DYNA puts the job id of a run before the names of its files.
#[test]
fn job_ids_stand_before_names() {
    let run = fixture("fe/lead-car-wall/12kmh");
    let text = |name: &str| fs::read(run.join(name)).unwrap();
    let build = |files: &[(&str, Vec<u8>)], code: i32| -> serde_json::Value {
        let folder = tempfile::tempdir().unwrap();
        study(folder.path(), files);
        let output = crumple_in(folder.path(), "build study.toml -o c.h5 --json");
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        if code > 0 {
            let said = [output.stdout, output.stderr].concat();
            return String::from_utf8(said).unwrap().into();
        }
        let listed = crumple_ok(folder.path(), "inspect 12kmh");
        assert!(files.iter().all(|(name, _)| listed.contains(name)), "{listed}");
        crumple_ok(folder.path(), "init 12kmh -o proposed.toml");
        crumple_ok(folder.path(), "build proposed.toml -o p.h5");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        report["runs"][0]["case"]["work_J"].clone()
    };
    let plain = build(&[("nodout", text("nodout")), ("rwforc", text("rwforc"))], 0);
    let jobs = [("run7.nodout", text("nodout")), ("run7.rwforc", text("rwforc"))];
    assert_eq!(build(&jobs, 0), plain);
    assert_eq!(build(&[("HAT.v2.binout0000", binout_of(&run))], 0), plain);
    let two = [("a.nodout", text("nodout")), ("b.nodout", text("nodout")), jobs[1].clone()];
    says(&build(&two, 1).to_string(), "has a.nodout and b.nodout: write in the recipe which one");
}

/// The binouts of one job are one tree, apart from those of another.
#[test]
fn families_are_of_one_job() {
    let folder = tempfile::tempdir().unwrap();
    for (name, kind) in
        [("a.binout0000", "nodout"), ("a.binout0001", "matsum"), ("b.binout0001", "rcforc")]
    {
        let mut out = Written::new();
        out.ids(kind, &[7]);
        for state in 1..4 {
            out.cd(&format!("/{kind}/d{state:06}"));
            out.reals("time", &[f64::from(state)]);
            out.reals("x_force", &[1.0]);
        }
        fs::write(folder.path().join(name), out.bytes).unwrap();
    }
    let names = |file: &str| -> Vec<String> {
        let read = read_sections(&folder.path().join(file), None, &Selection::nothing()).unwrap();
        read.into_iter().map(|s| s.section).collect()
    };
    assert_eq!(names("a.binout0000"), ["nodout", "matsum"]);
    assert_eq!(names("b.binout0001"), ["rcforc"]);
}
