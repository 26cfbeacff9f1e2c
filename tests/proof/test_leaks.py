"""The test for leaks finds one that is there, and is silent where there is none."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from proof import seal
from proof.bundle import pack
from proof.leaks import examine, permutation_p
from proof.trials import add_seal
from proof.truth import Concealed, Truth

KEY = seal.public(seal.new_key())
PORTS = ("motor torque", "joint torque", "transducer")


def truth(index: int) -> Truth:
    name = f"T{(index * 7919) % 10007:010X}"
    if index % 4 == 0:
        return Truth(trial=name, kind="nothing", split="development")
    effect = Concealed(
        port=PORTS[index % 3], axis="el", channels=("Tx",), family="unnamed", name="law", rho=300.0, rho_eff=300.0
    )  # type: ignore[arg-type]
    return Truth(trial=name, kind="concealed", split="development", level=300.0, effects=(effect,), rho_eff=300.0)


def recording(generator: np.random.Generator, epoch_s: float, samples: int) -> bytes:
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("s", "jsonschema", b"{}")
    channel = writer.register_channel("/transducer/wrench", "json", schema)
    for k in range(samples):
        stamp = int((epoch_s + 0.01 * k) * 1e9)
        writer.add_message(channel, log_time=stamp, publish_time=stamp, data=generator.bytes(16))
    writer.finish()
    return file.getvalue()


def trials(folder: Path, *, leak: str) -> tuple[dict[str, bytes], list[Truth]]:
    """Sixty small trials; with a leak, something about those with a concealed effect differs."""
    packed, truths = {}, []
    for index in range(60):
        generator = np.random.default_rng(index)
        told = truth(index)
        concealed = told.kind == "concealed"
        root = folder / leak / told.trial
        (root / "recordings").mkdir(parents=True)
        epoch = 8e8 + 1e8 * generator.uniform() + (2e8 if leak == "epoch" and concealed else 0.0)
        samples = 10 + int(generator.integers(4))
        for k in range(2):
            content = recording(generator, epoch + 900.0 * k, samples)
            (root / "recordings" / f"{generator.bytes(4).hex()}.mcap").write_bytes(content)
        (root / "campaign.toml").write_text("title = 'x'\n" * (2 if leak == "text" and concealed else 1))
        add_seal(root, told, KEY)
        packed[told.trial] = pack(root)
        truths.append(told)
    return packed, truths


@pytest.mark.parametrize(("leak", "told_by"), [("epoch", {"epoch"}), ("text", {"description", "lines", "size"})])
def test_a_leak_is_found_and_named(leak: str, told_by: set[str], tmp_path: Path) -> None:
    found = examine(*trials(tmp_path, leak=leak))["anything concealed"]
    assert found["p"] < 0.001
    assert found["most telling"].replace("'s", ",").split(",")[0] in told_by


def test_where_there_is_none_nothing_is_told(tmp_path: Path) -> None:
    found = examine(*trials(tmp_path, leak="none"))
    assert all(answer["p"] > 0.01 for answer in found.values()), found
    assert found["port"]["trials"] == 60 and found["port"]["properties"] > 10


def test_p_values_of_no_relation_are_uniform() -> None:
    generator = np.random.default_rng(3)
    p = [permutation_p(generator.standard_normal((24, 8)), generator.integers(0, 2, 24), seed) for seed in range(12)]
    assert 0.2 < np.mean(p) < 0.8 and min(p) > 0.002
