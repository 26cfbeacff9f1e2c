"""The flight model in orbit: many units, one trajectory."""
