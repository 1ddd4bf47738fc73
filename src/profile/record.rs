//! How a resolved profile is written into a record: types of others as text, times as numbers of seconds.

use std::fmt::Display;

use serde::{Deserialize, Deserializer, Serializer};

/// A time in s.
///
/// A double holds the times of a profile, a day at most, to 0.02 ns, and reading rounds to whole ns: so the way there and
/// back is exact.
pub(super) mod seconds {
    use std::time::Duration;

    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(in crate::profile) fn serialize<S: Serializer>(time: &Duration, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_f64(time.as_secs_f64())
    }

    pub(in crate::profile) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Duration, D::Error> {
        let seconds = f64::deserialize(from)?;
        Duration::try_from_secs_f64(seconds)
            .map_err(|error| D::Error::custom(format!("{seconds} s is no time: {error}")))
    }
}

/// [`Size`](crate::camera::Size) as `1024x768`.
pub(super) mod size {
    use serde::{Deserializer, Serializer};

    use crate::camera::Size;

    pub(in crate::profile) fn serialize<S: Serializer>(
        size: &Option<Size>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        super::write(size.map(|size| format!("{}x{}", size.columns, size.rows)), to)
    }

    pub(in crate::profile) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Size>, D::Error> {
        super::read(from, str::parse)
    }
}

/// [`BayerUse`](crate::camera::pixels::BayerUse) by its name.
pub(super) mod bayer {
    use serde::{Deserializer, Serializer};

    use super::super::parts::BAYER_USES;
    use crate::camera::pixels::BayerUse;

    pub(in crate::profile) fn serialize<S: Serializer>(
        bayer: &Option<BayerUse>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        let name = BAYER_USES.iter().find(|(_, known)| Some(*known) == *bayer).map(|(name, _)| *name);
        super::write(name.map(str::to_owned), to)
    }

    pub(in crate::profile) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<BayerUse>, D::Error> {
        super::read(from, |text| {
            let known = BAYER_USES.iter().find(|(name, _)| *name == text);
            known.map(|(_, bayer)| *bayer).ok_or_else(|| format!("{text:?} is no use of a colour mosaic"))
        })
    }
}

fn write<S: Serializer>(text: Option<String>, to: S) -> Result<S::Ok, S::Error> {
    match text {
        Some(text) => to.serialize_some(&text),
        None => to.serialize_none(),
    }
}

fn read<'de, D: Deserializer<'de>, T, E: Display>(
    from: D,
    parse: impl Fn(&str) -> Result<T, E>,
) -> Result<Option<T>, D::Error> {
    let text = Option::<String>::deserialize(from)?;
    text.map(|text| parse(&text).map_err(serde::de::Error::custom)).transpose()
}
