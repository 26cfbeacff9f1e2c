"""A campaign's description: from the TOML files in its folder to frozen data that passed every check.

Begin with `load`: it reads the files (`documents`), checks each against its format (`formats`, which states keys,
types, bounds and units once), builds the rig (`rig_builder`), and sees whether the parts agree (`checks`). What comes
out is in `config`. `mission` and `modal_file` read two more files that a description may name; `writing` goes the other
way. Whatever is wrong is collected in `problems`, and told with file, line, key and remedy.
"""
