//! Telemetry of the controller node: what it learned, for whoever listens on the bus.
//!
//! A taught point takes two PDOs of the controller's own node number, told apart by identifier and paired by the point's sequence number. They
//! are the lowest in rank of all that is cyclic. A listener sees from the numbers whether one is missing.
//!
//! | PDO | bytes |
//! |---|---|
//! | TPDO3 | sequence u8; x, y of the point i24, µm, Σ_B; slit in bit 7, standard deviation in bits 0–6, 2 µm |
//! | TPDO4 | sequence u8; z i24, µm; azimuth and elevation of the lit line across the sheet i16, 0.1 mrad |

use crate::can::Frame;
use crate::canopen::cob;
use crate::process::TaughtPoint;

/// PDO numbers of the two halves.
const PLACE: u8 = 3;
const MANNER: u8 = 4;

/// Bit that says "second slit"; below it the standard deviation.
const SLIT: u8 = 0x80;

/// The two frames of a point, from node `node`.
pub fn frames(node: u8, point: &TaughtPoint) -> [Frame; 2] {
    let TaughtPoint {
        sequence,
        slit,
        point_um: [x, y, z],
        across_e4: [azimuth, elevation],
        sigma_um,
    } = *point;
    let ([x0, x1, x2, _], [y0, y1, y2, _], [z0, z1, z2, _]) = (x.to_le_bytes(), y.to_le_bytes(), z.to_le_bytes());
    let ([a0, a1], [e0, e1]) = (azimuth.to_le_bytes(), elevation.to_le_bytes());
    let seen = (sigma_um >> 1) | if slit == 0 { 0 } else { SLIT };
    [
        Frame::of(cob::tpdo(PLACE, node), [sequence, x0, x1, x2, y0, y1, y2, seen]),
        Frame::of(cob::tpdo(MANNER, node), [sequence, z0, z1, z2, a0, a1, e0, e1]),
    ]
}

/// Hears the points of one controller node.
#[derive(Clone, Debug)]
pub struct Listener {
    node: u8,
    place: Option<[u8; 8]>,
}

impl Listener {
    /// Of node `node`.
    pub const fn new(node: u8) -> Self {
        Self { node, place: None }
    }

    /// Takes a frame of the bus; a point, if it was the second half of one.
    pub fn hear(&mut self, frame: &Frame) -> Option<TaughtPoint> {
        if frame.cob() == cob::tpdo(PLACE, self.node) {
            self.place = frame.bytes().try_into().ok();
            return None;
        }
        if frame.cob() != cob::tpdo(MANNER, self.node) {
            return None;
        }
        let [sequence, x0, x1, x2, y0, y1, y2, seen] = self.place.take()?;
        let [again, z0, z1, z2, a0, a1, e0, e1] = frame.bytes().try_into().ok()?;
        (sequence == again).then_some(TaughtPoint {
            sequence,
            slit: u8::from(seen & SLIT != 0),
            point_um: [[x0, x1, x2], [y0, y1, y2], [z0, z1, z2]].map(widen),
            across_e4: [[a0, a1], [e0, e1]].map(i16::from_le_bytes),
            sigma_um: (seen & !SLIT) << 1,
        })
    }
}

/// A number of three bytes.
fn widen([low, middle, high]: [u8; 3]) -> i32 {
    i32::from_le_bytes([0, low, middle, high]) >> 8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_point_is_heard_as_it_was_sent(
            sequence in any::<u8>(), slit in 0u8..2, point_um in prop::array::uniform3(-8_388_608i32..8_388_608),
            across_e4 in prop::array::uniform2(any::<i16>()), sigma in 0u8..128,
        ) {
            let point = TaughtPoint { sequence, slit, point_um, across_e4, sigma_um: 2 * sigma };
            let mut listener = Listener::new(127);
            let [first, second] = frames(127, &point);
            prop_assert_eq!(listener.hear(&first), None);
            prop_assert_eq!(listener.hear(&second), Some(point));
            prop_assert_eq!(listener.hear(&second), None, "a half that comes alone is no point");
        }
    }

    #[test]
    fn halves_of_different_points_and_of_other_nodes_are_not_joined() {
        let point = |sequence| TaughtPoint {
            sequence,
            ..TaughtPoint::default()
        };
        let mut listener = Listener::new(127);
        let ([first, _], [_, second]) = (frames(127, &point(1)), frames(127, &point(2)));
        listener.hear(&first);
        assert_eq!(listener.hear(&second), None);
        let [first, second] = frames(126, &point(3));
        listener.hear(&first);
        assert_eq!(listener.hear(&second), None);
    }
}
