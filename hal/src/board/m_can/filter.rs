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

    #[test]
    fn the_master_hears_every_node_and_no_frame_of_its_own() {
        for id in 0..=0x7FF {
            let wanted = matches!(
                Service::of(id),
                Some(Service::Emergency(_) | Service::Tpdo(..) | Service::SdoResponse(_) | Service::Heartbeat(_))
            );
            let let_in = MASTER.iter().any(|range| lets_in(element(*range), id));
            assert_eq!(let_in, wanted, "{id:#05x}");
        }
    }
}
