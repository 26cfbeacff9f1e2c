"""The proof bench: concealed effects, sealed truths, rivals, and one score for all of them."""
