"""Modal models as the text of a file that loads."""

from __future__ import annotations

from kbs_process.campaign.documents import quoted
from kbs_process.campaign.modal_file import SIX
from kbs_process.plant.linear.modal import ModalTable


def modal_text(table: ModalTable) -> str:
    """Return a modal file that `read_modal` reads back to the last bit."""
    lines = [
        "#:schema modal.schema.json",
        "# Modes of the article on its transducer, of unit modal mass. shape: motion of the interface (3 x kg^-1/2,",
        "# 3 x rad kg^-1/2 m^-1); participation: momentum about T's origin for unit modal velocity (3 x kg^1/2,",
        "# 3 x kg^1/2 m), its squares the effective masses; gravity: change of the weight's wrench. Axes of T.",
        "schema = 1",
        f"joint = {quoted(table.joint)}",
        f"source = {quoted(table.source)}",
    ]
    for model in table.models:
        lines += ["", "[[pose]]", f'angle = {{ value = {model.angle!r}, unit = "rad" }}']
        for k in range(len(model.frequency)):
            lines += [
                "",
                "[[pose.mode]]",
                f"frequency_Hz = {float(model.frequency[k])!r}",
                f"frequency_sigma_Hz = {float(model.frequency_sigma[k])!r}",
                f"damping = {float(model.damping[k])!r}",
                f"damping_sigma = {float(model.damping_sigma[k])!r}",
                *(f"{name} = {[float(value) for value in getattr(model, name)[:, k]]}" for name in SIX),
            ]
    return "\n".join(lines) + "\n"
