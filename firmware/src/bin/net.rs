//! The neural seam finder alone, for counting what it costs: images come over a link, and what the net makes of each goes back with counts.
//!
//! The camera's node finds seams by the local fit, which finds more; so its image has no net in it. The source, the compiler and
//! the profile are the camera's; no interrupt is on.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use firmware::vision::image::View;
use firmware::vision::joint::Joint;
use firmware::vision::net;
use hal::board::chosen::{self as board, Link};
use hal::camera::ONE_SLIT;

const WIDTH: usize = ONE_SLIT[0] as usize;
const HEIGHT: usize = ONE_SLIT[1] as usize;

#[entry]
fn main() -> ! {
    static mut PIXELS: [u8; WIDTH * HEIGHT] = [0; WIDTH * HEIGHT];

    let mut link = Link::open();
    loop {
        let joint: Joint = link.receive();
        link.fill(PIXELS);
        let Ok(view) = View::new(PIXELS, WIDTH, HEIGHT) else {
            board::halt()
        };
        let start = link.now();
        let seam = net::find(&view, joint);
        let frame = link.now().wrapping_sub(start);
        // One window by itself: the first.
        let left = net::first_window(&view).unwrap_or(0);
        let start = link.now();
        let says = net::CRANK.window(&view, left, 0, false);
        let window = link.now().wrapping_sub(start);
        let is_seam = says.map(|(_, activity)| activity.output);
        link.send(&(seam, is_seam, [frame, window]));
    }
}
