//! Distribution of simulations to registers: those with a step to compute are sorted by contact mode and share
//! registers, whatever computes their steps.

use crate::{
    model::contact_mode::{ContactMode, Foot},
    numeric::simd::{Register, SimdTask, Width},
    sim::Simulation,
};
use std::{marker::PhantomData, mem, ops::DerefMut};

/// Maximum number of simulations that are advanced at a time: enough to fill the lanes, few enough to keep their states
/// in the processor's caches.
pub(crate) const MAX_BATCH: usize = 64;
/// The same where simulations wait for others in their contact mode.
pub(crate) const MAX_WAITING_BATCH: usize = 256;

/// Advances one simulation to a time, step by step. The steps are computed alone or in lanes, with the same bits.
pub trait LaneDriver: Sized {
    /// Workspace of one register of simulations.
    type Workspace<T: Register>;
    /// Simulations in different contact modes may share a register. Otherwise, where they are many, each waits until its
    /// contact mode fills one.
    const MIXES_MODES: bool;

    /// Driver from the present state to the time `until` [s].
    fn new(sim: &mut Simulation, until: f64) -> Self;

    /// Start anew for another simulation of the same structure.
    fn start(&mut self, sim: &mut Simulation, until: f64);

    /// Contact mode of the next step; None at the end. Steps that cannot be computed in lanes are computed here.
    fn next_mode(&mut self, sim: &mut Simulation) -> Option<ContactMode>;

    /// Make the next step alone.
    fn step_scalar(&mut self, sim: &mut Simulation);

    /// Complete the simulation's state at the end.
    fn finish(&mut self, sim: &mut Simulation);

    /// Workspace for simulations like `sim`.
    fn workspace<T: Register>(sim: &Simulation) -> Self::Workspace<T>;

    /// Make the next steps of at most as many simulations as there are lanes.
    fn step_register<T: Register, P: DerefMut<Target = Simulation>>(
        workspace: &mut Self::Workspace<T>,
        active: &mut [Option<Active<P, Self>>],
        keys: &[LaneKey],
    );
}

/// Advance simulations of one structure, each to its own end time, at most `max_batch` and `N` at once. `done` receives
/// the owners of finished simulations in arbitrary order. Results do not depend on the other simulations.
pub(crate) fn advance_in_lanes<D: LaneDriver, P, const N: usize>(
    owners: impl Iterator<Item = (P, f64)>,
    (width, max_batch): (Width, usize),
    done: impl FnMut(P),
) where
    P: DerefMut<Target = Simulation>,
{
    width.run(BatchAdvance::<_, _, _, N> {
        owners,
        max_batch: max_batch.min(N),
        done,
        driver: PhantomData::<D>,
    });
}

struct BatchAdvance<I, A, D, const N: usize> {
    owners: I,
    max_batch: usize,
    done: A,
    driver: PhantomData<D>,
}

impl<D, P, I, A, const N: usize> SimdTask for BatchAdvance<I, A, D, N>
where
    D: LaneDriver,
    P: DerefMut<Target = Simulation>,
    I: Iterator<Item = (P, f64)>,
    A: FnMut(P),
{
    fn run_scalar(mut self) {
        self.owners.for_each(|(mut owner, until)| {
            owner.advance(until);
            (self.done)(owner);
        });
    }

    fn run_simd<T: Register>(mut self) {
        const { assert!(N <= 1 << 8, "slots have eight bits of a key") };
        let mut workspace = None;
        let mut active = [const { None }; N];
        let mut ready = [LaneKey::default(); N];
        loop {
            let n = self.collect_ready(&mut active, &mut ready);
            let Some(&first) = ready[..n].first() else {
                break;
            };
            let workspace = workspace
                .get_or_insert_with(|| D::workspace::<T>(&active_in(&mut active, first).owner));
            let together = |a: &LaneKey, b: &LaneKey| D::MIXES_MODES || a.mode() == b.mode();
            let chunks = || {
                let groups = ready[..n].chunk_by(together);
                groups.flat_map(|keys| keys.chunks(T::LANES))
            };
            // Where simulations are many, only the fullest registers are computed; the others wait.
            let least = if !D::MIXES_MODES && n > MAX_BATCH {
                chunks().map(<[LaneKey]>::len).max().unwrap_or(0)
            } else {
                0
            };
            for keys in chunks().filter(|keys| keys.len() >= least) {
                if keys.len() > T::LANES / 4 {
                    D::step_register(workspace, &mut active, keys);
                } else {
                    for &key in keys {
                        let Active { owner, driver } = active_in(&mut active, key);
                        driver.step_scalar(owner);
                    }
                }
            }
        }
    }
}

/// A simulation that is being advanced.
pub struct Active<P, D> {
    pub owner: P,
    pub driver: D,
}

/// Sort key of a simulation with a step to compute: its contact mode, then its slot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct LaneKey(u32);

impl LaneKey {
    fn new(mode: ContactMode, slot: usize) -> Self {
        let foot = |foot: Foot| {
            (foot.touch as u32) << 3 | (foot.friction_mode as u32) << 1 | u32::from(foot.pulled)
        };
        Self(foot(mode.free) << 16 | foot(mode.support) << 8 | slot as u32)
    }

    fn slot(self) -> usize {
        (self.0 & 0xff) as usize
    }

    fn mode(self) -> u32 {
        self.0 >> 8
    }
}

impl<D, P, I, A, const N: usize> BatchAdvance<I, A, D, N>
where
    D: LaneDriver,
    P: DerefMut<Target = Simulation>,
    I: Iterator<Item = (P, f64)>,
    A: FnMut(P),
{
    /// Sort the simulations with a step to compute by contact mode and return their number. Finished simulations are
    /// replaced by the next ones.
    #[inline(never)]
    fn collect_ready(
        &mut self,
        active: &mut [Option<Active<P, D>>; N],
        ready: &mut [LaneKey; N],
    ) -> usize {
        let mut n = 0;
        for (i, slot) in active[..self.max_batch].iter_mut().enumerate() {
            loop {
                let Some(Active { owner, driver }) = slot else {
                    let Some((mut owner, until)) = self.owners.next() else {
                        break;
                    };
                    let driver = D::new(&mut owner, until);
                    *slot = Some(Active { owner, driver });
                    continue;
                };
                if let Some(mode) = driver.next_mode(owner) {
                    ready[n] = LaneKey::new(mode, i);
                    n += 1;
                    break;
                }
                driver.finish(owner);
                if let Some((next, until)) = self.owners.next() {
                    (self.done)(mem::replace(owner, next));
                    driver.start(owner, until);
                } else if let Some(Active { owner, .. }) = slot.take() {
                    (self.done)(owner);
                }
            }
        }
        ready[..n].sort_unstable();
        n
    }
}

/// The simulation of a key.
pub fn active_in<P, D>(active: &mut [Option<Active<P, D>>], key: LaneKey) -> &mut Active<P, D> {
    let simulation = active[key.slot()].as_mut();
    simulation.expect("a step to compute")
}

/// The simulations of a register's lanes; unused lanes repeat the first.
pub fn in_lanes<'a, P, D>(
    active: &'a [Option<Active<P, D>>],
    keys: &[LaneKey],
    lane: usize,
) -> &'a Active<P, D> {
    let key = keys[if lane < keys.len() { lane } else { 0 }];
    active[key.slot()].as_ref().expect("a step to compute")
}
