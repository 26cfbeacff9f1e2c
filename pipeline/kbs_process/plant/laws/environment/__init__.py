"""What comes from outside: air, cords, cables that pull, what hangs on a link, the floor, the mounting."""
