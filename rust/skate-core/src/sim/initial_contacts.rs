//! The ends of the soles that are on the ice at a start.

use crate::{
    error::Invalid,
    events::guard::GAP_TOLERANCE,
    model::contact_mode::{End, FREE, SUPPORT, SoleContact},
    sim::Simulation,
};

/// Height and speed up to which an end of a sole is on the ice.
#[derive(Debug, Clone, Copy)]
struct Closeness {
    /// [m]
    height: f64,
    /// [m/s]
    speed: f64,
}

/// Event-driven motions keep closed ends within 1e-12 m and 1e-10 m/s. An end that rises faster has left the ice.
const AT_EVENTS: Closeness = Closeness {
    height: 1e-9,
    speed: 1e-9,
};
/// What single precision adds.
const ROUNDED: Closeness = Closeness {
    height: 1e-6,
    speed: 1e-5,
};
/// Time steps satisfy the constraints of velocities at the middle of the step, and locate landings to 1e-5 m.
const BY_STEPS: Closeness = Closeness {
    height: 1e-8,
    speed: 0.25,
};
const DEPTH_BY_STEPS: f64 = 2e-5;

const ENDS: [[&str; 2]; 2] = [
    ["supporting heel", "supporting toe"],
    ["free heel", "free toe"],
];

/// Contacts of a start. Arrays are indexed by foot, `SUPPORT` and `FREE`.
#[derive(Debug, Clone, Copy)]
pub(super) struct InitialContacts {
    /// Ends that rest on the ice; at an impact, all ends on the ice.
    pub closed: [SoleContact; 2],
    /// These, and ends that rise from slightly below the ice.
    pub touching: [SoleContact; 2],
    /// Speeds up to which the feet rest on the ice [m/s]. That of a supporting foot at rest is zero.
    pub rest: [f64; 2],
    /// Closed ends approach the ice, and not only by rounding.
    pub is_impact: bool,
    /// Touching ends are off the ice by more than the accuracy of a motion.
    pub is_off: bool,
    /// Closed ends move by more than that.
    pub is_moving: bool,
}

impl Simulation {
    /// Contacts of the start with the present sole points.
    ///
    /// # Errors
    /// `Invalid` if an end is below the ice, or the supporting foot above the ice in two-way contact.
    pub(super) fn initial_contacts(&self) -> Result<InitialContacts, Invalid> {
        let contact = self.model.contact;
        let (gaps, speeds) = (self.sole_points.gaps, self.sole_points.speeds);
        let lands = |foot: usize, end: usize| {
            contact.ends_land
                && match (foot, end) {
                    (SUPPORT, _) => true,
                    (_, 0) => contact.free_foot_touches,
                    _ => contact.free_toe_touches_alone,
                }
        };
        let by_steps = !self.model.scheme.locates_events();
        let (exact, depth, height) = match by_steps {
            true => (BY_STEPS, DEPTH_BY_STEPS, BY_STEPS.height),
            false => (AT_EVENTS, ROUNDED.height, GAP_TOLERANCE),
        };
        let mut lowest = 0.0_f64;
        for foot in [SUPPORT, FREE] {
            for end in [0, 1].into_iter().filter(|&end| lands(foot, end)) {
                let gap = gaps[foot][end];
                if gap < -depth {
                    return Err(Invalid(format!(
                        "the {} starts {} m below the ice; its height must be at least 0",
                        ENDS[foot][end], -gap
                    )));
                }
                lowest = lowest.min(gap);
            }
        }
        let is_rounded = !by_steps && lowest < -exact.height || self.is_in_single_precision();
        let mut rest = exact;
        if is_rounded {
            rest.height = rest.height.max(ROUNDED.height);
            rest.speed = rest.speed.max(ROUNDED.speed);
        }
        let is_near = |foot: usize, end: usize| {
            let gap = gaps[foot][end];
            gap <= exact.height && (gap >= -exact.height || !by_steps && lands(foot, end))
        };
        let mut closed = each(|foot, end| {
            let (gap, [_, speed]) = (gaps[foot][end].abs(), speeds[foot][end]);
            let rests = gap <= rest.height && speed.abs() <= rest.speed;
            rests || is_near(foot, end) && speed <= exact.speed
        });
        if closed[SUPPORT] == [false; 2] && !contact.is_push_only {
            // In two-way contact the foot cannot leave the ice.
            let on_ice = |foot: usize, end: usize| gaps[foot][end].abs() <= ROUNDED.height;
            closed[SUPPORT] = each(on_ice)[SUPPORT];
            if closed[SUPPORT] == [false; 2] {
                let message = "the supporting foot starts above the ice, or below it";
                return Err(Invalid(message.into()));
            }
        }
        let contacts = |ends: [[bool; 2]; 2]| {
            [SUPPORT, FREE].map(|foot| {
                let touch = SoleContact::of(ends[foot][0], ends[foot][1]);
                let allowed = contact.allowed_contacts(foot).contains(&touch);
                if allowed { touch } else { SoleContact::Air }
            })
        };
        let largest = |touches: [SoleContact; 2], value: &dyn Fn(usize, usize) -> f64| {
            let of = |foot: usize, end: usize| match touches[foot].has([End::Heel, End::Toe][end]) {
                true => value(foot, end),
                false => 0.0,
            };
            each(of).as_flattened().iter().copied().fold(0.0, f64::max)
        };
        let rise = |foot: usize, end: usize| speeds[foot][end][1];
        let approach = largest(contacts(closed), &|foot, end| -rise(foot, end));
        let is_impact = approach > rest.speed.max(ROUNDED.speed);
        if is_impact {
            // The impact may press ends onto the ice that rise before it.
            closed = each(|foot, end| closed[foot][end] || is_near(foot, end));
        }
        let touching = each(|foot, end| {
            closed[foot][end] || !by_steps && lands(foot, end) && gaps[foot][end] < -GAP_TOLERANCE
        });
        let [closed, touching] = [closed, touching].map(contacts);
        let off = largest(touching, &|foot, end| gaps[foot][end].abs());
        let speed = largest(closed, &|foot, end| rise(foot, end).abs());
        Ok(InitialContacts {
            closed,
            touching,
            rest: [if is_rounded { ROUNDED.speed } else { 0.0 }, rest.speed],
            is_impact,
            is_off: off > height,
            is_moving: speed > exact.speed,
        })
    }

    /// Are all numbers of the state ones of single precision?
    fn is_in_single_precision(&self) -> bool {
        let n = self.model.n;
        let mut numbers = self.state.q[..n].iter().chain(&self.state.v[..n]);
        numbers.all(|&x| f64::from(x as f32) == x)
    }
}

/// A value for each end of both soles.
fn each<T>(value: impl Fn(usize, usize) -> T) -> [[T; 2]; 2] {
    [SUPPORT, FREE].map(|foot| [0, 1].map(|end| value(foot, end)))
}
