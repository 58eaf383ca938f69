//! The power state machine as a drive runs it.
//!
//! It decides states only. The drive's motion part asks [`Machine::state`] what to do with the torque and tells when a
//! stop is over ([`Machine::stopped`]) or a fault has come ([`Machine::fail`]).

use super::PowerState;

/// Which transitions the drive's condition allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Condition {
    /// The power stage has its voltage.
    pub voltage: bool,
    /// No cause of a fault is present.
    pub healthy: bool,
}

/// State, and what of the past decides the next one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Machine {
    state: PowerState,
    /// Bit 7 of the last controlword: a fault is reset by its rising edge only.
    reset_bit: bool,
    /// After a quick stop the drive stays in Quick stop active, holding (0x605A = 5..=8), else it switches off.
    pub holds_after_quick_stop: bool,
}

impl Machine {
    /// State now.
    pub fn state(&self) -> PowerState {
        self.state
    }

    /// The self-test is over (transition 1).
    pub fn ready(&mut self) {
        if self.state == PowerState::NotReady {
            self.state = PowerState::SwitchOnDisabled;
        }
    }

    /// Takes a controlword; true if a fault was reset.
    pub fn control(&mut self, word: u16, condition: Condition) -> bool {
        use PowerState::*;
        let rising = word & 0x80 != 0 && !self.reset_bit;
        self.reset_bit = word & 0x80 != 0;
        if self.state == Fault {
            let reset = rising && condition.healthy;
            if reset {
                self.state = SwitchOnDisabled;
            }
            return reset;
        }
        // CiA 402 table of commands; × bits are masked out.
        let disable_voltage = word & 0x82 == 0x00;
        let quick_stop = word & 0x86 == 0x02;
        let shutdown = word & 0x87 == 0x06;
        let switch_on = word & 0x8F == 0x07;
        let enable = word & 0x8F == 0x0F;
        let on = condition.voltage;
        self.state = match self.state {
            SwitchOnDisabled if shutdown => ReadyToSwitchOn,
            ReadyToSwitchOn | SwitchedOn if disable_voltage || quick_stop => SwitchOnDisabled,
            ReadyToSwitchOn if (switch_on || enable) && on => SwitchedOn,
            SwitchedOn if shutdown => ReadyToSwitchOn,
            SwitchedOn if enable && on => OperationEnabled,
            OperationEnabled | QuickStopActive if disable_voltage => SwitchOnDisabled,
            OperationEnabled if quick_stop => QuickStopActive,
            OperationEnabled if shutdown => ReadyToSwitchOn,
            OperationEnabled if switch_on => SwitchedOn,
            other => other,
        };
        false
    }

    /// Stops by the drive's own decision, as a quick stop.
    pub fn quick_stop(&mut self) {
        if self.state == PowerState::OperationEnabled {
            self.state = PowerState::QuickStopActive;
        }
    }

    /// Switches torque off by the drive's own decision.
    pub fn disable(&mut self) {
        if !matches!(
            self.state,
            PowerState::NotReady | PowerState::FaultReaction | PowerState::Fault
        ) {
            self.state = PowerState::SwitchOnDisabled;
        }
    }

    /// A fault has come: with `ramp` the drive may stop first, if it carries torque.
    pub fn fail(&mut self, ramp: bool) {
        if self.state != PowerState::Fault {
            self.state = if ramp && self.state.has_torque() {
                PowerState::FaultReaction
            } else {
                PowerState::Fault
            };
        }
    }

    /// The drive has come to a stand on its ramp.
    pub fn stopped(&mut self) {
        match self.state {
            PowerState::QuickStopActive if !self.holds_after_quick_stop => self.state = PowerState::SwitchOnDisabled,
            PowerState::FaultReaction => self.state = PowerState::Fault,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::control::*;
    use super::*;
    use PowerState::*;

    const WELL: Condition = Condition {
        voltage: true,
        healthy: true,
    };

    fn enabled() -> Machine {
        let mut machine = Machine {
            holds_after_quick_stop: true,
            ..Machine::default()
        };
        machine.ready();
        for word in [SHUTDOWN, SWITCH_ON, ENABLE] {
            machine.control(word, WELL);
        }
        assert_eq!(machine.state(), OperationEnabled);
        machine
    }

    #[test]
    fn the_walk_up_takes_one_step_for_each_controlword() {
        let mut machine = Machine::default();
        machine.control(ENABLE, WELL);
        assert_eq!(machine.state(), NotReady);
        machine.ready();
        for (word, state) in [
            (ENABLE, SwitchOnDisabled),
            (SHUTDOWN, ReadyToSwitchOn),
            (ENABLE, SwitchedOn),
            (ENABLE, OperationEnabled),
            (ENABLE, OperationEnabled),
            (SWITCH_ON, SwitchedOn),
            (SHUTDOWN, ReadyToSwitchOn),
            (DISABLE_VOLTAGE, SwitchOnDisabled),
        ] {
            machine.control(word, WELL);
            assert_eq!(machine.state(), state, "after 0x{word:04X}");
        }
    }

    #[test]
    fn without_voltage_it_is_ready_but_not_switched_on() {
        let mut machine = Machine::default();
        machine.ready();
        machine.control(SHUTDOWN, WELL);
        machine.control(SWITCH_ON, Condition { voltage: false, ..WELL });
        assert_eq!(machine.state(), ReadyToSwitchOn);
    }

    #[test]
    fn a_fault_is_reset_on_a_rising_edge_only_and_only_when_its_cause_is_gone() {
        let mut machine = enabled();
        machine.control(ENABLE | FAULT_RESET, WELL);
        machine.fail(false);
        assert!(!machine.control(FAULT_RESET, WELL), "no edge: the bit was up before");
        machine.control(0, WELL);
        assert!(!machine.control(FAULT_RESET, Condition { healthy: false, ..WELL }));
        machine.control(0, WELL);
        assert!(machine.control(FAULT_RESET, WELL));
        assert_eq!(machine.state(), SwitchOnDisabled);
    }

    #[test]
    fn a_fault_with_torque_stops_first_and_without_torque_is_at_once() {
        let mut machine = enabled();
        machine.fail(true);
        assert_eq!(machine.state(), FaultReaction);
        machine.control(DISABLE_VOLTAGE, WELL);
        assert_eq!(machine.state(), FaultReaction);
        machine.stopped();
        assert_eq!(machine.state(), Fault);
        let mut machine = Machine::default();
        machine.ready();
        machine.fail(true);
        assert_eq!(machine.state(), Fault);
    }

    #[test]
    fn a_quick_stop_holds_or_switches_off_as_its_option_says() {
        let mut machine = enabled();
        machine.control(QUICK_STOP, WELL);
        machine.stopped();
        assert_eq!(machine.state(), QuickStopActive);
        machine.control(DISABLE_VOLTAGE, WELL);
        assert_eq!(machine.state(), SwitchOnDisabled);
        let mut machine = Machine {
            holds_after_quick_stop: false,
            ..enabled()
        };
        machine.quick_stop();
        machine.stopped();
        assert_eq!(machine.state(), SwitchOnDisabled);
    }
}
