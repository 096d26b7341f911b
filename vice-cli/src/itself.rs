//! How the program is started once more.

use std::ffi::OsString;
use std::process::Command;

/// A command line that starts the program with the arguments that it was started with.
///
/// The program may be a function inside of another one, so that the executable of the process is not enough to know.
#[derive(Clone, Debug)]
pub struct Itself {
    words: Vec<OsString>,
}

impl Itself {
    /// The executable of this process.
    pub fn this_executable() -> Self {
        let program = std::env::current_exe().map_or_else(|_| OsString::from("vice"), OsString::from);
        Self { words: vec![program] }
    }

    /// Another program with what it needs before the arguments of `vice`, such as an interpreter with a module.
    pub fn through(program: impl Into<OsString>, leading: impl IntoIterator<Item = OsString>) -> Self {
        Self { words: std::iter::once(program.into()).chain(leading).collect() }
    }

    /// The words that start it, without arguments.
    pub(crate) fn words(&self) -> Vec<OsString> {
        self.words.clone()
    }

    /// Adds the arguments.
    pub(crate) fn with(mut self, args: impl IntoIterator<Item = OsString>) -> Self {
        self.words.extend(args);
        self
    }

    /// The same once more.
    pub(crate) fn again(&self) -> Command {
        let mut command = Command::new(self.words.first().cloned().unwrap_or_default());
        command.args(self.words.iter().skip(1));
        command
    }
}
