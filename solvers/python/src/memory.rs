//! Gives memory that has been freed back to the system.
//!
//! A fit, a plan or a table of lengths allocates many small arrays on several threads, and NumPy allocates large ones on its own
//! thread. The C library of Linux keeps freed memory for the thread that has allocated it. Later stages, on other threads, would
//! allocate theirs in addition: 0.9 GB in a plan of a million blocks.

/// Gives freed memory back to the system, with allocators that keep it until they are told to (glibc).
#[allow(unsafe_code)]
pub fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        extern "C" {
            fn malloc_trim(pad: usize) -> std::ffi::c_int;
        }
        // SAFETY: glibc's function takes any number of bytes to keep and may be called by any thread at any time.
        unsafe { malloc_trim(0) };
    }
}
