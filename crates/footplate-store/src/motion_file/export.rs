//! From a motion model to its file.
