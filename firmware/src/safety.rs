//! The last word: which motion is allowed, and what a fault makes of it.
//!
//! ```text
//! E-stop ──reset──▶ not armed ──start──▶ arming ──all enabled──▶ armed ──▶ running ──done──▶ stopping ──at rest──▶ stopped ─▶ not armed
//!   ▲  chain open, from everywhere                                           └─fault, braking─▶ stopping ──▶ faulted ──reset──▶ not armed
//! ```
//! Starts tripped: power-up is an E-stop until somebody presses reset. One axis that leaves "operation enabled" takes the whole arm.

use crate::fault::{Fault, Reaction, Trip};

use hal::canopen::emcy::code::HEARTBEAT as HEARTBEAT_LOST;
use hal::cia402::PowerState;
use hal::process::{Inputs, NEVER, PowerRequest, digital};
use hal::wire_enum;

/// Statuswords older than this many cycles say nothing (bus.md, rules).
const FRESH: u8 = 2;
/// The I/O node sends its inputs with each SYNC; this many missed means that the E-stop chain cannot be seen.
const IO_SILENT: u8 = 4;
/// The camera's heartbeat comes each 20 cycles: two of them missed.
const CAMERA_SILENT: u8 = 45;
/// Cycles that arming may take: 5 s.
const ARMING: u32 = 1000;
/// Late cycles within [`OVERRUN_WINDOW`] that stop the arm; fewer are only counted.
const OVERRUNS: u8 = 3;
/// Cycles after which a late one is forgotten: 1 s.
const OVERRUN_WINDOW: u8 = 200;
/// Cycles for which the axes must have been enabled before the arm may move, 50 ms: holding brakes open in about 20 ms.
const SETTLE: u32 = 10;
/// Cycles at rest before power goes off: 0.1 s.
const REST: u32 = 20;

/// Where the machine stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// E-stop latched: no power until reset.
    #[default]
    EStop,
    /// No power; start arms.
    NotArmed,
    /// Drives on their way to operation enabled.
    Arming,
    /// All drives enabled and holding.
    Armed,
    /// The job moves the arm.
    Running,
    /// Braking, under control.
    Stopping,
    /// At rest after a job; power goes off.
    Stopped,
    /// Off after a fault; reset acknowledges.
    Faulted,
}

wire_enum!(State {
    EStop,
    NotArmed,
    Arming,
    Armed,
    Running,
    Stopping,
    Stopped,
    Faulted
});

/// What the machine allows in this cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Permit {
    /// Asked of every drive.
    pub power: PowerRequest,
    /// The servo may move the arm (else: zero targets, integrators preset).
    pub servo: bool,
    /// The job may advance; false while servo is true means brake.
    pub advance: bool,
}

/// The machine's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Safety {
    state: State,
    trip: Trip,
    since: u32,
    digital: u8,
    late: u8,
    late_age: u8,
}

impl Safety {
    /// At power-up.
    pub const fn new() -> Self {
        Self {
            state: State::EStop,
            trip: Trip {
                fault: Fault::None,
                place: 0,
                cycle: 0,
            },
            since: 0,
            digital: 0,
            late: 0,
            late_age: 0,
        }
    }

    /// Where the machine stands.
    pub fn state(&self) -> State {
        self.state
    }

    /// The first fault since the last reset.
    pub fn trip(&self) -> Trip {
        self.trip
    }

    /// Takes in one cycle's inputs, before the job acts. `watch_camera` is true while the job depends on the camera.
    pub fn observe<const N: usize>(&mut self, cycle: u32, inputs: &Inputs<N>, watch_camera: bool) -> Permit {
        let pressed = inputs.digital & !self.digital;
        self.digital = inputs.digital;
        let enabled = inputs.axes.iter().all(|axis| is_enabled(axis.statusword, axis.age));
        let powered = matches!(
            self.state,
            State::Arming | State::Armed | State::Running | State::Stopping | State::Stopped
        );

        if inputs.digital & digital::ESTOP_CLOSED == 0 && inputs.io_age != NEVER {
            if self.state != State::EStop {
                self.latch(Fault::EStop, 0, cycle);
            }
        } else if powered {
            let (fault, place) = self.check(inputs, enabled, watch_camera);
            if fault != Fault::None {
                self.latch(fault, place, cycle);
            } else if pressed & digital::STOP != 0 {
                self.latch(Fault::StopButton, 0, cycle);
            }
        }

        match self.state {
            State::EStop | State::Faulted if pressed & digital::RESET != 0 && chain_closed(inputs) => {
                self.trip = Trip::default();
                self.enter(State::NotArmed, cycle);
            }
            State::NotArmed if pressed & digital::START != 0 && inputs.bus_ready => self.enter(State::Arming, cycle),
            State::Arming if !enabled && cycle.wrapping_sub(self.since) > ARMING => {
                self.latch(Fault::ArmingTimeout, 0, cycle);
            }
            State::Arming if enabled => self.enter(State::Armed, cycle),
            State::Armed if cycle.wrapping_sub(self.since) >= SETTLE => self.enter(State::Running, cycle),
            State::Stopped if cycle.wrapping_sub(self.since) >= REST => {
                self.enter(
                    if self.trip.fault == Fault::None {
                        State::NotArmed
                    } else {
                        State::Faulted
                    },
                    cycle,
                );
            }
            _ => {}
        }
        self.permit()
    }

    /// The job says that the arm is at rest: after its end, or after braking.
    pub fn at_rest(&mut self, cycle: u32) {
        if matches!(self.state, State::Running | State::Stopping) {
            self.enter(State::Stopped, cycle);
        }
    }

    /// Latches a fault, from here or from the job, and starts its reaction.
    pub fn latch(&mut self, fault: Fault, place: u8, cycle: u32) {
        if self.trip.fault == Fault::None {
            self.trip = Trip { fault, place, cycle };
        }
        if fault == Fault::EStop {
            self.trip = Trip { fault, place, cycle };
            self.enter(State::EStop, cycle);
            return;
        }
        match (fault.reaction(), self.state) {
            (Reaction::Brake, State::Running) => self.enter(State::Stopping, cycle),
            (Reaction::Brake, State::Stopping | State::Stopped) => {}
            _ => self.enter(State::Faulted, cycle),
        }
    }

    /// What the present state allows.
    pub fn permit(&self) -> Permit {
        let power = match self.state {
            State::Arming | State::Armed | State::Running | State::Stopping | State::Stopped => PowerRequest::Enable,
            State::EStop => PowerRequest::QuickStop,
            State::Faulted => PowerRequest::QuickStop,
            State::NotArmed => PowerRequest::ResetFault,
        };
        Permit {
            power,
            servo: matches!(
                self.state,
                State::Armed | State::Running | State::Stopping | State::Stopped
            ),
            advance: self.state == State::Running,
        }
    }

    fn enter(&mut self, state: State, cycle: u32) {
        if state != self.state {
            self.state = state;
            self.since = cycle;
        }
    }

    /// The first fault that the inputs show while powered; `enabled` if all drives said just now that they are.
    fn check<const N: usize>(&mut self, inputs: &Inputs<N>, enabled: bool, watch_camera: bool) -> (Fault, u8) {
        self.late_age = self.late_age.saturating_add(1);
        if self.late_age > OVERRUN_WINDOW {
            self.late = 0;
        }
        if inputs.overruns > 0 {
            self.late = self.late.saturating_add(inputs.overruns);
            self.late_age = 0;
        }
        let suspects: &[_] = if enabled { &[] } else { &inputs.axes };
        for (place, axis) in suspects.iter().enumerate() {
            let place = place as u8;
            if axis.age > FRESH {
                return (Fault::DriveSilent, place);
            }
            match PowerState::of(axis.statusword) {
                Some(PowerState::Fault | PowerState::FaultReaction) => return (Fault::DriveFault, place),
                Some(PowerState::OperationEnabled) => {}
                _ if self.state == State::Arming => {}
                _ => return (Fault::DriveOff, place),
            }
        }
        // Silence of the camera and the I/O node is judged by their ages, which say what it means.
        let known_by_age = inputs.emergency_node as usize > N && inputs.emergency_code == HEARTBEAT_LOST;
        if inputs.io_age > IO_SILENT {
            (Fault::IoSilent, 0)
        } else if watch_camera && inputs.camera_age > CAMERA_SILENT {
            (Fault::CameraSilent, 0)
        } else if inputs.emergency_node != 0 && !known_by_age {
            (Fault::Emergency, inputs.emergency_node)
        } else if self.late >= OVERRUNS {
            (Fault::Overrun, 0)
        } else {
            (Fault::None, 0)
        }
    }
}

fn is_enabled(statusword: u16, age: u8) -> bool {
    age <= FRESH && PowerState::of(statusword) == Some(PowerState::OperationEnabled)
}

fn chain_closed<const N: usize>(inputs: &Inputs<N>) -> bool {
    inputs.io_age <= IO_SILENT && inputs.digital & digital::ESTOP_CLOSED != 0
}
