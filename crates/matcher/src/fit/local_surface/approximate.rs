//! Powers and logarithms that need few digits.

use fearless_simd::{Bytes, Simd, SimdBase, SimdFloat, SimdInt, f32x16, i32x16};

/// 2 to the power of a number from -80 to 80, to 1 part in 10,000; smaller ones count as -80.
#[inline(always)]
pub(super) fn power_of_two<S: Simd>(simd: S, exponent: f32x16<S>) -> f32x16<S> {
    let exponent = exponent.max(f32x16::splat(simd, -80.0));
    let whole = exponent.floor();
    let rest = exponent - whole;
    // The cubic that deviates least from 2^x between 0 and 1.
    let cubic = rest.mul_add(f32x16::splat(simd, 0.078_024_5), f32x16::splat(simd, 0.226_067));
    let fraction =
        rest.mul_add(rest.mul_add(cubic, f32x16::splat(simd, 0.695_833_5)), f32x16::splat(simd, 0.999_925_2));
    let scale: f32x16<S> = ((whole + 127.0).to_int::<i32x16<S>>() << 23).bitcast();
    fraction * scale
}

/// The logarithm to the base 2 of a positive number, to 0.05: its mantissa is taken for linear.
#[inline(always)]
pub(super) fn rough_logarithm<S: Simd>(simd: S, value: f32x16<S>) -> f32x16<S> {
    let bits: i32x16<S> = value.bitcast();
    let number: f32x16<S> = bits.to_float();
    number.mul_add(f32x16::splat(simd, 1.0 / 8_388_608.0), f32x16::splat(simd, 0.043 - 127.0))
}
