"""The sections of reports, one module each; `documents` puts them in order."""
