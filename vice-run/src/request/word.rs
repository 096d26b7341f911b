//! Spans as decimal seconds in documents, and addresses without their secrets.

pub(crate) mod seconds {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use vice_core::time::Span;

    pub(crate) fn serialize<S: Serializer>(span: &Span, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(span.as_secs_f64())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Span, D::Error> {
        Span::from_secs_f64(f64::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

pub(crate) mod seconds_option {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use vice_core::time::Span;

    pub(crate) fn serialize<S: Serializer>(span: &Option<Span>, serializer: S) -> Result<S::Ok, S::Error> {
        match span {
            Some(span) => serializer.serialize_some(&span.as_secs_f64()),
            None => serializer.serialize_none(),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Span>, D::Error> {
        let seconds = Option::<f64>::deserialize(deserializer)?;
        seconds.map(Span::from_secs_f64).transpose().map_err(D::Error::custom)
    }
}

/// Paths, of which addresses lose their secrets when they are written.
pub(crate) mod path {
    use std::path::Path;

    use serde::{Serialize, Serializer};
    use vice_files::address::shown_path;

    pub(crate) fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
        shown_path(path).serialize(serializer)
    }
}

pub(crate) mod path_option {
    use std::path::PathBuf;

    use serde::{Serialize, Serializer};
    use vice_files::address::shown_path;

    pub(crate) fn serialize<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
        path.as_deref().map(shown_path).serialize(serializer)
    }
}

/// Settings, of which some may be addresses.
pub(crate) mod settings {
    use std::collections::BTreeMap;

    use serde::Serializer;
    use vice_files::address::shown;

    pub(crate) fn serialize<S: Serializer>(
        settings: &BTreeMap<String, String>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_map(settings.iter().map(|(key, value)| (key, shown(value))))
    }
}
