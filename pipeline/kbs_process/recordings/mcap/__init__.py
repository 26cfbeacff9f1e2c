"""MCAP files, from the bytes up.

`framing` and `container` find verified chunks, `streams` decodes the numbers wanted from their messages, `source` is a
whole file as all others see it; `writer` writes one, and reads it back.
"""
