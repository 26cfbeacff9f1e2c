"""The report's sections, one module each; `catalogue.PANELS` is their order."""
