//! Fixed-size little-endian byte form of plain values.
//!
//! One encoding serves the run log, its hash, and the channel to an emulated target, so that "the same bits" means the
//! same thing everywhere. No lengths and no tags: a type's size is [`Wire::BYTES`], always.

/// Takes bytes in order: a slice writer, a hash, a file.
pub trait Sink {
    /// Appends `bytes`.
    fn put(&mut self, bytes: &[u8]);
}

/// A value with a fixed-size byte form.
pub trait Wire: Sized {
    /// Length of the byte form.
    const BYTES: usize;
    /// All zeros, or as near as the type comes: to be filled, not to be used.
    const EMPTY: Self;
    /// Writes exactly [`Self::BYTES`] bytes.
    fn write(&self, sink: &mut impl Sink);
    /// Takes [`Self::BYTES`] bytes off the front of `source` into this value, where it stands: a microcontroller has no stack for large ones.
    /// `None` if the source is too short or holds no legal value; the value is then neither the old nor the new.
    fn fill(&mut self, source: &mut &[u8]) -> Option<()>;
    /// The value that [`Self::fill`] gives.
    fn read(source: &mut &[u8]) -> Option<Self> {
        let mut value = Self::EMPTY;
        value.fill(source)?;
        Some(value)
    }
}

macro_rules! wire_number {
    ($($number:ty),*) => {$(
        impl Wire for $number {
            const BYTES: usize = size_of::<$number>();
            const EMPTY: Self = 0 as $number;
            fn write(&self, sink: &mut impl Sink) {
                sink.put(&self.to_le_bytes());
            }
            fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
                let (head, tail) = source.split_first_chunk()?;
                *source = tail;
                *self = Self::from_le_bytes(*head);
                Some(())
            }
        }
    )*};
}
wire_number!(u8, i8, u16, i16, u32, i32, u64, f32);

impl Wire for bool {
    const BYTES: usize = 1;
    const EMPTY: Self = false;
    fn write(&self, sink: &mut impl Sink) {
        sink.put(&[*self as u8]);
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        *self = match u8::read(source)? {
            0 => false,
            1 => true,
            _ => return None,
        };
        Some(())
    }
}

impl<T: Wire, const N: usize> Wire for [T; N] {
    const BYTES: usize = N * T::BYTES;
    const EMPTY: Self = [T::EMPTY; N];
    fn write(&self, sink: &mut impl Sink) {
        for item in self {
            item.write(sink);
        }
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        for item in self {
            item.fill(source)?;
        }
        Some(())
    }
}

impl<T: Wire> Wire for Option<T> {
    const BYTES: usize = 1 + T::BYTES;
    const EMPTY: Self = None;
    fn write(&self, sink: &mut impl Sink) {
        self.is_some().write(sink);
        match self {
            Some(value) => value.write(sink),
            None => T::EMPTY.write(sink),
        }
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        let some = bool::read(source)?;
        let value = T::read(source)?;
        *self = some.then_some(value);
        Some(())
    }
}

/// Nothing, in no byte.
impl Wire for () {
    const BYTES: usize = 0;
    const EMPTY: Self = ();
    fn write(&self, _: &mut impl Sink) {}
    fn fill(&mut self, _: &mut &[u8]) -> Option<()> {
        Some(())
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    const BYTES: usize = A::BYTES + B::BYTES;
    const EMPTY: Self = (A::EMPTY, B::EMPTY);
    fn write(&self, sink: &mut impl Sink) {
        self.0.write(sink);
        self.1.write(sink);
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        self.0.fill(source)?;
        self.1.fill(source)
    }
}

impl<A: Wire, B: Wire, C: Wire> Wire for (A, B, C) {
    const BYTES: usize = A::BYTES + B::BYTES + C::BYTES;
    const EMPTY: Self = (A::EMPTY, B::EMPTY, C::EMPTY);
    fn write(&self, sink: &mut impl Sink) {
        self.0.write(sink);
        self.1.write(sink);
        self.2.write(sink);
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        self.0.fill(source)?;
        self.1.fill(source)?;
        self.2.fill(source)
    }
}

/// Implements [`Wire`] for a struct, field by field in the order given.
#[macro_export]
macro_rules! wire_struct {
    ($name:ident $(<const $n:ident: usize>)? { $($field:ident: $kind:ty),* $(,)? }) => {
        impl $(<const $n: usize>)? $crate::wire::Wire for $name $(<$n>)? {
            const BYTES: usize = 0 $(+ <$kind as $crate::wire::Wire>::BYTES)*;
            const EMPTY: Self = Self { $($field: <$kind as $crate::wire::Wire>::EMPTY),* };
            fn write(&self, sink: &mut impl $crate::wire::Sink) {
                $($crate::wire::Wire::write(&self.$field, sink);)*
            }
            fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
                $($crate::wire::Wire::fill(&mut self.$field, source)?;)*
                Some(())
            }
        }
    };
}

/// Implements [`Wire`] for a field-less enum as its `u8` code; a code that is not listed reads as `None`.
#[macro_export]
macro_rules! wire_enum {
    ($name:ident { $first:ident $(, $variant:ident)* $(,)? }) => {
        impl $crate::wire::Wire for $name {
            const BYTES: usize = 1;
            const EMPTY: Self = Self::$first;
            fn write(&self, sink: &mut impl $crate::wire::Sink) {
                sink.put(&[*self as u8]);
            }
            fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
                let code = <u8 as $crate::wire::Wire>::read(source)?;
                for variant in [Self::$first $(, Self::$variant)*] {
                    if code == variant as u8 {
                        *self = variant;
                        return Some(());
                    }
                }
                None
            }
        }
    };
}

/// 64-bit FNV-1a (Fowler, Noll, Vo), the hash of logs and outputs: byte-serial, so it is the same on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv64(pub u64);

impl Default for Fnv64 {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325) // the offset basis
    }
}

impl Sink for Fnv64 {
    #[inline(never)] // into every field of what is hashed: kilobytes of flash
    fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}
