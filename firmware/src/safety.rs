//! The last word: which motion is allowed, and what a fault makes of it.
//!
//! ```text
//! E-stop ──reset──▶ not armed ──start──▶ arming ──all enabled──▶ armed ──▶ running ──done, at rest──▶ stopped ──▶ not armed
//!   ▲                                                                        ├─ fault to brake for ─▶ stopping ──▶ stopped ──▶ faulted
//!   └─ chain open, from everywhere                                           └─ any other fault ─▶ faulted ──reset──▶ not armed
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
const OVERRUNS: usize = 3;
/// Cycles in which so many may not be late: 1 s.
const OVERRUN_WINDOW: u32 = 200;
/// Fastest that an axis may still turn when a reset is accepted, counts/s: 1 mrad/s at the slowest of the gears.
const STANDSTILL: u32 = 1600;
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
    /// When the last cycles were late, newest first; zero is never.
    late: [u32; OVERRUNS],
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
            late: [0; OVERRUNS],
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
            let (fault, place) = self.check(cycle, inputs, enabled, watch_camera);
            if fault != Fault::None {
                self.latch(fault, place, cycle);
            } else if inputs.digital & digital::STOP != 0 {
                self.latch(Fault::StopButton, 0, cycle);
            }
        }

        match self.state {
            State::EStop | State::Faulted
                if pressed & digital::RESET != 0 && chain_closed(inputs) && stands(inputs) =>
            {
                self.trip = Trip::default();
                self.enter(State::NotArmed, cycle);
            }
            // A stop button that is held down beats start.
            State::NotArmed
                if pressed & digital::START != 0 && inputs.digital & digital::STOP == 0 && inputs.bus_ready =>
            {
                self.late = [0; OVERRUNS];
                self.enter(State::Arming, cycle);
            }
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
    fn check<const N: usize>(
        &mut self,
        cycle: u32,
        inputs: &Inputs<N>,
        enabled: bool,
        watch_camera: bool,
    ) -> (Fault, u8) {
        for _ in 0..(inputs.overruns as usize).min(OVERRUNS) {
            let [newest, middle, _] = self.late;
            self.late = [cycle, newest, middle];
        }
        let [.., oldest] = self.late;
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
        } else if oldest != 0 && cycle.wrapping_sub(oldest) < OVERRUN_WINDOW {
            (Fault::Overrun, 0)
        } else {
            (Fault::None, 0)
        }
    }
}

fn is_enabled(statusword: u16, age: u8) -> bool {
    age <= FRESH && PowerState::of(statusword) == Some(PowerState::OperationEnabled)
}

/// No axis turns any more.
fn stands<const N: usize>(inputs: &Inputs<N>) -> bool {
    inputs
        .axes
        .iter()
        .all(|axis| axis.velocity.unsigned_abs() <= STANDSTILL)
}

fn chain_closed<const N: usize>(inputs: &Inputs<N>) -> bool {
    inputs.io_age <= IO_SILENT && inputs.digital & digital::ESTOP_CLOSED != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal::process::AxisInput;

    const ENABLED: u16 = 0x0027;
    const OFF: u16 = 0x0040;

    fn inputs(statusword: u16, digital: u8) -> Inputs<2> {
        let axis = AxisInput {
            statusword,
            age: 0,
            ..AxisInput::default()
        };
        Inputs {
            axes: [axis; 2],
            digital,
            io_age: 0,
            camera_age: 0,
            bus_ready: true,
            ..Inputs::default()
        }
    }

    /// A machine that has been reset, started and enabled, and runs.
    fn running() -> (Safety, u32) {
        let mut safety = Safety::default();
        let presses = [digital::RESET, 0, digital::START, 0];
        let mut cycle = 0;
        for press in presses {
            cycle += 1;
            safety.observe(cycle, &inputs(OFF, digital::ESTOP_CLOSED | press), false);
        }
        while safety.state() != State::Running && cycle < 100 {
            cycle += 1;
            safety.observe(cycle, &inputs(ENABLED, digital::ESTOP_CLOSED), false);
        }
        assert_eq!(safety.state(), State::Running);
        (safety, cycle)
    }

    #[test]
    fn power_up_is_an_estop_until_reset_is_pressed_with_the_chain_closed() {
        let mut safety = Safety::default();
        safety.observe(1, &inputs(OFF, digital::START | digital::ESTOP_CLOSED), false);
        assert_eq!(safety.state(), State::EStop, "start alone does nothing");
        safety.observe(2, &inputs(OFF, digital::RESET), false);
        assert_eq!(safety.state(), State::EStop, "the chain is open");
        safety.observe(3, &inputs(OFF, digital::ESTOP_CLOSED | digital::RESET), false);
        assert_eq!(safety.state(), State::EStop, "reset was held down: no edge");
        safety.observe(4, &inputs(OFF, digital::ESTOP_CLOSED), false);
        safety.observe(5, &inputs(OFF, digital::ESTOP_CLOSED | digital::RESET), false);
        assert_eq!(safety.state(), State::NotArmed);
        assert_eq!(safety.permit().power, PowerRequest::ResetFault, "no power yet");
    }

    #[test]
    fn one_axis_that_leaves_operation_enabled_takes_the_whole_arm() {
        let (mut safety, cycle) = running();
        let mut one = inputs(ENABLED, digital::ESTOP_CLOSED);
        one.axes[1].statusword = OFF;
        let permit = safety.observe(cycle + 1, &one, false);
        assert_eq!(
            (safety.state(), safety.trip().fault, safety.trip().place),
            (State::Faulted, Fault::DriveOff, 1)
        );
        assert!(!permit.servo && permit.power == PowerRequest::QuickStop);
    }

    #[test]
    fn an_estop_is_latched_when_the_chain_closes_again() {
        let (mut safety, cycle) = running();
        safety.observe(cycle + 1, &inputs(ENABLED, 0), false);
        assert_eq!(safety.state(), State::EStop);
        safety.observe(cycle + 2, &inputs(ENABLED, digital::ESTOP_CLOSED), false);
        assert_eq!((safety.state(), safety.trip().fault), (State::EStop, Fault::EStop));
    }

    #[test]
    fn a_missing_tpdo_is_unknown_and_not_disabled() {
        let (mut safety, cycle) = running();
        let mut silent = inputs(ENABLED, digital::ESTOP_CLOSED);
        silent.axes[0].age = FRESH;
        safety.observe(cycle + 1, &silent, false);
        assert_eq!(safety.state(), State::Running, "two cycles old is fresh");
        silent.axes[0].age = FRESH + 1;
        safety.observe(cycle + 2, &silent, false);
        assert_eq!(safety.trip().fault, Fault::DriveSilent);
    }

    #[test]
    fn late_cycles_are_counted_and_three_within_a_second_brake_along_the_path() {
        let (mut safety, cycle) = running();
        let mut late = inputs(ENABLED, digital::ESTOP_CLOSED);
        late.overruns = 1;
        safety.observe(cycle + 1, &late, false);
        safety.observe(cycle + 2, &late, false);
        assert_eq!(safety.state(), State::Running, "two are only counted");
        for quiet in 3..202 {
            safety.observe(cycle + quiet, &inputs(ENABLED, digital::ESTOP_CLOSED), false);
        }
        safety.observe(cycle + 202, &late, false);
        assert_eq!(safety.state(), State::Running, "forgotten after a second");
        safety.observe(cycle + 203, &late, false);
        let permit = safety.observe(cycle + 204, &late, false);
        assert_eq!((safety.state(), safety.trip().fault), (State::Stopping, Fault::Overrun));
        assert!(
            permit.servo && !permit.advance,
            "the servo brakes, the job does not go on"
        );
    }

    #[test]
    fn a_braked_arm_at_rest_is_switched_off_and_stays_faulted_until_reset() {
        let (mut safety, mut cycle) = running();
        safety.latch(Fault::Blind, 0, cycle);
        assert_eq!(safety.state(), State::Stopping);
        safety.at_rest(cycle);
        for _ in 0..30 {
            cycle += 1;
            safety.observe(cycle, &inputs(ENABLED, digital::ESTOP_CLOSED), false);
        }
        assert_eq!((safety.state(), safety.trip().fault), (State::Faulted, Fault::Blind));
        safety.observe(cycle + 1, &inputs(OFF, digital::ESTOP_CLOSED | digital::RESET), false);
        assert_eq!((safety.state(), safety.trip().fault), (State::NotArmed, Fault::None));
    }

    #[test]
    fn a_stop_button_held_down_beats_start_and_stops_a_running_arm() {
        let (mut safety, cycle) = running();
        safety.observe(
            cycle + 1,
            &inputs(ENABLED, digital::ESTOP_CLOSED | digital::STOP),
            false,
        );
        assert_eq!(
            (safety.state(), safety.trip().fault),
            (State::Stopping, Fault::StopButton)
        );
        let mut safety = Safety::default();
        for (cycle, press) in (1..).zip([digital::RESET, 0, digital::STOP, digital::STOP | digital::START]) {
            safety.observe(cycle, &inputs(OFF, digital::ESTOP_CLOSED | press), false);
        }
        assert_eq!(safety.state(), State::NotArmed);
    }

    #[test]
    fn a_reset_waits_until_the_arm_stands() {
        let (mut safety, cycle) = running();
        safety.latch(Fault::FollowingError, 0, cycle);
        let mut moving = inputs(ENABLED, digital::ESTOP_CLOSED | digital::RESET);
        moving.axes[1].velocity = -20_000;
        safety.observe(cycle + 1, &moving, false);
        assert_eq!(safety.state(), State::Faulted);
        safety.observe(cycle + 2, &inputs(ENABLED, digital::ESTOP_CLOSED), false);
        safety.observe(
            cycle + 3,
            &inputs(ENABLED, digital::ESTOP_CLOSED | digital::RESET),
            false,
        );
        assert_eq!(safety.state(), State::NotArmed);
    }

    #[test]
    fn an_estop_after_a_fault_keeps_the_faults_name() {
        let (mut safety, cycle) = running();
        safety.latch(Fault::DriveFault, 3, cycle);
        safety.observe(cycle + 1, &inputs(ENABLED, 0), false);
        assert_eq!((safety.state(), safety.trip().fault), (State::EStop, Fault::DriveFault));
    }
}
