//! Instruction counts by valgrind's callgrind.

use crate::work::Item;
use std::{fs, io, path::Path, process::Command};

/// Argument with which this program runs the work to be counted.
pub const COUNT_FLAG: &str = "--counted";

/// Run a block twice; one-time costs, such as symbol resolution, are excluded from the second run.
pub fn run_twice(item: &mut Item) {
    for _ in 0..2 {
        (item.block)(&mut collected);
    }
}

/// Function to which callgrind restricts its counts; it writes a file at every call.
#[inline(never)]
fn collected(work: &mut dyn FnMut()) {
    work();
}

/// Instructions of one block of each of `items` items.
///
/// # Errors
/// Why instructions cannot be counted.
pub fn instructions(items: usize) -> Result<Vec<u64>, String> {
    let folder = std::env::temp_dir().join(format!("skate-micro-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let counts = run(&folder, items);
    let _ = fs::remove_dir_all(&folder);
    counts
}

fn run(folder: &Path, items: usize) -> Result<Vec<u64>, String> {
    let out = folder.join("out");
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let function = concat!(module_path!(), "::collected");
    let done = Command::new("valgrind")
        .args(["-q", "--tool=callgrind", "--collect-atstart=no"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(format!("--toggle-collect={function}"))
        .arg(format!("--dump-after={function}"))
        .arg(program)
        .arg(COUNT_FLAG)
        .output();
    let done = done.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => "valgrind is not installed".into(),
        _ => format!("valgrind does not start: {error}"),
    })?;
    if !done.status.success() {
        let said = String::from_utf8_lossy(&done.stderr);
        return Err(format!(
            "valgrind fails: {}",
            said.lines().last().unwrap_or("")
        ));
    }
    let second = |i: usize| total(&folder.join(format!("out.{}", 2 * i + 2)));
    (0..items).map(second).collect()
}

fn total(file: &Path) -> Result<u64, String> {
    let text =
        fs::read_to_string(file).map_err(|_| "callgrind does not see the work".to_string())?;
    let line = text.lines().find_map(|line| line.strip_prefix("totals: "));
    line.and_then(|total| total.trim().parse().ok())
        .ok_or_else(|| "callgrind left a file without totals".into())
}
