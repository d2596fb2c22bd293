"""Whether our functions are declared as in the standard's headers, which FMPy brings.

    python fmu_headers.py FOLDER_OF_OUR_SOURCES

The headers and our files are compiled together; a function that differs is an error of the
compiler. Enumerations of the headers become int, as ours are, and their structures take the place of
ours. Prints a JSON object with the functions that both have, and those that we lack.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import fmpy

HEADERS = pathlib.Path(fmpy.__file__).parent / "c-code"
OURS = {"callbacks_t": "fmi2CallbackFunctions", "event_info_t": "fmi2EventInfo"}


def with_plain_enums(text):
    return re.sub(r"typedef enum\s*(\{[^}]*\})\s*(\w+);", r"enum \1; typedef int \2;", text)


def main(folder):
    ours = pathlib.Path(folder)
    found = []
    with tempfile.TemporaryDirectory() as name:
        here = pathlib.Path(name)
        for header in HEADERS.glob("fmi[23]*.h"):
            (here / header.name).write_text(with_plain_enums(header.read_text()))
        for header in ours.glob("*.h"):
            (here / header.name).write_text(header.read_text())
        for source, header in [("fmi2", "fmi2"), ("fmi3", "fmi3"), ("fmi3_none", "fmi3")]:
            text = (ours / f"{source}.c").read_text()
            for mine, theirs in OURS.items():
                text = re.sub(
                    r"typedef struct \{[^}]*\} " + mine + ";", f"typedef {theirs} {mine};", text
                )
            # The standard names the members of the callbacks otherwise.
            text = text.replace("callbacks->environment", "callbacks->componentEnvironment")
            file = here / f"{source}.c"
            file.write_text(f'#include "{header}Functions.h"\n' + text)
            command = ["cc", "-std=c99", "-Wall", "-Werror", "-c", "-I", here, file]
            subprocess.run([*command, "-o", here / f"{source}.o"], check=True)
            names = subprocess.run(["nm", here / f"{source}.o"], capture_output=True, text=True)
            found += re.findall(r" T (fmi\w+)", names.stdout)
        declared = []
        for version in ["fmi2", "fmi3"]:
            text = (HEADERS / f"{version}Functions.h").read_text()
            declared += re.findall(rf"{version}FullName\((\w+)\)", text)
            declared += re.findall(rf"^FMI3_Export \w+ (\w+);", text, re.MULTILINE)
    declared = {name for name in declared if name.startswith("fmi")}
    print(json.dumps({
        "both": sorted(declared & set(found)),
        "lacking": sorted(declared - set(found)),
        "more": sorted(set(found) - declared),
    }))


if __name__ == "__main__":
    main(sys.argv[1])
