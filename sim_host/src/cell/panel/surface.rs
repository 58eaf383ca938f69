//! State of the part's surface, and how far its sheets then are from flat.

/// State of the part's surface; also chooses the optical disturbances that the camera renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Surface {
    /// Matt, flat sheet, no gap in the joint.
    Clean,
    /// Primed sheet after spot welding: the ordinary part.
    #[default]
    Moderate,
    /// Oily, scratched and dented sheet.
    Harsh,
}

/// How far sheets differ from flat and the joint from tight.
pub(super) struct Roughness {
    /// Amplitude of each of the undulation's [`UNDULATIONS`] waves, m.
    pub undulation_m: f64,
    /// Largest depth of a dent, m.
    pub dent_m: f64,
    /// Dents per metre of seam, within 25 mm of it.
    pub dents_per_m: f64,
    /// Largest gap between lapped sheets, m (2.3: "gaps of the joint make the step larger than the sheet").
    pub gap_m: f64,
    /// Largest inclination of one sheet against the other across the seam, rad.
    pub lap_tilt_rad: f64,
}

impl Surface {
    /// Assumed, because the paper speaks of dented panels without figures; chosen so that a dent is shallower than the
    /// sheet is thick (moderate) or nearly as deep (harsh).
    pub(super) fn roughness(self) -> Roughness {
        match self {
            Self::Clean => Roughness {
                undulation_m: 0.00001,
                dent_m: 0.0,
                dents_per_m: 0.0,
                gap_m: 0.0,
                lap_tilt_rad: 0.0,
            },
            Self::Moderate => Roughness {
                undulation_m: 0.00004,
                dent_m: 0.00025,
                dents_per_m: 15.0,
                gap_m: 0.00015,
                lap_tilt_rad: 1_f64.to_radians(),
            },
            Self::Harsh => Roughness {
                undulation_m: 0.00008,
                dent_m: 0.0005,
                dents_per_m: 25.0,
                gap_m: 0.00025,
                lap_tilt_rad: 1.5_f64.to_radians(),
            },
        }
    }
}
