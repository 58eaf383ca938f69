//! Identifiers of the pre-defined connection set (CiA 301, 11 bit).

/// NMT command, master to all.
pub const NMT: u16 = 0x000;
/// SYNC, master to all.
pub const SYNC: u16 = 0x080;
/// Highest node number.
pub const NODE_MAX: u8 = 0x7F;

const fn with(base: u16, node: u8) -> u16 {
    base + (node & NODE_MAX) as u16
}

/// Emergency object of a node.
pub const fn emcy(node: u8) -> u16 {
    with(0x080, node)
}

/// Transmit PDO `k` = 1..=4 of a node (node to master).
pub const fn tpdo(k: u8, node: u8) -> u16 {
    with(0x080 + 0x100 * (k & 7) as u16, node)
}

/// Receive PDO `k` = 1..=4 of a node (master to node).
pub const fn rpdo(k: u8, node: u8) -> u16 {
    with(0x100 + 0x100 * (k & 7) as u16, node)
}

/// SDO answer, server to client.
pub const fn sdo_response(node: u8) -> u16 {
    with(0x580, node)
}

/// SDO request, client to server.
pub const fn sdo_request(node: u8) -> u16 {
    with(0x600, node)
}

/// Heartbeat and boot-up of a node.
pub const fn heartbeat(node: u8) -> u16 {
    with(0x700, node)
}

/// What a frame is, told by its identifier; nodes are 1..=127, PDO numbers 1..=4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// NMT command.
    Nmt,
    /// SYNC.
    Sync,
    /// Emergency of a node.
    Emergency(u8),
    /// Transmit PDO: number, node.
    Tpdo(u8, u8),
    /// Receive PDO: number, node.
    Rpdo(u8, u8),
    /// SDO answer of a node.
    SdoResponse(u8),
    /// SDO request to a node.
    SdoRequest(u8),
    /// Heartbeat of a node.
    Heartbeat(u8),
}

impl Service {
    /// The service of identifier `cob`; `None` if the pre-defined set has none there.
    pub fn of(cob: u16) -> Option<Self> {
        let node = (cob & 0x7F) as u8;
        match (cob & 0x780, node) {
            (0x000, 0) => Some(Self::Nmt),
            (0x080, 0) => Some(Self::Sync),
            (_, 0) => None,
            (0x080, _) => Some(Self::Emergency(node)),
            (0x180, _) => Some(Self::Tpdo(1, node)),
            (0x200, _) => Some(Self::Rpdo(1, node)),
            (0x280, _) => Some(Self::Tpdo(2, node)),
            (0x300, _) => Some(Self::Rpdo(2, node)),
            (0x380, _) => Some(Self::Tpdo(3, node)),
            (0x400, _) => Some(Self::Rpdo(3, node)),
            (0x480, _) => Some(Self::Tpdo(4, node)),
            (0x500, _) => Some(Self::Rpdo(4, node)),
            (0x580, _) => Some(Self::SdoResponse(node)),
            (0x600, _) => Some(Self::SdoRequest(node)),
            (0x700, _) => Some(Self::Heartbeat(node)),
            _ => None,
        }
    }

    /// The identifier of the service.
    pub fn cob(self) -> u16 {
        match self {
            Self::Nmt => NMT,
            Self::Sync => SYNC,
            Self::Emergency(node) => emcy(node),
            Self::Tpdo(k, node) => tpdo(k, node),
            Self::Rpdo(k, node) => rpdo(k, node),
            Self::SdoResponse(node) => sdo_response(node),
            Self::SdoRequest(node) => sdo_request(node),
            Self::Heartbeat(node) => heartbeat(node),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_identifier_that_names_a_service_is_that_service_s_identifier() {
        let named = (0..=0x7FF).filter(|&cob| match Service::of(cob) {
            Some(service) => {
                assert_eq!(service.cob(), cob);
                true
            }
            None => false,
        });
        assert_eq!(named.count(), 2 + 12 * 127);
    }

    #[test]
    fn node_5_has_the_identifiers_of_the_standard() {
        assert_eq!(
            [emcy(5), tpdo(1, 5), rpdo(1, 5), tpdo(4, 5)],
            [0x085, 0x185, 0x205, 0x485]
        );
        assert_eq!([sdo_response(5), sdo_request(5), heartbeat(5)], [0x585, 0x605, 0x705]);
    }
}
