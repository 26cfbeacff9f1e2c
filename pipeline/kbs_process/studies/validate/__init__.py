"""Is a campaign complete and sound, and would processing take it?"""
