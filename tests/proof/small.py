"""The small set that every change is tested on: `python -m proof.small`, run from tests/, makes it again.

Two development trials, cut down to a calibration, two recordings to fit and one held out: nothing concealed but
parameters off within their uncertainty, and a clear effect. They are packed and sealed like all others; what a test
expects of them was seen to be right once.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import msgspec

from proof import seal
from proof.bundle import pack
from proof.concealed.trials import Spec, chosen, make
from proof.trials import add_seal
from proof.truth import Truth

FOLDER = Path(__file__).parent / "small"
KEY = FOLDER / "key"
_KEPT = (("calibration", 1), ("fit", 1), ("fit", 2), ("held-out", 3))  # role and repeat, of the first trajectory
_SPECIFICATIONS = {
    "T00000000A1": Spec("development", 7, 1, "within"),
    "T00000000B7": chosen("development", 7, 0, ["rounded triangle of transmission error"], 300.0),
}


def main() -> None:
    """Make what is missing of the small set."""
    FOLDER.mkdir(exist_ok=True)
    if not KEY.is_file():
        KEY.write_bytes(seal.new_key())
    key = KEY.read_bytes()
    for name, specification in _SPECIFICATIONS.items():
        if (FOLDER / f"{name}.tar").is_file():
            continue
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / name
            told = make(specification, folder) | {"trial": name}
            _cut(folder)
            add_seal(folder, msgspec.convert(told, Truth), seal.public(key))
            content = pack(folder)
        (FOLDER / f"{name}.tar").write_bytes(content)
        print(f"{name}: {len(content) / 1e6:.2f} MB", flush=True)


def _cut(folder: Path) -> None:
    """Keep what `_KEPT` says; strength falls by a third, as half of the fitted recordings go."""
    description = folder / "campaign.toml"
    head, *entries = description.read_text().split("[[recording]]\n")
    kept = []
    for entry in entries:
        of_first = "TRACK2" not in entry and "TRACK3" not in entry
        if of_first and any(f'role = "{role}"' in entry and f"repeat = {n}" in entry for role, n in _KEPT):
            kept.append(entry)
        else:
            file = entry.split('file = "')[1].split('"')[0]
            (folder / file).unlink()
    description.write_text("[[recording]]\n".join([head, *kept]))


if __name__ == "__main__":
    main()
