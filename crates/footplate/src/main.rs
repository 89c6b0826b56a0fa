//! The program: the only clock, sockets and threads.

fn main() {}
