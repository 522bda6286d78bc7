//! Imports of the core point downwards: read from the `use` lines of its sources.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// From the bottom to the top, as in the documentation of the crate.
const LAYERS: [&str; 19] = [
    "error",
    "numeric",
    "integrate",
    "scene",
    "model",
    "contact",
    "dynamics",
    "control",
    "rhs",
    "events",
    "sim",
    "time_stepping",
    "advance",
    "laws",
    "lanes",
    "derivatives",
    "task",
    "batch",
    "timing",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Paths of one `use` tree: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expand(tree: &str, prefix: &str, paths: &mut Vec<String>) {
    let tree = tree.trim();
    if let Some((before, rest)) = tree.split_once('{') {
        let inner = &rest[..rest.rfind('}').expect("a closing brace")];
        let prefix = format!("{prefix}{before}");
        let (mut depth, mut start) = (0, 0);
        for (i, character) in inner.char_indices() {
            match character {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(&inner[start..i], &prefix, paths);
                    start = i + 1;
                }
                _ => {}
            }
        }
        expand(&inner[start..], &prefix, paths);
    } else if !tree.is_empty() {
        paths.push(format!("{prefix}{tree}"));
    }
}

/// What a file imports from the crate, its tests apart, as module paths from the crate's root.
fn imports(text: &str, module: &[String]) -> Vec<Vec<String>> {
    let text = text.split("#[cfg(test)]").next().unwrap_or(text);
    let mut found = Vec::new();
    for statement in text.split(';') {
        let Some(at) = statement.rfind("\nuse ") else {
            continue;
        };
        let mut paths = Vec::new();
        expand(&statement[at + 5..], "", &mut paths);
        for path in paths {
            let mut parts: Vec<_> = path
                .split("::")
                .map(|part| part.trim().to_owned())
                .collect();
            let mut base = match parts[0].as_str() {
                "crate" => Vec::new(),
                "super" => module[..module.len() - 1].to_vec(),
                _ => continue,
            };
            parts.remove(0);
            base.extend(parts);
            found.push(base);
        }
    }
    found
}

struct Source {
    name: String,
    module: Vec<String>,
    imports: Vec<Vec<String>>,
}

fn core() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    let read = |path: &PathBuf| {
        let name = path
            .strip_prefix(&root)
            .expect("in src")
            .display()
            .to_string();
        let module = name.trim_end_matches(".rs").trim_end_matches("/mod");
        let module: Vec<_> = module.split('/').map(str::to_owned).collect();
        let imports = imports(&fs::read_to_string(path).expect("text"), &module);
        Source {
            name,
            module,
            imports,
        }
    };
    let mut all: Vec<_> = paths.iter().map(read).collect();
    all.retain(|source| source.name != "lib.rs" && !source.name.ends_with("tests.rs"));
    all
}

#[test]
fn every_import_points_down() {
    let level = |module: &str| {
        let level = LAYERS.iter().position(|layer| *layer == module);
        level.unwrap_or_else(|| panic!("{module} is not in LAYERS"))
    };
    let (mut read, mut upward) = (0, Vec::new());
    for Source {
        name,
        module,
        imports,
    } in core()
    {
        for import in imports {
            read += 1;
            if level(&import[0]) > level(&module[0]) {
                upward.push(format!("{name} imports {}", import.join("::")));
            }
        }
    }
    assert!(read > 400, "only {read} imports were read");
    assert!(upward.is_empty(), "{upward:#?}");
}

/// A `mod.rs` holds the type that the files of its folder extend, so it stands apart.
#[test]
fn files_of_a_folder_form_no_circle() {
    let sources = core();
    let parts: BTreeMap<_, _> = sources
        .iter()
        .filter(|source| !source.name.ends_with("mod.rs"))
        .map(|source| (source.module.clone(), source))
        .collect();
    let mut below: BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> = BTreeMap::new();
    for (module, source) in &parts {
        for import in &source.imports {
            let target = (1..=import.len())
                .rev()
                .find_map(|n| parts.get_key_value(&import[..n]));
            if let Some((target, _)) = target.filter(|(target, _)| *target != module) {
                below.entry(module).or_default().insert(target);
            }
        }
    }
    let mut left: BTreeSet<_> = parts.keys().collect();
    loop {
        let free: Vec<_> = left
            .iter()
            .filter(|module| {
                below
                    .get(*module)
                    .is_none_or(|targets| targets.is_disjoint(&left))
            })
            .copied()
            .collect();
        if free.is_empty() {
            break;
        }
        free.iter().for_each(|module| {
            left.remove(module);
        });
    }
    assert!(left.is_empty(), "in or above a circle: {left:#?}");
}
