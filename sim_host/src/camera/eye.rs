//! The seam sensor of a cell as people see it: its camera, and what it makes of an image in pixels.

use super::optics::Optics;
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::joint::Joint;
use firmware::vision::{SeamSensor, TwoSlitSensor};
use hal::camera::SLITS;

/// A place in an image: x right and y down, px from the centre of the top-left pixel.
pub type Pixel = (f64, f64);

/// The seam sensor in use.
#[derive(Clone, Copy, Debug)]
pub enum Eye {
    /// The tracking view with one slit (5.2).
    One(SeamSensor),
    /// The larger view with two (chapter 3).
    Two(TwoSlitSensor),
}

impl Eye {
    /// The cell's sensor with one slit or two, for `joint`, behind what the controller takes for its `pinholes`.
    pub fn new(slits: u8, pinholes: [Pinhole; SLITS], joint: Joint) -> Self {
        if slits == 1 {
            Self::One(SeamSensor::new(pinholes[0], joint))
        } else {
            Self::Two(TwoSlitSensor::new(pinholes, joint))
        }
    }

    /// The camera that it looks through, as drawn.
    pub fn optics(&self) -> Optics {
        match self {
            Self::One(_) => Optics::TRACKING,
            Self::Two(_) => Optics::TWO_SLITS,
        }
    }

    fn view<'a>(&self, image: &'a [u8]) -> Option<View<'a>> {
        let optics = self.optics();
        View::new(image, optics.width, optics.height).ok()
    }

    /// What it sees in an image, in pixels, for people: the centres of the lines, and the seam by each slit that found it.
    pub fn trace(&self, image: &[u8]) -> (Vec<Pixel>, Vec<Pixel>) {
        let Some(view) = self.view(image) else {
            return Default::default();
        };
        let (lines, finds) = match self {
            Self::One(sensor) => (vec![(0, sensor.trace(&view))], vec![sensor.find(&view)]),
            Self::Two(sensor) => (sensor.trace(&view).into(), sensor.find(&view).into()),
        };
        let lines = lines.into_iter().filter_map(|(left, line)| Some((left, line.ok()?)));
        let centres = lines.flat_map(|(left, line)| {
            let rows = line.centres.into_iter().filter(|row| row.weight > 0.0);
            rows.map(move |row| (left as f64 + f64::from(row.x), f64::from(row.y)))
        });
        let seams = finds.into_iter().flatten();
        (
            centres.collect(),
            seams.map(|find| (f64::from(find.x), f64::from(find.y))).collect(),
        )
    }
}
