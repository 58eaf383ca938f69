//! Why the arm stops, as data: cause, axis or node, cycle. A line for people is made where a person reads it.

use hal::{wire_enum, wire_struct};

/// Every cause of a stop, numbered: the number stands in [`hal::process::Outputs::reason`], in logs and in the README.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// None.
    #[default]
    None = 0,
    /// The E-stop chain is open.
    EStop = 1,
    /// A drive left "operation enabled" unasked.
    DriveOff = 2,
    /// A drive reported a fault.
    DriveFault = 3,
    /// A drive's TPDO1 is older than two cycles.
    DriveSilent = 4,
    /// The measured position is further from the reference than allowed.
    FollowingError = 5,
    /// The reference would leave a joint's range.
    JointLimit = 6,
    /// The reference would be faster than a joint may turn.
    SpeedLimit = 7,
    /// The I/O node is silent: the E-stop chain cannot be seen.
    IoSilent = 8,
    /// The camera node is silent.
    CameraSilent = 9,
    /// No usable sighting for too long a stretch of the path.
    Blind = 10,
    /// The timer's cycle was late or missed too often.
    Overrun = 11,
    /// A node reported an emergency, or its set-up failed.
    Emergency = 12,
    /// No inverse-kinematic solution for the start of the path.
    Unreachable = 13,
    /// Drives did not reach "operation enabled" in time.
    ArmingTimeout = 14,
    /// The stop button was pressed.
    StopButton = 15,
    /// The start of the seam was in no view of the search, or too little of the seam in the survey.
    StartNotFound = 16,
    /// Views of the start contradict themselves or each other.
    StartDoubtful = 17,
    /// The seam that is being taught was lost before its end.
    SeamLost = 18,
    /// The arm cannot turn the sensor about the place where the seam that is being taught turns off.
    CannotTurn = 19,
}

wire_enum!(Fault {
    None,
    EStop,
    DriveOff,
    DriveFault,
    DriveSilent,
    FollowingError,
    JointLimit,
    SpeedLimit,
    IoSilent,
    CameraSilent,
    Blind,
    Overrun,
    Emergency,
    Unreachable,
    ArmingTimeout,
    StopButton,
    StartNotFound,
    StartDoubtful,
    SeamLost,
    CannotTurn,
});

/// What a fault makes the arm do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Brake along the path, then switch off: the drives still obey and the path is still known.
    Brake,
    /// Each drive stops on its own quick-stop ramp: the reference cannot be trusted, or an axis is gone.
    QuickStop,
}

impl Fault {
    /// The defined reaction.
    pub fn reaction(self) -> Reaction {
        match self {
            Self::None
            | Self::CameraSilent
            | Self::Blind
            | Self::Overrun
            | Self::StopButton
            | Self::StartNotFound
            | Self::StartDoubtful
            | Self::SeamLost
            | Self::CannotTurn => Reaction::Brake,
            _ => Reaction::QuickStop,
        }
    }

    /// One line for a person: cause, and what to look at.
    pub fn line(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::EStop => "E-stop chain open: close it, then press reset",
            Self::DriveOff => "a drive left operation enabled: look at its supply and its enable input",
            Self::DriveFault => "a drive reports a fault: its error code names the cause",
            Self::DriveSilent => "no position from a drive for more than two cycles: look at its bus connection",
            Self::FollowingError => "an axis is too far from its reference: blocked, overloaded, or wrongly tuned",
            Self::JointLimit => "the path leaves a joint's range: move the part or teach another posture",
            Self::SpeedLimit => "the path asks a joint to turn faster than it may: slow down or move the part",
            Self::IoSilent => "I/O node silent: the E-stop chain cannot be seen",
            Self::CameraSilent => "camera node silent: look at its supply and its bus connection",
            Self::Blind => "no usable sighting of the seam for too long: look at the refusals in the log",
            Self::Overrun => "the control cycle came late too often: look at the jitter figures",
            Self::Emergency => "a node sent an emergency or refused its set-up: node and code are in the log",
            Self::Unreachable => "the start of the path cannot be reached within the joint limits",
            Self::ArmingTimeout => "the drives did not reach operation enabled in time",
            Self::StopButton => "stopped by the stop button",
            Self::StartNotFound => "the start of the seam was not found: is the part in its place, within 50 mm?",
            Self::StartDoubtful => {
                "the part's pose is in doubt, its views contradict each other: look for glare, dirt or a wrong part"
            }
            Self::SeamLost => {
                "the seam was lost before its end, and no other leg of it found: slow down, or look for dirt or a turn of more than 100 degrees"
            }
            Self::CannotTurn => {
                "the arm cannot turn the sensor about the place where the seam turns off, a joint is at its end: move the part, or teach in two parts"
            }
        }
    }
}

/// The first fault since the last reset: later ones are consequences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trip {
    /// What happened.
    pub fault: Fault,
    /// Axis (0 is the base) or node number, where one is to blame.
    pub place: u8,
    /// Cycle since power-up.
    pub cycle: u32,
}

wire_struct!(Trip {
    fault: Fault,
    place: u8,
    cycle: u32
});
