#![no_main]

#[path = "../targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(init: targets::let_readers_catch_panics(), |bytes: &[u8]| {
    targets::guide(bytes);
});
