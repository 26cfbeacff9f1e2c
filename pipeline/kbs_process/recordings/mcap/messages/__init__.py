"""Messages of MCAP files, in each encoding: decoded and encoded."""
