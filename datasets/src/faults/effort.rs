//! What is wrong with the effort by itself: not recorded, noise, without its sign, cut off, in another unit, late.

use super::sample::Sample;
use super::weigh::{Freedom, Weighed, spread, weigh, weigh_either};
use crate::check::{Fit, Logs, fit};
use crate::robust::rms;
use gapscope_dynamics::Model;

/// A gain between these is an effect, not a fault.
pub(crate) const GAINS: (f64, f64) = (0.67, 1.5);
/// A gain between these is as logged at first sight, and one that is negative besides has lost its sign alone.
pub(crate) const PLAIN: (f64, f64) = (0.6, 1.7);

/// Dry friction of the wrong sign explains at least this part of what the model leaves of the effort, squared.
const DRIVES: f64 = 0.5;

/// A joint bears no weight where that is less than this part of its torque, squared.
const WEIGHTLESS: f64 = 0.05;

/// What a scale of the effort costs beside an account of the motion, in nats: of mirror images, the one without.
const SCALE_COST: f64 = 8.0;

/// A unit that no other is near is that unit within this, as a logarithm.
const ALONE: f64 = 0.18;

/// A scale that some joints ask for may be that of all where it is this many times too large or too small.
const FAR: f64 = 4.0;

/// A rotor may take up to so many times the torque that the description does.
const ROTOR: f64 = 6.0;

/// Noise is loud at this many times that of the other joints.
const LOUD: f64 = 10.0;

/// An effort without its sign turns at zero, this part of its size, again and again: it comes from this part so many times. One
/// that keeps its sign because of a weight turns at zero by chance alone.
const ZERO: f64 = 0.02;
const UP: f64 = 0.2;
const TURNS: usize = 6;
/// Beside a joint of which that is clear in the same log, so many are enough.
const FEW: usize = 3;

/// Why the effort of a joint cannot be used.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Useless {
    /// It never changes; its value.
    Constant(f64),
    /// It changes from sample to sample and follows nothing.
    Noise,
}

/// The joints of one log whose effort cannot be used, with why. `torque` is what the model takes for the motion.
///
/// Of a joint that hardly bears anything, noise may be all that there is to log: it counts beside a joint that bears more.
pub(crate) fn useless_joints(logs: &Logs, e: usize, torque: &[Vec<f64>]) -> Vec<(usize, Useless)> {
    let noise: Vec<Option<Noise>> = (0..torque.len()).map(|j| noise(logs, e, j, spread(&torque[j]))).collect();
    let any = noise.iter().flatten().any(|noise| *noise == Noise::Shows);
    let of = |(j, noise): (usize, &Option<Noise>)| match noise {
        Some(Noise::Never(value)) => Some((j, Useless::Constant(*value))),
        Some(Noise::Shows | Noise::MayBe) if any => Some((j, Useless::Noise)),
        _ => None,
    };
    noise.iter().enumerate().filter_map(of).collect()
}

/// What an effort looks like from sample to sample, where it looks like no torque.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Noise {
    /// It never changes; its value.
    Never(f64),
    /// It is white where there is a torque to log.
    Shows,
    /// It is white.
    MayBe,
}

/// Whether the effort of a joint in one log is noise, where it should spread by `taken`, (N m)² or N².
pub(crate) fn follows_nothing(logs: &Logs, e: usize, j: usize, taken: f64) -> bool {
    noise(logs, e, j, taken) == Some(Noise::Shows)
}

fn noise(logs: &Logs, e: usize, j: usize, taken: f64) -> Option<Noise> {
    let (episode, traits) = (logs.episodes[e], &logs.traits[e][j]);
    let effort = &episode.effort[j];
    if !traits.moves() || episode.effort_unknown.contains(&j) {
        return None;
    }
    let first = *effort.first()?;
    if effort.iter().all(|x| *x == first) {
        return Some(Noise::Never(first));
    }
    // White from sample to sample, and nothing is left of it in the mean.
    let mean = effort.iter().sum::<f64>() / effort.len() as f64;
    let variance = effort.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / effort.len() as f64;
    let with_next =
        effort.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / effort.len() as f64;
    let block = 25.min(effort.len() / 10).max(1);
    let means: Vec<f64> = effort.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64 - mean).collect();
    if with_next.abs() > 0.15 * variance || rms(&means).powi(2) > 2.0 * variance / block as f64 || means.len() < 9 {
        return None;
    }
    let limit = logs.model.joints()[j].limits.effort.filter(|limit| *limit > 0.0).unwrap_or(f64::INFINITY);
    // Torque that the noise should not hide, or noise that no drive has.
    let should_show = variance > taken && (taken > variance / block as f64 || variance.sqrt() > 0.2 * limit);
    let shows = should_show || is_loud(logs, e, j, variance.sqrt());
    let absent = rms(&means).powi(2) < 0.3 * taken + 1.5 * variance / block as f64;
    Some(if shows && absent { Noise::Shows } else { Noise::MayBe })
}

/// Whether noise of this size, N m or N, is far beyond that of the other joints, each held against the limit of its drive: the
/// drives of one robot are measured alike.
fn is_loud(logs: &Logs, e: usize, j: usize, size: f64) -> bool {
    let limit = |i: usize| logs.model.joints()[i].limits.effort.filter(|limit| *limit > 0.0);
    let of = |i: usize| Some(from_sample_to_sample(&logs.episodes[e].effort[i]) / limit(i)?);
    let mut others: Vec<f64> = (0..logs.model.dof()).filter(|i| *i != j).filter_map(of).filter(|x| *x > 0.0).collect();
    let Some((middle, limit)) = crate::robust::median(&mut others).zip(limit(j)) else { return false };
    size > LOUD * middle * limit
}

/// Standard deviation of what a signal does from sample to sample beside going on as it went: of its second differences over √6.
fn from_sample_to_sample(x: &[f64]) -> f64 {
    let bends: Vec<f64> = x.windows(3).map(|three| three[0] - 2.0 * three[1] + three[2]).collect();
    rms(&bends) / 6f64.sqrt()
}

/// Whether a joint whose effort is zero throughout is driven by nothing: then what the motion takes by the model is far
/// less than its parts.
pub(crate) fn is_passive(model: &Model, sample: &Sample, j: usize) -> bool {
    let (torque, weight) = (sample.torque(model), sample.weight(model));
    let inertia: Vec<f64> = torque[j].iter().zip(&weight[j]).map(|(all, weight)| all - weight).collect();
    rms(&torque[j]) < 0.25 * rms(&weight[j]).max(rms(&inertia))
}

/// Which of some joints have efforts that lost their sign, each with the logs: never negative, down to zero again and again, and
/// like the model's only in size. Beside one of which that is clear in a log, the first two are enough; and of a joint that
/// lost it in one log, never negative in another.
pub(crate) fn absolute_joints(
    logs: &Logs,
    sample: &Sample,
    torque: &[Vec<f64>],
    joints: &[usize],
) -> Vec<(usize, Vec<usize>)> {
    let all = || 0..logs.episodes.len();
    let effort = |e: usize, j: usize| logs.episodes[e].effort[j].as_slice();
    // Where no log has the other sign, turns of all logs count.
    let together = |j: usize| {
        let one_sided = all().all(|e| is_one_sided(effort(e, j)));
        if one_sided { all().map(|e| turns_at_zero(effort(e, j))).sum() } else { 0 }
    };
    let together: Vec<usize> = (0..logs.model.dof()).map(together).collect();
    let turns = |e: usize, j: usize| {
        let own = if is_folded(effort(e, j)) { turns_at_zero(effort(e, j)) } else { 0 };
        own.max(together[j])
    };
    let by_model = |j: usize| all().all(|e| is_folded(effort(e, j))) && is_absolute(sample, torque, j);
    let clear: Vec<bool> = joints.iter().map(|&j| by_model(j)).collect();
    let told = |e: usize| clear.contains(&true) || joints.iter().any(|&j| turns(e, j) >= TURNS);
    let in_log: Vec<bool> = all().map(told).collect();
    let of = |(&j, clear): (&usize, &bool)| {
        let lost = |e: usize| *clear || (in_log[e] && turns(e, j) >= FEW);
        let found = all().any(lost).then(|| all().filter(|&e| lost(e) || is_one_sided(effort(e, j))).collect());
        found.map(|files| (j, files))
    };
    joints.iter().zip(&clear).filter_map(of).collect()
}

/// Whether an effort is never negative, or never positive.
pub(crate) fn is_one_sided(effort: &[f64]) -> bool {
    let (low, high) = effort.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let size = high.abs().max(low.abs());
    size > 0.0 && (low >= -1e-3 * size || high <= 1e-3 * size)
}

/// Whether an effort is never negative, or never positive, and down to zero again and again.
fn is_folded(effort: &[f64]) -> bool {
    let size = effort.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let near_zero = effort.iter().filter(|x| x.abs() < 0.04 * size).count() as f64 > 0.005 * effort.len() as f64;
    is_one_sided(effort) && near_zero
}

/// How often an effort comes down to zero and goes up again.
fn turns_at_zero(effort: &[f64]) -> usize {
    let size = effort.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (mut up, mut turns) = (false, 0);
    for x in effort.iter().map(|x| x.abs()) {
        if up && x < ZERO * size {
            (up, turns) = (false, turns + 1);
        }
        up |= x > UP * size;
    }
    turns
}

fn is_absolute(sample: &Sample, torque: &[Vec<f64>], j: usize) -> bool {
    let Some(plain) = explained(sample, torque, j) else { return false };
    // The torque with its friction, made from what has a sign, then without.
    let friction = |k: usize| sample.v[j][k].signum();
    let best = (0..12)
        .map(|i| 0.1 * f64::from(i) * rms(&torque[j]))
        .filter_map(|dry| {
            let folded: Vec<f64> = (0..sample.len()).map(|k| (torque[j][k] + dry * friction(k)).abs()).collect();
            fit(&sample.effort[j], &folded, &vec![0.0; sample.len()], None).map(|fit| fit.unexplained)
        })
        .fold(1.0, f64::min);
    best < 0.5 * plain.unexplained && best < 0.4
}

/// How torque explains a joint's effort, beside friction and a bias.
pub(crate) fn explained(sample: &Sample, torque: &[Vec<f64>], j: usize) -> Option<Fit> {
    fit(&sample.effort[j], &torque[j], &sample.v[j], None)
}

/// Whether most of what a joint's effort holds beside the model's torque goes with the motion, as friction would that gave
/// energy instead of taking it: then the effort, or the position, is counted the other way round.
pub(crate) fn friction_drives(sample: &Sample, torque: &[Vec<f64>], j: usize) -> bool {
    let slow = 0.1 * rms(&sample.v[j]);
    let mut left: Vec<f64> = sample.effort[j].iter().zip(&torque[j]).map(|(effort, torque)| effort - torque).collect();
    let mut dry: Vec<f64> = sample.v[j].iter().map(|v| (v / slow.max(1e-12)).tanh()).collect();
    for row in [&mut left, &mut dry] {
        let mean = row.iter().sum::<f64>() / row.len().max(1) as f64;
        row.iter_mut().for_each(|x| *x -= mean);
    }
    let with = left.iter().zip(&dry).map(|(x, y)| x * y).sum::<f64>();
    let [left, dry] = [left, dry].map(|row| row.iter().map(|x| x * x).sum::<f64>());
    with < 0.0 && with * with > DRIVES * left * dry
}

/// Whether what the model takes for a joint is inertia, and next to no weight.
pub(crate) fn is_inertial(model: &Model, sample: &Sample, torque: &[Vec<f64>], j: usize) -> bool {
    spread(&sample.weight(model)[j]) < WEIGHTLESS * spread(&torque[j])
}

/// What scales of the effort cost: one that all share as much as one alone.
pub(crate) fn scales_cost(scales: &[f64], active: &[bool]) -> f64 {
    let mut distinct: Vec<f64> =
        scales.iter().zip(active).filter(|(s, active)| **active && **s != 1.0).map(|(s, _)| *s).collect();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    SCALE_COST * distinct.len() as f64
}

/// What each joint's effort was multiplied by, at first sight: 1 where nothing speaks against it.
pub(crate) fn first_scales(model: &Model, sample: &Sample, active: &[bool]) -> Vec<f64> {
    let torque = sample.torque(model);
    let scale = |j: usize| {
        let found = explained(sample, &torque, j).filter(|_| active[j]);
        let told = found
            .filter(|fit| fit.correlation.abs() > 0.5 && fit.weight * fit.gain.abs() > 0.05)
            .map(|fit| if (PLAIN.0..PLAIN.1).contains(&fit.gain) { 1.0 } else { fit.gain });
        // A rotor that the description lacks makes a gain of some size: the sign is what friction tells.
        let size_is_told = told.is_some_and(|gain: f64| gain > 0.0 || !(ROTOR.recip()..ROTOR).contains(&-gain));
        if !size_is_told && active[j] && friction_drives(sample, &torque, j) { Some(-1.0) } else { told }
    };
    let told: Vec<Option<f64>> = (0..model.dof()).map(scale).collect();
    if let Some(one) = common(&told, active) {
        return one;
    }
    let each: Vec<f64> = told.iter().map(|scale| scale.unwrap_or(1.0)).collect();
    let mut accounts = vec![each];
    // Of a robot whose efforts are all turned round, some joints alone seem to need nothing; and where friction or rotors make
    // most of some efforts, a unit that all have looks like another one there.
    if accounts[0].iter().any(|scale| *scale < 0.0) {
        accounts.push(active.iter().map(|active| if *active { -1.0 } else { 1.0 }).collect());
    }
    let shared = middle(&told).map(|scale| {
        let shared = active.iter().map(|on| if *on { scale } else { 1.0 }).collect();
        fine_scales(model, sample, shared, active).0
    });
    accounts.extend(shared.filter(|scales| scales.iter().all(|scale| *scale == 1.0 || is_far(*scale))));
    if let [_] = accounts.as_slice() {
        return accounts.remove(0);
    }
    let score = |scales: &Vec<f64>| weigh_either(model, sample, scales, active).score - scales_cost(scales, active);
    let scored = accounts.into_iter().map(|scales| (score(&scales), scales));
    scored.max_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(|| vec![1.0; active.len()], |(_, scales)| scales)
}

/// The scale in the middle of those that joints ask for, where they agree about the sign, and it is far from one.
fn middle(told: &[Option<f64>]) -> Option<f64> {
    let telling = told.iter().flatten().count();
    let asked: Vec<f64> = told.iter().flatten().copied().filter(|scale| *scale != 1.0).collect();
    if asked.len() < 2 || 2 * asked.len() <= telling || asked.iter().any(|s| *s < 0.0) != asked.iter().all(|s| *s < 0.0)
    {
        return None;
    }
    let mut logs: Vec<f64> = asked.iter().map(|s| s.abs().ln()).collect();
    let scale = asked[0].signum() * crate::robust::median(&mut logs)?.exp();
    is_far(scale).then_some(scale)
}

/// Whether a scale is none that a robot could have.
pub(crate) fn is_far(scale: f64) -> bool {
    !(FAR.recip()..FAR).contains(&scale.abs())
}

/// One scale for all joints, where most of those that tell one ask for about the same. A wrist that bears little but friction
/// tells none, and follows.
fn common(told: &[Option<f64>], active: &[bool]) -> Option<Vec<f64>> {
    let telling: Vec<f64> = told.iter().flatten().copied().collect();
    let asked: Vec<f64> = telling.iter().copied().filter(|scale| *scale != 1.0).collect();
    if asked.len() < 2 || 2 * asked.len() <= telling.len() {
        return None;
    }
    let sign = asked.iter().map(|s| s.signum()).sum::<f64>().signum();
    let mut logs: Vec<f64> = asked.iter().filter(|s| **s * sign > 0.0).map(|s| s.abs().ln()).collect();
    let middle = crate::robust::median(&mut logs)?;
    let alike = logs.iter().filter(|s| (*s - middle).abs() < 0.5).count();
    let scale = sign * middle.exp();
    (5 * alike >= 4 * asked.len()).then(|| active.iter().map(|active| if *active { scale } else { 1.0 }).collect())
}

/// Brings scales other than 1 to where they fit best. Returns them with what they leave.
pub(crate) fn fine_scales(
    model: &Model,
    sample: &Sample,
    mut scales: Vec<f64>,
    active: &[bool],
) -> (Vec<f64>, Weighed) {
    let n = model.dof();
    let one = (0..n).filter(|&j| active[j]).all(|j| scales[j] == scales[(0..n).find(|&i| active[i]).unwrap_or(0)]);
    let mut weighed = weigh(model, sample, &scales, active, Freedom::ORDINARY);
    for _ in 0..4 {
        // A sign is a sign.
        let scaled: Vec<usize> = (0..n).filter(|&j| active[j] && scales[j].abs() != 1.0).collect();
        if scaled.is_empty() {
            break;
        }
        if one && n > 1 {
            // All together: each joint has its say as it is sure of it.
            let (sum, weight) = scaled.iter().fold((0.0, 0.0), |(sum, weight), &j| {
                let sure = weighed.gain_error[j].max(1e-3).powi(-2);
                (sum + sure * weighed.gain[j].max(0.2).ln(), weight + sure)
            });
            scaled.iter().for_each(|&j| scales[j] *= (sum / weight).exp());
        } else {
            scaled.iter().for_each(|&j| scales[j] *= weighed.gain[j].clamp(0.3, 3.0));
        }
        weighed = weigh(model, sample, &scales, active, Freedom::ORDINARY);
    }
    (scales, weighed)
}

/// Units of torque (force), each with its size: logged = factor × true.
pub(crate) fn effort_unit(scale: f64, error: f64, limit: Option<f64>) -> Option<(String, f64)> {
    const UNITS: [(&str, f64); 7] = [
        ("N mm or mN m", 1e3),
        ("N cm", 1e2),
        ("oz in", 141.612),
        ("kgf cm", 10.1972),
        ("lb in", 8.85075),
        ("kN m", 1e-3),
        ("kgf m", 0.101972),
    ];
    // All bodies together may be off by some per cent, which no log tells from a factor. Beside a thousand and a thousandth there
    // is no other name.
    let near = |factor: f64| {
        let alone = [1e3, 1e-3].contains(&factor);
        (scale.abs() / factor).ln().abs() < if alone { ALONE } else { (2.5 * error).clamp(0.06, 0.08) }
    };
    let mut fitting: Vec<(String, f64)> =
        UNITS.iter().filter(|(_, factor)| near(*factor)).map(|(name, factor)| ((*name).to_owned(), *factor)).collect();
    if let Some(limit) = limit.filter(|limit| *limit > 0.0 && near(100.0 / limit)) {
        fitting.push(("per cent of the URDF's limit".to_owned(), 100.0 / limit));
    }
    // Of two that fit, neither is known.
    let [one] = fitting.as_slice() else { return None };
    Some(one.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_gives_no_energy() {
        let v: Vec<f64> = (0..200).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let torque = vec![v.iter().map(|v| 0.2 * v * v).collect::<Vec<f64>>()];
        let driven = |size: f64| {
            let effort = v.iter().zip(&torque[0]).map(|(v, torque)| torque + size * v.signum() - 0.3).collect();
            let zero = || vec![vec![0.0; v.len()]];
            let sample = Sample {
                q: zero(),
                v: vec![v.clone()],
                a: zero(),
                effort: vec![effort],
                log: vec![0; v.len()],
                tents: vec![[0.0; 3]; v.len()],
                silent: None,
            };
            friction_drives(&sample, &torque, 0)
        };
        assert!(!driven(1.0) && driven(-1.0));
    }

    #[test]
    fn a_unit_that_most_joints_ask_for_is_that_of_all() {
        let told = [112.8, 107.0, 119.2, 117.3, 120.2, 154.3, -587.1].map(Some);
        let one = common(&told, &[true; 7]).unwrap();
        assert!(one.iter().all(|scale| *scale == one[0]) && (100.0..130.0).contains(&one[0]), "{one:?}");
        let halved = [112.8, 107.0, 119.2, -117.3, -120.2, -154.3].map(Some);
        assert_eq!(common(&halved, &[true; 6]), None);
    }

    #[test]
    fn what_changes_from_sample_to_sample_is_noise_and_not_motion() {
        let wave = |k: i32| (0.01 * f64::from(k)).sin();
        let noise = |k: i32| if (7.7 * f64::from(k * k)).sin() > 0.0 { 0.02 } else { -0.02 };
        let size = from_sample_to_sample(&(0..4000).map(|k| wave(k) + noise(k)).collect::<Vec<f64>>());
        assert!((size / 0.02 - 1.0).abs() < 0.1, "{size}");
    }

    #[test]
    fn an_effort_without_its_sign_turns_at_zero() {
        let wave = |k: i32| (0.05 * f64::from(k)).sin();
        let folded: Vec<f64> = (0..1000).map(|k| wave(k).abs()).collect();
        let lifted: Vec<f64> = (0..1000).map(|k| 1.05 + wave(k)).collect();
        assert!(is_folded(&folded) && turns_at_zero(&folded) >= TURNS);
        assert!(turns_at_zero(&lifted) == 0 && !is_folded(&(0..1000).map(wave).collect::<Vec<_>>()));
    }
}
