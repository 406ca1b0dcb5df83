//! Sine and cosine of many angles at once.

use crate::real::{LANES, times_plus};

/// Angles beyond this go to the standard library, so that the reduction by whole quarter turns stays exact.
const LARGEST: f64 = 1e5;

/// Adding and subtracting 1.5 · 2⁵² rounds to a whole number, which then stands in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// π/2 in three parts of 33 bits, and the minimax coefficients on [−π/4, π/4]: FreeBSD msun, `e_rem_pio2.c`,
/// `k_sin.c`, `k_cos.c`.
const QUARTER: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine of a block of angles, rad, to about one unit in the last place of one.
#[inline(always)]
pub(crate) fn sin_cos<const FUSED: bool>(angles: &[f64; LANES], sine: &mut [f64; LANES], cosine: &mut [f64; LANES]) {
    let mut small = true;
    for angle in angles {
        small &= angle.abs() <= LARGEST;
    }
    if !small {
        for i in 0..LANES {
            (sine[i], cosine[i]) = angles[i].sin_cos();
        }
        return;
    }
    for i in 0..LANES {
        let x = angles[i];
        let shifted = times_plus::<FUSED>(x, std::f64::consts::FRAC_2_PI, ROUND);
        let quarter = shifted.to_bits();
        let k = shifted - ROUND;
        let mut r = times_plus::<FUSED>(-k, QUARTER[0], x);
        r = times_plus::<FUSED>(-k, QUARTER[1], r);
        r = times_plus::<FUSED>(-k, QUARTER[2], r);
        let z = r * r;
        let mut p = SINE[5];
        p = times_plus::<FUSED>(p, z, SINE[4]);
        p = times_plus::<FUSED>(p, z, SINE[3]);
        p = times_plus::<FUSED>(p, z, SINE[2]);
        p = times_plus::<FUSED>(p, z, SINE[1]);
        p = times_plus::<FUSED>(p, z, SINE[0]);
        let s = times_plus::<FUSED>(r * z, p, r);
        let mut p = COSINE[5];
        p = times_plus::<FUSED>(p, z, COSINE[4]);
        p = times_plus::<FUSED>(p, z, COSINE[3]);
        p = times_plus::<FUSED>(p, z, COSINE[2]);
        p = times_plus::<FUSED>(p, z, COSINE[1]);
        p = times_plus::<FUSED>(p, z, COSINE[0]);
        let half = 0.5 * z;
        let head = 1.0 - half;
        let c = head + times_plus::<FUSED>(z * z, p, (1.0 - head) - half);
        // Quarter turn k: sin goes s, c, −s, −c and cos goes c, −s, −c, s.
        let odd = quarter & 1 == 1;
        let sine_sign = (quarter & 2) << 62;
        let cosine_sign = (quarter.wrapping_add(1) & 2) << 62;
        sine[i] = f64::from_bits(if odd { c } else { s }.to_bits() ^ sine_sign);
        cosine[i] = f64::from_bits(if odd { s } else { c }.to_bits() ^ cosine_sign);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        let mut worst = 0.0_f64;
        let mut at = -40.0;
        while at < 40.0 {
            let angles = [at, at * 1e-3, at * 1e-9, at * 2e3, at + 1e-7, -at, 0.5 * at, at * std::f64::consts::PI];
            let (mut s, mut c) = ([0.0; LANES], [0.0; LANES]);
            let (mut sf, mut cf) = ([0.0; LANES], [0.0; LANES]);
            sin_cos::<false>(&angles, &mut s, &mut c);
            sin_cos::<true>(&angles, &mut sf, &mut cf);
            for i in 0..LANES {
                let (sine, cosine) = angles[i].sin_cos();
                for (a, b) in [(s[i], sine), (c[i], cosine), (sf[i], sine), (cf[i], cosine)] {
                    worst = worst.max((a - b).abs());
                }
            }
            at += 0.000_7;
        }
        assert!(worst < 2.3e-16, "{worst:e}");
    }

    #[test]
    fn large_and_missing_angles_go_to_the_standard_library() {
        let angles = [1e9, f64::NAN, f64::INFINITY, 1.0, -3e7, 2.0, 0.0, 1e300];
        let (mut s, mut c) = ([0.0; LANES], [0.0; LANES]);
        sin_cos::<false>(&angles, &mut s, &mut c);
        for i in 0..LANES {
            assert_eq!(s[i].to_bits() << 1, angles[i].sin().to_bits() << 1);
            assert_eq!(c[i].to_bits() << 1, angles[i].cos().to_bits() << 1);
        }
    }
}
