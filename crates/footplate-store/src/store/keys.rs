//! The numbers by which a store knows recordings, runs and events.

use std::fmt;

/// A newtype over the number of a row.
macro_rules! key {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub i64);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

key!(
    /// A recording by its number in the store.
    RecordingKey
);
key!(
    /// A run by its number in the store, unique over all recordings.
    RunKey
);
key!(
    /// An event by its number in the store, by which a person excludes it.
    EventKey
);
