//! The engine for the browser: plain functions over WebAssembly's linear memory, no glue code.
//!
//! The caller writes text or numbers to `input(length)` and passes the length; text and bytes come back at
//! `output()`, `output_length()`. Functions that can fail return a negative number, and `output` holds the
//! message. A panic traps; `panic_text` then writes its message to `output`, and the instance must not be
//! used further.

pub mod engine;
pub mod scene_edit;

use engine::{Engine, STATE_LENGTH};
use scene_edit::SceneEdit;
use skate_core::{
    error::{Invalid, Termination},
    numeric::checksum,
};
use std::{cell::RefCell, panic, sync::Mutex};

/// Returned by functions that fail.
const FAILED: i32 = -1;

/// All memory that is shared with the caller.
#[derive(Default)]
struct Border {
    input: Vec<u8>,
    output: Vec<u8>,
    state: Vec<f64>,
    engines: Vec<Option<Engine>>,
}

thread_local! {
    static BORDER: RefCell<Border> = RefCell::default();
}

static PANIC: Mutex<String> = Mutex::new(String::new());

fn at_border<T>(task: impl FnOnce(&mut Border) -> T) -> T {
    BORDER.with_borrow_mut(task)
}

impl Border {
    /// The first bytes of the input.
    fn input(&self, length: usize) -> &[u8] {
        &self.input[..length.min(self.input.len())]
    }

    /// Write the message of an error to the output.
    fn fails(&mut self, why: &Invalid) -> i32 {
        self.output = why.to_string().into_bytes();
        FAILED
    }

    fn engine(&mut self, handle: i32) -> Result<&mut Engine, Invalid> {
        let found = usize::try_from(handle).ok();
        let engine = found.and_then(|i| self.engines.get_mut(i)?.as_mut());
        engine.ok_or_else(|| Invalid(format!("no simulation {handle}")))
    }

    /// Apply a task to a simulation, and return a number.
    fn with(&mut self, handle: i32, task: impl FnOnce(&mut Engine) -> Result<i32, Invalid>) -> i32 {
        match self.engine(handle).and_then(task) {
            Ok(number) => number,
            Err(why) => self.fails(&why),
        }
    }

    /// Write what a task makes of a simulation to the output, and return its length.
    fn write(&mut self, handle: i32, task: impl FnOnce(&mut Engine) -> Vec<u8>) -> i32 {
        match self.engine(handle).map(task) {
            Ok(bytes) => {
                self.output = bytes;
                self.output.len() as i32
            }
            Err(why) => self.fails(&why),
        }
    }
}

/// Call once, before anything else: keeps the message of a panic.
#[unsafe(no_mangle)]
pub extern "C" fn initialise() {
    panic::set_hook(Box::new(|info| {
        if let Ok(mut text) = PANIC.lock() {
            *text = info.to_string();
        }
    }));
}

/// Memory for `length` bytes of input, valid until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    at_border(|border| {
        border.input.resize(length, 0);
        border.input.as_mut_ptr()
    })
}

/// Start of the output of the last call.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    at_border(|border| border.output.as_ptr())
}

/// Length of the output [bytes].
#[unsafe(no_mangle)]
pub extern "C" fn output_length() -> usize {
    at_border(|border| border.output.len())
}

/// Message of the panic that has trapped; returns its address, its length is `panic_length()`.
#[unsafe(no_mangle)]
pub extern "C" fn panic_text() -> *const u8 {
    PANIC.lock().map_or(std::ptr::null(), |text| text.as_ptr())
}

/// Length of the message of the panic [bytes]; 0 without a panic.
#[unsafe(no_mangle)]
pub extern "C" fn panic_length() -> usize {
    PANIC.lock().map_or(0, |text| text.len())
}

/// Names of the terminations as a JSON list; returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn terminations() -> i32 {
    let names = Termination::ALL.map(Termination::name);
    at_border(|border| {
        border.output = serde_json::json!(names).to_string().into_bytes();
        border.output.len() as i32
    })
}

/// A simulation at the start of a scene, from the JSON of a `SceneEdit` in the input. Returns its handle, and
/// in the output the description of the scene as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn create(length: usize) -> i32 {
    at_border(|border| {
        let made = SceneEdit::from_json(border.input(length)).and_then(|edit| Engine::new(&edit));
        match made {
            Ok((engine, description)) => {
                border.output = description.to_string().into_bytes();
                let free = border.engines.iter().position(Option::is_none);
                let place = free.unwrap_or_else(|| {
                    border.engines.push(None);
                    border.engines.len() - 1
                });
                border.engines[place] = Some(engine);
                place as i32
            }
            Err(why) => border.fails(&why),
        }
    })
}

/// Free a simulation.
#[unsafe(no_mangle)]
pub extern "C" fn remove(handle: i32) {
    at_border(|border| {
        let place = usize::try_from(handle).ok();
        if let Some(place) = place.and_then(|i| border.engines.get_mut(i)) {
            *place = None;
        }
    });
}

/// Advance by a number of actions; returns how many were made before the simulation ended.
#[unsafe(no_mangle)]
pub extern "C" fn step(handle: i32, actions: u32) -> i32 {
    at_border(|border| border.with(handle, |engine| Ok(engine.step(actions) as i32)))
}

/// Set the residual joint torques to the `count` numbers in the input (f64) [N m].
#[unsafe(no_mangle)]
pub extern "C" fn hold(handle: i32, count: usize) -> i32 {
    at_border(|border| {
        let (words, _) = border.input(8 * count).as_chunks::<8>();
        let torque: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
        border.with(handle, |engine| engine.hold(&torque).map(|()| 0))
    })
}

/// Add a speed [m/s] to the forward velocity of every body.
#[unsafe(no_mangle)]
pub extern "C" fn kick(handle: i32, speed: f64) -> i32 {
    at_border(|border| border.with(handle, |engine| engine.kick(speed).map(|()| 0)))
}

/// Address of the present state, `state_length()` numbers as in `Engine::state`; null without a simulation.
#[unsafe(no_mangle)]
pub extern "C" fn state(handle: i32) -> *const f64 {
    at_border(|border| match border.engine(handle) {
        Ok(engine) => {
            border.state = engine.state().to_vec();
            border.state.as_ptr()
        }
        Err(_) => std::ptr::null(),
    })
}

/// Number of entries of the state.
#[unsafe(no_mangle)]
pub extern "C" fn state_length() -> usize {
    STATE_LENGTH
}

/// Write a snapshot to the output; returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn snapshot(handle: i32) -> i32 {
    at_border(|border| border.write(handle, |engine| engine.snapshot()))
}

/// Restore the snapshot in the input.
#[unsafe(no_mangle)]
pub extern "C" fn restore(handle: i32, length: usize) -> i32 {
    at_border(|border| {
        let bytes = border.input(length).to_vec();
        border.with(handle, |engine| engine.restore(&bytes).map(|()| 0))
    })
}

/// Write the observation (f32) to the output; returns its length [bytes].
#[unsafe(no_mangle)]
pub extern "C" fn observation(handle: i32) -> i32 {
    at_border(|border| {
        border.write(handle, |engine| {
            let entries = engine.observation();
            entries.iter().flat_map(|x| x.to_le_bytes()).collect()
        })
    })
}

/// Checksum of the bytes in the input.
#[unsafe(no_mangle)]
pub extern "C" fn checksum(length: usize) -> u64 {
    at_border(|border| checksum::checksum(border.input(length)))
}
