//! The drive's objects: settings, and what an SDO or a PDO reads and writes.

use super::data::DriveData;
use super::servo::Servo;
use hal::canopen::object::{Address, Number, Value};
use hal::canopen::sdo::Abort;
use hal::cia402::{Mode, object as o};

/// Values that objects hold. Power-on defaults: those of [`Settings::new`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    pub(super) abort_connection: i16,
    pub(super) quick_stop_option: i16,
    pub(super) shutdown_option: i16,
    pub(super) disable_option: i16,
    pub(super) halt_option: i16,
    pub(super) fault_option: i16,
    /// Stored and reported. In CSV and CST there is no position demand, so there is nothing to watch.
    pub(super) following_window: u32,
    /// As the window.
    pub(super) following_time: u16,
    pub(super) max_torque: u16,
    pub(super) max_speed_rpm: u32,
    pub(super) position_limits: [i32; 2],
    pub(super) quick_stop: u32,
}

impl Settings {
    pub(super) fn new(data: &DriveData) -> Self {
        Self {
            abort_connection: 1,
            quick_stop_option: 2,
            shutdown_option: 0,
            disable_option: 0,
            halt_option: 2,
            fault_option: 2,
            following_window: u32::MAX,
            following_time: 0,
            max_torque: (data.peak_torque_n_m / data.rated_torque_n_m * 1000.0).round() as u16,
            max_speed_rpm: data.max_speed_rpm,
            position_limits: [i32::MIN, i32::MAX],
            // From highest speed to a stand in 0.5 s.
            quick_stop: (data.max_speed_rad_s() * data.counts_per_rad() / 0.5) as u32,
        }
    }
}

/// `value`, if the emulation knows it.
fn option(number: Number, known: &[i16]) -> Result<i16, Abort> {
    let value = i16::try_from(number)?;
    if known.contains(&value) {
        Ok(value)
    } else {
        Err(Abort::RANGE)
    }
}

impl Servo {
    pub(super) fn read_object(&self, at: Address) -> Result<Value, Abort> {
        let s = &self.settings;
        Ok(match (at.index, at.sub) {
            (o::ABORT_CONNECTION, 0) => s.abort_connection.into(),
            (o::ERROR_CODE, 0) => self.error_code.into(),
            (o::CONTROLWORD, 0) => self.controlword.into(),
            (o::STATUSWORD, 0) => self.statusword().into(),
            (o::QUICK_STOP_OPTION, 0) => s.quick_stop_option.into(),
            (o::SHUTDOWN_OPTION, 0) => s.shutdown_option.into(),
            (o::DISABLE_OPTION, 0) => s.disable_option.into(),
            (o::HALT_OPTION, 0) => s.halt_option.into(),
            (o::FAULT_OPTION, 0) => s.fault_option.into(),
            (o::MODE | o::MODE_DISPLAY, 0) => self.mode.map_or(0, Mode::code).into(),
            (o::POSITION, 0) => self.position.into(),
            (o::FOLLOWING_WINDOW, 0) => s.following_window.into(),
            (o::FOLLOWING_TIME, 0) => s.following_time.into(),
            (o::VELOCITY, 0) => (self.tracking.velocity().round() as i32).into(),
            (o::TARGET_TORQUE, 0) => self.target_torque.into(),
            (o::MAX_TORQUE, 0) => s.max_torque.into(),
            (o::RATED_TORQUE, 0) => self.data().rated_torque_mnm().into(),
            (o::TORQUE, 0) => {
                let per_mille = self.motion.torque() / self.data().rated_torque_n_m * 1000.0;
                (per_mille.round() as i16).into()
            }
            (o::POSITION_LIMITS | o::ENCODER_RESOLUTION | o::GEAR_RATIO, 0) => 2u8.into(),
            (o::POSITION_LIMITS, 1) => s.position_limits[0].into(),
            (o::POSITION_LIMITS, 2) => s.position_limits[1].into(),
            (o::MAX_SPEED, 0) => s.max_speed_rpm.into(),
            (o::QUICK_STOP_DECELERATION, 0) => s.quick_stop.into(),
            (o::ENCODER_RESOLUTION, 1) => self.data().encoder_counts.into(),
            (o::ENCODER_RESOLUTION, 2) | (o::GEAR_RATIO, 1 | 2) => 1u32.into(),
            (o::TORQUE_OFFSET, 0) => self.torque_offset.into(),
            (o::TARGET_VELOCITY, 0) => self.target_velocity.into(),
            (o::SUPPORTED_MODES, 0) => (Mode::Velocity.supported_bit() | Mode::Torque.supported_bit()).into(),
            (o::ABORT_CONNECTION | o::ERROR_CODE..=o::FAULT_OPTION | o::MODE | o::MODE_DISPLAY, _) => {
                return Err(Abort::NO_SUB);
            }
            (o::POSITION_LIMITS | o::ENCODER_RESOLUTION | o::GEAR_RATIO, _) => return Err(Abort::NO_SUB),
            _ => return Err(Abort::NO_OBJECT),
        })
    }

    pub(super) fn write_object(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        let s = &mut self.settings;
        match (at.index, at.sub) {
            (o::CONTROLWORD, 0) => self.control(number.try_into()?),
            (o::TARGET_VELOCITY, 0) => {
                self.previous_velocity = self.target_velocity as f64;
                self.target_velocity = number.try_into()?;
            }
            (o::TARGET_TORQUE, 0) => self.target_torque = number.try_into()?,
            (o::TORQUE_OFFSET, 0) => self.torque_offset = number.try_into()?,
            (o::MODE, 0) => {
                let code = i8::try_from(number)?;
                let mode = Some(Mode::from_code(code).ok_or(Abort::RANGE)?);
                if self.machine.state().has_torque() && mode != self.mode {
                    return Err(Abort::STATE);
                }
                self.mode = mode;
            }
            (o::ABORT_CONNECTION, 0) => s.abort_connection = option(number, &[0, 1, 2, 3])?,
            (o::QUICK_STOP_OPTION, 0) => {
                s.quick_stop_option = option(number, &[2, 6])?;
                self.machine.holds_after_quick_stop = s.quick_stop_option == 6;
            }
            (o::SHUTDOWN_OPTION, 0) => s.shutdown_option = option(number, &[0])?,
            (o::DISABLE_OPTION, 0) => s.disable_option = option(number, &[0])?,
            (o::HALT_OPTION, 0) => s.halt_option = option(number, &[2])?,
            (o::FAULT_OPTION, 0) => s.fault_option = option(number, &[0, 2])?,
            (o::FOLLOWING_WINDOW, 0) => s.following_window = number.try_into()?,
            (o::FOLLOWING_TIME, 0) => s.following_time = number.try_into()?,
            (o::MAX_TORQUE, 0) => s.max_torque = number.try_into()?,
            (o::MAX_SPEED, 0) => s.max_speed_rpm = number.try_into()?,
            (o::POSITION_LIMITS, 1) => s.position_limits[0] = number.try_into()?,
            (o::POSITION_LIMITS, 2) => s.position_limits[1] = number.try_into()?,
            (o::QUICK_STOP_DECELERATION, 0) => match u32::try_from(number)? {
                0 => return Err(Abort::RANGE),
                value => s.quick_stop = value,
            },
            _ => return Err(self.read_object(at).err().unwrap_or(Abort::READ_ONLY)),
        }
        Ok(())
    }
}
