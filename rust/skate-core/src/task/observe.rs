//! Observations.

use crate::{
    control::feedforward_torque,
    derivatives::Observed,
    model::{
        Model,
        contact_mode::{End, FREE, SUPPORT},
        layout::{NV, ROOT},
    },
    numeric::{scalar::Scalar, simd::with_avx2, trig::wrap_angle},
    sim::Simulation,
    task::reward::standing_height,
};
use std::f64::consts::PI;

/// Contact states: rows 1 to 20 of Table 2, and 0 for flight.
const N_CONTACT_STATES: usize = 21;
/// The only entry that depends on the time of the last change of contact.
pub(super) const SINCE_EVENT: &str = "since_event";
/// Peak values in Eqs. 16 to 22 of tau1, tau2, ... [N m]; the equations have no tau4.
const TORQUE_PEAKS: [(usize, f64); 7] = [
    (1, 100.0),
    (2, 205.0),
    (3, 50.0),
    (5, 100.0),
    (6, 20.0),
    (7, 50.0),
    (8, 30.0),
];
/// Meaning of the joints, q1 first.
const JOINT_MEANINGS: [&str; 17] = [
    "supporting foot on the ice",
    "supporting ankle",
    "supporting knee",
    "supporting hip",
    "free hip",
    "free knee",
    "free ankle",
    "trunk yaw",
    "trunk pitch",
    "trunk roll",
    "right shoulder",
    "right elbow",
    "right wrist",
    "left shoulder",
    "left elbow",
    "left wrist",
    "neck",
];

/// Entry of an observation; values are clipped to its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Identifier, for example `angle.q2`.
    pub name: String,
    pub meaning: String,
    pub unit: &'static str,
    pub low: f32,
    pub high: f32,
}

/// All entries, in the order in which `observe` writes them.
pub(super) fn entries(model: &Model) -> Vec<Entry> {
    let mut all = Vec::new();
    let mut add = |name: String, meaning: String, unit, (low, high): (f64, f64)| {
        let (low, high) = (low as f32, high as f32);
        all.push(Entry {
            name,
            meaning,
            unit,
            low,
            high,
        });
    };
    let symmetric = |bound: f64| (-bound, bound);
    for (part, meaning, unit, bound) in [
        ("angle", "angle", "rad", PI),
        ("rate", "rate", "rad/s", 200.0),
    ] {
        for name in &model.names[2..] {
            let number: usize = name[1..].parse().expect("joints are numbered");
            let joint = JOINT_MEANINGS[number - 1];
            let meaning = format!("{meaning} of {name}, {joint}");
            add(format!("{part}.{name}"), meaning, unit, symmetric(bound));
        }
    }
    for (name, meaning) in [
        ("slip.support", "slip of the supporting foot, forward"),
        (
            "rise.support",
            "velocity of the supporting foot's edge, upward",
        ),
        (
            "slip.free",
            "velocity of the free foot's lower end, forward",
        ),
    ] {
        add(name.into(), meaning.into(), "m/s", symmetric(20.0));
    }
    for (foot, meaning) in [("support", "supporting"), ("free", "free")] {
        for end in ["heel", "toe"] {
            let name = format!("height.{foot}_{end}");
            add(
                name,
                format!("height of the {meaning} {end}"),
                "m",
                symmetric(2.0),
            );
        }
    }
    for state in 0..N_CONTACT_STATES {
        let meaning = match state {
            0 => "1 with both feet in the air".into(),
            _ => format!("1 in contact state {state} of Table 2"),
        };
        add(format!("state.{state}"), meaning, "1", (0.0, 1.0));
    }
    let since = "time since the last change of the contact state";
    add(SINCE_EVENT.into(), since.into(), "s", (0.0, 2.0));
    for wave in ["sin", "cos"] {
        let meaning = format!("{wave} of the phase angle of Eqs. 16 to 19");
        add(format!("phase.{wave}"), meaning, "1", symmetric(1.0));
    }
    let leg = "supporting leg, 1 right, -1 left";
    add("support_leg".into(), leg.into(), "1", symmetric(1.0));
    for (i, peak) in TORQUE_PEAKS {
        let meaning = format!("feedforward torque tau{i}, in units of {peak} N m");
        add(format!("feedforward.tau{i}"), meaning, "1", symmetric(10.0));
    }
    for (axis, meaning) in [("x", "to the right"), ("y", "ahead"), ("z", "above")] {
        let meaning = format!("head from its target, {meaning}");
        add(format!("head_error.{axis}"), meaning, "m", symmetric(2.0));
    }
    all
}

/// Bounds of all entries, in order.
#[derive(Debug, Clone)]
pub struct Bounds {
    low: Vec<f32>,
    high: Vec<f32>,
}

impl Bounds {
    pub(super) fn of(entries: &[Entry]) -> Self {
        Self {
            low: entries.iter().map(|entry| entry.low).collect(),
            high: entries.iter().map(|entry| entry.high).collect(),
        }
    }

    /// Whether an entry is not clipped.
    pub(super) fn contain(&self, entry: usize, x: f64) -> bool {
        (self.low[entry]..=self.high[entry]).contains(&(x as f32))
    }

    /// Clip to the bounds. NaN, which a terminated simulation may contain, becomes zero.
    #[inline(always)]
    fn clamp(&self, out: &mut [f32]) {
        for ((x, &low), &high) in out.iter_mut().zip(&self.low).zip(&self.high) {
            // Unlike `f64::clamp`, this does not check the order of the bounds every time.
            let known = if x.is_nan() { 0.0 } else { *x };
            let at_least = if known < low { low } else { known };
            *x = if at_least > high { high } else { at_least };
        }
    }
}

/// Sequential writer of an observation, which converts every number by a function.
struct Writer<'a, E, F>(&'a mut [E], F);

impl<E, F> Writer<'_, E, F> {
    #[inline(always)]
    fn write_array<T: Copy, const N: usize>(&mut self, values: [T; N])
    where
        F: Fn(T) -> E,
    {
        self.write_each(N, |i| values[i]);
    }

    #[inline(always)]
    fn write_each<T>(&mut self, n: usize, value: impl Fn(usize) -> T)
    where
        F: Fn(T) -> E,
    {
        let (now, later) = std::mem::take(&mut self.0).split_at_mut(n);
        for (i, x) in now.iter_mut().enumerate() {
            *x = (self.1)(value(i));
        }
        self.0 = later;
    }
}

/// Observation of a simulation, as an environment on the same scene returns it.
pub fn observation(sim: &Simulation) -> Vec<f32> {
    let bounds = Bounds::of(&entries(&sim.model));
    let mut out = vec![0.0; bounds.low.len()];
    observe(sim, standing_height(&sim.model), &bounds, &mut out);
    out
}

/// Write an observation. `standing` is the height of the head when standing upright [m].
pub(super) fn observe(sim: &Simulation, standing: f64, bounds: &Bounds, out: &mut [f32]) {
    let (torque, wave) = feedforward_torque(&sim.model, &sim.state);
    with_avx2(
        #[inline(always)]
        || {
            let seen = Observed {
                q: &sim.state.q,
                v: &sim.state.v,
                sole_points: &sim.sole_points,
                since_event: sim.since_event(),
                wave,
                torque: &torque,
            };
            write(sim, standing, &seen, (out, |x| x as f32));
            bounds.clamp(out);
        },
    );
}

/// Write all entries, each converted by `entry`. `standing` is the height of the head when standing upright [m].
#[inline(always)]
pub(super) fn write<T: Scalar<Mask = bool>, E>(
    sim: &Simulation,
    standing: f64,
    seen: &Observed<'_, T>,
    (out, entry): (&mut [E], impl Fn(T) -> E),
) {
    let Observed {
        q,
        v,
        sole_points,
        since_event,
        wave,
        torque,
    } = *seen;
    let (model, mode) = (&sim.model, sim.state.mode);
    let n = model.n.min(NV);
    let mut writer = Writer(out, entry);
    let (angles, rates) = (&q[2..n], &v[2..n]);
    writer.write_each(n - 2, |i| wrap_angle(angles[i]));
    writer.write_each(n - 2, |i| rates[i]);
    let [heel, toe] = sole_points.gaps[FREE];
    let low = if heel.lt(toe) { End::Heel } else { End::Toe };
    writer.write_array([v[0], v[1], sole_points.speeds[FREE][low as usize][0]]);
    writer.write_array([
        sole_points.gaps[SUPPORT][0],
        sole_points.gaps[SUPPORT][1],
        sole_points.gaps[FREE][0],
        sole_points.gaps[FREE][1],
    ]);
    let number = usize::from(mode.number());
    writer.write_each(N_CONTACT_STATES, |state| {
        T::of(f64::from(u8::from(state == number)))
    });
    writer.write_array([since_event, wave[0], wave[1]]);
    writer.write_array([T::of(sim.state.support_leg.sign())]);
    writer.write_array(TORQUE_PEAKS.map(|(i, peak)| torque[ROOT - 2 + i] / T::of(peak)));
    let ankle = q[0] + sole_points.ankle;
    let target = match &model.scene.control.lifting {
        Some(lifting) => [
            T::zero(),
            ankle + T::of(lifting.ahead),
            T::of(lifting.height),
        ],
        None => [T::zero(), ankle, T::of(standing)],
    };
    let [x, y, z] = sole_points.head;
    let head = [x, q[0] + y, q[1] + z];
    writer.write_array([0, 1, 2].map(|i| head[i] - target[i]));
}
