//! The program `rodfit`: calls [`rodfit::command::run`] with the arguments of the process and exits with its code. Exit
//! codes: 0 done; 2 bad input; 3 could not be computed, did not converge, or not identifiable.

/// Runs the command line of the process.
fn main() -> std::process::ExitCode {
    rodfit::command::run(std::env::args_os()).into()
}
