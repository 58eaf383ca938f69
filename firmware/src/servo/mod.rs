//! From joint references to drive commands, one 5 ms cycle at a time.
//!
//! - [`pid`]: PI-D with anti-windup and bumpless preset;
//! - [`inertia`]: masses of the links, and what of them torques depend on;
//! - [`dynamics`]: torque of the rigid arm (recursive Newton–Euler);
//! - [`feedforward`]: that, plus rotors and friction, at the actuators;
//! - [`drive`]: radians and newton-metres to counts and per mille of rated torque;
//! - [`limits`]: joint ranges and speeds;
//! - [`hold`]: a correction along the path between the samples that arrive;
//! - [`profile`]: rest-to-rest motion;
//! - [`axes`]: all of them for N axes, in torque or velocity mode.

pub mod axes;
pub mod drive;
pub mod dynamics;
pub mod feedforward;
pub mod hold;
pub mod inertia;
pub mod limits;
pub mod pid;
pub mod profile;
