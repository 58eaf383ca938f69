//! What the host-in-the-loop tests share.
