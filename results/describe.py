#!/usr/bin/env python3
"""Copies a bundle of `swarmctl export`, and adds its author and license to the description.

    results/describe.py BUNDLE TO --author NAME --orcid ID --license URL

All else keeps its bytes, so `swarmctl verify` proves the copy like the bundle. Needs Python 3.9 and
nothing else.
"""

import argparse
import json
import zipfile
from pathlib import Path

METADATA = "ro-crate-metadata.json"


def described(text, arguments):
    """The description with an author and a license: https://w3id.org/ro/crate/1.3."""
    crate = json.loads(text)
    root = next(entity for entity in crate["@graph"] if entity["@id"] == "./")
    author = {"@id": f"https://orcid.org/{arguments.orcid}"}
    root.update(author=author, license={"@id": arguments.license})
    crate["@graph"].append({**author, "@type": "Person", "name": arguments.author})
    return json.dumps(crate, indent=2)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bundle")
    parser.add_argument("to")
    for option in ("author", "orcid", "license"):
        parser.add_argument(f"--{option}", required=True)
    arguments = parser.parse_args()
    if Path(arguments.to).exists():
        parser.error(f"{arguments.to} exists; name another file for the copy")
    with zipfile.ZipFile(arguments.bundle) as bundle, zipfile.ZipFile(arguments.to, "w") as copy:
        for entry in bundle.infolist():
            data = bundle.read(entry)
            copy.writestr(entry, described(data, arguments) if entry.filename == METADATA else data)


if __name__ == "__main__":
    main()
