//! Why a call failed: the code for its kind, and the message.

use vice_core::error::{DataError, ErrorKind, one_line};

use crate::contract::{self, Message};

/// A call that failed.
pub(super) struct Failure {
    code: i32,
    text: String,
    /// Where the hint stands in the text, and its length.
    hint: (usize, usize),
}

impl Failure {
    pub(super) fn of(error: &DataError) -> Self {
        let code = match error.kind() {
            ErrorKind::Missing => contract::ERROR_MISSING,
            ErrorKind::Unsupported => contract::ERROR_UNSUPPORTED,
            ErrorKind::Contradictory => contract::ERROR_CONTRADICTORY,
            ErrorKind::Usage => contract::ERROR_USAGE,
            _ => contract::ERROR,
        };
        // The error's own text ends with the hint in brackets; its causes follow.
        let hint = error.hint_text().map_or((0, 0), |hint| {
            let own = error.to_string();
            (own.len().saturating_sub(hint.len() + 1), hint.len())
        });
        Self { code, text: one_line(error), hint }
    }

    pub(super) const fn panic(text: String) -> Self {
        Self { code: contract::EXCEPTION, text, hint: (0, 0) }
    }

    /// Writes the message, and gives the code.
    ///
    /// # Safety
    /// `message` is null or as [`Message::write`] wants it.
    #[allow(unsafe_code)]
    pub(super) unsafe fn write(&self, message: *mut Message) -> i32 {
        if !message.is_null() {
            // SAFETY: not null, and as the caller promises.
            let message = unsafe { &mut *message };
            // SAFETY: the caller's promise.
            unsafe { message.write(&self.text) };
            (message.hint_start, message.hint_length) = self.hint;
        }
        self.code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hint_is_found_in_the_text_and_the_kind_is_the_code() {
        let error = DataError::of_kind(ErrorKind::Usage, "no such é").at("a").hint("give `é`").because("why");
        let failed = Failure::of(&error);
        assert_eq!(
            (failed.code, failed.text.as_str()),
            (contract::ERROR_USAGE, "a: no such é (give `é`): why")
        );
        let (start, length) = failed.hint;
        assert_eq!(&failed.text[start..start + length], "give `é`");
        assert_eq!(Failure::of(&DataError::new("x")).hint, (0, 0));
    }
}
