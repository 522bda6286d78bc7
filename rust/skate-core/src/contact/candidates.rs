//! Candidate contact modes, ordered by their distance from a given mode.

use crate::{
    contact::mode_query::ModeQuery,
    model::{
        Model,
        contact_mode::{ContactMode, FREE, Foot, SUPPORT, SoleContact},
        friction::FrictionMode,
    },
};

/// Most candidates of one foot: the air, or one of three contacts with one of three friction modes. In two-way
/// contact the sole's contact is given, and modes with dry friction count twice, pulled and not.
const MAX_CANDIDATES: usize = 10;

/// Added to the distance of a mode in which friction of a pulled foot ends or begins, in scenes where it keeps the sign of
/// the normal force: such a mode is selected only where no other is consistent.
const LAST: u32 = 1 << 10;

/// All candidate modes with their distances, the nearest first.
pub fn by_distance(model: &Model, query: &ModeQuery) -> impl Iterator<Item = (u32, ContactMode)> {
    let [support, free] = [SUPPORT, FREE].map(|which| FootCandidates::of(model, query, which));
    let mut keys = [u32::MAX; MAX_CANDIDATES * MAX_CANDIDATES];
    for i in 0..support.n {
        for j in 0..free.n {
            let index = i * free.n + j;
            keys[index] = (support.distance[i] + free.distance[j]) << 8 | index as u32;
        }
    }
    let excluded = query.excluded;
    let modes = std::iter::from_fn(move || {
        let keys = &mut keys[..support.n * free.n];
        let least = *keys.iter().min()?;
        let index = (least & 0xff) as usize;
        // A key that was used is the largest of all; when it is the least, all were used.
        let was_used = std::mem::replace(keys.get_mut(index)?, u32::MAX) == u32::MAX;
        let mode = ContactMode {
            support: support.feet[index / free.n],
            free: free.feet[index % free.n],
        };
        (!was_used).then_some((least >> 8, mode))
    });
    modes.filter(move |&(_, mode)| excluded != Some(mode))
}

/// Candidates of one foot and their distances from its reference.
struct FootCandidates {
    feet: [Foot; MAX_CANDIDATES],
    distance: [u32; MAX_CANDIDATES],
    n: usize,
}

impl FootCandidates {
    fn of(model: &Model, query: &ModeQuery, which: usize) -> Self {
        let contact = model.contact;
        let (closed, may_load) = (query.closed[which], query.may_load[which]);
        let reference = query.reference.foot(which);
        let mut candidates = Self {
            feet: [Foot::AIR; MAX_CANDIDATES],
            distance: [0; MAX_CANDIDATES],
            n: 0,
        };
        for touch in [
            SoleContact::Flat,
            SoleContact::Heel,
            SoleContact::Toe,
            SoleContact::Air,
        ] {
            let is_allowed = match contact.is_push_only {
                false => touch == closed,
                true => (may_load.heel() || !touch.heel()) && (may_load.toe() || !touch.toe()),
            };
            if !is_allowed {
                continue;
            }
            let friction_modes = match touch {
                SoleContact::Air => &[FrictionMode::Stuck],
                _ => model.friction.friction_modes,
            };
            for &friction_mode in friction_modes {
                let is_stuck = friction_mode == FrictionMode::Stuck;
                let is_allowed = match (touch, query.sliding[which]) {
                    _ if query.must_stick == Some(which) => touch != SoleContact::Air && is_stuck,
                    _ if query.must_slide == Some(which) && is_stuck => touch == SoleContact::Air,
                    (SoleContact::Air, _) | (_, None) => true,
                    (_, Some(direction)) => friction_mode == direction,
                };
                if is_allowed {
                    let foot = Foot::new(touch, friction_mode);
                    let is_dry = friction_mode.has_dry_friction();
                    let keeps_sign = is_dry && !contact.ends_friction_when_pulled(which, foot);
                    candidates.add(foot, reference, keeps_sign);
                    if !contact.is_push_only && is_dry {
                        let pulled = true;
                        candidates.add(Foot { pulled, ..foot }, reference, keeps_sign);
                    }
                }
            }
        }
        candidates
    }

    fn add(&mut self, foot: Foot, reference: Foot, keeps_sign: bool) {
        self.feet[self.n] = foot;
        let last = keeps_sign && foot.pulled != reference.pulled;
        self.distance[self.n] = distance(foot, reference) + if last { LAST } else { 0 };
        self.n += 1;
    }
}

/// Distance of two modes of a foot. A change of one end's contact weighs more than all that friction can
/// change on both feet.
fn distance(a: Foot, b: Foot) -> u32 {
    let ends =
        u32::from(a.touch.heel() != b.touch.heel()) + u32::from(a.touch.toe() != b.touch.toe());
    let friction_mode = match (a.friction_mode, b.friction_mode) {
        (x, y) if x == y => 0,
        (FrictionMode::Forward, FrictionMode::Backward)
        | (FrictionMode::Backward, FrictionMode::Forward) => 2,
        _ => 1,
    };
    8 * ends + 2 * friction_mode + u32::from(a.pulled != b.pulled)
}
