"""Modes of the article on its transducer, as files."""
