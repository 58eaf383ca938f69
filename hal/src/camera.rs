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
use crate::process::Sighting;

/// Command record: sub 1 SYNC count of the exposure, u8, 0 none; sub 2 slit projector on, u8.
pub const COMMAND: u16 = 0x2100;
/// Sighting record: sub 1 stamp, 2 refusal, u8; 3..=5 point in Σ_S, i16, µm; 6 angle, i16, 0.1 mrad; 7 quality, 8 sigma µm, u8.
pub const SIGHTING: u16 = 0x2110;
/// Refusal of a sighting that has no image: the read-out failed as often as it was tried.
pub const NO_IMAGE: u8 = u8::MAX;

/// Who the camera node is: type 0, our product code 2 (no vendor number is registered for us).
pub const IDENTITY: Identity = Identity {
    device_type: 0,
    name: "seam camera",
    numbers: [0, 2, 1, 0],
};

/// Map of RPDO1: exposure, slit.
pub const RPDO1: [Mapped; 2] = [mapped(COMMAND, 1, 8), mapped(COMMAND, 2, 8)];
/// Map of TPDO1: stamp, refusal, point.
pub const TPDO1: [Mapped; 5] = [
    mapped(SIGHTING, 1, 8),
    mapped(SIGHTING, 2, 8),
    mapped(SIGHTING, 3, 16),
    mapped(SIGHTING, 4, 16),
    mapped(SIGHTING, 5, 16),
];
/// Map of TPDO2: stamp again, angle, quality, sigma.
pub const TPDO2: [Mapped; 4] = [
    mapped(SIGHTING, 1, 8),
    mapped(SIGHTING, 6, 16),
    mapped(SIGHTING, 7, 8),
    mapped(SIGHTING, 8, 8),
];

/// RPDO1.
pub const fn encode_command(exposure: u8, slit: bool) -> [u8; 2] {
    [exposure, slit as u8]
}

/// Pairs the two PDOs of a sighting by their stamp.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pairing {
    first: Option<[u8; 8]>,
    second: Option<[u8; 5]>,
}

impl Pairing {
    /// Neither half is there.
    pub const fn new() -> Self {
        Self {
            first: None,
            second: None,
        }
    }

    /// Takes TPDO1's data; a sighting if the other half was there.
    pub fn first(&mut self, bytes: &[u8]) -> Option<Sighting> {
        self.first = bytes.try_into().ok();
        self.join()
    }

    /// Takes TPDO2's data; a sighting if the other half was there.
    pub fn second(&mut self, bytes: &[u8]) -> Option<Sighting> {
        self.second = bytes.try_into().ok();
        self.join()
    }

    fn join(&mut self) -> Option<Sighting> {
        let [stamp, refusal, x0, x1, y0, y1, z0, z1] = self.first?;
        let [again, a0, a1, quality, sigma_um] = self.second?;
        if stamp != again {
            return None;
        }
        *self = Self::default();
        Some(Sighting {
            stamp,
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
    slit: bool,
    sighting: Sighting,
    exposing: Option<u8>,
}

impl Camera {
    /// The SYNC count of the exposure that the last SYNC asked for, once.
    pub fn take_exposure(&mut self) -> Option<u8> {
        self.exposing.take()
    }

    /// Whether the slit projector is to be on.
    pub fn slit(&self) -> bool {
        self.slit
    }

    /// Puts a sighting where the TPDOs read it.
    pub fn report(&mut self, sighting: Sighting) {
        self.sighting = sighting;
    }
}

impl Device for Camera {
    fn read(&self, at: Address) -> Result<Value, Abort> {
        let [x, y, z] = self.sighting.point_um;
        Ok(match (at.index, at.sub) {
            (COMMAND, 0) => 2u8.into(),
            (COMMAND, 1) => self.exposure.into(),
            (COMMAND, 2) => (self.slit as u8).into(),
            (SIGHTING, 0) => 8u8.into(),
            (SIGHTING, 1) => self.sighting.stamp.into(),
            (SIGHTING, 2) => self.sighting.refusal.into(),
            (SIGHTING, 3) => x.into(),
            (SIGHTING, 4) => y.into(),
            (SIGHTING, 5) => z.into(),
            (SIGHTING, 6) => self.sighting.angle_e4.into(),
            (SIGHTING, 7) => self.sighting.quality.into(),
            (SIGHTING, 8) => self.sighting.sigma_um.into(),
            (COMMAND | SIGHTING, _) => return Err(Abort::NO_SUB),
            _ => return Err(Abort::NO_OBJECT),
        })
    }

    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        match (at.index, at.sub) {
            (COMMAND, 1) => self.exposure = number.try_into()?,
            (COMMAND, 2) => self.slit = u8::try_from(number)? != 0,
            (COMMAND | SIGHTING, _) => return Err(self.read(at).err().unwrap_or(Abort::READ_ONLY)),
            _ => return Err(Abort::NO_OBJECT),
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
            stamp: u8, refusal: u8, point_um: [i16; 3], angle_e4: i16, quality: u8, sigma_um: u8, swap: bool,
        ) {
            let sighting = Sighting { stamp, refusal, point_um, angle_e4, quality, sigma_um };
            let mut camera = Camera::default();
            camera.report(sighting);
            let (one, two) = (bytes_by_map(&camera, &TPDO1), bytes_by_map(&camera, &TPDO2));
            let mut pairing = Pairing::default();
            let (early, late) = if swap {
                (pairing.second(&two), pairing.first(&one))
            } else {
                (pairing.first(&one), pairing.second(&two))
            };
            prop_assert_eq!((early, late), (None, Some(sighting)));
        }
    }

    #[test]
    fn halves_of_different_sightings_never_join() {
        let mut pairing = Pairing::default();
        assert_eq!(pairing.first(&[7, 0, 0, 0, 0, 0, 0, 0]), None);
        assert_eq!(pairing.second(&[8, 0, 0, 0, 0]), None);
        assert!(pairing.first(&[8, 0, 0, 0, 0, 0, 0, 0]).is_some());
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
        assert_eq!(camera.write(at(SIGHTING, 1), 1u8.into()), Err(Abort::READ_ONLY));
        assert_eq!(camera.write(at(COMMAND, 3), 1u8.into()), Err(Abort::NO_SUB));
    }
}
