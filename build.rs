//! Compiles the C sources of exported FMUs (src/formats/fmu/c) for Linux and Windows, so that no user
//! of an export needs a compiler. A platform whose compiler is absent is left out; to take it up once
//! it is there, `touch build.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// A platform that FMUs run on.
struct Platform {
    /// Names of its folder in FMI 2 and FMI 3.
    folders: [&'static str; 2],
    extension: &'static str,
    flags: &'static [&'static str],
}

const PLATFORMS: [Platform; 2] = [
    Platform {
        folders: ["linux64", "x86_64-linux"],
        extension: "so",
        flags: &["-fPIC", "-fvisibility=hidden", "-Wl,--build-id=none"],
    },
    Platform {
        folders: ["win64", "x86_64-windows"],
        extension: "dll",
        // Otherwise the address follows from the file's name.
        flags: &["-static-libgcc", "-Wl,--no-insert-timestamp", "-Wl,--image-base=0x180000000"],
    },
];

/// The same bytes wherever it is compiled with the same compiler; the same sums as Rust's, which
/// never contracts a·b + c; and no calls that need a recent C library.
const FLAGS: [&str; 12] = [
    "-std=c99",
    "-O2",
    "-Wall",
    "-Wextra",
    "-ffp-contract=off",
    "-fno-builtin",
    "-fno-tree-loop-distribute-patterns",
    "-fno-stack-protector",
    "-frandom-seed=crumple",
    "-ffile-prefix-map=.=crumple",
    "-shared",
    "-s",
];

fn main() -> io::Result<()> {
    let sources = Path::new("src/formats/fmu/c");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={}", sources.display());
    println!("cargo::rerun-if-env-changed=CC");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    let mut files = Vec::new();
    for entry in sources.read_dir()? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "c") {
            files.extend(path.file_name().map(PathBuf::from));
        }
    }
    files.sort();
    let mut ready = String::from("[\n");
    for platform in PLATFORMS {
        let library = out.join("crumple_spring").with_extension(platform.extension);
        let compiler = compiler(&platform);
        let mut command = Command::new(&compiler);
        command.current_dir(sources).args(FLAGS).args(platform.flags).arg("-o").arg(&library);
        let [fmi2, fmi3] = platform.folders;
        match command.args(&files).output() {
            Ok(output) if output.status.success() => ready.push_str(&format!(
                "Binary {{ folders: [{fmi2:?}, {fmi3:?}], extension: {:?}, bytes: include_bytes!({library:?}) }},\n",
                platform.extension
            )),
            Ok(output) => {
                let said = String::from_utf8_lossy(&output.stderr);
                let first = said.lines().find(|l| l.contains("error")).unwrap_or("no reason given");
                println!("cargo::warning=exported FMUs have no {fmi2} binary: {compiler}: {first}");
            }
            // `fmu::binaries` tells it; most builders never export an FMU for that platform.
            Err(_) => {}
        }
    }
    ready.push_str("]\n");
    fs::write(out.join("fmu_binaries.rs"), ready)
}

/// The compiler's name: the machine's own where it makes binaries for the platform.
fn compiler(platform: &Platform) -> String {
    let host = env::var("HOST").unwrap_or_default();
    let is_own = host.starts_with("x86_64") && host.contains("linux");
    match platform.extension {
        "dll" => "x86_64-w64-mingw32-gcc".into(),
        _ if is_own => env::var("CC").unwrap_or_else(|_| "cc".into()),
        _ => "x86_64-linux-gnu-gcc".into(),
    }
}
