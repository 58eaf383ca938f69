//! What one sealing trial is about: the options of the cell, and what a seed draws from them.

use crate::calibration::sensor::SensorGeometry;
use crate::cell::panel::{Joint, Panel, Side, Surface};
use crate::cell::path::SeamPath;
use crate::target::node::On;
use crate::taught::TaughtSeam;
use clap::ValueEnum;
use firmware::job::seal::StartPose;
use firmware::job::survey::SECTIONS;
use firmware::servo::hold::HoldKind;
use firmware::vision::joint::Joint as Pattern;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Which seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PathName {
    /// 500 mm straight.
    Straight,
    /// Half circle of R150 between two straights of 50 mm.
    Arc,
    /// The paper's: 280 mm, half circle R150, 120 mm, corner of 165°, 120 mm.
    Panel,
    /// A corner of 90° and R5 between two straights of 250 mm.
    Corner,
}

impl PathName {
    /// The seam in the work frame.
    pub fn seam(self) -> SeamPath {
        match self {
            Self::Straight => SeamPath::straight(),
            Self::Arc => SeamPath::arc(),
            Self::Panel => SeamPath::panel(),
            Self::Corner => SeamPath::corner(),
        }
    }

    /// Nominal pose of the work frame, Σ_W at the seam's start: T_b_w. The seam's middle stands where the arm is well conditioned (all six joints
    /// within ±130°, |sin θ_5| > 0.99, wrist under 150 °/s at 0.3 m/s), tilted 20° about y_B as in the paper's chapter 4.
    pub fn placing(self) -> Isometry3<f64> {
        let reach = match self {
            Self::Straight | Self::Panel | Self::Corner => 0.55,
            Self::Arc => 0.60,
        };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 20f64.to_radians())
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -90f64.to_radians());
        Isometry3::from_parts(Translation3::new(reach, 0.0, 0.1), turn) * Translation3::from(-self.middle())
    }

    /// Middle of the box around the seam, Σ_W, m.
    fn middle(self) -> Vector3<f64> {
        match self {
            Self::Straight => Vector3::new(0.250, 0.0, 0.0),
            Self::Arc => Vector3::new(0.100, 0.150, 0.0),
            Self::Panel => Vector3::new(0.215, 0.150, 0.0),
            Self::Corner => Vector3::new(0.128, 0.127, 0.0),
        }
    }
}

/// Shape of the joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum JointName {
    /// Lap joint, the upper sheet on the left of travel.
    Crank,
    /// The same with the upper sheet on the right.
    CrankRight,
    /// Bend: two flanks in a valley.
    Vee,
    /// Sheet edge at a drop, the sheet on the left of travel.
    Lip,
    /// The same with the sheet on the right.
    LipRight,
}

impl JointName {
    /// The true shape.
    pub fn shape(self) -> Joint {
        match self {
            Self::Crank => Joint::crank(Side::Left),
            Self::CrankRight => Joint::crank(Side::Right),
            Self::Vee => Joint::vee(),
            Self::Lip => Joint::lip(Side::Left),
            Self::LipRight => Joint::lip(Side::Right),
        }
    }

    /// The same as the sensor is told.
    pub fn pattern(self) -> Pattern {
        self.shape().pattern()
    }
}

/// State of the part's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SurfaceName {
    /// Matt, flat sheet.
    Clean,
    /// The ordinary part.
    Moderate,
    /// Oily, scratched and dented sheet.
    Harsh,
}

impl SurfaceName {
    /// The true surface.
    pub fn state(self) -> Surface {
        match self {
            Self::Clean => Surface::Clean,
            Self::Moderate => Surface::Moderate,
            Self::Harsh => Surface::Harsh,
        }
    }
}

/// Hold between corrections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HoldName {
    /// Zero-order: each correction at once.
    Zero,
    /// Straight from one to the next.
    First,
    /// The paper's: from rest to rest with constant acceleration.
    Second,
    /// Twice continuously differentiable, without stopping at samples.
    Smooth,
}

impl HoldName {
    /// The core's name for it.
    pub fn kind(self) -> HoldKind {
        match self {
            Self::Zero => HoldKind::Zero,
            Self::First => HoldKind::First,
            Self::Second => HoldKind::Second,
            Self::Smooth => HoldKind::Smooth,
        }
    }
}

/// Where the start pose comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StartName {
    /// The sensor measures it before the part is sealed.
    Measured,
    /// It is told, with an error.
    Given,
}

/// Name of a value as the command line spells it.
pub fn name_of(value: &impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map_or_else(String::new, |name| name.get_name().to_string())
}

/// Drive mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DriveMode {
    /// Cyclic synchronous velocity: the drive closes its own speed loop.
    Csv,
    /// Cyclic synchronous torque: the paper's arrangement.
    Cst,
}

/// The cell and how the job is run in it: every disturbance with its stated value.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Where the controller runs.
    pub on: On,
    /// Which seam.
    pub path: PathName,
    /// Shape of the joint.
    pub joint: JointName,
    /// Speed along the seam, m/s.
    pub speed: f64,
    /// Hold between corrections.
    pub hold: HoldName,
    /// Slits of the seam sensor, 1 or 2.
    pub slits: u8,
    /// How hard the images are.
    pub surface: SurfaceName,
    /// Part misplaced by up to this in each axis, m.
    pub offset: f64,
    /// Part turned by up to this about each axis, rad.
    pub turn: f64,
    /// Peak of the part's deformation, lateral and in height, m.
    pub deform: f64,
    /// Where the start pose comes from.
    pub start: StartName,
    /// Places along the seam that are looked at after the start was measured, so that a bend near it does not turn the whole path.
    pub survey: u8,
    /// Error of the given start pose per axis, m and rad, uniform.
    pub start_error: (f64, f64),
    /// Share of frames that the camera loses.
    pub frame_loss: f64,
    /// Times that the camera takes a lost image again by itself.
    pub retakes: u8,
    /// Relative error of the controller's servo model: masses, inertias, friction, torque constants.
    pub model_error: f64,
    /// Drive mode.
    pub mode: DriveMode,
    /// Velocity, inertia, gravity and friction feed-forward.
    pub feed_forward: bool,
    /// Preview corrections from the sensor.
    pub preview: bool,
    /// Cycles from one burst of exposures to the next.
    pub vision_period: u8,
    /// Cycles from exposure to the sighting on the bus. Default 4: 10 ms for the read-out of a small field, and 10 ms for the seam sensor on
    /// a camera processor of the controller's class; the paper's board took 30 + 2 ms.
    pub vision_latency: u8,
    /// The same of a grey view of the seam's start: 275 ms, of which the reference camera's processor (500 million instructions a second)
    /// works up to 200. Assumed.
    pub grey_latency: u8,
    /// From the SYNC that triggers an exposure, at which the drives latch their positions, to its middle, s: what the camera's trigger and half
    /// the time that it is open make. At 0 the camera opens that much ahead of the SYNC. Less than the read-out.
    pub exposure_delay: f64,
    /// The same as the controller believes it, s.
    pub assumed_delay: f64,
    /// The sensor is not as drawn, but as [`crate::calibration::simulated::truth`] draws it from this seed, its lens included.
    pub camera_seed: Option<u64>,
    /// The sensor as the controller knows it; without one, as drawn.
    pub calibration: Option<SensorGeometry>,
    /// Error frames injected on the bus per cycle, at most.
    pub error_frames: u8,
    /// The seam that is played, where it was taught; without one, the part's drawing.
    pub taught: Option<&'static TaughtSeam>,
    /// A second arm moves to and fro beside the sealing one, on the same bus and in the same cycle.
    pub second_arm: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            on: On::Host,
            path: PathName::Panel,
            joint: JointName::Crank,
            speed: 0.3,
            hold: HoldName::Smooth,
            slits: 2,
            surface: SurfaceName::Moderate,
            offset: 0.010,
            turn: 3f64.to_radians(),
            deform: 0.002,
            start: StartName::Measured,
            survey: SECTIONS as u8,
            start_error: (1e-4, 0.2f64.to_radians()),
            frame_loss: 0.05,
            retakes: 0,
            model_error: 0.10,
            mode: DriveMode::Csv,
            feed_forward: true,
            preview: true,
            vision_period: 20,
            vision_latency: 4,
            grey_latency: 55,
            exposure_delay: 0.0,
            assumed_delay: 0.0,
            camera_seed: None,
            calibration: None,
            error_frames: 0,
            taught: None,
            second_arm: false,
        }
    }
}

impl Options {
    /// The default with a start pose that is told: for what is not about measuring it.
    pub fn told() -> Self {
        Self {
            start: StartName::Given,
            ..Self::default()
        }
    }
}

/// Streams of random numbers of one trial: each user of chance has its own, so that a change in one leaves the others' draws alone.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
pub enum Stream {
    /// Where the part lies and how it is bent.
    Part = 1,
    /// The error of the given start pose.
    StartPose,
    /// The plant's deviations from the controller's model.
    Plant,
    /// Frames lost.
    Frames,
    /// The images' noise.
    Images,
    /// Errors on the bus.
    Bus,
    /// What is made to fail, and when.
    Faults,
    /// The second arm's deviations from the controller's model.
    SecondArm,
}

/// The generator of one stream of one trial.
pub fn stream(seed: u64, which: Stream) -> Pcg64 {
    // SplitMix64's constants spread neighbouring seeds and streams over the whole state.
    let mix = |x: u64| {
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let high = mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    let low = mix(high ^ mix(which as u64));
    Pcg64::new(u128::from(high), u128::from(low))
}

/// What a seed made of the options.
pub struct Draw {
    /// The part as it really is.
    pub panel: Panel,
    /// Rigid motion of the part from where it was taught, in Σ_B.
    pub displacement: Isometry3<f64>,
}

/// A number in −limit..=limit.
fn within(rng: &mut Pcg64, limit: f64) -> f64 {
    (2.0 * rng.random::<f64>() - 1.0) * limit
}

impl Draw {
    /// Draws the part for `seed`.
    pub fn new(options: &Options, seed: u64) -> Self {
        let mut rng = stream(seed, Stream::Part);
        let nominal = options.path.placing();
        let mut triple = |limit| Vector3::from_fn(|_, _| within(&mut rng, limit));
        let (shift, turn) = (triple(options.offset), triple(options.turn));
        // The part turns about the middle of its seam, as in a worn jig.
        let middle = Translation3::from((nominal * Point3::from(options.path.middle())).coords);
        let displacement = Translation3::from(shift)
            * middle
            * UnitQuaternion::from_euler_angles(turn.x, turn.y, turn.z)
            * middle.inverse();
        let joint = options.joint.shape();
        let panel = Panel::new(
            options.path.seam(),
            joint,
            options.surface.state(),
            options.deform,
            displacement * nominal,
            &mut rng,
        )
        .ending_at_end();
        Self { panel, displacement }
    }

    /// The start pose that the job is given: the true displacement seen from the taught nozzle pose `t_b_n0` (sealing.md, 6.2 and 6.3), with its error.
    pub fn start_pose(&self, options: &Options, t_b_n0: &Isometry3<f64>, seed: u64) -> StartPose {
        let mut rng = stream(seed, Stream::StartPose);
        let seen = t_b_n0.inverse() * self.displacement * t_b_n0;
        let r = seen.rotation.to_rotation_matrix();
        // R = Rot(x)·Rot(y)·Rot(z*): the sensor measures θ_z in its image plane, tan θ_z = tan θ_z* / cos θ_y.
        let y = r[(0, 2)].asin();
        let x = (-r[(1, 2)]).atan2(r[(2, 2)]);
        let z_star = (-r[(0, 1)]).atan2(r[(0, 0)]);
        let z = (z_star.tan() / y.cos()).atan();
        let (shift_error, tilt_error) = options.start_error;
        StartPose {
            shift: [seen.translation.x, seen.translation.y, seen.translation.z]
                .map(|v| (v + within(&mut rng, shift_error)) as f32),
            tilt: [x, y, z].map(|v| (v + within(&mut rng, tilt_error)) as f32),
        }
    }
}
