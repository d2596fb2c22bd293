//! A nodout whose states are laid out evenly is read by leaps: the same values as line by
//! line, few pages for few nodes, and the line reader at the first surprise.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::sync::Mutex;

use crate::common::{crumple_fails, crumple_ok, python};
use crumple::solver::Source;
use crumple::solver::{Access, Selection, SolverFile, blocks, read_from};

const PAGE: u64 = 4096;

/// A nodout; `rotations`: of every second node.
struct Written {
    nodes: usize,
    states: usize,
    rotations: bool,
    /// Blank lines before the n-th state: by default 3.
    blanks: fn(usize) -> usize,
    line_end: &'static str,
}

impl Default for Written {
    fn default() -> Self {
        Self { nodes: 40, states: 30, rotations: true, blanks: |_| 3, line_end: "\n" }
    }
}

fn number(state: usize, node: usize, field: usize) -> f64 {
    let exponent = (node * 7 + field * 3) as i32 % 41 - 20;
    let mantissa = ((state * 131 + node * 17 + field) % 180_000) as f64 / 1e4 - 9.0;
    mantissa * 10f64.powi(exponent)
}

/// `E12.5`, as Fortran writes it.
fn e12(value: f64) -> String {
    let (mantissa, exponent) = fortran(format!("{value:.5E}"));
    format!("{mantissa:>8}{exponent}")
}

/// Mantissa, and exponent with sign and two digits.
fn fortran(text: String) -> (String, String) {
    let (mantissa, exponent) = text.split_once('E').unwrap();
    (mantissa.into(), format!("E{:+03}", exponent.parse::<i32>().unwrap()))
}

impl Written {
    fn text(&self) -> String {
        let end = self.line_end;
        let mut text =
            format!(" title{end}                    ls-dyna smp d R14 R14.0 date 12/12/2022{end}");
        for state in 0..self.states {
            text += &end.repeat((self.blanks)(state));
            let (mantissa, exponent) = fortran(format!("{:.7E}", state as f64 * 0.5));
            let head = format!(
                " n o d a l   p r i n t   o u t   f o r   t i m e  s t e p{:8}                              ( at time {mantissa}{exponent} ){end}{end}",
                state * 10
            );
            text += &head;
            text += &format!(" nodal point  x-disp     y-disp      z-disp{end}");
            for node in 0..self.nodes {
                let fields: String = (0..12).map(|f| e12(number(state, node, f))).collect();
                text += &format!("{:>9} {fields}{end}", 1_000 + node);
            }
            if self.rotations {
                text += &format!(
                    "{end}{end}{end}{head} nodal point  x-rot      y-rot       z-rot{end}"
                );
                for node in (0..self.nodes).step_by(2) {
                    let fields: String = (0..9).map(|f| e12(number(state, node, f))).collect();
                    text += &format!("{:>9} {fields}{end}", 1_000 + node);
                }
            }
        }
        text
    }
}

fn read(text: &[u8], selection: &Selection) -> SolverFile {
    read_from("nodout", &[Box::new(text.to_vec())], selection).unwrap().remove(0)
}

/// Values by label, NaN as bits, with the times.
fn content(file: &SolverFile) -> Vec<(String, Vec<u64>)> {
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect();
    let time = ("time".to_string(), bits(&file.time));
    let histories = file.histories.iter().map(|h| (h.label(), bits(&h.values)));
    [time].into_iter().chain(histories).collect()
}

/// Bytes that note which pages are read.
struct Watched {
    bytes: Vec<u8>,
    pages: &'static Mutex<HashSet<u64>>,
}

impl Source for Watched {
    fn size(&self) -> io::Result<u64> {
        Ok(self.bytes.len() as u64)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.as_slice().read_at(offset, buffer)?;
        let last = offset + (count as u64).max(1) - 1;
        self.pages.lock().unwrap().extend(offset / PAGE..=last / PAGE);
        Ok(count)
    }
}

/// Reads and tells the share of the pages that were touched.
fn watched(text: &str, selection: &Selection) -> (SolverFile, f64) {
    let pages: &'static Mutex<HashSet<u64>> = Box::leak(Box::default());
    let source = Watched { bytes: text.as_bytes().to_vec(), pages };
    let file = read_from("nodout", &[Box::new(source)], selection).unwrap().remove(0);
    let all = (text.len() as u64).div_ceil(PAGE);
    let touched = pages.lock().unwrap().len();
    (file, touched as f64 / all as f64)
}

/// Leaping and going line by line (states of different lengths cannot be leapt over).
#[test]
fn leaps_give_what_lines_give() {
    for rotations in [false, true] {
        for line_end in ["\n", "\r\n"] {
            let even = Written { rotations, line_end, ..Written::default() };
            let uneven =
                Written { blanks: |k| 3 + k % 2, rotations, line_end, ..Written::default() };
            let some = Selection {
                ids: Some(vec!["1004".parse().unwrap(), "1033".parse().unwrap()]),
                components: Some(vec!["y_velocity".into(), "rz_velocity".into()]),
                ..Selection::all()
            };
            for selection in [Selection::all(), some, Selection::nothing()] {
                let leapt = read(even.text().as_bytes(), &selection);
                let lines = read(uneven.text().as_bytes(), &selection);
                assert_eq!(leapt.problems, []);
                assert_eq!(leapt.time.len(), 30);
                assert_eq!(content(&leapt), content(&lines));
                assert_eq!((leapt.entities, leapt.components), (lines.entities, lines.components));
            }
        }
    }
    let file = read(Written::default().text().as_bytes(), &Selection::all());
    for (k, value) in file.histories[4].values.iter().enumerate() {
        let written: f64 = e12(number(k, 0, 4)).trim().parse().unwrap();
        assert_eq!(*value, written);
    }
}

/// Few nodes of many: few pages. Scattered nodes cost a page each, neighbours share one.
#[test]
fn few_nodes_touch_few_pages() {
    let text = Written { nodes: 5_000, states: 12, rotations: false, ..Written::default() }.text();
    let nodes = |ids: &[usize]| Selection {
        ids: Some(ids.iter().map(|id| id.to_string().parse().unwrap()).collect()),
        ..Selection::all()
    };
    // The two states that teach the layout are read whole: 2 of 12. Of the others few pages.
    let learning = 2.0 / 12.0;
    let neighbours: Vec<usize> = (3_000..3_010).collect();
    let (file, touched) = watched(&text, &nodes(&neighbours));
    assert_eq!((file.time.len(), file.histories.len()), (12, 120));
    assert!(touched < learning + 0.05 * (1.0 - learning) + 0.01, "{touched}");
    let scattered: Vec<usize> = (0..10).map(|k| 1_200 + 450 * k).collect();
    let (_, touched) = watched(&text, &nodes(&scattered));
    assert!(touched < learning + 0.12, "{touched}");
    let (_, all) = watched(&text, &Selection::all());
    assert_eq!(all, 1.0);
}

/// A surprise in one state: its rows are read line by line, the states behind it by leaps
/// again, and the result is that of reading all line by line.
#[test]
fn a_surprise_is_left_to_the_line_reader() {
    let row = " 1007 ";
    let nth = |text: &str, what: &str, n: usize| text.match_indices(what).nth(n).unwrap().0;
    type Damage = fn(&mut String, usize);
    let damages: [(&str, Damage); 7] = [
        ("stars", |text, at| text.replace_range(at + 10..at + 22, "************")),
        ("another id", |text, at| text.replace_range(at..at + 5, " 9999")),
        ("a cut row", |text, at| text.replace_range(at + 60..at + 61, "")),
        ("a longer row", |text, at| text.insert(at + 60, ' ')),
        ("a missing row", |text, at| {
            let end = text[at..].find('\n').unwrap();
            text.replace_range(at - 4..at + end - 3, "");
        }),
        ("a lost line end", |text, at| {
            let end = at + text[at..].find('\n').unwrap();
            text.replace_range(end..=end, " ");
        }),
        ("zeros", |text, at| text.replace_range(at..at + 300, &"\0".repeat(300))),
    ];
    for (name, damage) in damages {
        let mut results = Vec::new();
        for blanks in [|_| 3, |k| 3 + k % 2] as [fn(usize) -> usize; 2] {
            let mut text = Written { blanks, ..Written::default() }.text();
            let at = nth(&text, row, 13);
            damage(&mut text, at);
            let file = read(text.as_bytes(), &Selection::all());
            let codes: Vec<_> = file.problems.iter().map(|p| p.code).collect();
            assert!(!codes.is_empty(), "{name}");
            assert!(file.time.len() >= 28, "{name}: {} states", file.time.len());
            results.push((content(&file), codes));
        }
        assert!(results[0] == results[1], "{name}: {:?}", results[0].1);
    }
    // Behind the surprise it leaps again.
    let many = Written { nodes: 2_000, states: 40, rotations: false, ..Written::default() };
    let mut text = many.text();
    let at = nth(&text, row, 10);
    text.replace_range(at + 10..at + 22, "************");
    let one = Selection { ids: Some(vec!["1007".parse().unwrap()]), ..Selection::all() };
    let (file, touched) = watched(&text, &one);
    assert_eq!(file.time.len(), 40);
    assert!(touched < 6.0 / 40.0, "{touched}");
}

/// A file that is being written: its size changes while it is read.
struct Live {
    bytes: Vec<u8>,
    /// Size that is stated, and bytes that are there when they are read.
    stated: u64,
    there: u64,
}

impl Source for Live {
    fn size(&self) -> io::Result<u64> {
        Ok(self.stated)
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        (&self.bytes[..self.there as usize]).read_at(offset, buffer)
    }
}

#[test]
fn a_file_that_shrinks_or_grows_gives_its_complete_states() {
    let text = Written::default().text();
    let size = text.len() as u64;
    let whole = read(text.as_bytes(), &Selection::all());
    for there in (0..size).step_by(2_713).chain([size]) {
        for stated in [there / 2, there, size, size * 3] {
            let live = Live { bytes: text.as_bytes().to_vec(), stated, there };
            let file = read_from("nodout", &[Box::new(live)], &Selection::all()).unwrap().remove(0);
            let cut = read(&text.as_bytes()[..there as usize], &Selection::all());
            assert_eq!(content(&file), content(&cut), "{there} of {size}, {stated} stated");
            for (a, b) in file.histories.iter().zip(&whole.histories) {
                assert_eq!(a.values, b.values[..file.time.len()]);
            }
        }
    }
}

/// State by state into HDF5, and the same through a map.
#[test]
fn blocks_and_maps_give_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let written = Written { nodes: 900, states: 60, ..Written::default() };
    fs::write(folder.path().join("nodout"), written.text()).unwrap();
    let path = folder.path().join("nodout");
    let whole = read(written.text().as_bytes(), &Selection::all());
    for access in [Access::Plain, Access::Map] {
        let selection = Selection { access, ..Selection::all() };
        let blocks = blocks(&path, None, &selection).unwrap().expect("an even file");
        assert_eq!(blocks.file.time, whole.time);
        let (mut read, mut out) = (blocks.reader(), vec![0.0; blocks.values()]);
        for state in 0..60 {
            assert!(read(state, &mut out).unwrap());
            let mut at = 0;
            for column in &blocks.columns {
                for entity in &column.entities {
                    let history = whole.history(Some(*entity), &column.component).unwrap();
                    assert_eq!(out[at], history.values[state]);
                    at += 1;
                }
            }
        }
    }
    let here = folder.path();
    let plain = crumple_ok(here, "histories nodout --id 1899");
    assert_eq!(plain, crumple_ok(here, "histories nodout --id 1899 --map"));
    crumple_ok(here, "histories nodout -o a.h5");
    crumple_ok(here, "histories nodout -o b.h5 --map");
    let bytes = |name: &str| fs::read(here.join(name)).unwrap();
    assert!(bytes("a.h5") == bytes("b.h5"));
    // A damaged file takes the other way and leaves nothing behind.
    let mut text = written.text();
    let at = text.match_indices(" 1007 ").nth(9).unwrap().0;
    text.replace_range(at + 10..at + 22, "************");
    fs::write(&path, text).unwrap();
    assert!(blocks(&path, None, &Selection::all()).unwrap().is_some(), "its frame is even");
    crumple_ok(here, "histories nodout -o c.h5");
    crumple_fails(here, 3, "histories nodout -o c.h5 --strict");
    assert_eq!(bytes("c.h5").len(), bytes("a.h5").len());
    let left: Vec<_> = fs::read_dir(here).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 4, "{left:?}");
}

/// The nodes of each component are in a dataset of their own.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn h5py_finds_the_nodes_of_what_was_written_state_by_state() {
    let folder = tempfile::tempdir().unwrap();
    let written = Written { nodes: 9_000, states: 20, ..Written::default() };
    let path = folder.path().join("nodout");
    fs::write(&path, written.text()).unwrap();
    assert!(blocks(&path, None, &Selection::all()).unwrap().is_some(), "an even file");
    crumple_ok(folder.path(), "histories nodout -o a.h5 --units mm-t-s");
    let look = "import h5py\n\
        file = h5py.File('a.h5')\n\
        assert file['time'].attrs['units'] == 's'\n\
        for name in file:\n\
        \x20   data = file[name]\n\
        \x20   if isinstance(data, h5py.Group) or data.ndim < 2: continue\n\
        \x20   nodes = file['node_2' if name.startswith('r') else 'node']\n\
        \x20   ids = data.attrs['ids'] if 'ids' in data.attrs else file['ids'][name]\n\
        \x20   assert (nodes[:] == ids[:]).all() and len(nodes) == data.shape[1], name\n\
        assert file['x_velocity'].attrs['units'] == 'mm/s'\n\
        print(file['x_velocity'].shape[1], file['rx_velocity'].shape[1])\n";
    let output = python().args(["-c", look]).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8(output.stdout).unwrap().trim(), "9000 4500");
}

/// A state of each of some kinds, with the time, the cycle and a number to be filled in.
const KINDS: [(&str, &str); 6] = [
    (
        "rcforc",
        "  slave           2 time {t5}  x {a}  y {b}  z {a} mass {b}  mx {a}  my {b}  mz {a}\n  master          2 time {t5}  x {b}  y {a}  z {b} mass {a}  mx {b}  my {a}  mz {b}\n",
    ),
    (
        "elout",
        " e l e m e n t   s t r e s s   c a l c u l a t i o n s   f o r   t i m e  s t e p {cycle}   ( at time {t5} )\n\n element  materl\n     ipt  stress       sig-xx      sig-yy      sig-zz      sig-xy      sig-yz      sig-zx                       yield\n           state                                                                                  effsg      function\n      45-      1\n       1 {word} {a}{b}{a}{b}{a}{b}  {a}  {b}\n      47-      1\n       1 elastic {b}{a}{b}{a}{b}{a}  {b}  {a}\n",
    ),
    (
        "matsum",
        " time =   {t4}\n mat.#=   10             inten= {a}     kinen= {b}     eroded_ie= {a}     eroded_ke= {b}\n x-mom= {a}     y-mom= {b}     z-mom= {a}\n x-rbv= {b}     y-rbv= {a}     z-rbv= {b}\n                         hgeng= {a}\n\n",
    ),
    (
        "glstat",
        " dt of cycle {cycle} is controlled by {kind} {cycle} of part        10\n\n time...........................  {t5}\n time step......................  {a}\n kinetic energy.................  {b}\n hourglass energy ..............  {a}\n time per zone cycle.(nanosec)..      {cycle}\n\n",
    ),
    ("rwforc", " {t5}       1   {a}   {b}   {a}   {b}\n {t5}      12   {b}   {a}   {b}   {a}\n"),
    (
        "bndout",
        " n o d a l   f o r c e/e n e r g y    o u t p u t  t=   {t5}\n\n velocity boundary condition forces/rigid body moments \n\n nd#  200034  xforce= {a}   yforce= {b}  zforce= {a}   energy= {b}   setid =  200034\n nd#  200039  xforce= {b}   yforce= {a}  zforce= {b}   energy= {a}   setid =  200039\n              xtotal= {a}   ytotal= {b}  ztotal= {a}   etotal= {b}\n",
    ),
];

/// A file of a kind; `uneven`: with blank lines that no layout repeats.
fn of_kind(kind: &str, state: &str, states: usize, uneven: bool, damage: Option<usize>) -> String {
    let mut text =
        " title\n                    ls-dyna smp d R14 R14.0 date 12/12/2022\n".to_string();
    if kind == "rwforc" {
        text += "    time       wall#   normal-force    x-force        y-force        z-force\n";
    }
    let decimals = |value: f64, count: usize, width: usize| {
        let (mantissa, exponent) = fortran(format!("{value:.count$E}"));
        format!("{:>width$}", format!("{mantissa}{exponent}"))
    };
    for k in 0..states {
        let time = k as f64 * 1e-4;
        let number = |field| number(k, k % 7, field) / if field == 3 { 1e3 } else { 1.0 };
        let form = |field| match kind {
            "elout" | "matsum" | "bndout" => decimals(number(field), 4, 12),
            _ => decimals(number(field), 5, 12),
        };
        let body = state
            .replace("{t5}", &decimals(time, 5, 11))
            .replace("{t4}", &decimals(time, 4, 10))
            .replace("{cycle}", &format!("{k:8}"))
            .replace("{word}", if k % 5 == 0 { "plastic" } else { "elastic" })
            .replace("{kind}", if k % 4 == 0 { "shell" } else { "solid" })
            .replace("{a}", &form(3))
            .replace("{b}", &form(8));
        let body = match damage {
            Some(at) if k == states / 2 => {
                let at = at % (body.len() - 30);
                format!("{}{}{}", &body[..at], "*".repeat(9), &body[at + 9..])
            }
            _ => body,
        };
        text += &body;
        text += &"\n".repeat(if uneven { k % 2 + 1 + k % 3 } else { 2 });
    }
    text
}

/// Every kind of text, read by its layout and line by line; then with stars anywhere in one state, and cut anywhere.
#[test]
fn kinds_are_read_by_their_layout_as_line_by_line() {
    let read_as = |kind: &str, text: &str, selection: &Selection| {
        read_from(kind, &[Box::new(text.as_bytes().to_vec())], selection).unwrap().remove(0)
    };
    let problems = |file: &SolverFile| {
        file.problems.iter().map(|p| (p.code, p.columns, p.message.clone())).collect::<Vec<_>>()
    };
    for (kind, state) in KINDS {
        for selection in [Selection::all(), Selection::nothing()] {
            let even = of_kind(kind, state, 40, false, None);
            let read = read_as(kind, &even, &selection);
            assert_eq!(problems(&read), [], "{kind}");
            assert_eq!(read.time.len(), 40, "{kind}");
            let lines = read_as(kind, &of_kind(kind, state, 40, true, None), &selection);
            assert!(content(&read) == content(&lines), "{kind}");
            for at in (0..600).step_by(7) {
                let damaged = |uneven| of_kind(kind, state, 40, uneven, Some(at));
                let read = read_as(kind, &damaged(false), &selection);
                let lines = read_as(kind, &damaged(true), &selection);
                assert_eq!(problems(&read), problems(&lines), "{kind} {at}");
                assert!(content(&read) == content(&lines), "{kind} {at}");
            }
        }
        // What is there of a cut file is what is there of the whole one.
        let even = of_kind(kind, state, 12, false, None);
        for cut in (even.len() / 2..even.len()).step_by(3) {
            let read = read_as(kind, &even[..cut], &Selection::all());
            let whole = read_as(kind, &even, &Selection::all());
            for (a, b) in read.histories.iter().zip(&whole.histories) {
                assert_eq!(a.values, b.values[..read.time.len()], "{kind} {cut}");
            }
        }
    }
}
