"""What is left, and where does it live?"""

from __future__ import annotations

from kbs_process.report import curves
from kbs_process.report.panel import Block, Caption, Figure, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.studies.diagnose import figures
from kbs_process.studies.diagnose.results import DiagnosisResults

_CHANNELS = Caption(
    shown="What is left of each channel over the floor, with everything that was found in the plant.",
    good="About 1 everywhere.",
    bad="One channel far above the others: its own sensor. One axis' channels: physics of that axis.",
    do="Look at that channel's spectrum and history below.",
)
_SPECTRA = Caption(
    shown="Power spectral density of what is unexplained, over that of the floor (dashed): known parameters refitted "
    "(before), with the finds (after).",
    good="After lies on the floor at all frequencies.",
    bad="A hump above the floor: physics that is still left out.",
    do="Find the motor order or resonance at the hump.",
)
_HISTORIES = Caption(
    shown="The same in time, in the channels' units.",
    good="After looks like noise, whatever the drives do; what an encoder's code rounds (half a step at most) is the "
    "floor's, and moves with the drives.",
    bad="Bursts that come again with position, rate or time.",
    do="Compare their instants with the commands.",
)


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """Channels of all recordings, spectra and histories of those held out."""
    blocks: list[Block] = [Figure("What is left, channel by channel", (figures.channels(results.trials),), _CHANNELS)]
    shown = [entry for entry in results.trials if entry.role == "held-out"] or list(results.trials)
    spectra, histories = [], []
    for entry in shown:
        channels = tuple(entry.channels)
        if (table := tables.read("residual_spectrum", entry.recording)) is not None:
            spectra.append(curves.spectra(table, channels, entry.recording, below="floor"))
        if (table := tables.read("residual", entry.recording)) is not None:
            histories.append(curves.histories(table, channels, entry.recording))
    if spectra:
        blocks.append(Figure("Spectra of the residual", tuple(spectra), _SPECTRA))
    if histories:
        blocks.append(Figure("Histories of the residual", tuple(histories), _HISTORIES))
    blocks += [Text(note) for note in results.notes]
    return Panel("remaining", "What remains", "What is left, and where does it live?", tuple(blocks))
