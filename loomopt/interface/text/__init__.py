"""Tables, drawings and figures for people; they read, they never solve."""
