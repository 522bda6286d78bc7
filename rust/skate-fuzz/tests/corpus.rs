//! Plays what fuzzing has collected: inputs that together reach what it has reached, and what it found.

use std::{fs, path::Path};

/// Every file plays without breaking a law, and twice to the same end.
fn play_all(folder: &str) -> usize {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut files: Vec<_> = fs::read_dir(&folder)
        .expect("a folder")
        .map(|file| file.expect("a file").path())
        .collect();
    files.sort();
    for file in &files {
        let bytes = fs::read(file).expect("readable");
        let played = std::panic::catch_unwind(|| {
            assert!(skate_fuzz::play(&bytes) == skate_fuzz::play(&bytes));
        });
        assert!(played.is_ok(), "{}", file.display());
    }
    files.len()
}

#[test]
fn the_corpus_plays() {
    assert!(play_all("corpus/scene_and_steps") > 100);
}

#[test]
fn what_was_found_stays_mended() {
    play_all("finds");
}
