//! What a bank is to hold, and the cases that make it up.

use crate::case::CaseSpec;
use crate::draw::{Difficulty, Sort, UNKNOWN};
use crate::servo::{AGAINST, CLASH as SERVO_CLASH, FREE};
use crate::truth::Used;
use gapscope_effects::Kind;
use rand::seq::{IndexedRandom, SliceRandom};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use Kind::*;

/// Kinds of which at most one is drawn for a case: one hides in the other.
const CLASH: [&[Kind]; 7] = [
    &[ParallelSpring, TorqueBias],
    &[ActuationDelay, ActuatorLag],
    &[Armature, JointElasticity],
    &[Armature, Backlash],
    &[JointElasticity, Backlash],
    &[Payload, LinkInertiaError],
    &[CoulombFriction, StribeckFriction, PreslidingFriction, ThermalDrift],
];

/// The settings of a bank; the same settings make the same bank.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Cases with one effect of the catalogue, each kind as often as the next.
    pub cases: usize,
    /// Cases with two to four effects of the catalogue.
    pub multi: usize,
    /// Cases with one effect of the catalogue and one outside it.
    pub mixed: usize,
    /// Cases without an effect.
    pub none: usize,
    /// Cases with one effect outside the catalogue, each law as often as the next.
    pub unknown: usize,
    /// Robots, taken in turn: names, or paths of URDF files.
    pub robots: Vec<String>,
    /// Everything is drawn from it.
    pub seed: u64,
    /// How large the effects are.
    pub difficulty: Difficulty,
    /// Length of an episode, s.
    pub seconds: f64,
    /// Logs per case.
    pub episodes: usize,
    /// Sealed test episodes per case.
    pub tests: usize,
    /// Used arms: then `cases` have a further effect of the catalogue, `unknown` a law outside it, and `none` nothing further.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub used: Option<Used>,
    /// Whether the logs of two cases in three have a fault, drawn at random.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub faulty: bool,
    /// Servo arms, drawn themselves: then `cases` and `multi` have one effect of a servo arm, and two to four.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub servo: bool,
}

/// Parts of a bank of servo arms with one effect, with several, and with one outside the catalogue.
const SERVO: [f64; 3] = [0.35, 0.35, 0.15];

/// Parts of a bank of used arms that have a further effect of the catalogue, and one outside it.
const FURTHER: [f64; 2] = [0.7, 0.15];

impl Plan {
    /// Shares out a bank of used arms: seven tenths have a further effect, as many an unknown one as nothing further.
    pub fn share_out(&mut self, arms: usize) {
        let [known, unknown] = FURTHER.map(|part| (part * arms as f64).round() as usize);
        (self.cases, self.unknown) = (known, unknown.min(arms - known));
        self.none = arms - self.cases - self.unknown;
    }

    /// Shares out a bank of servo arms: a third has one effect, a third several, as many an unknown one as none.
    pub fn share_out_servos(&mut self, arms: usize) {
        let [single, several, unknown] = SERVO.map(|part| (part * arms as f64).round() as usize);
        self.cases = single.min(arms);
        self.multi = several.min(arms - self.cases);
        self.unknown = unknown.min(arms - self.cases - self.multi);
        self.none = arms - self.cases - self.multi - self.unknown;
    }

    /// Servo arms enough for each kind to be the one effect of one.
    pub fn servo_arms() -> usize {
        ((FREE.len() + AGAINST.len()) as f64 / SERVO[0]).round() as usize
    }

    /// Used arms enough for each kind to be the further effect of one.
    pub fn used_arms(used: Used) -> usize {
        (further(Some(used)).len() as f64 / FURTHER[0]).round() as usize
    }

    /// Counts of one case of each kind, of each law outside the catalogue and of none.
    pub fn one_of_each(&mut self) {
        (self.cases, self.unknown, self.none) = (Kind::ALL.len(), UNKNOWN.len(), 1);
    }

    /// The cases, in an order that says nothing about what they hold.
    pub fn specs(&self) -> Vec<CaseSpec> {
        let mut random = Pcg64::seed_from_u64(self.seed);
        let mut kinds: Vec<Sort> = self.kinds().into_iter().map(Sort::Known).collect();
        let mut laws: Vec<Sort> = (0..UNKNOWN.len()).map(Sort::Unknown).collect();
        kinds.shuffle(&mut random);
        laws.shuffle(&mut random);
        let turns = |sorts: Vec<Sort>, count: usize| sorts.into_iter().cycle().take(count).map(|sort| vec![sort]);
        let mut plan: Vec<Vec<Sort>> = turns(kinds, self.cases).chain(turns(laws.clone(), self.unknown)).collect();
        plan.extend((0..self.none).map(|_| Vec::new()));
        plan.extend((0..self.multi).map(|_| self.several(&mut random)));
        for law in laws.iter().cycle().take(self.mixed) {
            plan.push(vec![known(&mut random), *law]);
        }
        plan.shuffle(&mut random);
        let spec = |(i, sorts)| CaseSpec {
            sorts,
            used: self.used,
            faulty: self.faulty,
            servo: self.servo,
            seed: self.seed.wrapping_mul(1000).wrapping_add(i as u64),
            difficulty: self.difficulty,
            seconds: self.seconds,
            episodes: self.episodes,
            tests: self.tests,
        };
        plan.into_iter().enumerate().map(spec).collect()
    }
}

impl Plan {
    /// Kinds of which each is the one effect of a case in turn.
    fn kinds(&self) -> Vec<Kind> {
        if self.servo { [&FREE[..], &AGAINST].concat() } else { further(self.used) }
    }

    /// Two to four kinds that do not hide in each other, in the catalogue's order.
    fn several(&self, random: &mut Pcg64) -> Vec<Sort> {
        let (all, clash) = if self.servo { (self.kinds(), &SERVO_CLASH[..]) } else { (companions(), &CLASH[..]) };
        several(&all, clash, random)
    }
}

/// Kinds that are no calibration of an arm that is as used.
fn further(used: Option<Used>) -> Vec<Kind> {
    let calibration = used.map_or(&[][..], Used::calibration);
    Kind::ALL.into_iter().filter(|kind| !calibration.contains(kind)).collect()
}

/// Kinds that stand beside others: a contact would hide them for as long as it lasts.
fn companions() -> Vec<Kind> {
    Kind::ALL.into_iter().filter(|kind| *kind != ExternalContact).collect()
}

fn known(random: &mut Pcg64) -> Sort {
    Sort::Known(companions().choose(random).copied().unwrap_or(CoulombFriction))
}

fn several(all: &[Kind], clashes: &[&[Kind]], random: &mut Pcg64) -> Vec<Sort> {
    let count = random.random_range(2..=4);
    loop {
        let mut kinds: Vec<Kind> = all.sample(random, count).copied().collect();
        kinds.sort_unstable();
        if clashes.iter().all(|clash| kinds.iter().filter(|kind| clash.contains(kind)).count() < 2) {
            return kinds.into_iter().map(Sort::Known).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Plan {
        Plan {
            cases: 44,
            multi: 200,
            mixed: 10,
            none: 3,
            unknown: 10,
            robots: vec!["arm7".into()],
            seed: 7,
            difficulty: Difficulty::Mixed,
            seconds: 10.0,
            episodes: 4,
            tests: 2,
            used: None,
            faulty: false,
            servo: false,
        }
    }

    #[test]
    fn a_plan_holds_what_it_was_asked_for_and_no_pair_that_hides() {
        let specs = plan().specs();
        assert_eq!(specs.len(), 267);
        let single = |name: &str| specs.iter().filter(|s| s.sorts.len() == 1 && s.sorts[0].name() == name).count();
        assert!(Kind::ALL.iter().all(|kind| single(kind.name()) == 2));
        assert!(UNKNOWN.iter().all(|law| single(law) == 2));
        assert_eq!(specs.iter().filter(|s| s.sorts.is_empty()).count(), 3);
        let named = |s: &CaseSpec, kind: Kind| s.sorts.contains(&Sort::Known(kind));
        for spec in specs.iter().filter(|s| s.sorts.len() > 1) {
            assert!(!named(spec, ExternalContact));
            for clash in CLASH {
                assert!(clash.iter().filter(|kind| named(spec, **kind)).count() < 2, "{spec:?}");
            }
        }
    }

    #[test]
    fn the_seed_decides() {
        assert_eq!(plan().specs(), plan().specs());
        assert_ne!(plan().specs(), Plan { seed: 8, ..plan() }.specs());
    }
}
