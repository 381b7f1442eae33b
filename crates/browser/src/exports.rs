//! The functions that a page calls.
#![allow(unsafe_code, reason = "an exported name counts as unsafe")]

use std::cell::RefCell;

use crate::Session;

#[derive(Default)]
struct Module {
    session: Session,
    /// The request, and then its answer.
    buffer: Vec<u8>,
}

thread_local! {
    static MODULE: RefCell<Module> = RefCell::default();
}

/// Makes room for a request of `len` bytes. Returns its address.
#[unsafe(no_mangle)]
extern "C" fn buffer(len: usize) -> *mut u8 {
    MODULE.with_borrow_mut(|module| {
        module.buffer.clear();
        module.buffer.resize(len, 0);
        module.buffer.as_mut_ptr()
    })
}

/// Answers the request in the buffer. Returns the length of the answer.
#[unsafe(no_mangle)]
extern "C" fn call() -> usize {
    MODULE.with_borrow_mut(|module| {
        module.buffer = module.session.answer(&module.buffer);
        module.buffer.len()
    })
}

/// The address of the answer.
#[unsafe(no_mangle)]
extern "C" fn answer() -> *const u8 {
    MODULE.with_borrow(|module| module.buffer.as_ptr())
}
