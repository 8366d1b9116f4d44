"""What people and programs see: Python, the command line, text, figures and files; never solves, knows no job."""
