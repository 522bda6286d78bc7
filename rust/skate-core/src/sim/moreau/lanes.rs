//! Many simulations on their way at once, in the lanes of vector registers: they take whatever motions are
//! wanted, those of one contact state together where they can.

use crate::{
    control::ControllerInput,
    dynamics::delassus::rows,
    error::Termination,
    model::{
        Model,
        contact_mode::{ContactMode, Foot},
        lanes::{Broadcast, ModelLanes, PerLane},
        layout::NV,
    },
    numeric::{
        scalar::{MAX_LANES, Scalar},
        simd::{SimdTask, Width},
    },
    rhs::{Evaluation, Stance, ankle_to_point, pivot_to_ankle},
    sim::{
        Simulation,
        moreau::{
            StepDriver, middle,
            step::{MoreauStep, glide},
            step_contacts::{Freedom, StepContacts},
        },
    },
};
use std::{mem, sync::Arc};

/// So many go their way together: enough to fill the lanes with those of one contact state, few enough that
/// their states stay in the processor's nearer caches. Who arrives makes room for the next.
pub(crate) const MAX_BATCH: usize = 64;

/// Somebody whose simulation is to be advanced.
pub trait HasSimulation {
    fn sim(&self) -> &Simulation;
    fn sim_mut(&mut self) -> &mut Simulation;
}

impl HasSimulation for &mut Simulation {
    fn sim(&self) -> &Simulation {
        self
    }

    fn sim_mut(&mut self) -> &mut Simulation {
        self
    }
}

/// Advance simulations of one structure by time steps, each to its own time, and hand back who has `arrived`,
/// in no order; at `most` so many are under way. What becomes of one does not depend on the others.
pub fn advance_many<P: HasSimulation>(
    passengers: impl Iterator<Item = (P, f64)>,
    (width, most): (Width, usize),
    mut arrived: impl FnMut(P),
) {
    if width.lanes() == 1 {
        passengers.for_each(|(mut passenger, until)| {
            passenger.sim_mut().advance_by_steps(until);
            arrived(passenger);
        });
    } else {
        width.run(Journey {
            passengers,
            most: most.min(MAX_BATCH),
            arrived,
        });
    }
}

struct Journey<I, A> {
    passengers: I,
    most: usize,
    arrived: A,
}

impl<P: HasSimulation, I: Iterator<Item = (P, f64)>, A: FnMut(P)> SimdTask for Journey<I, A> {
    #[inline(always)]
    fn run<T: Scalar>(mut self) {
        let mut workspace = Workspace::<T>::default();
        let mut crowd = [const { None }; MAX_BATCH];
        let mut wanting = [Order::default(); MAX_BATCH];
        loop {
            let n = self.gather(&mut crowd, &mut wanting);
            if n == 0 {
                break;
            }
            for lanes in wanting[..n].chunks(T::LANES) {
                if lanes.len() > T::LANES / 4 {
                    together(&mut workspace, &mut crowd, lanes);
                } else {
                    for &order in lanes {
                        traveller(&mut crowd, order).alone();
                    }
                }
            }
        }
    }
}

/// What the motions of a register full of robots are computed in.
#[derive(Default)]
struct Workspace<T: Scalar> {
    eval: Evaluation<T>,
    step: MoreauStep<T>,
    /// Where they end, robot by robot.
    q: [[f64; NV]; MAX_LANES],
    v: [[f64; NV]; MAX_LANES],
}

/// A simulation and where it is going.
struct Traveller<P> {
    passenger: P,
    way: StepDriver,
}

/// Somebody who wants to move on: after what they are ordered, then their place in the crowd.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Order(u32);

impl Order {
    fn new(mode: ContactMode, place: usize) -> Self {
        let foot = |foot: Foot| {
            (foot.touch as u32) << 3 | (foot.friction_mode as u32) << 1 | u32::from(foot.pulled)
        };
        Self(foot(mode.free) << 16 | foot(mode.support) << 8 | place as u32)
    }

    fn slot(self) -> usize {
        (self.0 & 0xff) as usize
    }
}

impl<P: HasSimulation, I: Iterator<Item = (P, f64)>, A: FnMut(P)> Journey<I, A> {
    /// All that want to move on, ordered by contact state, and how many. What one can only do alone it does;
    /// where one has arrived the next takes its place.
    #[inline(never)]
    fn gather(
        &mut self,
        crowd: &mut [Option<Traveller<P>>; MAX_BATCH],
        wanting: &mut [Order; MAX_BATCH],
    ) -> usize {
        let mut n = 0;
        for (i, place) in crowd[..self.most].iter_mut().enumerate() {
            loop {
                let Some(traveller) = place else {
                    let Some((mut passenger, until)) = self.passengers.next() else {
                        break;
                    };
                    let way = StepDriver::to(passenger.sim_mut(), until);
                    *place = Some(Traveller { passenger, way });
                    continue;
                };
                if let Some(mode) = traveller.wish_together() {
                    wanting[n] = Order::new(mode, i);
                    n += 1;
                    break;
                }
                traveller.way.end(traveller.passenger.sim_mut());
                if let Some((next, until)) = self.passengers.next() {
                    (self.arrived)(mem::replace(&mut traveller.passenger, next));
                    traveller.way.set_out(traveller.passenger.sim_mut(), until);
                } else if let Some(Traveller { passenger, .. }) = place.take() {
                    (self.arrived)(passenger);
                }
            }
        }
        wanting[..n].sort_unstable();
        n
    }
}

fn traveller<P>(crowd: &mut [Option<Traveller<P>>], order: Order) -> &mut Traveller<P> {
    let traveller = crowd[order.slot()].as_mut();
    traveller.expect("it wants to move on")
}

impl<P: HasSimulation> Traveller<P> {
    /// The contact state from which it wants to go on in company.
    fn wish_together(&mut self) -> Option<ContactMode> {
        loop {
            let sim = self.passenger.sim_mut();
            let mode = self.way.wish(sim)?.start.mode;
            // A controller that has not noticed a swap counts the joints otherwise.
            if !ControllerInput::of(&sim.state).mirrored {
                return Some(mode);
            }
            self.alone();
        }
    }

    fn alone(&mut self) {
        let sim = self.passenger.sim_mut();
        let mode = sim.glide(&self.way.step.wish);
        self.way.after(sim, mode);
    }
}

/// Motions of as many as there are lanes, at most.
#[inline(always)]
fn together<T: Scalar, P: HasSimulation>(
    workspace: &mut Workspace<T>,
    crowd: &mut [Option<Traveller<P>>],
    lanes: &[Order],
) {
    let (moved, outcomes) = {
        // Lanes that nobody needs repeat the first.
        let mut sims: [Option<&Traveller<P>>; MAX_LANES] = [None; MAX_LANES];
        for (lane, sim) in sims[..T::LANES].iter_mut().enumerate() {
            let order = lanes[if lane < lanes.len() { lane } else { 0 }];
            *sim = crowd[order.slot()].as_ref();
        }
        let sims = sims.map(|sim| sim.or(crowd[lanes[0].slot()].as_ref()));
        let sims = sims.map(|sim| sim.expect("it wants to move on"));
        let models = sims.map(|sim| &sim.passenger.sim().model);
        let shared = models[0];
        let alike = models.iter().all(|model| Arc::ptr_eq(shared, model));
        if alike {
            side_by_side(workspace, Broadcast(shared), &sims)
        } else {
            let models: [&Model; MAX_LANES] = models.map(|model| &**model);
            side_by_side(workspace, PerLane(&models), &sims)
        }
    };
    let Workspace { eval, step, q, v } = workspace;
    if moved {
        T::to_rows(&step.end.q, q);
        T::to_rows(&step.end.v, v);
    }
    for (lane, &order) in lanes.iter().enumerate() {
        let Traveller { passenger, way } = traveller(crowd, order);
        let sim = passenger.sim_mut();
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
fn side_by_side<T: Scalar, R: ModelLanes<T>, P: HasSimulation>(
    Workspace { eval, step, .. }: &mut Workspace<T>,
    models: R,
    sims: &[&Traveller<P>; MAX_LANES],
) -> (bool, [Result<ContactMode, Termination>; MAX_LANES]) {
    let wishes = sims.map(|sim| &sim.way.step.wish);
    let start = &mut step.start;
    T::from_rows(&wishes.map(|wish| &wish.start.q), &mut start.q);
    T::from_rows(&wishes.map(|wish| &wish.start.v), &mut start.v);
    start.anchor = T::from_lanes(|i| wishes[i].start.anchor);
    start.energies = [
        T::from_lanes(|i| wishes[i].start.energy_balance.actuators),
        T::from_lanes(|i| wishes[i].start.energy_balance.damping),
        T::from_lanes(|i| wishes[i].start.energy_balance.friction),
    ];
    let residuals = sims.map(|sim| &sim.passenger.sim().residual);
    T::from_rows(&residuals, &mut step.residual);
    step.h = T::from_lanes(|i| wishes[i].h);
    let modes: [ContactMode; MAX_LANES] = wishes.map(|wish| wish.start.mode);
    let freedom: [Freedom; MAX_LANES] = wishes.map(|wish| wish.freedom);
    let now: [ControllerInput; MAX_LANES] = wishes.map(|wish| middle(&wish.start, wish.h));
    let pivots: [[f64; 2]; MAX_LANES] =
        std::array::from_fn(|i| pivot_to_ankle(models.lane(i % T::LANES), modes[i].support.touch));
    let stance = Stance {
        pivot_to_ankle: [
            T::from_lanes(|i| pivots[i][0]),
            T::from_lanes(|i| pivots[i][1]),
        ],
        ankle_to_point: T::from_lanes(|i| ankle_to_point(models.lane(i), modes[i].free.touch)),
        rows: modes[..T::LANES]
            .iter()
            .map(|mode| rows(mode.free.touch))
            .fold(0, usize::max),
    };
    let mut feet = StepContacts::new(models, &modes[..T::LANES], &freedom[..T::LANES]);
    let moved = glide(eval, &mut feet, step, &stance, &now[..T::LANES]);
    (moved, std::array::from_fn(|i| feet.outcome(i)))
}
