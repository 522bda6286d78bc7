//! The guards of a contact mode.

use crate::{
    events::{edges::EDGES, guard::Guard},
    model::{
        Model,
        contact_mode::{ContactMode, End, FREE, Foot, SUPPORT, SoleContact, touches},
    },
};

/// Most guards of a mode.
pub const MAX_GUARDS: usize = 16;

/// The guards of one mode.
#[derive(Debug, Clone, Copy)]
pub struct Guards {
    list: [Guard; MAX_GUARDS],
    len: usize,
}

impl Guards {
    pub fn of(model: &Model, mode: ContactMode) -> Self {
        let mut guards = Self::none();
        if model.scene.fall.is_some() {
            guards.push(Guard::Fall);
        }
        guards.push_contacts(model, touches(mode));
        guards.push_friction(model, SUPPORT, mode.support);
        guards.push_friction(model, FREE, mode.free);
        guards
    }

    /// The guards of gaps and loads alone, for the contacts of the supporting and the free foot.
    pub fn of_ends(model: &Model, contacts: (SoleContact, SoleContact)) -> Self {
        let mut guards = Self::none();
        guards.push_contacts(model, contacts);
        guards
    }

    fn none() -> Self {
        Self {
            list: [Guard::Fall; MAX_GUARDS],
            len: 0,
        }
    }

    /// Every guard of the model's modes.
    pub fn all(model: &Model) -> Vec<Guard> {
        let mut all: Vec<Guard> = Vec::new();
        for mode in model.modes() {
            let guards = Self::of(model, mode);
            for &guard in guards.as_slice() {
                if !all.contains(&guard) {
                    all.push(guard);
                }
            }
        }
        all
    }

    pub fn as_slice(&self) -> &[Guard] {
        &self.list[..self.len]
    }

    fn push(&mut self, guard: Guard) {
        self.list[self.len] = guard;
        self.len += 1;
    }

    /// Two-way contact: the guards of the rules in `EDGES`. Push-only contact: those of every end.
    fn push_contacts(&mut self, model: &Model, contacts: (SoleContact, SoleContact)) {
        if model.contact.is_push_only {
            self.push_ends(model, SUPPORT, contacts.0);
            if model.contact.free_foot_touches {
                self.push_ends(model, FREE, contacts.1);
            }
            return;
        }
        for edge in &EDGES {
            if edge.starts_from(contacts) && edge.is_enabled(model.contact) {
                self.push(edge.guard);
            }
        }
    }

    /// Push-only contact: a closed end may lose its load, an open end may land.
    fn push_ends(&mut self, model: &Model, which: usize, touch: SoleContact) {
        for end in [End::Heel, End::Toe] {
            if touch.has(end) {
                self.push(Guard::Load(which, end));
            } else if model.contact.ends_land {
                self.push(Guard::Gap(which, end));
            }
        }
    }

    fn push_friction(&mut self, model: &Model, which: usize, foot: Foot) {
        if foot.touch == SoleContact::Air || !model.friction.is_dry() {
            return;
        }
        if !foot.slides() {
            self.push(Guard::ConeForward(which));
            self.push(Guard::ConeBackward(which));
            return;
        }
        // The impulse of a capture pulls or leaves the cone in nearly all poses, which push-only ice cannot do.
        if !model.contact.is_push_only {
            self.push(Guard::Speed(which));
        }
        self.push(Guard::Reversal(which));
        self.push(Guard::Wedge(which));
        if model.contact.friction_ends_when_pulled[which] || foot.pulled {
            self.push(Guard::Pull(which));
        }
    }
}
