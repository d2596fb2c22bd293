//! Curve of a Modelica package that `crumple export` wrote: its constants `d` and `f`, in SI.
//!
//! Comments `// key: value` before the package give force, speed, mass and unloading. The package keeps at most
//! 200 points of a curve.

use super::Input;
use super::columns::{Columns, Places, check_curves, check_points, choose};
use super::curve::{CUT, Metadata, Place, miscounted, shown, title, value};
use super::encoding::lines;
use crate::error::{Error, error};
use crate::unit::UnitSystem;

pub(super) fn recognise(input: &Input<'_>) -> bool {
    let has_name = input.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mo"));
    has_name
        || lines(input.beginning()).any(|(_, line)| line.trim().starts_with("constant Real d["))
}

pub(super) fn read(input: &Input<'_>) -> Result<Columns, Error> {
    let packages = packages(input.text)?;
    if packages.is_empty() {
        return Err(error!(
            CurveFile,
            "expected a package that crumple export wrote (constant Real d[…], f[…]), found none: write other curves as a table text (#1, double name(n,2)), CSV or MAT file"
        ));
    }
    let names = packages.iter().map(|package| (package.name.clone(), String::new()));
    let package = &packages[choose(names, input.options.curve.as_deref())?];
    for array in [&package.d, &package.f] {
        array.check()?;
    }
    if package.d.values.len() != package.f.values.len() {
        return Err(miscounted(
            Place::Line(package.f.line),
            "constant f",
            format_args!("{} forces", package.f.values.len()),
            format_args!("{} deflections", package.d.values.len()),
            "write the file anew",
        ));
    }
    let mut notes = vec![
        format!("curve: constants d and f of package {}, SI", shown(&package.name)),
        "points: a package keeps at most 200 of a curve".into(),
    ];
    Ok(Columns {
        deflection_m: package.d.values.clone(),
        force_n: package.f.values.clone(),
        facts: package.facts,
        title: title(&package.name, &mut notes),
        units: Some(UnitSystem::SI),
        notes,
        ..Columns::at(Places::Rows)
    })
}

/// An array of numbers.
#[derive(Clone, Debug, Default)]
struct Array {
    line: u64,
    name: &'static str,
    declared: usize,
    values: Vec<f64>,
    is_closed: bool,
}

impl Array {
    fn check(&self) -> Result<(), Error> {
        if self.is_closed && self.values.len() == self.declared {
            return Ok(());
        }
        let what = format_args!("constant {}", self.name);
        let declared = format_args!("{} values", self.declared);
        Err(miscounted(Place::Line(self.line), what, declared, self.values.len(), CUT))
    }
}

/// A package with its table.
#[derive(Clone, Debug, Default)]
struct Package {
    name: String,
    facts: Metadata,
    d: Array,
    f: Array,
}

/// The packages that hold a table.
fn packages(text: &str) -> Result<Vec<Package>, Error> {
    let (mut packages, mut facts) = (Vec::<Package>::new(), Metadata::default());
    // The array that continues in the next line.
    let mut open: Option<&'static str> = None;
    for (at, line) in lines(text) {
        let line = line.trim();
        if let Some(comment) = line.strip_prefix("//") {
            facts.take("//", comment, Place::Line(at))?;
            continue;
        }
        if let Some(name) = line.strip_prefix("package ") {
            let name = name.split_whitespace().next().unwrap_or_default().to_string();
            packages.push(Package { name, facts, ..Package::default() });
            check_curves(packages.len())?;
            open = None;
            continue;
        }
        let Some(package) = packages.last_mut() else { continue };
        let (name, rest) = match (declaration(line), open) {
            (Some((name, declared, rest)), _) => {
                *package.array(name) = Array { line: at, name, declared, ..Array::default() };
                (name, rest)
            }
            (None, Some(name)) => (name, line),
            (None, None) => continue,
        };
        let array = package.array(name);
        array.take(rest, at)?;
        open = (!array.is_closed).then_some(name);
    }
    packages.retain(|package| package.d.line > 0 && package.f.line > 0);
    Ok(packages)
}

/// Name, size and what follows the brace, if the line begins one of the two arrays.
fn declaration(line: &str) -> Option<(&'static str, usize, &str)> {
    let rest = line.strip_prefix("constant Real ")?;
    let name = ["d", "f"].into_iter().find(|name| rest.starts_with(&format!("{name}[")))?;
    let (size, values) = rest[2..].split_once(']')?;
    Some((name, size.trim().parse().ok()?, values.split_once('{')?.1))
}

impl Package {
    fn array(&mut self, name: &str) -> &mut Array {
        if name == "d" { &mut self.d } else { &mut self.f }
    }
}

impl Array {
    /// Takes the numbers of a line, up to the closing brace.
    fn take(&mut self, text: &str, line: u64) -> Result<(), Error> {
        let (text, is_closed) = match text.split_once('}') {
            Some((text, _)) => (text, true),
            None => (text, false),
        };
        for (field, word) in text.split(',').enumerate().filter(|(_, word)| !word.trim().is_empty())
        {
            let place = Place::Field { line, field: field + 1 };
            self.values.push(value(place, word)?);
            check_points(self.values.len())?;
        }
        self.is_closed = is_closed;
        Ok(())
    }
}
