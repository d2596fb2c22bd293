//! The Slurm example, really run on this machine: see `tests/slurm/one_machine`.

use std::process::Command;

use crate::common::root;

/// A job array of 1, 2 and 3 shards and its merge give the bytes of a run without shards.
#[test]
#[ignore = "needs Slurm (slurm-wlm) and root"]
fn a_job_array_gives_the_bytes_of_one_run() {
    let output = Command::new(root().join("tests/slurm/one_machine"))
        .arg(env!("CARGO_BIN_EXE_crumple"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}\n{error}");
    assert_eq!(said.matches(": the same bytes").count(), 3, "{said}");
}
