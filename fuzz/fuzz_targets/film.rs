#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| vice_tests::fuzzing::target("film").run(bytes));
