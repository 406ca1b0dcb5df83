//! The public names of the catalogue.

use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! kinds {
    (
        effects { $($(#[$about:meta])* $file:ident $type:ident $number:literal,)* }
        servo { $($(#[$about_servo:meta])* $servo_file:ident $servo:ident $servo_number:literal,)* }
        outside { $($(#[$about_law:meta])* $law_file:ident $law:ident $law_number:literal,)* }
    ) => {
        /// Kinds of effect, by the public names that JSON, command line and reports use.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Kind {
            $($(#[$about])* $type = $number,)*
            $($(#[$about_servo])* $servo = $servo_number,)*
            $($(#[$about_law])* $law = $law_number,)*
        }

        impl Kind {
            /// Every kind of the catalogue that acts on efforts, in its order.
            pub const ALL: [Kind; [$($number),*].len()] = [$(Kind::$type),*];

            /// Kinds of servo arms, against a drive that was given. They act on set points, so that no [`crate::Effect`], which
            /// acts on efforts, is of such a kind.
            pub const SERVO: [Kind; [$($servo_number),*].len()] = [$(Kind::$servo),*];

            /// Laws that the catalogue does not have: what its effects are held against. No [`crate::Effect`] is of such a kind.
            pub const OUTSIDE: [Kind; [$($law_number),*].len()] = [$(Kind::$law),*];

            /// The public name, e.g. `coulomb_friction`.
            pub fn name(self) -> &'static str {
                match self {
                    $(Kind::$type => stringify!($file),)*
                    $(Kind::$servo => stringify!($servo_file),)*
                    $(Kind::$law => stringify!($law_file),)*
                }
            }
        }
    };
}

crate::list::catalogue!(kinds);

impl Kind {
    /// Every kind that has a name: of efforts, of servos, and outside the catalogue.
    pub fn every() -> impl Iterator<Item = Kind> {
        Kind::ALL.into_iter().chain(Kind::SERVO).chain(Kind::OUTSIDE)
    }

    /// The kind with a public name, of the catalogue or outside it.
    pub fn named(name: &str) -> Option<Kind> {
        Kind::every().find(|kind| kind.name() == name)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_is_the_one_that_serde_writes() {
        for kind in Kind::every() {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
            assert_eq!(Kind::named(kind.name()), Some(kind));
        }
        assert_eq!(Kind::named("friction"), None);
    }
}
