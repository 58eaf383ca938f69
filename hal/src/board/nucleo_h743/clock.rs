//! Supply, clocks, pins and the image sensor's registers, by the hardware abstraction layer: once, at boot.
//!
//! The layer checks its figures at run time and panics over wrong ones. Ours are constants: either the image never boots, or
//! this never panics. The proof that no panic can be reached leaves out this one call, before anything has started; it
//! hands nothing on, so the rest of the image is the same with it and without.

use super::{CAN_HZ, CORE_HZ, mt9v034};
use stm32h7xx_hal::gpio::Speed;
use stm32h7xx_hal::pac;
use stm32h7xx_hal::prelude::*;
use stm32h7xx_hal::rcc::ResetEnable;
use stm32h7xx_hal::rcc::rec::FdcanClkSel;

/// The ST-LINK's crystal, which it puts out on MCO for the target (UM2407).
const EXTERNAL_HZ: u32 = 8_000_000;
/// Rate of the wires to the image sensor's registers.
const SENSOR_HZ: u32 = 400_000;

/// Sets everything up.
pub(super) fn start(device: pac::Peripherals) {
    let supply = device.PWR.constrain().vos1().freeze();
    let clocks = device
        .RCC
        .constrain()
        .use_hse(EXTERNAL_HZ.Hz())
        .bypass_hse()
        .sys_ck(CORE_HZ.Hz())
        .pll1_q_ck(CAN_HZ.Hz())
        .freeze(supply, &device.SYSCFG);
    let gates = clocks.peripheral;
    gates.FDCAN.kernel_clk_mux(FdcanClkSel::Pll1Q).enable().reset();
    gates.TIM2.enable().reset();
    gates.TIM5.enable().reset();

    let (a, b) = (device.GPIOA.split(gates.GPIOA), device.GPIOB.split(gates.GPIOB));
    let (c, d) = (device.GPIOC.split(gates.GPIOC), device.GPIOD.split(gates.GPIOD));
    let (e, f) = (device.GPIOE.split(gates.GPIOE), device.GPIOF.split(gates.GPIOF));
    let _can = (
        d.pd0.into_alternate::<9>(),
        d.pd1.into_alternate::<9>().speed(Speed::High),
    );
    let _synchronisation = (
        a.pa4.into_alternate::<13>(),
        b.pb7.into_alternate::<13>(),
        a.pa6.into_alternate::<13>(),
    );
    let _pixels = (
        c.pc6.into_alternate::<13>(),
        c.pc7.into_alternate::<13>(),
        c.pc8.into_alternate::<13>(),
        c.pc9.into_alternate::<13>(),
        c.pc11.into_alternate::<13>(),
        b.pb6.into_alternate::<13>(),
        b.pb8.into_alternate::<13>(),
        b.pb9.into_alternate::<13>(),
    );
    let _trigger_and_lights = (
        e.pe9.into_push_pull_output(),
        e.pe11.into_push_pull_output(),
        e.pe13.into_push_pull_output(),
        b.pb14.into_push_pull_output(),
    );
    // Pulled up, so that a bus to which nothing is wired reads as one where nobody answers.
    let wires = (
        f.pf1.into_alternate_open_drain::<4>().internal_pull_up(true),
        f.pf0.into_alternate_open_drain::<4>().internal_pull_up(true),
    );
    let mut bus = device.I2C2.i2c(wires, SENSOR_HZ.Hz(), gates.I2C2, &clocks.clocks);
    for (register, value) in mt9v034::REGISTERS {
        let [high, low] = value.to_be_bytes();
        if bus.write(mt9v034::ADDRESS, &[register, high, low]).is_err() {
            // There is none, as on a controller's board. A camera whose sensor does not answer reports lost images.
            break;
        }
    }
}
