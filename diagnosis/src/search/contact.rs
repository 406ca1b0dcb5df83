//! When something outside pushed: stretches of time in which the torque leaves what any law of the robot gives.

use crate::numbers::decide::CLEAR;
use crate::numbers::quantile::quantile;
use crate::record::band::Band;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use gapscope_effects::Pushes;

/// Part of all rows that is calm: pushes may take up the rest.
const CALM: f64 = 0.25;
/// The size of a standard normal number below which that part of all lies.
const QUARTER: f64 = 0.3186;
/// Stretches closer than this are one, and shorter ones none, s.
const SHORTEST: f64 = 0.12;
/// A push begins and ends where the rest crosses this part of its height in the stretch: the filter has spread it evenly.
const EDGE: f64 = 0.5;

/// What is left of the torque at the rows of the band, and its noise: `[joint][row]`, N m or N.
pub struct Left {
    /// What is left.
    pub rest: Rows,
    /// Its noise.
    pub noise: Rows,
}

impl Left {
    /// By what friction `holds` of each joint, N m or N, and the part of each row in which the joint is `still`: there,
    /// friction is anything up to that.
    pub fn new(rest: Rows, still: &Rows, holds: &[f64]) -> Left {
        let sliding: Rows = rest
            .iter()
            .zip(still)
            .map(|(rest, still)| rest.iter().zip(still).filter(|(_, still)| **still == 0.0).map(|(r, _)| *r).collect())
            .collect();
        let noise = (rest.iter().zip(&sliding).zip(still).zip(holds))
            .map(|(((rest, sliding), still), holds)| {
                let own = spread(if sliding.is_empty() { rest } else { sliding });
                still.iter().map(|still| own.hypot(holds * still)).collect()
            })
            .collect();
        Left { rest, noise }
    }

    /// Joints that tell anything at a row.
    fn told(&self, row: usize) -> impl Iterator<Item = usize> {
        (0..self.rest.len()).filter(move |&j| self.noise[j][row] > 0.0)
    }
}

/// The noise of what is left at every row, one for each joint.
pub fn noise(rest: &Rows) -> Rows {
    rest.iter().map(|row| vec![spread(row); row.len()]).collect()
}

/// Noise of a joint: from the calm rows, as pushes may take up many.
fn spread(row: &[f64]) -> f64 {
    quantile(&row.iter().map(|r| r.abs()).collect::<Vec<_>>(), CALM) / QUARTER
}

/// What pushes stand out of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ground {
    /// Noise.
    Noise,
    /// The calm rows, where these leave less than noise: a fit that pushes have bent leaves some of them in all rows.
    CalmRows,
}

/// The stretches of every episode, s since its start, in which what is left stands out of some ground.
pub fn stretches(signals: &[Signals], band: &Band, left: &Left, ground: Ground, pushes: &Pushes) -> Vec<Vec<[f64; 2]>> {
    let height: Vec<f64> = (0..band.rows.len())
        .map(|i| {
            let square: f64 = left.told(i).map(|j| (left.rest[j][i] / left.noise[j][i]).powi(2)).sum();
            (square / left.told(i).count().max(1) as f64).sqrt()
        })
        .collect();
    let calm = match ground {
        Ground::Noise => 1.0,
        Ground::CalmRows => quantile(&height, CALM).min(1.0),
    };
    let stands_out = CLEAR.get() * calm;
    let outside = height.iter().filter(|h| **h > stands_out).count();
    if outside as f64 > pushes.longest * height.len() as f64 {
        return vec![Vec::new(); signals.len()];
    }
    above(signals, band, &height, stands_out, |inside| {
        let mut sorted = inside.to_vec();
        sorted.sort_by(f64::total_cmp);
        EDGE * sorted[sorted.len() / 2]
    })
}

/// The stretches in which a force is there that would give some torque at each row if it were there `always`, by what is left
/// of the torque without it: a matched filter over the joints, 1 where the force is there and 0 where it is not.
pub fn of_one_force(
    signals: &[Signals],
    band: &Band,
    left: &Left,
    always: &Rows,
    pushes: &Pushes,
) -> Vec<Vec<[f64; 2]>> {
    let part: Vec<f64> = (0..band.rows.len())
        .map(|i| {
            let sum = |of: &dyn Fn(usize) -> f64| left.told(i).map(|j| of(j) / left.noise[j][i].powi(2)).sum::<f64>();
            let known = sum(&|j| always[j][i] * always[j][i]);
            let clear = known > pushes.unclear.powi(-2);
            if clear { sum(&|j| always[j][i] * left.rest[j][i]) / known } else { 0.0 }
        })
        .collect();
    above(signals, band, &part, EDGE, |_| EDGE)
}

/// Stretches of every episode in which a height is above some level, their ends where it crosses the one of its edges.
fn above(
    signals: &[Signals],
    band: &Band,
    height: &[f64],
    stands_out: f64,
    edge: impl Fn(&[f64]) -> f64,
) -> Vec<Vec<[f64; 2]>> {
    signals
        .iter()
        .zip(&band.of_episode)
        .map(|(s, rows)| {
            let time = |i: usize| s.first as f64 * s.raw.dt + band.rows[i].center as f64 * s.dt;
            let mut found: Vec<[usize; 2]> = Vec::new();
            for i in rows.clone().filter(|&i| height[i] > stands_out) {
                match found.last_mut() {
                    Some(last) if time(i) - time(last[1]) < SHORTEST => last[1] = i,
                    _ => found.push([i, i]),
                }
            }
            found
                .into_iter()
                .filter_map(|[first, last]| {
                    let level = edge(&height[first..=last]);
                    let cross = |outer: usize, inner: usize| {
                        let (a, b) = (height[outer], height[inner]);
                        let part = if b > a { ((level - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
                        time(outer) + part * (time(inner) - time(outer))
                    };
                    let begin = (first..=last).find(|&i| height[i] >= level).unwrap_or(first);
                    let end = (first..=last).rev().find(|&i| height[i] >= level).unwrap_or(last);
                    let from = if begin > rows.start { cross(begin - 1, begin) } else { 0.0 };
                    let to = if end + 1 < rows.end { cross(end + 1, end) } else { time(end) };
                    (to - from > SHORTEST).then_some([from, to])
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::support::{fitted, torque};
    use gapscope_effects::Kind;

    const PUSHES: Pushes = Pushes { longest: 0.6, unclear: 0.25 };

    /// Pushes of a fifth of the time bend a fit, and all rows leave some of them: there they stand out of the calm rows alone.
    #[test]
    fn pushes_that_bent_a_fit_stand_out_of_its_calm_rows() {
        let (signals, band, ..) = fitted(Kind::ViscousFriction, torque(|_| 0.0));
        let rows = band.rows.len();
        let pushes = |i: usize| i % 50 >= 40;
        let left = |height: f64| Left {
            rest: vec![(0..rows).map(|i| if pushes(i) { height } else { 0.5 }).collect(); 2],
            noise: vec![vec![1.0; rows]; 2],
        };
        let found = |height: f64, ground| {
            stretches(&signals, &band, &left(height), ground, &PUSHES).iter().map(Vec::len).sum::<usize>()
        };
        assert_eq!(found(3.0, Ground::Noise), 0);
        assert!(found(3.0, Ground::CalmRows) > 3, "{}", found(3.0, Ground::CalmRows));
        assert_eq!(found(2.0, Ground::CalmRows), 0, "no more than four times the calm rows");
    }

    /// The push is as large as the noise of a joint; friction at rest could be anything.
    #[test]
    fn one_force_is_found_by_all_joints_together_and_not_where_friction_holds() {
        let (signals, band, ..) = fitted(Kind::ViscousFriction, torque(|_| 0.0));
        let time = |i: usize| {
            let (row, s) = (&band.rows[i], &signals[band.rows[i].episode]);
            (row.episode, s.first as f64 * s.raw.dt + row.center as f64 * s.dt)
        };
        let rows = band.rows.len();
        let pushes = |i: usize| matches!(time(i), (1, t) if (2.0..3.0).contains(&t));
        let always: Rows = [0.9, -0.7].iter().map(|x| vec![*x; rows]).collect();
        let wave = |i: usize| 0.1 * (7.0 * i as f64).sin();
        let rest: Rows = (0..2)
            .map(|j| (0..rows).map(|i| if pushes(i) { always[j][i] } else { 0.0 } + wave(i + j)).collect())
            .collect();
        let moving = vec![vec![0.0; rows]; 2];
        let found = of_one_force(&signals, &band, &Left::new(rest.clone(), &moving, &[0.0; 2]), &always, &PUSHES);
        let [[from, to]] = found[1].as_slice() else { panic!("{found:?}") };
        assert!((from - 2.0).abs() < 0.04 && (to - 3.0).abs() < 0.04, "{found:?}");
        assert!(found[0].is_empty() && found[2].is_empty(), "{found:?}");
        // At rest, friction of ten times the force would hold it.
        let still = vec![vec![1.0; rows]; 2];
        let held = of_one_force(&signals, &band, &Left::new(rest, &still, &[9.0, 7.0]), &always, &PUSHES);
        assert!(held.iter().all(Vec::is_empty), "{held:?}");
    }
}
