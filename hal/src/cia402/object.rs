//! Indices of the CiA 402 objects in use; sub-index 0 unless said.

/// Abort connection option code, i16: what the drive does when the master is lost.
pub const ABORT_CONNECTION: u16 = 0x6007;
/// Error code, u16.
pub const ERROR_CODE: u16 = 0x603F;
/// Controlword, u16.
pub const CONTROLWORD: u16 = 0x6040;
/// Statusword, u16.
pub const STATUSWORD: u16 = 0x6041;
/// Quick stop option code, i16.
pub const QUICK_STOP_OPTION: u16 = 0x605A;
/// Shutdown option code, i16.
pub const SHUTDOWN_OPTION: u16 = 0x605B;
/// Disable operation option code, i16.
pub const DISABLE_OPTION: u16 = 0x605C;
/// Halt option code, i16.
pub const HALT_OPTION: u16 = 0x605D;
/// Fault reaction option code, i16.
pub const FAULT_OPTION: u16 = 0x605E;
/// Modes of operation, i8.
pub const MODE: u16 = 0x6060;
/// Modes of operation display, i8.
pub const MODE_DISPLAY: u16 = 0x6061;
/// Position actual value, i32, counts.
pub const POSITION: u16 = 0x6064;
/// Following error window, u32, counts.
pub const FOLLOWING_WINDOW: u16 = 0x6065;
/// Following error time out, u16, ms.
pub const FOLLOWING_TIME: u16 = 0x6066;
/// Velocity actual value, i32, counts/s.
pub const VELOCITY: u16 = 0x606C;
/// Target torque, i16, per mille of rated.
pub const TARGET_TORQUE: u16 = 0x6071;
/// Maximum torque, u16, per mille of rated.
pub const MAX_TORQUE: u16 = 0x6072;
/// Motor rated torque, u32, mN·m.
pub const RATED_TORQUE: u16 = 0x6076;
/// Torque actual value, i16, per mille of rated.
pub const TORQUE: u16 = 0x6077;
/// Software position limits, sub 1 min and 2 max, i32, counts.
pub const POSITION_LIMITS: u16 = 0x607D;
/// Maximum motor speed, u32, 1/min.
pub const MAX_SPEED: u16 = 0x6080;
/// Quick stop deceleration, u32, counts/s².
pub const QUICK_STOP_DECELERATION: u16 = 0x6085;
/// Position encoder resolution, sub 1 increments, 2 motor revolutions, u32.
pub const ENCODER_RESOLUTION: u16 = 0x608F;
/// Gear ratio, sub 1 motor revolutions, 2 shaft revolutions, u32.
pub const GEAR_RATIO: u16 = 0x6091;
/// Torque offset, i16, per mille of rated.
pub const TORQUE_OFFSET: u16 = 0x60B2;
/// Target velocity, i32, counts/s.
pub const TARGET_VELOCITY: u16 = 0x60FF;
/// Supported drive modes, u32.
pub const SUPPORTED_MODES: u16 = 0x6502;
