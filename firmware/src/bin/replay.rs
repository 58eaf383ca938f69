//! The core alone, for replays: inputs of recorded cycles come over a link, and what one cycle makes of each goes back.
//!
//! The same source, compiler and profile as the controller's image, without bus and clock: a cycle is a pure function of
//! parameters, state and inputs. Besides its outputs it tells the trail of its stages, so that a first difference to a recorded run
//! has a place. Parameters are the core's.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use firmware::cycle::{Params, State, step_watched};
use firmware::job::seal::AXES;
use hal::board::chosen::{self as board, Link};
use hal::board::parameters;
use hal::process::{Inputs, Outputs};
use hal::stage::{Stage, Trail, Witness};

#[entry]
fn main() -> ! {
    // Filled in where they stand: they take tens of kilobytes.
    static mut PARAMS: Params = Params::ZEROS;
    static mut STATE: State = State::EMPTY;

    if parameters::fill_one(board::parameters(), PARAMS).is_err() {
        board::halt()
    }
    STATE.set_up(PARAMS);
    let mut link = Link::open();
    loop {
        let (inputs, flip): (Inputs<AXES>, Option<Stage>) = link.receive();
        let mut witness = Witness {
            trail: Trail::default(),
            flip,
        };
        let mut outputs = Outputs::default();
        step_watched(PARAMS, STATE, &inputs, &mut outputs, &mut witness);
        link.send(&(outputs, witness.trail));
    }
}
