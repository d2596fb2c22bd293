//! The command line tool: arguments in, exit code out. See `cli`.

// The allocator of musl, with which the released program for Linux is linked, takes twice the time.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    crumple::cli::main()
}
