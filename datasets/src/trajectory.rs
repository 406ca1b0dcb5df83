//! A motion as a table, for a file that a robot can follow.

use crate::error::{LogError, LogErrorKind};
use std::fmt::Write;

/// The quantities of each joint in a file's columns, `position.<joint>` and so on.
const QUANTITIES: [&str; 3] = ["position", "velocity", "acceleration"];

/// Samples of a motion of all joints, joint-major `[n][T]`; between them it is the quintic that keeps position, velocity
/// and acceleration, before and behind them the robot stands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Names of the joints, in model order.
    pub joints: Vec<String>,
    /// Time, s, strictly increasing.
    pub time: Vec<f64>,
    /// Position, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Velocity, rad/s or m/s.
    pub velocity: Vec<Vec<f64>>,
    /// Acceleration, rad/s² or m/s².
    pub acceleration: Vec<Vec<f64>>,
}

impl Trajectory {
    /// From the first sample to the last, s.
    pub fn duration(&self) -> f64 {
        self.time.last().zip(self.time.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// The text of a CSV file: `time`, then `position.<joint>`, `velocity.<joint>` and `acceleration.<joint>`, SI units.
    pub fn to_csv(&self) -> String {
        let mut text = "time".to_owned();
        for quantity in QUANTITIES {
            self.joints.iter().for_each(|joint| text.extend([",", quantity, ".", joint.as_str()]));
        }
        text.push('\n');
        for (k, t) in self.time.iter().enumerate() {
            // Writing to a String cannot fail.
            let _ = write!(text, "{}", rounded(*t));
            for samples in [&self.position, &self.velocity, &self.acceleration] {
                samples.iter().for_each(|joint| _ = write!(text, ",{}", rounded(joint[k])));
            }
            text.push('\n');
        }
        text
    }

    /// Reads the text of a CSV file with the columns that [`Trajectory::to_csv`] writes, in any order; others are passed over.
    ///
    /// # Errors
    /// What is wrong with it: a column that is missing, a cell that is no number, time that does not increase, fewer than two
    /// rows. The error does not name the file.
    pub fn from_csv(text: &str, joints: &[String]) -> Result<Trajectory, LogError> {
        let mut reader = ::csv::ReaderBuilder::new().trim(::csv::Trim::All).from_reader(text.as_bytes());
        let damaged = |e: &::csv::Error| {
            let row = e.position().map_or(1, |p| p.line() as usize);
            LogError::new(LogErrorKind::RaggedRow, format!("the row cannot be read: {e}")).row(row)
        };
        let header = reader.headers().map_err(|e| damaged(&e))?.clone();
        let column = |name: String| {
            header.iter().position(|h| h == name).map(|at| (at, name.clone())).ok_or_else(|| {
                LogError::new(LogErrorKind::MissingColumn, "a trajectory needs this column")
                    .column(&name)
                    .hint("Needed are time, position.<joint>, velocity.<joint> and acceleration.<joint> of every joint")
            })
        };
        let time_column = column("time".to_owned())?;
        let of = |quantity: &str| -> Result<Vec<(usize, String)>, LogError> {
            joints.iter().map(|joint| column(format!("{quantity}.{joint}"))).collect()
        };
        let columns = [of(QUANTITIES[0])?, of(QUANTITIES[1])?, of(QUANTITIES[2])?];
        let mut time: Vec<f64> = Vec::new();
        let mut samples = [0, 1, 2].map(|_| vec![Vec::new(); joints.len()]);
        for (k, record) in reader.records().enumerate() {
            let record = record.map_err(|e| damaged(&e))?;
            let row = record.position().map_or(k + 2, |p| p.line() as usize);
            let number = |(at, name): &(usize, String)| {
                let cell = record.get(*at).unwrap_or_default();
                cell.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
                    LogError::new(LogErrorKind::NotANumber, format!("`{cell}` is not a number")).row(row).column(name)
                })
            };
            let t = number(&time_column)?;
            if time.last().is_some_and(|last| t <= *last) {
                return Err(LogError::new(
                    LogErrorKind::TimeNotIncreasing,
                    format!("time is {t} s, not after the row before"),
                )
                .row(row)
                .column("time"));
            }
            time.push(t);
            for (samples, columns) in samples.iter_mut().zip(&columns) {
                for (samples, column) in samples.iter_mut().zip(columns) {
                    samples.push(number(column)?);
                }
            }
        }
        if time.len() < 2 {
            return Err(LogError::new(LogErrorKind::Empty, "a trajectory needs two rows or more"));
        }
        let [position, velocity, acceleration] = samples;
        Ok(Trajectory { joints: joints.to_vec(), time, position, velocity, acceleration })
    }

    /// Position, velocity and acceleration `t` s after the first sample, into slices of length n. Allocates nothing.
    pub(crate) fn at(&self, t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let last = self.time.len() - 1;
        let t = t + self.time[0];
        let stands = t < self.time[0] || t > self.time[last];
        let right = self.time.partition_point(|&s| s <= t).clamp(1, last);
        let left = right - 1;
        let h = self.time[right] - self.time[left];
        let s = ((t - self.time[left]) / h).clamp(0.0, 1.0);
        for j in 0..q.len() {
            let end = |k: usize| [self.position[j][k], h * self.velocity[j][k], h * h * self.acceleration[j][k]];
            let ([q0, v0, a0], [q1, v1, a1]) = (end(left), end(right));
            // q = q₀ + v₀ s + a₀ s²/2 + c₃ s³ + c₄ s⁴ + c₅ s⁵, its rest at s = 1 being:
            let (dq, dv, da) = (q1 - q0 - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0);
            let c3 = 10.0 * dq - 4.0 * dv + 0.5 * da;
            let c4 = -15.0 * dq + 7.0 * dv - da;
            let c5 = 6.0 * dq - 3.0 * dv + 0.5 * da;
            q[j] = q0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))));
            v[j] = (v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h;
            a[j] = (a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (h * h);
            if stands {
                (v[j], a[j]) = (0.0, 0.0);
            }
        }
    }
}

/// To a billionth: far below what any encoder resolves, and short to write.
fn rounded(x: f64) -> f64 {
    // No minus in front of a zero.
    (1e9 * x).round() / 1e9 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Reference, ReferenceKind};
    use approx::assert_abs_diff_eq;
    use gapscope_dynamics::robots;

    fn drawn() -> (Vec<String>, Trajectory) {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let motion = Reference::draw(ReferenceKind::Fourier, &model, 1, 1.0, 8.0).unwrap();
        let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
        (joints.clone(), Trajectory::sample(&motion, joints, 8.0, 100.0))
    }

    #[test]
    fn starts_and_ends_at_rest_and_its_derivatives_are_its_own() {
        let (_, trajectory) = drawn();
        let reference = Reference::along(&trajectory);
        for t in [0.0, 8.0, -1.0, 9.0] {
            let (_, v, a) = reference.at(t);
            assert!(v.iter().chain(&a).all(|x| x.abs() < 1e-9), "{t} s: {v:?} {a:?}");
        }
        for t in [0.503, 1.999, 2.001, 3.337, 6.0, 7.49] {
            let h = 1e-4;
            let ((before, _, _), (_, v, a), (after, _, _)) =
                (reference.at(t - h), reference.at(t), reference.at(t + h));
            let (at, _, _) = reference.at(t);
            for j in 0..6 {
                assert_abs_diff_eq!(v[j], (after[j] - before[j]) / (2.0 * h), epsilon = 1e-5);
                assert_abs_diff_eq!(a[j], (after[j] - 2.0 * at[j] + before[j]) / (h * h), epsilon = 1e-2);
            }
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let (joints, trajectory) = drawn();
        let back = Trajectory::from_csv(&trajectory.to_csv(), &joints).unwrap();
        assert_eq!(back.time, trajectory.time);
        for (a, b) in back.acceleration.iter().flatten().zip(trajectory.acceleration.iter().flatten()) {
            assert_abs_diff_eq!(a, b, epsilon = 1e-9);
        }
        // A second time nothing is rounded any more.
        assert_eq!(Trajectory::from_csv(&back.to_csv(), &joints).unwrap(), back);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let joints = ["a".to_owned()];
        let header = "time,position.a,velocity.a,acceleration.a\n";
        let said = |text: &str| Trajectory::from_csv(text, &joints).unwrap_err().to_string();
        for (text, parts) in [
            ("", vec!["time"]),
            ("time,position.a\n0,1\n", vec!["velocity.a", "acceleration.<joint>"]),
            (&format!("{header}0,0,0,0\n"), vec!["two rows"]),
            (&format!("{header}0,0,0,0\n0,0,0,0\n"), vec!["time", "3"]),
            (&format!("{header}0,0,0,0\n1,x,0,0\n"), vec!["position.a", "`x`", "3"]),
            (&format!("{header}0,0,0,0\n1,inf,0,0\n"), vec!["`inf`"]),
            (&format!("{header}0,0,0,0\n1,0\n"), vec!["3"]),
        ] {
            let said = said(text);
            assert!(parts.iter().all(|part| said.contains(part)), "{text}: {said}");
        }
    }
}
