"""What every study's results share: records, store, tables, provenance, work on all cores."""
