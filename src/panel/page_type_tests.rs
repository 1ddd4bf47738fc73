//! The types of the page are those of the program: written into `web/src/types.ts` by
//! `EPIRIG_WRITE_TABLES=1 cargo test --lib page_type_tests`, and compared here.

use std::any::TypeId;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::path::Path;

use ts_rs::{Config, TS, TypeVisitor};

use super::results::results_questions;
use super::shared::{PictureHead, PictureWish};
use super::table::QUESTIONS;
use epirig_core::choice::Choice;
use epirig_devices::camera;
use epirig_surface as surface;

/// The form in which the page has a record of a crate that does not know the page. The conversion does not compile
/// when the record changes.
macro_rules! mirrors {
    ($($(#[$about:meta])* $name:ident = $record:path { $($(#[$as:meta])? $field:ident: $type:ty,)* })*) => {$(
        $(#[$about])*
        #[derive(TS)]
        #[expect(dead_code, reason = "only its declaration is used")]
        pub(crate) struct $name {
            $($(#[$as])? $field: $type,)*
        }

        impl From<$record> for $name {
            fn from(record: $record) -> Self {
                let $record { $($field,)* } = record;
                Self { $($field,)* }
            }
        }
    )*};
}

mirrors! {
    Roughness = surface::Roughness {
        sa_mm: f64,
        sq_mm: f64,
        sz_mm: f64,
        ssk: f64,
        sku: f64,
        sq_noise_mm: Option<f64>,
        sq_without_noise_mm: Option<f64>,
        pixels: usize,
    }
    Depth = surface::Depth {
        depth_mm: f64,
        sigma_mm: Option<f64>,
        degrees_of_freedom: Option<f64>,
        half_width_95_mm: Option<f64>,
        scale_sigma_mm: f64,
    }
    Part = surface::Part {
        centre_x_px: f64,
        centre_y_px: f64,
        area_px: usize,
        area_mm2: f64,
        used_px: usize,
        #[ts(as = "Depth")]
        depth: surface::Depth,
    }
    Contribution = surface::Contribution {
        name: &'static str,
        #[ts(type = "'A' | 'B'")]
        evaluation: surface::Evaluation,
        sigma_mm: Option<f64>,
        share: Option<f64>,
    }
    Combined = surface::Combined {
        sigma_mm: f64,
        degrees_of_freedom: f64,
        coverage_factor: f64,
        half_width_95_mm: f64,
    }
    Budget = surface::Budget {
        #[ts(as = "Vec<Contribution>")]
        contributions: Vec<surface::Contribution>,
        #[ts(as = "Option<Combined>")]
        combined: Option<surface::Combined>,
    }
    LinePoint = surface::ProfilePoint {
        x_px: f64,
        y_px: f64,
        distance_mm: f64,
        #[ts(as = "Option<f64>")]
        height_mm: f64,
        #[ts(as = "Option<f64>")]
        sigma_mm: f64,
    }
    /// A control of the camera.
    Control = camera::Control {
        #[ts(skip)]
        id: u32,
        name: String,
        #[ts(as = "Names<camera::ControlKind>")]
        kind: camera::ControlKind,
        minimum: i64,
        maximum: i64,
        step: u64,
        default: i64,
        value: Option<i64>,
        read_only: bool,
        inactive: bool,
        items: Vec<(i64, String)>,
    }
}

/// The names of a choice, as the page has them.
pub(crate) struct Names<C>(PhantomData<C>);

impl<C: Choice> TS for Names<C> {
    type WithoutGenerics = Self;
    type OptionInnerType = Self;

    fn name(_: &Config) -> String {
        C::ALL.iter().map(|choice| format!("'{}'", choice.name())).collect::<Vec<_>>().join(" | ")
    }

    fn inline(settings: &Config) -> String {
        Self::name(settings)
    }
}

/// Declarations by their names, each with all that it needs.
pub(super) struct Declarations {
    settings: Config,
    found: BTreeMap<String, (TypeId, String)>,
}

impl TypeVisitor for Declarations {
    fn visit<T: TS + 'static + ?Sized>(&mut self) {
        // Types without a file of their own, such as numbers and lists, have no name to be declared by.
        if T::output_path().is_none() {
            T::visit_generics(self);
            return T::visit_dependencies(self);
        }
        let name = T::ident(&self.settings);
        if let Some((id, _)) = self.found.get(&name) {
            assert_eq!(*id, TypeId::of::<T>(), "two types of the page have the name {name}");
            return;
        }
        let text = format!("{}export {}\n", T::docs().unwrap_or_default(), T::decl(&self.settings));
        self.found.insert(name, (TypeId::of::<T>(), text));
        T::visit_dependencies(self);
    }
}

/// What the page is told and sends: the roots, from which the others follow.
fn declarations() -> String {
    // JSON has one kind of number.
    let mut all = Declarations { settings: Config::new().with_large_int("number"), found: BTreeMap::new() };
    QUESTIONS.0.iter().for_each(|row| (row.types)(&mut all));
    results_questions().for_each(|row| (row.types)(&mut all));
    // Of the feeds; that of the state has the same type as the question.
    all.visit::<PictureHead>();
    all.visit::<PictureWish>();
    let all: Vec<String> = all.found.into_values().map(|(_, text)| text).collect();
    format!(
        "// What the program tells the page and is sent by it. Written by `EPIRIG_WRITE_TABLES=1 cargo test --lib \
         page_type_tests`.\n\n{}",
        all.join("\n")
    )
}

#[test]
fn the_page_has_the_types_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("web/src/types.ts");
    let found = declarations();
    if std::env::var_os("EPIRIG_WRITE_TABLES").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let told = std::fs::read_to_string(&path).unwrap();
    assert_eq!(found, told, "{} is another; EPIRIG_WRITE_TABLES=1 writes it anew", path.display());
}
