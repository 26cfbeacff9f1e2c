"""Write the time loop of several plants of one structure side by side: number by number the same as each alone.

A processor's vector does with eight numbers at once what it does with one. Every plant has a lane of each row of `s`:
its parameters, its state, the fields, its wrench, and what the parts of a step hand on to each other. Rows are of a
fixed length and all in one array, so that the compiler sees that they do not overlap; each innermost loop is over the
lanes, without a branch.
"""

from __future__ import annotations

from kbs_process.plant.compiled.mounting import vector_of
from kbs_process.plant.compiled.stepping import (
    ROTOR_STEPS,
    InVector,
    drifted,
    handed_over,
    kicked,
    prepared,
    state_layout,
    turned,
)
from kbs_process.plant.structure import Structure

LANES = 8  # doubles in the widest vector
_OF_JOINTS = (
    "drifted", "q", "qd", "carrier", "turning", "spin", "theta", "w", "share", "inverse", "begin", "pitch", "out"
)  # fmt: skip


class InRows(InVector):
    """The numbers of the state in the rows of a lane, behind the parameters."""

    def __init__(self, structure: Structure) -> None:
        super().__init__(structure)
        self.first = structure.size

    def place(self, i: int) -> str:
        """Number `i` of all."""
        return f"s[{LANES * (self.first + i)} + l]"


class Rows:
    """Which rows of `s` hold what: parameters, state, fields at a step's ends, its wrench, what is handed on."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        layout = state_layout(structure)
        self.state = slice(structure.size, structure.size + max(part.stop for part in layout.values()))
        self.q, self.qd = (structure.size + layout[name].start for name in ("q", "qd"))
        n = structure.joints
        self.field_0, self.field_1 = self.state.stop, self.state.stop + n
        self.wrench = self.state.stop + 2 * n
        self._first = self.wrench + 6
        self._rows: dict[str, tuple[int, int]] = {}
        self.count = self._first
        for name, size in self._handed_on():
            self._rows[name] = self.count, size
            self.count += size

    def _handed_on(self) -> list[tuple[str, int]]:
        """Names of a step's text that outlive one of its loops, with how many numbers they are; 0 for one alone."""
        n, z = self.structure.joints, len(self.structure.states)
        names = [("alpha", 3), ("omega", 3), ("drifted", 3)]
        names += [(f"r_{load.effect.name}", 3) for load in self.structure.forces]
        for j in range(n):
            names += [(f"a_{j}", 3), (f"S_{j}", 6), (f"I_{j}", 10)]
            names += [(f"{name}_{j}", 1) for name in [*_OF_JOINTS, *["ground"] * self.structure.grounded]]
            names += [(f"z_{j}", max(z, 1)), (f"zd_{j}", max(z, 1))]
        return names

    def _is_tuple(self, name: str) -> bool:
        return self._rows[name][1] > 1 or name.startswith(("z_", "zd_"))

    def stored(self, names: list[str]) -> list[str]:
        """Emit what puts names into their rows."""
        lines = []
        for name in names:
            row, size = self._rows[name]
            of = [f"{name}[{i}]" for i in range(size)] if self._is_tuple(name) else [name]
            lines += [f"    s[{LANES * (row + i)} + l] = {value}" for i, value in enumerate(of)]
        return lines

    def loaded(self, names: list[str]) -> list[str]:
        """Emit what takes them from there."""
        lines = []
        for name in names:
            row, size = self._rows[name]
            of = [f"s[{LANES * (row + i)} + l]" for i in range(size)]
            lines.append(f"    {name} = {vector_of(of) if self._is_tuple(name) else of[0]}")
        return lines

    @property
    def names(self) -> list[str]:
        """All that is handed on."""
        return list(self._rows)

    def of_rotors(self, *names: str) -> list[str]:
        """Some names for all joints."""
        return [f"{name}_{j}" for j in range(self.structure.joints) for name in names]


def lanes_text(structure: Structure) -> str:
    """Return the text that a plant's module ends with."""
    state, rows = InRows(structure), Rows(structure)
    n = structure.joints
    turning = ["theta", "w", "z", "zd", "out", *["ground"] * structure.grounded]
    still = ["q", "qd", "turning", "share", "inverse", "begin", "pitch"]
    ends = [
        "    p = parameters[:, l]",
        *[
            f"    field_{end} = {vector_of([f's[{LANES * (row + j)} + l]' for j in range(n)])}"
            for end, row in enumerate((rows.field_0, rows.field_1))
        ],
    ]
    times = ["    half = 0.5 * H", "    ahead = H * H / 12.0", f"    h = H / {ROTOR_STEPS}"]
    guess = ", ".join([*(state.at("omegad", i) for i in range(3)), *(state.at("qdd", j) for j in range(n))])
    last = [name for name in rows.names if not name.startswith(("share_", "inverse_", "begin_", "pitch_"))]
    begin = [*ends, *drifted(structure, state), *prepared(structure, state), *rows.stored(rows.names)]
    turn = [
        *ends,
        *rows.loaded(rows.of_rotors(*still, *turning)),
        *turned(structure, state),
        *rows.stored(rows.of_rotors(*turning)),
    ]
    finish = [
        "    p = parameters[:, l]",
        *rows.loaded(last),
        f"    guess = ({guess})",
        *handed_over(structure, state),
        *kicked(structure, state),
        *[f"    s[{LANES * (rows.wrench + i)} + l] = wrench[{i}]" for i in range(6)],
    ]
    step = [
        "@compiled",
        "def step_lanes(s, time, H, lanes):",
        '    """Advance all lanes by H."""',
        f"    parameters = carray(address(s), ({structure.size}, {LANES}))",
        *times,
        *_over_lanes(begin, 1),
        f"    for i in range({ROTOR_STEPS}):",
        *_over_lanes(turn, 2),
        *_over_lanes(finish, 1),
    ]
    numbers = {
        "LANES": LANES,
        "SIZE": structure.size,
        "Q": rows.q,
        "QD": rows.qd,
        "FIELD_0": rows.field_0,
        "FIELD_1": rows.field_1,
        "WRENCH": rows.wrench,
    }
    loop = _LOOP
    for name, number in numbers.items():
        loop = loop.replace(f"<{name}>", str(number))
    head = ["from numba import carray", "from kbs_process.plant.compiled.kernels import address", "", ""]
    return "\n".join([*head, *step, "", "", loop])


def _over_lanes(lines: list[str], depth: int) -> list[str]:
    indent = "    " * depth
    # A number that the compiler does not know: it takes loops that it knows to be short for not worth its while.
    return [f"{indent}for l in range(lanes):", *(f"{indent}{line}" for line in lines)]


_LOOP = '''@njit(cache=True, nogil=True, error_model="numpy")
def advance_lanes(
    first, count, H, s, cursor, closed, recorded, latency, command, rate, encoder, readings, gains, sums,
    knots, fields, per_sample, held, low_pass, drive_in, amplifier, wrench, angle_rate, angle_first, angle,
):
    """As `advance`, of all lanes: what belongs to one has the lane for its first axis; held is (6, lanes)."""
    n = angle.shape[2]
    order = drive_in.shape[1]
    parameters = carray(address(s), (<SIZE>, <LANES>))
    now = np.empty(n)
    before = np.empty((n, <LANES>))
    old = np.empty(order)
    samples = 0
    taken = 0
    for i in range(first, first + count):
        time = i * H
        end = (i + 1) * H
        while cursor[1] < knots.shape[0] - 1 and knots[cursor[1]] < end - 1e-3 * H:
            lag = knots[cursor[1]] - time
            for l in range(<LANES>):
                for j in range(n):
                    now[j] = s[(<Q> + j) * <LANES> + l] + lag * s[(<QD> + j) * <LANES> + l]
                control(
                    cursor[1], now, closed, recorded, latency, command, rate, encoder[l], readings[l], gains[l],
                    sums[l], knots, fields[l],
                )
            cursor[1] += 1
        ahead = follow(time, end, cursor, knots)
        for l in range(<LANES>):
            p = parameters[:, l]
            for j in range(n):
                s[(<FIELD_0> + j) * <LANES> + l] = field_late(time, cursor[0], cursor[1], knots, fields[l], j, p)
                s[(<FIELD_1> + j) * <LANES> + l] = field_late(end, ahead, cursor[1], knots, fields[l], j, p)
                before[j, l] = s[(<Q> + j) * <LANES> + l]
        sampling = i % per_sample == 0
        if sampling and order > 0:
            for l in range(<LANES>):
                for c in range(6):
                    wrench[l, samples, c] = amplifier[l, c, order - 1]
        step_lanes(s, time, H, encoder.shape[0])
        if sampling:
            if order == 0:
                for l in range(<LANES>):
                    for c in range(6):
                        wrench[l, samples, c] = 0.5 * (held[c, l] + s[(<WRENCH> + c) * <LANES> + l])
            samples += 1
        for l in range(<LANES>):
            for c in range(6):
                force = s[(<WRENCH> + c) * <LANES> + l]
                held[c, l] = force
                for a in range(order):
                    old[a] = amplifier[l, c, a]
                for a in range(order):
                    value = drive_in[l, a] * force
                    for b in range(order):
                        value += low_pass[l, a, b] * old[b]
                    amplifier[l, c, a] = value
        while taken < angle.shape[1]:
            due = (angle_first + taken) / angle_rate
            if due > end - 5e-10:
                break
            share = (due - time) / H
            for l in range(<LANES>):
                for j in range(n):
                    angle[l, taken, j] = before[j, l] + share * (s[(<Q> + j) * <LANES> + l] - before[j, l])
            taken += 1
    return taken
'''
