"""Odd campaigns: what a diagnosis may meet beside ordinary trials, and what it may say of it.

They are made of the parts that `proof.concealed` makes its trials of; cases.toml says what is odd in each.
"""
