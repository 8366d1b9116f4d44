"""Interface: Python, the command line, text, figures and files. It does not solve and knows no job."""
