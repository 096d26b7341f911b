//! Work on several threads where the feature `rayon` is on, else one thing after the other: the same results, in the
//! same order.

#[cfg(feature = "rayon")]
pub(crate) use rayon::{current_num_threads, prelude::*};

#[cfg(not(feature = "rayon"))]
pub(crate) use serial::{InOrder, RefInOrder, current_num_threads};

/// A part of some work, which gives a count. In a box: threads are then compiled for once and not for each kernel.
pub(crate) type Piece<'a> = Box<dyn FnOnce() -> usize + Send + 'a>;

/// The sum of what the pieces give.
pub(crate) fn total(pieces: Vec<Piece<'_>>) -> usize {
    pieces.into_par_iter().map(|piece| piece()).sum()
}

/// The names of rayon that are in use, without threads.
#[cfg(not(feature = "rayon"))]
mod serial {
    pub(crate) trait InOrder: IntoIterator + Sized {
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }

        /// Only the diagnosis asks for it.
        #[cfg(feature = "serde")]
        fn reduce_with(self, join: impl FnMut(Self::Item, Self::Item) -> Self::Item) -> Option<Self::Item> {
            self.into_iter().reduce(join)
        }
    }

    impl<I: IntoIterator> InOrder for I {}

    pub(crate) trait RefInOrder {
        fn par_iter<'a>(&'a self) -> <&'a Self as IntoIterator>::IntoIter
        where
            &'a Self: IntoIterator,
        {
            self.into_iter()
        }
    }

    impl<T: ?Sized> RefInOrder for T {}

    pub(crate) const fn current_num_threads() -> usize {
        1
    }
}
