//! Declares the numbers of a scene. `table!` defines a struct or an enum and implements `Numbers` for it,
//! so that field, range, unit and default stand in one place:
//!
//! ```text
//! table! {
//!     #[derive(Serialize, Deserialize)]
//!     pub struct Ice {
//!         /// Downward acceleration.
//!         pub gravity: f64 [0.0, 100.0, "m/s2"] = 9.81,
//!         pub friction: Friction = Friction::PAPER,
//!     }
//! }
//! ```
//!
//! `f64` does not implement `Numbers`, so a number without a range does not compile.

use std::{fmt, str::Split};

/// Where a number may lie, and its unit.
#[derive(Debug, Clone, Copy)]
pub struct Range {
    pub low: f64,
    pub high: f64,
    pub unit: &'static str,
}

/// Dotted name of a number, such as `body.head.mass`, without allocation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Name<'a> {
    /// Name of the table that holds it; `None` in the scene itself.
    pub table: Option<&'a Name<'a>>,
    /// The part after the last dot.
    pub last: &'a str,
}

impl<'a> Name<'a> {
    /// Name of a field in the table of that name.
    pub fn new(table: Option<&'a Name<'a>>, last: &'a str) -> Self {
        Self { table, last }
    }

    /// Is this the dotted name?
    pub fn is(&self, dotted: &str) -> bool {
        match (self.table, dotted.rsplit_once('.')) {
            (Some(table), Some((head, last))) => last == self.last && table.is(head),
            (None, None) => dotted == self.last,
            _ => false,
        }
    }
}

impl fmt::Display for Name<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(table) = self.table {
            write!(f, "{table}.")?;
        }
        f.write_str(self.last)
    }
}

/// Called for each number with its name and a reference to it.
pub(super) type Visit<'v, 'a> = &'v mut dyn FnMut(Name<'_>, &'a mut f64);

/// A part of a scene. The provided methods are those of a part without numbers.
pub(super) trait Numbers {
    /// Range of the number whose name has these `parts` after the name of this part, if a value of this
    /// type can have such a number.
    fn range(parts: &mut Split<'_, char>) -> Option<Range> {
        let _ = parts;
        None
    }

    /// Visit each number in the order of the fields; `name` is the name of this part, `None` for the scene.
    fn each<'a>(&'a mut self, name: Option<&Name<'_>>, visit: Visit<'_, 'a>) {
        let _ = (name, visit);
    }
}

impl Numbers for bool {}
impl Numbers for String {}
impl Numbers for Vec<String> {}

impl<T: Numbers> Numbers for Option<T> {
    fn range(parts: &mut Split<'_, char>) -> Option<Range> {
        T::range(parts)
    }

    fn each<'a>(&'a mut self, name: Option<&Name<'_>>, visit: Visit<'_, 'a>) {
        if let Some(table) = self {
            table.each(name, visit);
        }
    }
}

/// A field with a range: one number, or a list of numbers that share the range.
pub(super) trait Ranged {
    /// Is a number of the field called so after the field's name?
    fn has(parts: &mut Split<'_, char>) -> bool;
    /// As in `Numbers`.
    fn each<'a>(&'a mut self, name: Name<'_>, visit: Visit<'_, 'a>);
}

impl Ranged for f64 {
    fn has(parts: &mut Split<'_, char>) -> bool {
        parts.next().is_none()
    }

    fn each<'a>(&'a mut self, name: Name<'_>, visit: Visit<'_, 'a>) {
        visit(name, self);
    }
}

impl Ranged for [f64; 3] {
    fn has(parts: &mut Split<'_, char>) -> bool {
        parts.next().is_some() && parts.next().is_none()
    }

    fn each<'a>(&'a mut self, name: Name<'_>, visit: Visit<'_, 'a>) {
        for (index, x) in ["0", "1", "2"].into_iter().zip(self) {
            visit(Name::new(Some(&name), index), x);
        }
    }
}

/// See the documentation of the module.
macro_rules! table {
    // A struct of which every field has a default value.
    (
        $(#[$about:meta])*
        pub struct $table:ident {
            $($(#[$doc:meta])* pub $field:ident: $type:ty $([$low:literal, $high:literal, $unit:literal])? = $default:expr,)*
        }
    ) => {
        table! {
            $(#[$about])*
            pub struct $table {
                $(
                    $(#[$doc])*
                    #[doc = concat!("Default: `", stringify!($default), "`.")]
                    pub $field: $type $([$low, $high, $unit])?,
                )*
            }
        }

        impl Default for $table {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    };
    (
        $(#[$about:meta])*
        pub struct $table:ident {
            $($(#[$doc:meta])* pub $field:ident: $type:ty $([$low:literal, $high:literal, $unit:literal])?,)*
        }
    ) => {
        $(#[$about])*
        #[serde(deny_unknown_fields)]
        pub struct $table {
            $(
                $(#[$doc])*
                $(#[doc = concat!("Unit: ", $unit, ", range: ", stringify!($low), " to ", stringify!($high), ".")])?
                pub $field: $type,
            )*
        }

        table! { @numbers $table { { $($field: $type $([$low, $high, $unit])?,)* } } }
    };
    // An enum whose fields are all numbers.
    (
        $(#[$about:meta])*
        pub enum $table:ident {
            $(
                $(#[$variant_doc:meta])*
                $variant:ident {
                    $($(#[$doc:meta])* $field:ident: $type:ty [$low:literal, $high:literal, $unit:literal],)*
                },
            )*
        }
    ) => {
        $(#[$about])*
        #[serde(deny_unknown_fields)]
        pub enum $table {
            $(
                $(#[$variant_doc])*
                $variant {
                    $(
                        $(#[$doc])*
                        #[doc = concat!("Unit: ", $unit, ", range: ", stringify!($low), " to ", stringify!($high), ".")]
                        $field: $type,
                    )*
                },
            )*
        }

        table! { @numbers $table { $(:: $variant { $($field: $type [$low, $high, $unit],)* })* } }
    };
    (@numbers $table:ident {
        $($(:: $variant:ident)? { $($field:ident: $type:ty $([$low:literal, $high:literal, $unit:literal])?,)* })*
    }) => {
        impl $crate::scene::declaration::Numbers for $table {
            fn range(parts: &mut std::str::Split<'_, char>) -> Option<$crate::scene::declaration::Range> {
                let first = parts.next()?;
                $($(
                    if first == stringify!($field) {
                        return table!(@range $type, parts $(, $low, $high, $unit)?);
                    }
                )*)*
                None
            }

            fn each<'a>(
                &'a mut self,
                name: Option<&$crate::scene::declaration::Name<'_>>,
                visit: $crate::scene::declaration::Visit<'_, 'a>,
            ) {
                match self {
                    $(Self $(:: $variant)? { $($field),* } => {
                        $(table!(@visit $type, $field, name, visit $(, $unit)?);)*
                    })*
                }
            }
        }
    };
    // A field with a range, then a field without.
    (@range $type:ty, $parts:ident, $low:literal, $high:literal, $unit:literal) => {
        <$type as $crate::scene::declaration::Ranged>::has($parts)
            .then_some($crate::scene::declaration::Range { low: $low, high: $high, unit: $unit })
    };
    (@range $type:ty, $parts:ident) => {
        <$type as $crate::scene::declaration::Numbers>::range($parts)
    };
    (@visit $type:ty, $field:ident, $name:ident, $visit:ident, $unit:literal) => {
        <$type as $crate::scene::declaration::Ranged>::each(
            $field,
            $crate::scene::declaration::Name::new($name, stringify!($field)),
            $visit,
        )
    };
    (@visit $type:ty, $field:ident, $name:ident, $visit:ident) => {
        <$type as $crate::scene::declaration::Numbers>::each(
            $field,
            Some(&$crate::scene::declaration::Name::new($name, stringify!($field))),
            $visit,
        )
    };
}

pub(super) use table;
