//! C and C++ programs of `tests/c`, compiled without a warning and run.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

#[derive(Debug, Clone, Copy)]
pub(crate) enum Linkage {
    Static,
    Shared,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Compiler {
    /// The one that Rust links with, so that it is there; `CC` and `CXX` name another.
    Cc,
    Gcc,
    Clang,
}

impl Compiler {
    fn command(self, is_cpp: bool) -> Command {
        let [variable, c, cpp] = match self {
            Self::Cc => ["C", "cc", "c++"],
            Self::Gcc => ["", "gcc", "g++"],
            Self::Clang => ["", "clang", "clang++"],
        };
        let name = if is_cpp { cpp } else { c };
        let own = match (variable, is_cpp) {
            ("", _) => None,
            (_, true) => env::var_os("CXX"),
            (_, false) => env::var_os("CC"),
        };
        Command::new(own.unwrap_or_else(|| name.into()))
    }

    pub(crate) fn is_there(self) -> bool {
        answers(&mut self.command(false)) && answers(&mut self.command(true))
    }
}

/// Whether a program of this name answers to `--version`.
pub(crate) fn is_there(name: &str) -> bool {
    answers(&mut Command::new(name))
}

fn answers(command: &mut Command) -> bool {
    let run = command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.is_ok_and(|status| status.success())
}

/// A program, whose folder is gone when it is dropped.
#[derive(Debug)]
pub(crate) struct Program {
    _folder: TempDir,
    path: PathBuf,
}

/// A file of this package.
pub(crate) fn package(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The folder with the libraries.
pub(crate) fn libraries() -> PathBuf {
    let this = env::current_exe().expect("this program has a path");
    this.parent().expect("a program is in a folder").to_owned()
}

impl Program {
    /// Compiles `tests/c/SOURCE`, or the file at an absolute path.
    pub(crate) fn compile(
        source: &str,
        compiler: Compiler,
        linkage: Linkage,
        options: &[&str],
    ) -> Self {
        let folder = TempDir::new().expect("there is room for a file");
        let path = folder.path().join("program");
        let libraries = libraries();
        let is_cpp = source.ends_with(".cpp");
        let mut command = compiler.command(is_cpp);
        command.arg(if is_cpp { "-std=c++17" } else { "-std=c11" });
        command.args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]).arg(package("include"));
        command.args(options).arg(package("tests/c").join(source));
        match linkage {
            Linkage::Static => command.arg(libraries.join("libselvedge.a")),
            Linkage::Shared => command
                .arg(libraries.join(format!("libselvedge{}", env::consts::DLL_SUFFIX)))
                .arg(format!("-Wl,-rpath,{}", libraries.display())),
        };
        command.args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&path);
        let compiled = command.output().expect("a compiler starts");
        let errors = String::from_utf8_lossy(&compiled.stderr);
        assert!(compiled.status.success(), "{command:?}\n{errors}");
        Self { _folder: folder, path }
    }

    /// Runs it with `arguments`, by the program and options `under`, if any.
    pub(crate) fn run(&self, under: &[&str], arguments: &[&Path]) -> Output {
        let mut command = match under {
            [] => Command::new(&self.path),
            [program, options @ ..] => {
                let mut command = Command::new(program);
                command.args(options).arg(&self.path);
                command
            }
        };
        command.args(arguments).output().expect("what was compiled starts")
    }

    /// What it printed, if it ended well and had nothing to say on standard error.
    pub(crate) fn stdout(&self, arguments: &[&Path]) -> String {
        let output = self.run(&[], arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && stderr.is_empty(), "{}: {stderr}", output.status);
        String::from_utf8(output.stdout).expect("the program prints ASCII")
    }
}
