//! Which transmit buffer a frame goes to: one mailbox per identifier, as every node of the emulated bus has.
//!
//! Of two frames with one identifier the older, if it still waits, is worth nothing any more: a target of the cycle
//! before, an earlier heartbeat. So it is withdrawn. A bus that carries nothing for a while then ends with the newest
//! frame of each identifier waiting, and not with a queue of old ones.

/// Transmit buffers, as many as the controller has at most.
pub const BUFFERS: usize = 32;

/// What each buffer was last given.
#[derive(Clone, Copy, Debug)]
pub struct Mailboxes {
    ids: [u16; BUFFERS],
}

/// Where a frame goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The buffer, 0 to 31.
    pub buffer: u32,
    /// Buffers whose frames are to be withdrawn, as bits.
    pub withdrawn: u32,
}

impl Mailboxes {
    /// Nothing was sent yet.
    pub const fn new() -> Self {
        Self { ids: [0; BUFFERS] }
    }

    /// A place for a frame with identifier `id` while the buffers with bits in `waiting` wait (register TXBRP); `None` if
    /// all wait. A frame on the wire is not pulled back by being withdrawn: it ends, and the newer one follows.
    pub fn place(&mut self, id: u16, waiting: u32) -> Option<Place> {
        let buffer = waiting.trailing_ones();
        let mut withdrawn = 0;
        for (at, given) in self.ids.iter().enumerate() {
            let bit = 1 << at;
            if waiting & bit != 0 && *given == id {
                withdrawn |= bit;
            }
        }
        *self.ids.get_mut(buffer as usize)? = id;
        Some(Place { buffer, withdrawn })
    }
}

impl Default for Mailboxes {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_take_the_lowest_free_buffers() {
        let mut mailboxes = Mailboxes::new();
        let place = |buffer| Some(Place { buffer, withdrawn: 0 });
        assert_eq!(mailboxes.place(0x080, 0), place(0));
        assert_eq!(mailboxes.place(0x201, 0b1), place(1));
        assert_eq!(mailboxes.place(0x202, 0b10), place(0)); // SYNC has gone
    }

    #[test]
    fn a_newer_frame_withdraws_the_one_of_its_identifier_that_still_waits() {
        let mut mailboxes = Mailboxes::new();
        mailboxes.place(0x201, 0);
        mailboxes.place(0x202, 0b1);
        let newer = mailboxes.place(0x201, 0b11);
        assert_eq!(
            newer,
            Some(Place {
                buffer: 2,
                withdrawn: 0b01
            })
        );
        // The next after one that went out withdraws nothing, though buffer 0 was once given the identifier.
        assert_eq!(mailboxes.place(0x201, 0b010).unwrap().withdrawn, 0);
    }

    #[test]
    fn a_bus_that_carries_nothing_fills_no_queue_with_one_cycle_s_identifiers() {
        let (mut mailboxes, mut waiting) = (Mailboxes::new(), 0u32);
        for _cycle in 0..1000 {
            for id in [0x080, 0x201, 0x202, 0x203, 0x204, 0x205, 0x206, 0x210] {
                let place = mailboxes.place(id, waiting).unwrap();
                waiting = waiting & !place.withdrawn | 1 << place.buffer;
            }
        }
        assert_eq!(waiting.count_ones(), 8);
    }

    #[test]
    fn thirty_two_different_frames_wait_and_the_next_has_no_place() {
        let (mut mailboxes, mut waiting) = (Mailboxes::new(), 0u32);
        for id in 0..32 {
            waiting |= 1 << mailboxes.place(id, waiting).unwrap().buffer;
        }
        assert_eq!(mailboxes.place(40, waiting), None);
    }
}
