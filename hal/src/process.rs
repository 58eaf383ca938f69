//! The process image: all that one control cycle reads and writes, and the only types that `hal` and the core share.
//!
//! `hal` fills [`Inputs`] from the newest frame of each kind (one mailbox per PDO, newest wins, never a queue) and turns
//! [`Outputs`] into frames. Raw units of the bus: encoder counts, per mille of rated torque, micrometres.

use crate::{wire_enum, wire_struct};

/// An age, in cycles, that also says "never": no frame of this kind has come yet.
pub const NEVER: u8 = u8::MAX;

/// One axis as its drive reported it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisInput {
    /// Position actual value 0x6064, encoder counts at the SYNC that it answers.
    pub position: i32,
    /// Velocity actual value 0x606C, counts/s.
    pub velocity: i32,
    /// Torque actual value 0x6077, per mille of rated torque.
    pub torque: i16,
    /// Statusword 0x6041.
    pub statusword: u16,
    /// Error code 0x603F, zero for none.
    pub error_code: u16,
    /// Modes of operation display 0x6061.
    pub mode: i8,
    /// Cycles since the TPDO1 that `position` and `statusword` came with; 0 is this cycle's, [`NEVER`] is none yet.
    pub age: u8,
}

impl Default for AxisInput {
    fn default() -> Self {
        Self {
            position: 0,
            velocity: 0,
            torque: 0,
            statusword: 0,
            error_code: 0,
            mode: 0,
            age: NEVER,
        }
    }
}

wire_struct!(AxisInput {
    position: i32,
    velocity: i32,
    torque: i16,
    statusword: u16,
    error_code: u16,
    mode: i8,
    age: u8
});

/// What the camera is to look at, and by which light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Look {
    /// Nothing is lit.
    #[default]
    Dark,
    /// The seam along the path: slits lit, tracking view.
    Seam,
    /// The start of the seam in grey: spot light, the larger view (paper 003, chapter 5).
    StartGrey,
    /// The start of the seam cut by the slit: slit lit, the larger view.
    StartSlit,
}

wire_enum!(Look {
    Dark,
    Seam,
    StartGrey,
    StartSlit
});

/// What the camera node saw in one exposure, by one slit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sighting {
    /// SYNC counter of the exposure.
    pub stamp: u8,
    /// What was looked at.
    pub look: Look,
    /// The slit that it was seen by: 0 or, of a sensor with two, 1 for the one further ahead.
    pub slit: u8,
    /// Zero if a seam was found, else the number of the refusal (`firmware::vision::sensor::Refusal`).
    pub refusal: u8,
    /// Seam point in the sensor frame Σ_S, µm; in [`Look::StartGrey`] where its ray meets the plane z = 0.
    pub point_um: [i16; 3],
    /// Inclination of the slit line in the image from the image's column axis, 0.1 mrad.
    pub angle_e4: i16,
    /// Quality of the find: 0 worst, 255 best, from [`Self::SURE`] on sure.
    pub quality: u8,
    /// Standard deviation of the point across the seam, µm; 255: that or more.
    pub sigma_um: u8,
}

wire_struct!(Sighting {
    stamp: u8,
    look: Look,
    slit: u8,
    refusal: u8,
    point_um: [i16; 3],
    angle_e4: i16,
    quality: u8,
    sigma_um: u8
});

impl Sighting {
    /// Least quality of a find that a reader may go by without asking another image, as the controller always does: on harsh surfaces one in
    /// 10⁵ such finds is more than a millimetre off (the example `detection` counts them). One below it is doubtful, if likelier right
    /// than wrong.
    pub const SURE: u8 = 128;

    /// Found, and sure.
    pub fn is_sure(&self) -> bool {
        self.refusal == 0 && self.quality >= Self::SURE
    }

    /// [`Self::point_um`] in m.
    pub fn point(&self) -> [f32; 3] {
        self.point_um.map(|um| f32::from(um) * 1e-6)
    }

    /// [`Self::angle_e4`] in rad.
    pub fn angle(&self) -> f32 {
        f32::from(self.angle_e4) * 1e-4
    }

    /// [`Self::sigma_um`] in m.
    pub fn sigma(&self) -> f32 {
        f32::from(self.sigma_um) * 1e-6
    }
}

/// A point of a seam that is being taught: where a slit's light met it, and how the sheet lies there, in Σ_B.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TaughtPoint {
    /// Counts the points, modulo 256.
    pub sequence: u8,
    /// The slit that saw it, 0 or 1.
    pub slit: u8,
    /// The point, µm; 24 bits of each go out.
    pub point_um: [i32; 3],
    /// Direction of the lit line on the sheet, to the left of travel: azimuth from x toward y, elevation toward z, 0.1 mrad.
    pub across_e4: [i16; 2],
    /// Standard deviation across the seam as the sensor states it, µm.
    pub sigma_um: u8,
}

wire_struct!(TaughtPoint {
    sequence: u8,
    slit: u8,
    point_um: [i32; 3],
    across_e4: [i16; 2],
    sigma_um: u8
});

/// Digital inputs of the I/O node as bits of [`Inputs::digital`].
pub mod digital {
    /// The E-stop chain is closed: cleared means stop, so that a cut wire stops the arm.
    pub const ESTOP_CLOSED: u8 = 1 << 0;
    /// Start button.
    pub const START: u8 = 1 << 1;
    /// Reset button: acknowledges a fault or a latched E-stop.
    pub const RESET: u8 = 1 << 2;
    /// Stop button: a controlled stop.
    pub const STOP: u8 = 1 << 3;
}

/// All that one control cycle reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs<const N: usize> {
    /// Counter of the SYNC that opened this cycle, 1..=240.
    pub sync: u8,
    /// The axes, base first.
    pub axes: [AxisInput; N],
    /// A sighting that arrived, if any: at most one a cycle, the second slit's in the cycle after the first's.
    pub sighting: Option<Sighting>,
    /// Cycles since the camera node's last heartbeat or sighting; [`NEVER`] is none yet.
    pub camera_age: u8,
    /// Digital inputs, bits of [`digital`].
    pub digital: u8,
    /// Cycles since the I/O node's last TPDO; [`NEVER`] is none yet.
    pub io_age: u8,
    /// Set-up by SDO is complete and every node is operational.
    pub bus_ready: bool,
    /// First emergency or set-up failure of any node since the last cycle: node number, zero for none.
    pub emergency_node: u8,
    /// Its error code (CiA 301).
    pub emergency_code: u16,
    /// Cycles of the 5 ms timer that were late or missed since the last cycle.
    pub overruns: u8,
}

impl<const N: usize> Default for Inputs<N> {
    fn default() -> Self {
        Self {
            sync: 0,
            axes: [AxisInput::default(); N],
            sighting: None,
            camera_age: NEVER,
            digital: 0,
            io_age: NEVER,
            bus_ready: false,
            emergency_node: 0,
            emergency_code: 0,
            overruns: 0,
        }
    }
}

wire_struct!(Inputs<const N: usize> {
    sync: u8, axes: [AxisInput; N], sighting: Option<Sighting>, camera_age: u8, digital: u8, io_age: u8,
    bus_ready: bool, emergency_node: u8, emergency_code: u16, overruns: u8,
});

/// What an axis is asked to be; `hal` turns it and the last statusword into the next controlword (CiA 402).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum PowerRequest {
    /// No torque: switch on disabled.
    #[default]
    Off,
    /// On towards operation enabled, and stay there.
    Enable,
    /// Quick stop on the drive's own ramp.
    QuickStop,
    /// Off, and acknowledge a fault once its cause is gone.
    ResetFault,
}

wire_enum!(PowerRequest {
    Off,
    Enable,
    QuickStop,
    ResetFault
});

/// One axis' command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisOutput {
    /// Power state asked for.
    pub request: PowerRequest,
    /// Target velocity 0x60FF, counts/s; used in CSV.
    pub velocity: i32,
    /// Target torque 0x6071 in CST, torque offset 0x60B2 in CSV: per mille of rated torque.
    pub torque: i16,
}

wire_struct!(AxisOutput {
    request: PowerRequest,
    velocity: i32,
    torque: i16
});

/// All that one control cycle writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs<const N: usize> {
    /// The axes, base first.
    pub axes: [AxisOutput; N],
    /// SYNC count at which the camera is to expose next; zero for none.
    pub exposure: u8,
    /// What it is to look at, and by which light.
    pub look: Look,
    /// Dispenser flow, per mille of nominal at the job's nominal speed; zero is closed.
    pub flow: u16,
    /// Signal lamp: 0 off, 1 armed, 2 running, 3 fault.
    pub lamp: u8,
    /// State of the safety machine (`firmware::safety::State`), for people and logs.
    pub state: u8,
    /// Number of the latched fault or stop reason (`firmware::fault::Fault`), zero for none.
    pub reason: u8,
    /// Phase of the job (`firmware::job::phase::Phase`).
    pub phase: u8,
    /// What became of the sighting of this cycle (`firmware::job::correction::Use`), zero for none came.
    pub sighting: u8,
    /// Distance along the taught path, µm, for telemetry.
    pub station_um: i32,
    /// A point that was taught in this cycle.
    pub taught: Option<TaughtPoint>,
}

impl<const N: usize> Default for Outputs<N> {
    fn default() -> Self {
        Self {
            axes: [AxisOutput::default(); N],
            exposure: 0,
            look: Look::Dark,
            flow: 0,
            lamp: 0,
            state: 0,
            reason: 0,
            phase: 0,
            sighting: 0,
            station_um: 0,
            taught: None,
        }
    }
}

wire_struct!(Outputs<const N: usize> {
    axes: [AxisOutput; N], exposure: u8, look: Look, flow: u16, lamp: u8, state: u8, reason: u8, phase: u8,
    sighting: u8, station_um: i32, taught: Option<TaughtPoint>,
});
