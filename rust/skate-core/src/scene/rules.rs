//! Choices of a scene that contradict each other.

use crate::{
    error::{Invalid, MessageNumber},
    scene::{COORDINATES, ContactLaw, Friction, PulledFriction, Scene},
};

/// Maximum number of characters of a scene's name.
const MAX_NAME: usize = 100;

impl Scene {
    pub(super) fn check_rules(&self) -> Result<(), Invalid> {
        self.check_name()?;
        self.check_names()?;
        self.check_randomise()?;
        let contact = &self.contact;
        let push_only = contact.law == ContactLaw::PushOnly;
        let start =
            |name: &str| [&self.start.q, &self.start.v].map(|values| moves(values.get(name)));
        let [_, y0_moves] = start("y0");
        let [q1_turned, q1_turns] = start("q1");
        let rules = [
            // A foot that can neither slip nor be pulled down often has no consistent contact force.
            (
                self.ice.friction == Friction::Sticking {} && push_only,
                "ice.friction.kind = \"sticking\": ice that only pushes (contact.law = \"push_only\") lets a \
                 foot slip; must be another kind, such as \"coulomb\" with a large mu",
            ),
            (
                push_only && contact.edge_damping != 0.0,
                "contact.edge_damping: its torque would not end when the ice stops pushing \
                 (contact.law = \"push_only\"); must be 0",
            ),
            (
                push_only && !contact.foot_rotation,
                "contact.foot_rotation = false: ice that only pushes (contact.law = \"push_only\") lets \
                 any foot rotate; must be true",
            ),
            (
                push_only && contact.toe_contact,
                "contact.toe_contact = true: on ice that only pushes (contact.law = \"push_only\") every \
                 end of a sole may touch already; must be false",
            ),
            (
                push_only && contact.pulled_friction != PulledFriction::Literal,
                "contact.pulled_friction = \"none\": ice that only pushes (contact.law = \"push_only\") \
                 never pulls; must be \"literal\"",
            ),
            (
                push_only && contact.point_contact_holds,
                "contact.point_contact_holds = true: ice that only pushes (contact.law = \"push_only\") \
                 never holds; must be false",
            ),
            (
                contact.toe_contact && !contact.free_foot,
                "contact.toe_contact = true: the free foot passes through the ice \
                 (contact.free_foot = false); must be false",
            ),
            (
                contact.toe_contact && !contact.impacts,
                "contact.toe_contact = true: no toe lands (contact.impacts = false); must be false",
            ),
            (
                contact.point_contact_holds && !contact.free_foot,
                "contact.point_contact_holds = true: the free foot passes through the ice \
                 (contact.free_foot = false); must be false",
            ),
            (
                contact.edge_damping != 0.0 && !contact.foot_rotation,
                "contact.edge_damping: the supporting foot does not rotate \
                 (contact.foot_rotation = false); must be 0",
            ),
            (
                !contact.foot_rotation && (q1_turned || q1_turns),
                "start.q.q1 and start.v.q1: the supporting foot does not rotate \
                 (contact.foot_rotation = false); must be 0",
            ),
            (
                self.ice.friction == Friction::Sticking {}
                    && contact.free_foot
                    && !contact.point_contact_holds,
                "contact.point_contact_holds = false: a free foot that can neither slip nor be held \
                 (ice.friction.kind = \"sticking\") may have no consistent motion; must be true",
            ),
            (
                matches!(self.ice.friction, Friction::Viscous { .. }) && push_only,
                "ice.friction.kind = \"viscous\": its force would not end when the ice stops pushing \
                 (contact.law = \"push_only\"); must be another kind",
            ),
            (
                self.ice.friction == Friction::Sticking {} && y0_moves,
                "start.v.y0: the supporting foot never slips (ice.friction.kind = \"sticking\"); must be 0",
            ),
            (
                self.control.arm_swing.is_some() && self.is_locked("q8"),
                "control.arm_swing: its torque tau8 acts on q8, which is locked; must be absent",
            ),
        ];
        match rules.iter().find(|(broken, _)| *broken) {
            Some((_, message)) => Err(Invalid((*message).into())),
            None => Ok(()),
        }
    }

    /// Check that `randomise` names numbers of the scene and that its intervals lie within their ranges.
    fn check_randomise(&self) -> Result<(), Invalid> {
        if self.randomise.is_empty() {
            return Ok(());
        }
        let mut plain = self.clone();
        plain.randomise.clear();
        let known = plain.parameters();
        for (name, &[low, high]) in &self.randomise {
            let may = ["body.", "ice.", "contact.", "control.", "stabilizers."];
            let controller = ["control.sample_period", "control.action_period"];
            let drawn =
                may.iter().any(|table| name.starts_with(table)) && !controller.contains(&&**name);
            let Some(number) = known.iter().find(|number| drawn && number.name == *name) else {
                return Err(Invalid(format!(
                    "randomise: \"{name}\": must be a number of this scene's body, ice, contact, control or \
                     stabilizers, without the control's periods"
                )));
            };
            let range = &number.range;
            for bound in [low, high] {
                let name = format!("randomise.\"{name}\"");
                Invalid::range(&name, bound, range.low, range.high, range.unit)?;
            }
            if low > high {
                return Err(Invalid(format!(
                    "randomise.\"{name}\" = [{}, {}]: must be [lowest, highest]",
                    MessageNumber(low),
                    MessageNumber(high)
                )));
            }
        }
        // The bounds must not contradict the rest of the scene.
        for which in [0, 1] {
            let bounds = self.randomise.iter();
            plain.with_values(bounds.map(|(name, range)| (name.as_str(), range[which])))?;
        }
        Ok(())
    }

    pub(super) fn is_locked(&self, joint: &str) -> bool {
        self.locked.iter().any(|name| name == joint)
    }

    /// The name stands in file names and messages.
    fn check_name(&self) -> Result<(), Invalid> {
        let wrong = |c: char| c.is_control() || "/\\".contains(c);
        if self.name.chars().count() <= MAX_NAME && !self.name.contains(wrong) {
            return Ok(());
        }
        let shown: String = self.name.chars().take(MAX_NAME).collect();
        Err(Invalid(format!(
            "name = {shown:?}: must have at most {MAX_NAME} characters, none of them /, \\ or a control character"
        )))
    }

    fn check_names(&self) -> Result<(), Invalid> {
        for (i, joint) in self.locked.iter().enumerate() {
            let lockable = &COORDINATES[9..];
            if !lockable.contains(&joint.as_str()) {
                let known = lockable.join(", ");
                return Err(Invalid(format!(
                    "locked: \"{joint}\" cannot be locked; known are {known}"
                )));
            }
            if self.locked[..i].contains(joint) {
                return Err(Invalid(format!("locked: \"{joint}\" is listed twice")));
            }
        }
        for (table, values) in [("start.q", &self.start.q), ("start.v", &self.start.v)] {
            for (name, &x) in values {
                if !COORDINATES.contains(&name.as_str()) {
                    let known = COORDINATES.join(", ");
                    return Err(Invalid(format!(
                        "{table}.{name}: unknown; known are {known}"
                    )));
                }
                if x != 0.0 && self.is_locked(name) {
                    return Err(Invalid(format!(
                        "{table}.{name} = {x}: {name} is locked at zero; must be 0"
                    )));
                }
            }
        }
        Ok(())
    }
}

fn moves(x: Option<&f64>) -> bool {
    x.is_some_and(|&x| x != 0.0)
}
