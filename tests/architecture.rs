//! What the compiler cannot hold: who touches files, who prints, where unsafe code may stand, and
//! that the map in ARCHITECTURE.md is that of the Cargo.toml files. The code is parsed.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "architecture/circles.rs"]
mod circles;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};

/// Where files may be touched, besides the command line.
const FILES: &[&str] = &[
    "crates/data/src/storage/",
    "crates/data/src/sequence/",
    "crates/data/src/packed/",
    "crates/devices/src/link/",
    "crates/devices/src/camera/v4l2/discover.rs",
    "crates/devices/src/camera/v4l2/kernel/",
    "crates/photographs/src/files.rs",
    "src/bands/folder.rs",
    "src/calibrate/folder.rs",
    "src/memory.rs",
    "src/results/",
    "src/cli/",
];

/// Where something may be printed.
const PRINTS: &[&str] = &["src/cli/"];

/// The only places with unsafe code.
const UNSAFE: &[&str] = &["crates/devices/src/camera/v4l2/kernel/", "src/cli/memory.rs"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A file of the library or the program, without its tests.
struct Source {
    place: String,
    code: syn::File,
    text: String,
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The crates of ours: all but the kernel's header in Rust, which is generated.
fn crates() -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(root().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "v4l2-sys-mit")
        .collect();
    names.sort();
    names
}

fn is_test_file(path: &Path) -> bool {
    let is_test = |name: &str| name == "tests" || name.ends_with("tests.rs") || name == "scenes.rs";
    path.iter().any(|name| is_test(&name.to_string_lossy()))
}

fn sources() -> Vec<Source> {
    let mut files = Vec::new();
    rust_files(&root().join("src"), &mut files);
    crates().iter().for_each(|name| rust_files(&root().join("crates").join(name).join("src"), &mut files));
    let inside = files.into_iter().map(|path| path.strip_prefix(root()).unwrap().to_owned());
    inside
        .filter(|path| !is_test_file(path))
        .map(|path| {
            let text = fs::read_to_string(root().join(&path)).unwrap();
            let mut code = syn::parse_file(&text).unwrap();
            code.items.retain(|item| !is_for_tests(item));
            Source { place: path.to_str().unwrap().to_owned(), code, text }
        })
        .collect()
}

fn is_for_tests(item: &syn::Item) -> bool {
    let attributes = match item {
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|condition| condition.is_ident("test"))
    })
}

/// What a file does that not every file may do.
#[derive(Default)]
struct Deeds {
    /// Paths that are named, such as `std::fs::read`.
    paths: BTreeSet<String>,
    macros: BTreeSet<String>,
    /// Lines at which unsafe blocks, functions and implementations begin.
    unsafe_lines: Vec<usize>,
}

fn names(path: &syn::Path) -> String {
    let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
    names.join("::")
}

impl Deeds {
    fn take_use(&mut self, before: &str, tree: &syn::UseTree) {
        let join = |name: &syn::Ident| {
            if before.is_empty() { name.to_string() } else { format!("{before}::{name}") }
        };
        match tree {
            syn::UseTree::Path(path) => self.take_use(&join(&path.ident), &path.tree),
            syn::UseTree::Name(name) => drop(self.paths.insert(join(&name.ident))),
            syn::UseTree::Rename(rename) => drop(self.paths.insert(join(&rename.ident))),
            syn::UseTree::Glob(_) => drop(self.paths.insert(format!("{before}::*"))),
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.take_use(before, tree)),
        }
    }
}

impl<'a> Visit<'a> for Deeds {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.take_use("", &item.tree);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.paths.insert(names(path));
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.macros.insert(names(&call.path));
        visit::visit_macro(self, call);
    }

    fn visit_expr_unsafe(&mut self, block: &'a syn::ExprUnsafe) {
        self.unsafe_lines.push(block.unsafe_token.span.start().line);
        visit::visit_expr_unsafe(self, block);
    }

    fn visit_item_impl(&mut self, item: &'a syn::ItemImpl) {
        self.unsafe_lines.extend(item.unsafety.as_ref().map(|token| token.span().start().line));
        visit::visit_item_impl(self, item);
    }

    fn visit_signature(&mut self, signature: &'a syn::Signature) {
        self.unsafe_lines.extend(signature.unsafety.as_ref().map(|token| token.span().start().line));
        visit::visit_signature(self, signature);
    }
}

fn deeds(source: &Source) -> Deeds {
    let mut deeds = Deeds::default();
    deeds.visit_file(&source.code);
    deeds
}

fn may(place: &str, allowed: &[&str]) -> bool {
    allowed.iter().any(|allowed| place.starts_with(allowed))
}

#[test]
fn only_some_rooms_touch_files_print_or_end_the_program() {
    let mut touching = 0;
    for source in sources() {
        let deeds = deeds(&source);
        let named = |start: &str| {
            deeds.paths.iter().find(|path| *path == start || path.starts_with(&format!("{start}::"))).cloned()
        };
        let files = ["std::fs", "fs::File", "File::open", "File::create", "rustix::fs", "tempfile", "fs4"];
        if let Some(path) = files.into_iter().find_map(named) {
            touching += 1;
            assert!(may(&source.place, FILES), "{}: touches files ({path})", source.place);
        }
        for name in ["println", "eprintln", "print", "eprint", "dbg"] {
            let prints = deeds.macros.contains(name);
            assert!(!prints || may(&source.place, PRINTS), "{}: prints ({name}!)", source.place);
        }
        // Who listens to events, and where they are written, is the choice of the program.
        for start in ["clap", "indicatif", "tracing_subscriber", "std::process::exit", "process::exit"] {
            let found = named(start).filter(|_| !may(&source.place, PRINTS));
            assert!(found.is_none(), "{}: {start} belongs to the command line", source.place);
        }
    }
    assert!(touching >= 15, "the search has gone blind: {touching} files");
}

#[test]
fn unsafe_code_is_in_two_places_and_says_why_it_is_sound() {
    let mut found = 0;
    for source in sources() {
        let lines = deeds(&source).unsafe_lines;
        assert!(lines.is_empty() || may(&source.place, UNSAFE), "{}: unsafe code", source.place);
        let said = source.text.matches("SAFETY:").count() + source.text.matches("# Safety").count();
        assert!(said >= lines.len(), "{}: unsafe code that does not say why it is sound", source.place);
        found += lines.len();
    }
    assert!(found >= 10, "the search has gone blind: {found} places");
}

/// The crates of ours that each crate depends on, as its Cargo.toml says.
fn arrows() -> BTreeMap<String, BTreeSet<String>> {
    let own = |path: PathBuf| -> BTreeSet<String> {
        let text = fs::read_to_string(path).unwrap();
        let lines = text.lines().skip_while(|line| *line != "[dependencies]").skip(1);
        let names = lines.take_while(|line| !line.starts_with('[')).filter_map(|line| {
            let name = line.split(['.', ' ']).next()?;
            (name.starts_with("epirig-") || name == "firmware-protocol").then(|| name.to_owned())
        });
        names.collect()
    };
    let mut all: BTreeMap<_, _> = crates()
        .into_iter()
        .map(|name| (format!("epirig-{name}"), own(root().join("crates").join(&name).join("Cargo.toml"))))
        .collect();
    all.insert("epirig".to_owned(), own(root().join("Cargo.toml")));
    all
}

#[test]
fn the_map_in_architecture_md_is_that_of_the_crates() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for (name, uses) in arrows() {
        let row = text.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        let row = row.unwrap_or_else(|| panic!("ARCHITECTURE.md has no row for {name}"));
        let told: BTreeSet<String> =
            row.split('|').nth(2).unwrap().split('`').skip(1).step_by(2).map(str::to_owned).collect();
        let told: BTreeSet<String> = told
            .into_iter()
            .map(|name| if name == "firmware-protocol" { name } else { format!("epirig-{name}") })
            .collect();
        assert_eq!(told, uses, "the row of {name}");
    }
}

#[test]
fn each_crate_has_a_readme_that_is_its_documentation_and_an_example() {
    for name in crates() {
        let folder = root().join("crates").join(&name);
        let readme = fs::read_to_string(folder.join("README.md")).unwrap();
        assert!(readme.len() > 200, "{name}: README.md says little");
        let lib = fs::read_to_string(folder.join("src/lib.rs")).unwrap();
        assert!(
            lib.contains("#![doc = include_str!(\"../README.md\")]"),
            "{name}: README.md is not its docs"
        );
        assert!(folder.join("examples").read_dir().unwrap().next().is_some(), "{name}: no example");
    }
}
