//! Network management: the states of a node and the commands that change them (CiA 301, 7.3.2).

/// What a node is doing, as its heartbeat says it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NmtState {
    /// Just started; said once, never held.
    #[default]
    BootUp,
    /// Neither PDO nor SDO.
    Stopped,
    /// PDOs and SDOs.
    Operational,
    /// SDOs only: the state for set-up.
    PreOperational,
}

impl NmtState {
    /// The heartbeat byte.
    pub const fn code(self) -> u8 {
        match self {
            Self::BootUp => 0x00,
            Self::Stopped => 0x04,
            Self::Operational => 0x05,
            Self::PreOperational => 0x7F,
        }
    }

    /// State of a heartbeat byte (its top bit is the toggle of node guarding, unused); `None` for an unlisted code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code & 0x7F {
            0x00 => Some(Self::BootUp),
            0x04 => Some(Self::Stopped),
            0x05 => Some(Self::Operational),
            0x7F => Some(Self::PreOperational),
            _ => None,
        }
    }
}

/// A command of the NMT master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtCommand {
    /// To operational.
    Start,
    /// To stopped.
    Stop,
    /// To pre-operational.
    PreOperational,
    /// Restart application and communication.
    ResetNode,
    /// Restart communication: its parameters return to power-on values.
    ResetCommunication,
}

impl NmtCommand {
    /// Frame data: command, node (0 is all nodes).
    pub const fn encode(self, node: u8) -> [u8; 2] {
        let command = match self {
            Self::Start => 0x01,
            Self::Stop => 0x02,
            Self::PreOperational => 0x80,
            Self::ResetNode => 0x81,
            Self::ResetCommunication => 0x82,
        };
        [command, node]
    }

    /// Command and addressed node of frame data; `None` for a wrong length or an unlisted command.
    pub const fn decode(bytes: &[u8]) -> Option<(Self, u8)> {
        let &[command, node] = bytes else { return None };
        let command = match command {
            0x01 => Self::Start,
            0x02 => Self::Stop,
            0x80 => Self::PreOperational,
            0x81 => Self::ResetNode,
            0x82 => Self::ResetCommunication,
            _ => return None,
        };
        Some((command, node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_byte_that_decodes_encodes_to_itself() {
        let known = (0..=255u8).filter(|&byte| match NmtCommand::decode(&[byte, 7]) {
            Some((command, node)) => {
                assert_eq!(command.encode(node), [byte, 7]);
                true
            }
            None => false,
        });
        assert_eq!(known.count(), 5);
    }

    #[test]
    fn every_state_survives_its_code_and_the_guarding_toggle() {
        for state in [
            NmtState::BootUp,
            NmtState::Stopped,
            NmtState::Operational,
            NmtState::PreOperational,
        ] {
            assert_eq!(NmtState::from_code(state.code()), Some(state));
            assert_eq!(NmtState::from_code(state.code() | 0x80), Some(state));
        }
    }
}
