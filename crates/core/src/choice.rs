//! A choice by name: stated once, as an enum, for command lines, profiles and records alike.

/// A choice among few, each with a name.
pub trait Choice: Copy + Eq + std::fmt::Debug + Send + Sync + 'static {
    /// All of them, in the order of their declaration.
    const ALL: &'static [Self];

    /// The name, as options, profiles and records have it.
    fn name(self) -> &'static str;

    /// Its meaning in one line: the first line of its documentation.
    fn help(self) -> &'static str;

    /// The one of this name.
    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// The names of all choices, in the order of their declaration.
pub fn names<C: Choice>() -> Vec<&'static str> {
    C::ALL.iter().map(|choice| choice.name()).collect()
}

/// Declares an enum whose variants are [`Choice`]s: each with its documentation and its name.
///
/// Records (serde) have the name.
///
/// ```
/// use epirig_core::choice::Choice as _;
///
/// epirig_core::choices! {
///     /// Which way.
///     pub enum Way {
///         /// Away from home.
///         Out = "out",
///         /// Towards home.
///         Home = "home",
///     }
/// }
///
/// assert_eq!(Way::from_name("home"), Some(Way::Home));
/// assert_eq!((Way::Out.name(), Way::Out.help()), ("out", "Away from home."));
/// ```
#[macro_export]
macro_rules! choices {
    (
        $(#[$meta:meta])*
        pub enum $choice:ident {
            $(#[doc = $help:literal] $(#[$more:meta])* $variant:ident = $name:literal,)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $choice {
            $(#[doc = $help] $(#[$more])* $variant,)+
        }

        // The help is the first line of a description, so a sentence has to end there.
        const _: () = { $(assert!(matches!($help.as_bytes(), [.., b'.'])));+ };

        impl $crate::choice::Choice for $choice {
            const ALL: &'static [Self] = &[$(Self::$variant),+];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            fn help(self) -> &'static str {
                match self {
                    $(Self::$variant => $help.trim_ascii(),)+
                }
            }
        }

        impl std::fmt::Display for $choice {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad($crate::choice::Choice::name(*self))
            }
        }

        impl $crate::choice::serde::Serialize for $choice {
            fn serialize<S: $crate::choice::serde::Serializer>(
                &self,
                serializer: S,
            ) -> Result<S::Ok, S::Error> {
                serializer.serialize_str($crate::choice::Choice::name(*self))
            }
        }

        impl<'de> $crate::choice::serde::Deserialize<'de> for $choice {
            fn deserialize<D: $crate::choice::serde::Deserializer<'de>>(
                deserializer: D,
            ) -> Result<Self, D::Error> {
                let name = <String as $crate::choice::serde::Deserialize>::deserialize(deserializer)?;
                $crate::choice::Choice::from_name(&name).ok_or_else(|| {
                    $crate::choice::serde::de::Error::unknown_variant(&name, &[$($name),+])
                })
            }
        }
    };
}

#[doc(hidden)]
pub use serde;

#[cfg(test)]
mod tests {
    #![allow(unreachable_pub, reason = "the macro declares what is public")]

    use super::Choice as _;

    choices! {
        /// A colour.
        pub enum Colour {
            /// Like blood.
            ///
            /// And like roses.
            Red = "red",
            /// Like grass.
            DarkGreen = "dark-green",
        }
    }

    #[test]
    fn names_are_those_of_records() {
        for &colour in Colour::ALL {
            assert_eq!(Colour::from_name(colour.name()), Some(colour));
            let json = serde_json::to_string(&colour).unwrap();
            assert_eq!(json, format!("{:?}", colour.name()));
            assert_eq!(serde_json::from_str::<Colour>(&json).unwrap(), colour);
        }
        assert_eq!(Colour::Red.help(), "Like blood.");
        assert_eq!(format!("{:>11}", Colour::DarkGreen), " dark-green");
        let error = serde_json::from_str::<Colour>("\"blue\"").unwrap_err().to_string();
        assert!(error.contains("blue") && error.contains("dark-green"), "{error}");
    }
}
