//! The start sensor: where the seam begins, in the larger view of 450 × 450 px (paper 003, chapter 5).
//!
//! A grey image goes through four steps, each a file, each with constant bounds:
//! 1. [`edges`]: filters for the seam's edge and for the part's end, thinned to single pixels with a sub-pixel place;
//! 2. [`hough`]: votes for straight lines in fixed memory;
//! 3. [`line`](mod@line): a robust fit to the pixels of each line that won;
//! 4. [`corner`]: the pair of lines that meet as the joint's pattern says, which of several intersections is the start included.
//!
//! An image of the slit goes through the tracking view's own sensor; [`slit`] then takes the sheet's inclination from the whole lit line.
//!
//! What the fixed buffers take is in [`Workspace`]: 143 KB beside the image's 202.5 KB.

pub mod corner;
pub mod edges;
pub mod hough;
pub mod line;
pub mod slit;
mod stripe;

use super::camera::Pinhole;
use super::image::View;
use super::joint::Joint;
use super::number::limit;
use super::sensor::{Refusal, SeamSensor};
use crate::geometry::trig::atan2;
use corner::Corner;
use edges::{Edges, Pattern};
use hal::process::{Look, Sighting};
use hough::Votes;
use line::Line;

/// Width and height of the start view, px (5.2).
pub const SIDE: usize = 450;

impl Pinhole {
    /// The start view of the cell's own camera: the same lens and scale over 450 × 450 px (5.2).
    pub const START: Self = Self {
        centre_px: [224.5, 224.5],
        ..Self::TRACKING
    };
}

/// What is known of where the seam runs in a grey image before it is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// The row in which it is expected in the image's middle, px.
    pub middle: f32,
    /// How far from there it may be, px.
    pub off: f32,
    /// How steep it may run, px per px.
    pub slope: f32,
}

impl Aim {
    /// Nothing.
    pub const ANYWHERE: Self = Self {
        middle: 224.5,
        off: 1e3,
        slope: 1.0,
    };

    /// The sensor was held over the seam, as light sections show it, to look for its end: along the image's middle but for what a bend of ±2 mm
    /// over 150 mm makes of it from the sections to the end, 4 mm and 8°.
    pub const MIDDLE: Self = Self {
        middle: 224.5,
        off: 32.0,
        slope: 0.14,
    };

    /// How much a line that may be the seam counts: a ninth at the limit.
    fn weight(&self, line: &Line) -> f32 {
        let (off, slope) = ((line.at(line.middle) - self.middle) / self.off, line.slope / self.slope);
        1.0 / (1.0 + 8.0 * (off * off + slope * slope))
    }
}

/// Why a grey image shows no start. The numbers are those of [`Sighting::refusal`], after the seam sensor's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum GreyRefusal {
    /// No straight edge in the seam's direction.
    NoSeam = 21,
    /// No straight edge across it.
    NoEnd = 22,
    /// Edges, but none that meet as seam and end of this joint do.
    NoCorner = 23,
    /// Two places look alike.
    Unclear = 24,
    /// The corner lies too near to the image's border, or too little of the seam is in view.
    AtBorder = 25,
}

/// The memory that looking at a grey image takes; it keeps nothing from one image to the next.
#[derive(Clone, Debug)]
pub struct Workspace {
    edges: Edges,
    votes: Votes,
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

impl Workspace {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            edges: Edges::new(),
            votes: Votes::new(),
        }
    }
}

/// The sensor of one joint's start.
#[derive(Clone, Copy, Debug)]
pub struct StartSensor {
    camera: Pinhole,
    joint: Joint,
    aim: Aim,
    seam: SeamSensor,
}

impl StartSensor {
    /// A sensor for the start of `joint` behind `camera`, which is held over the seam by `aim`.
    pub fn new(camera: Pinhole, joint: Joint, aim: Aim) -> Self {
        Self {
            camera,
            joint,
            aim,
            seam: SeamSensor::new(camera, joint),
        }
    }

    /// The end-of-seam corner of a grey image, px.
    pub fn corner(&self, view: &View, workspace: &mut Workspace) -> Result<Corner, GreyRefusal> {
        let pattern = Pattern::of(self.joint);
        workspace.edges.find(view, &pattern, &self.aim);
        corner::find(view, &mut workspace.edges, &mut workspace.votes, &pattern, &self.aim)
    }

    /// Sees the start in a grey image, or refuses; the caller fills in the stamp.
    pub fn sight_grey(&self, view: &View, workspace: &mut Workspace) -> Sighting {
        let unseen = Sighting {
            look: Look::StartGrey,
            ..Sighting::default()
        };
        match self.corner(view, workspace) {
            Ok(corner) => {
                let [x, y] = self.camera.on_work(corner.x, corner.y).map(|m| (m * 1e6) as i16);
                let [along, down] = corner.middle;
                let [ahead, aside] = self.camera.straighten(along, down, [1.0, corner.slope]);
                Sighting {
                    point_um: [x, y, 0],
                    // The image's y axis points down, Σ_S's up.
                    angle_e4: (atan2(limit(-aside / ahead, -1.0, 1.0), 1.0) * 1e4) as i16,
                    quality: corner.quality,
                    sigma_um: limit(corner.sigma * self.camera.pixel_m * 1e6, 0.0, 255.0) as u8,
                    ..unseen
                }
            }
            Err(refusal) => Sighting {
                refusal: refusal as u8,
                ..unseen
            },
        }
    }

    /// Sees the seam in an image of the slit, with the inclination of the whole lit sheet; or refuses; the caller fills in the stamp.
    pub fn sight_slit(&self, view: &View) -> Sighting {
        let mut sighting = self.seam.sight(view);
        sighting.look = Look::StartSlit;
        if sighting.refusal == 0 {
            match slit::slope(&self.seam, &self.camera, self.joint, view) {
                Some(slope) => sighting.angle_e4 = (atan2(limit(slope, -1.0, 1.0), 1.0) * 1e4) as i16,
                None => {
                    sighting = Sighting {
                        look: Look::StartSlit,
                        refusal: Refusal::AtEdge as u8,
                        ..Sighting::default()
                    };
                }
            }
        }
        sighting
    }
}
