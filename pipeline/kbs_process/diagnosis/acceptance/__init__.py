"""Is a candidate effect accepted?"""
