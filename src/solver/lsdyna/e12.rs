//! The number that fills most files: twelve columns, `[ -]d.dddddE±dd`, read eight digits at a time and
//! exactly. Every other form goes to the general parser.

/// A power of ten as a factor and a divisor, one of which is 1. Both are exact for the
/// powers from −22 to 22, so that one rounding gives the nearest double (Clinger 1990,
/// "How to read floating point numbers accurately", the fast path).
#[derive(Clone, Copy)]
struct Scale {
    factor: f64,
    divisor: f64,
}

const NONE: Scale = Scale { factor: 0.0, divisor: 1.0 };
const DECIMALS: i32 = 5;
const EXACT: i32 = 22;
/// Bit of the table's index that says that the exponent is negative.
const NEGATIVE: usize = 128;

/// Scales of the exponents, by their two digits and sign.
static SCALES: [Scale; 256] = scales();

const fn scales() -> [Scale; 256] {
    let mut table = [NONE; 256];
    let mut exponent = -99i32;
    while exponent <= 99 {
        let power = exponent - DECIMALS;
        if -EXACT <= power && power <= EXACT {
            let digits = exponent.unsigned_abs() as usize;
            let index = if exponent < 0 { digits | NEGATIVE } else { digits };
            table[index] = if power < 0 {
                Scale { factor: 1.0, divisor: ten_to(-power) }
            } else {
                Scale { factor: ten_to(power), divisor: 1.0 }
            };
        }
        exponent += 1;
    }
    // "E-00" is not written, but means the same.
    table[NEGATIVE] = table[0];
    table
}

const fn ten_to(power: i32) -> f64 {
    let mut value = 1.0;
    let mut i = 0;
    while i < power {
        value *= 10.0;
        i += 1;
    }
    value
}

const ZEROS: u64 = 0x3030_3030_3030_3030;
/// Added to a byte below 10 it leaves the highest bit clear, to any other it sets it.
const ABOVE_NINE: u64 = 0x7676_7676_7676_7676;
const HIGH_BITS: u64 = 0x8080_8080_8080_8080;

/// The nearest double of a field of exactly this form whose exponent is small enough to be
/// exact; `None` for any other field, which [`super::line::real`] reads.
#[inline(always)]
pub(crate) fn parse(field: &[u8; 12]) -> Option<f64> {
    let [s, d, p, f0, f1, f2, f3, f4, e, es, e1, e2] = *field;
    let mantissa = u64::from_le_bytes([s, d, p, f0, f1, f2, f3, f4]);
    // Two zeros, the digit before the point, the five after it: eight digits.
    let digits = (mantissa & 0xffff_ffff_ff00_0000) | ((mantissa & 0xff00) << 8) | 0x3030;
    let digits = digits ^ ZEROS;
    let not_digits = (digits.wrapping_add(ABOVE_NINE) | digits) & HIGH_BITS;
    // Pairs, then all: two multiplications join eight digits.
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let even = (pairs & 0x0000_00ff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let odd = ((pairs >> 16) & 0x0000_00ff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    let number = even.wrapping_add(odd) >> 32;
    let (e1, e2) = (e1.wrapping_sub(b'0'), e2.wrapping_sub(b'0'));
    let form = (not_digits == 0)
        & (p == b'.')
        & ((s == b' ') | (s == b'-'))
        & (e == b'E')
        & ((es == b'+') | (es == b'-'))
        & (e1 < 10)
        & (e2 < 10);
    if !form {
        return None;
    }
    let index = usize::from(e1 * 10 + e2) | if es == b'-' { NEGATIVE } else { 0 };
    let Scale { factor, divisor } = SCALES[index & 0xff];
    if factor == 0.0 {
        return None;
    }
    let value = number as f64 * factor / divisor;
    let sign = u64::from(s == b'-') << 63;
    Some(f64::from_bits(value.to_bits() | sign))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::lsdyna::line::{Field, real};

    fn is_nearest(text: &str) {
        let field: &[u8; 12] = text.as_bytes().try_into().unwrap();
        let expected: f64 = text.trim_start().parse().unwrap();
        match parse(field) {
            Some(value) => assert_eq!(value.to_bits(), expected.to_bits(), "{text}"),
            None => {
                let exponent: i32 = text[9..].parse().unwrap();
                assert!(!(-17..=27).contains(&exponent), "{text}");
            }
        }
    }

    /// Every mantissa, every exponent and both signs: what the standard library reads. A mantissa below
    /// 10⁶ and a scale that is a double are multiplied or divided with one rounding, so that the
    /// two need not be tried in all pairs.
    #[test]
    fn equals_the_standard_library() {
        for number in 0..1_000_000_u32 {
            let exponent = (number % 45) as i32 - 17;
            let (whole, decimals) = (number / 100_000, number % 100_000);
            let sign = if number & 1 == 0 { ' ' } else { '-' };
            is_nearest(&format!("{sign}{whole}.{decimals:05}E{exponent:+03}"));
        }
        for exponent in -99..=99 {
            for number in (0..1_000_000_u32).step_by(9_973).chain([999_999]) {
                let (whole, decimals) = (number / 100_000, number % 100_000);
                for sign in [' ', '-'] {
                    is_nearest(&format!("{sign}{whole}.{decimals:05}E{exponent:+03}"));
                }
            }
        }
    }

    /// Any other byte at any place: no number, or the general parser's.
    #[test]
    fn a_wrong_byte_is_no_other_number() {
        for text in [b" 1.23456E+07", b"-9.99999E-17", b" 0.00000E+00"] {
            for (place, byte) in (0..12).flat_map(|place| (0..=255).map(move |byte| (place, byte)))
            {
                let mut field = *text;
                field[place] = byte;
                if let Some(value) = parse(&field) {
                    let Field::Real(expected) = real(&field) else { panic!("{field:?}") };
                    assert_eq!(value.to_bits(), expected.to_bits(), "{field:?}");
                }
            }
        }
    }

    #[test]
    fn leaves_other_forms_alone() {
        fn t(field: &str) {
            assert_eq!(parse(field.as_bytes().try_into().unwrap()), None, "{field:?}");
        }
        t(" 1.2345E+00 ");
        t("  1.2345E+00");
        t(" 1.5000-345 ");
        t("************");
        t(" 1.2345:E+00");
        t(" 1,23456E+00");
        t(" 1.23456D+00");
        t(" 1.23456E 00");
        t(" 1.23456E+0a");
        t("+1.23456E+00");
        t("\0\0\0\0\0\0\0\0\0\0\0\0");
        t(" /.23456E+00");
    }
}
