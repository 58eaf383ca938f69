//! The camera node: its objects, its process data, and the part of it that every camera shares.
//!
//! An exposure is asked for by the SYNC count at which it is to happen, so that image and joint angles belong to the same
//! instant whatever the processing takes. The sighting comes back in two PDOs, paired by that count as a stamp.
//! Device type 0x1000 is 0: CiA has no profile for it, and all objects lie in the manufacturer's area.

use crate::canopen::nmt::NmtState;
use crate::canopen::object::{Address, Device, Event, Number, Value};
use crate::canopen::pdo::{Mapped, mapped};
use crate::canopen::sdo::Abort;
use crate::canopen::slave::Identity;
use crate::process::{Look, Sighting};
use crate::wire::Wire;

/// Command record: sub 1 SYNC count of the exposure, u8, 0 none; sub 2 what to look at and by which light, [`Look`], u8.
pub const COMMAND: u16 = 0x2100;
/// Sighting record of the first slit, and after it of the second: sub 1 stamp, 2 refusal, u8; 3..=5 point in Σ_S, i16, µm; 6 angle,
/// i16, 0.1 mrad; 7 quality, 8 sigma µm, 9 [`Look`], u8.
pub const SIGHTING: [u16; SLITS] = [0x2110, 0x2111];
/// Images under way at once: one in the processor, one on its way to it. Whoever commands more exposures commands in vain.
pub const IN_FLIGHT: usize = 2;
/// Slits that a camera node can have.
pub const SLITS: usize = 2;
/// Width and height of an image, px.
pub type Size = [u16; 2];
/// Of the seam by one slit (paper 003, 5.2).
pub const ONE_SLIT: Size = [250, 250];
/// Of the seam by two slits (chapter 3).
pub const TWO_SLITS: Size = [400, 240];
/// Of the seam's start (5.2): the largest.
pub const START: Size = [450, 450];
/// Memory of one image, 8 bit grey, rows from the top.
pub type Pixels = [u8];

/// Bytes of memory that an image takes, with room to read out its rows as whole words.
pub const fn room([width, height]: Size) -> usize {
    width.next_multiple_of(4) as usize * height as usize
}
/// Refusal of a sighting that has no image: the read-out failed as often as it was tried.
pub const NO_IMAGE: u8 = u8::MAX;

/// Who the camera node is: type 0, our product code 2 (no vendor number is registered for us).
pub const IDENTITY: Identity = Identity {
    device_type: 0,
    name: "seam camera",
    numbers: [0, 2, 1, 0],
};

/// Map of RPDO1: exposure, look.
pub const RPDO1: [Mapped; 2] = [mapped(COMMAND, 1, 8), mapped(COMMAND, 2, 8)];
/// Map of TPDO1, and of TPDO3 for the second slit: stamp, refusal, point.
pub const fn place_map(slit: usize) -> [Mapped; 5] {
    let record = record(slit);
    [
        mapped(record, 1, 8),
        mapped(record, 2, 8),
        mapped(record, 3, 16),
        mapped(record, 4, 16),
        mapped(record, 5, 16),
    ]
}

/// Map of TPDO2, and of TPDO4 for the second slit: stamp again, angle, quality, sigma, look.
pub const fn manner_map(slit: usize) -> [Mapped; 5] {
    let record = record(slit);
    [
        mapped(record, 1, 8),
        mapped(record, 6, 16),
        mapped(record, 7, 8),
        mapped(record, 8, 8),
        mapped(record, 9, 8),
    ]
}

const fn record(slit: usize) -> u16 {
    let [first, second] = SIGHTING;
    if slit == 0 { first } else { second }
}

/// RPDO1.
pub const fn encode_command(exposure: u8, look: Look) -> [u8; 2] {
    [exposure, look as u8]
}

/// Pairs the two PDOs of one slit's sighting by their stamp.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pairing {
    slit: u8,
    place: Option<[u8; 8]>,
    manner: Option<[u8; 6]>,
}

impl Pairing {
    /// Of slit 0 or 1; neither half is there.
    pub const fn new(slit: u8) -> Self {
        Self {
            slit,
            place: None,
            manner: None,
        }
    }

    /// Takes data by [`place_map`]; a sighting if the other half was there.
    pub fn place(&mut self, bytes: &[u8]) -> Option<Sighting> {
        self.place = bytes.try_into().ok();
        self.join()
    }

    /// Takes data by [`manner_map`]; a sighting if the other half was there.
    pub fn manner(&mut self, bytes: &[u8]) -> Option<Sighting> {
        self.manner = bytes.try_into().ok();
        self.join()
    }

    fn join(&mut self) -> Option<Sighting> {
        let [stamp, refusal, x0, x1, y0, y1, z0, z1] = self.place?;
        let [again, a0, a1, quality, sigma_um, look] = self.manner?;
        if stamp != again {
            return None;
        }
        *self = Self::new(self.slit);
        Some(Sighting {
            stamp,
            look: Look::read(&mut [look].as_slice())?,
            slit: self.slit,
            refusal,
            point_um: [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes),
            angle_e4: i16::from_le_bytes([a0, a1]),
            quality,
            sigma_um,
        })
    }
}

/// The objects of a camera node and the moment of its exposure; lens, image and vision are its owner's.
#[derive(Clone, Copy, Debug, Default)]
pub struct Camera {
    exposure: u8,
    look: Look,
    sightings: [Sighting; SLITS],
    exposing: Option<u8>,
}

impl Camera {
    /// The SYNC count of the exposure that the last SYNC asked for, once.
    pub fn take_exposure(&mut self) -> Option<u8> {
        self.exposing.take()
    }

    /// What to look at, and by which light.
    pub fn look(&self) -> Look {
        self.look
    }

    /// Puts a sighting where its slit's TPDOs read it; the PDO numbers to send, none for a slit that no camera has.
    pub fn report(&mut self, sighting: Sighting) -> Option<[u8; 2]> {
        *self.sightings.get_mut(usize::from(sighting.slit))? = sighting;
        Some([2 * sighting.slit + 1, 2 * sighting.slit + 2])
    }

    fn sighting(&self, index: u16) -> Option<&Sighting> {
        let slit = SIGHTING.iter().position(|record| *record == index)?;
        self.sightings.get(slit)
    }
}

impl Device for Camera {
    fn read(&self, at: Address) -> Result<Value, Abort> {
        if let Some(sighting) = self.sighting(at.index) {
            let [x, y, z] = sighting.point_um;
            return Ok(match at.sub {
                0 => 9u8.into(),
                1 => sighting.stamp.into(),
                2 => sighting.refusal.into(),
                3 => x.into(),
                4 => y.into(),
                5 => z.into(),
                6 => sighting.angle_e4.into(),
                7 => sighting.quality.into(),
                8 => sighting.sigma_um.into(),
                9 => (sighting.look as u8).into(),
                _ => return Err(Abort::NO_SUB),
            });
        }
        Ok(match (at.index, at.sub) {
            (COMMAND, 0) => 2u8.into(),
            (COMMAND, 1) => self.exposure.into(),
            (COMMAND, 2) => (self.look as u8).into(),
            (COMMAND, _) => return Err(Abort::NO_SUB),
            _ => return Err(Abort::NO_OBJECT),
        })
    }

    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        match (at.index, at.sub) {
            (COMMAND, 1) => self.exposure = number.try_into()?,
            (COMMAND, 2) => {
                let code = [u8::try_from(number)?];
                self.look = Look::read(&mut code.as_slice()).ok_or(Abort::RANGE)?;
            }
            _ => return Err(self.read(at).err().unwrap_or(Abort::READ_ONLY)),
        }
        Ok(())
    }

    fn sync(&mut self, count: u8) {
        if self.exposure == count {
            self.exposing = Some(count);
        }
    }

    fn event(&mut self, event: Event) {
        // Without a master there is nobody to see for, and the slit's light goes out.
        if event != Event::State(NmtState::Operational) {
            *self = Self::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::object::at;
    use proptest::prelude::*;

    /// Data of a PDO by its map, as the node builds it.
    fn bytes_by_map(camera: &Camera, map: &[Mapped]) -> Vec<u8> {
        map.iter()
            .flat_map(|entry| match camera.read(entry.object) {
                Ok(Value::Number(number)) => number.to_bytes()[..entry.bits as usize / 8].to_vec(),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    extern crate std;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn a_sighting_survives_its_two_pdos_in_either_order(
            stamp: u8, look in 0_u8..4, slit in 0_u8..2, refusal: u8, point_um: [i16; 3], angle_e4: i16, quality: u8, sigma_um: u8, swap: bool,
        ) {
            let look = Look::read(&mut [look].as_slice()).unwrap();
            let sighting = Sighting { stamp, look, slit, refusal, point_um, angle_e4, quality, sigma_um };
            let mut camera = Camera::default();
            let k = usize::from(slit);
            prop_assert_eq!(camera.report(sighting), Some([2 * slit + 1, 2 * slit + 2]));
            let (one, two) = (bytes_by_map(&camera, &place_map(k)), bytes_by_map(&camera, &manner_map(k)));
            let mut pairing = Pairing::new(slit);
            let (early, late) = if swap {
                (pairing.manner(&two), pairing.place(&one))
            } else {
                (pairing.place(&one), pairing.manner(&two))
            };
            prop_assert_eq!((early, late), (None, Some(sighting)));
        }
    }

    #[test]
    fn halves_of_different_sightings_never_join() {
        let mut pairing = Pairing::default();
        assert_eq!(pairing.place(&[7, 0, 0, 0, 0, 0, 0, 0]), None);
        assert_eq!(pairing.manner(&[8, 0, 0, 0, 0, 0]), None);
        assert!(pairing.place(&[8, 0, 0, 0, 0, 0, 0, 0]).is_some());
    }

    #[test]
    fn it_exposes_at_the_commanded_count_only() {
        let mut camera = Camera::default();
        camera.write(at(COMMAND, 1), 20u8.into()).unwrap();
        let exposed: Vec<u8> = (1..=240)
            .filter_map(|count| {
                camera.sync(count);
                camera.take_exposure()
            })
            .collect();
        assert_eq!(exposed, [20]);
        assert_eq!(camera.write(at(SIGHTING[0], 1), 1u8.into()), Err(Abort::READ_ONLY));
        assert_eq!(camera.write(at(COMMAND, 3), 1u8.into()), Err(Abort::NO_SUB));
    }
}
