//! Supply, clocks and pins, by ST's hardware abstraction layer: once, at boot.
//!
//! The layer checks its figures at run time and panics over wrong ones. Ours are constants: either the image never boots, or
//! this never panics. The proof that no panic can be reached leaves out this one call, before anything has started; it
//! hands nothing on, so the rest of the image is the same with it and without.

use super::{CAN_HZ, CORE_HZ};
use stm32h7xx_hal::gpio::Speed;
use stm32h7xx_hal::pac;
use stm32h7xx_hal::prelude::*;
use stm32h7xx_hal::rcc::ResetEnable;
use stm32h7xx_hal::rcc::rec::FdcanClkSel;

/// The ST-LINK's crystal, which it puts out on MCO for the target (UM2407, "HSE clock").
const EXTERNAL_HZ: u32 = 8_000_000;
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

    let d = device.GPIOD.split(gates.GPIOD);
    let _receive = d.pd0.into_alternate::<9>();
    let _send = d.pd1.into_alternate::<9>().speed(Speed::High);
    let b = device.GPIOB.split(gates.GPIOB);
    let _lamp = b.pb14.into_push_pull_output();
}
