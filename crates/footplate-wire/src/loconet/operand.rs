//! Operands: the seven bits that a byte after the opcode has.

/// Operands have seven bits.
pub(super) const OPERAND: u8 = 0x7F;

/// The upper and the lower seven bits of an address.
pub(super) fn address_bytes(address: u16) -> (u8, u8) {
    let part = |bits: u16| u8::try_from(bits & u16::from(OPERAND)).unwrap_or(OPERAND);
    (part(address >> 7), part(address))
}
