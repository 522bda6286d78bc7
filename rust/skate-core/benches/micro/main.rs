//! Micro benchmarks: `cargo bench -p skate-core` prints the time of the engine's operations and, if
//! valgrind is installed, their instruction counts.
//!
//! The speed of a machine varies by tens of per cent within a second. Therefore short blocks of all items
//! alternate, so that all items run under the same conditions, and the minimum over many rounds is the time
//! on an idle machine. Benchmark libraries measure the items one after the other.

mod count;
mod work;

use std::{
    io::{IsTerminal, Write, stderr},
    time::{Duration, Instant},
};
use work::Item;

const ROUNDS: u32 = 400;
/// Blocks that take longer run in fewer rounds, at least `MIN_ROUNDS`.
const BLOCK_TIME: Duration = Duration::from_millis(1);
const MIN_ROUNDS: u32 = 20;

fn main() {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("--bench") => table(),
        // `count` runs this program under valgrind.
        Some(count::COUNT_FLAG) => work::all().iter_mut().for_each(count::run_twice),
        // `cargo test --all-targets` runs this program as well.
        _ => {}
    }
}

fn table() {
    let mut items = work::all();
    let times = minimum_times(&mut items);
    let instructions = count::instructions(items.len());
    let missing = instructions.as_ref().err().cloned();
    let counts = instructions.unwrap_or_default();
    println!("{:48} {:>12} {:>14}", "scene paper", "ns", "instructions");
    for (i, item) in items.iter().enumerate() {
        let count = counts.get(i).map_or("-".into(), |all| {
            format!("{:.0}", *all as f64 / f64::from(item.units))
        });
        println!("{:48} {:>12.1} {count:>14}", item.name, times[i]);
    }
    if let Some(why) = missing {
        println!("no instructions: {why}");
    }
}

/// Minimum time of every item, per unit [ns].
fn minimum_times(items: &mut [Item]) -> Vec<f64> {
    let first: Vec<_> = items.iter_mut().map(time).collect();
    let turns = first
        .iter()
        .map(|elapsed| elapsed.as_nanos().div_ceil(BLOCK_TIME.as_nanos()));
    let every: Vec<_> = turns
        .map(|turns| turns.clamp(1, u128::from(ROUNDS / MIN_ROUNDS)))
        .collect();
    let mut least = first;
    for round in 0..ROUNDS {
        for (i, item) in items.iter_mut().enumerate() {
            if u128::from(round) % every[i] == 0 {
                least[i] = least[i].min(time(item));
            }
        }
        if stderr().is_terminal() {
            eprint!("\r{:3} %", 100 * (round + 1) / ROUNDS);
            let _ = stderr().flush();
        }
    }
    if stderr().is_terminal() {
        eprintln!();
    }
    let per_unit =
        |(elapsed, item): (&Duration, &Item)| elapsed.as_secs_f64() * 1e9 / f64::from(item.units);
    least.iter().zip(items.iter()).map(per_unit).collect()
}

/// Time of a block, without its preparation.
fn time(item: &mut Item) -> Duration {
    let mut elapsed = Duration::ZERO;
    (item.block)(&mut |work| {
        let started = Instant::now();
        work();
        elapsed = started.elapsed();
    });
    elapsed
}
