"""Print the catalogue of all laws: `python -m kbs_process.plant.laws > docs/catalogue.md`."""

from kbs_process.plant.laws.document import catalogue

print(catalogue(), end="")
