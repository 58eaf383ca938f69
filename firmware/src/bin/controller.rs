//! The controller's image: the [`Controller`] wired to a board's timer and CAN.
//!
//! | priority | task | |
//! |---|---|---|
//! | 3 | `tick` | every 2.5 ms, in turn: SYNC, and the control cycle when the drives have answered |
//! | 2 | `receive` | "CAN receive": from the port's FIFO into that of `tick` |
//! | 1 | `background` | a round of load after each tick, if asked for |
//! | 0 | `idle` | starts the tick; then nothing, or more load |
//!
//! Deadline of `tick`: the next tick. If it is missed the drives keep their last targets, which they hold for four cycles;
//! what is late or missed is told to the next cycle, which drops its derivative, and three within a second stop the arm.
//! `tick` locks nothing that `receive` holds: frames come to it through a queue without locks, and it takes them in at its
//! own beginning, so that what a cycle knows does not depend on how long anything took.
//!
//! With the feature `second-arm` the same cycle moves a five-axis arm beside the sealing one, its drives on the same bus.
//! With the feature `stages` each cycle's report says what each of its stages took; the marks cost some instructions themselves.
//!
//! Parameters (the bus, then the core's) come from the board's parameter region. Without sound ones nothing starts: no
//! SYNC is sent, and the drives stay off.
#![no_std]
#![no_main]
#![allow(
    unsafe_code,
    reason = "RTIC's macro hands out resources and writes the vector table's entries"
)]

use cortex_m_rt as _;

#[rtic::app(device = hal::board::chosen, peripherals = false)]
mod app {
    use core::sync::atomic::{AtomicBool, Ordering};
    use firmware::controller::Controller;
    #[cfg(feature = "second-arm")]
    use firmware::cycle::SecondArm;
    use firmware::cycle::{Params, Second};
    use firmware::job::seal::AXES;
    use hal::board::beat::Beat;
    use hal::board::chosen::{self as board, Board, Counter, Port, Receive, Starter, Tick};
    use hal::board::counter::CycleCounter;
    use hal::board::fifo::Fifo;
    use hal::board::frames::ask;
    use hal::board::load::Load;
    use hal::board::m_can::filter;
    use hal::board::mailbox::Mailbox;
    use hal::board::parameters;
    use hal::board::report::{CycleReport, Event, HALF_US, Instruments, Timing};
    use hal::board::stack;
    use hal::master::MasterConfig;
    #[cfg(feature = "stages")]
    use hal::stage::Laps;
    use hal::stage::STAGES;
    use hal::wire::{Fnv64, Wire};

    /// What moves beside the sealing arm.
    #[cfg(not(feature = "second-arm"))]
    type Beside = ();
    #[cfg(feature = "second-arm")]
    type Beside = SecondArm<5>;

    /// All axes.
    const ALL: usize = AXES + <Beside as Second>::COUNT;

    /// Counts of the counter from one timer event to the next.
    const HALF: u32 = Counter::HERTZ / 1_000_000 * HALF_US;

    /// Frames that came and that `tick` has not taken in.
    static ARRIVED: Fifo = Fifo::new();

    /// Load is asked for; `tick` says so to `idle`.
    static LOADED: AtomicBool = AtomicBool::new(false);
    /// From `tick` to `background`: when the newest event began.
    static NEWS: Mailbox<1> = Mailbox::new();
    /// From `background` and `idle` to `tick`: rounds of load done, and what came out.
    static DONE: [Mailbox<2>; 2] = [const { Mailbox::new() }; 2];

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        starter: Option<Starter>,
        tick: Tick,
        counter: Counter,
        port: Port,
        controller: &'static mut Controller<Beside, ALL>,
        params: &'static (Params, Beside),
        beat: Beat<HALF>,
        hash: Fnv64,
        receive: Receive,
    }

    // Both are filled in where they stand: `init` has a few kilobytes of stack.
    #[init(local = [place: Controller<Beside, ALL> = Controller::EMPTY, parameter_place: (Params, Beside) = (Params::ZEROS, Beside::EMPTY)])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let Board {
            tick,
            starter,
            counter,
            port,
            receive,
            parameters,
            ..
        } = Board::open(&mut context.core, &filter::MASTER);
        let (controller, params) = (context.local.place, context.local.parameter_place);
        let mut config = MasterConfig::EMPTY;
        let filled = parameters::fill(parameters, &mut config, params);
        if filled.is_err() || controller.set_up(&config, &params.0).is_err() {
            board::halt()
        }
        let local = Local {
            starter: Some(starter),
            tick,
            counter,
            port,
            controller,
            params,
            beat: Beat::new(),
            hash: Fnv64::default(),
            receive,
        };
        (Shared {}, local)
    }

    #[task(binds = TICK, priority = 3, local = [tick, counter, port, controller, params, beat, hash, instruments: Instruments = Instruments::new()])]
    fn tick(context: tick::Context) {
        // Read before a register is saved for all that follows.
        let latency = context.local.tick.since();
        event(context.local, latency);
    }

    /// One timer event, whose task began `latency` counts after it.
    #[inline(never)]
    fn event(local: tick::LocalResources, latency: u32) {
        let tick::LocalResources {
            tick,
            counter,
            port,
            controller,
            params,
            beat,
            instruments,
            hash,
            ..
        } = local;
        let start = counter.now();
        tick.acknowledge();
        let (event, overruns) = beat.begin(start, latency);
        controller.overran(overruns);
        // What has come up to now was there before this event, whichever way the interrupts fell.
        ARRIVED.drain(|frame| controller.receive(&frame));
        #[cfg_attr(not(feature = "stages"), expect(unused_mut, reason = "only laps fill them"))]
        let mut stages = [0; STAGES];
        let done = match event {
            Event::Sync => {
                controller.sync(&mut |frame| port.send(frame));
                None
            }
            Event::Cycle => {
                let (params, second) = params;
                #[cfg(not(feature = "stages"))]
                let done = controller.cycle(params, second, &mut |frame| port.send(frame));
                #[cfg(feature = "stages")]
                let done = {
                    let mut laps = Laps::since(counter, start);
                    let done = controller.cycle_watched(params, second, &mut |frame| port.send(frame), &mut laps);
                    stages = laps.counts();
                    done
                };
                Some(done)
            }
        };
        let loaded = port.asked() & ask::LOAD != 0;
        LOADED.store(loaded, Ordering::Relaxed);
        if loaded {
            for (rounds, done) in instruments.load.iter_mut().zip(&DONE) {
                if let Some([count, _]) = done.newest() {
                    *rounds = count;
                }
            }
            NEWS.put(&[start]);
            rtic::pend(board::Interrupt::BACKGROUND);
        }
        let timing = Timing {
            event,
            latency,
            start,
            busy: counter.now().wrapping_sub(start),
            overruns,
        };
        instruments.add(&timing, 2 * HALF);
        port.trace(&timing);
        if let Some((inputs, outputs)) = done {
            outputs.write(hash);
            port.trace(&CycleReport {
                inputs: *inputs,
                outputs: *outputs,
                hash: hash.0,
                stages,
            });
        }
        if port.asked() & ask::INSTRUMENTS != 0 {
            instruments.stack = stack::depths();
            port.trace(instruments);
        }
        port.commit();
    }

    #[task(binds = CANRX, priority = 2, local = [receive])]
    fn receive(context: receive::Context) {
        while let Some(frame) = context.local.receive.take() {
            // A full queue means that `tick` has not run for more frames than half a cycle can hold: the newest are lost,
            // and the ages in the process image tell.
            let _ = ARRIVED.put(&frame);
        }
    }

    #[task(binds = BACKGROUND, priority = 1, local = [load: Load = Load::new()])]
    fn background(context: background::Context) {
        if let ([done, _], Some([news])) = (&DONE, NEWS.newest()) {
            done.put(&context.local.load.round(news));
        }
    }

    #[idle(local = [starter, idle_load: Load = Load::new()])]
    fn idle(context: idle::Context) -> ! {
        // Not in `init`: what that returns is still to be moved to its places, which takes longer than a tick.
        if let Some(starter) = context.local.starter.take() {
            starter.start(HALF_US);
        }
        let [_, done] = &DONE;
        loop {
            if LOADED.load(Ordering::Relaxed) {
                done.put(&context.local.idle_load.round(0));
            } else {
                board::idle();
            }
        }
    }
}
