"""What remembers: friction before it slides, wires that rub, joints that slip."""
