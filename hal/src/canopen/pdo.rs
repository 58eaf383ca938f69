//! A PDO of a node: its communication parameter, its mapping, and when it is due.

use super::object::{Address, Number, at};
use super::sdo::Abort;

/// Objects that one PDO maps at most: eight of a byte each.
pub const MAP_MAX: usize = 8;
/// Bit 31 of the COB-ID entry (sub-index 1): the PDO does not exist.
pub const INVALID: u32 = 1 << 31;
/// Transmission type: synchronous, sent with the SYNC that follows its event.
pub const ACYCLIC: u8 = 0;
/// Highest synchronous transmission type: every that many SYNCs.
pub const SYNC_MAX: u8 = 240;
/// Lowest event-driven transmission type; 241..=253 are reserved.
pub const EVENT: u8 = 254;

/// An entry of a PDO mapping (0x1600.., 0x1A00..): an object and its length in bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mapped {
    /// The object.
    pub object: Address,
    /// Its length, bits.
    pub bits: u8,
}

/// The entry for the object at `index`, `sub`, of `bits` length.
pub const fn mapped(index: u16, sub: u8, bits: u8) -> Mapped {
    Mapped {
        object: at(index, sub),
        bits,
    }
}

impl Mapped {
    /// The entry's u32: index, sub-index, length.
    pub const fn encode(self) -> u32 {
        (self.object.index as u32) << 16 | (self.object.sub as u32) << 8 | self.bits as u32
    }

    /// From the entry's u32.
    pub const fn decode(entry: u32) -> Self {
        mapped((entry >> 16) as u16, (entry >> 8) as u8, entry as u8)
    }
}

/// Which way a PDO goes, seen from the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// RPDO: master to node.
    Receive,
    /// TPDO: node to master.
    Transmit,
}

/// One PDO of a node, as its objects configure it.
#[derive(Clone, Copy, Debug)]
pub struct Pdo {
    direction: Direction,
    /// Identifier; bit 31 says that the PDO does not exist.
    cob: u32,
    /// Transmission type: 0 acyclic, 1..=240 every that many SYNCs, 254 and 255 by event.
    transmission: u8,
    /// RPDO: longest time between two frames, ms; 0 does not watch.
    event_ms: u16,
    map: [Mapped; MAP_MAX],
    len: u8,
    /// TPDO: SYNCs until the next transmission.
    left: u8,
}

impl Pdo {
    /// A PDO that exists at `cob`, event-driven, with nothing mapped.
    pub const fn new(direction: Direction, cob: u16) -> Self {
        Self {
            direction,
            cob: cob as u32,
            transmission: EVENT + 1,
            event_ms: 0,
            map: [mapped(0, 0, 0); MAP_MAX],
            len: 0,
            left: 1,
        }
    }

    /// Identifier, if the PDO exists and maps anything.
    pub fn cob(&self) -> Option<u16> {
        (self.cob & INVALID == 0 && self.len != 0).then_some((self.cob & 0x7FF) as u16)
    }

    /// Whether it acts on or goes with a SYNC.
    pub fn is_synchronous(&self) -> bool {
        self.transmission <= SYNC_MAX
    }

    /// Whether it goes only after an event of its device.
    pub fn is_event_driven(&self) -> bool {
        self.transmission == ACYCLIC || self.transmission >= EVENT
    }

    /// Event time of an RPDO, µs; zero does not watch.
    pub fn event_us(&self) -> u32 {
        self.event_ms as u32 * 1000
    }

    /// The mapped objects, first byte first.
    pub fn map(&self) -> &[Mapped] {
        self.map.get(..self.len as usize).unwrap_or(&[])
    }

    /// Forgets where in its SYNC rhythm it was: the node became operational.
    pub fn restart(&mut self) {
        self.left = self.transmission;
    }

    /// Whether a cyclic TPDO goes with this SYNC: every n-th since the node became operational. Call once each SYNC.
    pub fn due(&mut self) -> bool {
        if self.transmission == ACYCLIC || self.transmission > SYNC_MAX {
            return false;
        }
        self.left = self.left.saturating_sub(1);
        let due = self.left == 0;
        if due {
            self.left = self.transmission;
        }
        due
    }

    /// Reads communication parameter `sub` (0x1400.., 0x1800..).
    pub fn parameter(&self, sub: u8) -> Result<Number, Abort> {
        match (sub, self.direction) {
            (0, Direction::Receive) => Ok(5u8.into()),
            (0, Direction::Transmit) => Ok(2u8.into()),
            (1, _) => Ok(self.cob.into()),
            (2, _) => Ok(self.transmission.into()),
            (5, Direction::Receive) => Ok(self.event_ms.into()),
            _ => Err(Abort::NO_SUB),
        }
    }

    /// Writes communication parameter `sub`. An existing PDO must be switched off before its identifier
    /// changes.
    pub fn set_parameter(&mut self, sub: u8, number: Number) -> Result<(), Abort> {
        match (sub, self.direction) {
            (0, _) => Err(Abort::READ_ONLY),
            (1, _) => {
                let cob = u32::try_from(number)?;
                let moves = (cob ^ self.cob) & 0x7FF != 0;
                if cob & INVALID == 0 && self.cob & INVALID == 0 && moves {
                    return Err(Abort::STATE);
                }
                self.cob = cob & (INVALID | 0x7FF);
                Ok(())
            }
            (2, _) => match u8::try_from(number)? {
                241..=253 => Err(Abort::RANGE),
                transmission => {
                    self.transmission = transmission;
                    self.restart();
                    Ok(())
                }
            },
            (5, Direction::Receive) => {
                self.event_ms = number.try_into()?;
                Ok(())
            }
            _ => Err(Abort::NO_SUB),
        }
    }

    /// Reads mapping entry `sub` (0x1600.., 0x1A00..); entry 0 is their number.
    pub fn entry(&self, sub: u8) -> Result<Number, Abort> {
        match sub.checked_sub(1) {
            None => Ok(self.len.into()),
            Some(k) => self
                .map
                .get(k as usize)
                .map(|entry| entry.encode().into())
                .ok_or(Abort::NO_SUB),
        }
    }

    /// Writes mapping entry `sub`. First switch the PDO off and write 0 to entry 0, then the entries, then their number;
    /// `bits_of` tells how long an object of the node is.
    pub fn set_entry(
        &mut self,
        sub: u8,
        number: Number,
        bits_of: impl Fn(Address) -> Result<u8, Abort>,
    ) -> Result<(), Abort> {
        if self.cob & INVALID == 0 {
            return Err(Abort::STATE);
        }
        match sub.checked_sub(1) {
            None => {
                let len = u8::try_from(number)?;
                let map = self.map.get(..len as usize).ok_or(Abort::PDO_LENGTH)?;
                if map.iter().map(|entry| entry.bits as u32).sum::<u32>() > 64 {
                    return Err(Abort::PDO_LENGTH);
                }
                self.len = len;
                Ok(())
            }
            Some(_) if self.len != 0 => Err(Abort::ACCESS),
            Some(k) => {
                let entry = Mapped::decode(number.try_into()?);
                if bits_of(entry.object) != Ok(entry.bits) {
                    return Err(Abort::UNMAPPABLE);
                }
                *self.map.get_mut(k as usize).ok_or(Abort::NO_SUB)? = entry;
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due_of_twelve(transmission: u8) -> Vec<u8> {
        let mut pdo = Pdo::new(Direction::Transmit, 0x181);
        pdo.set_parameter(2, transmission.into()).unwrap();
        (1..=12).filter(|_| pdo.due()).collect()
    }

    extern crate std;
    use std::vec::Vec;

    #[test]
    fn a_cyclic_pdo_goes_every_nth_sync() {
        assert_eq!(due_of_twelve(1), (1..=12).collect::<Vec<_>>());
        assert_eq!(due_of_twelve(4), [4, 8, 12]);
        assert_eq!(due_of_twelve(ACYCLIC), []);
        assert_eq!(due_of_twelve(EVENT), []);
    }

    #[test]
    fn a_map_is_changed_only_while_the_pdo_is_off_and_empty() {
        let bits = |_| Ok(32);
        let entry = || Number::from(mapped(0x6064, 0, 32).encode());
        let mut pdo = Pdo::new(Direction::Transmit, 0x181);
        assert_eq!(pdo.set_entry(0, 0u8.into(), bits), Err(Abort::STATE));
        pdo.set_parameter(1, (INVALID | 0x181).into()).unwrap();
        for sub in 1..=3 {
            pdo.set_entry(sub, entry(), bits).unwrap();
        }
        assert_eq!(pdo.set_entry(0, 3u8.into(), bits), Err(Abort::PDO_LENGTH), "96 bits");
        pdo.set_entry(0, 2u8.into(), bits).unwrap();
        assert_eq!(pdo.set_entry(1, entry(), bits), Err(Abort::ACCESS));
        assert_eq!(pdo.cob(), None);
        pdo.set_parameter(1, 0x181u32.into()).unwrap();
        assert_eq!(pdo.cob(), Some(0x181));
    }

    #[test]
    fn an_entry_whose_length_is_not_the_object_s_cannot_be_mapped() {
        let mut pdo = Pdo::new(Direction::Receive, 0x201);
        pdo.set_parameter(1, (INVALID | 0x201).into()).unwrap();
        let entry = Number::from(mapped(0x6040, 0, 16).encode());
        assert_eq!(pdo.set_entry(1, entry, |_| Ok(32)), Err(Abort::UNMAPPABLE));
        assert_eq!(
            pdo.set_entry(1, entry, |_| Err(Abort::NO_OBJECT)),
            Err(Abort::UNMAPPABLE)
        );
    }
}
