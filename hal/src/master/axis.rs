//! One axis: its drive's bring-up, its controlwords.

use super::station::Station;
use crate::can::Frame;
use crate::canopen::cob;
use crate::cia402::command::{Commander, FRESH};
use crate::cia402::pdo::{TorqueCommand, VelocityCommand};
use crate::cia402::{Mode, PowerState};
use crate::process::{AxisInput, AxisOutput};

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Bring-up and watch.
    pub station: Station,
    /// Controlwords.
    pub commander: Commander,
}

impl Axis {
    /// Of no drive yet.
    pub const EMPTY: Self = Self {
        station: Station::EMPTY,
        commander: Commander::new(),
    };

    /// RPDO1 of this cycle to drive `node`, which last said `input`; none before it is operational.
    #[inline(always)] // a frame is three words, which a call hands over through memory
    pub fn command(&mut self, mode: Mode, node: u8, input: &AxisInput, output: &AxisOutput) -> Option<Frame> {
        if !self.station.is_operational() {
            self.commander = Commander::default();
            return None;
        }
        let state = if input.age <= FRESH {
            PowerState::of(input.statusword)
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
        let id = cob::rpdo(1, node);
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
