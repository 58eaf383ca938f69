//! What disturbs the image of the slit, and how much.
//!
//! The values are assumed: the papers give none. They are set by two methods whose rates within 0.5 mm on other rendered
//! images of this joint are known (clean / moderate / harsh): row centroid 100 / 64 / 31 %, the paper's windows with D_i
//! 45 / 15 / 7 %. Here, on the examples' `detection 41 1000`, they reach 100 / 39 / 14 % and 56 / 17 / 11 %: for the first
//! these surfaces are harder, for the second, which does better even on clean ones, about as hard.
//! Brightness is in grey levels of an 8-bit image, lengths in pixels of 0.12 mm.

use crate::cell::panel::Surface;

/// A range from which a value is drawn, uniformly.
pub type Range = [f64; 2];

/// Bright things of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blemish {
    /// Mean number per frame.
    pub mean_count: f64,
    /// Brightness at its peak, before saturation.
    pub brightness: Range,
    /// Size: rows of a highlight or ghost line, radius of a glint, length of a scratch, px.
    pub size_px: Range,
}

impl Blemish {
    const NONE: Self = Self {
        mean_count: 0.0,
        brightness: [0.0, 0.0],
        size_px: [0.0, 0.0],
    };
}

/// One kind of disturbance, for switching it off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Movement of the sensor during the exposure.
    MotionBlur,
    /// Blur that grows with the distance from the plane in focus.
    Defocus,
    /// Multiplicative grain of coherent light.
    Speckle,
    /// Light scattered around the line.
    Halo,
    /// Rows in which the line is dark.
    DropOuts,
    /// Stretches of the line that reflect specularly: too bright, too wide, to one side.
    Highlights,
    /// Bright spots beside the line, and at the joint's edge.
    Glints,
    /// Scratches that catch ambient or laser light.
    Scratches,
    /// Secondary reflections of the line.
    Ghosts,
    /// Light that is not the slit's.
    Ambient,
    /// Shot and read noise.
    Noise,
}

/// The set of disturbances of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Effects {
    /// Brightness of the line's centre on a matt sheet.
    pub line_brightness: Range,
    /// Slow relative change of that brightness along the line (± this much).
    pub shading: f64,
    /// Full width of the line at half its brightness, in focus. Chapter 2 states 0.6–1.2 mm at its own scale.
    pub line_width_px: Range,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Standard deviation of defocus per distance from the plane in focus, px/m.
    pub defocus_px_per_m: f64,
    /// Share of light that a pixel takes from each of the rows above and below it.
    pub row_blur: f64,
    /// Contrast (standard deviation over mean) of the speckle.
    pub speckle_contrast: f64,
    /// Size of its grains, px (standard deviation of the amplitude's kernel).
    pub speckle_grain_px: f64,
    /// Brightness of the halo relative to the line's centre, and its half width, px.
    pub halo: f64,
    /// See [`Self::halo`].
    pub halo_px: f64,
    /// Share of rows that drop out, their run lengths (rows), and what is left of the light in them.
    pub drop_out_share: f64,
    /// See [`Self::drop_out_share`].
    pub drop_out_rows: Range,
    /// See [`Self::drop_out_share`].
    pub drop_out_light: Range,
    /// Specular stretches of the line; brightness is a factor.
    pub highlights: Blemish,
    /// Largest displacement of a specular stretch from the line's centre, px.
    pub highlight_shift_px: f64,
    /// Bright spots.
    pub glints: Blemish,
    /// Probability of a glint on the joint's edge.
    pub edge_glint: f64,
    /// Scratches.
    pub scratches: Blemish,
    /// Ghost lines; brightness is relative to the line.
    pub ghosts: Blemish,
    /// Distance of a ghost from the line, px, to either side.
    pub ghost_distance_px: Range,
    /// Ambient light, and its relative variation across the image.
    pub ambient: Range,
    /// See [`Self::ambient`].
    pub ambient_variation: f64,
    /// Read noise, standard deviation.
    pub read_noise: f64,
    /// Shot noise: variance per grey level.
    pub shot_noise: f64,
}

impl Effects {
    /// The disturbances of a surface.
    pub fn of(surface: Surface) -> Self {
        match surface {
            Surface::Clean => Self {
                line_brightness: [150.0, 190.0],
                shading: 0.1,
                line_width_px: [5.0, 6.0],
                exposure_s: 0.001,
                defocus_px_per_m: 100.0,
                row_blur: 0.10,
                speckle_contrast: 0.12,
                speckle_grain_px: 0.7,
                halo: 0.02,
                halo_px: 10.0,
                drop_out_share: 0.0,
                drop_out_rows: [1.0, 2.0],
                drop_out_light: [0.0, 1.0],
                highlights: Blemish::NONE,
                highlight_shift_px: 0.0,
                glints: Blemish::NONE,
                edge_glint: 0.0,
                scratches: Blemish::NONE,
                ghosts: Blemish::NONE,
                ghost_distance_px: [12.0, 50.0],
                ambient: [4.0, 8.0],
                ambient_variation: 0.2,
                read_noise: 1.5,
                shot_noise: 0.05,
            },
            Surface::Moderate => Self {
                line_brightness: [90.0, 170.0],
                shading: 0.35,
                line_width_px: [5.0, 8.0],
                exposure_s: 0.001,
                defocus_px_per_m: 200.0,
                row_blur: 0.18,
                speckle_contrast: 0.45,
                speckle_grain_px: 0.9,
                halo: 0.08,
                halo_px: 12.0,
                drop_out_share: 0.07,
                drop_out_rows: [1.0, 6.0],
                drop_out_light: [0.0, 0.3],
                highlights: Blemish {
                    mean_count: 1.5,
                    brightness: [2.0, 5.0],
                    size_px: [4.0, 14.0],
                },
                highlight_shift_px: 1.0,
                glints: Blemish {
                    mean_count: 1.5,
                    brightness: [150.0, 600.0],
                    size_px: [1.0, 3.5],
                },
                edge_glint: 0.3,
                scratches: Blemish {
                    mean_count: 0.5,
                    brightness: [20.0, 70.0],
                    size_px: [10.0, 40.0],
                },
                ghosts: Blemish {
                    mean_count: 0.5,
                    brightness: [0.2, 0.6],
                    size_px: [30.0, 140.0],
                },
                ghost_distance_px: [12.0, 60.0],
                ambient: [12.0, 24.0],
                ambient_variation: 0.3,
                read_noise: 2.5,
                shot_noise: 0.10,
            },
            Surface::Harsh => Self {
                line_brightness: [60.0, 160.0],
                shading: 0.5,
                line_width_px: [5.0, 10.0],
                exposure_s: 0.001,
                defocus_px_per_m: 300.0,
                row_blur: 0.25,
                speckle_contrast: 0.52,
                speckle_grain_px: 1.1,
                halo: 0.10,
                halo_px: 15.0,
                drop_out_share: 0.10,
                drop_out_rows: [1.0, 8.0],
                drop_out_light: [0.0, 0.2],
                highlights: Blemish {
                    mean_count: 2.0,
                    brightness: [2.0, 6.0],
                    size_px: [4.0, 20.0],
                },
                highlight_shift_px: 2.0,
                glints: Blemish {
                    mean_count: 1.5,
                    brightness: [150.0, 900.0],
                    size_px: [1.0, 4.0],
                },
                edge_glint: 0.3,
                scratches: Blemish {
                    mean_count: 1.0,
                    brightness: [30.0, 120.0],
                    size_px: [10.0, 60.0],
                },
                ghosts: Blemish {
                    mean_count: 0.8,
                    brightness: [0.3, 0.9],
                    size_px: [30.0, 180.0],
                },
                ghost_distance_px: [12.0, 70.0],
                ambient: [15.0, 40.0],
                ambient_variation: 0.5,
                read_noise: 3.5,
                shot_noise: 0.15,
            },
        }
    }

    /// The same without one effect.
    pub fn without(mut self, effect: Effect) -> Self {
        match effect {
            Effect::MotionBlur => self.exposure_s = 0.0,
            Effect::Defocus => (self.defocus_px_per_m, self.row_blur) = (0.0, 0.0),
            Effect::Speckle => self.speckle_contrast = 0.0,
            Effect::Halo => self.halo = 0.0,
            Effect::DropOuts => self.drop_out_share = 0.0,
            Effect::Highlights => self.highlights.mean_count = 0.0,
            Effect::Glints => (self.glints.mean_count, self.edge_glint) = (0.0, 0.0),
            Effect::Scratches => self.scratches.mean_count = 0.0,
            Effect::Ghosts => self.ghosts.mean_count = 0.0,
            Effect::Ambient => self.ambient = [0.0, 0.0],
            Effect::Noise => (self.read_noise, self.shot_noise) = (0.0, 0.0),
        }
        self
    }
}
