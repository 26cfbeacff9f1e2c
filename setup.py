"""Lists the packages: those of pipeline/, and schemas/ as kbs_process.schemas. All else is in pyproject.toml."""

from setuptools import find_packages, setup

setup(
    packages=[*find_packages("pipeline"), "kbs_process.schemas"],
    package_dir={"": "pipeline", "kbs_process.schemas": "schemas"},
)
