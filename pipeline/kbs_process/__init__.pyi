from kbs_process.api import KbsError, Results, diagnose, identify, load_campaign, predict, process, read_table, simulate

__version__: str

__all__ = [
    "KbsError",
    "Results",
    "__version__",
    "diagnose",
    "identify",
    "load_campaign",
    "predict",
    "process",
    "read_table",
    "simulate",
]
