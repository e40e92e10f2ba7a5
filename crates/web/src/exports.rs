//! Functions of the WebAssembly module for JavaScript.
//!
//! Bytes pass through one buffer. JavaScript asks for its address with [`reserve`], writes, and calls [`add_file`] for
//! each file, then [`run_fit`]. The buffer then has a [`FitOutput`](crate::FitOutput) as JSON, at [`output_address`].

// The names of exported functions are the reason why `unsafe` appears: two functions of one name would not be found by
// the compiler. No memory is accessed through pointers here.
#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Bytes from or for JavaScript, and the files so far.
struct Exchange {
    buffer: Vec<u8>,
    files: BTreeMap<PathBuf, Vec<u8>>,
}

static EXCHANGE: Mutex<Exchange> =
    Mutex::new(Exchange { buffer: Vec::new(), files: BTreeMap::new() });

/// The exchange, also after a panic.
fn exchange() -> MutexGuard<'static, Exchange> {
    EXCHANGE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes the buffer `length` bytes long, zeros, and returns its address.
#[unsafe(no_mangle)]
extern "C" fn reserve(length: usize) -> *mut u8 {
    let buffer = &mut exchange().buffer;
    buffer.clear();
    buffer.resize(length, 0);
    buffer.as_mut_ptr()
}

/// Adds a file. The buffer has its name in UTF-8, of `name_length` bytes, then its content.
#[unsafe(no_mangle)]
extern "C" fn add_file(name_length: usize) {
    let Exchange { buffer, files } = &mut *exchange();
    let mut name = std::mem::take(buffer);
    let content = name.split_off(name_length.min(name.len()));
    files.insert(String::from_utf8_lossy(&name).as_ref().into(), content);
}

/// Solves the fit in the file whose name is in the buffer. Removes the files, and returns the length of the output.
#[unsafe(no_mangle)]
extern "C" fn run_fit() -> usize {
    let mut exchange = exchange();
    let files = std::mem::take(&mut exchange.files);
    let output = crate::fit(files, &String::from_utf8_lossy(&exchange.buffer));
    exchange.buffer = serde_json::to_vec(&output).unwrap_or_default();
    exchange.buffer.len()
}

/// Address of the output of [`run_fit`].
#[unsafe(no_mangle)]
extern "C" fn output_address() -> *const u8 {
    exchange().buffer.as_ptr()
}
