//! What the server answers where it cannot do what was asked: a status and one clear line.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;
use vice_core::error::{DataError, one_line};

use crate::store::StoreError;

/// An answer that is no success.
#[derive(Debug)]
pub(crate) struct ApiError {
    status: StatusCode,
    error: String,
    hint: Option<&'static str>,
    revision: Option<u64>,
}

impl ApiError {
    pub(crate) fn new(status: StatusCode, error: impl Into<String>) -> Self {
        Self { status, error: error.into(), hint: None, revision: None }
    }

    pub(crate) fn hint(mut self, hint: &'static str) -> Self {
        self.hint = Some(hint);
        self
    }

    pub(crate) fn bad(error: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, error)
    }

    pub(crate) fn internal(error: impl std::fmt::Display) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
    }
}

impl From<StoreError> for ApiError {
    fn from(error: StoreError) -> Self {
        let text = one_line(&error);
        match error {
            StoreError::Stale { revision } => {
                let hint = "read the state again";
                Self { revision: Some(revision), ..Self::new(StatusCode::CONFLICT, text).hint(hint) }
            }
            StoreError::ReadOnly(_) => Self::new(StatusCode::FORBIDDEN, text),
            StoreError::Nothing(_) => Self::new(StatusCode::CONFLICT, text),
            StoreError::Refused(_) => Self::new(StatusCode::UNPROCESSABLE_ENTITY, text),
            StoreError::Disk(_) => Self::new(StatusCode::INSUFFICIENT_STORAGE, text),
        }
    }
}

impl From<DataError> for ApiError {
    fn from(error: DataError) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, one_line(&error))
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let mut body = json!({ "error": self.error });
        if let Some(hint) = self.hint {
            body["hint"] = hint.into();
        }
        if let Some(revision) = self.revision {
            body["revision"] = revision.into();
        }
        (self.status, Json(body)).into_response()
    }
}
