"""Write the pins of all crates into this folder's Cargo.toml, from the versions in Cargo.lock.

    python solvers/pins/write.py

For newer versions delete the lines of `[dependencies]` there and run `cargo update` before.
"""

from __future__ import annotations

import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).parent
PINS = HERE / "Cargo.toml"
MARK = "[dependencies]\n"


def pins() -> str:
    """A line for each crate that the workspace does not name itself."""
    workspace = tomllib.loads((HERE.parent / "Cargo.toml").read_text("utf-8"))["workspace"]
    locked = tomllib.loads((HERE.parent / "Cargo.lock").read_text("utf-8"))["package"]
    crates = [(crate["name"], crate["version"].split("+")[0]) for crate in locked if "source" in crate]
    names = [name for name, _ in crates]
    others = [crate for crate in locked if crate["name"] != "feedplan-pins"]
    needed = {need.split()[0] for crate in others for need in crate.get("dependencies", ())}
    lines = []
    for name, version in sorted(crates):
        if name in workspace["dependencies"] or name not in needed:
            continue
        # Of two versions each gets a name of its own.
        own, package = name, ""
        if names.count(name) > 1:
            own, package = f"{name}-{version}".replace(".", "-"), f'package = "{name}", '
        pin = f'version = "={version}", default-features = false, optional = true'
        lines.append(f"{own} = {{ {package}{pin} }}\n")
    return "".join(lines)


if __name__ == "__main__":
    head = PINS.read_text("utf-8").split(MARK)[0]
    PINS.write_text(head + MARK + pins(), encoding="utf-8")
