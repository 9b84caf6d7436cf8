//! A shader that is broken on purpose is caught, with the exit code for it.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::process::Command;

/// How `selvedge measure` ends with a fault.
fn exit_code(what: &str, fault: &str) -> Option<i32> {
    let place = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.current_dir(place.path()).args(["measure", what, "preset:duchesse-satin", "-q"]);
    command.args(["-o", "report", "--budget", "0.01"]);
    if !fault.is_empty() {
        command.args(["--fault", fault]);
    }
    command.output().unwrap().status.code()
}

#[test]
fn each_fault_is_caught_by_its_measure() {
    for (what, fault) in [("furnace", "phase"), ("chi2", "pdf"), ("stability", "grazing")] {
        assert_eq!(exit_code(what, ""), Some(0), "{what}");
        assert_eq!(exit_code(what, fault), Some(3), "{what} {fault}");
    }
}
