"""Effects of scenes: a file for each effect, a folder for each job; kinds.py defines their declarations."""
