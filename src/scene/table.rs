//! Declaration of the tables of a scene file by `table!`: fields, serialization, physical numbers and their
//! validation.
//!
//! `table!` declares a struct, or an enum with a variant for each `kind`, over a number type `D`. A field `pub name:
//! Type = kind` holds physical numbers: `kind` is the [`Quantity`] of numbers, vectors and lists of them, or [`TABLE`]
//! for tables. Fields without a kind are copied from one number type to another. Fields in `each with { .. }` after an
//! enum are those of every variant, after its own. With `=> "key"` the path has another key than the name of the field.
//! Entries of a list of `pub struct Name by field` have the value of that field as their key, others their index. The
//! trait [`NumberTree`] visits all numbers with their paths, for parameters, validation and scenes over dual numbers.

use crate::error::Error;
use crate::scene::number::{NumberVisitor, Quantity};

/// Part of a scene that holds physical numbers: a number, a vector, a list or a table.
pub(crate) trait NumberTree {
    /// Description of the numbers besides their key, as the declaration of a field gives it: a quantity, or that of a
    /// table.
    type Kind: Copy;
    /// The same part over the number type `D`.
    type Over<D>;

    /// The part over the number type `D`: the visitor converts every number, at its path below `key` and with its
    /// quantity. `kind` is the quantity of numbers, or [`TABLE`]. Everything else is copied.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: Self::Kind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Self::Over<D>;

    /// Rejects numbers that are not finite or have a sign that their quantity does not allow; `key` is the path of the
    /// part, for the error.
    fn check_numbers(&self, key: &str, kind: Self::Kind) -> Result<(), Error>;

    /// Key of the part as the entry `index` of a list: the index as text, or its name if it has one.
    fn entry_key(&self, index: usize) -> String {
        index.to_string()
    }
}

/// Kind of a field that is a table.
#[derive(Clone, Copy)]
pub(crate) struct TableKind;

/// Kind of a field that is a table, or a list of tables.
pub(crate) const TABLE: TableKind = TableKind;

impl NumberTree for f64 {
    type Kind = Quantity;
    type Over<D> = D;

    /// The number converted by the visitor, at the key `key` of the present table.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        quantity: Quantity,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> D {
        visitor.number(key, *self, quantity)
    }

    /// Rejects a number that is not finite or has a sign that its quantity does not allow. `key` is its path, for the
    /// error.
    fn check_numbers(&self, key: &str, quantity: Quantity) -> Result<(), Error> {
        quantity.check(key, *self)
    }
}

/// Numbers of one quantity with a key each, as the components of a vector.
impl<const N: usize> NumberTree for [f64; N] {
    type Kind = Quantity;
    type Over<D> = [D; N];

    /// The components converted by the visitor at the paths `key.x`, `key.y`, `key.z` of three, and `key.d1`, `key.d2`
    /// of two. It panics for more than three.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        quantity: Quantity,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> [D; N] {
        // Vectors have world axes, pairs the two material directors.
        let keys = if N == 3 { ["x", "y", "z"] } else { ["d1", "d2", ""] };
        let outer_length = visitor.enter(key);
        let vector = std::array::from_fn(|c| visitor.number(keys[c], self[c], quantity));
        visitor.leave(outer_length);
        vector
    }

    /// Rejects the array if a component is not finite; the sign is not checked. `key` is its path, for the error.
    fn check_numbers(&self, key: &str, _: Quantity) -> Result<(), Error> {
        match self.iter().all(|component| component.is_finite()) {
            true => Ok(()),
            false => Err(Error::invalid(key, format!("{self:?}"), "finite numbers")),
        }
    }
}

impl<T: NumberTree> NumberTree for Option<T> {
    type Kind = T::Kind;
    type Over<D> = Option<T::Over<D>>;

    /// The part over `D`, with every number converted by the visitor below the path `key`; none without a part.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: T::Kind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Option<T::Over<D>> {
        self.as_ref().map(|part| part.map_numbers(key, kind, visitor))
    }

    /// Rejects invalid numbers of the part, with paths below `key`; `Ok` without a part.
    fn check_numbers(&self, key: &str, kind: T::Kind) -> Result<(), Error> {
        self.as_ref().map_or(Ok(()), |part| part.check_numbers(key, kind))
    }
}

impl<T: NumberTree> NumberTree for Box<T> {
    type Kind = T::Kind;
    type Over<D> = Box<T::Over<D>>;

    /// The part in the box over `D`, with every number converted by the visitor below the path `key`.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: T::Kind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Box<T::Over<D>> {
        Box::new((**self).map_numbers(key, kind, visitor))
    }

    /// Rejects numbers of the part in the box that are not finite or have a sign that their quantity does not allow;
    /// `key` is its path, for the error.
    fn check_numbers(&self, key: &str, kind: T::Kind) -> Result<(), Error> {
        (**self).check_numbers(key, kind)
    }
}

impl<T: NumberTree> NumberTree for Vec<T> {
    type Kind = T::Kind;
    type Over<D> = Vec<T::Over<D>>;

    /// The entries over `D`, in the same order, with every number converted by the visitor below `key.0`, `key.1`, ...
    /// Named entries have their name in place of the index.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: T::Kind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Vec<T::Over<D>> {
        let outer_length = visitor.enter(key);
        let mut mapped = Vec::with_capacity(self.len());
        for (i, entry) in self.iter().enumerate() {
            mapped.push(entry.map_numbers(&entry.entry_key(i), kind, visitor));
        }
        visitor.leave(outer_length);
        mapped
    }

    /// Rejects the first entry with an invalid number; its path is `key[i]` with the index from 0, also of a named
    /// entry.
    fn check_numbers(&self, key: &str, kind: T::Kind) -> Result<(), Error> {
        let mut entries = self.iter().enumerate();
        entries.try_for_each(|(i, entry)| entry.check_numbers(&format!("{key}[{i}]"), kind))
    }
}

/// Declares a table of a scene file; see the [module](self).
macro_rules! table {
    ($(#[$meta:meta])* pub struct $name:ident $(by $entry:ident)? {
        $($(#[$field_meta:meta])* $visibility:vis $field:ident: $type:ty $(= $kind:expr)? $(=> $key:literal)?,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
        #[serde(deny_unknown_fields, bound = "D: crate::scene::number::SceneNumber")]
        pub struct $name<D = f64> {
            $($(#[$field_meta])* $visibility $field: $type,)*
        }
        crate::scene::table::table!(@numbers $name $(by $entry)? { $($field $(= $kind)? $(=> $key)?,)* });
    };
    // An enum with further fields in each variant: they are appended to one variant after the other.
    ($(#[$meta:meta])* pub enum $name:ident { $($variants:tt)* } each with { $($shared:tt)* }) => {
        crate::scene::table::table!(@each { $(#[$meta])* pub enum $name } {} { $($variants)* } { $($shared)* });
    };
    (@each { $($head:tt)* } { $($done:tt)* } {} $shared:tt) => {
        crate::scene::table::table!($($head)* { $($done)* });
    };
    (@each $head:tt { $($done:tt)* } {
        $(#[$meta:meta])* $variant:ident { $($own:tt)* }, $($rest:tt)*
    } { $($shared:tt)* }) => {
        crate::scene::table::table!(
            @each $head { $($done)* $(#[$meta])* $variant { $($own)* $($shared)* }, } { $($rest)* } { $($shared)* }
        );
    };
    ($(#[$meta:meta])* pub enum $name:ident { $($(#[$variant_meta:meta])* $variant:ident {
        $($(#[$field_meta:meta])* $field:ident: $type:ty $(= $kind:expr)?,)*
    },)* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
        #[serde(
            tag = "kind",
            rename_all = "kebab-case",
            deny_unknown_fields,
            bound = "D: crate::scene::number::SceneNumber"
        )]
        pub enum $name<D = f64> {
            $($(#[$variant_meta])* $variant { $($(#[$field_meta])* $field: $type,)* },)*
        }
        crate::scene::table::table!(@tree $name, self, visitor, key, {
            match self { $(Self::$variant { $($field),* } => $name::$variant {
                $($field: crate::scene::table::table!(@map $field, stringify!($field), visitor $(, $kind)?),)*
            },)* }
        }, {
            match self { $(Self::$variant { $($field),* } => {
                $(crate::scene::table::table!(@check $field, stringify!($field), key $(, $kind)?);)*
            })* }
        });
    };
    // The numbers of a struct that is declared elsewhere.
    (@numbers $name:ident $(by $entry:ident)? { $($field:ident $(= $kind:expr)? $(=> $key:literal)?,)* }) => {
        crate::scene::table::table!(@tree $name $(by $entry)?, self, visitor, key, {
            $name { $($field: crate::scene::table::table!(
                @map &self.$field, crate::scene::table::table!(@key $field $(, $key)?), visitor $(, $kind)?
            ),)* }
        }, {
            $(crate::scene::table::table!(
                @check &self.$field, crate::scene::table::table!(@key $field $(, $key)?), key $(, $kind)?
            );)*
        });
    };
    (@tree $name:ident $(by $entry:ident)?, $self:ident, $visitor:ident, $key:ident, $map:block, $check:block) => {
        impl crate::scene::table::NumberTree for $name {
            type Kind = crate::scene::table::TableKind;
            type Over<D> = $name<D>;

            /// The table over the number type `D`: every number converted by the visitor, under its path below the key.
            fn map_numbers<D: From<f64>>(
                &$self,
                $key: &str,
                _: crate::scene::table::TableKind,
                $visitor: &mut crate::scene::number::NumberVisitor<'_, D>,
            ) -> $name<D> {
                let outer_length = $visitor.enter($key);
                let mapped = $map;
                $visitor.leave(outer_length);
                mapped
            }

            /// Rejects numbers of the table that are not finite or have a sign that their quantity does not allow.
            fn check_numbers(&$self, $key: &str, _: crate::scene::table::TableKind) -> Result<(), crate::error::Error> {
                $check
                Ok(())
            }

            $(/// Key of the table in a list: the value of the field that names it.
            fn entry_key(&self, _: usize) -> String {
                self.$entry.clone()
            })?
        }
    };
    (@key $field:ident) => { stringify!($field) };
    (@key $field:ident, $key:literal) => { $key };
    // A field without a kind has no physical numbers.
    (@map $value:expr, $key:expr, $visitor:ident) => { Clone::clone($value) };
    (@map $value:expr, $key:expr, $visitor:ident, $kind:expr) => {
        crate::scene::table::NumberTree::map_numbers($value, $key, $kind, $visitor)
    };
    (@check $value:expr, $key:expr, $path:ident) => { let _ = $value; };
    (@check $value:expr, $key:expr, $path:ident, $kind:expr) => {
        crate::scene::table::NumberTree::check_numbers($value, &crate::scene::table::join($path, $key), $kind)?;
    };
}
pub(crate) use table;

/// The path `table.key` of a key within a table; the key itself at the root, where `table` is empty.
pub(crate) fn join(table: &str, key: &str) -> String {
    if table.is_empty() { key.into() } else { format!("{table}.{key}") }
}
