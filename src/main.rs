//! The command line tool: arguments in, exit code out. See `cli`.

fn main() -> std::process::ExitCode {
    crumple::cli::main()
}
