//! What a law that filters gains by chance.
//!
//! A rotor that flies in a gap, or winds up a spring, takes noise of the effort for its motion. So it leaves less than a rigid
//! drive does, also where there is no gap. How much less is told by logs without a gap: what a rigid drive predicts, with what it
//! leaves shuffled in time. That has the spectrum of the noise, and nothing in it that the motion made (surrogate data; Theiler
//! et al., Physica D 58, 1992).

use crate::record::logs::Record;
use crate::record::signals::Signals;
use crate::search::chosen::{Chosen, Rest};
use gapscope_effects::EffectError;
use rayon::prelude::*;

/// Ways in which what an account leaves may have come as well. Each begins elsewhere: turned over, or played backwards along a
/// motion to and fro, what the motion made of it would stay beside the motion. By no such part has a motion of a few periods come
/// round again.
const SHUFFLES: [Shuffle; 5] = [
    Shuffle { backwards: false, sign: 1.0, begins: 0.44 },
    Shuffle { backwards: true, sign: 1.0, begins: 0.37 },
    Shuffle { backwards: false, sign: -1.0, begins: 0.27 },
    Shuffle { backwards: true, sign: -1.0, begins: 0.19 },
    Shuffle { backwards: false, sign: 1.0, begins: 0.58 },
];

/// A signal as it may have come as well, of the same spectrum.
struct Shuffle {
    /// Whether time runs backwards.
    backwards: bool,
    /// 1, or −1 where it is turned over.
    sign: f64,
    /// Part of its length at which it begins; what comes before follows at its end.
    begins: f64,
}

impl Shuffle {
    /// Sample `k` of the shuffled signal.
    fn at(&self, x: &[f64], k: usize) -> f64 {
        let n = x.len();
        let k = if self.backwards { n - 1 - k } else { k };
        self.sign * x[(k + (self.begins * n as f64) as usize) % n]
    }
}

impl Record<'_> {
    /// By how many nats an account is likelier, at the most, than one without its law in logs in which that one is true; nothing
    /// where it never is. What was likelier before any log is left out.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn gained_by_chance(&self, with: &Chosen, without: &Chosen) -> Result<f64, EffectError> {
        let rest = self.rest(without)?;
        let gained = |shuffle: &Shuffle| {
            let logs = self.shuffled(&rest, shuffle);
            let again = |chosen: &Chosen| {
                let (exact, fit) =
                    logs.data(&chosen.noise).exact(&chosen.all, &chosen.choice.set, chosen.turned.as_ref())?;
                Ok::<_, EffectError>(chosen.with(chosen.choice.clone(), exact, fit))
            };
            let (with, without) = (again(with)?, again(without)?);
            Ok(with.odds_against(&without, &logs)? - with.prior() + without.prior())
        };
        let gained: Vec<f64> = SHUFFLES.par_iter().map(gained).collect::<Result<_, EffectError>>()?;
        Ok(gained.into_iter().fold(0.0, f64::max))
    }

    /// The logs with what an account leaves of them shuffled.
    fn shuffled(&self, rest: &Rest, shuffle: &Shuffle) -> Record<'_> {
        let shuffled = |signals: &[Signals]| -> Vec<Signals> {
            let of = |(s, rest): (&Signals, &Vec<Vec<f64>>)| {
                let mut s = s.clone();
                for (tau, rest) in s.tau.iter_mut().zip(rest) {
                    tau.iter_mut().enumerate().for_each(|(k, tau)| *tau += shuffle.at(rest, k) - rest[k]);
                }
                s
            };
            signals.iter().zip(rest).map(of).collect()
        };
        Record {
            model: self.model,
            signals: shuffled(&self.signals),
            noisier: shuffled(&self.noisier),
            band: self.band.clone(),
            still: self.still.clone(),
            moving: self.moving.clone(),
            known: self.known.of_other_efforts(),
            contacts: self.contacts.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::chosen::Turned;
    use gapscope_datasets::{Episode, Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{Armature, Backlash, Effect, EncoderSide, Kind};

    #[test]
    fn a_shuffle_keeps_all_samples_of_a_signal_but_for_their_sign() {
        let x: Vec<f64> = (1..=10).map(f64::from).collect();
        for shuffle in &SHUFFLES {
            let shuffled: Vec<f64> = (0..x.len()).map(|k| shuffle.at(&x, k)).collect();
            assert_ne!(shuffled, x);
            let mut sorted: Vec<f64> = shuffled.iter().map(|x| x.abs()).collect();
            sorted.sort_by(f64::total_cmp);
            assert_eq!(sorted, x);
        }
    }

    /// Noise of an effort that is remembered for 40 ms.
    fn noisy(mut log: Episode) -> Episode {
        for (j, effort) in log.effort.iter_mut().enumerate() {
            let (mut noise, mut state) = (0.0, 17 + j as u64);
            for effort in effort.iter_mut() {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                noise += 0.1 * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5 - noise);
                *effort += noise;
            }
        }
        log
    }

    /// Turned over, or played backwards along the way back, what a spring makes of a motion would still go with the motion, and a
    /// spring gain by it.
    #[test]
    fn no_shuffle_goes_with_a_motion_there_and_back() {
        let bump = |k: f64| -> f64 {
            [(40.0, 1.0), (95.0, -0.7), (170.0, 1.3), (260.0, 0.5), (330.0, -1.1), (410.0, 0.9)]
                .iter()
                .map(|(at, size)| size * (-((k - at) / 15.0f64).powi(2)).exp())
                .sum()
        };
        let x: Vec<f64> = (0..1000).map(|k| bump(f64::from(if k < 500 { k } else { 999 - k }))).collect();
        let size: f64 = x.iter().map(|x| x * x).sum();
        for shuffle in &SHUFFLES {
            let along: f64 = x.iter().enumerate().map(|(k, own)| own * shuffle.at(&x, k)).sum();
            assert!((along / size).abs() < 0.5, "{} of it", along / size);
        }
    }

    /// What a play found in one log gains in another, and what it gains there by chance.
    #[test]
    fn play_gains_much_where_it_is_and_no_more_than_by_chance_where_it_is_not() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let on = |value: f64| [(model.joints()[0].name.clone(), value)].into();
        let rotor = Effect::Armature(Armature { armature: on(0.5) });
        let play = Effect::Backlash(Backlash { gap: on(0.04) });
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = |effects: &[Effect]| noisy(generate(&model, effects, 1, &recipe, "log").unwrap());
        let (loose, tight) = (log(&[play, rotor.clone()]), log(&[rotor]));
        let chosen = |record: &mut Record<'_>| record.choose(&|_, _| {}).unwrap();
        let mut loose = Record::new(&model, &[loose], &mut Vec::new());
        let mut tight = Record::new(&model, &[tight], &mut Vec::new());
        let (found, rigid) = (chosen(&mut loose), chosen(&mut tight));
        let turned = found.turned.clone().expect("play is found where it is");
        assert_eq!((turned.drive.kind, turned.drive.side), (Kind::Backlash, EncoderSide::Link));
        let gain = |record: &Record<'_>, with: &Chosen, without: &Chosen| {
            let odds = with.odds_against(without, record).unwrap() - with.prior() + without.prior();
            (odds, record.gained_by_chance(with, without).unwrap())
        };
        // Where it is.
        let (exact, fit) = loose.data(&found.noise).exact(&found.all, &found.choice.set, None).unwrap();
        let stiff = Chosen { turned: None, ..found.with(found.choice.clone(), exact, fit) };
        // Three nats as any kind beyond calibration, and one of 13 gaps with 8 rotors, 2 sides of the encoder and 2 joints.
        let price = stiff.prior() - found.prior();
        assert!((price - 3.0 - (13.0 * 8.0 * 2.0 * 2.0f64).ln()).abs() < 1e-9, "{price}");
        let (gained, by_chance) = gain(&loose, &found, &stiff);
        assert!(gained > 100.0 && by_chance < 0.1 * gained, "{gained} {by_chance}");
        // Where it is not, a gap as narrow as the noise is wide.
        let rotor = rigid.all.entries.iter().position(|e| e.candidate.kind.card().rotor && e.candidate.joints == [0]);
        let mut turned = Turned { place: rotor.unwrap(), beside: Vec::new(), ..turned };
        turned.drive.shape = 0.004;
        let (exact, fit) = tight.data(&rigid.noise).exact(&rigid.all, &rigid.choice.set, Some(&turned)).unwrap();
        let with = Chosen { turned: Some(turned), ..rigid.with(rigid.choice.clone(), exact, fit) };
        let (gained, by_chance) = gain(&tight, &with, &rigid);
        assert!(gained < by_chance && by_chance > 10.0, "{gained} {by_chance}");
    }
}
