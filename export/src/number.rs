//! Numbers as text: the shortest decimals that read back to the same bits.

use glam::{DMat3, DVec3};

/// One number.
pub fn number(x: f64) -> String {
    // −0 would be another text for the same number.
    format!("{:?}", x + 0.0).trim_end_matches(".0").to_owned()
}

/// Several, with blanks between.
pub fn numbers(x: &[f64]) -> String {
    x.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ")
}

/// The three of a vector.
pub fn vector(x: DVec3) -> String {
    numbers(&x.to_array())
}

/// Below this cosine of the pitch, roll and yaw turn about one axis, and yaw is taken as none.
const GIMBAL: f64 = 1e-9;

/// Roll, pitch and yaw about fixed x, y, z, rad, of R = Rz(yaw) Ry(pitch) Rx(roll).
pub fn roll_pitch_yaw(r: &DMat3) -> [f64; 3] {
    let cosine = r.x_axis.x.hypot(r.x_axis.y);
    let pitch = (-r.x_axis.z).atan2(cosine);
    if cosine < GIMBAL {
        return [(-r.z_axis.y).atan2(r.y_axis.y), pitch, 0.0];
    }
    [r.y_axis.z.atan2(r.z_axis.z), pitch, r.x_axis.y.atan2(r.x_axis.x)]
}

/// The rotation of roll, pitch and yaw.
pub fn from_roll_pitch_yaw([roll, pitch, yaw]: [f64; 3]) -> DMat3 {
    DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        for x in [0.0, -0.0, 1.0, -12.0, 0.1 + 0.2, 1e-9, -3.25e-300, 1.0 / 3.0, 12345678.9] {
            let text = number(x);
            assert_eq!(text.parse::<f64>().unwrap(), x, "{text}");
        }
        assert_eq!((number(2.0), number(-0.0), number(10.0)), ("2".into(), "0".into(), "10".into()));
    }

    #[test]
    fn angles_make_the_rotation_that_they_were_read_from() {
        for roll in [-3.0, -0.4, 0.0, 1.2] {
            for pitch in [-FRAC_PI_2, -0.7, 0.0, 1.1, FRAC_PI_2] {
                for yaw in [-2.5, 0.0, 0.3] {
                    let rotation = from_roll_pitch_yaw([roll, pitch, yaw]);
                    let again = from_roll_pitch_yaw(roll_pitch_yaw(&rotation));
                    let error = (rotation - again).to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    assert!(error < 1e-9, "{roll} {pitch} {yaw}: {error}");
                }
            }
        }
    }
}
