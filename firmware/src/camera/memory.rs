//! Which of a few memories an image is read out into.

use hal::camera::Pixels;

/// Memories in which nothing is, of `N` that there are.
#[derive(Debug)]
pub struct Spare<const N: usize>([Option<&'static mut Pixels>; N]);

impl<const N: usize> Spare<N> {
    /// All of them.
    pub fn new(memories: [&'static mut Pixels; N]) -> Self {
        Self(memories.map(Some))
    }

    /// The smallest with room for so many bytes, if there is one.
    pub fn take(&mut self, room: usize) -> Option<&'static mut Pixels> {
        let size = |place: &Option<&'static mut Pixels>| place.as_ref().map(|memory| memory.len());
        let fitting = self.0.iter_mut().filter(|place| size(place) >= Some(room));
        fitting.min_by_key(|place| size(place))?.take()
    }

    /// One of them comes back.
    pub fn put(&mut self, memory: &'static mut Pixels) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(memory);
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::boxed::Box;
    use std::vec;

    fn memory(bytes: usize) -> &'static mut Pixels {
        Box::leak(vec![0; bytes].into_boxed_slice())
    }

    #[test]
    fn the_smallest_that_fits_is_taken_whatever_the_order_in_which_they_came_back() {
        let mut spare = Spare::new([memory(10), memory(30)]);
        let (small, large) = (spare.take(10).unwrap(), spare.take(10).unwrap());
        assert_eq!((small.len(), large.len()), (10, 30));
        assert!(spare.take(1).is_none());
        spare.put(large);
        spare.put(small);
        assert_eq!(spare.take(5).unwrap().len(), 10);
        assert_eq!(spare.take(11).unwrap().len(), 30);
    }

    #[test]
    fn nothing_is_given_for_an_image_that_fits_nowhere() {
        let mut spare = Spare::new([memory(10), memory(30)]);
        assert!(spare.take(31).is_none());
    }
}
