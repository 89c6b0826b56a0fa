//! Which unknown is which among the numbers of a motion model.
