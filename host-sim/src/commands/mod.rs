//! One file per subcommand.

pub(crate) mod fly;
pub(crate) mod solve;
