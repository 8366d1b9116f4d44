"""The effects a scene may call for: one file each, in a folder per job; kinds.py says what each may declare."""
