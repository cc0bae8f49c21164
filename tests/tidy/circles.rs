//! Which file of a crate uses which, read from the sources, and the circles among them.
//!
//! A file uses another if it names something that the other defines: by `use`, or by a path that starts at
//! `crate`, `self`, `super` or a module declared there. A re-export (`pub use`) is followed to the file
//! that defines the name, so neither `mod child;` nor a re-export makes a parent use its child; a
//! re-exported name that is also used does. Tests (`#[cfg(test)]`) are left out, since they may look at
//! whatever they like.
//!
//! This reads words, not types: names that only macros generate are not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A word, a `::`, or a single other character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Token<'a> {
    text: &'a str,
    line: usize,
}

/// The tokens of a source file, without comments, texts, characters and lifetimes.
fn tokens(source: &str) -> Vec<Token<'_>> {
    let bytes = source.as_bytes();
    let is_word = |at: usize| bytes.get(at).is_some_and(|b| b.is_ascii_alphanumeric() || *b == b'_');
    let (mut found, mut at, mut line) = (Vec::new(), 0, 1);
    while at < bytes.len() {
        let rest = &source[at..];
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            block_comment(rest)
        } else if let Some(length) = text_literal(rest) {
            length
        } else if bytes[at] == b'\'' {
            character_or_lifetime(rest)
        } else {
            let length = if is_word(at) {
                (at..).take_while(|&at| is_word(at)).count()
            } else if rest.starts_with("::") {
                2
            } else {
                rest.chars().next().map_or(1, char::len_utf8)
            };
            let text = &rest[..length];
            if !text.trim().is_empty() {
                found.push(Token { text, line });
            }
            length
        };
        line += source[at..at + length].matches('\n').count();
        at += length;
    }
    found
}

/// How long a comment is, with those nested in it.
fn block_comment(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        let step = match &rest.as_bytes()[at..] {
            [b'/', b'*', ..] => {
                depth += 1;
                2
            }
            [b'*', b'/', ..] => {
                depth -= 1;
                2
            }
            _ => 1,
        };
        at += step;
        if depth == 0 {
            break;
        }
    }
    at
}

/// Length of the string literal at this position, raw or not.
fn text_literal(rest: &str) -> Option<usize> {
    let prefix = ["br", "cr", "r", "b", "c", ""].into_iter().find(|prefix| {
        let behind = rest.strip_prefix(prefix).map(|behind| behind.trim_start_matches('#'));
        behind.is_some_and(|behind| behind.starts_with('"'))
    })?;
    let hashes = rest[prefix.len()..].bytes().take_while(|b| *b == b'#').count();
    if hashes > 0 && !prefix.ends_with('r') {
        return None;
    }
    let from = prefix.len() + hashes + 1;
    if prefix.ends_with('r') {
        let end = format!("\"{}", "#".repeat(hashes));
        return Some(rest[from..].find(&end).map_or(rest.len(), |at| from + at + end.len()));
    }
    let mut escaped = false;
    let end = rest[from..].bytes().position(|b| {
        let ends = b == b'"' && !escaped;
        escaped = b == b'\\' && !escaped;
        ends
    });
    Some(end.map_or(rest.len(), |at| from + at + 1))
}

/// How long `'a'`, `'\n'` or the lifetime `'a` is.
fn character_or_lifetime(rest: &str) -> usize {
    let mut characters = rest.char_indices().skip(1);
    let (_, first) = characters.next().unwrap_or((0, ' '));
    if first == '\\' {
        let (after, _) = characters.next().unwrap_or((1, ' '));
        return rest[after + 1..].find('\'').map_or(rest.len(), |at| after + 1 + at + 1);
    }
    match characters.next() {
        Some((at, '\'')) => at + 1,
        _ => 1 + rest[1..].bytes().take_while(|b| b.is_ascii_alphanumeric() || *b == b'_').count(),
    }
}

/// The index behind the bracket that closes the one at `open`.
fn behind_bracket(tokens: &[Token<'_>], open: usize) -> usize {
    let mut depth = 0usize;
    for (at, token) in tokens.iter().enumerate().skip(open) {
        match token.text {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

/// The index behind the item at `at`: behind its block or its semicolon.
fn behind_item(tokens: &[Token<'_>], mut at: usize) -> usize {
    while let Some(token) = tokens.get(at) {
        match token.text {
            ";" => return at + 1,
            "{" => return behind_bracket(tokens, at),
            "(" | "[" => at = behind_bracket(tokens, at),
            ")" | "]" | "}" => return at,
            _ => at += 1,
        }
    }
    at
}

/// The source without parts compiled for tests only.
fn without_tests<'a>(tokens: &[Token<'a>]) -> Vec<Token<'a>> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        if tokens[at].text == "#" && tokens.get(at + 1).is_some_and(|token| token.text == "[") {
            let behind = behind_bracket(tokens, at + 1);
            let attribute: Vec<&str> = tokens[at + 2..behind - 1].iter().map(|token| token.text).collect();
            let says = |word: &str| attribute.contains(&word);
            if attribute.first() == Some(&"cfg") && says("test") && !says("not") {
                at = behind_item(tokens, behind);
                continue;
            }
        }
        kept.push(tokens[at]);
        at += 1;
    }
    kept
}

/// A name brought in by `use`.
#[derive(Debug)]
struct Import {
    path: Vec<String>,
    /// The name here; nothing for a glob.
    name: Option<String>,
    passed_on: bool,
    line: usize,
}

#[derive(Debug, Default)]
struct Module {
    file: PathBuf,
    children: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in the code, from their first word.
    paths: Vec<(Vec<String>, usize)>,
    /// Every word of the code, except those in `use`.
    words: BTreeSet<String>,
    defines: BTreeSet<String>,
}

/// The modules of a crate, by their path from its root.
#[derive(Debug, Default)]
struct Modules(BTreeMap<Vec<String>, Module>);

/// Gives the text of a file, or that it is not there.
type Read<'a> = &'a dyn Fn(&Path) -> Option<String>;

impl Modules {
    fn add_file(&mut self, file: &Path, path: &[String], folder: &Path, read: Read<'_>) {
        let source = read(file).unwrap_or_else(|| panic!("{} is not there", file.display()));
        let tokens = without_tests(&tokens(&source));
        // An attribute names the file of a module by a text, which the tokens leave out.
        self.add(&tokens, file, path, folder, &source, read);
    }

    fn add(
        &mut self,
        tokens: &[Token<'_>],
        file: &Path,
        path: &[String],
        folder: &Path,
        source: &str,
        read: Read<'_>,
    ) {
        let mut module = Module { file: file.to_owned(), ..Module::default() };
        let (mut at, mut depth) = (0, 0usize);
        let text = |at: usize| tokens.get(at).map_or("", |token| token.text);
        while at < tokens.len() {
            let token = tokens[at];
            match token.text {
                "mod" if matches!(text(at + 2), ";" | "{") => {
                    let name = text(at + 1).to_owned();
                    module.children.insert(name.clone());
                    let inner = [path, std::slice::from_ref(&name)].concat();
                    let child_folder = folder.join(&name);
                    if text(at + 2) == ";" {
                        let child = named_by_attribute(source, &name)
                            .map(|named| file.parent().unwrap_or(folder).join(named))
                            .or_else(|| {
                                let (flat, deep) =
                                    (folder.join(format!("{name}.rs")), child_folder.join("mod.rs"));
                                [flat, deep].into_iter().find(|file| read(file).is_some())
                            })
                            .unwrap_or_else(|| panic!("{}: no file of mod {name}", file.display()));
                        self.add_file(&child, &inner, &child_folder, read);
                        at += 3;
                    } else {
                        let behind = behind_bracket(tokens, at + 2);
                        self.add(&tokens[at + 3..behind - 1], file, &inner, &child_folder, source, read);
                        at = behind;
                    }
                    continue;
                }
                "use" => {
                    let end = at + tokens[at..].iter().take_while(|token| token.text != ";").count();
                    let is_public = at > 0 && (text(at - 1) == "pub" || text(at - 1) == ")");
                    tree(&tokens[at + 1..end], &[], is_public, &mut module.imports);
                    at = end + 1;
                    continue;
                }
                "fn" | "struct" | "enum" | "union" | "trait" | "const" | "static" | "type" if depth == 0 => {
                    module.defines.insert(text(at + 1).to_owned());
                }
                "{" => depth += 1,
                "}" => depth = depth.saturating_sub(1),
                _ => {}
            }
            if token.text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
                module.words.insert(token.text.to_owned());
                if at == 0 || text(at - 1) != "::" {
                    let mut segments = vec![token.text.to_owned()];
                    let mut behind = at + 1;
                    while text(behind) == "::"
                        && text(behind + 1).starts_with(|c: char| c.is_alphabetic() || c == '_')
                    {
                        segments.push(text(behind + 1).to_owned());
                        behind += 2;
                    }
                    if segments.len() > 1 {
                        module.paths.push((segments, token.line));
                    }
                }
            }
            at += 1;
        }
        self.0.insert(path.to_vec(), module);
    }

    /// Resolves a path from a module of this crate to the file that defines its target.
    fn file_of(&self, from: &[String], path: &[String]) -> Option<&Path> {
        let (first, mut rest) = path.split_first()?;
        let mut module = match first.as_str() {
            "crate" => Vec::new(),
            "self" => from.to_vec(),
            "super" => from.split_last()?.1.to_vec(),
            child if self.0[from].children.contains(child) => [from, std::slice::from_ref(first)].concat(),
            _ => return None,
        };
        while let Some((name, further)) = rest.split_first().filter(|(name, _)| *name == "super") {
            module.pop().unwrap_or_else(|| panic!("{name} of the root"));
            rest = further;
        }
        self.definition(&module, rest, 0)
    }

    fn definition(&self, module: &[String], rest: &[String], passed: usize) -> Option<&Path> {
        let here = self.0.get(module)?;
        let Some((name, further)) = rest.split_first() else { return Some(&here.file) };
        if here.children.contains(name) {
            return self.definition(&[module, std::slice::from_ref(name)].concat(), further, passed);
        }
        // Names that are passed on in a circle do not compile; a bound all the same.
        if passed < 20 && !here.defines.contains(name) {
            for import in &here.imports {
                let target = match &import.name {
                    Some(known) if known == name => [&import.path[..], further].concat(),
                    None if import.passed_on => [&import.path[..], rest].concat(),
                    _ => continue,
                };
                let Some((module, rest)) = self.absolute(module, &target) else { continue };
                if import.name.is_some() || self.has(&module, &rest) {
                    return self.definition(&module, &rest, passed + 1);
                }
            }
        }
        Some(&here.file)
    }

    /// A path as the module that it starts in and the rest; nothing for another crate's.
    fn absolute(&self, from: &[String], path: &[String]) -> Option<(Vec<String>, Vec<String>)> {
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => Some((Vec::new(), rest.to_vec())),
            "self" => Some((from.to_vec(), rest.to_vec())),
            "super" => Some((from.split_last()?.1.to_vec(), rest.to_vec())),
            child if self.0[from].children.contains(child) => Some((from.to_vec(), path.to_vec())),
            _ => None,
        }
    }

    /// Whether the last word of a path is defined in the module that the others lead to.
    fn has(&self, module: &[String], path: &[String]) -> bool {
        let Some((name, between)) = path.split_last() else { return false };
        self.0.get(&[module, between].concat()).is_some_and(|module| module.defines.contains(name))
    }

    /// The uses of each file: the used file, and the line.
    fn uses(&self) -> Uses {
        let mut uses = Uses::new();
        for (path, module) in &self.0 {
            let imports = module.imports.iter().filter_map(|import| {
                let used = import.name.as_ref().is_some_and(|name| module.words.contains(name));
                (used || !import.passed_on).then_some((&import.path, import.line))
            });
            let paths = module.paths.iter().map(|(path, line)| (path, *line));
            let here = uses.entry(module.file.clone()).or_default();
            for (named, line) in imports.chain(paths) {
                if let Some(file) = self.file_of(path, named)
                    && file != module.file
                {
                    here.entry(file.to_owned()).or_insert(line);
                }
            }
        }
        uses
    }
}

/// The file that `#[path = "..."]` names for a module.
fn named_by_attribute(source: &str, name: &str) -> Option<PathBuf> {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let wanted = format!("mod {name};");
    let at = lines.iter().position(|line| line.ends_with(&wanted) && !line.starts_with("//"))?;
    let above = lines[..at].iter().rev().take_while(|line| line.starts_with("#["));
    let named = above.filter_map(|line| line.strip_prefix("#[path = \"")?.strip_suffix("\"]")).next();
    named.map(PathBuf::from)
}

/// The names of a `use`, braces and all.
fn tree(tokens: &[Token<'_>], before: &[String], passed_on: bool, imports: &mut Vec<Import>) {
    let mut path = before.to_vec();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        match token.text {
            "::" => {}
            "{" => {
                let behind = behind_bracket(tokens, at);
                let mut from = at + 1;
                while from < behind - 1 {
                    let mut to = from;
                    while to < behind - 1 && tokens[to].text != "," {
                        to = if tokens[to].text == "{" { behind_bracket(tokens, to) } else { to + 1 };
                    }
                    tree(&tokens[from..to], &path, passed_on, imports);
                    from = to + 1;
                }
                return;
            }
            "*" => {
                imports.push(Import { path, name: None, passed_on, line: token.line });
                return;
            }
            "as" => {
                let name = tokens.get(at + 1).map(|token| token.text.to_owned());
                imports.push(Import { path, name, passed_on, line: token.line });
                return;
            }
            "self" if !path.is_empty() => {}
            word => path.push(word.to_owned()),
        }
        at += 1;
    }
    if let (Some(name), Some(token)) = (path.last().cloned(), tokens.first()) {
        imports.push(Import { path, name: Some(name), passed_on, line: token.line });
    }
}

/// For each file those that it uses, each with the first line that does.
type Uses = BTreeMap<PathBuf, BTreeMap<PathBuf, usize>>;

/// Uses among the files of a crate, from its `lib.rs` or `main.rs`.
pub(super) fn uses(root: &Path) -> Uses {
    uses_by(root, &|file| fs::read_to_string(file).ok())
}

fn uses_by(root: &Path, read: Read<'_>) -> Uses {
    let mut modules = Modules::default();
    modules.add_file(root, &[], root.parent().unwrap_or(Path::new("")), read);
    modules.uses()
}

/// The sets of files that all use each other, directly or through others.
pub(super) fn circles(uses: &Uses) -> Vec<BTreeSet<PathBuf>> {
    let reached: BTreeMap<&Path, BTreeSet<&Path>> =
        uses.keys().map(|file| (file.as_path(), reached_from(file, uses))).collect();
    let circles: BTreeSet<BTreeSet<PathBuf>> = reached
        .iter()
        .filter(|(file, reaches)| reaches.contains(**file))
        .map(|(file, reaches)| {
            let back = reaches.iter().filter(|other| reached.get(**other).is_some_and(|r| r.contains(file)));
            back.map(|other| other.to_path_buf()).collect()
        })
        .collect();
    circles.into_iter().collect()
}

fn reached_from<'a>(file: &'a Path, uses: &'a Uses) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut open = vec![file];
    while let Some(file) = open.pop() {
        for used in uses.get(file).into_iter().flat_map(BTreeMap::keys) {
            if reached.insert(used.as_path()) {
                open.push(used);
            }
        }
    }
    reached
}

fn of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let read = |file: &Path| {
        files.iter().find(|(name, _)| Path::new(name) == file).map(|(_, text)| (*text).to_owned())
    };
    let names = |circle: BTreeSet<PathBuf>| circle.iter().map(|file| file.display().to_string()).collect();
    circles(&uses_by(Path::new("lib.rs"), &read)).into_iter().map(names).collect()
}

#[test]
fn a_circle_is_seen_however_it_is_written() {
    let lib = "mod a; mod b; mod c;";
    for (a, b, c) in [
        ("use crate::b::B; struct A;", "use crate::c::C; struct B;", "use crate::a::A; struct C;"),
        ("fn a() { super::b::b() }", "fn b() { crate::c::c::<u8>() }", "use super::{a as other, b::{b}};"),
        (
            "use crate::{b::*};",
            "fn b(c: &'static crate::c::C) {}",
            "mod inner { fn c() { super::super::a::a() } }",
        ),
    ] {
        let found = of(&[("lib.rs", lib), ("a.rs", a), ("b.rs", b), ("c.rs", c)]);
        assert_eq!(found, [["a.rs", "b.rs", "c.rs"]], "{a} {b} {c}");
    }
}

#[test]
fn what_is_passed_on_counts_where_it_is_defined() {
    // `Plan` is named at the root, and defined in a file that knows nothing of the other.
    let lib = "mod plan; mod load; pub use plan::Plan; pub use load::*;";
    let load = "use crate::Plan; pub fn load(plan: &Plan) {}";
    assert!(of(&[("lib.rs", lib), ("plan.rs", "pub struct Plan;"), ("load.rs", load)]).is_empty());
    let plan = "pub struct Plan; fn f() { crate::load(&Plan) }";
    let found = of(&[("lib.rs", lib), ("plan.rs", plan), ("load.rs", load)]);
    assert_eq!(found, [["load.rs", "plan.rs"]]);
}

#[test]
fn a_parent_uses_its_child_if_it_does_more_than_pass_it_on() {
    let child = "use super::Error; pub fn read() -> Error { Error }";
    for (lib, circle) in [
        ("mod child; pub struct Error; pub use child::read;", false),
        ("mod child; pub struct Error; pub use child::read; fn f() { read(); }", true),
        ("mod child; pub struct Error; fn f() { child::read(); }", true),
        ("mod child; pub struct Error; #[cfg(test)] mod tests { fn f() { super::child::read(); } }", false),
        ("mod child; pub struct Error; // child::read()\nconst C: &str = \"child::read()\";", false),
    ] {
        assert_eq!(!of(&[("lib.rs", lib), ("child.rs", child)]).is_empty(), circle, "{lib}");
    }
}
