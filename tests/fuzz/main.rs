//! The fuzzer: one program for all targets; CRUMPLE_FUZZ_TARGET names the one that is run, and "list" prints
//! them all.
#![no_main]

mod targets;

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

static CHOSEN: OnceLock<targets::Target> = OnceLock::new();

fn choose() {
    let name = std::env::var("CRUMPLE_FUZZ_TARGET").expect("CRUMPLE_FUZZ_TARGET names a target");
    if name == "list" {
        targets::names().for_each(|name| println!("{name}"));
        std::process::exit(0);
    }
    let _ = CHOSEN.set(targets::target(&name).unwrap_or_else(|| panic!("no target {name}")));
}

fuzz_target!(init: choose(), |bytes: &[u8]| {
    CHOSEN.get().expect("init has run")(bytes)
});
