//! What every image does when it panics: it stops where it is, and whoever waits for it finds it missing. Of the controller that is SYNC: without it
//! the drives quick-stop by themselves. Of the camera it is the heartbeat, and of a replay the end of the link.

/// Stops. Built for the proof that no panic can be reached, it names a function that does not exist: an image that could come
/// here does not link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    #[cfg(feature = "panic-proof")]
    {
        unsafe extern "C" {
            fn a_panic_can_be_reached() -> !;
        }
        // SAFETY: never runs, for it never links: there is no such function.
        unsafe { a_panic_can_be_reached() }
    }
    #[cfg(not(feature = "panic-proof"))]
    super::chosen::halt()
}
