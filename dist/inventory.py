"""Writes the SBOM of a program's libraries, and their licences.

usage: inventory.py MANIFEST PACKAGE TARGET --sbom FILE --licences FILE

Lists the libraries that Cargo links for the target, without those of tests and of the build itself.
The SBOM is CycloneDX, in JSON, without times and random numbers.
"""

import argparse
import json
import subprocess
from pathlib import Path

from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL

# Beginnings of the names of files with licences.
TEXTS = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "COPYRIGHT", "UNLICENSE")


def metadata(manifest: Path, target: str) -> dict:
    """Cargo's description of the packages of a workspace."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    command += ["--filter-platform", target, "--manifest-path", manifest]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


def linked(found: dict, name: str) -> dict[str, list[str]]:
    """The ids of a package and of all packages linked into it, each with its dependencies."""
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    packages = {package["id"]: package for package in found["packages"]}
    members = set(found["workspace_members"])
    waiting = [id for id in members if packages[id]["name"] == name]
    needs: dict[str, list[str]] = {}
    while waiting:
        id = waiting.pop()
        if id in needs:
            continue
        ordinary = [
            dep["pkg"]
            for dep in nodes[id]["deps"]
            if any(kind["kind"] is None for kind in dep["dep_kinds"])
        ]
        # A procedural macro runs in the compiler; nothing of it is in the program.
        kinds = {dep: packages[dep]["targets"] for dep in ordinary}
        needs[id] = [
            dep
            for dep in ordinary
            if not any("proc-macro" in target["kind"] for target in kinds[dep])
        ]
        waiting += needs[id]
    return needs


def component(package: dict, kind: ComponentType) -> Component:
    licence = package["license"]
    # Old manifests write a slash for `OR`.
    expression = LicenseExpression(licence.replace("/", " OR ")) if licence else None
    return Component(
        type=kind,
        name=package["name"],
        version=package["version"],
        bom_ref=f"{package['name']}@{package['version']}",
        purl=PackageURL("cargo", None, package["name"], package["version"]),
        licenses=[expression] if expression else [],
    )


def sbom(packages: list[dict], needs: dict[str, list[str]], name: str) -> str:
    """The SBOM of a program."""
    components = {
        package["id"]: component(
            package,
            ComponentType.APPLICATION if package["name"] == name else ComponentType.LIBRARY,
        )
        for package in packages
    }
    program = next(c for c in components.values() if c.name == name)
    bom = Bom(components=[c for c in components.values() if c is not program])
    bom.metadata.component = program
    for id, dependencies in needs.items():
        bom.register_dependency(components[id], [components[dep] for dep in dependencies])
    text = make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string()
    document = json.loads(text)
    # Two builds of one commit have the same SBOM.
    del document["serialNumber"], document["metadata"]["timestamp"]
    text = json.dumps(document, indent=1, sort_keys=True) + "\n"
    error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    assert error is None, error
    return text


def licences(packages: list[dict]) -> str:
    """The licences of other people's libraries, with each text once."""
    texts: dict[str, list[str]] = {}
    for package in packages:
        if package["source"] is None:
            continue
        label = f"{package['name']} {package['version']}: {package['license']}"
        folder = Path(package["manifest_path"]).parent
        files = [path for path in sorted(folder.iterdir()) if path.name.upper().startswith(TEXTS)]
        files = [path for path in files if path.is_file()]
        if not files:
            texts.setdefault("(its package has no text of the licence)\n", []).append(label)
        for path in files:
            text = path.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n")
            texts.setdefault(text.strip() + "\n", []).append(label)
    rule = "\n" + "-" * 80 + "\n\n"
    return rule.join("\n".join(labels) + "\n\n" + text for text, labels in texts.items())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("manifest", type=Path)
    parser.add_argument("package")
    parser.add_argument("target")
    parser.add_argument("--sbom", type=Path, required=True)
    parser.add_argument("--licences", type=Path, required=True)
    args = parser.parse_args()
    found = metadata(args.manifest, args.target)
    needs = linked(found, args.package)
    packages = sorted(
        (package for package in found["packages"] if package["id"] in needs),
        key=lambda package: (package["name"], package["version"]),
    )
    args.sbom.write_text(sbom(packages, needs, args.package), encoding="utf-8")
    args.licences.write_text(licences(packages), encoding="utf-8")
    print(f"{len(packages)} packages are in {args.package}")


main()
