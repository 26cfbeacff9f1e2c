"""Recordings in and out, read a piece at a time, verified, and never trusted.

To read one of the project's own, an MCAP file, begin with `mcap/source`; to write one, with `mcap/writer`. A file in a
foreign format (CSV, Parquet, HDF5, ...) is opened by `open_table` as named columns; each format is one file in
`formats/`. What the columns mean to a campaign is none of this folder's business.
"""
