//! What disturbs the grey image of the seam's end, and how much.
//!
//! The light is a ring about the camera's lens (paper 003, appendix B): it comes from where the camera looks, so steps throw next to no
//! shadow, and an edge shows by its own rounding: a thin bright line where it mirrors the ring, and a dark one in the crevice below.
//! All values are assumed: the papers give none. Grey levels of an 8-bit image, lengths on the sheet in metres. The arm stands still, so
//! there is no motion blur.

use crate::camera::effects::Range;
use crate::cell::panel::Surface;

/// Marks of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marks {
    /// Mean number in the view.
    pub mean_count: f64,
    /// Relative change of brightness (of the sheet's own) at the middle.
    pub contrast: Range,
    /// Length of a scratch, radius of a blot or weld, of a glint.
    pub size_m: Range,
}

/// The set of disturbances of a grey image.
#[derive(Clone, Debug, PartialEq)]
pub struct SpotLight {
    /// Brightness of a matt sheet at the image's centre, grey levels.
    pub sheet: Range,
    /// Relative difference of the two sheets' brightness, ±.
    pub sheets_differ: f64,
    /// Brightness of the mirrored ring relative to the sheet's own, and the exponent of its lobe.
    pub gloss: Range,
    /// See [`Self::gloss`].
    pub gloss_exponent: Range,
    /// Share of brightness lost toward the corners of the image by the lens and the ring's distance.
    pub vignetting: Range,
    /// Rolling marks: relative standard deviation of streaks, the same direction all over a sheet.
    pub streaks: f64,
    /// Grain of the surface: relative standard deviation from pixel to pixel.
    pub grain: f64,
    /// The bright line on an edge relative to the sheet's brightness, and its width.
    pub edge_line: Range,
    /// See [`Self::edge_line`].
    pub edge_line_m: Range,
    /// Share of the light missing in the crevice under an edge, and the crevice's width.
    pub crevice: Range,
    /// See [`Self::crevice`].
    pub crevice_m: Range,
    /// Share of an edge's length along which it shows neither, and the length of such stretches.
    pub edge_lost: f64,
    /// See [`Self::edge_lost`].
    pub edge_lost_m: Range,
    /// Stretches of an edge that mirror the ring fully: mean number, and their brightness relative to the sheet's.
    pub edge_glints: Marks,
    /// Scratches: bright or dark.
    pub scratches: Marks,
    /// Oil, primer, fingerprints: soft, bright or dark.
    pub blots: Marks,
    /// Dark rings that spot welding leaves, 6 to 12 mm beside the seam.
    pub welds: Marks,
    /// Bright spots.
    pub glints: Marks,
    /// Standard deviation of the lens's blur, px.
    pub blur_px: Range,
    /// What lies behind the part, grey levels; the fixture's edges there change it by up to this much again.
    pub background: Range,
    /// Read noise, standard deviation.
    pub read_noise: f64,
    /// Shot noise: variance per grey level.
    pub shot_noise: f64,
}

const NONE: Marks = Marks {
    mean_count: 0.0,
    contrast: [0.0, 0.0],
    size_m: [0.001, 0.001],
};

impl SpotLight {
    /// The disturbances of a surface.
    pub fn of(surface: Surface) -> Self {
        let marks = |mean_count, contrast, size_m| Marks {
            mean_count,
            contrast,
            size_m,
        };
        match surface {
            Surface::Clean => Self {
                sheet: [110.0, 140.0],
                sheets_differ: 0.05,
                gloss: [0.05, 0.10],
                gloss_exponent: [40.0, 80.0],
                vignetting: [0.10, 0.20],
                streaks: 0.015,
                grain: 0.02,
                edge_line: [0.2, 0.4],
                edge_line_m: [0.00010, 0.00015],
                crevice: [0.6, 0.8],
                crevice_m: [0.00030, 0.00045],
                edge_lost: 0.0,
                edge_lost_m: [0.001, 0.002],
                edge_glints: NONE,
                scratches: NONE,
                blots: NONE,
                welds: NONE,
                glints: NONE,
                blur_px: [0.6, 0.8],
                background: [8.0, 14.0],
                read_noise: 1.5,
                shot_noise: 0.05,
            },
            Surface::Moderate => Self {
                sheet: [85.0, 140.0],
                sheets_differ: 0.15,
                gloss: [0.1, 0.6],
                gloss_exponent: [40.0, 150.0],
                vignetting: [0.15, 0.35],
                streaks: 0.04,
                grain: 0.05,
                edge_line: [0.1, 0.6],
                edge_line_m: [0.00008, 0.00020],
                crevice: [0.35, 0.75],
                crevice_m: [0.00020, 0.00045],
                edge_lost: 0.08,
                edge_lost_m: [0.0005, 0.004],
                edge_glints: marks(1.5, [0.5, 2.5], [0.0005, 0.003]),
                scratches: marks(5.0, [0.15, 0.6], [0.002, 0.012]),
                blots: marks(2.0, [0.05, 0.25], [0.002, 0.008]),
                welds: marks(1.2, [0.15, 0.4], [0.0022, 0.0030]),
                glints: marks(3.0, [0.5, 3.0], [0.0001, 0.0004]),
                blur_px: [0.7, 1.1],
                background: [10.0, 30.0],
                read_noise: 2.5,
                shot_noise: 0.10,
            },
            Surface::Harsh => Self {
                sheet: [60.0, 140.0],
                sheets_differ: 0.3,
                gloss: [0.3, 1.5],
                gloss_exponent: [40.0, 250.0],
                vignetting: [0.2, 0.5],
                streaks: 0.08,
                grain: 0.08,
                edge_line: [0.0, 1.0],
                edge_line_m: [0.00005, 0.00030],
                crevice: [0.2, 0.7],
                crevice_m: [0.00015, 0.00050],
                edge_lost: 0.2,
                edge_lost_m: [0.001, 0.006],
                edge_glints: marks(3.0, [0.5, 4.0], [0.0005, 0.005]),
                scratches: marks(12.0, [0.2, 1.0], [0.003, 0.025]),
                blots: marks(5.0, [0.1, 0.4], [0.002, 0.010]),
                welds: marks(1.5, [0.2, 0.6], [0.0022, 0.0035]),
                glints: marks(6.0, [0.5, 4.0], [0.0001, 0.0006]),
                blur_px: [0.8, 1.4],
                background: [10.0, 50.0],
                read_noise: 3.5,
                shot_noise: 0.15,
            },
        }
    }
}
