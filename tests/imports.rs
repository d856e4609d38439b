//! Which file imports from which: no circles, no stage of the encoder that knows a later one, and facades that
//! have nothing of their own.
//!
//! A path counts as an import of the file of the deepest module on it: `crate::encode::fit::adam::State`
//! of `encode/fit/adam.rs`, but a path to an item that `encode/fit/mod.rs` re-exports of that file.
//! Paths count wherever they stand, in `use`, in code and in macros. `mod x;` does not count, nor do
//! comments, nor does what is compiled for tests only.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, Group, Span, TokenStream, TokenTree};

/// A path, or a module's place below the root of its crate.
type Names = Vec<String>;

/// What is in each file.
type Sources = BTreeMap<String, String>;

/// Which file needs which, with a place where it does.
type Imports = BTreeMap<(String, String), String>;

/// The modules of a crate, and what they mention.
#[derive(Debug)]
struct Crate<'a> {
    sources: &'a Sources,
    /// The file in which each module is.
    modules: BTreeMap<Names, String>,
    /// What a module calls something, and the path in its `use`.
    aliases: BTreeMap<(Names, String), Names>,
    /// The modules from which a module uses all names.
    globs: BTreeMap<Names, Vec<Names>>,
    mentions: Vec<Mention>,
}

/// A path in the code.
#[derive(Debug)]
struct Mention {
    module: Names,
    file: String,
    line: usize,
    path: Names,
}

/// Where tokens are that are being read.
#[derive(Clone, Debug)]
struct Place {
    module: Names,
    file: String,
    /// The folder in which the files of child modules are.
    folder: String,
}

impl<'a> Crate<'a> {
    /// Reads all modules of a crate.
    fn read(sources: &'a Sources, root: &str) -> Self {
        let (modules, aliases) = (BTreeMap::new(), BTreeMap::new());
        let (globs, mentions) = (BTreeMap::new(), Vec::new());
        let mut read = Self { sources, modules, aliases, globs, mentions };
        let (folder, _) = root.rsplit_once('/').expect("a file in a folder");
        read.file(&Place { module: Names::new(), file: root.into(), folder: folder.into() });
        read
    }

    fn file(&mut self, place: &Place) {
        self.modules.insert(place.module.clone(), place.file.clone());
        let tokens = self.sources[&place.file].parse();
        self.tokens(place, tokens.unwrap_or_else(|error| panic!("{}: {error}", place.file)));
    }

    fn tokens(&mut self, place: &Place, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = &tokens[..];
        while let Some((first, after)) = rest.split_first() {
            rest = self.token(place, first, after);
        }
    }

    /// Reads what begins with a token. Returns what is after it.
    fn token<'t>(
        &mut self,
        place: &Place,
        first: &'t TokenTree,
        after: &'t [TokenTree],
    ) -> &'t [TokenTree] {
        match (name(first).as_deref(), after) {
            (Some("mod"), [child, body, after @ ..]) if name(child).is_some() => {
                self.module(place, &child.to_string(), body);
                after
            }
            // But not `use<'a>`.
            (Some("use"), [next, ..]) if !is(next, '<') => {
                let end = after.iter().position(|token| is(token, ';')).expect("a `;`");
                self.imported(place, &[], &after[..end]);
                &after[end..]
            }
            // Who may see something is no import.
            (Some("pub"), [TokenTree::Group(group), after @ ..]) if is_scope(group) => after,
            (Some(first_name), _) => {
                let (mut path, after) = names(after, true);
                path.insert(0, first_name.to_owned());
                // One name alone is a variable, or something that `use` or the prelude brought.
                if path.len() > 1 {
                    self.mention(place, first.span(), path);
                }
                after
            }
            (None, [next, TokenTree::Group(_), after @ ..]) if is(first, '#') && is(next, '!') => {
                after
            }
            (None, [TokenTree::Group(attribute), after @ ..]) if is(first, '#') => {
                if is_for_tests(attribute.stream()) {
                    let end = after.iter().position(ends_item).expect("an item ends");
                    return &after[end + 1..];
                }
                self.tokens(place, attribute.stream());
                after
            }
            // Of another crate, or of a type.
            (None, [next, after @ ..]) if is(first, ':') && is(next, ':') => names(after, false).1,
            (None, _) => {
                if let TokenTree::Group(group) = first {
                    self.tokens(place, group.stream());
                }
                after
            }
        }
    }

    fn module(&mut self, place: &Place, child: &str, body: &TokenTree) {
        let module = [&place.module[..], &[child.to_owned()]].concat();
        let folder = format!("{}/{child}", place.folder);
        if let TokenTree::Group(body) = body {
            self.modules.insert(module.clone(), place.file.clone());
            self.tokens(&Place { module, file: place.file.clone(), folder }, body.stream());
        } else {
            let mut candidates = [format!("{folder}.rs"), format!("{folder}/mod.rs")].into_iter();
            let file = candidates.find(|file| self.sources.contains_key(file));
            let file = file.unwrap_or_else(|| panic!("{}: where is {child}?", place.file));
            self.file(&Place { module, file, folder });
        }
    }

    /// Reads a `use`, or a branch of one, after these names.
    fn imported(&mut self, place: &Place, before: &[String], tree: &[TokenTree]) {
        let (more, rest) = names(tree, false);
        let mut path = [before, &more].concat();
        if let [TokenTree::Group(group)] = rest {
            let branches: Vec<TokenTree> = group.stream().into_iter().collect();
            for branch in branches.split(|token| is(token, ',')).filter(|tree| !tree.is_empty()) {
                self.imported(place, &path, branch);
            }
            return;
        }
        let Some(last) = path.last() else {
            assert!(is(&tree[0], ':'), "{}: `use` of what?", place.file);
            return;
        };
        if last == "self" && !before.is_empty() {
            path.pop();
        }
        match rest {
            [] => {
                let alias = (place.module.clone(), path[path.len() - 1].clone());
                self.aliases.insert(alias, path.clone());
            }
            [star] if is(star, '*') => {
                self.globs.entry(place.module.clone()).or_default().push(path.clone());
            }
            [_as, alias] => {
                self.aliases.insert((place.module.clone(), alias.to_string()), path.clone());
            }
            _ => panic!("{}: {path:?} and what?", place.file),
        }
        self.mention(place, tree[0].span(), path);
    }

    fn mention(&mut self, place: &Place, span: Span, path: Names) {
        let Place { module, file, .. } = place.clone();
        self.mentions.push(Mention { module, file, line: span.start().line, path });
    }

    /// Where a path leads from a module, from the root on; `None` if to another crate, or to something
    /// that only this module can name. It may begin with a name that a `*` has brought, or not.
    fn resolve(&self, module: &[String], path: &[String], globs: bool) -> Option<Names> {
        let (first, rest) = path.split_first()?;
        let mut from = match first.as_str() {
            "crate" => vec![],
            "self" => module.to_vec(),
            "super" => module[..module.len() - 1].to_vec(),
            _ => self.named(module, first, globs)?,
        };
        for name in rest {
            match name.as_str() {
                "super" => drop(from.pop()),
                name => from.push(name.to_owned()),
            }
        }
        Some(from)
    }

    /// What a module means by a name.
    fn named(&self, module: &[String], name: &str, globs: bool) -> Option<Names> {
        let child = [module, &[name.to_owned()]].concat();
        if self.modules.contains_key(&child) {
            return Some(child);
        }
        // What begins with the name itself is another crate's.
        let alias = self.aliases.get(&(module.to_vec(), name.to_owned()));
        if let Some(path) = alias.filter(|path| path[0] != name) {
            return self.resolve(module, path, globs);
        }
        self.globs.get(module).filter(|_| globs)?.iter().find_map(|glob| {
            let child = [self.resolve(module, glob, false)?, vec![name.to_owned()]].concat();
            self.modules.contains_key(&child).then_some(child)
        })
    }

    /// The file of the deepest module on a path from the root on.
    fn deepest(&self, path: &[String]) -> &str {
        let mut modules = (0..=path.len()).rev().map(|length| self.modules.get(&path[..length]));
        modules.find_map(|file| file).expect("the root is a module")
    }

    fn imports(&self) -> Imports {
        let mut imports = Imports::new();
        for Mention { module, file, line, path } in &self.mentions {
            let Some(found) = self.resolve(module, path, true) else { continue };
            let needed = self.deepest(&found);
            if needed != file {
                let place = || format!("{file}:{line} takes {} from {needed}", path.join("::"));
                imports.entry((file.clone(), needed.to_owned())).or_insert_with(place);
            }
        }
        imports
    }
}

fn name(token: &TokenTree) -> Option<String> {
    match token {
        TokenTree::Ident(ident) => Some(ident.to_string()),
        _ => None,
    }
}

fn is(token: &TokenTree, character: char) -> bool {
    matches!(token, TokenTree::Punct(found) if found.as_char() == character)
}

/// Whether this is the `(crate)` of `pub(crate)`, or the like.
fn is_scope(group: &Group) -> bool {
    let first = group.stream().into_iter().next().and_then(|first| name(&first));
    let is_single = group.stream().into_iter().count() == 1;
    first.is_some_and(|first| match first.as_str() {
        "crate" | "self" | "super" => is_single,
        first => first == "in",
    })
}

/// Whether an item may end with this token.
fn ends_item(token: &TokenTree) -> bool {
    match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        token => is(token, ';'),
    }
}

/// The names that `::` joins, the first of them too if the path has begun, and what is after them.
fn names(mut tokens: &[TokenTree], has_begun: bool) -> (Names, &[TokenTree]) {
    let mut found = Names::new();
    loop {
        let after_colons = match tokens {
            [a, b, after @ ..] if is(a, ':') && is(b, ':') => Some(after),
            _ => None,
        };
        let is_first = found.is_empty() && !has_begun;
        let next = if is_first { tokens } else { after_colons.unwrap_or(&[]) };
        match next.split_first().map(|(first, after)| (name(first), after)) {
            Some((Some(name), after)) => {
                found.push(name);
                tokens = after;
            }
            // Of a group or a star, those colons are a part of the path.
            _ => return (found, if is_first { tokens } else { after_colons.unwrap_or(tokens) }),
        }
    }
}

/// Whether an attribute is a `cfg` that holds in tests only: of `test`, or of `all` with it.
fn is_for_tests(attribute: TokenStream) -> bool {
    fn needs_test(condition: &[TokenTree]) -> bool {
        match condition {
            [word] => word.to_string() == "test",
            [word, TokenTree::Group(group)] if word.to_string() == "all" => {
                let parts: Vec<TokenTree> = group.stream().into_iter().collect();
                parts.split(|token| is(token, ',')).any(needs_test)
            }
            _ => false,
        }
    }
    match &attribute.into_iter().collect::<Vec<_>>()[..] {
        [word, TokenTree::Group(group)] if word.to_string() == "cfg" => {
            needs_test(&group.stream().into_iter().collect::<Vec<_>>())
        }
        _ => false,
    }
}

/// The imports that lie on circles, each with the place where it stands.
fn circles(imports: &Imports) -> Vec<&str> {
    let reached = |start: &str| {
        let (mut reached, mut next) = (BTreeSet::new(), vec![start.to_owned()]);
        while let Some(file) = next.pop() {
            let needed = imports.keys().filter(|(from, _)| *from == file).map(|(_, to)| to);
            next.extend(needed.filter(|to| reached.insert((*to).clone())).cloned());
        }
        reached
    };
    let on_circle = imports.iter().filter(|((from, to), _)| reached(to).contains(from));
    on_circle.map(|(_, place)| place.as_str()).collect()
}

/// All `.rs` files in a folder of this repository, by their paths in it.
fn sources(folder: &str) -> Sources {
    let mut sources = Sources::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(&folder);
        for entry in fs::read_dir(path).expect("the folder is there") {
            let entry = entry.expect("it can be read");
            let name = format!("{folder}/{}", entry.file_name().into_string().expect("UTF-8"));
            if entry.file_type().expect("it has a type").is_dir() {
                folders.push(name);
            } else if name.ends_with(".rs") {
                sources.insert(name, fs::read_to_string(entry.path()).expect("it is text"));
            }
        }
    }
    sources
}

/// The files that some modules of a crate are in.
fn files<'a>(read: &'a Crate<'_>) -> Vec<&'a str> {
    let files: BTreeSet<&str> = read.modules.values().map(String::as_str).collect();
    files.into_iter().collect()
}

/// Checks that no file was left out.
#[track_caller]
fn assert_belongs(mut found: Vec<&str>, sources: &Sources) {
    found.sort_unstable();
    assert!(found.iter().eq(sources.keys()), "{found:?} of {:?}", sources.keys());
}

#[test]
fn no_files_of_the_crate_import_each_other() {
    let sources = sources("src");
    let (library, tool) =
        (Crate::read(&sources, "src/lib.rs"), Crate::read(&sources, "src/bin/gip/main.rs"));
    let mut found = [files(&library), files(&tool)].concat();
    // Those of tests alone, which are no part of the crate.
    found.extend(["src/testing.rs", "src/encode/testing.rs", "src/coding/entropy/tables_fit.rs"]);
    found.push("src/bin/gip/args/packaged.rs");
    found.extend(sources.keys().map(String::as_str).filter(|name| name.ends_with("/tests.rs")));
    assert_belongs(found, &sources);
    for read in [library, tool] {
        let imports = read.imports();
        assert!(imports.len() > read.modules.len(), "most imports were not found");
        let circles = circles(&imports);
        assert!(circles.is_empty(), "import circles:\n{}", circles.join("\n"));
    }
}

#[test]
fn no_files_of_the_evaluation_import_each_other() {
    // It is no part of the package.
    if !Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/evaluation")).exists() {
        return;
    }
    let sources = sources("evaluation/src");
    let read = Crate::read(&sources, "evaluation/src/main.rs");
    assert_belongs(files(&read), &sources);
    let imports = read.imports();
    let circles = circles(&imports);
    assert!(circles.is_empty(), "import circles:\n{}", circles.join("\n"));
}

#[test]
fn no_stage_of_the_encoder_knows_a_later_one() {
    let sources = sources("src");
    let imports = Crate::read(&sources, "src/lib.rs").imports();
    let between = |from: &str, to: &str| -> Vec<&str> {
        let is_in = |file: &str, stage| file.starts_with(&format!("src/encode/{stage}/"));
        let found = imports.iter().filter(|((a, b), _)| is_in(a, from) && is_in(b, to));
        found.map(|(_, place)| place.as_str()).collect()
    };
    for stage in ["fit", "rdo", "file"] {
        assert!(!between(stage, stage).is_empty(), "nothing was found in {stage}");
    }
    for (from, to) in [("file", "fit"), ("file", "rdo"), ("fit", "rdo")] {
        assert_eq!(between(from, to), [""; 0], "{from} knows {to}");
    }
}

#[test]
fn every_mod_rs_is_a_facade() {
    for (name, text) in sources("src").iter().filter(|(name, _)| name.ends_with("/mod.rs")) {
        let is_code = |line: &&str| !line.starts_with("//") && !line.starts_with("#[");
        let code: String = text.lines().filter(is_code).collect();
        for item in code.split_terminator(';') {
            let private = item.strip_prefix("pub").and_then(|item| Some(item.split_once(' ')?.1));
            let item = private.unwrap_or(item);
            assert!(item.starts_with("mod ") || item.starts_with("use "), "{name}: {item}");
        }
    }
}

/// The imports of a crate of these files, as pairs of their names without extension.
#[track_caller]
fn check(files: &[(&str, &str)], expected: &[&str], circular: usize) {
    let sources: Sources =
        files.iter().map(|(name, text)| (format!("s/{name}.rs"), text.to_string())).collect();
    let imports = Crate::read(&sources, &format!("s/{}.rs", files[0].0)).imports();
    let short = |file: &str| file[2..file.len() - 3].to_owned();
    let found: Vec<String> =
        imports.keys().map(|(from, to)| format!("{} {}", short(from), short(to))).collect();
    assert_eq!(found, expected);
    assert_eq!(circles(&imports).len(), circular, "{imports:?}");
}

#[test]
fn a_path_is_an_import_of_the_deepest_file_on_it() {
    check(
        &[
            ("lib", "mod a; mod b; pub use b::c::C; pub use crate::b::B;"),
            ("a", "use std::fs; use crate::b::{self, c::{C as D, deep::*}, E::{F, G}};"),
            ("b/mod", "pub mod c; pub(in crate::a) enum E { F, G } use ::a::X;"),
            ("b/c", "pub mod deep { pub fn f() {} } fn g() { a::f(); c::f(); deep::f(); }"),
        ],
        &["a b/c", "a b/mod", "lib b/c", "lib b/mod"],
        0,
    );
}

#[test]
fn paths_count_in_code_macros_and_attributes_too() {
    check(
        &[
            ("main", "mod a; mod b; mod c; mod d; mod e; fn main() { a::run() }"),
            ("a", "pub fn run() { assert_eq!(vec![super::b::ONE], [1]); }"),
            ("b", "#[arg(default = crate::c::TWO)] pub struct S(pub (crate::e::E, u8));"),
            ("c", "use crate::d; fn f() -> <d::S as T>::U { x.d::<u8>(); self::g() }"),
            ("d", "fn f(c: u8) -> impl A + use<'_> { c; c.b(); let a = c; }"),
            ("e", "pub(in crate::a) struct E;"),
        ],
        &["a b", "b c", "b e", "c d", "main a"],
        0,
    );
}

#[test]
fn what_is_for_tests_only_does_not_count() {
    check(
        &[
            ("lib", "#![cfg_attr(test, x(a::b))] mod a; mod b; #[cfg(test)] mod testing;"),
            ("a", "/// See [`crate::b::B`].\n pub struct A; // crate::b::B\n"),
            (
                "b",
                "use crate::a::A;
                #[cfg(test)] use crate::B;
                #[cfg(all(test, feature = \"x\"))] impl B { fn f() { crate::f() } }
                #[cfg(test)] mod tests { use super::*; use crate::C; }",
            ),
        ],
        &["b a"],
        0,
    );
    check(
        &[
            ("lib", "mod a; mod b;"),
            ("a", "#[cfg(any(test, feature = \"x\"))] use crate::b::B;"),
            ("b", "#[cfg(not(test))] use crate::a::A;"),
        ],
        &["a b", "b a"],
        2,
    );
}

#[test]
fn a_circle_through_super_is_found() {
    check(
        &[
            ("lib", "mod x;"),
            ("x/mod", "mod a; mod b; mod c;"),
            ("x/a", "use super::b::B; pub struct A;"),
            ("x/b", "use super::super::x::c::C;"),
            ("x/c", "fn f() { use super::a; a::A }"),
        ],
        &["x/a x/b", "x/b x/c", "x/c x/a"],
        3,
    );
}

#[test]
fn a_circle_through_a_nested_module_is_found() {
    check(
        &[
            ("lib", "mod a; mod b; mod c;"),
            ("a", "pub mod inner { use super::super::b::B; use super::f; }"),
            ("b", "use crate::a::inner::I; use crate::c::C;"),
            ("c", "const C: u8 = 0;"),
        ],
        &["a b", "b a", "b c"],
        2,
    );
}

#[test]
fn a_circle_through_a_file_that_re_exports_is_found() {
    let files = |import| {
        [
            ("lib", "mod x;"),
            ("x/mod", "mod a; mod b; pub use a::A;"),
            ("x/a", "use super::b::B; pub struct A;"),
            ("x/b", import),
        ]
    };
    check(&files("use crate::x::A;"), &["x/a x/b", "x/b x/mod", "x/mod x/a"], 3);
    check(&files("use super::*;"), &["x/a x/b", "x/b x/mod", "x/mod x/a"], 3);
    // The folder's own file may use all that is in it.
    check(&files("use core::fmt;"), &["x/a x/b", "x/mod x/a"], 0);
}

#[test]
fn names_that_use_brings_lead_on() {
    check(
        &[
            ("lib", "mod a; mod b; mod x;"),
            ("a", "use crate::x as y; fn f() { y::one::f(); }"),
            ("b", "use crate::x::*; fn f() { two::f(); glam::f() } use glam;"),
            ("x/mod", "pub mod one; pub mod two;"),
            ("x/one", ""),
            ("x/two", "macro_rules! m { () => { $crate::b::f() } }"),
        ],
        &["a x/mod", "a x/one", "b x/mod", "b x/two", "x/two b"],
        2,
    );
}
