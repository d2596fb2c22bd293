"""A Python for Windows to try a wheel with under wine: windows_python.py FOLDER WHEEL

Python's own builds cannot be installed by name. The wheel of Panda3D for Windows has the library and the extension
modules of CPython 3.11, with which its users package programs; the modules in Python are those of the Python that runs this.
What starts it, and `python3.dll`, which passes the stable interface on, are linked here by mingw. The wheel is put into
`site-packages` with the oldest NumPy that it takes: wine 8 lacks functions of the C library that newer ones call.
"""

import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

folder, wheel = Path(sys.argv[1]), Path(sys.argv[2])
COMPILER, OBJDUMP = "x86_64-w64-mingw32-gcc", "x86_64-w64-mingw32-objdump"
START = """
#include <windows.h>
typedef int (*start_t)(int, wchar_t **);
int wmain(int count, wchar_t **words) {
    HMODULE python = LoadLibraryA("python311.dll");
    start_t start = python ? (start_t)GetProcAddress(python, "Py_Main") : 0;
    return start ? start(count, words) : 200;
}
"""
assert sys.version_info[:2] == (3, 11), "the modules in Python are of 3.11, as the library is"


def install(into, *arguments):
    of_windows = ["--platform", "win_amd64", "--python-version", "3.11", "--implementation", "cp", "--only-binary=:all:"]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    subprocess.run([*pip, "--target", into, *of_windows, *arguments], check=True)


with tempfile.TemporaryDirectory() as room:
    room = Path(room)
    (folder / "DLLs").mkdir(parents=True)
    install(room / "panda", "panda3d==1.10.16")
    for file in (room / "panda/deploy_libs").iterdir():
        if file.suffix == ".pyd":
            shutil.copy(file, folder / "DLLs")
        elif file.name.lower() in ("python311.dll", "vcruntime140.dll", "libffi-8.dll"):
            shutil.copy(file, folder)
    left_out = shutil.ignore_patterns("site-packages", "test", "__pycache__", "config-*", "lib-dynload")
    shutil.copytree(sysconfig.get_paths()["stdlib"], folder / "Lib", ignore=left_out)
    site = folder / "Lib/site-packages"
    install(site, "numpy==1.26.4", wheel)

    (room / "start.c").write_text(START)
    subprocess.run([COMPILER, "-municode", "-o", folder / "python.exe", room / "start.c"], check=True)
    imports = subprocess.run([OBJDUMP, "-p", site / "crumple/_crumple.pyd"], check=True, capture_output=True, text=True).stdout
    stable = imports.split("DLL Name: python3.dll")[1].split("DLL Name: ")[0]
    names = sorted(set(re.findall(r"\b_?Py\w+", stable)))
    (room / "stable.def").write_text("LIBRARY python3.dll\nEXPORTS\n" + "".join(f"{name}=python311.{name}\n" for name in names))
    (room / "stable.c").write_text("int DllMain(void *module, unsigned reason, void *reserved) { return 1; }\n")
    link = ["-shared", "-nostdlib", "-Wl,-e,DllMain", "-o", folder / "python3.dll"]
    subprocess.run([COMPILER, *link, room / "stable.c", room / "stable.def"], check=True)
