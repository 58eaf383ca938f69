//! The camera's image: the [`CameraNode`] wired to a board's CAN and image sensor, and [`Sensors`] to what is read out of it.
//!
//! | priority | task | |
//! |---|---|---|
//! | 2 | `tick` | every 2.5 ms: time passes for the node; the first time, power comes on |
//! | 2 | `receive` | "CAN receive": frames to the node, which answers; at the SYNC that it is told, it exposes |
//! | 2 | `frame` | the image sensor has been read out: the image to `vision`, or its loss to the node |
//! | 1 | `vision` | from pixels to sightings, and these to the node |
//! | 0 | `idle` | starts the tick, then nothing |
//!
//! There are two images' memories: into one the sensor is read out while vision looks at the other. One is as large as the
//! largest image, that of the seam's start, which the node takes alone; the other as the largest while tracking. What
//! priority 1 shares with priority 2 is the node, which is told the sightings, and the queue of images: it locks either
//! for a few dozen instructions.
//!
//! Deadline of `vision`: the SYNC with which the node sends the sighting (`Timing::latency_cycles` after the exposure). If it
//! is missed the sighting goes with the first SYNC after it is there, and the exposure after next is not taken.
//!
//! Parameters ([`Params`]) come from the board's parameter region. Without sound ones the node stays silent, and its master
//! finds it missing.
#![no_std]
#![no_main]
#![allow(
    unsafe_code,
    reason = "RTIC's macro hands out resources and writes the vector table's entries"
)]

use cortex_m_rt as _;

#[rtic::app(device = hal::board::chosen, peripherals = false)]
mod app {
    use firmware::camera::memory::Spare;
    use firmware::camera::node::CameraNode;
    use firmware::camera::sight::Sensors;
    use firmware::camera::{Event, Exposure, Params, Report};
    use firmware::vision::start::Workspace;
    use hal::board::chosen::{self as board, Board, Counter, Interrupt, Port, Receive, Sensor, Starter, Tick};
    use hal::board::counter::CycleCounter;
    use hal::board::frames::ask;
    use hal::board::m_can::filter;
    use hal::board::parameters;
    use hal::board::report::HALF_US;
    use hal::board::stack;
    use hal::camera::{Pixels, START, Size, TWO_SLITS, room};
    use hal::wire::Wire;
    use heapless::Deque;

    /// Images' memories: one for the sensor, one for vision.
    const MEMORIES: usize = 2;

    /// An image for vision: what it is of, its memory, its size.
    type Image = (Exposure, &'static mut Pixels, Size);

    #[shared]
    struct Shared {
        node: CameraNode,
        /// Images that vision has not looked at, oldest first.
        images: Deque<Image, MEMORIES>,
        /// Memories in which nothing is.
        spare: Spare<MEMORIES>,
        /// What vision finished since the last report, and the counts it took.
        seen: Option<(Exposure, u32)>,
        #[lock_free]
        port: Port,
        #[lock_free]
        sensor: Sensor,
    }

    #[local]
    struct Local {
        starter: Option<Starter>,
        tick: Tick,
        receive: Receive,
        params: Params,
        counter: Counter,
        sensors: Sensors,
        workspace: &'static mut Workspace,
    }

    // A board may have a memory for images that is not where it has its variables.
    #[init(local = [
        #[unsafe(link_section = ".bss.images")]
        small: [u8; room(TWO_SLITS)] = [0; room(TWO_SLITS)],
        #[unsafe(link_section = ".bss.images")]
        large: [u8; room(START)] = [0; room(START)],
        #[unsafe(link_section = ".bss.images")]
        scratch: Workspace = Workspace::new(),
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let Board {
            tick,
            starter,
            counter,
            port,
            receive,
            sensor,
            parameters,
        } = Board::open(&mut context.core, &filter::NODE);
        let mut params = Params::EMPTY;
        if parameters::fill_one(parameters, &mut params).is_err() {
            board::halt()
        }
        let init::LocalResources {
            small, large, scratch, ..
        } = context.local;
        let shared = Shared {
            node: CameraNode::new(params.node, params.timing),
            images: Deque::new(),
            spare: Spare::new([small, large]),
            seen: None,
            port,
            sensor,
        };
        let local = Local {
            starter: Some(starter),
            tick,
            receive,
            counter,
            sensors: Sensors::new(&params),
            workspace: scratch,
            params,
        };
        (shared, local)
    }

    #[task(binds = TICK, priority = 2, shared = [node, seen, port], local = [tick, has_power: bool = false])]
    fn tick(mut context: tick::Context) {
        let tick::LocalResources { tick, has_power, .. } = context.local;
        let port = context.shared.port;
        tick.acknowledge();
        context.shared.node.lock(|node| {
            if core::mem::replace(has_power, true) {
                node.elapse(HALF_US, &mut |frame| port.send(frame));
            } else {
                node.power_on(&mut |frame| port.send(frame));
            }
        });
        port.trace(&Report {
            event: Event::Tick,
            exposure: None,
            vision: context.shared.seen.lock(Option::take),
        });
        if port.asked() & ask::INSTRUMENTS != 0 {
            port.trace(&stack::depths());
        }
        port.commit();
    }

    #[task(binds = CANRX, priority = 2, shared = [node, spare, seen, port, sensor], local = [receive, params])]
    fn receive(mut context: receive::Context) {
        let receive::LocalResources { receive, params, .. } = context.local;
        let port = context.shared.port;
        let mut exposure = None;
        context.shared.node.lock(|node| {
            while let Some(frame) = receive.take() {
                exposure = exposure.or(node.receive(&frame, &mut |frame| port.send(frame)));
            }
        });
        if let Some(Exposure { look, .. }) = exposure {
            // The node has no more exposures under way than there are memories, and only one that takes the larger: it is there.
            let size = params.size(look);
            if let Some(memory) = context.shared.spare.lock(|spare| spare.take(room(size))) {
                context.shared.sensor.expose(look, size, memory);
            }
        }
        port.trace(&Report {
            event: Event::Receive,
            exposure,
            vision: context.shared.seen.lock(Option::take),
        });
        port.commit();
    }

    #[task(binds = FRAME, priority = 2, shared = [node, images, spare, sensor])]
    fn frame(mut context: frame::Context) {
        let Some((memory, size)) = context.shared.sensor.take() else {
            return;
        };
        let exposure = context.shared.node.lock(|node| node.read_out(size.is_some()));
        // As many images as there are memories: there is room.
        if let (Some(exposure), Some(size)) = (exposure, size) {
            let _ = context
                .shared
                .images
                .lock(|images| images.push_back((exposure, memory, size)));
            rtic::pend(Interrupt::BACKGROUND);
        } else {
            context.shared.spare.lock(|spare| spare.put(memory));
        }
    }

    #[task(binds = BACKGROUND, priority = 1, shared = [node, images, spare, seen], local = [counter, sensors, workspace])]
    fn vision(mut context: vision::Context) {
        let vision::LocalResources {
            counter,
            sensors,
            workspace,
            ..
        } = context.local;
        while let Some((exposure, memory, size)) = context.shared.images.lock(Deque::pop_front) {
            let start = counter.now();
            let sightings = sensors.see(&exposure, memory, size, workspace);
            let took = counter.now().wrapping_sub(start);
            // First of all: once the node has the sightings it may expose again.
            context.shared.spare.lock(|spare| spare.put(memory));
            context.shared.node.lock(|node| {
                sightings
                    .into_iter()
                    .flatten()
                    .for_each(|sighting| node.hand_back(sighting))
            });
            context.shared.seen.lock(|seen| *seen = Some((exposure, took)));
        }
    }

    #[idle(local = [starter])]
    fn idle(context: idle::Context) -> ! {
        // Not in `init`: what that returns is still to be moved to its places, which takes longer than a tick.
        if let Some(starter) = context.local.starter.take() {
            starter.start(HALF_US);
        }
        loop {
            board::idle();
        }
    }
}
