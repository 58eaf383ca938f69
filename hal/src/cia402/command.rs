//! The choice of controlwords as the master makes it: what the core asks of an axis, and what its drive last said.

use super::{PowerState, control};
use crate::process::PowerRequest;

/// Oldest statusword to act on, cycles: one lost TPDO is tolerated, two are not (spec of the bus).
pub const FRESH: u8 = 2;

/// The controlwords of one axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct Commander {
    word: u16,
    /// The edge of this request for a fault reset was given: one per request.
    reset_given: bool,
}

impl Commander {
    /// Nothing was sent yet.
    pub const fn new() -> Self {
        Self {
            word: 0,
            reset_given: false,
        }
    }

    /// The next controlword for `request`, given the state that a fresh statusword says; `None` is unknown.
    ///
    /// Unknown is not disabled: stopping needs no knowledge, everything else keeps the last word.
    pub fn next(&mut self, request: PowerRequest, state: Option<PowerState>) -> u16 {
        use PowerState::*;
        if let (PowerRequest::Enable, Some(OperationEnabled)) = (request, state) {
            // As in all cycles but few.
            (self.word, self.reset_given) = (control::ENABLE, false);
            return self.word;
        }
        if request != PowerRequest::ResetFault {
            self.reset_given = false;
        }
        self.word = match (request, state) {
            (PowerRequest::Off, _) => control::DISABLE_VOLTAGE,
            (PowerRequest::QuickStop, Some(Fault)) => control::DISABLE_VOLTAGE,
            (PowerRequest::QuickStop, _) => control::QUICK_STOP,
            (PowerRequest::Enable, None) => self.word & !control::FAULT_RESET,
            (PowerRequest::Enable, Some(state)) => match state {
                NotReady | FaultReaction | Fault | QuickStopActive => control::DISABLE_VOLTAGE,
                SwitchOnDisabled => control::SHUTDOWN,
                ReadyToSwitchOn => control::SWITCH_ON,
                SwitchedOn | OperationEnabled => control::ENABLE,
            },
            (PowerRequest::ResetFault, Some(Fault)) if !self.reset_given => {
                // The edge needs a low before it.
                self.reset_given = self.word & control::FAULT_RESET == 0;
                if self.reset_given {
                    control::FAULT_RESET
                } else {
                    control::DISABLE_VOLTAGE
                }
            }
            // The bit stays up until the drive answers: a word may be replaced on its way, a level cannot be missed.
            (PowerRequest::ResetFault, Some(Fault) | None) => self.word & control::FAULT_RESET,
            (PowerRequest::ResetFault, Some(_)) => control::DISABLE_VOLTAGE,
        };
        self.word
    }
}

#[cfg(test)]
mod tests {
    use super::super::machine::{Condition, Machine};
    use super::*;

    const WELL: Condition = Condition {
        voltage: true,
        healthy: true,
    };

    /// Runs a drive and its commander; the drive's answer comes a cycle after the word, as on the bus.
    fn run(machine: &mut Machine, commander: &mut Commander, request: PowerRequest, cycles: u32) -> Vec<PowerState> {
        (0..cycles)
            .map(|_| {
                let word = commander.next(request, Some(machine.state()));
                machine.control(word, WELL);
                machine.state()
            })
            .collect()
    }

    extern crate std;
    use std::vec::Vec;

    #[test]
    fn enable_walks_a_drive_up_in_three_cycles_and_stays() {
        use PowerState::*;
        let (mut machine, mut commander) = (Machine::default(), Commander::default());
        machine.ready();
        let walk = run(&mut machine, &mut commander, PowerRequest::Enable, 5);
        assert_eq!(
            walk,
            [
                ReadyToSwitchOn,
                SwitchedOn,
                OperationEnabled,
                OperationEnabled,
                OperationEnabled
            ]
        );
    }

    #[test]
    fn a_request_to_reset_gives_one_edge_and_enable_never_does() {
        let mut machine = Machine::default();
        let mut commander = Commander::default();
        machine.ready();
        machine.fail(false);
        assert!(
            run(&mut machine, &mut commander, PowerRequest::Enable, 10)
                .iter()
                .all(|&s| s == PowerState::Fault)
        );
        let sick = Condition { healthy: false, ..WELL };
        let mut last = 0;
        let mut edges = 0;
        for _ in 0..10 {
            let word = commander.next(PowerRequest::ResetFault, Some(machine.state()));
            edges += u32::from(word & 0x80 != 0 && last & 0x80 == 0);
            last = word;
            machine.control(word, sick);
        }
        assert_eq!(edges, 1);
        run(&mut machine, &mut commander, PowerRequest::Off, 1);
        let walk = run(&mut machine, &mut commander, PowerRequest::ResetFault, 2);
        assert_eq!(walk, [PowerState::SwitchOnDisabled; 2]);
    }

    #[test]
    fn an_unknown_state_keeps_an_enabled_drive_enabled_but_never_hinders_a_stop() {
        let mut commander = Commander::default();
        commander.next(PowerRequest::Enable, Some(PowerState::OperationEnabled));
        assert_eq!(commander.next(PowerRequest::Enable, None), 0x000F);
        assert_eq!(commander.next(PowerRequest::QuickStop, None), 0x0002);
        assert_eq!(commander.next(PowerRequest::Off, None), 0x0000);
        assert_eq!(commander.next(PowerRequest::Enable, None), 0x0000);
    }
}
