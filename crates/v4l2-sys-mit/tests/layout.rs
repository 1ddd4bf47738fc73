//! The bindings beside the kernel's header: the size of every structure, the place and size of each field,
//! and each number, as a C compiler and `rustc` have them.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::process::Command;

const BINDINGS: &str = include_str!("../src/bindings.rs");

/// A fact of the header: its name, how C says it, and how Rust says it.
struct Fact {
    name: String,
    c: String,
    rust: String,
}

impl Fact {
    /// Its word in the header: the name of a structure, a field or a number.
    fn word(&self) -> &str {
        self.name.rsplit('.').next().unwrap_or_default()
    }
}

/// The facts of `src/bindings.rs`. Unions without a name in C are compared as fields of the structures
/// around them.
fn facts() -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut structure = None;
    for line in BINDINGS.lines() {
        if let Some(name) = line.strip_prefix("pub struct ").and_then(|rest| rest.strip_suffix(" {")) {
            structure = Some(name).filter(|name| !name.contains("__"));
            let sizes = structure.map(|name| Fact {
                name: name.to_owned(),
                c: format!("sizeof(struct {name})"),
                rust: format!("size_of::<{name}>()"),
            });
            facts.extend(sizes);
        } else if line == "}" {
            structure = None;
        } else if let Some((structure, (field, kind))) = structure.zip(field_of(line)) {
            let in_c = c_name(field);
            facts.push(Fact {
                name: format!("place:{structure}.{in_c}"),
                c: format!("offsetof(struct {structure}, {in_c})"),
                rust: format!("offset_of!({structure}, {field})"),
            });
            facts.push(Fact {
                name: format!("size:{structure}.{in_c}"),
                c: format!("sizeof(((struct {structure} *)0)->{in_c})"),
                rust: format!("size_of::<{kind}>()"),
            });
        } else if let Some((name, kind)) =
            line.strip_prefix("pub const ").and_then(|rest| rest.split_once(": "))
        {
            // Enumerators have the name of their enumeration before their own.
            let kind = kind.split(" =").next().unwrap_or_default();
            // Texts are of no call.
            if kind.starts_with('&') {
                continue;
            }
            let own = name.strip_prefix(kind).and_then(|rest| rest.strip_prefix('_')).unwrap_or(name);
            facts.push(Fact { name: own.to_owned(), c: own.to_owned(), rust: name.to_owned() });
        }
    }
    facts
}

/// Name and type of a field that has a name in C.
fn field_of(line: &str) -> Option<(&str, &str)> {
    let field = line.strip_prefix("    pub ")?.strip_suffix(',')?.split_once(": ")?;
    (!field.0.contains("bindgen")).then_some(field)
}

/// Rust's keywords have an underscore behind them.
fn c_name(field: &str) -> &str {
    field.strip_suffix('_').unwrap_or(field)
}

fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if output.status.success() { Ok(text) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

/// Compiles `source` with `compiler`, runs the program, and reads its lines `name value`.
fn ask(compiler: &mut Command, source: &Path, text: &str) -> BTreeMap<String, i128> {
    std::fs::write(source, text).expect("a scratch file");
    let program: PathBuf = source.with_extension("program");
    run(compiler.arg(source).arg("-o").arg(&program)).expect("the program compiles");
    let told = run(&mut Command::new(&program)).expect("the program runs");
    let parse = |line: &str| {
        let (name, value) = line.split_once(' ').expect("a name and a value");
        (name.to_owned(), value.parse().expect("a number"))
    };
    told.lines().map(parse).collect()
}

#[test]
fn the_bindings_are_those_of_the_kernels_header() {
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let probe = scratch.path().join("header.c");
    std::fs::write(&probe, "#include <stddef.h>\n#include <stdio.h>\n#include <linux/videodev2.h>\n")
        .expect("a scratch file");
    let compiler = || Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()));
    // Its text, with macros: a header that is older than the bindings lacks some names.
    let header = match run(compiler().args(["-E", "-dD"]).arg(&probe)) {
        Ok(header) => header,
        Err(reason) => {
            println!("SKIPPED: no C compiler with linux/videodev2.h: {reason}");
            return;
        }
    };
    let words: HashSet<&str> =
        header.split(|character: char| !(character.is_alphanumeric() || character == '_')).collect();
    let (facts, unknown): (Vec<Fact>, Vec<Fact>) =
        facts().into_iter().partition(|fact| words.contains(fact.word()));

    let lines = |line: &dyn Fn(&Fact) -> String| facts.iter().map(line).collect::<String>();
    let c = format!(
        "#include <stddef.h>\n#include <stdio.h>\n#include <linux/videodev2.h>\nint main(void) {{\n{}return 0;\n}}\n",
        lines(&|fact| format!("printf(\"{} %lld\\n\", (long long)({}));\n", fact.name, fact.c)),
    );
    let rust = format!(
        "#![allow(warnings)]\nuse std::mem::{{offset_of, size_of}};\ninclude!({:?});\nfn main() {{\n{}}}\n",
        Path::new(env!("CARGO_MANIFEST_DIR")).join("src/bindings.rs"),
        lines(&|fact| format!("println!(\"{} {{}}\", ({}) as i64);\n", fact.name, fact.rust)),
    );
    let in_c = ask(&mut compiler(), &scratch.path().join("layout.c"), &c);
    let in_rust =
        ask(Command::new("rustc").args(["--edition", "2024"]), &scratch.path().join("layout.rs"), &rust);

    assert_eq!(in_c, in_rust);
    // A reader of the bindings that finds nothing would agree with everything.
    for name in [
        "v4l2_buffer",
        "place:v4l2_buffer.m",
        "size:v4l2_ext_controls.controls",
        "V4L2_BUF_TYPE_VIDEO_CAPTURE",
    ] {
        assert!(in_c.contains_key(name), "{name} was not compared");
    }
    println!(
        "{} facts agree; the header knows no {:?}",
        in_c.len(),
        unknown.iter().map(Fact::word).collect::<Vec<_>>()
    );
}
