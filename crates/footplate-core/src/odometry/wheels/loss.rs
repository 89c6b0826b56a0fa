//! How a wheelset can lose its grip.

/// What a wheelset was seen to do other than roll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Loss {
    /// Traction turns it faster than the train moves.
    Spin,
    /// It slides: the brake turns it slower than the train.
    Slide,
}
