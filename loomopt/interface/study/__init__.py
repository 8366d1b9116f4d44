"""Each study to work with: its result, its tables and its charts."""
