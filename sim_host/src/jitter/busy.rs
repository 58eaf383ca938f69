//! Threads that keep the machine busy below the real-time one, and talk with it as the image's load does.

use hal::board::load::Load;
use hal::board::mailbox::Mailbox;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// What one thread sweeps through, words: 8 MiB, more than a core's own caches hold.
const SWEPT: usize = 1 << 20;

/// The load, for as long as it lives: on every processor one thread that computes and one that moves memory.
pub struct Busy {
    news: Arc<Mailbox<1>>,
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Busy {
    /// Starts it.
    pub fn start() -> Self {
        let (news, over) = (Arc::new(Mailbox::new()), Arc::new(AtomicBool::new(false)));
        let processors = thread::available_parallelism().map_or(1, usize::from);
        let threads = (0..processors)
            .flat_map(|_| {
                let (news, computes, sweeps) = (Arc::clone(&news), Arc::clone(&over), Arc::clone(&over));
                [
                    thread::spawn(move || {
                        let mut load = Load::new();
                        while !computes.load(Ordering::Relaxed) {
                            let [news] = news.newest().unwrap_or_default();
                            black_box(load.round(news));
                        }
                    }),
                    thread::spawn(move || {
                        let mut memory = vec![0u64; SWEPT];
                        while !sweeps.load(Ordering::Relaxed) {
                            memory.iter_mut().for_each(|word| *word = word.wrapping_add(1));
                            black_box(&mut memory);
                        }
                    }),
                ]
            })
            .collect();
        Self { news, over, threads }
    }

    /// News from the real-time thread.
    pub fn tell(&self, news: u32) {
        self.news.put(&[news]);
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // One that panicked has told so itself.
            let _ = thread.join();
        }
    }
}
