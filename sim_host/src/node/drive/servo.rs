//! The drive as a device: its objects, its power state, its faults, and which demand they make on the motion.

use super::MotorCommand;
use super::data::{DriveData, rad_s};
use super::encoder::EncoderReading;
use super::motion::{Demand, Limits, Motion};
use super::tracking::Tracking;
use hal::canopen::emcy::code;
use hal::canopen::nmt::NmtState;
use hal::canopen::object::{Address, Device, Event, Number, Value};
use hal::canopen::sdo::Abort;
use hal::cia402::machine::{Condition, Machine};
use hal::cia402::{Mode, PowerState, control, object as o, status};

/// Over-speed is a fault at this multiple of the maximum motor speed 0x6080 (assumed; drives allow 1.1 to 1.3).
const OVER_SPEED: f64 = 1.2;
/// A motor stands, at the end of a stop, below this part of its highest speed.
const STANDSTILL: f64 = 0.002;

/// Values that objects hold. Power-on defaults: those of [`Settings::new`].
#[derive(Clone, Copy, Debug)]
struct Settings {
    abort_connection: i16,
    quick_stop_option: i16,
    shutdown_option: i16,
    disable_option: i16,
    halt_option: i16,
    fault_option: i16,
    /// Stored and reported. In CSV and CST there is no position demand, so there is nothing to watch.
    following_window: u32,
    /// As the window.
    following_time: u16,
    max_torque: u16,
    max_speed_rpm: u32,
    position_limits: [i32; 2],
    quick_stop: u32,
}

impl Settings {
    fn new(data: &DriveData) -> Self {
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

/// The drive but for its bus.
#[derive(Clone, Debug)]
pub struct Servo {
    data: DriveData,
    settings: Settings,
    machine: Machine,
    mode: Option<Mode>,
    controlword: u16,
    target_velocity: i32,
    target_torque: i16,
    torque_offset: i16,
    /// Velocity target of the SYNC before the last, for interpolation.
    previous_velocity: f64,
    tracking: Tracking,
    motion: Motion,
    /// Speed on the way to a stand, rad/s, while a stop is under way.
    ramp: Option<f64>,
    /// Time since torque came on, s.
    enabled_s: f64,
    reading: EncoderReading,
    /// Time of the reading, ns.
    read_ns: u64,
    position: i32,
    sync_ns: u64,
    sync_period_ns: u64,
    error_code: u16,
    emergency: Option<u16>,
    /// Cause of a fault that is present and holds it, zero for none.
    cause: u16,
    voltage: bool,
    pub(super) now_ns: u64,
}

impl Servo {
    pub(super) fn new(data: DriveData) -> Self {
        let settings = Settings::new(&data);
        let mut machine = Machine::default();
        machine.ready();
        Self {
            data,
            settings,
            machine,
            mode: None,
            controlword: 0,
            target_velocity: 0,
            target_torque: 0,
            torque_offset: 0,
            previous_velocity: 0.0,
            tracking: Tracking::default(),
            motion: Motion::default(),
            ramp: None,
            enabled_s: 0.0,
            reading: EncoderReading::default(),
            read_ns: 0,
            position: 0,
            sync_ns: 0,
            sync_period_ns: 0,
            error_code: code::NONE,
            emergency: None,
            cause: code::NONE,
            voltage: true,
            now_ns: 0,
        }
    }

    /// Ratings and constants.
    pub fn data(&self) -> &DriveData {
        &self.data
    }

    /// Power state.
    pub fn state(&self) -> PowerState {
        self.machine.state()
    }

    /// Speed as tracked, rad/s at the motor.
    pub fn speed_rad_s(&self) -> f64 {
        self.tracking.velocity() / self.data.counts_per_rad()
    }

    /// Motor power (the DC link) comes on or is cut. The logic stays alive, as behind a safety contactor.
    pub fn set_voltage(&mut self, on: bool) {
        self.voltage = on;
    }

    /// Injects the cause of a fault, one of [`code`]; it stays until [`Self::clear`].
    pub fn fail(&mut self, cause: u16) {
        self.cause = cause;
        self.fault(cause);
    }

    /// Takes the cause of an injected fault away. The fault itself stays latched until it is reset.
    pub fn clear(&mut self) {
        self.cause = code::NONE;
    }

    pub(super) fn take_emergency(&mut self) -> Option<u16> {
        self.emergency.take()
    }

    fn fault(&mut self, cause: u16) {
        if matches!(self.state(), PowerState::Fault | PowerState::FaultReaction) {
            return;
        }
        // Without current, voltage or speed there is nothing to stop with.
        let helpless = matches!(cause, code::OVER_CURRENT | code::UNDER_VOLTAGE | code::SENSOR);
        self.machine.fail(self.settings.fault_option != 0 && !helpless);
        self.error_code = cause;
        self.emergency = Some(cause);
    }

    /// The connection to the master is gone or unusable: 0x6007.
    fn disconnect(&mut self, cause: u16) {
        if !self.state().has_torque() {
            return;
        }
        match self.settings.abort_connection {
            1 => self.fault(cause),
            2 => self.machine.disable(),
            3 => self.machine.quick_stop(),
            _ => return,
        }
        self.error_code = cause;
    }

    pub(super) fn tick(&mut self, dt_s: f64, reading: EncoderReading) -> MotorCommand {
        self.reading = reading;
        self.read_ns = self.now_ns;
        self.position = reading.counts;
        self.tracking.update(dt_s, reading.counts);
        let speed = self.speed_rad_s();
        self.watch(speed);
        let demand = self.demand(speed, dt_s);
        let limits = Limits {
            torque_n_m: self.settings.max_torque as f64 / 1000.0 * self.data.rated_torque_n_m,
            speed_rad_s: rad_s(self.settings.max_speed_rpm).min(self.data.max_speed_rad_s()),
        };
        self.motion.step(&self.data, limits, demand, speed, dt_s);
        self.enabled_s = if demand == Demand::Off {
            0.0
        } else {
            self.enabled_s + dt_s
        };
        MotorCommand {
            torque_n_m: self.motion.torque(),
            brake_closed: self.enabled_s < self.data.brake_open_s,
        }
    }

    /// Faults that the drive finds itself.
    fn watch(&mut self, speed: f64) {
        let powered = self.state().has_torque() || self.state() == PowerState::SwitchedOn;
        if !self.voltage && powered {
            self.fault(code::UNDER_VOLTAGE);
        }
        if speed.abs() > OVER_SPEED * rad_s(self.settings.max_speed_rpm) {
            self.fault(code::OVER_SPEED);
        }
        // In CSV the demand already stops short of the limits; in CST only a fault can stop the motor.
        let [low, high] = self.settings.position_limits;
        let outward = (self.position > high && speed > 0.0) || (self.position < low && speed < 0.0);
        if outward && self.state() == PowerState::OperationEnabled && self.mode == Some(Mode::Torque) {
            self.fault(code::POSITION_LIMIT);
        }
    }

    fn demand(&mut self, speed: f64, dt_s: f64) -> Demand {
        let stops = match self.state() {
            PowerState::OperationEnabled => self.controlword & control::HALT != 0,
            PowerState::QuickStopActive | PowerState::FaultReaction => true,
            _ => {
                self.ramp = None;
                return Demand::Off;
            }
        };
        if stops {
            return self.stop(speed, dt_s);
        }
        self.ramp = None;
        let torque = |per_mille: i16| per_mille as f64 / 1000.0 * self.data.rated_torque_n_m;
        match self.mode {
            Some(Mode::Torque) => Demand::Torque(torque(self.target_torque) + torque(self.torque_offset)),
            Some(Mode::Velocity) => Demand::Velocity(self.velocity(), torque(self.torque_offset)),
            None => Demand::Off,
        }
    }

    /// The way to a stand on the quick-stop ramp, and what follows it.
    fn stop(&mut self, speed: f64, dt_s: f64) -> Demand {
        let step = self.settings.quick_stop as f64 / self.data.counts_per_rad() * dt_s;
        let from = self.ramp.unwrap_or(speed);
        let ramp = from - from.clamp(-step, step);
        self.ramp = Some(ramp);
        if ramp == 0.0 && speed.abs() < STANDSTILL * self.data.max_speed_rad_s() {
            self.machine.stopped();
        }
        // The torque offset is kept: it is the weight of the arm, and that does not stop.
        let offset = self.torque_offset as f64 / 1000.0 * self.data.rated_torque_n_m;
        if self.state().has_torque() {
            Demand::Velocity(ramp, offset)
        } else {
            Demand::Off
        }
    }

    /// Velocity demand in CSV, rad/s: held or interpolated, and never so fast towards a position limit that the
    /// quick-stop ramp could not stop before it.
    fn velocity(&self) -> f64 {
        let target = self.target_velocity as f64;
        let counts_s = if self.data.interpolate && self.sync_period_ns != 0 {
            let part = (self.now_ns - self.sync_ns) as f64 / self.sync_period_ns as f64;
            self.previous_velocity + (target - self.previous_velocity) * part.min(1.0)
        } else {
            target
        };
        let reach = |limit: i32, sign: f64| {
            let distance = sign * (limit as f64 - self.position as f64);
            (2.0 * self.settings.quick_stop as f64 * distance.max(0.0)).sqrt()
        };
        let [low, high] = self.settings.position_limits;
        counts_s.min(reach(high, 1.0)).max(-reach(low, -1.0)) / self.data.counts_per_rad()
    }

    fn statusword(&self) -> u16 {
        let state = self.state();
        let at_limit = {
            let [low, high] = self.settings.position_limits;
            state == PowerState::OperationEnabled && (self.position >= high || self.position <= low)
        };
        let flag = |bit, set: bool| if set { bit } else { 0 };
        state.bits()
            | status::REMOTE
            | flag(status::VOLTAGE, self.voltage)
            | flag(status::LIMIT, self.motion.is_limited() || at_limit)
            | flag(
                status::FOLLOWS,
                state == PowerState::OperationEnabled && self.ramp.is_none(),
            )
    }

    fn control(&mut self, word: u16) {
        self.controlword = word;
        let condition = Condition {
            voltage: self.voltage && self.mode.is_some(),
            healthy: self.cause == code::NONE && self.voltage,
        };
        if self.machine.control(word, condition) {
            self.error_code = code::NONE;
            self.emergency = Some(code::NONE);
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

impl Device for Servo {
    fn read(&self, at: Address) -> Result<Value, Abort> {
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
            (o::RATED_TORQUE, 0) => self.data.rated_torque_mnm().into(),
            (o::TORQUE, 0) => {
                let per_mille = self.motion.torque() / self.data.rated_torque_n_m * 1000.0;
                (per_mille.round() as i16).into()
            }
            (o::POSITION_LIMITS | o::ENCODER_RESOLUTION | o::GEAR_RATIO, 0) => 2u8.into(),
            (o::POSITION_LIMITS, 1) => s.position_limits[0].into(),
            (o::POSITION_LIMITS, 2) => s.position_limits[1].into(),
            (o::MAX_SPEED, 0) => s.max_speed_rpm.into(),
            (o::QUICK_STOP_DECELERATION, 0) => s.quick_stop.into(),
            (o::ENCODER_RESOLUTION, 1) => self.data.encoder_counts.into(),
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

    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
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
            _ => return Err(self.read(at).err().unwrap_or(Abort::READ_ONLY)),
        }
        Ok(())
    }

    fn sync(&mut self, _count: u8) {
        if self.sync_ns != 0 {
            self.sync_period_ns = self.now_ns - self.sync_ns;
        }
        self.sync_ns = self.now_ns;
        // The shaft has moved on since the last tick.
        let since_s = (self.now_ns - self.read_ns) as f64 * 1e-9;
        let moved = (self.tracking.velocity() * since_s).round() as i32;
        self.position = self.reading.counts.wrapping_add(moved);
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::State(NmtState::Operational) => {}
            Event::State(_) | Event::MasterLost => self.disconnect(code::HEARTBEAT),
            Event::RpdoLate(_) => self.disconnect(code::RPDO_TIMEOUT),
            Event::Reset => {
                // Motor power and the cause of a fault are the world's, not the node's.
                let (voltage, cause, now_ns) = (self.voltage, self.cause, self.now_ns);
                *self = Self {
                    voltage,
                    cause,
                    now_ns,
                    ..Self::new(self.data)
                };
            }
        }
    }
}
