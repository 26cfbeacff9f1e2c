"""A campaign's files as the program writes them: parameter files with new numbers, corrected models, modal files."""
