"""What would tell what these recordings leave open?"""

from __future__ import annotations

from kbs_process.report.panel import Block, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import count, number, percent
from kbs_process.studies.diagnose.results import DiagnosisResults, NextTest

_NOTHING = "No detection has an open rival, and none has a parameter with a sigma above 10 %."


def panel(results: DiagnosisResults, tables: Tables) -> Panel:
    """The proposed trajectory, what it will show, and what others would."""
    test = results.next_test
    blocks: tuple[Block, ...] = (Text(_NOTHING),) if test is None else _blocks(test)
    if test is None and not results.finds:
        blocks = (Text("There is no detection that a further test could confirm or measure better."),)
    return Panel("next", "Next test", "Which test would answer what is open?", blocks)


def _blocks(test: NextTest) -> tuple[Block, ...]:
    if test.rivals and test.distance is not None and test.p_wrong is not None:
        question = f"These recordings do not distinguish {test.law} from {', '.join(test.rivals)}."
        power = (
            f"One recording of it sets the nearest rival {number(test.distance)} sigma apart, with nominal parameters "
            f"refitted: the wrong effect would be chosen in {percent(test.p_wrong, 2)} of cases. "
            f"{count(test.recordings, 'recording')} bring that to 1 %."
        )
        worth = "Distance / sigma"
    else:
        question = f"{test.law} has a parameter with a sigma above 10 %."
        share = percent(1.0 if test.sigma is None else test.sigma, 2)
        power = f"One recording of it brings the least known of them to {share} of its present sigma."
        worth = "Information, root"
    rows = tuple((entry.trajectory, number(entry.worth)) for entry in test.tried)
    note = "Through the plant linearised along each trajectory's simulation; nominal parameters as fitted."
    return (
        Text(f"{question} Run next, for {number(test.seconds)} s: {test.trajectory}. {power}"),
        Text("Commands for kbs-process simulate --command, within the recorded range of motion:", (test.file,)),
        Grid("Trajectories that were compared, best first", ("Trajectory", worth), rows, "lr", note),
    )
