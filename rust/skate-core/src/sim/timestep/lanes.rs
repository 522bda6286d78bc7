//! Many simulations on their way at once, in the lanes of vector registers: they take whatever motions are
//! wanted, those of one contact state together where they can.

use super::{
    Underway,
    feet::{Feet, Freedom},
    glide::{Glide, glide},
    middle,
};
use crate::{
    contact::{Foot, Mode},
    control::Situation,
    error::EndCause,
    evaluate::{Evaluation, Stance, ankle_to_point, pivot_to_ankle},
    factored::rows,
    lanes::{Width, Work},
    model::{Alike, Each, Model, NV, Robots},
    real::{MOST_LANES, Real},
    sim::Simulation,
};
use std::sync::Arc;

/// So many go their way together: enough to fill most lanes, few enough that their states stay in the
/// processor's nearer caches.
pub const TOGETHER: usize = 64;

/// Advance simulations of one structure by time steps, each to its own time. What becomes of one does not
/// depend on the others.
pub fn advance_many<'a>(sims: impl Iterator<Item = (&'a mut Simulation, f64)>, width: Width) {
    if width.lanes() == 1 {
        sims.for_each(|(sim, until)| sim.advance_by_steps(until));
    } else {
        width.run(Journey(sims));
    }
}

struct Journey<I>(I);

impl<'a, I: Iterator<Item = (&'a mut Simulation, f64)>> Work for Journey<I> {
    #[inline(always)]
    fn run<T: Real>(self) {
        let mut workspace = (Evaluation::<T>::default(), Glide::<T>::default());
        let mut crowd = [const { None }; TOGETHER];
        let mut sims = self.0;
        loop {
            let mut n = 0;
            for (sim, until) in sims.by_ref().take(TOGETHER) {
                let way = Underway::to(sim, until);
                crowd[n] = Some(Traveller { sim, way });
                n += 1;
            }
            if n == 0 {
                break;
            }
            // The one place where it is called: it is long, and inlined.
            travel(&mut workspace, &mut crowd[..n]);
        }
    }
}

/// What the motions of a register full of robots are computed in.
type Workspace<T> = (Evaluation<T>, Glide<T>);

/// A simulation and where it is going.
struct Traveller<'a> {
    sim: &'a mut Simulation,
    way: Underway,
}

/// Those who want to move on: after what they are ordered, and their place in the crowd.
type Order = (u16, u8);

/// Bring all to their ends.
#[inline(always)]
fn travel<T: Real>(workspace: &mut Workspace<T>, crowd: &mut [Option<Traveller<'_>>]) {
    let mut wanting = [(0, 0); TOGETHER];
    loop {
        let n = gather(crowd, &mut wanting);
        if n == 0 {
            break;
        }
        for lanes in wanting[..n].chunks(T::LANES) {
            if lanes.len() > T::LANES / 4 {
                together(workspace, crowd, lanes);
            } else {
                lanes.iter().for_each(|&(_, i)| traveller(crowd, i).alone());
            }
        }
    }
    for Traveller { sim, way } in crowd.iter_mut().flatten() {
        way.end(sim);
    }
}

/// All that want to move on, ordered by contact state, and how many. What one can only do alone it does.
#[inline(never)]
fn gather(crowd: &mut [Option<Traveller<'_>>], wanting: &mut [Order; TOGETHER]) -> usize {
    let mut n = 0;
    for (i, traveller) in crowd.iter_mut().flatten().enumerate() {
        if let Some(mode) = traveller.wish_together() {
            wanting[n] = (order(mode), i as u8);
            n += 1;
        }
    }
    wanting[..n].sort_unstable();
    n
}

fn order(mode: Mode) -> u16 {
    let foot =
        |foot: Foot| (foot.touch as u16) << 3 | (foot.grip as u16) << 1 | u16::from(foot.pulled);
    foot(mode.free) << 8 | foot(mode.support)
}

fn traveller<'a, 'b>(crowd: &'a mut [Option<Traveller<'b>>], i: u8) -> &'a mut Traveller<'b> {
    crowd[usize::from(i)].as_mut().expect("it wants to move on")
}

impl Traveller<'_> {
    /// The contact state from which it wants to go on in company.
    fn wish_together(&mut self) -> Option<Mode> {
        loop {
            let mode = self.way.wish(self.sim)?.start.mode;
            // A controller that has not noticed a swap counts the joints otherwise.
            if !Situation::of(&self.sim.state).mirrored {
                return Some(mode);
            }
            self.alone();
        }
    }

    fn alone(&mut self) {
        let mode = self.sim.glide(&self.way.step.wish);
        self.way.after(self.sim, mode);
    }
}

/// Motions of as many as there are lanes, at most.
#[inline(always)]
fn together<T: Real>(
    workspace: &mut Workspace<T>,
    crowd: &mut [Option<Traveller<'_>>],
    lanes: &[Order],
) {
    let (moved, outcomes) = {
        // Lanes that nobody needs repeat the first.
        let mut sims: [Option<&Traveller<'_>>; MOST_LANES] = [None; MOST_LANES];
        for (lane, sim) in sims[..T::LANES].iter_mut().enumerate() {
            let (_, i) = lanes[if lane < lanes.len() { lane } else { 0 }];
            *sim = crowd[usize::from(i)].as_ref();
        }
        let sims = sims.map(|sim| sim.or(crowd[usize::from(lanes[0].1)].as_ref()));
        let sims = sims.map(|sim| sim.expect("it wants to move on"));
        let shared = &sims[0].sim.model;
        let alike = sims.iter().all(|sim| Arc::ptr_eq(shared, &sim.sim.model));
        if alike {
            side_by_side(workspace, Alike(shared), &sims)
        } else {
            let models: [&Model; MOST_LANES] = sims.map(|sim| &*sim.sim.model);
            side_by_side(workspace, Each(&models), &sims)
        }
    };
    let (eval, step) = workspace;
    let mut q = [[0.0; NV]; MOST_LANES];
    let mut v = q;
    if moved {
        T::to_rows(&step.end.q, &mut q);
        T::to_rows(&step.end.v, &mut v);
    }
    for (lane, &(_, i)) in lanes.iter().enumerate() {
        let Traveller { sim, way } = traveller(crowd, i);
        let moved = moved.then_some((&*step, &q[lane], &v[lane]));
        sim.take_glided(&way.step.wish, outcomes[lane], moved, lane);
        if way.step.wants_problem() {
            sim.eval.factored.problem = eval.factored.problem.lane(lane);
        }
        way.after(sim, outcomes[lane]);
    }
}

/// The motions of these simulations, and what their feet do.
#[inline(always)]
fn side_by_side<T: Real, R: Robots<T>>(
    (eval, step): &mut Workspace<T>,
    robots: R,
    sims: &[&Traveller<'_>; MOST_LANES],
) -> (bool, [Result<Mode, EndCause>; MOST_LANES]) {
    let wishes = sims.map(|sim| &sim.way.step.wish);
    let start = &mut step.start;
    T::from_rows(&wishes.map(|wish| &wish.start.q), &mut start.q);
    T::from_rows(&wishes.map(|wish| &wish.start.v), &mut start.v);
    start.anchor = T::from_lanes(|i| wishes[i].start.anchor);
    start.energies = [
        T::from_lanes(|i| wishes[i].start.ledger.actuators),
        T::from_lanes(|i| wishes[i].start.ledger.damping),
        T::from_lanes(|i| wishes[i].start.ledger.friction),
    ];
    T::from_rows(&sims.map(|sim| &sim.sim.residual), &mut step.residual);
    step.h = T::from_lanes(|i| wishes[i].h);
    let modes: [Mode; MOST_LANES] = wishes.map(|wish| wish.start.mode);
    let freedom: [Freedom; MOST_LANES] = wishes.map(|wish| wish.freedom);
    let now: [Situation; MOST_LANES] = wishes.map(|wish| middle(&wish.start, wish.h));
    let pivots: [[f64; 2]; MOST_LANES] =
        std::array::from_fn(|i| pivot_to_ankle(robots.lane(i % T::LANES), modes[i].support.touch));
    let stance = Stance {
        pivot_to_ankle: [
            T::from_lanes(|i| pivots[i][0]),
            T::from_lanes(|i| pivots[i][1]),
        ],
        ankle_to_point: T::from_lanes(|i| ankle_to_point(robots.lane(i), modes[i].free.touch)),
        rows: modes[..T::LANES]
            .iter()
            .map(|mode| rows(mode.free.touch))
            .fold(0, usize::max),
    };
    let mut feet = Feet::new(robots, &modes[..T::LANES], &freedom[..T::LANES]);
    let moved = glide(eval, &mut feet, step, &stance, &now[..T::LANES]);
    (moved, std::array::from_fn(|i| feet.outcome(i)))
}
