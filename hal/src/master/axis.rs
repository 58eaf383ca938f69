//! One axis: its drive's bring-up, its controlwords, its mailboxes.

use super::station::Station;
use crate::can::Frame;
use crate::canopen::cob;
use crate::cia402::command::{Commander, FRESH};
use crate::cia402::pdo::{Motion, TorqueCommand, VelocityCommand};
use crate::cia402::{Mode, PowerState};
use crate::process::{AxisInput, AxisOutput};
use crate::wire::Wire;

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Bring-up and watch.
    pub station: Station,
    /// Controlwords.
    pub commander: Commander,
    /// Newest of TPDO1 and TPDO2.
    pub input: AxisInput,
}

impl Axis {
    /// Of no drive yet.
    pub const EMPTY: Self = Self {
        station: Station::EMPTY,
        commander: Commander::new(),
        input: AxisInput::EMPTY,
    };

    /// TPDO1 of this cycle.
    pub fn take(&mut self, motion: Motion) {
        self.input.position = motion.position;
        self.input.torque = motion.torque;
        self.input.statusword = motion.statusword;
        self.input.age = 0;
    }

    /// RPDO1 of this cycle, once the drive is operational.
    #[inline(always)] // a frame is three words, which a call hands over through memory
    pub fn command(&mut self, mode: Mode, output: &AxisOutput) -> Option<Frame> {
        if !self.station.is_operational() {
            self.commander = Commander::default();
            return None;
        }
        let state = if self.input.age <= FRESH {
            PowerState::of(self.input.statusword)
        } else {
            None
        };
        let controlword = self.commander.next(output.request, state);
        // A drive that is known not to follow gets nothing to follow, so that enabling it is without a bump.
        let follows = matches!(state, None | Some(PowerState::OperationEnabled));
        let (velocity, torque) = if follows {
            (output.velocity, output.torque)
        } else {
            (0, 0)
        };
        let id = cob::rpdo(1, self.station.node());
        Some(match mode {
            Mode::Velocity => Frame::of(
                id,
                VelocityCommand {
                    controlword,
                    velocity,
                    torque_offset: torque,
                }
                .encode(),
            ),
            Mode::Torque => Frame::of(id, TorqueCommand { controlword, torque }.encode()),
        })
    }
}
