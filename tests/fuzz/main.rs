//! The fuzzer: one program for all targets; CRUMPLE_FUZZ_TARGET names the one that is run, and "list" prints
//! them all.
#![no_main]

mod deck;
mod files;
mod model;
mod reader;
mod scenario;
mod study;

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

/// Formats of solver files, which are one target each.
const FORMATS: &[&str] = &[
    "nodout", "rcforc", "rwforc", "secforc", "glstat", "matsum", "spcforc", "bndout", "sleout",
    "swforc", "abstat", "curvout", "deforc", "jntforc", "rbdout", "nodfor", "eloutdet", "elout",
    "binout", "t01",
];

/// Any bytes give a result, or an error that says where.
type Target = fn(&[u8]);

const OTHERS: &[(&str, Target)] = &[
    ("deck", deck::target),
    ("study", study::target),
    ("model", model::target),
    ("scenario", scenario::target),
    ("curve", files::curve),
    ("database", files::database),
    ("plan", files::plan),
    ("results", files::results),
];

static CHOSEN: OnceLock<Box<dyn Fn(&[u8]) + Send + Sync>> = OnceLock::new();

fn choose() {
    let name = std::env::var("CRUMPLE_FUZZ_TARGET").expect("CRUMPLE_FUZZ_TARGET names a target");
    if name == "list" {
        let others = OTHERS.iter().map(|(name, _)| name);
        FORMATS.iter().chain(others).for_each(|name| println!("{name}"));
        std::process::exit(0);
    }
    let format = FORMATS.iter().find(|format| **format == name);
    let other = OTHERS.iter().find(|(other, _)| *other == name);
    let chosen: Box<dyn Fn(&[u8]) + Send + Sync> = match (format, other) {
        (Some(format), _) => Box::new(|bytes| reader::target(format, bytes)),
        (None, Some((_, target))) => Box::new(target),
        (None, None) => panic!("no target {name}"),
    };
    let _ = CHOSEN.set(chosen);
}

fuzz_target!(init: choose(), |bytes: &[u8]| {
    CHOSEN.get().expect("init has run")(bytes)
});
