//! Circles of files inside a crate, found from the paths that the code names.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

use super::{crates, is_for_tests, is_test_file, root};

/// Circles that are known: all files of each begin with one of these. A completion script describes the command line
/// that it is a verb of.
const KNOWN: &[&str] = &["src/cli/"];

/// A path as the code writes it.
type Segments = Vec<String>;

/// One file of a crate.
#[derive(Default)]
struct File {
    place: String,
    parent: Option<usize>,
    /// Files of the modules declared here; several if a feature chooses among them.
    children: BTreeMap<String, Vec<usize>>,
    /// Names of the items that stand here.
    items: BTreeSet<String>,
    /// What each imported or re-exported name stands for.
    aliases: BTreeMap<String, Vec<Segments>>,
    /// Modules of which everything is imported.
    globs: Vec<Segments>,
    /// Paths that the file's own code names, and what it imports privately.
    named: BTreeSet<Segments>,
}

/// Collects what a file defines and names. Modules written out inside a file belong to the file.
struct Reader<'a> {
    file: &'a mut File,
    /// Modules declared here: name and the path given by an attribute.
    modules: Vec<(String, Option<String>)>,
    /// Number of written-out modules around the present place: each takes one `super` away.
    depth: usize,
}

impl Reader<'_> {
    fn segments(&self, path: &syn::Path) -> Segments {
        let names = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.out_of_inner_modules(names)
    }

    fn out_of_inner_modules(&self, names: Segments) -> Segments {
        let supers = names.iter().take_while(|name| *name == "super").count().min(self.depth);
        let mut rest = names[supers..].to_vec();
        if supers > 0 {
            rest.insert(0, "self".to_owned());
        }
        rest
    }

    fn take_use(&mut self, before: &[String], tree: &syn::UseTree, private: bool) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.take_use(&with(&path.ident), &path.tree, private),
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.take_use(before, tree, private));
            }
            syn::UseTree::Glob(_) => {
                let module = self.out_of_inner_modules(before.to_vec());
                // The variants of an enumeration may be meant, too.
                self.file.named.insert(module.clone());
                self.file.globs.push(module);
            }
            syn::UseTree::Name(name) if name.ident == "self" => {
                self.import(before.last().unwrap().clone(), before.to_vec(), private);
            }
            syn::UseTree::Name(name) => self.import(name.ident.to_string(), with(&name.ident), private),
            syn::UseTree::Rename(rename) => {
                self.import(rename.rename.to_string(), with(&rename.ident), private);
            }
        }
    }

    fn import(&mut self, name: String, path: Segments, private: bool) {
        let path = self.out_of_inner_modules(path);
        if private {
            self.file.named.insert(path.clone());
        }
        self.file.aliases.entry(name).or_default().push(path);
    }

    /// Paths in the arguments of a macro, which are not parsed.
    fn take_tokens(&mut self, tokens: TokenStream) {
        let mut path = Segments::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.name(std::mem::take(&mut path));
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                other => {
                    self.name(std::mem::take(&mut path));
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.take_tokens(group.stream());
                    }
                }
            }
        }
        self.name(path);
    }

    fn name(&mut self, path: Segments) {
        if !path.is_empty() {
            let path = self.out_of_inner_modules(path);
            self.file.named.insert(path);
        }
    }
}

impl<'a> Visit<'a> for Reader<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if is_for_tests(item) {
            return;
        }
        let name = match item {
            syn::Item::Const(item) => Some(&item.ident),
            syn::Item::Enum(item) => Some(&item.ident),
            syn::Item::Fn(item) => Some(&item.sig.ident),
            syn::Item::Macro(item) => item.ident.as_ref(),
            syn::Item::Static(item) => Some(&item.ident),
            syn::Item::Struct(item) => Some(&item.ident),
            syn::Item::Trait(item) => Some(&item.ident),
            syn::Item::Type(item) => Some(&item.ident),
            syn::Item::Union(item) => Some(&item.ident),
            _ => None,
        };
        self.file.items.extend(name.map(ToString::to_string));
        visit::visit_item(self, item);
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if item.content.is_none() {
            let path = item.attrs.iter().find(|attribute| attribute.path().is_ident("path"));
            let path = path.map(|attribute| match &attribute.meta.require_name_value().unwrap().value {
                syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. }) => path.value(),
                _ => panic!("{}: a module's path is no text", self.file.place),
            });
            self.modules.push((item.ident.to_string(), path));
        } else {
            self.file.items.insert(item.ident.to_string());
            self.depth += 1;
            visit::visit_item_mod(self, item);
            self.depth -= 1;
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let private = matches!(item.vis, syn::Visibility::Inherited);
        self.take_use(&[], &item.tree, private);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let path_segments = self.segments(path);
        self.file.named.insert(path_segments);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        let path = self.segments(&call.path);
        self.file.named.insert(path);
        self.take_tokens(call.tokens.clone());
    }
}

/// The files of one crate as a tree of modules.
struct Crate {
    files: Vec<File>,
}

impl Crate {
    fn read(lib: &Path) -> Self {
        let mut all = Self { files: Vec::new() };
        all.add(lib, None);
        all
    }

    fn add(&mut self, path: &Path, parent: Option<usize>) -> usize {
        let index = self.files.len();
        let place = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
        let code = syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap();
        let mut file = File { place, parent, ..File::default() };
        let mut reader = Reader { file: &mut file, modules: Vec::new(), depth: 0 };
        reader.visit_file(&code);
        let modules = reader.modules;
        self.files.push(file);
        let folder = path.parent().unwrap();
        let own = ["lib.rs", "mod.rs"].iter().any(|name| path.ends_with(name));
        let below = if own { folder.to_owned() } else { path.with_extension("") };
        for (name, given) in modules {
            let usual = [below.join(format!("{name}.rs")), below.join(&name).join("mod.rs")];
            let found: Option<PathBuf> = match given {
                Some(given) => Some(folder.join(given)),
                None => usual.into_iter().find(|path| path.exists()),
            };
            let found = found.unwrap_or_else(|| panic!("{}: no file for module {name}", path.display()));
            if !is_test_file(found.strip_prefix(root()).unwrap()) {
                let child = self.add(&found, Some(index));
                self.files[index].children.entry(name).or_default().push(child);
            }
        }
        index
    }

    /// The files in which the item that `path` names is defined, as code in file `from` sees it. Empty for what is
    /// not of this crate, and for modules: naming a module needs nothing of it.
    fn defining(&self, from: usize, path: &[String], look: Look, asked: &mut Asked) -> BTreeSet<usize> {
        let none = BTreeSet::new();
        let Some((first, rest)) = path.split_first() else { return none };
        if !asked.insert((from, path.to_vec(), look)) {
            return none;
        }
        let file = &self.files[from];
        let inside = if look == Look::Start { Look::Inside } else { look };
        match (first.as_str(), look) {
            ("crate", Look::Start) => return self.defining(0, rest, inside, asked),
            ("self", _) => return self.defining(from, rest, inside, asked),
            ("super", _) => {
                return file.parent.map_or(none, |parent| self.defining(parent, rest, inside, asked));
            }
            _ => {}
        }
        let (children, aliases) = (file.children.get(first), file.aliases.get(first));
        // A function may have the name of a module.
        if file.items.contains(first) && (rest.is_empty() || children.is_none()) {
            return BTreeSet::from([from]);
        }
        let mut found = BTreeSet::new();
        for &child in children.into_iter().flatten() {
            found.extend(self.defining(child, rest, inside, asked));
        }
        for alias in aliases.into_iter().flatten() {
            let whole: Segments = [alias, rest].concat();
            if alias[0] != *first {
                found.extend(self.defining(from, &whole, Look::Start, asked));
                continue;
            }
            // `use rows::rows`: the first of them is the module.
            for &child in children.into_iter().flatten() {
                found.extend(self.defining(child, &whole[1..], Look::Inside, asked));
            }
        }
        if children.is_some() || aliases.is_some() {
            return found;
        }
        let of_crate = |glob: &&Segments| {
            ["crate", "self", "super"].contains(&glob[0].as_str()) || file.children.contains_key(&glob[0])
        };
        for glob in file.globs.iter().filter(of_crate) {
            let whole: Segments = [glob.as_slice(), path].concat();
            let (start, whole) = if glob[0] == "crate" { (0, &whole[1..]) } else { (from, &whole[..]) };
            found.extend(self.defining(start, whole, Look::Glob, asked));
        }
        // A macro may have made an item of which the code holds no definition.
        if found.is_empty() && look == Look::Inside { BTreeSet::from([from]) } else { found }
    }

    /// For each file, the other files that it needs, each with the paths by which it names them.
    fn arrows(&self) -> Vec<BTreeMap<usize, Vec<String>>> {
        let needs = |from: usize| {
            let mut found: BTreeMap<usize, Vec<String>> = BTreeMap::new();
            for path in &self.files[from].named {
                for file in self.defining(from, path, Look::Start, &mut Asked::new()) {
                    found.entry(file).or_default().push(path.join("::"));
                }
            }
            found.remove(&from);
            found
        };
        (0..self.files.len()).map(needs).collect()
    }
}

/// How a name is looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Look {
    /// By code inside a file: it may be of another crate.
    Start,
    /// In a module that a path has led to: it has to be there.
    Inside,
    /// In a module of which everything is imported: it may be there.
    Glob,
}

type Asked = BTreeSet<(usize, Segments, Look)>;

/// A shortest way from each file back to itself, if there is one; a circle is told once, beginning at its first file.
fn circles(arrows: &[BTreeMap<usize, Vec<String>>]) -> BTreeSet<Vec<usize>> {
    let shortest = |start: usize| -> Option<Vec<usize>> {
        let mut before: BTreeMap<usize, usize> = BTreeMap::new();
        let mut front = vec![start];
        while !front.is_empty() {
            let mut next = Vec::new();
            for from in front {
                for &to in arrows[from].keys() {
                    if to == start {
                        let mut way = vec![from];
                        while *way.last().unwrap() != start {
                            way.push(before[way.last().unwrap()]);
                        }
                        way.reverse();
                        return Some(way);
                    }
                    if let std::collections::btree_map::Entry::Vacant(entry) = before.entry(to) {
                        entry.insert(from);
                        next.push(to);
                    }
                }
            }
            front = next;
        }
        None
    };
    let found = (0..arrows.len()).filter_map(shortest);
    found
        .map(|mut way| {
            let first = (0..way.len()).min_by_key(|&at| way[at]).unwrap();
            way.rotate_left(first);
            way
        })
        .collect()
}

/// Files of a crate need each other in one direction only.
///
/// File A needs file B if A's code names an item that is defined in B, or a private `use` in A imports it. Paths are
/// followed through `crate`, `self`, `super`, renamed imports, globs and re-exports to the file that defines the
/// item. So a parent that only declares and re-exports its children needs none of them, and who names a child's item
/// through the parent needs the child, not the parent. A parent whose own code names a child's items needs that child;
/// if the child in turn names items of the parent, that is a circle like any other: what both need belongs into a
/// file of its own. Tests do not count. Methods and trait implementations that are reached through a value are not
/// seen, since only a compiler knows whose they are.
#[test]
fn the_files_of_a_crate_form_no_circles() {
    let mut all = vec![Crate::read(&root().join("src/lib.rs"))];
    for name in crates() {
        all.push(Crate::read(&root().join("crates").join(&name).join("src/lib.rs")));
    }
    let (mut arrows_found, mut told, mut met) = (0, Vec::new(), BTreeSet::new());
    for one in all {
        let arrows = one.arrows();
        arrows_found += arrows.iter().map(BTreeMap::len).sum::<usize>();
        for circle in circles(&arrows) {
            let places: Vec<&str> = circle.iter().map(|&file| one.files[file].place.as_str()).collect();
            let known = |start: &&str| places.iter().all(|place| place.starts_with(start));
            match KNOWN.iter().copied().find(known) {
                Some(start) => drop(met.insert(start)),
                None => {
                    let next = circle.iter().cycle().skip(1);
                    let names = circle.iter().zip(next).map(|(&from, to)| arrows[from][to].join(", "));
                    let ways =
                        places.iter().zip(names).map(|(place, names)| format!("{place} needs {names}"));
                    told.push(ways.collect::<Vec<_>>().join("; "));
                }
            }
        }
    }
    assert!(told.is_empty(), "{} circles of files:\n{}", told.len(), told.join("\n"));
    let gone: Vec<_> = KNOWN.iter().filter(|start| !met.contains(*start)).collect();
    assert!(gone.is_empty(), "no circle any more; take these off the list: {gone:?}");
    assert!(arrows_found > 1000, "the search has gone blind: {arrows_found} arrows");
}

#[test]
fn paths_lead_to_the_file_that_defines_the_item() {
    let matcher = Crate::read(&root().join("crates/matcher/src/lib.rs"));
    let place = |end: &str| {
        let whole = format!("crates/matcher/src/{end}");
        matcher.files.iter().position(|file| file.place == whole).unwrap()
    };
    let arrows = matcher.arrows();
    let needs = |from: &str, to: &str| arrows[place(from)].contains_key(&place(to));
    // Through a re-export, not to it; and an enumeration that a macro makes.
    assert!(needs("quick/mod.rs", "search/result.rs"));
    assert!(needs("cost/exhaustive/mod.rs", "options.rs"));
    assert!(arrows[place("lib.rs")].is_empty(), "it only declares and re-exports");
}

#[test]
fn a_circle_is_told_once() {
    let to = |ends: &[usize]| ends.iter().map(|&end| (end, Vec::new())).collect();
    assert_eq!(circles(&[to(&[1]), to(&[2]), to(&[0, 3]), to(&[])]), BTreeSet::from([vec![0, 1, 2]]));
    assert!(circles(&[to(&[1, 2]), to(&[2]), to(&[])]).is_empty());
}
