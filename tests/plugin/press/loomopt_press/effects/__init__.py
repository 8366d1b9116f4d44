"""Effects of the press: every file here is one."""
