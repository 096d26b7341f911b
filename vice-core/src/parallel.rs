//! Work on several threads where the feature `rayon` is on, else one thing after the other: the same results, in the
//! same order.

#[cfg(feature = "rayon")]
pub(crate) use rayon::{current_num_threads, join, prelude::*};

#[cfg(not(feature = "rayon"))]
pub(crate) use serial::{InOrder, RefInOrder, current_num_threads, join};

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

    pub(crate) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }

    pub(crate) const fn current_num_threads() -> usize {
        1
    }
}
