//! Settings of a board and the line to it.

use core::ops::RangeInclusive;

/// How turnouts are commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TurnoutRequests {
    /// `<T id 0|1>`: by the linear address of the accessory decoder, for which the session makes a definition of its own, so that the board
    /// confirms every command. A board that knows no such definitions is written to as with [`Accessory`](Self::Accessory).
    #[default]
    Confirmed,
    /// `<a address 0|1>`: by the linear address of the accessory decoder. The board needs no definition and answers nothing, so
    /// the program cannot see whether it heard.
    Accessory,
    /// `<T id 0|1>`: by its number among the turnouts that are defined on the board, which answers when the state changes.
    Defined,
}

impl TurnoutRequests {
    /// The numbers that turnouts have on the board: linear addresses of accessory decoders (NMRA S-9.2.1, 2044 less those that
    /// are reserved) or any number of a definition.
    pub(super) const fn numbers(self) -> RangeInclusive<u16> {
        match self {
            Self::Confirmed | Self::Accessory => 1..=2044,
            Self::Defined => 1..=32_767,
        }
    }
}

/// Settings of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// Whether opening the line resets the board, as it does on the serial port of an Arduino. Its banner is awaited then
    /// before anything is written.
    pub resets_on_open: bool,
    /// How turnouts are commanded.
    pub turnouts: TurnoutRequests,
    /// The board's number of the layout's sensor 0.
    pub first_sensor: u16,
}
