//! The interface is the one that `abi.txt` lists: its functions, the sizes of its structs, where their
//! fields are, and its codes, as a C compiler sees them; and nothing else is exported.
//!
//! A line that is gone or differs breaks programs that were compiled before, and takes a new generation
//! of `SELVEDGE_ABI_VERSION`; a line more takes one more addition. `BLESS=1` rewrites the list.
#![cfg(target_pointer_width = "64")]

use std::collections::BTreeSet;
use std::process::Command;
use std::{env, fs};

use crate::programs::{self, Compiler, Linkage, Program, libraries, package};
use tempfile::TempDir;

/// The header without its comments.
fn header() -> String {
    let text = fs::read_to_string(package("include/selvedge.h")).expect("the header is there");
    let mut code = String::new();
    let mut rest = text.as_str();
    while let Some((before, after)) = rest.split_once("/*") {
        code += before;
        rest = after.split_once("*/").expect("every comment ends").1;
    }
    code + rest
}

/// Each function, `name: result(arguments)`.
fn functions(header: &str) -> Vec<String> {
    let starts_function = |line: &&str| line.contains("selvedge_") && line.contains('(');
    let is_typedef = |line: &str| line.starts_with("typedef") || line.starts_with(['#', ' ']);
    let mut found = Vec::new();
    let mut lines = header.lines();
    while let Some(line) = lines.by_ref().find(|line| starts_function(line) && !is_typedef(line)) {
        let mut declaration = line.to_owned();
        while !declaration.ends_with(");") {
            declaration += lines.next().expect("every declaration ends");
        }
        let words: Vec<_> = declaration.split_whitespace().collect();
        let (before, arguments) = words
            .join(" ")
            .split_once('(')
            .map(|(b, a)| (b.to_owned(), a.to_owned()))
            .expect("a function has arguments");
        let start = before.rfind([' ', '*']).map_or(0, |at| at + 1);
        let (result, name) = before.split_at(start);
        found.push(format!("{name}: {}({}", result.trim(), arguments.trim_end_matches(';')));
    }
    found
}

/// A C program that prints the sizes, offsets and codes of the header.
fn printing(header: &str) -> String {
    let mut prints =
        String::from("P(\"SELVEDGE_ABI_VERSION >> 16\", SELVEDGE_ABI_VERSION >> 16);\n");
    let mut lines = header.lines();
    while let Some(line) = lines.next() {
        if let Some(name) = line.strip_prefix("typedef struct ").and_then(|l| l.strip_suffix(" {"))
        {
            prints += &format!("P(\"sizeof {name}\", sizeof({name}));\n");
            for field in lines.by_ref().take_while(|line| !line.starts_with('}')) {
                let Some(field) = field.trim().strip_suffix(';') else { continue };
                let field = field.split('[').next().unwrap_or(field);
                let field = field.rsplit([' ', '*']).next().unwrap_or(field);
                prints += &format!("P(\"{name}.{field}\", offsetof({name}, {field}));\n");
            }
        } else if let Some((code, _)) = line.trim().split_once(" = ") {
            prints += &format!("P(\"{code}\", {code});\n");
        }
    }
    format!(
        "#include <stdio.h>\n#include \"selvedge.h\"\n\
         #define P(name, value) printf(\"%s %lu\\n\", name, (unsigned long)(value))\n\
         int main(void)\n{{\n{prints}return 0;\n}}\n"
    )
}

#[test]
fn the_interface_is_as_listed() {
    let header = header();
    let folder = TempDir::new().unwrap();
    let source = folder.path().join("print.c");
    fs::write(&source, printing(&header)).unwrap();
    let path = source.to_str().expect("a temporary folder has a name in UTF-8");
    let program = Program::compile(path, Compiler::Cc, Linkage::Static, &[]);
    let found = format!("{}\n{}", functions(&header).join("\n"), program.stdout(&[]));
    let path = package("abi.txt");
    if env::var_os("BLESS").is_some() {
        fs::write(&path, &found).unwrap();
    }
    let listed = fs::read_to_string(&path).unwrap_or_default();
    let [old, new] = [&listed, &found].map(|text| text.lines().collect::<BTreeSet<_>>());
    let gone: Vec<_> = old.difference(&new).collect();
    let added: Vec<_> = new.difference(&old).collect();
    assert!(gone.is_empty(), "gone or changed: {gone:#?}\nadded: {added:#?}");
    assert!(added.is_empty(), "not listed: {added:#?}");
}

#[test]
fn nothing_but_the_interface_is_exported() {
    if !cfg!(target_os = "linux") || !programs::is_there("nm") {
        eprintln!("skipped: there is no nm that lists the dynamic symbols of Linux");
        return;
    }
    let library = libraries().join("libselvedge.so");
    let output = Command::new("nm").args(["-D", "--defined-only"]).arg(library).output().unwrap();
    assert!(output.status.success());
    let output = String::from_utf8(output.stdout).unwrap();
    let exported: BTreeSet<_> = output.lines().filter_map(|line| line.split(' ').nth(2)).collect();
    let declared = functions(&header());
    let declared: BTreeSet<_> = declared.iter().filter_map(|line| line.split(':').next()).collect();
    assert_eq!(exported, declared);
}
