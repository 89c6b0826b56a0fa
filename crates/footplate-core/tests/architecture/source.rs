//! One Rust file as tokens: the paths it names and the items it defines, without its tests.

use std::str::FromStr as _;

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

/// The contents of one file outside its tests.
pub(crate) struct Source {
    /// Its path from the root of the project.
    pub(crate) path: String,
    /// Each path of two segments or more, with `crate`, `self` and `super` resolved.
    pub(crate) named: Vec<NamedPath>,
    /// Each method call.
    pub(crate) called: Vec<Word>,
    /// The keyword, such as `struct`, of each item of the file itself, not of a module within it.
    pub(crate) items: Vec<Word>,
    /// Test-only modules in other files, from the crate's root.
    pub(crate) test_modules: Vec<Vec<String>>,
}

/// A path such as `crate::time::Timestamp`.
pub(crate) struct NamedPath {
    pub(crate) line: usize,
    pub(crate) segments: Vec<String>,
}

/// One word and its line.
pub(crate) struct Word {
    pub(crate) line: usize,
    pub(crate) word: String,
}

const ITEM_KEYWORDS: [&str; 7] = ["struct", "enum", "union", "trait", "impl", "fn", "macro_rules"];

impl Source {
    /// Reads a file; `path` determines its module.
    pub(crate) fn read(path: &str, text: &str) -> Self {
        let tokens = TokenStream::from_str(text).unwrap_or_else(|e| panic!("{path}: {e}"));
        let mut source = Self {
            path: path.into(),
            named: Vec::new(),
            called: Vec::new(),
            items: Vec::new(),
            test_modules: Vec::new(),
        };
        source.walk(tokens, &module_of(path), 0);
        source
    }

    /// The modules that contain the file, from the crate's root: `track`, `graph` for `…/src/track/graph.rs`.
    pub(crate) fn module(&self) -> Vec<String> {
        module_of(&self.path)
    }

    fn walk(&mut self, tokens: TokenStream, module: &[String], depth: usize) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            at = match token {
                TokenTree::Punct(_) if attribute(&tokens, at).is_some_and(is_cfg_test) => {
                    let end = after_item(&tokens, at);
                    let item = tokens.get(at..end).unwrap_or_default();
                    self.test_modules.extend(module_elsewhere(item).map(|name| [module, &[name]].concat()));
                    end
                }
                TokenTree::Punct(_) if attribute(&tokens, at).is_some() => at + 2,
                TokenTree::Ident(_) if starts_path(&tokens, at) => {
                    self.take_path(&tokens, at, Vec::new(), module)
                }
                TokenTree::Ident(word) => {
                    let keyword = word.to_string();
                    let here = || Word { line: word.span().start().line, word: keyword.clone() };
                    if depth == 0 && ITEM_KEYWORDS.contains(&keyword.as_str()) {
                        self.items.push(here());
                    }
                    if is_call(&tokens, at) {
                        self.called.push(here());
                    }
                    match (keyword.as_str(), tokens.get(at + 1), tokens.get(at + 2)) {
                        ("mod", Some(TokenTree::Ident(name)), Some(TokenTree::Group(body))) => {
                            let inner = [module, &[name.to_string()]].concat();
                            self.walk(body.stream(), &inner, depth + 1);
                            at + 3
                        }
                        ("extern", Some(TokenTree::Ident(_)), Some(TokenTree::Ident(name))) => {
                            let segments = vec![name.to_string(), "*".into()];
                            self.named.push(NamedPath { line: name.span().start().line, segments });
                            at + 3
                        }
                        _ => at + 1,
                    }
                }
                TokenTree::Group(group) => {
                    self.walk(group.stream(), module, depth + 1);
                    at + 1
                }
                _ => at + 1,
            };
        }
    }

    /// Adds the path that starts at `at`, each leaf of it if it ends in a group, and returns where it ends.
    fn take_path(
        &mut self,
        tokens: &[TokenTree],
        mut at: usize,
        mut segments: Vec<String>,
        module: &[String],
    ) -> usize {
        let mut line = 0;
        while let Some(TokenTree::Ident(word)) = tokens.get(at) {
            line = word.span().start().line;
            segments.push(word.to_string());
            at += 1;
            if !is_path_separator(tokens, at) {
                break;
            }
            at += 2;
        }
        match tokens.get(at) {
            Some(TokenTree::Group(group))
                if is_braces(group) && is_path_separator(tokens, at.wrapping_sub(2)) =>
            {
                let leaves: Vec<TokenTree> = group.stream().into_iter().collect();
                for leaf in leaves.split(|token| matches!(token, TokenTree::Punct(p) if p.as_char() == ',')) {
                    self.take_path(leaf, 0, segments.clone(), module);
                }
                at + 1
            }
            _ => {
                if segments.len() > 1 {
                    self.named.push(NamedPath { line, segments: resolve(&segments, module) });
                }
                at
            }
        }
    }
}

/// Resolves `crate`, `self` and `super` in a path to one that starts with `crate`.
fn resolve(segments: &[String], module: &[String]) -> Vec<String> {
    let mut place: Option<Vec<String>> = None;
    let mut rest = segments;
    while let Some((first, after)) = rest.split_first() {
        match first.as_str() {
            "crate" => place = Some(Vec::new()),
            "self" => place = Some(place.unwrap_or_else(|| module.to_vec())),
            "super" => {
                let mut above = place.unwrap_or_else(|| module.to_vec());
                above.pop();
                place = Some(above);
            }
            _ => break,
        }
        rest = after;
    }
    match place {
        Some(place) => [&["crate".to_string()], place.as_slice(), rest].concat(),
        None => segments.to_vec(),
    }
}

fn module_of(path: &str) -> Vec<String> {
    let inside = path.split_once("/src/").map_or(path, |(_, inside)| inside);
    let inside = inside.trim_end_matches(".rs").trim_end_matches("/mod");
    if matches!(inside, "lib" | "main") { Vec::new() } else { inside.split('/').map(String::from).collect() }
}

fn is_path_separator(tokens: &[TokenTree], at: usize) -> bool {
    let colon = |token: Option<&TokenTree>| matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == ':');
    colon(tokens.get(at)) && colon(tokens.get(at.wrapping_add(1)))
}

/// Whether the word at `at` is a method, followed by its arguments.
fn is_call(tokens: &[TokenTree], at: usize) -> bool {
    matches!(tokens.get(at.wrapping_sub(1)), Some(TokenTree::Punct(p)) if p.as_char() == '.')
        && matches!(tokens.get(at + 1), Some(TokenTree::Group(g)) if g.delimiter() == Delimiter::Parenthesis)
}

fn starts_path(tokens: &[TokenTree], at: usize) -> bool {
    is_path_separator(tokens, at + 1) && !is_path_separator(tokens, at.wrapping_sub(2))
}

fn is_braces(group: &Group) -> bool {
    group.delimiter() == Delimiter::Brace
}

/// The brackets of the outer attribute that starts at `at`.
fn attribute(tokens: &[TokenTree], at: usize) -> Option<&Group> {
    match (tokens.get(at), tokens.get(at + 1)) {
        (Some(TokenTree::Punct(p)), Some(TokenTree::Group(group)))
            if p.as_char() == '#' && group.delimiter() == Delimiter::Bracket =>
        {
            Some(group)
        }
        _ => None,
    }
}

fn is_cfg_test(attribute: &Group) -> bool {
    attribute.stream().to_string().replace(' ', "") == "cfg(test)"
}

/// The first token after the item whose attributes start at `at`.
fn after_item(tokens: &[TokenTree], mut at: usize) -> usize {
    while attribute(tokens, at).is_some() {
        at += 2;
    }
    let head: Vec<String> = words(tokens.get(at..).unwrap_or_default()).collect();
    let has = |word: &str| head.iter().any(|found| found == word);
    // Their braces are a group of names or a value, not the end.
    let ends_in_semicolon = ["use", "extern", "static", "type", "const"].into_iter().any(has) && !has("fn");
    while tokens.get(at).is_some_and(|token| !ends_item(token, ends_in_semicolon)) {
        at += 1;
    }
    tokens.len().min(at + 1)
}

/// The words of an item up to its first braces or semicolon.
fn words(item: &[TokenTree]) -> impl Iterator<Item = String> {
    let head = item.iter().take_while(|token| !ends_item(token, false));
    head.filter_map(|token| if let TokenTree::Ident(word) = token { Some(word.to_string()) } else { None })
}

/// The name of the module, if its text is in another file.
fn module_elsewhere(item: &[TokenTree]) -> Option<String> {
    let elsewhere = matches!(item.last(), Some(TokenTree::Punct(p)) if p.as_char() == ';');
    elsewhere.then(|| words(item).skip_while(|word| word != "mod").nth(1)).flatten()
}

fn ends_item(token: &TokenTree, by_semicolon: bool) -> bool {
    match token {
        TokenTree::Punct(p) => p.as_char() == ';',
        TokenTree::Group(group) => is_braces(group) && !by_semicolon,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::Source;

    fn named(path: &str, text: &str) -> Vec<String> {
        Source::read(path, text).named.iter().map(|named| named.segments.join("::")).collect()
    }

    #[test]
    fn each_leaf_of_a_group_is_a_path() {
        let text = "use crate::{time::{Timestamp, TimeSpan}, units::Length};";
        let leaves = ["crate::time::Timestamp", "crate::time::TimeSpan", "crate::units::Length"];
        assert_eq!(named("core/src/event.rs", text), leaves);
    }

    #[test]
    fn super_leads_to_the_folder_and_beyond() {
        let text = "use super::node::Node; use super::super::ids::NodeId; mod inner { use super::super::edge::Edge; }";
        let led = ["crate::track::node::Node", "crate::ids::NodeId", "crate::track::edge::Edge"];
        assert_eq!(named("core/src/track/graph.rs", text), led);
    }

    #[test]
    fn paths_in_expressions_and_macros_count_and_comments_do_not() {
        let text = "//! std::fs\nfn f() { /* std::io */ assert!(std::env::var(\"std::fs\").is_ok()); }";
        assert_eq!(named("core/src/time.rs", text), ["std::env::var"]);
    }

    #[test]
    fn what_only_tests_see_is_left_out() {
        let text = "#[cfg(test)] extern crate std;\n#[cfg(test)] use std::{vec::Vec, fs::File};\n\
                    #[cfg(test)] mod tests { use std::fs::File; }\nuse core::fmt::Debug;";
        assert_eq!(named("core/src/time.rs", text), ["core::fmt::Debug"]);
    }

    #[test]
    fn what_only_tests_see_ends_where_it_ends() {
        let text = "#[cfg(test)] const fn f() -> u8 { std::u8::MAX } use core::fmt::Debug;";
        assert_eq!(named("core/src/time.rs", text), ["core::fmt::Debug"]);
        let text = "#[cfg(test)] static S: P = P { x: std::u8::MAX }; use core::fmt::Debug;";
        assert_eq!(named("core/src/time.rs", text), ["core::fmt::Debug"]);
    }

    #[test]
    fn a_module_of_tests_in_its_own_file_is_known() {
        let text = "mod graph; #[cfg(test)] mod example; #[cfg(test)] mod tests {}";
        let tests = Source::read("core/src/track/mod.rs", text).test_modules;
        assert_eq!(tests, [["track", "example"]]);
    }

    #[test]
    fn an_extern_crate_is_a_path() {
        assert_eq!(named("core/src/lib.rs", "extern crate std;"), ["std::*"]);
    }

    #[test]
    fn a_call_is_a_word_after_a_dot() {
        let called =
            Source::read("core/src/time.rs", "fn f(x: f64) -> f64 { x.exp() + ln(x) + self.cos }").called;
        assert_eq!(called.iter().map(|call| call.word.as_str()).collect::<Vec<_>>(), ["exp"]);
    }

    #[test]
    fn items_within_a_module_are_not_the_files_own() {
        let text = "pub struct A; mod inner { fn f() {} } #[cfg(test)] mod tests { fn g() {} }";
        let items = Source::read("core/src/track/mod.rs", text).items;
        assert_eq!(items.iter().map(|item| item.word.as_str()).collect::<Vec<_>>(), ["struct"]);
    }
}
