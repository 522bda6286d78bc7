//! Memory that a batch takes, and memory that there is.

use crate::{
    batch::Outcome,
    derivatives::state_size,
    error::Invalid,
    model::Model,
    sim::Simulation,
    task::{Episode, MEMORY, Task},
};
use std::{fs, hint::black_box};

/// Times that the matrices of an action are held: in the engine, as arrays, and as much again for the work.
const MATRICES: usize = 3;

/// Memory of one episode with full logs, of its draft during a reset, and of its outcome [bytes].
fn episode_size(task: &Task) -> usize {
    // An episode with drawn parameters has a model of its own.
    let own_model = !task.scene().randomise.is_empty();
    let model = if own_model { size_of::<Model>() } else { 0 };
    2 * size_of::<Episode>() + Simulation::LOG_SIZE + size_of::<Outcome>() + model
}

/// Check that `n` episodes fit into the available memory.
///
/// # Errors
/// `Invalid`, which names both sizes.
pub(super) fn check(task: &Task, n: usize) -> Result<(), Invalid> {
    check_size("", episode_size(task), n)
}

/// The same for the derivatives of an action of each of `n` episodes.
pub(super) fn check_derivatives(task: &Task, n: usize) -> Result<(), Invalid> {
    let state = state_size(task.model.n) + MEMORY;
    let columns = state + task.joints() + task.observation.len();
    let each = MATRICES * size_of::<f64>() * state * columns;
    check_size("derivatives of ", each, n)
}

fn check_size(what: &str, each: usize, n: usize) -> Result<(), Invalid> {
    let total = each.saturating_mul(n);
    let available = available();
    let fits = available.is_none_or(|available| total as u64 <= available);
    if fits && can_reserve(total) {
        return Ok(());
    }
    let there_is = match available {
        Some(available) if !fits => format!("{:.3e} bytes are available", available as f64),
        _ => "the system does not provide it".into(),
    };
    Err(Invalid(format!(
        "{what}{n} environments take {:.3e} bytes of memory, {each} bytes each; {there_is}",
        each as f64 * n as f64
    )))
}

/// Whether the address space has room for `size` bytes; a limit on it is not part of `available`.
fn can_reserve(size: usize) -> bool {
    let mut trial = Vec::<u8>::new();
    // Otherwise the compiler removes the allocation.
    black_box(&mut trial).try_reserve_exact(size).is_ok()
}

/// Available memory of the machine, or of the control group if that is less [bytes]; None where the system does not
/// tell.
fn available() -> Option<u64> {
    let of_machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text
            .lines()
            .find(|line| line.starts_with("MemAvailable:"))?;
        let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
        Some(1024 * kibibytes)
    });
    of_machine.into_iter().chain(of_group()).min()
}

/// Available memory of the control group (Linux, version 2) [bytes].
fn of_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |name: &str| -> Option<u64> {
        let text = fs::read_to_string(format!("/sys/fs/cgroup{path}/{name}")).ok()?;
        text.trim().parse().ok()
    };
    Some(read("memory.max")?.saturating_sub(read("memory.current")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{scene::Scene, task::Weights};

    #[test]
    fn a_batch_that_does_not_fit_is_refused_with_both_sizes() {
        let scene = Scene::from_toml(include_str!("../../../../skate_env/scenes/paper.toml"));
        let task =
            Task::new(scene.expect("a scene"), vec![1.0; 16], Weights::default()).expect("a task");
        assert_eq!(check(&task, 1), Ok(()));
        assert_eq!(check_derivatives(&task, 1), Ok(()));
        let refused = check_derivatives(&task, 1_000_000_000).expect_err("too many");
        assert!(
            refused
                .0
                .starts_with("derivatives of 1000000000 environments take")
        );
        // 1e9 fit into the address space, but into no memory; the others overflow.
        for n in [1_000_000_000, 1 << 60, usize::MAX] {
            let refused = check(&task, n).expect_err("too many").0;
            assert!(
                refused.starts_with(&format!("{n} environments take")),
                "{refused}"
            );
        }
    }
}
