//! The plug-ins for Python, Mitsuba 3 and Blender, with `SELVEDGE_HOST_TESTS=1`: installs them and what they
//! need from the Python registry into folders of their own, which takes a minute, and runs their tests, which
//! takes some more.

mod common;

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn hosts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("hosts")
}

/// What the command prints, if it ends well.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out.into_owned()
}

/// Whether to run; says so if not.
fn is_asked_for() -> bool {
    let is_set = env::var_os("SELVEDGE_HOST_TESTS").is_some();
    if !is_set {
        eprintln!("skipped: SELVEDGE_HOST_TESTS is not set");
    }
    is_set
}

/// The interpreter of an environment of this name with nothing in it.
fn environment(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    run(Command::new("python3").args(["-m", "venv"]).arg(&folder));
    folder.join("bin/python")
}

/// The program `selvedge`.
fn program() -> PathBuf {
    let mut build = Command::new(env!("CARGO"));
    run(build.args(["build", "--quiet", "--release", "-p", "selvedge"]));
    let target =
        Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is in the target folder");
    target.join("release/selvedge")
}

/// The interpreter of an environment with the hosts of Python.
fn python() -> PathBuf {
    let python = environment("hosts");
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "numpy", "mitsuba", "mypy"]);
    run(install.args(["python", "mitsuba3"].map(|host| hosts().join(host))));
    python
}

/// Prints, as bits, what the module gives where [`common::positions`] and [`common::DIRECTIONS`] are.
const BITS: &str = "
import sys, numpy as np, selvedge
shader = selvedge.Shader(selvedge.Fabric.load(sys.argv[1]))
step = np.arange(40.0)
uv = np.stack([1.1e-4 * step, 2.3e-4 * step - 1.0e-3], axis=-1)[:, None]
pairs = np.array([
    [[0, 0, 1], [0, 0, 1]], [[0.6, 0, 0.8], [0, 0.6, 0.8]], [[-0.48, 0.64, 0.6], [0.28, 0, 0.96]],
    [[0.6, 0, -0.8], [0, -0.6, -0.8]], [[0.6, 0, -0.8], [0, 0.6, 0.8]],
], dtype=np.float32)
f = shader.eval(uv, pairs[None, :, 0], pairs[None, :, 1])
for bits in f.reshape(-1, 3).view(np.uint32):
    print(*('%08x' % b for b in bits))
";

#[test]
fn hosts_give_the_values_of_rust_and_pass_their_tests() {
    if !is_asked_for() {
        return;
    }
    let python = python();
    let shader = common::shader("drafts/houndstooth.wif");
    let mut expected = String::new();
    for uv in common::positions() {
        for [wi, wo] in common::DIRECTIONS {
            let [r, g, b] = shader.eval(uv, wi, wo).to_array().map(f32::to_bits);
            expected += &format!("{r:08x} {g:08x} {b:08x}\n");
        }
    }
    let mut bits = Command::new(&python);
    let found = run(bits.args(["-c", BITS]).arg(common::fixture("drafts/houndstooth.wif")));
    assert_eq!(found, expected, "Python and Rust differ");

    // Elsewhere, so that what is installed is found and not the sources.
    let elsewhere = env!("CARGO_TARGET_TMPDIR");
    let mut tests = Command::new(&python);
    run(tests.arg(hosts().join("python/tests/test_selvedge.py")).current_dir(elsewhere));
    let mut types = Command::new(&python);
    run(types.args(["-m", "mypy", "selvedge"]).current_dir(hosts().join("python")));

    let program = program();
    for test in ["test_values.py", "test_chi2.py", "test_sheet.py"] {
        let mut command = Command::new(&python);
        command.arg(hosts().join("mitsuba3/tests").join(test));
        command.env("SELVEDGE_PROGRAM", &program);
        println!("{}", run(command.current_dir(elsewhere)));
    }
}

#[test]
fn blender_makes_a_material_of_baked_maps() {
    if !is_asked_for() {
        return;
    }
    let python = environment("blender");
    let mut install = Command::new(&python);
    let installed = install.args(["-m", "pip", "install", "--quiet", "bpy"]).output().unwrap();
    let reason = String::from_utf8_lossy(&installed.stderr);
    if reason.contains("No matching distribution") {
        eprintln!("skipped: there is no Blender for this Python");
        return;
    }
    assert!(installed.status.success(), "{reason}");
    let mut tests = Command::new(&python);
    tests.arg(hosts().join("blender/tests/test_blender.py")).env("SELVEDGE_PROGRAM", program());
    // Nothing else puts its files there: one of the tests looks for a file that must not be.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("blender");
    println!("{}", run(tests.current_dir(folder)));
}
