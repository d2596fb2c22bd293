//! The command line tool: arguments in, exit code out. See `cli`.

// The released program for Linux is linked with musl, whose own allocator is slow.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    crumple::cli::main()
}
