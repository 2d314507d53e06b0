//! No code: `Cargo.toml` pins versions.
