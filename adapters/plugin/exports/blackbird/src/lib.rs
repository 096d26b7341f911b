//! The format `blackbird` as a plugin: the same code as the built-in one, exported.

vice_abi::export_plugin!(vice_blackbird::Blackbird);
