//! Shared-memory services.
