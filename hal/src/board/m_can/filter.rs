//! Which identifiers are let into the receive FIFO: a range each, everything else stays outside.

use crate::canopen::cob;

/// Identifiers from the first to the second, inclusive.
pub type Range = (u16, u16);

/// What a CANopen master listens to: emergencies, transmit PDOs, SDO answers and heartbeats of every node.
pub const MASTER: [Range; 7] = [
    of_every_node(cob::emcy(0)),
    of_every_node(cob::tpdo(1, 0)),
    of_every_node(cob::tpdo(2, 0)),
    of_every_node(cob::tpdo(3, 0)),
    of_every_node(cob::tpdo(4, 0)),
    of_every_node(cob::sdo_response(0)),
    of_every_node(cob::heartbeat(0)),
];

/// What a CANopen node listens to: NMT, SYNC, PDOs and SDO requests to any node, for the numbers of its PDOs are its master's to
/// choose, and heartbeats.
pub const NODE: [Range; 8] = [
    (cob::NMT, cob::NMT),
    (cob::SYNC, cob::SYNC),
    of_every_node(cob::rpdo(1, 0)),
    of_every_node(cob::rpdo(2, 0)),
    of_every_node(cob::rpdo(3, 0)),
    of_every_node(cob::rpdo(4, 0)),
    of_every_node(cob::sdo_request(0)),
    of_every_node(cob::heartbeat(0)),
];

const fn of_every_node(base: u16) -> Range {
    (base + 1, base + cob::NODE_MAX as u16)
}

/// The element of the filter list that lets a range into receive FIFO 0: SFT = range, SFEC = store in FIFO 0.
pub const fn element((first, last): Range) -> u32 {
    const RANGE: u32 = 0b00 << 30;
    const STORE: u32 = 0b001 << 27;
    RANGE | STORE | (first as u32) << 16 | last as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::cob::Service;

    /// What the controller does with an element, read back from its bits.
    fn lets_in(element: u32, id: u16) -> bool {
        assert_eq!(element >> 27, 1, "a range, stored in FIFO 0");
        (element >> 16 & 0x7FF..=element & 0x7FF).contains(&u32::from(id))
    }

    /// Whether exactly the identifiers of services in `wanted` pass.
    fn lets_in_just(ranges: &[Range], wanted: fn(Service) -> bool) {
        for id in 0..=0x7FF {
            let let_in = ranges.iter().any(|range| lets_in(element(*range), id));
            assert_eq!(let_in, Service::of(id).is_some_and(wanted), "{id:#05x}");
        }
    }

    #[test]
    fn a_master_hears_what_nodes_send_and_no_frame_of_its_own() {
        use Service::{Emergency, Heartbeat, SdoResponse, Tpdo};
        lets_in_just(&MASTER, |service| {
            matches!(service, Emergency(_) | Tpdo(..) | SdoResponse(_) | Heartbeat(_))
        });
    }

    #[test]
    fn a_node_hears_what_masters_send() {
        use Service::{Heartbeat, Nmt, Rpdo, SdoRequest, Sync};
        lets_in_just(&NODE, |service| {
            matches!(service, Nmt | Sync | Rpdo(..) | SdoRequest(_) | Heartbeat(_))
        });
    }
}
