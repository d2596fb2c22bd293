"""What the program is made of: a CycloneDX document and the licence texts of every crate.

    bill_of_materials.py FOLDER

Writes crumple-VERSION.cdx.json and THIRD-PARTY-LICENSES.txt, and fails where a crate names no licence or has no text of one.
"""

import json
import pathlib
import re
import subprocess
import sys
import tomllib

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

# Crates whose archive lacks the text of the licence that they name; it is one of our own two.
AS_OURS = {"MIT", "Apache-2.0"}
TEXT = re.compile(r"^(licen[cs]e|copying|copyright|notice|unlicense)", re.IGNORECASE)


def metadata():
    printed = subprocess.run(
        ["cargo", "metadata", "--format-version", "1", "--locked"], check=True, capture_output=True, text=True
    )
    return json.loads(printed.stdout)


def linked(found, roots):
    """Packages that end up in what is handed out, on any platform: no build scripts' and no tests' own."""
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    seen, left = set(), list(roots)
    while left:
        package = left.pop()
        if package in seen:
            continue
        seen.add(package)
        for dependency in nodes[package]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                left.append(dependency["pkg"])
    return seen


def main(folder):
    found = metadata()
    packages = {package["id"]: package for package in found["packages"]}
    members = set(found["workspace_members"])
    checksums = {
        (package["name"], package["version"]): package.get("checksum")
        for package in tomllib.loads(pathlib.Path("Cargo.lock").read_text())["package"]
    }
    used = sorted(linked(found, members) - members, key=lambda id: (packages[id]["name"], packages[id]["version"]))
    components, texts, wrong = [], [], []
    for package in (packages[id] for id in used):
        name, version, licence = package["name"], package["version"], package["license"]
        where = pathlib.Path(package["manifest_path"]).parent
        files = sorted(path for path in where.iterdir() if TEXT.match(path.name) and path.is_file())
        if licence is None and not package["license_file"]:
            wrong.append(f"{name} {version} names no licence")
        if not files and not AS_OURS & set(re.split(r" OR |/", licence or "")):
            wrong.append(f"{name} {version} ({licence}) has no text of its licence")
        component = {
            "type": "library",
            "bom-ref": f"pkg:cargo/{name}@{version}",
            "name": name,
            "version": version,
            "purl": f"pkg:cargo/{name}@{version}",
            "licenses": [{"expression": (licence or "").replace("/", " OR ")}],
        }
        if checksum := checksums.get((name, version)):
            component["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        components.append(component)
        heading = f"{name} {version}: {licence}"
        own = "\n\n".join(path.read_text(errors="replace").strip() for path in files)
        texts.append(f"{heading}\n{'=' * len(heading)}\n\n{own or 'No text beside the code; see LICENSE-MIT and LICENSE-APACHE.'}\n")
    if wrong:
        sys.exit("\n".join(wrong))
    program = next(package for package in found["packages"] if package["name"] == "crumple")
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": "crumple",
                "name": "crumple",
                "version": program["version"],
                "licenses": [{"expression": program["license"]}],
            }
        },
        "components": components,
        "dependencies": [{"ref": "crumple", "dependsOn": [component["bom-ref"] for component in components]}],
    }
    text = json.dumps(document, indent=1) + "\n"
    error = JsonStrictValidator(SchemaVersion.V1_5).validate_str(text)
    if error:
        sys.exit(f"the bill of materials is not CycloneDX 1.5: {error}")
    (folder / f"crumple-{program['version']}.cdx.json").write_text(text)
    (folder / "THIRD-PARTY-LICENSES.txt").write_text("\n\n".join(texts))
    print(f"{len(components)} crates in the bill of materials")


main(pathlib.Path(sys.argv[1]))
