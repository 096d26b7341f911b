//! Spans as decimal seconds in documents.

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
