"""Post-processor of SGIMP: from the results of a run to a report one can read."""

__version__ = "0.1.0"
