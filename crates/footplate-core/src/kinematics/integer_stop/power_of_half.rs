//! Powers of one half in integers: the exponential of a stop, for controllers without floating point.

/// Binary digits behind the point of a power, and of its exponent.
pub(super) const POWER_BITS: u32 = 62;
pub(super) const EXPONENT_BITS: u32 = 56;

/// ln 2 with [`POWER_BITS`] behind the point.
const LN_2: u64 = 3_196_577_161_300_663_915;

/// 2^(−2^−k) for k = 1 to 32, with [`POWER_BITS`] behind the point. A test squares each to get the one before.
const ROOTS_OF_HALF: [u64; 32] = [
    3_260_954_456_333_195_553,
    3_877_950_241_171_266_237,
    4_228_934_724_888_366_668,
    4_416_165_660_797_809_419,
    4_512_867_096_753_504_463,
    4_562_008_997_483_360_349,
    4_586_780_255_215_411_731,
    4_599_216_278_082_138_665,
    4_605_446_927_862_164_404,
    4_608_565_417_332_308_035,
    4_610_125_453_837_388_245,
    4_610_905_670_110_601_999,
    4_611_295_827_762_151_833,
    4_611_490_918_967_884_501,
    4_611_588_467_665_893_036,
    4_611_637_242_788_701_951,
    4_611_661_630_543_559_956,
    4_611_673_824_469_352_645,
    4_611_679_921_444_339_948,
    4_611_682_969_934_856_344,
    4_611_684_494_180_870_228,
    4_611_685_256_304_066_092,
    4_611_685_637_365_711_255,
    4_611_685_827_896_545_643,
    4_611_685_923_161_965_790,
    4_611_685_970_794_676_601,
    4_611_685_994_611_032_191,
    4_611_686_006_519_210_032,
    4_611_686_012_473_298_964,
    4_611_686_015_450_343_433,
    4_611_686_016_938_865_668,
    4_611_686_017_683_126_786,
];

/// 2^−x for x ≥ 0 with [`EXPONENT_BITS`] behind the point: a root of one half for each of the first 32 binary digits
/// that is set, and 1 − y ln 2 for the rest `y`, with an error below 2^−64.
pub(super) fn power_of_half(x: i128) -> u64 {
    let halvings = x >> EXPONENT_BITS;
    if halvings >= i128::from(POWER_BITS) {
        return 0;
    }
    let mut power = 1_u64 << POWER_BITS;
    for (digit, root) in (1..).zip(ROOTS_OF_HALF) {
        if (x >> (EXPONENT_BITS - digit)) & 1 == 1 {
            power = product(power, root);
        }
    }
    let rest = (x & ((1 << (EXPONENT_BITS - 32)) - 1)) as u64;
    power -= product(power, product(LN_2, rest << (POWER_BITS - EXPONENT_BITS)));
    power >> halvings
}

/// Product of two numbers of at most one, with [`POWER_BITS`] behind the point.
fn product(one: u64, other: u64) -> u64 {
    ((u128::from(one) * u128::from(other)) >> POWER_BITS) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_root_squared_is_the_one_before() {
        let mut before = 1_u64 << (POWER_BITS - 1);
        for root in ROOTS_OF_HALF {
            assert!(product(root, root).abs_diff(before) <= 2, "{root}");
            before = root;
        }
    }

    #[test]
    fn whole_exponents_halve_and_others_are_those_of_floating_point() {
        assert_eq!(power_of_half(0), 1 << POWER_BITS);
        assert_eq!(power_of_half(3 << EXPONENT_BITS), 1 << (POWER_BITS - 3));
        assert_eq!(power_of_half(i128::MAX), 0);
        for count in 1..1_000_u32 {
            let x = f64::from(count) * 0.017_3;
            let found = power_of_half(libm::ldexp(x, EXPONENT_BITS as i32) as i128) as f64;
            let wanted = libm::ldexp(libm::exp2(-x), POWER_BITS as i32);
            assert!((found / wanted - 1.0).abs() < 1e-13, "{x}: {found} for {wanted}");
        }
    }
}
