//! Replays the fuzzing corpus and all findings.

use std::{fs, path::Path};

/// Every file runs without violating a property, and twice with the same result.
fn run_all(folder: &str) -> usize {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut files: Vec<_> = fs::read_dir(&folder)
        .expect("a folder")
        .map(|file| file.expect("a file").path())
        .collect();
    files.sort();
    for file in &files {
        let bytes = fs::read(file).expect("readable");
        let played = std::panic::catch_unwind(|| {
            assert!(skate_fuzz::run_input(&bytes) == skate_fuzz::run_input(&bytes));
        });
        assert!(played.is_ok(), "{}", file.display());
    }
    files.len()
}

#[test]
fn the_corpus_runs() {
    assert!(run_all("corpus/scene_and_steps") > 100);
}

#[test]
fn findings_stay_fixed() {
    run_all("finds");
}
