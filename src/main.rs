//! The `rodfit` command: simulate, static, modes, study, check, fit and more. Exit codes: 0 done; 2 bad input; 3 could not be
//! computed, did not converge, or not identifiable.

fn main() -> std::process::ExitCode {
    rodfit::command::run(std::env::args_os()).into()
}
