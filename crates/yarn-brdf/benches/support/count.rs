//! Instructions that a task takes, counted by running this program again under
//! `valgrind --tool=callgrind`: they are the same on a busy machine.

use std::process::Command;

/// The variable with the task of a run under valgrind.
const COUNT: &str = "SELVEDGE_COUNT";

/// What is to be run and counted, if this is such a run.
pub(crate) fn task() -> Option<String> {
    std::env::var(COUNT).ok()
}

/// Instructions of a run of `task`, or in it of the functions alone whose names are like `inside`, as in
/// `*name*`; `None` where there is no valgrind, or one that does not know them.
pub(crate) fn instructions(task: &str, inside: Option<&str>) -> Option<u64> {
    let program = std::env::current_exe().ok()?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args(inside.map(|name| format!("--toggle-collect={name}")))
        .arg(program)
        .env(COUNT, task)
        .output()
        .ok()?;
    let report = String::from_utf8_lossy(&output.stderr).into_owned();
    let collected = report.lines().find_map(|line| line.split("Collected : ").nth(1))?;
    collected.trim().parse().ok()
}
