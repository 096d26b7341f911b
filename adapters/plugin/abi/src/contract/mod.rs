//! The contract, as `include/vice_plugin.h` says it in C: the same names, the same types in the same order (a test reads
//! both and compares). Its comment on conventions, memory, errors and threads is not repeated here.
//!
//! Everything that the other side fills is valid for any bits: there is no enum, no `bool`, no reference, and function
//! pointers are optional.

mod constants;
mod table;
mod values;

pub use constants::*;
pub use table::*;
pub use values::*;
