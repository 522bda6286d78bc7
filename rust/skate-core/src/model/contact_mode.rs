//! The contact state of both feet, and Table 2 as data.

use crate::{
    model::{friction::FrictionMode, layout::NV},
    numeric::{scalar::Scalar, trig::nearest_half_turn},
};
use serde::{Deserialize, Serialize};

/// Index of a foot.
pub const SUPPORT: usize = 0;
pub const FREE: usize = 1;

/// Which end of a sole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Heel = 0,
    Toe = 1,
}

/// Which part of a sole is on the ice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SoleContact {
    Air,
    Heel,
    Toe,
    Flat,
}

impl SoleContact {
    pub fn heel(self) -> bool {
        matches!(self, Self::Heel | Self::Flat)
    }

    pub fn toe(self) -> bool {
        matches!(self, Self::Toe | Self::Flat)
    }

    /// From the two ends of the sole.
    pub fn of(heel: bool, toe: bool) -> Self {
        match (heel, toe) {
            (false, false) => Self::Air,
            (true, false) => Self::Heel,
            (false, true) => Self::Toe,
            (true, true) => Self::Flat,
        }
    }

    /// Does this end touch the ice?
    pub fn has(self, end: End) -> bool {
        match end {
            End::Heel => self.heel(),
            End::Toe => self.toe(),
        }
    }

    /// The contact after an end has landed, or lifted off.
    pub fn with(self, end: End, lands: bool) -> Self {
        match end {
            End::Heel => Self::of(lands, self.toe()),
            End::Toe => Self::of(self.heel(), lands),
        }
    }

    /// The pivot of a supporting foot, the origin of y0 and z0: its toe unless only the heel touches.
    pub fn pivot(self) -> End {
        match self {
            Self::Heel => End::Heel,
            _ => End::Toe,
        }
    }

    /// The contact point of a free foot, where its contact forces act: its heel unless only the toe touches.
    pub fn contact_point(self) -> End {
        match self {
            Self::Toe => End::Toe,
            _ => End::Heel,
        }
    }
}

/// Contact and friction mode of one foot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Foot {
    pub touch: SoleContact,
    pub friction_mode: FrictionMode,
    /// The foot slides under a negative normal force, and friction does not act (two-way contact).
    pub pulled: bool,
}

impl Foot {
    pub const AIR: Self = Self {
        touch: SoleContact::Air,
        friction_mode: FrictionMode::Stuck,
        pulled: false,
    };

    /// A foot on the ice. In the air the friction mode is `Stuck`.
    pub fn new(touch: SoleContact, friction_mode: FrictionMode) -> Self {
        if touch == SoleContact::Air {
            Self::AIR
        } else {
            Self {
                touch,
                friction_mode,
                pulled: false,
            }
        }
    }

    /// Set the coordinates and velocities to zero that this foot constrains as the supporting one.
    #[inline]
    pub fn zero_constrained<T: Scalar>(self, q: &mut [T; NV], v: &mut [T; NV]) {
        if self.touch == SoleContact::Air {
            return;
        }
        (q[1], v[1]) = (T::zero(), T::zero());
        if self.touch == SoleContact::Flat {
            (q[2], v[2]) = (nearest_half_turn(q[2]), T::zero());
        }
        if !self.slides() {
            v[0] = T::zero();
        }
    }

    pub fn slides(self) -> bool {
        self.friction_mode != FrictionMode::Stuck
    }

    fn name(self, rotating: &'static str) -> String {
        let touch = match self.touch {
            SoleContact::Air => return "air".into(),
            SoleContact::Flat => "flat",
            SoleContact::Heel => "heel",
            SoleContact::Toe => "toe",
        };
        let friction_mode = if self.slides() { "slide" } else { "stick" };
        if self.touch == SoleContact::Flat || rotating.is_empty() {
            format!("{friction_mode}_{touch}")
        } else {
            format!("{friction_mode}_{rotating}_{touch}")
        }
    }
}

/// Contact and friction mode of both feet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ContactMode {
    pub support: Foot,
    pub free: Foot,
}

impl ContactMode {
    /// The foot of an index, `SUPPORT` or `FREE`.
    pub fn foot(self, which: usize) -> Foot {
        if which == SUPPORT {
            self.support
        } else {
            self.free
        }
    }

    pub fn is_flight(self) -> bool {
        touches(self) == (SoleContact::Air, SoleContact::Air)
    }

    /// Does no foot stick to the ice?
    pub fn sticks_nowhere(self) -> bool {
        let sticks = |foot: Foot| foot.touch != SoleContact::Air && !foot.slides();
        !sticks(self.support) && !sticks(self.free)
    }

    fn foot_mut(&mut self, which: usize) -> &mut Foot {
        if which == SUPPORT {
            &mut self.support
        } else {
            &mut self.free
        }
    }

    /// The same mode with one foot stuck.
    pub fn with_stuck(mut self, which: usize) -> Self {
        let foot = self.foot_mut(which);
        *foot = Foot::new(foot.touch, FrictionMode::Stuck);
        self
    }

    /// The same mode with one foot sliding.
    pub fn with_sliding(mut self, which: usize, direction: FrictionMode) -> Self {
        self.foot_mut(which).friction_mode = direction;
        self
    }

    /// The same mode with the other sign of one foot's normal force.
    pub fn with_reversed_pull(mut self, which: usize) -> Self {
        self.foot_mut(which).pulled ^= true;
        self
    }

    /// Row of Table 2, 1 to 20; 0 when the supporting foot is in the air, which the table does not
    /// contain.
    pub fn number(self) -> u8 {
        if self.support.touch == SoleContact::Air {
            return 0;
        }
        let rotates = u8::from(self.support.touch != SoleContact::Flat);
        let slides = u8::from(self.support.slides());
        let free = match (self.free.touch, self.free.slides()) {
            (SoleContact::Air, _) => 0,
            (SoleContact::Heel | SoleContact::Toe, true) => 1,
            (SoleContact::Heel | SoleContact::Toe, false) => 2,
            (SoleContact::Flat, true) => 3,
            (SoleContact::Flat, false) => 4,
        };
        1 + rotates + 2 * slides + 4 * free
    }

    /// For example `slide_flat/slide_heel`: supporting foot / free foot.
    pub fn name(self) -> String {
        format!("{}/{}", self.support.name("roll"), self.free.name(""))
    }
}

/// Which parts of the soles are on the ice.
pub fn touches(mode: ContactMode) -> (SoleContact, SoleContact) {
    (mode.support.touch, mode.free.touch)
}

/// One row of Table 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TableRow {
    pub number: u8,
    /// y0 is a state variable: the supporting foot slides.
    pub y0: bool,
    /// q1 is a state variable: the supporting foot rotates about its edge.
    pub q1: bool,
    /// Multipliers of the free foot, each with its constraint C_hz, C_fr, C_hy.
    pub f_nz: bool,
    pub tau_n: bool,
    pub f_ny: bool,
}

const fn row(number: u8, [y0, q1]: [bool; 2], [f_nz, tau_n, f_ny]: [bool; 3]) -> TableRow {
    TableRow {
        number,
        y0,
        q1,
        f_nz,
        tau_n,
        f_ny,
    }
}

/// Table 2 of the paper: the unknowns of each contact state. The comments name the supporting foot's
/// motion first. `ContactMode::number` and `contact::equations` compute the same; a test compares
/// every row with them.
#[rustfmt::skip]
pub const TABLE_2: [TableRow; 20] = {
    const Y: bool = true;
    const N: bool = false;
    [
        //     y0 q1    f_nz tau_n f_ny
        row(1, [N, N], [N, N, N]), // state 1: stuck, flat; free foot in the air
        row(2, [N, Y], [N, N, N]), // state 2: stuck, rotating; free foot in the air
        row(3, [Y, N], [N, N, N]), // state 3: sliding, flat; free foot in the air
        row(4, [Y, Y], [N, N, N]), // state 4: sliding, rotating; free foot in the air
        row(5, [N, N], [Y, N, N]), // state 5: stuck, flat; free foot on an edge, sliding
        row(6, [N, Y], [Y, N, N]), // state 6: stuck, rotating; free foot on an edge, sliding
        row(7, [Y, N], [Y, N, N]), // state 7: sliding, flat; free foot on an edge, sliding
        row(8, [Y, Y], [Y, N, N]), // state 8: sliding, rotating; free foot on an edge, sliding
        row(9, [N, N], [Y, N, Y]), // state 9: stuck, flat; free foot on an edge, stuck
        row(10, [N, Y], [Y, N, Y]), // state 10: stuck, rotating; free foot on an edge, stuck
        row(11, [Y, N], [Y, N, Y]), // state 11: sliding, flat; free foot on an edge, stuck
        row(12, [Y, Y], [Y, N, Y]), // state 12: sliding, rotating; free foot on an edge, stuck
        row(13, [N, N], [Y, Y, N]), // state 13: stuck, flat; free foot flat, sliding
        row(14, [N, Y], [Y, Y, N]), // state 14: stuck, rotating; free foot flat, sliding
        row(15, [Y, N], [Y, Y, N]), // state 15: sliding, flat; free foot flat, sliding
        row(16, [Y, Y], [Y, Y, N]), // state 16: sliding, rotating; free foot flat, sliding
        row(17, [N, N], [Y, Y, Y]), // state 17: stuck, flat; free foot flat, stuck
        row(18, [N, Y], [Y, Y, Y]), // state 18: stuck, rotating; free foot flat, stuck
        row(19, [Y, N], [Y, Y, Y]), // state 19: sliding, flat; free foot flat, stuck
        row(20, [Y, Y], [Y, Y, Y]), // state 20: sliding, rotating; free foot flat, stuck
    ]
};
