//! One effect with its parameters, and what the catalogue says of its kind: the one place that knows every file of it.

mod actuation_delay;
mod actuator_lag;
mod armature;
mod backlash;
mod coulomb_friction;
mod dead_band;
mod external_contact;
mod gravity_misalignment;
mod joint_coupling;
mod joint_elasticity;
mod joint_zero_offset;
mod link_inertia_error;
mod load_dependent_friction;
mod parallel_spring;
mod payload;
mod presliding_friction;
mod servo_damping_error;
mod servo_gain_error;
mod speed_limit;
mod stribeck_friction;
mod thermal_drift;
mod torque_bias;
mod torque_gain_error;
mod torque_ripple;
mod torque_saturation;
mod viscous_friction;

use crate::candidate::Candidate;
use crate::card::Card;
use crate::column::Column;
use crate::error::EffectError;
use crate::kind::Kind;
use crate::law::{AtRest, Law, Listed, Signature};
use crate::motion::Motion;
use crate::outside;
use crate::plant::Plant;
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};

macro_rules! effects {
    (
        effects { $($(#[$about:meta])* $file:ident $type:ident $number:literal,)* }
        servo { $($(#[$about_servo:meta])* $servo_file:ident $servo:ident $servo_number:literal,)* }
        outside { $($(#[$about_law:meta])* $law_file:ident $law:ident $law_number:literal,)* }
    ) => {
        $(pub use $file::$type;)*
        $(pub use $servo_file::$servo;)*

        /// One unmodelled effect with its parameters. Joints are named as in the URDF; serde writes the public names.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum Effect {
            $($(#[$about])* $type($type),)*
        }

        impl Effect {
            /// The effect's law.
            pub fn law(&self) -> &dyn Law {
                match self {
                    $(Effect::$type(effect) => effect,)*
                }
            }

            fn law_mut(&mut self) -> &mut dyn Law {
                match self {
                    $(Effect::$type(effect) => effect,)*
                }
            }

            /// Takes the joints of another effect of the same kind into this one, where the kind has a value per joint.
            /// Returns the other effect where the two must stay apart.
            pub fn absorb(&mut self, other: Effect) -> Option<Effect> {
                match (self, other) {
                    $((Effect::$type(own), Effect::$type(other)) => own.absorb(other).map(Effect::$type),)*
                    (_, other) => Some(other),
                }
            }

            fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<Effect> {
                match candidate.kind {
                    $(Kind::$type => $type::from_coefficients(candidate, model, coefficients).map(Effect::$type),)*
                    $(Kind::$servo => None,)*
                    $(Kind::$law => None,)*
                }
            }
        }

        impl Kind {
            /// All that is true of the kind.
            pub fn card(self) -> &'static Card {
                match self {
                    $(Kind::$type => const { &<$type as Signature>::CARD },)*
                    $(Kind::$servo => const { &$servo::CARD },)*
                    $(Kind::$law => const { &<outside::$law_file::$law as Signature>::CARD },)*
                }
            }
        }

        impl Candidate {
            /// The signature on a motion.
            pub fn columns(&self, motion: &Motion) -> Vec<Column> {
                match self.kind {
                    $(Kind::$type => $type::columns(self, motion),)*
                    // They act on set points, which a motion of efforts does not have.
                    $(Kind::$servo => Vec::new(),)*
                    $(Kind::$law => outside::$law_file::$law::columns(self, motion),)*
                }
            }

            /// Standard deviations of the coefficients about nothing that are plausible for a robot, in the order of
            /// [`Candidate::columns`]; `None` where any size is. What logs do not determine stays near nothing.
            pub fn scales(&self, model: &Model) -> Option<Vec<f64>> {
                match self.kind {
                    $(Kind::$type => $type::scales(self, model),)*
                    $(Kind::$servo => None,)*
                    $(Kind::$law => outside::$law_file::$law::scales(self, model),)*
                }
            }
        }
    };
}

crate::list::catalogue!(effects);

impl Effect {
    /// The kind.
    pub fn kind(&self) -> Kind {
        self.law().kind()
    }

    /// Its dry friction at rest, where that is more than when sliding.
    pub fn at_rest(&mut self) -> Option<AtRest<'_>> {
        self.law_mut().at_rest()
    }
}

impl Candidate {
    /// The effects with these coefficients, in the order of [`Candidate::columns`]; none where no physical effect has them,
    /// and for laws outside the catalogue. A motor that turns on its own comes with its inertia.
    pub fn effects(&self, model: &Model, coefficients: &[f64]) -> Vec<Effect> {
        let Some(effect) = Effect::from_coefficients(self, model, coefficients) else { return Vec::new() };
        let rotor = Candidate { kind: Kind::Armature, ..self.clone() };
        let turns = self.kind.card().turning.is_some();
        let rotor = turns.then(|| Effect::from_coefficients(&rotor, model, coefficients)).flatten();
        std::iter::once(effect).chain(rotor).collect()
    }
}

impl Plant {
    /// The robot with effects. `dt` is the length of a step in s.
    ///
    /// # Errors
    /// An effect names a joint that the robot does not have, or has a parameter outside its physical bounds.
    pub fn new(model: &Model, effects: &[Effect], dt: f64) -> Result<Plant, EffectError> {
        let mut plant = Plant::bare(model, dt);
        for effect in effects {
            effect.law().install(&mut plant)?;
        }
        plant.check_friction()?;
        plant.assemble();
        Ok(plant)
    }
}

#[cfg(test)]
mod tests;
