//! From pixels to sightings: which sensor looks at which image.

use super::{Exposure, Params};
use crate::vision::image::View;
use crate::vision::sensor::{Refusal, SeamSensor};
use crate::vision::start::{Aim, StartSensor, Workspace};
use crate::vision::two_slit::TwoSlitSensor;
use hal::camera::{SLITS, Size};
use hal::process::{Look, Sighting};

/// The sensors of a camera.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    seam: Seam,
    start: StartSensor,
}

/// The seam sensor.
#[derive(Clone, Copy, Debug)]
enum Seam {
    OneSlit(SeamSensor),
    TwoSlits(TwoSlitSensor),
}

impl Sensors {
    /// Those that these parameters describe.
    pub fn new(params: &Params) -> Self {
        let [near, _] = params.pinholes;
        Self {
            seam: if params.slits == 1 {
                Seam::OneSlit(SeamSensor::new(near, params.joint))
            } else {
                Seam::TwoSlits(TwoSlitSensor::new(params.pinholes, params.joint))
            },
            start: StartSensor::new(params.start, params.joint, Aim::MIDDLE),
        }
    }

    /// What is seen in the image of an exposure, `height` rows of `width` bytes, by slit. Fewer bytes are no such image, and show no line.
    /// `workspace` is what a grey image takes; nothing in it is kept.
    pub fn see(
        &self,
        exposure: &Exposure,
        pixels: &[u8],
        size: Size,
        workspace: &mut Workspace,
    ) -> [Option<Sighting>; SLITS] {
        let of_exposure = |seen: Sighting| Sighting {
            stamp: exposure.stamp,
            look: exposure.look,
            ..seen
        };
        let [width, height] = size.map(usize::from);
        let image = pixels.get(..width * height).unwrap_or(&[]);
        let Ok(view) = View::new(image, width, height) else {
            let none = Sighting {
                refusal: Refusal::NoLine as u8,
                ..Sighting::default()
            };
            return [Some(of_exposure(none)), None];
        };
        match exposure.look {
            Look::StartGrey => return [Some(of_exposure(self.start.sight_grey(&view, workspace))), None],
            Look::StartSlit => return [Some(of_exposure(self.start.sight_slit(&view))), None],
            Look::Seam | Look::Dark => {}
        }
        match &self.seam {
            Seam::OneSlit(sensor) => [Some(of_exposure(sensor.sight(&view))), None],
            Seam::TwoSlits(sensor) => sensor.sight(&view).map(|seen| Some(of_exposure(seen))),
        }
    }
}
