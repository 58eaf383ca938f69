//! The points of a seam, as they come over the bus.

use hal::can::Frame;
use hal::telemetry::Listener;
use nalgebra::Vector3;

/// A point of the seam as the sensor saw it, Σ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawPoint {
    /// The point, m.
    pub point: Vector3<f64>,
    /// Unit direction of the lit line on the sheet, to the left of travel.
    pub across: Vector3<f64>,
    /// The slit that saw it.
    pub slit: u8,
    /// Standard deviation across the seam that the sensor states, m.
    pub sigma: f64,
}

/// Collects the points of one controller.
#[derive(Clone, Debug)]
pub struct Collector {
    listener: Listener,
    next: Option<u8>,
    /// What came, in order.
    pub points: Vec<RawPoint>,
    /// Points whose numbers did not come.
    pub missing: usize,
}

impl Collector {
    /// Of the controller that is node `node`.
    pub fn new(node: u8) -> Self {
        Self {
            listener: Listener::new(node),
            next: None,
            points: Vec::new(),
            missing: 0,
        }
    }

    /// Takes a frame of the bus.
    pub fn hear(&mut self, frame: &Frame) {
        let Some(taught) = self.listener.hear(frame) else {
            return;
        };
        if let Some(next) = self.next {
            self.missing += usize::from(taught.sequence.wrapping_sub(next));
        }
        self.next = Some(taught.sequence.wrapping_add(1));
        let [azimuth, elevation] = taught.across_e4.map(|angle| f64::from(angle) * 1e-4);
        self.points.push(RawPoint {
            point: Vector3::from(taught.point_um.map(|um| f64::from(um) * 1e-6)),
            across: Vector3::new(
                elevation.cos() * azimuth.cos(),
                elevation.cos() * azimuth.sin(),
                elevation.sin(),
            ),
            slit: taught.slit,
            sigma: f64::from(taught.sigma_um) * 1e-6,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal::process::TaughtPoint;
    use hal::telemetry::frames;

    #[test]
    fn points_are_collected_with_their_directions_and_missing_ones_are_counted() {
        let mut collector = Collector::new(127);
        for sequence in [254u8, 255, 0, 3] {
            let point = TaughtPoint {
                sequence,
                point_um: [400_000, -100_010, 200_000],
                across_e4: [15_708, -7854],
                ..TaughtPoint::default()
            };
            frames(127, &point).iter().for_each(|frame| collector.hear(frame));
        }
        assert_eq!((collector.points.len(), collector.missing), (4, 2));
        let raw = collector.points[0];
        assert!((raw.point - Vector3::new(0.4, -0.10001, 0.2)).norm() < 1e-9);
        let half = 0.5f64.sqrt();
        assert!(
            (raw.across - Vector3::new(0.0, half, -half)).norm() < 1e-4,
            "{}",
            raw.across
        );
    }
}
